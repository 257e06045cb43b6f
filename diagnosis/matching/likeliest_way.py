"""The likeliest way of a track over a road graph, by a hidden Markov model (Newson and Krumm 2009)."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields
from typing import TYPE_CHECKING, Final

import numpy as np
import shapely

from diagnosis.errors import DiagnosisError
from diagnosis.matching import kernels_viterbi as kernels
from diagnosis.matching.kernels_viterbi import Costs, Frontier, Places, RoadArrays, States, Steps
from diagnosis.matching.matched_way import Run
from routing.graph.earth import METRE_PER_DEGREE

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from diagnosis.matching.tracks import Track

OUTLIER_WAY_M: Final = 150.0  # assumed: so short a way off all roads is a receiver's error where the roads go on
REJOIN: Final = 3.0  # assumed: most cost of the way's length for that
REFERENCE_SD_M: Final = 8.0  # assumed: at which being off all roads is as likely as being off_m from one
BACK_SD: Final = 3.0  # a place may lie so many standard deviations behind the one before
SPEEDING_FRAC: Final = 0.2  # assumed: so far above the limit, and for each unit of cost beyond it
MOST_SPEEDING: Final = 2.0  # assumed: for limits of the map may be wrong
HEADING_BASE_M: Final = 40.0  # about the way that a heading is derived from: how a position's error turns it
LEAST_WEIGHT: Final = 0.2  # assumed: of a sample among others with the same error


@dataclass(frozen=True, slots=True)
class MatchSettings:
    """Parameters of the matcher; docs/matching.md has the measurements behind the assumed ones.

    position_sd_m: standard deviations of a position across the road that are tried [m]; the likeliest is taken (Newson
    and Krumm measured 4.07 m). tail_sd: beyond so many of them the cost grows in proportion to the distance.
    scale_sd, scale_frac: way on the map and by the odometer differ by so many of them, and so much of the way [-], for
    one unit of cost. heading_sd_rad: of a heading against the road's [rad]. radius_sd: roads within so many are
    candidates. step_m: way between two samples that are looked at [m]. error_way_m: way over which a receiver's error
    stays alike [m]: samples closer than that count for less. off_m: a position is off all roads where that is likelier
    than being so far from one [m]. leave, split: costs of leaving the roads, and of going on where no way leads.
    bridge_m: longest way without positions that is bridged [m]. pause_s: longest pause between samples over which the
    odometer is believed [s], or three steps of the recording where they are longer.
    Raises DiagnosisError where a value is not above 0 or there is no standard deviation.
    """

    position_sd_m: tuple[float, ...] = (4.0, 8.0, 16.0, 32.0)
    tail_sd: float = 2.0
    scale_sd: float = 0.75
    scale_frac: float = 0.03
    heading_sd_rad: float = 0.35
    radius_sd: float = 7.5
    step_m: float = 20.0
    error_way_m: float = 60.0
    off_m: float = 50.0
    leave: float = 8.0
    split: float = 15.0
    bridge_m: float = 5000.0
    pause_s: float = 10.0

    def __post_init__(self) -> None:
        if not self.position_sd_m:
            raise DiagnosisError("position_sd_m is empty, allowed: at least one standard deviation")
        for field in fields(self):
            value = getattr(self, field.name)
            for number in value if isinstance(value, tuple) else (value,):
                if not 0.0 < number < math.inf:
                    raise DiagnosisError(f"{field.name} is {number}, allowed: above 0")


@dataclass(frozen=True, slots=True)
class LikeliestWay:
    """The likeliest way for one standard deviation of positions, and its cost, −log likelihood up to a constant."""

    runs: tuple[Run, ...]
    cost: float
    position_sd_m: float


class TrackMatcher:
    """The model on one track: candidates are looked up once, ways found for any standard deviation of positions."""

    def __init__(
        self,
        roads: RoadArrays,
        speed_limit_mps: NDArray[np.float64],
        tree: shapely.STRtree,
        frontier: Frontier,
        track: Track,
        settings: MatchSettings,
    ) -> None:
        self._roads = roads
        self._speed_limit_mps = speed_limit_mps
        self._tree = tree
        self._frontier = frontier
        self._track = track
        self._settings = settings
        self._weight = np.ones(track.sample.size)
        self._weight[1:] = np.clip(track.driven_m / settings.error_way_m, LEAST_WEIGHT, 1.0)

    def best(self) -> LikeliestWay:
        """The way with the likeliest of the standard deviations; of equal ones the smallest."""
        ways = [self.way(sd_m) for sd_m in self._settings.position_sd_m]
        return min(ways, key=lambda way: way.cost)

    def way(self, sd_m: float) -> LikeliestWay:
        """The likeliest way for a standard deviation of positions across the road."""
        set_, track = self._settings, self._track
        places = self._places(sd_m)
        costs = Costs(
            scale_m=set_.scale_sd * sd_m,
            scale_frac=set_.scale_frac,
            level=math.log(sd_m / REFERENCE_SD_M),
            back_m=BACK_SD * sd_m,
            off=float(_tailed(np.array(set_.off_m / REFERENCE_SD_M), set_.tail_sd)),
            leave=set_.leave,
            split=set_.split,
            beam=2.0 * (set_.leave + set_.split),
        )
        count = places.link.size + track.sample.size
        states = States(np.full(count, np.inf), np.full(count, -1, np.int64), np.zeros(count, np.bool_))
        steps = Steps(track.driven_m, track.paused | (track.driven_m > set_.bridge_m), self._weight)
        kernels.likeliest(self._roads, self._frontier, places, steps, costs, states)
        path, cost = _traced(places, states.total, states.before)
        return LikeliestWay(tuple(self._runs(places, path, states.joined, sd_m)), cost, sd_m)

    def _places(self, sd_m: float) -> Places:
        """Candidates of each sample that is looked at, with their costs."""
        track, set_ = self._track, self._settings
        radius_m = set_.radius_sd * sd_m
        north = radius_m / METRE_PER_DEGREE
        east = north / np.cos(np.radians(track.lat_deg))
        boxes = shapely.box(track.lon_deg - east, track.lat_deg - north, track.lon_deg + east, track.lat_deg + north)
        at, link = self._tree.query(boxes)
        order = np.lexsort((link, at))
        at, link = at[order], link[order]
        position, distance, heading = (np.empty(at.size) for _ in range(3))
        kernels.project(
            self._roads, METRE_PER_DEGREE, track.lat_deg[at], track.lon_deg[at], link, position, distance, heading
        )
        near = distance <= radius_m
        at, link, position, distance, heading = (x[near] for x in (at, link, position, distance, heading))
        heading_sd_rad = math.hypot(set_.heading_sd_rad, sd_m / HEADING_BASE_M)
        turned = (1.0 - np.cos(heading - track.heading_rad[at])) / heading_sd_rad**2
        over = track.speed_mps[at] / self._speed_limit_mps[link] - 1.0 - SPEEDING_FRAC
        speeding = np.clip(over / SPEEDING_FRAC, 0.0, MOST_SPEEDING)
        cost = _tailed(distance / sd_m, set_.tail_sd) + np.where(np.isnan(turned), 0.0, turned) + speeding
        cost = self._weight[at] * (cost + math.log(sd_m / REFERENCE_SD_M))
        first = np.searchsorted(at, np.arange(track.sample.size + 1))
        return Places(first, link.astype(np.int64), position, cost)

    def _runs(self, places: Places, path: NDArray[np.int64], joined: NDArray[np.bool_], sd_m: float) -> list[Run]:
        """The chains of links along a sequence of candidates, cut where no way leads on."""
        driven, paused = self._track.driven_m, self._track.paused
        runs: list[Run] = []
        for t, state in enumerate(path.tolist()):
            if state < 0:
                continue
            link, position = int(places.link[state]), float(places.position_m[state])
            if runs:
                last = runs[-1].samples[-1]
                since_m = float(driven[last:t].sum())
                momentary = since_m <= OUTLIER_WAY_M and not paused[last:t].any()
                most = self._settings.split if joined[state] else REJOIN if momentary else 0.0
                if most > 0.0 and self._extend(runs[-1], t, link, position, since_m, most, sd_m):
                    continue
            runs.append(Run([t], [link], [position], [0.0]))
        return runs

    def _extend(
        self, run: Run, t: int, link: int, position_m: float, driven_m: float, most: float, sd_m: float
    ) -> bool:
        """Lead a run on to a place by the shortest way; False where its length would cost more than `most`."""
        length_m = self._roads.length_m
        slack = most * (self._settings.scale_sd * sd_m + self._settings.scale_frac * driven_m)
        last, there = run.links[-1], run.along_m[-1] - run.begin_m[-1]
        onward: list[int] = []
        way = position_m - there
        if link != last or way < -BACK_SD * sd_m:
            rest = float(length_m[last]) - there
            found = np.empty(length_m.size, np.int64)
            bound = driven_m + slack - rest
            count = kernels.links_between(self._roads, self._frontier, last, link, bound, found)
            if count < 0:
                return False
            onward = found[:count][::-1].tolist()
            way = rest + float(length_m[onward[:-1]].sum()) + position_m
        if abs(way - driven_m) > slack:
            return False
        for following in onward:
            run.begin_m.append(run.begin_m[-1] + float(length_m[run.links[-1]]))
            run.links.append(following)
        run.along_m.append(run.begin_m[-1] + position_m)
        run.samples.append(t)
        return True


def _tailed(z: NDArray[np.float64], tail_sd: float) -> NDArray[np.float64]:
    """Cost of a deviation of z standard deviations: normal, (1), beyond tail_sd in proportion to it (Huber)."""
    return np.where(z <= tail_sd, 0.5 * z * z, tail_sd * (z - 0.5 * tail_sd))


def _traced(places: Places, total: NDArray[np.float64], before: NDArray[np.int64]) -> tuple[NDArray[np.int64], float]:
    """The candidate that each sample of the likeliest sequence is at, −1 off all roads, int64 (T,), and its cost."""
    count, candidates = places.first.size - 1, places.link.size
    last = np.arange(places.first[-2], candidates)
    state = candidates + count - 1
    if last.size and total[last].min() < total[state]:
        state = int(last[np.argmin(total[last])])
    cost = float(total[state])
    path = np.empty(count, np.int64)
    for t in range(count - 1, -1, -1):
        path[t] = state if state < candidates else -1
        state = int(before[state])
    return path, cost
