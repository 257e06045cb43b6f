"""Compiled: the least that is still to be paid from a node to the goal, found backwards as far as it is asked for.

A search back from the goal over nodes, with the least cost of each link whatever it is entered with, runs just as far
as the search from the start asks (docs/search-goal.md). It is itself directed to the start by the straight line. What
it has not reached costs at least its radius, less what is left from there to the start.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from energy.compiled.kernels_borrow import borrowed
from energy.force.kernels_physics import LinkPhysics, borrowed_physics
from routing.kernels_heap import heap_drop, heap_push
from routing.lower_bound.kernels_least import Reduction, least_towards_any

# columns of the table of links by the node that they lead into
INTO_J, INTO_S, INTO_M, INTO_TAIL = range(4)
# columns of a node: least cost to the goal so far, and whether it is known and final, as numbers of the search
NODE_COST, NODE_SEEN, NODE_FINAL = range(3)

HEAP_SIZE = 0
RADIUS, FARTHEST = range(2)
# what is this much farther from the goal than the start, and as far again, is on no way that matters
FARTHEST_FRAC = 1.25
FARTHEST_J, FARTHEST_S, FARTHEST_M = 5e5, 60.0, 1000.0


class GoalBound(NamedTuple):
    """Least costs to the goal, for one search.

    used: false where the search is not directed. into_first: (N + 1,), into: (M, 4) links by head, their energy and
    time NaN until they are asked for; into_link: (M,) their numbers. tail: (M,) node of each link. entry: (M, 3) of
    kernels_least. physics: without what only adds energy. row, roads, successor_first, successor: as in the search.
    place_m: (N, 3) of nodes in space, start_m: (3,) where the search back is led. least_a_metre: (3,) least energy [J],
    time [s] and distance [m] of a metre of road; line_to_road: least metres of road for one of straight line, at most
    1. node: (N, 3). heap_key, heap_node: for all links and goals. in_heap: nodes that the search back has in its heap;
    reach: how far it has come; epoch: its number.
    """

    used: bool
    into_first: NDArray[np.int64]
    into: NDArray[np.float64]
    into_link: NDArray[np.int32]
    tail: NDArray[np.int32]
    entry: NDArray[np.float64]
    physics: LinkPhysics
    reduction: Reduction
    row: NDArray[np.float64]
    roads: NDArray[np.float64]
    successor_first: NDArray[np.int64]
    successor: NDArray[np.int32]
    place_m: NDArray[np.float64]
    start_m: NDArray[np.float64]
    least_a_metre: NDArray[np.float64]
    line_to_road: float
    node: NDArray[np.float64]
    heap_key: NDArray[np.float64]
    heap_node: NDArray[np.int32]
    in_heap: NDArray[np.int64]
    reach: NDArray[np.float64]
    epoch: float


@njit(nogil=True, cache=True, inline="always")
def borrowed_goal_bound(h: GoalBound) -> GoalBound:
    """The same with borrowed arrays."""
    return GoalBound(
        h.used,
        borrowed(h.into_first),
        borrowed(h.into),
        borrowed(h.into_link),
        borrowed(h.tail),
        borrowed(h.entry),
        borrowed_physics(h.physics),
        h.reduction,
        borrowed(h.row),
        borrowed(h.roads),
        borrowed(h.successor_first),
        borrowed(h.successor),
        borrowed(h.place_m),
        borrowed(h.start_m),
        borrowed(h.least_a_metre),
        h.line_to_road,
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
def least_into(h: GoalBound, k: int) -> tuple[float, float]:
    """Compute least energy above the potential [J] and least time [s] of a link, by its place in `into`, and keep them.

    They are no less than the straight line is counted with, so that what a search back settles is final.
    """
    least_j, least_s = least_towards_any(
        h.physics, h.reduction, h.row, h.roads, h.successor_first, h.successor, h.entry, h.into_link[k]
    )
    length_m = h.into[k, INTO_M]
    least_j, least_s = max(least_j, h.least_a_metre[0] * length_m), max(least_s, h.least_a_metre[1] * length_m)
    h.into[k, INTO_J], h.into[k, INTO_S] = least_j, least_s  # other searches find both, or compute them too
    return least_j, least_s


@njit(nogil=True, cache=True)
def lower_levels(h: GoalBound, power_w: float, level_j: NDArray[np.float64]) -> None:
    """Lower the level of each node, float64 (N,) [J], to the least of all nodes' levels and the way there together.

    A way takes at least the least costs of its links and power_w for their least times, ≥ 0. The heap of h must have
    room for all nodes and links. O(M log M).
    """
    h = borrowed_goal_bound(h)
    size = 0
    for n in range(level_j.size):
        heap_push(h.heap_key, h.heap_node, size, level_j[n], n)
        size += 1
    while size > 0:
        n, level = h.heap_node[0], h.heap_key[0]
        heap_drop(h.heap_key, h.heap_node, size)
        size -= 1
        if level > level_j[n]:
            continue
        for k in range(h.into_first[n], h.into_first[n + 1]):
            least_j, least_s = least_into(h, k)
            before = int(h.into[k, INTO_TAIL])
            lowered = level + least_j + power_w * least_s
            if lowered < level_j[before]:
                level_j[before] = lowered
                heap_push(h.heap_key, h.heap_node, size, lowered, before)
                size += 1


@njit(nogil=True, cache=True)
def set_out(h: GoalBound, goal_node: NDArray[np.int64]) -> None:
    """Begin a search back from the nodes at which the goals' links begin; their order among each other is free."""
    h.in_heap[HEAP_SIZE] = 0
    h.reach[RADIUS], h.reach[FARTHEST] = 0.0, math.inf
    for k in range(goal_node.size):
        n = goal_node[k]
        h.node[n, NODE_COST], h.node[n, NODE_SEEN] = 0.0, h.epoch
        heap_push(h.heap_key, h.heap_node, h.in_heap[HEAP_SIZE], 0.0, n)
        h.in_heap[HEAP_SIZE] += 1


