"""Units as loggers write them, each with its factor and offset to SI."""

from __future__ import annotations

from typing import Final

from diagnosis.recordings.formats.named_columns import M_PER_FOOT, RADIAN_PER_DEGREE
from energy.units import JOULE_PER_KWH, JOULE_PER_WH, KM_PER_MILE, KMH_PER_MPS, MPS_PER_MPH, ZERO_CELSIUS_K

MILE_M: Final = 1000.0 * KM_PER_MILE
K_PER_FAHRENHEIT: Final = 5.0 / 9.0

CELSIUS: Final = (1.0, ZERO_CELSIUS_K)
FAHRENHEIT: Final = (K_PER_FAHRENHEIT, ZERO_CELSIUS_K - 32.0 * K_PER_FAHRENHEIT)
UNITS: Final[dict[str, dict[str, tuple[float, float]]]] = {
    "speed": {
        "km/h": (1.0 / KMH_PER_MPS, 0.0),
        "mph": (MPS_PER_MPH, 0.0),
        "m/s": (1.0, 0.0),
        "meters/second": (1.0, 0.0),
    },
    "power": {"kw": (1000.0, 0.0), "w": (1.0, 0.0)},
    "energy": {"kwh": (JOULE_PER_KWH, 0.0), "wh": (JOULE_PER_WH, 0.0)},
    "way": {"km": (1000.0, 0.0), "mi": (MILE_M, 0.0), "miles": (MILE_M, 0.0), "mile": (MILE_M, 0.0), "m": (1.0, 0.0)},
    "voltage": {"v": (1.0, 0.0)},
    "current": {"a": (1.0, 0.0)},
    "share": {"%": (0.01, 0.0)},
    "temperature": {"°c": CELSIUS, "c": CELSIUS, "°f": FAHRENHEIT, "f": FAHRENHEIT},
    "height": {"m": (1.0, 0.0), "ft": (M_PER_FOOT, 0.0)},
    "angle": {"°": (RADIAN_PER_DEGREE, 0.0), "deg": (RADIAN_PER_DEGREE, 0.0)},
    "position": {"": (1.0, 0.0), "°": (1.0, 0.0), "deg": (1.0, 0.0)},
}


def plain_unit(unit: str) -> str:
    """A unit as UNITS has it: in small letters, with one spelling of the signs that have several."""
    return unit.strip().lower().replace("℃", "°c").replace("℉", "°f").replace("kmh", "km/h").replace("km/hr", "km/h")
