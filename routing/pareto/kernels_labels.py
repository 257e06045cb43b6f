"""Compiled: all ways between two places as paths of a graph of states, and the paths best in time or energy.

A state is (link, entry speed, probability of having stopped). Without tyres that warm up, what a state's link takes
towards a successor is always the same, so that ways are paths with two costs on each arc. Where too many states crowd
on a link the rest share states of which only a least speed is known. docs/pareto.md has the proofs.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from energy.chain.kernels_link import link_energy
from energy.force.kernels_physics import ROAD_WAIT, LinkPhysics, Road, cabin_energy_j, road_at
from routing.pareto.kernels_sums import drop, push
from routing.search.kernels_search import LinkArrays

GOAL = 0  # the state of having arrived
LEVEL_MPS = 1.0  # least speeds of shared states are multiples of it
# columns of StateGraph.number
ENTRY_MPS, STOPPED, OFFSET, POTENTIAL = range(4)
# counters of StateGraph
STATES, ARCS, SHARED, NEGATIVE = range(4)
NEGATIVE_J = 1e-3  # more than rounding
# counters of Labels
MADE, SETTLED, POINTS, SOLUTIONS = range(4)

DONE, FULL = range(2)


class StateGraph(NamedTuple):
    """States and the drives between them; room for S states and A arcs.

    link: (S,). number: (S, 4), columns as above: entry speed [m/s], or -1 less the least one where entries share the
    state; probability of having stopped, offset on the link [m], potential [J]. earlier: (S,), the state of the same
    link made before it, -1 for none. first: (S + 1,), the arcs of state k are first[k]..first[k + 1]. head: (A,) the
    state that an arc leads to. energy_j: (A,) without climate, less the gain in potential, ≥ 0. time_s: (A,).
    counter: (4,).
    """

    link: NDArray[np.int32]
    number: NDArray[np.float64]
    earlier: NDArray[np.int32]
    first: NDArray[np.int64]
    head: NDArray[np.int32]
    energy_j: NDArray[np.float64]
    time_s: NDArray[np.float64]
    counter: NDArray[np.int64]


class Labels(NamedTuple):
    """Labels of one search, room for L of them, and the points (time, energy) that ways are compared with, room for C.

    state, parent: (L,). time_s, energy_j: (L,), so far. key_s, key_j, item: (L,) of the heap. point_s: (C,) ascending;
    point_j: (C,) the least energy of the points up to there. solution: (C,) labels that arrived. counter: (4,).
    """

    state: NDArray[np.int32]
    parent: NDArray[np.int32]
    time_s: NDArray[np.float64]
    energy_j: NDArray[np.float64]
    key_s: NDArray[np.float64]
    key_j: NDArray[np.float64]
    item: NDArray[np.int32]
    point_s: NDArray[np.float64]
    point_j: NDArray[np.float64]
    solution: NDArray[np.int32]
    counter: NDArray[np.int64]


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


@njit(nogil=True, cache=True)
def place_state(
    g: LinkArrays, p: LinkPhysics, alpha: float, sg: StateGraph, state: int, link: int, offset: float
) -> None:
    """Write the state of being at rest on a link."""
    sg.link[state], sg.earlier[state] = link, -1
    sg.number[state, ENTRY_MPS], sg.number[state, STOPPED], sg.number[state, OFFSET] = 0.0, 0.0, offset
    height = g.tail_height_m[link] + g.grade_frac[link] * offset
    sg.number[state, POTENTIAL] = alpha * p.weight_n * height


@njit(nogil=True, cache=True)
def least_load_n(r: Road, low: float, high: float) -> float:
    """A road load that none at a speed between two is below [N], ≥ 0: each of its terms at its least."""
    air = low + r.wind_mps
    linear = r.linear_n_per_mps * (low if r.linear_n_per_mps > 0.0 else high)
    return max(r.rolling_n + linear + r.aero_n_per_mps2 * air * abs(air), 0.0)


@njit(nogil=True, cache=True)
def shared_drive(
    g: LinkArrays,
    p: LinkPhysics,
    alpha: float,
    half_inertia_kg: float,
    link: int,
    length: float,
    least_mps: float,
    stopped: float,
    target: float,
    p_stop: float,
    wait: float,
) -> tuple[float, float, float]:
    """Least reduced energy [J] and time [s] of a link over all entries at least_mps or more, and its end's entry speed.

    The last is as in StateGraph.number: that of the next link, certain where even the slowest drive reaches target. No
    drive is faster than the limit, and none takes less than its gain in potential and alpha times the road load.
    """
    v_max, road = g.speed_limit_mps[link], road_at(g.roads, link)
    time = length / v_max
    reduced = 0.0
    end2 = target * target
    if not p.table:
        slowest = min(least_mps, target) if p_stop == 0.0 else 0.0
        reduced = alpha * least_load_n(road, slowest, v_max) * length + p.aux_move_w * time
        accel = math.inf
        for k in range(p.accel_sum.size - 1):
            if p.speed_bound_mps[k] < v_max and (p.speed_bound_mps[k + 1] > least_mps or k == p.accel_sum.size - 2):
                accel = min(accel, p.accel_sum[k + 1] - p.accel_sum[k])
        end2 = min(end2, least_mps * least_mps + 2.0 * accel * length)
    time *= 1.0 - stopped
    time += p_stop * wait
    if stopped > 0.0:
        e, t, end = link_energy(p, road, length, 0.0, 0.0, v_max, target, p_stop, wait)
        gain = half_inertia_kg * (1.0 - p_stop) * end * end + p.weight_n * road.grade * length
        reduced += stopped * (max(e - alpha * gain, 0.0) - reduced)
        time += stopped * (t - p_stop * wait)
        end2 += stopped * (end * end - end2)
    if end2 >= target * target:
        return reduced, time, target
    return reduced, time, shared_level(math.sqrt(end2))


@njit(nogil=True, cache=True)
def expand(
    g: LinkArrays,
    p: LinkPhysics,
    alpha: float,
    half_inertia_kg: float,
    starts: NDArray[np.float64],
    goals: NDArray[np.float64],
    allowed: NDArray[np.bool_],
    most: int,
    latest: NDArray[np.int32],
    sg: StateGraph,
) -> int:
    """Every state that a drive from rest at a start can be in, on allowed links, and every drive between two of them.

    starts, goals: (n, 2) link and offset [m]. most: states of a link beyond which others are shared. latest: (M,) of
    -1. State 0 is the goal at rest, the next ones are the starts. Returns FULL where states or arcs have no room.
    """
    place_state(g, p, alpha, sg, GOAL, int(goals[0, 0]), goals[0, 1])
    for k in range(starts.shape[0]):
        place_state(g, p, alpha, sg, 1 + k, int(starts[k, 0]), starts[k, 1])
    sg.counter[:] = 0
    sg.counter[STATES] = 1 + starts.shape[0]
    sg.first[0] = sg.first[1] = 0
    state = 1
    while state < sg.counter[STATES]:
        link = sg.link[state]
        turns = g.successor_first[link + 1] - g.successor_first[link]
        if sg.counter[STATES] + turns + 1 > sg.link.size or sg.counter[ARCS] + turns + goals.shape[0] > sg.head.size:
            return FULL
        v, stopped, offset = sg.number[state, ENTRY_MPS], sg.number[state, STOPPED], sg.number[state, OFFSET]
        before_j = sg.number[state, POTENTIAL]
        v_max, road = g.speed_limit_mps[link], road_at(g.roads, link)
        for k in range(goals.shape[0]):
            if goals[k, 0] == link and goals[k, 1] > offset:
                ds = goals[k, 1] - offset
                if v < 0.0:
                    e, t, _ = shared_drive(g, p, alpha, half_inertia_kg, link, ds, -1.0 - v, stopped, v_max, 1.0, 0.0)
                else:
                    e, t, _ = link_energy(p, road, ds, v, stopped, v_max, v_max, 1.0, 0.0)
                    height = g.tail_height_m[link] + g.grade_frac[link] * goals[k, 1]
                    e += before_j - alpha * p.weight_n * height
                add_arc(sg, GOAL, e, t)
        p_stop, wait = g.stop_probability_frac[link], g.roads[link, ROAD_WAIT]
        known = -1.0
        e, t, end = 0.0, 0.0, 0.0
        for k in range(g.successor_first[link], g.successor_first[link + 1]):
            successor = g.successor[k]
            if not allowed[successor]:
                continue
            target = min(v_max, g.speed_limit_mps[successor])
            if target != known:
                known = target
                ds = g.length_m[link] - offset
                if v < 0.0:
                    e, t, end = shared_drive(
                        g, p, alpha, half_inertia_kg, link, ds, -1.0 - v, stopped, target, p_stop, wait
                    )
                else:
                    e, t, end = link_energy(p, road, ds, v, stopped, v_max, target, p_stop, wait)
            kinetic = half_inertia_kg * (1.0 - p_stop) * max(end, 0.0) ** 2
            after_j = alpha * (p.weight_n * g.tail_height_m[successor] + kinetic)
            to = state_at(sg, latest, successor, end, p_stop, most, after_j)
            add_arc(sg, to, e if v < 0.0 else e + before_j - after_j, t)
        state += 1
        sg.first[state] = sg.counter[ARCS]
    return DONE


@njit(nogil=True, cache=True)
def covered(point_s: NDArray[np.float64], point_j: NDArray[np.float64], count: int, time: float, energy: float) -> bool:
    """Whether a point takes at most this time and energy."""
    low, high = 0, count
    while low < high:
        middle = (low + high) >> 1
        if point_s[middle] <= time:
            low = middle + 1
        else:
            high = middle
    return low > 0 and point_j[low - 1] <= energy


@njit(nogil=True, cache=True)
def add_point(lb: Labels, time: float, energy: float) -> None:
    """One more point; the caller sees to room."""
    k = lb.counter[POINTS]
    lb.counter[POINTS] = k + 1
    while k > 0 and lb.point_s[k - 1] > time:
        lb.point_s[k], lb.point_j[k] = lb.point_s[k - 1], min(lb.point_j[k - 1], energy)
        k -= 1
    lb.point_s[k] = time
    lb.point_j[k] = energy if k == 0 else min(energy, lb.point_j[k - 1])


@njit(nogil=True, cache=True)
def explore(
    sg: StateGraph,
    p: LinkPhysics,
    least_s: NDArray[np.float64],
    least_j: NDArray[np.float64],
    epsilon_frac: float,
    slack_j: float,
    most_s: float,
    most_j: float,
    starts: int,
    state_j: NDArray[np.float64],
    lb: Labels,
) -> int:
    """Settle labels in the order of time, then energy, until each way is covered by a point or by a label that arrived.

    Energies of labels and points are less the gain in potential, those of points with climate. least_s, least_j: (S,)
    what is left to the goal at least. A way is covered by a point that takes at most 1 + epsilon_frac times its time
    and slack_j more energy; ways longer than most_s or beyond most_j need not be. state_j: (S,) of inf. Returns FULL
    where labels or points have no room. The energy of a state's labels falls from one that is settled to the next, so
    that one number tells whether a label is dominated (Hernández et al. 2023, doi:10.1016/j.artint.2022.103807).
    """
    size = 0
    for k in range(1, 1 + starts):
        lb.state[size], lb.parent[size], lb.time_s[size], lb.energy_j[size] = k, -1, 0.0, 0.0
        if least_s[k] < math.inf:
            push(lb.key_s, lb.key_j, lb.item, size, least_s[k], least_j[k], size)
            size += 1
    lb.counter[MADE] = size
    while size > 0:
        time, energy, label = lb.key_s[0], lb.key_j[0], lb.item[0]
        drop(lb.key_s, lb.key_j, lb.item, size)
        size -= 1
        state = lb.state[label]
        if lb.energy_j[label] >= state_j[state]:
            continue
        whole_j = energy + cabin_energy_j(p, 0.0, time)
        if covered(lb.point_s, lb.point_j, lb.counter[POINTS], (1.0 + epsilon_frac) * time, whole_j + slack_j):
            continue
        state_j[state] = lb.energy_j[label]
        lb.counter[SETTLED] += 1
        if state == GOAL:
            if lb.counter[POINTS] + 1 >= lb.point_s.size or lb.counter[SOLUTIONS] + 1 >= lb.solution.size:
                return FULL
            lb.solution[lb.counter[SOLUTIONS]] = label
            lb.counter[SOLUTIONS] += 1
            add_point(lb, time, whole_j)
            continue
        first, last = sg.first[state], sg.first[state + 1]
        if lb.counter[MADE] + last - first > lb.state.size:
            return FULL
        for arc in range(first, last):
            to = sg.head[arc]
            so_far_s, so_far_j = lb.time_s[label] + sg.time_s[arc], lb.energy_j[label] + sg.energy_j[arc]
            whole_s = so_far_s + least_s[to]
            if so_far_j >= state_j[to] or not whole_s <= most_s:
                continue
            whole_j = so_far_j + least_j[to] + cabin_energy_j(p, 0.0, whole_s)
            if whole_j > most_j or covered(
                lb.point_s, lb.point_j, lb.counter[POINTS], (1.0 + epsilon_frac) * whole_s, whole_j + slack_j
            ):
                continue
            made = lb.counter[MADE]
            lb.counter[MADE] = made + 1
            lb.state[made], lb.parent[made], lb.time_s[made], lb.energy_j[made] = to, label, so_far_s, so_far_j
            push(lb.key_s, lb.key_j, lb.item, size, whole_s, so_far_j + least_j[to], made)
            size += 1
    return DONE
