"""Vehicles given in the terms that the routing services of TomTom (and Azure Maps), HERE and Mapbox take.

Each function takes that service's own strings and units, so that a vehicle set up there can be moved here as it is.
What a service adds beyond constant speed, climbs and auxiliaries (HERE's table for heavy traffic, charging curves) has
no place in a `ConsumptionTableVehicle` and is left out.
"""

from __future__ import annotations

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
from energy.vehicle.consumption_table import ConsumptionTableVehicle

if TYPE_CHECKING:
    from numpy.typing import NDArray

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


def vehicle_from_tomtom(
    vehicle_id: str,
    name: str,
    *,
    constant_speed_consumption_kwh_per_100km: str,
    max_charge_kwh: float,
    vehicle_weight_kg: float = 0.0,
    acceleration_eff: float | None = None,
    deceleration_eff: float | None = None,
    uphill_eff: float | None = None,
    downhill_eff: float | None = None,
    auxiliary_power_kw: float = 0.0,
    source: str = "",
) -> ConsumptionTableVehicle:
    """The vehicle of TomTom's (and Azure Maps') electric consumption model.

    constant_speed_consumption_kwh_per_100km: `constantSpeedConsumptionInkWhPerHundredkm`, 1 to 25 pairs of speed
    [km/h] and consumption [kWh/100 km] in any order, as "50,8.2:130,21.3". Between them the curve is linear; beyond
    them it goes on with the slope of the two nearest, here to 0 and to 255 km/h, the service's range of speeds.
    max_charge_kwh: `maxChargeInkWh`. vehicle_weight_kg: `vehicleWeight`. auxiliary_power_kw: `auxiliaryPowerInkW`.
    acceleration_eff, deceleration_eff: `accelerationEfficiency` (kinetic energy gained over energy consumed) and
    `decelerationEfficiency` (energy saved over kinetic energy lost). uphill_eff, downhill_eff: `uphillEfficiency` and
    `downhillEfficiency`, the same of potential energy with g = 9.81 m/s². Both of a pair or none, a product of at most
    1, and only with a weight.

    Raises VehicleError where the service would refuse the values, or `ConsumptionTableVehicle` does.
    Source: developer.tomtom.com, Routing API, "Common Routing Parameters"; learn.microsoft.com, "Consumption model"
    and the REST reference of Route - Get Route Range, whose example the pairs above are.
    """
    field = "constantSpeedConsumptionInkWhPerHundredkm"
    points = _points(constant_speed_consumption_kwh_per_100km, ":", field, vehicle_id)
    if len(points) > MOST_TOMTOM_POINTS:
        raise VehicleError(field, f"{len(points)} points", f"1..{MOST_TOMTOM_POINTS}", vehicle_id)
    points.sort()
    speed_kmh, consumption = (np.array(column, np.float64) for column in zip(*points, strict=True))
    if speed_kmh[0] < 0.0 or speed_kmh[-1] > MOST_TOMTOM_SPEED_KMH:
        raise VehicleError(field, speed_kmh.tolist(), f"speeds within 0..{MOST_TOMTOM_SPEED_KMH:g} km/h", vehicle_id)
    if len(points) > 1:
        speed_kmh, consumption = _extrapolated(speed_kmh, consumption, field, vehicle_id)
    potential_n = vehicle_weight_kg * GRAVITY_MPS2
    up, down = _pair("uphillEfficiency", uphill_eff, "downhillEfficiency", downhill_eff, vehicle_weight_kg, vehicle_id)
    gain, loss = _pair(
        "accelerationEfficiency",
        acceleration_eff,
        "decelerationEfficiency",
        deceleration_eff,
        vehicle_weight_kg,
        vehicle_id,
    )
    return _vehicle(
        vehicle_id,
        name,
        speed_kmh / KMH_PER_MPS,
        consumption * JOULE_PER_M_PER_KWH_PER_100KM,
        ascent_j_per_m=potential_n * up,
        descent_j_per_m=potential_n * down,
        kinetic_up_kg=vehicle_weight_kg * gain,
        kinetic_down_kg=vehicle_weight_kg * loss,
        aux_power_w=auxiliary_power_kw * 1000.0,
        usable_capacity_wh=max_charge_kwh * 1000.0,
        source=source,
    )


