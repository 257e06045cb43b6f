"""Roundabouts: which exit, what kind, and small ones that are turns."""

from __future__ import annotations

import math
from typing import Any

import pytest

from routing.guidance.steps import steps_of
from tests.routing.guidance.driven import drawn, driven, said, street

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
) -> Any:
    """A roundabout with a road to each side; node 1000 + angle is its far end, 2000 + angle where it meets the ring."""
    sides = {angle: {} for angle in SIDES} if sides is None else sides
    points: dict[int, tuple[float, float]] = {}
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


def test_small_roundabout_is_foundas_a_turn_where_that_is_clear(draw_map: Any) -> None:
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
