"""Queries on two carriageways with a link between them over which nobody may turn back."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import shapely

from app.conversions.graph import graph_detail
from energy.conditions import Conditions
from energy.errors import LinkError
from routing.graph.rim import map_rim
from routing.importers.region import import_region
from routing.places import LinkSpan, Point
from routing.planner import Planner
from routing.queries import By, MatrixQuery, Outline, ParetoSettings, RangeQuery, RouteQuery, Trip
from routing.weights import BALANCED, ECO, FASTEST
from tests.routing.importers.test_osm import CARRIAGEWAYS, LINKED, MAIN, NO_TURNING_BACK
from tests.routing.test_planner import car

POINTS = {**CARRIAGEWAYS, 7: (100, -900), 8: (100, 900)}  # so far that turning there is no shorter way
WAYS = {**LINKED, 72: ([7, 2], MAIN), 58: ([5, 8], MAIN)}


def place(east_m: float, north_m: float) -> Point:
    return Point(42.0 + north_m / 111_073.38, 1.5 + east_m / 82_850.76)


NORTHBOUND, SOUTHBOUND, BETWEEN, SIDE = place(50, 0), place(50, 30), place(100, 15), place(100, -40)


@pytest.fixture
def free(draw_map: Any) -> Planner:
    return Planner(import_region(draw_map(POINTS, WAYS), [], "free"))


@pytest.fixture
def planner(draw_map: Any) -> Planner:
    path = draw_map(POINTS, WAYS, relations=[NO_TURNING_BACK], name="banned.osm.pbf")
    return Planner(import_region(path, [], "banned"))


def ways(planner: Planner, route: Any) -> list[int]:
    return list(dict.fromkeys(planner.graph.way_id[route.links.link_idx].tolist()))


def query(start: Point, goal: Point, **changes: Any) -> RouteQuery:
    return RouteQuery(**({"start": start, "goal": goal, "soc_frac": 0.8, "vehicle": car()} | changes))


@pytest.mark.parametrize("weights", [ECO, FASTEST, BALANCED])
def test_who_comes_from_the_carriageway_goes_round_and_others_turn(
    free: Planner, planner: Planner, weights: Any
) -> None:
    back = query(NORTHBOUND, SOUTHBOUND, weightings=(("w", weights),))
    (route,) = free.route(back).routes
    assert ways(free, route) == [12, 25, 54]
    (route,) = planner.route(back).routes
    assert ways(planner, route) == [12, 23, 36, 65, 54]
    (route,) = planner.route(query(SIDE, SOUTHBOUND, weightings=(("w", weights),))).routes
    assert ways(planner, route) == [72, 25, 54]
    (route,) = planner.route(query(BETWEEN, SOUTHBOUND, weightings=(("w", weights),))).routes
    assert ways(planner, route) == [25, 54]


def test_places_on_the_way_between_are_reached_and_left_and_answers_name_no_copy(planner: Planner) -> None:
    (route,) = planner.route(query(NORTHBOUND, BETWEEN)).routes
    assert ways(planner, route) == [12, 25]
    (route,) = planner.route(query(NORTHBOUND, SOUTHBOUND, via=(BETWEEN,))).routes
    assert ways(planner, route) == [12, 25, 54]  # a drive begins anew at a stop
    assert max(route.links.link_idx) < planner.graph.road_link_count
    answer = planner.route(query(NORTHBOUND, SOUTHBOUND, pareto=ParetoSettings()))
    assert all(max(one.links.link_idx) < planner.graph.road_link_count for one in answer.routes)
    assert answer.pareto is not None
    assert answer.pareto.unproven is None


def test_matrix_entries_with_bans_are_those_of_their_routes(planner: Planner) -> None:
    places = (NORTHBOUND, SOUTHBOUND, BETWEEN, SIDE)
    search = planner.matrix(MatrixQuery(places, places, 0.8, car(), conditions=Conditions(ambient_k=263.0)))
    for start, row in zip(places, [search.row(k) for k in range(4)], strict=True):
        for goal, entry in zip(places, row.entries, strict=True):
            (route,) = planner.route(query(start, goal, conditions=Conditions(ambient_k=263.0))).routes
            assert entry.energy_j == pytest.approx(route.energy_j, rel=1e-9)
            assert entry.distance_m == pytest.approx(route.distance_m, rel=1e-9)


@pytest.mark.parametrize("trip", list(Trip))
@pytest.mark.parametrize("outline", list(Outline))
def test_areas_with_bans_cover_the_way_between(planner: Planner, trip: Trip, outline: Outline) -> None:
    (band,) = planner.range(RangeQuery(NORTHBOUND, 0.8, car(), trip=trip, outline=outline)).bands
    for covered in (BETWEEN, SIDE, SOUTHBOUND):
        assert band.area.contains(shapely.Point(covered.lon_deg, covered.lat_deg))
    assert band.false_out_frac == 0.0


def test_the_way_between_is_reached_in_part_by_those_whom_the_ban_means(free: Planner, planner: Planner) -> None:
    asked = RangeQuery(NORTHBOUND, 0.8, car(), by=By.DISTANCE, limits=(50.0 + 20.0,))
    (ours,), (theirs,) = planner.range(asked).bands, free.range(asked).bands
    assert ours.area.equals(theirs.area)  # the ban is further on
    assert ours.road_reach == theirs.road_reach


def test_copies_are_in_no_count_and_no_rim_and_can_not_be_simulated(free: Planner, planner: Planner) -> None:
    graph = planner.graph
    assert graph.link_count == free.graph.link_count + 1
    ours, theirs = (graph_detail(one.graph, "") for one in (planner, free))
    assert (ours.link_count, ours.length_km) == (theirs.link_count, theirs.length_km)
    assert [kind.link_count for kind in ours.road_classes] == [kind.link_count for kind in theirs.road_classes]
    assert np.array_equal(map_rim(graph).node, map_rim(free.graph).node)
    with pytest.raises(LinkError, match=f"0..{graph.road_link_count - 1}"):
        planner.simulate((LinkSpan(graph.link_count - 1, 0.0, 5.0),), car())
    banned = [
        int(np.flatnonzero((graph.way_id == way) & (graph.node_id[graph.tail] == tail))[0])
        for way, tail in ((12, 1), (25, 2), (54, 5))
    ]
    chain = tuple(LinkSpan(k, 0.0, float(graph.length_m[k])) for k in banned)
    assert planner.simulate(chain, car()).distance_m > 0.0  # what was driven can be driven again
