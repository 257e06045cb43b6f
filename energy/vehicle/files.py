"""Vehicles read from TOML files in human units, each number with its source, converted once to SI."""

from __future__ import annotations

import math
import re
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from energy.errors import ConditionsError, VehicleError
from energy.units import (
    JOULE_PER_M_PER_KWH_PER_100KM,
    JOULE_PER_M_PER_WH_PER_KM,
    JOULE_PER_WH,
    KG_PER_LB,
    KMH_PER_MPS,
    MPS_PER_MPH,
    NEWTON_PER_LBF,
    ZERO_CELSIUS_K,
)
from energy.vehicle.coefficients import EffectCoefficients
from energy.vehicle.consumption_table import ConsumptionTableVehicle
from energy.vehicle.published import Published, published_from_section
from energy.vehicle.vehicle import Powertrain, Vehicle

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import NDArray


AnyVehicle = Vehicle | ConsumptionTableVehicle

_ROAD_LOAD_KIND: Final = "road-load"
_TABLE_KIND: Final = "consumption-table"
_KINDS: Final = (_ROAD_LOAD_KIND, _TABLE_KIND)
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


_POWER_UNITS: Final = {"w": 1.0, "kw": 1000.0}
_TEMPERATURE_UNITS: Final = {"c": 1.0, "k": 1.0}
_TEMPERATURE_OFFSETS: Final = {"c": ZERO_CELSIUS_K}


@dataclass(frozen=True, slots=True)
class _Quantity:
    """A section of a vehicle file: the field it fills, and factor and offset of each unit to that field's unit."""

    section: str
    field: str
    factors: Mapping[str, float]
    offsets: Mapping[str, float] | None = None


@dataclass(frozen=True, slots=True)
class _Read:
    """A section as read: raw value, its dotted name, factor and offset to the field's unit, sd and source."""

    value: object
    where: str
    factor: float
    offset: float
    sd: float | None
    source: str


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
# what conditions switch on; the coefficients of wet and snowy roads belong to the road and stay out
_EFFECTS: Final = (
    _Quantity("rolling_temp", "rolling_temp_per_k", {"per_k": 1.0}),
    _Quantity("yaw_drag", "yaw_drag_per_rad", {"per_rad": 1.0}),
    _Quantity("cabin_ua", "cabin_ua_w_per_k", {"w_per_k": 1.0}),
    _Quantity("cabin_target", "cabin_target_k", _TEMPERATURE_UNITS, _TEMPERATURE_OFFSETS),
    _Quantity("cabin_soak", "cabin_soak_w_per_k", {"w_per_k": 1.0}),
    _Quantity("cabin_time", "cabin_time_s", {"s": 1.0}),
    _Quantity("heating_cop", "heating_cop", {"coef": 1.0}),
    _Quantity("cooling_cop", "cooling_cop", {"coef": 1.0}),
    _Quantity("climate_fan", "climate_fan_w", _POWER_UNITS),
    _Quantity("climate_limit", "climate_limit_w", _POWER_UNITS),
    _Quantity("aux_climate", "aux_climate_w", _POWER_UNITS),
    _Quantity("battery_resistance", "battery_resistance_ohm", {"ohm": 1.0}),
    _Quantity("battery_voltage", "battery_voltage_v", {"v": 1.0}),
    _Quantity("resistance_doubling", "resistance_doubling_k", {"k": 1.0}),
    _Quantity("drive_loss", "drive_loss_w_per_n2", {"w_per_n2": 1.0}),
    _Quantity("regen_cap", "regen_cap_w", _POWER_UNITS),
    _Quantity("regen_fade_soc", "regen_fade_soc_frac", {"frac": 1.0}),
    _Quantity("regen_cold_full", "regen_cold_full_k", _TEMPERATURE_UNITS, _TEMPERATURE_OFFSETS),
    _Quantity("regen_cold_none", "regen_cold_none_k", _TEMPERATURE_UNITS, _TEMPERATURE_OFFSETS),
    _Quantity("regen_min_speed", "regen_min_speed_mps", {"mps": 1.0, "kmh": 1.0 / KMH_PER_MPS}),
    _Quantity("tyre_warm_up", "tyre_warm_up_frac", {"frac": 1.0}),
    _Quantity("tyre_time", "tyre_time_s", {"s": 1.0}),
    _Quantity("air_density", "air_density_coef", {"coef": 1.0}),
    _Quantity("cooling_target", "cooling_target_k", _TEMPERATURE_UNITS, _TEMPERATURE_OFFSETS),
    _Quantity("cooling_ua", "cooling_ua_w_per_k", {"w_per_k": 1.0}),
    _Quantity("cooling_soak", "cooling_soak_w_per_k", {"w_per_k": 1.0}),
    _Quantity("cooling_time", "cooling_time_s", {"s": 1.0}),
)
_HEAD: Final = ("id", "name", "powertrain", "kind")
_SECTIONS: Final = (*_HEAD, *(q.section for q in _NUMBERS + _TABLES + _EFFECTS), "published")

