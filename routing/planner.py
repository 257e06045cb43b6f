"""Route and range queries answered on one graph: snap, search, unpack."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

import numpy as np

from energy.chain.chain import LinkModel, StopRule, simulate_chain
from energy.chain.uncertainty import FACTOR_RANGE, SEED, dissipation_sd_frac, pessimistic
from energy.conditions import STILL, Conditions
from energy.stops import StopSettings
from energy.units import JOULE_PER_KWH, JOULE_PER_WH
from energy.vehicle.vehicle import Powertrain
from routing.errors import QueryError
from routing.graph.practice import practice_graph
from routing.graph.road_graph import Terrain
from routing.graph.snap import RoadIndex
from routing.links.spans import ChainMaker
from routing.pareto.all_ways import warm_up_labels
from routing.pareto.front import ParetoSearch, names_of
from routing.places import LinkPosition, LinkSpan, Point
from routing.queries import RANGE_PROBABILITIES, Trip
from routing.range.area import AreaMaker, energies_of_reach
from routing.range.bands import RangeAnswer, RangeBand
from routing.range.way_back import BackCharges, ReverseSearch
from routing.route.answer import no_route, route_of
from routing.route.best_path import RouteSearch, method_name
from routing.route.checks import check_charge, check_pareto, check_weights
from routing.route.limits import charge_limits
from routing.route.matrix import MatrixSearch
from routing.route.route import RouteAnswer, SearchStats
from routing.route.via import WayFinder
from routing.search.found import Limits, SearchCounts
from routing.search.search import find_path, reach
from routing.search.space import LOAD_NOISE_N
from routing.weights import ECO

if TYPE_CHECKING:
    from collections.abc import Sequence

    from energy.chain.chain import Chain, ChainResult
    from energy.vehicle.files import AnyVehicle
    from routing.graph.road_graph import RoadGraph
    from routing.places import SnappedPoint
    from routing.queries import MatrixQuery, ParetoSettings, RangeQuery, RouteQuery
    from routing.range.area import RoadEnergies
    from routing.route.matrix import SnappedPlace
    from routing.route.via import Way

SAMPLE_LINKS: Final = 300  # on which the spread of what driving dissipates is taken
LEAST_FACTOR: Final = FACTOR_RANGE[0]


class Planner:
    """Answers queries on one frozen graph; safe to share between threads."""

    def __init__(self, graph: RoadGraph, *, snap_limit_m: float = 1000.0, label_limit: int | None = None) -> None:
        self.graph = graph
        self._snap_limit_m = snap_limit_m
        self._roads = RoadIndex(graph)
        self._areas = AreaMaker(graph, self._roads)
        self._chains = ChainMaker(graph)
        self._search = RouteSearch(graph, self._chains, label_limit)
        self._reverse = ReverseSearch(graph, self._search.label_limit)

    def warm_up(self, vehicle: AnyVehicle) -> None:
        """Compile the kernels on a few links, and make what the first query of a vehicle needs of this graph."""
        Planner(practice_graph())._ask_once(vehicle)  # compiled code is for any graph's arrays
        self._search.space(vehicle, LinkModel.INTEGRATED, StopRule.EXPECTED, StopSettings()).lower_bound.costs()
        west, south, east, north = self.graph.meta.bbox
        self._roads.snap("warm-up", Point((south + north) / 2.0, (west + east) / 2.0), math.inf)

    def _ask_once(self, vehicle: AnyVehicle) -> None:
        """Run every kernel."""
        west, south, east, north = self.graph.meta.bbox
        middle = LinkPosition(0, 0.5 * float(self.graph.length_m[0]))
        space = self._search.space(vehicle, LinkModel.INTEGRATED, StopRule.EXPECTED, StopSettings())
        find_path(space, self._search.pool, ECO, Limits(), [middle], [middle], label_limit=1000)
        reached = reach(space, self._search.pool, Limits(0.0, 0.0), [middle], self.graph.head, self.graph.node_count)
        home = Point(float(self.graph.node_lat_deg[0]), float(self.graph.node_lon_deg[0]))
        self._areas.areas([(energies_of_reach(self.graph, reached), 0.0)], home)
        self._reverse.warm_up(space, middle)
        warm_up_labels(space, middle)
        self.simulate((LinkSpan(0, 0.0, float(self.graph.length_m[0])),), vehicle)
        self._roads.snap("warm-up", Point((south + north) / 2.0, (west + east) / 2.0), math.inf)

    def route(self, query: RouteQuery) -> RouteAnswer:
        """One route for each weighting of the query, from rest at the start over its via points to rest at the goal.

        Or the routes of the Pareto set that it asks for. Raises QueryError, PointOutsideMapError,
        PointFarFromRoadError, NoPathError, NegativeCycleError, SearchLimitError. A goal out of reach on this charge is
        an answer, with `feasible` false.
        """
        check_charge(query.soc_frac, query.reserve_soc_frac)
        if not query.weightings:
            raise QueryError("weightings", "empty", "at least one weighting")
        for name, weights in query.weightings:
            check_weights(name, weights)
        if query.pareto is not None:
            check_pareto(query.pareto)
        asked = [("start", query.start), *((f"via[{k}]", place) for k, place in enumerate(query.via))]
        snapped = [self._roads.snap(*place, self._snap_limit_m) for place in (*asked, ("goal", query.goal))]
        points, places = [point for point, _ in snapped], [positions for _, positions in snapped]
        if query.pareto is not None:
            return self._pareto(query, query.pareto, points, places)
        routes, stats, unproven = [], [], []
        finder = WayFinder(self._search, query, places)
        crowded, unpaid_j = False, 0.0
        for name, weights in query.weightings:
            way = finder.best(weights)
            crowded |= any(found.counts.crowded > 0 for found in way.found)
            unpaid_j = max(unpaid_j, *(found.counts.unpaid_j for found in way.found), 0.0)
            if way.spans:
                routes.append(route_of(self._chains, name, weights, query, way.spans, way.first))
            else:
                routes.append(no_route(self.graph, name, weights, query, points[0]))
            stats.append(_search_stats(way))
            unproven += [f"route {name!r} {note}" for note in way.notes]
        warnings = self._warnings(query, crowded, unpaid_j) + tuple(unproven)
        for route in routes:
            if not route.feasible and route.weights != ECO and query.stop_rule is not StopRule.COUNTED:
                warnings += (f"no route reaches the goal on this charge: {route.name!r} shows the least-energy way",)
        return RouteAnswer(tuple(routes), points[0], points[-1], tuple(stats), warnings, tuple(points[1:-1]))

    def matrix(self, query: MatrixQuery) -> MatrixSearch:
        """The drives from all sources to all targets of a query, ready to be searched row by row.

        Raises QueryError, PointOutsideMapError, PointFarFromRoadError; errors of a place name it as `sources[3]`.
        """
        check_charge(query.soc_frac, query.reserve_soc_frac)
        check_weights("matrix", query.weights)
        sources, targets = self._snap_all("sources", query.sources), self._snap_all("targets", query.targets)
        return MatrixSearch(self._search, query, sources, targets, self._warnings)

    def _snap_all(self, field: str, places: tuple[Point, ...]) -> list[SnappedPlace]:
        if not places:
            raise QueryError(field, "empty", "at least one place")
        return [self._roads.snap(f"{field}[{k}]", place, self._snap_limit_m) for k, place in enumerate(places)]

    def _pareto(
        self,
        query: RouteQuery,
        settings: ParetoSettings,
        points: list[SnappedPoint],
        places: list[tuple[LinkPosition, ...]],
    ) -> RouteAnswer:
        """The routes of a Pareto set, by time."""
        front = ParetoSearch(self._search, query, settings, places).front()
        routes = tuple(
            route_of(self._chains, name, way.weights, query, way.spans, way.first)
            if way.spans
            else no_route(self.graph, name, way.weights, query, points[0])
            for name, way in zip(names_of(front.ways), front.ways, strict=True)
        )
        warnings = self._warnings(query, front.crowded, front.unpaid_j)
        if front.claim.unproven is not None:
            warnings += (f"nothing is proven of this Pareto set: {front.claim.unproven}",)
        elif front.claim.epsilon_frac is not None and front.claim.epsilon_frac > settings.epsilon_frac:
            warnings += (
                f"the Pareto set is proven within {front.claim.epsilon_frac:.3g} only, not {settings.epsilon_frac:g}: "
                f"{len(routes)} of {front.claim.found} routes found are answered",
            )
        return RouteAnswer(routes, points[0], points[-1], front.stats, warnings, tuple(points[1:-1]), front.claim)

    def range(self, query: RangeQuery) -> RangeAnswer:
        """The area that can be reached before the charge falls below the reserve, with its inner bands.

        With the trip REVERSE the area from which the origin can be reached, with ROUND what can be driven to and back.
        Raises QueryError, PointOutsideMapError, PointFarFromRoadError, NegativeCycleError, SearchLimitError.
        """
        check_charge(query.soc_frac, query.reserve_soc_frac)
        if query.trip is not Trip.OUT and query.link_model is LinkModel.PRINTED:
            raise QueryError("link_model", "'printed'", f"'integrated' with {query.trip.value}")
        least_n = self._search.space_of(query, query.vehicle).least_load_n
        if query.trip is not Trip.OUT and least_n < -LOAD_NOISE_N:
            raise QueryError("conditions", f"a road load of {least_n:.1f} N", f"at least 0 N with {query.trip.value}")
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
        levels = sorted({query.reserve_soc_frac, *query.bands_soc_frac})
        searched = {
            probability: self._energies(query, levels, vehicle, starts) for probability, vehicle in vehicles.items()
        }
        wanted = [(left, probability) for left in levels for probability in searched]
        cases = [(searched[probability][0], (query.soc_frac - left) * capacity_j) for left, probability in wanted]
        areas = self._areas.areas(cases, origin.on_road)
        bands = tuple(
            RangeBand(
                left, a.area, a.area_m2, a.tolerance_m, a.node_count, a.false_in_frac, a.false_out_frac, probability
            )
            for (left, probability), a in zip(wanted, areas, strict=True)
        )
        counts = max((made for _, made in searched.values()), key=lambda made: made.labels_made)
        method = method_name(counts, pareto=False) + ("" if query.trip is Trip.OUT else f"-{query.trip.value}")
        stats = SearchStats(counts.labels_made, counts.labels_settled, counts.seconds, method)
        unpaid_j = max(made.unpaid_j for _, made in searched.values())
        warnings = self._warnings(query, counts.crowded > 0, unpaid_j) + self._cold_starts(query)
        return RangeAnswer(origin, bands, stats, warnings)

    def _energies(
        self, query: RangeQuery, levels: Sequence[float], vehicle: AnyVehicle, places: tuple[LinkPosition, ...]
    ) -> tuple[RoadEnergies, SearchCounts]:
        """What the trip takes from one vehicle at every place, down to the reserve; levels: charges left, ascending."""
        graph, space = self.graph, self._search.space_of(query, vehicle)
        capacity_j = vehicle.usable_capacity_wh * JOULE_PER_WH
        charges = BackCharges(
            soc_j=query.soc_frac * capacity_j,
            reserve_j=query.reserve_soc_frac * capacity_j,
            full_j=capacity_j,
            left_j=tuple(left * capacity_j for left in levels),
        )
        if query.trip is Trip.REVERSE:
            return self._reverse.way_back(space, places).reverse(charges)
        limits = charge_limits(query.soc_frac, query.reserve_soc_frac, capacity_j)
        most = self._search.label_limit
        reached = reach(space, self._search.pool, limits, places, graph.head, graph.node_count, label_limit=most)
        if query.trip is Trip.OUT:
            return energies_of_reach(graph, reached), reached.counts
        energies, back = self._reverse.way_back(space, places).round_trip(charges, reached)
        out = reached.counts
        made, settled = out.labels_made + back.labels_made, out.labels_settled + back.labels_settled
        return energies, SearchCounts(made, settled, out.seconds + back.seconds, False, 0, out.crowded, out.unpaid_j)

    def _cold_starts(self, query: RangeQuery) -> tuple[str, ...]:
        """What is to be said of ways back that begin cold."""
        physics = self._search.space_of(query, query.vehicle).physics
        if query.trip is Trip.OUT or (physics.cabin_start_w == 0.0 and physics.tyre_time_s == 0.0):
            return ()
        where = "at each place" if query.trip is Trip.REVERSE else "at the origin and again at each place"
        return (f"cabin and tyres count as at a departure {where}",)

    def _dissipation_sd_frac(self, query: RangeQuery) -> float:
        """Relative standard deviation of what driving dissipates, on a sample of the graph's links."""
        graph = self.graph
        rng = np.random.default_rng(SEED)
        idx = rng.choice(graph.link_count, SAMPLE_LINKS, p=graph.length_m / graph.length_m.sum())
        chain = self._chains.of_links(idx, graph.length_m[idx], query.stop_settings)
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
        """The chain of links that stretches of links make; raises LinkError as simulate does."""
        return self._chains.chain(spans, settings)

    def _warnings(self, query: RouteQuery | RangeQuery, crowded: bool, unpaid_j: float) -> tuple[str, ...]:
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
        elif not (space := self._search.space_of(query, query.vehicle)).conserving:
            load = f"{space.least_load_n:.1f} N"
            warnings.append(f"the road load falls to {load} under these conditions: label-correcting search")
        if query.vehicle.powertrain is Powertrain.ICE:
            warnings.append("combustion vehicle: energies are fuel energy, soc is the share of the tank")
        if crowded:
            warnings.append("very many short links: dominance was relaxed, a route some Wh better may exist")
        if unpaid_j > 0.0:
            warnings.append(
                "the battery fills up while cabin or tyres warm up: a better way, or one that just keeps the reserve, "
                f"could take at most {unpaid_j / JOULE_PER_KWH:.2g} kWh less"
            )
        return tuple(warnings)


def _search_stats(way: Way) -> SearchStats:
    """The work of all searches of a route."""
    counts = [found.counts for found in way.found]
    return SearchStats(
        labels_made=sum(one.labels_made for one in counts),
        labels_settled=sum(one.labels_settled for one in counts),
        seconds=sum(one.seconds for one in counts),
        method=", ".join(dict.fromkeys(found.method for found in way.found)) or "none",
    )
