"""What each parameter and each left-out effect would do to a recorded drive: columns of energy, window by window.

A column is the extra battery energy for one unit of its coefficient, at the recorded speed and grade. Columns of the
vehicle's own parameters are derivatives of the replayed energy; those of effects are the terms of docs/effects.md, so
that a coefficient found for one is a coefficient of the model. Every sum over a drive is exact for what is linear.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from enum import StrEnum
from typing import TYPE_CHECKING, Final

import numpy as np

from diagnosis.errors import DiagnosisError
from energy.effects import REFERENCE_K
from energy.replay import graded, replay

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from numpy.typing import NDArray

    from diagnosis.recordings import Recording
    from energy.replay import DrivenProfile
    from energy.vehicle import Vehicle

WINDOW_S: Final = 10.0  # long against the lag between speed and current, short against what changes in a drive
WINDOW_RANGE_S: Final = (1.0, 600.0)


class Family(StrEnum):
    """What kind of cause a column belongs to."""

    THERMAL = "thermal"
    ROLLING = "rolling"
    AERODYNAMIC = "aerodynamic"
    MASS = "mass"
    DRIVETRAIN = "drivetrain"
    RECUPERATION = "recuperation"
    AUXILIARY = "auxiliary"


@dataclass(frozen=True, slots=True)
class Drive:
    """One recorded drive as columns see it: vehicle, graded profile, and per step (n,) what they multiply.

    simulated_j: replayed energy without any effect. duration_s, since_start_s (at the middle of a step). ambient_k: air
    temperature of the drive, None where it was not recorded.
    """

    vehicle: Vehicle
    profile: DrivenProfile
    simulated_j: NDArray[np.float64]
    duration_s: NDArray[np.float64]
    since_start_s: NDArray[np.float64]
    ambient_k: float | None


@dataclass(frozen=True, slots=True)
class Column:
    """A cause that can be fitted: its coefficient's name and unit, and the energy [J] of one unit of it, float64 (n,).

    positive: whether the coefficient can only add energy. needs_ambient: whether it is nothing without temperature.
    """

    name: str
    unit: str
    family: Family
    energy_j: Callable[[Drive], NDArray[np.float64]]
    positive: bool = False
    needs_ambient: bool = False


@dataclass(frozen=True, slots=True)
class TripWindows:
    """One trip in windows of equal length, each array with one value a window.

    columns_j: float64 (n, k), in the order of names. measured_j and simulated_j: from the battery. standing_s: of
    duration_s. begin_s: since the start of the recording.
    """

    trip_id: str
    ambient_k: float | None
    names: tuple[str, ...]
    begin_s: NDArray[np.float64]
    duration_s: NDArray[np.float64]
    distance_m: NDArray[np.float64]
    standing_s: NDArray[np.float64]
    measured_j: NDArray[np.float64]
    simulated_j: NDArray[np.float64]
    columns_j: NDArray[np.float64]

    def residual_j(self) -> NDArray[np.float64]:
        """Measured less simulated energy of each window, float64 (n,) [J]."""
        return self.measured_j - self.simulated_j


def trip_windows(
    recording: Recording, vehicle: Vehicle, columns: Sequence[Column], *, window_s: float = WINDOW_S
) -> TripWindows:
    """A recording in windows with its columns; the last window is as long as what is left.

    Energy is summed over whole steps of a second, so that windows add up to the trip. Columns that need the air
    temperature are 0 where it was not recorded.

    Raises DiagnosisError for a window length out of range; replay's errors where the profile cannot be driven.
    """
    if not WINDOW_RANGE_S[0] <= window_s <= WINDOW_RANGE_S[1]:
        raise DiagnosisError(f"window_s is {window_s:g}, allowed: {WINDOW_RANGE_S[0]:g}..{WINDOW_RANGE_S[1]:g}")
    drive = drive_of_recording(recording, vehicle)
    profile = drive.profile
    since_s = profile.time_s - profile.time_s[0]
    window = np.minimum(since_s[:-1] / window_s, float(np.iinfo(np.int64).max)).astype(np.int64)

    def summed(values: NDArray[np.float64]) -> NDArray[np.float64]:
        return np.asarray(np.bincount(window, weights=values), np.float64)

    step = np.diff(recording.time_s)
    drawn_j = np.concatenate(([0.0], np.cumsum(0.5 * (recording.power_w[1:] + recording.power_w[:-1]) * step)))
    measured_j = np.diff(np.interp(profile.time_s, recording.time_s, drawn_j))
    step_m = profile.step_m()
    return TripWindows(
        trip_id=recording.id,
        ambient_k=drive.ambient_k,
        names=tuple(column.name for column in columns),
        begin_s=window_s * np.arange(int(window[-1]) + 1, dtype=np.float64),
        duration_s=summed(drive.duration_s),
        distance_m=summed(step_m),
        standing_s=summed(np.where(step_m <= 0.0, drive.duration_s, 0.0)),
        measured_j=summed(measured_j),
        simulated_j=summed(drive.simulated_j),
        columns_j=np.column_stack([summed(_energy_j(column, drive)) for column in columns])
        if columns
        else np.empty((int(window[-1]) + 1, 0)),
    )


def drive_of_recording(recording: Recording, vehicle: Vehicle) -> Drive:
    """A recording replayed with a vehicle without any effect, and what columns need of it."""
    profile = graded(recording.profile())
    duration_s = np.diff(profile.time_s)
    ambient_k = None
    if recording.ambient_k is not None and not bool(np.isnan(recording.ambient_k).all()):
        ambient_k = float(np.nanmedian(recording.ambient_k))
    return Drive(
        vehicle=vehicle,
        profile=profile,
        simulated_j=replay(vehicle, profile).step_energy_j,
        duration_s=duration_s,
        since_start_s=profile.time_s[:-1] + 0.5 * duration_s - profile.time_s[0],
        ambient_k=ambient_k,
    )


def parameter_columns() -> tuple[Column, ...]:
    """The vehicle's own parameters: what lies in their span is a parameter error, not left-out physics."""
    return tuple(
        Column(name, unit, family, _derivative(name, step))
        for name, unit, family, step in (
            ("mass_kg", "kg", Family.MASS, 5.0),
            ("road_load_a_n", "N", Family.ROLLING, 2.0),
            ("road_load_b_n_per_mps", "N/(m/s)", Family.AERODYNAMIC, 0.1),
            ("road_load_c_n_per_mps2", "N/(m/s)²", Family.AERODYNAMIC, 0.01),
            ("drive_eff", "1", Family.DRIVETRAIN, 0.002),
            ("recuperation_eff", "1", Family.RECUPERATION, 0.005),
            ("aux_power_w", "W", Family.AUXILIARY, 10.0),
        )
    )


