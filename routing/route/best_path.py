"""The best path for a weighting under the battery's limits: which searches to run, and what their answer proves."""

from __future__ import annotations

import threading
from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING, Final

import numpy as np

from energy.battery import soc_along
from energy.chain.chain import LinkModel, StopRule, simulate_chain
from energy.conditions import STILL, Conditions
from energy.force.effects import drive_of
from energy.units import JOULE_PER_WH
from energy.vehicle.consumption_table import ConsumptionTableVehicle
from routing.cache_budget import CacheBudget
from routing.errors import NoPathError, SearchLimitError, TimeUpError
from routing.places import LinkPosition, LinkSpan
from routing.route.limits import charge_limits, is_best_within
from routing.route.warnings import search_warnings
from routing.search.found import FoundPath, Limits, PathOptions, SearchCounts
from routing.search.search import find_path
from routing.search.space import SearchSpace, search_space
from routing.search.workspaces import WorkspacePool
from routing.weights import ECO, cost_of

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from energy.stops import StopSettings
    from energy.vehicle.files import AnyVehicle
    from routing.graph.road_graph import RoadGraph
    from routing.links.spans import ChainMaker
    from routing.queries import RangeQuery, RouteQuery
    from routing.weights import Weights

LABELS_PER_LINK: Final = 20
PARETO_LABELS_PER_LINK: Final = 8  # beyond it an answer with a bound beats a proof that takes many seconds


@dataclass(frozen=True, slots=True)
class Leg:
    """What one search is asked: a way from rest at one place to rest at another, and the state in which it begins.

    starts, goals: the place on each direction of its road. driven: all stretches from departure on, the last one
    ending at rest. soc_frac: charge left by them; clock_s: time since departure. reserve_frac: charge to be kept.
    name: of both ends, for errors. legs: of the whole route, which share the labels of searches with pairs of cost and
    energy.
    """

    starts: tuple[LinkPosition, ...]
    goals: tuple[LinkPosition, ...]
    soc_frac: float
    reserve_frac: float
    driven: tuple[LinkSpan, ...] = ()
    clock_s: float = 0.0
    name: str = "start to goal"
    legs: int = 1


@dataclass(frozen=True, slots=True)
class BestPath:
    """A path, the work that its search did, and by how much at most (short_by) it costs more than the least (bound).

    free_cost: of the best path without charge limits, of which none costs less; 0 where only energy is weighted.
    """

    path: FoundPath
    counts: SearchCounts
    method: str
    short_by: float = 0.0
    bound: float = 0.0
    free_cost: float = 0.0


