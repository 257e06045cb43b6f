"""The way of a recording: its odometer, its positions, and the headings between them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from diagnosis.errors import DiagnosisError
from routing.graph.earth import METRE_PER_DEGREE

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from diagnosis.recordings.reading import Recording

HEADING_SPEED_MPS: Final = 2.0  # assumed: below it a receiver's heading is noise
HEADING_HALF_SPAN_M: Final = 10.0  # assumed: way before and after, at least, to the positions that give a heading
HEADING_SPAN_M: Final = 80.0  # assumed: between positions farther apart than that a road bends
STRAIGHT_FRAC: Final = 0.9  # assumed: chord over way from which on the road between two positions counts as straight


class NoPositionsError(DiagnosisError):
    """A recording without positions: names the recording, the channel, what is there and what is needed."""

    def __init__(self, recording_id: str, channel: str, found: str, needed: str) -> None:
        self.recording_id = recording_id
        self.channel = channel
        self.found = found
        self.needed = needed
        super().__init__(f"recording {recording_id!r}: {channel} is {found}, needed: {needed}")


@dataclass(frozen=True, slots=True)
class Track:
    """A recording's odometer and positions, n samples of which T, a step of way apart, are looked at.

    odometer_m: float64 (n,) [m]. fix: int64 (k,) samples with a fresh position. sample: int64 (T,) those looked at;
    lat_deg, lon_deg, speed_mps: float64 (T,). heading_rad: float64 (T,) clockwise from north, NaN where not known.
    section: int64 (n,) number of pauses before each sample that are so long that the way driven in them is not known.
    """

    odometer_m: NDArray[np.float64]
    fix: NDArray[np.int64]
    sample: NDArray[np.int64]
    lat_deg: NDArray[np.float64]
    lon_deg: NDArray[np.float64]
    heading_rad: NDArray[np.float64]
    speed_mps: NDArray[np.float64]
    section: NDArray[np.int64]

    @property
    def driven_m(self) -> NDArray[np.float64]:
        """Way driven from each sample that is looked at to the next, float64 (T−1,) [m]."""
        return np.diff(self.odometer_m[self.sample])

    @property
    def paused(self) -> NDArray[np.bool_]:
        """Whether a pause lies between each sample that is looked at and the next, bool (T−1,)."""
        return np.diff(self.section[self.sample]) > 0


def track_of(recording: Recording, step_m: float, pause_s: float) -> Track:
    """The track of a recording, looked at every step_m of way.

    pause_s: longest step of time over which the odometer is believed [s]; three of the recording's where it is longer.
    Raises NoPositionsError.
    """
    lat, lon, fix = positions_deg(recording)
    way = odometer_m(recording)
    at = thinned(way[fix], step_m)
    step_s = np.diff(recording.time_s)
    section = np.concatenate(([0], np.cumsum(step_s > max(pause_s, 3.0 * float(np.median(step_s))))))
    return Track(
        odometer_m=way,
        fix=fix,
        sample=fix[at],
        lat_deg=lat[fix[at]],
        lon_deg=lon[fix[at]],
        heading_rad=headings_rad(recording, way, fix, at),
        speed_mps=recording.speed_mps[fix[at]],
        section=section,
    )


def odometer_m(recording: Recording) -> NDArray[np.float64]:
    """Way driven since the first sample, ∫v dt by the trapezoidal rule, float64 (n,) [m]."""
    step_m = 0.5 * (recording.speed_mps[1:] + recording.speed_mps[:-1]) * np.diff(recording.time_s)
    return np.concatenate(([0.0], np.cumsum(step_m)))


def positions_deg(recording: Recording) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.int64]]:
    """Latitude and longitude, float64 (n,) [deg], and the samples that have a fresh one, int64 (k,), rising.

    A position that is the same to the last digit as in the sample before is an old one that the logger repeats, as in a
    tunnel; one at 0° N 0° E is a receiver's way of saying that it has none.
    Raises NoPositionsError where a channel is missing or no sample has both.
    """
    for name in ("latitude_deg", "longitude_deg"):
        if getattr(recording, name) is None:
            raise NoPositionsError(recording.id, name, "not recorded", "latitude_deg and longitude_deg")
    lat, lon = recording.latitude_deg, recording.longitude_deg
    assert lat is not None
    assert lon is not None
    known = ~(np.isnan(lat) | np.isnan(lon)) & ((lat != 0.0) | (lon != 0.0))
    if not known.any():
        found = f"without a value in all {lat.size} samples"
        raise NoPositionsError(recording.id, "latitude_deg, longitude_deg", found, "at least two positions")
    sample = np.flatnonzero(known)
    fresh = np.concatenate(([True], (np.diff(lat[sample]) != 0.0) | (np.diff(lon[sample]) != 0.0)))
    return lat, lon, sample[fresh]


def thinned(way_m: NDArray[np.float64], step_m: float) -> NDArray[np.int64]:
    """Indices of a way, float64 (n,) never falling [m], at least step_m apart, beginning with the first."""
    chosen = [0]
    while True:
        after = int(np.searchsorted(way_m, way_m[chosen[-1]] + step_m))
        if after >= way_m.size:
            break
        chosen.append(after)
    return np.array(chosen, np.int64)


def headings_rad(
    recording: Recording, way_m: NDArray[np.float64], fix: NDArray[np.int64], at: NDArray[np.int64]
) -> NDArray[np.float64]:
    """Direction of travel at fix[at], float64 clockwise from north [rad]; NaN where neither recorded nor derivable.

    The receiver's own while moving; else from one position before to one after, where the road between is straight.
    """
    assert recording.latitude_deg is not None
    assert recording.longitude_deg is not None
    lat, lon, way = recording.latitude_deg[fix], recording.longitude_deg[fix], way_m[fix]
    before = np.maximum(np.searchsorted(way, way[at] - HEADING_HALF_SPAN_M, side="right") - 1, 0)
    after = np.minimum(np.searchsorted(way, way[at] + HEADING_HALF_SPAN_M), fix.size - 1)
    north = (lat[after] - lat[before]) * METRE_PER_DEGREE
    east = (lon[after] - lon[before]) * METRE_PER_DEGREE * np.cos(np.radians(lat[at]))
    span = way[after] - way[before]
    straight = (span >= 2.0 * HEADING_HALF_SPAN_M) & (span <= HEADING_SPAN_M)
    straight &= np.hypot(east, north) >= STRAIGHT_FRAC * span
    derived = np.where(straight, np.arctan2(east, north), np.nan)
    if recording.heading_rad is None:
        return derived
    recorded = recording.heading_rad[fix[at]]
    moving = recording.speed_mps[fix[at]] >= HEADING_SPEED_MPS
    return np.where(moving & ~np.isnan(recorded), recorded, derived)
