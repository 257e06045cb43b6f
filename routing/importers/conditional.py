"""Limits that hold under a condition, as `maxspeed:conditional` says them: in the wet, at hours, on weekdays."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from routing.graph.conditional_limits import DAY_MIN

if TYPE_CHECKING:
    from collections.abc import Callable

_DAYS: Final = ("mo", "tu", "we", "th", "fr", "sa", "su")
_ALL_DAYS: Final = frozenset(range(7))
_DAY_PART: Final = re.compile(r"^(mo|tu|we|th|fr|sa|su)(?:-(mo|tu|we|th|fr|sa|su))?$")
_HOLIDAY: Final = re.compile(r"^(?:ph|sh)(?:\s*,\s*(?:ph|sh))*\s+off$")
_SPAN: Final = re.compile(r"^(\d{1,2}):(\d{2})-(\d{1,2}):(\d{2})$")


@dataclass(frozen=True, slots=True)
class Hours:
    """A span of time that comes back each week.

    days: 0 is Monday, on which it begins; begin_min, end_min: minutes of that day, the end not included; an end beyond
    1440 is on the day after.
    """

    days: frozenset[int]
    begin_min: int
    end_min: int


@dataclass(frozen=True, slots=True)
class ConditionalLimit:
    """A limit [m/s] that holds in the wet, within hours (any of them), or where both are asked within both."""

    limit_mps: float
    wet: bool = False
    hours: tuple[Hours, ...] = ()


def conditional_limits(value: str, speed_mps: Callable[[str], float | None]) -> tuple[list[ConditionalLimit], int]:
    """The limits of a value such as `60 @ wet; 30 @ (Mo-Fr 07:00-17:00)`, and how many of its parts are not understood.

    speed_mps: reads a limit. Understood are `wet` (`rain`), weekdays, hours, and both joined by AND; school holidays,
    seasons, weights and the rest are not.
    """
    limits: list[ConditionalLimit] = []
    unread = 0
    for part in re.split(r";(?![^(]*\))", value):
        if not part.strip():
            continue
        said, at, condition = part.partition("@")
        limit_mps = speed_mps(said.strip())
        found = _condition(condition.strip()) if at and limit_mps is not None else None
        if found is None or limit_mps is None:
            unread += 1
        else:
            limits.append(ConditionalLimit(limit_mps, *found))
    return limits, unread


def _condition(text: str) -> tuple[bool, tuple[Hours, ...]] | None:
    """Whether it asks for a wet road, and its hours; None where a part of it is not understood."""
    if text.startswith("(") and text.endswith(")"):
        text = text[1:-1]
    wet = False
    hours: tuple[Hours, ...] = ()
    for part in re.split(r"\band\b", text.strip().lower()):
        if part.strip() in ("wet", "rain"):
            wet = True
            continue
        found = _hours(part)
        if found is None or hours:
            return None
        hours = found
    return wet, hours


def _hours(text: str) -> tuple[Hours, ...] | None:
    """Hours in the syntax of opening_hours, as far as weekdays and times go; None for all else.

    That they do not hold on holidays (`PH off`) is passed over: holidays are not known here.
    """
    hours: list[Hours] = []
    for rule in text.split(";"):
        if _HOLIDAY.match(rule.strip()):
            continue
        words = re.sub(r"\s*([,-])\s*", r"\1", rule.strip()).split()
        if not words or len(words) > 2:
            return None
        days = _ALL_DAYS
        if words[0][0].isalpha():
            named = _weekdays(words.pop(0))
            if named is None:
                return None
            days = named
        spans = [_span(word) for word in words[0].split(",")] if words else [(0, DAY_MIN)]
        for span in spans:
            if span is None:
                return None
            hours.append(Hours(days, *span))
    return tuple(hours) or None


def _weekdays(text: str) -> frozenset[int] | None:
    days: set[int] = set()
    for part in text.split(","):
        match = _DAY_PART.match(part)
        if not match:
            return None
        begin = _DAYS.index(match[1])
        count = (_DAYS.index(match[2]) - begin) % 7 + 1 if match[2] else 1
        days |= {(begin + k) % 7 for k in range(count)}
    return frozenset(days)


def _span(text: str) -> tuple[int, int] | None:
    match = _SPAN.match(text)
    if not match:
        return None
    begin, end = int(match[1]) * 60 + int(match[2]), int(match[3]) * 60 + int(match[4])
    if begin >= DAY_MIN or end > 2 * DAY_MIN or int(match[2]) > 59 or int(match[4]) > 59:
        return None
    return begin, end if end > begin else end + DAY_MIN
