"""A vehicle that takes more, or less, by a factor on all that it dissipates."""

from __future__ import annotations

from dataclasses import replace
from typing import Final

import numpy as np

from energy.errors import ConditionsError
from energy.vehicle.coefficients import COEFFICIENT_RANGES
from energy.vehicle.consumption_table import MOST_J_PER_M, ConsumptionTableVehicle
from energy.vehicle.vehicle import Vehicle

FACTOR_RANGE: Final = (0.05, 20.0)
MOST_AUX_W: Final = 100_000.0


def pessimistic(vehicle: Vehicle | ConsumptionTableVehicle, factor: float) -> Vehicle | ConsumptionTableVehicle:
    """The vehicle with all that it dissipates scaled by a factor, 0.05..20; below 1 an optimistic one.

    Scaled are A, B and C, P_aux, the losses 1/η_dis − 1 and 1 − η_chg, climate, battery resistance and what wet or
    snowy roads add; of a consumption table its values, P_aux, and how much more heights and speeds take than they give
    back. Values stop at the ends of their ranges: recuperation at 0, a COP at 0.5. The energy of any link grows with
    the factor, and 1 gives the vehicle itself. The dissipated energy follows the factor to within a few per cent of the
    change: losses act on a road load that has changed as well, and a car of more resistance recuperates less and so
    loses less in doing so. Powers that conditions name in watts stay.

    Raises ConditionsError for a factor out of range.
    """
    low, high = FACTOR_RANGE
    if not low <= factor <= high:
        raise ConditionsError("factor", factor, f"{low:g}..{high:g}")
    if factor == 1.0:
        return vehicle
    aux_power_w = min(vehicle.aux_power_w * factor, MOST_AUX_W)
    if isinstance(vehicle, ConsumptionTableVehicle):
        up_j_per_m, down_j_per_m = _parted(vehicle.ascent_j_per_m, vehicle.descent_j_per_m, factor)
        up_kg, down_kg = _parted(vehicle.kinetic_up_kg, vehicle.kinetic_down_kg, factor)
        return replace(
            vehicle,
            consumption_j_per_m=np.minimum(vehicle.consumption_j_per_m * factor, MOST_J_PER_M),
            ascent_j_per_m=up_j_per_m,
            descent_j_per_m=down_j_per_m,
            kinetic_up_kg=up_kg,
            kinetic_down_kg=down_kg,
            aux_power_w=aux_power_w,
        )
    effects = {name: getattr(vehicle.effects, name) * factor for name in _SCALED_EFFECTS}
    effects |= {name: getattr(vehicle.effects, name) / factor for name in _DIVIDED_EFFECTS}
    for name, value in effects.items():
        low, high = COEFFICIENT_RANGES[name]
        effects[name] = min(max(value, low), high)
    return replace(
        vehicle,
        road_load_a_n=vehicle.road_load_a_n * factor,
        road_load_b_n_per_mps=vehicle.road_load_b_n_per_mps * factor,
        road_load_c_n_per_mps2=vehicle.road_load_c_n_per_mps2 * factor,
        drive_eff=1.0 / (1.0 + factor * (1.0 / vehicle.drive_eff - 1.0)),
        recuperation_eff=max(1.0 - factor * (1.0 - vehicle.recuperation_eff), 0.0),
        aux_power_w=aux_power_w,
        effects=replace(vehicle.effects, **effects),
    )


_SCALED_EFFECTS: Final = (
    "wet_rolling_coef",
    "wet_drag_n_per_mps",
    "snow_rolling_coef",
    "climate_fan_w",
    "climate_limit_w",
    "aux_climate_w",
    "battery_resistance_ohm",
    "drive_loss_w_per_n2",
)
_DIVIDED_EFFECTS: Final = ("heating_cop", "cooling_cop")


def _parted(taken: float, given: float, factor: float) -> tuple[float, float]:
    """What is taken and given back, their difference scaled about the middle, nothing below 0."""
    middle, half = 0.5 * (taken + given), 0.5 * factor * (taken - given)
    return middle + half, max(middle - half, 0.0)