class RouteSearch:
    """Searches on one graph; keeps search spaces and workspaces between queries, safe between threads."""

    def __init__(
        self, graph: RoadGraph, chains: ChainMaker, label_limit: int | None = None, budget: CacheBudget | None = None
    ) -> None:
        self.graph = graph
        self.budget = CacheBudget() if budget is None else budget
        self.pool = WorkspacePool(graph.link_count, self.budget)
        self.label_limit = label_limit or max(LABELS_PER_LINK * graph.link_count, 1_000_000)
        self.pareto_limit = max(PARETO_LABELS_PER_LINK * graph.link_count, 200_000)
        self._chains = chains
        self._spaces: dict[tuple[object, ...], SearchSpace] = {}
        self._lock = threading.Lock()

    def space_of(self, query: RouteQuery | RangeQuery, vehicle: AnyVehicle) -> SearchSpace:
        """The graph as a vehicle sees it under a query's conditions."""
        return self.space(vehicle, query.link_model, query.stop_rule, query.stop_settings, query.conditions)

    def space_key(self, query: RouteQuery | RangeQuery, vehicle: AnyVehicle) -> tuple[object, ...]:
        """What tells the graph as a vehicle sees it under a query's conditions from that of others."""
        conditions = query.conditions
        if self.graph.conditional is None:
            conditions = replace(conditions, departure_min=None)
        return _space_key(vehicle, query.link_model, query.stop_rule, query.stop_settings, conditions)

    def space(
        self,
        vehicle: AnyVehicle,
        model: LinkModel,
        rule: StopRule,
        settings: StopSettings,
        conditions: Conditions = STILL,
    ) -> SearchSpace:
        """The graph as a vehicle sees it, from the ones kept or computed; raises ConditionsError."""
        if self.graph.conditional is None and conditions.departure_min is not None:
            conditions = replace(conditions, departure_min=None)  # no limit depends on it
        key = _space_key(vehicle, model, rule, settings, conditions)
        with self._lock:
            space = self._spaces.get(key)
        if space is None:
            made = search_space(self.graph, vehicle, model, rule, settings, conditions)
            with self._lock:
                space = self._spaces.setdefault(key, made)
        # known drives take more memory than all else of a space, so that they go before it
        drives = space.drives
        self.budget.used(space, "drives", "drives", lambda: drives.held_bytes, drives.forget)
        self.budget.used(self, key, "spaces", lambda: space.held_bytes, partial(self._drop, key))
        return space

    def forget(self) -> None:
        """Give up what is kept between queries."""
        self.budget.forget(self)
        self.budget.forget(self.pool)

    def _drop(self, key: tuple[object, ...]) -> None:
        with self._lock:
            space = self._spaces.pop(key, None)
        if space is not None:
            self.budget.forget(space)  # its drives, and what areas have made of it

    def warnings(self, query: RouteQuery | RangeQuery, crowded: bool, unpaid_j: float) -> tuple[str, ...]:
        """What an answer to a query is to be read with; crowded, unpaid_j: as search_warnings has them."""
        return search_warnings(self.graph.meta, self.space_of(query, query.vehicle), query, crowded, unpaid_j)

    def best_path(self, query: RouteQuery, weights: Weights, leg: Leg) -> BestPath:
        """The best path that keeps the charge limits, or the one of least energy; raises NoPathError."""
        space = self.space_of(query, query.vehicle)
        capacity_j = query.vehicle.usable_capacity_wh * JOULE_PER_WH
        limits = charge_limits(leg.soc_frac, leg.reserve_frac, capacity_j)
        energy_only = weights.time == 0.0 and weights.distance == 0.0

        def find(w: Weights, held: Limits, *, pareto: bool = False) -> tuple[FoundPath | None, SearchCounts]:
            most = min(self.label_limit, self.pareto_limit // leg.legs) if pareto else self.label_limit
            options = PathOptions(pareto=pareto, label_limit=most, begin_s=leg.clock_s)
            return find_path(space, self.pool, w, held, leg.starts, leg.goals, options)

        path: FoundPath | None = None
        free_cost = unpaid_j = 0.0
        in_charge = leg.soc_frac >= leg.reserve_frac
        if energy_only and in_charge:
            path, counts = find(weights, limits)
            unpaid_j = counts.unpaid_j
        elif not energy_only:
            # without limits costs add up, so that the search is simpler; most often its path keeps the limits anyway
            free, counts = find(weights, Limits())
            path = free
            free_cost = 0.0 if free is None else free.cost
            if free is not None and not self._is_best_within(query, free, leg, limits, weights.energy):
                path, counts = find(ECO, limits) if in_charge else (None, counts)
                unpaid_j = counts.unpaid_j
                if path is not None:
                    try:
                        best, counts = find(weights, limits, pareto=True)
                    except (SearchLimitError, TimeUpError):
                        return self._nearly_best(query, weights, leg, limits, free, path, counts)
                    best = path if best is None else best
                    return BestPath(best, counts, method_name(counts, pareto=True), free_cost=free_cost)
        if path is not None:
            return BestPath(path, counts, method_name(counts, pareto=False), free_cost=free_cost)
        path, counts = find(ECO if not energy_only else weights, Limits())
        if path is None:
            raise NoPathError(f"no permitted way leads from {leg.name}")
        counts = replace(counts, unpaid_j=unpaid_j)  # that nothing keeps the limits is no better proven than this
        return BestPath(path, counts, method_name(counts, pareto=False), free_cost=free_cost)

    def _nearly_best(
        self,
        query: RouteQuery,
        weights: Weights,
        leg: Leg,
        limits: Limits,
        free: FoundPath,
        least_energy: FoundPath,
        counts: SearchCounts,
    ) -> BestPath:
        """The better of two paths that keep the limits, and by how much a better one can be cheaper at most.

        No path costs less than the best one without limits, since a battery at its limits only ever adds cost.
        """
        kept = [least_energy, *([free] if self._is_best_within(query, free, leg, limits, 0.0) else [])]
        costs = [self._cost(query, path, leg, weights) for path in kept]
        best = int(np.argmin(costs))
        return BestPath(
            kept[best],
            counts,
            method_name(counts, pareto=False) + "-bounded",
            max(costs[best] - free.cost, 0.0),
            free.cost,
            free.cost,
        )

    def link_energies(
        self, query: RouteQuery, spans: tuple[LinkSpan, ...], soc_start_frac: float | None
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Battery energy [J] and time [s] of each stretch from departure on as the search sees them, float64 (n,)."""
        result = simulate_chain(
            query.vehicle,
            self._chains.chain(spans, query.stop_settings, query.conditions),
            conditions=query.conditions,
            link_model=query.link_model,
            stop_rule=StopRule.EXPECTED if query.stop_rule is StopRule.COUNTED else query.stop_rule,
            soc_start_frac=soc_start_frac,
        )
        return result.links.energy_j, result.links.duration_s

    def _energies_j(
        self, query: RouteQuery, path: FoundPath, leg: Leg, *, charged: bool = True
    ) -> tuple[NDArray[np.float64], float]:
        """Battery energy of each link of a leg's path as the search saw it, float64 (n,) [J], and its time [s].

        charged: with what a nearly full battery refuses.
        """
        spans = (*leg.driven, *self.spans(path))
        energy_j, time_s = self.link_energies(query, spans, query.soc_frac if charged else None)
        return energy_j[len(leg.driven) :], float(time_s[len(leg.driven) :].sum())

    def _cost(self, query: RouteQuery, path: FoundPath, leg: Leg, weights: Weights) -> float:
        """What a path costs with the battery's limits: recuperation that a full battery can't take is worth nothing."""
        energy_j, time_s = self._energies_j(query, path, leg)
        soc, _ = soc_along(energy_j, leg.soc_frac, query.vehicle.usable_capacity_wh)
        used_kwh = (leg.soc_frac - float(soc[-1])) * query.vehicle.usable_capacity_wh / 1000.0
        return cost_of(weights, used_kwh, time_s, path.distance_m)

    def _is_best_within(
        self, query: RouteQuery, path: FoundPath, leg: Leg, limits: Limits, energy_weight: float
    ) -> bool:
        """Whether a path found without limits never takes the charge below the reserve and costs what it said."""
        energy_j, _ = self._energies_j(query, path, leg)
        fades = drive_of(query.vehicle, query.conditions).physics.fade_width_j > 0.0
        return is_best_within(
            limits,
            energy_j,
            leg.soc_frac,
            query.vehicle.usable_capacity_wh,
            energy_weighted=energy_weight != 0.0,
            accepted_whole_j=(lambda: self._energies_j(query, path, leg, charged=False)[0]) if fades else None,
        )

    def spans(self, path: FoundPath) -> tuple[LinkSpan, ...]:
        """The stretches of links that a path drives."""
        from_m = [path.start.offset_m, *[0.0] * (len(path.links) - 1)]
        to_m: list[float] = [*self.graph.length_m[list(path.links[:-1])].tolist(), path.goal.offset_m]
        return tuple(map(LinkSpan, path.links, from_m, to_m))


def _space_key(
    vehicle: AnyVehicle, model: LinkModel, rule: StopRule, settings: StopSettings, conditions: Conditions
) -> tuple[object, ...]:
    """Everything that a search space is made of but the graph."""
    stops = (rule, settings.probability_frac.tobytes(), settings.time_s.tobytes())
    return (_vehicle_key(vehicle), model, *stops, conditions)


def _vehicle_key(vehicle: AnyVehicle) -> tuple[object, ...]:
    """Everything of a vehicle that a search reads; how it charges changes no link and stays out."""
    if isinstance(vehicle, ConsumptionTableVehicle):
        return (
            vehicle.speed_mps.tobytes(),
            vehicle.consumption_j_per_m.tobytes(),
            vehicle.ascent_j_per_m,
            vehicle.descent_j_per_m,
            vehicle.kinetic_up_kg,
            vehicle.kinetic_down_kg,
            vehicle.aux_power_w,
        )
    return (
        vehicle.mass_kg,
        vehicle.road_load_a_n,
        vehicle.road_load_b_n_per_mps,
        vehicle.road_load_c_n_per_mps2,
        vehicle.drive_eff,
        vehicle.recuperation_eff,
        vehicle.aux_power_w,
        vehicle.aux_move_eff,
        vehicle.aux_idle_eff,
        vehicle.rotating_mass_coef,
        vehicle.usable_capacity_wh,
        vehicle.accel_speed_mps.tobytes(),
        vehicle.accel_mps2.tobytes(),
        vehicle.decel_mps2.tobytes(),
        vehicle.effects,
    )


def method_name(counts: SearchCounts, *, pareto: bool) -> str:
    """What an answer calls the search."""
    return ("label-correcting" if counts.label_correcting else "label-setting") + ("-pareto" if pareto else "")
