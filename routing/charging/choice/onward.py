"""Whether any journey comes to its goal, by the battery alone: searches of least energy from all stations at once.

What is looked at is no harder than any journey: via points are passed by, each station gives as much as it may, and
nothing is kept beyond the reserve but at the goal. So where this finds no way there is none.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from routing.charging.choice.sources import Held, Spots, most_left, reached_from
from routing.route.via import same_place

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from routing.charging.choice.sources import Place
    from routing.charging.legs import LegCounts
    from routing.route.best_path import RouteSearch
    from routing.search.found import FoundPath
    from routing.search.space import SearchSpace

SAME_FRAC: Final = 1e-7  # of the capacity, that rounding may hide
START: Final = -1
GOAL: Final = -2
NEXT_STATIONS: Final = 16  # that are looked at where no way leads on; assumed
MOST_LOOKED_FROM: Final = 500
ROUNDS: Final = 100  # of driving from charge to charge, after which nothing is said
CHAIN_SEARCHES: Final = 32  # for ways from one charge to the next, at most; assumed
RAISED: Final = 3  # of them that reach no further station, after which any that has more than it gives counts as full


@dataclass(frozen=True, slots=True)
class Charges:
    """Charge at departure, most at a station's, least on arrival there and at the goal, reserve, full battery [J]."""

    start_j: float
    station_j: float
    arrive_j: float
    goal_j: float
    reserve_j: float
    capacity_j: float


@dataclass(frozen=True, slots=True, eq=False)
class Onward:
    """What comes of driving from charge to charge: whether the goal is come to, and which stations are, bool (n,).

    nearest: the station that is reached, or START, from which least lacks of what is asked for at the next one or at
    the goal, whether it is at the goal, and how much [J], by ways that no reserve holds up; inf where no way leads on.
    """

    is_met: bool
    reached: NDArray[np.bool_]
    nearest: int = START
    missing_j: float = 0.0
    at_goal: bool = True


@dataclass(frozen=True, slots=True)
class Hop:
    """The way that leaves most charge from a station, or START, to another one, or GOAL; cap: number of its cap."""

    here: int
    there: int
    cap: int
    path: FoundPath | None


