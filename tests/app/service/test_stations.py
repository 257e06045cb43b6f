"""Stations that change on disk under a running service, or are damaged there."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from app.service.service import Service
from app.settings import Settings
from app.sharing.memory import can_share
from app.sharing.shelf import GraphShelf, OfferedGraphs
from app.sharing.sources import GraphsOnDisk
from app.stations.parameters import StationParameters
from routing.errors import GraphFormatError
from routing.graph.files import load_graph, save_graph
from routing.graph.folders import graph_folders
from routing.graph.road_graph import Terrain
from routing.stations.files import STATIONS_FILE, save_stations, stations_bytes
from tests.app.conftest import VEHICLES, street_grid
from tests.app.expected import database_in
from tests.app.stations_beside import grid_stations


@pytest.fixture
def graphs(tmp_path: Path) -> Path:
    folder = tmp_path / "graphs"
    grid = street_grid("grid", Terrain.SYNTHETIC)
    save_graph(grid, folder / "grid", {STATIONS_FILE: stations_bytes(grid, grid_stations(grid))})
    save_graph(street_grid("level", Terrain.ABSENT), folder / "level")
    return folder


@pytest.fixture
def running(graphs: Path, tmp_path: Path) -> Service:
    return Service(
        Settings(graph_dirs=(graphs,), vehicle_dir=VEHICLES, database_url=database_in(tmp_path), default_graph="grid")
    )


def count(service: Service, name: str) -> int:
    return service.stations(name).collection(StationParameters()).matched


def test_stations_are_loaded_with_their_graph_and_reloaded_with_it(running: Service, graphs: Path) -> None:
    for name in running.atlas.names:
        running.atlas.planner(name)
    assert (count(running, "grid"), count(running, "level")) == (4, 0)
    tag = running.stations("grid").tag(StationParameters())
    digest = running.tiles.graph_tiles("grid").digest
    for name in ("grid", "level"):
        graph = load_graph(graphs / name)
        every = grid_stations(graph)
        save_stations(graphs / name, graph, replace(every, stations=every.stations[:2]))
    assert (count(running, "grid"), count(running, "level")) == (4, 0)
    assert running.reload_graphs().replaced == ["grid", "level"]
    assert (count(running, "grid"), count(running, "level")) == (2, 2)
    assert running.stations("grid").tag(StationParameters()) != tag
    assert running.tiles.graph_tiles("grid").digest != digest
    assert running.reload_graphs().replaced == []
    (graphs / "grid" / STATIONS_FILE).unlink()
    assert running.reload_graphs().replaced == ["grid"]
    assert count(running, "grid") == 0


@pytest.mark.parametrize("content", [b"", b"nonsense", b'{"format_version": 1, "stations": 4}'])
def test_stations_that_are_damaged_stay_as_they_were(running: Service, graphs: Path, content: bytes) -> None:
    planner = running.atlas.planner("grid")
    (graphs / "grid" / STATIONS_FILE).write_bytes(content)
    changed = running.reload_graphs()
    assert [refused.name for refused in changed.refused] == ["grid"]
    assert STATIONS_FILE in changed.refused[0].reason
    assert running.atlas.planner("grid") is planner
    assert count(running, "grid") == 4


def test_a_service_starts_with_damaged_stations_and_says_what_is_wrong(running: Service, graphs: Path) -> None:
    (graphs / "grid" / STATIONS_FILE).write_bytes(b"[")
    for name in running.atlas.names:
        assert running.atlas.planner(name).graph.link_count == 24
    with pytest.raises(GraphFormatError, match=STATIONS_FILE):
        running.stations("grid")
    assert running.tiles.graph_tiles("grid").stations.stations.stations == ()
    grid = load_graph(graphs / "grid")
    save_stations(graphs / "grid", grid, grid_stations(grid))
    assert running.reload_graphs().replaced == ["grid"]
    assert count(running, "grid") == 4


@pytest.mark.skipif(not can_share(), reason="the system has no memory to share without a file")
def test_processes_that_share_a_graph_share_its_stations(graphs: Path) -> None:
    source = GraphsOnDisk(lambda: graph_folders((graphs,)))
    shelf = GraphShelf(source)
    shelf.refresh("grid")
    (graphs / "grid" / STATIONS_FILE).unlink()  # what happens on disk later changes nothing
    offered = OfferedGraphs(source)
    offered.take(*shelf.offers())
    stored = offered.load(graphs / "grid")
    assert stored.stations == grid_stations(stored.graph)
    assert stored.problem is None
    assert offered.load(graphs / "level").stations.stations == ()


@pytest.mark.skipif(not can_share(), reason="the system has no memory to share without a file")
def test_a_process_is_told_of_damaged_stations_by_the_one_that_read_them(graphs: Path) -> None:
    (graphs / "grid" / STATIONS_FILE).write_bytes(b"[")
    source = GraphsOnDisk(lambda: graph_folders((graphs,)))
    shelf = GraphShelf(source)
    shelf.refresh("grid")
    offered = OfferedGraphs(source)
    offered.take(*shelf.offers())
    stored = offered.load(graphs / "grid")
    assert stored.graph.link_count == 24
    with pytest.raises(GraphFormatError, match=STATIONS_FILE):
        stored.whole()
