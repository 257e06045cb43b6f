"""Battery energy by cause: the parts that add up to the whole."""

from __future__ import annotations

from dataclasses import field, fields, make_dataclass
from enum import StrEnum
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from energy.force import kernels_parts as columns

if TYPE_CHECKING:
    from numpy.typing import NDArray


class Part(StrEnum):
    """A cause of battery energy, in the order of answers: its name there, the kernels' column of it, what it is.

    The only enumeration of the causes: fields of results and schemas come from it, in its order. The first
    SOURCE_PART_COUNT are the source's model: work against road load, grade and inertia at the wheels, losses of
    drivetrain and recuperation, auxiliaries. The rest is what conditions add, each 0 while its effect is off, and
    all that a vehicle given as a table takes on the flat. A part without a column is split off others.
    """

    idx: int  # where it is in arrays of all parts
    column: int | None
    meaning: str

    def __new__(cls, name: str, column: int | None, meaning: str) -> Part:
        """A member whose value is the name."""
        part = str.__new__(cls, name)
        part._value_ = name
        part.idx = len(cls.__members__)
        part.column = column
        part.meaning = meaning
        return part

    ROLLING = "rolling", columns.ROLLING, "rolling resistance of the vehicle itself, at the wheels"
    LINEAR = "linear", columns.LINEAR, "part of the road load that grows with speed, at the wheels"
    AERO = "aero", columns.AERO, "drag of the vehicle itself in still air of the reference density, at the wheels"
    GRADE = "grade", columns.GRADE, "climbing, negative downhill, at the wheels"
    INERTIA = "inertia", columns.INERTIA, "gaining speed, negative when losing it, at the wheels"
    DRIVETRAIN_LOSS = "drivetrain_loss", columns.DRIVETRAIN_LOSS, "between battery and wheels when driving"
    RECUPERATION_LOSS = "recuperation_loss", columns.RECUPERATION_LOSS, "what braking does not bring back"
    AUXILIARY = "auxiliary", columns.AUXILIARY, "on-board supply"
    TYRE_TEMPERATURE = "tyre_temperature", None, "effect: rolling resistance of tyres colder or warmer than 20 °C"
    ROAD_SURFACE = "road_surface", None, "effect: water or snow on the road"
    PAYLOAD = "payload", None, "effect: load beyond the vehicle's mass, rolling, climbing and inertia"
    AIR_DENSITY = "air_density", None, "effect: air denser or thinner than at 20 °C and 100 kPa"
    DRAG = "drag", None, "effect: roof load, and air flow from the side"
    WIND = "wind", columns.WIND, "effect: wind against or with the vehicle"
    REGEN_LIMIT = "regen_limit", columns.REGEN_LIMIT, "effect: recuperation beyond its cap, left to the friction brakes"
    LOAD_LOSS = "load_loss", columns.LOAD_LOSS, "effect: drivetrain loss that grows with the square of the force"
    BATTERY_RESISTANCE = (
        "battery_resistance",
        columns.BATTERY_RESISTANCE,
        "effect: heat in a battery colder than its reference",
    )
    CABIN = "cabin", columns.CABIN, "effect: heating or cooling the cabin"
    TYRE_WARM_UP = (
        "tyre_warm_up",
        columns.TYRE_WARM_UP,
        "effect: rolling resistance of tyres that are not yet warm from driving",
    )
    CONSUMPTION_TABLE = (
        "consumption_table",
        columns.CONSUMPTION_TABLE,
        "all that a vehicle given as a consumption table takes on the flat",
    )


PART_NAMES: Final = tuple(part.value for part in Part)
SOURCE_PART_COUNT: Final = Part.AUXILIARY.idx + 1

_FieldsByPart: Any = make_dataclass(
    "_FieldsByPart", [(f"{name}_j", float, field(default=0.0)) for name in PART_NAMES], frozen=True, slots=True
)


class EnergyParts(_FieldsByPart):  # type: ignore[misc]  # its fields are those of Part
    """Battery energy by cause [J], a field `<part>_j` for each Part in their order; the parts add up to the whole."""

    __slots__ = ()

    def total_j(self) -> float:
        """Sum of all parts [J]."""
        return sum(float(getattr(self, field.name)) for field in fields(self))


def energy_parts(parts_j: NDArray[np.float64]) -> EnergyParts:
    """Energy by cause from an array (20,) in the order of Part [J]."""
    return EnergyParts(**{f"{name}_j": value for name, value in zip(PART_NAMES, parts_j.tolist(), strict=True)})
