"""Journeys with charging stops: which stations, by which ways, charged how far; and what would help where none is."""

from __future__ import annotations

import math
import time
from dataclasses import replace
from typing import TYPE_CHECKING, Final

from energy.chain.chain import LinkModel
from energy.chain.sampling import STANDARD_SAMPLING, sampling_of
from energy.charging.power import at_battery_temperature
from energy.units import JOULE_PER_KWH, KMH_PER_MPS, SECOND_PER_MINUTE, ZERO_CELSIUS_K
from routing.charging.choice.choice import USUAL_FEW, Few, StationChoice
from routing.charging.choice.crowd import Crowd, CrowdStore
from routing.charging.journey import JourneyMaker
from routing.charging.legs import LegStore
from routing.charging.plan import ChargingAnswer, Help, HelpKind, NoPlan, Objective, PlanStats
from routing.charging.promise.keeper import PromiseKeeper
from routing.charging.promise.promise import DrawStore
from routing.charging.sites import hindrance, usable_sites, worth_of
from routing.charging.task import PROVEN_FRAC, Proof, Shortage, Task, usual_margin_j
from routing.errors import QueryError, TimeUpError

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from energy.charging.charging import Charging
    from routing.charging.choice.onward import OnwardFinder
    from routing.charging.corridor import Dearness
    from routing.charging.legs import Place
    from routing.charging.network import Step
    from routing.charging.plan import ChargingQuery, Plan
    from routing.charging.sites import Site
    from routing.links.spans import ChainMaker
    from routing.queries import RouteQuery
    from routing.route.best_path import RouteSearch
    from routing.stations.station import Station

MANY_SITES: Final = 400  # stations of a query, of more of which a few are chosen; assumed
WIDER_ROUNDS: Final = 2  # of choosing more of them, where few lead to no goal; assumed
CHOICE_SEARCHES: Final = 400_000  # some 2 s, of choosing more of them, after which bounds stay as they are; assumed
FEW_PROOF_LABELS: Final = 300_000  # as PROOF_LABELS, where a few of very many stations are looked at; assumed
PROOF_LABELS: Final = 2_000_000  # some 2 s, after which an answer with a bound beats a proof; assumed
MANY_LINKS: Final = 300_000  # on more, one search to many places takes some tenths of a second
BEST: Final = "best"  # name of the plan
HOURS: Final = "with opening hours a later arrival may be better, which is not looked for"
NOT_COMPARED: Final = "not all ways were looked at for what they take to be as sure"
PASSED: Final = "what a way needs after a station that is passed without a charge is kept after a charge there too"
KEPT_ROUNDS: Final = 4  # of proof and promise at most
HELP_LABELS: Final = 4_000_000  # some 2 to 4 s, after which nothing more is tried that might help; assumed
CAPS_TRIED_MPS: Final = (110.0 / 3.6, 90.0 / 3.6)  # where no plan is found
LITTLE_KWH: Final = 0.05  # below which two decimals say too little
RESERVE_STEP: Final = 0.05
MOST_RESERVE_STEPS: Final = 19
FEWEST_COST: Final = 1.5  # of the best plan's cost, that one of fewer stops may have; assumed
RESERVE_COST: Final = 1.2  # of the best plan's cost, that one with more reserve may have; assumed


class ChargingPlanner:
    """Plans journeys with charging stops on one graph; keeps ways between stations, safe between threads.

    proof_labels: of searches, up to which ways are refined once a plan is known. many_links: of a graph, beyond which a
    few stations are looked at for each stretch of a journey and plans carry a bound instead of a proof. many_sites:
    stations of a query, of more of which few are looked at first, and others only where a better journey may lead over
    them.
    """

    def __init__(
        self,
        search: RouteSearch,
        chains: ChainMaker,
        *,
        proof_labels: int = PROOF_LABELS,
        many_links: int = MANY_LINKS,
        many_sites: int = MANY_SITES,
        few: Few = USUAL_FEW,
    ) -> None:
        self._search, self._chains, self._proof_labels, self._many_links = search, chains, proof_labels, many_links
        self._many_sites, self._few = many_sites, few
        self._legs = LegStore(search)
        self._crowds = CrowdStore()
        self._draws = DrawStore()

    def forget(self) -> None:
        """Give up the ways that are kept between queries; what is under way goes on."""
        self._legs.forget()
        self._crowds.forget()

    def plan(
        self,
        query: RouteQuery,
        charging: ChargingQuery,
        vehicle_charging: Charging,
        stations: Sequence[Station],
        places: Sequence[Place],
        margin_j: Callable[[float, float], float] | None = None,
    ) -> ChargingAnswer:
        """The best journey from a start over via points to a goal, with stops at stations where it needs them.

        places: start, via points and goal of the query, each by its positions on both directions of its road.
        margin_j: what is kept beyond the energy of a way [J], by that energy, with which it must rise, and its climb
        [m]; by default what `confidence` asks for by the vehicle's own uncertainty. Raises QueryError,
        NegativeCycleError, SearchLimitError, TimeUpError where time is up before any plan is known, AbandonedError.
        """
        check(query, charging)
        asked = _Asked(self, query, charging, vehicle_charging, stations, places, margin_j)
        return asked.answer()


