"""Forms in which loggers write a time: seconds, parts of them and days since a start, date and time, time of day."""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Callable
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import TYPE_CHECKING, Final

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

DAY_S: Final = 86_400.0
HOUR_S: Final = 3600.0
EPOCH: Final = datetime(1970, 1, 1, tzinfo=UTC)
FORMS: Final = "a time of day such as 13:59:59.5 or 01:59:59 PM, a date and time such as 2026-03-01T13:59:59 (ISO 8601)"
CLOCK: Final = r"(\d{1,2})([:.-])(\d{2})(?:\2(\d{2})(?:[.,:](\d{1,9}))?)?(?:\s*([AaPp])\.?\s?[Mm]\.?)?"
ZONE: Final = r"\s*((?:UTC|GMT)?\s?[+-]\d{1,2}(?::?\d{2})?|[A-Z]{1,4})?(?:\s?UTC|\s?\([^)]*\)|\s?\[[^\]]*\])?"
WEEKDAY: Final = r"(?:[^\W\d]{2,10}\.?,?\s+)?"
TIME_OF_DAY: Final = re.compile(r"(?:(\d+) days? \+?)?" + CLOCK.replace(r"\2", r"\3"))
MINUTES: Final = re.compile(r"(\d{1,3}):(\d{2})[.,](\d{1,9})")
COMPACT: Final = re.compile(r"((?:19|20)\d{2})(\d{2})(\d{2})(\d{2})(\d{2})(\d{2})(\d{3})?(?:\.(\d{1,9}))?")
DIGITS: Final = re.compile(r"\d{1,6}(?:\.\d*)?")
NUMBERS: Final = re.compile(
    rf"{WEEKDAY}(\d{{1,4}})([./-])\s?(\d{{1,2}})\2\s?(\d{{2,4}}),?[\s_T]+" + CLOCK.replace(r"\2", r"\6") + ZONE
)
NAMED_MONTH: Final = re.compile(
    rf"{WEEKDAY}(\d{{1,2}})[-. /]+([^\W\d]{{3,10}})[-. /]+(\d{{4}}),?\s+" + CLOCK.replace(r"\2", r"\5") + ZONE
)
MONTH_FIRST: Final = re.compile(
    rf"{WEEKDAY}([^\W\d]{{3,10}})\.? (\d{{1,2}}),? (\d{{4}}),?\s+" + CLOCK.replace(r"\2", r"\5") + ZONE
)
YEAR_LAST: Final = re.compile(
    rf"{WEEKDAY}([^\W\d]{{3,10}})\.? +(\d{{1,2}})\s+" + CLOCK.replace(r"\2", r"\4") + ZONE + r"\s+(\d{4})"
)
MONTHS: Final = tuple(  # their first letters in English, German, French, Spanish, Italian, Dutch and Portuguese
    text.split()
    for text in (
        "jan ene gen", "feb fev", "mar mrz mrt", "apr avr abr", "may mai mag mei maj", "jun juin giu", "jul juil lug",
        "aug aou ago", "sep set", "oct okt ott out", "nov", "dec dez dic",
    )
)  # fmt: skip
MONTHS_A_YEAR: Final = 12
ZONES_H: Final = {  # hours before UTC
    "Z": 0, "UTC": 0, "GMT": 0, "WET": 0, "WEST": 1, "BST": 1, "CET": 1, "CEST": 2, "MEZ": 1, "MESZ": 2, "EET": 2,
    "EEST": 3, "EST": -5, "EDT": -4, "CST": -6, "CDT": -5, "MST": -7, "MDT": -6, "PST": -8, "PDT": -7,
}  # fmt: skip
GOES_ON_S: Final = 60.0  # a clock that starts anew goes on within that
MOST_FALLS: Final = 1000
COARSE_FRAC: Final = 0.5  # of the rows that have the stamp of the row before, from which on it is too coarse
LEAST_STEPS: Final = 3


@dataclass(frozen=True, slots=True)
class Count:
    """Numbers that count something since a start: the least and most of them, how many a second has, 1970 in them."""

    low: float
    high: float
    per_s: float
    begin: float
    name: str


