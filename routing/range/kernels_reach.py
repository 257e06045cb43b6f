"""Compiled: how far bands reach, along roads and as the crow flies."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from energy.compiled.kernels_borrow import borrowed
from routing.kernels_heap import heap_drop, heap_push

DONE, PAUSED = range(2)
PAUSE_NODES = 65_536  # settled before settle_nodes pauses, some 10 ms, so that its caller may stop it
SIZE, MISSING = range(2)  # of a heap's counter: its size, and how many wanted nodes are not settled


class Roads(NamedTuple):
    """Links by the node at which they are entered: where those of each begin, int64 (N + 1,), and of each link (M,).

    far: the other node. length_m: of the link. link: its number.
    """

    first: NDArray[np.int64]
    far: NDArray[np.int32]
    length_m: NDArray[np.float64]
    link: NDArray[np.int32]


class NodeHeap(NamedTuple):
    """Nodes that are met and not settled, (M + starts,), and counters: int64 (2,)."""

    key_m: NDArray[np.float64]
    node: NDArray[np.int32]
    counter: NDArray[np.int64]


class BandEnergies(NamedTuple):
    """What places take, (N,), and the stretch of each link for which the charge suffices, (M,), as in RoadEnergies."""

    node_energy_j: NDArray[np.float64]
    from_m: NDArray[np.float64]
    to_m: NDArray[np.float64]
    most_energy_j: float


class Starts(NamedTuple):
    """Positions of one place on links, (S,) each: the link, how far along it [m] and the node where it is left."""

    link: NDArray[np.int64]
    offset_m: NDArray[np.float64]
    far: NDArray[np.int32]


@njit(nogil=True, cache=True)
def meet_node(node: int, away_m: float, node_m: NDArray[np.float64], heap: NodeHeap) -> None:
    """Put a node into the heap, unless a way that is no longer leads there."""
    if away_m < node_m[node]:
        node_m[node] = away_m
        heap_push(heap.key_m, heap.node, heap.counter[SIZE], away_m, node)
        heap.counter[SIZE] += 1


@njit(nogil=True, cache=True)
def settle_nodes(roads: Roads, wanted: NDArray[np.bool_], node_m: NDArray[np.float64], heap: NodeHeap) -> int:
    """Shortest distances from the nodes in a heap to wanted ones, bool (N,), into node_m (N,), inf where none is known.

    Those of other nodes are no shorter than their shortest ones. Returns DONE, or PAUSED after PAUSE_NODES, to be
    called again for the rest. Label setting, in O(M log M).
    """
    first, far, length_m = borrowed(roads.first), borrowed(roads.far), borrowed(roads.length_m)
    wanted, node_m = borrowed(wanted), borrowed(node_m)
    heap = NodeHeap(borrowed(heap.key_m), borrowed(heap.node), borrowed(heap.counter))
    settled = 0
    while heap.counter[SIZE] > 0 and heap.counter[MISSING] > 0:
        if settled == PAUSE_NODES:
            return PAUSED
        away_m, node = heap.key_m[0], heap.node[0]
        heap_drop(heap.key_m, heap.node, heap.counter[SIZE])
        heap.counter[SIZE] -= 1
        if away_m > node_m[node]:
            continue
        settled += 1
        if wanted[node]:
            heap.counter[MISSING] -= 1
        for k in range(first[node], first[node + 1]):
            meet_node(far[k], away_m + length_m[k], node_m, heap)
    return DONE


@njit(nogil=True, cache=True)
def end_along(e: BandEnergies, budget_j: float, begin_j: float, end_j: float, driven_m: float) -> float:
    """How far along a stretch a budget reaches [m], of which the energy is taken as linear; 0..driven_m."""
    span_j = min(end_j, e.most_energy_j) - begin_j
    part = (budget_j - begin_j) / span_j if span_j > 0.0 else 1.0
    return min(max(part, 0.0), 1.0) * max(driven_m, 0.0)


@njit(nogil=True, cache=True)
def road_ends(
    roads: Roads, e: BandEnergies, budget_j: float, starts: Starts, node_m: NDArray[np.float64], homeward: bool
) -> tuple[float, float]:
    """The nearest place at which a budget ends on a link, inf where there is none, and the farthest in reach [m].

    It ends on links that lead from a node in reach to one that is not, or from the place itself. roads, node_m: as
    settle_nodes had them.
    """
    roads = Roads(borrowed(roads.first), borrowed(roads.far), borrowed(roads.length_m), borrowed(roads.link))
    e = BandEnergies(borrowed(e.node_energy_j), borrowed(e.from_m), borrowed(e.to_m), e.most_energy_j)
    node_m = borrowed(node_m)
    nearest, farthest = math.inf, 0.0
    for node in range(node_m.size):
        begin_j, begin_m = e.node_energy_j[node], node_m[node]
        if begin_j > budget_j:
            continue
        if begin_m < math.inf:
            farthest = max(farthest, begin_m)
        for k in range(roads.first[node], roads.first[node + 1]):
            end_j = e.node_energy_j[roads.far[k]]
            if end_j <= budget_j:
                continue
            link = roads.link[k]
            driven_m = 0.0  # where the charge does not suffice for going on
            if e.to_m[link] >= e.from_m[link]:
                driven_m = roads.length_m[k] - e.from_m[link] if homeward else e.to_m[link]
            end_m = begin_m + end_along(e, budget_j, begin_j, end_j, driven_m)
            nearest, farthest = min(nearest, end_m), max(farthest, end_m)
    for k in range(starts.link.size):
        link, end_j = starts.link[k], e.node_energy_j[starts.far[k]]
        if e.to_m[link] >= e.from_m[link] and end_j > budget_j:
            driven_m = starts.offset_m[k] - e.from_m[link] if homeward else e.to_m[link] - starts.offset_m[k]
            end_m = end_along(e, budget_j, 0.0, end_j, driven_m)
            nearest, farthest = min(nearest, end_m), max(farthest, end_m)
    return nearest, farthest


@njit(nogil=True, cache=True)
def farthest_crossings(
    lonlat: NDArray[np.float64],
    ring_first: NDArray[np.int64],
    home: NDArray[np.float64],
    scale: NDArray[np.float64],
    east: NDArray[np.float64],
    north: NDArray[np.float64],
    farthest: NDArray[np.float64],
) -> None:
    """Where closed rings cross rays from a place farthest away, float64 (B,) [m], 0 on entry.

    lonlat: (P, 2) [deg], those of ring r from ring_first[r] on. home: (2,) [deg]; scale: (2,) [m/deg]. east, north:
    (B,) directions of the rays, evenly spaced from north on, clockwise. A stretch that stays between two rays next to
    each other, as nearly all do, is compared with these alone.
    """
    lonlat, ring_first, home, scale = borrowed(lonlat), borrowed(ring_first), borrowed(home), borrowed(scale)
    east, north, farthest = borrowed(east), borrowed(north), borrowed(farthest)
    rays = east.size
    before = 0  # the point is not left of this ray, and left of the next
    for ring in range(ring_first.size - 1):
        x0 = y0 = 0.0
        for k in range(ring_first[ring], ring_first[ring + 1]):
            x, y = (lonlat[k, 0] - home[0]) * scale[0], (lonlat[k, 1] - home[1]) * scale[1]
            after = (before + 1) % rays
            stays = (
                x * north[before] - y * east[before] >= 0.0
                and x * north[after] - y * east[after] < 0.0
                and x0 * north[before] - y0 * east[before] >= 0.0
                and x0 * north[after] - y0 * east[after] < 0.0
            )
            if not stays:
                for ray in range(rays):
                    aside0, aside = x0 * north[ray] - y0 * east[ray], x * north[ray] - y * east[ray]
                    if aside >= 0.0 and x * north[(ray + 1) % rays] - y * east[(ray + 1) % rays] < 0.0:
                        before = ray
                    if k > ring_first[ring] and (aside0 < 0.0) != (aside < 0.0):
                        ahead0, ahead = x0 * east[ray] + y0 * north[ray], x * east[ray] + y * north[ray]
                        part = aside0 / (aside0 - aside)
                        farthest[ray] = max(farthest[ray], ahead0 + part * (ahead - ahead0))
            x0, y0 = x, y
