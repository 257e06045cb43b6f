"""Opening hours: open, closed, unknown, and when it opens."""

from __future__ import annotations

from datetime import datetime, timedelta

import pytest

from routing.stations.opening import (
    LONGEST_TEXT,
    Opening,
    is_understood,
    next_opening,
    open_times,
    opening_at,
    opening_during,
    week_time,
)

MONDAY_9 = datetime(2026, 6, 1, 9)
OFFICE = "Mo-Fr 08:00-18:00; Sa 09:00-12:00"


@pytest.mark.parametrize(
    ("hours", "time", "expected"),
    [
        ("24/7", MONDAY_9, Opening.OPEN),
        (OFFICE, MONDAY_9, Opening.OPEN),
        (OFFICE, MONDAY_9.replace(hour=18), Opening.CLOSED),
        (OFFICE, MONDAY_9 + timedelta(days=5), Opening.OPEN),
        (OFFICE, MONDAY_9 + timedelta(days=6), Opening.CLOSED),
        ("Fr 22:00-04:00", datetime(2026, 6, 6, 3), Opening.OPEN),  # Friday's night lasts into Saturday
        ("Mo-Fr 08:00-18:00 unknown", MONDAY_9, Opening.UNKNOWN),
        ("off", MONDAY_9, Opening.CLOSED),
        ("when the shop is open", MONDAY_9, Opening.UNKNOWN),
        ("", MONDAY_9, Opening.UNKNOWN),
        (None, MONDAY_9, Opening.UNKNOWN),
        ("24/7;" * LONGEST_TEXT, MONDAY_9, Opening.UNKNOWN),
    ],
)
def test_hours_say_whether_it_is_open_and_what_is_not_understood_is_unknown(
    hours: str | None, time: datetime, expected: Opening
) -> None:
    assert opening_at(hours, time) is expected
    assert opening_during(hours, time, time) is expected


def test_open_during_needs_all_of_the_time() -> None:
    assert opening_during(OFFICE, MONDAY_9, MONDAY_9 + timedelta(hours=9)) is Opening.OPEN
    assert opening_during(OFFICE, MONDAY_9, MONDAY_9 + timedelta(hours=10)) is Opening.CLOSED
    assert opening_during("24/7", MONDAY_9, MONDAY_9 + timedelta(days=9)) is Opening.OPEN
    partly = "Mo 08:00-10:00, Mo 10:00-12:00 unknown"
    assert opening_during(partly, MONDAY_9, MONDAY_9 + timedelta(hours=2)) is Opening.UNKNOWN
    assert opening_during("nonsense", MONDAY_9, MONDAY_9 + timedelta(hours=2)) is Opening.UNKNOWN


def test_next_opening_is_now_or_the_next_morning_or_none() -> None:
    assert next_opening(OFFICE, MONDAY_9) == MONDAY_9
    assert next_opening(OFFICE, MONDAY_9.replace(hour=19)) == datetime(2026, 6, 2, 8)
    assert next_opening(OFFICE, datetime(2026, 6, 6, 12)) == datetime(2026, 6, 8, 8)  # over Sunday
    assert next_opening("off", MONDAY_9) is None
    assert next_opening("nonsense", MONDAY_9) is None


@pytest.mark.parametrize("hours", [OFFICE, "24/7", "Mo-Su 06:00-22:00", "sunrise-sunset"])
def test_next_opening_is_the_first_time_at_which_it_is_open(hours: str) -> None:
    for hour in range(0, 24 * 7, 5):
        asked = MONDAY_9 + timedelta(hours=hour)
        found = next_opening(hours, asked)
        assert found is not None
        assert opening_at(hours, found) is Opening.OPEN
        if found > asked:
            assert opening_during(hours, asked, found) is Opening.CLOSED
            assert opening_at(hours, found - timedelta(minutes=1)) is Opening.CLOSED


def test_minutes_of_a_week_begin_on_monday_and_go_round() -> None:
    assert week_time(0.0).weekday() == 0
    assert week_time(6 * 1440 + 90).strftime("%a %H:%M") == "Sun 01:30"
    assert week_time(7 * 1440 + 5.5) == week_time(5.5)


def test_texts_of_hours_are_told_from_others() -> None:
    assert is_understood("Mo-Fr 08:00-18:00; PH off")
    assert not is_understood("8 to 6")


@pytest.mark.parametrize("hours", [OFFICE, "24/7", "off", "sunrise-sunset", "Mo[1] 10:00-12:00", "easter 10:00-12:00"])
@pytest.mark.parametrize("time", [datetime(1, 1, 1), datetime(1900, 2, 28), datetime(9999, 12, 31, 23, 59, 59)])
def test_the_first_and_last_times_that_there_are_can_be_asked_for(hours: str, time: datetime) -> None:
    assert opening_at(hours, time) in Opening
    found = next_opening(hours, time)
    assert found is None or found >= time


def test_times_of_a_week_are_those_of_its_season() -> None:
    hours = "Apr-Oct 08:00-20:00; Nov-Mar off"
    assert open_times(hours, datetime(2026, 12, 3, 7)) == ()
    times = open_times(hours, datetime(2026, 7, 15, 23, 59))
    assert times is not None
    assert times[0] == (480.0, 1200.0)
    assert len(times) == 7
    assert open_times(hours) == times
    assert open_times("nonsense", MONDAY_9) is None


@pytest.mark.parametrize("time", [datetime.min, datetime(1899, 12, 31), datetime(1900, 1, 1), datetime.max])
def test_a_time_of_any_year_is_no_error_and_never_closes_what_is_always_open(time: datetime) -> None:
    assert opening_at("24/7", time) is not Opening.CLOSED
    assert open_times("24/7", time) == ((0.0, 10080.0),)
