"""How far bands reach from their origin, as the crow flies by bearing and along roads."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from routing.graph.earth import METRE_PER_DEGREE
from routing.range.kernels_reach import (
    DONE,
    MISSING,
    BandEnergies,
    NodeHeap,
    Roads,
    Starts,
    farthest_crossings,
    meet_node,
    road_ends,
    settle_nodes,
)
from routing.time_budget import time_budget

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from routing.graph.road_graph import RoadGraph
    from routing.places import LinkPosition, Point
    from routing.range.area import RoadEnergies
    from routing.range.rings import AreaRings

BEARINGS: Final = 24  # from north on, clockwise


@dataclass(frozen=True, slots=True)
class RoadReach:
    """Distances along roads at which a band ends [m].

    nearest_m: of the nearest place at which the charge ends, None where it ends nowhere on the map. farthest_m: of the
    farthest place in reach.
    """

    nearest_m: float | None
    farthest_m: float


def bearing_reach_m(rings: AreaRings, origin: Point) -> NDArray[np.float64]:
    """Distance from an origin within rings to the farthest of them in each of BEARINGS directions, float64 [m].

    Straight lines in a plane that touches the earth at the origin.
    """
    home = np.array((origin.lon_deg, origin.lat_deg))
    scale = METRE_PER_DEGREE * np.array((np.cos(np.radians(origin.lat_deg)), 1.0))
    bearing = np.radians(np.arange(BEARINGS) * (360.0 / BEARINGS))
    farthest = np.zeros(BEARINGS)
    farthest_crossings(rings.lonlat, rings.ring_first, home, scale, np.sin(bearing), np.cos(bearing), farthest)
    return farthest


class RoadDistances:
    """Shortest distances along the roads of one graph; bans of turns are not looked at. Safe to share by threads."""

    def __init__(self, graph: RoadGraph) -> None:
        self._graph = graph
        self._outward = _roads(graph, graph.tail, graph.head)
        self._homeward = _roads(graph, graph.head, graph.tail)

    def of_nodes(
        self, places: Sequence[LinkPosition], wanted: NDArray[np.bool_], *, homeward: bool
    ) -> NDArray[np.float64]:
        """From a place, given by its position on each direction of its road, to wanted nodes or back, float64 (N,) [m].

        wanted: (N,). Infinite where no way leads; those of other nodes may be too long. In O(M log M); raises as
        TimeBudget.check does.
        """
        graph, roads = self._graph, self._homeward if homeward else self._outward
        room = roads.far.size + len(places)
        node_m = np.full(graph.node_count, np.inf)
        heap = NodeHeap(np.empty(room), np.empty(room, np.int32), np.zeros(2, np.int64))
        heap.counter[MISSING] = np.count_nonzero(wanted)
        starts = _starts(graph, places, homeward=homeward)
        away_m = starts.offset_m if homeward else graph.length_m[starts.link] - starts.offset_m
        for node, begun_m in zip(starts.far.tolist(), away_m.tolist(), strict=True):
            meet_node(node, begun_m, node_m, heap)
        while settle_nodes(roads, wanted, node_m, heap) != DONE:
            time_budget().check()
        return node_m

    def reach(
        self,
        node_m: NDArray[np.float64],
        energies: RoadEnergies,
        budget_j: float,
        places: Sequence[LinkPosition],
        *,
        homeward: bool,
    ) -> RoadReach:
        """How far along roads a budget [J] reaches; node_m: as of_nodes finds it for all nodes in reach, at least.

        The charge ends on links that lead from a node in reach to one that is not, or from the place itself.
        """
        roads = self._homeward if homeward else self._outward
        found = BandEnergies(energies.node_energy_j, energies.from_m, energies.to_m, energies.most_energy_j)
        starts = _starts(self._graph, places, homeward=homeward)
        nearest_m, farthest_m = road_ends(roads, found, budget_j, starts, node_m, homeward)
        return RoadReach(nearest_m if nearest_m < math.inf else None, farthest_m)


def _roads(graph: RoadGraph, near: NDArray[np.int32], far: NDArray[np.int32]) -> Roads:
    """Links by their near node; without copies, which lie on the others."""
    count = graph.road_link_count
    order = np.argsort(near[:count], kind="stable")
    first = np.searchsorted(near[:count][order], np.arange(graph.node_count + 1))
    return Roads(first, far[order], graph.length_m[order], order.astype(np.int32))


def _starts(graph: RoadGraph, places: Sequence[LinkPosition], *, homeward: bool) -> Starts:
    """A place, given by its position on each direction of its road, as the start of ways or their end."""
    link = np.array([place.link_idx for place in places], np.int64)
    offset_m = np.array([place.offset_m for place in places], np.float64)
    return Starts(link, offset_m, (graph.tail if homeward else graph.head)[link])
