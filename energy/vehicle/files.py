"""Vehicles read from TOML files in human units, each number with its source, converted once to SI."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Mapping
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from energy.errors import ConditionsError, VehicleError
from energy.units import KMH_PER_MPS
from energy.vehicle.charging_section import charging_from_section
from energy.vehicle.coefficients import EffectCoefficients
from energy.vehicle.consumption_table import ConsumptionTableVehicle
from energy.vehicle.published import Published, published_from_section
from energy.vehicle.sections import (
    CONSUMPTION,
    EFFECTS,
    ROAD_LOAD_LISTS,
    ROAD_LOAD_NUMBERS,
    TABLE_NUMBERS,
    SectionValue,
    array_of,
    number_of,
    numbers_in,
    powertrain_in,
    section_value,
    text_in,
)
from energy.vehicle.vehicle import Vehicle

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import NDArray

    from energy.charging.charging import Charging


AnyVehicle = Vehicle | ConsumptionTableVehicle

_ROAD_LOAD_KIND: Final = "road-load"
_TABLE_KIND: Final = "consumption-table"
_KINDS: Final = (_ROAD_LOAD_KIND, _TABLE_KIND)
_ID: Final = re.compile(r"[a-z0-9]+(-[a-z0-9]+)*")
_HEAD: Final = ("id", "name", "powertrain", "kind")
_FURTHER: Final = ("charging", "published")
_SECTIONS: Final = (*_HEAD, *(q.section for q in ROAD_LOAD_NUMBERS + ROAD_LOAD_LISTS + EFFECTS), *_FURTHER)
_KINETIC: Final = ("mass_kg", "acceleration_eff", "deceleration_eff")
_TABLE_SECTIONS: Final = (*_HEAD, "consumption", *(q.section for q in TABLE_NUMBERS), "kinetic", *_FURTHER)


class VehicleFileError(VehicleError):
    """A vehicle file that can't be a vehicle: names the file beside the field, its value and what is allowed."""

    def __init__(self, path: str, field: str, value: object, allowed: str, vehicle_id: str = "") -> None:
        super().__init__(field, value, allowed, vehicle_id)
        self.path = path
        self.args = (f"{path}: {self.args[0]}",)


def load_vehicle(path: Path) -> AnyVehicle:
    """The vehicle in one TOML file, whose name is the vehicle's id.

    Raises VehicleFileError naming the file, the field and what is allowed there.
    """
    data = _load(path)
    try:
        vehicle = vehicle_from_mapping(data)
    except VehicleError as error:
        raise VehicleFileError(str(path), error.field, error.value, error.allowed, error.vehicle_id) from error
    if vehicle.id != path.stem:
        raise VehicleFileError(str(path), "id", repr(vehicle.id), f"the file's own name, {path.stem!r}")
    return vehicle


def load_vehicles(folder: Path) -> dict[str, AnyVehicle]:
    """All vehicles of a folder's `*.toml` files by id, in the order of their ids.

    Raises VehicleFileError when the folder is missing, has no such file, or a file is broken.
    """
    if not folder.is_dir():
        raise VehicleFileError(str(folder), "folder", "missing", "a folder of vehicle files")
    vehicles = {vehicle.id: vehicle for vehicle in map(load_vehicle, folder.glob("*.toml"))}
    if not vehicles:
        raise VehicleFileError(str(folder), "folder", "without a *.toml file", "at least one vehicle file")
    return dict(sorted(vehicles.items()))


def load_published(path: Path) -> Published | None:
    """What one vehicle file says is published of the vehicle's consumption; None where it has no such section.

    Raises VehicleFileError naming the file, the field and what is allowed there.
    """
    data = _load(path)
    if "published" not in data:
        return None
    try:
        return published_from_section(data["published"], path.stem)
    except VehicleError as error:
        raise VehicleFileError(str(path), error.field, error.value, error.allowed, error.vehicle_id) from error


def _load(path: Path) -> dict[str, object]:
    try:
        return tomllib.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise VehicleFileError(str(path), "file", error.strerror, "a readable file") from error
    except UnicodeDecodeError as error:
        raise VehicleFileError(str(path), "file", f"not UTF-8 at byte {error.start}", "a TOML file in UTF-8") from error
    except tomllib.TOMLDecodeError as error:
        raise VehicleFileError(str(path), "file", f"not TOML ({error})", "a TOML file") from error


def vehicle_from_mapping(data: Mapping[str, object]) -> AnyVehicle:
    """The vehicle that a parsed vehicle file describes, in SI units, with the source of each number by field name.

    data: as docs/vehicles.md describes: `id`, `name`, `powertrain`, `kind` and one section a quantity with exactly one
    `value_<unit>`, a `source` and perhaps `sd_<unit>`. Sources and standard deviations of effect coefficients are kept
    as `effects.<field>`.

    Raises VehicleError on an unknown or missing key, a wrong type, or a number that the vehicle refuses.
    """
    vehicle_id = text_in(data, "id", "")
    if _ID.fullmatch(vehicle_id) is None:
        raise VehicleError("id", repr(vehicle_id), "lower-case letters and digits, joined by single hyphens")
    kind = data.get("kind", _ROAD_LOAD_KIND)
    if kind not in _KINDS:
        raise VehicleError("kind", repr(kind), f"one of {', '.join(_KINDS)}", vehicle_id)
    sections = _TABLE_SECTIONS if kind == _TABLE_KIND else _SECTIONS
    for key in data:
        if key not in sections:
            raise VehicleError(key, "unknown", f"one of {', '.join(sections)}", vehicle_id)
    if "published" in data:
        published_from_section(data["published"], vehicle_id)
    return _table_vehicle(data, vehicle_id) if kind == _TABLE_KIND else _road_load_vehicle(data, vehicle_id)


