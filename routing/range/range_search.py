"""Range queries: what the trip takes to every place, and the areas that each charge suffices for."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from energy.chain.chain import DriveSettings, LinkModel
from energy.chain.sampling import SEED
from energy.chain.uncertainty import dissipation_sd_frac
from energy.units import JOULE_PER_KWH, JOULE_PER_WH
from energy.vehicle.pessimistic import FACTOR_RANGE, pessimistic
from routing.errors import QueryError
from routing.links.spans import ChainMaker
from routing.places import LinkPosition, Point
from routing.queries import RANGE_PROBABILITIES, Outline, Trip
from routing.range.area import AreaMaker, energies_of_reach
from routing.range.bands import RangeAnswer, RangeBand
from routing.range.filled import filled_areas, filling_of
from routing.range.map_edge import map_edge
from routing.range.reach import RoadDistances, bearing_reach_m
from routing.range.way_back import BackCharges, ReverseSearch
from routing.route.best_path import RouteSearch, method_name
from routing.route.checks import check_charge
from routing.route.limits import charge_limits
from routing.route.route import SearchStats
from routing.search.found import Limits, SearchCounts
from routing.search.search import reach
from routing.search.space import LOAD_NOISE_N

if TYPE_CHECKING:
    from collections.abc import Sequence

    from energy.vehicle.files import AnyVehicle
    from routing.graph.rim import RimFinder
    from routing.graph.road_graph import RoadGraph
    from routing.links.spans import ChainMaker
    from routing.places import SnappedPoint
    from routing.queries import RangeQuery
    from routing.range.area import AreaMaker, RoadEnergies
    from routing.route.best_path import RouteSearch
    from routing.search.space import SearchSpace

SAMPLE_LINKS: Final = 300  # on which the spread of what driving dissipates is taken
LEAST_FACTOR: Final = FACTOR_RANGE[0]


class RangeSearch:
    """Answers range queries on one graph; safe to share between threads."""

    def __init__(
        self, graph: RoadGraph, search: RouteSearch, chains: ChainMaker, areas: AreaMaker, rim: RimFinder
    ) -> None:
        self.graph = graph
        self._search, self._chains, self._areas, self._rim = search, chains, areas, rim
        self._distances = RoadDistances(graph)
        self._reverse = ReverseSearch(graph, search.label_limit)

    def warm_up(self, space: SearchSpace, place: LinkPosition) -> None:
        """Run every kernel of ranges once."""
        graph = self.graph
        reached = reach(space, self._search.pool, Limits(0.0, 0.0), [place], graph.head, graph.node_count)
        home = Point(float(graph.node_lat_deg[0]), float(graph.node_lon_deg[0]))
        self._areas.areas([(energies_of_reach(graph, reached), 0.0)], home)
        self._reverse.warm_up(space, place)

    def check(self, query: RangeQuery) -> None:
        """Raise QueryError where a query asks for what can't be, or can't be searched."""
        check_charge(query.soc_frac, query.reserve_soc_frac)
        if query.trip is not Trip.OUT and query.link_model is LinkModel.PRINTED:
            raise QueryError("link_model", "'printed'", f"'integrated' with {query.trip.value}")
        least_n = self._search.space_of(query, query.vehicle).least_load_n
        if query.trip is not Trip.OUT and least_n < -LOAD_NOISE_N:
            raise QueryError("conditions", f"a road load of {least_n:.1f} N", f"at least 0 N with {query.trip.value}")
        for band in query.bands_soc_frac:
            if not query.reserve_soc_frac <= band <= query.soc_frac:
                raise QueryError("bands", band, f"{query.reserve_soc_frac:g} (reserve_soc)..{query.soc_frac:g} (soc)")

    def answer(self, query: RangeQuery, origin: SnappedPoint, starts: tuple[LinkPosition, ...]) -> RangeAnswer:
        """The bands of a checked query; origin: where it met the road, starts: its position on both directions."""
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
        filling = filling_of(areas[0]) if query.outline is Outline.FILLED else None
        if filling is not None:
            areas = filled_areas(self.graph, origin.on_road, cases, areas, filling)
        soc_j, homeward = query.soc_frac * capacity_j, query.trip is Trip.REVERSE
        node_m = self._distances.of_nodes(starts, homeward=homeward)
        bands = []
        for (left, probability), (energies, budget_j), drawn in zip(wanted, cases, areas, strict=True):
            edge = map_edge(self.graph, self._rim.rim(), energies, budget_j, drawn)
            bands.append(
                RangeBand(
                    soc_left_frac=left,
                    area=drawn.area,
                    area_m2=drawn.area_m2,
                    tolerance_m=drawn.tolerance_m,
                    node_count=drawn.node_count,
                    false_in_frac=drawn.false_in_frac,
                    false_out_frac=drawn.false_out_frac,
                    probability_frac=probability,
                    map_edge=edge,
                    edge_left_j=None if edge is None else soc_j - edge.least_energy_j,
                    bearing_reach_m=bearing_reach_m(drawn.area, origin.on_road),
                    road_reach=self._distances.reach(node_m, energies, budget_j, starts, homeward=homeward),
                )
            )
        counts = max((made for _, made in searched.values()), key=lambda made: made.labels_made)
        method = method_name(counts, pareto=False) + ("" if query.trip is Trip.OUT else f"-{query.trip.value}")
        stats = SearchStats(counts.labels_made, counts.labels_settled, counts.seconds, method)
        unpaid_j = max(made.unpaid_j for _, made in searched.values())
        warnings = self._search.warnings(query, counts.crowded > 0, unpaid_j) + self._cold_starts(query)
        return RangeAnswer(origin, tuple(bands), stats, warnings + _map_ends(query.trip, bands), filling)

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
        chain = self._chains.of_links(idx, graph.length_m[idx], query.stop_settings, query.conditions)
        return dissipation_sd_frac(
            query.vehicle, chain, DriveSettings(query.conditions, query.link_model, query.stop_rule)
        )


def _map_ends(trip: Trip, bands: Sequence[RangeBand]) -> tuple[str, ...]:
    """What is to be said where the outermost band is ended by the map."""
    ended = [band for band in bands if band.map_edge is not None and band.edge_left_j is not None]
    if not ended:
        return ()
    most_kwh = max(band.edge_left_j or 0.0 for band in ended) / JOULE_PER_KWH
    where = {
        Trip.OUT: "there",
        Trip.REVERSE: "at the origin after coming from there",
        Trip.ROUND: "at the origin after going there and back",
    }[trip]
    if any(band.map_edge is not None and band.map_edge.whole_map for band in ended):
        return (
            "every road of this map is reached with charge to spare: the area ends where the map ends, with up to "
            f"{most_kwh:.1f} kWh left {where}; what lies beyond this map is not known",
        )
    return (
        "the map ends before the charge does: at roads that it cuts off the area ends with up to "
        f"{most_kwh:.1f} kWh left {where}; what lies beyond this map is not known",
    )
