"""Conditions of a drive as they are sent, in human units (docs/effects.md)."""

from __future__ import annotations

from typing import Any, Final

from pydantic import Field, NaiveDatetime, model_validator

from app.schemas.base import Flag, Number, Sent, refusal
from energy.conditions import CONDITION_RANGES, RoadSurface
from energy.units import KMH_PER_MPS, ZERO_CELSIUS_K

DIGITS: Final = 9  # of °C and km/h, so that the ends of the ranges are those inside


def condition_field(name: str, default: float | None, description: str) -> Any:
    """A field within the range of the one inside; name: of that one."""
    low, high = CONDITION_RANGES[name]
    if name.endswith("_k"):
        low, high = (round(bound - ZERO_CELSIUS_K, DIGITS) for bound in (low, high))
    if name == "top_speed_mps":
        low, high = (round(bound * KMH_PER_MPS, DIGITS) for bound in (low, high))
    return Field(default=default, ge=low, le=high, description=description)


class ConditionsSent(Sent):
    """Weather, load and habits of one drive; every field at its default leaves the model as it is without it."""

    ambient_c: Number | None = condition_field(
        "ambient_k", None, "air temperature [°C]; without it, no effect of temperature"
    )
    cabin_start_c: Number | None = condition_field(
        "cabin_start_k", None, "cabin at departure [°C], with ambient_c only; without it, as outside"
    )
    climate: Flag = Field(default=True, description="false switches heating and cooling off")
    altitude_density: Flag | None = Field(
        default=None, description="whether air is thinner higher up; without it, where ambient_c is sent"
    )
    wind_speed_mps: Number = condition_field("wind_speed_mps", 0.0, "at the vehicle's height [m/s]")
    wind_from_deg: Number = Field(
        default=0.0, ge=0, le=360, description="where the wind comes from, clockwise from north [°]"
    )
    payload_kg: Number = condition_field("payload_kg", 0.0, "beyond the vehicle's mass_kg [kg]")
    drag_factor: Number = condition_field("drag_factor", 1.0, "on the aerodynamic drag, such as 1.25 for a roof box")
    road: RoadSurface = Field(default=RoadSurface.DRY, description="what lies on the road")
    speed_factor: Number = condition_field("speed_factor", 1.0, "driven speed over the limit")
    top_speed_kmh: Number | None = condition_field("top_speed_mps", None, "never faster than this [km/h]")
    aux_power_w: Number | None = condition_field("aux_power_w", None, "instead of the vehicle's [W]")
    sun_w: Number = condition_field("sun_w", 0.0, "heat of the sun into the cabin [W], with ambient_c only")
    regen_limited: Flag = Field(
        default=False, description="whether recuperation has a power cap that falls at high charge and in the cold"
    )

    departure: NaiveDatetime | None = Field(
        default=None,
        description="local time at the roads such as 2026-11-30T08:15: limits at hours hold that hold then",
    )

    @model_validator(mode="after")
    def _cabin_needs_ambient(self) -> ConditionsSent:
        if self.ambient_c is None:
            if self.cabin_start_c is not None:
                raise refusal("cabin_start_c", self.cabin_start_c, "only together with ambient_c")
            if self.sun_w > 0.0:
                raise refusal("sun_w", self.sun_w, "only together with ambient_c")
        return self
