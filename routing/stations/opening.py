"""Whether a station is open, by opening hours in the syntax of OpenStreetMap."""

from __future__ import annotations

from datetime import datetime, timedelta
from enum import StrEnum
from functools import lru_cache
from typing import Final

from opening_hours import OpeningHours, State, validate

LONGEST_TEXT: Final = 1000  # characters; OpenStreetMap has 255 at most
_MONDAY: Final = datetime(2026, 6, 1)  # of a week that stands for any: no holidays of a country are looked at
_READ: Final = (datetime(1900, 1, 1), datetime(9999, 12, 20))  # beyond which the parser takes all as closed
_WEEK_MIN: Final = 7 * 24 * 60
_LOOKED_AHEAD: Final = timedelta(days=366)
_TEXTS_KEPT: Final = 8192


class Opening(StrEnum):
    """Whether a station is open; unknown where its hours are not known, not understood or say so themselves."""

    OPEN = "open"
    CLOSED = "closed"
    UNKNOWN = "unknown"


def is_understood(hours: str) -> bool:
    """Whether a text is one of opening hours."""
    return _parsed(hours) is not None


def week_time(minute: float) -> datetime:
    """A local time that stands for minutes since Monday 0:00, which may be beyond a week; in whole seconds."""
    return _MONDAY + timedelta(seconds=round(minute % _WEEK_MIN * 60.0))


def opening_at(hours: str | None, time: datetime) -> Opening:
    """Whether what has these hours is open at a local time."""
    parsed = None if hours is None else _parsed(hours)
    if parsed is None or time.replace(tzinfo=None) < _READ[0]:
        return Opening.UNKNOWN
    return _opening(parsed.state(time)[0])


def opening_during(hours: str | None, begin: datetime, end: datetime) -> Opening:
    """Open where it is open from begin to end, closed where it is closed at any time between, else unknown."""
    parsed = None if hours is None else _parsed(hours)
    if parsed is None:
        return Opening.UNKNOWN
    if end <= begin:
        return opening_at(hours, begin)
    states = {state for _, _, state, _ in parsed.intervals(begin, end)}
    if State.CLOSED in states:
        return Opening.CLOSED
    return Opening.UNKNOWN if State.UNKNOWN in states else Opening.OPEN


def next_opening(hours: str | None, time: datetime) -> datetime | None:
    """The first local time from now on at which it is open, within a year; None where there is or is known none."""
    parsed = None if hours is None else _parsed(hours)
    if parsed is None:
        return None
    if parsed.is_open(time):
        return time
    last = datetime.max.replace(tzinfo=time.tzinfo)
    for begin, _, state, _ in parsed.intervals(time, last if last - time < _LOOKED_AHEAD else time + _LOOKED_AHEAD):
        if state == State.OPEN:
            return begin.replace(tzinfo=time.tzinfo)
    return None


def _opening(state: State) -> Opening:
    if state == State.OPEN:
        return Opening.OPEN
    return Opening.CLOSED if state == State.CLOSED else Opening.UNKNOWN


@lru_cache(maxsize=_TEXTS_KEPT)
def _parsed(hours: str) -> OpeningHours | None:
    if len(hours) > LONGEST_TEXT or not validate(hours):
        return None
    return OpeningHours(hours, auto_country=False, auto_timezone=False)


def open_times(hours: str | None, time: datetime | None = None) -> tuple[tuple[float, float], ...] | None:
    """When it may be open in the week of a local time: from and to in minutes since Monday 0:00, rising.

    None where hours aren't known. Times that are said to be unknown count as open. Without a time, and before 1900 or
    at the end of 9999, a week in June stands for any.
    """
    parsed = None if hours is None else _parsed(hours)
    if parsed is None:
        return None
    found = []
    monday = _MONDAY
    if time is not None and _READ[0] + timedelta(minutes=_WEEK_MIN) <= time <= _READ[1]:
        monday = datetime(time.year, time.month, time.day) - timedelta(days=time.weekday())
    for begin, end, state, _ in parsed.intervals(monday, monday + timedelta(minutes=_WEEK_MIN)):
        from_min, to_min = ((at - monday).total_seconds() / 60.0 for at in (begin, end))
        if state != State.CLOSED and min(to_min, _WEEK_MIN) > max(from_min, 0.0):
            found.append((max(from_min, 0.0), min(to_min, float(_WEEK_MIN))))
    return tuple(found)
