"""The area that can be reached: a valid right-handed area around the origin that nests and grows with the charge."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.ndimage import distance_transform_edt

from energy.vehicle.files import load_vehicles
from routing.graph.earth import EARTH_RADIUS_M, great_circle_m
from routing.graph.files import load_graph
from routing.graph.road_graph import GraphMeta, LooseLinks, LooseNodes, RoadGraph, Terrain, assemble_graph
from routing.places import Point
from routing.planner import Planner
from routing.queries import RangeQuery
from routing.range.bands import RangeAnswer
from routing.range.kernels_grid import LEVEL_BITS, LEVEL_MASK, NOWHERE, nearest_roads
from routing.range.kernels_outline import CUTS, crossing_at

KONA = load_vehicles(Path(__file__).resolve().parents[3] / "data/vehicles")["hyundai-kona-64"]
SIDE = 24
SOUTH, WEST = 55.0, 12.0
HIGHLANDS = Path(__file__).resolve().parents[3] / "data/graphs/highlands"


def hilly_grid() -> RoadGraph:
    """24 by 24 nodes about 600 m apart on seeded hills, all streets both ways, some left out."""
    rng = np.random.default_rng(11)
    row, column = np.divmod(np.arange(SIDE * SIDE), SIDE)
    lat_e7 = np.rint((SOUTH + 0.0054 * row) * 1e7 + rng.integers(-9000, 9000, row.size)).astype(np.int64)
    lon_e7 = np.rint((WEST + 0.0094 * column) * 1e7 + rng.integers(-9000, 9000, row.size)).astype(np.int64)
    height = 300.0 + 90.0 * np.sin(row / 3.0) * np.cos(column / 4.0) + 4.0 * column
    right = [(k, k + 1) for k in range(row.size) if k % SIDE < SIDE - 1]
    up = [(k, k + SIDE) for k in range(row.size - SIDE)]
    streets = [street for street in [*right, *up] if rng.random() > 0.12]
    tail, head = (
        np.array(side, np.int32) for side in zip(*[s for a, b in streets for s in ((a, b), (b, a))], strict=True)
    )
    n = tail.size
    corners = np.column_stack((tail, head)).ravel()
    lat, lon = lat_e7 / 1e7, lon_e7 / 1e7
    return assemble_graph(
        GraphMeta("grid", "test", "none", "none", Terrain.SYNTHETIC, "drawn", 0.0, (0.0,) * 4),
        ("",),
        LooseNodes(lat, lon, height, np.arange(row.size)),
        LooseLinks(
            tail=tail,
            head=head,
            length_m=np.asarray(great_circle_m(lat[tail], lon[tail], lat[head], lon[head])),
            speed_limit_mps=np.where(np.arange(n) // 2 % 3 == 0, 80.0, 50.0) / 3.6,
            functional_class=np.full(n, 5, np.int8),
            cross=np.zeros(n, np.int8),
            urban=np.zeros(n, bool),
            structure=np.zeros(n, bool),
            way_id=np.arange(n) // 2,
            name_idx=np.zeros(n, np.int32),
            geometry_first=np.arange(n + 1) * 2,
            geometry_lon_e7=lon_e7[corners].astype(np.int32),
            geometry_lat_e7=lat_e7[corners].astype(np.int32),
            forbidden_turns=np.empty((0, 2), np.int64),
        ),
    )


@pytest.fixture(scope="module")
def planner() -> Planner:
    return Planner(hilly_grid())


def place(east: float, north: float) -> Point:
    """A place by its share of the map's width and height."""
    return Point(SOUTH + 0.0054 * (SIDE - 1) * north, WEST + 0.0094 * (SIDE - 1) * east)


MIDDLE = place(0.5, 0.5)
ORIGINS = [MIDDLE, place(0.03, 0.04), place(0.7, 0.95), place(0.21, 0.55)]


