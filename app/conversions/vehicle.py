"""Vehicles between human units and the energy package."""

from __future__ import annotations

from types import MappingProxyType
from typing import TYPE_CHECKING

import numpy as np

from app.conversions.consumption_table import table_vehicle_answer, table_vehicle_detail, table_vehicle_from_sent
from app.conversions.effects import effects_answer, effects_from_sent
from app.conversions.quantities import WH_PER_KWH, inside_names, inside_sd, shown_names, shown_sd
from app.conversions.vehicles.charging import charging_answer, charging_from_sent, charging_sources
from app.schemas.vehicles.answer import TableVehicleDetail, VehicleDetail, VehicleKind, VehicleSummary
from app.schemas.vehicles.vehicle import (
    Acceleration,
    InlineTableVehicle,
    InlineVehicle,
    RoadLoad,
    RoadLoadEpa,
    RoadLoadMetric,
    SentVehicle,
)
from energy.errors import INLINE_ID, VehicleError
from energy.units import KMH_PER_MPS, MPS_PER_MPH, NEWTON_PER_LBF
from energy.vehicle.consumption_table import ConsumptionTableVehicle
from energy.vehicle.vehicle import Vehicle

if TYPE_CHECKING:
    from app.schemas.vehicles.answer import AnyVehicleDetail
    from energy.vehicle.files import AnyVehicle


def vehicle_from_sent(sent: SentVehicle, tables_from: AnyVehicle | None, vehicle_id: str = INLINE_ID) -> AnyVehicle:
    """The vehicle that a request or a stored document describes, in SI units.

    tables_from: whose acceleration tables apply where none are sent; None only where they are.

    Raises VehicleError with the names of the schema, and with the id.
    """
    try:
        if isinstance(sent, InlineTableVehicle):
            return table_vehicle_from_sent(sent, vehicle_id)
        return _physical_from_sent(sent, tables_from, vehicle_id)
    except VehicleError as error:
        raise VehicleError(error.field, error.value, error.allowed, vehicle_id) from error


def _physical_from_sent(sent: InlineVehicle, tables_from: AnyVehicle | None, vehicle_id: str) -> Vehicle:
    a_n, b_n_per_mps, c_n_per_mps2 = road_load_si(sent.road_load)
    if sent.acceleration is not None:
        speed_mps = np.array(sent.acceleration.speed_kmh, np.float64) / KMH_PER_MPS
        accel = np.array(sent.acceleration.accel_mps2, np.float64)
        decel = np.array(sent.acceleration.decel_mps2, np.float64)
    elif isinstance(tables_from, Vehicle):
        speed_mps, accel, decel = tables_from.accel_speed_mps, tables_from.accel_mps2, tables_from.decel_mps2
    else:
        allowed = "required, since there are no tables of a default vehicle"
        raise VehicleError("acceleration", "missing", allowed)
    effects = effects_from_sent(sent.effects)
    try:
        return Vehicle(
            id=vehicle_id,
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
            sources=MappingProxyType(inside_names(sent.sources)),
            sd=MappingProxyType(inside_sd(sent.sd)),
            effects=effects,
            charging=charging_from_sent(sent.charging, sent.sources),
        )
    except VehicleError as error:
        value = error.value
        if error.field == "accel_speed_mps" and sent.acceleration is not None:
            value = sent.acceleration.speed_kmh
        (field,) = shown_names({error.field: ""})
        raise VehicleError(field, value, error.allowed) from error


def road_load_si(sent: RoadLoad) -> tuple[float, float, float]:
    """Road-load coefficients [N, N/(m/s), N/(m/s)²]."""
    if isinstance(sent, RoadLoadEpa):
        return (
            sent.a_lbf * NEWTON_PER_LBF,
            sent.b_lbf_per_mph * NEWTON_PER_LBF / MPS_PER_MPH,
            sent.c_lbf_per_mph2 * NEWTON_PER_LBF / MPS_PER_MPH**2,
        )
    return sent.a_n, sent.b_n_per_kmh * KMH_PER_MPS, sent.c_n_per_kmh2 * KMH_PER_MPS**2


