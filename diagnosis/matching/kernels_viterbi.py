"""Compiled: places on roads near positions, bounded searches from link to link, and the likeliest sequence of places.

Units: m, degrees for positions; costs are negative logarithms of likelihoods. Equation numbers are those of Newson and
Krumm, Hidden Markov map matching through noise and sparseness (2009, doi 10.1145/1653771.1653818).
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

import energy.compiled.cache  # noqa: F401  (sets the cache folder before anything is compiled)


class RoadArrays(NamedTuple):
    """What matching reads of a routing.graph.road_graph.RoadGraph; shapes and units as there."""

    length_m: NDArray[np.float64]
    successor_first: NDArray[np.int64]
    successor: NDArray[np.int32]
    geometry_first: NDArray[np.int64]
    geometry_lon_e7: NDArray[np.int32]
    geometry_lat_e7: NDArray[np.int32]


class Frontier(NamedTuple):
    """What one bounded search writes, for M links and S transitions; an entry counts where epoch has the search's."""

    entry_m: NDArray[np.float64]  # (M,) way from the start's end to the link's beginning
    parent: NDArray[np.int32]  # (M,) link before
    epoch: NDArray[np.int64]  # (M,)
    settled: NDArray[np.int64]  # (M,)
    heap_m: NDArray[np.float64]  # (S + 1,)
    heap_link: NDArray[np.int32]  # (S + 1,)
    counter: NDArray[np.int64]  # (2,): epoch of the last search, entries on the heap


class Places(NamedTuple):
    """Candidates of T samples: those of sample t are first[t] ≤ k < first[t + 1], each on a directed link.

    first: int64 (T+1,). link: int64 (C,). position_m: float64 (C,) from the link's beginning. cost: float64 (C,).
    """

    first: NDArray[np.int64]
    link: NDArray[np.int64]
    position_m: NDArray[np.float64]
    cost: NDArray[np.float64]


class Costs(NamedTuple):
    """Rates of the model: way in m for one unit of cost is scale_m + scale_frac·driven way; the rest are costs.

    level: of each transition, from the scale. back_m: a position may lie so far behind the last one on the same link.
    off: of a sample off all roads, times its weight. leave: of leaving the roads or coming back. split: of going on at
    a place that no way leads to. beam: states so much worse than the best are given up.
    """

    scale_m: float
    scale_frac: float
    level: float
    back_m: float
    off: float
    leave: float
    split: float
    beam: float


class Steps(NamedTuple):
    """What is known of a drive of T samples.

    driven_m: float64 (T−1,) way driven to the next sample. too_far: bool (T−1,) whether that is too far to be bridged.
    weight: float64 (T,) of each sample's emission.
    """

    driven_m: NDArray[np.float64]
    too_far: NDArray[np.bool_]
    weight: NDArray[np.float64]


class States(NamedTuple):
    """What the search writes of the C candidates and, C + t, of being off all roads at sample t, each (C + T,).

    total: least cost. before: the state before, −1 at the first sample. joined: whether a way leads from there.
    """

    total: NDArray[np.float64]
    before: NDArray[np.int64]
    joined: NDArray[np.bool_]


@njit(nogil=True, cache=True)
def project(
    roads: RoadArrays,
    metre_per_degree: float,
    lat_deg: NDArray[np.float64],
    lon_deg: NDArray[np.float64],
    link: NDArray[np.int64],
    position_m: NDArray[np.float64],
    distance_m: NDArray[np.float64],
    heading_rad: NDArray[np.float64],
) -> None:
    """Fill position, distance and heading there, float64 (n,), of the place on each link that is nearest to a point.

    In a plane that touches the earth at the point; of equally near places the first.
    """
    for k in range(link.size):
        begin, end = roads.geometry_first[link[k]], roads.geometry_first[link[k] + 1]
        shrink = metre_per_degree * math.cos(math.radians(lat_deg[k]))
        x_a = (roads.geometry_lon_e7[begin] * 1e-7 - lon_deg[k]) * shrink
        y_a = (roads.geometry_lat_e7[begin] * 1e-7 - lat_deg[k]) * metre_per_degree
        way, best, place, heading = 0.0, math.inf, 0.0, 0.0
        for g in range(begin + 1, end):
            x_b = (roads.geometry_lon_e7[g] * 1e-7 - lon_deg[k]) * shrink
            y_b = (roads.geometry_lat_e7[g] * 1e-7 - lat_deg[k]) * metre_per_degree
            dx, dy = x_b - x_a, y_b - y_a
            square = dx * dx + dy * dy
            if square > 0.0:
                share = min(max(-(x_a * dx + y_a * dy) / square, 0.0), 1.0)
                off = math.hypot(x_a + share * dx, y_a + share * dy)
                step = math.sqrt(square)
                if off < best:
                    best, place, heading = off, way + share * step, math.atan2(dx, dy)
                way += step
            x_a, y_a = x_b, y_b
        if way == 0.0:
            best = math.hypot(x_a, y_a)
        distance_m[k] = best
        position_m[k] = place * (roads.length_m[link[k]] / way) if way > 0.0 else 0.0
        heading_rad[k] = heading


@njit(nogil=True, cache=True)
def push(f: Frontier, key: float, link: int) -> None:
    """Put a link on the heap."""
    at = f.counter[1]
    f.counter[1] += 1
    while at > 0:
        up = (at - 1) // 2
        if f.heap_m[up] <= key:
            break
        f.heap_m[at], f.heap_link[at] = f.heap_m[up], f.heap_link[up]
        at = up
    f.heap_m[at], f.heap_link[at] = key, link


