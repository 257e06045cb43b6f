"""A vehicle's self-check on driving cycles into an answer."""

from __future__ import annotations

from typing import TYPE_CHECKING, get_args

from app.schemas.vehicles.check import CycleFigure, VehicleCheck
from energy.vehicle.self_check import CycleName, bundled_cycle, cycle_consumption, self_check

if TYPE_CHECKING:
    from energy.vehicle.files import AnyVehicle
    from energy.vehicle.published import Published


def vehicle_check(vehicle: AnyVehicle, published: Published | None) -> VehicleCheck:
    """What a vehicle takes on every cycle, and each published figure beside the model's."""
    checked = self_check(vehicle, published)
    return VehicleCheck(
        id=vehicle.id,
        battery_kwh_per_100km={name: cycle_consumption(vehicle, bundled_cycle(name)) for name in get_args(CycleName)},
        figures=[
            CycleFigure(
                figure=check.figure,
                cycle=check.cycle,
                model_kwh_per_100km=check.model_kwh_per_100km,
                published_kwh_per_100km=check.published_kwh_per_100km,
                ratio=check.ratio,
                allowed_ratio=check.band,
                met=check.met,
            )
            for check in checked.checks
        ],
        met=checked.met,
    )
