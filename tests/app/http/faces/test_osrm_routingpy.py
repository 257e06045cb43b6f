"""routingpy's client of OSRM, as it is published, against the face."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import pytest
from routingpy import OSRM
from routingpy.exceptions import RouterApiError

from tests.app.http.faces.on_the_map import ALSENWICK, AT_SEA, ID4, PASS_ROAD, VALLEY_ROAD

if TYPE_CHECKING:
    from tests.web.served import ServedMap


@pytest.fixture(scope="module")
def osrm(served: ServedMap) -> Any:
    """The client, with nothing changed but the address."""
    return OSRM(base_url=f"{served.address}/osrm")


def fastest_and_eco(served: ServedMap, places: list[list[float]], **fields: object) -> Any:
    sent = {"start": places[0], "via": places[1:-1], "goal": places[-1], "soc": 0.8, **fields}
    return served.ask("/route", sent)["routes"]


def test_directions_between_two_places_are_those_of_post_route(osrm: Any, served: ServedMap) -> None:
    found = osrm.directions([ALSENWICK, PASS_ROAD], profile="driving")
    (own,) = fastest_and_eco(served, [ALSENWICK, PASS_ROAD])
    assert found.distance == int(round(own["distance_m"], 1))
    assert found.duration == int(round(own["duration_s"], 1))
    (route,) = found.raw["routes"]
    assert route["ev"]["energy_kwh"] == pytest.approx(own["energy_kwh"], abs=1e-5)
    assert found.geometry[0] == pytest.approx((-36.77999, 44.43999), abs=2e-5)


def test_directions_of_a_profile_are_driven_by_its_vehicle_and_charge(osrm: Any, served: ServedMap) -> None:
    found = osrm.directions([ALSENWICK, PASS_ROAD], profile=ID4)
    (own,) = fastest_and_eco(served, [ALSENWICK, PASS_ROAD], vehicle="vw-id4", soc=0.9)
    electric = found.raw["routes"][0]["ev"]
    assert electric["soc_start"] == 0.9
    assert electric["soc_end"] == pytest.approx(own["soc_end"], abs=1e-5)


@pytest.mark.parametrize("geometries", ["polyline", "polyline6", "geojson"])
def test_full_line_in_each_form_has_all_points(osrm: Any, served: ServedMap, geometries: str) -> None:
    found = osrm.directions([ALSENWICK, PASS_ROAD], geometries=geometries, overview="full")
    (own,) = fastest_and_eco(served, [ALSENWICK, PASS_ROAD])
    line = found.geometry
    assert len(line) == len(own["geometry"]["coordinates"])
    for at in (0, 100, -1):
        assert line[at] == pytest.approx(own["geometry"]["coordinates"][at], abs=1e-5)


def test_simplified_line_has_few_points_and_the_same_ends(osrm: Any) -> None:
    full = osrm.directions([ALSENWICK, PASS_ROAD], overview="full").geometry
    few = osrm.directions([ALSENWICK, PASS_ROAD]).geometry
    assert len(few) < 0.3 * len(full)
    assert (few[0], few[-1]) == (full[0], full[-1])


def test_steps_and_annotations_add_up_to_each_leg(osrm: Any) -> None:
    found = osrm.directions([ALSENWICK, VALLEY_ROAD, PASS_ROAD], steps=True, annotations=True, overview="full")
    (route,) = found.raw["routes"]
    assert len(route["legs"]) == 2
    for leg in route["legs"]:
        assert [leg["steps"][k]["maneuver"]["type"] for k in (0, -1)] == ["depart", "arrive"]
        annotation = leg["annotation"]
        assert leg["distance"] == pytest.approx(sum(step["distance"] for step in leg["steps"]), abs=2.0)
        assert leg["distance"] == pytest.approx(sum(annotation["distance"]), rel=1e-3)
        assert leg["duration"] == pytest.approx(sum(annotation["duration"]), rel=1e-2)
        assert 1000.0 * leg["ev"]["energy_kwh"] == pytest.approx(sum(annotation["energy"]), rel=1e-3)
        assert leg["ev"]["soc_end"] == pytest.approx(annotation["soc"][-1], abs=1e-4)
        assert set(annotation) >= {"speed", "weight", "datasources", "metadata"}


def test_alternatives_are_weightings_the_thriftiest_first(osrm: Any) -> None:
    found = osrm.directions([ALSENWICK, PASS_ROAD], alternatives=True)
    routes = found.raw["routes"]
    assert routes[0]["weight_name"] == "eco"
    assert len(routes) > 1
    energies = [route["ev"]["energy_kwh"] for route in routes]
    assert energies[0] == min(energies)
    assert min(route["duration"] for route in routes) < routes[0]["duration"]


def test_fields_of_our_own_change_the_drive(osrm: Any) -> None:
    cold = osrm.directions([ALSENWICK, PASS_ROAD], ambient_c=-10, soc=0.7, weighting="fastest")
    warm = osrm.directions([ALSENWICK, PASS_ROAD], soc=0.7, weighting="fastest")
    assert cold.raw["routes"][0]["ev"]["energy_kwh"] > warm.raw["routes"][0]["ev"]["energy_kwh"]
    assert cold.raw["routes"][0]["ev"]["soc_start"] == 0.7


def test_charge_that_does_not_suffice_is_told(osrm: Any) -> None:
    found = osrm.directions([ALSENWICK, PASS_ROAD], profile="ev@0.1")
    assert not found.raw["routes"][0]["ev"]["feasible"]
    assert "does not suffice" in found.raw["message"]


def test_charging_stops_make_the_goal_reachable(osrm: Any) -> None:
    found = osrm.directions([ALSENWICK, PASS_ROAD], profile="ev@0.3", charging="true")
    (route,) = found.raw["routes"][:1]
    assert route["ev"]["feasible"]
    assert route["ev"]["stop_s"] > 0.0
    assert "stop" in [leg["ev"]["ends_at"] for leg in route["legs"]]


def test_matrix_has_durations_and_distances_of_post_matrix(osrm: Any, served: ServedMap) -> None:
    places = [ALSENWICK, VALLEY_ROAD, PASS_ROAD]
    found = osrm.matrix(places, sources=[0, 2], destinations=[1])
    own = served.ask("/matrix", {"sources": [places[0], places[2]], "targets": [places[1]], "soc": 0.8})
    assert found.durations == [[pytest.approx(row[0], abs=0.06)] for row in own["duration_s"]]
    assert found.distances == [[pytest.approx(row[0], abs=0.06)] for row in own["distance_m"]]


def test_matrix_of_energies_is_an_annotation_of_our_own(osrm: Any) -> None:
    found = osrm.matrix([ALSENWICK, VALLEY_ROAD], annotations=["energy", "soc"], profile=ID4)
    assert found.raw["energies"][0][1] > 0.0
    assert found.raw["socs"][0][0] == 0.9
    assert found.durations is None


def code_of(caught: pytest.ExceptionInfo[RouterApiError]) -> str:
    assert caught.value.status == 400
    answer = json.loads(caught.value.message)
    assert answer["message"]
    code: str = answer["code"]
    return code


@pytest.mark.parametrize(
    ("places", "options", "code"),
    [
        ([ALSENWICK, AT_SEA], {}, "NoSegment"),
        ([ALSENWICK], {}, "InvalidOptions"),
        ([ALSENWICK, PASS_ROAD], {"profile": "foot"}, "InvalidValue"),
        ([ALSENWICK, PASS_ROAD], {"profile": "ev:no-such-car"}, "InvalidValue"),
        ([ALSENWICK, PASS_ROAD], {"profile": "ev@1.5"}, "InvalidValue"),
        ([ALSENWICK, PASS_ROAD], {"radiuses": [0.01, 5]}, "NoSegment"),
        ([ALSENWICK, PASS_ROAD], {"bearings": [[20, 30], [40, 50]]}, "NotImplemented"),
        ([ALSENWICK, PASS_ROAD], {"continue_straight": True}, "NotImplemented"),
        ([ALSENWICK, PASS_ROAD], {"exclude": "motorway"}, "InvalidValue"),
        ([ALSENWICK, PASS_ROAD], {"annotations": "nodes"}, "NotImplemented"),
        ([ALSENWICK, PASS_ROAD], {"no_such_option": 1}, "InvalidQuery"),
        ([ALSENWICK] * 30, {}, "TooBig"),
        ([[200.0, 44.0], PASS_ROAD], {}, "InvalidValue"),
    ],
)
def test_what_can_not_be_answered_has_a_code_of_osrm(
    osrm: Any, places: list[list[float]], options: dict[str, Any], code: str
) -> None:
    with pytest.raises(RouterApiError) as caught:
        osrm.directions(places, geometries="geojson", **options)
    assert code_of(caught) == code
