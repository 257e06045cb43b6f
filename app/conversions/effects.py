"""Effect coefficients between human units and energy.conditions."""

from __future__ import annotations

from dataclasses import fields
from typing import TYPE_CHECKING, Any, Final

from app.schemas.effects import CELSIUS_FIELDS, TEMPERATURE_DIGITS, EffectsSent
from energy.errors import ConditionsError, VehicleError
from energy.units import ZERO_CELSIUS_K
from energy.vehicle.coefficients import EffectCoefficients

if TYPE_CHECKING:
    from collections.abc import Mapping

COEFFICIENTS: Final = tuple(field.name for field in fields(EffectCoefficients))


def effects_from_sent(sent: EffectsSent | None) -> EffectCoefficients:
    """Coefficients in SI units, defaults where nothing is sent; raises VehicleError with the names of the schema."""
    values: dict[str, Any] = {}
    for name in COEFFICIENTS:
        value = getattr(sent, schema_name(name), None)
        if value is not None:
            values[name] = _moved(value, ZERO_CELSIUS_K) if name in CELSIUS_FIELDS else value
    try:
        return EffectCoefficients(**values)
    except ConditionsError as error:  # the ranges are the schema's, so these are two temperatures in wrong order
        field, value, allowed = misordered(
            {name: getattr(EffectCoefficients(), name) for name in COEFFICIENTS} | values
        )
        raise VehicleError(field, value, allowed) from error


def misordered(values: Mapping[str, Any]) -> tuple[str, float, str]:
    """Field, value and allowed range, as requests name them, of coefficients with two temperatures in wrong order."""
    name, bound = "regen_cold_none_k", "regen_cold_full_k"
    order = "below"
    if values[name] < values[bound]:
        name, bound, order = "cooling_target_k", "cabin_target_k", "at least"
    allowed = f"{order} {schema_name(bound)}, {_moved(values[bound], -ZERO_CELSIUS_K):g}"
    return f"effects.{schema_name(name)}", _moved(values[name], -ZERO_CELSIUS_K), allowed


def effects_answer(effects: EffectCoefficients) -> EffectsSent:
    """All coefficients in human units."""
    values = {name: getattr(effects, name) for name in COEFFICIENTS}
    for name in CELSIUS_FIELDS:
        if values[name] is not None:
            values[name] = _moved(values[name], -ZERO_CELSIUS_K)
    return EffectsSent(**{schema_name(name): value for name, value in values.items()})


def schema_name(name: str) -> str:
    """The schema's name of a field of EffectCoefficients."""
    return CELSIUS_FIELDS.get(name, name)


def _moved(value: float, by: float) -> float:
    return round(value + by, TEMPERATURE_DIGITS)
