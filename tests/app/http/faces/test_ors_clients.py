"""openrouteservice's own client and routingpy's, as they are published, against the face."""

from __future__ import annotations

import json
import xml.etree.ElementTree as ElementTree
from typing import TYPE_CHECKING, Any

import httpx2
import openrouteservice
import pytest
from openrouteservice import convert
from openrouteservice.exceptions import ApiError
from routingpy import ORS
from routingpy.exceptions import RouterApiError
from shapely.geometry import Point, shape

from tests.app.http.faces.on_the_map import ALSENWICK, AT_SEA, ID4, PASS_ROAD, VALLEY_ROAD

if TYPE_CHECKING:
    from tests.web.served import ServedMap

PLACES = [ALSENWICK, PASS_ROAD]
GPX = "{http://www.topografix.com/GPX/1/1}"


@pytest.fixture(scope="module")
def ors(served: ServedMap) -> Any:
    """openrouteservice-py, with nothing changed but the address."""
    return openrouteservice.Client(base_url=f"{served.address}/ors", key="none")


@pytest.fixture(scope="module")
def routed(served: ServedMap) -> Any:
    """routingpy's client, with nothing changed but the address."""
    return ORS(api_key="none", base_url=f"{served.address}/ors")


@pytest.fixture(scope="module")
def own(served: ServedMap) -> Any:
    """What POST /route answers for the same drive."""
    sent = {"start": ALSENWICK, "goal": PASS_ROAD, "soc": 0.8, "steps": True}
    return served.ask("/route", sent)["routes"][0]


def test_directions_as_json_are_those_of_post_route(ors: Any, own: Any) -> None:
    (route,) = ors.directions(PLACES)["routes"]
    assert route["summary"]["distance"] == pytest.approx(own["distance_m"], abs=0.06)
    assert route["summary"]["duration"] == pytest.approx(own["duration_s"], abs=0.06)
    assert route["ev"]["energy_kwh"] == pytest.approx(own["energy_kwh"], abs=1e-5)
    line = convert.decode_polyline(route["geometry"])["coordinates"]
    assert len(line) == len(own["geometry"]["coordinates"])
    assert line[-1] == pytest.approx(own["geometry"]["coordinates"][-1], abs=2e-5)
    assert route["way_points"] == [0, len(line) - 1]


def test_steps_lie_on_the_line_and_speak_english(ors: Any, own: Any) -> None:
    (route,) = ors.directions(PLACES, maneuvers=True)["routes"]
    (segment,) = route["segments"]
    assert [step["instruction"] for step in segment["steps"]] == [step["instruction"] for step in own["steps"]]
    assert [segment["steps"][k]["type"] for k in (0, -1)] == [11, 10]
    assert {step["type"] for step in segment["steps"]} <= set(range(14))
    assert sum(step["distance"] for step in segment["steps"]) == pytest.approx(segment["distance"], abs=5.0)
    line = convert.decode_polyline(route["geometry"])["coordinates"]
    for step in segment["steps"]:
        assert line[step["way_points"][0]] == pytest.approx(step["maneuver"]["location"], abs=2e-5)


def test_directions_as_geojson_have_heights_where_asked_for(ors: Any, own: Any) -> None:
    found = ors.directions(PLACES, format="geojson", elevation=True, attributes=["avgspeed", "percentage"])
    (feature,) = found["features"]
    assert len(feature["geometry"]["coordinates"][0]) == 3
    assert feature["geometry"]["coordinates"][0][2] == pytest.approx(own["height_start_m"], abs=0.06)
    assert feature["properties"]["summary"]["ascent"] == pytest.approx(own["climb_m"], abs=0.06)
    assert len(feature["bbox"]) == 6
    (segment,) = feature["properties"]["segments"]
    assert segment["percentage"] == 100.0
    assert segment["avgspeed"] == pytest.approx(3.6 * own["distance_m"] / own["duration_s"], abs=0.01)


