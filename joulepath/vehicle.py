"""A vehicle that drives."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from energy.errors import VehicleNotFoundError
from energy.folders import bundled_folder
from energy.vehicle.files import load_vehicle, vehicle_from_mapping

if TYPE_CHECKING:
    from collections.abc import Mapping

    from energy.vehicle.files import AnyVehicle


@dataclass(frozen=True, slots=True)
class Vehicle:
    """A vehicle, by its physics or as a table of consumption; model: as the energy package has it, in SI units."""

    model: AnyVehicle

    @classmethod
    def load(cls, vehicle: str | Path) -> Vehicle:
        """A vehicle that comes with joulepath by its id, or one of your own by its TOML file (docs/vehicles.md).

        Raises VehicleNotFoundError or VehicleError.
        """
        if Path(vehicle).suffix == ".toml":
            return cls(load_vehicle(Path(vehicle)))
        known = cls.bundled()
        if str(vehicle) not in known:
            raise VehicleNotFoundError(str(vehicle), known)
        return cls(load_vehicle(_folder() / f"{vehicle}.toml"))

    @classmethod
    def from_mapping(cls, data: Mapping[str, Any]) -> Vehicle:
        """A vehicle in the terms of a TOML file; raises VehicleError."""
        return cls(vehicle_from_mapping(data))

    @staticmethod
    def bundled() -> tuple[str, ...]:
        """Ids of the vehicles that come with joulepath."""
        return tuple(sorted(file.stem for file in _folder().glob("*.toml")))

    @property
    def id(self) -> str:
        """Its id."""
        return self.model.id

    @property
    def name(self) -> str:
        """Its name."""
        return self.model.name

    @property
    def usable_capacity_kwh(self) -> float:
        """Energy between a charge of 0 and 1."""
        return self.model.usable_capacity_wh / 1000.0

    def __repr__(self) -> str:
        return f"<Vehicle {self.id!r}: {self.name}, {self.usable_capacity_kwh:g} kWh>"


def _folder() -> Path:
    return bundled_folder("data", "vehicles")
