"""Values of trips in two groups, and steps in their order, against what was planted."""

from __future__ import annotations

import numpy as np
import pytest

from diagnosis.fit.mixture import drawn_gains, groups_of, step_of

DAYS = 0.05


def drawn(seed, count=24, spread=DAYS):
    """Values of days, their standard deviations, and how cold each day was."""
    rng = np.random.default_rng(seed)
    sd = rng.uniform(0.01, 0.06, count)
    cold = np.maximum(rng.uniform(-20.0, 25.0, count), 0.0)[:, None]
    return np.hypot(sd, spread) * rng.standard_normal(count), sd, cold


@pytest.mark.parametrize("seed", range(6))
def test_the_trips_that_carry_a_level_are_found_with_its_size(seed):
    values, sd, cold = drawn(seed)
    on = np.zeros(values.size, bool)
    on[np.random.default_rng(seed).choice(values.size, 5, replace=False)] = True
    groups = groups_of(values + 0.4 * on + 0.02 * cold[:, 0], sd, cold, DAYS)
    np.testing.assert_array_equal(groups.on, on)
    assert groups.shift == pytest.approx(0.4, abs=0.1)
    assert groups.gain > np.quantile(drawn_gains(sd, cold, DAYS, groups.null_spread, 100), 0.99)


def test_days_that_differ_gain_no_more_than_drawn_ones_do():
    passed = 0
    for seed in range(40):
        values, sd, cold = drawn(100 + seed)
        groups = groups_of(values, sd, cold, DAYS)
        if groups is not None:
            passed += groups.gain > np.quantile(drawn_gains(sd, cold, DAYS, groups.null_spread, 100), 0.95)
    assert passed <= 6  # 5 % of 40 are 2; more than 6 come by chance once in 100 times


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_step_in_time_is_found_at_its_place_whichever_side_has_more(sign):
    values, sd, cold = drawn(3)
    order = np.random.default_rng(5).permutation(values.size)
    later = np.zeros(values.size, bool)
    later[order[14:]] = True
    step = step_of(values + sign * 0.2 * later, sd, cold, DAYS, order)
    np.testing.assert_array_equal(step.on, later if sign > 0.0 else ~later)
    assert step.shift == pytest.approx(0.2, abs=0.06)
    assert step.gain > np.quantile(drawn_gains(sd, cold, DAYS, step.null_spread, 100, order), 0.99)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_drift_is_told_from_a_step(sign):
    values, sd, cold = drawn(4)
    order = np.random.default_rng(6).permutation(values.size)
    share = np.argsort(order) / (values.size - 1)
    drift = step_of(values + sign * 0.3 * share, sd, cold, DAYS, order)
    assert drift.drift
    np.testing.assert_allclose(drift.belongs, share if sign > 0.0 else 1.0 - share)
    assert drift.shift == pytest.approx(0.3, abs=0.09)
    assert drift.gain > np.quantile(drawn_gains(sd, cold, DAYS, drift.null_spread, 100, order), 0.99)


def test_a_trip_that_does_not_tell_its_value_belongs_to_no_group_for_sure():
    values, sd, cold = drawn(7)
    values[:4] += 0.5
    sd[10] = np.inf
    groups = groups_of(values, sd, cold, DAYS)
    assert set(np.flatnonzero(groups.on).tolist()) == {0, 1, 2, 3}
    assert groups.belongs[10] == pytest.approx(4 / 24, abs=0.1)


def test_what_grows_with_cold_is_no_level():
    values, sd, _ = drawn(11)
    cold = np.where(np.arange(values.size) % 2 == 0, 15.0, 0.0)[:, None]  # half of the days alike cold
    assert groups_of(values + 0.03 * cold[:, 0], sd, cold, DAYS) is None or (
        groups_of(values + 0.03 * cold[:, 0], sd, cold, DAYS).gain < 4.0
    )
