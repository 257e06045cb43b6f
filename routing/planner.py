"""Route and range queries answered on one graph: snap, search, unpack."""

from __future__ import annotations

import math
from dataclasses import replace
from types import MappingProxyType
from typing import TYPE_CHECKING, Final

from energy.chain.chain import LinkModel, StopRule, simulate_chain
from energy.conditions import STILL, Conditions
from energy.stops import StopSettings
from routing.charging.planner import ChargingPlanner
from routing.charging.route import route_of_plan
from routing.errors import PointFarFromRoadError, PointOutsideMapError, QueryError, TimeUpError
from routing.graph.earth import great_circle_m
from routing.graph.practice import practice_graph
from routing.graph.rim import RimFinder
from routing.graph.snap import NEAR_M, RoadIndex, moved_warnings, place_on_road
from routing.links.spans import ChainMaker
from routing.numerals import text_above
from routing.pareto.all_ways import warm_up_labels
from routing.pareto.front import ParetoSearch, names_of
from routing.places import LinkPosition, LinkSpan, Point
from routing.range.antimeridian import half_turned
from routing.range.area import AreaMaker
from routing.range.bands import RangeAnswer
from routing.range.range_search import RangeSearch
from routing.route.answer import no_route, route_of
from routing.route.best_path import RouteSearch
from routing.route.beyond_map import beyond_map_warnings
from routing.route.checks import check_charge, check_pareto, check_weights
from routing.route.matrix import MatrixSearch
from routing.route.route import RouteAnswer, SearchStats
from routing.route.via import WayFinder
from routing.route.warnings import ferry_note, ferry_warnings
from routing.search.found import Limits, PathOptions
from routing.search.search import find_path
from routing.time_budget import time_budget
from routing.weights import ECO

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from energy.chain.chain import Chain, ChainResult
    from energy.charging.charging import Charging
    from energy.vehicle.files import AnyVehicle
    from routing.cache_budget import CacheBudget
    from routing.charging.plan import ChargingAnswer, ChargingQuery
    from routing.graph.road_graph import RoadGraph
    from routing.places import SnappedPoint
    from routing.queries import MatrixQuery, ParetoSettings, RangeQuery, RouteQuery
    from routing.route.matrix import SnappedPlace
    from routing.route.route import Route
    from routing.route.via import Way
    from routing.stations.station import Station

NO_STATIONS: Final[Mapping[int, Station]] = MappingProxyType({})


