"""Compiled: what a search space knows of its links beforehand: their commonest drives, and where drives have met."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from energy.chain.kernels_link import link_energy
from energy.compiled.kernels_borrow import borrowed
from energy.force.kernels_physics import ROAD_WAIT, LinkPhysics, borrowed_physics, road_at
from routing.links.kernels_tables import CRUISE_J, CRUISE_S, LENGTH, LIMIT, REST_J, REST_S, STOP


@njit(nogil=True, cache=True)
def fill_cruise(p: LinkPhysics, row: NDArray[np.float64], roads: NDArray[np.float64]) -> None:
    """Energy and time of each link entered at its limit or from rest, left at the limit or stopped, into its row."""
    p, row, roads = borrowed_physics(p), borrowed(row), borrowed(roads)
    for k in range(row.shape[0]):
        v, length, stop = row[k, LIMIT], row[k, LENGTH], row[k, STOP]
        r = road_at(roads, k)
        wait = roads[k, ROAD_WAIT]
        row[k, CRUISE_J], row[k, CRUISE_S], _ = link_energy(p, r, length, v, 0.0, v, v, stop, wait)
        row[k, REST_J], row[k, REST_S], end = link_energy(p, r, length, 0.0, 0.0, v, v, stop, wait)
        if end != v:
            row[k, REST_S] = -1.0


@njit(nogil=True, cache=True)
def top_classes(
    length: NDArray[np.float64],
    first: NDArray[np.int64],
    successor: NDArray[np.int32],
    run_up: NDArray[np.float64],
    top: NDArray[np.int8],
) -> None:
    """Highest speed interval that drives may be in before two of them must have met, for each link.

    run_up: distance in which any entry reaches the link's limit. top starts as the interval of that limit
    and grows along successors of links shorter than their run-up until nothing changes.
    """
    changed = True
    while changed:
        changed = False
        for i in range(length.size):
            if length[i] >= run_up[i]:
                continue
            best = top[i]
            for k in range(first[i], first[i + 1]):
                best = max(best, top[successor[k]])
            if best > top[i]:
                top[i] = best
                changed = True


@njit(nogil=True, cache=True)
def is_whole_way(
    successor_first: NDArray[np.int64],
    successor: NDArray[np.int32],
    length_m: NDArray[np.float64],
    links: NDArray[np.int64],
    from_m: NDArray[np.float64],
    to_m: NDArray[np.float64],
) -> bool:
    """Whether stretches of links, (n,) each, are a way of links that may follow one another, whole but for its ends.

    The first three arrays are those of a graph, of which links are.
    """
    last = links.size - 1
    for k in range(last + 1):
        link = links[k]
        if not (0.0 <= from_m[k] < to_m[k] <= length_m[link]):
            return False
        if (k > 0 and from_m[k] != 0.0) or (k < last and to_m[k] != length_m[link]):
            return False
        follows = k == last
        for at in range(successor_first[link], 0 if follows else successor_first[link + 1]):
            follows = follows or successor[at] == links[k + 1]
        if not follows:
            return False
    return True
