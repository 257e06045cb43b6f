"""Time from a charge to another: by hand, its laws, its slow twin, and the charges where two curves agree."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import assume, example, given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.integrate import quad

from energy.charging import charge_time, kernels_charging
from energy.charging.charge_time import charge_times, mean_power_w, power_bands, stationary_charges
from energy.charging.charging import PowerCurve
from energy.errors import ChargeError

pytestmark = pytest.mark.nojit

CAPACITY_J = 64 * 3.6e6


def curve(soc: list[float], power_kw: list[float]) -> PowerCurve:
    return PowerCurve(np.array(soc, np.float64), 1000.0 * np.array(power_kw, np.float64))


KONA = curve([0, 0.40, 0.42, 0.53, 0.55, 0.71, 0.72, 0.76, 0.78, 0.88, 1], [70, 77, 70, 71, 57, 58, 38, 38, 25, 25, 8])
FALLING = curve([0, 0.5, 0.8, 1], [100, 100, 50, 20])
FLAT = curve([0, 1], [50, 50])
fractions = st.floats(0.0, 1.0, allow_subnormal=False)
powers = st.one_of(st.floats(1.0, 4000.0), st.sampled_from([3.7, 11.0, 50.0, 100.0, 350.0]))


@st.composite
def curves(draw: st.DrawFn) -> PowerCurve:
    inner = draw(st.lists(st.integers(1, 999), max_size=6, unique=True))
    soc = [0.0, *(k / 1000 for k in sorted(inner)), 1.0]
    return curve(soc, draw(st.lists(powers, min_size=len(soc), max_size=len(soc))))


def quadrature_s(given: PowerCurve, start: float, end: float) -> float:
    """The slow twin: the integral of C/P by pieces."""
    points = [start, *(s for s in given.soc_frac.tolist() if start < s < end), end]
    return sum(
        quad(lambda s: CAPACITY_J / np.interp(s, given.soc_frac, given.power_w), a, b, epsrel=1e-12)[0]
        for a, b in pairwise(points)
    )


def test_constant_power_takes_energy_over_power() -> None:
    # 64 kWh · 0.6 at 50 kW: 2764.8 s
    assert float(charge_time.seconds(FLAT, CAPACITY_J, 0.2, 0.8)) == pytest.approx(2764.8, rel=1e-14)


def test_linear_power_takes_the_logarithm_of_its_ratio() -> None:
    # from 100 kW at 50 % to 50 kW at 80 %: C · 0.3 / (50 kW − 100 kW) · ln(50 / 100)
    by_hand = CAPACITY_J * 0.3 / -50_000.0 * math.log(0.5)
    assert float(charge_time.seconds(FALLING, CAPACITY_J, 0.5, 0.8)) == pytest.approx(by_hand, rel=1e-14)


def test_kona_takes_the_time_of_its_pieces_added_up() -> None:
    taken = charge_time.seconds(KONA, CAPACITY_J, KONA.soc_frac[:-1], KONA.soc_frac[1:])
    for k, (p, q) in enumerate(pairwise(KONA.power_w)):
        gained = CAPACITY_J * (KONA.soc_frac[k + 1] - KONA.soc_frac[k])
        by_hand = gained / p if p == q else gained / (q - p) * math.log(q / p)
        assert taken[k] == pytest.approx(by_hand, rel=1e-13)
    assert float(charge_time.seconds(KONA, CAPACITY_J, 0.0, 1.0)) == pytest.approx(taken.sum(), rel=1e-14)


@given(curves(), fractions, fractions)
@settings(max_examples=150)
def test_time_is_the_integral_of_capacity_over_power(given_curve: PowerCurve, one: float, other: float) -> None:
    start, end = min(one, other), max(one, other)
    expected = quadrature_s(given_curve, start, end)
    assert float(charge_time.seconds(given_curve, CAPACITY_J, start, end)) == pytest.approx(
        expected, rel=1e-8, abs=1e-9
    )


@given(curves(), st.lists(fractions, min_size=3, max_size=3))
def test_time_over_a_charge_between_adds_up(given_curve: PowerCurve, charges: list[float]) -> None:
    low, middle, high = sorted(charges)
    times = charge_times([given_curve], CAPACITY_J)
    whole = float(times.seconds(0, low, high))
    parts = float(times.seconds(0, low, middle)) + float(times.seconds(0, middle, high))
    assert parts == pytest.approx(whole, rel=1e-11, abs=1e-9)
    from_empty = [kernels_charging.seconds_to(times.curves, 0, charge) for charge in (low, high)]
    assert from_empty[1] - from_empty[0] == pytest.approx(whole, rel=1e-9, abs=1e-9 * from_empty[1])


@given(curves(), fractions, fractions)
@example(FLAT, 0.0, 1.0)
@example(FALLING, 0.5, 0.8)
def test_charge_after_the_time_to_a_charge_is_that_charge(given_curve: PowerCurve, one: float, other: float) -> None:
    start, end = min(one, other), max(one, other)
    taken = charge_time.seconds(given_curve, CAPACITY_J, start, end)
    back = float(charge_time.soc_after(given_curve, CAPACITY_J, start, taken))
    # one rounding of the time is worth its power over the capacity
    slack = 1e-13 + 1e-13 * float(taken) * float(given_curve.power_w.max()) / CAPACITY_J
    assert back == pytest.approx(end, abs=slack)


@given(curves(), fractions, st.floats(0.0, 1e6))
def test_energy_taken_is_power_over_the_time(given_curve: PowerCurve, start: float, time_s: float) -> None:
    times = charge_times([given_curve], CAPACITY_J)
    end = float(times.soc_after(0, start, time_s))
    assert start <= end <= 1.0
    taken = float(times.seconds(0, start, end))
    assert taken <= time_s * (1.0 + 1e-9) + 1e-6
    assert end == 1.0 or taken == pytest.approx(time_s, rel=1e-6, abs=1e-6)
    if end > start:
        mean_w = mean_power_w(given_curve, CAPACITY_J, start, end)
        assert mean_w * taken == pytest.approx(CAPACITY_J * (end - start), rel=1e-9)
        assert given_curve.power_w.min() * (1 - 1e-6) <= mean_w <= given_curve.power_w.max() * (1 + 1e-6)


@given(curves(), st.floats(1.0, 3.0), fractions, fractions)
def test_more_power_never_takes_longer(given_curve: PowerCurve, factor: float, one: float, other: float) -> None:
    start, end = min(one, other), max(one, other)
    more = PowerCurve(given_curve.soc_frac, np.minimum(given_curve.power_w * factor, 4e6))
    slow = float(charge_time.seconds(given_curve, CAPACITY_J, start, end))
    assert float(charge_time.seconds(more, CAPACITY_J, start, end)) <= slow * (1 + 1e-12)
    assert float(charge_time.soc_after(more, CAPACITY_J, start, slow)) >= end - 1e-9


@given(curves(), st.lists(fractions, min_size=2, max_size=30))
def test_time_rises_with_the_charge(given_curve: PowerCurve, charges: list[float]) -> None:
    reached = charge_time.seconds(given_curve, CAPACITY_J, 0.0, np.sort(charges))
    assert bool(np.all(np.diff(reached) >= -1e-9))


@given(curves(), fractions, fractions, st.lists(st.floats(1.0, 3e6), max_size=4, unique=True))
def test_power_bands_add_up_and_are_those_of_small_steps(
    given_curve: PowerCurve, one: float, other: float, edges: list[float]
) -> None:
    start, end = min(one, other), max(one, other)
    lower = np.array([0.0, *sorted(edges)])
    bands = power_bands(given_curve, CAPACITY_J, start, end, lower.tolist())
    whole = float(charge_time.seconds(given_curve, CAPACITY_J, start, end))
    assert sum(time for _, _, time in bands) == pytest.approx(whole, rel=1e-9, abs=1e-9)
    assert [low for low, _, _ in bands] == sorted({low for low, _, _ in bands})
    # the slow twin: steps of charge, each in the band of its middle
    points = np.linspace(start, end, 2001)
    middle_w = np.interp(0.5 * (points[:-1] + points[1:]), given_curve.soc_frac, given_curve.power_w)
    steps_s = charge_time.seconds(given_curve, CAPACITY_J, points[:-1], points[1:])
    stepped = np.bincount(np.searchsorted(lower, middle_w, side="right") - 1, steps_s, minlength=lower.size)
    found = dict.fromkeys(lower.tolist(), 0.0) | {low: time for low, _, time in bands}
    # each edge is crossed once a piece at most, and a step with a crossing may be booked in the wrong band
    slack = 2.0 * len(edges) * given_curve.soc_frac.size * float(steps_s.max()) + 1e-9 * (1.0 + whole)
    assert list(found.values()) == pytest.approx(stepped.tolist(), abs=slack)


def test_power_bands_of_a_falling_curve_by_hand() -> None:
    # 100 kW to 50 %, then to 50 kW at 80 %: 75 kW at 65 %
    bands = power_bands(FALLING, CAPACITY_J, 0.4, 0.8, [0.0, 75e3])
    slope_w = -50_000.0 / 0.3
    below = CAPACITY_J / slope_w * math.log(50 / 75)
    above = CAPACITY_J * 0.1 / 100e3 + CAPACITY_J / slope_w * math.log(75 / 100)
    assert [band[:2] for band in bands] == [(0.0, 75e3), (75e3, math.inf)]
    assert [band[2] for band in bands] == pytest.approx([below, above], rel=1e-12)


def test_shapes_are_those_that_both_make_together() -> None:
    times = charge_times([KONA, FLAT], CAPACITY_J)
    found = times.seconds(1, np.array([[0.1], [0.2]]), np.array([0.5, 0.6, 0.7]))
    assert found.shape == (2, 3)
    assert found[1, 2] == pytest.approx(CAPACITY_J * 0.5 / 50e3)
    assert times.soc_after(0, 0.3, np.zeros((0,))).shape == (0,)
    assert float(times.soc_after(0, 1.0, 100.0)) == 1.0


@pytest.mark.parametrize(
    ("call", "field"),
    [
        (lambda: charge_time.seconds(FLAT, CAPACITY_J, -0.1, 0.5), "start_frac"),
        (lambda: charge_time.seconds(FLAT, CAPACITY_J, 0.1, 1.5), "end_frac"),
        (lambda: charge_time.seconds(FLAT, CAPACITY_J, 0.5, [0.6, 0.4]), "end_frac"),
        (lambda: charge_time.seconds(FLAT, CAPACITY_J, math.nan, 0.5), "start_frac"),
        (lambda: charge_time.soc_after(FLAT, CAPACITY_J, 0.5, -1.0), "seconds"),
        (lambda: charge_time.soc_after(FLAT, CAPACITY_J, 0.5, math.nan), "seconds"),
        (lambda: charge_times([FLAT], 0.0), "capacity_j"),
        (lambda: power_bands(FLAT, CAPACITY_J, 0.1, 0.2, [1.0, 2.0]), "edges_w"),
    ],
)
def test_what_no_charging_has_is_refused(call, field: str) -> None:  # type: ignore[no-untyped-def]
    with pytest.raises(ChargeError) as caught:
        call()
    assert caught.value.field == field


def _slope(
    a: PowerCurve, b: PowerCurve, shift: float, price: float, d: NDArray[np.float64], weight: float = 1.0
) -> NDArray[np.float64]:
    at_a = np.interp(d, a.soc_frac, a.power_w)
    at_b = np.interp(d - shift, b.soc_frac, b.power_w)
    return np.asarray(weight / at_a - 1.0 / at_b + price)


@given(
    curves(),
    curves(),
    st.floats(-0.9, 0.9),
    st.one_of(st.just(0.0), st.floats(-3e-5, 3e-5)),
    st.one_of(st.just(1.0), st.floats(0.3, 3.0)),
)
@example(FALLING, FALLING, 0.2, 0.0, 1.0)
@example(KONA, KONA, 0.3, 1e-6, 1.0)
@example(KONA, KONA, 0.3, -1e-6, 1.2)
@example(KONA, FLAT, -0.2, 0.0, 1.0)
@settings(max_examples=200)
def test_each_change_of_sign_of_a_dense_scan_has_a_stationary_charge(
    a: PowerCurve, b: PowerCurve, shift: float, price: float, weight: float
) -> None:
    found = stationary_charges(a, b, shift, price, weight)
    low, high = max(0.0, shift), min(1.0, 1.0 + shift)
    assert bool(np.all(np.diff(found) > 0.0))
    assert bool(np.all((found >= low) & (found <= high)))
    # each is a zero, to within roundings of the charge on the steepest piece
    least_w = min(float(a.power_w.min()), float(b.power_w.min()))
    steepest = max(float(np.max(np.abs(np.diff(c.power_w) / np.diff(c.soc_frac)))) for c in (a, b)) + 1.0
    slack = 1e-9 / least_w + 1e-12 * steepest / least_w**2
    assert bool(np.all(np.abs(_slope(a, b, shift, price, found, weight)) <= slack))
    scan = np.unique(np.concatenate((np.linspace(low, high, 2001), a.soc_frac, b.soc_frac + shift)))
    scan = scan[(scan >= low) & (scan <= high)]
    slope = _slope(a, b, shift, price, scan, weight)
    known = np.concatenate((found, a.soc_frac, b.soc_frac + shift))
    for k in np.flatnonzero(slope[:-1] * slope[1:] < 0.0):
        if abs(slope[k]) > slack and abs(slope[k + 1]) > slack:
            assert bool(np.any((known >= scan[k] - 1e-9) & (known <= scan[k + 1] + 1e-9)))


def test_stationary_charge_of_equal_falling_curves_by_hand() -> None:
    # P(d) = P(d − 0.2): both are at 100 kW up to d = 0.5, of which only the end is found; after it P(d) is the lower
    assert stationary_charges(FALLING, FALLING, 0.2).tolist() == [0.5]
    # 100 − 80·d against a constant 60 kW: d = 0.5
    assert stationary_charges(curve([0, 1], [100, 20]), curve([0, 1], [60, 60]), 0.1).tolist() == pytest.approx([0.5])
    # with a price of 1/60 kW − 1/80 kW an hour of the next stop is worth as much at 80 kW: d = 0.25
    price = 1 / 60e3 - 1 / 80e3
    assert stationary_charges(curve([0, 1], [100, 20]), curve([0, 1], [60, 60]), 0.1, price).tolist() == (
        pytest.approx([0.25])
    )


def test_stationary_charges_of_two_slopes_with_a_price_are_both_roots() -> None:
    a, b = curve([0, 1], [100, 20]), curve([0, 1], [20, 100])
    price = -1e-5
    found = stationary_charges(a, b, 0.0, price)
    dense = np.linspace(0.0, 1.0, 200_001)
    slope = _slope(a, b, 0.0, price, dense)
    expected = dense[np.flatnonzero(slope[:-1] * slope[1:] < 0.0)]
    assert found.tolist() == pytest.approx(expected.tolist(), abs=1e-5)
    assert found.size >= 1


def test_a_second_that_counts_half_is_worth_twice_the_power() -> None:
    # ½/P_a = 1/P_b: 100 − 80·d at the first against 160 kW at the next is d = 0.25
    a, b = curve([0, 1], [100, 20]), curve([0, 1], [160, 160])
    assert stationary_charges(a, b, 0.1, weight_a=0.5).tolist() == pytest.approx([0.25])
    assert stationary_charges(a, b, 0.1, weight_a=1.0, weight_b=2.0).tolist() == pytest.approx([0.25])
    assert stationary_charges(a, b, 0.1, weight_a=0.0, weight_b=0.0).size == 0


def test_shift_that_leaves_nothing_in_common_has_none() -> None:
    assert stationary_charges(KONA, FLAT, 1.0).size == 0
    assert stationary_charges(KONA, FLAT, -1.5).size == 0


@given(st.lists(curves(), min_size=2, max_size=4), fractions, fractions)
def test_curves_one_behind_the_other_are_each_their_own(several: list[PowerCurve], one: float, other: float) -> None:
    start, end = min(one, other), max(one, other)
    assume(end > start)
    times = charge_times(several, CAPACITY_J)
    for k, each in enumerate(several):
        assert float(times.seconds(k, start, end)) == float(charge_time.seconds(each, CAPACITY_J, start, end))
        taken = times.seconds(k, start, end)
        assert float(times.soc_after(k, start, taken)) == float(charge_time.soc_after(each, CAPACITY_J, start, taken))
        assert kernels_charging.power_at(times.curves, k, start) == pytest.approx(
            np.interp(start, each.soc_frac, each.power_w), rel=1e-12
        )
