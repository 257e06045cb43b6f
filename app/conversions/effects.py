"""Effect coefficients between human units and energy.conditions."""

from __future__ import annotations

from dataclasses import fields
from typing import Final

from app.schemas.effects import CELSIUS_FIELDS, TEMPERATURE_DIGITS, EffectsSent
from energy.conditions import ZERO_CELSIUS_K, EffectCoefficients
from energy.errors import ConditionsError, VehicleError

COEFFICIENTS: Final = tuple(field.name for field in fields(EffectCoefficients))


def effects_from_sent(sent: EffectsSent | None) -> EffectCoefficients:
    """Coefficients in SI units, defaults where nothing is sent; raises VehicleError with the names of the schema."""
    values: dict[str, float] = {}
    for name in COEFFICIENTS:
        value = getattr(sent, schema_name(name), None)
        if value is not None:
            values[name] = _moved(value, ZERO_CELSIUS_K) if name in CELSIUS_FIELDS else value
    try:
        return EffectCoefficients(**values)
    except ConditionsError as error:  # the ranges are the schema's, so these are the two temperatures in wrong order
        full_k = values.get("regen_cold_full_k", EffectCoefficients().regen_cold_full_k)
        none_k = values.get("regen_cold_none_k", EffectCoefficients().regen_cold_none_k)
        allowed = f"below regen_cold_full_c, {_moved(full_k, -ZERO_CELSIUS_K):g}"
        raise VehicleError("effects.regen_cold_none_c", _moved(none_k, -ZERO_CELSIUS_K), allowed) from error


def effects_answer(effects: EffectCoefficients) -> EffectsSent:
    """All coefficients in human units."""
    values = {name: getattr(effects, name) for name in COEFFICIENTS}
    for name in CELSIUS_FIELDS:
        values[name] = _moved(values[name], -ZERO_CELSIUS_K)
    return EffectsSent(**{schema_name(name): value for name, value in values.items()})


def schema_name(name: str) -> str:
    """The schema's name of a field of EffectCoefficients."""
    return CELSIUS_FIELDS.get(name, name)


def _moved(value: float, by: float) -> float:
    return round(value + by, TEMPERATURE_DIGITS)
