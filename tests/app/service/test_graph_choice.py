"""Which graph a request is answered on that names none."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import pytest

from app.schemas.matrix import MatrixRequest
from app.schemas.range import RangeRequest
from app.schemas.route import RouteRequest
from app.service.service import Service
from routing.errors import PointOutsideMapError
from routing.graph.files import save_graph
from routing.graph.road_graph import RoadGraph, Terrain
from tests.app.conftest import street_grid

if TYPE_CHECKING:
    from app.settings import Settings

NEAR = {"lat": 46.5, "lon": 8.003}
NEAR_TOO = {"lat": 46.504, "lon": 8.0}
EAST = {"lat": 46.5, "lon": 8.023}
APART = {"lat": 46.5, "lon": 9.003}


def moved(name: str, by_deg: float, times: float = 1.0) -> RoadGraph:
    """The street grid, farther to the east, and so many times as wide."""
    grid = street_grid(name, Terrain.ABSENT)
    lon_deg = 8.0 + by_deg + times * (grid.node_lon_deg - 8.0)
    line_e7 = 8e7 + by_deg * 1e7 + times * (grid.geometry_lon_e7 - 8e7)
    west, south, east, north = grid.meta.bbox
    bbox = (west + by_deg, south, 8.0 + by_deg + times * (east - 8.0), north)
    return replace(
        grid,
        node_lon_deg=lon_deg,
        geometry_lon_e7=line_e7.round().astype(grid.geometry_lon_e7.dtype),
        meta=replace(grid.meta, bbox=bbox),
    )


@pytest.fixture(scope="module")
def service(settings: Settings, tmp_path_factory: pytest.TempPathFactory) -> Service:
    """Graphs side by side: `small` within `wide`, which is the default, and `apart` to the east of both."""
    folder = tmp_path_factory.mktemp("places")
    for graph in (moved("wide", 0.0, 2.0), moved("small", 0.0), moved("apart", 1.0)):
        save_graph(graph, folder / graph.meta.name)
    return Service(settings.model_copy(update={"graph_dirs": (folder,), "default_graph": "wide"}))


def routed(service: Service, start: object, goal: object, graph: str | None = None) -> str | None:
    sent = RouteRequest.model_validate({"start": start, "goal": goal, "soc": 0.5, "graph": graph})
    return service.route(sent).request.graph


def test_smallest_graph_that_holds_all_places_is_chosen_and_told(service: Service) -> None:
    assert routed(service, NEAR, NEAR_TOO) == "small"
    assert routed(service, NEAR, EAST) == "wide"
    assert routed(service, APART, {"lat": 46.504, "lon": 9.0}) == "apart"


def test_graph_that_is_named_is_kept(service: Service) -> None:
    assert routed(service, NEAR, NEAR_TOO, "wide") == "wide"


def test_range_and_matrix_go_by_their_places_too(service: Service) -> None:
    asked = RangeRequest.model_validate({"origin": APART, "soc": 0.01})
    assert service.range(asked).request.graph == "apart"
    pairs = MatrixRequest.model_validate({"sources": [NEAR], "targets": [NEAR_TOO, EAST], "soc": 0.5})
    assert service.matrix(pairs).request.graph == "wide"


def test_place_just_beyond_the_outermost_road_is_held(service: Service) -> None:
    assert routed(service, {"lat": 46.499996, "lon": 9.003}, {"lat": 46.504, "lon": 9.0}) == "apart"


def test_places_on_different_graphs_are_refused_by_the_default_one(service: Service) -> None:
    with pytest.raises(PointOutsideMapError, match=r"^goal \(lat 46.5, lon 9.003\) .* lon 8\.\.8\.04$"):
        routed(service, NEAR, APART)


def test_places_that_another_graph_holds_swapped_are_asked_about(service: Service) -> None:
    with pytest.raises(PointOutsideMapError, match=r"did you mean lat 46.5, lon 9.003\?$"):
        routed(service, {"lat": 9.003, "lon": 46.5}, {"lat": 9.0, "lon": 46.504})
