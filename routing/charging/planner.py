"""Journeys with charging stops: which stations, by which ways, and charged how far, with the proof that comes along."""

from __future__ import annotations

import math
import time
from typing import TYPE_CHECKING, Final

import numpy as np

from energy.charging.charge_time import charge_times
from energy.units import JOULE_PER_WH
from routing.charging import kernels_plan as kernels
from routing.charging.journey import JourneyMaker
from routing.charging.kernels_plan import Rules, Stops
from routing.charging.legs import LegCounts, LegFinder, LegStore, usual_weightings
from routing.charging.network import Arc, Part, StationGraph
from routing.charging.plan import ChargingAnswer, NoPlan, PlanStats
from routing.charging.sites import usable_sites, worth_of
from routing.charging.ways import joined, stay_of
from routing.errors import TimeUpError

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from energy.charging.charging import Charging
    from routing.charging.legs import Place
    from routing.charging.network import Step
    from routing.charging.plan import ChargingQuery, Plan
    from routing.charging.sites import Site
    from routing.charging.ways import Way
    from routing.links.spans import ChainMaker
    from routing.queries import RouteQuery
    from routing.route.best_path import RouteSearch
    from routing.stations.station import Station

PROVEN_FRAC: Final = 1e-7  # of the cost, below which a bound meets a plan
PROOF_S: Final = 2.0  # after which an answer with a bound beats a proof; assumed
ROUNDS: Final = 500  # of refinement at most


class ChargingPlanner:
    """Plans journeys with charging stops on one graph; keeps ways between stations, safe between threads."""

    def __init__(self, search: RouteSearch, chains: ChainMaker) -> None:
        self._search, self._chains = search, chains
        self._legs = LegStore(search)

    def plan(
        self,
        query: RouteQuery,
        charging: ChargingQuery,
        vehicle_charging: Charging,
        stations: Sequence[Station],
        places: Sequence[Place],
        margin_j: Callable[[Way], float] | None = None,
    ) -> ChargingAnswer:
        """The best journey from a start over via points to a goal, with stops at stations where it needs them.

        places: start, via points and goal of the query, each by its positions on both directions of its road.
        margin_j: what is kept beyond the energy of a way [J], 0 without. Raises NegativeCycleError, SearchLimitError,
        TimeUpError where time is up before any plan is known, AbandonedError.
        """
        began = time.perf_counter()
        sites = usable_sites(vehicle_charging, charging, stations)
        task = _Task(self._search, self._legs, self._chains, query, charging, vehicle_charging, sites, places, margin_j)
        plans, missing = task.solve()
        stats = PlanStats(
            leg_searches=task.counts.searches,
            legs_cached=task.counts.known,
            labels_made=task.graph.work.made,
            labels_settled=task.graph.work.settled,
            seconds=time.perf_counter() - began,
        )
        return ChargingAnswer(plans, missing, stats)