COUNTS: Final = (  # the narrower first
    Count(1.2e17, 1.5e17, 1e7, 116_444_736e9, "tenths of microseconds since 1601"),  # as nanoseconds it were 1973
    Count(6.2e17, 6.6e17, 1e7, 621_355_968e9, "tenths of microseconds since the year 1"),  # 1989
    Count(1e17, 1e20, 1e9, 0.0, "nanoseconds since 1970"),
    Count(1e14, 1e17, 1e6, 0.0, "microseconds since 1970"),
    Count(1e11, 1e14, 1e3, 0.0, "milliseconds since 1970"),  # seconds reach it in the year 5138, they have since 1973
)
DAYS: Final = (
    Count(25_569.0, 73_051.0, 1.0 / DAY_S, 25_569.0, "days since 1900, as spreadsheets count"),
    Count(719_529.0, 767_011.0, 1.0 / DAY_S, 719_529.0, "days since the year 0"),
    Count(2_440_587.5, 2_488_069.5, 1.0 / DAY_S, 2_440_587.5, "Julian days"),
)
MOST_STEP_DAYS: Final = 60.0 / DAY_S  # between rows; the same number of seconds is no log's


@dataclass(frozen=True, slots=True)
class Written:
    """How a column writes its times, and how one of them is read: seconds, ValueError where it is of another form.

    starts_anew_s: after how long the clock begins again, as a time of day does.
    """

    form: str
    second_of: Callable[[str], float]
    starts_anew_s: tuple[float, ...] = ()


class ZoneError(ValueError):
    """A time zone in some rows, and none in others."""


def written(cells: Sequence[str]) -> Written | None:
    """The form of a column's times by its first and, where day and month could be either, by all; None for numbers.

    Date and time is of UTC where it has no zone.
    """
    first = next((cell.strip() for cell in cells if cell.strip()), "")
    day = TIME_OF_DAY.fullmatch(first)
    if day is not None and (day[5] or first[-1] in "mM."):
        anew = (DAY_S,) if day[7] else (DAY_S, 0.5 * DAY_S, HOUR_S)
        return Written("time of day", _second_of_day, anew)
    if MINUTES.fullmatch(first):
        return Written("minutes and seconds", _second_of_hour, (HOUR_S, DAY_S))
    if COMPACT.fullmatch(first):
        return Written("date and time", _compact_s, (HOUR_S,))
    if _is_iso(first):
        zoned = datetime.fromisoformat(first).tzinfo is not None
        return Written("date and time", lambda cell: _iso_s(cell, zoned=zoned), () if zoned else (HOUR_S,))
    for pattern, second_of in (
        (NAMED_MONTH, _named_month_s),
        (MONTH_FIRST, _month_first_s),
        (YEAR_LAST, _year_last_s),
    ):
        match = pattern.fullmatch(first)
        if match is not None and any(_month(text) for text in match.groups() if text):
            return _with_zone("date and time", second_of, first)
    if NUMBERS.fullmatch(first):
        return _by_numbers(cells, first)
    return Written("digits of hours, minutes and seconds", _digits_s, (DAY_S,)) if _in_digits(cells, first) else None


def counted(values: NDArray[np.float64]) -> Count | None:
    """What numbers of a column of times count, where these are no seconds."""
    if not values.size:
        return None
    first = abs(float(values[0]))
    found = next((count for count in COUNTS if count.low < first <= count.high), None)
    if found is not None or values.size < LEAST_STEPS:
        return found
    days = next((count for count in DAYS if bool(((values >= count.low) & (values <= count.high)).all())), None)
    if days is None:
        return None
    steps = np.diff(values)
    steps = steps[steps > 0.0]
    return days if steps.size and float(np.median(steps)) <= MOST_STEP_DAYS else None


def past_midnight(time_s: NDArray[np.float64]) -> NDArray[np.float64]:
    """Seconds of the day, float64 (n,), with a day more after each fall of at least half a day."""
    days = np.concatenate(([0.0], np.cumsum(np.diff(time_s) < -0.5 * DAY_S)))
    return np.asarray(time_s + DAY_S * days, np.float64)