def check(query: RouteQuery, charging: ChargingQuery) -> None:
    """Raise QueryError where a field is out of its range."""
    for field in ("arrive_soc_frac", "goal_soc_frac", "max_soc_frac"):
        value = getattr(charging, field)
        if not 0.0 <= value <= 1.0:
            raise QueryError(f"charging.{field}", value, "0..1")
    if charging.arrive_soc_frac >= charging.max_soc_frac:
        allowed = f"above {charging.arrive_soc_frac:g} (arrive_soc_frac)"
        raise QueryError("charging.max_soc_frac", charging.max_soc_frac, allowed)
    if charging.arrive_soc_frac < query.reserve_soc_frac:
        allowed = f"{query.reserve_soc_frac:g}..1 (from reserve_soc_frac on)"
        raise QueryError("charging.arrive_soc_frac", charging.arrive_soc_frac, allowed)
    if not 0.0 <= charging.overhead_s <= 86_400.0:
        raise QueryError("charging.overhead_s", charging.overhead_s, "0..86400")
    if charging.confidence is not None and not 0.5 <= charging.confidence <= 0.999:
        raise QueryError("charging.confidence", charging.confidence, "0.5..0.999")
    for name, factor in charging.network_factors.items():
        if not 0.01 <= factor <= 100.0:
            raise QueryError(f"charging.network_factors[{name}]", factor, "0.01..100")
    if not 0 <= charging.most_stops <= 100:
        raise QueryError("charging.most_stops", charging.most_stops, "0..100")
    for cap in charging.speed_caps_mps:
        if not 5.0 <= cap <= 70.0:
            raise QueryError("charging.speed_caps_mps", cap, "5..70")
    for stay in charging.stays:
        if stay.via_idx is not None and not 0 <= stay.via_idx < len(query.via):
            raise QueryError("charging.stays.via_idx", stay.via_idx, f"0..{len(query.via) - 1}, or none for the goal")
        if not (0.0 <= stay.seconds <= 7 * 86_400.0 and stay.power_w >= 0.0):
            raise QueryError("charging.stays", (stay.seconds, stay.power_w), "0..604800 s, a power of 0 or more")
    for k, (via_idx, _) in enumerate(charging.via_stations):
        if not 0 <= via_idx < len(query.via):
            allowed = f"0..{len(query.via) - 1}" if query.via else "a query with via points"
            raise QueryError(f"charging.via_stations[{k}].via", via_idx, allowed)