class _Task:
    """One query at work.

    Places of the station graph: 0 is the start, 1 + stage · sites + k station k with `stage` via points behind, the
    last one the goal.
    """

    def __init__(
        self,
        search: RouteSearch,
        legs: LegStore,
        chains: ChainMaker,
        query: RouteQuery,
        charging: ChargingQuery,
        vehicle_charging: Charging,
        sites: Sequence[Site],
        places: Sequence[Place],
        margin_j: Callable[[Way], float] | None,
    ) -> None:
        self._query, self._charging, self._sites, self._places = query, charging, sites, places
        self._capacity_j = query.vehicle.usable_capacity_wh * JOULE_PER_WH
        self._reserve_j = query.reserve_soc_frac * self._capacity_j
        self._margin_j = margin_j
        self._worth = worth_of(charging)
        self._proof_s = PROOF_S
        self.counts = LegCounts()
        self._stages = len(places) - 1
        kinds = {id(site.curve): site.curve for site in sites}
        self._kind = {key: k for k, key in enumerate(kinds)}
        curves = charge_times(list(kinds.values()), self._capacity_j).curves
        power_w = max((float(np.mean(site.curve.power_w)) for site in sites), default=50e3)
        self._finder = LegFinder(legs, query, usual_weightings(power_w), self.counts)
        self._goal = 1 + self._stages * len(sites)
        self._stops = self._made_stops()
        self.graph = StationGraph(curves, self._stops, self._arcs_from)
        self._vias: dict[int, list[Arc]] = {}
        self._journeys = JourneyMaker(search, chains, query, charging, sites)

    def _made_stops(self) -> Stops:
        charging, capacity_j = self._charging, self._capacity_j
        count = self._goal + 1
        number = np.zeros((count, 10))
        number[:, kernels.CURVE] = -1.0
        number[:, kernels.LEAST_J] = charging.arrive_soc_frac * capacity_j
        number[self._goal, kernels.LEAST_J] = self._goal_least_j()
        for place in range(1, self._goal):
            site = self._sites[(place - 1) % len(self._sites)]
            number[place, kernels.CURVE] = self._kind[id(site.curve)]
            number[place, kernels.A_SECOND], number[place, kernels.A_JOULE] = site.a_second, site.a_joule
            number[place, kernels.STOP_COST], number[place, kernels.STOP_S] = site.stop_cost, charging.overhead_s
            number[place, kernels.CAP] = charging.max_soc_frac * capacity_j
        return Stops(
            number,
            np.zeros(count, np.bool_),
            np.zeros(count, np.int64),
            np.zeros(count, np.int64),
            np.zeros(count + 1, np.int64),
            np.empty((0, 2)),
        )

    def _goal_least_j(self) -> float:
        return max(self._charging.goal_soc_frac * self._capacity_j, self._reserve_j)

    def _rules(self, *, bounded: bool) -> Rules:
        return Rules(
            self._reserve_j,
            0.0,
            self._worth.a_second,
            False,
            False,
            self._charging.most_stops,
            bounded,
        )

    def _position(self, place: int) -> Place:
        """Where a place of the station graph, or via point −1 − k, is on the roads."""
        if place < 0:
            return self._places[-place]
        if place == 0:
            return self._places[0]
        if place == self._goal:
            return self._places[-1]
        return self._sites[(place - 1) % len(self._sites)].station.position

    def _arcs_from(self, place: int) -> list[Arc]:
        """Arcs from the start, a station, or via point −1 − k, over no, one or more via points."""
        if place == self._goal:
            return []
        if place < 0:
            stage = -place
        elif place == 0:
            stage = 0
        else:
            stage = (place - 1) // len(self._sites)
        first = 1 + stage * len(self._sites)
        ahead = [to for to in range(first, first + len(self._sites)) if to != place]
        via = self._goal if stage == self._stages - 1 else -1 - stage
        targets = [*ahead, via]
        pairs = self._finder.pairs(self._position(place), [self._position(to) for to in targets])
        arcs: list[Arc] = []
        for to, pair in zip(targets, pairs, strict=True):
            for way in (*pair.ways, *pair.bounds()):
                if way.longest_j > self._capacity_j - self._reserve_j:
                    continue
                part = Part(place, to, way)
                if to != via or via == self._goal:
                    arcs.append(self._arc(to, way, (part,)))
                else:
                    arcs += self._over(via, part)
        return arcs

    def _over(self, via: int, part: Part) -> list[Arc]:
        """Arcs that begin with a part to a via point."""
        if via not in self._vias:
            self._vias[via] = self._arcs_from(via)
        before = part.way
        stay = next((s for s in self._charging.stays if s.via_idx == -1 - via), None)
        if stay is not None:
            gain_j = self._stay_power_w(stay.power_w) * stay.seconds
            least_j = max(self._charging.arrive_soc_frac * self._capacity_j - self._reserve_j, 0.0) if gain_j else 0.0
            before = joined(before, stay_of(stay.seconds, gain_j, least_j))
        found = []
        for arc in self._vias[via]:
            way = joined(before, arc.way)
            if way.longest_j <= self._capacity_j - self._reserve_j:
                found.append(self._arc(arc.to, way, (part, *arc.parts)))
        return found

    def _stay_power_w(self, power_w: float) -> float:
        return power_w

    def _arc(self, to: int, way: Way, parts: tuple[Part, ...]) -> Arc:
        cost = self._worth.a_second * way.time_s + self._worth.a_joule * sum(part.way.energy_j for part in parts)
        margin = 0.0
        if self._margin_j is not None:
            margin = math.hypot(*(self._margin_j(part.way) for part in parts))
        return Arc(to, way, cost, margin, parts)

    def solve(self) -> tuple[tuple[Plan, ...], NoPlan | None]:
        """Plans, the best first, or why there is none."""
        best = self._best(bounded=False)
        best, short_by, why = self._proven(best)
        if best is None:
            return (), NoPlan("no way", None, 0.0, None, ())
        return (self._journeys.plan("best", best, short_by, why),), None

    def _best(self, *, bounded: bool, below: float = math.inf) -> list[Step] | None:
        start_j = self._query.soc_frac * self._capacity_j
        return self.graph.best(0, start_j, self._goal, self._rules(bounded=bounded), below)

    def _proven(self, best: list[Step] | None) -> tuple[list[Step] | None, float | None, str]:
        """A journey that may be better than one, by how much at most a better one is better, and what hinders more.

        A journey over bounds is no worse than any journey. As long as the best of these is better than the best known
        one, more is learnt of the ways at its bounds.
        """
        short_by, until = 0.0, time.perf_counter() + self._proof_s
        try:
            for _ in range(ROUNDS):
                cost = math.inf if best is None else best[-1].cost
                rounding = PROVEN_FRAC * abs(cost) if best is not None else 0.0
                bound = self._best(bounded=True, below=cost - rounding)
                if bound is None:
                    return best, 0.0, ""
                short_by = cost - bound[-1].cost
                if time.perf_counter() > until:
                    return best, short_by, "too many ways between stations to compare all"
                if not self._refined(bound, cost):
                    return (
                        best,
                        short_by,
                        "ways between stations could not be compared in all that they do to a battery",
                    )
                best = self._best(bounded=False)
        except TimeUpError as error:
            if best is None:
                raise
            return best, short_by, f"{error.limit_s:g} s were not enough for a proof"
        return best, short_by, "too many ways between stations to compare all"

    def _refined(self, journey: list[Step], cost: float) -> bool:
        """Learn more of the ways at the bounds of a journey; whether there was anything to be learnt."""
        learnt = False
        most_s = cost / self._worth.a_second if self._worth.a_joule == 0.0 else math.inf
        for step in journey[1:]:
            for part in step.arc.parts if step.arc is not None else ():
                if not part.way.is_bound:
                    continue
                here, there = self._position(part.here), self._position(part.there)
                if self._finder.refined(here, there, part.way, most_s, self._capacity_j - self._reserve_j):
                    learnt = True
                    if part.here < 0:
                        self._vias.clear()
                        self._stops.known[:] = False
                    else:
                        self.graph.forget(part.here)
        return learnt
