"""Battery energy along a driven speed and height, by the law of force and battery of the route model."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Final

import numpy as np

from energy.chain.chain import filling_energy_j
from energy.conditions import STILL, Conditions
from energy.errors import ConditionsError, EnergyError, Refusal
from energy.force.effects import LinkSetting, drive_of
from energy.force.kernels_parts import PART_COUNT
from energy.force.kernels_physics import ROAD_COLUMNS
from energy.force.parts import Part, energy_parts
from energy.replay.kernels_replay import ProfileSteps, drive_profile
from energy.vehicle.vehicle import CHECKED_SPEED_MPS

if TYPE_CHECKING:
    from collections.abc import Iterator

    from numpy.typing import NDArray

    from energy.force.parts import EnergyParts
    from energy.vehicle.consumption_table import ConsumptionTableVehicle
    from energy.vehicle.vehicle import Vehicle

SMOOTHING_M: Final = 200.0  # assumed: a height in whole metres errs by 0.29 m, over 200 m a grade of 0.2 %
AMBIENT_STEP_K: Final = 0.5  # resolution of a driven profile's air temperature


class DrivenProfileError(Refusal, EnergyError):
    """A driven profile that cannot be replayed: names the field, the position in it, its value and the range."""

    def __init__(self, field: str, position: int, value: object, allowed: str) -> None:
        self.position = position
        super().__init__(field, value, allowed, subject=f"{field} at sample {position}")


@dataclass(frozen=True, slots=True)
class DrivenProfile:
    """Speed over time as it was driven, n samples joined by straight lines; between them n−1 steps.

    time_s: float64 (n,), rising. speed_mps: float64 (n,), 0..55.6 [m/s].
    elevation_m: float64 (n,) height at each sample [m]. grade_frac: float64 (n−1,), sin θ of each step, −1..1. At most
    one of the two; without either the road is flat.
    heading: float64 (n−1, 2), east and north part of the direction of travel, for wind. altitude_m: float64 (n−1,) of
    each step, for the density of the air; elevation_m stands in for it.
    ambient_k: float64 (n,) air temperature on the way [K], in place of the one of the conditions.

    Raises DrivenProfileError naming field, position, value and range.
    """

    time_s: NDArray[np.float64]
    speed_mps: NDArray[np.float64]
    elevation_m: NDArray[np.float64] | None = None
    grade_frac: NDArray[np.float64] | None = None
    heading: NDArray[np.float64] | None = None
    altitude_m: NDArray[np.float64] | None = None
    ambient_k: NDArray[np.float64] | None = None

    def __post_init__(self) -> None:
        n = self.time_s.size
        if n < 2:
            raise DrivenProfileError("time_s", 0, f"{n} samples", "at least 2")
        if self.elevation_m is not None and self.grade_frac is not None:
            raise DrivenProfileError("grade_frac", 0, "given", "None where elevation_m is given")
        fields: tuple[tuple[str, NDArray[np.float64] | None, tuple[int, ...], float, float], ...] = (
            ("time_s", self.time_s, (n,), -1e12, 1e12),
            ("speed_mps", self.speed_mps, (n,), 0.0, CHECKED_SPEED_MPS),
            ("elevation_m", self.elevation_m, (n,), -1000.0, 10_000.0),
            ("grade_frac", self.grade_frac, (n - 1,), -1.0, 1.0),
            ("heading", self.heading, (n - 1, 2), -1.0, 1.0),
            ("altitude_m", self.altitude_m, (n - 1,), -1000.0, 10_000.0),
            ("ambient_k", self.ambient_k, (n,), 220.0, 330.0),
        )
        for name, values, shape, low, high in fields:
            if values is None:
                continue
            if values.shape != shape:
                raise DrivenProfileError(name, 0, f"of shape {values.shape}", f"shape {shape}")
            good = (values >= low) & (values <= high)  # false for NaN
            if not bool(good.all()):
                position = int(np.argmin(good)) if values.ndim == 1 else int(np.argmin(good.all(axis=1)))
                raise DrivenProfileError(name, position, values[position].tolist(), f"{low:g}..{high:g}")
        rising = np.diff(self.time_s) > 0.0
        if not bool(rising.all()):
            position = int(np.argmin(rising)) + 1
            raise DrivenProfileError("time_s", position, float(self.time_s[position]), "rising")

    def step_m(self) -> NDArray[np.float64]:
        """Distance of each step, float64 (n−1,) [m]."""
        return 0.5 * (self.speed_mps[:-1] + self.speed_mps[1:]) * np.diff(self.time_s)


@dataclass(frozen=True, slots=True)
class ReplayResult:
    """What driving a profile takes, whole and step by step.

    dissipated_j: of energy_j what is not stored in height and speed at the end. step_energy_j: float64 (n−1,) from the
    battery; step_parts_j: float64 (n−1, 20) in the order of Part; power_w: float64 (n−1,) mean over each step.
    """

    distance_m: float
    duration_s: float
    standstill_s: float
    energy_j: float
    dissipated_j: float
    parts: EnergyParts
    step_energy_j: NDArray[np.float64]
    step_parts_j: NDArray[np.float64]
    power_w: NDArray[np.float64]


def replay(
    vehicle: Vehicle | ConsumptionTableVehicle,
    profile: DrivenProfile,
    *,
    conditions: Conditions = STILL,
    smoothing_m: float = SMOOTHING_M,
    soc_start_frac: float | None = None,
) -> ReplayResult:
    """Energy of driving a profile, speed and height given, integrated exactly with both linear between samples.

    Heights are first smoothed over distance (smoothed_height_m). The conditions' speed_factor and top_speed_mps have
    nothing to act on, since the speed is given. The clock of the cabin's warm-up starts at the first sample.
    soc_start_frac matters only where recuperation is limited.

    Raises DrivenProfileError where a step would be steeper than vertical, ConditionsError where the profile has an
    air temperature and the conditions another, or where conditions need what profile or vehicle do not have.
    """
    profile = graded(profile, smoothing_m)
    n = profile.time_s.size - 1
    step_m = profile.step_m()
    grade = np.zeros(n) if profile.grade_frac is None else profile.grade_frac
    altitude_m = profile.altitude_m
    driven_mps = step_m / np.diff(profile.time_s)
    energy, terms, roads = np.zeros(n), np.zeros((n, PART_COUNT)), np.zeros((n, ROAD_COLUMNS))
    profile_steps = ProfileSteps(profile.time_s, profile.speed_mps, roads)
    parts = np.zeros((n, len(Part)))
    used = stored = 0.0
    full_j = filling_energy_j(soc_start_frac, vehicle.usable_capacity_wh)
    for steps, weather in _weather(profile, conditions):
        drive = drive_of(vehicle, weather)
        setting = LinkSetting(
            grade[steps],
            driven_mps[steps],
            None if altitude_m is None else altitude_m[steps],
            None if profile.heading is None else profile.heading[steps],
        )
        roads[steps] = drive.roads(setting, np.zeros(grade[steps].size))
        begin, end = steps.start, steps.stop
        used = drive_profile(drive.physics, profile_steps, begin, end, full_j, used, energy, terms)
        parts[steps] = drive.parts(setting, terms[steps])
        gain = 0.5 * (profile.speed_mps[end] ** 2 - profile.speed_mps[begin] ** 2)
        stored += drive.physics.weight_n * float((grade[steps] * step_m[steps]).sum()) + drive.physics.inertia_kg * gain
    return ReplayResult(
        distance_m=float(step_m.sum()),
        duration_s=float(profile.time_s[-1] - profile.time_s[0]),
        standstill_s=float(np.diff(profile.time_s)[step_m <= 0.0].sum()),
        energy_j=float(energy.sum()),
        dissipated_j=float(energy.sum()) - float(stored),
        parts=energy_parts(parts.sum(axis=0)),
        step_energy_j=energy,
        step_parts_j=parts,
        power_w=energy / np.diff(profile.time_s),
    )


def smoothed_height_m(
    distance_m: NDArray[np.float64], elevation_m: NDArray[np.float64], window_m: float = SMOOTHING_M
) -> NDArray[np.float64]:
    """Height at each sample, the mean of the recorded one over window_m of way around it, float64 (n,) [m].

    distance_m: float64 (n,), never falling. First, samples at one place get their mean height, since a vehicle that
    stands neither climbs nor falls; between places the height is linear in the distance. Beyond each end the way is
    continued upside down, h(−x) = 2·h(0) − h(x), so that a constant grade stays as it is, and so do the heights of the
    first and the last place and with them the climb of the whole way.
    A lag of the sensor is not undone: it moves the grade along the way and leaves the climb of the way as it is.
    """
    place, index = np.unique(distance_m, return_inverse=True)
    height = np.bincount(index, weights=elevation_m) / np.bincount(index)
    half_m = min(0.5 * window_m, float(place[-1] - place[0]))
    if half_m <= 0.0:
        return np.asarray(height[index], np.float64)
    slope = np.diff(height) / np.diff(place)
    area = np.concatenate(([0.0], np.cumsum(0.5 * (height[1:] + height[:-1]) * np.diff(place))))

    def area_within(at: NDArray[np.float64]) -> NDArray[np.float64]:
        k = np.clip(np.searchsorted(place, at, side="right") - 1, 0, slope.size - 1)
        x = at - place[k]
        return np.asarray(area[k] + (height[k] + 0.5 * slope[k] * x) * x, np.float64)

    def area_to(at: NDArray[np.float64]) -> NDArray[np.float64]:
        before, after = np.maximum(place[0] - at, 0.0), np.maximum(at - place[-1], 0.0)
        within = area_within(at + 2.0 * (before - after))
        return np.asarray(within - 2.0 * height[0] * before + 2.0 * height[-1] * after, np.float64)

    mean = (area_to(place + half_m) - area_to(place - half_m)) / (2.0 * half_m)
    mean[0], mean[-1] = height[0], height[-1]  # to rounding they are already
    return np.asarray(mean[index], np.float64)


def graded(profile: DrivenProfile, smoothing_m: float = SMOOTHING_M) -> DrivenProfile:
    """The profile with the grade and altitude of each step in place of its elevation, smoothed over smoothing_m of way.

    Saves replays of one profile with many vehicles from doing so each time; without elevation it is the profile itself.
    Raises DrivenProfileError where a step would be steeper than vertical.
    """
    if profile.elevation_m is None:
        return profile
    step_m = profile.step_m()
    height_m = smoothed_height_m(np.concatenate(([0.0], np.cumsum(step_m))), profile.elevation_m, smoothing_m)
    rise = np.diff(height_m)
    grade = np.divide(rise, step_m, out=np.zeros_like(rise), where=step_m > 0.0)
    if not bool((np.abs(grade) <= 1.0).all()):
        position = int(np.argmax(np.abs(grade)))
        raise DrivenProfileError(
            "elevation_m",
            position,
            f"{rise[position]:.2f} m higher a step of {step_m[position]:.2f} m later",
            "no step steeper than vertical; a longer smoothing_m",
        )
    altitude_m = 0.5 * (height_m[:-1] + height_m[1:]) if profile.altitude_m is None else profile.altitude_m
    return replace(profile, elevation_m=None, grade_frac=grade, altitude_m=altitude_m)


def _weather(profile: DrivenProfile, conditions: Conditions) -> Iterator[tuple[slice, Conditions]]:
    """Runs of steps with one air temperature, and the conditions in each."""
    n = profile.time_s.size - 1
    if profile.ambient_k is None:
        yield slice(0, n), conditions
        return
    if conditions.ambient_k is not None:
        raise ConditionsError(
            "conditions.ambient_k", conditions.ambient_k, "none where the driven profile has air temperatures"
        )
    ambient_k = np.round(0.5 * (profile.ambient_k[:-1] + profile.ambient_k[1:]) / AMBIENT_STEP_K) * AMBIENT_STEP_K
    begins = np.concatenate(([0], np.flatnonzero(np.diff(ambient_k) != 0.0) + 1, [n]))
    for begin, end in zip(begins[:-1].tolist(), begins[1:].tolist(), strict=True):
        yield (
            slice(begin, end),
            replace(conditions, ambient_k=float(ambient_k[begin]), cabin_start_k=float(profile.ambient_k[0])),
        )
