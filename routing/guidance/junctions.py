"""The junctions of a route: the roads that meet at each, and which of them may be driven into."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from routing.guidance.bearings import leaving_deg
from routing.guidance.surroundings import RANKS, bits_of, surroundings_of

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from routing.graph.road_graph import RoadGraph


@dataclass(frozen=True, slots=True)
class Junctions:
    """Where each of K links of a route ends, lists of numbers, which are read one by one faster than arrays.

    first: K+1, the first road of each junction. Of each road, clockwise from north within a junction: out_link,
    in_link: links away from the junction and towards it, -1 where there is none. bearing_deg: away from it. entry:
    whether it may be driven into from the link that the route comes by. rank, bits: of its class and its sign. came: of
    each junction the road that the route comes by, -1 where it is none of them.
    """

    first: list[int]
    out_link: list[int]
    in_link: list[int]
    bearing_deg: list[float]
    entry: list[bool]
    rank: list[int]
    bits: list[int]
    came: list[int]

    def roads(self, at: int) -> range:
        """The roads of a junction."""
        return range(self.first[at], self.first[at + 1])


def junctions_after(graph: RoadGraph, link: NDArray[np.int64]) -> Junctions:
    """The junctions at the ends of links, int64 (K,), no copies among them."""
    around = surroundings_of(graph)
    node = graph.head[link].astype(np.int64)
    at, out = _rows(around.out_first, node)
    oneway_at, oneway = _rows(around.oneway_first, node)
    junction = np.concatenate((at, oneway_at))
    out_link = np.concatenate((out, np.full(oneway.size, -1)))
    in_link = np.concatenate((graph.reverse_idx[out], around.oneway[oneway])).astype(np.int64)
    either = np.where(out_link >= 0, out_link, in_link)
    bearing = leaving_deg(graph, either, out_link < 0)
    order = np.lexsort((out_link, bearing, junction))
    junction, out_link, in_link, either = junction[order], out_link[order], in_link[order], either[order]
    came = np.flatnonzero(
        (in_link == link[junction]) | ((out_link >= 0) & (out_link == graph.reverse_idx[link[junction]]))
    )
    came_at = np.full(link.size, -1)
    came_at[junction[came]] = came
    return Junctions(
        first=np.searchsorted(junction, np.arange(link.size + 1)).tolist(),
        out_link=out_link.tolist(),
        in_link=in_link.tolist(),
        bearing_deg=bearing[order].tolist(),
        entry=_entry(graph, link, junction, out_link).tolist(),
        rank=RANKS[graph.functional_class[either]].tolist(),
        bits=bits_of(graph, either).tolist(),
        came=came_at.tolist(),
    )


def _rows(first: NDArray[np.int64], node: NDArray[np.int64]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Which of the nodes each row is of, and the rows, int64 each; first: int64 (N+1,)."""
    begin, count = first[node], first[node + 1] - first[node]
    at = np.repeat(np.arange(node.size), count)
    return at, np.arange(at.size) + np.repeat(begin - (np.cumsum(count) - count), count)


def _entry(
    graph: RoadGraph, link: NDArray[np.int64], junction: NDArray[np.int64], out_link: NDArray[np.int64]
) -> NDArray[np.bool_]:
    """Whether a road may be driven into: its link follows that of the route, itself or as a copy."""
    at, row = _rows(graph.successor_first, link)
    follows = graph.successor[row].astype(np.int64)
    if graph.copies is not None:
        copy = follows >= graph.road_link_count
        follows[copy] = graph.copies.of[follows[copy] - graph.road_link_count]
    size = graph.link_count
    return np.isin(junction * size + out_link, at * size + follows) & (out_link >= 0)
