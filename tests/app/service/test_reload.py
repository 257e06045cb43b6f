"""Graphs that change on disk under a running service."""

from __future__ import annotations

import json
import shutil
import threading
from dataclasses import replace
from pathlib import Path

import pytest
from starlette.testclient import TestClient

from app.main import create_app
from app.service.service import Service
from app.settings import Settings
from routing.errors import GraphFormatError, GraphNotFoundError
from routing.graph.files import save_graph
from routing.graph.road_graph import Terrain
from tests.app.conftest import VEHICLES, street_grid
from tests.app.expected import check_problem, database_in

TRIP = {"start": {"lat": 46.5, "lon": 8.0}, "goal": {"lat": 46.52, "lon": 8.02}, "soc": 0.5}


@pytest.fixture
def graphs(tmp_path: Path) -> Path:
    folder = tmp_path / "graphs"
    save_graph(street_grid("grid", Terrain.SYNTHETIC), folder / "grid")
    save_graph(street_grid("level", Terrain.ABSENT), folder / "level")
    return folder


@pytest.fixture
def running(graphs: Path, tmp_path: Path) -> Service:
    settings = Settings(
        graph_dirs=(graphs,), vehicle_dir=VEHICLES, database_url=database_in(tmp_path), default_graph="grid"
    )
    service = Service(settings)
    service.load_all()
    return service


def slower(name: str) -> object:
    """The grid with half the speed on all its streets."""
    grid = street_grid(name, Terrain.SYNTHETIC)
    return replace(grid, speed_limit_mps=0.5 * grid.speed_limit_mps)


def test_graphs_that_were_added_replaced_and_removed_are_taken_in(running: Service, graphs: Path) -> None:
    with TestClient(create_app(running.settings, running)) as client:
        before = client.post("/route", json={**TRIP, "graph": "grid"}).json()["routes"][0]
        tiles = client.get("/graphs/grid/tiles.json").json()["tiles"]
        save_graph(slower("grid"), graphs / "grid")
        save_graph(street_grid("new", Terrain.SYNTHETIC), graphs / "new")
        shutil.rmtree(graphs / "level")
        answered = client.post("/reload")
        assert answered.status_code == 200
        assert answered.json() == {"added": ["new"], "replaced": ["grid"], "removed": ["level"], "refused": []}
        after = client.post("/route", json={**TRIP, "graph": "grid"}).json()["routes"][0]
        assert after["duration_s"] > 1.5 * before["duration_s"]
        assert client.get("/graphs/grid/tiles.json").json()["tiles"] != tiles
        assert client.post("/route", json={**TRIP, "graph": "new"}).status_code == 200
        check_problem(client.post("/route", json={**TRIP, "graph": "level"}), 404, "unknown_graph")
        assert client.post("/reload").json() == {"added": [], "replaced": [], "removed": [], "refused": []}


def test_graph_that_is_damaged_stays_as_it_was(running: Service, graphs: Path) -> None:
    planner = running.atlas.planner("grid")
    path = graphs / "grid" / "length_m.npy"
    path.write_bytes(path.read_bytes()[:-8])
    meta = json.loads((graphs / "grid" / "meta.json").read_text())
    (graphs / "grid" / "meta.json").write_text(json.dumps(meta | {"attribution": "someone else"}))
    changed = running.reload_graphs()
    assert [refused.name for refused in changed.refused] == ["grid"]
    assert "length_m.npy" in changed.refused[0].reason
    assert running.atlas.planner("grid") is planner
    assert running.atlas.names == ("grid", "level")


def test_nothing_changes_without_the_default_graph(running: Service, graphs: Path) -> None:
    shutil.rmtree(graphs / "grid")
    save_graph(street_grid("new", Terrain.SYNTHETIC), graphs / "new")
    with pytest.raises(GraphNotFoundError, match="grid"):
        running.reload_graphs()
    assert running.atlas.names == ("grid", "level")


def test_nothing_changes_where_a_folder_cannot_be_looked_through(running: Service, graphs: Path) -> None:
    (graphs / "level" / "meta.json").write_text("{")
    with pytest.raises(GraphFormatError, match=r"meta\.json"):
        running.reload_graphs()
    with TestClient(create_app(running.settings, running)) as client:
        check_problem(client.post("/reload"), 409, "graph_damaged")
        assert client.post("/route", json={**TRIP, "graph": "level"}).status_code == 200


def test_no_request_fails_while_graphs_are_replaced(running: Service, graphs: Path) -> None:
    stop, statuses = threading.Event(), list[int]()
    with TestClient(create_app(running.settings, running)) as client:

        def ask() -> None:
            while not stop.is_set():
                statuses.append(client.post("/route", json={**TRIP, "graph": "grid"}).status_code)

        asking = threading.Thread(target=ask)
        asking.start()
        for k in range(6):
            save_graph(slower("grid") if k % 2 == 0 else street_grid("grid", Terrain.SYNTHETIC), graphs / "grid")
            assert client.post("/reload").json()["replaced"] == ["grid"]
        stop.set()
        asking.join()
    assert len(statuses) > 3
    assert set(statuses) == {200}
