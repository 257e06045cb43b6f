"""What a diagnosis has learned, in routes and ranges: by its object or its id, and what it does to a cold day."""

from __future__ import annotations

import sqlite3
from contextlib import closing
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

from app.conversions.conditions import vehicle_with_effects
from app.conversions.learned_effects import learned_effects
from app.schemas.learned_effects import LearnedEffects, LearnedFrom
from app.service.learned import warnings_of
from app.store.diagnoses import DiagnosisDocuments, DiagnosisStore, NewDiagnosis, Turn
from diagnosis.answer.results import Diagnosis, Finding, Rival, Verdict
from diagnosis.causes.families import Family
from diagnosis.engine import diagnose
from diagnosis.recordings.reading import read_recordings
from energy.vehicle.vehicle import Vehicle
from tests.app.expected import TABLE, VEHICLE, check_problem
from tests.app.recorded import HEATER_W_PER_K, write_winter

if TYPE_CHECKING:
    from starlette.testclient import TestClient

    from app.service.service import Service

CAR = "hyundai-kona-64"
SHARED = Path(__file__).resolve().parents[4] / "shared/data/recordings/bmw-i3"
ROUTE = {"start": [8.003, 46.5], "goal": [8.02, 46.518], "soc": 0.5, "vehicle": CAR}
NOTHING = Diagnosis(
    vehicle_id=CAR,
    verdict=Verdict.NOTHING_MISSING,
    text="",
    findings=(),
    parameter_errors=(),
    unexplained=(),
    data_quality=(),
    fitted_trips=("a", "b"),
    held_out_trips=("c",),
    before=None,
    after=None,
    routes=None,
    regimes_before=(),
    regimes_after=(),
    trips=(),
    effects={},
    effects_ci95={},
    parameters={},
    not_carried={},
)


def learned(**changes: Any) -> LearnedEffects:
    return learned_effects(replace(NOTHING, **changes), diagnosis_id="x", date="2026-03-01")


def store_effects(service: Service, diagnosis_id: str, vehicle: str, document: str) -> None:
    """Store a finished diagnosis with what it has learned."""
    store = DiagnosisStore(service.database)
    assert store.submit(NewDiagnosis(diagnosis_id, "nobody:1:run-a", vehicle, "{}"), 1000)
    assert store.begin(diagnosis_id, "run") is Turn.NOW
    assert store.finish(diagnosis_id, DiagnosisDocuments("{}", "", document, "[]"))


def area_km2(client: TestClient, **parameters: Any) -> float:
    answer = client.get("/range", params={"lat": 46.505, "lon": 8.001, **parameters}).json()
    return float(answer["features"][0]["properties"]["area_km2"])


def test_temperatures_are_in_celsius_with_their_intervals() -> None:
    sent = learned(
        effects={"cabin_target_k": 294.15, "cabin_ua_w_per_k": 120.00000000001, "regen_always_limited": 1.0},
        effects_ci95={"cabin_target_k": (292.15, 296.15), "cabin_ua_w_per_k": None},
    )
    assert (sent.cabin_target_c, sent.cabin_ua_w_per_k, sent.regen_always_limited) == (21.0, 120.0, True)
    assert sent.learned_from is not None
    assert sent.learned_from.ci95 == {"cabin_target_c": [19.0, 23.0], "cabin_ua_w_per_k": None}
    assert (sent.learned_from.trips, sent.learned_from.held_out_trips) == (2, 1)


def test_findings_that_could_be_others_are_open_causes_in_words() -> None:
    clear = Finding("load_loss", Family.DRIVETRAIN, "", (), 1.0, None, 0.1, 9.0)
    alike = replace(
        clear,
        effect="cabin_heating",
        family=Family.THERMAL,
        ambiguous_with=(Rival("rolling_temperature", Family.ROLLING),),
        separating_recording="A recording with standstill.",
    )
    origin = learned(findings=(clear, alike)).learned_from
    assert origin is not None
    assert [cause.model_dump() for cause in origin.open_causes] == [
        {
            "cause": "Heating the cabin in the cold",
            "rivals": ["Tyres that roll harder in the cold"],
            "recording": "A recording with standstill.",
        }
    ]


def test_what_requests_would_refuse_is_named_as_not_carried() -> None:
    sent = learned(
        effects={"heating_cop": 99.0, "cabin_ua_w_per_k": 100.0},
        parameters={"mass_kg": 0.2, "aux_power_w": 300.0},
        not_carried={"cornering": "routes have no curvature"},
    )
    assert sent.heating_cop is None
    assert sent.parameters is not None
    assert (sent.parameters.mass_kg, sent.parameters.aux_power_w) == (None, 300.0)
    assert sent.learned_from is not None
    assert set(sent.learned_from.not_carried) == {"cornering", "heating_cop", "mass_kg"}
    assert sent.learned_from.not_carried["heating_cop"].startswith("99 is beyond")


