"""Coordinates typed as a text."""

from __future__ import annotations

import re
from typing import Final

_PART: Final = (
    r"(?P<{0}1>[NSEWnsew])?\s*(?P<{0}s>[+-]?)(?P<{0}d>\d{{1,3}}(?:\.\d{{1,15}})?)\s*°?\s*"
    r"(?:(?P<{0}m>\d{{1,2}}(?:\.\d{{1,15}})?)\s*['′’]\s*(?:(?P<{0}x>\d{{1,2}}(?:\.\d{{1,15}})?)\s*(?:[\"″”]|''))?)?\s*"
    r"(?P<{0}2>[NSEWnsew])?"
)
_PAIR: Final = re.compile(
    r"\s*(?:lat\w*\s*[:=]?\s*)?"
    + _PART.format("a")
    + r"\s*(?:[,;/\s]\s*)(?:lo?ng?\w*\s*[:=]?\s*)?"
    + _PART.format("b")
    + r"\s*\Z"
)
_COMMA: Final = re.compile(r"\s*([+-]?\d{1,3}),(\d{2,15})\s*[;\s]\s*([+-]?\d{1,3}),(\d{2,15})\s*\Z")


def coordinates_in(text: str) -> tuple[float, float] | None:
    """Latitude and longitude [deg] of a text such as `41.15, -8.61`, `41.15N 8.61W` or `41°9'N 8°36'36"W`, else None.

    Without letters the latitude is first, unless it can only be the other way round.
    """
    commas = _COMMA.match(text)
    if commas:
        text = f"{commas[1]}.{commas[2]} {commas[3]}.{commas[4]}"
    found = _PAIR.match(text)
    if found is None:
        return None
    first, second = _degrees(found, "a"), _degrees(found, "b")
    if first is None or second is None:
        return None
    (lat, lat_letter), (lon, lon_letter) = first, second
    if not (lat_letter or lon_letter or found["am"] or any(c in text for c in ".,;/°")):
        return None  # two whole numbers are rather a house number and a street
    if lat_letter in ("e", "w") or lon_letter in ("n", "s"):
        if lat_letter in ("n", "s") or lon_letter in ("e", "w"):
            return None
        lat, lon = lon, lat
    elif abs(lat) > 90.0 >= abs(lon):
        lat, lon = lon, lat
    return (lat, lon) if abs(lat) <= 90.0 and abs(lon) <= 180.0 else None


def _degrees(found: re.Match[str], part: str) -> tuple[float, str] | None:
    letter = (found[f"{part}1"] or found[f"{part}2"] or "").lower()
    if found[f"{part}1"] and found[f"{part}2"]:
        return None
    minutes, seconds = float(found[f"{part}m"] or 0.0), float(found[f"{part}x"] or 0.0)
    if minutes >= 60.0 or seconds >= 60.0:
        return None
    value = float(found[f"{part}d"]) + minutes / 60.0 + seconds / 3600.0
    return (-value if found[f"{part}s"] == "-" or letter in ("s", "w") else value), letter
