"""Graphs as they are listed and named in answers."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from app.schemas.graph import CutOff, GraphDetail, GraphSummary, RoadClassLength, TerrainNote
from energy.stops import FunctionalClass

if TYPE_CHECKING:
    from routing.graph.road_graph import RoadGraph


def terrain_note(graph: RoadGraph) -> TerrainNote:
    """What an answer says of the data it rests on."""
    meta = graph.meta
    return TerrainNote(
        graph=meta.name,
        terrain=meta.terrain,
        elevation_method=meta.elevation_method,
        smoothing_m=meta.smoothing_m,
        source=meta.source,
        attribution=meta.attribution,
        licence=meta.licence,
    )


def graph_summary(graph: RoadGraph, default_name: str) -> GraphSummary:
    """A graph's line in the list."""
    meta = graph.meta
    return GraphSummary(
        name=meta.name,
        source=meta.source,
        attribution=meta.attribution,
        licence=meta.licence,
        terrain=meta.terrain,
        elevation_method=meta.elevation_method,
        smoothing_m=meta.smoothing_m,
        bbox=meta.bbox,
        node_count=graph.node_count,
        link_count=graph.road_link_count,
        default=meta.name == default_name,
    )


def graph_detail(graph: RoadGraph, default_name: str) -> GraphDetail:
    """A graph with its extent by road class."""
    classes = []
    own = ~graph.is_copy()
    ferry, road = graph.is_ferry() & own, ~graph.is_ferry() & own
    chosen_by_name = {kind.name.lower(): (graph.functional_class == kind) & road for kind in FunctionalClass}
    if graph.ferries is not None:
        chosen_by_name["ferry"] = ferry
    for name, chosen in chosen_by_name.items():
        classes.append(
            RoadClassLength(
                functional_class=name,
                link_count=int(np.count_nonzero(chosen)),
                length_km=float(graph.length_m[chosen].sum()) / 1000.0,
            )
        )
    return GraphDetail(
        **graph_summary(graph, default_name).model_dump(),
        height_min_m=float(graph.node_height_m.min()),
        height_max_m=float(graph.node_height_m.max()),
        length_km=float(graph.length_m[own].sum()) / 1000.0,
        road_classes=classes,
        dropped=dict(graph.meta.dropped),
        cut_off=[
            CutOff(
                link_count=part.link_count,
                length_km=part.length_m / 1000.0,
                lat=part.lat_deg,
                lon=part.lon_deg,
                name=part.name,
            )
            for part in graph.meta.cut_off
        ],
    )
