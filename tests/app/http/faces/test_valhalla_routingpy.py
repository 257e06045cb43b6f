"""routingpy's client of Valhalla, as it is published, against the face; other addresses by Valhalla's own examples."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import httpx2
import pytest
from routingpy import Valhalla
from routingpy.exceptions import RouterApiError
from shapely.geometry import Point, shape

from tests.app.http.faces.on_the_map import ALSENWICK, AT_SEA, ID4, PASS_ROAD, VALLEY_ROAD

if TYPE_CHECKING:
    from tests.web.served import ServedMap

PLACES = [ALSENWICK, PASS_ROAD]


@pytest.fixture(scope="module")
def valhalla(served: ServedMap) -> Any:
    """The client, with nothing changed but the address."""
    return Valhalla(base_url=f"{served.address}/valhalla")


@pytest.fixture(scope="module")
def own(served: ServedMap) -> Any:
    """What POST /route answers for the same drive."""
    sent = {"start": ALSENWICK, "goal": PASS_ROAD, "soc": 0.8, "steps": True}
    return served.ask("/route", sent)["routes"][0]


def asked(places: list[list[float]], **fields: object) -> dict[str, object]:
    return {"locations": [{"lon": lon, "lat": lat} for lon, lat in places], "costing": "auto", **fields}


def test_directions_are_those_of_post_route(valhalla: Any, own: Any) -> None:
    found = valhalla.directions(PLACES, "auto")
    assert found.distance == pytest.approx(own["distance_m"], abs=2)
    assert found.duration == pytest.approx(own["duration_s"], abs=1)
    assert len(found.geometry) == len(own["geometry"]["coordinates"])
    assert found.geometry[0] == pytest.approx(own["geometry"]["coordinates"][0], abs=2e-6)
    assert found.raw["trip"]["ev"]["energy_kwh"] == pytest.approx(own["energy_kwh"], abs=1e-5)


def test_manoeuvres_lie_on_the_shape_and_speak_english(valhalla: Any, own: Any) -> None:
    (leg,) = valhalla.directions(PLACES, "auto", instructions=True).raw["trip"]["legs"]
    maneuvers = leg["maneuvers"]
    assert [maneuvers[k]["type"] for k in (0, -1)] == [1, 4]
    assert [maneuver["instruction"] for maneuver in maneuvers] == [f"{s['instruction']}." for s in own["steps"]]
    ends = [(maneuver["begin_shape_index"], maneuver["end_shape_index"]) for maneuver in maneuvers]
    assert [begin for begin, _ in ends[1:]] == [end for _, end in ends[:-1]]
    assert sum(maneuver["length"] for maneuver in maneuvers) == pytest.approx(leg["summary"]["length"], abs=0.1)


def test_costing_options_and_costing_say_vehicle_charge_and_speed(valhalla: Any) -> None:
    free = valhalla.directions(PLACES, ID4).raw["trip"]
    slow = valhalla.directions(PLACES, ID4, options={"top_speed": 60, "ev": {"soc": 0.7}}).raw["trip"]
    assert (free["ev"]["soc_start"], slow["ev"]["soc_start"]) == (0.9, 0.7)
    assert slow["summary"]["time"] > free["summary"]["time"]


def test_shortest_is_shorter(valhalla: Any, own: Any) -> None:
    found = valhalla.directions(PLACES, "auto", preference="shortest")
    assert found.distance < own["distance_m"]


def test_via_makes_no_leg_and_break_does(served: ServedMap, valhalla: Any) -> None:
    between = valhalla.directions([ALSENWICK, VALLEY_ROAD, PASS_ROAD], "auto").raw["trip"]
    over = asked([ALSENWICK, VALLEY_ROAD, PASS_ROAD])
    over["locations"][1]["type"] = "via"  # type: ignore[index]
    (leg,) = served.ask("/valhalla/route", over)["trip"]["legs"]
    assert len(between["legs"]) == 2
    assert leg["summary"]["length"] == pytest.approx(between["summary"]["length"], abs=0.01)
    assert [leg["maneuvers"][k]["type"] for k in (0, -1)] == [1, 4]
    assert [maneuver["type"] for maneuver in leg["maneuvers"]].count(4) == 1


def test_alternates_units_heights_and_id_are_answered(served: ServedMap) -> None:
    sent = asked(PLACES, alternates=2, units="miles", elevation_interval=500, id="mine", shape_format="geojson")
    found = served.ask("/valhalla/route", sent)
    assert found["id"] == "mine"
    assert found["alternates"][0]["trip"]["legs"]
    assert found["trip"]["units"] == "miles"
    assert found["trip"]["summary"]["length"] == pytest.approx(113.9467 / 1.609344, abs=0.01)
    (leg,) = found["trip"]["legs"]
    assert len(leg["elevation"]) > 100
    assert leg["shape"]["type"] == "LineString"


def test_get_has_its_request_in_the_address(served: ServedMap, own: Any) -> None:
    answer = httpx2.get(
        f"{served.address}/valhalla/route", params={"json": json.dumps(asked(PLACES)), "id": "7"}, trust_env=False
    ).json()
    assert answer["id"] == "7"
    assert answer["trip"]["summary"]["length"] == pytest.approx(own["distance_m"] / 1000.0, abs=1e-3)


def test_isochrones_have_the_largest_first_as_routingpy_counts_on(valhalla: Any) -> None:
    found = valhalla.isochrones(ALSENWICK, "auto", [600, 1200], polygons=True)
    small, large = (shape({"type": "Polygon", "coordinates": area.geometry}) for area in found)
    assert small.area < large.area
    assert large.intersects(Point(ALSENWICK).buffer(1e-3))


def test_isodistances_are_lines_unless_polygons_are_asked_for(valhalla: Any) -> None:
    found = valhalla.isochrones(ALSENWICK, "auto", [4000, 8000], interval_type="distance", colors=["ff0000", "00ff00"])
    assert [feature["geometry"]["type"] for feature in found.raw["features"]] == ["LineString"] * 2
    assert [feature["properties"]["color"] for feature in found.raw["features"]] == ["#00ff00", "#ff0000"]


def test_contours_of_energy_and_charge_are_ours(served: ServedMap) -> None:
    contours = [{"energy": 2.0}, {"energy": 4.0}, {"charge": 0.75}]
    found = served.ask("/valhalla/isochrone", asked([ALSENWICK], contours=contours, polygons=True, denoise=0.2))
    assert {(f["properties"]["metric"], f["properties"]["contour"]) for f in found["features"]} == {
        ("energy", 2.0),
        ("energy", 4.0),
        ("charge", 0.75),
    }


def test_matrix_is_that_of_post_matrix(valhalla: Any, served: ServedMap) -> None:
    places = [ALSENWICK, VALLEY_ROAD, PASS_ROAD]
    found = valhalla.matrix(places, "auto", sources=[0, 1], destinations=[1, 2])
    own = served.ask("/matrix", {"sources": places[:2], "targets": places[1:], "soc": 0.8})
    assert found.durations[0] == pytest.approx(own["duration_s"][0], abs=0.01)
    assert found.distances[1] == pytest.approx(own["distance_m"][1], abs=1.1)
    assert found.raw["sources_to_targets"][0][1]["ev"]["energy_kwh"] == pytest.approx(own["energy_kwh"][0][1], abs=1e-5)


def test_concise_matrix_has_rows(served: ServedMap) -> None:
    place = {"lon": ALSENWICK[0], "lat": ALSENWICK[1]}
    sent = {"sources": [place], "targets": [place], "costing": "auto", "verbose": False}
    found = served.ask("/valhalla/sources_to_targets", sent)
    assert found["sources_to_targets"]["durations"] == [[0.0]]


def test_heights_are_those_of_the_road(served: ServedMap, own: Any) -> None:
    line = own["geometry"]["coordinates"]
    sent = {"shape": [{"lon": lon, "lat": lat} for lon, lat in (line[0], line[-1])], "range": True}
    found = served.ask("/valhalla/height", {**sent, "height_precision": 1})
    (start_m, start), (_, _) = found["range_height"]
    assert start_m == 0
    assert start == pytest.approx(own["height_start_m"], abs=0.2)
    shape = served.ask("/valhalla/route", asked(PLACES))["trip"]["legs"][0]["shape"]
    whole = served.ask("/valhalla/height", {"encoded_polyline": shape, "range": True})
    assert len(whole["range_height"]) == len(line)
    sampled = served.ask("/valhalla/height", {"encoded_polyline": shape, "resample_distance": 1000})
    assert len(sampled["height"]) == pytest.approx(115, abs=2)
    assert served.ask("/valhalla/height", {"shape": [{"lon": 0, "lat": 0}]})["height"] == [None]


def test_locate_and_status_are_answered(served: ServedMap) -> None:
    near, far = served.ask("/valhalla/locate", asked([ALSENWICK, AT_SEA]))
    assert near["edges"][0]["correlated_lat"] == pytest.approx(ALSENWICK[1], abs=1e-3)
    assert far["edges"] is None
    assert "route" in served.ask("/valhalla/status")["available_actions"]


@pytest.mark.parametrize(
    ("number", "places", "options"),
    [
        (171, [ALSENWICK, AT_SEA], {}),
        (120, [ALSENWICK], {}),
        (125, PLACES, {"profile": "pedestrian"}),
        (125, PLACES, {"profile": "ev:no-such-car"}),
        (130, [[200.0, 44.0], PASS_ROAD], {}),
        (150, [ALSENWICK] * 30, {}),
        (157, PLACES, {"avoid_locations": [VALLEY_ROAD]}),
        (167, PLACES, {"avoid_polygons": [[ALSENWICK, VALLEY_ROAD, PASS_ROAD]]}),
        (163, PLACES, {"date_time": {"type": 2, "value": "2026-12-01T08:00"}}),
        (162, PLACES, {"date_time": {"type": 1, "value": "tomorrow"}}),
        (100, PLACES, {"options": {"ev": {"soc": 7}}}),
        (100, PLACES, {"units": "parsec"}),
    ],
)
def test_what_can_not_be_answered_has_a_number_of_valhalla(
    valhalla: Any, number: int, places: list[list[float]], options: dict[str, Any]
) -> None:
    with pytest.raises(RouterApiError) as caught:
        valhalla.directions(places, **{"profile": "auto", **options})
    answer = json.loads(caught.value.message)
    assert answer["error_code"] == number
    assert answer["error"]
    assert (answer["status_code"], answer["status"]) == (400, "Bad Request")


def test_other_addresses_and_methods_are_refused_as_by_valhalla(served: ServedMap) -> None:
    unknown = httpx2.get(f"{served.address}/valhalla/no_such_action", trust_env=False)
    assert (unknown.status_code, unknown.json()["error_code"]) == (404, 106)
    wrong = httpx2.put(f"{served.address}/valhalla/route", json={}, trust_env=False)
    assert (wrong.status_code, wrong.json()["error_code"]) == (405, 101)
