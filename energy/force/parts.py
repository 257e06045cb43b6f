"""Battery energy by cause: the parts that add up to the whole."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import TYPE_CHECKING, Final

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray


PART_NAMES: Final = (
    "rolling",
    "linear",
    "aero",
    "grade",
    "inertia",
    "drivetrain_loss",
    "recuperation_loss",
    "auxiliary",
    "tyre_temperature",
    "road_surface",
    "payload",
    "air_density",
    "drag",
    "wind",
    "regen_limit",
    "load_loss",
    "battery_resistance",
    "cabin",
    "tyre_warm_up",
    "consumption_table",
)


@dataclass(frozen=True, slots=True)
class EnergyParts:
    """Battery energy by cause [J], fields in the order of PART_NAMES; the parts add up to the whole.

    The first eight are the source's model: work against road load, grade and inertia at the wheels, losses of
    drivetrain and recuperation, auxiliaries. The rest is what conditions add, each 0 while its effect is off;
    consumption_table_j is all that a vehicle given as a table takes on the flat.
    """

    rolling_j: float = 0.0
    linear_j: float = 0.0
    aero_j: float = 0.0
    grade_j: float = 0.0
    inertia_j: float = 0.0
    drivetrain_loss_j: float = 0.0
    recuperation_loss_j: float = 0.0
    auxiliary_j: float = 0.0
    tyre_temperature_j: float = 0.0
    road_surface_j: float = 0.0
    payload_j: float = 0.0
    air_density_j: float = 0.0
    drag_j: float = 0.0
    wind_j: float = 0.0
    regen_limit_j: float = 0.0
    load_loss_j: float = 0.0
    battery_resistance_j: float = 0.0
    cabin_j: float = 0.0
    tyre_warm_up_j: float = 0.0
    consumption_table_j: float = 0.0

    def total_j(self) -> float:
        """Sum of all parts [J]."""
        return sum(float(getattr(self, field.name)) for field in fields(self))


def energy_parts(parts_j: NDArray[np.float64]) -> EnergyParts:
    """Energy by cause from an array (20,) in the order of PART_NAMES [J]."""
    return EnergyParts(**{f"{name}_j": float(value) for name, value in zip(PART_NAMES, parts_j, strict=True)})
