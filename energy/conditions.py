"""The world that a vehicle drives in, and the coefficients of the effects that it switches on (MODEL.md section 8).

Every field of `Conditions` at its default switches its effect off, so that the source's model is left untouched to the
bit. `EffectCoefficients` say how strong an effect is once it is on; a vehicle carries its own, and those that a
diagnosis has fitted replace them. Equations and sources: docs/effects.md.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import StrEnum
from typing import TYPE_CHECKING, Final

from energy.errors import ConditionsError
from energy.units import SECOND_PER_MINUTE

if TYPE_CHECKING:
    from datetime import datetime


class RoadSurface(StrEnum):
    """What lies on the road."""

    DRY = "dry"
    WET = "wet"
    SNOW = "snow"


@dataclass(frozen=True, slots=True)
class Conditions:
    """Weather, load and habits of one drive; every default is the source's model.

    ambient_k: air temperature, 220..330 [K]. None: that of the source, no effect of temperature at all.
    cabin_start_k: cabin temperature at departure [K]; without it, ambient. climate: False switches heating and cooling
    off.
    altitude_density: thinner air higher up; None: only when ambient_k is given.
    wind_speed_mps, wind_from_rad: at the vehicle's height [m/s], direction it comes from, clockwise from north [rad].
    payload_kg: beyond the vehicle's mass [kg]. drag_factor: on the aerodynamic part, e.g. 1.25 for a roof box [-].
    road: what lies on it. speed_factor: driven speed over the limit [-]; top_speed_mps: never faster [m/s].
    aux_power_w: instead of the vehicle's [W]. sun_w: heat that the sun brings into the cabin [W].
    regen_limited: recuperation has a power cap that fades at high charge and in the cold.
    departure_min: minute of the week, 0..10079 from Monday 00:00, local time of the roads: the limits of that time hold
    on the whole way; None: those without a time.

    Raises ConditionsError naming field, value and range.
    """

    ambient_k: float | None = None
    cabin_start_k: float | None = None
    climate: bool = True
    altitude_density: bool | None = None
    wind_speed_mps: float = 0.0
    wind_from_rad: float = 0.0
    payload_kg: float = 0.0
    drag_factor: float = 1.0
    road: RoadSurface = RoadSurface.DRY
    speed_factor: float = 1.0
    top_speed_mps: float | None = None
    aux_power_w: float | None = None
    sun_w: float = 0.0
    regen_limited: bool = False
    departure_min: int | None = None

    def __post_init__(self) -> None:
        for name, (low, high) in CONDITION_RANGES.items():
            value = getattr(self, name)
            if value is not None and not low <= value <= high:
                raise ConditionsError(f"conditions.{name}", value, f"{low:g}..{high:g}")
        if self.departure_min is not None and not 0 <= self.departure_min < WEEK_MIN:
            raise ConditionsError("conditions.departure_min", self.departure_min, f"0..{WEEK_MIN - 1}")
        if self.ambient_k is None:
            for name in ("cabin_start_k", "sun_w"):
                if getattr(self, name):
                    raise ConditionsError(f"conditions.{name}", getattr(self, name), "only together with ambient_k")

    @property
    def thin_air(self) -> bool:
        """Whether altitude changes the density of the air."""
        return self.ambient_k is not None if self.altitude_density is None else self.altitude_density


WEEK_MIN: Final = 7 * 1440  # minutes of a week
CONDITION_RANGES: Final = {
    "ambient_k": (220.0, 330.0),
    "cabin_start_k": (220.0, 350.0),
    "wind_speed_mps": (0.0, 40.0),
    "wind_from_rad": (-2.0 * math.pi, 2.0 * math.pi),
    "payload_kg": (0.0, 100_000.0),
    "drag_factor": (0.3, 5.0),
    "speed_factor": (0.2, 1.5),
    "top_speed_mps": (1.0, 200.0 / 3.6),
    "aux_power_w": (0.0, 100_000.0),
    "sun_w": (0.0, 5000.0),
}

STILL: Final = Conditions()


def minute_of_week(departure: datetime) -> int:
    """Minute of the week of a local time, 0..10079 from Monday 00:00."""
    return departure.weekday() * 1440 + departure.hour * 60 + departure.minute


def exact_minute_of_week(departure: datetime) -> float:
    """Minutes since Monday 00:00 of a local time, with its seconds as a fraction, 0..10080."""
    return minute_of_week(departure) + (departure.second + departure.microsecond / 1e6) / SECOND_PER_MINUTE
