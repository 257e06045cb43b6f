"""The compiled search back from a goal: from every road, the way there that takes least, driven as it would be.

A label is a link with a state in which it is entered (`Entries`). It holds what the way on takes from that very state
(`Passage`), and which label comes next. Drives that enter the link at nearly that speed take the same way.
docs/search.md has what is exact in this and what is not.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from energy.chain.kernels_link import link_energy
from energy.force.kernels_physics import ROAD_WAIT, LinkPhysics, cabin_energy_j, road_at, road_in_time
from routing.kernels_heap import heap_drop, heap_push
from routing.links.kernels_tables import CRUISE_J, CRUISE_S, REST_J, REST_S, LinkArrays
from routing.range.kernels_entries import Entries

MERGED_MPS = 1e-3  # two drives that differ by less have met: for a car at 50 km/h that is 0.01 Wh

# columns of Homeward.number
NEED, COST, MOST, DURATION, COLD, REST_NEED, REST_COST, REST_MOST, REST_DURATION, REST_COLD, END, BEST = range(12)
LEG_TARGET, LEG_COST, LEG_DURATION, LEG_COLD, LEG_END = range(12, 17)
NUMBERS = 17
# values of Homeward.following below all labels
NONE, ARRIVED = -1, -2
# counters
PUSHED, SETTLED = range(2)
DONE, TOO_MANY = range(2)


class Passage(NamedTuple):
    """What a stretch takes of a charge c [J]: with at least need_j on board, min(c − cost_j, most_j) is left.

    duration_s: time for it. cost_j holds climate at its steady power and warm tyres. cold_j: what tyres add that are as
    cold as at departure where the stretch begins. need_j and cost_j rise by it and by the climate's start where a drive
    begins here; most_j holds both.
    """

    need_j: float
    cost_j: float
    most_j: float
    duration_s: float
    cold_j: float


class Homeward(NamedTuple):
    """Labels of one search, one for each entry: K of them.

    number: (K, 17), columns as above: the passage from here to the goal, that from the next label on, the speed at the
    link's end, what the search compares; then its own link as last driven, and towards which limit. following: (K,) the
    next label. settled: (K,).
    """

    number: NDArray[np.float64]
    following: NDArray[np.int32]
    settled: NDArray[np.bool_]
    heap_key: NDArray[np.float64]
    heap_label: NDArray[np.int32]
    counter: NDArray[np.int64]


class ReverseRules(NamedTuple):
    """Of a search back to a goal.

    reserve_j, full_j: charge that is never gone below, and that fills the battery. accepting_j: charge up to which the
    battery takes all that is recuperated. held: whether the least charge at departure is looked for that leaves left_j
    at the goal; otherwise the least energy, without limits. bound_j: nothing beyond it is wanted. gain_n: the most that
    a metre of height gives back [J/m]. highest_m: of all nodes.
    """

    reserve_j: float
    full_j: float
    accepting_j: float
    held: bool
    left_j: float
    bound_j: float
    alpha: float
    gain_n: float
    highest_m: float
    half_inertia_kg: float
    label_limit: int


class Goal(NamedTuple):
    """Places on links that are one and the same goal, (G,) each."""

    link: NDArray[np.int64]
    offset_m: NDArray[np.float64]


@njit(nogil=True, cache=True)
def int64_of(number: int) -> int:
    """A link or label of whatever type: kernels that are called with one type only are compiled once."""
    return int(np.int64(number))


@njit(nogil=True, cache=True)
def leg(r: ReverseRules, cost: float, duration_s: float, cold_j: float) -> Passage:
    """The passage of one link; where more is recuperated than taken, the battery is filled to accepting_j at most."""
    most = r.full_j if cost >= 0.0 else r.accepting_j
    return Passage(max(r.reserve_j, r.reserve_j + cost), cost, most, duration_s, cold_j)


@njit(nogil=True, cache=True)
def starting_climate_j(p: LinkPhysics, duration_s: float) -> float:
    """What climate takes beyond its steady power in the time since departure [J]."""
    if p.cabin_start_w == 0.0:
        return 0.0
    return cabin_energy_j(p, 0.0, duration_s) - p.cabin_w * duration_s


@njit(nogil=True, cache=True)
def chained(p: LinkPhysics, one: Passage, two: Passage) -> Passage:
    """The passage of a stretch and the one after it.

    A battery that is full between the two takes nothing ahead for a cold start, which then counts in full.
    """
    start = two.cold_j + starting_climate_j(p, two.duration_s)
    need = max(one.need_j, two.need_j + one.cost_j) if two.need_j + start <= one.most_j else math.inf
    most = min(two.most_j, one.most_j - two.cost_j - start)
    cold = one.cold_j
    if two.cold_j > 0.0:
        cold += math.exp(-one.duration_s / p.tyre_time_s) * two.cold_j
    return Passage(need, one.cost_j + two.cost_j, most, one.duration_s + two.duration_s, cold)


@njit(nogil=True, cache=True)
def drive(
    g: LinkArrays,
    p: LinkPhysics,
    r: ReverseRules,
    link: int,
    begin_m: float,
    end_m: float,
    v: float,
    stopped: float,
    target: float,
    p_stop: float,
    wait: float,
) -> tuple[Passage, float]:
    """The passage of a link from begin_m to end_m, and the go-speed at its end.

    Cold tyres count by the chord of their effect, which is convex in the resistance: never too little.
    """
    v_max = g.speed_limit_mps[link]
    ds = end_m - begin_m
    road = road_at(g.roads, link)
    e, t, end = link_energy(p, road, ds, v, stopped, v_max, target, p_stop, wait)
    cold = 0.0
    if p.tyre_time_s > 0.0:
        at_once = road_in_time(p, g.roads, link, 0.0, 0.0)
        warming = road_in_time(p, g.roads, link, 0.0, ds / v_max)
        raised = at_once.rolling_n - road.rolling_n
        if raised > 0.0:
            whole, _, _ = link_energy(p, at_once, ds, v, stopped, v_max, target, p_stop, wait)
            cold = max(whole - e, 0.0) * (warming.rolling_n - road.rolling_n) / raised
    return leg(r, e + p.cabin_w * t, t, cold), end


@njit(nogil=True, cache=True)
def drive_on(
    g: LinkArrays, p: LinkPhysics, r: ReverseRules, link: int, begin_m: float, v: float, stopped: float, target: float
) -> tuple[Passage, float]:
    """The passage of a link from begin_m to its end, where target is the wanted go-speed, and the go-speed there."""
    here = g.row[link]
    v_max = g.speed_limit_mps[link]
    if target == v_max and begin_m == 0.0 and p.tyre_time_s == 0.0 and (v == v_max or v == 0.0):
        if v == 0.0:
            if here[REST_S] >= 0.0:
                return leg(r, here[REST_J] + p.cabin_w * here[REST_S], here[REST_S], 0.0), v_max
        elif stopped == 0.0:
            return leg(r, here[CRUISE_J] + p.cabin_w * here[CRUISE_S], here[CRUISE_S], 0.0), v_max
        elif here[REST_S] >= 0.0:
            e = here[CRUISE_J] + stopped * (here[REST_J] - here[CRUISE_J])
            t = here[CRUISE_S] + stopped * (here[REST_S] - here[CRUISE_S])
            return leg(r, e + p.cabin_w * t, t, 0.0), v_max
    p_stop, wait = g.stop_probability_frac[link], g.roads[link, ROAD_WAIT]
    return drive(g, p, r, link, begin_m, g.length_m[link], v, stopped, target, p_stop, wait)


@njit(nogil=True, cache=True)
def drive_in(
    g: LinkArrays, p: LinkPhysics, r: ReverseRules, goal: Goal, link: int, begin_m: float, v: float, stopped: float
) -> tuple[bool, Passage]:
    """Whether the goal lies ahead on a link, and the passage to it."""
    for k in range(goal.link.size):
        if goal.link[k] == link and goal.offset_m[k] > begin_m:
            limit = g.speed_limit_mps[link]
            there, _ = drive(g, p, r, link, begin_m, goal.offset_m[k], v, stopped, limit, 1.0, 0.0)
            return True, there
    return False, Passage(math.inf, math.inf, -math.inf, 0.0, 0.0)


@njit(nogil=True, cache=True)
def passage_at(number: NDArray[np.float64], label: int, column: int) -> Passage:
    """The passage that a label holds from a column on."""
    n = number[label]
    return Passage(n[column], n[column + 1], n[column + 2], n[column + 3], n[column + 4])


@njit(nogil=True, cache=True)
def way_on(
    g: LinkArrays, p: LinkPhysics, r: ReverseRules, e: Entries, h: Homeward, goal: Goal, label: int, v: float
) -> Passage:
    """The passage from a label's link to the goal, entered at speed v: driven on until the speeds have met."""
    one = passage_at(h.number, label, NEED)
    begun = False
    while abs(v - e.speed_mps[label]) > MERGED_MPS and e.stopped_frac[label] < 1.0:
        link, stopped, following = int64_of(e.link[label]), e.stopped_frac[label], int64_of(h.following[label])
        if following == ARRIVED:
            _, last = drive_in(g, p, r, goal, link, 0.0, v, stopped)
            return chained(p, one, last) if begun else last
        target = min(g.speed_limit_mps[link], g.speed_limit_mps[e.link[following]])
        this, v = drive_on(g, p, r, link, 0.0, v, stopped, target)
        one = chained(p, one, this) if begun else this
        begun = True
        if abs(v - h.number[label, END]) <= MERGED_MPS:
            return chained(p, one, passage_at(h.number, label, REST_NEED))
        label = following
    if not begun:
        return one
    return chained(p, one, passage_at(h.number, label, NEED))


