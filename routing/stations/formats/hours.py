"""Opening hours of other sources in the syntax of OpenStreetMap, where they are clear."""

from __future__ import annotations

import re
from functools import lru_cache
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

REPEATED: Final = 2000  # texts of a file, most of which come again
ALWAYS: Final = "24/7"
DAYS: Final = ("Mo", "Tu", "We", "Th", "Fr", "Sa", "Su")
MOST_TEXT: Final = 250  # letters, OpenStreetMap's own limit of a value is 255
FULL_DAY: Final = "00:00-24:00"
CLOCK: Final = re.compile(r"(\d{1,2}):(\d{2})(?::\d{2})?")
SPAN: Final = re.compile(r"(\d{1,2}:\d{2})\s*[-–]\s*(\d{1,2}:\d{2})")
_DAY: Final = r"(?:Mo|Tu|We|Th|Fr|Sa|Su|PH|SH)"
_TIME: Final = r"(?:\d{1,2}:\d{2}|sunrise|sunset|dawn|dusk)"
_SPANS: Final = rf"{_TIME}\s?-\s?{_TIME}(?:\s?,\s?{_TIME}\s?-\s?{_TIME}){{0,5}}\+?"
_MONTH: Final = r"(?:Jan|Feb|Mar|Apr|May|Jun|Jul|Aug|Sep|Oct|Nov|Dec)"
_RULE: Final = (
    rf"(?:{_MONTH}(?: \d{{1,2}})?(?:-{_MONTH}(?: \d{{1,2}})?)?:? )?"
    rf"(?:{_DAY}(?:-{_DAY})?(?:,\s?{_DAY}(?:-{_DAY})?){{0,8}}:? ?)?(?:{_SPANS}|24/7|off|closed|open)"
)
OSM_SYNTAX: Final = re.compile(rf"{_RULE}(?:(?:\s?;\s?|,\s?(?=[A-Z])){_RULE}){{0,20}}\s?;?")
WORDS_OF_DAYS: Final = {
    **{name: k for k, names in enumerate(
        (
            ("m", "mo", "mon", "monday", "montag"), ("tu", "tue", "tues", "tuesday", "dienstag"),
            ("w", "we", "wed", "wednesday", "mittwoch"), ("th", "thu", "thur", "thurs", "thursday", "donnerstag"),
            ("f", "fr", "fri", "friday", "freitag"), ("sa", "sat", "saturday", "samstag", "sonnabend"),
            ("su", "sun", "sunday", "sonntag"),
        )
    ) for name in names},
}  # fmt: skip
_AM_PM: Final = r"(\d{1,2})(?::(\d{2}))?\s*([ap])\.?m\.?"
_ENGLISH_SPAN: Final = re.compile(rf"{_AM_PM}\s*(?:-|–|to)\s*{_AM_PM}", re.IGNORECASE)
_ENGLISH: Final = re.compile(
    rf"(?:(?P<days>[a-z]{{1,9}}(?:\s*-\s*[a-z]{{1,9}})?)\s*:?\s*)?(?P<span>{_AM_PM}\s*(?:-|–|to)\s*{_AM_PM})\s*(?P<daily>daily)?",
    re.IGNORECASE,
)
_ALWAYS_ENGLISH: Final = re.compile(
    r"24 ?(?:hours|hrs|h)(?:[ ,]*(?:daily|a day|per day|7 days a week))?|24 ?/ ?7", re.I
)
_OF_HOURS: Final = re.compile(
    r"\d\s*[ap]\.?m\b|\d:\d\d|clos|dawn|dusk|business hours|summer|winter|season|weekend|weekday|holiday|hours", re.I
)


@lru_cache(maxsize=REPEATED)
def osm_hours(text: str) -> str | None:
    """A text that is in OpenStreetMap's syntax already, in its common forms; None where it is in another."""
    kept = " ".join(text.split())
    if not kept or len(kept) > MOST_TEXT:
        return None
    if kept.lower() in ("24/7", "24 / 7", "24h", "24 h", "24 hours", "always", "24/24"):
        return ALWAYS
    return kept if OSM_SYNTAX.fullmatch(kept) else None


