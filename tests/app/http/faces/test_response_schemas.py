"""Answers of the faces against their engines' documented form, whatever is asked for."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any, Final

import pytest
from jsonschema import Draft202012Validator

from tests.app.http.faces import response_schemas as schemas

if TYPE_CHECKING:
    from starlette.testclient import TestClient

# corners of the drawn map
A, B, C = [8.001, 46.5], [8.019, 46.52], [8.01, 46.511]
OSRM: Final = ";".join(f"{lon},{lat}" for lon, lat in (A, C, B))
NAMED: Final = [{"lon": lon, "lat": lat} for lon, lat in (A, C, B)]
TRIP: Final[dict[str, Any]] = {"locations": NAMED, "costing": "auto"}
HERE: Final[dict[str, Any]] = {"locations": NAMED[:1], "costing": "ev@0.5"}
MATRIX: Final[dict[str, Any]] = {"sources": NAMED[:2], "targets": NAMED, "costing": "auto"}


def keeps(schema: dict[str, Any], answer: Any) -> None:
    faults = [f"{error.json_path}: {error.message[:200]}" for error in Draft202012Validator(schema).iter_errors(answer)]
    assert not faults, "\n".join(faults)


@pytest.mark.parametrize(
    "options",
    [
        "",
        "steps=true&alternatives=true&annotations=true&geometries=geojson&overview=full",
        "steps=true&geometries=polyline6&overview=by_legs",
        "overview=false&annotations=duration,speed,soc&skip_waypoints=true",
        "steps=true&alternatives=2&ambient_c=-5&vehicle=vw-id4&soc=0.5&weighting=fastest",
        "generate_hints=false&hints=;;&radiuses=;unlimited;500&approaches=;;&snapping=any&continue_straight=false",
    ],
)
def test_routes_of_osrm_are_in_its_form(client: TestClient, options: str) -> None:
    answer = client.get(f"/osrm/route/v1/driving/{OSRM}?{options}")
    assert answer.status_code == 200, answer.text
    keeps(schemas.OSRM_ROUTES, answer.json())
    assert ("waypoints" in answer.json()) == ("skip_waypoints" not in options)


def test_route_from_a_place_to_itself_is_in_osrms_form(client: TestClient) -> None:
    for geometries in ("polyline", "geojson"):
        answer = client.get(
            f"/osrm/route/v1/ev/8.001,46.5;8.001,46.5?steps=true&annotations=true&geometries={geometries}"
        )
        keeps(schemas.OSRM_ROUTES, answer.json())
        assert [step["maneuver"]["type"] for step in answer.json()["routes"][0]["legs"][0]["steps"]] == [
            "depart",
            "arrive",
        ]


def test_profile_names_say_vehicle_charge_and_weather_in_every_face(client: TestClient) -> None:
    profile = "ev:vw-id4@0.6,ambient_c=-10,road=wet,weighting=fastest"
    asked = {"start": A, "goal": B, "vehicle": "vw-id4", "soc": 0.6, "conditions": {"ambient_c": -10.0, "road": "wet"}}
    own = client.post("/route", json={**asked, "weights": {"time": 1.0}}).json()["routes"][0]
    osrm = client.get(f"/osrm/route/v1/{profile}/{A[0]},{A[1]};{B[0]},{B[1]}").json()["routes"][0]["ev"]
    ors = client.post(f"/ors/v2/directions/{profile}", json={"coordinates": [A, B]}).json()["routes"][0]["ev"]
    trip = client.post("/valhalla/route", json={"locations": [NAMED[0], NAMED[2]], "costing": profile}).json()["trip"]
    for found in (osrm, ors, trip["ev"]):
        assert found["energy_kwh"] == pytest.approx(own["energy_kwh"], abs=1e-5)
        assert found["soc_start"] == 0.6


def test_fields_of_a_request_go_before_those_of_its_profile(client: TestClient) -> None:
    profile = "ev@0.6,ambient_c=-10,wind_speed_mps=3"
    both = {"coordinates": [A, B], "ev": {"soc": 0.5, "conditions": {"ambient_c": 20.0}}}
    alone = {"coordinates": [A, B], "ev": {"soc": 0.5, "conditions": {"ambient_c": 20.0, "wind_speed_mps": 3.0}}}
    answers = [client.post(f"/ors/v2/directions/{name}", json=sent) for name, sent in ((profile, both), ("ev", alone))]
    assert answers[0].json()["routes"] == answers[1].json()["routes"]


@pytest.mark.parametrize(
    "profile", ["ev,soc=2", "ev,soc", "ev,=", "ev,no_such_field=1", "ev@0.5,ambient_c=warm", "ev,"]
)
def test_profile_names_that_can_not_be_read_are_refused_in_every_face(client: TestClient, profile: str) -> None:
    osrm = client.get(f"/osrm/route/v1/{profile}/{A[0]},{A[1]};{B[0]},{B[1]}")
    assert (osrm.status_code, osrm.json()["code"]) == (400, "InvalidValue")
    ors = client.post(f"/ors/v2/directions/{profile}", json={"coordinates": [A, B]})
    assert (ors.status_code, ors.json()["error"]["code"]) == (400, 2003)
    trip = client.post("/valhalla/route", json={**TRIP, "costing": profile})
    assert (trip.status_code, trip.json()["error_code"] in (100, 125)) == (400, True)


def test_bodies_of_osrm_say_the_same_as_addresses(client: TestClient) -> None:
    address = client.get(f"/osrm/route/v1/ev@0.6/{OSRM}?steps=true&radiuses=;100;unlimited&soc=0.5").json()
    body = {"coordinates": [A, C, B], "steps": True, "radiuses": [None, 100, "unlimited"], "ev": {"soc": 0.5}}
    form = {"coordinates": OSRM, "steps": "true", "radiuses": ";100;unlimited", "soc": "0.5"}
    assert client.post("/osrm/route/v1/ev@0.6", json=body).json() == address
    assert client.post("/osrm/route/v1/ev@0.6", data=form).json() == address


@pytest.mark.parametrize(
    "options",
    ["", "annotations=duration,distance,energy,soc&sources=0;2&destinations=1", "scale_factor=2&skip_waypoints=true"],
)
def test_tables_of_osrm_are_in_its_form(client: TestClient, options: str) -> None:
    keeps(schemas.OSRM_TABLE, client.get(f"/osrm/table/v1/driving/{OSRM}?{options}").json())


def test_table_without_charge_is_filled_by_a_speed_as_the_crow_flies(client: TestClient) -> None:
    empty = client.get(f"/osrm/table/v1/ev@0/{OSRM}").json()
    filled = client.get(f"/osrm/table/v1/ev@0/{OSRM}?fallback_speed=10&annotations=duration,distance").json()
    keeps(schemas.OSRM_TABLE, filled)
    assert empty["durations"][0][1] is None
    assert [0, 1] in filled["fallback_speed_cells"]
    assert filled["durations"][0][1] == pytest.approx(filled["distances"][0][1] / 10.0, abs=0.1)


def test_nearest_roads_of_osrm_are_in_its_form_the_nearest_first(client: TestClient) -> None:
    found = client.get("/osrm/nearest/v1/driving/8.001,46.5?number=4").json()
    keeps(schemas.OSRM_NEAREST, found)
    away = [place["distance"] for place in found["waypoints"]]
    assert len(away) == 4
    assert away == sorted(away)


@pytest.mark.parametrize(
    "fields",
    [
        {},
        {"elevation": True, "maneuvers": True, "attributes": ["avgspeed", "detourfactor", "percentage"], "id": "mine"},
        {
            "instructions_format": "html",
            "units": "km",
            "preference": "fastest",
            "alternative_routes": {"target_count": 3},
        },
        {"geometry_simplify": True, "language": "de", "departure": "2026-12-01T08:00:00", "maximum_speed": 40},
        {"geometry": False, "instructions": False, "suppress_warnings": True, "ev": {"soc": 0.01}},
    ],
)
def test_directions_of_openrouteservice_are_in_its_form(client: TestClient, fields: dict[str, Any]) -> None:
    sent = {"coordinates": [A, C, B], **fields}
    for form, schema in (("json", schemas.ORS_ROUTES), ("geojson", schemas.ORS_FEATURES)):
        answer = client.post(f"/ors/v2/directions/driving-car/{form}", json=sent)
        assert answer.status_code == 200, answer.text
        keeps(schema, answer.json())
    assert client.post("/ors/v2/directions/driving-car/gpx", json=sent).text.startswith("<?xml")


@pytest.mark.parametrize(
    "fields",
    [
        {"range": [60, 120], "attributes": ["area"], "area_units": "km"},
        {"range": [2], "interval": 1, "range_type": "distance", "units": "km", "smoothing": 0},
        {"range": [100], "range_type": "energy", "location_type": "destination"},
        {"range": [0.795], "range_type": "charge"},
    ],
)
def test_isochrones_of_openrouteservice_are_in_its_form(client: TestClient, fields: dict[str, Any]) -> None:
    answer = client.post("/ors/v2/isochrones/ev@0.8", json={"locations": [A, B], **fields})
    assert answer.status_code == 200, answer.text
    keeps(schemas.ORS_ISOCHRONES, answer.json())


@pytest.mark.parametrize(
    "fields", [{}, {"metrics": ["duration", "distance", "energy", "soc"], "resolve_locations": True}]
)
def test_matrices_of_openrouteservice_are_in_its_form(client: TestClient, fields: dict[str, Any]) -> None:
    answer = client.post("/ors/v2/matrix/driving-car", json={"locations": [A, B, C], "sources": ["0"], **fields})
    keeps(schemas.ORS_MATRIX, answer.json())


@pytest.mark.parametrize(
    "fields",
    [
        {},
        {"alternates": 2, "units": "miles", "elevation_interval": 100, "shape_format": "geojson", "turn_lanes": True},
        {"directions_type": "none", "shape_format": "no_shape", "id": "7"},
        {"directions_type": "maneuvers", "costing_options": {"auto": {"exclude_tolls": True, "use_ferry": 0.1}}},
        {"date_time": {"type": 1, "value": "2026-12-01T08:00"}, "language": "de-DE", "format": "osrm"},
        {"locations": [NAMED[0], {**NAMED[1], "type": "through"}, NAMED[2]]},
        {"locations": [NAMED[0], {**NAMED[0], "type": "via"}, NAMED[0]]},
    ],
)
def test_trips_of_valhalla_are_in_its_form(client: TestClient, fields: dict[str, Any]) -> None:
    answer = client.post("/valhalla/route", json={**TRIP, **fields})
    assert answer.status_code == 200, answer.text
    keeps(schemas.VALHALLA_ROUTE, answer.json())


@pytest.mark.parametrize(
    ("path", "fields", "schema"),
    [
        ("isochrone", {**HERE, "contours": [{"time": 1}, {"time": 2, "color": "0000ff"}]}, schemas.VALHALLA_ISOCHRONE),
        (
            "isochrone",
            {**HERE, "contours": [{"distance": 1}], "polygons": True, "show_locations": True, "generalize": 20},
            schemas.VALHALLA_ISOCHRONE,
        ),
        ("isochrone", {**HERE, "contours": [{"energy": 0.1}], "reverse": True}, schemas.VALHALLA_ISOCHRONE),
        ("sources_to_targets", MATRIX, schemas.VALHALLA_MATRIX),
        ("sources_to_targets", {**MATRIX, "verbose": False, "units": "mi"}, schemas.VALHALLA_MATRIX),
        ("height", {"shape": NAMED, "range": True}, schemas.VALHALLA_HEIGHT),
        ("height", {"shape": NAMED, "resample_distance": 50}, schemas.VALHALLA_HEIGHT),
        ("locate", {"locations": [*NAMED, {"lon": 0, "lat": 0}], "costing": "auto"}, schemas.VALHALLA_LOCATE),
        ("status", {}, schemas.VALHALLA_STATUS),
    ],
)
def test_other_answers_of_valhalla_are_in_its_form(
    client: TestClient, path: str, fields: dict[str, Any], schema: dict[str, Any]
) -> None:
    posted = client.post(f"/valhalla/{path}", json=fields)
    assert posted.status_code == 200, posted.text
    keeps(schema, posted.json())
    got = client.get(f"/valhalla/{path}", params={"json": json.dumps(fields)})
    assert got.json() == posted.json()
