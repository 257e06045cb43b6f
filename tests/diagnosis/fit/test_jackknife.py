"""Everything solved at once is what solving trip by trip gives; inference takes the trip as the unit."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import stats

from diagnosis.fit.jackknife import (
    Equations,
    additions,
    as_z,
    effective_trips,
    first_least,
    jackknife_sd,
    no_prior,
    ranked,
    simulated_additions,
    solve,
)


def drawn(seed, trips=9, windows=30, columns=5, beta=(1.0, -2.0, 0.0, 0.5, 0.0)):
    """Design matrices and right sides of trips, and their normal equations."""
    rng = np.random.default_rng(seed)
    xs = [rng.normal(size=(windows, columns)) * rng.uniform(0.5, 2.0, columns) for _ in range(trips)]
    ys = [x @ np.array(beta) + rng.normal(size=windows) for x in xs]
    system = Equations(
        tuple("abcde"[:columns]),
        np.array([x.T @ x for x in xs]),
        np.array([x.T @ y for x, y in zip(xs, ys, strict=True)]),
        np.array([y @ y for y in ys]),
        np.full(trips, float(windows)),
        no_prior(columns),
    )
    return xs, ys, system


@given(st.integers(0, 10_000))
@settings(deadline=None, max_examples=25)
def test_all_trips_left_out_at_once_are_those_left_out_one_by_one(seed):
    xs, ys, system = drawn(seed)
    found = solve(system, ["a", "c", "d"])
    picked = [0, 2, 3]
    whole = np.linalg.lstsq(np.vstack(xs)[:, picked], np.concatenate(ys), rcond=None)[0]
    np.testing.assert_allclose(found.coefficients, whole, rtol=1e-7, atol=1e-9)
    for k, (x, y) in enumerate(zip(xs, ys, strict=True)):
        rest = np.vstack([columns for j, columns in enumerate(xs) if j != k])[:, picked]
        other_ys = np.concatenate([residual for j, residual in enumerate(ys) if j != k])
        beta = np.linalg.lstsq(rest, other_ys, rcond=None)[0]
        np.testing.assert_allclose(found.without[k], beta, rtol=1e-7, atol=1e-9)
        left_residual = y - x[:, picked] @ beta
        assert found.losses[k] == pytest.approx(left_residual @ left_residual - y @ y, rel=1e-7, abs=1e-7)


@given(st.integers(0, 10_000))
@settings(deadline=None, max_examples=25)
def test_a_column_tried_beside_a_base_is_the_column_solved_with_it(seed):
    _, _, system = drawn(seed)
    tried = additions(system, ["a", "b"], ["c", "d", "e"])
    for k, name in enumerate("cde"):
        both = solve(system, ["a", "b", name])
        assert tried.coefficients[k] == pytest.approx(both.value(name), rel=1e-7, abs=1e-9)
        assert tried.sd[k] == pytest.approx(float(both.sd()[2]), rel=1e-6)
        assert tried.effective[k] == pytest.approx(float(both.effective[2]), rel=1e-6)
        np.testing.assert_allclose(tried.losses[:, k], both.losses, rtol=1e-6, atol=1e-6)


def test_a_prior_holds_a_coefficient_that_the_data_do_not_carry():
    _, _, system = drawn(3)
    system.prior.precision[0], system.prior.mean[0] = 1e12, 7.0
    held = system
    _, _, system = drawn(3)
    assert solve(held, list("abcde")).value("a") == pytest.approx(7.0, rel=1e-6)
    assert solve(held, list("abcde")).value("d") == pytest.approx(solve(system, list("abcde")).value("d"), abs=0.6)


def test_the_jackknife_of_a_mean_is_its_standard_error():
    values = np.random.default_rng(1).normal(size=12)
    without = (values.sum() - values) / 11
    assert jackknife_sd(without[:, None])[0] == pytest.approx(values.std(ddof=1) / np.sqrt(12))


def test_a_trip_that_outweighs_the_others_leaves_few_effective_trips():
    even, outweighed = np.ones(10), np.array([1000.0] + [1.0] * 9)
    information = np.column_stack([np.concatenate(([info.sum()], info.sum() - info)) for info in (even, outweighed)])
    effective = effective_trips(information)
    assert effective[0] == pytest.approx(10.0)
    assert effective[1] == pytest.approx(1.018, abs=0.01)
    assert as_z(np.array([9.0, 9.0]), effective)[1] == 0.0


def test_z_is_as_rare_as_t():
    z = as_z(np.array([-4.0]), np.array([11.0]))
    assert stats.norm.cdf(z[0]) == pytest.approx(stats.t.cdf(-4.0, 10.0), rel=1e-6)


def test_drives_with_nothing_left_out_are_rarely_significant():
    _, _, system = drawn(5, trips=30)
    z = simulated_additions(system, ["a", "b"], ["c", "d", "e"], 2000, np.random.default_rng(1), np.ones(30))
    assert z.shape == (2000, 3)
    assert (np.abs(z) > 1.96).mean() == pytest.approx(0.05, abs=0.02)
    assert (np.abs(z) > 3.3).mean() < 0.005


def test_intervals_of_a_sum_cover_the_truth():
    covered = 0
    for seed in range(200):
        _, _, system = drawn(seed, trips=12)
        found = solve(system, list("abcde"))
        weights = np.array([1.0, 1.0, 0.0, 0.0, 0.0])
        covered += abs(float(weights @ found.coefficients) - (1.0 - 2.0)) <= found.half_width_by_trips(weights)
        assert found.half_width(weights) > max(
            found.half_width_by_trips(weights), 0.19 * abs(weights @ found.coefficients)
        )
    assert 0.90 <= covered / 200 <= 0.99


@pytest.mark.parametrize("apart", [-1e-12, 0.0, 1e-12])
def test_of_values_that_differ_in_their_last_bits_the_first_is_the_least(apart):
    values = np.array([3.0, -7.0, 2.0, -7.0 * (1.0 + apart), 3.0 * (1.0 + apart), 2.0 * (1.0 + apart)])
    assert first_least(values) == 1
    assert first_least(np.vstack((values, np.abs(values)))).tolist() == [1, 2]
    assert ranked(values) == [1, 3, 2, 5, 0, 4]
    assert first_least(np.array([1.0, np.inf, 1.0 - 1e-6])) == 2  # no more alike than that
