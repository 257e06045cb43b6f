"""The use cases of single places on the roads: which are near, and how high they are."""

from __future__ import annotations

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


def roads_near(service: Service, sent: RangeRequest, count: int) -> tuple[list[SnappedPoint], list[tuple[int, int]]]:
    """The nearest place on each of the roads nearest to a request's origin, and the ids of the road's end nodes.

    The nearest one first; at most count, and none beyond the farthest that a place is moved. Raises as graph_for and
    Planner.snap do.
    """
    name = graph_for(sent, service.atlas, service.settings.default_graph, service.settings.snap_limit_m)
    planner = service.atlas.planner(name)
    graph = planner.graph
    places = planner.near("origin", point_from_place(sent.origin), count)
    return places, [
        (int(graph.node_id[graph.tail[place.link_idx]]), int(graph.node_id[graph.head[place.link_idx]]))
        for place in places
    ]


def road_heights(service: Service, sent: RangeRequest, places: Sequence[Point]) -> list[float | None]:
    """Height of the nearest road at each place [m]; None where none is near, or the graph has no heights.

    sent: a request that names the graph, or whose origin is on it. Raises as graph_for does.
    """
    name = graph_for(sent, service.atlas, service.settings.default_graph, service.settings.snap_limit_m)
    planner = service.atlas.planner(name)
    graph = planner.graph
    if graph.meta.terrain is Terrain.ABSENT:
        return [None] * len(places)
    heights: list[float | None] = []
    for place in places:
        try:
            on = planner.snap("shape", place)
        except (PointOutsideMapError, PointFarFromRoadError):
            heights.append(None)
            continue
        ends = graph.node_height_m[[graph.tail[on.link_idx], graph.head[on.link_idx]]]
        share = on.offset_m / float(graph.length_m[on.link_idx])
        heights.append(float(np.interp(share, (0.0, 1.0), ends)))
    return heights
