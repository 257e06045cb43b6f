"""One query for a journey with charging stops: its station graph, and the best journey on it with its proof."""

from __future__ import annotations

import math
from contextlib import contextmanager
from dataclasses import dataclass, replace
from itertools import pairwise
from statistics import NormalDist
from typing import TYPE_CHECKING, Final

import numpy as np

from energy.charging.charge_time import charge_times
from energy.units import JOULE_PER_KWH, JOULE_PER_WH, SECOND_PER_MINUTE
from routing.charging import kernels_plan as kernels
from routing.charging.choice import onward
from routing.charging.choice.choice import StationChoice
from routing.charging.choice.onward import Onward, OnwardFinder
from routing.charging.corridor import FEW_SITES, Charges, Corridor, Dearness, mixed_weights
from routing.charging.halts import charged_halts_cost
from routing.charging.kernels_plan import Rules, Stops
from routing.charging.legs import STAY, LegCounts, LegFinder, LegStore, usual_weightings
from routing.charging.margins import Margins
from routing.charging.network import Arc, Part, StationGraph, UndecidedError
from routing.charging.sites import least_cost_a_joule, worth_of
from routing.charging.ways import Pair, joined, likely_between, stay_of
from routing.errors import TimeUpError
from routing.stations.opening import open_times
from routing.weights import ECO

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from numpy.typing import NDArray

    from energy.charging.charging import Charging
    from routing.charging.choice.choice import Few
    from routing.charging.choice.crowd import Crowd
    from routing.charging.choice.sources import Spots
    from routing.charging.legs import Place
    from routing.charging.network import Step
    from routing.charging.plan import ChargingQuery, FixedStay
    from routing.charging.sites import Site
    from routing.charging.ways import Way
    from routing.queries import RouteQuery
    from routing.stations.station import Station
    from routing.weights import Weights

SAME_FRAC: Final = 1e-9
ROUNDING_J: Final = 1.0  # by which what a charge suffices for is exceeded
PROVEN_FRAC: Final = 1e-8  # of the cost, below which a bound meets a plan
ROUNDS: Final = 500  # of refinement at most
MORE_LIKELY: Final = 3.0
FAR_FRAC: Final = 3.0
DAY_S: Final = 86_400.0
WEEK_MIN: Final = 7 * 1440.0
MOST_AC_W: Final = 22e3  # of a place to stay at, above which its power is direct current; assumed
HIGH_FRAC: Final = 0.5  # of what stations charge to, asked for at the goal, from which it may well not be had
FEW_STOPS: Final = 8  # up to which labels are told apart by their number


@dataclass(frozen=True, slots=True)
class Proof:
    """By how much at most a better journey is better in the objective, None where nothing is proven, and why."""

    short_by: float | None
    unproven: str = ""


