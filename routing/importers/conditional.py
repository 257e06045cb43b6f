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
_HOLIDAYS: Final = frozenset(("ph", "sh"))
_FULL_DAY: Final = re.compile(r"\b(mo|tu|we|th|fr|sa|su)[a-z]{1,5}day\b")
_CLOSED: Final = frozenset(("off", "closed"))
_ALWAYS: Final = "24/7"
# Conditions that no private car meets: what it weighs and measures is bounded by its driving licence (3.5 t) and kind.
_OTHER_VEHICLE: Final = re.compile(
    r"^(?:hgv|goods|lorry|truck|bus|coach|tourist_bus|minibus|psv|taxi|trailer|caravan|motorhome|motorcycle|moped|mofa"
    r"|bicycle|tractor|agricultural|forestry|emergency|delivery|hazmat|towing|axles(?:>=[3-9]|>[2-9])"
    r"|(?:max)?(?:gross)?weight(?:rating|rated)?>=?(?P<t>\d+(?:\.\d+)?)t?|length>=?(?P<m>\d+(?:\.\d+)?)m?)$"
)
_HEAVIEST_CAR_T: Final = 3.5
_LONGEST_CAR_M: Final = 6.0  # assumed
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
    seasons and the rest are not. What is for lorries, buses, trailers or heavy vehicles is passed over.
    """
    limits: list[ConditionalLimit] = []
    unread = 0
    for said, condition in _parts(value):
        if _is_for_others(condition):
            continue
        limit_mps = speed_mps(said)
        found = _condition(condition) if condition and limit_mps is not None else None
        if found is None or limit_mps is None:
            unread += 1
        else:
            limits.append(ConditionalLimit(limit_mps, *found))
    return limits, unread


def concerns_cars(value: str) -> bool:
    """Whether a condition of a value such as `no @ (weight>3.5)` can hold for a private car."""
    return any(not _is_for_others(condition) for _, condition in _parts(value))


def _parts(value: str) -> list[tuple[str, str]]:
    """What is said under each condition, and the condition without its brackets, in lower case."""
    found = []
    for part in re.split(r";(?![^(]*\))", value):
        said, _, condition = (text.strip() for text in part.partition("@"))
        if said or condition:
            while condition.startswith("(") and condition.endswith(")"):
                condition = condition[1:-1].strip()
            found.append((said, condition.lower()))
    return found


def _is_for_others(condition: str) -> bool:
    """Whether one of the parts of a condition that AND joins holds for other vehicles only."""
    return any(_is_other(part) for part in re.split(r"\band\b", condition))


def _is_other(part: str) -> bool:
    match = _OTHER_VEHICLE.match(re.sub(r"\s", "", part))
    if not match:
        return False
    heavy, long = match["t"], match["m"]
    if heavy is not None:
        return float(heavy) >= _HEAVIEST_CAR_T
    return long is None or float(long) >= _LONGEST_CAR_M


def _condition(text: str) -> tuple[bool, tuple[Hours, ...]] | None:
    """Whether it asks for a wet road, and its hours; None where a part of it is not understood."""
    wet = False
    hours: tuple[Hours, ...] = ()
    for part in re.split(r"\band\b", text):
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

    Of rules apart at `;` a later one replaces what earlier ones say of its days, `off` takes them out. What is said of
    holidays is passed over: they are not known here.
    """
    text = _FULL_DAY.sub(r"\1", text.translate({0x2013: "-", 0x2014: "-"}))
    hours: list[Hours] = []
    for rule in text.split(";"):
        added: list[Hours] = []
        days_off: frozenset[int] = frozenset()
        for part in re.split(r"(?<=\d)\s*,\s*(?=[a-z])", rule.strip()):  # rules that don't replace each other
            found = _rule(part)
            if found is None:
                return None
            days, spans = found
            days_off |= days
            added += [Hours(days, *span) for span in spans] if days else []
        hours = [Hours(h.days - days_off, h.begin_min, h.end_min) for h in hours if h.days - days_off] + added
    return tuple(hours) or None


def _rule(text: str) -> tuple[frozenset[int], list[tuple[int, int]]] | None:
    """Days of a rule, none where it is for holidays, and its spans, none where it says `off`; None where not read."""
    words = re.sub(r"\s*([,-])\s*", r"\1", text.strip()).split()
    if words and words[-1] == "open":
        words.pop()
    if words == [_ALWAYS]:
        return _ALL_DAYS, [(0, DAY_MIN)]
    if not words or len(words) > 2:
        return None
    days = _ALL_DAYS
    if words[0][0].isalpha() and words[0] not in _CLOSED:
        names = [name for name in words.pop(0).split(",") if name not in _HOLIDAYS]
        found = _weekdays(names)
        if found is None or (not names and words and words[0][0].isalpha() and words[0] not in _CLOSED):
            return None
        days = found
    elif len(words) == 2:
        return None
    if words and words[0] in _CLOSED:
        return days, []
    spans = [_span(word) for word in words[0].split(",")] if words else [(0, DAY_MIN)]
    known = [span for span in spans if span is not None]
    return (days, known) if len(known) == len(spans) else None


def _weekdays(names: list[str]) -> frozenset[int] | None:
    days: set[int] = set()
    for part in names:
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
