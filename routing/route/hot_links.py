"""The stretches of a route that take the most energy for their length, and why."""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import StrEnum
from typing import TYPE_CHECKING, Final, NamedTuple

import numpy as np

from energy.force.parts import SOURCE_PART_COUNT, Part
from routing.errors import QueryError

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

HOT_STRETCH_LIMIT: Final = 5
SHORTEST_STRETCH_M: Final = 100.0  # assumed: shorter ones are single junctions, of no use to somebody who reads a route
MARGIN_FRAC: Final = 0.5  # assumed: without one, stretches of half the route a few percent above its mean come first
ROUNDING_FRAC: Final = 1e-9  # an excess below this share of all energy moved is rounding


class HotReason(StrEnum):
    """What a hot stretch has more of than the rest of the route."""

    CLIMB = "climb"  # work against gravity
    SPEED = "speed"  # linear and aerodynamic drag
    STOPS = "stops"  # speeding up, braking, standing: inertia, losses of drive and recuperation, idle auxiliaries
    AUXILIARY = "auxiliary"  # auxiliaries while moving: much time for the length
    ROLLING = "rolling"  # rolling resistance
    CONDITIONS = "conditions"  # any further part: wind, wet road, cabin and so on


@dataclass(frozen=True, slots=True)
class RouteLinks:
    """The links of a route in driving order, one value a link.

    length_m: float64 (n,) > 0. energy_j: float64 (n,) from the battery, may be negative. grade_frac: float64 (n,).
    speed_limit_mps: float64 (n,). stop_probability_frac: float64 (n,) at the end of the link. duration_s: float64 (n,)
    with standing still, standstill_s: float64 (n,). parts_j: float64 (n, k), k ≥ 8, adding up to energy_j: rolling,
    linear, aero, grade, inertia, drivetrain loss, recuperation loss, auxiliary, then any others.
    road_names: (n,), empty where a road has none. altitude_m: float64 (n + 1,) heights of the nodes, where known.
    """

    length_m: NDArray[np.float64]
    energy_j: NDArray[np.float64]
    grade_frac: NDArray[np.float64]
    speed_limit_mps: NDArray[np.float64]
    stop_probability_frac: NDArray[np.float64]
    duration_s: NDArray[np.float64]
    standstill_s: NDArray[np.float64]
    parts_j: NDArray[np.float64]
    road_names: Sequence[str]
    altitude_m: NDArray[np.float64] | None = None

    def __post_init__(self) -> None:
        n = self.length_m.size
        for name in (
            "energy_j",
            "grade_frac",
            "speed_limit_mps",
            "stop_probability_frac",
            "duration_s",
            "standstill_s",
        ):
            shape = getattr(self, name).shape
            if shape != (n,):
                raise QueryError(name, f"of shape {shape}", f"({n},), one value a link")
        if self.parts_j.ndim != 2 or self.parts_j.shape[0] != n or self.parts_j.shape[1] < SOURCE_PART_COUNT:
            raise QueryError("parts_j", f"of shape {self.parts_j.shape}", f"({n}, {SOURCE_PART_COUNT} or more)")
        if len(self.road_names) != n:
            raise QueryError("road_names", f"{len(self.road_names)} long", f"{n}, one a link")
        if self.altitude_m is not None and self.altitude_m.shape != (n + 1,):
            raise QueryError("altitude_m", f"of shape {self.altitude_m.shape}", f"({n + 1},), one value a node")
        if not bool(np.all(self.length_m > 0.0)):
            raise QueryError("length_m", self.length_m.min(), "positive lengths")
        if not bool(np.all(np.isfinite(self.energy_j))):
            raise QueryError("energy_j", "not finite", "finite energies")


