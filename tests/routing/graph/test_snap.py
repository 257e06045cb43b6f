"""Where coordinates meet the road, and what is refused."""

from __future__ import annotations

import itertools
import math
import re

import numpy as np
import pytest

from routing.errors import PointFarFromRoadError, PointOutsideMapError
from routing.graph.earth import EARTH_RADIUS_M, great_circle_m
from routing.graph.road_graph import GraphMeta, LooseLinks, LooseNodes, RoadGraph, Terrain, assemble_graph
from routing.graph.snap import END_MARGIN_M, RoadIndex, moved_warnings, part_of_line
from routing.places import Point

pytestmark = pytest.mark.nojit

METRE_PER_DEGREE = EARTH_RADIUS_M * math.pi / 180.0
SOUTH, WEST = 60.0, 10.0  # a degree of longitude is half as long as one of latitude here
# metres east and north of 60° N 10° E:
# 2 ------- 3      a ring of 4 km by 4 km; the south side 0-1 has a bend half-way, 500 m to the north,
# |         |      and the east side 1-3 is a oneway to the north
# 0 -- ^ -- 1
PLACES_M = [(0.0, 0.0), (4000.0, 0.0), (0.0, 4000.0), (4000.0, 4000.0), (3930.0, 70.0), (70.0, 3930.0)]
BEND_M = (2000.0, 500.0)


def place(east_m: float, north_m: float) -> Point:
    shrink = math.cos(math.radians(SOUTH))
    return Point(round(SOUTH + north_m / METRE_PER_DEGREE, 7), round(WEST + east_m / METRE_PER_DEGREE / shrink, 7))


def drawn() -> RoadGraph:
    links = [(0, 1), (1, 0), (1, 3), (3, 2), (2, 3), (2, 0), (0, 2), (1, 4), (4, 1), (2, 5), (5, 2)]
    points = [place(*m) for m in PLACES_M]
    bend = place(*BEND_M)
    lines = [[points[a], bend, points[b]] if {a, b} == {0, 1} else [points[a], points[b]] for a, b in links]
    tail, head = (np.array(side, np.int32) for side in zip(*links, strict=True))
    n = len(links)
    lon = np.array([p.lon_deg for line in lines for p in line])
    lat = np.array([p.lat_deg for line in lines for p in line])
    length = [
        sum(float(great_circle_m(p.lat_deg, p.lon_deg, q.lat_deg, q.lon_deg)) for p, q in itertools.pairwise(line))
        for line in lines
    ]
    return assemble_graph(
        GraphMeta("ring", "test", "none", "none", Terrain.SYNTHETIC, "flat", 0.0, (0.0,) * 4),
        ("", "South Side"),
        LooseNodes(
            np.array([p.lat_deg for p in points]), np.array([p.lon_deg for p in points]), np.zeros(6), np.arange(6)
        ),
        LooseLinks(
            tail=tail,
            head=head,
            length_m=np.array(length),
            speed_limit_mps=np.full(n, 20.0),
            functional_class=np.full(n, 6, np.int8),
            cross=np.zeros(n, np.int8),
            urban=np.zeros(n, bool),
            structure=np.zeros(n, bool),
            way_id=np.arange(n),
            name_idx=np.array([1, 1, *[0] * (n - 2)], np.int32),
            geometry_first=np.concatenate(([0], np.cumsum([len(line) for line in lines]))),
            geometry_lon_e7=np.rint(lon * 1e7).astype(np.int32),
            geometry_lat_e7=np.rint(lat * 1e7).astype(np.int32),
            forbidden_turns=np.empty((0, 2), np.int64),
        ),
    )


@pytest.fixture(scope="module")
def graph() -> RoadGraph:
    return drawn()


@pytest.fixture(scope="module")
def roads(graph: RoadGraph) -> RoadIndex:
    return RoadIndex(graph)


def ends(graph: RoadGraph, link: int) -> tuple[int, int]:
    return int(graph.tail[link]), int(graph.head[link])


