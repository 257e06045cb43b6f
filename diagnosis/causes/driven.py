"""One recorded drive as effects see it: replayed step by step, with every channel at the middle of each step."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Final

import numpy as np

from energy.conditions import STILL, Conditions
from energy.replay.replay import SMOOTHING_M, graded, replay
from energy.units import GRAVITY_MPS2

if TYPE_CHECKING:
    from collections.abc import Mapping

    from numpy.typing import NDArray

    from diagnosis.causes.battery import BatteryLoss
    from diagnosis.recordings.reading import Recording
    from energy.replay.replay import DrivenProfile
    from energy.vehicle.vehicle import Vehicle

ROUGHER_M: Final = 2.0 * SMOOTHING_M
TURN_SMOOTHING_S: Final = 5  # of the heading, before it is differentiated
LEAST_TURN_MPS: Final = 3.0  # slower than this a heading from positions is noise
CHANNELS: Final = ("soc_frac", "battery_k", "wind_speed_mps", "wet_frac", "payload_kg", "latitude_deg", "longitude_deg")


@dataclass(frozen=True, slots=True)
class ReplayedDrive:
    """A drive in n steps, each array float64 (n,), and the vehicle that replays it.

    force_n: at the wheels, of the vehicle without effects. factor: battery energy over work at the wheels, by the sign
    of the force. power_w: simulated, at the battery. since_s: from the first sample to the middle of the step.
    ambient_k: median of the drive. channels: what else was recorded, by the names of Recording; altitude_m and heading
    (radian, clockwise from north) among them, curvature_per_m with the latter.
    battery: what voltage tells of it.
    """

    vehicle: Vehicle
    profile: DrivenProfile
    duration_s: NDArray[np.float64]
    speed_mps: NDArray[np.float64]
    accel_mps2: NDArray[np.float64]
    grade_frac: NDArray[np.float64]
    force_n: NDArray[np.float64]
    factor: NDArray[np.float64]
    power_w: NDArray[np.float64]
    since_s: NDArray[np.float64]
    ambient_k: float | None
    channels: Mapping[str, NDArray[np.float64]]
    battery: BatteryLoss | None = None

    def work_j(self, force_n: NDArray[np.float64] | float) -> NDArray[np.float64]:
        """Battery energy of an extra force against the way, float64 (n,) [J]; small against the force that is there."""
        return np.asarray(self.factor * force_n * self.speed_mps * self.duration_s, np.float64)

    def recovered_w(self) -> NDArray[np.float64]:
        """Power that recuperation gives to the battery, ≥ 0, float64 (n,) [W]."""
        work_w = np.minimum(self.force_n * self.speed_mps, 0.0)
        return np.asarray(-self.vehicle.recuperation_eff * work_w, np.float64)


def driven(recording: Recording, vehicle: Vehicle, battery: BatteryLoss | None = None) -> ReplayedDrive:
    """A recording replayed with a vehicle without any effect; raises replay's errors where it cannot be driven.

    battery: what voltage has told of the vehicle's battery, on this drive or others.
    """
    profile = graded(recording.profile())
    duration_s = np.diff(profile.time_s)
    speed = 0.5 * (profile.speed_mps[:-1] + profile.speed_mps[1:])
    accel = np.diff(profile.speed_mps) / duration_s
    grade = np.zeros_like(speed) if profile.grade_frac is None else profile.grade_frac
    force = wheel_force_n(vehicle, speed, accel, grade)
    middle_s = 0.5 * (profile.time_s[:-1] + profile.time_s[1:])
    ambient_k = None
    if recording.ambient_k is not None and not bool(np.isnan(recording.ambient_k).all()):
        ambient_k = float(np.nanmedian(recording.ambient_k))
    return ReplayedDrive(
        vehicle=vehicle,
        profile=profile,
        duration_s=duration_s,
        speed_mps=speed,
        accel_mps2=accel,
        grade_frac=grade,
        force_n=force,
        factor=np.where(force >= 0.0, 1.0 / vehicle.drive_eff, vehicle.recuperation_eff),
        power_w=replay(vehicle, profile).power_w,
        since_s=middle_s - profile.time_s[0],
        ambient_k=ambient_k,
        channels=_channels(recording, profile, middle_s, speed),
        battery=battery,
    )


def with_vehicle(drive: ReplayedDrive, vehicle: Vehicle) -> ReplayedDrive:
    """The same drive replayed with another vehicle."""
    force = wheel_force_n(vehicle, drive.speed_mps, drive.accel_mps2, drive.grade_frac)
    return replace(
        drive,
        vehicle=vehicle,
        force_n=force,
        factor=np.where(force >= 0.0, 1.0 / vehicle.drive_eff, vehicle.recuperation_eff),
        power_w=replay(vehicle, drive.profile).power_w,
    )


def wheel_force_n(
    vehicle: Vehicle, speed_mps: NDArray[np.float64], accel_mps2: NDArray[np.float64], grade_frac: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Force at the wheels by the source's equation (4), float64 (n,) [N]; 0 where the vehicle stands."""
    flat = np.sqrt(np.maximum(1.0 - grade_frac * grade_frac, 0.0))
    load = vehicle.road_load_a_n * flat
    load = load + (vehicle.road_load_b_n_per_mps + vehicle.road_load_c_n_per_mps2 * speed_mps) * speed_mps
    force = load + vehicle.mass_kg * (vehicle.rotating_mass_coef * accel_mps2 + GRAVITY_MPS2 * grade_frac)
    return np.asarray(np.where(speed_mps > 0.0, force, 0.0), np.float64)