@dataclass(frozen=True, slots=True)
class HotStretch:
    """A run of links that takes more energy for its length than the route.

    first, last: positions of its links, both included. from_m, to_m: along the route. excess_j: energy above the
    route's mean for that length. energy_share_frac and times_mean: of the route's energy and energy a metre; None
    where the route's energy is not positive. rise_m: end height less start height. stop_count: expected.
    speed_mps: mean, standing still included. road_names: those of its links in order, each once.
    """

    first: int
    last: int
    from_m: float
    to_m: float
    length_m: float
    energy_j: float
    excess_j: float
    energy_per_m: float
    times_mean: float | None
    energy_share_frac: float | None
    reason: HotReason
    rise_m: float
    stop_count: float
    speed_mps: float
    speed_limit_mps: float
    road_names: tuple[str, ...]


def hot_stretches(
    links: RouteLinks,
    *,
    limit: int = HOT_STRETCH_LIMIT,
    shortest_m: float = SHORTEST_STRETCH_M,
    margin_frac: float = MARGIN_FRAC,
) -> tuple[HotStretch, ...]:
    """The stretches with the largest excess of energy, at most `limit`, largest first; linear in the number of links.

    A link's score is its energy less what its length takes at the bar, mean + margin_frac·|mean|, with the route's mean
    energy a metre. A stretch is a maximal scoring run of links (maximal_runs): it scores more than any part of it, and
    can't be extended to one that does. So each takes more a metre than the bar, and no two touch. They are ranked by
    their excess over the mean, equal ones in driving order. Those shorter than shortest_m are left out, and so is what
    is above the bar by rounding only. A route of one link, or with the same energy on every metre, has none.
    """
    if limit < 0:
        raise QueryError("limit", limit, "0 or more")
    if not shortest_m >= 0.0:
        raise QueryError("shortest_m", shortest_m, "0 or more")
    if not margin_frac >= 0.0:
        raise QueryError("margin_frac", margin_frac, "0 or more")
    if links.length_m.size == 0:
        return ()
    mean_j_per_m = float(links.energy_j.sum() / links.length_m.sum())
    excess = links.energy_j - mean_j_per_m * links.length_m
    score = excess - margin_frac * abs(mean_j_per_m) * links.length_m
    rounding_j = ROUNDING_FRAC * float(np.abs(links.parts_j).sum() + np.abs(links.energy_j).sum())
    score[np.abs(score) <= rounding_j] = 0.0
    node_m = [0.0, *np.cumsum(links.length_m).tolist()]
    summed = np.array((excess, links.energy_j, links.duration_s, links.stop_probability_frac))
    runs = [
        (_Sums(*summed[:, first : last + 1].sum(axis=1).tolist()), first, last)
        for first, last in maximal_runs(score)
        if node_m[last + 1] - node_m[first] >= shortest_m
    ]
    if not runs:
        return ()
    runs.sort(key=lambda run: (-run[0].excess_j, run[1]))
    causes_j = _causes_j(links)
    whole_j = {reason: math.fsum(cause_j) for reason, cause_j in causes_j.items()}
    route_j = float(links.energy_j.sum())
    stretches = []
    for sums, first, last in runs[:limit]:
        length_share = (node_m[last + 1] - node_m[first]) / node_m[-1]
        reason = _reason({r: j[first : last + 1] for r, j in causes_j.items()}, whole_j, length_share)
        stretches.append(_stretch(links, node_m, route_j, sums, first, last, reason))
    return tuple(stretches)


