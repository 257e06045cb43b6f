"""Vehicles read from TOML files in human units, each number with its source, converted once to SI."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import TYPE_CHECKING, Final

import numpy as np

from energy.errors import VehicleError
from energy.vehicle import KMH_PER_MPS, Powertrain, Vehicle

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import NDArray

NEWTON_PER_LBF: Final = 4.4482216152605  # exact: 0.45359237 kg · 9.80665 m/s²
MPS_PER_MPH: Final = 0.44704  # exact: 1609.344 m / 3600 s
KG_PER_LB: Final = 0.45359237  # exact

_ID: Final = re.compile(r"[a-z0-9]+(-[a-z0-9]+)*")
_MASS_UNITS: Final = {"kg": 1.0, "lb": KG_PER_LB}
_ROAD_LOAD_A_UNITS: Final = {"n": 1.0, "lbf": NEWTON_PER_LBF}
_ROAD_LOAD_B_UNITS: Final = {
    "n_per_kmh": KMH_PER_MPS,
    "lbf_per_mph": NEWTON_PER_LBF / MPS_PER_MPH,
    "n_per_mps": 1.0,
}
_ROAD_LOAD_C_UNITS: Final = {
    "n_per_kmh2": KMH_PER_MPS**2,
    "lbf_per_mph2": NEWTON_PER_LBF / MPS_PER_MPH**2,
    "n_per_mps2": 1.0,
}


@dataclass(frozen=True, slots=True)
class _Quantity:
    """A section of a vehicle file: the Vehicle field it fills and the factor of each unit to that field's unit."""

    section: str
    field: str
    factors: Mapping[str, float]


_NUMBERS: Final = (
    _Quantity("mass", "mass_kg", _MASS_UNITS),
    _Quantity("rotating_mass", "rotating_mass_coef", {"coef": 1.0}),
    _Quantity("road_load_a", "road_load_a_n", _ROAD_LOAD_A_UNITS),
    _Quantity("road_load_b", "road_load_b_n_per_mps", _ROAD_LOAD_B_UNITS),
    _Quantity("road_load_c", "road_load_c_n_per_mps2", _ROAD_LOAD_C_UNITS),
    _Quantity("drive_efficiency", "drive_eff", {"eff": 1.0}),
    _Quantity("recuperation_efficiency", "recuperation_eff", {"eff": 1.0}),
    _Quantity("aux_power", "aux_power_w", {"w": 1.0}),
    _Quantity("aux_efficiency_moving", "aux_move_eff", {"eff": 1.0}),
    _Quantity("aux_efficiency_idle", "aux_idle_eff", {"eff": 1.0}),
    _Quantity("usable_capacity", "usable_capacity_wh", {"kwh": 1000.0}),
)
_TABLES: Final = (
    _Quantity("accel_speed", "accel_speed_mps", {"kmh": 1.0 / KMH_PER_MPS}),
    _Quantity("acceleration", "accel_mps2", {"mps2": 1.0}),
    _Quantity("deceleration", "decel_mps2", {"mps2": 1.0}),
)
_SECTIONS: Final = ("id", "name", "powertrain", *(quantity.section for quantity in _NUMBERS + _TABLES))


class VehicleFileError(VehicleError):
    """A vehicle file that can't be a vehicle: names the file beside the field, its value and what is allowed."""

    def __init__(self, path: str, field: str, value: object, allowed: str, vehicle_id: str = "") -> None:
        super().__init__(field, value, allowed, vehicle_id)
        self.path = path
        self.args = (f"{path}: {self.args[0]}",)


def load_vehicle(path: Path) -> Vehicle:
    """The vehicle in one TOML file, whose name is the vehicle's id.

    Raises VehicleFileError naming the file, the field and what is allowed there.
    """
    try:
        data = tomllib.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise VehicleFileError(str(path), "file", error.strerror, "a readable file") from error
    except UnicodeDecodeError as error:
        raise VehicleFileError(str(path), "file", f"not UTF-8 at byte {error.start}", "a TOML file in UTF-8") from error
    except tomllib.TOMLDecodeError as error:
        raise VehicleFileError(str(path), "file", f"not TOML ({error})", "a TOML file") from error
    try:
        vehicle = vehicle_from_mapping(data)
    except VehicleError as error:
        raise VehicleFileError(str(path), error.field, error.value, error.allowed, error.vehicle_id) from error
    if vehicle.id != path.stem:
        raise VehicleFileError(str(path), "id", repr(vehicle.id), f"the file's own name, {path.stem!r}")
    return vehicle


def load_vehicles(folder: Path) -> dict[str, Vehicle]:
    """All vehicles of a folder's `*.toml` files by id, in the order of their ids.

    Raises VehicleFileError when the folder is missing, has no such file, or a file is broken.
    """
    if not folder.is_dir():
        raise VehicleFileError(str(folder), "folder", "missing", "a folder of vehicle files")
    vehicles = {vehicle.id: vehicle for vehicle in map(load_vehicle, folder.glob("*.toml"))}
    if not vehicles:
        raise VehicleFileError(str(folder), "folder", "without a *.toml file", "at least one vehicle file")
    return dict(sorted(vehicles.items()))