@njit(nogil=True, cache=True)
def worth(r: ReverseRules, way: Passage) -> float:
    """What the search makes least: the energy, or the charge at departure that leaves left_j; inf where none does."""
    cost = way.cost_j + way.cold_j
    if not r.held:
        return cost
    if way.need_j == math.inf or r.left_j > way.most_j:
        return math.inf
    return max(way.need_j + way.cold_j, r.left_j + cost)


@njit(nogil=True, cache=True)
def offer(
    g: LinkArrays,
    p: LinkPhysics,
    r: ReverseRules,
    e: Entries,
    h: Homeward,
    label: int,
    following: int,
    end: float,
    way: Passage,
    rest: Passage,
) -> None:
    """Give a label a way to the goal if it is the best one so far, and put it into the heap."""
    value = worth(r, way)
    if not value < h.number[label, BEST]:
        return
    link, v = e.link[label], e.speed_mps[label]
    height, v_max = g.tail_height_m[link], g.speed_limit_mps[link]
    faster_j = p.drive_factor * r.half_inertia_kg * (v_max * v_max - v * v)
    if value - r.gain_n * (r.highest_m - height) - faster_j > r.bound_j:
        return  # not even from the highest place, for one of those that share the label and enter faster
    n = h.number[label]
    n[NEED], n[COST], n[MOST], n[DURATION], n[COLD] = way
    n[REST_NEED], n[REST_COST], n[REST_MOST], n[REST_DURATION], n[REST_COLD] = rest
    n[END], n[BEST] = end, value
    h.following[label] = following
    kinetic = r.half_inertia_kg * (1.0 - e.stopped_frac[label]) * v * v
    key = value + r.alpha * (p.weight_n * height + kinetic)
    heap_push(h.heap_key, h.heap_label, h.counter[PUSHED], key, label)
    h.counter[PUSHED] += 1


