"""Which graph a request is answered on that names none."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import pytest

from app.errors.raised import PlacesApartError
from app.schemas.matrix import MatrixRequest
from app.schemas.range import RangeRequest
from app.schemas.route import RouteRequest
from app.service.service import Service
from routing.errors import PointOutsideMapError
from routing.graph.files import save_graph
from routing.graph.road_graph import RoadGraph, Terrain
from tests.app.conftest import street_grid

if TYPE_CHECKING:
    from pathlib import Path

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


def test_place_on_another_graph_than_the_one_named_is_told_both(service: Service) -> None:
    with pytest.raises(PointOutsideMapError) as refusal:
        routed(service, NEAR, APART, "small")
    assert str(refusal.value).startswith(
        "goal (lat 46.5, lon 9.003) is outside the map of graph 'small', but on graph 'apart', allowed: lat"
    )


def test_range_and_matrix_go_by_their_places_too(service: Service) -> None:
    asked = RangeRequest.model_validate({"origin": APART, "soc": 0.01})
    assert service.range(asked).request.graph == "apart"
    pairs = MatrixRequest.model_validate({"sources": [NEAR], "targets": [NEAR_TOO, EAST], "soc": 0.5})
    assert service.matrix(pairs).request.graph == "wide"


def test_place_just_beyond_the_outermost_road_is_held(service: Service) -> None:
    assert routed(service, {"lat": 46.499996, "lon": 9.003}, {"lat": 46.504, "lon": 9.0}) == "apart"


@pytest.mark.parametrize("lon", [180.0, -180.0, -179.9999])
def test_place_just_beyond_the_antimeridian_is_held(settings: Settings, tmp_path: Path, lon: float) -> None:
    for graph in (moved("date", 171.98), moved("apart", 0.0)):
        save_graph(graph, tmp_path / graph.meta.name)
    service = Service(settings.model_copy(update={"graph_dirs": (tmp_path,), "default_graph": "apart"}))
    sent = RouteRequest.model_validate({"start": [lon, 46.503], "goal": [179.985, 46.5], "soc": 0.5})
    answer = service.route(sent)
    assert answer.request.graph == "date"
    assert answer.snapped.start.asked.lon == lon
    assert answer.snapped.start.on_road.lon == pytest.approx(180.0, abs=1e-6)
    assert answer.snapped.start.distance_m == pytest.approx(7.65 if lon == -179.9999 else 0.0, abs=0.1)


def test_places_on_different_graphs_are_refused_naming_both(service: Service) -> None:
    with pytest.raises(PlacesApartError) as refusal:
        routed(service, NEAR, APART)
    assert str(refusal.value) == (
        "goal (lat 46.5, lon 9.003) is on graph 'apart', but start (lat 46.5, lon 8.003) is on graphs 'small' and "
        "'wide', allowed: all places of a request on one graph"
    )
    with pytest.raises(PlacesApartError, match=r"^goal .* on graph 'apart', but start .* on graph 'wide', allowed"):
        service.route(RouteRequest.model_validate({"start": NEAR, "via": [[8.038, 46.5]], "goal": APART, "soc": 0.5}))
    pairs = MatrixRequest.model_validate({"sources": [APART, NEAR], "targets": [APART], "soc": 0.5})
    with pytest.raises(PlacesApartError, match=r"^sources\[1\] .* but sources\[0\] .* on graph 'apart'"):
        service.matrix(pairs)


@pytest.mark.parametrize(
    ("place", "nearest"),
    [
        ({"lat": 46.5, "lon": 8.5}, "'wide', 35209 m from the nearest road 'Street .*' at lat 46.5, lon 8.04"),
        ({"lat": 46.5, "lon": 8.55}, "'apart', 3444. m from the nearest road 'Street .*' at lat 46.5, lon 9"),
        ({"lat": 56.5, "lon": 8.0}, "'wide', 1110 km away"),
    ],
)
def test_place_on_no_graph_is_told_the_nearest_one_and_how_far_it_is(
    service: Service, place: object, nearest: str
) -> None:
    message = f"^goal .* is outside the map of every graph, the nearest is {nearest}, allowed: lat 46.5"
    with pytest.raises(PointOutsideMapError, match=message):
        routed(service, NEAR, place)


@pytest.mark.parametrize(
    ("start", "goal", "field", "meant"),
    [
        ({"lat": 9.003, "lon": 46.5}, {"lat": 9.0, "lon": 46.504}, "start", "lat 46.5, lon 9.003"),
        (APART, {"lat": 9.0, "lon": 46.504}, "goal", "lat 46.504, lon 9"),
        ([46.504, 9.0], APART, "start", "lat 46.504, lon 9"),
        (APART, {"lat": 8.99999, "lon": 46.504}, "goal", "lat 46.504, lon 8.99999"),
    ],
)
def test_place_that_a_graph_holds_swapped_is_asked_about(
    service: Service, start: object, goal: object, field: str, meant: str
) -> None:
    with pytest.raises(PointOutsideMapError, match=rf"^{field} .* did you mean {meant}\?$"):
        routed(service, start, goal)
