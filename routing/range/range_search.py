"""Range queries: what the trip takes to every place, and the areas that each charge suffices for."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Final

import numpy as np

from energy.chain.chain import LinkModel
from energy.chain.sampling import SEED
from energy.chain.uncertainty import dissipation_sd_frac
from energy.units import JOULE_PER_KWH, JOULE_PER_WH
from energy.vehicle.pessimistic import FACTOR_RANGE, pessimistic
from routing.errors import QueryError
from routing.links.spans import ChainMaker
from routing.numerals import text_above, text_below
from routing.places import LinkPosition, Point
from routing.queries import LIMIT_UNITS, RANGE_PROBABILITIES, By, Outline, Trip, drive_settings
from routing.range.antimeridian import half_turned_point, turned_back, turned_back_lines
from routing.range.area import AreaMaker, RoadEnergies, energies_of_reach
from routing.range.bands import RangeAnswer, RangeBand
from routing.range.filled import filled_areas, filling_of, nodes_ashore
from routing.range.map_edge import map_edge
from routing.range.reach import RoadDistances, bearing_reach_m
from routing.range.rings import rings_of
from routing.range.simplified import SIMPLER_CELLS, simplified_areas, without_straight_points
from routing.range.way_back import BackCharges, ReverseSearch
from routing.route.best_path import RouteSearch, method_name
from routing.route.checks import check_charge
from routing.route.limits import charge_limits
from routing.route.route import SearchStats
from routing.search.found import Limits, Measure, SearchCounts
from routing.search.search import reach, reach_by
from routing.search.space import LOAD_NOISE_N

if TYPE_CHECKING:
    from collections.abc import Sequence

    from energy.vehicle.files import AnyVehicle
    from routing.graph.rim import RimFinder
    from routing.graph.road_graph import RoadGraph
    from routing.links.spans import ChainMaker
    from routing.places import SnappedPoint
    from routing.queries import RangeQuery
    from routing.range.area import AreaMaker
    from routing.route.best_path import RouteSearch
    from routing.search.space import SearchSpace

SAMPLE_LINKS: Final = 300  # on which the spread of what driving dissipates is taken
LEAST_FACTOR: Final = FACTOR_RANGE[0]
ROUNDING_FRAC: Final = 1e-9  # of all that the battery may give, by which a limit of energy may be above it


@dataclass(frozen=True, slots=True)
class _Case:
    """A band before it is drawn: what places take, and what they may take; the rest as in RangeBand."""

    energies: RoadEnergies
    budget: float
    left_frac: float | None
    limit: float | None
    probability_frac: float | None


@dataclass(frozen=True, slots=True)
class _Found:
    """Bands before they are drawn, the outermost level first; cases_a_level: how many each has, by probability."""

    bands: list[_Case]
    cases_a_level: int
    counts: list[SearchCounts]
    warnings: tuple[str, ...]


class RangeSearch:
    """Answers range queries on one graph; safe to share between threads.

    drawn: the graph itself, or half a turn around (antimeridian.half_turned); areas and rim are made on it.
    """

    def __init__(
        self,
        graph: RoadGraph,
        search: RouteSearch,
        chains: ChainMaker,
        areas: AreaMaker,
        rim: RimFinder,
        drawn: RoadGraph,
    ) -> None:
        self.graph, self._drawn = graph, drawn
        self._search, self._chains, self._areas, self._rim = search, chains, areas, rim
        self._distances = RoadDistances(graph)
        self._reverse = ReverseSearch(graph, search.label_limit, search.budget)

    def warm_up(self, space: SearchSpace, place: LinkPosition) -> None:
        """Run every kernel of ranges once."""
        graph = self.graph
        reached = reach(space, self._search.pool, Limits(0.0, 0.0), [place], graph.head, graph.node_count)
        home = Point(float(graph.node_lat_deg[0]), float(self._drawn.node_lon_deg[0]))
        energies = energies_of_reach(graph, reached)
        (drawn,) = self._areas.areas([(energies, 0.0)], home)
        self._reverse.warm_up(space, place)
        for measure in Measure:
            reach_by(space, self._search.pool, measure, 1.0, [place], graph.head, graph.node_count)
        node_m = self._distances.of_nodes([place], np.zeros(graph.node_count, np.bool_), homeward=False)
        self._distances.reach(node_m, energies, 0.0, [place], homeward=False)
        bearing_reach_m(drawn.rings, home)
        drawn.rings.coordinates_json()
        simplified_areas(
            self._drawn, home, [(energies, 0.0)], [drawn], drawn.cell_m, np.ones(graph.node_count, np.bool_)
        )

    def check(self, query: RangeQuery) -> None:
        """Raise QueryError where a query asks for what can't be, or can't be searched."""
        check_charge(query.soc_frac, query.reserve_soc_frac)
        if query.tolerance_m is not None and not 0.0 <= query.tolerance_m < math.inf:
            raise QueryError("tolerance_m", query.tolerance_m, "at least 0")
        if query.trip is not Trip.OUT and query.link_model is LinkModel.PRINTED:
            raise QueryError("link_model", "'printed'", f"'integrated' with {query.trip.value}")
        least_n = self._search.space_of(query, query.vehicle).least_load_n
        if query.trip is not Trip.OUT and least_n < -LOAD_NOISE_N:
            raise QueryError(
                "conditions", f"a road load of {text_below(least_n, 0.0, 1)} N", f"at least 0 N with {query.trip.value}"
            )
        if query.by is not By.CHARGE:
            self._check_limits(query)
        elif query.limits:
            raise QueryError("limits", list(query.limits), "left out with by charge, which takes bands")
        for band in query.bands_soc_frac:
            if not query.reserve_soc_frac <= band <= query.soc_frac:
                allowed = f"{query.reserve_soc_frac} (reserve_soc_frac)..{query.soc_frac} (soc_frac)"
                raise QueryError("bands_soc_frac", band, allowed)

    def _check_limits(self, query: RangeQuery) -> None:
        """Raise QueryError where bands by energy, time or distance can't be drawn."""
        if not query.limits:
            raise QueryError("limits", "empty", f"at least one limit with bands by {query.by.value}")
        if query.bands_soc_frac:
            allowed = f"left out with by {query.by.value}, which takes limits"
            raise QueryError("bands_soc_frac", list(query.bands_soc_frac), allowed)
        most_j = (query.soc_frac - query.reserve_soc_frac) * query.vehicle.usable_capacity_wh * JOULE_PER_WH
        unit = LIMIT_UNITS[query.by]
        for limit in query.limits:
            if not 0.0 < limit < math.inf:
                raise QueryError("limits", limit / unit, "above 0")
            if query.by is By.ENERGY and limit > most_j * (1.0 + ROUNDING_FRAC):
                allowed = f"at most the {most_j / unit:.9g} kWh between soc and reserve_soc"  # as exact as the limit
                raise QueryError("limits", limit / unit, allowed)
        if query.by is not By.ENERGY:
            if query.trip is not Trip.OUT:
                raise QueryError("by", f"'{query.by.value}'", f"'charge' or 'energy' with {query.trip.value}")
            if query.uncertainty:
                raise QueryError("by", f"'{query.by.value}'", "'charge' or 'energy' with uncertainty")

    def answer(self, query: RangeQuery, origin: SnappedPoint, starts: tuple[LinkPosition, ...]) -> RangeAnswer:
        """The bands of a checked query; origin: where it met the road, starts: its position on both directions."""
        found = self._by_charge(query, starts) if query.by in (By.CHARGE, By.ENERGY) else self._by_way(query, starts)
        cases = [(band.energies, band.budget) for band in found.bands]
        is_turned = self._drawn is not self.graph
        home = half_turned_point(origin.on_road) if is_turned else origin.on_road
        areas = self._areas.areas(cases, home)
        filling = filling_of(areas[0]) if query.outline is Outline.FILLED else None
        if filling is not None:
            areas = filled_areas(self._drawn, home, cases, areas, filling, found.cases_a_level)
        exact = areas
        tolerance_m = SIMPLER_CELLS * areas[0].cell_m if query.tolerance_m is None else query.tolerance_m
        if tolerance_m > 0.0:
            counted = np.ones(self.graph.node_count, np.bool_) if filling is None else nodes_ashore(self._drawn)
            within = None if filling is None else found.cases_a_level
            areas = simplified_areas(self._drawn, home, cases, areas, tolerance_m, counted, within)
        soc_j = query.soc_frac * query.vehicle.usable_capacity_wh * JOULE_PER_WH
        homeward = query.trip is Trip.REVERSE
        within = np.logical_or.reduce([energies.node_energy_j <= budget for energies, budget in cases])
        node_m = self._distances.of_nodes(starts, within, homeward=homeward)
        bands = []
        for band, drawn, outline in zip(found.bands, areas, exact, strict=True):
            area = turned_back(drawn.area) if is_turned else drawn.area
            edge = map_edge(self._drawn, self._rim.rim(), band.energies, band.budget, drawn)
            if edge is not None and tolerance_m > 0.0:
                edge = replace(edge, line=without_straight_points(edge.line))
            bands.append(
                RangeBand(
                    soc_left_frac=band.left_frac,
                    limit=band.limit,
                    area=area,
                    rings=rings_of(area) if is_turned else drawn.rings,
                    area_m2=drawn.area_m2,
                    tolerance_m=drawn.tolerance_m,
                    node_count=drawn.node_count,
                    false_in_frac=drawn.false_in_frac,
                    false_out_frac=drawn.false_out_frac,
                    probability_frac=band.probability_frac,
                    map_edge=replace(edge, line=turned_back_lines(edge.line)) if edge and is_turned else edge,
                    edge_left_j=None if edge is None or band.left_frac is None else soc_j - edge.least_energy_j,
                    bearing_reach_m=bearing_reach_m(outline.rings, home),
                    road_reach=self._distances.reach(node_m, band.energies, band.budget, starts, homeward=homeward),
                )
            )
        counts = max(found.counts, key=lambda made: made.labels_made)
        method = method_name(counts, pareto=False) + ("" if query.trip is Trip.OUT else f"-{query.trip.value}")
        stats = SearchStats(counts.labels_made, counts.labels_settled, counts.seconds, method)
        unpaid_j = max(made.unpaid_j for made in found.counts)
        warnings = self._search.warnings(query, counts.crowded > 0, unpaid_j) + self._cold_starts(query)
        warnings += found.warnings + _map_ends(query, bands)
        return RangeAnswer(origin, tuple(bands), stats, warnings, filling)

    def _by_charge(self, query: RangeQuery, starts: tuple[LinkPosition, ...]) -> _Found:
        """Bands by charge left, or by energy taken, which is the same, the outermost first."""
        vehicles: dict[float | None, AnyVehicle] = {None: query.vehicle}
        if query.uncertainty:
            sd_frac = self._dissipation_sd_frac(query)
            vehicles = {
                probability: pessimistic(query.vehicle, max(1.0 + z * sd_frac, LEAST_FACTOR))
                for probability, z in RANGE_PROBABILITIES.items()
            }
        capacity_j = query.vehicle.usable_capacity_wh * JOULE_PER_WH
        if query.by is By.ENERGY:
            wanted: list[tuple[float, float | None]] = [
                (max(query.soc_frac - limit / capacity_j, query.reserve_soc_frac), limit)
                for limit in sorted(set(query.limits), reverse=True)
            ]
        else:
            wanted = [(left, None) for left in sorted({query.reserve_soc_frac, *query.bands_soc_frac})]
        levels = sorted({query.reserve_soc_frac, *(left for left, _ in wanted)})
        searched = {
            probability: self._energies(query, levels, vehicle, starts) for probability, vehicle in vehicles.items()
        }
        bands = [
            _Case(energies, (query.soc_frac - left) * capacity_j if limit is None else limit, left, limit, probability)
            for left, limit in wanted
            for probability, (energies, _) in searched.items()
        ]
        return _Found(bands, len(searched), [counts for _, counts in searched.values()], ())

    def _by_way(self, query: RangeQuery, starts: tuple[LinkPosition, ...]) -> _Found:
        """Bands by time or distance, the outermost first."""
        graph, space = self.graph, self._search.space_of(query, query.vehicle)
        limits = sorted(set(query.limits), reverse=True)
        reached = reach_by(
            space,
            self._search.pool,
            Measure(query.by.value),
            limits[0],
            starts,
            graph.head,
            graph.node_count,
            label_limit=self._search.label_limit,
        )
        values = RoadEnergies(
            node_energy_j=reached.node_least,
            tail_energy_j=None,
            head_energy_j=None,
            from_m=np.zeros(graph.link_count),
            to_m=reached.link_reach_m,
            most_energy_j=reached.most,
        )
        holds_j = (query.soc_frac - query.reserve_soc_frac) * query.vehicle.usable_capacity_wh * JOULE_PER_WH
        within = np.isfinite(reached.node_least)
        beyond = int(np.count_nonzero(within & (reached.node_energy_j > holds_j)))
        warnings: tuple[str, ...] = ()
        if beyond:
            warnings = (
                f"bands by {query.by.value} do not look at the charge: for {beyond} of {int(within.sum())} places in "
                f"them it does not suffice on the {'fastest' if query.by is By.TIME else 'shortest'} way",
            )
        return _Found([_Case(values, limit, None, limit, None) for limit in limits], 1, [reached.counts], warnings)

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
        if query.trip is Trip.OUT:
            return ()
        physics = self._search.space_of(query, query.vehicle).physics
        if physics.cabin_start_w == 0.0 and physics.tyre_time_s == 0.0:
            return ()
        where = "at each place" if query.trip is Trip.REVERSE else "at the origin and again at each place"
        return (f"cabin and tyres count as at a departure {where}",)

    def _dissipation_sd_frac(self, query: RangeQuery) -> float:
        """Relative standard deviation of what driving dissipates, on a sample of the graph's links."""
        graph = self.graph
        rng = np.random.default_rng(SEED)
        road_m = np.where(graph.is_ferry() | graph.is_copy(), 0.0, graph.length_m)
        idx = rng.choice(graph.link_count, SAMPLE_LINKS, p=road_m / road_m.sum())
        chain = self._chains.of_links(idx, graph.length_m[idx], query.stop_settings, query.conditions)
        return dissipation_sd_frac(query.vehicle, chain, drive_settings(query))


def _map_ends(query: RangeQuery, bands: Sequence[RangeBand]) -> tuple[str, ...]:
    """What is to be said where a band is ended by the map."""
    ended = [band for band in bands if band.map_edge is not None]
    if not ended:
        return ()
    what = "charge" if query.by is By.CHARGE else query.by.value
    left_j = [band.edge_left_j for band in ended if band.edge_left_j is not None]
    spare = ""
    if left_j:
        where = {
            Trip.OUT: "there",
            Trip.REVERSE: "at the origin after coming from there",
            Trip.ROUND: "at the origin after going there and back",
        }[query.trip]
        spare = f"with up to {text_above(max(left_j) / JOULE_PER_KWH, 0.0, 1)} kWh left {where}"
    if any(band.map_edge is not None and band.map_edge.whole_map for band in ended):
        return (
            f"every road of this map is reached with {what} to spare: the area ends where the map ends"
            f"{spare and f', {spare}'}; what lies beyond this map is not known",
        )
    spare = spare or f"with {what} to spare"
    return (
        f"the map ends before the {what} does: at roads that it cuts off the area ends {spare}; what lies beyond this "
        "map is not known",
    )