@njit(nogil=True, cache=True)
def straight_m(place_m: NDArray[np.float64], start_m: NDArray[np.float64], node: int) -> float:
    """Distance of a node from the start in space, below that along any road."""
    east, north, up = place_m[node, 0] - start_m[0], place_m[node, 1] - start_m[1], place_m[node, 2] - start_m[2]
    return math.sqrt(east * east + north * north + up * up)


@njit(nogil=True, cache=True)
def most_straight(
    place_m: NDArray[np.float64], tail: NDArray[np.int32], head: NDArray[np.int32], length_m: NDArray[np.float64]
) -> float:
    """Greatest ratio of the straight line to the length of a link; lengths may be measured otherwise."""
    most = 0.0
    for k in range(tail.size):
        most = max(most, straight_m(place_m, place_m[tail[k]], head[k]) / length_m[k])
    return most


@njit(nogil=True, cache=True)
def cost_to_goal(h: GoalBound, energy_weight: float, time_weight: float, distance_weight: float, asked: int) -> float:
    """Least cost from a node to the goal, or less where it is far; inf where no road leads there. h: borrowed."""
    into_first, into, node = h.into_first, h.into, h.node
    heap_key, heap_node, epoch = h.heap_key, h.heap_node, h.epoch
    size = h.in_heap[HEAP_SIZE]
    radius: float = h.reach[RADIUS]
    farthest = h.reach[FARTHEST]
    if node[asked, NODE_FINAL] == epoch:
        known: float = node[asked, NODE_COST]
        return known
    place_m, start_m = h.place_m, h.start_m
    road_j, road_s, road_m = h.least_a_metre[0], h.least_a_metre[1], h.least_a_metre[2]
    a_metre = (energy_weight * road_j + time_weight * road_s + distance_weight * road_m) * h.line_to_road
    while size > 0 and radius < farthest:
        n = heap_node[0]
        radius = heap_key[0]
        heap_drop(heap_key, heap_node, size)
        size -= 1
        if node[n, NODE_FINAL] == epoch:
            continue
        node[n, NODE_FINAL] = epoch
        cost = node[n, NODE_COST]
        for k in range(into_first[n], into_first[n + 1]):
            before = int(into[k, INTO_TAIL])
            if node[before, NODE_FINAL] == epoch:
                continue
            least_j, least_s = into[k, INTO_J], into[k, INTO_S]
            if math.isnan(least_j + least_s):
                least_j, least_s = least_into(h, k)
            so_far = cost + energy_weight * least_j + time_weight * least_s + distance_weight * into[k, INTO_M]
            if node[before, NODE_SEEN] != epoch or so_far < node[before, NODE_COST]:
                node[before, NODE_COST], node[before, NODE_SEEN] = so_far, epoch
                key = so_far + a_metre * straight_m(place_m, start_m, before)
                heap_push(heap_key, heap_node, size, key, before)
                size += 1
        if n == asked:
            break
    h.in_heap[HEAP_SIZE] = size
    h.reach[RADIUS] = radius
    if node[asked, NODE_FINAL] == epoch:
        found: float = node[asked, NODE_COST]
        return found
    return max(radius - a_metre * straight_m(place_m, start_m, asked), 0.0) if size > 0 else math.inf
