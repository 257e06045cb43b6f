"""What a route query is answered with."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import TYPE_CHECKING, overload

from routing.places import Point, SnappedPoint
from routing.weights import Weights

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from energy.chain.chain import LinkResult, LinkResults
    from energy.chain.uncertainty import EnergyDistribution
    from energy.force.parts import EnergyParts
    from routing.route.hot_links import HotStretch


class ParetoProof(StrEnum):
    """What a claim on a Pareto set rests on: best ways by weightings, or all ways compared in time and energy."""

    WEIGHTINGS = "weightings"
    ALL_WAYS = "all_ways"
    NONE = "none"


class LegEnd(StrEnum):
    """What a leg leads to."""

    VIA = "via"
    STOP = "stop"
    GOAL = "goal"


@dataclass(frozen=True, slots=True)
class RouteLink:
    """One link of a route, driven from from_m to to_m of its length; result has energy, parts, time, speeds.

    rest: its end is a via point. geometry_end_idx: row of the route's geometry at which it ends.
    soc_end_p10_frac, soc_end_p90_frac: charge at its end that is not exceeded with a probability of 10 and 90 %, each
    place for itself; None where uncertainty was not asked for.
    """

    link_idx: int
    from_m: float
    to_m: float
    grade_frac: float  # rise over length, sin θ
    speed_limit_mps: float
    stop_probability_frac: float
    road_name: str
    result: LinkResult
    soc_end_frac: float
    braked_away_j: float
    rest: bool
    height_end_m: float  # above sea, 0 on a graph without terrain
    geometry_end_idx: int
    soc_end_p10_frac: float | None = None
    soc_end_p90_frac: float | None = None


@dataclass(frozen=True, slots=True, eq=False)
class DrivenLinks(Sequence[RouteLink]):
    """The links of a route in driving order: the rows are RouteLink, the columns lists of its fields.

    results: of all links. soc_end_p10_frac, soc_end_p90_frac: None at each link where uncertainty was not asked for.
    """

    link_idx: list[int]
    from_m: list[float]
    to_m: list[float]
    grade_frac: list[float]
    speed_limit_mps: list[float]
    road_name: list[str]
    results: LinkResults
    soc_end_frac: list[float]
    braked_away_j: list[float]
    rest: list[bool]
    height_end_m: list[float]
    geometry_end_idx: list[int]
    soc_end_p10_frac: Sequence[float | None]
    soc_end_p90_frac: Sequence[float | None]

    def __len__(self) -> int:
        return len(self.link_idx)

    @overload
    def __getitem__(self, at: int) -> RouteLink: ...

    @overload
    def __getitem__(self, at: slice) -> tuple[RouteLink, ...]: ...

    def __getitem__(self, at: int | slice) -> RouteLink | tuple[RouteLink, ...]:
        if isinstance(at, slice):
            return tuple(self[k] for k in range(*at.indices(len(self))))
        result = self.results[at]
        return RouteLink(
            link_idx=self.link_idx[at],
            from_m=self.from_m[at],
            to_m=self.to_m[at],
            grade_frac=self.grade_frac[at],
            speed_limit_mps=self.speed_limit_mps[at],
            stop_probability_frac=result.stop_probability_frac,
            road_name=self.road_name[at],
            result=result,
            soc_end_frac=self.soc_end_frac[at],
            braked_away_j=self.braked_away_j[at],
            rest=self.rest[at],
            height_end_m=self.height_end_m[at],
            geometry_end_idx=self.geometry_end_idx[at],
            soc_end_p10_frac=self.soc_end_p10_frac[at],
            soc_end_p90_frac=self.soc_end_p90_frac[at],
        )


@dataclass(frozen=True, slots=True)
class RouteLeg:
    """A route from one of its places to the next, from_m to to_m along the route [m].

    first_link, last_link: positions in the route's links; None where the places are the same and nothing is driven.
    battery_j: that the battery gave, as of Route. soc_start_frac: after charging where it begins at a charging stop.
    speed_cap_mps: highest speed that it was planned for, None without.
    """

    from_m: float
    to_m: float
    duration_s: float
    energy_j: float
    soc_end_frac: float
    first_link: int | None
    last_link: int | None
    battery_j: float = 0.0
    soc_start_frac: float = 0.0
    ends_at: LegEnd = LegEnd.GOAL
    speed_cap_mps: float | None = None


@dataclass(frozen=True, slots=True)
class Remedy:
    """What would make an infeasible route feasible.

    soc_start_needed_frac: charge at departure that this route needs, may exceed 1.
    charge_needed_wh: energy to add before or on the way.
    """

    soc_start_needed_frac: float
    charge_needed_wh: float


@dataclass(frozen=True, slots=True)
class Route:
    """One route. Not feasible: soc goes below the reserve, deficit_j > 0 and furthest is where it does.

    weights: what it is best in; None where it is of a Pareto set and no weighting found it.

    legs: from start to first via point or charging stop and so on to the goal, one where there are neither.
    stop_s: what charging stops take beside driving [s].
    """

    name: str
    weights: Weights | None
    feasible: bool
    distance_m: float
    duration_s: float
    energy_j: float
    parts: EnergyParts
    braked_away_j: float
    soc_start_frac: float
    soc_end_frac: float
    soc_min_frac: float
    climb_m: float
    descent_m: float
    geometry: NDArray[np.float64]  # (k, 2) lon, lat [deg]
    links: DrivenLinks
    legs: tuple[RouteLeg, ...]
    height_start_m: float  # above sea, 0 on a graph without terrain
    deficit_j: float = 0.0
    furthest: Point | None = None
    remedy: Remedy | None = None
    hot_links: tuple[HotStretch, ...] = ()
    uncertainty: EnergyDistribution | None = None
    stop_s: float = 0.0

    @property
    def battery_j(self) -> float:
        """Energy that the battery gave [J], what its charge has fallen by: with what it could not take back."""
        return self.energy_j + self.braked_away_j


@dataclass(frozen=True, slots=True)
class SearchStats:
    """What a search did."""

    labels_made: int
    labels_settled: int
    seconds: float
    method: str  # "label-setting" | "label-correcting", with "-pareto" where the charge limits bind


@dataclass(frozen=True, slots=True)
class ParetoClaim:
    """What is proven of a Pareto set: no way that keeps the reserve is better than all its routes by more than this.

    For every such way there is a route that takes at most 1 + epsilon_frac times its time, and at most slack_j more of
    the battery's charge [J]. slack_j: epsilon_frac · reference_j. reference_j: charge that the route of least energy
    uses beyond its gain in potential (docs/pareto.md). epsilon_frac, slack_j: None where nothing is proven, unproven
    says why. found: routes that were found, of which those answered are a choice. proof: what it rests on.
    """

    epsilon_frac: float | None
    slack_j: float | None
    reference_j: float
    found: int
    proof: ParetoProof
    unproven: str | None = None


@dataclass(frozen=True, slots=True)
class RouteAnswer:
    """Routes in the order of the weightings asked, or of a Pareto set by time, then with what is proven of it."""

    routes: tuple[Route, ...]
    start: SnappedPoint
    goal: SnappedPoint
    stats: tuple[SearchStats, ...]
    warnings: tuple[str, ...]
    via: tuple[SnappedPoint, ...] = ()
    pareto: ParetoClaim | None = None
