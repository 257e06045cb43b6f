"""Vehicles between human units and energy.vehicle.Vehicle."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from app.schemas.vehicle import (
    Acceleration,
    InlineVehicle,
    RoadLoad,
    RoadLoadEpa,
    RoadLoadMetric,
    VehicleDetail,
    VehicleSummary,
)
from energy.errors import VehicleError
from energy.vehicle import KMH_PER_MPS, Vehicle

if TYPE_CHECKING:
    from collections.abc import Mapping

INLINE_ID: Final = "inline"
NEWTON_PER_LBF: Final = 4.4482216152605  # exact: 0.45359237 kg · 9.80665 m/s²
MPS_PER_MPH: Final = 0.44704  # exact: 1609.344 m / 3600 s
WH_PER_KWH: Final = 1000.0

# names of Vehicle on the left, of the schema on the right, where they differ
SCHEMA_FIELDS: Final[Mapping[str, str]] = {
    "road_load_a_n": "road_load.a_n",
    "road_load_b_n_per_mps": "road_load.b_n_per_kmh",
    "road_load_c_n_per_mps2": "road_load.c_n_per_kmh2",
    "usable_capacity_wh": "usable_capacity_kwh",
    "accel_speed_mps": "acceleration.speed_kmh",
    "accel_mps2": "acceleration.accel_mps2",
    "decel_mps2": "acceleration.decel_mps2",
}


def vehicle_from_inline(sent: InlineVehicle, tables_from: Vehicle) -> Vehicle:
    """The vehicle that a request describes; acceleration tables of another one where it sends none.

    Raises VehicleError with the request's field names.
    """
    a_n, b_n_per_mps, c_n_per_mps2 = road_load_si(sent.road_load)
    if sent.acceleration is None:
        speed_mps, accel, decel = tables_from.accel_speed_mps, tables_from.accel_mps2, tables_from.decel_mps2
    else:
        speed_mps = np.array(sent.acceleration.speed_kmh, np.float64) / KMH_PER_MPS
        accel = np.array(sent.acceleration.accel_mps2, np.float64)
        decel = np.array(sent.acceleration.decel_mps2, np.float64)
    try:
        return Vehicle(
            id=INLINE_ID,
            name=sent.name,
            mass_kg=sent.mass_kg,
            road_load_a_n=a_n,
            road_load_b_n_per_mps=b_n_per_mps,
            road_load_c_n_per_mps2=c_n_per_mps2,
            drive_eff=sent.drive_eff,
            recuperation_eff=sent.recuperation_eff,
            aux_power_w=sent.aux_power_w,
            usable_capacity_wh=sent.usable_capacity_kwh * WH_PER_KWH,
            accel_speed_mps=speed_mps,
            accel_mps2=accel,
            decel_mps2=decel,
            powertrain=sent.powertrain,
            rotating_mass_coef=sent.rotating_mass_coef,
            aux_move_eff=sent.aux_move_eff,
            aux_idle_eff=sent.aux_idle_eff,
        )
    except VehicleError as error:
        value = error.value
        if error.field == "accel_speed_mps" and sent.acceleration is not None:
            value = sent.acceleration.speed_kmh
        raise VehicleError(SCHEMA_FIELDS.get(error.field, error.field), value, error.allowed) from error


def road_load_si(sent: RoadLoad) -> tuple[float, float, float]:
    """Road-load coefficients [N, N/(m/s), N/(m/s)²]."""
    if isinstance(sent, RoadLoadEpa):
        return (
            sent.a_lbf * NEWTON_PER_LBF,
            sent.b_lbf_per_mph * NEWTON_PER_LBF / MPS_PER_MPH,
            sent.c_lbf_per_mph2 * NEWTON_PER_LBF / MPS_PER_MPH**2,
        )
    return sent.a_n, sent.b_n_per_kmh * KMH_PER_MPS, sent.c_n_per_kmh2 * KMH_PER_MPS**2


def inline_with_tables(sent: InlineVehicle, vehicle: Vehicle) -> InlineVehicle:
    """An inline vehicle as understood: with the acceleration tables that apply."""
    return sent if sent.acceleration is not None else sent.model_copy(update={"acceleration": _acceleration(vehicle)})


def vehicle_summary(vehicle: Vehicle, default_id: str) -> VehicleSummary:
    """A vehicle's line in the list."""
    return VehicleSummary(
        id=vehicle.id,
        name=vehicle.name,
        powertrain=vehicle.powertrain,
        usable_capacity_kwh=vehicle.usable_capacity_wh / WH_PER_KWH,
        mass_kg=vehicle.mass_kg,
        default=vehicle.id == default_id,
    )


def vehicle_detail(vehicle: Vehicle) -> VehicleDetail:
    """All of a vehicle's numbers with their sources."""
    return VehicleDetail(
        id=vehicle.id,
        name=vehicle.name,
        powertrain=vehicle.powertrain,
        mass_kg=vehicle.mass_kg,
        road_load=RoadLoadMetric(
            a_n=vehicle.road_load_a_n,
            b_n_per_kmh=vehicle.road_load_b_n_per_mps / KMH_PER_MPS,
            c_n_per_kmh2=vehicle.road_load_c_n_per_mps2 / KMH_PER_MPS**2,
        ),
        rotating_mass_coef=vehicle.rotating_mass_coef,
        drive_eff=vehicle.drive_eff,
        recuperation_eff=vehicle.recuperation_eff,
        aux_power_w=vehicle.aux_power_w,
        aux_move_eff=vehicle.aux_move_eff,
        aux_idle_eff=vehicle.aux_idle_eff,
        usable_capacity_kwh=vehicle.usable_capacity_wh / WH_PER_KWH,
        acceleration=_acceleration(vehicle),
        sources={SCHEMA_FIELDS.get(name, name): source for name, source in vehicle.sources.items()},
    )


def _acceleration(vehicle: Vehicle) -> Acceleration:
    return Acceleration(
        speed_kmh=(vehicle.accel_speed_mps * KMH_PER_MPS).round(9).tolist(),
        accel_mps2=vehicle.accel_mps2.tolist(),
        decel_mps2=vehicle.decel_mps2.tolist(),
    )
