"""Route and range queries answered on one graph: snap, search, unpack."""

from __future__ import annotations

import math
import threading
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Final

import numpy as np

from energy.battery import JOULE_PER_WH, soc_along
from energy.chain import Chain, EnergyParts, LinkModel, StopRule, simulate_chain
from energy.conditions import STILL, Conditions
from energy.consumption_table import ConsumptionTableVehicle
from energy.errors import LinkError
from energy.stops import StopSettings
from energy.uncertainty import FACTOR_RANGE, SEED, chain_distribution, dissipation_sd_frac, pessimistic
from energy.vehicle import Powertrain
from routing.area import reachable_areas
from routing.errors import NoPathError, QueryError, SearchLimitError
from routing.graph import Terrain
from routing.hot_links import RouteLinks, hot_stretches
from routing.query import (
    ECO,
    RANGE_PROBABILITIES,
    LinkSpan,
    Point,
    RangeAnswer,
    RangeBand,
    Remedy,
    Route,
    RouteAnswer,
    RouteLink,
    SearchStats,
)
from routing.search import (
    METRE_PER_KM,
    SECOND_PER_HOUR,
    FoundPath,
    Limits,
    LinkPosition,
    Reach,
    SearchCounts,
    SearchSpace,
    WorkspacePool,
    find_path,
    link_stops,
    reach,
    search_space,
)
from routing.snap import RoadIndex, part_of_line

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from energy.chain import ChainResult
    from energy.uncertainty import EnergyDistribution
    from energy.vehicle_files import AnyVehicle
    from routing.graph import RoadGraph
    from routing.hot_links import HotStretch
    from routing.query import RangeQuery, RouteQuery, SnappedPoint, Weights

SAME_PLACE_M: Final = 0.5
SPACES_KEPT: Final = 12
SAMPLE_LINKS: Final = 300  # on which the spread of what driving dissipates is taken
LEAST_FACTOR: Final = FACTOR_RANGE[0]
LABELS_PER_LINK: Final = 20
PARETO_LABELS_PER_LINK: Final = 8  # beyond it an answer with a bound beats a proof that takes many seconds


@dataclass(frozen=True, slots=True)
class _Found:
    """A path, the work that its search did, and by how much at most (short_by) it costs more than the least (bound)."""

    path: FoundPath
    counts: SearchCounts
    method: str
    short_by: float = 0.0
    bound: float = 0.0


