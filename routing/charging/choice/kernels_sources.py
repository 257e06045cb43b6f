"""Compiled: searches that begin at many places, and what they are below on each link."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

import energy.compiled.cache  # noqa: F401  (sets the cache folder before anything is compiled)
from energy.force.kernels_physics import LinkPhysics
from routing.dominance.kernels_rules import SearchRules
from routing.kernels_heap import heap_push
from routing.links.kernels_tables import LinkArrays
from routing.search.kernels_search import start_label
from routing.search.kernels_workspace import COST, ENERGY, HEAP, KEY, LABELS, LINK, Workspace


@njit(nogil=True, cache=True)
def start_labels(
    g: LinkArrays,
    p: LinkPhysics,
    r: SearchRules,
    ws: Workspace,
    link: NDArray[np.int64],
    offset_m: NDArray[np.float64],
    used_j: NDArray[np.float64],
) -> None:
    """Put starts, at rest on links so far along [m], into the heap of an empty workspace that has room for them.

    used_j: what each has used already [J], ≥ 0.
    """
    for k in range(link.size):
        start_label(g, p, r, ws, link[k], offset_m[k], 0.0)
        ws.number[k, ENERGY], ws.number[k, COST] = used_j[k], r.energy_weight * used_j[k]
        ws.number[k, KEY] += ws.number[k, COST]
    ws.counter[HEAP] = 0  # which is made anew by their keys
    for k in range(link.size):
        heap_push(ws.heap_key, ws.heap_label, k, ws.number[k, KEY], k)
    ws.counter[HEAP] = link.size


@njit(nogil=True, cache=True)
def least_keys(ws: Workspace, key: NDArray[np.float64]) -> None:
    """Lower the key of each link, float64 (M,), to the least of the labels on it: keys never fall on the way on."""
    for label in range(ws.counter[LABELS]):
        link = ws.pointer[label, LINK]
        if link < key.size:
            key[link] = min(key[link], ws.number[label, KEY])
