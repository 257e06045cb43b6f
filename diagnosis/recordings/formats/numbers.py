"""Numbers as loggers and spreadsheets write them beside plain ones: thousands set off, other signs, units behind."""

from __future__ import annotations

import re
from typing import Final

from diagnosis.recordings.formats.units import unit_of

DECIMAL_COMMA: Final = re.compile(r"[-+\u2212]?\d*,\d+(?:[eE][-+]?\d+)?")
DECIMAL_POINT: Final = re.compile(r"[-+\u2212]?\d*\.\d+(?:[eE][-+]?\d+)?")
COMMA_THOUSANDS: Final = re.compile(r"[-+\u2212]?[1-9]\d{0,2}(?:,\d{3})+")
POINT_THOUSANDS: Final = re.compile(r"[-+\u2212]?[1-9]\d{0,2}(?:\.\d{3})+")
SPACES: Final = " \u00a0\u2009\u202f'\u2019"
SET_OFF: Final = (  # what sets off thousands, and a decimal sign that is another one
    (re.compile(rf"[-+]?\d{{1,3}}(?:[{SPACES}]\d{{3}})+(?:[.,]\d+)?"), SPACES),
    (re.compile(r"[-+]?\d{1,3}(?:,\d{3})+\.\d+"), ","),
    (re.compile(r"[-+]?\d{1,3}(?:\.\d{3})+,\d+"), "."),
)
NUMBER: Final = re.compile(r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?")
WITH_UNIT: Final = re.compile(rf"([-+]?\d[\d.,{SPACES}]*?)[{SPACES}]*([^\d\s.,{SPACES}][^\d]*)")
QUOTED: Final = re.compile(r'="?([^"]*)"?')  # as spreadsheets keep a number a text
BEHIND: Final = re.compile(r"([\d.,]+)-")
IN_BRACKETS: Final = re.compile(r"\(([\d.,]+)\)")

DEGREES: Final = re.compile(
    r"[NSEW]?\s*[-+]?[\d.,\s°º'′’\"″:]+[NSEW]?", re.IGNORECASE
)  # and minutes, seconds, in any order
PART: Final = re.compile(r"\d+(?:[.,]\d+)?")
MOST_PARTS: Final = 3  # degrees, minutes, seconds


def number_of(cell: str) -> float | None:
    """The number in a cell that is written in another way than Python's; None where it is none or may be two."""
    text = cell.strip().replace("\u2212", "-")
    quoted = QUOTED.fullmatch(text)
    text = quoted[1].strip() if quoted is not None else text
    for pattern in (BEHIND, IN_BRACKETS):
        match = pattern.fullmatch(text)
        text = f"-{match[1]}" if match is not None else text
    for pattern, signs in SET_OFF:
        if pattern.fullmatch(text):
            text = "".join(letter for letter in text if letter not in signs)
            text = text.replace(",", ".")
            break
    return float(text) if NUMBER.fullmatch(text) else None


def number_and_unit(cell: str, channel: str) -> tuple[float, str] | None:
    """The value in SI of a number with a unit behind it that a channel can have, and the unit; None for all else."""
    match = WITH_UNIT.fullmatch(cell.strip().replace("\u2212", "-"))
    if match is None:
        return None
    unit, text = unit_of(channel, match[2]), match[1]
    value = number_of(text.replace(",", ".") if DECIMAL_COMMA.fullmatch(text) else text)
    return None if unit is None or value is None else (value * unit[0] + unit[1], match[2].strip())


def degrees_of(cell: str) -> float | None:
    """The latitude or longitude in a cell of degrees, minutes and seconds, also with a letter; None where it is none.

    N48 8.22, 48°8'13.2"N, -117 25.75 and W117 25.75 are known; minutes and seconds are below 60.
    """
    text = cell.strip().replace("\u2212", "-")
    parts = [float(part.replace(",", ".")) for part in PART.findall(text)]
    if DEGREES.fullmatch(text) is None or not 0 < len(parts) <= MOST_PARTS or any(part >= 60.0 for part in parts[1:]):
        return None
    value = sum(part / 60.0**k for k, part in enumerate(parts))
    return -value if "-" in text or text[:1] in "SWsw" or text[-1:] in "SWsw" else value
