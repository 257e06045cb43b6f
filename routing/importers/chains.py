"""Ways as chains of short steps, and the pieces of them that become links."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from routing.importers.roads import HALF_TURN_E7, eastward_e7, short_distance_m

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from routing.importers.roads import Roads

MERGE_BELOW_M: Final = 0.5  # shorter pieces become one node: below the precision of the map


@dataclass(frozen=True, slots=True)
class Chains:
    """Ways with points put in so that no step is longer than asked; Q positions over P points.

    first: int64 (W+1,) first position of a way; way: int64 (Q,) way of a position; point: int64 (Q,).
    step_m: float64 (Q,) distance to the next position of the way [m], 0 at its last.
    distance_m: float64 (Q,) distance from the way's first position [m].
    lon_e7, lat_e7: int32 (P,); the map's own points come first, map_points of them.
    """

    first: NDArray[np.int64]
    way: NDArray[np.int64]
    point: NDArray[np.int64]
    step_m: NDArray[np.float64]
    distance_m: NDArray[np.float64]
    lon_e7: NDArray[np.int32]
    lat_e7: NDArray[np.int32]
    map_points: int

    @property
    def point_count(self) -> int:
        """Number of points, those put in included."""
        return int(self.lon_e7.size)

    def steps(self) -> NDArray[np.int64]:
        """Positions from which a step leads to the next position, int64 (K,)."""
        last = np.zeros(self.point.size, np.bool_)
        last[self.first[1:] - 1] = True
        return np.flatnonzero(~last)


def chains_from_roads(roads: Roads, longest_step_m: float) -> Chains:
    """The ways of a map with points put in evenly wherever two points are further apart than longest_step_m."""
    ways = roads.ways
    count = ways.point.size
    is_last = np.zeros(count, np.bool_)
    is_last[ways.way_first[1:] - 1] = True
    here = ways.point.astype(np.int64)
    there = np.where(is_last, here, np.roll(here, -1))
    span_m = short_distance_m(roads.lon_e7[here], roads.lat_e7[here], roads.lon_e7[there], roads.lat_e7[there])
    parts = np.maximum(np.ceil(span_m / longest_step_m), 1.0).astype(np.int64)
    source = np.repeat(np.arange(count), parts)
    offset = np.arange(source.size) - np.repeat(np.cumsum(parts) - parts, parts)
    added = np.flatnonzero(offset)
    fraction = offset[added] / parts[source[added]]
    a, b = here[source[added]], there[source[added]]
    lon = roads.lon_e7[a] + np.rint(eastward_e7(roads.lon_e7[a], roads.lon_e7[b]) * fraction).astype(np.int64)
    lon -= np.where(np.abs(lon) > HALF_TURN_E7, np.sign(lon) * 2 * HALF_TURN_E7, 0)
    lat = roads.lat_e7[a] + np.rint((roads.lat_e7[b].astype(np.int64) - roads.lat_e7[a]) * fraction).astype(np.int64)
    point = here[source]
    point[added] = roads.point_id.size + np.arange(added.size)
    first = np.concatenate(([0], np.cumsum(parts)))[ways.way_first]
    way = np.repeat(np.arange(ways.id.size), np.diff(first))
    step_m = (span_m / parts)[source]
    if ways.stretch is not None:
        step_m = step_m * ways.stretch[way]
    before = np.cumsum(step_m) - step_m
    return Chains(
        first=first,
        way=way,
        point=point,
        step_m=step_m,
        distance_m=before - before[first[way]],
        lon_e7=np.concatenate((roads.lon_e7, lon)).astype(np.int32),
        lat_e7=np.concatenate((roads.lat_e7, lat)).astype(np.int32),
        map_points=int(roads.point_id.size),
    )


def junction_positions(chains: Chains) -> NDArray[np.bool_]:
    """Whether a position is a node of the graph: a way's end or a point passed more than once, bool (Q,)."""
    uses = np.bincount(chains.point, minlength=chains.point_count)
    node = uses[chains.point] > 1
    node[chains.first[:-1]] = True
    node[chains.first[1:] - 1] = True
    return node