def test_place_beside_a_street_meets_both_directions_at_its_foot(graph, roads):
    snapped, positions = roads.snap("start", place(150.0, 1000.0), 1000.0)
    assert {ends(graph, p.link_idx) for p in positions} == {(0, 2), (2, 0)}
    assert snapped.distance_m == pytest.approx(150.0, rel=1e-3)
    for position in positions:
        along = position.offset_m if ends(graph, position.link_idx) == (0, 2) else 4000.0 - position.offset_m
        assert along == pytest.approx(1000.0, abs=0.5)
    assert sum(p.offset_m for p in positions) == pytest.approx(float(graph.length_m[positions[0].link_idx]))
    assert snapped.on_road.lat_deg == pytest.approx(place(0.0, 1000.0).lat_deg, abs=1e-6)
    assert snapped.on_road.lon_deg == pytest.approx(WEST, abs=1e-6)


def test_place_beside_a_oneway_meets_its_only_direction(graph, roads):
    _, positions = roads.snap("goal", place(3900.0, 3000.0), 1000.0)
    (position,) = positions
    assert ends(graph, position.link_idx) == (1, 3)
    assert position.offset_m == pytest.approx(3000.0, abs=2.0)


def test_place_beyond_a_bend_meets_the_bend_and_the_name(graph, roads):
    snapped, positions = roads.snap("start", place(2000.0, 700.0), 1000.0)
    assert snapped.road_name == "South Side"
    assert snapped.distance_m == pytest.approx(200.0, rel=1e-3)
    half = math.hypot(*BEND_M)
    assert [p.offset_m for p in positions] == pytest.approx([half, half], rel=1e-3)


@pytest.mark.parametrize("corner", range(6))
def test_place_on_a_node_keeps_off_the_link_ends(graph, roads, corner):
    snapped, positions = roads.snap("start", place(*PLACES_M[corner]), 1000.0)
    assert snapped.distance_m < 0.02
    for position in positions:
        length = float(graph.length_m[position.link_idx])
        assert END_MARGIN_M * 0.999 <= position.offset_m <= length - END_MARGIN_M * 0.999


def test_places_on_near_roads_begin_with_the_nearest_and_end_at_the_limit(graph, roads):
    here = place(100.0, 50.0)
    near = roads.near("here", here, 5000.0, 3)
    assert near[0] == roads.snap("here", here, 5000.0)[0]
    assert len(near) == 3
    assert len({met.link_idx for met in near}) == 3
    assert [met.distance_m for met in near] == sorted(met.distance_m for met in near)
    assert len(roads.near("here", here, near[1].distance_m + 1.0, 5)) == 2
    with pytest.raises(PointFarFromRoadError):
        roads.near("here", here, 1.0, 3)


def test_nearest_road_on_a_high_latitude_counts_metres_not_degrees(graph, roads):
    # 700 m east of the west side and 900 m south of the north side; in degrees the north side would be nearer
    snapped, _ = roads.snap("start", place(700.0, 3100.0), 1000.0)
    assert set(ends(graph, snapped.link_idx)) == {0, 2}
    assert snapped.distance_m == pytest.approx(700.0, rel=1e-3)


@pytest.mark.parametrize(
    ("lat", "lon"),
    [(59.9, 10.02), (60.1, 10.02), (60.01, 9.9), (60.01, 10.2), (math.nan, 10.02), (60.01, math.nan), (math.inf, 10.0)],
)
def test_point_outside_the_map_is_refused_with_its_bounds(graph, roads, lat, lon):
    with pytest.raises(PointOutsideMapError) as refusal:
        roads.snap("goal", Point(lat, lon), 1000.0)
    error = refusal.value
    assert error.field == "goal"
    assert error.bbox == graph.meta.bbox
    assert str(error).startswith("goal (lat ")
    assert "allowed: lat 60..60.0" in str(error)


@pytest.mark.parametrize(("east_m", "north_m"), [(-0.4, 1000.0), (-999.0, 1000.0), (70.0, 4000.4), (4000.4, -0.4)])
def test_place_beyond_the_outermost_road_is_snapped_within_the_limit(graph, roads, east_m, north_m):
    point = place(east_m, north_m)
    west, south, east, north = graph.meta.bbox
    assert not (south <= point.lat_deg <= north and west <= point.lon_deg <= east)
    snapped, _ = roads.snap("start", point, 1000.0)
    off_m = math.hypot(max(-east_m, east_m - 4000.0, 0.0), max(-north_m, north_m - 4000.0, 0.0))
    assert snapped.distance_m == pytest.approx(off_m, rel=2e-3, abs=0.02)