# a consumption table
_CONSUMPTION: Final = _Quantity(
    "consumption",
    "consumption_j_per_m",
    {
        "kwh_per_100km": JOULE_PER_M_PER_KWH_PER_100KM,
        "wh_per_km": JOULE_PER_M_PER_WH_PER_KM,
        "wh_per_m": JOULE_PER_WH,
    },
)
_TABLE_NUMBERS: Final = (
    _Quantity("ascent", "ascent_j_per_m", {"wh_per_m": JOULE_PER_WH}),
    _Quantity("descent", "descent_j_per_m", {"wh_per_m": JOULE_PER_WH}),
    _Quantity("aux_power", "aux_power_w", {"w": 1.0}),
    _Quantity("usable_capacity", "usable_capacity_wh", {"kwh": 1000.0}),
)
_KINETIC: Final = ("mass_kg", "acceleration_eff", "deceleration_eff")
_TABLE_SECTIONS: Final = (*_HEAD, "consumption", *(q.section for q in _TABLE_NUMBERS), "kinetic", "published")


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
    vehicle_id = _text(data, "id", "")
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
    name = _text(data, "name", vehicle_id)
    powertrain = _powertrain(data, vehicle_id)
    tables: dict[str, NDArray[np.float64]] = {}
    numbers, sources, sd = _numbers(data, _NUMBERS, vehicle_id)
    for quantity in _TABLES:
        read = _read(data, quantity, vehicle_id)
        tables[quantity.field] = _array(read, vehicle_id)
        sources[quantity.field] = read.source
    given = [quantity for quantity in _EFFECTS if quantity.section in data]
    numbers_of_effects, effect_sources, effect_sd = _numbers(data, given, vehicle_id)
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
    )


def _table_vehicle(data: Mapping[str, object], vehicle_id: str) -> ConsumptionTableVehicle:
    name = _text(data, "name", vehicle_id)
    powertrain = _powertrain(data, vehicle_id)
    read = _read(data, _CONSUMPTION, vehicle_id, ("speed_kmh",))
    section = data["consumption"]
    if not isinstance(section, Mapping) or "speed_kmh" not in section:
        raise VehicleError("consumption.speed_kmh", "missing", "a list of numbers", vehicle_id)
    speed = _Read(section["speed_kmh"], "consumption.speed_kmh", 1.0 / KMH_PER_MPS, 0.0, None, read.source)
    numbers, sources, sd = _numbers(data, _TABLE_NUMBERS, vehicle_id)
    kinetic_up_kg = kinetic_down_kg = 0.0
    if "kinetic" in data:
        kinetic_up_kg, kinetic_down_kg, source = _kinetic(data["kinetic"], vehicle_id)
        sources |= {"kinetic_up_kg": source, "kinetic_down_kg": source}
    return ConsumptionTableVehicle(
        id=vehicle_id,
        name=name,
        powertrain=powertrain,
        speed_mps=_array(speed, vehicle_id),
        consumption_j_per_m=_array(read, vehicle_id),
        ascent_j_per_m=numbers["ascent_j_per_m"],
        descent_j_per_m=numbers["descent_j_per_m"],
        aux_power_w=numbers["aux_power_w"],
        usable_capacity_wh=numbers["usable_capacity_wh"],
        kinetic_up_kg=kinetic_up_kg,
        kinetic_down_kg=kinetic_down_kg,
        sources=MappingProxyType({"speed_mps": read.source, "consumption_j_per_m": read.source, **sources}),
        sd=MappingProxyType(sd),
    )


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
        value = _number(section.get(key), f"kinetic.{key}", vehicle_id)
        if not 0.0 < value <= most:
            raise VehicleError(f"kinetic.{key}", value, f"(0, {most:g}]", vehicle_id)
        numbers.append(value)
    mass_kg, acceleration_eff, deceleration_eff = numbers
    return mass_kg / acceleration_eff, mass_kg * deceleration_eff, _text(section, "source", vehicle_id, "kinetic.")