def test_encoded_line_with_heights_is_read_by_the_clients_decoder(ors: Any, own: Any) -> None:
    (route,) = ors.directions(PLACES, elevation=True)["routes"]
    line = convert.decode_polyline(route["geometry"], True)["coordinates"]
    assert line[0] == pytest.approx([*own["geometry"]["coordinates"][0], own["height_start_m"]], abs=0.06)


def test_directions_as_gpx_are_a_route_with_steps_and_a_track(served: ServedMap) -> None:
    answer = httpx2.post(
        f"{served.address}/ors/v2/directions/driving-car/gpx", json={"coordinates": PLACES}, trust_env=False
    )
    root = ElementTree.fromstring(answer.text)
    assert answer.headers["content-type"].startswith("application/gpx+xml")
    assert root.find(f"{GPX}rte/{GPX}rtept/{GPX}desc") is not None
    kwh = [float(at.text) for at in root.iter("{urn:joulepath:gpx}energy_kwh")]
    assert len(kwh) == len(root.findall(f"{GPX}rte/{GPX}rtept"))
    assert sum(kwh) > 1.0
    assert len(root.findall(f"{GPX}trk/{GPX}trkseg/{GPX}trkpt/{GPX}ele")) > 100


def test_directions_without_geometry_and_instructions_are_a_summary(ors: Any) -> None:
    (route,) = ors.directions(PLACES, geometry=False, instructions=False, suppress_warnings=True)["routes"]
    assert set(route) == {"summary", "bbox", "way_points", "ev"}


def test_simplified_line_still_has_the_places_of_steps(ors: Any) -> None:
    (route,) = ors.directions(PLACES, geometry_simplify=True, maneuvers=True)["routes"]
    line = convert.decode_polyline(route["geometry"])["coordinates"]
    assert len(line) < 1500
    for step in route["segments"][0]["steps"]:
        assert line[step["way_points"][0]] == pytest.approx(step["maneuver"]["location"], abs=2e-5)


def test_shortest_is_shorter_and_fastest_is_faster_than_recommended(ors: Any) -> None:
    asked = {preference: ors.directions(PLACES, preference=preference) for preference in ("fastest", "shortest")}
    summary = {name: found["routes"][0]["summary"] for name, found in asked.items()}
    recommended = ors.directions(PLACES, preference="recommended")["routes"][0]["summary"]
    assert summary["shortest"]["distance"] < recommended["distance"]
    assert summary["fastest"]["duration"] < recommended["duration"]


def test_alternatives_and_units_are_heeded_by_routingpy(routed: Any) -> None:
    wanted = {"share_factor": 0.6, "target_count": 3, "weight_factor": 1.4}
    found = routed.directions(PLACES, "driving-car", alternative_routes=wanted, format="geojson")
    assert len(found) > 1
    in_km = routed.directions(PLACES, "driving-car", units="km", format="json")
    assert in_km.distance == pytest.approx(found[0].distance, abs=100)


def test_profile_and_options_say_vehicle_charge_and_weather(routed: Any) -> None:
    warm = routed.directions(PLACES, ID4).raw["features"][0]["properties"]["ev"]
    options = {"ev": {"conditions": {"ambient_c": -10.0}, "soc": 0.85}}
    cold = routed.directions(PLACES, ID4, options=options).raw["features"][0]["properties"]["ev"]
    assert (warm["soc_start"], cold["soc_start"]) == (0.9, 0.85)
    assert cold["energy_kwh"] > warm["energy_kwh"]


def test_charge_that_does_not_suffice_is_a_warning(ors: Any) -> None:
    (route,) = ors.directions(PLACES, "ev@0.1", validate=False)["routes"]
    assert any("does not suffice" in warning["message"] for warning in route["warnings"])