class Planner:
    """Answers queries on one frozen graph; safe to share between threads.

    budget: of the memory that caches may take, shared with other planners; without it one of its own.
    """

    def __init__(
        self,
        graph: RoadGraph,
        *,
        snap_limit_m: float = 1000.0,
        label_limit: int | None = None,
        budget: CacheBudget | None = None,
    ) -> None:
        self.graph = graph
        self._snap_limit_m = snap_limit_m
        self._roads = RoadIndex(graph)
        self._chains = ChainMaker(graph)
        self._search = RouteSearch(graph, self._chains, label_limit, budget)
        self._charging = ChargingPlanner(self._search, self._chains)
        drawn = half_turned(graph)
        self._rim = RimFinder(drawn)
        areas = AreaMaker(drawn, self._roads if drawn is graph else RoadIndex(drawn))
        self._ranges = RangeSearch(graph, self._search, self._chains, areas, self._rim, drawn)

    def forget(self) -> None:
        """Give up what is kept between queries; what is under way goes on."""
        self._search.forget()
        self._charging.forget()

    def warm_up(self, vehicle: AnyVehicle) -> None:
        """Compile the kernels on a few links, and make what the first query of a vehicle needs of this graph."""
        Planner(practice_graph())._ask_once(vehicle)  # compiled code is for any graph's arrays
        self._search.space(vehicle, LinkModel.INTEGRATED, StopRule.EXPECTED, StopSettings()).lower_bound.costs()
        west, south, east, north = self.graph.meta.bbox
        self._roads.snap("warm-up", Point((south + north) / 2.0, (west + east) / 2.0), math.inf)
        self._rim.rim()

    def _ask_once(self, vehicle: AnyVehicle) -> None:
        """Run every kernel."""
        west, south, east, north = self.graph.meta.bbox
        middle = LinkPosition(0, 0.5 * float(self.graph.length_m[0]))
        space = self._search.space(vehicle, LinkModel.INTEGRATED, StopRule.EXPECTED, StopSettings())
        find_path(space, self._search.pool, ECO, Limits(), [middle], [middle], PathOptions(label_limit=1000))
        self._ranges.warm_up(space, middle)
        warm_up_labels(space, middle)
        self.simulate((LinkSpan(0, 0.0, float(self.graph.length_m[0])),), vehicle)
        self._roads.snap("warm-up", Point((south + north) / 2.0, (west + east) / 2.0), math.inf)

    def snap(self, field: str, place: Point) -> SnappedPoint:
        """Where a place meets the roads; raises PointOutsideMapError, PointFarFromRoadError as queries do."""
        return self._roads.snap(field, place, self._snap_limit_m)[0]

    def near(self, field: str, place: Point, count: int) -> list[SnappedPoint]:
        """The places on the roads nearest to one, the nearest first, at most count; raises as snap does."""
        return self._roads.near(field, place, self._snap_limit_m, count)

    def holds(self, places: Sequence[Point]) -> bool:
        """Whether each of the places is as near to a road as queries need."""
        try:
            for place in places:
                self.snap("place", place)
        except (PointOutsideMapError, PointFarFromRoadError):
            return False
        return True

    def route(self, query: RouteQuery) -> RouteAnswer:
        """One route for each weighting of the query, from rest at the start over its via points to rest at the goal.

        Or the routes of the Pareto set that it asks for. Raises QueryError, PointOutsideMapError,
        PointFarFromRoadError, NoPathError, NegativeCycleError, SearchLimitError, TimeUpError, AbandonedError. A goal
        out of reach on this charge is an answer, with `feasible` false. Where time is up after the first route, the
        answer has those found, and a warning.
        """
        check_charge(query.soc_frac, query.reserve_soc_frac)
        if not query.weightings:
            raise QueryError("weightings", "empty", "at least one weighting")
        for name, weights in query.weightings:
            check_weights(name, weights)
        if query.pareto is not None:
            check_pareto(query.pareto)
        points, places = self._snapped(query)
        if query.pareto is not None:
            return self._pareto(query, query.pareto, points, places)
        return self._weighted(query, points, places, _moved(points))

    def _weighted(
        self,
        query: RouteQuery,
        points: Sequence[SnappedPoint],
        places: Sequence[tuple[LinkPosition, ...]],
        moved: tuple[str, ...],
    ) -> RouteAnswer:
        """One route for each weighting of a query; moved: what is to be said of its places."""
        routes: list[Route] = []
        stats: list[SearchStats] = []
        unproven: list[str] = []
        finder = WayFinder(self._search, query, places)
        crowded, unpaid_j = False, 0.0
        for name, weights in query.weightings:
            try:
                if routes:
                    time_budget().check()
                way = finder.best(weights)
            except TimeUpError as error:
                if not routes:
                    raise
                rest = ", ".join(repr(missing) for missing, _ in query.weightings[len(routes) :])
                unproven.append(f"routes {rest} are not answered: {error.limit_s:g} s were not enough")
                break
            crowded |= any(found.counts.crowded > 0 for found in way.found)
            unpaid_j = max(unpaid_j, *(found.counts.unpaid_j for found in way.found), 0.0)
            if way.spans:
                routes.append(route_of(self._chains, name, weights, query, way.spans, way.first))
            else:
                routes.append(no_route(self.graph, name, weights, query, points[0]))
            stats.append(_search_stats(way))
            unproven += [f"route {name!r} {note}" for note in way.notes]
        warnings = self._search.warnings(query, crowded, unpaid_j) + tuple(unproven)
        for route in routes:
            if not route.feasible and route.weights != ECO and query.stop_rule is not StopRule.COUNTED:
                warnings += (f"no route reaches the goal on this charge: {route.name!r} shows the least-energy way",)
        warnings += self._beyond_map(points, routes) + ferry_warnings(self.graph, routes) + moved
        return RouteAnswer(tuple(routes), points[0], points[-1], tuple(stats), warnings, tuple(points[1:-1]))

    def journey(
        self, query: RouteQuery, charging: ChargingQuery, vehicle_charging: Charging, stations: Sequence[Station]
    ) -> tuple[RouteAnswer, ChargingAnswer]:
        """A journey with charging stops where it needs them: a route for each plan, and the plans.

        Where there is no plan, the routes are those without charging. vehicle_charging: of the query's vehicle, with
        what a request changes of it. stations: of this graph, placed on its roads. The query asks for no Pareto set.
        Raises as route does.
        """
        check_charge(query.soc_frac, query.reserve_soc_frac)
        known = {station.id: station for station in stations if station.position}
        chosen = {via: known[name] for via, name in charging.via_stations if name in known}
        points, places = self._snapped(query, chosen)
        charged = self._charging.plan(query, charging, vehicle_charging, stations, places)
        moved = _moved(points, chosen)
        if not charged.plans:
            answer = self._weighted(query, points, places, moved)
            return replace(answer, warnings=charged.warnings + answer.warnings), charged
        routes = tuple(route_of_plan(self._chains, query, plan, points[0], places[1:-1]) for plan in charged.plans)
        warnings = charged.warnings + self._search.warnings(query, False, 0.0)
        if (
            any(plan.stops for plan in charged.plans)
            and self._search.space_of(query, query.vehicle).physics.fade_width_j > 0.0
        ):
            warnings += ("with charging stops a nearly full battery counts as taking all that is recuperated",)
        warnings += self._beyond_map(points, routes) + ferry_warnings(self.graph, routes) + moved
        return RouteAnswer(routes, points[0], points[-1], (), warnings, tuple(points[1:-1])), charged

    def _snapped(
        self, query: RouteQuery, chosen: Mapping[int, Station] = NO_STATIONS
    ) -> tuple[list[SnappedPoint], list[tuple[LinkPosition, ...]]]:
        """Start, via points and goal of a query on the roads, and their positions on both directions.

        chosen: stations that stand for via points, by their position in the query.
        """
        snapped = [self._roads.snap("start", query.start, self._snap_limit_m)]
        for k, place in enumerate(query.via):
            if k in chosen:
                position = chosen[k].position
                snapped.append((place_on_road(self.graph, place, position[0]), position))
            else:
                snapped.append(self._roads.snap(f"via[{k}]", place, self._snap_limit_m))
        snapped.append(self._roads.snap("goal", query.goal, self._snap_limit_m))
        return [point for point, _ in snapped], [positions for _, positions in snapped]

    def _beyond_map(self, points: Sequence[SnappedPoint], routes: Sequence[Route]) -> tuple[str, ...]:
        places = [point.on_road for point in points]
        return beyond_map_warnings(self.graph, self._rim.rim(), places, routes)

    def matrix(self, query: MatrixQuery) -> MatrixSearch:
        """The drives from all sources to all targets of a query, ready to be searched row by row.

        Raises QueryError, PointOutsideMapError, PointFarFromRoadError; errors of a place name it as `sources[3]`.
        """
        check_charge(query.soc_frac, query.reserve_soc_frac)
        check_weights("matrix", query.weights)
        sources, targets = self._snap_all("sources", query.sources), self._snap_all("targets", query.targets)
        note = ferry_note(self.graph)
        moved = _moved_all("sources", sources)
        if query.targets != query.sources:
            moved += _moved_all("targets", targets)
        return MatrixSearch(
            self._search, query, sources, targets, lambda *found: self._search.warnings(*found) + note, moved
        )

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
        warnings = self._search.warnings(query, front.crowded, front.unpaid_j)
        if front.claim.unproven is not None:
            warnings += (f"nothing is proven of this Pareto set: {front.claim.unproven}",)
        elif front.claim.epsilon_frac is not None and front.claim.epsilon_frac > settings.epsilon_frac:
            warnings += (
                f"the Pareto set is proven within {text_above(front.claim.epsilon_frac, settings.epsilon_frac, 3)} "
                f"only, not {settings.epsilon_frac:g}: "
                f"{len(routes)} of {front.claim.found} routes found are answered",
            )
        warnings += self._beyond_map(points, routes) + ferry_warnings(self.graph, routes) + _moved(points)
        return RouteAnswer(routes, points[0], points[-1], front.stats, warnings, tuple(points[1:-1]), front.claim)

    def range(self, query: RangeQuery) -> RangeAnswer:
        """The area that can be reached before the charge falls below the reserve, with its inner bands.

        With the trip REVERSE the area from which the origin can be reached, with ROUND what can be driven to and back.
        Raises QueryError, PointOutsideMapError, PointFarFromRoadError, NegativeCycleError, SearchLimitError.
        """
        self._ranges.check(query)
        origin, starts = self._roads.snap("origin", query.origin, self._snap_limit_m)
        answer = self._ranges.answer(query, origin, starts)
        notes = ferry_note(self.graph) + moved_warnings(("origin",), (origin,))
        return replace(answer, warnings=answer.warnings + notes)

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
            self.chain(spans, stop_settings, conditions),
            conditions=conditions,
            link_model=link_model,
            stop_rule=stop_rule,
            arrive_stopped=arrive_stopped,
            soc_start_frac=soc_start_frac,
        )

    def chain(
        self, spans: tuple[LinkSpan, ...], settings: StopSettings | None = None, conditions: Conditions = STILL
    ) -> Chain:
        """The chain of links that stretches of links make; raises LinkError as simulate does."""
        return self._chains.chain(spans, settings, conditions)