@dataclass(frozen=True, slots=True)
class Shortage:
    """Where journeys end: whence least lacks on the way on, what lacks [J], the last station reached; None: the start.

    at_goal: whether it lacks at the goal of what is asked for there.
    """

    station: Station | None
    missing_j: float
    last: Station | None
    at_goal: bool = False


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
        proof_labels: int,
        many_links: int,
        dearness: Dearness | None = None,
    ) -> None:
        self.query, self.charging, self.sites, self.places = query, charging, sites, places
        self._many_links = many_links
        self.capacity_j = query.vehicle.usable_capacity_wh * JOULE_PER_WH
        self.reserve_j = query.reserve_soc_frac * self.capacity_j
        self.counts = LegCounts()
        self._vehicle_charging, self._legs, self._margin_j = vehicle_charging, legs, margin_j
        self._proof_labels = proof_labels
        self._worth = worth_of(charging)
        self._stages = len(places) - 1
        kinds = {id(site.curve): site.curve for site in sites}
        self._kind = {key: k for k, key in enumerate(kinds)}
        self._start_j = query.soc_frac * self.capacity_j
        self.goal = 1 + self._stages * len(sites)
        self._stops = self._made_stops()
        self._least_j = self._stops.number[:, kernels.LEAST_J].copy()  # on arrival, also at stations that are closed
        self.margins = Margins()
        curves = charge_times(list(kinds.values()), self.capacity_j).curves
        self.graph = StationGraph(curves, self._stops, self._arcs_from, self.margins.of)
        if dearness is None:
            a_joule = least_cost_a_joule(sites, query.vehicle.usable_capacity_wh, charging.max_soc_frac)
            dearness = Dearness(a_joule, np.zeros(len(sites)))
        self.dearness = dearness
        self._is_thinned = legs.search.graph.link_count > many_links
        weightings = usual_weightings(mixed_weights(self._worth, dearness.a_joule), bounded=not self._is_thinned)
        self.queries = capped(query, charging.speed_caps_mps)
        self._finders = [LegFinder(legs, capped_query, weightings, self.counts) for capped_query in self.queries]
        self._mixed = (weightings[0],)
        self._weightings: tuple[Weights, ...] | None = None  # of ways that are learnt, None: all
        self._usual: tuple[Weights, ...] | None = None  # of those of all stations over which a journey may be the best
        self._learnt: set[tuple[int, int]] = set()  # of which what is likely is not asked any more
        self._at_ends: dict[tuple[int, LegFinder], tuple[Way | None, Way | None]] = {}
        self._vias: dict[int, list[Arc]] = {}
        self._asked: dict[int, tuple[NDArray[np.bool_], bool]] = {}  # stations that arcs of a place lead to
        self._with_bounds = False  # which no search along known ways looks at
        self._beyond: dict[int, list[tuple[int, Way]]] = {}  # ways that no full battery suffices for, by their place
        self.usable = sites  # of which sites may be a part
        self.stop_cost = -math.inf  # no journey that stops anywhere costs less
        self.beyond_cost = math.inf  # no journey over stations that are not among sites costs less
        self.latest: list[Step] | None = None  # the best journey that was found last
        self._onward: OnwardFinder | None = None
        self._shut_off: Onward | None = None  # why no journey comes to the goal, where that is known
        stays = [self.stay_at(via_idx) for via_idx in range(self._stages - 1)]
        room_j = self.capacity_j - self.reserve_j
        self._stays = [
            (0.0, 0.0) if stay is None else (stay.seconds, min(self.stay_gain_j(stay), room_j)) for stay in stays
        ]
        self._charges = Charges(self._start_j, self._goal_least_j(), self.capacity_j)
        self._corridor = Corridor(
            self._finders,
            self._worth,
            dearness,
            sites,
            places,
            self._stops.number,
            self._stays,
            self._charges,
            thinned=self._is_thinned,
        )

    def _made_stops(self) -> Stops:
        charging, capacity_j, count = self.charging, self.capacity_j, self.goal + 1
        number = np.zeros((count, 10))
        number[:, kernels.CURVE] = -1.0
        number[:, kernels.LEAST_J] = charging.arrive_soc_frac * capacity_j
        number[self.goal, kernels.LEAST_J] = self._goal_least_j()
        columns = [kernels.CURVE, kernels.A_SECOND, kernels.A_JOULE, kernels.STOP_COST]
        rows = [(self._kind[id(site.curve)], site.a_second, site.a_joule, site.stop_cost) for site in self.sites]
        if rows:
            number[1 : self.goal, columns] = np.tile(np.array(rows), (self._stages, 1))
        number[1 : self.goal, kernels.STOP_S] = charging.overhead_s
        number[1 : self.goal, kernels.CAP] = charging.max_soc_frac * capacity_j
        opening_first, opening = [0] * (self.goal + 1), []
        if charging.departure_min is not None:
            for place in range(1, self.goal):
                hours = open_times(self.site_at(place).station.opening_hours, charging.departure)
                opening += [(begin * SECOND_PER_MINUTE, end * SECOND_PER_MINUTE) for begin, end in hours or ()]
                opening_first[place + 1] = len(opening)
        opening_first.append(len(opening))
        return Stops(
            number,
            np.zeros(count, np.bool_),
            np.zeros(count, np.int64),
            np.zeros(count, np.int64),
            np.array(opening_first, np.int64),
            np.array(opening, np.float64).reshape(-1, 2),
        )

    def site_at(self, place: int) -> Site:
        """The station at a place of the station graph."""
        return self.sites[(place - 1) % len(self.sites)]

    def place_of(self, station_id: str) -> int | None:
        """A place of the station graph, before all via points, of a station; None where it is not used."""
        return next((k for k, site in enumerate(self.sites, start=1) if site.station.id == station_id), None)

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

    def least_stops(self) -> int:
        """No journey has fewer stops: by the least energy that it takes, and the most that each of them charges."""
        least_j = 0.0
        for here, there in pairwise(self.places):
            pairs = [pair for finder in self._finders for pair in finder.pairs(here, [there], (ECO,))]
            least_j += JOULE_PER_KWH * min(pair.least_cost(ECO) for pair in pairs)
        stays = [self.stay_at(via_idx) for via_idx in range(self._stages - 1)]
        there_j = self._start_j + sum(self.stay_gain_j(stay) for stay in stays if stay is not None)
        lacking_j = least_j + self._goal_least_j() - there_j
        a_stop_j = (self.charging.max_soc_frac - self.charging.arrive_soc_frac) * self.capacity_j
        return max(math.ceil(lacking_j / a_stop_j - SAME_FRAC), 0) if math.isfinite(lacking_j) else 0

    @property
    def least_cost(self) -> float:
        """No journey costs less."""
        return min(self._corridor.least_cost, self.beyond_cost)

    def keep_below(self, cost: float, *, thinned: bool = False) -> None:
        """Leave out stations over which no journey costs less; thinned: and most of those that remain."""
        if not self._corridor.keep_below(cost, self._weightings, thinned=thinned):
            return
        only_onward = self._corridor.only_onward
        grown = [
            place
            for place, (asked, asked_onward) in self._asked.items()
            if (asked_onward and not only_onward) or bool((self._near(place) & ~asked).any())
        ]
        if grown:  # arcs to stations that are left out now may stay
            self._vias.clear()
            self._stops.known[grown] = False
            for place in grown:
                del self._asked[place]

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

    def waiting_of_s(self, site: Site, arrive_s: float) -> float:
        """The same of any station that may be used, also where it is no place of the station graph."""
        if self.charging.departure_min is None:
            return 0.0
        hours = open_times(site.station.opening_hours, self.charging.departure)
        at_min = (self.charging.departure_min + arrive_s / SECOND_PER_MINUTE) % WEEK_MIN
        if not hours or any(begin <= at_min < end for begin, end in hours):
            return 0.0
        return SECOND_PER_MINUTE * min((begin - at_min) % WEEK_MIN for begin, _ in hours)

    def direct_way(self) -> Way | None:
        """A way from the start to the first place after it, whatever charge it takes."""
        (pair,) = self._finders[0].pairs(self.places[0], [self.places[1]])
        return pair.ways[0] if pair.ways else None

    def _stage(self, place: int) -> int:
        """How many via points are behind at a place."""
        return -place if place <= 0 else (place - 1) // len(self.sites)

    def _near(self, place: int) -> NDArray[np.bool_]:
        """Stations that ways from a place may lead to, bool (stages, sites)."""
        near, stage = self._corridor.near.copy(), self._stage(place)
        near[stage] = self._corridor.targets(stage, (place - 1) % len(self.sites) if place > 0 else None)
        return near

    def _arcs_from(self, place: int) -> list[Arc]:
        """Arcs from the start, a station or a via point, over no, one or more via points."""
        if place == self.goal:
            return []
        stage = self._stage(place)
        first = 1 + stage * len(self.sites)
        last = stage == self._stages - 1
        near = self._near(place)
        others = np.flatnonzero(near[stage])
        others = others[others != place - first]
        if self._corridor.only_onward and place > 0:
            others = others[self._corridor.leads_on(stage, (place - 1) % len(self.sites), others)]
        targets = (first + others).tolist()
        onward = self.goal if last else -1 - stage
        targets.append(onward)
        if place >= 0:
            self._asked[place] = (near, self._corridor.only_onward)
        spots = [self.position(to) for to in targets]
        arcs: list[Arc] = []
        longest_j = self.capacity_j - self.reserve_j
        here = self.position(place)
        for cap, finder in enumerate(self._finders):
            for to, there, pair in zip(targets, spots, self._pairs_from(place, targets, spots, finder), strict=True):
                climb_m = finder.climb_m(here, there) if self._margin_j is not None else 0.0
                for way in (*pair.ways, *(pair.bounds() if self._with_bounds else ())):
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

    def _pairs_from(self, place: int, targets: Sequence[int], spots: Sequence[Place], finder: LegFinder) -> list[Pair]:
        """Ways from a place to others; where few stations are looked at, what ways between two of them likely take."""
        here = self.position(place)
        if place <= 0 or not self._corridor.only_onward:
            return finder.pairs(here, spots, self._weightings)
        if self._learnt:  # of which pairs are not guessed any more
            return self._guessed_from(place, targets, spots, finder)
        stage = self._stage(place)
        question = here, tuple(spots), self.places[stage], self.places[stage + 1], self._mixed[0], targets[-1] < 0
        return finder.guessed(question, lambda: self._guessed_from(place, targets, spots, finder))

    def _guessed_from(
        self, place: int, targets: Sequence[int], spots: Sequence[Place], finder: LegFinder
    ) -> list[Pair]:
        """As _pairs_from, where few stations are looked at."""
        here = self.position(place)
        pairs = finder.known_pairs(here, spots)
        from_start, to_goal = self._end_ways(place, finder)
        for k, pair in enumerate(pairs):
            if pair is None and 0 < targets[k] < self.goal and (place, targets[k]) not in self._learnt:
                behind, beyond = self._end_ways(targets[k], finder)
                ways = likely_between(self._mixed[0], [(to_goal, beyond), (behind, from_start)])
                pairs[k] = Pair(ways, ()) if ways else None
        found = finder.pairs(here, [spot for spot, pair in zip(spots, pairs, strict=True) if pair is None])
        rest = iter(found)
        return [next(rest) if pair is None else pair for pair in pairs]

    def _end_ways(self, place: int, finder: LegFinder) -> tuple[Way | None, Way | None]:
        """The best ways by the mixed weighting to a station from where its stage begins, and on to where that ends."""
        key = place, finder
        if key not in self._at_ends:
            stage, here = self._stage(place), self.position(place)
            (before,), (after,) = (
                finder.known_pairs(self.places[stage], [here]),
                finder.known_pairs(here, [self.places[stage + 1]]),
            )
            self._at_ends[key] = (
                None if before is None else before.best(self._mixed[0]),
                None if after is None else after.best(self._mixed[0]),
            )
        return self._at_ends[key]

    def _learn_between(self, journey: list[Step]) -> bool:
        """Learn the ways of which a journey has what they likely take; whether there were any."""
        likely = [
            part
            for step in journey[1:]
            for part in (step.arc.parts if step.arc is not None else ())
            if part.way.is_bound
        ]
        for part in likely:
            self._learnt.add((part.here, part.there))
            self._finders[part.cap].find_onward([self.position(part.here)], self.position(part.there))
            self._forget(part.here)
        return bool(likely)

    def _over(self, via: int, part: Part) -> list[Arc]:
        """Arcs that begin with a part to a via point, and those that end there where it is a station."""
        if via not in self._vias:
            self._vias[via] = self._arcs_from(via)
        found = []
        stage = -via
        stations_there = [
            1 + stage * len(self.sites) + k
            for k, site in enumerate(self.sites)
            if site.station.position == self.places[-via]
        ]
        before = part.way
        stay = self.stay_at(-1 - via)
        if stay is not None:
            gain_j = self.stay_gain_j(stay)
            least_j = (
                max(self.charging.arrive_soc_frac * self.capacity_j - self.reserve_j, 0.0) if gain_j > 0.0 else 0.0
            )
            before = joined(before, stay_of(stay.seconds, gain_j, least_j))
        for to in stations_there:  # after the stay, which is taken anyway
            parts = (part,) if stay is None else (part, Part(via, to, STAY.ways[0], part.cap))
            if before.longest_j <= self.capacity_j - self.reserve_j:
                found.append(self._arc(to, before, parts))
        for arc in self._vias[via]:
            if arc.parts[0].cap == part.cap:
                way = joined(before, arc.way)
                if way.longest_j <= self.capacity_j - self.reserve_j:
                    found.append(self._arc(arc.to, way, (part, *arc.parts)))
        return found

    def _arc(self, to: int, way: Way, parts: tuple[Part, ...]) -> Arc:
        cost = self._worth.a_second * way.time_s
        if self._worth.a_joule > 0.0:
            cost += self._worth.a_joule * sum(part.way.energy_j for part in parts)
        return Arc(to, way, cost, self._arc_margin_j(to, way, parts), parts)

    def _arc_margin_j(self, to: int, way: Way, parts: tuple[Part, ...]) -> float:
        """The least margin of an arc: what is kept at its end may have been needed on the way anyway."""
        if self._margin_j is None:
            return 0.0
        needs_j = float(self._least_j[to]) + way.energy_j + sum(part.margin_j for part in parts)
        so_far_j = 0.0  # of driving with margins, less what stays have charged
        for part in parts:
            so_far_j += part.way.energy_j + part.margin_j
            stay = self.stay_at(-1 - part.there) if part.there < 0 else None
            gain_j = 0.0 if stay is None else self.stay_gain_j(stay)
            if gain_j > 0.0:
                needs_j = max(needs_j, so_far_j + self._stay_least_j())
            so_far_j -= gain_j
        return max(needs_j - self.needs_j(to, way), 0.0)

    def _stay_least_j(self) -> float:
        """Charge on arrival at a fixed stay that charges [J]."""
        return max(self.charging.arrive_soc_frac * self.capacity_j, self.reserve_j)

    def found(self) -> list[Step] | None:
        """The best journey along known ways, of stations over which a journey may be the best; None where none is.

        Stations over which no journey costs less than one that is known are left out, at first those that are likely
        to be such. On large graphs ways of least energy are looked for where there is none along the others.
        """
        high_j = HIGH_FRAC * self.charging.max_soc_frac * self.capacity_j
        if self._goal_least_j() > high_j and self.is_shut_off(whole=False):
            return None
        best = self._found_at_once()
        if best is None and self._is_thinned:
            self._learn_thrifty()
            best = self._with_other_ways(self.best())
        return best

    def _learn_thrifty(self) -> None:
        """Learn ways of least energy from the start to all near stations, and from places reached to the next goal."""
        by_stage: dict[int, list[int]] = {}
        for place in self.graph.reached:
            by_stage.setdefault(self._stage(place), []).append(place)
        starts = [site.station.position for site, near in zip(self.sites, self._corridor.near[0], strict=True) if near]
        for finder in self._finders:
            finder.pairs(self.places[0], starts, (ECO,))
            for stage, places in by_stage.items():
                finder.find_onward([self.position(place) for place in places], self.places[stage + 1], (ECO,))
        self._vias.clear()
        for place in self.graph.reached:
            self.graph.forget(place)

    def _found_at_once(self) -> list[Step] | None:
        """As found, along ways of the usual searches."""
        bounded = math.isfinite(self._corridor.least_cost)
        best: list[Step] | None = None
        if self._is_thinned and bounded:
            self.keep_below(self._corridor.likely_cost, thinned=True)
            best = self._with_other_ways(self.best())
            if best is not None:
                return best
        if len(self.sites) <= FEW_SITES or not bounded:
            return self._with_other_ways(self.best()) if self._is_thinned else self.best()
        if not self._is_thinned and self.latest is None:  # more stations are likely than are no worse than a plan
            self._weightings = self._mixed
            best = self._near_best()
            self._weightings = self._usual
            if best is not None:
                self.keep_below(best[-1].cost)
            self._forget_all()
        best = self._near_best() if best is None else self.best()
        if best is None:
            return None
        self.keep_below(best[-1].cost)
        return self._with_other_ways(best) if self._is_thinned else best

    def _near_best(self) -> list[Step] | None:
        """The best journey over stations over which none costs more than it, and over some that are likely such."""
        slack = self._corridor.likely_cost - self._corridor.least_cost
        while True:
            self.keep_below(self._corridor.least_cost + slack)
            best = self.best()
            if best is not None:
                if best[-1].cost <= self._corridor.least_cost + slack:
                    return best
                slack = best[-1].cost - self._corridor.least_cost
            elif bool(self._corridor.near.all()) or self.is_shut_off():
                return None
            else:
                slack = MORE_LIKELY * slack if slack < FAR_FRAC * abs(self._corridor.least_cost) + DAY_S else math.inf

    def found_below(self, cost: float) -> list[Step] | None:
        """The best journey along known ways, of those that cost no more."""
        self.keep_below(cost)
        return self.best(below=cost + PROVEN_FRAC * abs(cost))

    def take_likely_ways(self) -> None:
        """Search ways by the mixed weighting alone; others that are known are looked at as well."""
        self._weightings = self._usual = self._mixed

    def found_soon(self, cost: float, labels: int) -> list[Step] | None:
        """The best journey along known ways that costs no more; None as well where that takes more labels."""
        is_over = self.after_labels(labels)
        self.keep_below(cost)
        try:
            return self.best(below=cost + PROVEN_FRAC * abs(cost), is_over=is_over)
        except UndecidedError:
            return None

    def choice(self, crowd: Crowd, few: Few) -> StationChoice:
        """Which of very many stations are looked at for the same query."""
        search, most = self._legs.search, self.charging.max_soc_frac
        return StationChoice(
            search, self._finders, self._worth, crowd, self.places, self._stays, self._charges, most, few
        )

    def is_shut_off(self, *, whole: bool = True) -> bool:
        """Whether the battery alone shows that no journey comes to the goal; whole: over all of it, not at its end."""
        finder = self._own_onward()
        if finder is not None and self._shut_off is None and (whole or finder.goal_is_beyond_all()):
            self._shut_off = finder.shut_off()
        return self._shut_off is not None

    def chain(self) -> list[Site]:
        """Stations that lead to the goal one after the other, it seems; none where that is not known."""
        finder = self._own_onward()
        return [] if finder is None else [self.sites[k] for k in self.learn_chain(finder, self.sites)]

    def learn_chain(self, finder: OnwardFinder, sites: Sequence[Site]) -> list[int]:
        """The same of any stations, by what tells whether the goal is come to over them; learns the ways between."""
        hops = finder.chain() or ()
        for hop in hops:
            here = self.places[0] if hop.here == onward.START else sites[hop.here].station.position
            there = self.places[-1] if hop.there == onward.GOAL else sites[hop.there].station.position
            if hop.path is not None:
                self._finders[hop.cap].add(here, there, hop.path)
        return [hop.here for hop in hops if hop.here != onward.START]

    def _own_onward(self) -> OnwardFinder | None:
        if self._onward is None:
            self._onward = self.onward(self.sites)
        return self._onward

    def onward(self, sites: Sequence[Site], spots: Spots | None = None) -> OnwardFinder | None:
        """What tells whether the goal is come to over stations; None where a stay charges or the graph is large."""
        if self._is_thinned or any(gain_j > 0.0 for _, gain_j in self._stays):
            return None
        return OnwardFinder(
            self._legs.search,
            [finder.space for finder in self._finders],
            (self.places[0], self.places[-1]),
            [site.station.position for site in sites],
            onward.Charges(
                start_j=self._start_j,
                station_j=self.charging.max_soc_frac * self.capacity_j,
                arrive_j=self.charging.arrive_soc_frac * self.capacity_j,
                goal_j=self._goal_least_j(),
                reserve_j=self.reserve_j,
                capacity_j=self.capacity_j,
            ),
            self.counts,
            spots,
        )

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
            self._forget_all()
        else:
            self.graph.forget(place)

    def _forget_all(self) -> None:
        """Ask for all arcs anew."""
        self._vias.clear()
        self._asked.clear()
        self._stops.known[:] = False

    def best(
        self,
        *,
        bounded: bool = False,
        below: float = math.inf,
        is_over: Callable[[], bool] | None = None,
        known_only: bool = False,
    ) -> list[Step] | None:
        """The best journey along known ways, or along bounds as well; None where none costs less.

        is_over, known_only: as of StationGraph.best.
        """
        if bounded and not self._with_bounds and not self._is_thinned:
            self._with_bounds = True
            self._forget_all()
        steps = None
        if known_only or not self._is_thinned:
            rules = self._rules(bounded=bounded)
            steps = self.graph.best(0, self._start_j, self.goal, rules, below, is_over=is_over, known_only=known_only)
        if self._is_thinned and steps is None:
            steps = self._likely_best(below, is_over)
        if steps is not None and not bounded:
            self.latest = steps
        return steps

    def _likely_best(self, below: float, is_over: Callable[[], bool] | None) -> list[Step] | None:
        """As best, with ways between stations learnt where a journey is best by what they likely take."""
        rules = self._rules(bounded=True)
        while True:
            steps = self.graph.best(0, self._start_j, self.goal, rules, below, is_over=is_over)
            if steps is None or not self._learn_between(steps):
                return steps

    def after_time(self, error: TimeUpError) -> tuple[list[Step], Proof]:
        """The journey that was known when time was up; raises where none was."""
        if self.latest is None:
            raise error
        why = f"{error.limit_s:g} s were not enough to look at all stations"
        return self.latest, Proof(self.latest[-1].cost - self.least_cost, why)

    def weigh(self) -> None:
        """Take margins as they are known now."""
        self.graph.weigh(self.margins.factor, self.margins.places())

    @property
    def is_bounded(self) -> bool:
        """Whether it is known of all ways what none is better than."""
        return not self._is_thinned and len(self.usable) == len(self.sites)

    @property
    def finder(self) -> LegFinder:
        """Ways without a cap on speed."""
        return self._finders[0]

    @property
    def goal_least_frac(self) -> float:
        """Charge on arrival at the goal that is asked for."""
        return self._goal_least_j() / self.capacity_j

    def look_at_all(self) -> None:
        """Leave no station out of searches."""
        self.keep_below(math.inf)

    def without(self, station_id: str) -> Task:
        """The same query over the other stations."""
        sites = [site for site in self.sites if site.station.id != station_id]
        asked = self.query, self.charging, self._vehicle_charging, sites, self.places, self._margin_j
        return Task(self._legs, *asked, self._proof_labels, self._many_links)

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
        """The best journey, and the proof of it, which counts those over stations that are not among sites as well."""
        best, proof = self._proven(best)
        if best is None:
            return best, proof
        cost, halts_count = best[-1].cost, self._corridor.halts_count
        if proof.short_by is not None and cost - self.stop_cost < proof.short_by and self.least_stops() > 0:
            proof = replace(proof, short_by=max(cost - self.stop_cost, 0.0))
        if proof.short_by is not None and halts_count and not self._is_least(best):
            halted_cost = self._charged_halts_cost(cost - max(proof.short_by, PROVEN_FRAC * abs(cost)))
            if math.isfinite(halted_cost):
                proof = Proof(
                    cost - halted_cost, "not all charges ahead of halts at which nothing is charged were compared"
                )
        if self.beyond_cost >= cost - PROVEN_FRAC * abs(cost) and not (halts_count and math.isfinite(self.beyond_cost)):
            return best, proof
        if halts_count:
            return best, Proof(None, "halts were not looked at over all of very many stations")
        short_by = cost - self.beyond_cost
        if proof.short_by is not None and short_by > proof.short_by:
            proof = Proof(short_by, "very many stations: not all that may be better were compared")
        return best, proof

    def _proven(self, best: list[Step] | None) -> tuple[list[Step] | None, Proof]:
        """The best journey that is found, where one is known that may not be the best, and the proof of it.

        A journey over bounds is no worse than any journey. As long as the best of these is better than the best known
        one, more is learnt of the ways at its bounds.
        """
        if best is None and self.is_shut_off():
            return None, Proof(None)
        halts_count = self._corridor.halts_count
        if self._is_thinned:
            why = "on a graph of this size a plan is bounded by what driving and charging cost at least"
            if best is None or halts_count:
                return best, Proof(None, why)
            return best, Proof(0.0) if self._is_least(best) else Proof(best[-1].cost - self._corridor.least_cost, why)
        short_by, is_over = math.inf, self.after_labels(self._proof_labels)
        why = "too many ways between stations to compare"
        try:
            for _ in range(ROUNDS):
                if halts_count and best is not None:
                    if not self._corridor.allow_halts(best[-1].cost + PROVEN_FRAC * abs(best[-1].cost), is_over):
                        return best, Proof(None, "too many halts at which nothing is charged to look at")
                    self._forget_all()
                    best, halts_count = self.best(), False
                if self._is_least(best):
                    return best, Proof(0.0)
                cost = math.inf if best is None else best[-1].cost
                bound = self.best(bounded=True, below=math.inf if best is None else cost - PROVEN_FRAC * abs(cost))
                if bound is None:
                    return best, Proof(0.0)
                short_by = cost - bound[-1].cost
                if is_over():
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
            short_by = min(short_by, best[-1].cost - self._corridor.least_cost)
        return best, Proof(short_by if math.isfinite(short_by) else None, why)

    def _charged_halts_cost(self, cost: float) -> float:
        """As charged_halts_cost, of all stations that remain; of none where bounds do not hold for halts."""
        bounds = self._corridor.place_bounds()
        if bounds is None:
            return math.inf
        arcs: dict[int, list[Arc]] = {}

        def arcs_of(place: int) -> list[Arc]:
            if place not in arcs:
                arcs[place] = self._arcs_from(place)
            return arcs[place]

        places = 1 + np.flatnonzero(self._corridor.near.ravel())
        least_j = max(self.charging.arrive_soc_frac * self.capacity_j - self.reserve_j, 0.0)
        halt_way = stay_of(0.0, 0.0, least_j)
        most_j = self.charging.max_soc_frac * self.capacity_j
        known = places.tolist(), arcs_of, self.margins.of, bounds, halt_way
        return charged_halts_cost(*known, self.needs_j, most_j, cost)

    def after_labels(self, labels: int) -> Callable[[], bool]:
        """Whether so much more work was done from now on, which is the same on every machine."""
        until = self.labels + labels
        return lambda: self.labels > until

    @property
    def labels(self) -> int:
        """Work that was done, the same on every machine."""
        return self.counts.labels + self.graph.work.made

    def _is_least(self, best: list[Step] | None) -> bool:
        """Whether a journey costs no more than any does at least."""
        return best is not None and best[-1].cost - self._corridor.least_cost <= PROVEN_FRAC * abs(best[-1].cost)

    def refined(self, journey: list[Step], cost: float = math.inf) -> bool:
        """Learn more of ways at the bounds of a journey that may cost so much; whether anything was to be learnt."""
        learnt = False
        for step in journey[1:]:
            for part in step.arc.parts if step.arc is not None else ():
                if not part.way.is_bound:
                    continue
                here, there = self.position(part.here), self.position(part.there)
                finder, most_s = (
                    self._finders[part.cap],
                    self._corridor.longest_s(part.here, part.there, part.cap, cost),
                )
                most_j, stretch_j = self._most_j(part), self.capacity_j - self.reserve_j
                if finder.refined(here, there, part.way, most_s, most_j, stretch_j):
                    learnt = True
                    self._forget(part.here)
        return learnt

    def _most_j(self, part: Part) -> float:
        """More than the charge at the start lets a way from there take [J]; inf elsewhere."""
        if part.here != 0:
            return math.inf
        least_j = self.reserve_j if part.there < 0 else self.least_j(part.there)
        return max(self._start_j - least_j, 0.0) + ROUNDING_J

    def shortage(self) -> Shortage:
        """Where journeys end that do not come to the goal, after a search that found none."""
        if self._shut_off is not None:
            reached = self._shut_off.reached.nonzero()[0]
            ahead = self._stops.number[self.goal - len(self.sites) + reached, kernels.AHEAD]
            last = self.sites[reached[np.argmin(ahead)]] if reached.size else None
            return self.shortage_of(self._shut_off, self.sites, last)
        reached_j = self.graph.reached
        nearest, least_j, last_place, last_s = 0, math.inf, 0, math.inf
        for place, charge_j in reached_j.items():
            depart_j = max(charge_j, self.charging.max_soc_frac * self.capacity_j) if place > 0 else charge_j
            ways = [(arc.to, arc.way, self.margins.of(arc)) for arc in self.graph.arcs(place) if not arc.way.is_bound]
            ways += [(to, way, 0.0) for to, way in self._beyond.get(place, ())]
            for to, way, margin_j in ways:
                missing_j = self.needs_j(to, way) + margin_j - depart_j
                if to not in reached_j and missing_j < least_j:
                    nearest, least_j = place, missing_j
            ahead_s = float(self._stops.number[place, kernels.AHEAD])
            if place > 0 and ahead_s < last_s:
                last_place, last_s = place, ahead_s
        here, last = (None if place <= 0 else self.site_at(place).station for place in (nearest, last_place))
        return Shortage(here, least_j, last)

    def least_j(self, place: int) -> float:
        """Charge that is asked for on arrival at a place [J]."""
        return float(self._least_j[place])

    def shortage_of(self, shut_off: Onward, sites: Sequence[Site], last: Site | None) -> Shortage:
        """Where journeys end by the battery alone, of stations; or what lacks on the way, where nothing does then."""
        here = None if shut_off.nearest == onward.START else sites[shut_off.nearest].station
        missing_j = shut_off.missing_j
        if missing_j <= 0.0:
            here_j, place = self._start_j, self.places[0]
            if here is not None:
                here_j, place = self.charging.max_soc_frac * self.capacity_j, here.position
            pairs = [finder.pairs(place, [self.places[-1]], (ECO,))[0] for finder in self._finders]
            missing_j = min((self.needs_j(self.goal, way) for pair in pairs for way in pair.ways), default=0.0) - here_j
        return Shortage(here, missing_j, None if last is None else last.station, at_goal=shut_off.at_goal)

    def needs_j(self, to: int, way: Way) -> float:
        """Charge that a way to a place begins with at least, without a margin [J]."""
        arrive_j = float(self._least_j[to]) + way.energy_j
        return max(self.reserve_j + way.need_j, arrive_j)


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