def maximal_runs(score: NDArray[np.float64]) -> list[tuple[int, int]]:
    """All maximal scoring runs [first, last] of a sequence, in order, by the algorithm of Ruzzo and Tompa.

    score: float64 (n,). A run is maximal if every proper part of it scores less than it, and no longer run that
    contains it has that property. Runs are disjoint, their scores positive, and no two touch. O(n).
    Ruzzo, W. L., Tompa, M.: A linear time algorithm for finding all maximal scoring subsequences. ISMB 1999, 234-241.
    """
    # For candidate k: its run, the sum of scores before it (start_sum) and up to its end (end_sum), and the last
    # candidate before it whose start_sum is smaller (below), which the search for such a candidate follows.
    first: list[int] = []
    last: list[int] = []
    start_sum: list[float] = []
    end_sum: list[float] = []
    below: list[int] = []
    total = 0.0
    for position, value in enumerate(score.tolist()):
        before, total = total, total + value
        if value <= 0.0:
            continue
        begin, sum_before = position, before
        while True:
            k = len(first) - 1
            while k >= 0 and start_sum[k] >= sum_before:
                k = below[k]
            if k < 0 or end_sum[k] >= total:
                break
            begin, sum_before = first[k], start_sum[k]  # candidate k and all after it are one with the new run
            del first[k:], last[k:], start_sum[k:], end_sum[k:], below[k:]
        first.append(begin)
        last.append(position)
        start_sum.append(sum_before)
        end_sum.append(total)
        below.append(k)
    return list(zip(first, last, strict=True))


class _Sums(NamedTuple):
    """Sums over the links of a run."""

    excess_j: float
    energy_j: float
    duration_s: float
    stop_count: float


def _stretch(
    links: RouteLinks, node_m: list[float], route_j: float, sums: _Sums, first: int, last: int, reason: HotReason
) -> HotStretch:
    chosen = slice(first, last + 1)
    length_m = node_m[last + 1] - node_m[first]
    energy_j, duration_s, route_m = sums.energy_j, sums.duration_s, node_m[-1]
    if links.altitude_m is None:
        rise_m = float(links.grade_frac[chosen] @ links.length_m[chosen])
    else:
        rise_m = float(links.altitude_m[last + 1] - links.altitude_m[first])
    return HotStretch(
        first=first,
        last=last,
        from_m=node_m[first],
        to_m=node_m[last + 1],
        length_m=length_m,
        energy_j=energy_j,
        excess_j=sums.excess_j,
        energy_per_m=energy_j / length_m,
        times_mean=(energy_j / length_m) / (route_j / route_m) if route_j > 0.0 else None,
        energy_share_frac=energy_j / route_j if route_j > 0.0 else None,
        reason=reason,
        rise_m=rise_m,
        stop_count=sums.stop_count,
        speed_mps=length_m / duration_s if duration_s > 0.0 else 0.0,
        speed_limit_mps=float(links.speed_limit_mps[chosen] @ links.length_m[chosen]) / length_m,
        road_names=tuple(dict.fromkeys(name for name in links.road_names[first : last + 1] if name)),
    )


def _reason(here_j: dict[HotReason, list[float]], whole_j: dict[HotReason, float], length_share: float) -> HotReason:
    """The cause whose energy exceeds its route mean for that length the most; of equal ones the first of HotReason."""
    excess = {reason: math.fsum(cause_j) - length_share * whole_j[reason] for reason, cause_j in here_j.items()}
    return max(excess, key=excess.__getitem__)


def _causes_j(links: RouteLinks) -> dict[HotReason, list[float]]:
    """Energy of each link by reason; together they are all parts. Auxiliaries are shared out by time standing still."""
    parts = links.parts_j
    standing = np.divide(
        links.standstill_s, links.duration_s, out=np.zeros(links.length_m.size), where=links.duration_s > 0.0
    )
    idle_j = parts[:, Part.AUXILIARY.idx] * standing
    causes = {
        HotReason.CLIMB: parts[:, Part.GRADE.idx],
        HotReason.SPEED: parts[:, Part.LINEAR.idx] + parts[:, Part.AERO.idx],
        HotReason.STOPS: parts[:, Part.INERTIA.idx]
        + parts[:, Part.DRIVETRAIN_LOSS.idx]
        + parts[:, Part.RECUPERATION_LOSS.idx]
        + idle_j,
        HotReason.AUXILIARY: parts[:, Part.AUXILIARY.idx] - idle_j,
        HotReason.ROLLING: parts[:, Part.ROLLING.idx],
        HotReason.CONDITIONS: parts[:, SOURCE_PART_COUNT:].sum(axis=1),
    }
    return {reason: cause_j.tolist() for reason, cause_j in causes.items()}
