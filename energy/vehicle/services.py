"""Vehicles given in the terms that the routing services of TomTom (and Azure Maps), HERE and Mapbox take.

Each record holds that service's own strings and units, so that a vehicle set up there can be moved here as it is.
What a service adds beyond constant speed, climbs, auxiliaries and charging (HERE's table for heavy traffic) has no
place in a `ConsumptionTableVehicle` and is left out. Errors name the service's parameter.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from types import MappingProxyType
from typing import TYPE_CHECKING, Final

import numpy as np

from energy.errors import VehicleError
from energy.units import (
    GRAVITY_MPS2,
    JOULE_PER_M_PER_KWH_PER_100KM,
    JOULE_PER_M_PER_WH_PER_KM,
    JOULE_PER_WH,
    KMH_PER_MPS,
)
from energy.vehicle.consumption_table import MOST_J_PER_M, ConsumptionTableVehicle
from energy.vehicle.service_charging import charging_from_here, charging_from_mapbox, charging_from_tomtom

if TYPE_CHECKING:
    from collections.abc import Mapping

    from numpy.typing import NDArray

    from energy.charging.charging import Charging
    from energy.vehicle.service_charging import TomTomCharging

MOST_SPEED_KMH: Final = 400.0  # that of a ConsumptionTableVehicle
LEAST_STEP_KMH: Final = 1e-6  # between two speeds of a curve; closer ones are one speed, given twice
MOST_TOMTOM_POINTS: Final = 25
MOST_TOMTOM_SPEED_KMH: Final = 255.0
MOST_MAPBOX_CLIMB_WH_PER_M: Final = 1000.0
_FIELDS: Final = (
    "speed_mps",
    "consumption_j_per_m",
    "ascent_j_per_m",
    "descent_j_per_m",
    "kinetic_up_kg",
    "kinetic_down_kg",
    "aux_power_w",
    "usable_capacity_wh",
)


@dataclass(frozen=True, slots=True)
class TomTomParameters:
    """TomTom's (and Azure Maps') electric consumption model.

    constant_speed_consumption_kwh_per_100km: `constantSpeedConsumptionInkWhPerHundredkm`, 1 to 25 pairs of speed
    [km/h] and consumption [kWh/100 km] in any order, as "50,8.2:130,21.3". Between them the curve is linear; beyond
    them it goes on with the slope of the two nearest, here to 0 and to 255 km/h, the service's range of speeds.
    max_charge_kwh: `maxChargeInkWh`. vehicle_weight_kg: `vehicleWeight`. auxiliary_power_kw: `auxiliaryPowerInkW`.
    acceleration_eff, deceleration_eff: `accelerationEfficiency` (kinetic energy gained over energy consumed) and
    `decelerationEfficiency` (energy saved over kinetic energy lost). uphill_eff, downhill_eff: `uphillEfficiency` and
    `downhillEfficiency`, the same of potential energy with g = 9.81 m/s². Both of a pair or none, a product of at most
    1, and only with a weight. charging: `chargingParameters`.

    Source: developer.tomtom.com, Routing API, "Common Routing Parameters"; learn.microsoft.com, "Consumption model"
    and the REST reference of Route - Get Route Range, whose example the pairs above are.
    """

    constant_speed_consumption_kwh_per_100km: str
    max_charge_kwh: float
    vehicle_weight_kg: float = 0.0
    acceleration_eff: float | None = None
    deceleration_eff: float | None = None
    uphill_eff: float | None = None
    downhill_eff: float | None = None
    auxiliary_power_kw: float = 0.0
    charging: TomTomCharging | None = None


@dataclass(frozen=True, slots=True)
class HereParameters:
    """HERE Routing's empirical consumption model.

    free_flow_speed_table_wh_per_m: `ev[freeFlowSpeedTable]`, speeds [km/h] rising and consumptions [Wh/m] in turn, as
    "0,0.239,27,0.239,45,0.259"; linear between the speeds, constant beyond them. max_charge_kwh: `ev[maxCharge]`.
    ascent_wh_per_m: `ev[ascent]`, consumed for each metre risen. descent_wh_per_m: `ev[descent]`, recovered for each
    metre fallen, at most ascent. auxiliary_consumption_wh_per_s: `ev[auxiliaryConsumption]`, for each second of travel.
    charging_curve_kwh_kw: `ev[chargingCurve]`, charges [kWh] rising and powers [kW] in turn, as "0,239,32,199,56,167".
    connector_types: `ev[connectorTypes]`, as "iec62196Type2Combo,chademo"; both or none.
    `ev[trafficSpeedTable]` is left out: joulepath knows the speed of a road, not how jammed it is.

    Source: docs.here.com, Routing API v8, "Consumption" and "Calculate consumption per section".
    """

    free_flow_speed_table_wh_per_m: str
    max_charge_kwh: float
    ascent_wh_per_m: float = 0.0
    descent_wh_per_m: float = 0.0
    auxiliary_consumption_wh_per_s: float = 0.0
    charging_curve_kwh_kw: str | None = None
    connector_types: str | None = None


@dataclass(frozen=True, slots=True)
class MapboxParameters:
    """Mapbox Directions' electric parameters.

    energy_consumption_curve_wh_per_km: `energy_consumption_curve`, pairs of speed [km/h] and consumption [Wh/km] with
    rising speeds, as "0,300;20,160;80,140;120,180". ev_max_charge_wh: `ev_max_charge` [Wh].
    ev_ascent_wh_per_m, ev_descent_wh_per_m: `ev_ascent` and `ev_descent`, consumed and gained for each metre of height,
    0..1000, both or none, descent at most ascent. auxiliary_consumption_w: `auxiliary_consumption` [W].
    ev_charging_curve_wh_w: `ev_charging_curve`, pairs of charge [Wh] and power [W], as "0,100000;40000,70000".
    ev_connector_types: `ev_connector_types`, as "ccs_combo_type2,chademo"; both or none. ev_max_ac_charging_power_w:
    `ev_max_ac_charging_power` [W], 14,400 where it is not given, and only with both.

    Source: docs.mapbox.com, Directions API, electric vehicle routing; Navigation SDK, EvDataProvider.
    """

    energy_consumption_curve_wh_per_km: str
    ev_max_charge_wh: float
    ev_ascent_wh_per_m: float | None = None
    ev_descent_wh_per_m: float | None = None
    auxiliary_consumption_w: float = 0.0
    ev_charging_curve_wh_w: str | None = None
    ev_connector_types: str | None = None
    ev_max_ac_charging_power_w: float | None = None


def vehicle_from_tomtom(
    vehicle_id: str, name: str, given: TomTomParameters, source: str = ""
) -> ConsumptionTableVehicle:
    """The vehicle of TomTom's parameters; source: where the numbers are from.

    Raises VehicleError where the service would refuse the values, or `ConsumptionTableVehicle` does.
    """
    field = "constantSpeedConsumptionInkWhPerHundredkm"
    points = _points(given.constant_speed_consumption_kwh_per_100km, ":", field, vehicle_id)
    if len(points) > MOST_TOMTOM_POINTS:
        raise VehicleError(field, f"{len(points)} points", f"1..{MOST_TOMTOM_POINTS}", vehicle_id)
    curve = _Curve(field, vehicle_id, JOULE_PER_M_PER_KWH_PER_100KM, "kWh/100 km", MOST_TOMTOM_SPEED_KMH)
    speed_kmh, consumption = curve.checked(sorted(points))
    if len(points) > 1:
        speed_kmh, consumption = _extrapolated(speed_kmh, consumption, curve)
    weight_kg = given.vehicle_weight_kg
    up, down = _pair(
        "uphillEfficiency", given.uphill_eff, "downhillEfficiency", given.downhill_eff, weight_kg, vehicle_id
    )
    gain, loss = _pair(
        "accelerationEfficiency",
        given.acceleration_eff,
        "decelerationEfficiency",
        given.deceleration_eff,
        weight_kg,
        vehicle_id,
    )
    speed_mps, consumption_j_per_m = curve.inside(speed_kmh, consumption)
    return ConsumptionTableVehicle(
        id=vehicle_id,
        name=name,
        speed_mps=speed_mps,
        consumption_j_per_m=consumption_j_per_m,
        ascent_j_per_m=weight_kg * GRAVITY_MPS2 * up,
        descent_j_per_m=weight_kg * GRAVITY_MPS2 * down,
        kinetic_up_kg=weight_kg * gain,
        kinetic_down_kg=weight_kg * loss,
        aux_power_w=given.auxiliary_power_kw * 1000.0,
        usable_capacity_wh=given.max_charge_kwh * 1000.0,
        sources=_sources(source),
        charging=None
        if given.charging is None
        else charging_from_tomtom(given.charging, given.max_charge_kwh, vehicle_id, source),
    )


def vehicle_from_here(vehicle_id: str, name: str, given: HereParameters, source: str = "") -> ConsumptionTableVehicle:
    """The vehicle of HERE's parameters; source: where the numbers are from.

    Raises VehicleError when the table can't be read or `ConsumptionTableVehicle` refuses a number.
    """
    field = "freeFlowSpeedTable"
    pairs = _in_turn(given.free_flow_speed_table_wh_per_m, field, "a consumption for each speed", vehicle_id)
    _check_climbs(("ascent", given.ascent_wh_per_m), ("descent", given.descent_wh_per_m), vehicle_id)
    curve = _Curve(field, vehicle_id, JOULE_PER_WH, "Wh/m")
    speed_mps, consumption_j_per_m = curve.inside(*curve.checked(pairs))
    return ConsumptionTableVehicle(
        id=vehicle_id,
        name=name,
        speed_mps=speed_mps,
        consumption_j_per_m=consumption_j_per_m,
        ascent_j_per_m=given.ascent_wh_per_m * JOULE_PER_WH,
        descent_j_per_m=given.descent_wh_per_m * JOULE_PER_WH,
        aux_power_w=given.auxiliary_consumption_wh_per_s * JOULE_PER_WH,
        usable_capacity_wh=given.max_charge_kwh * 1000.0,
        sources=_sources(source),
        charging=_here_charging(given, vehicle_id, source),
    )


def vehicle_from_mapbox(
    vehicle_id: str, name: str, given: MapboxParameters, source: str = ""
) -> ConsumptionTableVehicle:
    """The vehicle of Mapbox' parameters; source: where the numbers are from.

    Raises VehicleError where the service would refuse the values, or `ConsumptionTableVehicle` does.
    """
    if (given.ev_ascent_wh_per_m is None) != (given.ev_descent_wh_per_m is None):
        raise VehicleError("ev_ascent and ev_descent", "only one of them", "both or none", vehicle_id)
    ascent, descent = given.ev_ascent_wh_per_m or 0.0, given.ev_descent_wh_per_m or 0.0
    for field, value in (("ev_ascent", ascent), ("ev_descent", descent)):
        if not 0.0 <= value <= MOST_MAPBOX_CLIMB_WH_PER_M:
            raise VehicleError(field, value, f"0..{MOST_MAPBOX_CLIMB_WH_PER_M:g}", vehicle_id)
    _check_climbs(("ev_ascent", ascent), ("ev_descent", descent), vehicle_id)
    field = "energy_consumption_curve"
    curve = _Curve(field, vehicle_id, JOULE_PER_M_PER_WH_PER_KM, "Wh/km")
    points = _points(given.energy_consumption_curve_wh_per_km, ";", field, vehicle_id)
    speed_mps, consumption_j_per_m = curve.inside(*curve.checked(points))
    return ConsumptionTableVehicle(
        id=vehicle_id,
        name=name,
        speed_mps=speed_mps,
        consumption_j_per_m=consumption_j_per_m,
        ascent_j_per_m=ascent * JOULE_PER_WH,
        descent_j_per_m=descent * JOULE_PER_WH,
        aux_power_w=given.auxiliary_consumption_w,
        usable_capacity_wh=given.ev_max_charge_wh,
        sources=_sources(source),
        charging=_mapbox_charging(given, vehicle_id, source),
    )


@dataclass(frozen=True, slots=True)
class _Curve:
    """How a service writes consumption against speed, and of which vehicle; joule_per_m: in one of its units."""

    field: str
    vehicle_id: str
    joule_per_m: float
    unit: str
    most_speed_kmh: float = MOST_SPEED_KMH

    def checked(self, points: list[tuple[float, float]]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Speeds [km/h] and consumptions as given, float64 (n,) each, refused where they are out of range."""
        speed_kmh, consumption = (np.array(column, np.float64) for column in zip(*points, strict=True))
        if not bool(np.all((speed_kmh >= 0.0) & (speed_kmh <= self.most_speed_kmh))):
            raise self.refused(speed_kmh.tolist(), f"speeds within 0..{self.most_speed_kmh:g} km/h")
        if not bool(np.all(np.diff(speed_kmh) >= LEAST_STEP_KMH)):
            raise self.refused(speed_kmh.tolist(), "rising speeds, each once")
        self.check_consumption(consumption)
        return speed_kmh, consumption

    def check_consumption(self, consumption: NDArray[np.float64]) -> None:
        """Refuse consumptions that no vehicle has."""
        most = MOST_J_PER_M / self.joule_per_m
        if not bool(np.all((consumption >= 0.0) & (consumption <= most))):
            raise self.refused(consumption.tolist(), f"each 0..{most:g} {self.unit}")

    def inside(
        self, speed_kmh: NDArray[np.float64], consumption: NDArray[np.float64]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Speeds [m/s] and consumptions [J/m], not to be written to."""
        speed_mps, consumption_j_per_m = speed_kmh / KMH_PER_MPS, consumption * self.joule_per_m
        speed_mps.flags.writeable = False
        consumption_j_per_m.flags.writeable = False
        return speed_mps, consumption_j_per_m

    def refused(self, value: object, allowed: str) -> VehicleError:
        """The error that names the service's parameter."""
        return VehicleError(self.field, value, allowed, self.vehicle_id)


def _here_charging(given: HereParameters, vehicle_id: str, source: str) -> Charging | None:
    if given.charging_curve_kwh_kw is None and given.connector_types is None:
        return None
    if given.charging_curve_kwh_kw is None or given.connector_types is None:
        raise VehicleError("chargingCurve and connectorTypes", "only one of them", "both or none", vehicle_id)
    pairs = _in_turn(given.charging_curve_kwh_kw, "chargingCurve", "a power for each charge", vehicle_id)
    return charging_from_here(pairs, given.connector_types, given.max_charge_kwh, vehicle_id, source)


def _mapbox_charging(given: MapboxParameters, vehicle_id: str, source: str) -> Charging | None:
    field, curve, plugs = "ev_charging_curve", given.ev_charging_curve_wh_w, given.ev_connector_types
    if curve is None and plugs is None:
        if given.ev_max_ac_charging_power_w is not None:
            allowed = f"only with {field} and ev_connector_types"
            raise VehicleError("ev_max_ac_charging_power", given.ev_max_ac_charging_power_w, allowed, vehicle_id)
        return None
    if curve is None or plugs is None:
        raise VehicleError(f"{field} and ev_connector_types", "only one of them", "both or none", vehicle_id)
    pairs = _points(curve, ";", field, vehicle_id, "charge,power")
    most_ac_w = given.ev_max_ac_charging_power_w
    return charging_from_mapbox(pairs, plugs, most_ac_w, given.ev_max_charge_wh, vehicle_id, source)


def _sources(source: str) -> Mapping[str, str]:
    """One source for all numbers, or none."""
    return MappingProxyType(dict.fromkeys(_FIELDS, source) if source else {})


def _check_climbs(ascent: tuple[str, float], descent: tuple[str, float], vehicle_id: str) -> None:
    """Refuse a descent, by its name and value, that gives back more than the ascent takes."""
    if not 0.0 <= descent[1] <= ascent[1]:
        raise VehicleError(descent[0], descent[1], f"0..{ascent[1]:g}, at most {ascent[0]}", vehicle_id)


def _float(text: str, field: str, vehicle_id: str) -> float:
    try:
        number = float(text)
    except ValueError:
        number = math.nan
    if not math.isfinite(number):
        raise VehicleError(field, repr(text), "a number", vehicle_id)
    return number


def _in_turn(text: str, field: str, allowed: str, vehicle_id: str) -> list[tuple[float, float]]:
    """Pairs of numbers that are given one behind the other."""
    numbers = [_float(number, field, vehicle_id) for number in text.split(",")]
    if len(numbers) % 2:
        raise VehicleError(field, f"{len(numbers)} numbers", allowed, vehicle_id)
    return list(zip(numbers[::2], numbers[1::2], strict=True))


def _points(
    text: str, separator: str, field: str, vehicle_id: str, names: str = "speed,consumption"
) -> list[tuple[float, float]]:
    """Pairs of speed and consumption, or of what else the names say."""
    points: list[tuple[float, float]] = []
    for pair in text.split(separator):
        parts = pair.split(",")
        if len(parts) != 2:
            raise VehicleError(field, repr(pair), names, vehicle_id)
        points.append((_float(parts[0], field, vehicle_id), _float(parts[1], field, vehicle_id)))
    return points


def _extrapolated(
    speed_kmh: NDArray[np.float64], consumption: NDArray[np.float64], curve: _Curve
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """The curve drawn on to 0 and 255 km/h with its outer slopes; refused where it would leave what a vehicle takes."""
    slope = np.diff(consumption) / np.diff(speed_kmh)
    if slope[-1] < 0.0:
        raise curve.refused(consumption.tolist(), "not falling at the highest speed")
    at_rest = float(consumption[0] - slope[0] * speed_kmh[0])
    if at_rest < 0.0:
        raise curve.refused(f"{at_rest:g} at 0 km/h", "a line from the lowest speeds that stays above 0")
    at_most = float(consumption[-1] + slope[-1] * (MOST_TOMTOM_SPEED_KMH - speed_kmh[-1]))
    if speed_kmh[0] >= LEAST_STEP_KMH:
        speed_kmh, consumption = np.insert(speed_kmh, 0, 0.0), np.insert(consumption, 0, at_rest)
    if speed_kmh[-1] <= MOST_TOMTOM_SPEED_KMH - LEAST_STEP_KMH:
        speed_kmh, consumption = np.append(speed_kmh, MOST_TOMTOM_SPEED_KMH), np.append(consumption, at_most)
    curve.check_consumption(consumption)
    return speed_kmh, consumption


def _pair(
    gain_field: str,
    gain_eff: float | None,
    loss_field: str,
    loss_eff: float | None,
    weight_kg: float,
    vehicle_id: str,
) -> tuple[float, float]:
    """1/η for what is gained and η for what is given back; both 0 where neither is given."""
    if gain_eff is None and loss_eff is None:
        return 0.0, 0.0
    if gain_eff is None or loss_eff is None:
        raise VehicleError(f"{gain_field} and {loss_field}", "only one of them", "both or none", vehicle_id)
    if not (gain_eff > 0.0 and loss_eff >= 0.0 and gain_eff * loss_eff <= 1.0):
        allowed = "above 0, at least 0, and a product of at most 1"
        raise VehicleError(f"{gain_field} and {loss_field}", (gain_eff, loss_eff), allowed, vehicle_id)
    if weight_kg <= 0.0:
        raise VehicleError("vehicleWeight", weight_kg, f"above 0 together with {gain_field}", vehicle_id)
    return 1.0 / gain_eff, min(loss_eff, 1.0 / gain_eff)  # a product of 1 may be above it by rounding
