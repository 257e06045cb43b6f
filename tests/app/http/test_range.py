"""GET and POST /range on the hand-made grid."""

from __future__ import annotations

import itertools
import json
import math
import re
from typing import TYPE_CHECKING, Any

import pytest
from shapely.geometry import Point, shape

from tests.app.expected import TABLE, check_problem

if TYPE_CHECKING:
    from starlette.testclient import TestClient

ORIGIN = "lat=46.5&lon=8.003"


def ask(client: TestClient, query: str) -> dict[str, Any]:
    response = client.get(f"/range?{query}")
    assert response.status_code == 200, response.text
    assert response.headers["content-type"] == "application/geo+json"
    answer: dict[str, Any] = response.json()
    answer["stats"].pop("seconds")
    return answer


def bands_of(answer: dict[str, Any]) -> list[dict[str, Any]]:
    return [feature for feature in answer["features"] if feature["properties"]["kind"] == "band"]


def test_range_with_a_count_answers_nested_bands_outermost_first(client: TestClient) -> None:
    answer = ask(client, f"{ORIGIN}&soc=0.006&bands=3")
    bands = bands_of(answer)
    assert [band["properties"]["soc_left"] for band in bands] == pytest.approx([0.0, 0.002, 0.004])
    areas = [shape(band["geometry"]) for band in bands]
    for outer, inner in itertools.pairwise(areas):
        assert inner.difference(outer).area <= 1e-9 * outer.area
    sizes = [band["properties"]["area_km2"] for band in bands]
    assert sizes == sorted(sizes, reverse=True)
    counts = [band["properties"]["node_count"] for band in bands]
    assert counts == sorted(counts, reverse=True)


def test_range_polygons_are_valid_geojson_around_the_origin(client: TestClient) -> None:
    answer = ask(client, f"{ORIGIN}&soc=0.006&bands=2")
    origin = answer["features"][-1]
    assert origin["properties"]["kind"] == "origin"
    for band in bands_of(answer):
        area = shape(band["geometry"])
        assert area.is_valid
        assert area.contains(Point(origin["geometry"]["coordinates"]))
        for polygon, rings in zip(area.geoms, band["geometry"]["coordinates"], strict=True):
            assert polygon.exterior.is_ccw
            assert all(ring[0] == ring[-1] for ring in rings)


def test_range_coordinates_have_at_most_seven_decimals(client: TestClient) -> None:
    text = json.dumps([feature["geometry"] for feature in ask(client, f"{ORIGIN}&soc=0.006")["features"]])
    assert re.search(r"\d\.\d{8,}", text) is None


def test_range_with_charges_left_adds_the_reserve_as_outermost(client: TestClient) -> None:
    answer = ask(client, f"{ORIGIN}&soc=0.3&reserve_soc=0.1&bands=0.25,0.2")
    assert [band["properties"]["soc_left"] for band in bands_of(answer)] == pytest.approx([0.1, 0.2, 0.25])


def test_range_with_less_charge_left_reaches_farther(client: TestClient) -> None:
    areas = [bands_of(ask(client, f"{ORIGIN}&soc={soc}"))[0]["properties"]["area_km2"] for soc in (0.002, 0.004, 0.008)]
    assert areas == sorted(areas)


def test_range_request_as_understood_sent_to_post_answers_the_same(client: TestClient) -> None:
    answer = ask(client, f"{ORIGIN}&soc=0.3&vehicle=vw-id4&bands=2")
    response = client.post("/range", json=answer["request"])
    assert response.headers["content-type"] == "application/geo+json"
    again = response.json()
    again["stats"].pop("seconds")
    assert again == answer


def test_range_with_no_charge_answers_the_origin(client: TestClient) -> None:
    answer = ask(client, f"{ORIGIN}&soc=0")
    assert answer["features"][-1]["properties"]["kind"] == "origin"


def test_range_answer_names_the_terrain_it_rests_on(client: TestClient) -> None:
    assert ask(client, f"{ORIGIN}&soc=0.01&graph=level")["terrain"]["terrain"] == "absent"


