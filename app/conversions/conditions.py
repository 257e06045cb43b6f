"""Conditions and strengths of effects from human units into energy.conditions."""

from __future__ import annotations

import math
from dataclasses import asdict, replace
from typing import TYPE_CHECKING, Any, Final, TypeVar

from app.conversions.effects import misordered
from app.schemas.conditions import DIGITS, ConditionsSent
from app.schemas.effects import CELSIUS_FIELDS, EffectsSent
from app.schemas.learned_effects import LearnedEffects
from energy.conditions import STILL, Conditions, minute_of_week
from energy.errors import ConditionsError, VehicleError
from energy.units import KMH_PER_MPS, ZERO_CELSIUS_K
from energy.vehicle.consumption_table import ConsumptionTableVehicle
from energy.vehicle.vehicle import Vehicle

if TYPE_CHECKING:
    from collections.abc import Mapping

Given = TypeVar("Given", bound=Vehicle | ConsumptionTableVehicle)

INSIDE_NAME: Final[Mapping[str, str]] = {shown: inside for inside, shown in CELSIUS_FIELDS.items()}

STRENGTHS: Final = set(EffectsSent.model_fields)


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
        departure_min=None if sent.departure is None else minute_of_week(sent.departure),
    )


def vehicle_with_effects(vehicle: Given, sent: EffectsSent | None) -> Given:
    """A vehicle whose effects are as strong as a request says; what is not sent stays the vehicle's.

    Learned effects may also have numbers in place of the vehicle's own.

    Raises ConditionsError in the request's names where all of recuperation is back at a temperature that has none,
    where such numbers do not go with the vehicle's others, and where the vehicle is a consumption table, which has
    neither.
    """
    shown = {} if sent is None else sent.model_dump(include=STRENGTHS, exclude_none=True)
    numbers: dict[str, Any] = {}
    if isinstance(sent, LearnedEffects) and sent.parameters is not None:
        numbers = sent.parameters.model_dump(exclude_none=True)
    if not shown and not numbers:
        return vehicle
    if isinstance(vehicle, ConsumptionTableVehicle):
        allowed = f"none for vehicle {vehicle.id!r}, a consumption table"
        raise ConditionsError("effects", sorted([*shown, *numbers]), allowed)
    changes: dict[str, Any] = {
        INSIDE_NAME.get(name, name): _kelvin(value) if name in INSIDE_NAME else value for name, value in shown.items()
    }
    try:
        effects = replace(vehicle.effects, **changes)
    except ConditionsError as error:  # the ranges are the schema's, so these are two temperatures in wrong order
        raise ConditionsError(*misordered(asdict(vehicle.effects) | changes)) from error
    try:
        changed = replace(vehicle, effects=effects, **numbers)
        return changed.with_residual({*numbers, *(f"effects.{name}" for name in changes)})
    except VehicleError as error:
        raise ConditionsError(f"effects.parameters.{error.field}", error.value, error.allowed) from error


def _kelvin(celsius: float) -> float:
    return round(celsius + ZERO_CELSIUS_K, DIGITS)
