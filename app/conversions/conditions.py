"""Conditions and strengths of effects from human units into energy.conditions."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING, Final, TypeVar

from app.schemas.conditions import DIGITS, ConditionsSent
from app.schemas.effects import CELSIUS_FIELDS, EffectsSent
from energy.conditions import STILL, ZERO_CELSIUS_K, Conditions
from energy.consumption_table import ConsumptionTableVehicle
from energy.errors import ConditionsError
from energy.vehicle import KMH_PER_MPS, Vehicle

if TYPE_CHECKING:
    from collections.abc import Mapping

Given = TypeVar("Given", bound=Vehicle | ConsumptionTableVehicle)

INSIDE_NAME: Final[Mapping[str, str]] = {shown: inside for inside, shown in CELSIUS_FIELDS.items()}


def conditions_from(sent: ConditionsSent | None) -> Conditions:
    """The conditions that a request describes; without any, those of the source."""
    if sent is None:
        return STILL
    return Conditions(
        ambient_k=None if sent.ambient_c is None else _kelvin(sent.ambient_c),
        cabin_start_k=None if sent.cabin_start_c is None else _kelvin(sent.cabin_start_c),
        climate=sent.climate,
        altitude_density=sent.altitude_density,
        wind_speed_mps=sent.wind_speed_mps,
        wind_from_rad=math.radians(sent.wind_from_deg),
        payload_kg=sent.payload_kg,
        drag_factor=sent.drag_factor,
        road=sent.road,
        speed_factor=sent.speed_factor,
        top_speed_mps=None if sent.top_speed_kmh is None else sent.top_speed_kmh / KMH_PER_MPS,
        aux_power_w=sent.aux_power_w,
        sun_w=sent.sun_w,
        regen_limited=sent.regen_limited,
    )


def vehicle_with_effects(vehicle: Given, sent: EffectsSent | None) -> Given:
    """A vehicle whose effects are as strong as a request says; what is not sent stays the vehicle's.

    Raises ConditionsError in the request's names where all of recuperation is back at a temperature that has none, and
    where the vehicle is a consumption table, which has no effects.
    """
    shown = {} if sent is None else sent.model_dump(exclude_none=True)
    if not shown:
        return vehicle
    if isinstance(vehicle, ConsumptionTableVehicle):
        raise ConditionsError("effects", sorted(shown), f"none for vehicle {vehicle.id!r}, a consumption table")
    changes = {
        INSIDE_NAME.get(name, name): _kelvin(value) if name in INSIDE_NAME else value for name, value in shown.items()
    }
    full_k = changes.get("regen_cold_full_k", vehicle.effects.regen_cold_full_k)
    none_k = changes.get("regen_cold_none_k", vehicle.effects.regen_cold_none_k)
    if none_k >= full_k:
        allowed = f"below regen_cold_full_c, {round(full_k - ZERO_CELSIUS_K, DIGITS):g}"
        raise ConditionsError("effects.regen_cold_none_c", round(none_k - ZERO_CELSIUS_K, DIGITS), allowed)
    return replace(vehicle, effects=replace(vehicle.effects, **changes))


def _kelvin(celsius: float) -> float:
    return round(celsius + ZERO_CELSIUS_K, DIGITS)
