"""How far bands reach from their origin, as the crow flies by bearing and along roads."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np
import shapely
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra

from routing.graph.earth import METRE_PER_DEGREE

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from routing.graph.road_graph import RoadGraph
    from routing.places import LinkPosition, Point
    from routing.range.area import RoadEnergies

BEARINGS: Final = 24  # from north on, clockwise


@dataclass(frozen=True, slots=True)
class RoadReach:
    """Distances along roads at which a band ends [m].

    nearest_m: of the nearest place at which the charge ends, None where it ends nowhere on the map. farthest_m: of the
    farthest place in reach.
    """

    nearest_m: float | None
    farthest_m: float


def bearing_reach_m(area: shapely.MultiPolygon, origin: Point) -> NDArray[np.float64]:
    """Distance from an origin within an area to its farthest edge in each of BEARINGS directions, float64 [m].

    Straight lines in a plane that touches the earth at the origin.
    """
    scale = METRE_PER_DEGREE * np.array((np.cos(np.radians(origin.lat_deg)), 1.0))
    _, points, (ring_first, _, _) = shapely.to_ragged_array([area])
    x, y = ((points - (origin.lon_deg, origin.lat_deg)) * scale).T
    joined = np.ones(x.size - 1, np.bool_)
    joined[ring_first[1:-1] - 1] = False
    farthest = np.zeros(BEARINGS)
    for k, bearing in enumerate(np.radians(np.arange(BEARINGS) * (360.0 / BEARINGS))):
        east, north = float(np.sin(bearing)), float(np.cos(bearing))
        aside, ahead = x * north - y * east, x * east + y * north
        crossed = np.flatnonzero(joined & ((aside[:-1] < 0.0) != (aside[1:] < 0.0)))
        part = aside[crossed] / (aside[crossed] - aside[crossed + 1])
        farthest[k] = (ahead[crossed] + part * (ahead[crossed + 1] - ahead[crossed])).max(initial=0.0)
    return farthest


class RoadDistances:
    """Shortest distances along the roads of one graph; bans of turns are not looked at. Safe to share by threads."""

    def __init__(self, graph: RoadGraph) -> None:
        self._graph = graph
        order = np.argsort(graph.head, kind="stable")
        self._outward = _Roads(np.arange(graph.link_count), graph.tail, graph.head)
        self._homeward = _Roads(order, graph.head[order], graph.tail[order])

    def of_nodes(self, places: Sequence[LinkPosition], *, homeward: bool) -> NDArray[np.float64]:
        """From a place, given by its position on each direction of its road, to every node or back, float64 (N,) [m].

        Infinite where no way leads. In O(M log N).
        """
        graph, roads = self._graph, self._homeward if homeward else self._outward
        length_m = graph.length_m[roads.order]
        begun = [_begun(graph, place, homeward=homeward) for place in places]
        first = np.searchsorted(roads.near, np.arange(graph.node_count + 1))
        weight = np.concatenate((length_m, [away_m for _, away_m in begun]))
        column = np.concatenate((roads.far, [node for node, _ in begun])).astype(np.int32)
        shape = (graph.node_count + 1, graph.node_count + 1)
        matrix = csr_array((weight, column, np.append(first, weight.size)), shape=shape)
        found: NDArray[np.float64] = dijkstra(matrix, indices=[graph.node_count])[0, :-1]
        return found

    def reach(
        self,
        node_m: NDArray[np.float64],
        energies: RoadEnergies,
        budget_j: float,
        places: Sequence[LinkPosition],
        *,
        homeward: bool,
    ) -> RoadReach:
        """How far along roads a budget [J] reaches; node_m: as of_nodes finds it.

        The charge ends on links that lead from a node in reach to one that is not, or from the place itself.
        """
        graph, node_j = self._graph, energies.node_energy_j
        near, far = (graph.head, graph.tail) if homeward else (graph.tail, graph.head)
        driven = energies.to_m >= energies.from_m
        leaves = np.flatnonzero((node_j[near] <= budget_j) & (node_j[far] > budget_j))
        driven_m = graph.length_m[leaves] - energies.from_m[leaves] if homeward else energies.to_m[leaves]
        driven_m = np.where(driven[leaves], driven_m, 0.0)  # the charge does not suffice for going on
        begin_m, begin_j, end_j = node_m[near[leaves]], node_j[near[leaves]], node_j[far[leaves]]
        for place in places:
            link = place.link_idx
            if driven[link] and node_j[far[link]] > budget_j:
                end_m = place.offset_m - energies.from_m[link] if homeward else energies.to_m[link] - place.offset_m
                driven_m, begin_m = np.append(driven_m, end_m), np.append(begin_m, 0.0)
                begin_j, end_j = np.append(begin_j, 0.0), np.append(end_j, node_j[far[link]])
        span_j = np.minimum(end_j, energies.most_energy_j) - begin_j
        part = np.divide(budget_j - begin_j, span_j, out=np.ones(span_j.size), where=span_j > 0.0)
        end_m = begin_m + np.clip(part, 0.0, 1.0) * np.maximum(driven_m, 0.0)
        inside_m = node_m[(node_j <= budget_j) & np.isfinite(node_m)]
        farthest_m = float(np.concatenate((inside_m, end_m)).max(initial=0.0))
        return RoadReach(float(end_m.min()) if end_m.size else None, farthest_m)


@dataclass(frozen=True, slots=True)
class _Roads:
    """Links sorted by the node at which they are entered: their numbers, that node and the other one, (M,) each."""

    order: NDArray[np.int64]
    near: NDArray[np.int32]
    far: NDArray[np.int32]


def _begun(graph: RoadGraph, place: LinkPosition, *, homeward: bool) -> tuple[int, float]:
    """The node at which a link that is begun, or ended, at a place ends, or begins, and how far it is [m]."""
    link = place.link_idx
    if homeward:
        return int(graph.tail[link]), place.offset_m
    return int(graph.head[link]), float(graph.length_m[link]) - place.offset_m