def test_range_in_cold_and_head_wind_is_smaller_and_the_same_by_address_and_body(client: TestClient) -> None:
    mild = ask(client, f"{ORIGIN}&soc=0.006")
    cold = ask(client, f"{ORIGIN}&soc=0.006&ambient_c=-10&wind_speed_mps=8&wind_from_deg=45&road=snow")
    assert bands_of(cold)[0]["properties"]["area_km2"] < bands_of(mild)[0]["properties"]["area_km2"]
    assert cold["request"]["conditions"]["ambient_c"] == -10
    posted = client.post("/range", json=cold["request"]).json()
    posted["stats"].pop("seconds")
    assert posted == cold
    assert mild["request"]["conditions"] is None


def test_range_with_uncertainty_answers_each_band_for_three_probabilities(client: TestClient) -> None:
    answer = ask(client, f"{ORIGIN}&soc=0.006&bands=2&uncertainty=true")
    properties = [band["properties"] for band in bands_of(answer)]
    assert [p["probability"] for p in properties] == [0.1, 0.5, 0.9] * 2
    for k in (0, 3):
        sizes = [p["area_km2"] for p in properties[k : k + 3]]
        assert sizes == sorted(sizes, reverse=True)
        assert sizes[0] > sizes[2]
    plain = bands_of(ask(client, f"{ORIGIN}&soc=0.006&bands=2"))
    assert [p["properties"]["probability"] for p in plain] == [None, None]
    assert plain[0]["properties"]["node_count"] == properties[1]["node_count"]


@pytest.mark.parametrize(
    ("parameters", "field"),
    [
        ("ambient_c=200", "ambient_c"),
        ("wind_speed_mps=-1", "wind_speed_mps"),
        ("road=ice", "road"),
        ("sun_w=100", "sun_w"),
        ("payload_kg=NaN", "payload_kg"),
    ],
)
def test_range_with_a_bad_condition_names_the_parameter(client: TestClient, parameters: str, field: str) -> None:
    response = client.get(f"/range?{ORIGIN}&soc=0.006&{parameters}")
    assert response.status_code == 422
    assert response.json()["errors"][0]["field"] == field


def test_range_of_a_consumption_table_in_wind_names_the_parameter_by_address_and_the_field_in_a_body(
    client: TestClient,
) -> None:
    client.put("/vehicles/my-van", json=TABLE)
    try:
        response = client.get(f"/range?{ORIGIN}&soc=0.006&vehicle=my-van&wind_speed_mps=5")
    finally:
        client.delete("/vehicles/my-van")
    problem = check_problem(response, 422, "invalid_conditions")
    assert [error["field"] for error in problem["errors"]] == ["wind_speed_mps"]
    assert problem["detail"].startswith("wind_speed_mps is 5")
    body = {"origin": {"lat": 46.5, "lon": 8.003}, "soc": 0.006, "vehicle": TABLE, "conditions": {"wind_speed_mps": 5}}
    problem = check_problem(client.post("/range", json=body), 422, "invalid_conditions")
    assert [error["field"] for error in problem["errors"]] == ["conditions.wind_speed_mps"]


def test_range_reverse_and_round_trip_are_nested_valid_areas_around_the_origin(client: TestClient) -> None:
    for trip in ("reverse", "round_trip"):
        answer = ask(client, f"{ORIGIN}&soc=0.006&bands=3&{trip}=true")
        assert answer["request"][trip] is True
        assert answer["stats"]["method"] == f"label-setting-{trip}"
        bands = bands_of(answer)
        assert [band["properties"]["soc_left"] for band in bands] == pytest.approx([0.0, 0.002, 0.004])
        areas = [shape(band["geometry"]) for band in bands]
        origin = Point(answer["features"][-1]["geometry"]["coordinates"])
        assert all(area.is_valid and area.contains(origin) for area in areas)
        for outer, inner in itertools.pairwise(areas):
            assert inner.difference(outer).area <= 1e-9 * outer.area