def sent_with_tables(sent: SentVehicle, vehicle: AnyVehicle) -> SentVehicle:
    """A vehicle as understood: with the acceleration tables that apply."""
    if isinstance(sent, InlineTableVehicle) or sent.acceleration is not None or not isinstance(vehicle, Vehicle):
        return sent
    return sent.model_copy(update={"acceleration": _acceleration(vehicle)})


def vehicle_summary(vehicle: AnyVehicle, default_id: str, *, bundled: bool) -> VehicleSummary:
    """A vehicle's line in the list."""
    physical = isinstance(vehicle, Vehicle)
    return VehicleSummary(
        id=vehicle.id,
        name=vehicle.name,
        kind=VehicleKind.PHYSICAL if physical else VehicleKind.CONSUMPTION_TABLE,
        bundled=bundled,
        powertrain=vehicle.powertrain,
        usable_capacity_kwh=vehicle.usable_capacity_wh / WH_PER_KWH,
        mass_kg=vehicle.mass_kg if isinstance(vehicle, Vehicle) else None,
        connectors=[] if vehicle.charging is None else list(vehicle.charging.connectors),
        default=vehicle.id == default_id,
    )


def vehicle_detail(vehicle: AnyVehicle) -> AnyVehicleDetail:
    """All of a vehicle's numbers with their sources."""
    if isinstance(vehicle, ConsumptionTableVehicle):
        return table_vehicle_answer(vehicle)
    return VehicleDetail(
        id=vehicle.id,
        kind="physical",
        name=vehicle.name,
        powertrain=vehicle.powertrain,
        mass_kg=vehicle.mass_kg,
        road_load=_road_load_metric(vehicle),
        rotating_mass_coef=vehicle.rotating_mass_coef,
        drive_eff=vehicle.drive_eff,
        recuperation_eff=vehicle.recuperation_eff,
        aux_power_w=vehicle.aux_power_w,
        aux_move_eff=vehicle.aux_move_eff,
        aux_idle_eff=vehicle.aux_idle_eff,
        usable_capacity_kwh=vehicle.usable_capacity_wh / WH_PER_KWH,
        acceleration=_acceleration(vehicle),
        effects=effects_answer(vehicle.effects),
        charging=charging_answer(vehicle.charging),
        sources=shown_names(vehicle.sources) | charging_sources(vehicle.charging),
        sd=shown_sd(vehicle.sd),
    )


def detail_of_sent(sent: SentVehicle, vehicle: AnyVehicle) -> VehicleDetail | TableVehicleDetail:
    """All numbers of a vehicle that was sent, to the digit as they were sent where they are in the same unit.

    vehicle: what `vehicle_from_sent` made of it.
    """
    if isinstance(sent, InlineTableVehicle):
        return table_vehicle_detail(sent, vehicle)
    assert isinstance(vehicle, Vehicle), "a vehicle sent by its physics is one"
    same = {name: getattr(sent, name) for name in VehicleDetail.model_fields if name in InlineVehicle.model_fields}
    given = {} if sent.effects is None else sent.effects.model_dump(exclude_none=True)
    metric = isinstance(sent.road_load, RoadLoadMetric)
    changed = {
        "id": vehicle.id,
        "road_load": sent.road_load if metric else _road_load_metric(vehicle),
        "acceleration": sent.acceleration or _acceleration(vehicle),
        "effects": effects_answer(vehicle.effects).model_copy(update=given),
        "charging": charging_answer(vehicle.charging, sent.charging),
        "sd": sent.sd if metric else shown_sd(vehicle.sd),
    }
    return VehicleDetail(**{**same, **changed})


def _road_load_metric(vehicle: Vehicle) -> RoadLoadMetric:
    return RoadLoadMetric(
        a_n=vehicle.road_load_a_n,
        b_n_per_kmh=vehicle.road_load_b_n_per_mps / KMH_PER_MPS,
        c_n_per_kmh2=vehicle.road_load_c_n_per_mps2 / KMH_PER_MPS**2,
    )


def _acceleration(vehicle: Vehicle) -> Acceleration:
    return Acceleration(
        speed_kmh=(vehicle.accel_speed_mps * KMH_PER_MPS).round(9).tolist(),
        accel_mps2=vehicle.accel_mps2.tolist(),
        decel_mps2=vehicle.decel_mps2.tolist(),
    )