def _moved(points: Sequence[SnappedPoint], chosen: Mapping[int, Station] = NO_STATIONS) -> tuple[str, ...]:
    """Warnings of the places of a route: start, via points, goal; chosen: stations that stand for via points."""
    names = ("start", *(f"via[{k}]" for k in range(len(points) - 2)), "goal")
    roads = [k for k in range(len(points)) if k - 1 not in chosen]
    warnings = moved_warnings([names[k] for k in roads], [points[k] for k in roads])
    for k, station in sorted(chosen.items()):
        if k + 1 < len(points) - 1:
            asked, there = points[k + 1].asked, station.at
            away_m = great_circle_m(asked.lat_deg, asked.lon_deg, there.lat_deg, there.lon_deg)
            if away_m > NEAR_M:
                name = station.name or repr(station.id)
                warnings += (f"via[{k}] is {away_m:.0f} m from station {name}, whose place is taken for it",)
    return warnings


def _moved_all(field: str, places: Sequence[SnappedPlace]) -> tuple[str, ...]:
    """Warnings of one list of places of a matrix."""
    return moved_warnings([f"{field}[{k}]" for k in range(len(places))], [point for point, _ in places])


def _search_stats(way: Way) -> SearchStats:
    """The work of all searches of a route."""
    counts = [found.counts for found in way.found]
    return SearchStats(
        labels_made=sum(count.labels_made for count in counts),
        labels_settled=sum(count.labels_settled for count in counts),
        seconds=sum(count.seconds for count in counts),
        method=", ".join(dict.fromkeys(found.method for found in way.found)) or "none",
    )