def reached(planner: Planner, origin: Point = MIDDLE, soc: float = 0.02, **changes) -> RangeAnswer:
    return planner.range(replace(RangeQuery(origin, soc, KONA), **changes))


def left_out(part: shapely.MultiPolygon, whole: shapely.MultiPolygon) -> float:
    """The share of an area that lies outside another one; 1e-12 is what floating-point numbers leave."""
    return float(part.difference(whole).area / part.area)


def rings(area: shapely.MultiPolygon) -> list[shapely.LinearRing]:
    return [ring for polygon in area.geoms for ring in (polygon.exterior, *polygon.interiors)]


@pytest.mark.parametrize("origin", ORIGINS)
@pytest.mark.parametrize("soc", [0.004, 0.011, 0.03])
def test_areas_are_valid_right_handed_and_contain_the_origin(planner, origin, soc):
    answer = reached(planner, origin, soc, bands_soc_frac=(0.3 * soc, 0.6 * soc, soc))
    home = shapely.Point(answer.origin.on_road.lon_deg, answer.origin.on_road.lat_deg)
    for band in answer.bands:
        assert band.area.geom_type == "MultiPolygon"
        assert band.area.is_valid
        assert band.area.contains(home)
        for polygon in band.area.geoms:
            assert polygon.exterior.is_ccw
            assert not any(ring.is_ccw for ring in polygon.interiors)
        for ring in rings(band.area):
            assert ring.is_closed
            assert len(ring.coords) >= 4


def test_coordinates_of_areas_have_seven_decimals_at_most(planner):
    for band in reached(planner, bands_soc_frac=(0.01,)).bands:
        coordinates = shapely.get_coordinates(band.area)
        np.testing.assert_array_equal(np.round(coordinates, 7), coordinates)


@settings(max_examples=40, deadline=None)
@given(east=st.floats(0.02, 0.98), north=st.floats(0.02, 0.98), soc=st.floats(0.0, 0.04), inner=st.floats(0.0, 1.0))
def test_any_area_is_valid_nested_and_around_its_origin(planner, east, north, soc, inner):
    answer = reached(planner, place(east, north), soc, bands_soc_frac=(inner * soc,))
    home = shapely.Point(answer.origin.on_road.lon_deg, answer.origin.on_road.lat_deg)
    for band in answer.bands:
        assert band.area.is_valid
        assert band.area.contains(home)
        assert all(polygon.exterior.is_ccw for polygon in band.area.geoms)
    assert left_out(answer.bands[-1].area, answer.bands[0].area) <= 1e-12


@pytest.mark.parametrize("soc", [0.004, 0.02])
def test_rings_have_no_point_on_the_line_between_its_neighbours(planner, soc):
    for ring in rings(reached(planner, soc=soc).bands[0].area):
        whole = np.rint(shapely.get_coordinates(ring) * 1e7).astype(np.int64)[:-1]
        come, go = whole - np.roll(whole, 1, axis=0), np.roll(whole, -1, axis=0) - whole
        assert (come[:, 0] * go[:, 1] != come[:, 1] * go[:, 0]).all()


@pytest.mark.parametrize("origin", ORIGINS)
def test_shares_are_those_of_all_nodes_asked_one_by_one(planner, origin):
    graph = planner.graph
    nodes = shapely.points(graph.node_lon_deg, graph.node_lat_deg)
    for soc in (0.004, 0.012):
        (band,) = reached(planner, origin, soc).bands
        covered = int(shapely.contains(band.area, nodes).sum())
        truly = round(covered * (1.0 - band.false_in_frac))
        assert covered * band.false_in_frac == pytest.approx(covered - truly)
        assert band.node_count * (1.0 - band.false_out_frac) == pytest.approx(truly)


def near(level: np.ndarray, most: int, off_road: float) -> tuple[np.ndarray, np.ndarray]:
    """Squares of distances to the nearest road and in how many bands it is, of a grid with -1 where no road is."""
    key = np.where(level < 0, NOWHERE, level).astype(np.int32)
    nearest_roads(key, most, off_road)
    return key >> LEVEL_BITS, key & LEVEL_MASK


