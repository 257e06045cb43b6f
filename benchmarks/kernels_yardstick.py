"""Plain Dijkstra, compiled: the yardstick of the benchmarks."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from routing.kernels_heap import heap_drop, heap_push


@njit(nogil=True, cache=True)
def scalar_dijkstra(
    first: NDArray[np.int64],
    successor: NDArray[np.int32],
    weight: NDArray[np.float64],
    source: int,
    distance: NDArray[np.float64],
    heap_key: NDArray[np.float64],
    heap_item: NDArray[np.int32],
) -> int:
    """Plain one-to-all Dijkstra over links with one scalar weight and the same heap: the yardstick of benchmarks."""
    distance[source] = 0.0
    heap_push(heap_key, heap_item, 0, 0.0, source)
    size = 1
    settled = 0
    while size > 0:
        key = heap_key[0]
        i = heap_item[0]
        heap_drop(heap_key, heap_item, size)
        size -= 1
        if key > distance[i]:
            continue
        settled += 1
        d = key + weight[i]
        for k in range(first[i], first[i + 1]):
            j = successor[k]
            if d < distance[j]:
                distance[j] = d
                heap_push(heap_key, heap_item, size, d, j)
                size += 1
    return settled
