"""A diagnosis from end to end: what was planted in drives is named, clean drives are left alone."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from diagnosis.answer.learned import learned_vehicle
from diagnosis.answer.results import CapacityKind, Verdict
from diagnosis.answer.results_json import as_json
from diagnosis.causes.families import Family
from diagnosis.engine import DiagnosisSettings, diagnose
from diagnosis.errors import DiagnosisCancelled, DiagnosisError
from diagnosis.recordings.reading import Recording
from energy.replay.replay import replay
from energy.vehicle.files import load_vehicle
from tests.diagnosis.planted_drives import drive, heater

ROOT = Path(__file__).resolve().parents[2]
TRIPS = 14


@pytest.fixture(scope="module")
def car():
    return load_vehicle(ROOT / "data" / "vehicles" / "bmw-i3-60ah.toml")


@pytest.fixture(scope="module")
def heated(car):
    drives = [drive(car, number, heater) for number in range(TRIPS)]
    return drives, diagnose(drives, car, held_out=("T3", "T8", "T12"))


def test_a_heater_that_the_model_does_not_know_is_named_and_sized(heated):
    drives, found = heated
    assert found.verdict is Verdict.LEFT_OUT_PHYSICS
    (first, *_) = found.findings
    assert (first.effect, first.family) == ("cabin_heating", Family.THERMAL)
    assert first.ambiguous_with == ()
    truth = sum(
        float(
            np.trapezoid(
                heater(recording.time_s, float(recording.ambient_k[0]) - 273.15, recording, None), recording.time_s
            )
        )
        / 3.6e6
        for recording in drives
        if recording.id in found.fitted_trips
    )
    low, high = first.energy_kwh_ci95
    assert 0.9 * low < truth < 1.1 * high
    assert first.energy_kwh == pytest.approx(truth, rel=0.15)
    assert not [finding for finding in found.findings if finding.family is not Family.THERMAL]
    assert first.located
    assert all(regime.departs for regime in first.located)


def test_held_out_trips_are_predicted_better_and_were_never_fitted(heated, car):
    drives, found = heated
    assert found.held_out_trips == ("T3", "T8", "T12")
    assert found.after.mape < 0.4 * found.before.mape
    assert found.after.mape_ci95[0] <= found.after.mape <= found.after.mape_ci95[1]
    spoilt = [
        replace(recording, power_w=3.0 * recording.power_w) if recording.id in found.held_out_trips else recording
        for recording in drives
    ]
    again = diagnose(spoilt, car, held_out=found.held_out_trips)
    assert [finding.coefficients for finding in again.findings] == [finding.coefficients for finding in found.findings]
    for account, other in zip(found.trips, again.trips, strict=True):
        assert account.after_kwh == pytest.approx(other.after_kwh, rel=1e-12)


def test_every_trip_is_accounted_for_by_families(heated):
    drives, found = heated
    assert {account.id for account in found.trips} == {recording.id for recording in drives}
    for account in found.trips:
        assert sum(account.by_family_kwh.values()) == pytest.approx(account.explained_kwh, rel=1e-9)
        assert abs(account.explained_kwh / account.measured_kwh - 1.0) < 0.05
        truth = next(recording for recording in drives if recording.id == account.id)
        assert account.measured_kwh == pytest.approx(truth.energy_j() / 3.6e6, rel=1e-6)


def test_what_was_learned_is_a_set_of_coefficients_of_the_model(heated, car):
    _, found = heated
    effects = replace(car.effects, **found.effects)
    assert effects.cabin_soak_w_per_k > 30.0
    assert effects.climate_limit_w >= 6000.0
    assert found.routes.mape < 0.6 * found.before.mape
    assert json.loads(json.dumps(as_json(found)))["verdict"] == "left_out_physics"


@pytest.mark.parametrize("first", [0, 100, 200])
def test_nothing_is_claimed_of_clean_drives(car, first):
    found = diagnose([drive(car, first + number) for number in range(TRIPS)], car)
    assert found.findings == ()
    assert found.unexplained == ()
    assert found.verdict in (Verdict.NOTHING_MISSING, Verdict.PARAMETER_ERROR)
    assert found.after.mape < 0.03


def test_a_battery_that_has_aged_is_told_and_carried_beside_consumption_that_is_right(car):
    def charged(number):
        recording = drive(car, number)
        taken_wh = np.cumsum(recording.power_w) / 3600.0
        charge = 0.9 - taken_wh / (0.85 * car.usable_capacity_wh)
        return replace(recording, soc_frac=np.round(charge / 0.005) * 0.005)

    found = diagnose([charged(number) for number in range(TRIPS)], car)
    assert found.capacity is not None
    assert found.capacity.kind is CapacityKind.LESS
    low, high = found.capacity.ci95_wh
    assert low < 0.85 * car.usable_capacity_wh < high
    assert found.verdict is Verdict.PARAMETER_ERROR
    assert "where its file has 18.8: aged" in found.text
    assert "nothing stands out" not in found.text
    assert found.findings == ()
    assert learned_vehicle(car, found).usable_capacity_wh == found.parameters["usable_capacity_wh"]
    written = as_json(found)["capacity"]
    assert written["kind"] == "less"
    assert written["kwh_ci95"][0] < 0.85 * 18.8 < written["kwh_ci95"][1]


def test_a_wrong_parameter_is_told_as_one_and_not_as_physics(car):
    wrong = replace(car, aux_power_w=car.aux_power_w + 900.0)
    found = diagnose([drive(car, number) for number in range(TRIPS)], wrong)
    assert found.verdict is Verdict.PARAMETER_ERROR
    (error,) = [error for error in found.parameter_errors if error.parameter == "aux_power_w"]
    assert error.ci95[0] < car.aux_power_w < error.ci95[1]
    assert "a constant offset of the recorded current" in error.aliases
    assert found.parameters["aux_power_w"] == pytest.approx(car.aux_power_w, abs=120.0)


def test_causes_that_drives_cannot_tell_apart_are_not_chosen_between(car):
    """On the motorway without a stop, heat that a cold cabin takes and drag of cold air differ in nothing."""

    def steady(number):
        rng = np.random.default_rng(500 + number)
        time = np.arange(900.0)
        speed = np.full(900, 25.0) + 0.3 * np.sin(time / 40.0 + number)
        ambient_c = float(rng.uniform(-15.0, 25.0))
        plain = Recording(
            f"M{number}", time, speed, np.zeros_like(time), ambient_k=np.full(time.size, 273.15 + ambient_c)
        )
        power = replay(car, plain.profile()).power_w
        at = np.append(power, power[-1]) * rng.normal(1.0, 0.01, 900) + 20.0 * rng.normal()
        return replace(
            plain, power_w=at + car.road_load_c_n_per_mps2 * 25.0**3 / 0.92 * (293.15 / (273.15 + ambient_c) - 1.0)
        )

    found = diagnose([steady(number) for number in range(16)], car)
    assert found.verdict is Verdict.CANNOT_TELL
    (recording,) = found.findings
    families = {recording.family, *(other.family for other in recording.ambiguous_with)}
    assert {Family.AERODYNAMIC, Family.ROLLING} <= families
    assert recording.separating_recording


def test_a_draw_of_no_known_kind_is_reported_where_it_is(car):
    def between(time, ambient_c, plain, steps):
        del ambient_c, steps
        return np.where((plain.elevation_m > 505.0) & (plain.elevation_m < 528.0), 2500.0, 0.0) + 0.0 * time

    found = diagnose([drive(car, number, between) for number in range(16)], car)
    assert found.verdict is Verdict.UNEXPLAINED
    assert found.findings == ()
    first = found.unexplained[0]
    assert first.axis == "altitude"
    assert min(first.high, 528.0) - max(first.low, 505.0) > 10.0
    assert first.p < 0.05


def test_few_trips_carry_no_conclusion(car):
    found = diagnose([drive(car, number, heater) for number in range(4)], car)
    assert found.verdict is Verdict.TOO_FEW_TRIPS
    assert "at least 6" in found.text
    assert found.findings == found.parameter_errors == found.unexplained == ()
    assert len(found.trips) == 4


def test_bad_orders_are_named(car):
    recording = drive(car, 1)
    with pytest.raises(DiagnosisError, match="0 recordings"):
        diagnose([], car)
    with pytest.raises(DiagnosisError, match="'T1' is there 2 times"):
        diagnose([recording, recording], car)
    with pytest.raises(DiagnosisError, match="held-out trip 'T9'"):
        diagnose([recording], car, held_out=["T9"])
    with pytest.raises(DiagnosisError, match="seed is -1"):
        DiagnosisSettings(seed=-1)
    with pytest.raises(DiagnosisError, match="window_s is 1"):
        DiagnosisSettings(window_s=1.0)


def test_progress_rises_and_a_cancelled_diagnosis_stops(car):
    drives = [drive(car, number) for number in range(8)]
    seen: list[tuple[str, float]] = []
    diagnose(drives, car, progress=lambda stage, share: seen.append((stage, share)))
    shares = [share for _, share in seen]
    assert shares == sorted(shares)
    assert shares[0] == 0.0
    assert shares[-1] < 1.0
    with pytest.raises(DiagnosisCancelled):
        diagnose(drives, car, cancelled=lambda: True)


def test_the_same_drives_give_the_same_answer(heated, car):
    drives, found = heated
    again = diagnose(drives, car, held_out=("T3", "T8", "T12"))
    assert json.dumps(as_json(again)) == json.dumps(as_json(found))


def test_a_heater_that_was_recorded_is_taken_as_it_was_and_the_rest_of_the_cold_is_not_heat(car):
    def heat_and_tyres(time, ambient_c, plain, steps):
        tyres_w = 0.025 * max(20.0 - ambient_c, 0.0) * car.road_load_a_n * plain.speed_mps / car.drive_eff
        return tyres_w + heater(time, ambient_c, plain, steps)

    def with_column(recording):
        watts = heater(recording.time_s, float(recording.ambient_k[0]) - 273.15, recording, None)
        return replace(recording, hvac_w=watts)

    drives = [with_column(drive(car, number, heat_and_tyres)) for number in range(20)]
    found = diagnose(drives, car)
    by_effect = {finding.effect: finding for finding in found.findings}
    assert {"cabin_heating", "rolling_temperature"} <= by_effect.keys()
    recorded_kwh = {one.id: float(np.trapezoid(one.hvac_w, one.time_s)) / 3.6e6 for one in drives}
    for account in found.trips:
        assert account.by_family_kwh.get("thermal", 0.0) == pytest.approx(recorded_kwh[account.id], abs=0.01)
    assert by_effect["cabin_heating"].energy_kwh == pytest.approx(sum(recorded_kwh.values()), rel=0.1)