@pytest.mark.nojit
@pytest.mark.parametrize("most", [1, 4, 50])
def test_squared_distances_on_the_grid_are_exact_up_to_their_cap(most):
    site = np.random.default_rng(3).random((23, 81)) < 0.02
    exact = np.rint(distance_transform_edt(~site) ** 2)
    np.testing.assert_array_equal(near(np.where(site, 1, -1), most, 50.0)[0], np.minimum(exact, most**2))


@pytest.mark.nojit
def test_grid_without_a_road_is_in_no_band():
    square, level = near(np.full((4, 5), -1), 7, 6.0)
    assert (square == 49).all()
    assert (level == 0).all()


@pytest.mark.nojit
def test_grid_node_is_in_a_band_where_that_is_nearer_than_any_road_out_of_it():
    level = np.random.default_rng(5).integers(0, 4, (30, 70))
    level[np.random.default_rng(6).random(level.shape) < 0.95] = -1
    found = near(level, 9, 8.0)[1]
    for band in (1, 2, 3):
        inside, beyond = (distance_transform_edt(~road) for road in (level >= band, (level >= 0) & (level < band)))
        np.testing.assert_array_equal(found >= band, (inside < beyond) & (inside <= 8.0))


@pytest.mark.nojit
def test_ring_crosses_half_way_between_roads_and_at_the_rim_off_a_road():
    level = np.full((5, 21), -1)
    level[:, 2], level[:, 9] = 1, 0
    level[:, 2:][:, 7] = 0
    square, _ = near(level, 7, 6.0)
    key = square << LEVEL_BITS
    assert crossing_at(int(key[2, 5]), int(key[2, 6]), 6.0) == CUTS // 2  # 3 cells from both
    assert crossing_at(int(key[2, 15]), int(key[2, 16]), 6.5) == CUTS // 2  # 6 cells off, then 7
    assert crossing_at(int(key[2, 15]), int(key[2, 16]), 6.0) == 1  # never on a node of the grid


def test_area_on_a_real_road_network_has_holes_and_tells_nodes_apart():
    graph = load_graph(HIGHLANDS)
    planner = Planner(graph)
    holes = 0
    for node in (2000, 15000):
        home = Point(float(graph.node_lat_deg[node]), float(graph.node_lon_deg[node]))
        answer = reached(planner, home, 0.2, bands_soc_frac=(0.05, 0.1))
        for band in answer.bands:
            holes += sum(len(polygon.interiors) for polygon in band.area.geoms)
            assert band.area.is_valid
            assert band.false_in_frac <= 0.03
            assert band.false_out_frac <= 0.03
        for outer, inner in pairwise(answer.bands):
            assert left_out(inner.area, outer.area) <= 1e-12
    assert holes > 10


@pytest.mark.parametrize("origin", ORIGINS)
def test_bands_nest_from_the_reserve_inwards(planner, origin):
    shares = np.linspace(0.002, 0.02, 7)
    answer = reached(planner, origin, 0.02, reserve_soc_frac=0.001, bands_soc_frac=tuple(shares.tolist()))
    assert [band.soc_left_frac for band in answer.bands] == pytest.approx([0.001, *shares])
    for outer, inner in pairwise(answer.bands):
        assert left_out(inner.area, outer.area) <= 1e-12
        assert inner.area_m2 <= outer.area_m2
        assert inner.node_count <= outer.node_count


@pytest.mark.parametrize("origin", ORIGINS)
def test_more_charge_covers_what_less_does(planner, origin):
    charges = np.geomspace(0.002, 0.05, 12)
    bands = [reached(planner, origin, soc).bands[0] for soc in charges.tolist()]
    for less, more in pairwise(bands):
        assert less.node_count <= more.node_count
        # where the grid becomes coarser, the boundary may move by a cell
        assert left_out(less.area, more.area) <= 0.02
    # but that is seldom: nearly always it is covered
    kept = [left_out(less.area, more.area) <= 1e-12 for less, more in pairwise(bands)]
    assert sum(kept) >= len(kept) - 1


