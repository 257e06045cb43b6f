"""Plans that keep what is asked with the confidence that is asked for, and say how sure they are."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING, Final

from routing.charging.journey import JourneyMaker
from routing.charging.margins import Taken
from routing.charging.network import UndecidedError
from routing.charging.promise.fallback import FallbackFinder
from routing.charging.promise.promise import PromiseMaker, with_promise
from routing.errors import TimeUpError

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from routing.charging.network import Arc, Step
    from routing.charging.plan import ChargeStop, Plan
    from routing.charging.promise.promise import DrawStore, Promise
    from routing.charging.task import Task
    from routing.links.spans import ChainMaker
    from routing.route.best_path import RouteSearch

ROUNDS: Final = 32  # of search and promise at most
BESIDE: Final = 16  # ways that are driven at once
BESIDE_FRAC: Final = 0.02  # of the cost of one of them, by which they differ at most
SAME_FRAC: Final = 1e-9  # of a cost
MOST_LINKS: Final = 5000  # of graphs on which all ways are compared to tell a gatekeeper; assumed
GATE_LABELS: Final = 500_000  # some 0.5 s, for all gatekeepers of a plan, after which the rest is not known; assumed
MOST_AFRESH: Final = 4  # stations of a plan without which another one is looked for afresh on a large graph; assumed
DETOURS: Final = (0.1, 0.4)  # of a plan's cost, by which one without a station may cost more; all others come after
OUTER_NORMAL: Final = 1.2815515655446004  # P90 of the standard normal distribution


class PromiseKeeper:
    """Promises of one task's plans. draws: drawn vehicles, kept from query to query."""

    def __init__(self, search: RouteSearch, chains: ChainMaker, task: Task, draws: DrawStore) -> None:
        self._search, self._chains, self._task, self._draws = search, chains, task, draws
        self._journeys = JourneyMaker(search, chains, task)
        query = task.query
        shifts = draws.shifts(search.space_key(query, query.vehicle), query.vehicle)
        self._promises = PromiseMaker(chains, task.queries, task.charging, task.goal_least_frac, shifts)
        self.sure: list[Step] | None = None  # the best journey so far that is as sure as it was asked to be
        self.is_best = True  # of all journeys along known ways that are as sure
        self.warnings: list[str] = []
        self._expected = 1.0  # of the least margins, what a plan's ways have needed

    def kept(self, best: list[Step] | None) -> list[Step] | None:
        """The best journey that keeps what is asked with the confidence asked for, from the best one by least margins.

        Margins of ways that a plan takes become what its promise needs, and the search is run again, until the plan
        needs no more. Other ways count by what those taken have needed, so that a plan is found soon, and then by least
        margins, with which all ways are tried that may be better. None where there is none.
        """
        task, confidence = self._task, self._task.charging.confidence
        self.is_best = True
        if confidence is None:
            return best
        sure: list[Step] | None = None
        met: set[tuple[int, int]] = set()
        for k in range(ROUNDS):
            cost = math.inf if sure is None else sure[-1].cost - SAME_FRAC * abs(sure[-1].cost)
            if best is None or best[-1].cost >= cost:
                if task.margins.factor == 1.0 or (sure is not None and not task.is_bounded):
                    self.is_best = task.margins.factor == 1.0
                    return sure
                task.margins.factor = 1.0
            else:
                promise = self._promises.of(self._journeys.plan("", best, None, ""))
                taken = self._taken(best, promise)
                unsure = [drive.arc for drive in taken if drive.kept_frac < confidence and not drive.passes]
                settled = task.margins.learn(taken, confidence, task.capacity_j)
                for arc in unsure:
                    self._learn_beside(arc, confidence, met)
                if promise.least_kept_frac >= confidence:
                    self.sure = sure = best
                if k == 0:
                    task.margins.expect(taken)
                    self._expected = task.margins.factor
                elif settled and task.margins.factor > 1.0:
                    continue
            task.weigh()
            best = task.found()
        self.is_best = False
        return sure

    def most_kept_frac(self, steps: list[Step]) -> float:
        """Probability that the stop which is least sure could have, if all were charged as far as they may be."""
        promise = self._promises.of(self._journeys.plan("", steps, None, ""))
        return min((drive.most_kept_frac for drive in self._taken(steps, promise)), default=1.0)

    def promised(self, plan: Plan, *, gatekeepers: bool) -> Plan:
        """A plan with what it promises, fallbacks, and stations marked without which there is none."""
        promise = self._promises.of(plan)
        plan = with_promise(plan, promise)
        try:
            gates = self._gatekeepers(plan) if gatekeepers else {}
            return replace(plan, stops=self._with_fallbacks(plan, promise.spread_frac, gates))
        except TimeUpError as error:
            self.warnings.append(f"{error.limit_s:g} s were not enough to tell fallbacks and gatekeepers")
            return plan

    def _taken(self, steps: Sequence[Step], promise: Promise) -> list[Taken]:
        """Arcs that end at stops which are charged, and what they need after those that lead to stations passed."""
        taken, first = [], 0
        for driven, count in self._journeys.stretches(steps):
            legs = promise.legs[first : first + count]
            first += count
            before_j = sum(step.arc.way.energy_j for step in driven[:-1] if step.arc is not None)
            last = driven[-1]
            if last.arc is not None:
                taken.append(
                    Taken(
                        last.arc,
                        nominal_j=self._task.needs_j(last.place, last.arc.way),
                        needed_j=legs[0].needed_frac * self._task.capacity_j - before_j,
                        kept_frac=min(leg.kept_frac for leg in legs),
                        most_kept_frac=legs[0].most_kept_frac,
                        passes=len(driven) > 1,
                    )
                )
        return taken

    def _learn_beside(self, arc: Arc, confidence: float, met: set[tuple[int, int]]) -> None:
        """Learn what other ways between the places of an arc need, from the second time on that one is not sure enough.

        Ways that differ little would else be tried one after the other. met: places between which one was not.
        """
        task, (here, to) = self._task, (arc.parts[0].here, arc.to)
        if len(arc.parts) > 1 or here < 0:
            return
        if (here, to) not in met:
            met.add((here, to))
            return
        others = [
            other
            for other in task.graph.arcs(here)
            if other.to == to and len(other.parts) == 1 and not other.way.is_bound and not task.margins.is_known(other)
        ]
        others = [other for other in others if abs(other.cost - arc.cost) <= BESIDE_FRAC * abs(arc.cost)]
        others = sorted(others, key=lambda other: abs(other.cost - arc.cost))[:BESIDE]
        if not others:
            return
        least_frac = task.least_j(to) / task.capacity_j
        taken = []
        for other in others:
            needed_frac = self._promises.needed_frac(self._journeys.leg(other), least_frac, confidence)
            needed_j = needed_frac * task.capacity_j
            taken.append(Taken(other, task.needs_j(to, other.way), needed_j, kept_frac=1.0, most_kept_frac=1.0))
        task.margins.learn(taken, confidence, task.capacity_j)

    def _with_fallbacks(self, plan: Plan, spread_frac: float, gates: dict[str, bool | None]) -> tuple[ChargeStop, ...]:
        task = self._task
        finder = FallbackFinder(self._search.graph, task)
        planned = frozenset(stop.station.id for stop in plan.stops if stop.station is not None)
        stops = []
        for stop in plan.stops:
            if stop.station is not None and stop.arrive_quantiles_frac is not None:
                at, low_frac = stop.station.position, stop.arrive_quantiles_frac[0]
                onward_s = stop.arrive_s + stop.overhead_s  # it is found out at the plug, and once that is open
                fallback = finder.fallback(at, planned, onward_s, low_frac, OUTER_NORMAL * spread_frac)
                stop = replace(stop, fallback=fallback, gatekeeper=gates.get(stop.station.id))
            stops.append(stop)
        return tuple(stops)

    def _gatekeepers(self, plan: Plan) -> dict[str, bool | None]:
        """Whether there is no plan without each of a plan's stations, by id; None where that was too much work."""
        task = self._task
        is_over = task.after_labels(GATE_LABELS)
        ids = dict.fromkeys(stop.station.id for stop in plan.stops if stop.station is not None)
        gates = {station_id: self._gate(station_id, plan.objective, is_over) for station_id in ids}
        if not task.is_bounded:
            for station_id in [known for known, gate in gates.items() if gate is None][:MOST_AFRESH]:
                if self._has_plan_without(station_id):
                    gates[station_id] = False
        unknown = sum(gate is None for gate in gates.values())
        if unknown:
            self.warnings.append(f"of {unknown} station(s) it is not known whether there is a plan without")
        return gates

    def _gate(self, station_id: str, cost: float, is_over: Callable[[], bool]) -> bool | None:
        """Whether no journey does without a station, beside one of a cost that does not; None where that is not known.

        First along ways that the search knows already, then over more and more stations, and then along bounds that no
        way is better than: only without these there is none. On graphs of which the search knows no bounds only the
        first is tried.
        """
        task = self._task
        with task.closed(station_id):
            try:
                task.margins.factor = self._expected
                if self._found(lambda: task.best(known_only=True)):
                    return False
                if not task.is_bounded:
                    return None
                for more in DETOURS:
                    task.keep_below(cost + more * abs(cost))
                    if self._found(lambda: task.best(is_over=is_over)):
                        return False
                task.margins.factor = 1.0
                task.look_at_all()
                while not self._found(lambda: task.best(is_over=is_over)):
                    task.margins.is_relaxed = True
                    task.weigh()
                    bound = task.best(bounded=True, is_over=is_over)
                    task.margins.is_relaxed = False
                    if bound is None:
                        return True
                    if is_over() or not self._learnt(bound):
                        return None
            except UndecidedError:
                return None
            finally:
                task.margins.factor, task.margins.is_relaxed = 1.0, False
        return False

    def _found(self, best: Callable[[], list[Step] | None]) -> bool:
        """Whether there is a journey that keeps what is asked; best: of least cost by margins as they are learnt."""
        task, confidence = self._task, self._task.charging.confidence
        for _ in range(ROUNDS):
            task.weigh()
            steps = best()
            if steps is None or confidence is None:
                return steps is not None
            promise = self._promises.of(self._journeys.plan("", steps, None, ""))
            task.margins.learn(self._taken(steps, promise), confidence, task.capacity_j)
            if promise.least_kept_frac >= confidence:
                return True
        raise UndecidedError

    def _has_plan_without(self, station_id: str) -> bool:
        """Whether a search over the other stations finds a plan, on a graph on which it looks at few of them."""
        other = self._task.without(station_id)
        steps = other.found()
        return (
            steps is not None and PromiseKeeper(self._search, self._chains, other, self._draws).kept(steps) is not None
        )

    def _learnt(self, bound: list[Step]) -> bool:
        """Learn more of the ways at the bounds of a journey; whether there was anything to be learnt."""
        if self._task.with_more_ways(bound):
            return True
        return self._search.graph.link_count <= MOST_LINKS and self._task.refined(bound)