def going_on(time_s: NDArray[np.float64], anew_s: Sequence[float]) -> tuple[NDArray[np.float64], str]:
    """Times that go on where the clock begins again after one of anew_s, float64 (n,), and how often it did, or "".

    A day is added after any fall of half a day, all else only where it puts the time within GOES_ON_S of the row
    before: midnight, a clock of 12 hours, and an hour that is put back in autumn.
    """
    falls = np.flatnonzero(np.diff(time_s) < 0.0) + 1
    if not 0 < falls.size <= MOST_FALLS:
        return time_s, ""
    more, found = np.zeros(time_s.size), []
    for row in falls.tolist():
        fall_s = float(time_s[row - 1] - time_s[row])
        exact = [each for each in anew_s if 0.0 <= each - fall_s <= GOES_ON_S]
        if exact or (DAY_S in anew_s and fall_s > 0.5 * DAY_S):
            by_s = exact[0] if exact else DAY_S
            more[row:] += by_s
            if by_s != DAY_S:
                found.append(f"{by_s / HOUR_S:g} h added from {float(time_s[row - 1]):.12g} s on, where it is put back")
    return time_s + more, "; ".join(found[:LEAST_STEPS])


def is_too_coarse(time_s: NDArray[np.float64]) -> bool:
    """Whether times are whole minutes, which most rows share."""
    step_s = np.diff(time_s)
    if step_s.size < LEAST_STEPS or bool((time_s % 60.0 != 0.0).any()):
        return False
    return bool(np.count_nonzero(step_s == 0.0) > COARSE_FRAC * step_s.size)


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


def _with_zone(form: str, parts_of: Callable[[str], tuple[float, str | None]], first: str) -> Written:
    """A form of dates whose zone is in all rows, or in none; parts_of: seconds as written, and the zone."""
    try:
        zoned = parts_of(first)[1] is not None
    except ValueError:
        zoned = False  # told of by second_of

    def second_of(text: str) -> float:
        time_s, zone = parts_of(text)
        if (zone is not None) != zoned:
            raise ZoneError(text)
        return time_s - (0.0 if zone is None else _ahead_s(zone))

    return Written(form, second_of, () if zoned else (HOUR_S,))


def _ahead_s(zone: str) -> float:
    """How far a zone is ahead of UTC [s]; ValueError for a name that is not known."""
    match = re.fullmatch(r"(?:UTC|GMT)?\s?([+-])(\d{1,2}):?(\d{2})?", zone)
    if match is None:
        if zone not in ZONES_H:
            raise ValueError(zone)
        return HOUR_S * ZONES_H[zone]
    return (-1.0 if match[1] == "-" else 1.0) * (HOUR_S * int(match[2]) + 60.0 * int(match[3] or 0))


def _by_numbers(cells: Sequence[str], first: str) -> Written:
    """Dates in numbers: year first, or day and month in the order that all of them allow; dots mean day first.

    Where both are allowed, the one by which a drive over midnight goes on.
    """
    found = [match for cell in cells if (match := NUMBERS.fullmatch(cell.strip())) is not None]
    if len(found[0][1]) > 2:
        return _with_zone("date and time", lambda cell: _numbers_s(cell, (0, 1, 2)), first)
    day_first = any(int(match[1]) > MONTHS_A_YEAR for match in found)
    month_first = any(int(match[3]) > MONTHS_A_YEAR for match in found)
    dates = list(dict.fromkeys((int(match[1]), int(match[3]), int(match[4])) for match in found))
    if not day_first and not month_first and len(dates) > 1:
        day_first, month_first = _shorter(dates[0], dates[-1])
    if found[0][2] == "." or day_first:
        return _with_zone("date and time, the day first", lambda cell: _numbers_s(cell, (2, 1, 0)), first)
    sure = "" if month_first else " (it may be the day, which is the same drive on another date)"
    return _with_zone(f"date and time, the month first{sure}", lambda cell: _numbers_s(cell, (2, 0, 1)), first)


def _shorter(begin: tuple[int, int, int], end: tuple[int, int, int]) -> tuple[bool, bool]:
    """Whether the way from one date to another is shorter with the day first, and with the month first."""
    try:
        by_day, by_month = (abs(_ordered_s(end, o) - _ordered_s(begin, o)) for o in ((2, 1, 0), (2, 0, 1)))
    except ValueError:
        return False, False
    return by_day < by_month, by_month < by_day


