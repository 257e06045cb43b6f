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

from energy.compiled.kernels_borrow import borrowed
from energy.force.kernels_physics import LinkPhysics, borrowed_physics, cabin_energy_j
from routing.kernels_heap import drop, push
from routing.pareto.kernels_states import DONE, FULL, GOAL, PAUSED, StateGraph, borrowed_state_graph

# counters of Labels
MADE, SETTLED, POINTS, SOLUTIONS, HEAP = range(5)
PAUSE_LABELS = 65_536  # taken from the heap before explore pauses, so that its caller may stop it


class Labels(NamedTuple):
    """Labels of one search, room for L of them, and the points (time, energy) that ways are compared with, room for C.

    state, parent: (L,). time_s, energy_j: (L,), so far. key_s, key_j, item: (L,) of the heap. point_s: (C,) ascending;
    point_j: (C,) the least energy of the points up to there. solution: (C,) labels that arrived. counter: (5,).
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


@njit(nogil=True, cache=True, inline="always")
def borrowed_labels(lb: Labels) -> Labels:
    """The same labels with borrowed arrays."""
    return Labels(
        borrowed(lb.state),
        borrowed(lb.parent),
        borrowed(lb.time_s),
        borrowed(lb.energy_j),
        borrowed(lb.key_s),
        borrowed(lb.key_j),
        borrowed(lb.item),
        borrowed(lb.point_s),
        borrowed(lb.point_j),
        borrowed(lb.solution),
        borrowed(lb.counter),
    )


class CoverRules(NamedTuple):
    """When a way needs no route of its own, as in all_ways.Cover; most_j: less the gain in potential."""

    epsilon_frac: float
    slack_j: float
    most_s: float
    most_j: float


class ToGoal(NamedTuple):
    """Least time [s] and reduced energy [J] from each state to the goal, (S,) each; inf where no way leads there."""

    time_s: NDArray[np.float64]
    energy_j: NDArray[np.float64]


@njit(nogil=True, cache=True)
def is_covered(lb: Labels, rules: CoverRules, way_s: float, way_j: float) -> bool:
    """Whether a point takes at most 1 + epsilon_frac times a way's time, and slack_j more energy."""
    time, energy = (1.0 + rules.epsilon_frac) * way_s, way_j + rules.slack_j
    low, high = 0, lb.counter[POINTS]
    while low < high:
        middle = (low + high) >> 1
        if lb.point_s[middle] <= time:
            low = middle + 1
        else:
            high = middle
    return low > 0 and lb.point_j[low - 1] <= energy


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
    to_goal: ToGoal,
    rules: CoverRules,
    starts: int,
    state_j: NDArray[np.float64],
    lb: Labels,
) -> int:
    """Settle labels in the order of time, then energy, until each way is covered by a point or by a label that arrived.

    Energies of labels and points are less the gain in potential, those of points with climate. Ways longer than most_s
    or beyond most_j need not be covered. state_j: (S,), inf before the first call. Returns FULL where labels or points
    have no room, and PAUSED after PAUSE_LABELS, to be called again for the rest. The energy of a state's labels falls
    from one that is settled to the next, so that one number tells whether a label is dominated (Hernández et al. 2023,
    doi:10.1016/j.artint.2022.103807).
    """
    p, sg, lb = borrowed_physics(p), borrowed_state_graph(sg), borrowed_labels(lb)
    least_s, least_j, state_j = borrowed(to_goal.time_s), borrowed(to_goal.energy_j), borrowed(state_j)
    size = lb.counter[HEAP]
    if lb.counter[MADE] == 0:
        for k in range(1, 1 + starts):
            lb.state[size], lb.parent[size], lb.time_s[size], lb.energy_j[size] = k, -1, 0.0, 0.0
            if least_s[k] < math.inf:
                push(lb.key_s, lb.key_j, lb.item, size, least_s[k], least_j[k], size)
                size += 1
        lb.counter[MADE] = size
    for _ in range(PAUSE_LABELS):
        if size == 0:
            return DONE
        time, energy, label = lb.key_s[0], lb.key_j[0], lb.item[0]
        drop(lb.key_s, lb.key_j, lb.item, size)
        size -= 1
        state = lb.state[label]
        if lb.energy_j[label] >= state_j[state]:
            continue
        whole_j = energy + cabin_energy_j(p, 0.0, time)
        if is_covered(lb, rules, time, whole_j):
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
            if so_far_j >= state_j[to] or not whole_s <= rules.most_s:
                continue
            whole_j = so_far_j + least_j[to] + cabin_energy_j(p, 0.0, whole_s)
            if whole_j > rules.most_j or is_covered(lb, rules, whole_s, whole_j):
                continue
            made = lb.counter[MADE]
            lb.counter[MADE] = made + 1
            lb.state[made], lb.parent[made], lb.time_s[made], lb.energy_j[made] = to, label, so_far_s, so_far_j
            push(lb.key_s, lb.key_j, lb.item, size, whole_s, so_far_j + least_j[to], made)
            size += 1
    lb.counter[HEAP] = size
    return PAUSED
