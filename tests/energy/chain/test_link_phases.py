"""Phases of a link by hand: cases 1 to 6 of docs/model.md, distances and speeds.

The vehicle accelerates at 3, 2, 1 and brakes at 4, 3, 2 m/s² in 0-10, 10-20 and 20-30 m/s.
"""

from __future__ import annotations

import math

import numpy as np
import pytest

from energy.chain.kernels_link import mean_over_intervals
from energy.force.kernels_force import force_roots
from tests.energy.loaded import plan_link

pytestmark = pytest.mark.nojit


def test_full_phases_from_rest_to_rest_leave_the_cruise_between(make_physics):
    # (11) a = (3+2)/2 = 2.5, (12) s1 = 20²/5 = 80; (21) b = (4+3)/2 = 3.5, (22) s3 = 20²/7; (17) s2 = the rest
    s1, s2, s3, peak, end = plan_link(make_physics(), 1000.0, 0.0, 20.0, 0.0)
    assert s1 == pytest.approx(80.0)
    assert s3 == pytest.approx(400.0 / 7.0)
    assert s2 == pytest.approx(920.0 - 400.0 / 7.0)
    assert (peak, end) == (20.0, 0.0)


def test_entry_below_the_limit_accelerates_in_the_touched_interval_only(make_physics):
    # 10 to 20 m/s touches the second interval: a = 2, s1 = (400-100)/4 = 75; no braking
    assert plan_link(make_physics(), 1000.0, 10.0, 20.0, 20.0) == pytest.approx((75.0, 925.0, 0.0, 20.0, 20.0))


def test_entry_above_the_limit_brakes_first(make_physics):
    # case 1: 30 to 20 m/s: b = 2, s1 = (900-400)/4 = 125
    assert plan_link(make_physics(), 1000.0, 30.0, 20.0, 20.0) == pytest.approx((125.0, 875.0, 0.0, 20.0, 20.0))


def test_entry_above_the_limit_with_a_lower_target_brakes_twice(make_physics):
    # s1 = 125 as above; 20 to 10 m/s: b = 3, s3 = (400-100)/6 = 50; s2 = 1000-175
    assert plan_link(make_physics(), 1000.0, 30.0, 20.0, 10.0) == pytest.approx((125.0, 825.0, 50.0, 20.0, 10.0))


def test_entry_at_the_limit_is_all_cruise(make_physics):
    assert plan_link(make_physics(), 1000.0, 20.0, 20.0, 20.0) == (0.0, 1000.0, 0.0, 20.0, 20.0)


def test_full_phases_that_just_fit_have_no_cruise(make_physics):
    # s1 = 80 and, 20 to 10 m/s, s3 = 300/6 = 50
    assert plan_link(make_physics(), 130.0, 0.0, 20.0, 10.0) == pytest.approx((80.0, 0.0, 50.0, 20.0, 10.0))


def test_short_link_from_rest_to_rest_peaks_lower(make_physics):
    # case 3, a = 2.5, b = 3.5 (up to v_max, although the peak is lower):
    # peak² = 2abL/(a+b) = 2·2.5·3.5·96/6 = 280, s1 = 280/5 = 56, s3 = 280/7 = 40
    planned = plan_link(make_physics(), 96.0, 0.0, 20.0, 0.0)
    assert planned == pytest.approx((56.0, 0.0, 40.0, math.sqrt(280.0), 0.0))


def test_short_link_between_equal_speeds_peaks_lower(make_physics):
    # 10 → peak → 10 m/s under a limit of 30: a = (2+1)/2 = 1.5, b = (3+2)/2 = 2.5
    # peak² = (2·1.5·2.5·160 + 2.5·100 + 1.5·100)/4 = (1200+250+150)/4 = 400; s1 = 300/3 = 100, s3 = 300/5 = 60
    assert plan_link(make_physics(), 160.0, 10.0, 30.0, 10.0) == pytest.approx((100.0, 0.0, 60.0, 20.0, 10.0))