def test_parameters_replace_the_vehicles_own_numbers_and_leave_the_others(service: Service) -> None:
    kona = service.known_vehicle(CAR)
    numbers = {
        "mass_kg": 2000.0,
        "road_load_a_n": 150.0,
        "road_load_b_n_per_mps": 1.0,
        "road_load_c_n_per_mps2": 0.5,
        "drive_eff": 0.8,
        "recuperation_eff": 0.5,
        "aux_power_w": 900.0,
    }
    changed = vehicle_with_effects(kona, LearnedEffects.model_validate({"parameters": numbers}))
    assert isinstance(kona, Vehicle)
    assert isinstance(changed, Vehicle)
    assert {name: getattr(changed, name) for name in numbers} == numbers
    assert changed.effects == kona.effects
    assert changed.usable_capacity_wh == kona.usable_capacity_wh
    assert vehicle_with_effects(kona, LearnedEffects.model_validate({"parameters": {}})) is kona


def test_route_with_parameters_takes_what_a_vehicle_with_these_numbers_takes(client: TestClient) -> None:
    heavy = {**VEHICLE, "mass_kg": 2100, "aux_power_w": 900}
    effects = {"parameters": {"mass_kg": 2100, "aux_power_w": 900}}
    by_effects = client.post("/route", json={**ROUTE, "vehicle": VEHICLE, "effects": effects}).json()
    by_vehicle = client.post("/route", json={**ROUTE, "vehicle": heavy}).json()
    assert by_effects["routes"] == by_vehicle["routes"]


def test_learned_from_changes_no_number(client: TestClient) -> None:
    effects = {"heating_cop": 2.0}
    cold = {**ROUTE, "conditions": {"ambient_c": -5}}
    learned = {**effects, "learned_from": {"vehicle": CAR, "date": "2026-03-01", "ci95": {"heating_cop": [1.9, 2.1]}}}
    plain, with_origin = (client.post("/route", json={**cold, "effects": sent}).json() for sent in (effects, learned))
    assert with_origin["routes"] == plain["routes"]
    assert with_origin["request"]["effects"]["learned_from"]["ci95"] == {"heating_cop": [1.9, 2.1]}


@pytest.mark.parametrize(
    ("effects", "code", "field"),
    [
        ({"parameters": {"mass_kg": 0}}, "invalid_request", "effects.parameters.mass_kg"),
        ({"parameters": {"usable_capacity_wh": 0}}, "invalid_request", "effects.parameters.usable_capacity_wh"),
        ({"learned_from": {"trips": -1}}, "invalid_request", "effects.learned_from.trips"),
        ({"learned_from": {"who": "me"}}, "invalid_request", "effects.learned_from.who"),
        ({"heating_cop": 99}, "invalid_request", "effects.heating_cop"),
        (7, "invalid_request", "effects"),
        (["x"], "invalid_request", "effects"),
        ("x" * 201, "invalid_request", "effects"),
        ({"parameters": {"road_load_a_n": -9000}}, "invalid_conditions", "effects.parameters.road_load"),
        (
            {"parameters": {"drive_eff": 1, "recuperation_eff": 1}, "vehicle": TABLE},
            "invalid_request",
            "effects.vehicle",
        ),
    ],
)
def test_effects_that_cannot_be_are_refused_with_their_field(
    client: TestClient, effects: object, code: str, field: str
) -> None:
    problem = check_problem(client.post("/route", json={**ROUTE, "effects": effects}), 422, code)
    assert problem["errors"][0]["field"] == field


def test_consumption_table_takes_no_parameters(client: TestClient) -> None:
    body = {**ROUTE, "vehicle": TABLE, "effects": {"parameters": {"mass_kg": 2000}}}
    problem = check_problem(client.post("/route", json=body), 422, "invalid_conditions")
    assert problem["errors"][0]["value"] == ["mass_kg"]


@pytest.mark.parametrize("effects_id", ["nothing", "", "../x", "A", "x\n", "\0", "é"])
def test_effects_of_an_unknown_id_answer_404_everywhere(client: TestClient, effects_id: str) -> None:
    named = {"effects": effects_id}
    for path, body in (
        ("/route", ROUTE),
        ("/range", {"origin": [8.003, 46.5], "soc": 0.01}),
        ("/simulate", {"links": [{"id": 0}]}),
    ):
        problem = check_problem(client.post(path, json={**body, **named}), 404, "unknown_effects")
        assert problem["errors"][0]["field"] == "effects"


