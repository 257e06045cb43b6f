"""Sections of vehicle files: the quantity of each, its units, and its value read from a parsed file."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from energy.errors import VehicleError
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
from energy.vehicle.vehicle import Powertrain

if TYPE_CHECKING:
    from numpy.typing import NDArray

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
class Quantity:
    """A section of a vehicle file: the field it fills, and factor and offset of each unit to that field's unit."""

    section: str
    field: str
    factors: Mapping[str, float]
    offsets: Mapping[str, float] | None = None


@dataclass(frozen=True, slots=True)
class SectionValue:
    """A section as read: raw value, its dotted name, factor and offset to the field's unit, sd and source."""

    value: object
    where: str
    factor: float
    offset: float
    sd: float | None
    source: str


ROAD_LOAD_NUMBERS: Final = (
    Quantity("mass", "mass_kg", _MASS_UNITS),
    Quantity("rotating_mass", "rotating_mass_coef", {"coef": 1.0}),
    Quantity("road_load_a", "road_load_a_n", _ROAD_LOAD_A_UNITS),
    Quantity("road_load_b", "road_load_b_n_per_mps", _ROAD_LOAD_B_UNITS),
    Quantity("road_load_c", "road_load_c_n_per_mps2", _ROAD_LOAD_C_UNITS),
    Quantity("drive_efficiency", "drive_eff", {"eff": 1.0}),
    Quantity("recuperation_efficiency", "recuperation_eff", {"eff": 1.0}),
    Quantity("aux_power", "aux_power_w", {"w": 1.0}),
    Quantity("aux_efficiency_moving", "aux_move_eff", {"eff": 1.0}),
    Quantity("aux_efficiency_idle", "aux_idle_eff", {"eff": 1.0}),
    Quantity("usable_capacity", "usable_capacity_wh", {"kwh": 1000.0}),
)
ROAD_LOAD_LISTS: Final = (
    Quantity("accel_speed", "accel_speed_mps", {"kmh": 1.0 / KMH_PER_MPS}),
    Quantity("acceleration", "accel_mps2", {"mps2": 1.0}),
    Quantity("deceleration", "decel_mps2", {"mps2": 1.0}),
)
# what conditions switch on; the coefficients of wet and snowy roads belong to the road and stay out
EFFECTS: Final = (
    Quantity("rolling_temp", "rolling_temp_per_k", {"per_k": 1.0}),
    Quantity("yaw_drag", "yaw_drag_per_rad", {"per_rad": 1.0}),
    Quantity("cabin_ua", "cabin_ua_w_per_k", {"w_per_k": 1.0}),
    Quantity("cabin_target", "cabin_target_k", _TEMPERATURE_UNITS, _TEMPERATURE_OFFSETS),
    Quantity("cabin_soak", "cabin_soak_w_per_k", {"w_per_k": 1.0}),
    Quantity("cabin_time", "cabin_time_s", {"s": 1.0}),
    Quantity("heating_cop", "heating_cop", {"coef": 1.0}),
    Quantity("cooling_cop", "cooling_cop", {"coef": 1.0}),
    Quantity("climate_fan", "climate_fan_w", _POWER_UNITS),
    Quantity("climate_limit", "climate_limit_w", _POWER_UNITS),
    Quantity("aux_climate", "aux_climate_w", _POWER_UNITS),
    Quantity("battery_resistance", "battery_resistance_ohm", {"ohm": 1.0}),
    Quantity("battery_voltage", "battery_voltage_v", {"v": 1.0}),
    Quantity("resistance_doubling", "resistance_doubling_k", {"k": 1.0}),
    Quantity("drive_loss", "drive_loss_w_per_n2", {"w_per_n2": 1.0}),
    Quantity("regen_cap", "regen_cap_w", _POWER_UNITS),
    Quantity("regen_fade_soc", "regen_fade_soc_frac", {"frac": 1.0}),
    Quantity("regen_cold_full", "regen_cold_full_k", _TEMPERATURE_UNITS, _TEMPERATURE_OFFSETS),
    Quantity("regen_cold_none", "regen_cold_none_k", _TEMPERATURE_UNITS, _TEMPERATURE_OFFSETS),
    Quantity("regen_min_speed", "regen_min_speed_mps", {"mps": 1.0, "kmh": 1.0 / KMH_PER_MPS}),
    Quantity("tyre_warm_up", "tyre_warm_up_frac", {"frac": 1.0}),
    Quantity("tyre_time", "tyre_time_s", {"s": 1.0}),
    Quantity("air_density", "air_density_coef", {"coef": 1.0}),
    Quantity("cooling_target", "cooling_target_k", _TEMPERATURE_UNITS, _TEMPERATURE_OFFSETS),
    Quantity("cooling_ua", "cooling_ua_w_per_k", {"w_per_k": 1.0}),
    Quantity("cooling_soak", "cooling_soak_w_per_k", {"w_per_k": 1.0}),
    Quantity("cooling_time", "cooling_time_s", {"s": 1.0}),
)
# a consumption table
CONSUMPTION: Final = Quantity(
    "consumption",
    "consumption_j_per_m",
    {
        "kwh_per_100km": JOULE_PER_M_PER_KWH_PER_100KM,
        "wh_per_km": JOULE_PER_M_PER_WH_PER_KM,
        "wh_per_m": JOULE_PER_WH,
    },
)
TABLE_NUMBERS: Final = (
    Quantity("ascent", "ascent_j_per_m", {"wh_per_m": JOULE_PER_WH}),
    Quantity("descent", "descent_j_per_m", {"wh_per_m": JOULE_PER_WH}),
    Quantity("aux_power", "aux_power_w", {"w": 1.0}),
    Quantity("usable_capacity", "usable_capacity_wh", {"kwh": 1000.0}),
)


