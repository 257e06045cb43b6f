"""The link model against a slow twin: quadrature of battery power, and bisection for the peak speed."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import quad
from scipy.optimize import brentq

from energy.chain.kernels_link import mean_over_intervals
from energy.force.effects import drive_of
from tests.energy.loaded import link_energy, loaded, plan_link, ramp_energy


def wheel_force_n(p, v, accel, grade, flat):
    """Equation (4) in SI units."""
    drag_n = p.rolling_n * flat + p.linear_n_per_mps * v + p.aero_n_per_mps2 * v**2
    return drag_n + p.inertia_kg * accel + p.weight_n * grade


def ramp_by_quadrature(p, ds, v_a, v_b, grade, flat):
    """Battery energy, time and sum of absolute pieces of a ramp: ∫P_bat dt over v, dt = dv/a, by scipy.

    Changes of sign are looked for on a grid, not with the closed form under test.
    """
    accel = (v_b**2 - v_a**2) / (2.0 * ds)

    def force(v):
        return wheel_force_n(p, v, accel, grade, flat)

    def battery_w(v):
        wheel_w = force(v) * v
        return wheel_w * (p.drive_factor if wheel_w >= 0.0 else p.recuperation_factor)

    grid = np.linspace(v_a, v_b, 2001)
    signs = np.sign(force(grid))
    edges = [v_a]
    for k in np.flatnonzero(signs[:-1] * signs[1:] < 0.0):
        edges.append(brentq(force, grid[k], grid[k + 1], xtol=1e-13))
    edges.append(v_b)
    pieces = [
        # full_output: roundoff is returned as a message, not a warning
        quad(lambda v: battery_w(v) / accel, a, b, epsabs=0.0, epsrel=1e-12, full_output=1)[0]
        for a, b in itertools.pairwise(edges)
    ]
    dt = (v_b - v_a) / accel
    return sum(pieces) + p.aux_move_w * dt, dt, sum(map(abs, pieces)) + p.aux_move_w * dt


def assert_ramp_is_the_integral(p, ds, v_a, v_b, grade):
    flat = math.sqrt(1.0 - grade * grade)
    energy_j, time_s = ramp_energy(p, ds, v_a, v_b, grade, flat)
    twin_j, twin_s, scale_j = ramp_by_quadrature(p, ds, v_a, v_b, grade, flat)
    assert time_s == pytest.approx(twin_s, rel=1e-12)
    # forces that cancel out leave the rounding of their own size
    rounding_j = 1e-14 * ds * (p.rolling_n + p.weight_n * abs(grade) + p.inertia_kg * abs(v_b**2 - v_a**2) / (2.0 * ds))
    assert energy_j == pytest.approx(twin_j, rel=1e-9, abs=1e-9 * scale_j + 10.0 * rounding_j)


DIPPING = {"linear_n_per_mps": -20.0, "aero_n_per_mps2": 1.0}
HUMPED = {"linear_n_per_mps": 20.0, "aero_n_per_mps2": -0.6}


@pytest.mark.nojit
@pytest.mark.parametrize(
    ("changes", "ds", "v_a", "v_b", "grade", "sign_changes"),
    [
        pytest.param({}, 80.0, 0.0, 20.0, 0.0, 0, id="start"),
        pytest.param({}, 57.0, 20.0, 0.0, 0.0, 0, id="brake"),
        pytest.param({}, 1466.0, 30.0, 10.0, 0.0, 1, id="gentle braking"),
        pytest.param({}, 3000.0, 5.0, 30.0, -0.0471, 1, id="accelerating downhill"),
        # m·d·a = -55 N: 45 - 20v + v² is zero at 2.6 and 17.4 m/s
        pytest.param(DIPPING, 8990.0, 30.0, 1.0, 0.0, 2, id="B < 0, braking"),
        # 100 + 55 - 110 N: the same parabola
        pytest.param(DIPPING, 8990.0, 1.0, 30.0, -0.011213, 2, id="B < 0, accelerating"),
        # m·d·a = 98.9 N: -140 + 20v - 0.6v² is zero at 10 and 23.3 m/s
        pytest.param(HUMPED, 5000.0, 1.0, 30.0, -0.034545, 2, id="C < 0"),
        pytest.param({"aero_n_per_mps2": 0.0, "linear_n_per_mps": 9.0}, 2000.0, 30.0, 2.0, 0.0, 1, id="C = 0"),
        pytest.param({"aero_n_per_mps2": 0.0}, 2000.0, 30.0, 2.0, 0.0, 0, id="B = C = 0"),
        pytest.param({"aero_n_per_mps2": 0.0, "rolling_n": 0.0}, 50.0, 0.0, 12.0, 0.0, 0, id="A = B = C = 0"),
        pytest.param({"aero_n_per_mps2": 1e-300}, 2000.0, 30.0, 2.0, 0.0, 0, id="C next to nothing"),
    ],
)
def test_ramp_energy_equals_the_quadrature_of_battery_power(make_physics, changes, ds, v_a, v_b, grade, sign_changes):
    p = make_physics(**changes)
    signs = np.sign(wheel_force_n(p, np.linspace(v_a, v_b, 999), (v_b**2 - v_a**2) / (2.0 * ds), grade, 1.0))
    assert np.count_nonzero(np.diff(signs)) == sign_changes
    assert_ramp_is_the_integral(p, ds, v_a, v_b, grade)


@pytest.mark.nojit
def test_ramp_energy_of_the_kona_with_its_negative_linear_drag_equals_the_quadrature(kona):
    p = loaded(drive_of(kona))
    assert p.linear_n_per_mps < 0.0
    for ds, v_a, v_b, grade in ((100.0, 0.0, 14.0, 0.0), (3000.0, 36.0, 2.0, 0.0), (1500.0, 3.0, 30.0, -0.03)):
        assert_ramp_is_the_integral(p, ds, v_a, v_b, grade)


@settings(max_examples=300, deadline=None)
@given(
    rolling=st.floats(0.0, 800.0),
    linear=st.one_of(st.just(0.0), st.floats(-25.0, 25.0)),
    aero=st.one_of(st.just(0.0), st.floats(-0.2, 1.5)),
    grade=st.floats(-0.3, 0.3),
    v_a=st.floats(0.0, 55.0),
    dv=st.floats(0.5, 55.0),
    braking=st.booleans(),
    accel=st.floats(0.02, 5.0),
    recuperation=st.floats(0.0, 1.0),
)
def test_ramp_energy_of_any_ramp_equals_the_quadrature(
    make_physics, rolling, linear, aero, grade, v_a, dv, braking, accel, recuperation
):
    p = make_physics(rolling_n=rolling, linear_n_per_mps=linear, aero_n_per_mps2=aero, recuperation_factor=recuperation)
    low, high = v_a, v_a + dv
    ds = (high**2 - low**2) / (2.0 * accel)
    if braking:
        low, high = high, low
    assert_ramp_is_the_integral(p, ds, low, high, grade)


def plan_by_bisection(p, length, v_start, v_max, target):
    """Stretches (ds, from, to) of a link, with the peak found by bisection on the sum of the distances."""

    def mean(running_sum, low, high):
        return mean_over_intervals(p.speed_bound_mps, running_sum, low, high)

    def run_m(v, w, accel):
        return abs(v * v - w * w) / (2.0 * accel)

    def stretches(*candidates):
        return [s for s in candidates if s[0] > 0.0]

    top = max(v_start, v_max)
    if v_start > v_max:
        first = run_m(v_start, v_max, mean(p.decel_sum, v_max, v_start))
    else:
        first = run_m(v_start, v_max, mean(p.accel_sum, v_start, v_max)) if v_start < v_max else 0.0
    last = run_m(v_max, target, mean(p.decel_sum, target, v_max)) if target < v_max else 0.0
    if first + last <= length:
        return stretches((first, v_start, v_max), (length - first - last, v_max, v_max), (last, v_max, target))
    if v_start > v_max:
        return [(length, v_start, target)]
    accel = mean(p.accel_sum, v_start, v_max) if v_start < v_max else math.inf
    decel = mean(p.decel_sum, target, v_max) if target < v_max else math.inf
    if v_start > target and run_m(v_start, target, decel) >= length:
        return [(length, v_start, target)]
    if v_start < target and run_m(v_start, target, accel) > length:
        return [(length, v_start, math.sqrt(v_start**2 + 2.0 * accel * length))]
    low, high = max(v_start, target), top
    for _ in range(200):
        peak = 0.5 * (low + high)
        if run_m(v_start, peak, accel) + run_m(peak, target, decel) > length:
            high = peak
        else:
            low = peak
    first = run_m(v_start, low, accel)
    return stretches((first, v_start, low), (length - first, low, target))


def drive_by_twin(p, length, grade, v_start, v_max, target):
    flat = math.sqrt(1.0 - grade * grade)
    energy_j = time_s = scale_j = 0.0
    end = v_start
    for ds, v_a, v_b in plan_by_bisection(p, length, v_start, v_max, target):
        end = v_b
        if abs(v_a - v_b) < 1e-9:
            dt = ds / v_b
            work_j = wheel_force_n(p, v_b, 0.0, grade, flat) * ds
            piece_j = work_j * (p.drive_factor if work_j >= 0.0 else p.recuperation_factor) + p.aux_move_w * dt
            e, t, s = piece_j, dt, abs(piece_j)
        else:
            e, t, s = ramp_by_quadrature(p, ds, v_a, v_b, grade, flat)
        energy_j, time_s, scale_j = energy_j + e, time_s + t, scale_j + s
    return energy_j, time_s, end, scale_j


@settings(max_examples=300, deadline=None)
@given(
    length=st.one_of(st.floats(0.5, 60.0), st.floats(60.0, 3000.0)),
    grade=st.floats(-0.3, 0.3),
    v_start=st.one_of(st.just(0.0), st.floats(1.0, 55.0)),
    v_max=st.floats(1.0, 55.0),
    v_next=st.one_of(st.just(0.0), st.floats(1.0, 55.0)),
)
def test_link_energy_of_any_link_equals_the_slow_twin(make_physics, length, grade, v_start, v_max, v_next):
    p = make_physics(linear_n_per_mps=-4.0)
    target = min(v_max, v_next)
    energy_j, time_s, end = link_energy(p, length, grade, v_start, 0.0, v_max, v_next, 0.0, 0.0)
    twin_j, twin_s, twin_end, scale_j = drive_by_twin(p, length, grade, v_start, v_max, target)
    assert end == pytest.approx(twin_end, rel=1e-9)
    assert time_s == pytest.approx(twin_s, rel=1e-6)
    assert energy_j == pytest.approx(twin_j, abs=1e-6 * scale_j)


@pytest.mark.nojit
def test_link_energy_against_the_slow_twin_in_every_case(make_physics):
    p = make_physics(linear_n_per_mps=-4.0)
    cases = (
        (1000.0, 0.0, 20.0, 10.0),  # full phases
        (1000.0, 29.0, 20.0, 10.0),  # 1: entry above the limit
        (96.0, 0.0, 20.0, 0.0),  # 3: lower peak
        (45.0, 0.0, 20.0, 20.0),  # 4: target out of reach
        (20.0, 20.0, 20.0, 0.0),  # 5: harder braking
        (1000.0, 20.0, 20.0, 20.0),  # 6: one phase only
    )
    for length, v_start, v_max, target in cases:
        energy_j, time_s, end = link_energy(p, length, -0.01, v_start, 0.0, v_max, target, 0.0, 0.0)
        assert (energy_j, time_s, end) == pytest.approx(drive_by_twin(p, length, -0.01, v_start, v_max, target)[:3])


@settings(max_examples=300, deadline=None)
@given(
    v_start=st.floats(0.0, 50.0), v_max=st.floats(1.0, 50.0), target=st.floats(0.0, 50.0), length=st.floats(0.1, 2000.0)
)
def test_phase_accelerations_are_the_tables_means_up_to_the_limit(make_physics, v_start, v_max, target, length):
    p = make_physics()
    target = min(target, v_max)
    s1, _, s3, peak, end = plan_link(p, length, v_start, v_max, target)
    if s3 > 1e-6:
        braking = (peak**2 - end**2) / (2.0 * s3)
        wanted = mean_over_intervals(p.speed_bound_mps, p.decel_sum, target, v_max)
        assert braking == pytest.approx(wanted, rel=1e-5)
    if s1 > 1e-6 and v_start < peak:
        gaining = (peak**2 - v_start**2) / (2.0 * s1)
        wanted = mean_over_intervals(p.speed_bound_mps, p.accel_sum, v_start, v_max)
        assert gaining == pytest.approx(wanted, rel=1e-5, abs=1e-6 / s1)