def weekly_hours(spans: Mapping[int, Sequence[tuple[str, str]]]) -> str | None:
    """Hours of the week: by day, 0 is Monday, when it opens and closes as HH:MM; None where one is no time of day.

    Days that are missing are closed. Spans that end before they begin end on the next day.
    """
    by_day: dict[int, str] = {}
    for day in sorted(spans):
        texts = []
        for begin, end in spans[day]:
            opened, closed = _clock(begin), _clock(end)
            if opened in (None, "24:00") or closed is None or not 0 <= day <= 6:
                return None
            texts.append(f"{opened}-{'24:00' if closed in ('00:00', '23:59') else closed}")
        if texts:
            by_day[day] = FULL_DAY if FULL_DAY in texts else ",".join(dict.fromkeys(sorted(texts)))
    if not by_day:
        return None
    if len(by_day) == 7 and set(by_day.values()) == {FULL_DAY}:
        return ALWAYS
    rules: list[str] = []
    first = min(by_day)
    for day in range(first, 8):
        if day > first and by_day.get(day) == by_day.get(day - 1):
            continue
        if day > first and day - 1 in by_day:
            days = DAYS[first] if first == day - 1 else f"{DAYS[first]}-{DAYS[day - 1]}"
            rules.append(f"{days} {by_day[first]}")
        first = day
    text = "; ".join(rules)
    return text if len(text) <= MOST_TEXT else None


@lru_cache(maxsize=REPEATED)
def english_hours(text: str) -> str | None:
    """Hours of American registers, such as "24 hours daily" or "Mon-Fri 8am-5pm; Sat 9am-1pm"; None where unclear.

    Remarks that say nothing of hours, such as "pay lot", may follow.
    """
    spans: dict[int, list[tuple[str, str]]] = {}
    always = False
    if len(text) > 600:
        return None
    for clause in filter(None, (part.strip() for part in re.split(r"[;.](?=\s|$)|,(?=\s)", text))):
        if _ALWAYS_ENGLISH.fullmatch(clause):
            always = True
            continue
        match = _ENGLISH.fullmatch(clause)
        days = None if match is None else _days_of(match["days"])
        if match is None or days is None:
            if _OF_HOURS.search(clause) and not re.search(r"\d hours? (?:limit|max)|stay of \d+ hours", clause, re.I):
                return None
            continue
        span = _english_span(match["span"])
        if span is None:
            return None
        for day in days:
            spans.setdefault(day, []).append(span)
    if always:
        return None if spans else ALWAYS
    return weekly_hours(spans)


def day_of(word: str) -> int | None:
    """The day of the week of an English or German name or its short form, 0 is Monday."""
    return WORDS_OF_DAYS.get(word.strip().lower().rstrip("."))


def _days_of(text: str | None) -> Sequence[int] | None:
    if text is None or text.lower() == "daily":
        return range(7)
    ends = [day_of(word) for word in text.split("-")]
    first, last = ends[0], ends[-1]
    if first is None or last is None:
        return None
    return range(first, last + 1) if first <= last else (*range(first, 7), *range(last + 1))


def _english_span(text: str) -> tuple[str, str] | None:
    match = _ENGLISH_SPAN.fullmatch(text.strip())
    if match is None:
        return None
    begin, end = _of_halves(*match.groups()[:3]), _of_halves(*match.groups()[3:])
    return None if begin is None or end is None else (begin, end)


def _of_halves(hour: str, minute: str | None, half: str) -> str | None:
    """A time of day of two halves as HH:MM: 12am is 00:00."""
    if not 1 <= int(hour) <= 12 or int(minute or 0) > 59:
        return None
    return f"{int(hour) % 12 + (12 if half.lower() == 'p' else 0):02d}:{int(minute or 0):02d}"


def _clock(text: str) -> str | None:
    match = CLOCK.fullmatch(text.strip())
    if match is None or int(match[1]) > 24 or int(match[2]) > 59 or (int(match[1]) == 24 and int(match[2])):
        return None
    return f"{int(match[1]):02d}:{match[2]}"
