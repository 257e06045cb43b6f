"""`steps` of POST /route."""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING, Any

import pytest

from app.schemas.route import RouteFeatureCollection, RouteResponse

if TYPE_CHECKING:
    from starlette.testclient import TestClient

ROUTE: dict[str, Any] = {
    "start": {"lat": 46.5, "lon": 8.003},
    "goal": {"lat": 46.518, "lon": 8.02},
    "soc": 0.5,
    "steps": True,
}


def test_steps_are_answered_only_where_asked_for(client: TestClient) -> None:
    plain = client.post("/route", json={**ROUTE, "steps": False}).json()
    assert plain["routes"][0].pop("steps") is None
    full = client.post("/route", json=ROUTE).json()
    assert full["routes"][0].pop("steps")
    assert full["routes"] == plain["routes"]


def test_steps_keep_to_the_schema_and_add_up_to_the_route(client: TestClient) -> None:
    answer = client.post("/route", json=ROUTE).json()
    assert RouteResponse.model_validate(answer).model_dump(mode="json") == answer
    (route,) = answer["routes"]
    steps = route["steps"]
    assert steps[0]["type"] == "depart"
    assert steps[0]["instruction"].startswith("Head ")
    assert (steps[-1]["type"], steps[-1]["instruction"]) == ("arrive", "You have arrived")
    for name in ("distance_m", "duration_s", "energy_kwh"):
        assert sum(step[name] for step in steps) == pytest.approx(route[name])
    assert (steps[0]["soc_start"], steps[-1]["soc_end"]) == (route["soc_start"], route["soc_end"])
    for before, after in pairwise(steps):
        assert (after["first_link"], after["geometry_first"]) == (before["last_link"] + 1, before["geometry_last"])
    line = route["geometry"]["coordinates"]
    assert all([step["at"]["lon"], step["at"]["lat"]] == line[step["geometry_first"]] for step in steps)


def test_via_point_ends_a_leg_of_steps(client: TestClient) -> None:
    via = [{"lat": 46.509, "lon": 8.01}]
    (route,) = client.post("/route", json={**ROUTE, "via": via}).json()["routes"]
    kinds = [step["type"] for step in route["steps"] if step["type"] in ("depart", "arrive")]
    assert kinds == ["depart", "arrive"] * 2
    arrivals = [(step["ends_at"], step["instruction"]) for step in route["steps"] if step["type"] == "arrive"]
    assert arrivals == [("via", "You have reached a place on your way"), ("goal", "You have arrived")]
    second = [step for step in route["steps"] if step["type"] == "depart"][1]
    assert second["soc_start"] == route["legs"][0]["soc_end"]
    assert second["first_link"] == route["legs"][1]["first_link"]


def test_route_to_its_own_place_departs_and_arrives(client: TestClient) -> None:
    (route,) = client.post("/route", json={**ROUTE, "goal": ROUTE["start"]}).json()["routes"]
    assert [(step["type"], step["distance_m"]) for step in route["steps"]] == [("depart", 0.0), ("arrive", 0.0)]


def test_geojson_has_steps_among_the_properties(client: TestClient) -> None:
    answer = client.post("/route", json=ROUTE, headers={"accept": "application/geo+json"}).json()
    assert answer["features"][0]["properties"]["steps"][0]["type"] == "depart"
    RouteFeatureCollection.model_validate(answer)
