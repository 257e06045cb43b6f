"""Numbers, powers and places as registers and spreadsheets write them."""

from __future__ import annotations

import math
import re
from typing import Final

from energy.charging.charging import MOST_POWER_W, Connector
from routing.places import Point, can_only_be_swapped, degrees_text, place_text, swapped_question
from routing.stations.notes import LeftOutError, shown

LEAST_POWER_W: Final = 500.0  # less charges bicycles; assumed
MOST_COUNT: Final = 2000  # sockets or vehicles of a station; the largest have some hundreds
NOT_SET_DEG: Final = 1e-3  # from 0, 0, which is where places lie that were never set
PLAIN: Final = re.compile(r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d{1,3})?")
POINT_THOUSANDS: Final = re.compile(r"[-+]?[1-9]\d{0,2}(?:\.\d{3})+(?:,\d+)?")
COMMA_THOUSANDS: Final = re.compile(r"[-+]?[1-9]\d{0,2}(?:,\d{3})+(?:\.\d+)?")
SPACES: Final = re.compile(r"(?<=\d)[ '\u00a0\u2009\u202f\u2019](?=\d{3}(?:\D|$))")
POWER: Final = re.compile(r"([-+\d.,'\u00a0\u2009\u202f\u2019 ]*\d)\s*(k|m)?\s*(w|va|wp)?\.?", re.IGNORECASE)
FACTORS: Final = {"": 1.0, "k": 1e3, "m": 1e6}
MOST_NUMBER: Final = 40  # letters
MOST_NACS_AC_W: Final = 20_000.0  # 80 A at 240 V
SINGLE_PHASE_W: Final = 8_000.0  # more than 32 A at 240 V give
MOST_AC_W: Final = {  # what a plug carries: 63 A of three phases, 16 A of a household's socket
    Connector.TYPE1: 19_200.0,
    Connector.TYPE2: 43_700.0,
    Connector.TYPE3: 43_700.0,
    Connector.GBT_AC: 43_700.0,
    Connector.DOMESTIC: 12_000.0,  # NEMA 14-50
    Connector.CEE: 87_000.0,
}


def number_of(value: object, *, decimal_comma: bool = False) -> float | None:
    """The finite number in a cell or a JSON value; None where it is none.

    decimal_comma: whether the file writes decimals with a comma, which settles what "1.000" and "1,000" are. Where the
    file's sign can't be meant, as in "50.9374" of such a file, the other one is.
    """
    if isinstance(value, bool):
        return None
    if isinstance(value, int | float):
        return float(value) if abs(value) < 1e300 and math.isfinite(value) else None
    if not isinstance(value, str) or len(value) > MOST_NUMBER:
        return None
    text = SPACES.sub("", value.strip().replace("\u2212", "-"))
    thousands = POINT_THOUSANDS if decimal_comma else COMMA_THOUSANDS
    if thousands.fullmatch(text):
        text = text.replace("." if decimal_comma else ",", "")
    elif "," in text and "." in text:
        other = COMMA_THOUSANDS if decimal_comma else POINT_THOUSANDS
        if not other.fullmatch(text):
            return None
        text = text.replace("," if decimal_comma else ".", "")
    text = text.replace(",", ".")
    if not PLAIN.fullmatch(text):
        return None
    number = float(text)
    return number if math.isfinite(number) else None


def degrees_of(value: object) -> float | None:
    """A latitude or longitude, with a decimal point or comma, as no thousands can be in it; None where it is none."""
    if isinstance(value, str):
        text = value.strip().replace("\u2212", "-").removesuffix("°")
        if len(text) > MOST_NUMBER or text.count(",") + text.count(".") > 1:
            return None
        text = text.replace(",", ".")
        value = float(text) if PLAIN.fullmatch(text) else None
    return number_of(value)


def place_of(lat: object, lon: object, bounds: tuple[float, float, float, float] | None = None) -> Point:
    """The place of a latitude and a longitude [deg].

    bounds: south, west, north, east that the source has stations in; a place outside whose swapped twin is inside is
    taken as swapped. Raises LeftOutError for what is missing, no number, 0 and 0, out of range or swapped.
    """
    lat_deg, lon_deg = _checked_degrees("latitude", lat, 90), _checked_degrees("longitude", lon, 180)
    if abs(lat_deg) < NOT_SET_DEG and abs(lon_deg) < NOT_SET_DEG:
        raise LeftOutError("place 0, 0", "place", place_text(lat_deg, lon_deg), "a place that is set")
    if can_only_be_swapped(lat_deg, lon_deg) or _is_swapped_in(lat_deg, lon_deg, bounds):
        hint = swapped_question(lat_deg, lon_deg)
        allowed = "latitude -90..90, then longitude"
        raise LeftOutError("latitude and longitude swapped", "place", place_text(lat_deg, lon_deg), allowed, hint)
    for field, found, most in (("latitude", lat_deg, 90.0), ("longitude", lon_deg, 180.0)):
        if abs(found) > most:
            raise LeftOutError("place out of range", field, degrees_text(found), f"-{most:g}..{most:g}")
    return Point(lat_deg, lon_deg)


def _checked_degrees(field: str, given: object, most: int) -> float:
    if given is None or given == "":
        raise LeftOutError("no place", field, "missing", f"-{most}..{most}")
    found = degrees_of(given)
    if found is None:
        raise LeftOutError("place that is no number", field, shown(given), f"a number, -{most}..{most}")
    return found


def _is_swapped_in(lat_deg: float, lon_deg: float, bounds: tuple[float, float, float, float] | None) -> bool:
    if bounds is None:
        return False
    south, west, north, east = bounds
    inside = south <= lat_deg <= north and west <= lon_deg <= east
    return not inside and south <= lon_deg <= north and west <= lat_deg <= east


def power_w_of(value: object, *, unit: str = "k", decimal_comma: bool = False) -> float | None:
    """A power [W] of a number with W, kW, MW or kVA behind it, or without a unit in that of its column; else None.

    unit: of the column: "k" for kW, "" for W. Powers that no station has, less than 500 W or more than 4 MW, are None.
    """
    if isinstance(value, str):
        match = POWER.fullmatch(value.strip()) if len(value) <= MOST_NUMBER else None
        if match is None:
            return None
        number = number_of(match[1], decimal_comma=decimal_comma)
        factor = FACTORS[(match[2] or "").lower()] if match[2] or match[3] else FACTORS[unit]
    else:
        number, factor = number_of(value), FACTORS[unit]
    if number is None:
        return None
    power_w = number * factor
    return power_w if LEAST_POWER_W <= power_w <= MOST_POWER_W else None


def count_of(value: object, most: int = MOST_COUNT) -> int | None:
    """A count of sockets or vehicles, 1..most; None where it is none."""
    number = number_of(value)
    return int(number) if number is not None and 1 <= number <= most and number == int(number) else None


def phases_of(connector: Connector, output_w: float | None) -> int | None:
    """Phases of alternating current that a plug must have by its kind and power; None where it may be one or three."""
    if connector in (Connector.TYPE1, Connector.DOMESTIC):
        return 1
    if connector is Connector.NACS:  # direct current beyond, which has no phases
        return 1 if output_w is not None and output_w <= MOST_NACS_AC_W else None
    if connector in (Connector.TYPE2, Connector.TYPE3, Connector.CEE, Connector.GBT_AC) and output_w is not None:
        return 3 if output_w > SINGLE_PHASE_W else None
    return None
