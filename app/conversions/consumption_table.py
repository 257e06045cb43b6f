"""Vehicles given as consumption tables between human units and energy.vehicle.consumption_table."""

from __future__ import annotations

from types import MappingProxyType
from typing import TYPE_CHECKING

import numpy as np

from app.conversions.quantities import WH_PER_KWH, inside_names, inside_sd, shown_names, shown_sd
from app.conversions.vehicles.charging import charging_answer, charging_from_sent, charging_sources
from app.schemas.vehicles.answer import TableVehicleDetail
from app.schemas.vehicles.vehicle import Consumption, InlineTableVehicle, Kinetic
from energy.errors import VehicleError
from energy.units import JOULE_PER_M_PER_KWH_PER_100KM, JOULE_PER_WH, KMH_PER_MPS
from energy.vehicle.consumption_table import ConsumptionTableVehicle

if TYPE_CHECKING:
    from energy.vehicle.files import AnyVehicle

SPEED_DIGITS = 9  # of km/h, so that 50 km/h inside is shown as 50


def table_vehicle_from_sent(sent: InlineTableVehicle, vehicle_id: str) -> ConsumptionTableVehicle:
    """The vehicle that a request or a stored document describes; raises VehicleError with the schema's names."""
    _check_tables(sent.consumption)
    if sent.descent_wh_per_m > sent.ascent_wh_per_m:
        allowed = f"at most ascent_wh_per_m, {sent.ascent_wh_per_m:g}"
        raise VehicleError("descent_wh_per_m", sent.descent_wh_per_m, allowed)
    kinetic = sent.kinetic
    try:
        return ConsumptionTableVehicle(
            id=vehicle_id,
            name=sent.name,
            speed_mps=np.array(sent.consumption.speed_kmh, np.float64) / KMH_PER_MPS,
            consumption_j_per_m=np.array(sent.consumption.kwh_per_100km, np.float64) * JOULE_PER_M_PER_KWH_PER_100KM,
            ascent_j_per_m=sent.ascent_wh_per_m * JOULE_PER_WH,
            descent_j_per_m=sent.descent_wh_per_m * JOULE_PER_WH,
            aux_power_w=sent.aux_power_w,
            usable_capacity_wh=sent.usable_capacity_kwh * WH_PER_KWH,
            kinetic_up_kg=0.0 if kinetic is None else kinetic.mass_kg / kinetic.acceleration_eff,
            kinetic_down_kg=0.0 if kinetic is None else kinetic.mass_kg * kinetic.deceleration_eff,
            powertrain=sent.powertrain,
            sources=MappingProxyType(inside_names(sent.sources)),
            sd=MappingProxyType(inside_sd(sent.sd)),
            charging=charging_from_sent(sent.charging, sent.sources),
        )
    except VehicleError as error:
        (field,) = shown_names({error.field: ""})
        raise VehicleError(field, error.value, error.allowed) from error


def _check_tables(sent: Consumption) -> None:
    speeds, values = sent.speed_kmh, sent.kwh_per_100km
    if len(speeds) != len(values):
        raise VehicleError(
            "consumption.kwh_per_100km", f"{len(values)} values", f"{len(speeds)}, one for each of speed_kmh"
        )
    # compared as they are driven: two speeds may differ by less than their conversion keeps
    if not bool(np.all(np.diff(np.array(speeds, np.float64) / KMH_PER_MPS) > 0.0)):
        raise VehicleError("consumption.speed_kmh", speeds, "rising")


def table_vehicle_answer(vehicle: ConsumptionTableVehicle) -> TableVehicleDetail:
    """All of a vehicle's numbers with their sources; its kinetic figures as of a mass that gains speed without loss."""
    up_kg, down_kg = vehicle.kinetic_up_kg, vehicle.kinetic_down_kg
    return TableVehicleDetail(
        id=vehicle.id,
        kind="consumption_table",
        name=vehicle.name,
        powertrain=vehicle.powertrain,
        consumption=Consumption(
            speed_kmh=(vehicle.speed_mps * KMH_PER_MPS).round(SPEED_DIGITS).tolist(),
            kwh_per_100km=(vehicle.consumption_j_per_m / JOULE_PER_M_PER_KWH_PER_100KM).tolist(),
        ),
        ascent_wh_per_m=vehicle.ascent_j_per_m / JOULE_PER_WH,
        descent_wh_per_m=vehicle.descent_j_per_m / JOULE_PER_WH,
        kinetic=Kinetic(mass_kg=up_kg, acceleration_eff=1.0, deceleration_eff=down_kg / up_kg) if up_kg > 0.0 else None,
        aux_power_w=vehicle.aux_power_w,
        usable_capacity_kwh=vehicle.usable_capacity_wh / WH_PER_KWH,
        charging=charging_answer(vehicle.charging),
        sources=shown_names(vehicle.sources) | charging_sources(vehicle.charging),
        sd=shown_sd(vehicle.sd),
    )


def table_vehicle_detail(sent: InlineTableVehicle, vehicle: AnyVehicle) -> TableVehicleDetail:
    """All numbers of a vehicle as they were sent; vehicle: what was made of it."""
    same = {name: getattr(sent, name) for name in TableVehicleDetail.model_fields if name != "id"}
    return TableVehicleDetail(id=vehicle.id, **(same | {"charging": charging_answer(vehicle.charging, sent.charging)}))