def test_all_charge_in_reserve_reaches_the_origin_and_what_lies_below(planner):
    answer = reached(planner, soc=0.5, reserve_soc_frac=0.5)
    (band,) = answer.bands
    assert band.area.contains(shapely.Point(answer.origin.on_road.lon_deg, answer.origin.on_road.lat_deg))
    full = reached(planner, soc=0.5).bands[0]
    assert band.area_m2 < 0.5 * full.area_m2
    assert band.node_count < 0.5 * full.node_count


@pytest.mark.nojit
def test_empty_battery_on_flat_ground_reaches_the_origin_only():
    flat = hilly_grid()
    level = replace(flat, node_height_m=np.zeros(flat.node_count))
    (band,) = reached(Planner(level), soc=0.0).bands
    assert band.node_count == 0
    assert 0.0 < band.area_m2 < math.pi * 420.0**2  # a road in reach is widened by 400 m at most
    assert band.false_out_frac == 0.0


def test_band_of_all_charge_is_inside_the_others_and_holds_the_origin(planner):
    answer = reached(planner, soc=0.02, bands_soc_frac=(0.01, 0.02))
    outer, middle, inner = answer.bands
    assert inner.soc_left_frac == 0.02
    assert 0.0 < inner.area_m2 < middle.area_m2 < outer.area_m2
    assert inner.area.contains(shapely.Point(answer.origin.on_road.lon_deg, answer.origin.on_road.lat_deg))


def test_plenty_of_charge_reaches_every_node_and_covers_it(planner):
    (band,) = reached(planner, soc=0.9).bands
    graph = planner.graph
    assert band.node_count == graph.node_count
    assert (band.false_in_frac, band.false_out_frac) == (0.0, 0.0)
    assert shapely.contains_xy(band.area, graph.node_lon_deg, graph.node_lat_deg).all()
    assert len(band.area.geoms) == 1


def area_by_strips_m2(area: shapely.MultiPolygon, strips: int = 500) -> float:
    """Area on the sphere, summed over strips of latitude: each is flat, and shrinks with the cosine of its middle."""
    west, south, east, north = area.bounds
    edges = np.linspace(south, north, strips + 1)
    flat_deg2 = shapely.area(shapely.intersection(area, shapely.box(west, edges[:-1], east, edges[1:])))
    shrink = np.cos(np.radians((edges[:-1] + edges[1:]) / 2.0))
    return float((flat_deg2 * shrink).sum() * (EARTH_RADIUS_M * math.pi / 180.0) ** 2)


@pytest.mark.parametrize("soc", [0.004, 0.02])
def test_area_in_square_metres_equals_a_sum_over_strips(planner, soc):
    for band in reached(planner, soc=soc, bands_soc_frac=(0.5 * soc,)).bands:
        assert band.area_m2 == pytest.approx(area_by_strips_m2(band.area), rel=1e-6)


@pytest.mark.parametrize("origin", ORIGINS)
def test_area_tells_reachable_nodes_from_others(planner, origin):
    for soc in (0.006, 0.015, 0.025):
        (band,) = reached(planner, origin, soc).bands
        assert band.false_in_frac <= 0.03
        assert band.false_out_frac <= 0.03


def test_area_stays_near_the_roads_in_reach(planner):
    (band,) = reached(planner, soc=0.9).bands
    west, south, east, north = planner.graph.meta.bbox
    rim_lat = 460.0 / (EARTH_RADIUS_M * math.pi / 180.0)  # 400 m and a cell of 40 m, with its corner
    rim_lon = rim_lat / math.cos(math.radians(north))
    box = shapely.box(west - rim_lon, south - rim_lat, east + rim_lon, north + rim_lat)
    assert box.contains(band.area)