def test_range_round_trip_reaches_fewer_nodes_than_the_way_out(client: TestClient) -> None:
    counts = [
        bands_of(ask(client, f"{ORIGIN}&soc=0.006{trip}"))[0]["properties"]["node_count"]
        for trip in ("", "&round_trip=true")
    ]
    assert 0 < counts[1] < counts[0]


def test_range_reverse_request_as_understood_sent_to_post_answers_the_same(client: TestClient) -> None:
    answer = ask(client, f"{ORIGIN}&soc=0.006&bands=2&reverse=true")
    again = client.post("/range", json=answer["request"])
    assert again.status_code == 200, again.text
    assert again.json()["features"] == answer["features"]


def test_range_reverse_and_round_trip_together_are_refused(client: TestClient) -> None:
    response = client.get(f"/range?{ORIGIN}&soc=0.3&reverse=true&round_trip=true")
    problem = check_problem(response, 422, "invalid_request")
    refused = {"field": "round_trip", "value": True, "allowed": "false where reverse is true"}
    assert problem["errors"] == [refused]


def test_range_reverse_with_the_printed_model_is_refused(client: TestClient) -> None:
    response = client.get(f"/range?{ORIGIN}&soc=0.3&reverse=true&link_model=printed")
    problem = check_problem(response, 422, "invalid_request")
    assert [error["field"] for error in problem["errors"]] == ["link_model"]
    assert "integrated" in problem["errors"][0]["allowed"]


def test_range_reverse_in_the_cold_says_where_the_cold_start_counts(client: TestClient) -> None:
    answer = ask(client, f"{ORIGIN}&soc=0.3&reverse=true&ambient_c=-10")
    assert any("departure at each place" in warning for warning in answer["warnings"])


def test_range_reverse_with_uncertainty_gives_smaller_areas_for_more_certainty(client: TestClient) -> None:
    bands = bands_of(ask(client, f"{ORIGIN}&soc=0.006&reverse=true&uncertainty=true"))
    sizes = [band["properties"]["area_km2"] for band in bands]
    assert [band["properties"]["probability"] for band in bands] == [0.1, 0.5, 0.9]
    assert sizes == sorted(sizes, reverse=True)


def test_range_with_plenty_of_charge_says_that_the_map_ends_first(client: TestClient) -> None:
    for trip in ("", "&reverse=true", "&round_trip=true"):
        answer = ask(client, f"{ORIGIN}&soc=0.9&bands=2{trip}")
        (warning,) = [text for text in answer["warnings"] if "map ends" in text]
        for band in bands_of(answer):
            said = band["properties"]
            assert said["reaches_map_edge"] is True
            assert said["map_edge"]["type"] == "MultiLineString"
            assert shape(said["map_edge"]).within(shape(band["geometry"]).boundary.buffer(1e-9))
            assert said["soc_left"] * 64.0 < said["map_edge_left_kwh"] <= 0.9 * 64.0 + 0.1
            assert f"{said['map_edge_left_kwh']:.1f} kWh" in warning
            assert said["road_nearest_km"] is None


def test_range_that_the_charge_ends_says_nothing_of_the_maps_edge(client: TestClient) -> None:
    for trip in ("", "&reverse=true", "&round_trip=true"):
        answer = ask(client, f"{ORIGIN}&soc=0.002{trip}")
        said = bands_of(answer)[0]["properties"]
        assert (said["reaches_map_edge"], said["map_edge"], said["map_edge_left_kwh"]) == (False, None, None)
        assert not [text for text in answer["warnings"] if "map" in text]
        assert said["road_nearest_km"] <= said["road_farthest_km"]