@njit(nogil=True, cache=True)
def own_leg(
    g: LinkArrays, p: LinkPhysics, r: ReverseRules, e: Entries, h: Homeward, label: int, successor: int
) -> tuple[Passage, float]:
    """The passage of a label's link towards a successor, from the label if it was last driven towards such a limit."""
    link = int64_of(e.link[label])
    target = min(g.speed_limit_mps[link], g.speed_limit_mps[successor])
    n = h.number[label]
    if n[LEG_TARGET] == target:
        return leg(r, n[LEG_COST], n[LEG_DURATION], n[LEG_COLD]), n[LEG_END]
    this, end = drive_on(g, p, r, link, 0.0, e.speed_mps[label], e.stopped_frac[label], target)
    n[LEG_TARGET], n[LEG_COST], n[LEG_DURATION] = target, this.cost_j, this.duration_s
    n[LEG_COLD], n[LEG_END] = this.cold_j, end
    return this, end


@njit(nogil=True, cache=True)
def search_back(g: LinkArrays, p: LinkPhysics, r: ReverseRules, e: Entries, h: Homeward, goal: Goal) -> int:
    """Settle labels from the goal backwards in the order of their reduced cost; TOO_MANY beyond the label limit.

    Precondition: reduced costs are not negative. A settled label is never changed, so that each label's passage is
    that of driving along its chain of next labels, whatever the order. O(L log L) for L labels pushed. Ties: the first
    stays.
    """
    nothing = Passage(0.0, 0.0, math.inf, 0.0, 0.0)
    for k in range(goal.link.size):
        for label in range(e.first[goal.link[k]], e.first[goal.link[k] + 1]):
            _, way = drive_in(g, p, r, goal, goal.link[k], 0.0, e.speed_mps[label], e.stopped_frac[label])
            offer(g, p, r, e, h, label, int64_of(ARRIVED), 0.0, way, nothing)
    while h.counter[PUSHED] > 0:
        label = int64_of(h.heap_label[0])
        heap_drop(h.heap_key, h.heap_label, h.counter[PUSHED])
        h.counter[PUSHED] -= 1
        if h.settled[label]:
            continue
        h.settled[label] = True
        h.counter[SETTLED] += 1
        if h.counter[SETTLED] > r.label_limit:
            return TOO_MANY
        link = e.link[label]
        for at in range(e.before_first[link], e.before_first[link + 1]):
            before = e.before[at]
            for other in range(e.first[before], e.first[before + 1]):
                if h.settled[other] or e.turn[e.turn_first[other] + e.before_turn[at]] != label:
                    continue
                this, end = own_leg(g, p, r, e, h, other, link)
                rest = way_on(g, p, r, e, h, goal, label, end)
                offer(g, p, r, e, h, other, label, end, chained(p, this, rest), rest)
    return DONE
