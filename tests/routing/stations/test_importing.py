"""Stations of several sources on one graph, and what is said of them."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pytest

from energy.charging.charging import Connector
from routing.graph.files import load_graph, save_graph
from routing.graph.networkx_graph import write_graphml
from routing.importers.region import import_region
from routing.stations.files import STATIONS_FILE, load_stations, save_stations
from routing.stations.formats.osm.reading import read_osm_stations
from routing.stations.importing import bring_in, stations_beside
from routing.stations.station import Socket, Station, Stations, StationSource
from tests.routing.stations.drawn import SOURCE, TYPE2, station

STREET = {"highway": "residential"}
STATION = {"amenity": "charging_station", "socket:type2": "2", "socket:type2:output": "22 kW", "operator": "Town"}
POINTS = {1: (0, 0), 2: (1000, 0), 3: (1000, 1000), 4: (200, 10), 5: (300, 400)}
WAYS = {9: ([1, 2, 3], STREET)}
OTHER = StationSource("other", "another register", "CC-BY-4.0")


@dataclass(frozen=True)
class Read:
    stations: tuple[Station, ...]
    source: StationSource = SOURCE
    left_out: dict[str, int] = field(default_factory=dict)


def test_sources_are_united_placed_and_counted(draw_map: Any) -> None:
    town = import_region(draw_map(POINTS, WAYS), [], "town")
    mine = Read(
        (
            station("a", 200, 10, operator="Town", opening_hours="8 to 6"),
            station("far", 500, 400),
            station("beyond", 90_000, 0),
            station("bare", 800, 5, sockets=()),
        ),
        left_out={"without a place": 2},
    )
    theirs = Read((station("b", 210, 10, operator="Town", source="other", sockets=(TYPE2,)),), OTHER)
    kept, report = bring_in(town, [mine, theirs])
    assert [found.id for found in kept.stations] == ["drawn:a", "drawn:bare"]
    assert kept.stations[0].sockets == (TYPE2,)
    assert [source.key for source in kept.sources] == ["drawn", "other"]
    assert report.read_count == {"drawn": 4, "other": 1}
    assert (report.kept, report.united, report.without_sockets, report.hours_unread) == (2, 1, 1, 1)
    assert kept.left_out == report.left_out == {"outside the map": 1, "over 250 m from a road": 1, "without a place": 2}
    assert [far.id for far in report.far] == ["drawn:far"]


def test_stations_of_a_source_replace_those_it_had_and_others_stay(draw_map: Any) -> None:
    town = import_region(draw_map(POINTS, WAYS), [], "town")
    first, _ = bring_in(town, [Read((station("a", 200, 10), station("old", 700, 0)))])
    both, _ = bring_in(town, [Read((station("b", 500, 10, source="other"),), OTHER)], first)
    assert [found.id for found in both.stations] == ["drawn:a", "drawn:b", "drawn:old"]
    again, _ = bring_in(town, [Read((station("a", 200, 10),))], both)
    assert [found.id for found in again.stations] == ["drawn:a", "drawn:b"]
    assert [source.key for source in again.sources] == ["drawn", "other"]


def test_a_map_brings_its_stations_and_keeps_those_of_other_sources(draw_map: Any, tmp_path: Path) -> None:
    path, place = draw_map(POINTS, WAYS, {4: STATION}), tmp_path / "town"
    town = import_region(path, [], "town")
    beside = stations_beside(path, town, place)
    save_graph(town, place, beside.files)
    (found,) = load_stations(place, load_graph(place)).stations
    assert (found.id, found.sockets) == ("osm:n4", (Socket(Connector.TYPE2, 22_000.0, 2, 3),))
    more, _ = bring_in(town, [Read((station("b", 900, 10),))], load_stations(place, town))
    save_stations(place, town, more)
    longer = import_region(draw_map({**POINTS, 6: (1000, 2000)}, {9: ([1, 2, 3, 6], STREET)}, {4: STATION}), [], "town")
    save_graph(longer, place, stations_beside(path, longer, place).files)
    loaded = load_stations(place, load_graph(place))
    assert [found.id for found in loaded.stations] == ["drawn:b", "osm:n4"]
    assert [source.key for source in loaded.sources] == ["drawn", "osm"]


def test_a_map_without_stations_writes_no_file(draw_map: Any, tmp_path: Path) -> None:
    path = draw_map(POINTS, WAYS)
    town = import_region(path, [], "town")
    assert stations_beside(path, town, tmp_path / "town").files == {}
    write_graphml(town, tmp_path / "town.graphml")
    assert stations_beside(tmp_path / "town.graphml", town, tmp_path / "town").files == {}


def test_damaged_stations_of_the_graph_before_do_not_stop_an_import(draw_map: Any, tmp_path: Path) -> None:
    path, place = draw_map(POINTS, WAYS, {4: STATION}), tmp_path / "town"
    town = import_region(path, [], "town")
    save_graph(town, place, {STATIONS_FILE: b"nonsense"})
    beside = stations_beside(path, town, place)
    assert STATIONS_FILE in beside.problem
    save_graph(town, place, beside.files)
    assert len(load_stations(place, town).stations) == 1


@pytest.mark.parametrize("name", ["munich-centre"])
def test_stations_of_a_real_town_lie_on_its_roads(name: str, real_maps: Path) -> None:
    path = real_maps / f"{name}.osm.pbf"
    graph = import_region(path, [], name)
    kept, report = bring_in(graph, [read_osm_stations(path)])
    assert report.read_count == {"osm": 23}
    assert report.kept + report.united == 23
    assert all(found.position and found.snap_m < 50.0 for found in kept.stations)
    assert sum(found.capacity or 0 for found in kept.stations) == 2 * 23


def test_nothing_read_is_nothing_kept(draw_map: Any) -> None:
    town = import_region(draw_map(POINTS, WAYS), [], "town")
    kept, report = bring_in(town, [])
    assert kept == Stations((), ())
    assert report.kept == 0
