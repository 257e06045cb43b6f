"""The import of stations: told by one source or several, united, placed on a graph's roads, and what became of them."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from typing import TYPE_CHECKING

from routing.errors import GraphFormatError
from routing.importers.osm_files import is_graphml
from routing.stations.duplicates import united
from routing.stations.files import NO_STATIONS, STATIONS_FILE, load_stations, stations_bytes
from routing.stations.formats.osm.reading import read_osm_stations
from routing.stations.opening import is_understood
from routing.stations.placing import place_stations
from routing.stations.station import Stations

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from pathlib import Path
    from typing import Protocol

    from routing.graph.road_graph import RoadGraph
    from routing.stations.formats.gathering import ReadStations
    from routing.stations.placing import FarStation
    from routing.stations.station import Station, StationSource

    class ReadSource(Protocol):
        """What was read of one source: its stations, not placed yet, and how many it left out, by reason."""

        @property
        def stations(self) -> tuple[Station, ...]:
            """The stations."""

        @property
        def source(self) -> StationSource:
            """Where they are from."""

        @property
        def left_out(self) -> Mapping[str, int]:
            """How many were left out, by reason."""


@dataclass(frozen=True, slots=True)
class StationsReport:
    """What became of stations that were told.

    read_count: how many, by source, with those that the graph had. repeated: of them, under an id that a later one has.
    kept: on the graph. united: with another one. left_out: by reason. far: those too
    far from a road, the nearest first. without_sockets: kept ones of which no socket is known; hours_unread: of which
    the opening hours are not understood.
    """

    read_count: Mapping[str, int]
    kept: int
    united: int
    left_out: Mapping[str, int]
    far: tuple[FarStation, ...]
    without_sockets: int
    hours_unread: int
    repeated: int = 0


def bring_in(
    graph: RoadGraph, read: Sequence[ReadSource], before: Stations | None = None
) -> tuple[Stations, StationsReport]:
    """The stations of all sources on a graph, duplicates united, with those that it had before.

    before: kept but for stations of the sources that are read now, which replace them; None: none. O(n log R).
    """
    sources: dict[str, StationSource] = {}
    every: list[Station] = []
    left_out: Counter[str] = Counter()
    fresh = {part.source.key for part in read}
    if before is not None:
        sources |= {source.key: source for source in before.sources if source.key not in fresh}
        every += [station for station in before.stations if station.source not in fresh]
    for part in read:
        if part.stations:
            sources[part.source.key] = part.source
        every += part.stations
        left_out.update(part.left_out)
    single, count = united(every)
    placed = place_stations(graph, single)
    left_out.update(placed.left_out)
    kept = placed.stations
    named = {reason: left_out[reason] for reason in sorted(left_out) if left_out[reason]}
    stations = Stations(kept, tuple(sources[key] for key in sorted(sources)), named)
    return stations, StationsReport(
        read_count=dict(sorted(Counter(station.source for station in every).items())),
        kept=len(kept),
        united=count,
        left_out=named,
        far=placed.far,
        without_sockets=sum(not station.sockets for station in kept),
        hours_unread=sum(
            station.opening_hours is not None and not is_understood(station.opening_hours) for station in kept
        ),
        repeated=len(every) - len({station.id for station in every}),
    )


@dataclass(frozen=True, slots=True)
class StationsBeside:
    """The stations that are written beside a graph that is imported, in files by name, and what became of them.

    problem: why those that the graph had before can't be read, "" where they can. read: of the map.
    """

    stations: Stations
    report: StationsReport
    files: Mapping[str, bytes]
    problem: str
    read: tuple[ReadStations, ...] = ()


def stations_beside(map_path: Path, graph: RoadGraph, place: Path) -> StationsBeside:
    """The stations of a map, with those of other sources that a graph in that place has, on the map's graph.

    No files where there are none. A map that is no OpenStreetMap file has none of its own. Raises ImportFailedError.
    """
    before, problem = NO_STATIONS, ""
    try:
        before = load_stations(place, graph)
    except GraphFormatError as error:
        problem = str(error)
    is_osm = not (map_path.suffix.lower() == ".graphml" or is_graphml(map_path))
    read = (read_osm_stations(map_path),) if is_osm else ()
    stations, report = bring_in(graph, read, before)
    files = {STATIONS_FILE: stations_bytes(graph, stations)} if stations.stations or report.left_out else {}
    return StationsBeside(stations, report, files, problem, read)
