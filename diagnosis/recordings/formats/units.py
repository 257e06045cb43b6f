"""Units as loggers write them, each with its factor and offset to SI."""

from __future__ import annotations

import math
import re
from typing import Final

from energy.units import JOULE_PER_KWH, JOULE_PER_WH, KM_PER_MILE, KMH_PER_MPS, MPS_PER_MPH, ZERO_CELSIUS_K

M_PER_FOOT: Final = 0.3048
MPS_PER_KNOT: Final = 1852.0 / 3600.0
RADIAN_PER_DEGREE: Final = math.pi / 180.0
MILE_M: Final = 1000.0 * KM_PER_MILE
K_PER_FAHRENHEIT: Final = 5.0 / 9.0
W_PER_HP: Final = 745.699872  # mechanical, 550 ft lbf/s
W_PER_PS: Final = 735.49875  # metric, 75 kgf m/s

CELSIUS: Final = (1.0, ZERO_CELSIUS_K)
FAHRENHEIT: Final = (K_PER_FAHRENHEIT, ZERO_CELSIUS_K - 32.0 * K_PER_FAHRENHEIT)
UNITS: Final[dict[str, dict[str, tuple[float, float]]]] = {
    "speed": {
        "km/h": (1.0 / KMH_PER_MPS, 0.0),
        "mph": (MPS_PER_MPH, 0.0),
        "m/s": (1.0, 0.0),
        "kn": (MPS_PER_KNOT, 0.0),
        "ft/s": (M_PER_FOOT, 0.0),
    },
    "power": {"kw": (1000.0, 0.0), "w": (1.0, 0.0), "hp": (W_PER_HP, 0.0), "ps": (W_PER_PS, 0.0)},
    "energy": {"kwh": (JOULE_PER_KWH, 0.0), "wh": (JOULE_PER_WH, 0.0), "kj": (1000.0, 0.0), "mj": (1e6, 0.0)},
    "way": {"km": (1000.0, 0.0), "mi": (MILE_M, 0.0), "m": (1.0, 0.0)},
    "voltage": {"v": (1.0, 0.0), "mv": (0.001, 0.0)},
    "current": {"a": (1.0, 0.0), "ma": (0.001, 0.0)},
    "share": {"%": (0.01, 0.0)},
    "temperature": {"°c": CELSIUS, "°f": FAHRENHEIT, "k": (1.0, 0.0)},
    "height": {"m": (1.0, 0.0), "ft": (M_PER_FOOT, 0.0)},
    "angle": {"°": (RADIAN_PER_DEGREE, 0.0)},
    "position": {"": (1.0, 0.0), "°": (1.0, 0.0)},
    "time": {"s": (1.0, 0.0), "ms": (0.001, 0.0)},
}
SPELLINGS: Final = {
    "km/h": "kmh km/hr km/u kph km/hour km/std km/t км/ч kilometers/hour kilometres/hour",
    "mph": "mi/h miles/h miles/hr miles/hour",
    "m/s": "mps m/sec meters/second metres/second м/с",
    "kn": "kt kts knot knots",
    "ft/s": "fps feet/second",
    "kw": "кВт kilowatt kilowatts",
    "w": "watt watts вт",
    "hp": "bhp",
    "ps": "cv",
    "kwh": "kw·h kw*h квтч",
    "wh": "w·h w*h втч",
    "km": "км kilometers kilometres kilometer",
    "mi": "mile miles",
    "m": "meter meters metre metres м",
    "v": "volt volts в",
    "a": "amp amps ampere amperes а",
    "%": "percent pct",
    "k": "kelvin",
    "ft": "feet foot '",
    "°": "deg degree degrees º",
    "s": "sec secs second seconds с",
    "ms": "msec millisecond milliseconds",
}  # fmt: skip
BY_SPELLING: Final = {each.lower(): unit for unit, texts in SPELLINGS.items() for each in texts.split()}
DEGREES: Final = re.compile(  # however the sign of degrees came through
    r"(?:[^a-z%/]{1,3}|deg(?:rees?)?\.? ?)?([cf])(?:elsius|ahrenheit)?"
)
KIND_OF: Final = {
    "time_s": "time", "speed_mps": "speed", "power_w": "power", "heater_w": "power", "aircon_w": "power",
    "hvac_w": "power", "used_j": "energy", "regen_j": "energy", "drawn_j": "energy", "fed_j": "energy",
    "odometer_m": "way", "voltage_v": "voltage", "current_a": "current", "soc_frac": "share",
    "displayed_frac": "share", "ambient_k": "temperature", "battery_k": "temperature", "elevation_m": "height",
    "heading_rad": "angle", "latitude_deg": "position", "longitude_deg": "position",
}  # fmt: skip


def plain_unit(unit: str) -> str:
    """A unit as UNITS has it: in small letters, with one spelling of those that have several."""
    plain = unit.strip().strip("[]()").strip().lower().replace("℃", "°c").replace("℉", "°f")
    degrees = DEGREES.fullmatch(plain)
    return f"°{degrees[1]}" if degrees is not None else BY_SPELLING.get(plain, plain)


def is_unit(text: str) -> bool:
    """Whether a text is a unit of any kind."""
    unit = plain_unit(text)
    return bool(unit) and any(unit in units for units in UNITS.values())


def unit_of(channel: str, unit: str) -> tuple[float, float] | None:
    """Factor and offset to SI of a unit that a channel can be in; None for any other."""
    return UNITS.get(KIND_OF.get(channel, ""), {}).get(plain_unit(unit))