def effect_columns(target_k: float, time_constants_s: Sequence[float]) -> tuple[Column, ...]:
    """Effects of temperature and time that the base model leaves out, for a wanted cabin temperature [K].

    Heating and cooling, steady [W/K] and decaying from the start with each time constant [W/K]; rolling resistance
    against temperature [1/K] and against time since the start [-]; density of the air [-].
    """

    def cold(drive: Drive) -> float:
        return max(target_k - _known(drive), 0.0)

    def hot(drive: Drive) -> float:
        return max(_known(drive) - target_k, 0.0)

    found = [
        Column("heating_w_per_k", "W/K", Family.THERMAL, lambda d: cold(d) * d.duration_s, True, True),
        Column("cooling_w_per_k", "W/K", Family.THERMAL, lambda d: hot(d) * d.duration_s, True, True),
    ]
    for tau_s in time_constants_s:
        for name, away in (("warm_up", cold), ("pull_down", hot)):
            found.append(
                Column(f"{name}_{tau_s:g}s_w_per_k", "W/K", Family.THERMAL, _decaying(away, tau_s), True, True)
            )
        found.append(Column(f"tyre_warm_up_{tau_s:g}s", "1", Family.ROLLING, _warming_tyres(tau_s), True))
    found.append(
        Column(
            "rolling_temp_per_k",
            "1/K",
            Family.ROLLING,
            lambda d: _rolling_j(d) * (REFERENCE_K - _known(d)),
            True,
            True,
        )
    )
    found.append(
        Column(
            "air_density",
            "1",
            Family.AERODYNAMIC,
            lambda d: _drag_j(d) * (REFERENCE_K / _known(d) - 1.0),
            True,
            True,
        )
    )
    return tuple(found)


def _energy_j(column: Column, drive: Drive) -> NDArray[np.float64]:
    if column.needs_ambient and drive.ambient_k is None:
        return np.zeros_like(drive.duration_s)
    return column.energy_j(drive)


def _known(drive: Drive) -> float:
    assert drive.ambient_k is not None, "columns that need the temperature are not asked without it"
    return drive.ambient_k


def _derivative(name: str, step: float) -> Callable[[Drive], NDArray[np.float64]]:
    """Central difference of the replayed energy by one field of the vehicle; exact where it is linear."""

    def energy_j(drive: Drive) -> NDArray[np.float64]:
        value = getattr(drive.vehicle, name)
        above, below = (
            replay(replace(drive.vehicle, **{name: value + shift}), drive.profile).step_energy_j
            for shift in (step, -step)
        )
        return (above - below) / (2.0 * step)

    return energy_j


def _decaying(away: Callable[[Drive], float], tau_s: float) -> Callable[[Drive], NDArray[np.float64]]:
    """Power away from the target that decays from the start, integrated exactly over each step."""

    def energy_j(drive: Drive) -> NDArray[np.float64]:
        begin_s = drive.since_start_s - 0.5 * drive.duration_s
        decayed = np.exp(-begin_s / tau_s) * -np.expm1(-drive.duration_s / tau_s)
        return np.asarray(away(drive) * tau_s * decayed, np.float64)

    return energy_j


def _warming_tyres(tau_s: float) -> Callable[[Drive], NDArray[np.float64]]:
    """Rolling resistance that is higher at the start and decays, at the middle of each step."""

    def energy_j(drive: Drive) -> NDArray[np.float64]:
        return np.asarray(_rolling_j(drive) * np.exp(-drive.since_start_s / tau_s), np.float64)

    return energy_j


def _rolling_j(drive: Drive) -> NDArray[np.float64]:
    """Battery energy of the vehicle's rolling resistance: of all of A, where the sign of the force stays."""
    return _derivative("road_load_a_n", 2.0)(drive) * drive.vehicle.road_load_a_n


def _drag_j(drive: Drive) -> NDArray[np.float64]:
    """Battery energy of the vehicle's aerodynamic drag: of all of C, where the sign of the force stays."""
    return _derivative("road_load_c_n_per_mps2", 0.01)(drive) * drive.vehicle.road_load_c_n_per_mps2


def weighted_columns(trips: Sequence[TripWindows]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Columns (N, k) and residuals (N,) of all windows of trips, each trip with the same weight in all.

    The trip is the unit of inference: a long one must not count for more than a short one because it has more windows.
    """
    if not trips:
        raise DiagnosisError("no trips, at least one is needed")
    weight = [1.0 / math.sqrt(trip.begin_s.size) for trip in trips]
    columns = np.vstack([w * trip.columns_j for w, trip in zip(weight, trips, strict=True)])
    residual = np.concatenate([w * trip.residual_j() for w, trip in zip(weight, trips, strict=True)])
    return columns, residual
