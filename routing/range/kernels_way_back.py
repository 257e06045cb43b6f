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

from energy.compiled.kernels_borrow import borrowed
from energy.force.kernels_physics import LinkPhysics, borrowed_physics, cabin_energy_j, road_at, road_in_time
from routing.kernels_heap import heap_drop, heap_push
from routing.links.kernels_stretch import LinkStretch, limit_drive, stretch_energy, stretch_to_end, stretch_to_rest
from routing.links.kernels_tables import HEIGHT, LIMIT, REST_J, REST_S, BorrowedLinks, LinkArrays, borrowed_links
from routing.range.kernels_entries import Entries, borrowed_entries

MERGED_MPS = 1e-3  # two drives that differ by less have met: for a car at 50 km/h that is 0.01 Wh

# columns of Homeward.number
NEED, COST, MOST, DURATION, COLD, REST_NEED, REST_COST, REST_MOST, REST_DURATION, REST_COLD, END, BEST = range(12)
LEG_TARGET, LEG_COST, LEG_DURATION, LEG_COLD, LEG_END = range(12, 17)
NUMBERS = 17
# values of Homeward.following below all labels
NONE, ARRIVED = -1, -2
# counters
PUSHED, SETTLED = range(2)
DONE, TOO_MANY, PAUSED = range(3)
PAUSE_LABELS = 8192  # settled before a search pauses, so that its caller may stop it


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
    """Places on links that are the same goal, (G,) each."""

    link: NDArray[np.int64]
    offset_m: NDArray[np.float64]


class ReverseArrays(NamedTuple):
    """All that a search back reads, and the labels that it writes."""

    links: LinkArrays
    physics: LinkPhysics
    rules: ReverseRules
    entries: Entries
    labels: Homeward
    goal: Goal


class BorrowedReverse(NamedTuple):
    """The same, borrowed."""

    links: BorrowedLinks
    physics: LinkPhysics
    rules: ReverseRules
    entries: Entries
    labels: Homeward
    goal: Goal


@njit(nogil=True, cache=True, inline="always")
def borrowed_reverse(a: ReverseArrays) -> BorrowedReverse:
    """The same with borrowed arrays."""
    h = a.labels
    return BorrowedReverse(
        borrowed_links(a.links),
        borrowed_physics(a.physics),
        a.rules,
        borrowed_entries(a.entries),
        Homeward(
            borrowed(h.number),
            borrowed(h.following),
            borrowed(h.settled),
            borrowed(h.heap_key),
            borrowed(h.heap_label),
            borrowed(h.counter),
        ),
        Goal(borrowed(a.goal.link), borrowed(a.goal.offset_m)),
    )


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
def chained(p: LinkPhysics, first: Passage, second: Passage) -> Passage:
    """The passage of a stretch and the one after it.

    A battery that is full between the two takes nothing ahead for a cold start, which then counts in full.
    """
    start = second.cold_j + starting_climate_j(p, second.duration_s)
    need = max(first.need_j, second.need_j + first.cost_j) if second.need_j + start <= first.most_j else math.inf
    most = min(second.most_j, first.most_j - second.cost_j - start)
    cold = first.cold_j
    if second.cold_j > 0.0:
        cold += math.exp(-first.duration_s / p.tyre_time_s) * second.cold_j
    return Passage(need, first.cost_j + second.cost_j, most, first.duration_s + second.duration_s, cold)


@njit(nogil=True, cache=True)
def drive(b: BorrowedReverse, link: int, s: LinkStretch, v: float, stopped: float) -> tuple[Passage, float]:
    """The passage of a stretch of a link, and the go-speed at its end.

    Cold tyres count by the chord of their effect, which is convex in the resistance: never too little.
    """
    p, roads = b.physics, b.links.roads
    road = road_at(roads, link)
    e, t, end = stretch_energy(p, road, s, v, stopped)
    cold = 0.0
    if p.tyre_time_s > 0.0:
        at_once = road_in_time(p, roads, link, 0.0, 0.0)
        warming = road_in_time(p, roads, link, 0.0, s.length_m / s.limit_mps)
        raised = at_once.rolling_n - road.rolling_n
        if raised > 0.0:
            whole, _, _ = stretch_energy(p, at_once, s, v, stopped)
            cold = max(whole - e, 0.0) * (warming.rolling_n - road.rolling_n) / raised
    return leg(b.rules, e + p.cabin_w * t, t, cold), end


@njit(nogil=True, cache=True)
def drive_on(
    b: BorrowedReverse, link: int, begin_m: float, v: float, stopped: float, target: float
) -> tuple[Passage, float]:
    """The passage of a link from begin_m to its end, where target is the wanted go-speed, and the go-speed there."""
    p, row = b.physics, b.links.row
    v_max = row[link, LIMIT]
    if target == v_max and begin_m == 0.0 and p.tyre_time_s == 0.0:
        from_rest = row[link, REST_S] >= 0.0
        if v == 0.0 and from_rest:
            return leg(b.rules, row[link, REST_J] + p.cabin_w * row[link, REST_S], row[link, REST_S], 0.0), v_max
        if v == v_max and (stopped == 0.0 or from_rest):
            e, t = limit_drive(row, link, stopped)
            return leg(b.rules, e + p.cabin_w * t, t, 0.0), v_max
    return drive(b, link, stretch_to_end(row, b.links.roads, link, begin_m, target), v, stopped)


