"""One query for a journey with charging stops: its station graph, and the best journey on it with its proof."""

from __future__ import annotations

import math
import time
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import partial
from statistics import NormalDist
from typing import TYPE_CHECKING, Final

import numpy as np

from energy.charging.charge_time import charge_times
from energy.units import JOULE_PER_KWH, JOULE_PER_WH, SECOND_PER_HOUR, SECOND_PER_MINUTE
from routing.charging import kernels_plan as kernels
from routing.charging.kernels_plan import Rules, Stops
from routing.charging.legs import LegCounts, LegFinder, LegStore, usual_weightings
from routing.charging.margins import Margins
from routing.charging.network import Arc, Part, StationGraph
from routing.charging.sites import least_cost_a_joule, worth_of
from routing.charging.ways import joined, stay_of
from routing.errors import TimeUpError
from routing.route.via import same_place
from routing.stations.opening import open_times
from routing.weights import Weights

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from numpy.typing import NDArray

    from energy.charging.charging import Charging
    from routing.charging.legs import Place
    from routing.charging.network import Step
    from routing.charging.plan import ChargingQuery, FixedStay
    from routing.charging.sites import Site
    from routing.charging.ways import Way
    from routing.queries import RouteQuery

PROVEN_FRAC: Final = 1e-8  # of the cost, below which a bound meets a plan
ROUNDS: Final = 500  # of refinement at most
FEW_SITES: Final = 48  # of which all are looked at
LIKELY_FRAC: Final = 0.06  # of the least cost, that a best journey rarely costs more
LIKELY_S: Final = 900.0
LIKELY_REACH: Final = 0.7  # of what a way takes by the mean of the whole journey, that it takes at least
LABELS: Final = 256  # after which the searches of bounds end
FEW_LABELS: Final = 48
STRETCHES: Final = 12  # of a journey on a large graph, of each of which a few stations are looked at
A_STRETCH: Final = 3
MORE_LIKELY: Final = 3.0
FAR_FRAC: Final = 3.0
DAY_S: Final = 86_400.0
MOST_AC_W: Final = 22e3  # of a place to stay at, above which its power is direct current; assumed
COST_UNIT: Final = 3600.0  # of the objective, that a unit of a search's cost is
FEW_STOPS: Final = 8  # up to which labels are told apart by their number


@dataclass(frozen=True, slots=True)
class Proof:
    """By how much at most a better journey is better in the objective, None where nothing is proven, and why."""

    short_by: float | None
    unproven: str = ""


@dataclass(frozen=True, slots=True)
class Shortage:
    """Where journeys end: the place whose onward way lacks least, what it lacks [J], the last place reached."""

    place: int
    missing_j: float
    last: int