def test_range_tells_how_far_it_reaches_in_24_directions(client: TestClient) -> None:
    answer = ask(client, f"{ORIGIN}&soc=0.006&tolerance_m=0")
    (band,) = bands_of(answer)
    lon, lat = answer["features"][-1]["geometry"]["coordinates"]
    said, area = band["properties"], shape(band["geometry"])
    by_bearing = said["reach_by_bearing_km"]
    assert len(by_bearing) == 24
    assert (said["reach_nearest_km"], said["reach_farthest_km"]) == (min(by_bearing), max(by_bearing))
    for k, reach_km in enumerate(by_bearing):
        bearing = math.radians(15.0 * k)
        for km, inside in ((reach_km - 0.01, True), (reach_km + 0.01, False)):
            north, east = km / 111.19508 * math.cos(bearing), km / 111.19508 * math.sin(bearing)
            assert area.contains(Point(lon + east / math.cos(math.radians(lat)), lat + north)) is inside


def test_range_filled_covers_more_with_fewer_rings_and_says_how_far_it_is_filled(client: TestClient) -> None:
    roads = ask(client, f"{ORIGIN}&soc=0.006&bands=2")
    filled = ask(client, f"{ORIGIN}&soc=0.006&bands=2&outline=filled")
    assert roads["filling"] is None
    assert filled["filling"]["gap_m"] == 800.0
    assert filled["filling"]["hole_km2"] == pytest.approx(0.64)
    assert filled["request"]["outline"] == "filled"
    for plain, smooth in zip(bands_of(roads), bands_of(filled), strict=True):
        assert shape(smooth["geometry"]).is_valid
        assert smooth["properties"]["area_km2"] >= plain["properties"]["area_km2"]
        assert smooth["properties"]["node_count"] == plain["properties"]["node_count"]
    again = client.post("/range", json=filled["request"]).json()
    assert again["features"] == filled["features"]


def test_range_with_an_unknown_outline_is_refused_with_what_is_allowed(client: TestClient) -> None:
    problem = check_problem(client.get(f"/range?{ORIGIN}&soc=0.3&outline=round"), 422, "invalid_request")
    (error,) = problem["errors"]
    assert (error["field"], error["value"]) == ("outline", "round")
    assert "filled" in error["allowed"]


@pytest.mark.parametrize(("by", "limits"), [("energy", "0.1,0.3"), ("time", "1,3"), ("distance", "0.9,2.5")])
def test_range_by_limits_answers_a_band_for_each_the_same_by_address_and_body(
    client: TestClient, by: str, limits: str
) -> None:
    answer = ask(client, f"{ORIGIN}&soc=0.5&by={by}&limits={limits}")
    outer, inner = bands_of(answer)
    less, more = (float(part) for part in limits.split(","))
    assert (outer["properties"]["limit"], inner["properties"]["limit"]) == (more, less)
    assert shape(inner["geometry"]).difference(shape(outer["geometry"])).area <= 1e-12
    assert (outer["properties"]["soc_left"] is None) is (by != "energy")
    if by == "energy":
        assert outer["properties"]["soc_left"] == pytest.approx(0.5 - 0.3 / 64.0, rel=1e-3)
    if by == "distance":
        assert inner["properties"]["road_farthest_km"] == pytest.approx(0.9, abs=0.05)
    again = client.post("/range", json=answer["request"])
    assert again.status_code == 200, again.text
    assert again.json()["features"] == answer["features"]


@pytest.mark.parametrize(
    ("parameters", "field"),
    [
        ("by=time", "limits"),
        ("limits=3", "limits"),
        ("by=time&limits=0", "limits[0]"),
        ("by=time&limits=3,x", "limits"),
        ("by=time&limits=3&bands=2", "bands"),
        ("by=time&limits=1_0", "limits"),
        ("by=time&limits=\u0663", "limits"),
        ("bands=\u0663", "bands"),
        ("by=energy&limits=50", "limits"),
        ("by=distance&limits=3&reverse=true", "by"),
        ("by=time&limits=3&uncertainty=true", "by"),
        ("by=cost&limits=3", "by"),
    ],
)
def test_range_with_limits_that_do_not_fit_names_the_parameter(client: TestClient, parameters: str, field: str) -> None:
    problem = check_problem(client.get(f"/range?{ORIGIN}&soc=0.5&{parameters}"), 422, "invalid_request")
    assert [error["field"] for error in problem["errors"]] == [field]
