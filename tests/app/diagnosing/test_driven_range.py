"""The fastest and the steepest of recorded drives, without what no drive held."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from app.diagnosing.driven_range import fastest_kmh, steepest
from diagnosis.recordings.recording import Detail, Recording


def straight(speed_mps: float, grade: float | None, duration_s: int = 600) -> Recording:
    """A drive at one speed, on one grade where heights are recorded."""
    time_s = np.arange(float(duration_s))
    height_m = None if grade is None else 300.0 + grade * speed_mps * time_s
    power_w = np.full(time_s.size, 5000.0)
    return Recording("T", time_s, np.full(time_s.size, speed_mps), power_w, elevation_m=height_m)


def test_grades_are_those_of_the_drives_with_heights() -> None:
    low, high = steepest([straight(15.0, 0.04), straight(15.0, -0.07), straight(15.0, None)]) or (0.0, 0.0)
    assert low == pytest.approx(-0.07, abs=1e-6)
    assert high == pytest.approx(0.04, abs=1e-6)
    assert steepest([straight(15.0, None)]) is None
    assert steepest([]) is None


def test_speed_that_was_held_for_less_than_ten_seconds_in_all_does_not_count() -> None:
    drive = straight(20.0, None)
    speed_mps = drive.speed_mps.copy()
    speed_mps[100:106] = 55.0  # a spike of the sensor
    assert fastest_kmh([replace(drive, speed_mps=speed_mps)]) == pytest.approx(72.0)
    speed_mps[100:120] = 30.0
    assert fastest_kmh([replace(drive, speed_mps=speed_mps)]) == pytest.approx(108.0)


def test_what_happened_in_a_gap_does_not_count() -> None:
    time_s = np.array([0.0, 10.0, 20.0, 500.0, 510.0, 520.0])
    speed_mps = np.array([10.0, 10.0, 30.0, 30.0, 10.0, 10.0])
    drive = Recording("T", time_s, speed_mps, np.zeros(6), gaps=((20.0, 500.0),))
    assert fastest_kmh([drive]) == pytest.approx(72.0)
    assert fastest_kmh([replace(drive, gaps=())]) == pytest.approx(108.0)


def test_sums_of_drives_say_nothing_of_speeds_and_grades() -> None:
    drive = replace(straight(20.0, 0.05), detail=Detail.TOTALS)
    assert fastest_kmh([drive]) is None
    assert steepest([drive]) is None
    charge = replace(straight(20.0, 0.05), detail=Detail.CHARGE)
    assert fastest_kmh([charge]) == pytest.approx(72.0)
