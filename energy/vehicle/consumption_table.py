"""A vehicle given as consumption against speed, with figures for climbs: what TomTom, HERE and Mapbox take."""

from __future__ import annotations

from dataclasses import dataclass, field
from types import MappingProxyType
from typing import TYPE_CHECKING, Final

import numpy as np

from energy.errors import VehicleError
from energy.vehicle.vehicle import CHECKED_SPEED_MPS, Powertrain

if TYPE_CHECKING:
    from collections.abc import Mapping

    from numpy.typing import NDArray

    from energy.charging.charging import Charging

MOST_J_PER_M: Final = 36_000.0  # 1000 kWh/100 km


@dataclass(frozen=True, slots=True)
class ConsumptionTableVehicle:
    """One vehicle whose battery energy over a link is

        E = c(v)·length + ascent·Δh⁺ − descent·Δh⁻ + ½·(gain of v²)·kinetic_up − ½·(loss of v²)·kinetic_down + P_aux·t

    with c piecewise linear in the speed v, constant beyond the ends of the table. Speeds change at once, where links
    meet; it has no acceleration tables.

    speed_mps: float64 (n,), rising, > 0 or ≥ 0 [m/s]. consumption_j_per_m: float64 (n,) ≥ 0 at constant speed on the
    flat, without P_aux [J/m]. ascent_j_per_m, descent_j_per_m: battery energy for each metre of height, taken climbing
    and given back descending [J/m], descent ≤ ascent. kinetic_up_kg, kinetic_down_kg: m/η taken when gaining
    and m·η given back when losing speed [kg], down ≤ up; 0 where the table is to hold everything.
    aux_power_w: P_aux at the battery [W]. usable_capacity_wh: [Wh].
    charging: which plugs fit and what power the battery takes; None where it is not known.

    Raises VehicleError when a number is out of range or a round trip would gain energy.
    """

    id: str
    name: str
    speed_mps: NDArray[np.float64]
    consumption_j_per_m: NDArray[np.float64]
    ascent_j_per_m: float
    descent_j_per_m: float
    aux_power_w: float
    usable_capacity_wh: float
    kinetic_up_kg: float = 0.0
    kinetic_down_kg: float = 0.0
    powertrain: Powertrain = Powertrain.BEV
    sources: Mapping[str, str] = field(default_factory=lambda: MappingProxyType({}))
    sd: Mapping[str, float] = field(default_factory=lambda: MappingProxyType({}))
    charging: Charging | None = None

    def __post_init__(self) -> None:
        speeds, table = self.speed_mps, self.consumption_j_per_m
        if speeds.ndim != 1 or speeds.size < 1 or table.shape != speeds.shape:
            raise VehicleError(
                "speed_mps", f"{speeds.size} and {table.size} values", "as many speeds as values", self.id
            )
        if not bool(np.all(np.isfinite(speeds) & (speeds >= 0.0) & (speeds <= 2.0 * CHECKED_SPEED_MPS))):
            raise VehicleError("speed_mps", speeds.tolist(), f"each 0..{2.0 * CHECKED_SPEED_MPS:.1f}", self.id)
        if not bool(np.all(np.diff(speeds) > 0.0)):
            raise VehicleError("speed_mps", speeds.tolist(), "rising", self.id)
        if not bool(np.all((table >= 0.0) & (table <= MOST_J_PER_M))):
            raise VehicleError("consumption_j_per_m", table.tolist(), f"each 0..{MOST_J_PER_M:g}", self.id)
        ranges = (
            ("ascent_j_per_m", 0.0, 1e7),
            ("descent_j_per_m", 0.0, self.ascent_j_per_m),
            ("aux_power_w", 0.0, 100_000.0),
            ("kinetic_up_kg", 0.0, 1e6),
            ("kinetic_down_kg", 0.0, self.kinetic_up_kg),
            ("usable_capacity_wh", 1e-3, 1e7),
        )
        for name, low, high in ranges:
            value = float(getattr(self, name))
            if not low <= value <= high:
                raise VehicleError(name, value, f"{low:g}..{high:g}", self.id)

    def consumption_at(self, speed_mps: NDArray[np.float64]) -> NDArray[np.float64]:
        """Consumption at constant speeds on the flat, without auxiliaries [J/m], of the shape given."""
        return np.asarray(np.interp(speed_mps, self.speed_mps, self.consumption_j_per_m), np.float64)