def test_stored_effects_that_are_damaged_answer_409(client: TestClient, service: Service) -> None:
    store_effects(service, "20260301-damaged", CAR, "{}")
    path = service.database.url.database
    assert path is not None
    with closing(sqlite3.connect(path)) as connection:
        connection.execute(
            "UPDATE learned_effects SET document = '{\"heating_cop\": 99}' WHERE id = '20260301-damaged'"
        )
        connection.commit()
    problem = check_problem(
        client.post("/route", json={**ROUTE, "effects": "20260301-damaged"}), 409, "diagnosis_damaged"
    )
    assert "heating_cop is 99" in problem["detail"]


def assert_cold_shrinks_the_range(client: TestClient, service: Service, diagnosis: Diagnosis, soc: float) -> None:
    """The area on a cold day with what was learned is the smallest."""
    effects = learned_effects(diagnosis, diagnosis_id=f"20260301-{diagnosis.vehicle_id}", date="2026-03-01")
    effects_id = f"20260301-{diagnosis.vehicle_id}"
    store_effects(service, effects_id, diagnosis.vehicle_id, effects.model_dump_json(exclude_none=True))
    car = {"vehicle": diagnosis.vehicle_id, "soc": soc}
    base = area_km2(client, **car)
    mild = area_km2(client, **car, effects=effects_id, ambient_c=20)
    cold = area_km2(client, **car, effects=effects_id, ambient_c=-5)
    assert cold < min(base, mild)


def test_a_route_with_a_learned_capacity_uses_up_more_of_the_charge_and_the_same_energy(
    client: TestClient, service: Service
) -> None:
    kona = service.known_vehicle(CAR)
    aged = learned(parameters={"usable_capacity_wh": round(0.8 * kona.usable_capacity_wh)})
    effects = aged.model_dump(mode="json", exclude_none=True)
    assert effects["parameters"] == {"usable_capacity_wh": round(0.8 * kona.usable_capacity_wh)}
    plain, found = (
        client.post("/route", json={**ROUTE, **more}).json()["routes"][0] for more in ({}, {"effects": effects})
    )
    assert found["energy_kwh"] == pytest.approx(plain["energy_kwh"], rel=1e-6)
    assert 0.5 - found["soc_end"] == pytest.approx((0.5 - plain["soc_end"]) / 0.8, rel=1e-3)


def test_cold_shrinks_the_range_after_learning_from_winter_drives(
    client: TestClient, service: Service, tmp_path: Path
) -> None:
    kona = service.known_vehicle(CAR)
    assert isinstance(kona, Vehicle)
    write_winter(tmp_path, kona, duration_s=300)
    recordings, errors = read_recordings([tmp_path])
    assert errors == []
    diagnosis = diagnose(recordings, kona)
    # the heater's power for each kelvin is what the cabin loses over the heater's efficiency
    found = diagnosis.effects
    assert found["cabin_ua_w_per_k"] / found["heating_cop"] == pytest.approx(HEATER_W_PER_K, rel=0.1)
    assert_cold_shrinks_the_range(client, service, diagnosis, soc=0.006)


@pytest.mark.shared_data
def test_cold_shrinks_the_range_after_learning_from_recorded_drives_of_an_i3(
    client: TestClient, service: Service
) -> None:
    if not SHARED.is_dir():
        pytest.skip("no recordings beside the repository (shared/data/recordings)")
    i3 = service.known_vehicle("bmw-i3-60ah")
    assert isinstance(i3, Vehicle)
    every_third = sorted(SHARED.glob("Trip*.csv.gz"))[::3]
    recordings, errors = read_recordings(every_third, ["*Heat*", "*AirCon*", "*coolant*", "*vent*"])
    assert errors == []
    assert_cold_shrinks_the_range(client, service, diagnose(recordings, i3), soc=0.016)


@pytest.mark.parametrize(
    ("ambient_c", "verdict", "told"),
    [
        (None, "left_out_physics", ()),
        (-6.0, "left_out_physics", ()),  # near enough
        (-12.0, "left_out_physics", ("the effects were learned at -4 to 31 °C, this is -12 °C",)),
        (38.0, "parameter_error", ("the effects were learned at -4 to 31 °C, this is 38 °C",)),
        (10.0, "cannot_tell", ("the effects were learned from drives that could not tell their causes apart",)),
    ],
)
def test_requests_are_warned_beyond_what_was_driven_and_where_causes_are_open(ambient_c, verdict, told):
    effects = LearnedEffects(
        learned_from=LearnedFrom(vehicle="bmw-i3-60ah", ambient_c=[-4.0, 31.0], speed_kmh=130.0, verdict=verdict)
    )
    assert warnings_of(effects, "bmw-i3-60ah", ambient_c) == told