def _numbers(
    data: Mapping[str, object], quantities: Sequence[_Quantity], vehicle_id: str
) -> tuple[dict[str, float], dict[str, str], dict[str, float]]:
    """Number in the field's unit, source and (where given) standard deviation of each quantity, by field name."""
    numbers: dict[str, float] = {}
    sources: dict[str, str] = {}
    sd: dict[str, float] = {}
    for quantity in quantities:
        read = _read(data, quantity, vehicle_id)
        numbers[quantity.field] = _number(read.value, read.where, vehicle_id) * read.factor + read.offset
        sources[quantity.field] = read.source
        if read.sd is not None:
            sd[quantity.field] = read.sd * read.factor
    return numbers, sources, sd


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


def _read(
    data: Mapping[str, object], quantity: _Quantity, vehicle_id: str, further_keys: tuple[str, ...] = ()
) -> _Read:
    """The section of a quantity, with everything about it checked but its value."""
    units = {f"value_{unit}": unit for unit in quantity.factors}
    choice = " or ".join(units)
    section = data.get(quantity.section, "missing")
    if not isinstance(section, Mapping):
        raise VehicleError(quantity.section, section, f"a section with {choice}, and source", vehicle_id)
    given = [key for key in units if key in section]
    unit = units[given[0]] if len(given) == 1 else ""
    for key in section:
        if key.startswith("sd_") and unit and key != f"sd_{unit}":
            raise VehicleError(f"{quantity.section}.{key}", "unknown", f"sd_{unit}, in the value's unit", vehicle_id)
        if key not in units and key not in further_keys and key != "source" and not key.startswith("sd_"):
            raise VehicleError(f"{quantity.section}.{key}", "unknown", f"{choice}, and source", vehicle_id)
    if not unit:
        found = " and ".join(given) if given else "missing"
        raise VehicleError(f"{quantity.section}.value", found, f"exactly one of {choice}", vehicle_id)
    return _Read(
        value=section[given[0]],
        where=f"{quantity.section}.{given[0]}",
        factor=quantity.factors[unit],
        offset=(quantity.offsets or {}).get(unit, 0.0),
        sd=_sd(section, f"sd_{unit}", quantity.section, vehicle_id),
        source=_text(section, "source", vehicle_id, f"{quantity.section}."),
    )


def _sd(section: Mapping[str, object], key: str, name: str, vehicle_id: str) -> float | None:
    if key not in section:
        return None
    value = _number(section[key], f"{name}.{key}", vehicle_id)
    if not (math.isfinite(value) and value >= 0.0):
        raise VehicleError(f"{name}.{key}", value, "a finite number, at least 0", vehicle_id)
    return value


def _number(value: object, where: str, vehicle_id: str) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise VehicleError(where, "missing" if value is None else repr(value), "a number", vehicle_id)
    return float(value)


def _array(read: _Read, vehicle_id: str) -> NDArray[np.float64]:
    """The list of a section in the field's unit, read-only."""
    if not isinstance(read.value, list):
        raise VehicleError(read.where, repr(read.value), "a list of numbers", vehicle_id)
    if read.sd is not None:
        raise VehicleError(f"{read.where.split('.')[0]}.sd", read.sd, "none for a list", vehicle_id)
    numbers = [_number(item, f"{read.where}[{k}]", vehicle_id) for k, item in enumerate(read.value)]
    array = np.array(numbers, dtype=np.float64) * read.factor
    array.flags.writeable = False
    return array