def _road_load_vehicle(data: Mapping[str, object], vehicle_id: str) -> Vehicle:
    name = text_in(data, "name", vehicle_id)
    powertrain = powertrain_in(data, vehicle_id)
    tables: dict[str, NDArray[np.float64]] = {}
    numbers, sources, sd = numbers_in(data, ROAD_LOAD_NUMBERS, vehicle_id)
    for quantity in ROAD_LOAD_LISTS:
        read = section_value(data, quantity, vehicle_id)
        tables[quantity.field] = array_of(read, vehicle_id)
        sources[quantity.field] = read.source
    given = [quantity for quantity in EFFECTS if quantity.section in data]
    numbers_of_effects, effect_sources, effect_sd = numbers_in(data, given, vehicle_id)
    coefficients: dict[str, Any] = dict(numbers_of_effects)
    sources |= {f"effects.{key}": source for key, source in effect_sources.items()}
    sd |= {f"effects.{key}": value for key, value in effect_sd.items()}
    try:
        effects = EffectCoefficients(**coefficients)
    except ConditionsError as error:
        raise VehicleError(error.field, error.value, error.allowed, vehicle_id) from error
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
        sd=MappingProxyType(sd),
        effects=effects,
        charging=_charging(data, vehicle_id),
    )


def _table_vehicle(data: Mapping[str, object], vehicle_id: str) -> ConsumptionTableVehicle:
    name = text_in(data, "name", vehicle_id)
    powertrain = powertrain_in(data, vehicle_id)
    read = section_value(data, CONSUMPTION, vehicle_id, ("speed_kmh",))
    section = data["consumption"]
    if not isinstance(section, Mapping) or "speed_kmh" not in section:
        raise VehicleError("consumption.speed_kmh", "missing", "a list of numbers", vehicle_id)
    speed = SectionValue(section["speed_kmh"], "consumption.speed_kmh", 1.0 / KMH_PER_MPS, 0.0, None, read.source)
    numbers, sources, sd = numbers_in(data, TABLE_NUMBERS, vehicle_id)
    kinetic_up_kg = kinetic_down_kg = 0.0
    if "kinetic" in data:
        kinetic_up_kg, kinetic_down_kg, source = _kinetic(data["kinetic"], vehicle_id)
        sources |= {"kinetic_up_kg": source, "kinetic_down_kg": source}
    return ConsumptionTableVehicle(
        id=vehicle_id,
        name=name,
        powertrain=powertrain,
        speed_mps=array_of(speed, vehicle_id),
        consumption_j_per_m=array_of(read, vehicle_id),
        ascent_j_per_m=numbers["ascent_j_per_m"],
        descent_j_per_m=numbers["descent_j_per_m"],
        aux_power_w=numbers["aux_power_w"],
        usable_capacity_wh=numbers["usable_capacity_wh"],
        kinetic_up_kg=kinetic_up_kg,
        kinetic_down_kg=kinetic_down_kg,
        sources=MappingProxyType({"speed_mps": read.source, "consumption_j_per_m": read.source, **sources}),
        sd=MappingProxyType(sd),
        charging=_charging(data, vehicle_id),
    )


def _charging(data: Mapping[str, object], vehicle_id: str) -> Charging | None:
    return charging_from_section(data["charging"], vehicle_id) if "charging" in data else None


def _kinetic(section: object, vehicle_id: str) -> tuple[float, float, str]:
    """m/η of gaining speed and m·η of losing it [kg], and their source."""
    keys = f"{', '.join(_KINETIC)}, and source"
    if not isinstance(section, Mapping):
        raise VehicleError("kinetic", section, f"a section with {keys}", vehicle_id)
    for key in section:
        if key not in _KINETIC and key != "source":
            raise VehicleError(f"kinetic.{key}", "unknown", keys, vehicle_id)
    numbers: list[float] = []
    for key, most in zip(_KINETIC, (100_000.0, 1.0, 1.0), strict=True):
        value = number_of(section.get(key), f"kinetic.{key}", vehicle_id)
        if not 0.0 < value <= most:
            raise VehicleError(f"kinetic.{key}", value, f"(0, {most:g}]", vehicle_id)
        numbers.append(value)
    mass_kg, acceleration_eff, deceleration_eff = numbers
    return mass_kg / acceleration_eff, mass_kg * deceleration_eff, text_in(section, "source", vehicle_id, "kinetic.")