def vehicle_from_here(
    vehicle_id: str,
    name: str,
    *,
    free_flow_speed_table_wh_per_m: str,
    max_charge_kwh: float,
    ascent_wh_per_m: float = 0.0,
    descent_wh_per_m: float = 0.0,
    auxiliary_consumption_wh_per_s: float = 0.0,
    source: str = "",
) -> ConsumptionTableVehicle:
    """The vehicle of HERE Routing's empirical consumption model.

    free_flow_speed_table_wh_per_m: `ev[freeFlowSpeedTable]`, speeds [km/h] rising and consumptions [Wh/m] in turn, as
    "0,0.239,27,0.239,45,0.259"; linear between the speeds, constant beyond them. max_charge_kwh: `ev[maxCharge]`.
    ascent_wh_per_m: `ev[ascent]`, consumed for each metre risen. descent_wh_per_m: `ev[descent]`, recovered for each
    metre fallen. auxiliary_consumption_wh_per_s: `ev[auxiliaryConsumption]`, Wh for each second of travel.
    `ev[trafficSpeedTable]` is left out: joulepath knows the speed of a road, not how jammed it is.

    Raises VehicleError when the table can't be read or `ConsumptionTableVehicle` refuses a number.
    Source: docs.here.com, Routing API v8, "Consumption" and "Calculate consumption per section".
    """
    field = "freeFlowSpeedTable"
    numbers = [_float(text, field, vehicle_id) for text in free_flow_speed_table_wh_per_m.split(",")]
    if len(numbers) % 2:
        raise VehicleError(field, f"{len(numbers)} numbers", "a consumption for each speed", vehicle_id)
    return _vehicle(
        vehicle_id,
        name,
        np.array(numbers[::2], np.float64) / KMH_PER_MPS,
        np.array(numbers[1::2], np.float64) * JOULE_PER_WH,
        ascent_j_per_m=ascent_wh_per_m * JOULE_PER_WH,
        descent_j_per_m=descent_wh_per_m * JOULE_PER_WH,
        aux_power_w=auxiliary_consumption_wh_per_s * JOULE_PER_WH,
        usable_capacity_wh=max_charge_kwh * 1000.0,
        source=source,
    )


def vehicle_from_mapbox(
    vehicle_id: str,
    name: str,
    *,
    energy_consumption_curve_wh_per_km: str,
    ev_max_charge_wh: float,
    ev_ascent_wh_per_m: float | None = None,
    ev_descent_wh_per_m: float | None = None,
    auxiliary_consumption_w: float = 0.0,
    source: str = "",
) -> ConsumptionTableVehicle:
    """The vehicle of Mapbox Directions' electric parameters.

    energy_consumption_curve_wh_per_km: `energy_consumption_curve`, pairs of speed [km/h] and consumption [Wh/km] with
    rising speeds, as "0,300;20,160;80,140;120,180". ev_max_charge_wh: `ev_max_charge` [Wh].
    ev_ascent_wh_per_m, ev_descent_wh_per_m: `ev_ascent` and `ev_descent`, consumed and gained for each metre of height,
    0..1000, both or none. auxiliary_consumption_w: `auxiliary_consumption` [W].

    Raises VehicleError where the service would refuse the values, or `ConsumptionTableVehicle` does.
    Source: docs.mapbox.com, Directions API, electric vehicle routing; Navigation SDK, EvDataProvider.
    """
    if (ev_ascent_wh_per_m is None) != (ev_descent_wh_per_m is None):
        raise VehicleError("ev_ascent and ev_descent", "only one of them", "both or none", vehicle_id)
    ascent, descent = ev_ascent_wh_per_m or 0.0, ev_descent_wh_per_m or 0.0
    for field, value in (("ev_ascent", ascent), ("ev_descent", descent)):
        if not 0.0 <= value <= MOST_MAPBOX_CLIMB_WH_PER_M:
            raise VehicleError(field, value, f"0..{MOST_MAPBOX_CLIMB_WH_PER_M:g}", vehicle_id)
    points = _points(energy_consumption_curve_wh_per_km, ";", "energy_consumption_curve", vehicle_id)
    speed_kmh, consumption = (np.array(column, np.float64) for column in zip(*points, strict=True))
    return _vehicle(
        vehicle_id,
        name,
        speed_kmh / KMH_PER_MPS,
        consumption * JOULE_PER_M_PER_WH_PER_KM,
        ascent_j_per_m=ascent * JOULE_PER_WH,
        descent_j_per_m=descent * JOULE_PER_WH,
        aux_power_w=auxiliary_consumption_w,
        usable_capacity_wh=ev_max_charge_wh,
        source=source,
    )


