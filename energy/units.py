"""Factors between the units that people use and SI, which everything inside is in; exact but for gravity."""

from __future__ import annotations

from typing import Final

JOULE_PER_WH: Final = 3600.0
JOULE_PER_KWH: Final = 3.6e6
JOULE_PER_M_PER_WH_PER_KM: Final = 3.6
JOULE_PER_M_PER_KWH_PER_100KM: Final = 36.0
SECOND_PER_HOUR: Final = 3600.0
SECOND_PER_MINUTE: Final = 60.0
METRE_PER_KM: Final = 1000.0
KMH_PER_MPS: Final = 3.6
ZERO_CELSIUS_K: Final = 273.15
GRAVITY_MPS2: Final = 9.81  # the source's value

NEWTON_PER_LBF: Final = 4.4482216152605  # 0.45359237 kg · 9.80665 m/s²
MPS_PER_MPH: Final = 0.44704  # 1609.344 m / 3600 s
KG_PER_LB: Final = 0.45359237
KM_PER_MILE: Final = 1.609344
