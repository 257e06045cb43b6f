"""Terms of the library are the terms of the energy model: one unit of each is what replaying with it takes more."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from diagnosis.causes.driven import driven, with_vehicle
from diagnosis.causes.library import LIBRARY, candidates
from diagnosis.causes.nuisance import PARAMETERS, SENSOR_COLUMNS
from diagnosis.fit.windows import trip_of, windows_of
from diagnosis.recordings.reading import Recording
from energy.conditions import STILL, Conditions, RoadSurface
from energy.replay.replay import replay
from energy.vehicle.coefficients import EffectCoefficients
from energy.vehicle.files import load_vehicle
from energy.vehicle.self_check import bundled_cycle

ROOT = Path(__file__).resolve().parents[3]
TERMS = {term.name: term for term in LIBRARY}
NOTHING = EffectCoefficients(
    rolling_temp_per_k=0.0, cabin_ua_w_per_k=0.0, cabin_soak_w_per_k=0.0, climate_fan_w=0.0, climate_limit_w=1e5,
    battery_resistance_ohm=0.0, air_density_coef=0.0, wet_rolling_coef=0.0, wet_drag_n_per_mps=0.0,
    yaw_drag_per_rad=0.0,
)  # fmt: skip


@pytest.fixture(scope="module")
def car():
    return load_vehicle(ROOT / "data" / "vehicles" / "bmw-i3-60ah.toml")


def recording(car, ambient_c=0.0, **channels):
    """A regulatory cycle over hills, at one temperature."""
    speed = bundled_cycle("udds").speed_mps
    time = np.arange(speed.size, dtype=float)
    way = np.concatenate(([0.0], np.cumsum(0.5 * (speed[1:] + speed[:-1]))))
    return Recording(
        "T", time, speed, np.zeros_like(time), elevation_m=500.0 + 30.0 * np.sin(way / 900.0),
        ambient_k=np.full(time.size, 273.15 + ambient_c), **channels,
    )  # fmt: skip


def more_j(car, drive, conditions, **coefficients):
    """What replaying with coefficients takes more than with none of them."""
    base = replace(car, effects=NOTHING)
    on = replace(car, effects=replace(NOTHING, **coefficients))
    profile = replace(drive.profile, altitude_m=drive.profile.altitude_m)
    return (
        replay(on, profile, conditions=conditions).step_energy_j
        - replay(base, profile, conditions=conditions).step_energy_j
    )


@pytest.mark.parametrize(
    ("term", "shape", "unit", "conditions", "coefficients"),
    [
        ("heating_w_per_k", 21.0, 100.0, {}, {"cabin_ua_w_per_k": 100.0}),
        ("warm_up_w_per_k", 500.0, 80.0, {}, {"cabin_soak_w_per_k": 80.0, "cabin_time_s": 500.0}),
        ("rolling_temp_per_k", np.nan, 0.008, {}, {"rolling_temp_per_k": 0.008}),
        ("tyre_warm_up_frac", 600.0, 0.2, {}, {"tyre_warm_up_frac": 0.2, "tyre_time_s": 600.0}),
        ("air_density_coef", np.nan, 1.0, {}, {"air_density_coef": 1.0}),
        ("drive_loss_w_per_n2", np.nan, 2e-4, {}, {"drive_loss_w_per_n2": 2e-4}),
        ("cold_battery_resistance_ohm", np.nan, 0.09, {}, {"battery_resistance_ohm": 0.09}),
    ],
)
def test_one_unit_is_what_replaying_with_it_takes_more(car, term, shape, unit, conditions, coefficients):
    drive = driven(recording(car), car)
    column = unit * TERMS[term].column_j(drive, shape)
    expected_j = more_j(car, drive, Conditions(ambient_k=273.15, **conditions), **coefficients)
    assert column.sum() == pytest.approx(expected_j.sum(), rel=0.03)
    assert np.abs(column - expected_j).sum() < 0.15 * np.abs(expected_j).sum()


def test_a_wet_road_is_that_of_the_model(car):
    drive = driven(recording(car, wet_frac=np.ones(bundled_cycle("udds").speed_mps.size)), car)
    on = replace(car, effects=replace(NOTHING, wet_rolling_coef=0.002, wet_drag_n_per_mps=0.8))
    expected_j = (
        replay(on, drive.profile, conditions=Conditions(road=RoadSurface.WET)).energy_j
        - replay(car, drive.profile).energy_j
    )
    column = 0.002 * TERMS["wet_rolling_coef"].column_j(drive, np.nan) + 0.8 * TERMS["wet_drag_n_per_mps"].column_j(
        drive, np.nan
    )
    assert column.sum() == pytest.approx(expected_j, rel=0.02)


def test_a_payload_is_that_of_the_model(car):
    drive = driven(recording(car, payload_kg=np.full(bundled_cycle("udds").speed_mps.size, 100.0)), car)
    expected_j = (
        replay(car, drive.profile, conditions=Conditions(payload_kg=100.0)).energy_j
        - replay(car, drive.profile).energy_j
    )
    assert TERMS["payload_coef"].column_j(drive, np.nan).sum() == pytest.approx(expected_j, rel=0.02)


def test_wind_is_that_of_the_model(car):
    n = bundled_cycle("udds").speed_mps.size
    blown = recording(car, heading_rad=np.full(n, 0.3), wind_speed_mps=np.full(n, 4.0), wind_from_rad=np.full(n, 0.3))
    drive = driven(blown, car)
    profile = replace(drive.profile, heading=np.tile((np.sin(0.3), np.cos(0.3)), (n - 1, 1)))
    windy = Conditions(wind_speed_mps=4.0, wind_from_rad=0.3)
    bare = replace(car, effects=NOTHING)
    expected_j = replay(bare, profile, conditions=windy).energy_j - replay(bare, profile).energy_j
    assert TERMS["wind_coef"].column_j(drive, np.nan).sum() == pytest.approx(expected_j, rel=0.02)


def test_terms_are_nothing_where_their_channel_was_not_recorded(car):
    drive = driven(replace(recording(car), ambient_k=None, elevation_m=None), car)
    for term in LIBRARY:
        if term.needs_ambient or term.channels:
            assert not term.column_j(drive, 1.0).any(), term.name
    names = {candidate.term.name for candidate in candidates([drive])}
    assert names == {term.name for term in LIBRARY if not (term.needs_ambient or term.channels or term.by_voltage)}


def test_every_term_is_finite_and_names_are_unique(car):
    n = bundled_cycle("udds").speed_mps.size
    rng = np.random.default_rng(1)
    full = recording(
        car, heading_rad=np.cumsum(rng.normal(0.0, 0.02, n)), wind_speed_mps=np.full(n, 5.0), wind_from_rad=np.zeros(n),
        wet_frac=np.ones(n), payload_kg=np.full(n, 50.0), soc_frac=np.linspace(1.0, 0.8, n),
        battery_k=np.full(n, 280.0),
    )  # fmt: skip
    drive = driven(full, car)
    every = candidates([drive])
    assert len({candidate.label for candidate in every}) == len(every)
    for candidate in every:
        column = candidate.term.column_j(drive, candidate.shape)
        assert column.shape == drive.duration_s.shape
        assert bool(np.isfinite(column).all()), candidate.label
        if (
            candidate.term.positive
            and not candidate.term.oscillates
            and candidate.term.name not in ("air_density_coef", "warm_restart_w_per_k")
        ):
            assert column.sum() >= 0.0, candidate.label


def test_parameter_columns_are_what_a_changed_vehicle_takes_more(car):
    drive = driven(recording(car), car)
    for parameter in PARAMETERS:
        step = 0.1 * parameter.step
        other = replace(car, **{parameter.name: getattr(car, parameter.name) + step})
        more = with_vehicle(drive, other).power_w - drive.power_w
        assert parameter.column_j(drive).sum() * step == pytest.approx(
            (more * drive.duration_s).sum(), rel=0.03, abs=5.0
        )


def test_windows_add_up_to_the_trip_whatever_their_length(car):
    plain = recording(car)
    power = replay(car, plain.profile()).power_w
    full = replace(plain, power_w=np.append(power, power[-1]))
    drive = driven(full, car)
    tried = candidates([drive])
    for window_s in (5.0, 10.0, 60.0):
        windows = windows_of(trip_of(full, drive, window_s), tried)
        assert windows.measured_j.sum() == pytest.approx(full.energy_j(), rel=1e-9)
        assert windows.duration_s.sum() == pytest.approx(full.time_s[-1])
        assert windows.distance_m.sum() == pytest.approx(full.distance_m(), rel=1e-9)
        assert 0.0 < windows.standing_s.sum() < windows.duration_s.sum()
        assert windows.simulated_j.sum() == pytest.approx(
            replay(car, drive.profile, conditions=STILL).energy_j, rel=1e-9
        )
        assert len(windows.names) == len(PARAMETERS) + len(SENSOR_COLUMNS) + len(tried) == windows.columns_j.shape[1]