class Planner:
    """Answers queries on one frozen graph; safe to share between threads."""

    def __init__(self, graph: RoadGraph, *, snap_limit_m: float = 1000.0, label_limit: int | None = None) -> None:
        self.graph = graph
        self._snap_limit_m = snap_limit_m
        self._label_limit = label_limit or max(LABELS_PER_LINK * graph.link_count, 1_000_000)
        self._pareto_limit = max(PARETO_LABELS_PER_LINK * graph.link_count, 200_000)
        self._roads = RoadIndex(graph)
        self._altitude_m, self._heading = graph.altitude_m(), graph.heading()
        self._pool = WorkspacePool(graph.link_count)
        self._spaces: dict[tuple[object, ...], SearchSpace] = {}
        self._lock = threading.Lock()

    def warm_up(self, vehicle: AnyVehicle) -> None:
        """Compile the kernels for this graph's arrays before the first query, and build the road index."""
        west, south, east, north = self.graph.meta.bbox
        middle = LinkPosition(0, 0.5 * float(self.graph.length_m[0]))
        space = self._space(vehicle, LinkModel.INTEGRATED, StopRule.EXPECTED, StopSettings())
        find_path(space, self._pool, ECO, Limits(), [middle], [middle], label_limit=1000)
        reach(space, self._pool, Limits(0.0, 0.0), [middle], self.graph.head, self.graph.node_count)
        self.simulate((LinkSpan(0, 0.0, float(self.graph.length_m[0])),), vehicle)
        self._roads.snap("warm-up", Point((south + north) / 2.0, (west + east) / 2.0), math.inf)

    def route(self, query: RouteQuery) -> RouteAnswer:
        """One route for each weighting of the query, from rest at the start to rest at the goal.

        Raises QueryError, PointOutsideMapError, PointFarFromRoadError, NoPathError, NegativeCycleError,
        SearchLimitError. A goal out of reach on this charge is an answer, with `feasible` false.
        """
        _check_charge(query.soc_frac, query.reserve_soc_frac)
        if not query.weightings:
            raise QueryError("weightings", "empty", "at least one weighting")
        for name, weights in query.weightings:
            _check_weights(name, weights)
        start, starts = self._roads.snap("start", query.start, self._snap_limit_m)
        goal, goals = self._roads.snap("goal", query.goal, self._snap_limit_m)
        routes, stats, bounded = [], [], []
        crowded = False
        for name, weights in query.weightings:
            if start.link_idx == goal.link_idx and abs(start.offset_m - goal.offset_m) < SAME_PLACE_M:
                routes.append(_no_route(name, weights, query, start))
                stats.append(SearchStats(0, 0, 0.0, "none"))
                continue
            found = self._search(query, weights, starts, goals)
            counts = found.counts
            crowded |= counts.crowded > 0
            routes.append(self._unpack(name, weights, query, found.path))
            stats.append(SearchStats(counts.labels_made, counts.labels_settled, counts.seconds, found.method))
            if found.short_by > 0.0:
                bounded.append(
                    f"route {name!r} is good but not proven best: near the battery's limits too many ways compare; "
                    f"a better one would cost at most {found.short_by:.3g} less (of {found.short_by + found.bound:.3g})"
                )
        warnings = self._warnings(query, crowded) + tuple(bounded)
        for route in routes:
            if not route.feasible and route.weights != ECO and query.stop_rule is not StopRule.COUNTED:
                warnings += (f"no route reaches the goal on this charge: {route.name!r} shows the least-energy way",)
        return RouteAnswer(tuple(routes), start, goal, tuple(stats), warnings)

    def range(self, query: RangeQuery) -> RangeAnswer:
        """The area that can be reached before the charge falls below the reserve, with its inner bands.

        Raises QueryError, PointOutsideMapError, PointFarFromRoadError, NegativeCycleError, SearchLimitError.
        """
        _check_charge(query.soc_frac, query.reserve_soc_frac)
        for band in query.bands_soc_frac:
            if not query.reserve_soc_frac <= band <= query.soc_frac:
                raise QueryError("bands", band, f"{query.reserve_soc_frac:g} (reserve_soc)..{query.soc_frac:g} (soc)")
        origin, starts = self._roads.snap("origin", query.origin, self._snap_limit_m)
        vehicles: dict[float | None, AnyVehicle] = {None: query.vehicle}
        if query.uncertainty:
            sd_frac = self._dissipation_sd_frac(query)
            vehicles = {
                probability: pessimistic(query.vehicle, max(1.0 + z * sd_frac, LEAST_FACTOR))
                for probability, z in RANGE_PROBABILITIES.items()
            }
        capacity_j = query.vehicle.usable_capacity_wh * JOULE_PER_WH
        searched = {probability: self._reach(query, vehicle, starts) for probability, vehicle in vehicles.items()}
        wanted = [
            (left, probability)
            for left in sorted({query.reserve_soc_frac, *query.bands_soc_frac})
            for probability in searched
        ]
        cases = [(searched[probability], (query.soc_frac - left) * capacity_j) for left, probability in wanted]
        areas = reachable_areas(self.graph, cases, origin.on_road)
        bands = tuple(
            RangeBand(left, a.area, a.area_m2, a.node_count, a.false_in_frac, a.false_out_frac, probability)
            for (left, probability), a in zip(wanted, areas, strict=True)
        )
        counts = max((reached.counts for reached in searched.values()), key=lambda made: made.labels_made)
        stats = SearchStats(counts.labels_made, counts.labels_settled, counts.seconds, _method(counts, pareto=False))
        return RangeAnswer(origin, bands, stats, self._warnings(query, counts.crowded > 0))

    def _reach(self, query: RangeQuery, vehicle: AnyVehicle, starts: tuple[LinkPosition, ...]) -> Reach:
        """What one vehicle reaches down to the reserve."""
        return reach(
            self._space(vehicle, query.link_model, query.stop_rule, query.stop_settings, query.conditions),
            self._pool,
            _limits(query.soc_frac, query.reserve_soc_frac, vehicle.usable_capacity_wh * JOULE_PER_WH),
            starts,
            self.graph.head,
            self.graph.node_count,
            label_limit=self._label_limit,
        )

    def _dissipation_sd_frac(self, query: RangeQuery) -> float:
        """Relative standard deviation of what driving dissipates, on a sample of the graph's links."""
        graph = self.graph
        rng = np.random.default_rng(SEED)
        idx = rng.choice(graph.link_count, SAMPLE_LINKS, p=graph.length_m / graph.length_m.sum())
        chain = self._chain_of(idx, graph.length_m[idx], query.stop_settings)
        return dissipation_sd_frac(
            query.vehicle, chain, conditions=query.conditions, link_model=query.link_model, stop_rule=query.stop_rule
        )

    def simulate(
        self,
        spans: tuple[LinkSpan, ...],
        vehicle: AnyVehicle,
        *,
        conditions: Conditions = STILL,
        link_model: LinkModel = LinkModel.INTEGRATED,
        stop_rule: StopRule = StopRule.EXPECTED,
        stop_settings: StopSettings | None = None,
        arrive_stopped: bool = True,
        soc_start_frac: float | None = None,
    ) -> ChainResult:
        """Energy and time over stretches of links driven one after the other.

        Raises LinkError where a link does not exist, may not follow the one before, or a stretch leaves it.
        """
        return simulate_chain(
            vehicle,
            self.chain(spans, stop_settings),
            conditions=conditions,
            link_model=link_model,
            stop_rule=stop_rule,
            arrive_stopped=arrive_stopped,
            soc_start_frac=soc_start_frac,
        )

    def chain(self, spans: tuple[LinkSpan, ...], settings: StopSettings | None = None) -> Chain:
        """The chain of links that stretches of links make, with altitude and heading; raises LinkError as simulate."""
        graph = self.graph
        for k, span in enumerate(spans):
            if not 0 <= span.link_idx < graph.link_count:
                raise LinkError("id", k, span.link_idx, f"0..{graph.link_count - 1}")
            length_m = float(graph.length_m[span.link_idx])
            slack = 1e-6 * length_m
            if not -slack <= span.from_m < length_m:
                raise LinkError("from_m", k, span.from_m, f"0..{length_m} (length of the link)")
            if not span.from_m < span.to_m <= length_m + slack:
                raise LinkError("to_m", k, span.to_m, f"above {span.from_m} (from_m), at most {length_m} (length)")
            if k > 0:
                before = spans[k - 1]
                if span.link_idx not in graph.successors(before.link_idx):
                    raise LinkError("id", k, span.link_idx, f"a link that may follow link {before.link_idx}")
                before_m = float(graph.length_m[before.link_idx])
                if before.to_m < before_m * (1.0 - 1e-6):
                    raise LinkError("to_m", k - 1, before.to_m, f"{before_m}: no gap before the next link")
                if span.from_m > slack:
                    raise LinkError("from_m", k, span.from_m, "0: no gap after the link before")
        idx = np.array([s.link_idx for s in spans], np.int64)
        return self._chain_of(idx, np.array([s.to_m - s.from_m for s in spans]), settings or StopSettings())

    def _chain_of(self, idx: NDArray[np.int64], length_m: NDArray[np.float64], settings: StopSettings) -> Chain:
        """Links of the graph one after the other, each driven over a length."""
        graph = self.graph
        probability, wait = link_stops(graph, settings)
        stop_class = 4 * graph.urban[idx].astype(np.int8) + graph.cross[idx]
        climb = graph.node_height_m[graph.head[idx]] - graph.node_height_m[graph.tail[idx]]
        return Chain(
            length_m=length_m,
            grade_frac=climb / graph.length_m[idx],
            speed_limit_mps=graph.speed_limit_mps[idx],
            stop_probability_frac=probability[idx],
            stop_time_s=wait[idx],
            stop_class=stop_class.astype(np.int8),
            altitude_m=self._altitude_m[idx],
            heading=self._heading[idx],
        )

    def _space(
        self,
        vehicle: AnyVehicle,
        model: LinkModel,
        rule: StopRule,
        settings: StopSettings,
        conditions: Conditions = STILL,
    ) -> SearchSpace:
        stops = (rule, settings.probability_frac.tobytes(), settings.time_s.tobytes())
        key = (_vehicle_key(vehicle), model, *stops, conditions)
        with self._lock:
            space = self._spaces.pop(key, None)
        if space is None:
            space = search_space(self.graph, vehicle, model, rule, settings, conditions)
        with self._lock:
            self._spaces[key] = space  # last used is last; the first is dropped
            while len(self._spaces) > SPACES_KEPT:
                self._spaces.pop(next(iter(self._spaces)))
        return space

    def _search(
        self, query: RouteQuery, weights: Weights, starts: tuple[LinkPosition, ...], goals: tuple[LinkPosition, ...]
    ) -> _Found:
        """The best path that keeps the charge limits, or the one of least energy."""
        space = self._space(query.vehicle, query.link_model, query.stop_rule, query.stop_settings, query.conditions)
        capacity_j = query.vehicle.usable_capacity_wh * JOULE_PER_WH
        limits = _limits(query.soc_frac, query.reserve_soc_frac, capacity_j)
        energy_only = weights.time == 0.0 and weights.distance == 0.0

        def find(w: Weights, held: Limits, *, pareto: bool = False) -> tuple[FoundPath | None, SearchCounts]:
            most = min(self._label_limit, self._pareto_limit) if pareto else self._label_limit
            return find_path(space, self._pool, w, held, starts, goals, pareto=pareto, label_limit=most)

        if energy_only:
            path, counts = find(weights, limits)
        else:
            # without limits costs add up, so that the search is simpler; most often its path keeps the limits anyway
            free, counts = find(weights, Limits())
            path = free
            if free is not None and not self._keeps(query, free, limits, weights.energy):
                path, counts = find(ECO, limits)
                if path is not None:
                    try:
                        best, counts = find(weights, limits, pareto=True)
                    except SearchLimitError:
                        return self._nearly_best(query, weights, limits, free, path, counts)
                    return _Found(path if best is None else best, counts, _method(counts, pareto=True))
        if path is not None:
            return _Found(path, counts, _method(counts, pareto=False))
        path, counts = find(ECO if not energy_only else weights, Limits())
        if path is None:
            raise NoPathError("no permitted way leads from start to goal")
        return _Found(path, counts, _method(counts, pareto=False))

    def _nearly_best(
        self,
        query: RouteQuery,
        weights: Weights,
        limits: Limits,
        free: FoundPath,
        least_energy: FoundPath,
        counts: SearchCounts,
    ) -> _Found:
        """The better of two paths that keep the limits, and by how much a better one can be cheaper at most.

        No path costs less than the best one without limits, since a battery at its limits only ever adds cost.
        """
        kept = [least_energy, *([free] if self._keeps(query, free, limits, 0.0) else [])]
        costs = [self._cost(query, path, weights) for path in kept]
        best = int(np.argmin(costs))
        return _Found(
            kept[best], counts, _method(counts, pareto=False) + "-bounded", max(costs[best] - free.cost, 0.0), free.cost
        )

    def _energies_j(
        self, query: RouteQuery, path: FoundPath, soc_start_frac: float | None
    ) -> tuple[NDArray[np.float64], float]:
        """Battery energy of each link of a path as the search saw it, float64 (n,) [J], and its time [s]."""
        result = self.simulate(
            self._spans(path),
            query.vehicle,
            conditions=query.conditions,
            link_model=query.link_model,
            stop_rule=StopRule.EXPECTED if query.stop_rule is StopRule.COUNTED else query.stop_rule,
            stop_settings=query.stop_settings,
            soc_start_frac=soc_start_frac,
        )
        return np.array([link.energy_j for link in result.links]), result.duration_s

    def _cost(self, query: RouteQuery, path: FoundPath, weights: Weights) -> float:
        """What a path costs with the battery's limits: recuperation that a full battery can't take is worth nothing."""
        energy_j, time_s = self._energies_j(query, path, query.soc_frac)
        soc, _ = soc_along(energy_j, query.soc_frac, query.vehicle.usable_capacity_wh)
        used_kwh = (query.soc_frac - float(soc[-1])) * query.vehicle.usable_capacity_wh / 1000.0
        rest = weights.time * time_s / SECOND_PER_HOUR + weights.distance * path.distance_m / METRE_PER_KM
        return weights.energy * used_kwh + rest

    def _keeps(self, query: RouteQuery, path: FoundPath, limits: Limits, energy_weight: float) -> bool:
        """Whether a path never takes the charge below the reserve and costs what the search without limits says.

        A battery that is overfilled on the way, or so full that it takes up less, loses energy, which changes the cost
        only where energy is weighted.
        """
        energy_j, _ = self._energies_j(query, path, query.soc_frac)
        capacity_wh = query.vehicle.usable_capacity_wh
        soc, braked = soc_along(energy_j, query.soc_frac, capacity_wh)
        most_j = (query.soc_frac - soc) * capacity_wh * JOULE_PER_WH
        if not bool(most_j.max() <= limits.most_energy_j):
            return False
        if energy_weight == 0.0:
            return True
        # a cap on recuperation that fades with charge only ever takes energy from other paths, as overfilling does
        fades = query.conditions.regen_limited and not np.array_equal(energy_j, self._energies_j(query, path, None)[0])
        return not (braked.any() or fades)

    def _spans(self, path: FoundPath) -> tuple[LinkSpan, ...]:
        last = len(path.links) - 1
        return tuple(
            LinkSpan(
                link,
                path.start.offset_m if k == 0 else 0.0,
                path.goal.offset_m if k == last else float(self.graph.length_m[link]),
            )
            for k, link in enumerate(path.links)
        )

    def _unpack(self, name: str, weights: Weights, query: RouteQuery, path: FoundPath) -> Route:
        graph = self.graph
        spans = self._spans(path)
        chain = self.chain(spans, query.stop_settings)
        result = simulate_chain(
            query.vehicle,
            chain,
            conditions=query.conditions,
            link_model=query.link_model,
            stop_rule=query.stop_rule,
            soc_start_frac=query.soc_frac,
        )
        capacity_wh = query.vehicle.usable_capacity_wh
        energy_j = np.array([link.energy_j for link in result.links])
        soc, braked = soc_along(energy_j, query.soc_frac, capacity_wh)
        links, lines = [], []
        for k, span in enumerate(spans):
            length_m = float(graph.length_m[span.link_idx])
            line = part_of_line(graph.geometry(span.link_idx), span.from_m / length_m, span.to_m / length_m)
            lines.append(line if k == 0 else line[1:])
            links.append(
                RouteLink(
                    link_idx=span.link_idx,
                    from_m=span.from_m,
                    to_m=span.to_m,
                    grade_frac=float(chain.grade_frac[k]),
                    speed_limit_mps=float(chain.speed_limit_mps[k]),
                    stop_probability_frac=result.links[k].stop_probability_frac,
                    road_name=graph.names[int(graph.name_idx[span.link_idx])],
                    result=result.links[k],
                    soc_end_frac=float(soc[k]),
                    braked_away_j=float(braked[k]),
                )
            )
        climb = chain.grade_frac * chain.length_m
        soc_min = float(min(soc.min(), query.soc_frac))
        # the figures decide, not the search: it rounds differently, and `counted` stops are not those it saw
        feasible = soc_min >= query.reserve_soc_frac - 1e-9
        route = Route(
            name=name,
            weights=weights,
            feasible=feasible,
            distance_m=result.distance_m,
            duration_s=result.duration_s,
            energy_j=result.energy_j,
            parts=result.parts,
            braked_away_j=float(braked.sum()),
            soc_start_frac=query.soc_frac,
            soc_end_frac=float(soc[-1]),
            soc_min_frac=soc_min,
            climb_m=float(climb[climb > 0.0].sum()),
            descent_m=float(-climb[climb < 0.0].sum()),
            geometry=np.concatenate(lines),
            links=tuple(links),
            hot_links=_hot_links(chain, result, [link.road_name for link in links]),
            uncertainty=self._distribution(query, chain) if query.uncertainty else None,
        )
        if feasible:
            return route
        missing = max(query.reserve_soc_frac - soc_min, 0.0)
        return replace(
            route,
            deficit_j=missing * capacity_wh * JOULE_PER_WH,
            furthest=self._furthest(route, query.reserve_soc_frac),
            remedy=Remedy(
                _start_charge_needed(energy_j / (capacity_wh * JOULE_PER_WH), query.reserve_soc_frac),
                missing * capacity_wh,
            ),
        )

    def _distribution(self, query: RouteQuery, chain: Chain) -> EnergyDistribution:
        return chain_distribution(
            query.vehicle,
            chain,
            soc_start_frac=query.soc_frac,
            reserve_soc_frac=query.reserve_soc_frac,
            conditions=query.conditions,
            link_model=query.link_model,
            stop_rule=query.stop_rule,
        )

    def _furthest(self, route: Route, reserve_frac: float) -> Point:
        """Where along a route the charge reaches the reserve, taking it as linear within a link."""
        before = route.soc_start_frac
        for link in route.links:
            if link.soc_end_frac < reserve_frac:
                share = (before - reserve_frac) / (before - link.soc_end_frac)
                at_m = link.from_m + share * (link.to_m - link.from_m)
                part = at_m / float(self.graph.length_m[link.link_idx])
                lon, lat = part_of_line(self.graph.geometry(link.link_idx), 0.0, max(part, 1e-9))[-1]
                return Point(float(lat), float(lon))
            before = link.soc_end_frac
        lon, lat = route.geometry[-1]
        return Point(float(lat), float(lon))

    def _warnings(self, query: RouteQuery | RangeQuery, crowded: bool) -> tuple[str, ...]:
        warnings = []
        meta = self.graph.meta
        if meta.terrain is Terrain.ABSENT:
            warnings.append(f"graph {meta.name!r} has no terrain: every road counts as flat, climbs are missing")
        elif meta.terrain is Terrain.SYNTHETIC:
            warnings.append(f"graph {meta.name!r} has synthetic terrain: it is no real place or not its real heights")
        if query.stop_rule is StopRule.COUNTED:
            warnings.append(
                "stops 'counted' depend on the way so far: the search used 'expected', the figures 'counted'"
            )
        if query.link_model is LinkModel.PRINTED:
            warnings.append("link model 'printed' does not conserve energy: label-correcting search")
        if query.vehicle.powertrain is Powertrain.ICE:
            warnings.append("combustion vehicle: energies are fuel energy, soc is the share of the tank")
        if crowded:
            warnings.append("very many short links: dominance was relaxed, a route some Wh better may exist")
        return tuple(warnings)


