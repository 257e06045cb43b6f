"""Compiled: a heap with two keys, and the least sums of weights over a graph given by arrays."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from routing.kernels_heap import drop, push


@njit(nogil=True, cache=True)
def least_sums(
    first: NDArray[np.int64],
    head: NDArray[np.int32],
    weight: NDArray[np.float64],
    origin: int,
    most: float,
    sums: NDArray[np.float64],
) -> None:
    """Least sum of arc weights ≥ 0 from an origin to every vertex, where it is at most most; others stay as they are.

    sums: float64 (N,), of inf, or of what is known from other origins.
    """
    if sums[origin] <= 0.0:
        return
    sums[origin] = 0.0
    room = head.size + 2
    key, tie, item = np.empty(room), np.empty(room), np.empty(room, np.int32)
    push(key, tie, item, 0, 0.0, 0.0, origin)
    size = 1
    while size > 0:
        near, at = key[0], item[0]
        drop(key, tie, item, size)
        size -= 1
        if near > sums[at]:
            continue
        for arc in range(first[at], first[at + 1]):
            to = head[arc]
            if near + weight[arc] < sums[to] and near + weight[arc] <= most:
                sums[to] = near + weight[arc]
                push(key, tie, item, size, sums[to], 0.0, to)
                size += 1


@njit(nogil=True, cache=True)
def turned_round(
    first: NDArray[np.int64], head: NDArray[np.int32], back_first: NDArray[np.int64], arc: NDArray[np.int64]
) -> None:
    """The arcs into each vertex: back_first int64 (N + 1,), and the arcs' numbers in that order, int64 (A,)."""
    count = first.size - 1
    back_first[:] = 0
    for k in range(first[count]):
        back_first[head[k] + 1] += 1
    for vertex in range(count):
        back_first[vertex + 1] += back_first[vertex]
    place = back_first[:count].copy()
    for k in range(first[count]):
        arc[place[head[k]]] = k
        place[head[k]] += 1
