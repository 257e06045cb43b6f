"""What a search is bounded by, and what it has found."""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import StrEnum
from typing import TYPE_CHECKING, Final

import numpy as np

from routing.places import LinkPosition

if TYPE_CHECKING:
    from numpy.typing import NDArray


@dataclass(frozen=True, slots=True)
class Limits:
    """Battery energy that may be used from the start on [J]: least fills the battery, most reaches the reserve."""

    least_energy_j: float = -math.inf
    most_energy_j: float = math.inf

    @property
    def held(self) -> bool:
        """Whether any limit is held."""
        return self.least_energy_j != -math.inf or self.most_energy_j != math.inf


@dataclass(frozen=True, slots=True)
class PathOptions:
    """How a path is searched.

    pareto: pairs of cost and energy are kept, as they must be where limits are held and anything but energy is
    weighted. label_limit: labels beyond which the search gives up. begin_s: time since departure at the start [s],
    which cabin and tyres depend on. directed: towards the goals by the lower bound of docs/search-goal.md, which
    changes the work and not the answer.
    """

    pareto: bool = False
    label_limit: int = 50_000_000
    begin_s: float = 0.0
    directed: bool = True


USUAL: Final = PathOptions()


@dataclass(frozen=True, slots=True)
class FoundPath:
    """The cheapest way: links in order, first from start.offset_m on, last up to goal.offset_m."""

    links: tuple[int, ...]
    start: LinkPosition
    goal: LinkPosition
    cost: float
    energy_j: float
    time_s: float
    distance_m: float


@dataclass(frozen=True, slots=True)
class SearchCounts:
    """Work done by one search.

    unpaid_j: 0 where the answer is proven although the battery fills up while cabin or tyres warm up; otherwise what
    they could still take then, by which at most a better way may take less or keep the reserve more narrowly [J].
    """

    labels_made: int
    labels_settled: int
    seconds: float
    label_correcting: bool
    reduced_below_zero: int
    crowded: int
    unpaid_j: float = 0.0


@dataclass(frozen=True, slots=True)
class Reach:
    """What a one-to-all search reached.

    node_energy_j: float64 (N,) least energy to stop at each node, inf where unreachable.
    link_reach_m: float64 (M,) how far along each link one can drive and stop, -1 where it can't be entered.
    most_energy_j: battery energy that might be used [J].
    """

    node_energy_j: NDArray[np.float64]
    link_reach_m: NDArray[np.float64]
    most_energy_j: float
    counts: SearchCounts


class Measure(StrEnum):
    """What else than energy a one-to-all search can go by."""

    TIME = "time"
    DISTANCE = "distance"


@dataclass(frozen=True, slots=True)
class ReachBy:
    """What a one-to-all search by time or distance reached; the rest as in Reach.

    node_least: float64 (N,) least time [s] or distance [m] to stop at each node, inf beyond `most`. node_energy_j:
    float64 (N,) what the battery gives on that way.
    """

    node_least: NDArray[np.float64]
    node_energy_j: NDArray[np.float64]
    link_reach_m: NDArray[np.float64]
    most: float
    counts: SearchCounts