def _hot_links(chain: Chain, result: ChainResult, names: list[str]) -> tuple[HotStretch, ...]:
    """Where a route's energy goes; standing still counts to the link that it follows."""
    links = result.links
    return hot_stretches(
        RouteLinks(
            length_m=chain.length_m,
            energy_j=np.array([link.energy_j for link in links]),
            grade_frac=chain.grade_frac,
            speed_limit_mps=chain.speed_limit_mps,
            stop_probability_frac=np.array([link.stop_probability_frac for link in links]),
            duration_s=np.array([link.duration_s for link in links]),
            standstill_s=np.array([link.standstill_s for link in links]),
            parts_j=np.array([link.parts_j for link in links]),
            road_names=names,
        )
    )


def _vehicle_key(vehicle: AnyVehicle) -> tuple[object, ...]:
    """Everything of a vehicle that a search reads."""
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


def _limits(soc_frac: float, reserve_frac: float, capacity_j: float) -> Limits:
    return Limits(-(1.0 - soc_frac) * capacity_j, (soc_frac - reserve_frac) * capacity_j)


def _start_charge_needed(used_frac: NDArray[np.float64], reserve_frac: float) -> float:
    """Charge at departure that keeps the reserve on the way; above 1 where a full battery would not do.

    A battery that fills up on the way starts from 1 again there, whatever it had at departure.
    used_frac: float64 (n,) battery energy of each link over the capacity.
    """
    used = np.concatenate(([0.0], np.cumsum(used_frac)))
    longest_fall = float((used - np.minimum.accumulate(used)).max())
    needed = reserve_frac + float(used.max())
    return max(needed, reserve_frac + longest_fall) if reserve_frac + longest_fall > 1.0 else needed


