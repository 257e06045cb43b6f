"""Limits under a condition."""

from __future__ import annotations

import pytest

from routing.importers.conditional import ConditionalLimit, Hours, concerns_cars, conditional_limits
from routing.importers.speeds import limit_mps_from_value

WORKDAYS = frozenset(range(5))
EVERY_DAY = frozenset(range(7))


def read(value: str) -> tuple[list[ConditionalLimit], int]:
    return conditional_limits(value, limit_mps_from_value)


@pytest.mark.parametrize(
    ("value", "limit"),
    [
        ("80 @ wet", ConditionalLimit(80 / 3.6, wet=True)),
        ("80 @ (Wet)", ConditionalLimit(80 / 3.6, wet=True)),
        ("30 @ (07:00-17:00)", ConditionalLimit(30 / 3.6, hours=(Hours(EVERY_DAY, 420, 1020),))),
        ("30 @ (Mo-Fr 7:00-17:30)", ConditionalLimit(30 / 3.6, hours=(Hours(WORKDAYS, 420, 1050),))),
        ("30 @ (Sa,Su)", ConditionalLimit(30 / 3.6, hours=(Hours(frozenset((5, 6)), 0, 1440),))),
        ("30 @ (Sa-Mo)", ConditionalLimit(30 / 3.6, hours=(Hours(frozenset((5, 6, 0)), 0, 1440),))),
        ("80 @ 22:00-06:00", ConditionalLimit(80 / 3.6, hours=(Hours(EVERY_DAY, 1320, 1800),))),
        (
            "40 @ (Mo-Fr 08:00-09:30, 14:30-16:00)",
            ConditionalLimit(40 / 3.6, hours=(Hours(WORKDAYS, 480, 570), Hours(WORKDAYS, 870, 960))),
        ),
        ("30 @ (Mo-Fr 07:00–17:00)", ConditionalLimit(30 / 3.6, hours=(Hours(WORKDAYS, 420, 1020),))),
        ("30@(Monday-Friday 07:00-17:00 open)", ConditionalLimit(30 / 3.6, hours=(Hours(WORKDAYS, 420, 1020),))),
        ("30 @ (Mo-Fr,PH,SH 07:00-17:00)", ConditionalLimit(30 / 3.6, hours=(Hours(WORKDAYS, 420, 1020),))),
        ("30 @ (Mo-Fr 07:00-17:00; PH 00:00-24:00)", ConditionalLimit(30 / 3.6, hours=(Hours(WORKDAYS, 420, 1020),))),
        ("30 @ (Mo-Su 07:00-17:00; Sa-Su off)", ConditionalLimit(30 / 3.6, hours=(Hours(WORKDAYS, 420, 1020),))),
        ("80 @ 24/7", ConditionalLimit(80 / 3.6, hours=(Hours(EVERY_DAY, 0, 1440),))),
        (
            "30 @ (Mo-Su 07:00-17:00; Sa,Su 10:00-12:00)",  # the later rule replaces the earlier one on its days
            ConditionalLimit(30 / 3.6, hours=(Hours(WORKDAYS, 420, 1020), Hours(frozenset((5, 6)), 600, 720))),
        ),
        (
            "30 @ (Mo-Fr 07:00-17:00, Sa 08:00-12:00)",
            ConditionalLimit(30 / 3.6, hours=(Hours(WORKDAYS, 420, 1020), Hours(frozenset((5,)), 480, 720))),
        ),
        ("30 @ (Mo-Fr 07:00-17:00; PH off; SH off)", ConditionalLimit(30 / 3.6, hours=(Hours(WORKDAYS, 420, 1020),))),
        (
            "60 @ (wet AND 22:00-06:00)",
            ConditionalLimit(60 / 3.6, wet=True, hours=(Hours(EVERY_DAY, 1320, 1800),)),
        ),
    ],
)
def test_condition_of_wet_and_hours_is_read(value: str, limit: ConditionalLimit) -> None:
    assert read(value) == ([limit], 0)


@pytest.mark.parametrize(
    "value",
    [
        *("60 @ (weight>2.5)", "30 @ (07:00-17:00 Mo-Fr)", "30 @ (Mo-Fr 07:00-17:00; Dec 25 off)", "30 @ (off)"),
        *("30 @ (PH)", "30 @ (SH Mo-Fr 07:00-17:00)", "80 @ winter", "50 @ (Nov-Apr)", "30 @ ()"),
        *(
            "30",
            "fast @ wet",
            "30 @ (25:00-26:00)",
            "30 @ (07:00+)",
            "30 @ (sunrise-sunset)",
            "30 @ (PH off)",
        ),
    ],
)
def test_condition_that_is_not_understood_gives_no_limit_and_is_counted(value: str) -> None:
    assert read(value) == ([], 1)


def test_conditions_of_one_value_are_read_apart() -> None:
    limits, unread = read("120 @ (06:00-20:00); 80 @ wet; 60 @ snow")
    assert [limit.limit_mps * 3.6 for limit in limits] == pytest.approx([120, 80])
    assert unread == 1


@pytest.mark.parametrize(
    "condition",
    ["weight>7.5", "weightrating >= 3.5 t", "hgv", "trailer", "axles>2", "length>12", "22:00-06:00 AND hgv"],
)
def test_what_holds_for_other_vehicles_is_no_limit_and_nothing_unknown(condition: str) -> None:
    assert read(f"60 @ ({condition})") == ([], 0)
    assert not concerns_cars(f"no @ ({condition})")
    assert concerns_cars(f"no @ ({condition}); no @ (22:00-06:00)")