class OnwardFinder:
    """Searches of one vehicle under each of its caps; ends: where a journey begins and ends, stations: between.

    spots: of stations, where they are known. A search counts as a label a link and source.

    Complexity: a search of the graph for each time that a charge brings more stations in reach.
    """

    def __init__(
        self,
        search: RouteSearch,
        spaces: Sequence[SearchSpace],
        ends: tuple[Place, Place],
        stations: Sequence[Place],
        charges: Charges,
        counts: LegCounts,
        spots: Spots | None = None,
    ) -> None:
        self._search, self._spaces, self._charges = search, spaces, charges
        (self._start, self._goal), self._stations = ends, stations
        self._counts = counts
        spots = Spots.at(stations) if spots is None else spots
        self._places = spots.joined(Spots.at([self._start]))  # the start is the last of them
        self._held = Held(charges.reserve_j, charges.capacity_j)
        # where the battery takes less when nearly full, ways of plans leave that out
        self._is_certain = all(space.conserving and space.physics.fade_width_j == 0.0 for space in spaces)
        self._slack_j = SAME_FRAC * charges.capacity_j
        self._round = np.zeros(len(stations) + 1, np.int64)  # of driving, that a station is reached in
        self._leaves_j = np.full(len(stations) + 1, -math.inf)  # the most that each is left with
        self._own: Onward | None = None

    def shut_off(self) -> Onward | None:
        """Why no journey comes to the goal; None where one may, or where that is not known."""
        own = self._from_charge_to_charge()
        if own is None:
            return None
        if not self.goal_is_beyond_all():
            return None if own.is_met else self._with_next_stations(own)
        return self._goal_from(np.append(own.reached, True), self._given_j()) if own.is_met else own

    def goal_is_beyond_all(self) -> bool:
        """Whether the goal is not come to from the start nor from any station, reached or not."""
        if self._charges.start_j > self._charges.station_j:  # and some stations may be come to with more than they give
            own = self._from_charge_to_charge()
            return own is not None and not own.is_met
        every = self._goal_from(np.ones(self._places.count, np.bool_), self._given_j())
        return every is not None and not every.is_met

    def chain(self) -> tuple[Hop, ...] | None:
        """Ways that lead from the start to the goal over stations, one after the other; None where none are known.

        Looked for backwards, from stations of earlier rounds first. One that is not come to after all is left out.
        """
        own = self._from_charge_to_charge()
        if own is None or not own.is_met:
            return None
        leaves_j, hops, good = self._given_j(), list[Hop](), np.append(own.reached, True)
        for _ in range(CHAIN_SEARCHES):
            there = hops[0].here if hops else GOAL
            if there == START:
                return tuple(hops)
            place, least_j = (
                (self._goal, self._charges.goal_j) if there == GOAL else (self._stations[there], self._charges.arrive_j)
            )
            others = good.copy()
            others[[hop.there for hop in hops if hop.there != GOAL]] = False
            earlier = others if there == GOAL else others & (self._round < self._round[there])
            for sources in (earlier, others):
                hop, most_j = self._hop(sources, leaves_j, place, there)
                if most_j >= least_j - self._slack_j:
                    hops.insert(0, hop)
                    break
            else:
                if there == GOAL:
                    return None
                good[there] = False
                del hops[0]
        return None

    def _hop(
        self, sources: NDArray[np.bool_], leaves_j: NDArray[np.float64], place: Place, there: int
    ) -> tuple[Hop, float]:
        """The way that leaves most charge at a place from some others, which may be there already, and how much."""
        nearest, most_j, cap, path = START, -math.inf, 0, None
        for k in self._at(place, sources):
            if k != there and leaves_j[k] > most_j:
                nearest, most_j = k, float(leaves_j[k])
        spots = self._places.where(sources)
        for number, space in enumerate(self._spaces):
            self._counts.labels += self._search.graph.link_count + spots.link.size
            left = most_left(self._search, space, self._held, spots, leaves_j, place)
            if left is not None and left.most_j > most_j:
                nearest, most_j, cap, path = left.source, left.most_j, number, left.path
        return Hop(START if nearest == len(self._stations) else nearest, there, cap, path), most_j

    def _given_j(self) -> NDArray[np.float64]:
        """Most charge that stations give, and at the start."""
        leaves_j = np.full(self._places.count, self._charges.station_j)
        leaves_j[-1] = self._charges.start_j
        return leaves_j

    def _at(self, place: Place, places: NDArray[np.bool_]) -> list[int]:
        """Those of some places that are the same as another one."""
        beside = self._places.any_of(np.isin(self._places.link, [position.link_idx for position in place]))
        every = (*self._stations, self._start) if bool((places & beside).any()) else ()
        return [k for k in np.flatnonzero(places & beside).tolist() if same_place(every[k], place)]

    def _from_charge_to_charge(self) -> Onward | None:
        """What is reached from the start, from there with a charge, and so on.

        Some may be come to with more than stations give, and be left so.
        """
        if self._own is not None or not self._is_certain:
            return self._own
        charges, leaves_j = self._charges, self._leaves_j
        leaves_j[-1] = charges.start_j
        new = np.zeros(self._places.count, np.bool_)
        new[-1] = True
        raised = 0
        for rounds in range(1, ROUNDS):
            comes_j = self._come_to(new, leaves_j)
            if comes_j is None:
                return None
            comes_j[-1] = -math.inf
            comes_j[comes_j < charges.arrive_j - self._slack_j] = -math.inf
            comes_j = np.where(comes_j > -math.inf, np.clip(comes_j, charges.station_j, charges.capacity_j), comes_j)
            # what a last link takes is left out, so that stops along a road seem to gain: an end of it in few rounds
            if raised > RAISED:
                comes_j[comes_j > charges.station_j + self._slack_j] = charges.capacity_j
            new = comes_j > leaves_j + self._slack_j
            first = new & (leaves_j == -math.inf)
            self._round[first] = rounds
            raised += not first.any()
            leaves_j[new] = comes_j[new]
            if not new.any():
                self._own = self._goal_from(leaves_j > -math.inf, leaves_j)
                return self._own
        return None

    def _come_to(self, sources: NDArray[np.bool_], leaves_j: NDArray[np.float64]) -> NDArray[np.float64] | None:
        """The most charge with which each place is come to from some of them."""
        comes_j = np.full(self._places.count, -math.inf)
        for space in self._spaces:
            spots = self._places.where(sources)
            self._counts.labels += self._search.graph.link_count + spots.link.size
            found = reached_from(self._search, space, self._held, spots, leaves_j, self._places)
            if found is None:
                return None
            comes_j = np.maximum(comes_j, found)
        return comes_j

    def _goal_from(self, places: NDArray[np.bool_], leaves_j: NDArray[np.float64]) -> Onward | None:
        """Whether the goal is come to from some places, and what lacks there where it is not."""
        if not self._is_certain:
            return None
        goal, goal_j, sources = self._goal, self._charges.goal_j, self._places.where(places)
        nearest, most_j = START, -math.inf
        for k in self._at(goal, places):
            if leaves_j[k] > most_j:
                nearest, most_j = k, float(leaves_j[k])
        for held in (self._held, Held(-math.inf, self._charges.capacity_j)):
            for space in self._spaces:
                self._counts.labels += self._search.graph.link_count + sources.link.size
                left = most_left(self._search, space, held, sources, leaves_j, goal)
                if left is None:
                    return None
                if left.most_j > most_j:
                    most_j, nearest = left.most_j, left.source
            if nearest == len(self._stations):
                nearest = START
            if held is self._held and most_j >= goal_j - self._slack_j:
                return Onward(True, places[:-1], nearest, goal_j - most_j)
        return Onward(False, places[:-1], nearest, goal_j - most_j)

    def _with_next_stations(self, own: Onward) -> Onward:
        """The same, or from where least lacks to come to one of the stations next to those that are reached."""
        free = Held(-math.inf, self._charges.capacity_j)
        sources = self._places.where(self._leaves_j > -math.inf)
        for k in self._next_to(own.reached).tolist():
            for space in self._spaces:
                left = most_left(self._search, space, free, sources, self._leaves_j, self._stations[k])
                if left is not None and self._charges.arrive_j - left.most_j < own.missing_j:
                    nearest = START if left.source == len(self._stations) else left.source
                    own = Onward(False, own.reached, nearest, self._charges.arrive_j - left.most_j, at_goal=False)
        return own

    def _next_to(self, reached: NDArray[np.bool_]) -> NDArray[np.int64]:
        """A few stations that are not reached, nearest to those that are and to the start by the straight line."""
        tail = self._search.graph.tail
        nodes = tail[[place[0].link_idx for place in (*self._stations, self._start)]]
        at = self._spaces[0].lower_bound.costs().place_m[nodes]
        beyond = np.flatnonzero(~reached)
        away_m = np.full(beyond.size, math.inf)
        whence = np.flatnonzero(reached)
        for here in (*whence[:: max(whence.size // MOST_LOOKED_FROM, 1)].tolist(), -1):
            away_m = np.minimum(away_m, np.linalg.norm(at[beyond] - at[here], axis=1))
        return beyond[np.argsort(away_m, kind="stable")[:NEXT_STATIONS]]
