"""The way of a drive as heights are looked up along it: places near each other, straight lines over what is between."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING, Final

import numpy as np

from diagnosis.matching.tracks import positions_deg
from energy.replay.replay import smoothed_height_m
from routing.graph.earth import METRE_PER_DEGREE

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from diagnosis.recordings.recording import Recording

STEP_M: Final = 30.0  # between places, as in the import of maps (routing.importers.region)
STRAIGHT_M: Final = 250.0  # way between two positions over which the road is taken to run straight
BRIDGED_M: Final = 1000.0  # way between two heights up to which a straight line stands for what is between
DETOUR: Final = 1.3  # times the way, and so many metres, that a position may lie from those beside it
ASTRAY_M: Final = 100.0


@dataclass(frozen=True, slots=True)
class Section:
    """n samples that follow each other without a gap; way_m: float64 (n,) from the first, never falling [m]."""

    samples: slice
    way_m: NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Places:
    """Positions along a section: place_m float64 (k,), rising [m]; lat_deg, lon_deg float64 (k,)."""

    place_m: NDArray[np.float64]
    lat_deg: NDArray[np.float64]
    lon_deg: NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class SectionHeights:
    """Heights along a section: place_m float64 (k,), rising [m]; height_m float64 (k,) [m], NaN where not known.

    off_road: bool (k,), known heights that are not those of the road.
    """

    section: Section
    place_m: NDArray[np.float64]
    height_m: NDArray[np.float64]
    off_road: NDArray[np.bool_]


@dataclass(frozen=True, slots=True)
class SampleHeights:
    """Height of n samples, float64 (n,) [m], and on which share of the way it is known [-].

    off_road_frac: share of the places with a height where it is not the road's, so that a straight line stands [-].
    """

    height_m: NDArray[np.float64]
    known_frac: float
    off_road_frac: float


def sections(recording: Recording) -> list[Section]:
    """The parts of a recording between its gaps, in order."""
    speed, time_s = recording.speed_mps, recording.time_s
    step_m = 0.5 * (speed[1:] + speed[:-1]) * np.diff(time_s)
    edges = [0, *(np.flatnonzero(recording.gap_steps(time_s)) + 1).tolist(), time_s.size]
    return [
        Section(slice(first, behind), np.concatenate(([0.0], np.cumsum(step_m[first : behind - 1]))))
        for first, behind in pairwise(edges)
    ]


def places_along(recording: Recording, parts: Sequence[Section]) -> list[Places]:
    """Places of each section of a recording; raises NoPositionsError.

    They are at most STEP_M apart where positions are near each other; else they are the positions alone, since a
    straight line between them leaves the road. A position too far from those beside it is an error of the receiver.
    """
    lat, lon, fix = positions_deg(recording)
    found = []
    for part in parts:
        here = fix[(fix >= part.samples.start) & (fix < part.samples.stop)]
        found.append(_places(part.way_m[here - part.samples.start], lat[here], lon[here]))
    return found


def sample_heights(known: Sequence[SectionHeights], smoothing_m: float) -> SampleHeights | None:
    """Heights of all samples of a recording, from those along its sections; None where none is known.

    They are smoothed as recorded ones are, over smoothing_m of way, 0 for none. Straight lines join known heights. The
    way between two that are farther apart than BRIDGED_M and than any two samples is not known, nor is that before the
    first and behind the last, which is level.
    """
    found = []
    known_m = whole_m = 0.0
    asked = off_road = 0
    for part in known:
        way_m = part.section.way_m
        whole_m += float(way_m[-1])
        there = ~np.isnan(part.height_m)
        if not there.any():
            found.append(np.full(way_m.size, np.nan))
            continue
        span_m = np.diff(part.place_m[there])
        known_m += float(span_m[span_m <= max(BRIDGED_M, 1.001 * np.diff(way_m).max(initial=0.0))].sum())
        asked += int(there.sum())
        off_road += int(part.off_road[there].sum())
        there &= ~part.off_road
        place_m, height_m = part.place_m[there], part.height_m[there]
        if smoothing_m > 0.0:
            height_m = smoothed_height_m(place_m, height_m, smoothing_m)
        found.append(np.interp(way_m, place_m, height_m))
    height_m = np.concatenate(found)
    there = ~np.isnan(height_m)
    if not there.any() or whole_m <= 0.0:
        return None
    sample = np.arange(height_m.size)
    return SampleHeights(np.interp(sample, sample[there], height_m[there]), known_m / whole_m, off_road / asked)


def _places(fix_m: NDArray[np.float64], lat: NDArray[np.float64], lon: NDArray[np.float64]) -> Places:
    """Places from positions lat, lon, float64 (f,), at fix_m of the way, never falling."""
    east = np.asarray(np.unwrap(lon, period=360.0), np.float64)
    good = ~_strays(fix_m, lat, east)
    if not good.any():
        return Places(*(np.empty(0) for _ in range(3)))
    fix_m, index = np.unique(fix_m[good], return_inverse=True)
    lat, east = (np.bincount(index, values[good]) / np.bincount(index) for values in (lat, east))  # where it stood
    long = np.diff(fix_m) > STRAIGHT_M
    grid = np.arange(fix_m[0], fix_m[-1], STEP_M)
    grid = grid[~long[np.searchsorted(fix_m, grid, side="right") - 1]]
    alone = np.concatenate(([True], long)) | np.concatenate((long, [True]))
    place_m = np.unique(np.concatenate((fix_m[alone], grid)))
    lon = (np.interp(place_m, fix_m, east) + 180.0) % 360.0 - 180.0
    return Places(place_m, np.interp(place_m, fix_m, lat), np.asarray(lon, np.float64))


def _strays(fix_m: NDArray[np.float64], lat: NDArray[np.float64], east: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Which positions lie farther from all that are beside them than was driven, bool (f,)."""
    if fix_m.size < 3:
        return np.zeros(fix_m.size, np.bool_)
    apart = np.hypot(np.diff(lat), np.diff(east) * np.cos(np.radians(lat[1:])))
    far = METRE_PER_DEGREE * apart > DETOUR * np.diff(fix_m) + ASTRAY_M
    return np.concatenate(([far[0] and not far[1]], far[:-1] & far[1:], [far[-1] and not far[-2]]))