def test_braking_curve_in_a_link_is_the_same_whatever_the_entry(make_physics):
    # Two lower peaks in one link: both brake with b = (4+3)/2 = 3.5, so peak² = 7·s3
    for v_start in (0.0, 5.0, 11.0):
        _, _, s3, peak, _ = plan_link(make_physics(), 60.0, v_start, 20.0, 0.0)
        assert peak < 20.0
        assert peak * peak == pytest.approx(7.0 * s3)


def test_target_out_of_reach_accelerates_over_the_whole_link(make_physics):
    # case 4: v² = 2·2.5·45 = 225
    assert plan_link(make_physics(), 45.0, 0.0, 20.0, 20.0) == pytest.approx((45.0, 0.0, 0.0, 15.0, 15.0))


def test_lower_next_limit_out_of_reach_accelerates_over_the_whole_link(make_physics):
    # target 20 below the limit 30: a = 1.5, v² = 100 + 3·50 = 250 < 400
    end = math.sqrt(250.0)
    assert plan_link(make_physics(), 50.0, 10.0, 30.0, 20.0) == pytest.approx((50.0, 0.0, 0.0, end, end))


def test_braking_from_the_limit_too_long_brakes_harder(make_physics):
    # case 5: 20 → 0 needs 57.1 m at 3.5 m/s², 20 m are there
    assert plan_link(make_physics(), 20.0, 20.0, 20.0, 0.0) == (20.0, 0.0, 0.0, 0.0, 0.0)


def test_braking_from_below_the_limit_too_long_brakes_harder(make_physics):
    # 20 → 10 under a limit of 30: b = (3+2)/2 = 2.5 needs 300/5 = 60 m, 25 m are there
    assert plan_link(make_physics(), 25.0, 20.0, 30.0, 10.0) == (25.0, 0.0, 0.0, 10.0, 10.0)


def test_braking_that_nearly_fits_brakes_harder(make_physics):
    # as above with 59 of the 60 m: no acceleration first
    assert plan_link(make_physics(), 59.0, 20.0, 30.0, 10.0) == (59.0, 0.0, 0.0, 10.0, 10.0)
    s1, _, s3, peak, _ = plan_link(make_physics(), 61.0, 20.0, 30.0, 10.0)
    # one metre more: peak² = (2·1·2.5·61 + 2.5·400 + 1·100)/3.5 = 1405/3.5, with a = 1 in 20-30 m/s
    assert peak * peak == pytest.approx(1405.0 / 3.5)
    assert (s1, s3) == pytest.approx((peak * peak / 2.0 - 200.0, peak * peak / 5.0 - 20.0))


def test_braking_to_the_limit_too_long_brakes_harder(make_physics):
    # 30 → 20 needs 125 m, 50 m are there
    assert plan_link(make_physics(), 50.0, 30.0, 20.0, 20.0) == (50.0, 0.0, 0.0, 20.0, 20.0)


def test_braking_twice_too_long_brakes_once_and_harder(make_physics):
    # 30 → 20 takes 125 m and 20 → 0 takes 57.1 m, 150 m are there
    assert plan_link(make_physics(), 150.0, 30.0, 20.0, 0.0) == (150.0, 0.0, 0.0, 0.0, 0.0)


@pytest.mark.parametrize(
    ("accel", "decel", "v_start", "target", "length"),
    [(0.1, 0.3, 0.0, 9.0, 405.0), (0.1, 0.2, 4.0, 5.0, 45.0), (0.1, 0.3, 1.0, 11.0, 600.0)],
)
def test_target_reached_at_the_very_end_leaves_no_sliver_to_brake(make_physics, accel, decel, v_start, target, length):
    # v_start² + 2·a·length = target² to rounding: a third phase of 1e-13 m between equal speeds would divide by zero
    physics = make_physics(accel=(accel,), decel=(decel,))
    s1, s2, s3, peak, end = plan_link(physics, length, v_start, 20.0, target)
    assert (s1, s2, s3) == (length, 0.0, 0.0)
    assert (peak, end) == (target, target)