class _Asked:
    """One query for plans."""

    def __init__(
        self,
        planner: ChargingPlanner,
        query: RouteQuery,
        charging: ChargingQuery,
        vehicle_charging: Charging,
        stations: Sequence[Station],
        places: Sequence[Place],
        margin_j: Callable[[float, float], float] | None,
    ) -> None:
        self._began = time.perf_counter()
        self._search, self._chains = planner._search, planner._chains
        self._legs, self._proof_labels, self._many_links = planner._legs, planner._proof_labels, planner._many_links
        self._draws, self._crowds = planner._draws, planner._crowds
        self._many_sites, self._few = planner._many_sites, planner._few
        self._query, self._charging, self._stations = query, charging, stations
        self._places = places_with_stations(places, charging, stations)
        if query.conditions.ambient_k is not None:
            vehicle_charging = at_battery_temperature(vehicle_charging, query.conditions.ambient_k - ZERO_CELSIUS_K)
        self._vehicle_charging, self._margin_j = vehicle_charging, margin_j
        self._tasks: list[Task] = []
        self._choices: dict[Task, tuple[Crowd, StationChoice]] = {}  # of tasks with a part of very many stations
        self._shortages: dict[Task, Shortage] = {}  # of those, where all of these do not lead to the goal
        self._warnings: list[str] = []

    def _task(self, query: RouteQuery, charging: ChargingQuery) -> Task:
        crowd = self._crowd(charging)
        if crowd is None:
            sites = usable_sites(self._vehicle_charging, charging, self._stations)
            return self._kept_task(self._task_over(sites, query, charging, self._margin_j))
        choice = self._task_over((), query, charging, None).choice(crowd, self._few)
        return self._chosen_task(crowd, choice, query, charging)

    def _crowd(self, charging: ChargingQuery) -> Crowd | None:
        """Stations that a query may use, where they are so many that few are looked at."""
        if len(self._stations) <= self._many_sites or self._search.graph.link_count > self._many_links:
            return None
        crowd = self._crowds.crowd(self._vehicle_charging, charging, self._stations)
        return crowd if len(crowd.sites) > self._many_sites else None

    @property
    def _labels(self) -> int:
        """Work that was done so far, the same on every machine."""
        return sum(task.labels for task in self._tasks)

    def _kept_task(self, task: Task) -> Task:
        self._tasks.append(task)
        return task

    def _chosen_task(
        self,
        crowd: Crowd,
        choice: StationChoice,
        query: RouteQuery,
        charging: ChargingQuery,
        stations: Sequence[int] | None = None,
    ) -> Task:
        """A task over the stations that are chosen, or over some others."""
        numbers = choice.chosen.nonzero()[0].tolist() if stations is None else stations
        sites = [crowd.sites[k] for k in numbers]
        task = self._task_over(sites, query, charging, self._margin_j, choice.dearness(numbers))
        task.usable, task.beyond_cost, task.stop_cost = crowd.sites, choice.beyond_cost, choice.stop_cost
        self._choices[task] = crowd, choice
        return self._kept_task(task)

    def _found(self, task: Task) -> tuple[Task, list[Step] | None]:
        """The best journey along known ways, and the task that has it: over more stations, where a few were chosen."""
        best = task.found()
        if task not in self._choices:
            return task, best
        crowd, choice = self._choices[task]
        if best is None:
            finder = task.onward(crowd.sites, crowd.spots)
            if self._is_shut_off(task, finder):
                return task, None
            return self._found_wider(task, crowd, choice, finder)
        if choice.grow(best, CHOICE_SEARCHES):
            task = self._chosen_task(crowd, choice, task.query, task.charging)
            best = task.found_below(best[-1].cost)
        task.beyond_cost, task.stop_cost = choice.beyond_cost, choice.stop_cost
        return task, best

    def _found_wider(
        self, task: Task, crowd: Crowd, choice: StationChoice, finder: OnwardFinder | None
    ) -> tuple[Task, list[Step] | None]:
        """As _found where the first few do not lead to the goal: over those by which the battery does, or over more.

        Of the stations by which it does, as good as ways to and from the others are known by then.
        """
        query, charging = task.query, task.charging
        chain = [] if finder is None else task.learn_chain(finder, crowd.sites)
        if chain:
            task = self._chosen_task(crowd, choice, query, charging, chain)
            best = task.found()
            choice.add(chain)
            if best is not None:
                more = self._chosen_task(crowd, choice, query, charging)
                better = more.found_soon(best[-1].cost, FEW_PROOF_LABELS)
                return (task, best) if better is None else (more, better)
        for _ in range(WIDER_ROUNDS):
            if not choice.widen():
                return task, None
            task = self._chosen_task(crowd, choice, query, charging)
            best = task.found()
            if best is not None:
                return task, best
        count = int(choice.chosen.sum())
        self._warnings.append(f"of {len(crowd.sites)} stations {count} were looked at, over which there is no plan")
        return task, None

    def _is_shut_off(self, task: Task, finder: OnwardFinder | None) -> bool:
        """Whether the battery alone shows that no journey comes to the goal over any of very many stations."""
        crowd, choice = self._choices[task]
        shut_off = None if finder is None else finder.shut_off()
        if shut_off is not None:
            last = choice.last_of(shut_off.reached)
            self._shortages[task] = task.shortage_of(shut_off, crowd.sites, None if last is None else crowd.sites[last])
        return shut_off is not None

    def _task_over(
        self,
        sites: Sequence[Site],
        query: RouteQuery,
        charging: ChargingQuery,
        margin_j: Callable[[float, float], float] | None,
        dearness: Dearness | None = None,
    ) -> Task:
        return Task(
            self._legs,
            query,
            charging,
            self._vehicle_charging,
            sites,
            self._places,
            margin_j,
            self._proof_labels if dearness is None else min(self._proof_labels, FEW_PROOF_LABELS),
            self._many_links,
            dearness,
        )

    def answer(self) -> ChargingAnswer:
        """The plans, or why there is none."""
        if self._charging.confidence is not None and self._margin_j is None:
            self._margin_j = self._least_margin(self._charging.confidence)
        task = self._task(self._query, self._charging)
        usable = {site.station.id for site in task.usable} if self._charging.via_stations else set()
        on_roads = {station.id: station for station in self._stations if station.position}
        for k, (via_idx, station_id) in enumerate(self._charging.via_stations):
            if station_id not in on_roads:
                allowed = "a station of the graph that is on one of its roads"
                raise QueryError(f"charging.via_stations[{k}].station", station_id, allowed)
            if station_id not in usable:
                station = on_roads[station_id]
                why = hindrance(station, self._vehicle_charging, self._charging)
                self._warnings.append(f"via[{via_idx}], {_called(station)}, is passed without charging: {why}")
        stage_s = {"set_up": self._since()}
        keeper = self._keeper(task)
        best: list[Step] | None
        try:
            task, best = self._found(task)
            keeper = self._keeper(task)
            stage_s["first_plan"] = self._since()
            best, proof = self._kept(keeper, task, best)
        except TimeUpError as error:
            best, proof = self._after_time(keeper, task, error)
        stage_s["proof"] = self._since()
        plans: list[Plan] = []
        missing = None
        if best is None:
            missing = self._no_plan(task)
        else:
            plans.append(self._made(keeper, task, BEST, best, self._honest(task, best, proof)))
            stage_s["promise"] = self._since()
            try:
                self._add_alternatives(plans, task, best)
            except TimeUpError as error:
                self._warnings.append(f"not all alternatives are answered: {error.limit_s:g} s were not enough")
            stage_s["alternatives"] = self._since()
        return ChargingAnswer(tuple(plans), missing, self._stats(stage_s), tuple(self._warnings))

    def _since(self) -> float:
        return time.perf_counter() - self._began

    def _stats(self, stage_s: dict[str, float]) -> PlanStats:
        return PlanStats(
            leg_searches=sum(task.counts.searches + task.counts.compared for task in self._tasks),
            legs_cached=sum(task.counts.known for task in self._tasks),
            labels_made=sum(task.graph.work.made for task in self._tasks),
            labels_settled=sum(task.graph.work.settled for task in self._tasks),
            seconds=self._since(),
            stage_s=stage_s,
        )

    def _keeper(self, task: Task) -> PromiseKeeper:
        return PromiseKeeper(self._search, self._chains, task, self._draws)

    def _kept(self, keeper: PromiseKeeper, task: Task, best: list[Step] | None) -> tuple[list[Step] | None, Proof]:
        """The best journey that keeps what is asked for, and the proof of it.

        Ways that the proof finds have the least margins at first: a better journey over them is to be kept as well.
        """
        if self._charging.confidence is None:
            return task.proven(best)
        proof = Proof(None)
        for _ in range(KEPT_ROUNDS):
            sure = keeper.kept(best)
            best, proof = task.proven(sure)
            if best is None or (sure is not None and best[-1].cost >= sure[-1].cost):
                return best, self._kept_proof(task, best, proof) if keeper.is_best else self._not_compared(task, best)
        sure = keeper.kept(best)
        return sure, self._not_compared(task, sure)

    def _kept_proof(self, task: Task, best: list[Step] | None, proof: Proof) -> Proof:
        """The proof of a journey that keeps a confidence, as far as no margin is too large."""
        if best is None or proof.short_by is None or not task.margins.may_be_too_large:
            return proof
        task.margins.is_relaxed = True
        task.weigh()
        cost = best[-1].cost
        bound = task.best(bounded=True, below=cost - max(proof.short_by, PROVEN_FRAC * abs(cost)))
        task.margins.is_relaxed = False
        task.weigh()
        return proof if bound is None else Proof(cost - bound[-1].cost, PASSED)

    def _after_time(self, keeper: PromiseKeeper, task: Task, error: TimeUpError) -> tuple[list[Step], Proof]:
        """The journey that was known, and kept what is asked for, when time was up; raises where none was."""
        if self._charging.confidence is None:
            return task.after_time(error)
        if keeper.sure is None:
            raise error
        return keeper.sure, Proof(keeper.sure[-1].cost - task.least_cost, f"{error.limit_s:g} s were not enough")

    def _not_compared(self, task: Task, best: list[Step] | None) -> Proof:
        return Proof(None if best is None else max(best[-1].cost - task.least_cost, 0.0), NOT_COMPARED)

    def _made(self, keeper: PromiseKeeper, task: Task, name: str, steps: list[Step], proof: Proof) -> Plan:
        plan = JourneyMaker(self._search, self._chains, task).plan(name, steps, proof.short_by, proof.unproven)
        known = len(keeper.warnings)
        for halt in plan.halts:
            self._warnings.append(
                f"{name}: going on from rest at {_called(halt.station)} serves better than passing it"
            )
        for passed in plan.passed:
            if passed.waiting_s > 0.0:
                opens = f"it is closed on arrival, for another {passed.waiting_s / SECOND_PER_MINUTE:.0f} min"
                at = _called(passed.station)
                self._warnings.append(f"{name}: via[{passed.via_idx}], {at}, is passed without charging: {opens}")
        plan = keeper.promised(plan, gatekeepers=name == BEST)
        self._warnings += keeper.warnings[known:]
        return plan

    def _honest(self, task: Task, best: list[Step], proof: Proof) -> Proof:
        """A proof, taken back where the model that it is of is not quite what is driven."""
        space = self._search.space_of(self._query, self._query.vehicle)
        physics = space.physics
        if physics.cabin_start_w != 0.0 or physics.tyre_time_s != 0.0:
            return Proof(None, "cabin or tyres warm up, and each leg was searched as if it began cold")
        if physics.fade_width_j > 0.0:
            return Proof(None, "the battery takes less when nearly full, which ways between stations leave out")
        if self._query.link_model is LinkModel.PRINTED or not space.conserving:
            return Proof(None, "energy is not conserved by this model under these conditions")
        if task.counts.crowded:
            return Proof(None, "very many short links: dominance was relaxed")
        return self._by_open_stations(best) if task.is_clocked else proof

    def _by_open_stations(self, best: list[Step]) -> Proof:
        """The proof of a journey over stations with opening hours: none is better than if all were always open."""
        task = self._task(self._query, replace(self._charging, departure_min=None))
        try:
            task, steps = self._found(task)
            steps, proof = task.proven(steps)
        except TimeUpError:
            return Proof(None, HOURS)
        if steps is None or proof.short_by is None:
            return Proof(None, HOURS)
        cost = best[-1].cost
        short_by = cost - (steps[-1].cost - proof.short_by)
        return Proof(0.0) if short_by <= PROVEN_FRAC * abs(cost) else Proof(short_by, HOURS)

    def _least_margin(self, confidence: float) -> Callable[[float, float], float]:
        """What a confidence keeps at least beyond a way's energy; promises tell what it takes more."""
        query = self._query
        sd_frac = sampling_of(query.vehicle, STANDARD_SAMPLING).residual_sd_frac
        weight_n = self._search.space_of(query, query.vehicle).physics.weight_n
        return usual_margin_j(sd_frac, confidence, weight_n)

    def _add_alternatives(self, plans: list[Plan], task: Task, best: list[Step]) -> None:
        """Further plans that differ: fewest stops, fastest, most reserve."""
        charging = self._charging
        wanted: list[tuple[str, Callable[[], tuple[Task, list[Step]] | None]]] = [
            (
                "fewest stops",
                lambda: self._fewest(task, sum(stop.station is not None for stop in plans[0].stops), best[-1].cost),
            ),
            ("fastest", lambda: self._fastest(task)),
            ("most reserve", lambda: self._most_reserve(task, best[-1].cost)),
        ]
        for name, find in wanted:
            if len(plans) > charging.alternatives:
                return
            found = find()
            if found is None:
                continue
            other, steps = found
            keeper = self._keeper(other)
            sure = keeper.kept(steps)
            if sure is None:
                continue
            plan = self._made(keeper, other, name, sure, Proof(None, "an alternative"))
            if all(_stops_of(plan) != _stops_of(known) for known in plans):
                plans.append(plan)

    def _other_task(self, task: Task, charging: ChargingQuery) -> Task:
        """The same query otherwise, over the same few of very many stations."""
        if task not in self._choices:
            return self._task(self._query, charging)
        sites = usable_sites(self._vehicle_charging, charging, [site.station for site in task.sites])
        costs_alike = worth_of(charging) == worth_of(self._charging) and len(sites) == len(task.sites)
        dearness = task.dearness if costs_alike and not self._charging.network_factors else None
        other = self._task_over(sites, self._query, charging, self._margin_j, dearness)
        other.take_likely_ways()
        other.usable = task.usable
        return self._kept_task(other)

    def _fewest(self, task: Task, stops: int, cost: float) -> tuple[Task, list[Step]] | None:
        """The best journey of the fewest stops, below a number of them, that does not cost far more."""
        task = self._other_task(task, replace(self._charging, most_stops=stops))
        task.keep_below(FEWEST_COST * cost)
        for most in range(task.least_stops(), stops):
            task.charging = replace(self._charging, most_stops=most)
            steps = task.best(below=FEWEST_COST * cost)
            if steps is not None:
                return task, steps
        return None

    def _fastest(self, task: Task) -> tuple[Task, list[Step]] | None:
        if self._charging.objective is Objective.TIME and not self._charging.network_factors:
            return None
        task = self._other_task(task, replace(self._charging, objective=Objective.TIME, network_factors={}))
        task, steps = self._found(task)
        return None if steps is None else (task, steps)

    def _most_reserve(self, task: Task, cost: float) -> tuple[Task, list[Step]] | None:
        """The best journey that arrives with the most charge everywhere and does not cost much more.

        More reserve never costs less, so that the most is found by halving what is left to be tried.
        """
        found = None
        most = self._charging.max_soc_frac - RESERVE_STEP - self._charging.arrive_soc_frac
        low, high = 0, min(int(most / RESERVE_STEP + 1e-9), MOST_RESERVE_STEPS) + 1
        while high - low > 1:
            middle = (low + high) // 2
            least = self._charging.arrive_soc_frac + middle * RESERVE_STEP
            goal = max(self._charging.goal_soc_frac, least)
            other = self._other_task(task, replace(self._charging, arrive_soc_frac=least, goal_soc_frac=goal))
            other.keep_below(RESERVE_COST * cost)
            steps = other.best(below=RESERVE_COST * cost)
            if steps is None:
                high = middle
            else:
                low, found = middle, (other, steps)
        return found

    def _no_plan(self, task: Task) -> NoPlan:
        """Which leg fails, by how much, the last station in reach, and what would help, in the order of trying."""
        shortage = self._shortages.get(task) or task.shortage()
        helps: list[Help] = []
        until = self._labels + HELP_LABELS
        try:
            for cap in CAPS_TRIED_MPS:
                if self._labels > until:
                    break
                slower = replace(self._charging, speed_caps_mps=(cap,))
                if self._has_plan(self._query, slower):
                    helps.append(Help(HelpKind.SPEED_CAP, cap, f"driving at most {cap * KMH_PER_MPS:.0f} km/h"))
                    break
            if self._charging.max_soc_frac < 1.0 and self._labels <= until:
                fuller = replace(self._charging, max_soc_frac=1.0)
                if self._has_plan(self._query, fuller):
                    helps.append(Help(HelpKind.MAX_SOC, 1.0, "charging to 100 % at stations"))
            charge = self._charge_that_suffices(until)
            if charge is not None:
                text = f"departing with {100.0 * charge:.0f} % instead of {100.0 * self._query.soc_frac:.0f} %"
                helps.append(Help(HelpKind.SOC, charge, text))
            confidence = self._confidence_that_is_kept()
            if confidence is not None:
                text = f"a confidence of {confidence:g} instead of {self._charging.confidence:g}"
                helps.append(Help(HelpKind.CONFIDENCE, confidence, text))
            if self._labels > until:
                self._warnings.append("not all that might help was tried")
        except TimeUpError as error:
            self._warnings.append(f"{error.limit_s:g} s were not enough to try all that might help")
        station, last = shortage.station, shortage.last
        missing_j = max(shortage.missing_j, 0.0)
        kwh = missing_j / JOULE_PER_KWH
        if missing_j == float("inf"):
            reason, missing_j = "no permitted way leads on", 0.0
        else:
            whence = "the start" if station is None else f"station {station.name or station.id!r}"
            lacks = f"{kwh:.2f}" if kwh >= LITTLE_KWH else f"{kwh:.2g}"
            reason = f"from {whence} nothing that leads on is reached: {lacks} kWh are missing"
            if shortage.at_goal:
                reason = f"from {whence} the goal is not reached with what is asked for there: {lacks} kWh are missing"
            if missing_j == 0.0:  # charge is enough for each next leg
                reason = f"the goal is not reached with at most {_counted(self._charging.most_stops)}"
        if not self._stations:
            name = self._search.graph.meta.name
            reason += f"; graph {name!r} has no charging stations"
            text = f"charging stations: joulepath stations import FILE --graph {name}"
            helps.append(Help(HelpKind.STATIONS, None, text))
        elif not task.usable:
            reason += "; no station may be used" + (": at most 0 stops" if self._charging.most_stops == 0 else "")
        return NoPlan(reason, station, missing_j, last, tuple(helps))

    def _has_plan(self, query: RouteQuery, charging: ChargingQuery) -> bool:
        """Whether there is a plan, of the confidence asked for, along ways that are known by few searches."""
        if self._search.graph.link_count <= self._many_links:
            reached = self._is_reached(query, charging)
            if reached is not None:
                return reached
        task = self._task(query, charging)
        if task in self._choices:
            task, steps = self._found(task)
            return self._keeper(task).kept(steps) is not None
        return self._keeper(task).kept(task.found()) is not None

    def _is_reached(self, query: RouteQuery, charging: ChargingQuery) -> bool | None:
        """Whether there is a plan by the battery alone, or over the stations by which it leads to the goal; None for
        unknown.
        """
        crowd = self._crowd(charging)
        sites = usable_sites(self._vehicle_charging, charging, self._stations) if crowd is None else crowd.sites
        none = self._kept_task(self._task_over((), query, charging, None))
        finder = none.onward(sites, None if crowd is None else crowd.spots)
        if finder is None:
            return None
        if finder.goal_is_beyond_all() or finder.shut_off() is not None:
            return False
        chain = [sites[k] for k in none.learn_chain(finder, sites)]
        if chain:
            small = self._kept_task(self._task_over(chain, query, charging, self._margin_j))
            if self._keeper(small).kept(small.found()) is not None:
                return True
        return None if crowd is None else False  # others of very many stations take too long to look at

    def _confidence_that_is_kept(self) -> float | None:
        """Of the best plan by the mean, charged as far as it may be, rounded down; None where it is below a half."""
        if self._charging.confidence is None:
            return None
        margin_j, self._margin_j = self._margin_j, None
        task = self._task(self._query, replace(self._charging, confidence=None))
        self._margin_j = margin_j
        steps = task.found()
        kept = 0.0 if steps is None else math.floor(1000.0 * self._keeper(task).most_kept_frac(steps)) / 1000.0
        return kept if kept >= 0.5 else None

    def _charge_that_suffices(self, until: int) -> float | None:
        """Least charge at departure, in whole percent, with which there is a plan; None where no charge helps.

        After so many labels it is the least of those that are known to suffice.
        """
        low, high = int(100.0 * self._query.soc_frac), 100
        if low >= high or not self._has_plan(replace(self._query, soc_frac=1.0), self._charging):
            return None
        while high - low > 1 and self._labels <= until:
            middle = (low + high) // 2
            if self._has_plan(replace(self._query, soc_frac=middle / 100.0), self._charging):
                high = middle
            else:
                low = middle
        return high / 100.0


def places_with_stations(
    places: Sequence[Place], charging: ChargingQuery, stations: Sequence[Station]
) -> Sequence[Place]:
    """Start, via points and goal, of which those that are stations lie where these are on the roads."""
    if not charging.via_stations:
        return places
    positions = {station.id: station.position for station in stations}
    at = dict(charging.via_stations)
    return [positions.get(at.get(k - 1, ""), place) for k, place in enumerate(places)]


def _called(station: Station) -> str:
    return f"station {station.name or repr(station.id)}"


def _counted(stops: int) -> str:
    return f"{stops} stop{'' if stops == 1 else 's'}"


def _stops_of(plan: Plan) -> tuple[tuple[str, int, float | None], ...]:
    """What tells plans apart: stations, charges at departure in percent, caps."""
    return tuple(
        ("" if stop.station is None else stop.station.id, round(100.0 * stop.depart_soc_frac), leg.speed_cap_mps)
        for stop, leg in zip(plan.stops, plan.legs, strict=False)
    )
