"""What of a selection lasts: shares of draws, what stands in for what, and a file that is shaken."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from diagnosis.causes.families import Family
from diagnosis.causes.nuisance import PARAMETERS
from diagnosis.fit.jackknife import Equations, no_prior, solve
from diagnosis.fit.model import priors
from diagnosis.fit.stability import FILE_SD_FRAC, Stability, drives_of, shaken
from diagnosis.fit.windows import FREE
from energy.vehicle.files import load_vehicle

ROOT = Path(__file__).resolve().parents[3]
HEAT, TYRES, LOSS = ({Family.THERMAL: {"heat"}}, {Family.ROLLING: {"tyres"}}, {Family.DRIVETRAIN: {"loss"}})


def of(*draws):
    return Stability(tuple({family: frozenset(effects) for family, effects in draw.items()} for draw in draws))


def test_a_cause_of_most_draws_is_clear():
    found = of(*([HEAT] * 8), TYRES, TYRES)
    assert found.held_frac(Family.THERMAL) == pytest.approx(0.8)
    assert found.instead(Family.THERMAL) == {}
    assert found.stands(Family.THERMAL)


def test_what_is_named_in_its_place_is_its_rival():
    found = of(*([HEAT] * 6), *([TYRES] * 4))
    assert found.instead(Family.THERMAL) == {"tyres": Family.ROLLING}
    assert found.instead(Family.ROLLING) == {"heat": Family.THERMAL}
    assert found.stands(Family.THERMAL)


def test_what_is_there_beside_it_as_well_is_not_in_its_place():
    found = of(*([HEAT | LOSS] * 6), *([LOSS] * 4))
    assert found.instead(Family.THERMAL) == {}
    assert not found.stands(Family.THERMAL)
    assert found.stands(Family.DRIVETRAIN)


def test_a_cause_of_few_draws_with_nothing_in_its_place_does_not_stand():
    assert not of(HEAT, HEAT, {}, {}, {}).stands(Family.THERMAL)


@pytest.fixture
def system():
    car = load_vehicle(ROOT / "data/vehicles/bmw-i3-60ah.toml")
    rng = np.random.default_rng(2)
    xs = [rng.normal(size=(40, len(FREE))) for _ in range(9)]
    ys = [rng.normal(size=40) for _ in xs]
    return car, Equations(
        FREE,
        np.array([x.T @ x for x in xs]),
        np.array([x.T @ y for x, y in zip(xs, ys, strict=True)]),
        np.array([y @ y for y in ys]),
        np.full(9, 40.0),
        priors(FREE, car, car),
    )


def test_part_of_the_drives_is_what_was_measured_on_them(system):
    _, whole = system
    part = drives_of(whole, np.array([0, 3, 8]))
    assert part.trips == 3
    np.testing.assert_array_equal(part.gram[1], whole.gram[3])


def test_a_shaken_file_moves_as_far_as_it_is_said_to(system):
    car, whole = system
    k = whole.names.index("mass_kg")
    means = [shaken(whole, car, np.random.default_rng(seed)).prior.mean[k] for seed in range(400)]
    assert np.std(means) == pytest.approx(FILE_SD_FRAC * car.mass_kg, rel=0.15)
    np.testing.assert_array_equal(whole.prior.mean[: len(PARAMETERS)], 0.0)


def test_a_coefficient_beyond_its_bound_is_held_there_and_the_others_make_up_for_it():
    rng = np.random.default_rng(4)
    xs = [rng.normal(size=(50, 2)) for _ in range(8)]
    for x in xs:
        x[:, 1] += 0.8 * x[:, 0]
    ys = [x @ np.array([3.0, 1.0]) + 0.1 * rng.normal(size=50) for x in xs]
    prior = no_prior(2)
    prior.high[0] = 2.0
    held = Equations(
        ("a", "b"),
        np.array([x.T @ x for x in xs]),
        np.array([x.T @ y for x, y in zip(xs, ys, strict=True)]),
        np.array([y @ y for y in ys]),
        np.full(8, 50.0),
        prior,
    )
    solution = solve(held, ["a", "b"])
    assert solution.value("a") == pytest.approx(2.0, abs=1e-6)
    rest = np.concatenate(ys) - 2.0 * np.vstack(xs)[:, 0]
    column = np.vstack(xs)[:, 1]
    assert solution.value("b") == pytest.approx(float(column @ rest / (column @ column)), abs=1e-6)
    np.testing.assert_allclose(solution.without[:, 0], 2.0, atol=1e-6)
