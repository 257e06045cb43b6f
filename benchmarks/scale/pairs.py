"""Places some way apart, the same kind of pair on a graph of any size."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from routing.graph.earth import great_circle_m
from routing.places import Point

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from routing.graph.road_graph import RoadGraph

APART_M: Final = 25_000.0
WITHIN_FRAC: Final = 0.05  # of the distance
RIM_M: Final = 30_000.0  # from the map's rim: a search from there ends on the map as on a larger one
TRIES: Final = 1000


@dataclass(frozen=True, slots=True)
class NodePair:
    """Two places at nodes."""

    start: Point
    goal: Point


def draw_pairs(graph: RoadGraph, count: int, rng: np.random.Generator, apart_m: float = APART_M) -> list[NodePair]:
    """Random nodes some way apart as the crow flies, the first away from the map's rim where the map is that large.

    Raises ValueError where the map is too small for the distance.
    """
    inner = _inner_nodes(graph, RIM_M)
    pairs: list[NodePair] = []
    for _ in range(TRIES * count):
        if len(pairs) == count:
            return pairs
        start = int(inner[rng.integers(inner.size)])
        goals = _nodes_apart(graph, start, apart_m)
        if goals.size:
            pairs.append(NodePair(node_point(graph, start), node_point(graph, int(rng.choice(goals)))))
    raise ValueError(f"graph {graph.meta.name!r}: hardly any nodes are {apart_m / 1000.0:g} km apart")


def node_point(graph: RoadGraph, node: int) -> Point:
    """Where a node is."""
    return Point(float(graph.node_lat_deg[node]), float(graph.node_lon_deg[node]))


def _inner_nodes(graph: RoadGraph, rim_m: float) -> NDArray[np.intp]:
    """Nodes away from the map's bounds, or all of them where there are none."""
    west, south, east, north = graph.meta.bbox
    lat, lon = graph.node_lat_deg, graph.node_lon_deg
    to_rim = np.minimum(
        np.minimum(great_circle_m(lat, lon, lat, west), great_circle_m(lat, lon, lat, east)),
        np.minimum(great_circle_m(lat, lon, south, lon), great_circle_m(lat, lon, north, lon)),
    )
    inner = np.flatnonzero(to_rim >= rim_m)
    return inner if inner.size else np.arange(graph.node_count)


def _nodes_apart(graph: RoadGraph, node: int, apart_m: float) -> NDArray[np.intp]:
    lat, lon = graph.node_lat_deg[node], graph.node_lon_deg[node]
    near_deg = np.degrees(apart_m / 6.3e6) * 1.1  # a band of latitude spares most of the distances
    band = np.flatnonzero(np.abs(graph.node_lat_deg - lat) < near_deg)
    away_m = great_circle_m(lat, lon, graph.node_lat_deg[band], graph.node_lon_deg[band])
    return band[np.abs(away_m - apart_m) <= WITHIN_FRAC * apart_m]