def vehicle_from_mapping(data: Mapping[str, object]) -> Vehicle:
    """The vehicle that a parsed vehicle file describes, in SI units, with the source of each number by field name.

    data: as docs/vehicles.md describes: `id`, `name`, `powertrain`, and one section a quantity with exactly one
    `value_<unit>` and a `source`.

    Raises VehicleError on an unknown or missing key, a wrong type, or a number that `Vehicle` refuses.
    """
    vehicle_id = _text(data, "id", "")
    if _ID.fullmatch(vehicle_id) is None:
        raise VehicleError("id", repr(vehicle_id), "lower-case letters and digits, joined by single hyphens")
    for key in data:
        if key not in _SECTIONS:
            raise VehicleError(key, "unknown", f"one of {', '.join(_SECTIONS)}", vehicle_id)
    name = _text(data, "name", vehicle_id)
    powertrain = _powertrain(data, vehicle_id)
    numbers: dict[str, float] = {}
    tables: dict[str, NDArray[np.float64]] = {}
    sources: dict[str, str] = {}
    for quantity in _NUMBERS:
        value, where, factor, sources[quantity.field] = _value(data, quantity, vehicle_id)
        numbers[quantity.field] = _number(value, where, vehicle_id) * factor
    for quantity in _TABLES:
        value, where, factor, sources[quantity.field] = _value(data, quantity, vehicle_id)
        tables[quantity.field] = _array(value, where, vehicle_id) * factor
        tables[quantity.field].flags.writeable = False
    return Vehicle(
        id=vehicle_id,
        name=name,
        powertrain=powertrain,
        mass_kg=numbers["mass_kg"],
        rotating_mass_coef=numbers["rotating_mass_coef"],
        road_load_a_n=numbers["road_load_a_n"],
        road_load_b_n_per_mps=numbers["road_load_b_n_per_mps"],
        road_load_c_n_per_mps2=numbers["road_load_c_n_per_mps2"],
        drive_eff=numbers["drive_eff"],
        recuperation_eff=numbers["recuperation_eff"],
        aux_power_w=numbers["aux_power_w"],
        aux_move_eff=numbers["aux_move_eff"],
        aux_idle_eff=numbers["aux_idle_eff"],
        usable_capacity_wh=numbers["usable_capacity_wh"],
        accel_speed_mps=tables["accel_speed_mps"],
        accel_mps2=tables["accel_mps2"],
        decel_mps2=tables["decel_mps2"],
        sources=MappingProxyType(sources),
    )


def _text(section: Mapping[str, object], key: str, vehicle_id: str, prefix: str = "") -> str:
    if key not in section:
        raise VehicleError(prefix + key, "missing", "a text", vehicle_id)
    value = section[key]
    if not isinstance(value, str) or not value.strip():
        raise VehicleError(prefix + key, repr(value), "a text that is not empty", vehicle_id)
    return value.strip()


def _powertrain(data: Mapping[str, object], vehicle_id: str) -> Powertrain:
    value = _text(data, "powertrain", vehicle_id)
    try:
        return Powertrain(value)
    except ValueError:
        allowed = f"one of {', '.join(Powertrain)}"
        raise VehicleError("powertrain", repr(value), allowed, vehicle_id) from None


def _value(data: Mapping[str, object], quantity: _Quantity, vehicle_id: str) -> tuple[object, str, float, str]:
    """Raw value of a section, its dotted name, the factor to the field's unit, and its source."""
    keys = {f"value_{unit}": factor for unit, factor in quantity.factors.items()}
    choice = " or ".join(keys)
    section = data.get(quantity.section, "missing")
    if not isinstance(section, Mapping):
        raise VehicleError(quantity.section, section, f"a section with {choice}, and source", vehicle_id)
    for key in section:
        if key not in keys and key != "source":
            raise VehicleError(f"{quantity.section}.{key}", "unknown", f"{choice}, and source", vehicle_id)
    given = [key for key in keys if key in section]
    if len(given) != 1:
        found = " and ".join(given) if given else "missing"
        raise VehicleError(f"{quantity.section}.value", found, f"exactly one of {choice}", vehicle_id)
    source = _text(section, "source", vehicle_id, f"{quantity.section}.")
    return section[given[0]], f"{quantity.section}.{given[0]}", keys[given[0]], source


def _number(value: object, where: str, vehicle_id: str) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise VehicleError(where, repr(value), "a number", vehicle_id)
    return float(value)


def _array(value: object, where: str, vehicle_id: str) -> NDArray[np.float64]:
    if not isinstance(value, list):
        raise VehicleError(where, repr(value), "a list of numbers", vehicle_id)
    return np.array([_number(item, f"{where}[{k}]", vehicle_id) for k, item in enumerate(value)], dtype=np.float64)
