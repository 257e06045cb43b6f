"""Compiled: the arrays that one search writes, their columns, and what its kernel reports."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from energy.compiled.kernels_borrow import borrowed

# columns of the label table
KEY, COST, ENERGY, TIME, DISTANCE, SPEED, STOPPED, OFFSET = range(8)


LINK, PARENT, NEXT, STATE = range(4)
DEAD = -2  # as the next label of its link: another one dominates it
# counters; REFUSED_S: when the battery first refused something while cabin or tyres warm up [s], -1 for never
# COMPARED: comparisons of labels on links where they crowd
LABELS, HEAP, SETTLED, GOAL, CYCLE, REDUCED_BELOW_ZERO, CROWDED, REFUSED_S, COMPARED = range(9)
COUNTERS = 9
BAG_LABEL, BAG_EPOCH, BAG_STATE, BAG_COST = range(4)
DONE, FOUND, FULL, NEGATIVE_CYCLE, TOO_MANY, CRAMPED, PAUSED = range(7)
PAUSE_LABELS = 8192  # settled before a kernel pauses, 10 to 20 ms, so that its caller may stop it
PAUSE_COMPARED = 300_000  # as many in crowds take as long


class Workspace(NamedTuple):
    """Arrays that one search writes; capacity C labels, M links. bag: newest label of each link and the search
    that it is of, which spares resetting. Rows of number, and the four children of a place in the heap, are aligned."""

    number: NDArray[np.float64]  # (C, 8)
    pointer: NDArray[np.int32]  # (C, 4)
    heap_key: NDArray[np.float64]  # (C,)
    heap_label: NDArray[np.int32]  # (C,)
    bag: NDArray[np.float64]  # (M + 1, 4)
    counter: NDArray[np.int64]  # (COUNTERS,)


@njit(nogil=True, cache=True, inline="always")
def borrowed_workspace(ws: Workspace) -> Workspace:
    """The same workspace with borrowed arrays."""
    return Workspace(
        borrowed(ws.number),
        borrowed(ws.pointer),
        borrowed(ws.heap_key),
        borrowed(ws.heap_label),
        borrowed(ws.bag),
        borrowed(ws.counter),
    )


@njit(nogil=True, cache=True)
def labels_to(pointer: NDArray[np.int32], label: int) -> NDArray[np.int64]:
    """The labels of a way in driving order, int64 (n,), the last one given."""
    count, at = 0, label
    while at >= 0:
        count, at = count + 1, pointer[at, PARENT]
    labels = np.empty(count, np.int64)
    at = label
    for k in range(count - 1, -1, -1):
        labels[k], at = at, pointer[at, PARENT]
    return labels


@njit(nogil=True, cache=True, inline="always")
def whole(value: float) -> int:
    """A stored whole number of any type as int64, which records hold."""
    return int(np.int64(value))
