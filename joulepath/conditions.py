"""What a drive meets: weather, load and habits, in human units."""

from __future__ import annotations

import math
from dataclasses import dataclass
from datetime import datetime
from typing import Final

from energy.conditions import CONDITION_RANGES, STILL, RoadSurface, minute_of_week
from energy.conditions import Conditions as ConditionsInSi
from energy.errors import ConditionsError
from energy.units import KMH_PER_MPS, ZERO_CELSIUS_K

DIGITS: Final = 9  # of K, so that the ends of the ranges are those inside
# the fields whose units are not those inside: the name there, and what a value is multiplied with and moved by
IN_SI: Final = {
    "ambient_c": ("ambient_k", 1.0, ZERO_CELSIUS_K),
    "cabin_start_c": ("cabin_start_k", 1.0, ZERO_CELSIUS_K),
    "wind_from_deg": ("wind_from_rad", math.pi / 180.0, 0.0),
    "top_speed_kmh": ("top_speed_mps", 1.0 / KMH_PER_MPS, 0.0),
}


@dataclass(frozen=True, slots=True)
class Conditions:
    """Weather, load and habits of one drive, by the names of the HTTP API (docs/effects.md).

    Every field at its default leaves the model as it is without it. Values out of range raise ConditionsError.
    """

    ambient_c: float | None = None
    cabin_start_c: float | None = None
    climate: bool = True
    altitude_density: bool | None = None
    wind_speed_mps: float = 0.0
    wind_from_deg: float = 0.0
    payload_kg: float = 0.0
    drag_factor: float = 1.0
    road: str = "dry"
    speed_factor: float = 1.0
    top_speed_kmh: float | None = None
    aux_power_w: float | None = None
    sun_w: float = 0.0
    regen_limited: bool = False
    departure: datetime | None = None

    def __post_init__(self) -> None:
        for name, (inside, factor, offset) in IN_SI.items():
            value = getattr(self, name)
            low, high = ((bound - offset) / factor for bound in CONDITION_RANGES[inside])
            if value is not None and not low <= value <= high:
                raise ConditionsError(f"conditions.{name}", value, f"{low:g}..{high:g}")
        if self.ambient_c is None and (self.cabin_start_c is not None or self.sun_w > 0.0):
            name = "cabin_start_c" if self.cabin_start_c is not None else "sun_w"
            raise ConditionsError(f"conditions.{name}", getattr(self, name), "only together with ambient_c")
        if self.departure is not None and not isinstance(self.departure, datetime):
            raise ConditionsError("conditions.departure", repr(self.departure), "a datetime, local at the roads")
        self.in_si()

    def in_si(self) -> ConditionsInSi:
        """The same as the energy package takes it."""
        if self.road not in tuple(RoadSurface):
            raise ConditionsError("conditions.road", repr(self.road), ", ".join(RoadSurface))
        return ConditionsInSi(
            ambient_k=_kelvin(self.ambient_c),
            cabin_start_k=_kelvin(self.cabin_start_c),
            climate=self.climate,
            altitude_density=self.altitude_density,
            wind_speed_mps=self.wind_speed_mps,
            wind_from_rad=math.radians(self.wind_from_deg),
            payload_kg=self.payload_kg,
            drag_factor=self.drag_factor,
            road=RoadSurface(self.road),
            speed_factor=self.speed_factor,
            top_speed_mps=None if self.top_speed_kmh is None else self.top_speed_kmh / KMH_PER_MPS,
            aux_power_w=self.aux_power_w,
            sun_w=self.sun_w,
            regen_limited=self.regen_limited,
            departure_min=None if self.departure is None else minute_of_week(self.departure),
        )


def conditions_in_si(given: Conditions | None) -> ConditionsInSi:
    """Conditions as the energy package takes them; without any, those of the source."""
    if given is None:
        return STILL
    if not isinstance(given, Conditions):
        raise ConditionsError("conditions", repr(given), "a joulepath.Conditions")
    return given.in_si()


def _kelvin(celsius: float | None) -> float | None:
    return None if celsius is None else round(celsius + ZERO_CELSIUS_K, DIGITS)
