"""A recording's samples placed along the links that it was driven over, stretch by stretch."""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import StrEnum
from typing import TYPE_CHECKING, Final

import numpy as np
from scipy.linalg import solveh_banded

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from diagnosis.matching.tracks import Track
    from diagnosis.recordings.reading import Recording

SMOOTHING_WAY_M: Final = 5000.0  # see smoothed_m; docs/matching.md has the measurement
SHORTEST_M: Final = 50.0  # assumed: a shorter stretch does not tell which road it is on
TOUCH_M: Final = 1.0  # assumed: at an end of a stretch, so little of a link was not driven
JUNCTION_M: Final = 1e-3  # assumed: of 1000 km, rounding moves a place by 1.4e-6 m; maps are stored to 11 mm
LEAD_ON_M: Final = 25.0  # assumed: before the first and after the last place, the odometer leads on so far


class GapReason(StrEnum):
    """Why a part of a recording lies on no link."""

    NO_POSITIONS = "no_positions"
    OFF_ROAD = "off_road"
    PAUSE = "pause"  # the recording itself has a gap
    NO_WAY = "no_way"  # no permitted way of the driven length leads on: a turn back, a road that the map lacks


@dataclass(frozen=True, slots=True)
class Gap:
    """A part of a recording on no link, from the last sample before it that is on one to the first after it."""

    begin_s: float
    end_s: float
    driven_m: float
    reason: GapReason


@dataclass(frozen=True, slots=True)
class Stretch:
    """Links driven one after the other without a break, by the samples first to last, both included.

    links: int64 (k,), each may follow the one before. enter_s: float64 (k+1,) times at which each is entered, and of
    the end. from_m, to_m: float64 (k,) part of each link that is driven [m]; only the first begins and only the last
    ends within the link. along_m: float64 (last − first + 1,) way of each sample from the stretch's beginning [m].
    """

    first: int
    last: int
    links: NDArray[np.int64]
    enter_s: NDArray[np.float64]
    from_m: NDArray[np.float64]
    to_m: NDArray[np.float64]
    along_m: NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Run:
    """Links in driving order, and how far along them the samples lie that were looked at.

    samples: positions in Track.sample, rising. along_m: of each of them [m]. begin_m: of each link [m].
    """

    samples: list[int]
    links: list[int]
    along_m: list[float]
    begin_m: list[float]


@dataclass(frozen=True, slots=True)
class _Part:
    """Samples that a run covers, and how far along it each is, float64, never falling [m]."""

    samples: slice
    along_m: NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class PlacedWay:
    """n samples on links: link int64 (n,), −1 where none; position_m float64 (n,), NaN where none."""

    link: NDArray[np.int64]
    position_m: NDArray[np.float64]
    stretches: tuple[Stretch, ...]
    gaps: tuple[Gap, ...]


def place_samples(recording: Recording, track: Track, runs: Sequence[Run], length_m: NDArray[np.float64]) -> PlacedWay:
    """Every sample placed by the odometer between those that were looked at; length_m: float64 (M,) of all links.

    A sample where one link ends and the next begins is on the next one, at its beginning; so is one up to JUNCTION_M
    before that. At the end of a stretch, where the next link is not driven, it is on the one before.
    """
    n = recording.time_s.size
    link, position = np.full(n, -1, np.int64), np.full(n, np.nan)
    stretches: list[Stretch] = []
    free_from = 0
    for k, run in enumerate(runs):
        free_to = int(track.sample[runs[k + 1].samples[0]]) if k + 1 < len(runs) else n
        part = _placed(run, track, run.begin_m[-1] + float(length_m[run.links[-1]]), free_from, free_to)
        if part is None:
            continue
        free_from = part.samples.stop
        links, begin = np.array(run.links, np.int64), np.array(run.begin_m)
        at = np.searchsorted(begin, part.along_m, side="right") - 1
        link[part.samples], position[part.samples] = links[at], part.along_m - begin[at]
        used = slice(int(at[0]), int(at[-1]) + 1)
        stretches.append(_stretch(recording, part, links[used], begin[used]))
    return PlacedWay(link, position, tuple(stretches), _gaps(recording, track, stretches))