class Task:
    """One query at work.

    Places of the station graph: 0 is the start, 1 + stage · sites + k station k with `stage` via points behind, the
    last one the goal; −1 − k is via point k. places: start, via points and goal on the roads. margin_j: kept beyond
    the energy of a way, by that energy [J], with which it must rise, and its climb [m].
    """

    def __init__(
        self,
        legs: LegStore,
        query: RouteQuery,
        charging: ChargingQuery,
        vehicle_charging: Charging,
        sites: Sequence[Site],
        places: Sequence[Place],
        margin_j: Callable[[float, float], float] | None,
        proof_s: float,
        many_links: int,
    ) -> None:
        self.query, self.charging, self.sites, self.places = query, charging, sites, places
        self.capacity_j = query.vehicle.usable_capacity_wh * JOULE_PER_WH
        self.reserve_j = query.reserve_soc_frac * self.capacity_j
        self.counts = LegCounts()
        self._vehicle_charging, self._legs, self._margin_j, self._proof_s = vehicle_charging, legs, margin_j, proof_s
        self._worth = worth_of(charging)
        self._stages = len(places) - 1
        kinds = {id(site.curve): site.curve for site in sites}
        self._kind = {key: k for k, key in enumerate(kinds)}
        self._start_j = query.soc_frac * self.capacity_j
        self.goal = 1 + self._stages * len(sites)
        self._stops = self._made_stops()
        self.margins = Margins()
        curves = charge_times(list(kinds.values()), self.capacity_j).curves
        self.graph = StationGraph(curves, self._stops, self._arcs_from, self.margins.of)
        self._a_joule = least_cost_a_joule(sites, query.vehicle.usable_capacity_wh, charging.max_soc_frac)
        self._mixed = weights_of(self._worth.a_second, self._worth.a_joule + self._a_joule)
        self._is_thinned = legs.search.graph.link_count > many_links
        weightings = usual_weightings(self._mixed, bounded=not self._is_thinned)
        self.queries = capped(query, charging.speed_caps_mps)
        self._finders = [LegFinder(legs, capped_query, weightings, self.counts) for capped_query in self.queries]
        self._vias: dict[int, list[Arc]] = {}
        self._beyond: dict[int, list[tuple[int, Way]]] = {}  # ways that no full battery suffices for, by their place
        self._only_onward = False  # whether ways lead to stations alone that are nearer to where a journey goes
        self._joule_a_cost = 0.0  # what ways take, of the mixed cost
        self._near = np.ones((self._stages, len(sites)), np.bool_)  # the stations that journeys may call at, by stage
        self.least_cost = self._look_ahead()

    def _made_stops(self) -> Stops:
        charging, capacity_j, count = self.charging, self.capacity_j, self.goal + 1
        number = np.zeros((count, 10))
        number[:, kernels.CURVE] = -1.0
        number[:, kernels.LEAST_J] = charging.arrive_soc_frac * capacity_j
        number[self.goal, kernels.LEAST_J] = self._goal_least_j()
        opening_first, opening = [0, 0], []
        for place in range(1, self.goal):
            site = self.site_at(place)
            number[place, kernels.CURVE] = self._kind[id(site.curve)]
            number[place, kernels.A_SECOND], number[place, kernels.A_JOULE] = site.a_second, site.a_joule
            number[place, kernels.STOP_COST], number[place, kernels.STOP_S] = site.stop_cost, charging.overhead_s
            number[place, kernels.CAP] = charging.max_soc_frac * capacity_j
            hours = open_times(site.station.opening_hours) if charging.departure_min is not None else None
            opening += [(begin * SECOND_PER_MINUTE, end * SECOND_PER_MINUTE) for begin, end in hours or ()]
            opening_first.append(len(opening))
        opening_first.append(len(opening))
        return Stops(
            number,
            np.zeros(count, np.bool_),
            np.zeros(count, np.int64),
            np.zeros(count, np.int64),
            np.array(opening_first, np.int64),
            np.array(opening, np.float64).reshape(-1, 2),
        )

    def _look_ahead(self) -> float:
        """Set what is still to be paid at least from each place; the least that any journey costs.

        Whatever is driven is charged sooner or later, but for what is in the battery, and no joule of charge comes
        cheaper than _a_joule. Stations that are far aside get what the straight line costs.
        """
        second = self._worth.a_second
        plain = weights_of(second, self._worth.a_joule)
        ahead, mixed, least = 0.0, self._a_joule * self._goal_least_j(), 0.0
        spots = [site.station.position for site in self.sites]
        for stage in range(self._stages - 1, -1, -1):
            here, there = self.places[stage], self.places[stage + 1]
            stay = self.stay_at(stage) if stage < self._stages - 1 else None
            if stay is not None:
                ahead += second * stay.seconds
                mixed += second * stay.seconds - self._a_joule * self.stay_gain_j(stay)
            rows = self._stops.number[1 + stage * len(spots) : 1 + (stage + 1) * len(spots)]
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

                labels = FEW_LABELS if self._is_thinned else LABELS
                sharp = COST_UNIT * finder.least_costs(self._mixed, here, near, there, labels)
                picked = [spots[k] for k in chosen.tolist()]
                free = np.full(sharp.size, -math.inf)
                if not self._is_thinned:
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
            ahead, mixed = ahead + onward, mixed + onward_mixed
            least = max(ahead, mixed - self._a_joule * self._start_j)
        return least

    def _straight(self, finder: LegFinder, spots: Sequence[Place], place: Place, *, to: bool) -> NDArray[np.float64]:
        """No way between stations and a place costs less by the mixed weighting, by the straight line and height."""
        straight = finder.straight_costs(self._mixed, spots, place)
        lifts = [finder.lift_cost(self._mixed, *((spot, place) if to else (place, spot))) for spot in spots]
        found: NDArray[np.float64] = COST_UNIT * (straight + np.array(lifts))
        return found

    def _likely(self, cost: float) -> float:
        """By how much more than the least a best journey hardly costs."""
        return max(LIKELY_FRAC * abs(cost), LIKELY_S * self._worth.a_second)

    def keep_below(self, cost: float, *, thinned: bool = False) -> None:
        """Leave out stations over which no journey costs less; thinned: and most of those that remain.

        What ways lead on from the others is searched at once, since a search back serves many.
        """
        through = self._through(cost)
        near = through <= cost
        if thinned:
            slow = np.array([site.window_cost * self.capacity_j + site.stop_cost for site in self.sites])
            score = through + 0.5 * (slow - slow.min(initial=math.inf))  # a stop rarely charges all of that
            near = np.array([self._few_of(stage, score[stage], near[stage]) for stage in range(self._stages)])
        if bool((near != self._near).any()) or thinned != self._only_onward:
            self._near, self._only_onward = near, thinned
            self._vias.clear()
            self._stops.known[:] = False
        for stage in range(self._stages):
            chosen = np.flatnonzero(near[stage])
            ahead = self._stops.number[1 + stage * len(self.sites) + chosen, kernels.AHEAD_MIX]
            chosen = chosen[np.argsort(-ahead, kind="stable")]  # a search back is led to the first, the farthest one
            spots = [self.sites[k].station.position for k in chosen.tolist()]
            for finder in self._finders if spots else ():
                finder.find_onward(spots, self.places[stage + 1])
                for k in chosen.tolist() if thinned else ():
                    behind = [self.sites[i].station.position for i in chosen.tolist() if self._leads_on(stage, i, k)]
                    if behind:
                        finder.find_onward(behind, self.sites[k].station.position)

    def _few_of(self, stage: int, score: NDArray[np.float64], near: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """A few stations for each stretch of the way, those of the least scores."""
        ahead = self._stops.number[1 + stage * near.size : 1 + (stage + 1) * near.size, kernels.AHEAD_MIX]
        kept = np.zeros(near.size, np.bool_)
        chosen = np.flatnonzero(near)
        if chosen.size:
            span = max(float(np.ptp(ahead[chosen])), 1e-9)
            stretch = np.minimum((STRETCHES * (ahead[chosen] - ahead[chosen].min()) / span).astype(int), STRETCHES - 1)
            for k in range(STRETCHES):
                inside = chosen[stretch == k]
                kept[inside[np.argsort(score[inside], kind="stable")[:A_STRETCH]]] = True
        return kept

    def _leads_on(self, stage: int, here: int, there: int) -> bool:
        """Whether one station is farther from the next via point or goal than another, and likely within a charge."""
        rows = self._stops.number[1 + stage * len(self.sites) : 1 + (stage + 1) * len(self.sites)]
        onward = float(rows[here, kernels.AHEAD_MIX] - rows[there, kernels.AHEAD_MIX])
        return onward > 0.0 and onward * self._joule_a_cost * LIKELY_REACH < self.capacity_j

    def _through(self, cost: float) -> NDArray[np.float64]:
        """The least that a journey over a station costs, float64 (stages, sites); less than that only above a cost."""
        spots = [site.station.position for site in self.sites]
        so_far = -self._a_joule * self._start_j
        through = np.full((self._stages, len(spots)), math.inf)
        for stage in range(self._stages):
            here, there = self.places[stage], self.places[stage + 1]
            onward = math.inf
            ahead = self._stops.number[1 + stage * len(spots) : 1 + (stage + 1) * len(spots), kernels.AHEAD_MIX]
            for finder in self._finders:
                least = self._straight(finder, spots, here, to=False)
                chosen = np.flatnonzero(so_far + least + ahead <= cost)
                pairs = finder.pairs(here, [*(spots[k] for k in chosen.tolist()), there], (self._mixed,))
                costs = COST_UNIT * np.array([pair.least_cost(self._mixed) for pair in pairs])
                least[chosen] = costs[:-1]
                through[stage] = np.minimum(through[stage], so_far + least + ahead)
                onward = min(onward, float(costs[-1]))
                way = pairs[-1].ways[0] if pairs[-1].ways else None
                if way is not None and costs[-1] > 0.0:
                    self._joule_a_cost = max(way.energy_j, 0.0) / float(costs[-1])
            so_far += onward
            stay = self.stay_at(stage)
            if stay is not None:
                so_far += self._worth.a_second * stay.seconds - self._a_joule * self.stay_gain_j(stay)
        self.least_cost = max(self.least_cost, so_far + self._a_joule * self._goal_least_j())
        return through

    def site_at(self, place: int) -> Site:
        """The station at a place of the station graph."""
        return self.sites[(place - 1) % len(self.sites)]

    def stay_at(self, via_idx: int | None) -> FixedStay | None:
        """The fixed stay at a via point, or at the goal."""
        return next((stay for stay in self.charging.stays if stay.via_idx == via_idx), None)

    def stay_gain_j(self, stay: FixedStay) -> float:
        """What a fixed stay charges, if the battery has room.

        By the charger on board, up to its power; above what one takes by direct current, as fast as the slowest part of
        the curve, since what a stay gives must not depend on the charge.
        """
        vehicle = self._vehicle_charging
        power_w = vehicle.ac_eff * min(stay.power_w, vehicle.ac_power_w)
        if vehicle.dc is not None and stay.power_w > max(vehicle.ac_power_w, MOST_AC_W):
            power_w = max(power_w, min(vehicle.dc_eff * stay.power_w, float(vehicle.dc.power_w.min())))
        return power_w * stay.seconds

    def _goal_least_j(self) -> float:
        """Charge on arrival at the goal; what is charged there may bring it to what is asked for."""
        stay = self.stay_at(None)
        if stay is None:
            return max(self.charging.goal_soc_frac * self.capacity_j, self.reserve_j)
        after_j = self.charging.goal_soc_frac * self.capacity_j - self.stay_gain_j(stay)
        return max(
            after_j, min(self.charging.arrive_soc_frac, self.charging.goal_soc_frac) * self.capacity_j, self.reserve_j
        )

    def _rules(self, *, bounded: bool) -> Rules:
        departure_min = self.charging.departure_min
        most = self.charging.most_stops
        return Rules(
            reserve_j=self.reserve_j,
            departure_s=0.0 if departure_min is None else departure_min * SECOND_PER_MINUTE,
            a_second=self._worth.a_second,
            clocked=self._stops.opening.size > 0,
            counted=most <= FEW_STOPS,
            most_stops=most,
            bounded=bounded,
        )

    def position(self, place: int) -> Place:
        """Where a place of the station graph is on the roads."""
        if place <= 0:
            return self.places[-place]
        return self.places[-1] if place == self.goal else self.site_at(place).station.position

    @property
    def is_clocked(self) -> bool:
        """Whether opening hours are looked at."""
        return self._stops.opening.size > 0

    @property
    def ac_eff(self) -> float:
        """Battery from wall at fixed stays."""
        return self._vehicle_charging.ac_eff

    def cap_mps(self, cap: int) -> float | None:
        """A cap on speed by its number [m/s]; None for none."""
        return None if cap == 0 else self.queries[cap].conditions.top_speed_mps

    def waiting_s(self, place: int, arrive_s: float) -> float:
        """How long a station is still closed on arrival [s]."""
        return kernels.waiting_s(self._stops, place, self._rules(bounded=False).departure_s + arrive_s)

    def direct_way(self) -> Way | None:
        """A way from the start to the first place after it, whatever charge it takes."""
        (pair,) = self._finders[0].pairs(self.places[0], [self.places[1]])
        return pair.ways[0] if pair.ways else None

    def _stage(self, place: int) -> int:
        """How many via points are behind at a place."""
        return -place if place <= 0 else (place - 1) // len(self.sites)

    def _arcs_from(self, place: int) -> list[Arc]:
        """Arcs from the start, a station or a via point, over no, one or more via points."""
        if place == self.goal:
            return []
        stage = self._stage(place)
        first = 1 + stage * len(self.sites)
        last = stage == self._stages - 1
        targets = [first + int(k) for k in np.flatnonzero(self._near[stage]) if first + k != place]
        if self._only_onward and place > 0:
            here_idx = (place - 1) % len(self.sites)
            targets = [to for to in targets if self._leads_on(stage, here_idx, to - first)]
        onward = self.goal if last else -1 - stage
        targets.append(onward)
        spots = [self.position(to) for to in targets]
        arcs: list[Arc] = []
        longest_j = self.capacity_j - self.reserve_j
        here = self.position(place)
        for cap, finder in enumerate(self._finders):
            for to, there, pair in zip(targets, spots, finder.pairs(here, spots), strict=True):
                climb_m = finder.climb_m(here, there) if self._margin_j is not None else 0.0
                for way in (*pair.ways, *(() if self._is_thinned else pair.bounds())):
                    if way.longest_j > longest_j:
                        if not way.is_bound:
                            self._beyond.setdefault(place, []).append((to, way))
                        continue
                    margin_j = 0.0 if self._margin_j is None else self._margin_j(way.energy_j, climb_m)
                    part = Part(place, to, way, cap, margin_j)
                    if to == onward and not last:
                        arcs += self._over(to, part)
                    else:
                        arcs.append(self._arc(to, way, (part,)))
        return arcs

    def _over(self, via: int, part: Part) -> list[Arc]:
        """Arcs that begin with a part to a via point, and those that end there where it is a station."""
        if via not in self._vias:
            self._vias[via] = self._arcs_from(via)
        found = []
        stage = -via
        for k, site in enumerate(self.sites):
            if site.station.position == self.places[-via]:
                found.append(self._arc(1 + stage * len(self.sites) + k, part.way, (part,)))
        before = part.way
        stay = self.stay_at(-1 - via)
        if stay is not None:
            gain_j = self.stay_gain_j(stay)
            least_j = (
                max(self.charging.arrive_soc_frac * self.capacity_j - self.reserve_j, 0.0) if gain_j > 0.0 else 0.0
            )
            before = joined(before, stay_of(stay.seconds, gain_j, least_j))
        for arc in self._vias[via]:
            if arc.parts[0].cap == part.cap:
                way = joined(before, arc.way)
                if way.longest_j <= self.capacity_j - self.reserve_j:
                    found.append(self._arc(arc.to, way, (part, *arc.parts)))
        return found

    def _arc(self, to: int, way: Way, parts: tuple[Part, ...]) -> Arc:
        cost = self._worth.a_second * way.time_s + self._worth.a_joule * sum(part.way.energy_j for part in parts)
        return Arc(to, way, cost, self._arc_margin_j(to, way, parts), parts)

    def _arc_margin_j(self, to: int, way: Way, parts: tuple[Part, ...]) -> float:
        """The least margin of an arc: what is kept at its end may have been needed on the way anyway."""
        if any(part.there < 0 and self.stay_at(-1 - part.there) is not None for part in parts):
            return 0.0  # of which promises tell more
        arrive_j = float(self._stops.number[to, kernels.LEAST_J]) + way.energy_j
        return max(arrive_j + sum(part.margin_j for part in parts) - self.needs_j(to, way), 0.0)

    def found(self) -> list[Step] | None:
        """The best journey along known ways, of stations over which a journey may be the best; None where none is.

        Stations over which no journey costs less than one that is known are left out, at first those that are likely
        to be such.
        """
        if self._is_thinned:
            self.keep_below(self.least_cost + self._likely(self.least_cost), thinned=True)
            best = self._with_other_ways(self.best())
            if best is not None:
                return best
        if len(self.sites) <= FEW_SITES:
            return self._with_other_ways(self.best()) if self._is_thinned else self.best()
        slack = self._likely(self.least_cost)
        while True:
            self.keep_below(self.least_cost + slack)
            best = self.best()
            if best is not None:
                if best[-1].cost <= self.least_cost + slack:
                    break
                slack = best[-1].cost - self.least_cost
            elif bool(self._near.all()):
                return None
            else:
                slack = MORE_LIKELY * slack if slack < FAR_FRAC * abs(self.least_cost) + DAY_S else math.inf
        self.keep_below(best[-1].cost)
        return self._with_other_ways(best) if self._is_thinned else best

    def _with_other_ways(self, best: list[Step] | None) -> list[Step] | None:
        """The best journey with the fastest and least-energy ways between the stops of those before it."""
        while best is not None and self.with_more_ways(best):
            best = self.best()
        return best

    def with_more_ways(self, journey: list[Step]) -> bool:
        """Learn the fastest and the least-energy ways between the stops of a journey; whether one was not known."""
        changed = False
        for step in journey[1:]:
            for part in step.arc.parts if step.arc is not None else ():
                if self._finders[part.cap].more(self.position(part.here), self.position(part.there)):
                    changed = True
                    self._forget(part.here)
        return changed

    def _forget(self, place: int) -> None:
        """Ask for the arcs of a place anew."""
        if place < 0:
            self._vias.clear()
            self._stops.known[:] = False
        else:
            self.graph.forget(place)

    def best(
        self,
        *,
        bounded: bool = False,
        below: float = math.inf,
        until: float = math.inf,
        known_only: bool = False,
    ) -> list[Step] | None:
        """The best journey along known ways, or along bounds as well; None where none costs less.

        until, known_only: as of StationGraph.best.
        """
        rules = self._rules(bounded=bounded)
        return self.graph.best(0, self._start_j, self.goal, rules, below, until=until, known_only=known_only)

    def weigh(self) -> None:
        """Take margins as they are known now."""
        self.graph.weigh(self.margins.factor, self.margins.places())

    @property
    def is_bounded(self) -> bool:
        """Whether it is known of all ways what none is better than."""
        return not self._is_thinned

    @property
    def finder(self) -> LegFinder:
        """Ways without a cap on speed."""
        return self._finders[0]

    @property
    def goal_least_frac(self) -> float:
        """Charge on arrival at the goal that is asked for."""
        return self._goal_least_j() / self.capacity_j

    @contextmanager
    def closed(self, station_id: str) -> Iterator[None]:
        """Searches as if a station were not there."""
        places = [place for place in range(1, self.goal) if self.site_at(place).station.id == station_id]
        least_j = self._stops.number[places, kernels.LEAST_J]
        self._stops.number[places, kernels.LEAST_J] = math.inf
        try:
            yield
        finally:
            self._stops.number[places, kernels.LEAST_J] = least_j

    def proven(self, best: list[Step] | None) -> tuple[list[Step] | None, Proof]:
        """The best journey that is found, where one is known that may not be the best, and the proof of it.

        A journey over bounds is no worse than any journey. As long as the best of these is better than the best known
        one, more is learnt of the ways at its bounds.
        """
        if best is not None and best[-1].cost - self.least_cost <= PROVEN_FRAC * abs(best[-1].cost):
            return best, Proof(0.0)
        if self._is_thinned:
            why = "on a graph of this size a plan is bounded by what driving and charging cost at least"
            return best, Proof(None if best is None else best[-1].cost - self.least_cost, why)
        short_by, until = math.inf, time.perf_counter() + self._proof_s
        why = "too many ways between stations to compare"
        try:
            for _ in range(ROUNDS):
                cost = math.inf if best is None else best[-1].cost
                bound = self.best(bounded=True, below=math.inf if best is None else cost - PROVEN_FRAC * abs(cost))
                if bound is None:
                    return best, Proof(0.0)
                short_by = cost - bound[-1].cost
                if time.perf_counter() > until:
                    break
                if not self.refined(bound, cost):
                    why = "ways between stations could not be compared in all that they do to a battery"
                    break
                best = self.best()
        except TimeUpError as error:
            if best is None:
                raise
            why = f"{error.limit_s:g} s were not enough for a proof"
        if best is not None:
            short_by = min(short_by, best[-1].cost - self.least_cost)
        return best, Proof(short_by if math.isfinite(short_by) else None, why)

    def refined(self, journey: list[Step], cost: float = math.inf) -> bool:
        """Learn more of ways at the bounds of a journey that may cost so much; whether anything was to be learnt."""
        learnt = False
        most_s = math.inf
        if self._worth.a_joule == 0.0 and self._worth.a_second > 0.0:
            most_s = cost / self._worth.a_second
        for step in journey[1:]:
            for part in step.arc.parts if step.arc is not None else ():
                if not part.way.is_bound:
                    continue
                here, there = self.position(part.here), self.position(part.there)
                finder = self._finders[part.cap]
                if finder.refined(here, there, part.way, most_s, self.capacity_j - self.reserve_j):
                    learnt = True
                    self._forget(part.here)
        return learnt

    def shortage(self) -> Shortage:
        """Where journeys end that do not come to the goal, after a search that found none."""
        reached = self.graph.reached
        least, last, last_s = Shortage(0, math.inf, 0), 0, math.inf
        for place, charge_j in reached.items():
            depart_j = max(charge_j, self.charging.max_soc_frac * self.capacity_j) if place > 0 else charge_j
            onward = [(arc.to, arc.way, self.margins.of(arc)) for arc in self.graph.arcs(place) if not arc.way.is_bound]
            onward += [(to, way, 0.0) for to, way in self._beyond.get(place, ())]
            for to, way, margin_j in onward:
                if to in reached:
                    continue
                missing_j = self.needs_j(to, way) + margin_j - depart_j
                if missing_j < least.missing_j:
                    least = Shortage(place, missing_j, 0)
            ahead_s = float(self._stops.number[place, kernels.AHEAD])
            if place > 0 and ahead_s < last_s:
                last, last_s = place, ahead_s
        return replace(least, last=last)

    def needs_j(self, to: int, way: Way) -> float:
        """Charge that a way to a place begins with at least, without a margin [J]."""
        arrive_j = float(self._stops.number[to, kernels.LEAST_J]) + way.energy_j
        return max(self.reserve_j + way.need_j, arrive_j)


def _always(places: Sequence[Place], _: float) -> Sequence[Place]:
    """The places, whatever is known of another one."""
    return places


def weights_of(a_second: float, a_joule: float) -> Weights:
    """Weights of a search whose costs are COST_UNIT of the objective's."""
    return Weights(a_joule * JOULE_PER_KWH / COST_UNIT, a_second * SECOND_PER_HOUR / COST_UNIT, 0.0)


def capped(query: RouteQuery, caps_mps: Sequence[float]) -> tuple[RouteQuery, ...]:
    """The query, and again for each cap on its speed that is below what holds anyway, the highest first."""
    queries = [query]
    top_mps = query.conditions.top_speed_mps
    for cap in sorted(set(caps_mps), reverse=True):
        if top_mps is None or cap < top_mps:
            queries.append(replace(query, conditions=replace(query.conditions, top_speed_mps=cap)))
    return tuple(queries)


def usual_margin_j(sd_frac: float, confidence: float, weight_n: float) -> Callable[[float, float], float]:
    """What is kept at least beyond a way's energy so that it suffices with a probability.

    sd_frac: standard deviation of the model's residual over the dissipated energy; parameters only add to it. What
    height stores is certain.
    """
    share = NormalDist().inv_cdf(confidence) * sd_frac
    return lambda energy_j, climb_m: share * max(energy_j - weight_n * climb_m, 0.0)
