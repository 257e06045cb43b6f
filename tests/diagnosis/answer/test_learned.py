"""What was learned is what the energy model replays: fitted power and the model with learned effects agree."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from diagnosis.answer.learned import learned_vehicle
from diagnosis.causes.driven import driven
from diagnosis.engine import diagnose
from energy.conditions import Conditions
from energy.replay.replay import replay
from energy.vehicle.files import load_vehicle
from tests.diagnosis.planted_drives import drive, heater

ROOT = Path(__file__).resolve().parents[3]


@pytest.fixture(scope="module")
def car():
    return load_vehicle(ROOT / "data" / "vehicles" / "bmw-i3-60ah.toml")


def replayed_kwh(car, recording):
    """Energy by the route model's terms at the recorded speed and temperature, without the battery's own loss."""
    steps = driven(recording, car)
    still = replace(car, effects=replace(car.effects, battery_resistance_ohm=0.0))
    conditions = Conditions(ambient_k=float(recording.ambient_k[0]))
    return replay(still, steps.profile, conditions=conditions).energy_j / 3.6e6


def test_a_learned_heater_warms_the_route_model_too(car):
    drives = [drive(car, number, heater) for number in range(16)]
    found = diagnose(drives, car, held_out=("T2", "T5", "T9"))
    warmed = learned_vehicle(car, found)
    errors, plain = [], []
    for recording in drives:
        if recording.id in found.held_out_trips:
            errors.append(replayed_kwh(warmed, recording) / (recording.energy_j() / 3.6e6) - 1.0)
            plain.append(replay(car, driven(recording, car).profile).energy_j / recording.energy_j() - 1.0)
    assert np.abs(errors).mean() < 0.05
    assert np.abs(errors).mean() < 0.4 * np.abs(plain).mean()


def test_a_learned_hot_climate_cools(car):
    def cooler(time, ambient_c, plain, steps):
        del plain, steps
        return 110.0 * max(ambient_c - 22.0, 0.0) + 0.0 * time

    drives = [drive(car, number, cooler, ambient_c=10.0 + 2.0 * number) for number in range(15)]
    found = diagnose(drives, car)
    assert [finding.effect for finding in found.findings] == ["air_conditioning"]
    cooled = learned_vehicle(car, found)
    hottest = drives[-1]
    assert replayed_kwh(cooled, hottest) == pytest.approx(hottest.energy_j() / 3.6e6, rel=0.06)
    assert found.effects["cooling_ua_w_per_k"] == pytest.approx(110.0, rel=0.3)


def test_an_effect_that_routes_cannot_use_says_why(car):
    rng = np.random.default_rng(3)
    drives = []
    for number in range(14):
        recording = drive(car, number)
        battery_k = np.full(recording.time_s.size, 273.15 + rng.uniform(-5.0, 30.0))
        draw_w = 2500.0 * (battery_k < 281.15)
        drives.append(replace(recording, battery_k=battery_k, power_w=recording.power_w + draw_w))
    found = diagnose(drives, car)
    assert "battery_heating" in {finding.effect for finding in found.findings}
    assert "battery" in found.not_carried["battery_heating_w"]
