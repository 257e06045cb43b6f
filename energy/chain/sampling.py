"""Vehicles whose parameters are drawn by their standard deviations, and the residuals of the model itself."""

from __future__ import annotations

import zlib
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from energy.errors import ConditionsError, VehicleError
from energy.vehicle.coefficients import COEFFICIENT_RANGES
from energy.vehicle.vehicle import MOST_RESIDUAL_SD_FRAC, Vehicle

if TYPE_CHECKING:
    from collections.abc import Mapping

    from numpy.typing import NDArray

    from energy.vehicle.consumption_table import ConsumptionTableVehicle

# Source, table VII: standard deviation of the energy error over its 23 trips, parameters set from real drives. Its
# speeds, stops and climate were simulated, so it holds the error of the driving profile as well.
RESIDUAL_SD_FRAC: Final = 0.104
SAMPLES: Final = 200
MOST_SAMPLES: Final = 10_000
SEED: Final = 20_220_923
TRIES: Final = 64  # draws for one vehicle before its standard deviations are refused


@dataclass(frozen=True, slots=True)
class Sampling:
    """How many vehicles and residuals are drawn, by which seed, and how far the residual spreads."""

    samples: int = SAMPLES
    seed: int = SEED
    residual_sd_frac: float = RESIDUAL_SD_FRAC


STANDARD_SAMPLING: Final = Sampling()


def sampling_of(vehicle: Vehicle | ConsumptionTableVehicle, sampling: Sampling) -> Sampling:
    """The sampling with the vehicle's own residual, where that was measured."""
    own = vehicle.residual_sd_frac if isinstance(vehicle, Vehicle) else None
    return sampling if own is None else replace(sampling, residual_sd_frac=own)


def sampled_vehicles(
    vehicle: Vehicle | ConsumptionTableVehicle, count: int, seed: int = SEED
) -> tuple[Vehicle | ConsumptionTableVehicle, ...]:
    """Vehicles whose parameters are drawn from independent normals by `vehicle.sd`, cut off at what a vehicle can be.

    A draw that the vehicle or its effect coefficients refuse is drawn anew as a whole. An array moves as a whole, by
    one draw. Each field has its own stream of random numbers, and the first vehicles of a larger count are those of a
    smaller one. A vehicle without standard deviations gives itself, count times.

    Raises VehicleError where a field is unknown, a standard deviation negative, or TRIES draws are refused in a row.
    """
    check_within("samples", count, 1, MOST_SAMPLES)
    for name, sd in vehicle.sd.items():
        if not _has(vehicle, name):
            raise VehicleError(f"sd.{name}", sd, "a field of the vehicle, or effects.<field>", vehicle.id)
        if not 0.0 <= sd < np.inf:
            raise VehicleError(f"sd.{name}", sd, "a finite number, at least 0", vehicle.id)
    names = [name for name, sd in vehicle.sd.items() if sd > 0.0]
    if not names:
        return (vehicle,) * count
    shifts = np.stack([vehicle.sd[name] * _normals(name, seed, (count, TRIES)) for name in names], axis=-1)
    return tuple(_first_possible(vehicle, names, shifts[k]) for k in range(count))


def residual_fracs(count: int, seed: int = SEED, sd_frac: float = RESIDUAL_SD_FRAC) -> NDArray[np.float64]:
    """Factors f on the dissipated energy, float64 (count,), normal with sd_frac and never below −1 [-]."""
    check_within("samples", count, 1, MOST_SAMPLES)
    check_within("residual_sd_frac", sd_frac, 0.0, MOST_RESIDUAL_SD_FRAC)
    return np.maximum(sd_frac * _normals("residual", seed, (count,)), -1.0)


def shifted_vehicle(
    vehicle: Vehicle | ConsumptionTableVehicle, shifts: Mapping[str, float]
) -> Vehicle | ConsumptionTableVehicle:
    """The vehicle with numbers moved by shifts, by the names and in the units of its `sd`; arrays as a whole.

    Raises VehicleError or ConditionsError where no vehicle can be so.
    """
    own: dict[str, Any] = {}
    effects: dict[str, Any] = {}
    for name, shift in shifts.items():
        if isinstance(vehicle, Vehicle) and name.startswith("effects."):
            field = name.removeprefix("effects.")
            effects[field] = getattr(vehicle.effects, field) + shift
        else:
            own[name] = getattr(vehicle, name) + shift
    if isinstance(vehicle, Vehicle) and effects:
        own["effects"] = replace(vehicle.effects, **effects)
    return replace(vehicle, **own)


def check_within(field: str, value: float, low: float, high: float) -> None:
    """Raise ConditionsError unless a value is within a range, both ends included."""
    if not low <= value <= high:
        raise ConditionsError(field, value, f"{low:g}..{high:g}")


def _has(vehicle: Vehicle | ConsumptionTableVehicle, name: str) -> bool:
    if name.startswith("effects."):
        field = name.removeprefix("effects.")
        return (
            isinstance(vehicle, Vehicle) and field in COEFFICIENT_RANGES and getattr(vehicle.effects, field) is not None
        )
    return isinstance(getattr(vehicle, name, None), int | float | np.ndarray)


def _normals(name: str, seed: int, shape: tuple[int, ...]) -> NDArray[np.float64]:
    """Standard normal numbers of one field's own stream, float64 of the shape."""
    return np.random.default_rng((seed, zlib.crc32(name.encode()))).standard_normal(shape)


def _first_possible(
    vehicle: Vehicle | ConsumptionTableVehicle, names: list[str], shifts: NDArray[np.float64]
) -> Vehicle | ConsumptionTableVehicle:
    """The vehicle shifted by the first row of shifts (tries, names) that it does not refuse."""
    refused = None
    for row in shifts:
        try:
            return shifted_vehicle(vehicle, dict(zip(names, row.tolist(), strict=True)))
        except (VehicleError, ConditionsError) as error:
            refused = error
    allowed = f"small enough that one of {TRIES} draws can be a vehicle; the last was refused: {refused}"
    raise VehicleError("sd", dict(vehicle.sd), allowed, vehicle.id)
