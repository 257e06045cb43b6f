"""A recorded drive: its channels in SI units."""

from __future__ import annotations

from dataclasses import dataclass, fields
from enum import StrEnum
from typing import TYPE_CHECKING, Final

import numpy as np

from diagnosis.recordings.positions import heading_of_compass, heading_of_positions
from energy.replay.replay import DrivenProfile

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from diagnosis.recordings.notes import Note

PROFILE_STEP_S: Final = 1.0
REQUIRED: Final = ("time_s", "speed_mps", "power_w")


class Detail(StrEnum):
    """How much of a drive was recorded."""

    SAMPLES = "samples"
    COUNTER = "counter"
    CHARGE = "charge"
    TOTALS = "totals"
    PROFILE = "profile"


@dataclass(frozen=True, slots=True)
class Recording:
    """One recorded drive: n samples, each channel float64 (n,), NaN where a channel has no value; None: not recorded.

    id: the file's name without its endings. time_s: rising; time_s, speed_mps and power_w have no NaN.
    power_w: at the battery's terminals, positive = discharge, all consumers included. voltage_v, current_a: likewise.
    soc_frac: as the file has it, of whatever capacity it means. displayed_frac: as the car shows it.
    heater_w, aircon_w: electric; hvac_w: both together.
    heading_rad: clockwise from north; wind_from_rad: direction that it comes from. wet_frac: 1 on a wet road.
    payload_kg: beyond the vehicle's mass. odometer_m, used_j, regen_j: counters from any start, of the way, of the
    energy that left the battery less what came back, and of what came back by recuperation.
    notes: what the reader has found and what it did. detail: whether power, only a coarse counter of energy, only the
    charge, only sums of the drive, or no energy at all were recorded. Of the three before the last one energy is known;
    where that is by the charge, power_w is 0 until a vehicle's capacity is known. Of a profile power_w is 0.
    elevation_source: what elevation_m was filled in from; empty where it was recorded.
    gaps: begin and end [s] of each stretch in which nothing was recorded, rising, each from one sample to the next.
    """

    id: str
    time_s: NDArray[np.float64]
    speed_mps: NDArray[np.float64]
    power_w: NDArray[np.float64]
    elevation_m: NDArray[np.float64] | None = None
    ambient_k: NDArray[np.float64] | None = None
    soc_frac: NDArray[np.float64] | None = None
    battery_k: NDArray[np.float64] | None = None
    heater_w: NDArray[np.float64] | None = None
    aircon_w: NDArray[np.float64] | None = None
    voltage_v: NDArray[np.float64] | None = None
    current_a: NDArray[np.float64] | None = None
    latitude_deg: NDArray[np.float64] | None = None
    longitude_deg: NDArray[np.float64] | None = None
    heading_rad: NDArray[np.float64] | None = None
    wind_speed_mps: NDArray[np.float64] | None = None
    wind_from_rad: NDArray[np.float64] | None = None
    wet_frac: NDArray[np.float64] | None = None
    payload_kg: NDArray[np.float64] | None = None
    notes: tuple[Note, ...] = ()
    hvac_w: NDArray[np.float64] | None = None
    displayed_frac: NDArray[np.float64] | None = None
    odometer_m: NDArray[np.float64] | None = None
    used_j: NDArray[np.float64] | None = None
    regen_j: NDArray[np.float64] | None = None
    gaps: tuple[tuple[float, float], ...] = ()
    detail: Detail = Detail.SAMPLES
    elevation_source: str = ""

    @property
    def is_one_number(self) -> bool:
        """Whether one energy at most is known of the battery's power."""
        return self.detail is not Detail.SAMPLES

    def energy_j(self) -> float:
        """Energy that left the battery, ∫P dt by the trapezoidal rule [J]; not counted is what left it in gaps."""
        return self._integral(self.power_w)

    def distance_m(self) -> float:
        """Way driven, ∫v dt by the trapezoidal rule [m], without what was driven in gaps."""
        return self._integral(self.speed_mps)

    def gap_steps(self, time_s: NDArray[np.float64]) -> NDArray[np.bool_]:
        """Which steps between the times of an axis have a gap in them, bool (n−1,) for time_s float64 (n,), rising."""
        if not self.gaps:
            return np.zeros(time_s.size - 1, np.bool_)
        begin, end = np.array(self.gaps).T
        following = np.minimum(np.searchsorted(end, time_s[:-1], side="right"), end.size - 1)
        return np.asarray((end[following] > time_s[:-1]) & (begin[following] < time_s[1:]), np.bool_)

    def profile(self, step_s: float = PROFILE_STEP_S) -> DrivenProfile:
        """Speed, elevation and direction at equal steps and at the end, linear between samples, to be replayed.

        Steps of a second by default: at 10 Hz the noise of a speed sensor would be taken for accelerations, and each
        costs what drive and recuperation lose. Gaps are bridged by straight lines, which is no drive: leave out the
        steps that gap_steps(profile.time_s) names. The direction is that of a compass, or else of the positions.
        """
        begin, end = float(self.time_s[0]), float(self.time_s[-1])
        time_s = np.append(np.arange(begin, end - 1e-3 * step_s, step_s), end)
        elevation_m = None
        if self.elevation_m is not None:
            known = ~np.isnan(self.elevation_m)
            elevation_m = np.interp(time_s, self.time_s[known], self.elevation_m[known])
        heading = None
        if self.heading_rad is not None:
            heading = heading_of_compass(time_s, self.time_s, self.heading_rad)
        if heading is None and self.latitude_deg is not None and self.longitude_deg is not None:
            heading = heading_of_positions(time_s, self.time_s, self.latitude_deg, self.longitude_deg)
        speed_mps = np.interp(time_s, self.time_s, self.speed_mps)
        return DrivenProfile(time_s, speed_mps, elevation_m, heading=heading)

    def _integral(self, values: NDArray[np.float64]) -> float:
        if not self.gaps:
            return float(np.trapezoid(values, self.time_s))
        step = np.where(self.gap_steps(self.time_s), 0.0, np.diff(self.time_s))
        return float((0.5 * (values[1:] + values[:-1]) * step).sum())


def channels_of(recording: Recording) -> dict[str, NDArray[np.float64]]:
    """The channels that a recording has, by the names of its fields."""
    found = {field.name: getattr(recording, field.name) for field in fields(recording)}
    return {name: values for name, values in found.items() if isinstance(values, np.ndarray)}
