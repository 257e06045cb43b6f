"""PUT, GET and DELETE /vehicles/{id}: what is stored comes back, what can't be is refused."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from dataclasses import fields
from typing import TYPE_CHECKING, Any

import pytest
from starlette.testclient import TestClient

from app.conversions.effects import effects_answer, effects_from_sent, schema_name
from app.http.examples.answers import VEHICLE_BODIES
from app.main import create_app
from app.schemas.effects import EffectsSent
from app.service.service import Service
from energy.vehicle.coefficients import EffectCoefficients
from tests.app.expected import CHAIN_LINK, HERE, MAPBOX, TABLE, TOMTOM, VEHICLE, check_problem, database_in

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    from app.settings import Settings

CHAIN: dict[str, Any] = {"chain": [{"length_m": 900, "grade": 0.01, "speed_limit_kmh": 70}], "soc": 0.5}
ODD = 0.1 + 0.2  # a number that a conversion to SI and back would change


CHARGING: dict[str, Any] = {
    "connectors": ["type2", "ccs2"],
    "curve_soc_percent": [0, 33.3 * ODD, 80, 100],
    "curve_kw": [100 * ODD, 70, 40, ODD],
    "ac_kw": 11 + ODD,
    "ac_phases": 3,
    "ac_one_phase_kw": 7 + ODD,
    "ac_eff": 0.6 + ODD,
    "dc_eff": 0.5 + ODD,
    "cold_c": [-10 - ODD, 20 * ODD],
    "cold_factor": [ODD, 0.9 + ODD / 9],
}


BEYOND = {"stateOfChargeInkWh": 90, "maxPowerInkW": 50}
CCS = {"currentType": "DC", "plugTypes": ["CCS"]}


@pytest.fixture
def shop(settings: Settings, service: Service, tmp_path: Path) -> Iterator[TestClient]:
    """A client with an empty database of its own, on the loaded graphs."""
    own = Service(settings.model_copy(update={"database_url": database_in(tmp_path)}), {})
    own.atlas = service.atlas
    with TestClient(create_app(own.settings, own)) as started:
        yield started


def test_put_of_a_new_vehicle_answers_201_with_its_place_and_the_next_put_200(shop: TestClient) -> None:
    first = shop.put("/vehicles/my-car", json=VEHICLE | {"name": "first"})
    assert (first.status_code, first.headers["location"]) == (201, "/vehicles/my-car")
    second = shop.put("/vehicles/my-car", json=VEHICLE | {"name": "second"})
    assert (second.status_code, second.headers.get("location")) == (200, None)
    assert shop.get("/vehicles/my-car").json() == second.json()
    assert second.json()["name"] == "second"


def test_stored_vehicle_is_listed_among_the_bundled_until_it_is_removed(shop: TestClient) -> None:
    before = shop.get("/vehicles").json()
    assert all(line["bundled"] for line in before["vehicles"])
    shop.put("/vehicles/my-car", json=VEHICLE)
    shop.put("/vehicles/my-van", json=TABLE)
    listed = shop.get("/vehicles").json()["vehicles"]
    assert [line["id"] for line in listed] == sorted(line["id"] for line in listed)
    stored = [(v["id"], v["kind"], v["mass_kg"]) for v in listed if not v["bundled"]]
    assert stored == [("my-car", "physical", 1500), ("my-van", "consumption_table", None)]
    for vehicle_id in ("my-car", "my-van"):
        assert shop.delete(f"/vehicles/{vehicle_id}").status_code == 204
    assert shop.get("/vehicles").json() == before


def test_physical_vehicle_comes_back_with_every_number_as_sent(shop: TestClient) -> None:
    body = VEHICLE | {
        "name": "odd Å 车",
        "road_load": {"a_n": 120 + ODD, "b_n_per_kmh": 0.1 * ODD, "c_n_per_kmh2": 0.03 * ODD},
        "usable_capacity_kwh": 40 + ODD,
        "acceleration": {"speed_kmh": [0, 10 + ODD, 130.7], "accel_mps2": [ODD, 1], "decel_mps2": [-ODD, -1]},
        "effects": {"cabin_target_c": 20 + ODD, "heating_cop": 2 + ODD},
        "sources": {"mass_kg": "weighed", "a note of mine": "\u0000 ü"},
        "sd": {"mass_kg": 20 * ODD, "road_load.b_n_per_kmh": ODD, "effects.cabin_target_c": ODD},
    }
    shop.put("/vehicles/odd", json=body)
    shown = shop.get("/vehicles/odd").json()
    assert {key: shown[key] for key in body if key != "effects"} == {k: v for k, v in body.items() if k != "effects"}
    assert {key: shown["effects"][key] for key in body["effects"]} == body["effects"]


def test_consumption_table_comes_back_with_every_number_as_sent(shop: TestClient) -> None:
    body = TABLE | {
        "consumption": {"speed_kmh": [ODD, 50 + ODD], "kwh_per_100km": [10 * ODD, 15 + ODD]},
        "ascent_wh_per_m": 7 + ODD,
        "kinetic": {"mass_kg": 2000 * ODD, "acceleration_eff": 0.9, "deceleration_eff": ODD},
        "sd": {"ascent_wh_per_m": ODD},
        "sources": {"consumption.kwh_per_100km": "logged"},
    }
    shop.put("/vehicles/odd", json=body)
    shown = shop.get("/vehicles/odd").json()
    assert {key: shown[key] for key in body} == body
    assert shown["id"] == "odd"


@pytest.mark.parametrize("vehicle", [VEHICLE, TABLE], ids=["physical", "table"])
def test_charging_comes_back_with_every_number_as_sent_and_defaults_filled_in(
    shop: TestClient, vehicle: dict[str, Any]
) -> None:
    sources = {"charging.curve_kw": "measured", "charging.connectors": "seen"}
    put = shop.put("/vehicles/odd", json=vehicle | {"charging": CHARGING, "sources": sources})
    assert put.json()["charging"] == CHARGING
    assert shop.get("/vehicles/odd").json() == put.json()
    assert put.json()["sources"] == sources
    few = {"connectors": ["type1"], "ac_kw": 7.4}
    shown = shop.put("/vehicles/odd", json=vehicle | {"charging": few}).json()["charging"]
    assert {name: value for name, value in shown.items() if value is not None} == few | {
        "ac_phases": 1,
        "ac_eff": 0.9,
        "dc_eff": 0.95,
    }
    assert shop.put("/vehicles/odd", json=vehicle).json()["charging"] is None


def test_list_names_the_plugs_and_a_bundled_vehicle_shows_its_charging_with_sources(shop: TestClient) -> None:
    shop.put("/vehicles/odd", json=VEHICLE | {"charging": CHARGING})
    plugs = {line["id"]: line["connectors"] for line in shop.get("/vehicles").json()["vehicles"]}
    assert plugs["odd"] == plugs["hyundai-kona-64"] == ["type2", "ccs2"]
    assert plugs["toyota-corolla-petrol"] == []
    shown = shop.get("/vehicles/hyundai-kona-64").json()
    assert shown["charging"]["curve_kw"][:3] == [70, 77, 70]
    assert shown["charging"]["curve_soc_percent"][:3] == [0, 40, 42]
    assert shown["sources"]["charging.curve_kw"].startswith("Open EV Data (https://github.com/KilowattApp/")
    assert shown["sources"]["charging.ac_eff"].startswith("assumed: ")


def test_epa_coefficients_and_their_deviations_come_back_in_newton(shop: TestClient) -> None:
    shop.put("/vehicles/epa", json=VEHICLE_BODIES["physical"]["value"] | {"sd": {"road_load.a_lbf": 1}})
    shown = shop.get("/vehicles/epa").json()
    assert shown["road_load"]["a_n"] == pytest.approx(28 * 4.4482216152605)
    assert shown["sd"] == {"road_load.a_n": pytest.approx(4.4482216152605)}


@pytest.mark.parametrize("without", [("id",), ("id", "sources")])
def test_every_vehicle_without_its_id_can_be_stored_and_shows_the_same(
    shop: TestClient, without: tuple[str, ...]
) -> None:
    shop.put("/vehicles/my-van", json=TABLE)
    for line in shop.get("/vehicles").json()["vehicles"]:
        shown = shop.get(f"/vehicles/{line['id']}").json()
        body = {key: value for key, value in shown.items() if key not in without}
        copy = shop.put("/vehicles/a-copy", json=body)
        assert copy.status_code in (200, 201), copy.text
        assert {key: value for key, value in copy.json().items() if key in body} == body


def test_put_in_a_services_parameters_stores_the_consumption_table_that_they_stand_for(shop: TestClient) -> None:
    here = shop.put("/vehicles/by-here", json=HERE)
    assert (here.status_code, here.json()["kind"], here.json()["name"]) == (201, "consumption_table", "by-here")
    assert here.json() == shop.get("/vehicles/by-here").json()
    assert here.json()["consumption"] == {
        "speed_kmh": [10, 30, 50, 70, 90, 110, 130],
        "kwh_per_100km": [13, 13.6, 15.1, 17.6, 21.4, 26.4, 32.1],
    }
    numbers = {name: here.json()[name] for name in ("ascent_wh_per_m", "descent_wh_per_m", "usable_capacity_kwh")}
    assert numbers == {"ascent_wh_per_m": 9, "descent_wh_per_m": 4.3, "usable_capacity_kwh": 80}
    assert here.json()["aux_power_w"] == pytest.approx(6480)  # 1.8 Wh/s
    assert here.json()["kinetic"] is None
    mapbox = shop.put("/vehicles/by-mapbox", json=MAPBOX).json()
    assert mapbox["consumption"] == {"speed_kmh": [0, 20, 80, 120], "kwh_per_100km": [30, 16, 14, 18]}
    assert (mapbox["usable_capacity_kwh"], mapbox["aux_power_w"]) == (50, 300)


def test_put_in_a_services_parameters_stores_how_the_vehicle_charges(shop: TestClient) -> None:
    by_tomtom = shop.put("/vehicles/by-tomtom", json=TOMTOM).json()
    charging = by_tomtom["charging"]
    assert charging["connectors"] == ["type2", "ccs2"]
    # 150 kW · 0.9 − 0.2 kW arrive; 85 kWh of capacity
    assert charging["curve_kw"] == pytest.approx([134.8, 134.8, 100, 40, 40])
    assert charging["curve_soc_percent"] == pytest.approx([0, 63.04 / 0.85, 70 / 0.85, 80 / 0.85, 100])
    assert (charging["ac_kw"], charging["ac_phases"]) == (11, 3)
    assert by_tomtom["sources"]["charging.curve_kw"] == TOMTOM["source"]
    here = shop.put("/vehicles/by-here", json=HERE).json()["charging"]
    assert here["connectors"] == ["ccs2", "chademo"]
    assert (here["curve_soc_percent"][:3], here["curve_kw"][:3]) == ([0, 40, 70], [239, 199, 167])
    mapbox = shop.put("/vehicles/by-mapbox", json=MAPBOX).json()["charging"]
    assert (mapbox["curve_soc_percent"], mapbox["curve_kw"]) == ([0, 50, 75, 100], [100, 70, 30, 10])
    assert (mapbox["connectors"], mapbox["ac_kw"]) == (["ccs1", "ccs2"], 7.4)
    for name, body in (("by-tomtom", TOMTOM), ("by-here", HERE), ("by-mapbox", MAPBOX)):
        without = {key: value for key, value in body.items() if "harging" not in key and "onnector" not in key}
        assert shop.put(f"/vehicles/{name}", json=without).json()["charging"] is None


def test_put_in_tomtoms_parameters_drives_as_the_bundled_example_of_them(shop: TestClient) -> None:
    stored = shop.put("/vehicles/by-tomtom", json=TOMTOM).json()
    assert stored["name"] == TOMTOM["name"]
    assert set(stored["sources"].values()) == {TOMTOM["source"]}
    energies = [
        shop.post("/simulate", json={"chain": [CHAIN_LINK, CHAIN_LINK | {"grade": 0.02}], "vehicle": name}).json()
        for name in ("by-tomtom", "example-tomtom-table")
    ]
    assert energies[0]["energy_kwh"] == pytest.approx(energies[1]["energy_kwh"], rel=1e-5)
    assert energies[0]["energy_parts_kwh"]["grade"] > 0.0


@pytest.mark.parametrize("body", [VEHICLE, TABLE], ids=["physical", "consumption table"])
def test_stored_vehicle_takes_what_the_same_vehicle_takes_inline(shop: TestClient, body: dict[str, Any]) -> None:
    shop.put("/vehicles/my-car", json=body)
    stored = shop.post("/simulate", json=CHAIN | {"vehicle": "my-car"}).json()
    inline = shop.post("/simulate", json=CHAIN | {"vehicle": body}).json()
    assert stored["request"]["vehicle"] == "my-car"
    assert stored["energy_kwh"] == inline["energy_kwh"] > 0.0
    routed = shop.post("/route", json={"start": [8.0, 46.5], "goal": [8.02, 46.52], "soc": 0.5, "vehicle": "my-car"})
    assert routed.status_code == 200, routed.text


def test_acceleration_that_was_left_out_is_stored_as_the_default_vehicles_tables(shop: TestClient) -> None:
    shown = shop.put("/vehicles/my-car", json=VEHICLE).json()
    assert shown["acceleration"] == shop.get("/vehicles/hyundai-kona-64").json()["acceleration"]


def test_inline_vehicle_must_send_its_acceleration_where_the_default_vehicle_has_none(
    settings: Settings, service: Service, tmp_path: Path
) -> None:
    changes = {"database_url": database_in(tmp_path), "default_vehicle": "my-van"}
    own = Service(settings.model_copy(update=changes), {})
    own.atlas = service.atlas
    with TestClient(create_app(own.settings, own)) as client:
        client.put("/vehicles/my-van", json=TABLE)
        assert client.get("/vehicles").json()["default"] == "my-van"
        problem = check_problem(client.post("/simulate", json=CHAIN | {"vehicle": VEHICLE}), 422, "invalid_vehicle")
        assert problem["errors"][0]["field"] == "vehicle.acceleration"
        assert client.post("/simulate", json=CHAIN).json()["request"]["vehicle"] == "my-van"


def test_vehicle_without_a_name_is_named_after_its_id(shop: TestClient) -> None:
    assert shop.put("/vehicles/my-car", json=VEHICLE).json()["name"] == "my-car"


@pytest.mark.parametrize("method", ["PUT", "DELETE"])
def test_change_of_a_bundled_vehicle_answers_409_and_leaves_it(shop: TestClient, method: str) -> None:
    before = shop.get("/vehicles/vw-id4").json()
    problem = check_problem(
        shop.request(method, "/vehicles/vw-id4", json=VEHICLE if method == "PUT" else None), 409, "vehicle_is_bundled"
    )
    assert problem["errors"] == [{"field": "id", "value": "vw-id4", "allowed": "the id of no bundled vehicle"}]
    assert shop.get("/vehicles/vw-id4").json() == before


@pytest.mark.parametrize("method", ["GET", "DELETE"])
@pytest.mark.parametrize("vehicle_id", ["delorean", "De-Lorean", "a--b", "%00", "x" * 150, "%F0%9F%9A%97"])
def test_unknown_vehicle_answers_404(shop: TestClient, method: str, vehicle_id: str) -> None:
    problem = check_problem(shop.request(method, f"/vehicles/{vehicle_id}"), 404, "unknown_vehicle")
    assert problem["errors"][0]["allowed"].startswith("one of ")


def test_unknown_vehicle_names_those_that_are_like_it_stored_ones_too(shop: TestClient) -> None:
    shop.put("/vehicles/kona-of-mine", json=VEHICLE)
    named = check_problem(shop.get("/vehicles/hyundai-kona"), 404, "unknown_vehicle")["errors"][0]["allowed"]
    assert "hyundai-kona-64" in named
    named = check_problem(shop.get("/vehicles/kona-of-min"), 404, "unknown_vehicle")["errors"][0]["allowed"]
    assert named.startswith("one of kona-of-mine, ")


@pytest.mark.parametrize("vehicle_id", ["My-Car", "a--b", "-a", "a-", "ä", "a%20b", "x" * 101])
def test_put_under_an_id_that_no_vehicle_file_could_have_is_refused(shop: TestClient, vehicle_id: str) -> None:
    problem = check_problem(shop.put(f"/vehicles/{vehicle_id}", json=VEHICLE), 422, "invalid_request")
    assert problem["errors"][0]["field"] == "id"


@pytest.mark.parametrize(
    ("body", "field", "allowed"),
    [
        ({}, "mass_kg", "required"),
        ([], "", "an object that describes a vehicle"),
        ("hyundai-kona-64", "", "an object that describes a vehicle"),
        (VEHICLE | {"mass_kg": "1500"}, "mass_kg", "a valid number"),
        (VEHICLE | {"colour": "red"}, "colour", "no field of this name"),
        (VEHICLE | {"id": "other"}, "id", "no field of this name"),
        (VEHICLE | {"kind": "steam"}, "kind", "'physical' or 'consumption_table'"),
        (HERE | {"format": "garmin"}, "format", "'tomtom', 'here' or 'mapbox'"),
        (HERE | {"format": ["here"]}, "format", "'tomtom', 'here' or 'mapbox'"),
        (HERE | {"maxCharge": 0}, "maxCharge", "at least 0.001"),
        (HERE | {"maxCharge": "80"}, "maxCharge", "a valid number"),
        (HERE | {"trafficSpeedTable": "0,0.349"}, "trafficSpeedTable", "no field of this name"),
        (HERE | {"kind": "consumption_table"}, "kind", "no field of this name"),
        (TOMTOM | {"chargingParameters": {}}, "chargingParameters.batteryCurve", "required"),
        (TOMTOM | {"accelerationEfficiency": 0}, "accelerationEfficiency", "at least 0.1"),
        ({"format": "mapbox", "ev_max_charge": 50000}, "energy_consumption_curve", "required"),
        (VEHICLE | {"kind": None}, "kind", "'physical' or 'consumption_table'"),
        (VEHICLE | {"name": "two\nlines"}, "name", "a text of one line"),
        (VEHICLE | {"name": "x" * 201}, "name", "at most 200 characters"),
        (VEHICLE | {"sources": {"mass_kg": 3}}, "sources.mass_kg", "a valid string"),
        (VEHICLE | {"sd": {"colour": 1}}, "sd.colour", "no field of this name, but mass_kg"),
        (VEHICLE | {"sd": {"mass_kg": -1}}, "sd.mass_kg", "at least 0"),
        (VEHICLE | {"sd": {"road_load.a_lbf": 1}}, "sd.road_load.a_lbf", "no field of this name"),
        (VEHICLE | {"effects": {"heating_cop": 99}}, "effects.heating_cop", "at most 10"),
        (VEHICLE | {"effects": {"cabin_target_c": 294}}, "effects.cabin_target_c", "at most 40"),
        (VEHICLE | {"charging": {}}, "charging.connectors", "required"),
        (VEHICLE | {"charging": CHARGING | {"connectors": []}}, "charging.connectors", "at least 1 item"),
        (VEHICLE | {"charging": CHARGING | {"connectors": ["ccs"]}}, "charging.connectors[0]", "'type1'"),
        (VEHICLE | {"charging": CHARGING | {"curve_kw": [1, 2, 3, 0]}}, "charging.curve_kw[3]", "at least 0.001"),
        (TABLE | {"charging": CHARGING | {"ac_kw": 101}}, "charging.ac_kw", "at most 100"),
        (TABLE | {"charging": CHARGING | {"ac_phases": 4}}, "charging.ac_phases", "1, 2 or 3"),
        (TABLE | {"charging": CHARGING | {"plug": "ccs2"}}, "charging.plug", "no field of this name"),
        (TABLE | {"kinetic": {"mass_kg": 2000}}, "kinetic.acceleration_eff", "required"),
        (TABLE | {"mass_kg": 1500}, "mass_kg", "no field of this name"),
        (TABLE | {"sd": {"mass_kg": 1}}, "sd.mass_kg", "no field of this name"),
        ({key: TABLE[key] for key in TABLE if key != "kind"}, "kind", "required"),
        (TABLE | {"consumption": {"speed_kmh": [], "kwh_per_100km": []}}, "consumption.speed_kmh", "at least 1 item"),
    ],
)
def test_put_of_a_bad_field_names_it(shop: TestClient, body: object, field: str, allowed: str) -> None:
    problem = check_problem(shop.put("/vehicles/my-car", json=body), 422, "invalid_request")
    assert problem["errors"][0]["field"] == field
    assert problem["errors"][0]["allowed"].startswith(allowed)


@pytest.mark.parametrize(
    ("body", "field", "value"),
    [
        (HERE | {"descent": 9.5}, "descent", 9.5),
        (HERE | {"freeFlowSpeedTable": "30,0.2,0,0.2"}, "freeFlowSpeedTable", [30, 0]),
        (HERE | {"freeFlowSpeedTable": "0,fast"}, "freeFlowSpeedTable", "'fast'"),
        (
            HERE | {"freeFlowSpeedTable": ",".join(f"{k / 2},0.2" for k in range(401))},
            "freeFlowSpeedTable",
            "401 points",
        ),
        (TOMTOM | {"vehicleWeight": 0}, "vehicleWeight", 0),
        (TOMTOM | {"decelerationEfficiency": 1.6}, "accelerationEfficiency and decelerationEfficiency", [0.66, 1.6]),
        (MAPBOX | {"ev_descent": 9.5}, "ev_descent", 9.5),
        (HERE | {"chargingCurve": "0,239,81,1"}, "chargingCurve", [0, 81]),
        (HERE | {"connectorTypes": "ccs2"}, "connectorTypes", "'ccs2'"),
        (HERE | {"connectorTypes": None}, "chargingCurve and connectorTypes", "only one of them"),
        (MAPBOX | {"ev_charging_curve": "0,1e5;60000,1e4"}, "ev_charging_curve", [0, 60000]),
        (MAPBOX | {"ev_charging_curve": ";".join(f"{k},1e4" for k in range(201))}, "ev_charging_curve", "201 points"),
        (
            TOMTOM | {"chargingParameters": TOMTOM["chargingParameters"] | {"batteryCurve": [BEYOND]}},
            "chargingParameters.batteryCurve",
            [90],
        ),
        (
            TOMTOM | {"chargingParameters": TOMTOM["chargingParameters"] | {"chargingConnectors": [CCS]}},
            "chargingParameters.chargingConnectors[0].plugTypes",
            "'CCS'",
        ),
    ],
)
def test_put_in_a_services_parameters_that_contradict_themselves_names_the_services_parameter(
    shop: TestClient, body: dict[str, Any], field: str, value: object
) -> None:
    problem = check_problem(shop.put("/vehicles/my-car", json=body), 422, "invalid_vehicle")
    assert (problem["errors"][0]["field"], problem["errors"][0]["value"]) == (field, value)


@pytest.mark.parametrize(
    ("body", "field", "value"),
    [
        (
            VEHICLE | {"road_load": {"a_n": -5, "b_n_per_kmh": 0, "c_n_per_kmh2": 0}},
            "road_load",
            "-5.0 N at 0.0 km/h",
        ),
        (VEHICLE | {"effects": {"regen_cold_full_c": -20}}, "effects.regen_cold_none_c", -15),
        (TABLE | {"descent_wh_per_m": 8}, "descent_wh_per_m", 8),
        (
            TABLE | {"consumption": {"speed_kmh": [50, 40], "kwh_per_100km": [10, 12]}},
            "consumption.speed_kmh",
            [50, 40],
        ),
        (
            TABLE | {"consumption": {"speed_kmh": [40, 50], "kwh_per_100km": [10]}},
            "consumption.kwh_per_100km",
            "1 values",
        ),
        (
            VEHICLE | {"charging": CHARGING | {"curve_soc_percent": [0, 90, 80, 100]}},
            "charging.curve_soc_percent",
            [0, 90, 80, 100],
        ),
        (VEHICLE | {"charging": CHARGING | {"curve_kw": [100, 50]}}, "charging.curve_kw", "2 values"),
        (TABLE | {"charging": CHARGING | {"connectors": ["type2"]}}, "charging.connectors", "type2"),
        (TABLE | {"charging": CHARGING | {"ac_one_phase_kw": 1}}, "charging.ac_one_phase_kw", 1),
        (TABLE | {"charging": {"connectors": ["chademo"]}}, "charging.curve_kw", "missing"),
    ],
)
def test_put_of_a_vehicle_that_contradicts_itself_names_the_field_of_the_body(
    shop: TestClient, body: dict[str, Any], field: str, value: object
) -> None:
    problem = check_problem(shop.put("/vehicles/my-car", json=body), 422, "invalid_vehicle")
    assert (problem["errors"][0]["field"], problem["errors"][0]["value"]) == (field, value)
    inline = check_problem(shop.post("/simulate", json=CHAIN | {"vehicle": body}), 422, "invalid_vehicle")
    assert (inline["errors"][0]["field"], inline["errors"][0]["value"]) == (f"vehicle.{field}", value)


def test_refused_put_leaves_the_stored_vehicle(shop: TestClient) -> None:
    stored = shop.put("/vehicles/my-car", json=VEHICLE).json()
    assert shop.put("/vehicles/my-car", json=VEHICLE | {"mass_kg": -1}).status_code == 422
    assert shop.get("/vehicles/my-car").json() == stored


def test_puts_of_one_id_at_the_same_time_create_it_once_and_leave_one_of_them_whole(shop: TestClient) -> None:
    bodies = [VEHICLE | {"mass_kg": 1000 + k, "name": f"car {k}"} for k in range(24)]
    with ThreadPoolExecutor(8) as pool:
        answers = list(pool.map(lambda body: shop.put("/vehicles/my-car", json=body), bodies))
    assert sorted(answer.status_code for answer in answers) == [200] * 23 + [201]
    assert shop.get("/vehicles/my-car").json() in [answer.json() for answer in answers]


def test_browser_of_an_allowed_origin_may_put_and_delete(shop: TestClient) -> None:
    for method in ("PUT", "DELETE"):
        asked = {"Origin": "https://map.example", "Access-Control-Request-Method": method}
        answer = shop.options("/vehicles/my-car", headers=asked)
        assert answer.status_code == 200
        assert method in answer.headers["access-control-allow-methods"]


def test_effects_have_every_coefficient_and_convert_there_and_back_to_the_digit() -> None:
    names = {schema_name(field.name) for field in fields(EffectCoefficients)}
    assert set(EffectsSent.model_fields) == names
    default = EffectCoefficients()
    assert effects_answer(default).cabin_target_c == 21
    assert effects_from_sent(effects_answer(default)) == effects_from_sent(None) == default
