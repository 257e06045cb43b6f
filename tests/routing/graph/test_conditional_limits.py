"""Limits under a condition over the plain ones of a graph."""

from __future__ import annotations

import numpy as np
import pytest

from routing.graph.conditional_limits import EVERY_DAY, ConditionalLimits, conditional_limits_from

PLAIN_MPS = np.array([30.0, 30.0, 30.0])


def rows(*row: tuple[int, float, bool, int, int, int]) -> ConditionalLimits:
    link, limit_mps, wet, days, begin_min, end_min = (np.array(column) for column in zip(*row, strict=True))
    return ConditionalLimits(link, limit_mps, wet, days, begin_min, end_min)


def test_wet_limit_holds_on_its_link_on_a_wet_road_alone() -> None:
    limits = rows((1, 20.0, True, EVERY_DAY, 0, 1440))
    assert limits.over(PLAIN_MPS, wet=True).tolist() == [30.0, 20.0, 30.0]
    assert limits.over(PLAIN_MPS, wet=False) is PLAIN_MPS


def test_limit_at_hours_does_not_hold_at_an_unknown_time() -> None:
    limits = rows(
        (0, 20.0, False, EVERY_DAY, 420, 1020), (1, 20.0, False, 0b11111, 0, 1440), (2, 9.0, True, 1, 0, 1440)
    )
    assert limits.over(PLAIN_MPS, wet=True) is PLAIN_MPS
    assert limits.over(PLAIN_MPS, wet=False, minute=8 * 60).tolist() == [20.0, 20.0, 30.0]  # Monday
    assert limits.over(PLAIN_MPS, wet=True, minute=7 * 60).tolist() == [20.0, 20.0, 9.0]
    assert limits.over(PLAIN_MPS, wet=False, minute=6 * 1440 + 17 * 60) is PLAIN_MPS  # Sunday 17:00, the end


def test_limit_past_midnight_reaches_into_the_next_day_and_from_sunday_into_monday() -> None:
    limits = rows((0, 20.0, False, 0b1000000, 22 * 60, 30 * 60))
    for minute, held in ((6 * 1440 + 23 * 60, True), (5 * 60, True), (6 * 60, False), (6 * 1440 + 5 * 60, False)):
        assert limits.over(PLAIN_MPS, wet=False, minute=minute)[0] == (20.0 if held else 30.0)


def test_last_of_several_limits_that_hold_counts() -> None:
    limits = rows((0, 20.0, True, EVERY_DAY, 0, 1440), (0, 25.0, True, EVERY_DAY, 0, 1440))
    assert limits.over(PLAIN_MPS, wet=True).tolist() == [25.0, 30.0, 30.0]


def test_rows_follow_their_links_to_new_numbers_and_leave_with_them() -> None:
    limits = rows((0, 20.0, True, EVERY_DAY, 0, 1440), (2, 25.0, True, EVERY_DAY, 0, 1440))
    kept = limits.of_links(np.array([1, 2]), np.array([1, 0]))
    assert (kept.link.tolist(), kept.limit_mps.tolist()) == ([0], [25.0])


@pytest.mark.parametrize(
    ("column", "value"),
    [
        ("link", [3]),
        ("link", [-1]),
        ("link", [0, 1]),
        ("limit_mps", [0.0]),
        ("limit_mps", [float("nan")]),
        ("wet", None),
        ("days", ["Monday"]),
    ],
)
def test_damaged_columns_are_refused(column: str, value: object) -> None:
    columns = rows((0, 20.0, True, EVERY_DAY, 0, 1440)).columns()
    assert conditional_limits_from(columns, 3).columns() == columns
    with pytest.raises((KeyError, TypeError, ValueError, OverflowError)):
        conditional_limits_from({**columns, column: value}, 3)  # type: ignore[dict-item]
