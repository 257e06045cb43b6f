"""The use cases of single places on the roads: which are near, and how high they are."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from app.conversions.place import point_from_place
from app.service.graph_choice import graph_for
from routing.errors import PointFarFromRoadError, PointOutsideMapError
from routing.graph.road_graph import Terrain

if TYPE_CHECKING:
    from collections.abc import Sequence

    from app.schemas.range import RangeRequest
    from app.service.service import Service
    from routing.places import Point, SnappedPoint
    from routing.planner import Planner


@dataclass(frozen=True, slots=True)
class NearRoad:
    """A road near a place: where it is met, its end nodes and way by their outside ids, and its length [m]."""

    place: SnappedPoint
    nodes: tuple[int, int]
    way_id: int
    length_m: float


def roads_near(service: Service, sent: RangeRequest, count: int) -> list[NearRoad]:
    """The roads nearest to a request's origin, the nearest first.

    At most count, and none beyond the farthest that a place is moved. Raises as graph_for and Planner.snap do.
    """
    planner = _planner(service, sent)
    graph = planner.graph
    return [
        NearRoad(
            place,
            (int(graph.node_id[graph.tail[place.link_idx]]), int(graph.node_id[graph.head[place.link_idx]])),
            int(graph.way_id[place.link_idx]),
            float(graph.length_m[place.link_idx]),
        )
        for place in planner.near("origin", point_from_place(sent.origin), count)
    ]


def road_heights(service: Service, asked: Sequence[RangeRequest], places: Sequence[Point]) -> list[float | None]:
    """Height of the nearest road at each place [m]; None where none is near, or the graph has no heights.

    asked: requests that name the graph, or whose origin is on it; of several the first that is on any. Raises as
    graph_for does, but for places that are on none.
    """
    planner = None
    for sent in asked:
        try:
            planner = _planner(service, sent)
            break
        except PointOutsideMapError:
            continue
    if planner is None or planner.graph.meta.terrain is Terrain.ABSENT:
        return [None] * len(places)
    graph = planner.graph
    heights: list[float | None] = []
    for place in places:
        try:
            on = planner.snap("shape", place)
        except (PointOutsideMapError, PointFarFromRoadError):
            heights.append(None)
            continue
        ends = graph.node_height_m[[graph.tail[on.link_idx], graph.head[on.link_idx]]]
        heights.append(float(np.interp(on.offset_m / float(graph.length_m[on.link_idx]), (0.0, 1.0), ends)))
    return heights


def _planner(service: Service, sent: RangeRequest) -> Planner:
    name = graph_for(sent, service.atlas, service.settings.default_graph, service.settings.snap_limit_m)
    return service.atlas.planner(name)
