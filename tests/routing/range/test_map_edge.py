"""Ranges that end where the map ends, on a straight road and on real roads."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import shapely

from energy.units import JOULE_PER_WH
from energy.vehicle.files import load_vehicle
from energy.vehicle.vehicle import Vehicle
from routing.graph.earth import METRE_PER_DEGREE
from routing.graph.files import load_graph
from routing.graph.rim import map_rim
from routing.graph.snap import RoadIndex
from routing.places import Point
from routing.planner import Planner
from routing.queries import RangeQuery, RouteQuery, Trip
from routing.range.bands import RangeAnswer
from routing.range.reach import RoadDistances
from routing.weights import Weights
from tests.routing.drawn_streets import SOUTH, STEP, WEST, drawn_streets

ROOT = Path(__file__).parents[3]
KONA = load_vehicle(ROOT / "data/vehicles/hyundai-kona-64.toml")
assert isinstance(KONA, Vehicle)
CAPACITY_J = KONA.usable_capacity_wh * JOULE_PER_WH
LONG = 24  # steps
COQUIMBO = ROOT / "data/graphs/coquimbo"
HOME = Point(-29.95, -71.25)
TRIPS = [Trip.OUT, Trip.REVERSE, Trip.ROUND]


def straight_road() -> Planner:
    """A flat road of LONG steps to the north, both ways; nothing is beyond its ends."""
    links = [(k, k + 1) for k in range(LONG)] + [(k + 1, k) for k in range(LONG)]
    graph = drawn_streets(
        "road",
        [(0.0, float(k)) for k in range(LONG + 1)],
        links,
        np.zeros(LONG + 1),
        speed_limit_mps=np.full(len(links), 80.0 / 3.6),
        cross=np.zeros(len(links), np.int64),
    )
    return Planner(graph)


@pytest.fixture(scope="module")
def road() -> Planner:
    return straight_road()


def at(steps: float) -> Point:
    return Point(SOUTH + steps * STEP / 1e7, WEST)


def asked(planner: Planner, origin: Point, soc: float, **changes) -> RangeAnswer:
    return planner.range(replace(RangeQuery(origin, soc, KONA), **changes))


@pytest.mark.parametrize("trip", TRIPS)
def test_area_that_the_charge_ends_says_nothing_of_the_map(road, trip):
    answer = asked(road, at(12.3), 0.01, trip=trip)
    assert all(band.map_edge is None and band.edge_left_j is None for band in answer.bands)
    assert not [warning for warning in answer.warnings if "map" in warning]


@pytest.mark.parametrize("trip", TRIPS)
def test_area_that_reaches_one_end_of_a_road_is_the_maps_there_and_the_charges_elsewhere(road, trip):
    share = 0.02 if trip is not Trip.ROUND else 0.04
    (band,) = asked(road, at(3.3), share, trip=trip).bands
    edge = band.map_edge
    assert edge is not None
    assert not edge.whole_map
    _, south, _, north = edge.line.bounds
    assert south < SOUTH  # drawn beyond the road's end, and round it
    assert north < at(1.0).lat_deg
    assert edge.line.length > 0.0
    assert (
        shapely.hausdorff_distance(edge.line, shapely.intersection(edge.line, band.area.boundary.buffer(1e-7))) < 1e-6
    )


@pytest.mark.parametrize("trip", TRIPS)
def test_bands_that_keep_more_charge_than_is_left_at_the_rim_do_not_reach_it(road, trip):
    share = 0.02 if trip is not Trip.ROUND else 0.04
    levels = tuple(np.linspace(0.0, share, 9).tolist())
    answer = asked(road, at(3.3), share, trip=trip, bands_soc_frac=levels)
    reaches = [band.map_edge is not None for band in answer.bands]
    assert reaches == sorted(reaches, reverse=True)
    assert 1 < sum(reaches) < len(reaches)
    for band in answer.bands:
        if band.edge_left_j is not None:
            assert band.edge_left_j > band.soc_left_frac * CAPACITY_J
    (left_j,) = {band.edge_left_j for band in answer.bands if band.edge_left_j is not None}
    keeps = [band.soc_left_frac * CAPACITY_J for band in answer.bands if band.map_edge is None]
    assert left_j <= min(keeps)


def test_energy_left_at_the_rim_is_what_a_route_there_leaves(road):
    answer = asked(road, at(3.3), 0.5)
    (south,) = {band.edge_left_j for band in answer.bands}
    node = int(np.argmin(road.graph.node_lat_deg))
    end = Point(float(road.graph.node_lat_deg[node]), float(road.graph.node_lon_deg[node]))
    (route,) = road.route(RouteQuery(at(3.3), end, 0.5, KONA)).routes
    assert south == pytest.approx(route.soc_end_frac * CAPACITY_J, rel=1e-5)  # 10 mm before the end


@pytest.mark.parametrize("trip", TRIPS)
def test_plenty_of_charge_says_that_every_road_is_reached_and_the_map_ends(road, trip):
    answer = asked(road, at(3.3), 0.9, trip=trip)
    (band,) = answer.bands
    assert band.map_edge is not None
    assert band.map_edge.whole_map
    shells = shapely.MultiLineString([polygon.exterior for polygon in band.area.geoms])
    assert band.map_edge.line.equals(shells)
    (warning,) = [warning for warning in answer.warnings if "map ends" in warning]
    assert "every road of this map is reached" in warning
    assert f"{band.edge_left_j / 3.6e6:.1f} kWh" in warning


def test_uncertain_areas_reach_the_rim_no_more_surely_than_they_are_large(road):
    answer = asked(road, at(3.3), 0.02, uncertainty=True)
    by_probability = {band.probability_frac: band.edge_left_j or 0.0 for band in answer.bands}
    assert by_probability[0.1] > by_probability[0.5] > by_probability[0.9]


@pytest.mark.parametrize("trip", [Trip.OUT, Trip.REVERSE])
def test_reach_along_a_straight_flat_road_is_that_of_its_outline(road, trip):
    for share in (0.007, 0.01, 0.013):
        (band,) = asked(road, at(12.3), share, trip=trip).bands
        north, south = band.bearing_reach_m[0], band.bearing_reach_m[12]
        nearest_m, farthest_m = band.road_reach.nearest_m, band.road_reach.farthest_m
        assert nearest_m is not None
        assert 2000.0 < nearest_m <= farthest_m
        for outline_m, end_m in ((min(north, south), nearest_m), (max(north, south), farthest_m)):
            # half-way between a reached place and one that is not, which are 60 m apart, on a grid of 20 m
            assert outline_m == pytest.approx(end_m, abs=90.0)
        assert band.bearing_reach_m[6] == pytest.approx(400.0, abs=20.0)
        assert band.bearing_reach_m[18] == pytest.approx(400.0, abs=20.0)


def test_reach_along_roads_ends_nowhere_where_the_map_ends_first(road):
    (band,) = asked(road, at(3.3), 0.9).bands
    assert band.road_reach.nearest_m is None
    assert band.road_reach.farthest_m == pytest.approx((LONG - 3.3) * STEP / 1e7 * METRE_PER_DEGREE, rel=1e-6)


def test_roads_cut_on_a_real_map_end_the_area_where_they_are_reached():
    graph = load_graph(COQUIMBO)
    planner, rim = Planner(graph), map_rim(graph)
    nodes = shapely.points(graph.node_lon_deg[rim.node], graph.node_lat_deg[rim.node])
    kinds = set()
    for soc in (0.005, 0.015, 0.02, 0.025, 0.03, 0.5):
        (band,) = asked(planner, HOME, soc).bands
        inside = nodes[shapely.contains(band.area, nodes)]
        edge = band.map_edge
        assert (edge is not None) == (inside.size > 0)
        kinds.add("none" if edge is None else "all" if edge.whole_map else "some")
        if edge is None:
            continue
        assert edge.line.within(band.area.boundary.buffer(1e-7))
        if not edge.whole_map:
            far_deg = 1.5 * 400.0 / METRE_PER_DEGREE / np.cos(np.radians(30.0)) * 1.01
            assert edge.line.within(shapely.union_all(inside).buffer(far_deg, quad_segs=32))
    assert kinds == {"none", "some", "all"}


def test_road_distances_are_those_of_the_shortest_ways():
    graph = load_graph(COQUIMBO)
    planner = Planner(graph)
    (start, positions) = RoadIndex(graph).snap("start", HOME, 1000.0)
    everywhere = np.ones(graph.node_count, np.bool_)
    shortest = RoadDistances(graph).of_nodes(positions, everywhere, homeward=False)
    back = RoadDistances(graph).of_nodes(positions, everywhere, homeward=True)
    for node in np.random.default_rng(4).choice(graph.node_count, 12, replace=False).tolist():
        place = Point(float(graph.node_lat_deg[node]), float(graph.node_lon_deg[node]))
        for ends, found_m in (((start.on_road, place), shortest[node]), ((place, start.on_road), back[node])):
            query = RouteQuery(*ends, 0.9, KONA, weightings=(("short", Weights(0.0, 0.0, 1.0)),))
            (route,) = planner.route(query).routes
            assert found_m <= route.distance_m + 0.05
            # bans of turns make a way longer, but seldom
            assert route.distance_m == pytest.approx(found_m, rel=0.05, abs=400.0)