def numbers_in(
    data: Mapping[str, object], quantities: Sequence[Quantity], vehicle_id: str
) -> tuple[dict[str, float], dict[str, str], dict[str, float]]:
    """Number in the field's unit, source and (where given) standard deviation of each quantity, by field name."""
    numbers: dict[str, float] = {}
    sources: dict[str, str] = {}
    sd: dict[str, float] = {}
    for quantity in quantities:
        read = section_value(data, quantity, vehicle_id)
        numbers[quantity.field] = number_of(read.value, read.where, vehicle_id) * read.factor + read.offset
        sources[quantity.field] = read.source
        if read.sd is not None:
            sd[quantity.field] = read.sd * read.factor
    return numbers, sources, sd


def text_in(section: Mapping[str, object], key: str, vehicle_id: str, prefix: str = "") -> str:
    """A text of a section that is not empty, without space around it."""
    if key not in section:
        raise VehicleError(prefix + key, "missing", "a text", vehicle_id)
    value = section[key]
    if not isinstance(value, str) or not value.strip():
        raise VehicleError(prefix + key, repr(value), "a text that is not empty", vehicle_id)
    return value.strip()


def powertrain_in(data: Mapping[str, object], vehicle_id: str) -> Powertrain:
    """What the stored energy is."""
    value = text_in(data, "powertrain", vehicle_id)
    try:
        return Powertrain(value)
    except ValueError:
        allowed = f"one of {', '.join(Powertrain)}"
        raise VehicleError("powertrain", repr(value), allowed, vehicle_id) from None


def section_value(
    data: Mapping[str, object], quantity: Quantity, vehicle_id: str, further_keys: tuple[str, ...] = ()
) -> SectionValue:
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
    return SectionValue(
        value=section[given[0]],
        where=f"{quantity.section}.{given[0]}",
        factor=quantity.factors[unit],
        offset=(quantity.offsets or {}).get(unit, 0.0),
        sd=_sd(section, f"sd_{unit}", quantity.section, vehicle_id),
        source=text_in(section, "source", vehicle_id, f"{quantity.section}."),
    )


def _sd(section: Mapping[str, object], key: str, name: str, vehicle_id: str) -> float | None:
    if key not in section:
        return None
    value = number_of(section[key], f"{name}.{key}", vehicle_id)
    if not (math.isfinite(value) and value >= 0.0):
        raise VehicleError(f"{name}.{key}", value, "a finite number, at least 0", vehicle_id)
    return value


def number_of(value: object, where: str, vehicle_id: str) -> float:
    """A value that must be a number, named by where it stands."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise VehicleError(where, "missing" if value is None else repr(value), "a number", vehicle_id)
    return float(value)


def array_of(read: SectionValue, vehicle_id: str) -> NDArray[np.float64]:
    """The list of a section in the field's unit, read-only."""
    if not isinstance(read.value, list):
        raise VehicleError(read.where, repr(read.value), "a list of numbers", vehicle_id)
    if read.sd is not None:
        raise VehicleError(f"{read.where.split('.')[0]}.sd", read.sd, "none for a list", vehicle_id)
    numbers = [number_of(item, f"{read.where}[{k}]", vehicle_id) for k, item in enumerate(read.value)]
    array = np.array(numbers, dtype=np.float64) * read.factor
    array.flags.writeable = False
    return array