def rougher_grade(recording: Recording, smoothing_m: float) -> DrivenProfile:
    """The profile of a recording with its height smoothed over another length than SMOOTHING_M."""
    return graded(recording.profile(), smoothing_m)


def _channels(
    recording: Recording, profile: DrivenProfile, middle_s: NDArray[np.float64], speed: NDArray[np.float64]
) -> dict[str, NDArray[np.float64]]:
    found: dict[str, NDArray[np.float64]] = {}
    for name in CHANNELS:
        values = _at(recording, getattr(recording, name), middle_s)
        if values is not None:
            found[name] = values
    if profile.altitude_m is not None:
        found["altitude_m"] = profile.altitude_m
    for name in ("heading_rad", "wind_from_rad"):
        values = _angle_at(recording, getattr(recording, name), middle_s)
        if values is not None:
            found[name] = values
    if "heading_rad" not in found and {"latitude_deg", "longitude_deg"} <= found.keys():
        found["heading_rad"] = _heading_of_positions(found["latitude_deg"], found["longitude_deg"])
    if "heading_rad" in found:
        found["curvature_per_m"] = _curvature(found["heading_rad"], speed, np.diff(profile.time_s))
    return found


def _at(
    recording: Recording, values: NDArray[np.float64] | None, time_s: NDArray[np.float64]
) -> NDArray[np.float64] | None:
    """A channel at given times, linear between the samples that are known; None where none is."""
    if values is None:
        return None
    known = ~np.isnan(values)
    if not known.any():
        return None
    return np.interp(time_s, recording.time_s[known], values[known])


def _angle_at(
    recording: Recording, values: NDArray[np.float64] | None, time_s: NDArray[np.float64]
) -> NDArray[np.float64] | None:
    if values is None:
        return None
    east, north = (_at(recording, part, time_s) for part in (np.sin(values), np.cos(values)))
    return None if east is None or north is None else np.asarray(np.arctan2(east, north), np.float64)


def _heading_of_positions(latitude: NDArray[np.float64], longitude: NDArray[np.float64]) -> NDArray[np.float64]:
    if latitude.size < 2:
        return np.zeros_like(latitude)
    north = np.gradient(_smoothed(latitude))
    east = np.gradient(_smoothed(longitude)) * np.cos(np.radians(latitude))
    moving = np.hypot(east, north) > 1e-7  # degrees a step, some centimetres
    heading = np.arctan2(east, north)
    if not moving.any():
        return np.zeros_like(latitude)
    last = np.maximum.accumulate(np.where(moving, np.arange(moving.size), -1))
    return np.asarray(heading[np.where(last < 0, int(np.argmax(moving)), last)], np.float64)


def _curvature(
    heading: NDArray[np.float64], speed: NDArray[np.float64], duration_s: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Turn over way [rad/m], of the smoothed heading; 0 where the vehicle is too slow for a heading."""
    if heading.size < 2:
        return np.zeros_like(heading)
    turn = np.gradient(_smoothed(np.unwrap(heading))) / duration_s
    moving = speed > LEAST_TURN_MPS
    return np.divide(turn, speed, out=np.zeros_like(speed), where=moving)


def _smoothed(values: NDArray[np.float64]) -> NDArray[np.float64]:
    if values.size < TURN_SMOOTHING_S:
        return values
    kernel = np.full(TURN_SMOOTHING_S, 1.0 / TURN_SMOOTHING_S)
    half = TURN_SMOOTHING_S // 2
    return np.convolve(np.pad(values, half, mode="edge"), kernel, mode="valid")


__all__ = ["ROUGHER_M", "ReplayedDrive", "driven", "rougher_grade", "wheel_force_n", "with_vehicle"]


def median_ambient(recording: Recording) -> Conditions:
    """Conditions with the median of the recorded air temperature, those of the source's model where it has none."""
    if recording.ambient_k is None:
        return STILL
    return Conditions(ambient_k=float(np.nanmedian(recording.ambient_k)))
