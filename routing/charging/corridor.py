"""The stations over which the best journey may lead, and what is still to be paid at least from each of them."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Final

import numpy as np

from energy.units import JOULE_PER_KWH, SECOND_PER_HOUR
from routing.charging import kernels_plan as kernels
from routing.charging.halts import Course, HaltBounds, PlaceBounds, halt_bounds
from routing.charging.sites import charging_costs
from routing.charging.stretches import A_STRETCH, STRETCHES
from routing.route.via import same_place
from routing.weights import ECO, FASTEST, Weights

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from numpy.typing import NDArray

    from routing.charging.legs import LegFinder, Place
    from routing.charging.sites import Site, Worth

FEW_SITES: Final = 48  # of which all are looked at
LIKELY_FRAC: Final = 0.06  # of the least cost, that a best journey rarely costs more
LIKELY_S: Final = 900.0
LIKELY_OF_FEW_FRAC: Final = 0.04
LIKELY_REACH: Final = 0.7  # of what a way takes by the mean of the whole journey, that it takes at least
LABELS: Final = 64  # after which the searches of bounds end
FEW_LABELS: Final = 48
START_LABELS: Final = 256  # of the first, by which a plan may be proven at once
SAVED_FRAC: Final = 0.5  # of the energy of the greatest speed, that a halt saves at most; assumed
HARD_MPS2: Final = 2.0  # as which a halt slows down and speeds up at most; assumed
ROUNDING_FRAC: Final = 1e-9
ROUNDING_S: Final = 1e-3
COST_UNIT: Final = 3600.0  # of the objective, that a unit of a search's cost is


@dataclass(frozen=True, slots=True)
class Charges:
    """Charge at departure, asked for at the goal, and of a full battery [J]."""

    start_j: float
    goal_j: float
    capacity_j: float


@dataclass(frozen=True, slots=True, eq=False)
class Dearness:
    """What bounds count a joule of charge at, and by how much a stop at each station costs more at least, (n,), ≥ 0."""

    a_joule: float
    excess: NDArray[np.float64]


class Corridor:
    """The stations of one query by what a journey over them costs at least.

    dearness: no joule of charge costs less at any of sites, stops counted. places: start, via points, goal. number:
    rows of the station graph, of which the columns ahead are filled. stays: seconds and charge [J] at each via point.
    thinned: for a graph on which few stations are looked at. near: bool (stages, sites), those that remain;
    only_onward: whether ways lead to stations alone that are nearer to where a journey goes.
    """

    def __init__(
        self,
        finders: Sequence[LegFinder],
        worth: Worth,
        dearness: Dearness,
        sites: Sequence[Site],
        places: Sequence[Place],
        number: NDArray[np.float64],
        stays: Sequence[tuple[float, float]],
        charges: Charges,
        *,
        thinned: bool,
    ) -> None:
        self._finders, self._worth, self._sites, self._places = finders, worth, sites, places
        self._a_joule, self._excess = dearness.a_joule, dearness.excess
        self._number, self._stays, self._charges, self._thinned = number, stays, charges, thinned
        self._stages = len(places) - 1
        self.halts_count = self._may_halt()
        self._mixed = mixed_weights(worth, self._a_joule)
        self._joule_a_cost = 0.0  # what ways take, of the mixed cost
        self.near = np.ones((self._stages, len(sites)), np.bool_)
        self.only_onward = False
        self._halt_bounds: HaltBounds | None = None
        self._below, self._reached = math.inf, np.full(self.near.shape, -math.inf)  # at least, before each station
        self._halts = False  # whether journeys may halt where nothing is charged
        self._tails = [0.0] * self._stages  # mixed cost of what is behind each stage
        self._few: NDArray[np.bool_] | None = None  # chosen on a large graph, where only those along the way are known
        along = self._look_along() if thinned else None
        self.least_cost = self._look_ahead() if along is None else along

    @property
    def likely_cost(self) -> float:
        """A best journey hardly costs more; where what stops cost more is known, few do."""
        if self._excess.any():
            return self.least_cost + float(self._excess.min()) + LIKELY_OF_FEW_FRAC * abs(self.least_cost)
        return self.least_cost + self._likely(self.least_cost)

    def _may_halt(self) -> bool:
        """Whether a halt where nothing is charged may save more than it costs, so that bounds are to hold for halts.

        By half of the energy of the greatest speed at most (assumed), since on both sides of a crest what speed takes
        is drive and recuperation, with their losses. Slowing down and speeding up take their time.
        """
        top_mps = float(self._finders[0].space.arrays.speed_limit_mps.max())
        saved_j = SAVED_FRAC * self._finders[0].space.half_inertia_kg * top_mps**2
        saved = saved_j * (self._worth.a_joule + self._a_joule) - self._worth.a_second * top_mps / HARD_MPS2
        return saved > min((site.stop_cost for site in self._sites), default=math.inf)

    def _look_ahead(self) -> float:
        """Set what is still to be paid at least from each place; the least that any journey costs.

        Whatever is driven is charged sooner or later, but for what is in the battery, and no joule of charge comes
        cheaper than _a_joule. Stations that are far aside get what the straight line costs.
        """
        second = self._worth.a_second
        plain = weights_of(second, self._worth.a_joule)
        ahead, mixed, least = 0.0, self._a_joule * self._charges.goal_j, 0.0
        spots = [site.station.position for site in self._sites]
        for stage in range(self._stages - 1, -1, -1):
            here, there = self._places[stage], self._places[stage + 1]
            if stage < self._stages - 1:
                seconds, gain_j = self._stays[stage]
                ahead += second * seconds
                mixed += second * seconds - self._a_joule * gain_j
            self._tails[stage] = mixed
            rows = self._number[1 + stage * len(spots) : 1 + (stage + 1) * len(spots)]
            rows[:, kernels.AHEAD_A_JOULE] = self._a_joule
            rows[:, kernels.AHEAD], rows[:, kernels.AHEAD_MIX] = math.inf, math.inf
            onward, onward_mixed = math.inf, math.inf
            for finder in self._finders:
                to_goal = self._straight(finder, spots, there, to=True)
                aside = to_goal + self._straight(finder, spots, here, to=False)
                chosen = np.arange(len(spots))

                def near(
                    least: float, aside: NDArray[np.float64] = aside, all_of: bool = len(spots) <= FEW_SITES
                ) -> list[Place]:
                    nonlocal chosen
                    if not all_of:
                        slack = 1.5 * self._likely(COST_UNIT * least)
                        chosen = np.flatnonzero(aside <= COST_UNIT * least + slack)
                    return [spots[k] for k in chosen.tolist()]

                labels = (FEW_LABELS, FEW_LABELS) if self._thinned else (START_LABELS, LABELS)
                sharp = COST_UNIT * finder.least_costs(self._mixed, here, near, there, labels)
                picked = [spots[k] for k in chosen.tolist()]
                free = np.full(sharp.size, -math.inf)
                if not self._thinned:
                    free = COST_UNIT * finder.least_costs(plain, here, partial(_always, picked), there, labels)
                at_goal = [same_place(source, there) for source in (here, *picked)]
                sharp[at_goal] = 0.0
                free[at_goal] = np.minimum(free[at_goal], 0.0)
                to_goal[chosen] = sharp[1:]
                whole_free = np.full(len(spots), -math.inf)
                whole_free[chosen] = free[1:]
                rows[:, kernels.AHEAD_MIX] = np.minimum(rows[:, kernels.AHEAD_MIX], mixed + to_goal)
                rows[:, kernels.AHEAD] = np.minimum(rows[:, kernels.AHEAD], ahead + whole_free)
                onward, onward_mixed = min(onward, float(free[0])), min(onward_mixed, float(sharp[0]))
            rows[:, kernels.AHEAD_MIX] += self._excess
            ahead, mixed = ahead + onward, mixed + onward_mixed
            least = max(ahead, mixed - self._a_joule * self._charges.start_j)
        return least

    def _look_along(self) -> float | None:
        """As _look_ahead on a large graph: stations along the way alone, a few of which are chosen at once.

        None where no search back directs searches.
        """
        spots = [site.station.position for site in self._sites]
        slow = self._slow()
        few = np.zeros(self.near.shape, np.bool_)
        mixed = self._a_joule * self._charges.goal_j
        for stage in range(self._stages - 1, -1, -1):
            ends = self._places[stage], self._places[stage + 1]
            if stage < self._stages - 1:
                seconds, gain_j = self._stays[stage]
                mixed += self._worth.a_second * seconds - self._a_joule * gain_j
            rows = self._number[1 + stage * len(spots) : 1 + (stage + 1) * len(spots)]
            rows[:, kernels.AHEAD_A_JOULE], rows[:, kernels.AHEAD] = self._a_joule, -math.inf
            rows[:, kernels.AHEAD_MIX] = math.inf
            onward = math.inf
            for finder in self._finders:
                along = finder.along(self._mixed, COST_UNIT, ends, spots, slow, self._likely)
                if along is None:
                    return None
                ahead = np.maximum(along.least_there, self._straight(finder, spots, ends[1], to=True))
                rows[:, kernels.AHEAD_MIX] = np.minimum(rows[:, kernels.AHEAD_MIX], mixed + ahead)
                few[stage, list(along.few)] = True
                if along.onward < onward:
                    onward = along.onward
                    self._joule_a_cost = max(along.way_j, 0.0) / max(onward, 1e-9)
            mixed += onward
        self._few = few
        return mixed - self._a_joule * self._charges.start_j

    def _straight(self, finder: LegFinder, spots: Sequence[Place], place: Place, *, to: bool) -> NDArray[np.float64]:
        """No way between stations and a place costs less by the mixed weighting, by the straight line and height."""
        straight = finder.straight_costs(self._mixed, spots, place)
        lifts = finder.lift_costs(self._mixed, spots, place)
        found: NDArray[np.float64] = COST_UNIT * (straight + (lifts if to else -lifts))
        return found

    def _likely(self, cost: float) -> float:
        """By how much more than the least a best journey hardly costs."""
        return max(LIKELY_FRAC * abs(cost), LIKELY_S * self._worth.a_second)

    def keep_below(self, cost: float, weightings: Sequence[Weights] | None, *, thinned: bool = False) -> bool:
        """Leave out stations over which no journey costs less; thinned: and most of those that remain; whether others.

        What ways lead on from the others by some weightings, None: all, is searched at once, since a search back serves
        many.
        """
        if not thinned and self._few is not None:  # all stations are looked at after all
            self._few = None
            self.least_cost = max(self.least_cost, self._look_ahead())
        near = self._chosen(cost) if thinned else self._through(cost) <= cost
        changed = bool((near != self.near).any()) or thinned != self.only_onward or cost > self._below
        self._below = cost
        self.near, self.only_onward = near, thinned
        for stage in range(self._stages):
            chosen = np.flatnonzero(near[stage])
            ahead = self._number[1 + stage * len(self._sites) + chosen, kernels.AHEAD_MIX]
            chosen = chosen[np.argsort(-ahead, kind="stable")]  # a search back is led to the first, the farthest one
            spots = [self._sites[k].station.position for k in chosen.tolist()]
            for finder in self._finders if spots else ():
                if self._thinned:
                    finder.find_onward(spots, self._places[stage + 1], weightings)
                else:
                    finder.find_through(self._places[stage], spots, self._places[stage + 1], weightings)
        return changed

    def longest_s(self, here: int, there: int, cap: int, cost: float) -> float:
        """No journey that costs so much at most has a longer way between two places under a cap [s].

        here, there: as Task numbers them. What is before and behind it costs its least, by time alone and with energy
        at the least that a joule of charge costs; inf where driving less is worth any time.
        """
        if self.halts_count or self._worth.a_second == 0.0 or cost == math.inf:
            return math.inf
        second, goal = self._worth.a_second, 1 + self._stages * len(self._sites)
        spots = [
            self._places[-place] if place <= 0 else self._places[-1] if place == goal else self._spot(place)
            for place in (here, there)
        ]
        spent, spent_mixed = 0.0, -math.inf
        if here == 0:
            spent_mixed = -self._a_joule * self._charges.start_j
        elif 0 < here <= len(self._sites):
            pairs = [finder.pairs(self._places[0], [spots[0]], ())[0] for finder in self._finders]
            spent = second * SECOND_PER_HOUR * max(min(pair.least_cost(FASTEST) for pair in pairs), 0.0)
            spent_mixed = COST_UNIT * min(pair.least_cost(self._mixed) for pair in pairs)
            spent_mixed -= self._a_joule * self._charges.start_j
        ahead, ahead_mixed = 0.0, -math.inf
        if there == goal:
            ahead_mixed = self._a_joule * self._charges.goal_j
        elif there > 0:
            ahead, ahead_mixed = self._number[there, [kernels.AHEAD, kernels.AHEAD_MIX]].tolist()
        stops = sum(float(self._number[place, kernels.STOP_COST]) for place in (here, there) if place > 0)
        (pair,) = self._finders[cap].pairs(spots[0], [spots[1]], ())
        least = self._a_joule * JOULE_PER_KWH * pair.least_cost(ECO)
        by_time, mixed = cost - spent - max(ahead, 0.0) - stops, cost - spent_mixed - ahead_mixed - least
        return max(min(by_time, mixed), 0.0) / second * (1.0 + ROUNDING_FRAC) + ROUNDING_S

    def _spot(self, place: int) -> Place:
        return self._sites[(place - 1) % len(self._sites)].station.position

    def allow_halts(self, cost: float, is_over: Callable[[], bool]) -> bool:
        """Let all bounds hold for journeys that halt where nothing is charged, and leave out stations over which none
        of these costs so little; False, and nothing is changed, where it is over before.
        """

        def least(here: Place, there: Sequence[Place]) -> NDArray[np.float64]:
            costs = [[pair.least_cost(mixed) for pair in finder.pairs(here, there, (mixed,))] for finder in finders]
            found: NDArray[np.float64] = COST_UNIT * np.array(costs).min(axis=0)
            return found

        def straight(here: Place, there: Sequence[Place]) -> NDArray[np.float64]:
            lines = [self._straight(finder, there, here, to=False) for finder in finders]
            return np.asarray(np.min(lines, axis=0))

        finders, mixed = self._finders, self._mixed
        start_cost, goal_cost = -self._a_joule * self._charges.start_j, self._a_joule * self._charges.goal_j
        stays = [self._worth.a_second * seconds - self._a_joule * gain_j for seconds, gain_j in self._stays]
        spots = [site.station.position for site in self._sites]
        course = Course(self._places, start_cost, goal_cost, stays)
        bounds = halt_bounds(course, spots, least, straight, cost, is_over)
        if bounds is None:
            return False
        rows = self._number[1 : 1 + bounds.ahead.size]
        rows[:, kernels.AHEAD], rows[:, kernels.AHEAD_MIX] = -math.inf, bounds.ahead.ravel()
        self.least_cost, self.near = bounds.least_cost, bounds.through <= cost
        self._halts = True
        self._halt_bounds = bounds
        return True

    def place_bounds(self) -> PlaceBounds | None:
        """Bounds of journeys with halts by place, once they are allowed."""
        if self._halt_bounds is None:
            return None
        beyond = []
        for site in self._sites:
            charged_j, cost = charging_costs(site, self._charges.capacity_j, 1.0)
            beyond.append(min(site.stop_cost, float((cost - self._a_joule * charged_j).min())))
        stop, halt = np.maximum(beyond, 0.0), np.array([site.stop_cost for site in self._sites])
        never = np.array([math.inf])
        return PlaceBounds(
            np.concatenate((never, self._halt_bounds.reached.ravel(), never)),
            np.concatenate((never, self._halt_bounds.ahead.ravel(), [self._a_joule * self._charges.goal_j])),
            np.concatenate((never, np.tile(halt, self._stages), never)),
            np.concatenate((never, np.tile(stop, self._stages), never)),
            self._a_joule,
        )

    def _chosen(self, cost: float) -> NDArray[np.bool_]:
        """A few stations along the way, or, where none are told, those over which a journey likely costs least."""
        if self._few is not None:
            return self._few
        through = self._through(cost)
        near = np.zeros(self.near.shape, np.bool_)
        for stage in range(self._stages):
            order = np.argsort(through[stage] + self._slow(), kind="stable")[: STRETCHES * A_STRETCH]
            near[stage, order] = through[stage, order] <= cost
        return near

    def _slow(self) -> NDArray[np.float64]:
        """What charging costs more at each station than at the best; a stop rarely charges all of a battery."""
        slow = np.array([site.window_cost * self._charges.capacity_j + site.stop_cost for site in self._sites])
        found: NDArray[np.float64] = 0.5 * (slow - slow.min(initial=math.inf))
        return found

    def targets(self, stage: int, here: int | None) -> NDArray[np.bool_]:
        """Stations that ways from one, or from the place before the stage, may lead to, bool (sites,).

        Not those that no journey over both costs so little over, where that is known.
        """
        near: NDArray[np.bool_] = self.near[stage].copy()
        if here is None or self._halts or self._below == math.inf or self._reached[stage, here] == -math.inf:
            return near
        chosen = np.flatnonzero(near)
        spots, place = [self._sites[k].station.position for k in chosen.tolist()], self._sites[here].station.position
        ways = np.min([self._straight(finder, spots, place, to=False) for finder in self._finders], axis=0)
        ahead = self._number[1 + stage * len(self._sites) + chosen, kernels.AHEAD_MIX]
        near[chosen] = self._reached[stage, here] + self._excess[here] + ways + ahead <= self._below
        return near

    def leads_on(self, stage: int, here: int, there: NDArray[np.int64]) -> NDArray[np.bool_]:
        """Whether a station is farther from the next via point or goal than others, and likely within a charge."""
        ahead = self._number[1 + stage * len(self._sites) : 1 + (stage + 1) * len(self._sites), kernels.AHEAD_MIX]
        onward = ahead[here] - ahead[there]
        found: NDArray[np.bool_] = (onward > 0.0) & (
            onward * self._joule_a_cost * LIKELY_REACH < self._charges.capacity_j
        )
        return found

    def _through(self, cost: float) -> NDArray[np.float64]:
        """The least that a journey over a station costs, float64 (stages, sites); less than that only above a cost."""
        spots = [site.station.position for site in self._sites]
        so_far = -self._a_joule * self._charges.start_j
        through = np.full((self._stages, len(spots)), math.inf)
        for stage in range(self._stages):
            here, there = self._places[stage], self._places[stage + 1]
            onward, reached = math.inf, np.full(len(spots), math.inf)
            ahead = self._number[1 + stage * len(spots) : 1 + (stage + 1) * len(spots), kernels.AHEAD_MIX]
            for finder in self._finders:
                least, over = self._straight(finder, spots, here, to=False), np.full(len(spots), -math.inf)
                chosen = np.flatnonzero(so_far + least + ahead <= cost)
                if not self._thinned:
                    places, tail = [spots[k] for k in chosen.tolist()], self._tails[stage]
                    most = (cost - so_far - tail) / COST_UNIT
                    over[chosen] = tail + COST_UNIT * finder.find_over(self._mixed, here, places, there, most)
                    chosen = chosen[so_far + over[chosen] <= cost]
                pairs = finder.pairs(here, [*(spots[k] for k in chosen.tolist()), there], (self._mixed,))
                costs = COST_UNIT * np.array([pair.least_cost(self._mixed) for pair in pairs])
                least[chosen] = costs[:-1]
                reached = np.minimum(reached, so_far + least)
                through[stage] = np.minimum(through[stage], so_far + np.maximum(least + ahead, over))
                onward = min(onward, float(costs[-1]))
                way = pairs[-1].ways[0] if pairs[-1].ways else None
                if way is not None and costs[-1] > 0.0:
                    self._joule_a_cost = max(way.energy_j, 0.0) / float(costs[-1])
            self._reached[stage] = reached
            so_far += onward
            if stage < self._stages - 1:
                seconds, gain_j = self._stays[stage]
                so_far += self._worth.a_second * seconds - self._a_joule * gain_j
        self.least_cost = max(self.least_cost, so_far + self._a_joule * self._charges.goal_j)
        return through


def _always(places: Sequence[Place], _: float) -> Sequence[Place]:
    """The places, whatever is known of another one."""
    return places


def weights_of(a_second: float, a_joule: float) -> Weights:
    """Weights of a search whose costs are COST_UNIT of the objective's."""
    return Weights(a_joule * JOULE_PER_KWH / COST_UNIT, a_second * SECOND_PER_HOUR / COST_UNIT, 0.0)


def mixed_weights(worth: Worth, a_joule: float) -> Weights:
    """Weights of time and energy with what driving takes charged at a cost."""
    return weights_of(worth.a_second, worth.a_joule + a_joule)
