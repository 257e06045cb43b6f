"""Compiled: the four-ary heap of the searches."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

import energy.compiled.cache  # noqa: F401  (sets the cache folder before anything is compiled)


@njit(nogil=True, cache=True)
def heap_push(heap_key: NDArray[np.float64], heap_label: NDArray[np.int32], size: int, key: float, label: int) -> None:
    """Add a label to the four-ary heap of a size; the caller counts."""
    k = size
    while k > 0:
        up = (k - 1) >> 2
        if heap_key[up] <= key:
            break
        heap_key[k] = heap_key[up]
        heap_label[k] = heap_label[up]
        k = up
    heap_key[k] = key
    heap_label[k] = label


@njit(nogil=True, cache=True)
def heap_drop(heap_key: NDArray[np.float64], heap_label: NDArray[np.int32], size: int) -> None:
    """Take the least key off the four-ary heap of a size; the caller counts."""
    size -= 1
    key = heap_key[size]
    label = heap_label[size]
    k = 0
    while True:
        child = 4 * k + 1
        if child >= size:
            break
        best = child
        best_key = heap_key[child]
        for c in range(child + 1, min(child + 4, size)):
            if heap_key[c] < best_key:
                best = c
                best_key = heap_key[c]
        if best_key >= key:
            break
        heap_key[k] = best_key
        heap_label[k] = heap_label[best]
        k = best
    heap_key[k] = key
    heap_label[k] = label


@njit(nogil=True, cache=True)
def push(
    key: NDArray[np.float64],
    tie: NDArray[np.float64],
    item: NDArray[np.int32],
    size: int,
    k1: float,
    k2: float,
    new: int,
) -> None:
    """Add an item to the heap of a size, ordered by key, then tie; the caller counts."""
    at = size
    while at > 0:
        up = (at - 1) >> 1
        if key[up] < k1 or (key[up] == k1 and tie[up] <= k2):
            break
        key[at], tie[at], item[at] = key[up], tie[up], item[up]
        at = up
    key[at], tie[at], item[at] = k1, k2, new


@njit(nogil=True, cache=True)
def drop(key: NDArray[np.float64], tie: NDArray[np.float64], item: NDArray[np.int32], size: int) -> None:
    """Take the first item off the heap of a size; the caller counts."""
    size -= 1
    k1, k2, moved = key[size], tie[size], item[size]
    at = 0
    while True:
        child = 2 * at + 1
        if child >= size:
            break
        other = child + 1
        if other < size and (key[other] < key[child] or (key[other] == key[child] and tie[other] < tie[child])):
            child = other
        if k1 < key[child] or (k1 == key[child] and k2 <= tie[child]):
            break
        key[at], tie[at], item[at] = key[child], tie[child], item[child]
        at = child
    key[at], tie[at], item[at] = k1, k2, moved
