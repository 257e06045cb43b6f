"""Compiled: the graph of all states in which links are entered, from a start."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from energy.compiled.kernels_borrow import borrowed
from energy.force.kernels_physics import ROAD_GRADE, LinkPhysics, Road, borrowed_physics, road_at
from routing.links.kernels_stretch import LinkStretch, stretch_energy, stretch_to_end, stretch_to_rest
from routing.links.kernels_tables import CRUISE_S, HEIGHT, LIMIT, STOP, BorrowedLinks, LinkArrays, borrowed_links

GOAL = 0  # the state of having arrived
LEVEL_MPS = 1.0  # least speeds of shared states are multiples of it
# columns of StateGraph.number
ENTRY_MPS, STOPPED, OFFSET, POTENTIAL = range(4)
# counters of StateGraph
STATES, ARCS, SHARED, NEGATIVE, EXPANDED = range(5)
NEGATIVE_J = 1e-3  # more than rounding
DONE, FULL, PAUSED = range(3)
PAUSE_STATES = 65_536  # expanded before expand pauses, so that its caller may stop it


class StateGraph(NamedTuple):
    """States and the drives between them; room for S states and A arcs.

    link: (S,). number: (S, 4), columns as above: entry speed [m/s], or -1 less the least one where entries share the
    state; probability of having stopped, offset on the link [m], potential [J]. earlier: (S,), the state of the same
    link made before it, -1 for none. first: (S + 1,), the arcs of state k are first[k]..first[k + 1]. head: (A,) the
    state that an arc leads to. energy_j: (A,) without climate, less the gain in potential, ≥ 0. time_s: (A,).
    counter: (5,).
    """

    link: NDArray[np.int32]
    number: NDArray[np.float64]
    earlier: NDArray[np.int32]
    first: NDArray[np.int64]
    head: NDArray[np.int32]
    energy_j: NDArray[np.float64]
    time_s: NDArray[np.float64]
    counter: NDArray[np.int64]


class StateRules(NamedTuple):
    """Of the graph of states: share of the potential, half the inertia [kg], and the most states of a link.

    Beyond these entries share states.
    """

    alpha: float
    half_inertia_kg: float
    most: int


class Ends(NamedTuple):
    """Where ways begin and end: link and offset [m] of each place, (n, 2) each."""

    starts: NDArray[np.float64]
    goals: NDArray[np.float64]


@njit(nogil=True, cache=True, inline="always")
def borrowed_state_graph(sg: StateGraph) -> StateGraph:
    """The same graph with borrowed arrays."""
    return StateGraph(
        borrowed(sg.link),
        borrowed(sg.number),
        borrowed(sg.earlier),
        borrowed(sg.first),
        borrowed(sg.head),
        borrowed(sg.energy_j),
        borrowed(sg.time_s),
        borrowed(sg.counter),
    )


@njit(nogil=True, cache=True)
def shared_level(speed: float) -> float:
    """The entry speed of the shared state for a speed that is not known but by its least value [m/s]."""
    return -1.0 - math.floor(speed / LEVEL_MPS) * LEVEL_MPS


@njit(nogil=True, cache=True)
def state_at(
    sg: StateGraph, latest: NDArray[np.int32], link: int, speed: float, stopped: float, most: int, potential_j: float
) -> int:
    """The state of a link with this entry, made if it is new; beyond most states of a link the rest are shared ones.

    speed: as in StateGraph.number. The caller sees to room.
    """
    for _ in range(2):
        count = 0
        state: int = latest[link]
        while state >= 0:
            if sg.number[state, ENTRY_MPS] == speed and sg.number[state, STOPPED] == stopped:
                return state
            if sg.number[state, ENTRY_MPS] >= 0.0:
                count += 1
            state = sg.earlier[state]
        if speed < 0.0 or count < most:
            break
        speed = shared_level(speed)
    made = sg.counter[STATES]
    sg.counter[STATES] = made + 1
    if speed < 0.0:
        sg.counter[SHARED] += 1
    sg.link[made], sg.earlier[made] = link, latest[link]
    sg.number[made, ENTRY_MPS], sg.number[made, STOPPED] = speed, stopped
    sg.number[made, OFFSET], sg.number[made, POTENTIAL] = 0.0, potential_j
    latest[link] = made
    return int(made)


@njit(nogil=True, cache=True)
def add_arc(sg: StateGraph, head: int, reduced_j: float, time: float) -> None:
    """One more arc of the state that is being driven on from; reduced energies below 0 by rounding count as 0."""
    arc = sg.counter[ARCS]
    sg.counter[ARCS] = arc + 1
    sg.head[arc], sg.energy_j[arc], sg.time_s[arc] = head, max(reduced_j, 0.0), time
    if reduced_j < -NEGATIVE_J:
        sg.counter[NEGATIVE] += 1


@njit(nogil=True, cache=True, inline="always")
def potential_j(p: LinkPhysics, g: BorrowedLinks, alpha: float, link: int, offset: float) -> float:
    """The potential of being at rest on a link."""
    height: float = g.row[link, HEIGHT] + g.roads[link, ROAD_GRADE] * offset
    return alpha * p.weight_n * height


@njit(nogil=True, cache=True, inline="always")
def place_state(sg: StateGraph, state: int, link: int, offset: float, potential_j: float) -> None:
    """Write the state of being at rest on a link."""
    sg.link[state], sg.earlier[state] = link, -1
    sg.number[state, ENTRY_MPS], sg.number[state, STOPPED], sg.number[state, OFFSET] = 0.0, 0.0, offset
    sg.number[state, POTENTIAL] = potential_j


@njit(nogil=True, cache=True)
def least_load_n(r: Road, low: float, high: float) -> float:
    """A road load that none at a speed between two is below [N], ≥ 0: each of its terms at its least."""
    air = low + r.wind_mps
    linear = r.linear_n_per_mps * (low if r.linear_n_per_mps > 0.0 else high)
    return max(r.rolling_n + linear + r.aero_n_per_mps2 * air * abs(air), 0.0)


@njit(nogil=True, cache=True)
def shared_drive(
    p: LinkPhysics, rules: StateRules, road: Road, s: LinkStretch, least_mps: float, stopped: float
) -> tuple[float, float, float]:
    """Least reduced energy [J] and time [s] of a link over all entries at least_mps or more, and its end's entry speed.

    The last is as in StateGraph.number: that of the next link, certain where even the slowest drive reaches target. No
    drive is faster than the limit, and none takes less than its gain in potential and alpha times the road load.
    """
    v_max, target, p_stop, wait = s.limit_mps, s.target_mps, s.stop_frac, s.wait_s
    time = s.length_m / v_max
    reduced = 0.0
    end2 = target * target
    if not p.table:
        slowest = min(least_mps, target) if p_stop == 0.0 else 0.0
        reduced = rules.alpha * least_load_n(road, slowest, v_max) * s.length_m + p.aux_move_w * time
        accel = math.inf
        for k in range(p.accel_sum.size - 1):
            if p.speed_bound_mps[k] < v_max and (p.speed_bound_mps[k + 1] > least_mps or k == p.accel_sum.size - 2):
                accel = min(accel, p.accel_sum[k + 1] - p.accel_sum[k])
        end2 = min(end2, least_mps * least_mps + 2.0 * accel * s.length_m)
    time *= 1.0 - stopped
    time += p_stop * wait
    if stopped > 0.0:
        e, t, end = stretch_energy(p, road, s, 0.0, 0.0)
        gain = rules.half_inertia_kg * (1.0 - p_stop) * end * end + p.weight_n * road.grade * s.length_m
        reduced += stopped * (max(e - rules.alpha * gain, 0.0) - reduced)
        time += stopped * (t - p_stop * wait)
        end2 += stopped * (end * end - end2)
    if end2 >= target * target:
        return reduced, time, target
    return reduced, time, shared_level(math.sqrt(end2))


@njit(nogil=True, cache=True)
def expand(
    g: LinkArrays,
    p: LinkPhysics,
    rules: StateRules,
    ends: Ends,
    allowed: NDArray[np.bool_],
    latest: NDArray[np.int32],
    sg: StateGraph,
) -> int:
    """Every state that a drive from rest at a start can be in, on allowed links, and every drive between two of them.

    latest: (M,), -1 before the first call. State 0 is the goal at rest, the next ones are the starts. Returns FULL
    where states or arcs have no room, and PAUSED after PAUSE_STATES, to be called again for the rest.
    """
    p, links, sg = borrowed_physics(p), borrowed_links(g), borrowed_state_graph(sg)
    starts, goals, allowed, latest = borrowed(ends.starts), borrowed(ends.goals), borrowed(allowed), borrowed(latest)
    alpha = rules.alpha
    if sg.counter[STATES] == 0:
        place, offset = int(goals[0, 0]), goals[0, 1]
        place_state(sg, GOAL, place, offset, potential_j(p, links, alpha, place, offset))
        for k in range(starts.shape[0]):
            place, offset = int(starts[k, 0]), starts[k, 1]
            place_state(sg, 1 + k, place, offset, potential_j(p, links, alpha, place, offset))
        sg.counter[STATES] = 1 + starts.shape[0]
        sg.counter[EXPANDED] = 1
        sg.first[0] = sg.first[1] = 0
    for _ in range(PAUSE_STATES):
        state = sg.counter[EXPANDED]
        if state == sg.counter[STATES]:
            return DONE
        link = sg.link[state]
        turns = links.successor_first[link + 1] - links.successor_first[link]
        if sg.counter[STATES] + turns + 1 > sg.link.size or sg.counter[ARCS] + turns + goals.shape[0] > sg.head.size:
            return FULL
        v, stopped, offset = sg.number[state, ENTRY_MPS], sg.number[state, STOPPED], sg.number[state, OFFSET]
        before_j = sg.number[state, POTENTIAL]
        road = road_at(links.roads, link)
        for k in range(goals.shape[0]):
            if goals[k, 0] == link and goals[k, 1] > offset:
                stretch = stretch_to_rest(links.row, link, offset, goals[k, 1])
                if v < 0.0:
                    e, t, _ = shared_drive(p, rules, road, stretch, -1.0 - v, stopped)
                else:
                    e, t, _ = stretch_energy(p, road, stretch, v, stopped)
                    e += before_j - potential_j(p, links, alpha, link, goals[k, 1])
                add_arc(sg, GOAL, e, t)
        p_stop = links.row[link, STOP]
        known = -1.0
        e, t, end = 0.0, 0.0, 0.0
        for k in range(links.successor_first[link], links.successor_first[link + 1]):
            successor = links.successor[k]
            if not allowed[successor]:
                continue
            target = max(min(links.row[link, LIMIT], links.row[successor, LIMIT]), 0.0)
            if links.row[link, LIMIT] < 0.0:  # on board
                after_j = alpha * p.weight_n * links.row[successor, HEIGHT]
                add_arc(
                    sg,
                    state_at(sg, latest, successor, 0.0, p_stop, rules.most, after_j),
                    0.0,
                    links.row[link, CRUISE_S],
                )
                continue
            if target != known:
                known = target
                stretch = stretch_to_end(links.row, links.roads, link, offset, target)
                if v < 0.0:
                    e, t, end = shared_drive(p, rules, road, stretch, -1.0 - v, stopped)
                else:
                    e, t, end = stretch_energy(p, road, stretch, v, stopped)
            kinetic = rules.half_inertia_kg * (1.0 - p_stop) * max(end, 0.0) ** 2
            after_j = alpha * (p.weight_n * links.row[successor, HEIGHT] + kinetic)
            to = state_at(sg, latest, successor, end, p_stop, rules.most, after_j)
            add_arc(sg, to, e if v < 0.0 else e + before_j - after_j, t)
        sg.first[state + 1] = sg.counter[ARCS]
        sg.counter[EXPANDED] = state + 1
    return PAUSED
