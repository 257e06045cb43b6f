"""The index that is written beside a graph: of its map, or of the graph itself where it has none to read."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from routing.errors import ImportFailedError
from routing.gazetteer.building import content_of
from routing.gazetteer.files import PLACES_FILE, index_bytes
from routing.gazetteer.graphs import streets_of
from routing.gazetteer.osm import PlaceReader
from routing.graph.earth import E7
from routing.importers.osm import read_osm

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping
    from pathlib import Path

    from routing.gazetteer.entries import Collected
    from routing.graph.road_graph import RoadGraph
    from routing.stations.station import Stations

RIM_DEG: Final = 0.05  # beyond the graph's extent
LEAST_INSIDE: Final = 0.1  # of the streets of a map, which may be larger than the graph; assumed


@dataclass(frozen=True, slots=True)
class PlacesBeside:
    """An index as files by name, how many things of each kind it has, and what was left out, by reason."""

    files: Mapping[str, bytes]
    counts: Mapping[str, int]
    left_out: Mapping[str, int]

    @property
    def size_bytes(self) -> int:
        """Of the file."""
        return sum(map(len, self.files.values()))


def places_beside(graph: RoadGraph, stations: Stations | None, found: Collected | None) -> PlacesBeside:
    """The index of a graph with its stations. found: what was read of its map, None for the graph's own roads only."""
    collected = streets_of(graph) if found is None else found
    content = content_of(collected, stations, graph.meta.name)
    attribution = f"{graph.meta.attribution}, {graph.meta.licence}"
    files = {PLACES_FILE: index_bytes(content, graph.meta.source, attribution)}
    return PlacesBeside(files, content.counts(), content.left_out)


def places_of_map(map_path: Path, graph: RoadGraph, progress: Callable[[float], None] | None = None) -> Collected:
    """What can be searched for on a graph's OpenStreetMap file.

    Raises ImportFailedError as its import does, and where most of its streets lie outside the graph.
    """
    reader = PlaceReader()
    read_osm(map_path, progress, beside=reader)
    pieces = reader.found.pieces
    west, south, east, north = graph.meta.bbox
    inside = sum(
        west - RIM_DEG <= piece.points[0] / E7 <= east + RIM_DEG
        and south - RIM_DEG <= piece.points[1] / E7 <= north + RIM_DEG
        for piece in pieces
    )
    if inside < LEAST_INSIDE * len(pieces):
        reason = f"{inside} of its {len(pieces)} streets lie on graph {graph.meta.name!r}, needed: the graph's own map"
        raise ImportFailedError("map", map_path, reason)
    return reader.found