def test_isochrones_by_time_grow_and_hold_their_center(ors: Any) -> None:
    found = ors.isochrones([ALSENWICK], range=[1200], interval=600, attributes=["area"])
    small, large = found["features"]
    assert [feature["properties"]["value"] for feature in (small, large)] == [600.0, 1200.0]
    assert small["properties"]["area"] < large["properties"]["area"]
    assert small["geometry"]["type"] == "Polygon"
    assert shape(large["geometry"]).intersects(Point(large["properties"]["center"]).buffer(1e-4))


def test_isochrones_of_two_places_are_two_groups(ors: Any) -> None:
    found = ors.isochrones([ALSENWICK, VALLEY_ROAD], range=[900])
    assert [feature["properties"]["group_index"] for feature in found["features"]] == [0, 1]


def test_isochrones_by_distance_are_read_by_routingpy(routed: Any) -> None:
    found = routed.isochrones(ALSENWICK, "driving-car", [5000, 10000], interval_type="distance")
    assert [isochrone.interval for isochrone in found] == [5000.0, 10000.0]
    assert len(found[0].geometry) > 10


def test_isochrones_by_energy_and_charge_are_ours(served: ServedMap, routed: Any) -> None:
    energy = routed.isochrones(ALSENWICK, ID4, [2000, 4000], interval_type="energy")
    assert [isochrone.interval for isochrone in energy] == [2000.0, 4000.0]
    charge = routed.isochrones(ALSENWICK, "ev:vw-id4@0.3", [0.25, 0.2], interval_type="charge")
    assert [feature["properties"]["value"] for feature in charge.raw["features"]] == [0.25, 0.2]
    areas = [feature["properties"]["ev"]["area_km2"] for feature in charge.raw["features"]]
    sent = {"origin": ALSENWICK, "vehicle": "vw-id4", "soc": 0.3, "bands": [0.2, 0.25], "outline": "filled"}
    own = {
        f["properties"]["soc_left"]: f["properties"]["area_km2"] for f in served.ask("/range", sent)["features"][:-1]
    }
    assert areas == [pytest.approx(own[0.25], abs=1e-3), pytest.approx(own[0.2], abs=1e-3)]


def test_isochrones_towards_a_place_are_by_energy(served: ServedMap) -> None:
    sent = {"locations": [ALSENWICK], "range": [3000], "range_type": "energy", "location_type": "destination"}
    found = served.ask("/ors/v2/isochrones/ev@0.5", sent)
    assert found["features"][0]["properties"]["ev"]["area_km2"] > 1.0


def test_matrix_has_sources_destinations_and_both_metrics(ors: Any, served: ServedMap) -> None:
    places = [ALSENWICK, VALLEY_ROAD, PASS_ROAD]
    found = ors.distance_matrix(
        places, sources=[0], destinations=[1, 2], metrics=["duration", "distance"], resolve_locations=True, units="km"
    )
    own = served.ask("/matrix", {"sources": [places[0]], "targets": places[1:], "soc": 0.8})
    assert found["durations"][0] == pytest.approx(own["duration_s"][0], abs=0.01)
    assert found["distances"][0] == pytest.approx([way / 1000.0 for way in own["distance_m"][0]], abs=1e-3)
    assert found["destinations"][1]["name"]
    assert found["metadata"]["service"] == "matrix"


def test_matrix_of_routingpy_has_energies_by_a_metric_of_ours(routed: Any) -> None:
    found = routed.matrix([ALSENWICK, VALLEY_ROAD], ID4, metrics=["energy", "soc"])
    assert found.raw["energies"][0][1] > 0.0
    assert found.raw["socs"][1][1] == 0.9


