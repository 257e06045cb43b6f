"""The Python interface beside HTTP: the same figures for the same question, to the bit."""

from __future__ import annotations

from dataclasses import fields
from typing import TYPE_CHECKING, Any, Final

import pytest

import joulepath
from app.conversions.matrix import matrix_query, matrix_response
from app.conversions.range import range_features, range_query
from app.conversions.route import route_query, route_response
from app.schemas.matrix import MatrixRequest
from app.schemas.range import RangeRequest
from app.schemas.route import RouteRequest
from joulepath import Graph, Vehicle
from routing.graph.road_graph import Terrain
from routing.planner import Planner
from tests.app.conftest import street_grid

if TYPE_CHECKING:
    from collections.abc import Mapping

START, VIA, GOAL = (46.5, 8.003), (46.51, 8.01), (46.518, 8.02)
# names over HTTP of what is neither the same nor the same without "_frac"
OTHER_NAMES: Final = {
    "energy_parts": "energy_parts_kwh",
    "energy_p10_kwh": "energy_kwh_p10",
    "energy_p50_kwh": "energy_kwh_p50",
    "energy_p90_kwh": "energy_kwh_p90",
    "above_reserve_frac": "probability_above_reserve",
    "false_in_frac": "false_in_share",
    "false_out_frac": "false_out_share",
    "link_idx": "id",
    "geometry_end_idx": "geometry_end",
    "road_name": "name",
}
ONLY_HERE: Final = {"furthest", "legs", "links", "uncertainty", "geometry", "map_edge", "geometry_lon_lat_deg"}


@pytest.fixture(scope="module")
def graph() -> Graph:
    return Graph(Planner(street_grid("grid", Terrain.SYNTHETIC)))


@pytest.fixture(scope="module")
def leaf() -> Vehicle:
    return Vehicle.load("nissan-leaf")


def sent(place: tuple[float, float]) -> dict[str, float]:
    return {"lat": place[0], "lon": place[1]}


def check_same(result: Any, answered: Mapping[str, Any]) -> None:
    """Every figure of a result is that of an answer."""
    flat = dict(answered) | {
        "soc_start_needed": (answered.get("remedy") or {}).get("soc_start_needed"),
        "charge_needed_kwh": (answered.get("remedy") or {}).get("charge_needed_kwh"),
    }
    for name in (field.name for field in fields(result) if field.name not in ONLY_HERE):
        value = getattr(result, name)
        shown = flat[OTHER_NAMES.get(name, name.removesuffix("_frac"))]
        if name == "reach_by_bearing_km":  # over HTTP to the metre
            assert list(value) == pytest.approx(shown, abs=5.1e-4)
        else:
            assert (dict(value) if name == "energy_parts" else value) == shown, name


@pytest.mark.parametrize("soc", [1.0, 0.5, 0.0])
def test_routes_are_those_of_http(graph: Graph, leaf: Vehicle, soc: float) -> None:
    (route,) = joulepath.route(graph, leaf, start=START, via=[VIA], goal=GOAL, soc_frac=soc, uncertainty=True)
    body = {"start": sent(START), "via": [sent(VIA)], "goal": sent(GOAL), "soc": soc, "uncertainty": True}
    asked = RouteRequest.model_validate(body | {"vehicle": "nissan-leaf", "graph": "grid"})
    found = graph.planner.route(route_query(asked, leaf.model))
    answered = route_response(found, asked, graph.planner.graph).model_dump(mode="json")["routes"][0]
    check_same(route, answered)
    check_same(route.uncertainty, answered["uncertainty"])
    for leg, shown in zip(route.legs, answered["legs"], strict=True):
        check_same(leg, shown)
    for field in fields(route.links):
        if field.name not in ONLY_HERE:
            name = OTHER_NAMES.get(field.name, field.name.removesuffix("_frac"))
            assert list(getattr(route.links, field.name)) == [link[name] for link in answered["links"]], name
    assert route.geometry_lon_lat_deg.round(7).tolist() == answered["geometry"]["coordinates"]


@pytest.mark.parametrize("by", [{}, {"by": "energy", "limits": [0.2, 0.1]}, {"by": "time", "limits": [1.0]}])
def test_areas_are_those_of_http(graph: Graph, leaf: Vehicle, by: dict[str, Any]) -> None:
    area = joulepath.range(graph, leaf, origin=START, soc_frac=0.01, **by)
    asked = RangeRequest.model_validate(
        {"origin": sent(START), "soc": 0.01, "vehicle": "nissan-leaf", "tolerance_m": 0} | by
    )
    found = graph.planner.range(range_query(asked, leaf.model))
    answered = range_features(found, asked, graph.planner.graph).model_dump(mode="json")["features"]
    for band, shown in zip(area.bands, answered[:-1], strict=True):
        check_same(band, shown["properties"])


def test_matrices_are_those_of_http(graph: Graph, leaf: Vehicle) -> None:
    matrix = joulepath.matrix(graph, leaf, sources=[START, GOAL], soc_frac=0.5)
    asked = MatrixRequest.model_validate({"sources": [sent(START), sent(GOAL)], "soc": 0.5, "vehicle": "nissan-leaf"})
    search = graph.planner.matrix(matrix_query(asked, leaf.model))
    found = search.answer([search.row(k) for k in range(search.row_count)])
    answered = matrix_response(found, asked, graph.planner.graph).model_dump(mode="json")
    for name in (field.name for field in fields(matrix) if field.name not in ("reason", "sources", "targets")):
        value = getattr(matrix, name)
        shown = answered[name.removesuffix("_frac")]
        assert (list(value) if name == "warnings" else value.tolist()) == shown, name
