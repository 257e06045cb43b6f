"""How fast and how steep a way is: what some of it in sum has."""

from __future__ import annotations

import numpy as np
import pytest

from app.conversions.way_limits import held, way_limits


def test_held_is_the_highest_value_that_enough_in_sum_reaches() -> None:
    values, weights = np.array([30.0, 50.0, 130.0, 120.0]), np.array([500.0, 500.0, 150.0, 60.0])
    assert held(values, weights, 200.0) == 120.0  # 150 at 130 are too little, 210 reach 120
    assert held(values, weights, 150.0) == 130.0
    assert held(values, weights, 211.0) == 50.0


def test_short_steep_and_fast_links_do_not_count_until_200_m_of_them_are_there() -> None:
    length_m = np.array([1000.0, 100.0, 100.0])
    grade = np.array([0.01, 0.12, -0.09])
    speed_mps = np.array([50.0, 100.0, 100.0]) / 3.6
    limits = way_limits(length_m, grade, speed_mps)
    assert limits is not None
    assert limits.speed_kmh == pytest.approx(100.0)
    assert limits.grade == (0.01, 0.01)
    longer = way_limits(np.array([1000.0, 200.0, 200.0]), grade, speed_mps)
    assert longer is not None
    assert longer.grade == (-0.09, 0.12)


def test_a_way_shorter_than_that_counts_by_half_of_it() -> None:
    limits = way_limits(np.array([60.0, 40.0]), np.array([0.05, 0.02]), np.array([10.0, 20.0]))
    assert limits is not None
    assert limits.speed_kmh == pytest.approx(36.0)
    assert limits.grade == (0.05, 0.05)
    assert way_limits(np.zeros(0), np.zeros(0), np.zeros(0)) is None