def _method(counts: SearchCounts, *, pareto: bool) -> str:
    return ("label-correcting" if counts.label_correcting else "label-setting") + ("-pareto" if pareto else "")


def _check_charge(soc_frac: float, reserve_frac: float) -> None:
    if not 0.0 <= soc_frac <= 1.0:
        raise QueryError("soc", soc_frac, "0..1")
    if not 0.0 <= reserve_frac <= soc_frac:
        raise QueryError("reserve_soc", reserve_frac, f"0..{soc_frac:g} (soc)")


def _check_weights(name: str, weights: Weights) -> None:
    values = (weights.energy, weights.time, weights.distance)
    for field, value in zip(("energy", "time", "distance"), values, strict=True):
        if not 0.0 <= value <= 1e6:
            raise QueryError(f"weights.{field} ({name})", value, "0..1e6")
    if max(values) == 0.0:
        raise QueryError(f"weights ({name})", values, "at least one above 0")


def _no_route(name: str, weights: Weights, query: RouteQuery, start: SnappedPoint) -> Route:
    """The route from a place to itself."""
    here = np.array([[start.on_road.lon_deg, start.on_road.lat_deg]] * 2)
    soc = query.soc_frac
    return Route(name, weights, True, 0.0, 0.0, 0.0, EnergyParts(), 0.0, soc, soc, soc, 0.0, 0.0, here, ())
