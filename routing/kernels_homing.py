"""Compiled: the least that is still to be paid from a node to the goal, found backwards as far as it is asked for.

A search back from the goal over nodes, with the least cost of each link whatever it is entered with, runs just as far
as the search from the start asks (docs/search-goal.md). What it has not reached costs at least its radius.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from energy.kernels_borrow import borrowed, borrowed_physics
from energy.kernels_force import LinkPhysics
from routing.kernels_heap import heap_drop, heap_push
from routing.kernels_least import least_towards_any

# columns of the table of links by the node that they lead into
INTO_J, INTO_S, INTO_M, INTO_TAIL = range(4)
# columns of a node: least cost to the goal so far, and whether it is known and final, as numbers of the search
NODE_COST, NODE_SEEN, NODE_FINAL = range(3)

HEAP_SIZE = 0
RADIUS, FARTHEST = range(2)
# what is this much farther from the goal than the start, and as far again, is on no way that matters
FARTHEST_FRAC = 1.25
FARTHEST_J, FARTHEST_S, FARTHEST_M = 5e5, 60.0, 1000.0


class Homing(NamedTuple):
    """Least costs to the goal, for one search.

    used: false where the search is not directed. into_first: (N + 1,), into: (M, 4) links by head, their energy and
    time NaN until they are asked for; into_link: (M,) their numbers. tail: (M,) node of each link. entry: (M, 3) of
    kernels_least. physics: without what only adds energy. alpha, sag_n, row, roads, successor_first, successor: as in
    the search. node: (N, 3). heap_key, heap_node: for all links and goals. in_heap: nodes that the search back has in
    its heap; reach: how far it has come; epoch: its number.
    """

    used: bool
    into_first: NDArray[np.int64]
    into: NDArray[np.float64]
    into_link: NDArray[np.int32]
    tail: NDArray[np.int32]
    entry: NDArray[np.float64]
    physics: LinkPhysics
    alpha: float
    sag_n: float
    row: NDArray[np.float64]
    roads: NDArray[np.float64]
    successor_first: NDArray[np.int64]
    successor: NDArray[np.int32]
    node: NDArray[np.float64]
    heap_key: NDArray[np.float64]
    heap_node: NDArray[np.int32]
    in_heap: NDArray[np.int64]
    reach: NDArray[np.float64]
    epoch: float


@njit(nogil=True, cache=True)
def borrowed_homing(h: Homing) -> Homing:
    """The same with borrowed arrays."""
    return Homing(
        h.used,
        borrowed(h.into_first),
        borrowed(h.into),
        borrowed(h.into_link),
        borrowed(h.tail),
        borrowed(h.entry),
        borrowed_physics(h.physics),
        h.alpha,
        h.sag_n,
        borrowed(h.row),
        borrowed(h.roads),
        borrowed(h.successor_first),
        borrowed(h.successor),
        borrowed(h.node),
        borrowed(h.heap_key),
        borrowed(h.heap_node),
        borrowed(h.in_heap),
        borrowed(h.reach),
        h.epoch,
    )


@njit(nogil=True, cache=True)
def links_by_head(head: NDArray[np.int32], first: NDArray[np.int64], link: NDArray[np.int32]) -> None:
    """Sort links (M,) by the node that they lead into; first (N + 1,) starts as zeros."""
    for i in range(head.size):
        first[head[i] + 1] += 1
    for n in range(first.size - 1):
        first[n + 1] += first[n]
    place = first[:-1].copy()
    for i in range(head.size):
        link[place[head[i]]] = i
        place[head[i]] += 1


@njit(nogil=True, cache=True)
def set_out(h: Homing, goal_node: NDArray[np.int64]) -> None:
    """Begin a search back from the nodes at which the goals' links begin."""
    h.in_heap[HEAP_SIZE] = 0
    h.reach[RADIUS], h.reach[FARTHEST] = 0.0, math.inf
    for k in range(goal_node.size):
        n = goal_node[k]
        h.node[n, NODE_COST], h.node[n, NODE_SEEN] = 0.0, h.epoch
        heap_push(h.heap_key, h.heap_node, h.in_heap[HEAP_SIZE], 0.0, n)
        h.in_heap[HEAP_SIZE] += 1


@njit(nogil=True, cache=True)
def cost_to_goal(h: Homing, energy_weight: float, time_weight: float, distance_weight: float, asked: int) -> float:
    """Least cost from a node to the goal, or less where it is far; inf where no road leads there. h: borrowed."""
    into_first, into, into_link, node = h.into_first, h.into, h.into_link, h.node
    heap_key, heap_node, epoch = h.heap_key, h.heap_node, h.epoch
    size = h.in_heap[HEAP_SIZE]
    radius: float = h.reach[RADIUS]
    farthest = h.reach[FARTHEST]
    if node[asked, NODE_FINAL] == epoch:
        known: float = node[asked, NODE_COST]
        return known
    while size > 0 and radius < farthest:
        n = heap_node[0]
        radius = heap_key[0]
        heap_drop(heap_key, heap_node, size)
        size -= 1
        if node[n, NODE_FINAL] == epoch:
            continue
        node[n, NODE_FINAL] = epoch
        for k in range(into_first[n], into_first[n + 1]):
            before = int(into[k, INTO_TAIL])
            if node[before, NODE_FINAL] == epoch:
                continue
            least_j, least_s = into[k, INTO_J], into[k, INTO_S]
            if math.isnan(least_j + least_s):
                least_j, least_s = least_towards_any(
                    h.physics,
                    h.alpha,
                    h.sag_n,
                    h.row,
                    h.roads,
                    h.successor_first,
                    h.successor,
                    h.entry,
                    into_link[k],
                )
                into[k, INTO_J], into[k, INTO_S] = least_j, least_s  # other searches find both, or compute them too
            so_far = radius + energy_weight * least_j + time_weight * least_s + distance_weight * into[k, INTO_M]
            if node[before, NODE_SEEN] != epoch or so_far < node[before, NODE_COST]:
                node[before, NODE_COST], node[before, NODE_SEEN] = so_far, epoch
                heap_push(heap_key, heap_node, size, so_far, before)
                size += 1
        if n == asked:
            break
    h.in_heap[HEAP_SIZE] = size
    h.reach[RADIUS] = radius
    if node[asked, NODE_FINAL] == epoch:
        return radius
    return radius if size > 0 else math.inf
