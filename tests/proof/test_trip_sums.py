"""The baselines on trip sums against energies that are made of these sums."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from energy.vehicle.files import load_vehicle
from energy.vehicle.vehicle import Vehicle
from proof.trip_sums import TripSums, ridge_kwh, sums_kwh, trip_sum_rules, trip_sums
from tests.diagnosis.planted_drives import drive

ROOT = Path(__file__).resolve().parents[2]


def made(seed: int, beta: np.ndarray) -> list[TripSums]:
    rng = np.random.default_rng(seed)
    found = []
    for k in range(30):
        seven = rng.uniform(0.2, 3.0, 7)
        three = np.array([seven[0] + 0.3 * seven[1], seven[1], seven[2]])
        found.append(TripSums(f"T{k}", float(seven @ beta), float(three[0]), three, seven))
    return found


def test_the_regression_finds_what_the_sums_are_made_of() -> None:
    trips = made(1, np.array([1.1, 0.4, 0.2, 0.0, 0.0, 0.05, 0.1]))
    predicted = sums_kwh(trips[:20], trips[20:])
    assert predicted == pytest.approx([trip.measured_kwh for trip in trips[20:]], rel=1e-6)


def test_the_ridge_finds_what_its_three_numbers_tell() -> None:
    trips = made(2, np.array([1.0, 0.9, 0.2, 0.0, 0.0, 0.0, 0.0]))
    predicted = ridge_kwh(trips[:20], trips[20:])
    assert predicted == pytest.approx([trip.measured_kwh for trip in trips[20:]], rel=0.01)


def test_sums_of_a_drive_are_those_of_the_file_and_the_weather() -> None:
    car = load_vehicle(ROOT / "data/vehicles/bmw-i3-60ah.toml")
    assert isinstance(car, Vehicle)
    recording = drive(car, 3, ambient_c=-5.0)
    sums = trip_sums(recording, car)
    hours = (recording.time_s[-1] - recording.time_s[0]) / 3600.0
    assert sums.three == pytest.approx([sums.file_kwh, hours, 25.0 * hours], rel=0.01)
    assert sums.measured_kwh == pytest.approx(recording.energy_j() / 3.6e6, rel=1e-6)
    assert sums.seven[6] == pytest.approx(sums.seven[3])  # without a battery's temperature it stood as cold as the air
    warm = replace(recording, battery_k=np.full(recording.time_s.size, 288.15))
    assert trip_sums(warm, car).seven[6] == pytest.approx(sums.seven[3] * 5.0 / 25.0, rel=1e-6)


def test_baselines_predict_held_out_drives_and_claim_nothing() -> None:
    car = load_vehicle(ROOT / "data/vehicles/bmw-i3-60ah.toml")
    assert isinstance(car, Vehicle)
    drives = [drive(car, number) for number in range(10)]
    for rule in trip_sum_rules(drives, car, {"T2", "T7"}):
        assert rule.families == ()
        assert rule.held_out_kwh == pytest.approx([drives[k].energy_j() / 3.6e6 for k in (2, 7)], rel=0.1)
