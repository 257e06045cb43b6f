"""Heights that a road can follow: the largest set of them, held against all sets."""

from __future__ import annotations

from itertools import combinations

import numpy as np
import pytest

from diagnosis.heights.drivable import drivable, steepest_grade

STEP_M = 30.0


def climbs(count: int, grade: float) -> np.ndarray:
    return grade * STEP_M * np.arange(count)


def fits(height_m: np.ndarray, climb_m: np.ndarray, chosen: tuple[int, ...]) -> bool:
    return all(abs(height_m[b] - height_m[a]) <= climb_m[b] - climb_m[a] for a, b in combinations(chosen, 2))


@pytest.mark.parametrize("seed", range(20))
def test_kept_heights_fit_together_and_no_larger_set_does(seed: int) -> None:
    rng = np.random.default_rng(seed)
    climb_m = np.cumsum(rng.uniform(0.5, 4.0, 9))
    height_m = rng.normal(0.0, 4.0, 9)
    kept = tuple(np.flatnonzero(drivable(height_m, climb_m)).tolist())
    assert fits(height_m, climb_m, kept)
    ends = {0, 8} if fits(height_m, climb_m, (0, 8)) else set()
    assert ends <= set(kept)
    larger = (chosen for chosen in combinations(range(9), len(kept) + 1) if ends <= set(chosen))
    assert not any(fits(height_m, climb_m, chosen) for chosen in larger)


def test_ground_that_is_nowhere_too_steep_is_kept() -> None:
    height_m = 100.0 * np.sin(np.arange(200) * STEP_M / 1000.0)  # at most 10 %
    assert drivable(height_m, climbs(200, 0.11)).all()


def test_mountain_above_a_tunnel_and_valley_below_a_bridge_are_not_kept() -> None:
    height_m = np.full(200, 500.0)
    height_m[50:80] = 800.0
    height_m[120:130] = 440.0
    kept = drivable(height_m, climbs(200, 0.1))
    assert np.flatnonzero(~kept).tolist() == [*range(50, 80), *range(120, 130)]


def test_drive_that_ends_behind_a_step_ends_there() -> None:
    height_m = np.full(100, 500.0)
    height_m[90:] = 470.0  # 30 m at 10 % are 10 steps
    kept = drivable(height_m, climbs(100, 0.1))
    assert np.flatnonzero(~kept).tolist() == list(range(90, 99))


def test_nothing_and_one_height_are_kept() -> None:
    assert drivable(np.empty(0), np.empty(0)).tolist() == []
    assert drivable(np.array([5.0]), np.zeros(1)).tolist() == [True]


def test_faster_roads_are_less_steep() -> None:
    assert steepest_grade(np.array([5.0, 80.0 / 3.6, 40.0])).tolist() == [0.20, 0.12, 0.07]
