"""Compiled: all ways between two places that differ in what they do to a battery, as paths of the graph of states.

What routing/pareto compares in time and energy is compared here in time, energy, need, spill and longest as well
(routing.charging.ways.Way), so that nothing is left out whatever charge a way begins with.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

import energy.compiled.cache  # noqa: F401  (sets the cache folder before anything is compiled)
from routing.kernels_heap import heap_drop, heap_push
from routing.pareto.kernels_states import GOAL, POTENTIAL, StateGraph

# columns of WayLabels.number
TIME, ENERGY, NEED, SPILL, LONGEST = range(5)
CRITERIA = 5
# columns of WayLabels.pointer
STATE, PARENT, NEXT, DROPPED = range(4)
# counters
MADE, HEAP, SETTLED = range(3)
DONE, FULL, PAUSED = range(3)
PAUSE_LABELS = 16_384
NOISE_J = 1e-6  # rounding of sums of energies


class WayLabels(NamedTuple):
    """Labels: number (L, 5), pointer (L, 4) as above; latest (S,) of each state, −1 before; heap; counter (3,)."""

    number: NDArray[np.float64]
    pointer: NDArray[np.int32]
    latest: NDArray[np.int32]
    heap_key: NDArray[np.float64]
    heap_label: NDArray[np.int32]
    counter: NDArray[np.int64]


@njit(nogil=True, cache=True)
def is_worse(labels: WayLabels, state: int, row: NDArray[np.float64]) -> bool:
    """Whether a label of a state is as good in everything."""
    other = labels.latest[state]
    while other >= 0:
        number = labels.number[other]
        if (
            number[TIME] <= row[TIME]
            and number[ENERGY] <= row[ENERGY] + NOISE_J
            and number[NEED] <= row[NEED] + NOISE_J
            and number[SPILL] <= row[SPILL] + NOISE_J
            and number[LONGEST] <= row[LONGEST] + NOISE_J
        ):
            return True
        other = labels.pointer[other, NEXT]
    return False


@njit(nogil=True, cache=True)
def explore_ways(
    sg: StateGraph,
    least_s: NDArray[np.float64],
    least_j: NDArray[np.float64],
    starts: int,
    power_w: float,
    most_s: float,
    most_j: float,
    most_stretch_j: float,
    labels: WayLabels,
) -> int:
    """Settle labels by their least time to the goal until none is left.

    least_s, least_j: (S,) least time and reduced energy to the goal. power_w: what climate takes all the time. Ways
    that take more than most_s or most_j, or of which a stretch takes more than most_stretch_j, are left out. Labels of
    state GOAL are the ways. Returns FULL where labels have no room, PAUSED after some thousand.
    """
    row = np.empty(CRITERIA)
    ahead = np.empty(CRITERIA)
    goal_j = sg.number[GOAL, POTENTIAL]
    if labels.counter[MADE] == 0:
        for k in range(1, 1 + starts):
            if least_s[k] < math.inf:
                made = labels.counter[MADE]
                labels.number[made, :] = 0.0
                labels.pointer[made, STATE], labels.pointer[made, PARENT] = k, -1
                labels.pointer[made, NEXT], labels.pointer[made, DROPPED] = -1, 0
                labels.latest[k] = made
                heap_push(labels.heap_key, labels.heap_label, labels.counter[HEAP], least_s[k], made)
                labels.counter[HEAP] += 1
                labels.counter[MADE] += 1
    for _ in range(PAUSE_LABELS):
        if labels.counter[HEAP] == 0:
            return DONE
        top = labels.heap_label[0]
        heap_drop(labels.heap_key, labels.heap_label, labels.counter[HEAP])
        labels.counter[HEAP] -= 1
        state = labels.pointer[top, STATE]
        if state == GOAL or labels.pointer[top, DROPPED] == 1:
            continue
        labels.counter[SETTLED] += 1
        first, last = sg.first[state], sg.first[state + 1]
        if labels.counter[MADE] + last - first > labels.number.shape[0]:
            return FULL
        before = labels.number[top]
        for arc in range(first, last):
            to = sg.head[arc]
            if least_s[to] == math.inf:
                continue
            taken = sg.energy_j[arc] + sg.number[to, POTENTIAL] - sg.number[state, POTENTIAL]
            taken += power_w * sg.time_s[arc]
            row[TIME] = before[TIME] + sg.time_s[arc]
            row[ENERGY] = before[ENERGY] + taken
            row[NEED] = max(before[NEED], row[ENERGY])
            row[SPILL] = max(before[SPILL] + taken, 0.0)
            row[LONGEST] = max(before[LONGEST], row[SPILL])
            onward = least_j[to] + goal_j - sg.number[to, POTENTIAL] + power_w * least_s[to]
            if row[TIME] + least_s[to] > most_s or row[ENERGY] + onward > most_j or row[LONGEST] > most_stretch_j:
                continue
            if is_worse(labels, to, row):
                continue
            if to != GOAL:
                ahead[TIME], ahead[ENERGY] = row[TIME] + least_s[to], row[ENERGY] + onward
                ahead[NEED], ahead[SPILL] = max(row[NEED], ahead[ENERGY]), max(row[SPILL] + onward, 0.0)
                ahead[LONGEST] = max(row[LONGEST], ahead[SPILL])
                if is_worse(labels, GOAL, ahead):
                    continue
            made = labels.counter[MADE]
            labels.number[made, :] = row
            labels.pointer[made, STATE], labels.pointer[made, PARENT], labels.pointer[made, DROPPED] = to, top, 0
            previous, other = -1, labels.latest[to]
            while other >= 0:  # those that the new one is as good as
                after = labels.pointer[other, NEXT]
                number = labels.number[other]
                if (
                    row[TIME] <= number[TIME]
                    and row[ENERGY] <= number[ENERGY]
                    and row[NEED] <= number[NEED]
                    and row[SPILL] <= number[SPILL]
                    and row[LONGEST] <= number[LONGEST]
                ):
                    labels.pointer[other, DROPPED] = 1
                    if previous < 0:
                        labels.latest[to] = after
                    else:
                        labels.pointer[previous, NEXT] = after
                else:
                    previous = other
                other = after
            labels.pointer[made, NEXT] = labels.latest[to]
            labels.latest[to] = made
            heap_push(labels.heap_key, labels.heap_label, labels.counter[HEAP], row[TIME] + least_s[to], made)
            labels.counter[HEAP] += 1
            labels.counter[MADE] = made + 1
    return PAUSED
