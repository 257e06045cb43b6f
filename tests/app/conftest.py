"""A hand-made street grid, the service on it, and its HTTP client."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pytest
from starlette.testclient import TestClient

from app.main import create_app
from app.service.service import Service
from app.settings import Settings
from energy.stops import Cross, FunctionalClass
from routing.graph.earth import great_circle_m
from routing.graph.files import save_graph
from routing.graph.road_graph import GraphMeta, LooseLinks, LooseNodes, RoadGraph, Terrain, assemble_graph
from tests.app.expected import database_in

if TYPE_CHECKING:
    from collections.abc import Iterator

    from fastapi import FastAPI

VEHICLES = Path(__file__).resolve().parents[2] / "data" / "vehicles"
SIDE = 3
SPACING_DEG = 0.01
SOUTH, WEST = 46.5, 8.0
# 6 --- 7 --- 8     every street is 0.01° long and runs both ways;
# |     |     |     node 4 in the middle lies 60 m above the corners
# 3 --- 4 --- 5     and has signals in all directions
# |     |     |
# 0 --- 1 --- 2
HEIGHTS_M = (500.0, 520.0, 500.0, 530.0, 560.0, 530.0, 500.0, 510.0, 500.0)


def street_grid(name: str, terrain: Terrain) -> RoadGraph:
    """Nine nodes, twelve streets, 24 directed links."""
    lat = np.repeat(SOUTH + SPACING_DEG * np.arange(SIDE), SIDE)
    lon = np.tile(WEST + SPACING_DEG * np.arange(SIDE), SIDE)
    height = np.array(HEIGHTS_M) if terrain is not Terrain.ABSENT else np.zeros(SIDE * SIDE)
    pairs = [(n, n + 1) for n in range(9) if n % SIDE < SIDE - 1] + [(n, n + SIDE) for n in range(6)]
    both_ways = [pair for a, b in pairs for pair in ((a, b), (b, a))]
    tail, head = (np.array(ends, np.int32) for ends in zip(*both_ways, strict=True))
    count = tail.size
    corners = np.column_stack((tail, head)).ravel()
    ways = np.repeat(np.arange(count // 2), 2)
    return assemble_graph(
        GraphMeta(
            name=name,
            source="drawn by hand for tests",
            licence="CC0-1.0",
            attribution="none needed",
            terrain=terrain,
            elevation_method="by hand" if terrain is not Terrain.ABSENT else "none",
            smoothing_m=0.0,
            bbox=(0.0, 0.0, 0.0, 0.0),
        ),
        tuple(f"Street {way}" for way in range(count // 2)),
        LooseNodes(lat_deg=lat, lon_deg=lon, height_m=height, id=np.arange(9, dtype=np.int64)),
        LooseLinks(
            tail=tail,
            head=head,
            length_m=np.asarray(great_circle_m(lat[tail], lon[tail], lat[head], lon[head]), np.float64),
            speed_limit_mps=np.where(ways % 3 == 0, 80.0, 50.0) / 3.6,
            functional_class=np.full(count, FunctionalClass.TERTIARY, np.int8),
            cross=np.where(head == 4, Cross.LARGE, Cross.NONE).astype(np.int8),
            urban=ways % 2 == 0,
            structure=np.zeros(count, bool),
            way_id=ways.astype(np.int64),
            name_idx=ways.astype(np.int32),
            geometry_first=np.arange(0, 2 * count + 1, 2, dtype=np.int64),
            geometry_lon_e7=np.round(lon[corners] * 1e7).astype(np.int32),
            geometry_lat_e7=np.round(lat[corners] * 1e7).astype(np.int32),
            forbidden_turns=np.empty((0, 2), np.int64),
        ),
    )


@pytest.fixture(scope="session")
def graph_dir(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with two stored graphs: `grid` with hills and `level` without terrain."""
    folder = tmp_path_factory.mktemp("graphs")
    save_graph(street_grid("grid", Terrain.SYNTHETIC), folder / "grid")
    save_graph(street_grid("level", Terrain.ABSENT), folder / "level")
    return folder


@pytest.fixture(scope="session")
def settings(graph_dir: Path, tmp_path_factory: pytest.TempPathFactory) -> Settings:
    """Settings that point to the hand-made graphs, the bundled vehicles and an empty database."""
    return Settings(
        graph_dirs=(graph_dir,),
        vehicle_dir=VEHICLES,
        database_url=database_in(tmp_path_factory.mktemp("database")),
        default_graph="grid",
        body_limit_bytes=100_000,
        cors_origins=("https://map.example",),
    )


@pytest.fixture(scope="session")
def service(settings: Settings) -> Service:
    """The use cases on the hand-made graphs, loaded and warm."""
    loaded = Service(settings)
    loaded.load_all()
    return loaded


@pytest.fixture(scope="session")
def app(settings: Settings, service: Service) -> FastAPI:
    """The application on the hand-made graphs."""
    return create_app(settings, service)


@pytest.fixture(scope="session")
def client(app: FastAPI) -> Iterator[TestClient]:
    """A client of the started application."""
    with TestClient(app) as started:
        yield started
