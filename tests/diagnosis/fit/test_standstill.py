"""Heat is there at standstill too; what is not moves with the car."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from diagnosis.causes.families import Family
from diagnosis.engine import diagnose
from energy.vehicle.files import load_vehicle
from tests.diagnosis.planted_drives import drive, heater

ROOT = Path(__file__).resolve().parents[3]


@pytest.fixture(scope="module")
def car():
    return load_vehicle(ROOT / "data" / "vehicles" / "bmw-i3-60ah.toml")


def heat_of(car, more_w):
    found = diagnose([drive(car, number, more_w, stands_s=150) for number in range(14)], car)
    return next(finding for finding in found.findings if finding.family is Family.THERMAL)


def test_standstill_shows_all_of_a_heater(car):
    heat = heat_of(car, heater)
    low, high = heat.standing_ratio_ci95
    assert low < 1.0 < high
    assert heat.standing_ratio == pytest.approx(1.0, abs=0.25)
    assert heat.ambiguous_with == ()


def test_what_standstill_shows_too_little_of_has_tyres_for_a_rival(car):
    def mostly_moving(time, ambient_c, plain, steps):
        share = np.where(plain.speed_mps > 0.0, 1.0, 0.35)
        return share * heater(time, ambient_c, plain, steps)

    heat = heat_of(car, mostly_moving)
    assert heat.standing_ratio_ci95[1] < 0.75
    assert Family.ROLLING in {rival.family for rival in heat.ambiguous_with}
