"""Mismatch by regime: sums are kept, and intervals take the trip as the unit."""

from __future__ import annotations

import numpy as np
import pytest

from diagnosis.answer.regimes import EDGES, Axis, regimes
from diagnosis.errors import DiagnosisError
from diagnosis.fit.axes import AXES
from diagnosis.fit.windows import Windows


def trip(number, windows=60, ambient_c=5.0):
    """Ten minutes of windows of 10 s; the vehicle stands in every third."""
    stands = np.arange(windows) % 3 == 0
    seconds = np.full(windows, 10.0)
    return Windows(
        trip_id=f"T{number}", ambient_k=None if ambient_c is None else 273.15 + ambient_c,
        begin_s=10.0 * np.arange(windows), duration_s=seconds, distance_m=np.where(stands, 0.0, 150.0),
        standing_s=np.where(stands, 10.0, 0.0), measured_j=np.zeros(windows), simulated_j=np.full(windows, 3e4),
        dynamic_w=np.full(windows, 3e3), hill_w=np.zeros(windows), places={"grade_frac": np.zeros(windows)},
        names=(), columns_j=np.empty((windows, 0)),
    )  # fmt: skip


def test_energy_of_all_regimes_is_what_is_left_of_all_trips():
    rng = np.random.default_rng(1)
    trips = [trip(k) for k in range(6)]
    residuals_w = [rng.normal(0.0, 500.0, 60) for _ in trips]
    whole_kwh = sum(float((residual_w * 10.0).sum()) for residual_w in residuals_w) / 3.6e6
    for axis in (Axis.STANDSTILL, Axis.SPEED, Axis.SINCE_START, Axis.AMBIENT, Axis.GRADE, Axis.POWER):
        found = regimes(trips, axis, residuals_w)
        assert sum(regime.energy_kwh for regime in found) == pytest.approx(whole_kwh, rel=1e-9)
        assert sum(regime.duration_s for regime in found) == pytest.approx(3600.0)


def test_a_draw_at_standstill_is_located_there():
    trips = [trip(k) for k in range(8)]
    rng = np.random.default_rng(2)
    residuals_w = [np.where(windows.standing_s > 0.0, 800.0, 0.0) + rng.normal(0.0, 60.0, 60) for windows in trips]
    moving, standing = regimes(trips, Axis.STANDSTILL, residuals_w)
    assert standing.departs
    assert standing.low_w < 800.0 < standing.high_w
    assert not moving.departs


def test_the_interval_is_the_standard_error_of_trips_not_of_seconds():
    trips = [trip(k) for k in range(5)]
    levels = np.array([-200.0, 300.0, 100.0, 600.0, -50.0])
    (found,) = regimes(trips, Axis.AMBIENT, [np.full(60, level) for level in levels])
    half = 2.7764 * levels.std(ddof=1) / np.sqrt(5)
    assert found.high_w - found.mean_w == pytest.approx(half, rel=1e-3)
    assert found.mean_w == pytest.approx(levels.mean())


def test_one_trip_has_no_interval_and_departs_nowhere():
    (found,) = regimes([trip(0)], Axis.AMBIENT, [np.full(60, 900.0)])
    assert found.low_w is None
    assert not found.departs


def test_trips_without_the_channel_are_left_out():
    assert regimes([trip(0, ambient_c=None)], Axis.AMBIENT, [np.ones(60)]) == ()
    assert regimes([trip(0)], Axis.SOC, [np.ones(60)]) == ()


def test_bad_edges_and_no_trips_are_named():
    with pytest.raises(DiagnosisError, match="no trips"):
        regimes([], Axis.SPEED, [])
    with pytest.raises(DiagnosisError, match="rising"):
        regimes([trip(0)], Axis.SPEED, [np.ones(60)], edges=(5.0, 5.0))


def test_edges_of_all_axes_rise():
    assert set(EDGES) <= set(AXES) == set(Axis)
    for edges in EDGES.values():
        assert list(edges) == sorted(set(edges))
