"""What is told along drives over small maps, and what each step says of its way."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import pairwise
from typing import Any

import pytest

from energy.folders import ROOT
from energy.vehicle.files import load_vehicle
from routing.graph.files import load_graph
from routing.guidance.instructions import instruction_of
from routing.guidance.step import Modifier, StepType
from routing.guidance.steps import steps_of
from routing.places import Point
from routing.planner import Planner
from routing.queries import RouteQuery
from routing.route.route import LegEnd
from routing.weights import NAMED_WEIGHTS
from tests.routing.guidance.driven import drawn, driven, said, street

# a crossing of two streets, and a T at the end of one:      3     7
#                                                            |     |
#                                                        1---2-----6
#                                                            |     |
#                                                            4     8
PLACES = {1: (0, 0), 2: (100, 0), 3: (100, 100), 4: (100, -100), 6: (300, 0), 7: (300, 100), 8: (300, -100)}
WAYS = {
    10: ([1, 2, 6], street("Long Street")),
    11: ([3, 2, 4], street("Cross Street")),
    12: ([7, 6, 8], street("Last Street")),
}


def test_crossing_is_told_only_where_it_is_turned_at(draw_map: Any) -> None:
    graph = drawn(draw_map, PLACES, WAYS)
    assert said(graph, 1, 2, 6, 7) == ["end of road left Last Street"]
    assert said(graph, 1, 2, 3) == ["turn left Cross Street"]
    assert said(graph, 1, 2, 4) == ["turn right Cross Street"]
    assert said(graph, 3, 2, 4) == []
    assert said(graph, 7, 6, 2) == ["turn right Long Street"]


def test_steps_follow_each_other_without_gaps_and_add_up_to_the_route(draw_map: Any) -> None:
    graph = drawn(draw_map, PLACES, WAYS)
    route = driven(graph, 1, 2, 6, 7)
    steps = steps_of(graph, route)
    assert [step.type for step in steps] == [StepType.DEPART, StepType.END_OF_ROAD, StepType.ARRIVE]
    assert sum(step.distance_m for step in steps) == pytest.approx(route.distance_m)
    assert sum(step.duration_s for step in steps) == pytest.approx(route.duration_s)
    assert sum(step.energy_j for step in steps) == pytest.approx(route.energy_j)
    assert (steps[0].soc_start_frac, steps[-1].soc_end_frac) == (route.soc_start_frac, route.soc_end_frac)
    for before, after in pairwise(steps):
        assert after.first_link == before.last_link + 1
        assert after.geometry_first == before.geometry_last
        assert after.soc_start_frac == before.soc_end_frac
    for step in steps:
        lon, lat = route.geometry[step.geometry_first]
        assert step.at == (lat, lon)
    assert steps[-1].last_link == len(route.links) - 1 < steps[-1].first_link


def test_turn_has_bearings_and_the_roads_that_meet_clockwise_from_north(draw_map: Any) -> None:
    graph = drawn(draw_map, PLACES, WAYS)
    turn = steps_of(graph, driven(graph, 1, 2, 4))[1]
    assert turn.bearing_before_deg == pytest.approx(90.0, abs=0.5)
    assert turn.bearing_after_deg == pytest.approx(180.0, abs=0.5)
    (junction,) = turn.intersections
    assert junction.bearings == (0, 90, 180, 270)
    assert junction.entry == (True, True, True, False)  # turning back is not permitted there
    assert (junction.in_idx, junction.out_idx) == (3, 2)


def test_junctions_passed_without_a_step_are_intersections_of_the_step_before(draw_map: Any) -> None:
    graph = drawn(draw_map, PLACES, WAYS)
    depart, turn, arrive = steps_of(graph, driven(graph, 1, 2, 6, 7))
    assert [len(step.intersections) for step in (depart, turn, arrive)] == [2, 1, 1]
    assert depart.intersections[1].bearings == (0, 90, 180, 270)
    assert (arrive.intersections[0].in_idx, arrive.intersections[0].out_idx) == (0, None)


def test_each_leg_departs_and_arrives_and_says_its_charge(draw_map: Any) -> None:
    graph = drawn(draw_map, PLACES, WAYS)
    route = driven(graph, 1, 2, 6, 7, via=(1,))
    steps = steps_of(graph, route)
    kinds = [step.type.value for step in steps]
    assert kinds == ["depart", "arrive", "depart", "arrive"]  # the via point is at the junction: it is departed from
    assert steps[1].soc_end_frac == route.legs[0].soc_end_frac == steps[2].soc_start_frac
    assert steps[2].first_link == route.legs[1].first_link


def test_turning_back_at_a_dead_end_is_a_u_turn(draw_map: Any) -> None:
    graph = drawn(draw_map, PLACES, WAYS)
    step = steps_of(graph, driven(graph, 3, 2, 4, 2, 3))[1]
    assert (step.type, step.modifier) == (StepType.CONTINUE, Modifier.UTURN)


def test_name_that_changes_where_the_way_is_obvious_is_a_new_name(draw_map: Any) -> None:
    places = {1: (0, 0), 2: (100, 0), 3: (200, 0), 4: (600, 0), 5: (900, 0)}
    ways = {
        10: ([1, 2], street("Rua do Campo")),
        11: ([2, 3], street("Rua de Campo")),  # small words are written now and then
        12: ([3, 4], street("Ponte Nova")),
        13: ([4, 5], street("Ponte Nova", ref="N 1")),
    }
    graph = drawn(draw_map, places, ways)
    assert said(graph, 1, 5) == ["new name straight Ponte Nova"]


def test_road_that_has_its_name_back_after_a_bridge_is_not_told(draw_map: Any) -> None:
    places = {1: (0, 0), 2: (200, 0), 3: (280, 0), 4: (600, 0)}
    ways = {10: ([1, 2], street("Rua")), 11: ([2, 3], street("Ponte", bridge="yes")), 12: ([3, 4], street("Rua"))}
    assert said(drawn(draw_map, places, ways), 1, 4) == []


def test_graph_without_signs_is_told_by_names_and_angles(draw_map: Any) -> None:
    graph = replace(drawn(draw_map, PLACES, WAYS), signs=None)
    assert said(graph, 1, 2, 6, 7) == ["end of road left Last Street"]


@pytest.mark.parametrize(("short_m", "turns"), [(0.0, ["turn"]), (95.0, ["turn"]), (99.9, [])])
def test_route_that_begins_and_ends_within_links_turns_alike(draw_map: Any, short_m: float, turns: list[str]) -> None:
    graph = drawn(draw_map, PLACES, WAYS)
    route = driven(graph, 1, 2, 4, short_m=short_m)
    steps = steps_of(graph, route)
    assert sum(step.distance_m for step in steps) == pytest.approx(route.distance_m)
    assert steps[-1].name == "Cross Street"
    assert [step.type.value for step in steps[1:-1]] == turns  # within a metre of both ends nothing is turned
    assert all(len(step.intersections) >= 1 for step in steps)


def test_copies_of_links_that_bans_make_are_told_as_the_links(draw_map: Any) -> None:
    ban = (
        [("w", 10, "from"), ("w", 13, "via"), ("w", 12, "to")],
        {"type": "restriction", "restriction": "no_left_turn"},
    )
    places = {**PLACES, 5: (200, 0), 9: (200, 150), 11: (200, -150)}
    ways = {
        10: ([1, 2], street("Long Street")),
        13: ([2, 5, 6], street("Long Street")),
        11: ([3, 2, 4], street("Cross Street")),
        12: ([7, 6], street("Last Street")),
        15: ([6, 8], street("Last Street")),
        14: ([9, 5, 11], street("Middle Street")),
    }
    graph = drawn(draw_map, places, ways, relations=[ban])
    assert graph.copies is not None
    assert graph.signs is not None
    assert graph.signs.sign_idx.size == graph.link_count
    assert said(graph, 1, 2, 5, 6, 8) == ["end of road right Last Street"]
    assert said(graph, 3, 2, 5, 6, 7) == ["turn left Long Street", "end of road left Last Street"]


def test_roads_are_named_in_a_language_where_they_are_tagged_in_it(draw_map: Any) -> None:
    ways = {**WAYS, 11: ([3, 2, 4], street("Cross Street", name__de="Querstraße"))}
    graph = drawn(draw_map, PLACES, ways)
    route = driven(graph, 1, 2, 4)
    assert [step.name for step in steps_of(graph, route)] == ["Long Street", "Cross Street", "Cross Street"]
    assert [step.name for step in steps_of(graph, route, language="de")] == ["Long Street", "Querstraße", "Querstraße"]


def test_leg_with_a_planned_speed_departs_with_it(draw_map: Any) -> None:
    graph = drawn(draw_map, PLACES, WAYS)
    route = driven(graph, 1, 2, 4)
    capped = replace(route, legs=(replace(route.legs[0], speed_cap_mps=25.0),))
    depart, turn, _ = steps_of(graph, capped)
    assert (depart.speed_cap_mps, turn.speed_cap_mps) == (25.0, None)
    assert instruction_of(depart) == "Head east on Long Street. Plan: drive at no more than 90 km/h"


def test_charge_jumps_where_a_leg_begins_after_charging(draw_map: Any) -> None:
    graph = drawn(draw_map, PLACES, WAYS)
    route = driven(graph, 1, 2, 6, 7, via=(0,))
    first, second = route.legs
    charged = replace(route, legs=(first, replace(second, soc_start_frac=0.9)))
    steps = steps_of(graph, charged)
    assert [step.type.value for step in steps[:3]] == ["depart", "arrive", "depart"]
    assert steps[1].soc_end_frac == first.soc_end_frac < steps[2].soc_start_frac == 0.9


@pytest.mark.parametrize(
    ("east_m", "north_m", "side", "said_of_it"),
    [
        (10.0, 0.0, Modifier.LEFT, "You have arrived, on the left"),  # the route ends southwards
        (-10.0, 0.0, Modifier.RIGHT, "You have arrived, on the right"),
        (-50.0, -40.0, Modifier.RIGHT, "You have arrived, on the right"),
        (2.0, -30.0, Modifier.STRAIGHT, "You have arrived, straight ahead"),
        (2.0, 30.0, None, "You have arrived"),  # behind
        (4.0, 0.0, None, "You have arrived"),  # on the road
        (400.0, 0.0, None, "You have arrived"),  # too far to be said to be beside it
    ],
)
def test_arrival_says_on_which_side_the_goal_is(
    draw_map: Any, east_m: float, north_m: float, side: Modifier | None, said_of_it: str
) -> None:
    graph = drawn(draw_map, PLACES, WAYS)
    route = driven(graph, 1, 2, 4)
    lon, lat = route.geometry[-1].tolist()
    degree_m = 111_195.0
    goal = Point(lat + north_m / degree_m, lon + east_m / (degree_m * math.cos(math.radians(lat))))
    *_, arrival = steps_of(graph, route, asked=[goal])
    assert arrival.modifier is side
    assert instruction_of(arrival) == said_of_it


def test_sides_are_said_of_via_points_too_and_not_of_charging_stops(draw_map: Any) -> None:
    graph = drawn(draw_map, PLACES, WAYS)
    route = driven(graph, 1, 2, 6, 7, via=(0,))
    lon, lat = route.geometry[-1].tolist()
    beside = Point(lat, lon + 0.0002)
    via_lon, via_lat = route.geometry[route.links.geometry_end_idx[0]].tolist()
    arrivals = [
        step for step in steps_of(graph, route, asked=[Point(via_lat - 0.0002, via_lon), beside]) if step.ends_at
    ]
    assert [step.modifier for step in arrivals] == [Modifier.RIGHT, Modifier.RIGHT]
    first, second = route.legs
    charged = replace(route, legs=(replace(first, ends_at=LegEnd.STOP), second))
    arrivals = [step for step in steps_of(graph, charged, asked=[beside]) if step.ends_at]
    assert [step.modifier for step in arrivals] == [None, Modifier.RIGHT]


def test_route_on_the_bundled_highlands_takes_an_exit_of_its_motorway() -> None:
    planner = Planner(load_graph(ROOT / "data" / "graphs" / "highlands"))
    query = RouteQuery(
        start=Point(43.872, -36.433),
        goal=Point(43.697, -35.19),
        soc_frac=0.9,
        vehicle=load_vehicle(ROOT / "data" / "vehicles" / "hyundai-kona-64.toml"),
        weightings=(("fastest", NAMED_WEIGHTS["fastest"]),),
    )
    (route,) = planner.route(query).routes
    said_along = [instruction_of(step) for step in steps_of(planner.graph, route)]
    assert "Take the exit on the right onto Motorway M1" in said_along
