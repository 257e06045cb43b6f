"""A load or a box on single trips is found on those trips, and a wind that nobody recorded."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from diagnosis.causes.driven import driven
from diagnosis.causes.families import Family
from diagnosis.engine import diagnose
from energy.units import GRAVITY_MPS2
from energy.vehicle.files import load_vehicle
from tests.diagnosis.planted_drives import drive

ROOT = Path(__file__).resolve().parents[3]
BOXED = (1, 4, 8, 11)
TRIPS = 15


@pytest.fixture(scope="module")
def car():
    return load_vehicle(ROOT / "data" / "vehicles" / "bmw-i3-60ah.toml")


def with_drag(recording, car, share):
    """The recording with more drag than the vehicle has, and the energy [kWh] that it took."""
    steps = driven(recording, car)
    more_j = steps.work_j(share * car.road_load_c_n_per_mps2 * steps.speed_mps**2)
    more_w = np.interp(recording.time_s, steps.since_s, more_j / steps.duration_s)
    return replace(recording, power_w=recording.power_w + more_w), float(more_j.sum()) / 3.6e6


def test_a_roof_box_is_found_on_the_trips_that_carried_it(car):
    drives, energy_kwh = [], 0.0
    for number in range(TRIPS):
        recording = drive(car, number)
        if number in BOXED:
            recording, more_kwh = with_drag(recording, car, 0.6)
            energy_kwh += more_kwh
        drives.append(recording)
    found = diagnose(drives, car).findings
    (level,) = found
    named = {level.effect, *(rival.effect for rival in level.ambiguous_with)}
    assert "roof_load" in named
    assert named <= {"roof_load", "trip_rolling"}  # of which these cycles cannot tell much
    assert set(level.trips) == {f"T{number}" for number in BOXED}
    assert level.energy_kwh == pytest.approx(energy_kwh, rel=0.25)
    low, high = level.energy_kwh_ci95
    assert low < energy_kwh < high


def with_power(recording, car, more_j):
    """The recording with energy added to each of its steps."""
    steps = driven(recording, car)
    more_w = np.interp(recording.time_s, steps.since_s, more_j(steps) / steps.duration_s)
    return replace(recording, power_w=recording.power_w + more_w)


def test_a_draw_that_was_left_on_is_a_constant_power_on_its_trips(car):
    drives = [drive(car, number) for number in range(TRIPS)]
    drives = [with_power(d, car, lambda s: 1200.0 * s.duration_s) if k in BOXED else d for k, d in enumerate(drives)]
    (level,) = diagnose(drives, car).findings
    assert (level.effect, level.ambiguous_with) == ("trip_power", ())
    assert set(level.trips) == {f"T{number}" for number in BOXED}
    assert level.coefficients[0].unit == "W"
    assert level.coefficients[0].value == pytest.approx(1200.0, rel=0.1)


def test_a_load_on_some_trips_is_mass(car):
    def loaded(steps):
        force = car.rotating_mass_coef * steps.accel_mps2 + 9.80665 * steps.grade_frac
        return steps.work_j(350.0 * (force + car.road_load_a_n / car.mass_kg))

    drives = [drive(car, number) for number in range(TRIPS)]
    drives = [with_power(d, car, loaded) if k in BOXED else d for k, d in enumerate(drives)]
    (level,) = diagnose(drives, car).findings
    assert level.effect == "trip_payload"
    assert set(level.trips) <= {f"T{number}" for number in BOXED}  # one of them hardly accelerates
    assert len(level.trips) >= 3
    assert level.coefficients[0].value == pytest.approx(350.0 / car.mass_kg, rel=0.25)  # of the file's mass


def test_tyres_that_were_changed_are_a_step_in_the_order_of_the_drives(car):
    drives = [drive(car, number) for number in range(TRIPS)]
    drives = [
        with_power(d, car, lambda s: s.work_j(0.35 * car.road_load_a_n)) if k >= 7 else d for k, d in enumerate(drives)
    ]
    (level,) = diagnose(drives, car).findings
    assert "trip_rolling" in {level.effect, *(rival.effect for rival in level.ambiguous_with)}
    assert level.trips == tuple(f"T{number}" for number in range(7, TRIPS))
    assert "from T7 on" in level.text


def test_without_height_what_single_trips_have_may_be_hills(car):
    drives = [replace(drive(car, number), elevation_m=None) for number in range(TRIPS)]
    found = diagnose(drives, car)
    assert found.findings == ()
    assert [lack.channel for lack in found.missing if lack.decisive] == ["elevation_m"]
    assert found.text.startswith("No height was recorded on any drive")


def test_clean_trips_carry_no_level(car):
    assert diagnose([drive(car, 300 + number) for number in range(TRIPS)], car).findings == ()


def test_an_unrecorded_wind_is_told_from_headings(car):
    drives = []
    for number in range(TRIPS):
        rng = np.random.default_rng(900 + number)
        recording = drive(car, number)
        heading = np.cumsum(rng.normal(0.0, 0.05, recording.time_s.size)) + rng.uniform(0.0, 6.0)
        recording = replace(recording, heading_rad=heading)
        steps = driven(recording, car)
        from_rad, wind_mps = rng.uniform(0.0, 6.0), 6.0
        ahead = wind_mps * np.cos(from_rad - steps.channels["heading_rad"])
        v = steps.speed_mps
        more_j = steps.work_j(car.road_load_c_n_per_mps2 * ((v + ahead) * np.abs(v + ahead) - v * v))
        more_w = np.interp(recording.time_s, steps.since_s, more_j / steps.duration_s)
        drives.append(replace(recording, power_w=recording.power_w + more_w))
    (found,) = diagnose(drives, car).findings
    assert (found.effect, found.family) == ("steady_wind", Family.WIND)
    assert found.coefficients[0].value == pytest.approx(6.0, rel=0.3)


def with_mass(recording, car, kilograms):
    """The recording with a load, and the energy [kWh] that it took."""
    steps = driven(recording, car)
    force = car.rotating_mass_coef * steps.accel_mps2 + GRAVITY_MPS2 * steps.grade_frac
    more_j = steps.work_j(kilograms * (force + car.road_load_a_n / car.mass_kg))
    more_w = np.interp(recording.time_s, steps.since_s, more_j / steps.duration_s)
    return replace(recording, power_w=recording.power_w + more_w), float(more_j.sum()) / 3.6e6


def test_loads_that_differ_from_trip_to_trip_are_told_with_their_trips(car):
    drives, energy_kwh, loaded = [], 0.0, set()
    for number in range(16):
        kilograms = (0.0, 120.0, 480.0, 0.0, 300.0)[number % 5]
        recording, more_kwh = with_mass(drive(car, number), car, kilograms)
        drives.append(recording)
        energy_kwh += more_kwh
        if kilograms >= 300.0:
            loaded.add(recording.id)
    (found,) = diagnose(drives, car).findings
    assert (found.effect, found.family) == ("trip_payload", Family.MASS)
    assert loaded <= set(found.trips)
    assert not {f"T{number}" for number in range(16) if number % 5 in (0, 3)} & set(found.trips)
    low, high = found.energy_kwh_ci95
    assert low < energy_kwh < high


def test_tyres_that_lose_air_grow_worse_from_trip_to_trip(car):
    drives = []
    for number in range(20):
        share = 0.4 * number / 19.0
        drives.append(with_power(drive(car, number), car, lambda d, s=share: d.work_j(s * car.road_load_a_n)))
    found = diagnose(drives, car)
    level = next(finding for finding in found.findings if finding.effect == "trip_rolling")
    assert "growing from none on T0 to all of it on T19" in level.text
    assert set(level.trips) == {f"T{number}" for number in range(10, 20)}
    assert level.coefficients[0].value == pytest.approx(0.4, abs=0.15)
    assert "road_load_a_n" not in {error.parameter for error in found.parameter_errors}
