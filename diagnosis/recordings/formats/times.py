"""Forms in which loggers write a time: seconds, seconds since 1970 and parts of them, date and time, time of day."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import TYPE_CHECKING, Final

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

DAY_S: Final = 86_400.0
EPOCH: Final = datetime(1970, 1, 1, tzinfo=UTC)
EPOCH_PARTS: Final = (  # least number of them since 1970, how many a second has, their name
    (1e17, 1e9, "nanoseconds"),
    (1e14, 1e6, "microseconds"),
    (1e11, 1e3, "milliseconds"),  # seconds since 1970 reach it in the year 5138, milliseconds have since 1973
)
FORMS: Final = "a time of day such as 13:59:59.5 or 01:59:59 PM, a date and time such as 2026-03-01T13:59:59 (ISO 8601)"
CLOCK: Final = r"(\d{1,2}):(\d{2})(?::(\d{2})(?:[.,:](\d{1,9}))?)?(?:\s*([AaPp])\.?[Mm]\.?)?"
TIME_OF_DAY: Final = re.compile(CLOCK)
NUMBERS: Final = re.compile(rf"(\d{{1,4}})([./-])(\d{{1,2}})\2(\d{{2,4}}),?[\sT]+{CLOCK}")
NAMED_MONTH: Final = re.compile(rf"(\d{{1,2}})[-. /]([A-Za-z]{{3}})[A-Za-z]*[-. /](\d{{4}}),?\s+{CLOCK}")
MONTHS: Final = ("jan", "feb", "mar", "apr", "may", "jun", "jul", "aug", "sep", "oct", "nov", "dec")
MONTHS_A_YEAR: Final = 12


@dataclass(frozen=True, slots=True)
class Written:
    """How a column writes its times, and how one of them is read: seconds, ValueError where it is of another form."""

    form: str
    second_of: Callable[[str], float]
    of_day: bool = False


def written(cells: Sequence[str]) -> Written | None:
    """The form of a column's times by its first and, where day and month could be either, by all; None for numbers.

    Date and time is of UTC where it has no zone.
    """
    first = next((cell.strip() for cell in cells if cell.strip()), "")
    if TIME_OF_DAY.fullmatch(first) and (first.count(":") > 1 or first[-1] in "mM."):
        return Written("time of day", _second_of_day, of_day=True)
    if NAMED_MONTH.fullmatch(first):
        return Written("date and time", _named_month_s)
    if _is_iso(first):
        zoned = datetime.fromisoformat(first).tzinfo is not None
        return Written("date and time", lambda cell: _iso_s(cell, zoned=zoned))
    return _by_numbers(cells) if NUMBERS.fullmatch(first) else None


def epoch_parts(first: float) -> tuple[float, str] | None:
    """How many of its parts a second has, and their name, where a number since 1970 is too large for seconds."""
    return next(((per_s, name) for least, per_s, name in EPOCH_PARTS if abs(first) > least), None)


def past_midnight(time_s: NDArray[np.float64]) -> NDArray[np.float64]:
    """Seconds of the day, float64 (n,), with a day more after each fall of at least half a day."""
    days = np.concatenate(([0.0], np.cumsum(np.diff(time_s) < -0.5 * DAY_S)))
    return np.asarray(time_s + DAY_S * days, np.float64)


def _is_iso(text: str) -> bool:
    try:
        datetime.fromisoformat(text)
    except ValueError:
        return False
    return not text.isdigit()


def _iso_s(text: str, *, zoned: bool) -> float:
    when = datetime.fromisoformat(text)
    if (when.tzinfo is not None) != zoned:
        raise ZoneError(text)
    return (when - (EPOCH if zoned else EPOCH.replace(tzinfo=None))).total_seconds()


class ZoneError(ValueError):
    """A time zone in some rows, and none in others."""


def _by_numbers(cells: Sequence[str]) -> Written:
    """Dates in numbers: year first, or day and month in the order that all of them allow; dots mean day first."""
    found = [match for cell in cells if (match := NUMBERS.fullmatch(cell.strip())) is not None]
    if len(found[0][1]) > 2:
        return Written("date and time", lambda cell: _numbers_s(cell, (0, 1, 2)))
    day_first = any(int(match[1]) > MONTHS_A_YEAR for match in found)
    month_first = any(int(match[3]) > MONTHS_A_YEAR for match in found)
    if found[0][2] == "." or day_first:
        return Written("date and time, the day first", lambda cell: _numbers_s(cell, (2, 1, 0)))
    sure = "" if month_first else " (it may be the day, which is the same drive on another date)"
    return Written(f"date and time, the month first{sure}", lambda cell: _numbers_s(cell, (2, 0, 1)))


def _numbers_s(text: str, order: tuple[int, int, int]) -> float:
    match = _matched(NUMBERS, text)
    parts = (int(match[1]), int(match[3]), int(match[4]))
    year, month, day = (parts[k] for k in order)
    return _date_s(year, month, day) + _clock_s(*match.groups()[4:])


def _named_month_s(text: str) -> float:
    match = _matched(NAMED_MONTH, text)
    month = MONTHS.index(match[2].lower()) + 1
    return _date_s(int(match[3]), month, int(match[1])) + _clock_s(*match.groups()[3:])


def _date_s(year: int, month: int, day: int) -> float:
    full = year if year > 99 else 2000 + year
    return (datetime(full, month, day, tzinfo=UTC) - EPOCH).total_seconds()


def _second_of_day(text: str) -> float:
    return _clock_s(*_matched(TIME_OF_DAY, text).groups())


def _clock_s(hours: str, minutes: str, seconds: str | None, part: str | None, half: str | None) -> float:
    hour = int(hours)
    if half is not None:
        if not 1 <= hour <= 12:
            raise ValueError(hours)
        hour = hour % 12 + (12 if half in "pP" else 0)
    return 3600.0 * hour + 60.0 * int(minutes) + float(f"{seconds or 0}.{part or 0}")


def _matched(pattern: re.Pattern[str], text: str) -> re.Match[str]:
    match = pattern.fullmatch(text)
    if match is None:
        raise ValueError(text)
    return match