def test_place_just_beyond_the_limit_outside_the_map_is_told_its_road_and_bounds_that_exclude_it(roads):
    point = place(2000.0, -0.4)  # 430 m from the bend, and by its place 0.4 m outside
    with pytest.raises(PointOutsideMapError) as refusal:
        roads.snap("start", point, 300.0)
    said = str(refusal.value)
    assert refusal.value.nearest.name == "South Side"
    assert refusal.value.nearest.distance_m == pytest.approx(485.5, rel=2e-3)  # 500.4 m · cos(atan(500 / 2000))
    assert f"{refusal.value.nearest.distance_m:.0f} m from the nearest road 'South Side' at lat 60.00" in said
    value, low, high = map(float, re.search(r"lat ([\d.]+), lon.*allowed: lat ([\d.]+)\.\.([\d.]+)", said).groups())
    assert not low <= value <= high


@pytest.mark.parametrize("beyond_m", [0.3, 0.004])
def test_distance_beyond_the_limit_is_shown_above_it(roads, beyond_m):
    point = place(1000.3, 2500.0)
    limit_m = roads.snap("start", point, 2000.0)[0].distance_m - beyond_m
    with pytest.raises(PointFarFromRoadError) as refusal:
        roads.snap("start", point, limit_m)
    shown = float(re.search(r"is ([\d.]+) m from the nearest road", str(refusal.value))[1])
    assert limit_m < shown == pytest.approx(limit_m + beyond_m, abs=0.5)


@pytest.mark.parametrize(("lat", "lon", "hint"), [(10.02, 60.01, True), (10.02, 50.0, False), (60.5, 10.02, False)])
def test_swapped_latitude_and_longitude_are_asked_about(roads, lat, lon, hint):
    with pytest.raises(PointOutsideMapError) as refusal:
        roads.snap("goal", Point(lat, lon), 1000.0)
    assert refusal.value.swapped is hint
    assert str(refusal.value).endswith(f"; did you mean lat {lon:g}, lon {lat:g}?") is hint


def test_place_far_off_its_road_is_told_with_the_road(roads):
    points = [roads.snap("start", place(2000.0, north_m), 1000.0)[0] for north_m in (510.0, 700.0)]
    assert moved_warnings(("start", "goal"), points) == (
        "goal is 200 m from the nearest road 'South Side' and was moved there",
    )


def test_corners_of_the_map_are_inside_it(graph, roads):
    west, south, east, north = graph.meta.bbox
    for lat, lon in ((south, west), (south, east), (north, west), (north, east)):
        snapped, _ = roads.snap("start", Point(lat, lon), 1000.0)
        assert snapped.distance_m < 1.0


def test_point_farther_than_the_limit_is_refused_with_its_distance(roads):
    middle = place(1500.0, 2200.0)  # 1500 m from the west side, 1700 m from the bend
    with pytest.raises(PointFarFromRoadError) as refusal:
        roads.snap("origin", middle, 1000.0)
    error = refusal.value
    assert (error.field, error.limit_m) == ("origin", 1000.0)
    assert error.distance_m == pytest.approx(1500.0, rel=2e-3)
    assert "at most 1000 m" in str(error)


def test_point_just_within_and_just_beyond_the_limit_differ(roads):
    point = place(999.0, 2500.0)
    assert roads.snap("start", point, 1000.0)[0].distance_m == pytest.approx(999.0, rel=1e-3)
    with pytest.raises(PointFarFromRoadError):
        roads.snap("start", place(1003.0, 2500.0), 1000.0)


LINE = np.array([(10.0, 60.0), (10.002, 60.0), (10.002, 60.001)])  # two legs of the same length in metres


def test_part_of_a_line_from_end_to_end_is_the_line():
    np.testing.assert_array_equal(part_of_line(LINE, 0.0, 1.0), LINE)


def test_part_of_a_line_across_its_corner_keeps_the_corner():
    part = part_of_line(LINE, 0.25, 0.75)
    np.testing.assert_allclose(part, [(10.001, 60.0), (10.002, 60.0), (10.002, 60.0005)], atol=1e-7)


def test_parts_of_a_line_join_without_a_gap():
    shares = np.linspace(0.0, 1.0, 12)
    parts = [part_of_line(LINE, a, b) for a, b in itertools.pairwise(shares)]
    for part, following in itertools.pairwise(parts):
        np.testing.assert_allclose(part[-1], following[0], atol=1e-12)
    assert min(len(part) for part in parts) >= 2
    np.testing.assert_allclose(parts[0][0], LINE[0])
    np.testing.assert_allclose(parts[-1][-1], LINE[-1])
