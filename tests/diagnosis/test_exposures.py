"""Columns are what their causes do to the replayed energy; planted causes are found, with trips as the unit."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from diagnosis.errors import DiagnosisError
from diagnosis.exposures import (
    Family,
    drive_of_recording,
    effect_columns,
    parameter_columns,
    trip_windows,
    weighted_columns,
)
from diagnosis.recordings import Recording, read_recording
from diagnosis.trip_fit import fit_trips, predicted_j, score
from energy.replay import replay
from energy.self_check import bundled_cycle
from energy.vehicle_files import load_vehicle

ROOT = Path(__file__).resolve().parents[2]
RECORDINGS = ROOT.parent / "shared" / "data" / "recordings" / "bmw-i3"
HIDDEN = ("*heat*", "*air*con*", "*coolant*", "*cabin*", "*vent*", "*exchanger*")
TARGET_K = 294.15
COLUMNS = (*parameter_columns(), *effect_columns(TARGET_K, (400.0,)))


@pytest.fixture(scope="module")
def car():
    return load_vehicle(ROOT / "data" / "vehicles" / "bmw-i3-60ah.toml")


def drawn(car, number, ambient_k, heater_w=lambda since_s: 0.0 * since_s):
    """A drive of a regulatory cycle over hills, by a car with a heater of its own, as a recorder at 1 Hz sees it."""
    rng = np.random.default_rng(number)
    speed = bundled_cycle("udds" if number % 2 else "hwfet").speed_mps * rng.uniform(0.8, 1.1)
    time = np.arange(speed.size, dtype=float)
    way = np.concatenate(([0.0], np.cumsum(0.5 * (speed[1:] + speed[:-1]))))
    height = 500.0 + 40.0 * np.sin(way / rng.uniform(400.0, 1500.0))
    empty = Recording(f"T{number}", time, speed, np.zeros_like(time), elevation_m=height)
    power = replay(car, empty.profile()).power_w
    # a power that is constant over each step, as ∫P dt by the trapezoidal rule on steps of 1 s sees it
    at = np.concatenate(([power[0]], 0.5 * (power[1:] + power[:-1]), [power[-1]]))
    return replace(empty, power_w=at + heater_w(time), ambient_k=np.full(time.size, ambient_k))


def test_parameter_columns_are_what_a_changed_vehicle_takes_more(car):
    recording = drawn(car, 1, 280.0)
    drive = drive_of_recording(recording, car)
    for column in parameter_columns():
        step = {"drive_eff": 0.001, "recuperation_eff": 0.001, "mass_kg": 2.0}.get(column.name, 0.01)
        other = replace(car, **{column.name: getattr(car, column.name) + step})
        more = replay(other, drive.profile).step_energy_j - drive.simulated_j
        assert column.energy_j(drive).sum() * step == pytest.approx(more.sum(), rel=0.02, abs=5.0)


def test_windows_add_up_to_the_trip_whatever_their_length(car):
    recording = drawn(car, 3, 270.0)
    whole = [trip_windows(recording, car, COLUMNS, window_s=w) for w in (5.0, 10.0, 60.0)]
    for trip in whole:
        assert trip.measured_j.sum() == pytest.approx(recording.energy_j(), rel=1e-9)
        assert trip.duration_s.sum() == pytest.approx(recording.time_s[-1])
        assert trip.distance_m.sum() == pytest.approx(recording.distance_m(), rel=1e-9)
        np.testing.assert_allclose(trip.columns_j.sum(axis=0), whole[0].columns_j.sum(axis=0), rtol=1e-9, atol=1e-6)
        assert trip.names == tuple(column.name for column in COLUMNS)
        assert 0.0 < trip.standing_s.sum() < trip.duration_s.sum()


def test_columns_of_temperature_are_nothing_without_it(car):
    trip = trip_windows(replace(drawn(car, 1, 280.0), ambient_k=None), car, COLUMNS)
    for column, energy in zip(COLUMNS, trip.columns_j.T, strict=True):
        assert bool(energy.any()) != column.needs_ambient
    assert trip.ambient_k is None


def test_heating_column_is_the_power_of_a_heater(car):
    trip = trip_windows(drawn(car, 1, 268.15), car, COLUMNS)
    columns = dict(zip(trip.names, trip.columns_j.T, strict=True))
    np.testing.assert_allclose(columns["heating_w_per_k"], 26.0 * trip.duration_s)
    assert not columns["cooling_w_per_k"].any()
    begin, end = trip.begin_s, trip.begin_s + trip.duration_s
    np.testing.assert_allclose(
        columns["warm_up_400s_w_per_k"], 26.0 * 400.0 * (np.exp(-begin / 400.0) - np.exp(-end / 400.0)), rtol=1e-9
    )


@pytest.fixture(scope="module")
def planted(car):
    """Twelve drives from −15 to 15 °C of a heavier car with more auxiliaries, 80 W/K of heating and a warm-up."""
    heavier = replace(car, mass_kg=car.mass_kg + 120.0, aux_power_w=car.aux_power_w + 270.0)
    trips = []
    for number, ambient_k in enumerate(np.linspace(258.0, 288.0, 12)):
        away = TARGET_K - ambient_k
        recording = drawn(heavier, number, ambient_k, lambda s, away=away: away * (80.0 + 150.0 * np.exp(-s / 400.0)))
        trips.append(trip_windows(recording, car, COLUMNS))
    return trips


def test_planted_causes_are_found_and_others_are_not(planted, car):
    fit = fit_trips(planted, COLUMNS, prior_sd={"drive_eff": 0.03, "recuperation_eff": 0.08})
    found = dict(zip(fit.names, fit.coefficients, strict=True))
    assert found["mass_kg"] == pytest.approx(120.0, rel=0.1)
    assert found["aux_power_w"] == pytest.approx(270.0, rel=0.1)
    assert found["heating_w_per_k"] == pytest.approx(80.0, rel=0.05)
    assert found["warm_up_400s_w_per_k"] == pytest.approx(150.0, rel=0.05)
    assert found["rolling_temp_per_k"] == pytest.approx(0.0, abs=1e-3)
    assert found["air_density"] == pytest.approx(0.0, abs=0.2)
    assert fit.t_value("heating_w_per_k") > 10.0


def test_fit_meets_trips_that_it_has_not_seen(planted):
    fitted, held_out = planted[::2], planted[1::2]
    before = score(held_out, None)
    after = score(held_out, fit_trips(fitted, COLUMNS, prior_sd={"drive_eff": 0.03, "recuperation_eff": 0.08}))
    assert before.bias_frac < -0.2
    assert after.mape_frac < 0.01
    assert (before.trips, after.trips) == (6, 6)


def test_prediction_does_not_look_at_measured_power(planted):
    fit = fit_trips(planted, COLUMNS)
    blind = replace(planted[0], measured_j=np.full_like(planted[0].measured_j, np.nan))
    assert predicted_j(blind, fit) == predicted_j(planted[0], fit)


def test_each_trip_weighs_the_same(planted):
    columns, residual = weighted_columns([planted[0]])
    twice = replace(
        planted[0],
        **{
            name: np.repeat(getattr(planted[0], name), 2, axis=0)
            for name in ("begin_s", "duration_s", "distance_m", "standing_s", "measured_j", "simulated_j", "columns_j")
        },
    )
    more, left = weighted_columns([twice])
    np.testing.assert_allclose(more.T @ more, columns.T @ columns, rtol=1e-12)
    np.testing.assert_allclose(more.T @ left, columns.T @ residual, rtol=1e-12)


def test_too_few_trips_foreign_columns_and_bad_priors_are_refused(planted, car):
    with pytest.raises(DiagnosisError, match="2 trips, at least 3"):
        fit_trips(planted[:2], COLUMNS)
    with pytest.raises(DiagnosisError, match="has columns"):
        fit_trips(planted, COLUMNS[:3])
    with pytest.raises(DiagnosisError, match="prior_sd"):
        fit_trips(planted, COLUMNS, prior_sd={"colour": 1.0})
    with pytest.raises(DiagnosisError, match=r"window_s is 0\.1, allowed: 1\.\.600"):
        trip_windows(drawn(car, 1, 280.0), car, COLUMNS, window_s=0.1)
    with pytest.raises(DiagnosisError, match="at least one"):
        score([], None)


def test_every_column_names_its_unit_and_family():
    assert len({column.name for column in COLUMNS}) == len(COLUMNS)
    assert {column.family for column in COLUMNS} <= set(Family)
    assert all(column.unit for column in COLUMNS)


@pytest.mark.shared_data
def test_winter_and_summer_drives_of_a_real_car_are_met_far_better_on_trips_held_out(car):
    if not RECORDINGS.is_dir():
        pytest.skip(f"{RECORDINGS} is absent")
    files = sorted(RECORDINGS.glob("*.csv.gz"))
    columns = (*parameter_columns(), *effect_columns(TARGET_K, (200.0, 400.0, 800.0)))
    trips = [trip_windows(read_recording(path, HIDDEN), car, columns) for path in files]
    prior = {
        "mass_kg": 75.0,
        "road_load_a_n": 10.0,
        "road_load_b_n_per_mps": 1.0,
        "road_load_c_n_per_mps2": 0.05,
        "drive_eff": 0.05,
        "recuperation_eff": 0.15,
        "aux_power_w": 400.0,
    }
    for fitted, held_out in ((trips[::2], trips[1::2]), (trips[1::2], trips[::2])):
        before, after = score(held_out, None), score(held_out, fit_trips(fitted, columns, prior_sd=prior))
        print(f"held out {len(held_out)}: before {before}, after {after}")
        assert before.mape_frac > 0.2
        assert after.mape_frac < 0.5 * before.mape_frac
