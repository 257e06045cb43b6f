"""The streets of a graph, for an index where there is no map to read: of synthetic regions and GraphML."""

from __future__ import annotations

from array import array
from typing import TYPE_CHECKING

import numpy as np

from energy.stops import FunctionalClass
from routing.gazetteer.entries import Collected, Piece

if TYPE_CHECKING:
    from routing.graph.road_graph import RoadGraph


def streets_of(graph: RoadGraph) -> Collected:
    """The named roads of a graph, each direction pair once; it knows no places and no house numbers."""
    link = np.arange(graph.road_link_count)
    forward = (graph.reverse_idx[link] < 0) | (link < graph.reverse_idx[link])
    is_osm = graph.meta.licence.startswith("ODbL")
    pieces = []
    for k in link[forward].tolist():
        name = graph.names[graph.name_idx[k]] if graph.name_idx[k] >= 0 else ""
        begin, end = graph.geometry_first[k], graph.geometry_first[k + 1]
        if not name or end - begin < 2:
            continue
        points = np.column_stack((graph.geometry_lon_e7[begin:end], graph.geometry_lat_e7[begin:end]))
        value = FunctionalClass(int(graph.functional_class[k])).name.lower()  # as the values of highway
        pieces.append(
            Piece(int(graph.way_id[k]) if is_osm else 0, name, {}, value, array("i", points.astype(np.int32).tobytes()))
        )
    return Collected(pieces=pieces)