@pytest.mark.parametrize(
    ("status", "code", "places", "options"),
    [
        (404, 2010, [ALSENWICK, AT_SEA], {}),
        (404, 2010, PLACES, {"radiuses": [0.01, 0.01]}),
        (400, 2003, [ALSENWICK], {}),
        (400, 2003, PLACES, {"profile": "foot-walking"}),
        (400, 2003, PLACES, {"profile": "ev:no-such-car"}),
        (400, 2003, PLACES, {"preference": "scenic"}),
        (400, 2018, PLACES, {"options": {"avoid_features": ["highways"]}}),
        (400, 2018, PLACES, {"extra_info": ["surface"]}),
        (400, 2018, PLACES, {"bearings": [[10, 20], [30, 40]]}),
        (400, 2012, PLACES, {"options": {"no_such_option": 1}}),
        (400, 2002, PLACES, {"elevation": "high"}),
    ],
)
def test_directions_that_can_not_be_answered_have_a_number_of_openrouteservice(
    ors: Any, status: int, code: int, places: list[list[float]], options: dict[str, Any]
) -> None:
    with pytest.raises(ApiError) as caught:
        ors.directions(places, validate=False, **options)
    assert caught.value.status == status
    assert caught.value.message["error"]["code"] == code
    assert caught.value.message["error"]["message"]
    assert caught.value.message["info"]["engine"]["version"]


@pytest.mark.parametrize(
    ("code", "fields"),
    [
        (3003, {"range": [-5]}),
        (3003, {"range": [600], "range_type": "money"}),
        (3005, {"range": [600], "location_type": "destination"}),
        (3004, {"range": [1000], "interval": 1}),
    ],
)
def test_isochrones_that_can_not_be_answered_have_a_number_of_openrouteservice(
    ors: Any, code: int, fields: dict[str, Any]
) -> None:
    with pytest.raises(ApiError) as caught:
        ors.isochrones([ALSENWICK], validate=False, **fields)
    assert caught.value.message["error"]["code"] == code


def test_matrix_off_the_map_has_a_number_of_openrouteservice(routed: Any) -> None:
    with pytest.raises(RouterApiError) as caught:
        routed.matrix([ALSENWICK, AT_SEA], "driving-car")
    assert json.loads(caught.value.message)["error"]["code"] == 6010


def test_get_has_start_and_end_in_its_address(served: ServedMap, own: Any) -> None:
    query = "start=-36.78,44.44&end=-36.1817,44.1088&api_key=none"
    found = served.ask(f"/ors/v2/directions/driving-car?{query}")
    assert found["features"][0]["properties"]["summary"]["distance"] == pytest.approx(own["distance_m"], abs=0.06)


def test_calls_of_the_plug_in_of_qgis_are_answered_with_what_it_reads(served: ServedMap) -> None:
    """As ORS Tools 2 sends them (ORStools/proc and ORStools/common of GIScience/orstools-qgis-plugin)."""
    sent = {"coordinates": PLACES, "preference": "recommended", "geometry": "true", "instructions": "false"}
    sent |= {"elevation": True, "id": None, "options": None, "extra_info": []}
    (line, *_) = served.ask("/ors/v2/directions/driving-car/geojson?", sent)["features"]
    assert {len(point) for point in line["geometry"]["coordinates"]} == {3}
    assert set(line["properties"]["summary"]) >= {"distance", "duration"}
    area = {"locations": [ALSENWICK], "range_type": "time", "range": [300, 600], "attributes": ["total_pop"], "id": 7}
    found = served.ask("/ors/v2/isochrones/driving-car?", {**area, "location_type": "start", "smoothing": 0})
    for feature in found["features"]:
        assert len(feature["geometry"]["coordinates"][0]) > 3
        assert {len(point) for point in feature["geometry"]["coordinates"][0]} == {2}
        assert len(feature["properties"]["center"]) == 2
    matrix = {"locations": [ALSENWICK, VALLEY_ROAD], "sources": [0], "destinations": [1], "id": "Matrix"}
    rows = served.ask("/ors/v2/matrix/driving-car?", {**matrix, "metrics": ["duration", "distance"]})
    assert rows["durations"][0][0] > 0.0
    assert rows["distances"][0][0] > 0.0