@pytest.mark.parametrize(
    ("low", "high", "mean"),
    [
        (0.0, 10.0, 3.0),  # ends exactly at an edge: the next interval is not touched
        (10.0, 20.0, 2.0),  # from edge to edge
        (0.0, 20.0, 2.5),
        (5.0, 15.0, 2.5),  # two halves count as two whole intervals: the mean is unweighted
        (9.9, 10.1, 2.5),
        (10.0, 10.1, 2.0),
        (19.9, 20.0, 2.0),
        (0.0, 30.0, 2.0),
        (0.0, 0.1, 3.0),
        (25.0, 50.0, 1.0),  # above the table's end the last interval holds on
        (15.0, 50.0, 1.5),
        (30.0, 40.0, 1.0),
        (35.0, 40.0, 1.0),
    ],
)
def test_mean_over_intervals_takes_the_touched_ones_unweighted(make_physics, low, high, mean):
    physics = make_physics()
    assert mean_over_intervals(physics.speed_bound_mps, physics.accel_sum, low, high) == pytest.approx(mean, rel=1e-15)


def test_mean_over_intervals_at_rounded_edges_touches_one_side_only():
    # 13 intervals of 10 km/h as in the source; edges that come from other divisions are off by an ulp
    bound = np.arange(14) * 10.0 / 3.6
    values = np.arange(1.0, 14.0)
    running = np.concatenate(([0.0], np.cumsum(values)))
    for k in range(13):
        for low in (k * 10.0 / 3.6, k * (10.0 / 3.6), np.nextafter(bound[k], 0.0), np.nextafter(bound[k], 99.0)):
            for high in ((k + 1) * (10.0 / 3.6), np.nextafter(bound[k + 1], 0.0), np.nextafter(bound[k + 1], 99.0)):
                assert mean_over_intervals(bound, running, low, high) == pytest.approx(values[k], rel=1e-13)


@pytest.mark.parametrize(
    ("f0", "b", "c", "roots"),
    [
        (-200.0, 0.0, 0.5, [20.0]),  # 0.5·20² = 200
        (300.0, -40.0, 1.0, [10.0, 30.0]),  # (v-10)(v-30)
        (-300.0, 40.0, -1.0, [10.0, 30.0]),
        (600.0, -50.0, 1.0, [20.0, 30.0]),
        (-60.0, 3.0, 0.0, [20.0]),  # C = 0
        (60.0, -3.0, 0.0, [20.0]),
        (5.0, 0.0, 0.0, []),  # B = C = 0
        (-5.0, 0.0, 0.0, []),
        (400.0, -40.0, 1.0, []),  # (v-20)² touches zero without changing sign
        (401.0, -40.0, 1.0, []),
        (75.0, -20.0, 1.0, [15.0]),  # (v-5)(v-15): the other root is at the interval's end
        (525.0, -50.0, 1.0, [15.0]),  # (v-15)(v-35): the other root lies at the other end
        (0.0, 0.0, 0.5, []),
    ],
)
def test_force_roots_between_5_and_35_are_the_factors(f0, b, c, roots):
    count, first, second = force_roots(f0, b, c, 5.0, 35.0)
    assert [first, second][:count] == pytest.approx(roots)


def test_entry_across_an_interval_boundary_can_leave_a_short_link_slower(make_physics):
    # a consequence of (11): 9.9 → 30 m/s touches 3, 2, 1 (mean 2), 10 → 30 m/s only 2, 1 (mean 1.5)
    # over 50 m: 98.01 + 200 = 298.01 against 100 + 150 = 250
    slower, faster = (plan_link(make_physics(), 50.0, v_start, 30.0, 30.0)[4] for v_start in (9.9, 10.0))
    assert slower**2 == pytest.approx(298.01)
    assert faster**2 == pytest.approx(250.0)
