"""Roundabouts: which exit, what kind, and small ones that are turns."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import pytest

from routing.graph.files import load_graph, save_graph
from routing.guidance.instructions import instruction_of
from routing.guidance.steps import steps_of
from tests.routing.guidance.driven import drawn, driven, said, street

if TYPE_CHECKING:
    from pathlib import Path

EAST, NORTH, WEST, SOUTH = 0, 90, 180, 270  # by angle from the middle, counter-clockwise from east
SIDES = {EAST: "East Road", NORTH: "North Road", WEST: "West Road", SOUTH: "South Road"}


def ring(
    draw_map: Any,
    *,
    radius_m: float = 25.0,
    clockwise: bool = False,
    name: str = "",
    parts: int = 1,
    sides: dict[int, Any] | None = None,
    beside: dict[int, Any] | None = None,
    yards: dict[int, tuple[float, float]] | None = None,
) -> Any:
    """A roundabout with a road to each side; node 1000 + angle is its far end, 2000 + angle where it meets the ring."""
    sides = {angle: {} for angle in SIDES} if sides is None else sides
    points: dict[int, tuple[float, float]] = dict(yards or {})
    ways: dict[int, Any] = dict(beside or {})
    angles = sorted({*range(0, 360, 30), *sides})
    for angle in angles:
        x, y = math.cos(math.radians(angle)), math.sin(math.radians(angle))
        points[2000 + angle] = (radius_m * x, radius_m * y)
        if angle in sides:
            points[1000 + angle] = (200.0 * x, 200.0 * y)
            tags = street(SIDES.get(angle, f"Road {angle}")) | sides[angle]
            ways[10 + angle] = ([1000 + angle, 2000 + angle], tags)
    order = [2000 + angle for angle in angles]
    order = [*order, order[0]]
    if clockwise:
        order = order[::-1]
    tags = {"highway": "residential", "junction": "roundabout"} | ({"name": name} if name else {})
    step = math.ceil(len(order) / parts)
    for k in range(parts):
        ways[500 + k] = (order[k * step : (k + 1) * step + 1], tags)
    return drawn(draw_map, points, ways)


def through(graph: Any, come: int, leave: int) -> list[str]:
    return said(graph, 1000 + come, 2000 + leave, 1000 + leave)


@pytest.mark.parametrize("parts", [1, 3])
def test_exits_are_counted_from_the_entry_on(draw_map: Any, parts: int) -> None:
    graph = ring(draw_map, parts=parts)  # driven counter-clockwise; from the south: east, north, west, south
    for number, side in enumerate((EAST, NORTH, WEST), 1):
        found = through(graph, SOUTH, side)
        assert found[0].startswith(f"roundabout {number} ")
        assert found[0].endswith(SIDES[side])
        assert found[1].startswith(f"exit roundabout {number} ")
        assert len(found) == 2


def test_exits_are_counted_the_other_way_where_traffic_keeps_left(draw_map: Any) -> None:
    graph = ring(draw_map, clockwise=True)
    assert [through(graph, SOUTH, side)[0].split()[1] for side in (WEST, NORTH, EAST)] == ["1", "2", "3"]
    assert through(graph, SOUTH, WEST)[0].split()[2] in ("slight", "left")


def test_ways_out_that_may_not_be_driven_do_not_count(draw_map: Any) -> None:
    for tags in ({"oneway": "yes"}, {"access": "no"}, {"highway": "footway"}):  # ways are drawn towards the ring
        sides = {EAST: tags, NORTH: {}, WEST: {}, SOUTH: {}}
        graph = ring(draw_map, sides=sides, beside={900: ([1000 + EAST, 1000 + NORTH], street("Back Lane"))})
        assert through(graph, SOUTH, NORTH)[0].split()[1] == "1"


def test_way_back_by_the_road_that_one_came_by_is_the_last_exit(draw_map: Any) -> None:
    graph = ring(draw_map)
    found = said(graph, 1000 + SOUTH, 2000 + WEST, 2000 + SOUTH, 1000 + SOUTH)
    assert found[0].startswith("roundabout 4 ")


def test_roundabout_with_a_name_of_its_own_is_a_rotary(draw_map: Any) -> None:
    graph = ring(draw_map, name="Rotunda da Boavista")
    enter, leave = steps_of(graph, driven(graph, 1000 + SOUTH, 2000 + NORTH, 1000 + NORTH))[1:-1]
    assert (enter.type, enter.exit, enter.rotary_name) == ("rotary", 2, "Rotunda da Boavista")
    assert (enter.name, leave.name, leave.type) == ("North Road", "North Road", "exit rotary")
    assert through(ring(draw_map, name="North Road"), SOUTH, NORTH)[0].startswith("roundabout 2")


def test_small_roundabout_is_told_as_a_turn_where_that_is_clear(draw_map: Any) -> None:
    graph = ring(draw_map, radius_m=10.0)
    assert through(graph, SOUTH, EAST) == ["roundabout turn 1 right East Road"]
    assert through(graph, SOUTH, NORTH) == ["roundabout turn 2 straight North Road"]
    assert through(graph, SOUTH, WEST) == ["roundabout turn 3 left West Road"]
    close = ring(draw_map, radius_m=10.0, sides={EAST: {}, 30: {}, WEST: {}, SOUTH: {}})
    assert through(close, SOUTH, EAST)[0].startswith("roundabout 1")


def test_route_that_ends_in_a_roundabout_has_no_exit(draw_map: Any) -> None:
    graph = ring(draw_map)
    (enter,) = steps_of(graph, driven(graph, 1000 + SOUTH, 2000 + NORTH))[1:-1]
    assert (enter.type, enter.exit) == ("roundabout", None)


def test_route_that_begins_in_a_roundabout_leaves_it(draw_map: Any) -> None:
    graph = ring(draw_map)
    (leave,) = said(graph, 2000 + EAST, 2000 + NORTH, 1000 + NORTH)
    assert leave.startswith(("exit roundabout right", "exit roundabout slight right"))


def test_driveways_are_counted_though_they_are_no_roads(draw_map: Any) -> None:
    driveway = {"highway": "service", "service": "driveway"}
    out = {900: ([2000 + 60, 3000], driveway)}  # between the ways out to the east and the north
    into = {901: ([3000, 2000 + 60], driveway | {"oneway": "yes"})}
    private = {902: ([2000 + 60, 3000], driveway | {"access": "no"})}
    for beside, number in ((out, "3"), (into, "2"), (private, "2"), ({}, "2")):
        graph = ring(draw_map, beside=beside, yards={3000: (60.0, 90.0)})
        assert through(graph, SOUTH, NORTH)[0].split()[1] == number
        assert through(graph, SOUTH, EAST)[0].split()[1] == "1"


def test_driveways_are_counted_where_ways_of_the_ring_join_too(draw_map: Any) -> None:
    driveway = {"highway": "service", "service": "driveway"}
    angles = [2000 + angle for angle in range(0, 360, 30)]
    joint = angles[4]  # of 12 points in 3 ways of 4: at 120° the second begins
    graph = ring(draw_map, parts=3, beside={900: ([joint, 3000], driveway)}, yards={3000: (-40.0, 80.0)})
    assert through(graph, SOUTH, WEST)[0].split()[1] == "4"
    assert through(graph, SOUTH, NORTH)[0].split()[1] == "2"


def test_left_out_exits_come_back_from_files(draw_map: Any, tmp_path: Path) -> None:
    beside = {900: ([2000 + 60, 3000], {"highway": "service", "service": "parking_aisle"})}
    graph = ring(draw_map, beside=beside, yards={3000: (60.0, 90.0)})
    save_graph(graph, tmp_path / "graph")
    assert through(load_graph(tmp_path / "graph"), SOUTH, NORTH)[0].split()[1] == "3"


@pytest.mark.parametrize("clockwise", [False, True])
def test_roundabouts_that_touch_are_each_told(draw_map: Any, clockwise: bool) -> None:
    points: dict[int, Any] = {1: (-200, 0), 2: (0, 200), 3: (280, 0), 4: (80, -200), 5: (0, -200)}
    rings = {}
    for k, middle_m in ((100, 0.0), (200, 80.0)):  # radii of 40 m
        for angle in range(0, 360, 30):
            x, y = math.cos(math.radians(angle)), math.sin(math.radians(angle))
            points[k + angle // 30] = (middle_m + 40.0 * x, 40.0 * y)
        rings[k] = [*range(k, k + 12), k]
    rings[200] = [100 if point == 206 else point for point in rings[200]]  # its west is the east of the first one
    del points[206]
    tags = {"highway": "residential", "junction": "roundabout"}
    ways = {k: (nodes[::-1] if clockwise else nodes, tags) for k, nodes in rings.items()}
    ways |= {
        10: ([1, 106], street("West Road")),
        11: ([2, 103], street("North Road")),
        12: ([3, 200], street("East Road")),
        13: ([4, 209], street("South Road")),
        14: ([5, 109], street("Back Road")),
    }
    graph = drawn(draw_map, points, ways)
    found = said(graph, 1, 106, 100, 200, 3)
    # by the first one past Back Road, or with the clock past North Road; by the second past South Road, or past none
    assert [text.split()[:2] for text in found[:2]] == [["roundabout", "2"], ["roundabout", "1" if clockwise else "2"]]
    assert found[-1].startswith("exit roundabout")
    assert found[-1].endswith("East Road")
    assert len(found) == 3
    past = said(graph, 1, 106, 109, 100, 103, 2) if not clockwise else said(graph, 1, 106, 103, 100, 109, 5)
    assert past[0].startswith("roundabout 3")  # the other ring is a way out that is passed


def test_mini_roundabout_is_told_as_a_turn_with_the_number_of_its_exit(draw_map: Any) -> None:
    points = {1: (0, 0), 2: (0, 200), 3: (200, 0), 4: (-200, 0), 5: (0, -200)}
    ways = {
        10: ([5, 1], street("South Road")),
        11: ([1, 2], street("North Road")),
        12: ([1, 3], street("East Road")),
        13: ([4, 1], street("West Road")),
    }
    mini = {1: {"highway": "mini_roundabout"}}
    graph = drawn(draw_map, points, ways, point_tags=mini)
    assert said(graph, 5, 1, 3) == ["roundabout turn 1 right East Road"]
    assert said(graph, 5, 1, 2) == ["roundabout turn 2 straight North Road"]
    assert said(graph, 5, 1, 4) == ["roundabout turn 3 left West Road"]
    assert graph.signs is not None
    left = replace(graph, signs=replace(graph.signs, drives_left=True))
    assert said(left, 5, 1, 4) == ["roundabout turn 1 left West Road"]
    assert said(left, 5, 1, 3) == ["roundabout turn 3 right East Road"]
    step = steps_of(graph, driven(graph, 5, 1, 2))[1]
    assert instruction_of(step) == "At the roundabout go straight onto North Road"
    plain = drawn(draw_map, points, ways)
    assert said(plain, 5, 1, 2) == ["new name straight North Road"]
