"""The tree of roads finds what looking at every road finds."""

from __future__ import annotations

import math

import numpy as np
import pytest
import shapely

from routing.graph.earth import METRE_PER_DEGREE
from routing.graph.kernels_nearest import FAN
from routing.graph.nearest import RoadTree
from routing.graph.practice import practice_graph
from routing.graph.road_graph import RoadGraph
from routing.places import Point
from routing.synth import synthesize

pytestmark = pytest.mark.nojit


@pytest.fixture(scope="module")
def graph() -> RoadGraph:
    return synthesize("roads", seed=11, width_km=None, height_km=None, links_target=700)


@pytest.fixture(scope="module")
def tree(graph: RoadGraph) -> RoadTree:
    return RoadTree(graph)


def distances_m(graph: RoadGraph, point: Point) -> np.ndarray:
    """From a place to every link, one after the other, in the plane that touches the earth at the place."""
    scale = np.array((METRE_PER_DEGREE * math.cos(math.radians(point.lat_deg)), METRE_PER_DEGREE))
    lines = [(graph.geometry(k) - (point.lon_deg, point.lat_deg)) * scale for k in range(graph.link_count)]
    return np.asarray(shapely.distance(shapely.Point(0.0, 0.0), [shapely.LineString(line) for line in lines]))


def test_nearest_to_places_all_over_the_map_is_what_looking_at_every_road_finds(graph, tree):
    assert graph.link_count > 2 * FAN * FAN  # so that the tree has levels between its roads and its top
    rng = np.random.default_rng(2)
    west, south, east, north = graph.meta.bbox
    for lat, lon in zip(rng.uniform(south, north, 60).tolist(), rng.uniform(west, east, 60).tolist(), strict=True):
        point = Point(lat, lon)
        away_m = distances_m(graph, point)
        assert away_m[tree.nearest(point)] == pytest.approx(float(away_m.min()), abs=1e-6)


def test_roads_near_a_place_are_those_that_looking_at_every_road_finds_nearest(graph, tree):
    roads = np.sort(tree.boxes.road)
    rng = np.random.default_rng(5)
    west, south, east, north = graph.meta.bbox
    for lat, lon in zip(rng.uniform(south, north, 20).tolist(), rng.uniform(west, east, 20).tolist(), strict=True):
        point = Point(lat, lon)
        away_m = distances_m(graph, point)
        found = tree.near(point, 7)
        assert len(set(found)) == 7
        assert set(found) <= set(roads.tolist())
        assert away_m[found] == pytest.approx(np.sort(away_m[roads])[:7], abs=1e-6)
    assert len(tree.near(point, 10 * roads.size)) == roads.size


def test_the_place_on_a_line_nearest_to_a_place_is_that_of_a_geometry_library(graph, tree):
    rng = np.random.default_rng(3)
    west, south, east, north = graph.meta.bbox
    for lat, lon in zip(rng.uniform(south, north, 60).tolist(), rng.uniform(west, east, 60).tolist(), strict=True):
        link = int(rng.integers(graph.link_count))
        scale = np.array((METRE_PER_DEGREE * float(np.cos(np.radians(lat))), METRE_PER_DEGREE))
        line = shapely.LineString((graph.geometry(link) - (lon, lat)) * scale)
        expected = line.project(shapely.Point(0.0, 0.0), normalized=True)
        there = line.interpolate(expected, normalized=True)
        share, away_m, place = tree.foot(link, Point(lat, lon))
        assert share == pytest.approx(expected, abs=1e-12)
        assert away_m == pytest.approx(line.distance(shapely.Point(0.0, 0.0)), abs=1e-6)
        assert (place.lon_deg, place.lat_deg) == pytest.approx((lon + there.x / scale[0], lat + there.y / scale[1]))


def test_nearest_at_a_junction_is_the_link_of_the_least_number(graph, tree):
    degree = np.bincount(graph.tail, minlength=graph.node_count) + np.bincount(graph.head, minlength=graph.node_count)
    junctions = np.flatnonzero(degree >= 6)
    assert junctions.size > 20
    for node in junctions[:20].tolist():
        at = Point(float(graph.node_lat_deg[node]), float(graph.node_lon_deg[node]))
        met = np.flatnonzero((graph.tail == node) | (graph.head == node))
        assert tree.nearest(at) == met.min()


@pytest.mark.parametrize(("north_deg", "east_deg"), [(1e-14, 0.0), (-1e-14, 0.0), (0.0, 1e-14), (0.0, -1e-14)])
def test_nearest_in_the_middle_between_roads_is_the_link_of_the_least_number_whatever_the_last_bit(north_deg, east_deg):
    block = practice_graph()  # 222 m by 222 m
    point = Point(0.001 + north_deg, 0.001 + east_deg)
    assert distances_m(block, point) == pytest.approx(METRE_PER_DEGREE * 0.001, abs=2e-7)
    assert RoadTree(block).nearest(point) == 0


def test_nearest_of_two_roads_a_hair_apart_is_the_nearer_one():
    block = practice_graph()
    nearest = {RoadTree(block).nearest(Point(0.001 + away, 0.001)) for away in (2e-12, -2e-12)}  # 0.2 µm
    assert len(nearest) == 2


def test_nearest_far_outside_of_the_map_is_a_road_at_its_rim(graph, tree):
    _, south, east, north = graph.meta.bbox
    point = Point(0.5 * (south + north), east + 20.0)
    away_m = distances_m(graph, point)
    assert away_m[tree.nearest(point)] == pytest.approx(float(away_m.min()), abs=1e-6)


def test_nearest_direction_of_a_two_way_road_is_the_one_of_the_least_number(graph, tree):
    for link in range(0, graph.link_count, 97):
        line = graph.geometry(link)
        lon, lat = (0.5 * (line[0] + line[1])).tolist()
        found = tree.nearest(Point(lat, lon))
        assert found < graph.reverse_idx[found] or graph.reverse_idx[found] < 0