def _placed(run: Run, track: Track, length_m: float, free_from: int, free_to: int) -> _Part | None:
    """The samples free_from ≤ k < free_to that a run of this length_m covers, None where it is too short to tell."""
    looked_at = track.sample[run.samples]
    way = track.odometer_m
    if looked_at.size < 2:
        return None
    known, along = way[looked_at], smoothed_m(way[looked_at], np.array(run.along_m))
    # at both ends the odometer leads on, as far as the link, the next sample that is looked at and the next pause
    section = track.section[looked_at[0]]
    free_from = max(free_from, int(np.searchsorted(track.section, section)))
    free_to = min(free_to, int(np.searchsorted(track.section, section, side="right")))
    first = int(np.searchsorted(way, known[0] - min(LEAD_ON_M, along[0])))
    beyond = int(np.searchsorted(way, known[-1] + min(LEAD_ON_M, length_m - along[-1]), side="right"))
    first, beyond = max(first, free_from), min(beyond, free_to)
    samples = slice(min(first, int(looked_at[0])), max(beyond, int(looked_at[-1]) + 1))
    here = way[samples]
    placed = np.interp(here, known, along)
    placed += np.minimum(here - known[0], 0.0) + np.maximum(here - known[-1], 0.0)
    if way[samples.stop - 1] - way[samples.start] < SHORTEST_M:
        return None
    begin_m = np.array(run.begin_m)
    placed = entered_m(placed, begin_m)
    # a drive that begins where one link ends was not on it
    low = float(begin_m[min(int(np.searchsorted(begin_m, placed[0])), begin_m.size - 1)])
    high = float(begin_m[int(np.searchsorted(begin_m, placed[-1], side="right")) - 1])
    low = low if 0.0 < low - placed[0] < TOUCH_M else 0.0
    high = high if high > 0.0 and placed[-1] - high < TOUCH_M else length_m
    return _Part(samples, np.clip(placed, low, math.nextafter(high, 0.0)))


def entered_m(along_m: NDArray[np.float64], begin_m: NDArray[np.float64]) -> NDArray[np.float64]:
    """Way along a run, float64 (k,) [m], led on to where a link begins from up to JUNCTION_M before; never falling.

    Without it the last bit of a sum would say on which of two links a sample at their junction is, and whether the
    second one was entered before or after a stop there. along_m: never falling; begin_m: of each link, rising [m].
    """
    next_m = begin_m[np.searchsorted(begin_m, along_m + JUNCTION_M, side="right") - 1]
    return np.maximum(along_m, next_m)


def smoothed_m(way_m: NDArray[np.float64], along_m: NDArray[np.float64]) -> NDArray[np.float64]:
    """Way along the links with positions' errors taken out by the odometer, float64 (k,), never falling [m].

    The difference e of the two changes slowly: found is the z with the least ∫(z − e)² + (L/2π)⁴·z″² over the way (a
    smoothing spline, Reinsch 1967, doi 10.1007/BF02162161), which halves waves of e of length L.
    """
    if way_m.size < 3:
        return np.maximum.accumulate(np.maximum(along_m, 0.0))
    step = np.diff(way_m)
    share = np.concatenate(([0.5 * step[0]], 0.5 * (step[1:] + step[:-1]), [0.5 * step[-1]]))
    middle = 0.5 * (step[1:] + step[:-1])
    before, after = 1.0 / step[:-1], 1.0 / step[1:]
    rows = np.stack((before, -(before + after), after))  # second differences: z′ after less z′ before
    heavy = (SMOOTHING_WAY_M / (2.0 * math.pi)) ** 4 / middle
    bands = np.zeros((3, way_m.size))
    bands[2] = share
    for a in range(3):
        for b in range(a, 3):
            # entry (row + a, row + b) of the symmetric matrix, in upper form
            bands[2 - (b - a), b : way_m.size - 2 + b] += heavy * rows[a] * rows[b]
    smooth = way_m + solveh_banded(bands, share * (along_m - way_m))
    return np.asarray(np.maximum.accumulate(np.maximum(smooth, 0.0)), np.float64)


def _stretch(recording: Recording, part: _Part, links: NDArray[np.int64], begin_m: NDArray[np.float64]) -> Stretch:
    """A stretch of the links that are driven, begin_m along the same way as the samples' places."""
    along, time_s = part.along_m, recording.time_s[part.samples]
    inner = begin_m[1:]
    after = np.searchsorted(along, inner)
    gone, step = inner - along[after - 1], along[after] - along[after - 1]
    enter = time_s[after - 1] + gone / step * (time_s[after] - time_s[after - 1])
    ends = np.concatenate(([along[0]], inner, [along[-1]]))
    return Stretch(
        first=part.samples.start,
        last=part.samples.stop - 1,
        links=links,
        enter_s=np.concatenate(([time_s[0]], enter, [time_s[-1]])),
        from_m=ends[:-1] - begin_m,
        to_m=ends[1:] - begin_m,
        along_m=along - along[0],
    )


def _gaps(recording: Recording, track: Track, stretches: list[Stretch]) -> tuple[Gap, ...]:
    """What lies before, between and after stretches, where anything was driven."""
    edges = [0, *(sample for part in stretches for sample in (part.first, part.last)), recording.time_s.size - 1]
    found = []
    for first, last in zip(edges[::2], edges[1::2], strict=True):
        driven_m = float(track.odometer_m[last] - track.odometer_m[first])
        if driven_m <= 0.0:
            continue
        found.append(
            Gap(float(recording.time_s[first]), float(recording.time_s[last]), driven_m, _reason(track, first, last))
        )
    return tuple(found)


def _reason(track: Track, first: int, last: int) -> GapReason:
    if (track.paused & (track.sample[1:] > first) & (track.sample[:-1] < last)).any():
        return GapReason.PAUSE
    if ((track.sample > first) & (track.sample < last)).any():
        return GapReason.OFF_ROAD
    if last == first + 1 or ((track.fix > first) & (track.fix < last)).any():
        return GapReason.NO_WAY
    return GapReason.NO_POSITIONS