@njit(nogil=True, cache=True)
def pop(f: Frontier) -> int:
    """Take the nearest link off the heap."""
    nearest = f.heap_link[0]
    f.counter[1] -= 1
    size = f.counter[1]
    key, link = f.heap_m[size], f.heap_link[size]
    at = 0
    while 2 * at + 1 < size:
        down = 2 * at + 1
        if down + 1 < size and f.heap_m[down + 1] < f.heap_m[down]:
            down += 1
        if f.heap_m[down] >= key:
            break
        f.heap_m[at], f.heap_link[at] = f.heap_m[down], f.heap_link[down]
        at = down
    f.heap_m[at], f.heap_link[at] = key, link
    return int(nearest)


@njit(nogil=True, cache=True)
def search(roads: RoadArrays, f: Frontier, start: int, bound_m: float) -> int:
    """Way from the end of a link to the beginning of every link at most bound_m away; the epoch it is marked with.

    Dijkstra over permitted transitions, lengths positive; of equally long ways the first found. Each transition is
    looked at once, so that the heap holds at most S entries. The start itself is reached only where a loop comes back.
    """
    f.counter[0] += 1
    f.counter[1] = 0
    epoch = f.counter[0]
    at, way = start, 0.0
    while True:
        for s in range(roads.successor_first[at], roads.successor_first[at + 1]):
            link = roads.successor[s]
            if way <= bound_m and (f.epoch[link] != epoch or way < f.entry_m[link]):
                f.epoch[link] = epoch
                f.entry_m[link] = way
                f.parent[link] = at
                push(f, way, link)
        while True:
            if f.counter[1] == 0:
                return int(epoch)
            at = pop(f)
            if f.settled[at] != epoch:
                break
        f.settled[at] = epoch
        way = f.entry_m[at] + roads.length_m[at]


@njit(nogil=True, cache=True)
def way_m(
    roads: RoadArrays, f: Frontier, epoch: int, back_m: float, a: int, from_m: float, b: int, to_m: float
) -> float:
    """Way from a place on link a to one on link b after a search from a, inf where the search did not reach it."""
    if a == b and to_m >= from_m - back_m:
        return to_m - from_m
    if f.epoch[b] != epoch:
        return math.inf
    return float(roads.length_m[a] - from_m + f.entry_m[b] + to_m)


@njit(nogil=True, cache=True)
def likeliest(
    roads: RoadArrays,
    f: Frontier,
    places: Places,
    steps: Steps,
    costs: Costs,
    states: States,
) -> None:
    """Viterbi: fill the least cost of every state, the state before it and whether a way leads from there.

    Transitions cost |way on roads − way driven| over a scale, (2).
    """
    driven_m, too_far, weight = steps.driven_m, steps.too_far, steps.weight
    total, before, joined = states.total, states.before, states.joined
    T = places.first.size - 1
    C = places.link.size
    for k in range(places.first[0], places.first[1]):
        total[k], before[k] = places.cost[k], -1
    total[C], before[C] = weight[0] * costs.off, -1
    for t in range(T - 1):
        begin, end, beyond = places.first[t], places.first[t + 1], places.first[t + 2]
        best, best_at = math.inf, -1
        for i in range(begin, end):
            if total[i] < best:
                best, best_at = total[i], i
        off, next_off = C + t, C + t + 1
        free = 0.0 if too_far[t] else 1.0
        stay, go = total[off], best + free * costs.leave
        total[next_off] = min(stay, go) + weight[t + 1] * costs.off
        before[next_off] = off if stay <= go else best_at
        from_off, from_split = total[off] + free * costs.leave, best + free * costs.split
        for j in range(end, beyond):
            total[j] = min(from_off, from_split)
            before[j] = off if from_off <= from_split else best_at
            joined[j] = False
        if not too_far[t]:
            scale = costs.scale_m + costs.scale_frac * driven_m[t]
            least = min(best, total[off])
            for i in range(begin, end):
                if total[i] > least + costs.beam:
                    continue
                # what deviates more costs more than a split
                bound = driven_m[t] + costs.split * scale - (roads.length_m[places.link[i]] - places.position_m[i])
                epoch = search(roads, f, places.link[i], bound) if bound >= 0.0 else -1
                for j in range(end, beyond):
                    way = way_m(
                        roads,
                        f,
                        epoch,
                        costs.back_m,
                        places.link[i],
                        places.position_m[i],
                        places.link[j],
                        places.position_m[j],
                    )
                    if way == math.inf:
                        continue
                    cost = total[i] + costs.level + abs(way - driven_m[t]) / scale
                    if cost < total[j]:
                        total[j], before[j], joined[j] = cost, i, True
        for j in range(end, beyond):
            total[j] += places.cost[j]


@njit(nogil=True, cache=True)
def links_between(roads: RoadArrays, f: Frontier, a: int, b: int, bound_m: float, links: NDArray[np.int64]) -> int:
    """Fill the links after a up to and with b on the shortest way, last first; their number, −1 where none is found.

    bound_m: of the way between the end of a and the beginning of b. links: int64 (M,).
    """
    epoch = search(roads, f, a, bound_m)
    if f.epoch[b] != epoch:
        return -1
    count, at = 0, b
    while True:
        links[count] = at
        count += 1
        at = f.parent[at]
        if at == a:
            return count