@njit(nogil=True, cache=True)
def drive_in(b: BorrowedReverse, link: int, begin_m: float, v: float, stopped: float) -> tuple[bool, Passage]:
    """Whether the goal lies ahead on a link, and the passage to it."""
    goal = b.goal
    for k in range(goal.link.size):
        if goal.link[k] == link and goal.offset_m[k] > begin_m:
            there, _ = drive(b, link, stretch_to_rest(b.links.row, link, begin_m, goal.offset_m[k]), v, stopped)
            return True, there
    return False, Passage(math.inf, math.inf, -math.inf, 0.0, 0.0)


@njit(nogil=True, cache=True)
def passage_at(number: NDArray[np.float64], label: int, column: int) -> Passage:
    """The passage that a label holds from a column on."""
    n = number[label]
    return Passage(n[column], n[column + 1], n[column + 2], n[column + 3], n[column + 4])


@njit(nogil=True, cache=True)
def way_on(b: BorrowedReverse, label: int, v: float) -> Passage:
    """The passage from a label's link to the goal, entered at speed v: driven on until the speeds have met."""
    p, e, h = b.physics, b.entries, b.labels
    way = passage_at(h.number, label, NEED)
    begun = False
    while abs(v - e.speed_mps[label]) > MERGED_MPS and e.stopped_frac[label] < 1.0:
        link, stopped, following = int64_of(e.link[label]), e.stopped_frac[label], int64_of(h.following[label])
        if following == ARRIVED:
            _, last = drive_in(b, link, 0.0, v, stopped)
            return chained(p, way, last) if begun else last
        target = min(b.links.row[link, LIMIT], b.links.row[e.link[following], LIMIT])
        this, v = drive_on(b, link, 0.0, v, stopped, target)
        way = chained(p, way, this) if begun else this
        begun = True
        if abs(v - h.number[label, END]) <= MERGED_MPS:
            return chained(p, way, passage_at(h.number, label, REST_NEED))
        label = following
    if not begun:
        return way
    return chained(p, way, passage_at(h.number, label, NEED))


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
def offer(b: BorrowedReverse, label: int, following: int, end: float, way: Passage, rest: Passage) -> None:
    """Give a label a way to the goal if it is the best one so far, and put it into the heap."""
    p, r, e, h = b.physics, b.rules, b.entries, b.labels
    value = worth(r, way)
    if not value < h.number[label, BEST]:
        return
    link, v = e.link[label], e.speed_mps[label]
    height, v_max = b.links.row[link, HEIGHT], b.links.row[link, LIMIT]
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
def own_leg(b: BorrowedReverse, label: int, successor: int) -> tuple[Passage, float]:
    """The passage of a label's link towards a successor, from the label if it was last driven towards such a limit."""
    e = b.entries
    link = int64_of(e.link[label])
    target = min(b.links.row[link, LIMIT], b.links.row[successor, LIMIT])
    n = b.labels.number[label]
    if n[LEG_TARGET] == target:
        return leg(b.rules, n[LEG_COST], n[LEG_DURATION], n[LEG_COLD]), n[LEG_END]
    this, end = drive_on(b, link, 0.0, e.speed_mps[label], e.stopped_frac[label], target)
    n[LEG_TARGET], n[LEG_COST], n[LEG_DURATION] = target, this.cost_j, this.duration_s
    n[LEG_COLD], n[LEG_END] = this.cold_j, end
    return this, end


@njit(nogil=True, cache=True)
def search_back(arrays: ReverseArrays) -> int:
    """Settle labels from the goal backwards in the order of their reduced cost; TOO_MANY beyond the label limit.

    Returns PAUSED after PAUSE_LABELS, to be called again for the rest.

    Precondition: reduced costs are not negative. A settled label is never changed, so that each label's passage is
    that of driving along its chain of next labels, whatever the order. O(L log L) for L labels pushed. Ties: the first
    stays.
    """
    b = borrowed_reverse(arrays)
    e, h, goal = b.entries, b.labels, b.goal
    nothing = Passage(0.0, 0.0, math.inf, 0.0, 0.0)
    begun = h.counter[SETTLED] > 0
    for k in range(0 if begun else goal.link.size):
        for label in range(e.first[goal.link[k]], e.first[goal.link[k] + 1]):
            _, way = drive_in(b, goal.link[k], 0.0, e.speed_mps[label], e.stopped_frac[label])
            offer(b, label, int64_of(ARRIVED), 0.0, way, nothing)
    pause = h.counter[SETTLED] + PAUSE_LABELS
    while h.counter[PUSHED] > 0:
        if h.counter[SETTLED] == pause:
            return PAUSED
        label = int64_of(h.heap_label[0])
        heap_drop(h.heap_key, h.heap_label, h.counter[PUSHED])
        h.counter[PUSHED] -= 1
        if h.settled[label]:
            continue
        h.settled[label] = True
        h.counter[SETTLED] += 1
        if h.counter[SETTLED] > b.rules.label_limit:
            return TOO_MANY
        link = e.link[label]
        for at in range(e.before_first[link], e.before_first[link + 1]):
            before = e.before[at]
            for other in range(e.first[before], e.first[before + 1]):
                if h.settled[other] or e.turn[e.turn_first[other] + e.before_turn[at]] != label:
                    continue
                this, end = own_leg(b, other, link)
                rest = way_on(b, label, end)
                offer(b, other, label, end, chained(b.physics, this, rest), rest)
    return DONE
