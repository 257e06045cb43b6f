"""Regimes of the mismatch: power where it was planted, intervals that take the trip as the unit."""

from __future__ import annotations

import math

import numpy as np
import pytest

from diagnosis.errors import DiagnosisError
from diagnosis.exposures import TripWindows
from diagnosis.locate import EDGES, Axis, regimes
from diagnosis.trip_fit import Fit

WINDOW_S = 10.0


def trip(number, extra_w=lambda speed, since_s: 0.0 * speed, *, trip_w=0.0, ambient_k=280.0, windows=120):
    """A trip of windows at random speeds, a quarter of them at rest, with an extra power and one of the trip's own."""
    rng = np.random.default_rng(number)
    speed = np.where(rng.random(windows) < 0.25, 0.0, rng.uniform(3.0, 35.0, windows))
    begin = WINDOW_S * np.arange(windows)
    power = extra_w(speed, begin) + trip_w + rng.normal(0.0, 50.0, windows)
    simulated = WINDOW_S * (500.0 + 12.0 * speed**2)
    return TripWindows(
        trip_id=f"T{number}",
        ambient_k=ambient_k,
        names=("aux_power_w",),
        begin_s=begin,
        duration_s=np.full(windows, WINDOW_S),
        distance_m=speed * WINDOW_S,
        standing_s=np.where(speed == 0.0, WINDOW_S, 0.0),
        measured_j=simulated + power * WINDOW_S,
        simulated_j=simulated,
        columns_j=np.full((windows, 1), WINDOW_S),
    )


def test_a_consumer_shows_at_standstill_and_while_driving_alike():
    standing, driving = reversed(regimes([trip(k, trip_w=800.0) for k in range(8)], Axis.STANDSTILL))
    for found in (standing, driving):
        assert found.mean_w == pytest.approx(800.0, abs=20.0)
        assert found.departs
        assert 0.0 < found.high_w - found.low_w < 40.0  # 50 W of noise over some 250 windows and more
    assert standing.low == 0.9


def test_drag_shows_at_speed_only():
    found = regimes([trip(k, lambda v, s: 0.2 * v**3) for k in range(10)], Axis.SPEED)
    at_rest, fastest = found[0], found[-1]
    assert abs(at_rest.mean_w) < 20.0
    assert fastest.low == 100.0
    assert fastest.mean_w > 4000.0
    assert [r.mean_w for r in found[1:]] == sorted(r.mean_w for r in found[1:])


def test_a_warm_up_shows_after_the_start_and_dies_away():
    found = regimes([trip(k, lambda v, s: 3000.0 * np.exp(-s / 300.0)) for k in range(8)], Axis.SINCE_START)
    powers = [r.mean_w for r in found]
    assert powers == sorted(powers, reverse=True)
    assert found[0].mean_w > 2000.0
    assert found[0].departs


def test_cold_shows_in_cold_trips_and_trips_without_temperature_are_left_out():
    trips = [trip(k, trip_w=100.0 * (288.0 - t), ambient_k=t) for k, t in enumerate((262.0, 265.0, 282.0, 287.0))]
    found = regimes([*trips, trip(9, trip_w=9e9, ambient_k=None)], Axis.AMBIENT)
    assert [(r.low, r.trips) for r in found] == [(-50.0, 2), (5.0, 2)]
    assert found[0].mean_w > found[1].mean_w > 0.0


def test_energy_of_all_regimes_is_the_residual_of_all_trips():
    trips = [trip(k, lambda v, s: 5.0 * v, trip_w=200.0) for k in range(5)]
    residual_kwh = sum(float(t.residual_j().sum()) for t in trips) / 3.6e6
    for axis in EDGES:
        found = regimes(trips, axis)
        assert sum(r.energy_kwh for r in found) == pytest.approx(residual_kwh, rel=1e-12)
        assert sum(r.duration_s for r in found) == pytest.approx(sum(t.duration_s.sum() for t in trips))


def test_a_fit_that_explains_it_leaves_nothing():
    trips = [trip(k, trip_w=600.0) for k in range(6)]
    fit = Fit(("aux_power_w",), np.array([600.0]), np.array([1.0]), 1.0, 6)
    assert all(r.departs for r in regimes(trips, Axis.STANDSTILL))
    assert not any(r.departs for r in regimes(trips, Axis.STANDSTILL, fit))


def test_interval_covers_the_truth_about_as_often_as_it_says_when_trips_differ():
    # each trip has an extra power of its own: windows within one are no independent evidence
    hits = 0
    for world in range(200):
        rng = np.random.default_rng(1000 + world)
        trips = [trip(100 * world + k, trip_w=300.0 + rng.normal(0.0, 400.0), windows=40) for k in range(10)]
        found = regimes(trips, Axis.SPEED, edges=(0.0, 200.0))[0]
        hits += found.low_w < 300.0 < found.high_w
    assert 0.90 <= hits / 200 <= 0.99


def test_one_trip_has_a_mean_and_no_interval():
    found = regimes([trip(1, trip_w=700.0)], Axis.STANDSTILL)
    assert all(r.low_w is None and not r.departs and math.isfinite(r.mean_w) for r in found)


def test_no_trips_and_falling_edges_are_refused():
    with pytest.raises(DiagnosisError, match="at least one"):
        regimes([], Axis.SPEED)
    with pytest.raises(DiagnosisError, match="rising"):
        regimes([trip(1)], Axis.SPEED, edges=(5.0, 1.0))