def _vehicle(
    vehicle_id: str,
    name: str,
    speed_mps: NDArray[np.float64],
    consumption_j_per_m: NDArray[np.float64],
    *,
    ascent_j_per_m: float,
    descent_j_per_m: float,
    aux_power_w: float,
    usable_capacity_wh: float,
    source: str,
    kinetic_up_kg: float = 0.0,
    kinetic_down_kg: float = 0.0,
) -> ConsumptionTableVehicle:
    speed_mps.flags.writeable = False
    consumption_j_per_m.flags.writeable = False
    return ConsumptionTableVehicle(
        id=vehicle_id,
        name=name,
        speed_mps=speed_mps,
        consumption_j_per_m=consumption_j_per_m,
        ascent_j_per_m=ascent_j_per_m,
        descent_j_per_m=descent_j_per_m,
        kinetic_up_kg=kinetic_up_kg,
        kinetic_down_kg=kinetic_down_kg,
        aux_power_w=aux_power_w,
        usable_capacity_wh=usable_capacity_wh,
        sources=MappingProxyType(dict.fromkeys(_FIELDS, source) if source else {}),
    )


def _float(text: str, field: str, vehicle_id: str) -> float:
    try:
        return float(text)
    except ValueError:
        raise VehicleError(field, repr(text), "a number", vehicle_id) from None


def _points(text: str, separator: str, field: str, vehicle_id: str) -> list[tuple[float, float]]:
    """Pairs of speed and consumption."""
    points: list[tuple[float, float]] = []
    for pair in text.split(separator):
        parts = pair.split(",")
        if len(parts) != 2:
            raise VehicleError(field, repr(pair), "speed,consumption", vehicle_id)
        points.append((_float(parts[0], field, vehicle_id), _float(parts[1], field, vehicle_id)))
    return points


def _extrapolated(
    speed_kmh: NDArray[np.float64], consumption: NDArray[np.float64], field: str, vehicle_id: str
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """The curve drawn on to 0 and 255 km/h with its outer slopes; refused where it would fall below zero."""
    if not bool(np.all(np.diff(speed_kmh) > 0.0)):
        raise VehicleError(field, speed_kmh.tolist(), "each speed once", vehicle_id)
    slope = np.diff(consumption) / np.diff(speed_kmh)
    if slope[-1] < 0.0:
        raise VehicleError(field, consumption.tolist(), "not falling at the highest speed", vehicle_id)
    at_rest = float(consumption[0] - slope[0] * speed_kmh[0])
    if at_rest < 0.0:
        raise VehicleError(
            field, f"{at_rest:g} at 0 km/h", "a line from the lowest speeds that stays above 0", vehicle_id
        )
    at_most = float(consumption[-1] + slope[-1] * (MOST_TOMTOM_SPEED_KMH - speed_kmh[-1]))
    if speed_kmh[0] > 0.0:
        speed_kmh, consumption = np.insert(speed_kmh, 0, 0.0), np.insert(consumption, 0, at_rest)
    if speed_kmh[-1] < MOST_TOMTOM_SPEED_KMH:
        speed_kmh, consumption = np.append(speed_kmh, MOST_TOMTOM_SPEED_KMH), np.append(consumption, at_most)
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
    return 1.0 / gain_eff, loss_eff