def _ordered_s(parts: tuple[int, int, int], order: tuple[int, int, int]) -> float:
    return _date_s(*(parts[k] for k in order))


def _numbers_s(text: str, order: tuple[int, int, int]) -> tuple[float, str | None]:
    match = _matched(NUMBERS, text)
    parts = (int(match[1]), int(match[3]), int(match[4]))
    return _ordered_s(parts, order) + _clock_s(*match.groups()[4:10]), match[11]


def _named_month_s(text: str) -> tuple[float, str | None]:
    match = _matched(NAMED_MONTH, text)
    return _date_s(int(match[3]), _month(match[2]), int(match[1])) + _clock_s(*match.groups()[3:9]), match[10]


def _month_first_s(text: str) -> tuple[float, str | None]:
    match = _matched(MONTH_FIRST, text)
    return _date_s(int(match[3]), _month(match[1]), int(match[2])) + _clock_s(*match.groups()[3:9]), match[10]


def _year_last_s(text: str) -> tuple[float, str | None]:
    match = _matched(YEAR_LAST, text)
    return _date_s(int(match[10]), _month(match[1]), int(match[2])) + _clock_s(*match.groups()[2:8]), match[9]


def _compact_s(text: str) -> float:
    match = _matched(COMPACT, text)
    part = match[7] or match[8]
    date_s = _date_s(int(match[1]), int(match[2]), int(match[3]))
    return date_s + _clock_s(match[4], "", match[5], match[6], part, None)


def _month(name: str) -> int:
    """A month's number by its name, 0 where it is none."""
    letters = unicodedata.normalize("NFKD", name.lower())
    plain = "".join(letter for letter in letters if letter.isalpha() and not unicodedata.combining(letter))
    return next((k for k, names in enumerate(MONTHS, 1) if any(plain.startswith(each) for each in names)), 0)


def _date_s(year: int, month: int, day: int) -> float:
    full = year if year > 99 else 2000 + year
    return (datetime(full, month, day, tzinfo=UTC) - EPOCH).total_seconds()


def _second_of_day(text: str) -> float:
    match = _matched(TIME_OF_DAY, text)
    return DAY_S * int(match[1] or 0) + _clock_s(*match.groups()[1:])


def _second_of_hour(text: str) -> float:
    match = _matched(MINUTES, text)
    return 60.0 * int(match[1]) + float(f"{match[2]}.{match[3]}")


def _digits_s(text: str) -> float:
    """Seconds of 80059.5, which is 8 h, 0 min and 59.5 s."""
    if DIGITS.fullmatch(text) is None:
        raise ValueError(text)
    value = float(text)
    hours, minutes, seconds = value // 10_000.0, value // 100.0 % 100.0, value % 100.0
    if hours > 24.0 or minutes >= 60.0 or seconds >= 60.0:
        raise ValueError(text)
    return HOUR_S * hours + 60.0 * minutes + seconds


def _in_digits(cells: Sequence[str], first: str) -> bool:
    """Whether numbers are digits of a time of day: over a minute and more none of them ends on 60 to 99."""
    if DIGITS.fullmatch(first) is None:
        return False
    values = []
    for cell in cells:
        try:
            _digits_s(cell.strip())
        except ValueError:
            return False
        values.append(float(cell))
    steps = np.diff(np.array(values))
    return float(max(values)) - float(min(values)) >= 200.0 and 0.0 < float(np.median(steps)) <= 30.0


def _clock_s(hours: str, _: str, minutes: str, seconds: str | None, part: str | None, half: str | None) -> float:
    hour = int(hours)
    if half is not None:
        if not 1 <= hour <= 12:
            raise ValueError(hours)
        hour = hour % 12 + (12 if half in "pP" else 0)
    if int(minutes) > 59 or int(seconds or 0) > 60:
        raise ValueError(minutes)
    return HOUR_S * hour + 60.0 * int(minutes) + float(f"{seconds or 0}.{part or 0}")


def _matched(pattern: re.Pattern[str], text: str) -> re.Match[str]:
    match = pattern.fullmatch(text)
    if match is None:
        raise ValueError(text)
    return match