@dataclass(frozen=True, slots=True)
class Pieces:
    """Parts of ways between two nodes; begin, end: int64 (K,) positions in Chains, ends included.

    tail, head: int64 (K,) points, those nearer than MERGE_BELOW_M made one; length_m: float64 (K,) > 0 [m].
    loops: how many pieces were left out because they led from a node to itself.
    """

    begin: NDArray[np.int64]
    end: NDArray[np.int64]
    tail: NDArray[np.int64]
    head: NDArray[np.int64]
    length_m: NDArray[np.float64]
    loops: int

    def without(self, chains: Chains, excluded: NDArray[np.bool_]) -> Pieces:
        """The pieces that pass none of the excluded points, bool (P,)."""
        before = np.concatenate(([0], np.cumsum(excluded[chains.point])))
        kept = before[self.end + 1] == before[self.begin]
        return Pieces(
            self.begin[kept], self.end[kept], self.tail[kept], self.head[kept], self.length_m[kept], self.loops
        )


def pieces_of(
    chains: Chains,
    node: NDArray[np.bool_],
    height_m: NDArray[np.float64] | None,
    grade_tolerance_m: float,
    longest_link_m: float,
) -> Pieces:
    """Pieces between nodes, divided where the height leaves the straight line, where too long, and within loops.

    height_m: float64 (P,) or None. Heights within a piece stay within grade_tolerance_m of the line between its ends
    (Douglas and Peucker's algorithm on distance and height).
    """
    node = node.copy()
    at = np.flatnonzero(node)
    same_way = chains.way[at[:-1]] == chains.way[at[1:]]
    begin, end = at[:-1][same_way], at[1:][same_way]
    length = chains.distance_m[end] - chains.distance_m[begin]
    closed = chains.point[begin] == chains.point[end]
    for b, e, parts in zip(
        begin.tolist(),
        end.tolist(),
        np.maximum(np.ceil(length / longest_link_m), np.where(closed, 2, 1)).astype(np.int64).tolist(),
        strict=True,
    ):
        if parts > 1 and e - b > 1:
            wanted = chains.distance_m[b] + (chains.distance_m[e] - chains.distance_m[b]) * np.arange(1, parts) / parts
            node[b + 1 + _nearest(chains.distance_m[b + 1 : e], wanted)] = True
    if height_m is not None:
        _cut_at_grades(chains, node, height_m[chains.point], grade_tolerance_m)
    at = np.flatnonzero(node)
    same_way = chains.way[at[:-1]] == chains.way[at[1:]]
    begin, end = at[:-1][same_way], at[1:][same_way]
    length = chains.distance_m[end] - chains.distance_m[begin]
    tail, head = chains.point[begin], chains.point[end]
    short = length < MERGE_BELOW_M
    if bool(short.any()):
        size = chains.point_count
        joined = coo_array((np.ones(int(short.sum())), (tail[short], head[short])), shape=(size, size))
        component = connected_components(joined, directed=False)[1]
        lowest = np.full(int(component.max()) + 1, size, np.int64)
        np.minimum.at(lowest, component, np.arange(size))
        tail, head = lowest[component[tail]], lowest[component[head]]
    loop = (tail == head) & ~short
    kept = ~short & ~loop
    return Pieces(begin[kept], end[kept], tail[kept], head[kept], length[kept], int(loop.sum()))


def _nearest(ascending: NDArray[np.float64], wanted: NDArray[np.float64]) -> NDArray[np.int64]:
    """Position of the value nearest to each wanted one, the first of equally near ones, int64 (k,)."""
    after = np.clip(np.searchsorted(ascending, wanted), 0, ascending.size - 1)
    before = np.maximum(after - 1, 0)
    nearer = np.abs(wanted - ascending[before]) <= np.abs(ascending[after] - wanted)
    nearest: NDArray[np.int64] = np.searchsorted(ascending, ascending[np.where(nearer, before, after)])
    return nearest


def _cut_at_grades(chains: Chains, node: NDArray[np.bool_], height_m: NDArray[np.float64], tolerance_m: float) -> None:
    """Mark the positions at which the height leaves the line between two nodes by more than the tolerance."""
    at = np.flatnonzero(node)
    same_way = chains.way[at[:-1]] == chains.way[at[1:]]
    stack = list(zip(at[:-1][same_way].tolist(), at[1:][same_way].tolist(), strict=True))
    distance = chains.distance_m
    while stack:
        b, e = stack.pop()
        if e - b < 2 or distance[e] <= distance[b]:
            continue
        slope = (height_m[e] - height_m[b]) / (distance[e] - distance[b])
        off = np.abs(height_m[b + 1 : e] - height_m[b] - slope * (distance[b + 1 : e] - distance[b]))
        worst = int(off.argmax())
        if off[worst] > tolerance_m:
            middle = b + 1 + worst
            node[middle] = True
            stack += [(b, middle), (middle, e)]
