"""What is told at junctions drawn as real ones are: forks, ramps, slip roads, islands, two carriageways, ferries."""

from __future__ import annotations

import gc
from typing import Any

import pytest

from routing.guidance import surroundings
from routing.guidance.bearings import modifier_of
from routing.guidance.instructions import instruction_of, ordinal
from routing.guidance.labels import label_of, same_road
from routing.guidance.lanes import lanes_for
from routing.guidance.step import Modifier, StepType
from routing.guidance.steps import steps_of
from routing.importers.region import import_region
from tests.routing.guidance.driven import drawn, driven, said, street

ONEWAY = {"oneway": "yes"}


def test_fork_of_like_roads_is_foundwith_its_side(draw_map: Any) -> None:
    places = {1: (0, 0), 2: (0, 200), 3: (-80, 400), 4: (80, 400)}
    ways = {10: ([1, 2], street("A")), 11: ([2, 3], street("B")), 12: ([2, 4], street("C"))}
    graph = drawn(draw_map, places, ways)
    assert said(graph, 1, 2, 3) == ["fork slight left B"]
    assert said(graph, 1, 2, 4) == ["fork slight right C"]


def test_road_that_keeps_its_name_straight_on_is_no_fork(draw_map: Any) -> None:
    places = {1: (0, 0), 2: (0, 200), 3: (0, 400), 4: (80, 400)}
    ways = {10: ([1, 2, 3], street("A")), 12: ([2, 4], street("C"))}
    graph = drawn(draw_map, places, ways)
    assert said(graph, 1, 2, 3) == []
    assert said(graph, 1, 2, 4) == ["turn slight right C"]


def test_road_that_bends_where_another_goes_straight_on_is_told(draw_map: Any) -> None:
    places = {1: (0, 0), 2: (0, 200), 3: (200, 200), 4: (0, 400)}
    ways = {10: ([1, 2, 3], street("Main")), 11: ([2, 4], street("Side"))}
    graph = drawn(draw_map, places, ways)
    assert said(graph, 1, 2, 3) == ["continue right Main"]
    assert said(graph, 1, 2, 4) == ["new name straight Side"]


def test_road_that_bends_where_the_only_other_one_leads_back_is_not_told(draw_map: Any) -> None:
    places = {1: (0, 0), 2: (0, 200), 3: (180, 300), 4: (-180, 80)}
    ways = {10: ([1, 2, 3], street("Main")), 11: ([2, 4], street("Side"))}
    graph = drawn(draw_map, places, ways)
    assert said(graph, 1, 2, 3) == []
    assert said(graph, 1, 2, 4) == ["turn sharp left Side"]


def test_road_that_ends_and_one_that_bends_there_differ(draw_map: Any) -> None:
    places = {1: (0, 0), 2: (0, 200), 3: (200, 200), 4: (-200, 200)}
    ends = {10: ([1, 2], street("A")), 11: ([3, 2, 4], street("B"))}
    assert said(drawn(draw_map, places, ends), 1, 2, 3) == ["end of road right B"]
    bends = {10: ([1, 2, 3], street("A")), 11: ([2, 4], street("B"))}
    graph = drawn(draw_map, places, bends)
    assert said(graph, 1, 2, 3) == ["continue right A"]
    assert said(graph, 1, 2, 4) == ["turn left B"]  # it is not the end of A


#      motorway 1 ───────── 2 ═════ 3 ───────── 4       ramp 2-5 leaves, ramp 6-3 joins
MOTORWAY = {1: (0, 0), 2: (1000, 0), 3: (2000, 0), 4: (3000, 0), 5: (1300, -60), 6: (1700, -60), 7: (1500, -300)}
BIG = {"highway": "motorway", "ref": "A 1", "name": "Autoestrada do Norte"}
RAMPS = {
    10: ([1, 2, 3, 4], BIG),
    11: ([2, 5], {"highway": "motorway_link", "destination": "Porto;Gaia", "destination:ref": "A 20", **ONEWAY}),
    12: ([6, 3], {"highway": "motorway_link", **ONEWAY}),
    13: ([5, 7, 6], street("Village Road")),
    14: ([4, 7], street("Way Back", oneway="yes")),
    15: ([7, 1], street("Way There", oneway="yes")),
}


def test_ramps_are_left_by_number_and_joined_by_side(draw_map: Any) -> None:
    tags = {2: {"highway": "motorway_junction", "ref": "12"}}
    graph = drawn(draw_map, MOTORWAY, RAMPS, point_tags=tags)
    assert said(graph, 1, 2, 3, 4) == []
    off = steps_of(graph, driven(graph, 1, 2, 5))[1]
    assert (off.type, off.modifier, off.exits) == (StepType.OFF_RAMP, Modifier.SLIGHT_RIGHT, "12")
    assert off.destinations == "A 20: Porto, Gaia"
    assert instruction_of(off) == "Take exit 12 on the right towards A 20: Porto, Gaia"
    on = steps_of(graph, driven(graph, 5, 7, 6, 3, 4))[-3:-1]
    assert [step.type for step in on] == [StepType.ON_RAMP, StepType.MERGE]
    assert (on[1].modifier, on[1].ref) == (Modifier.SLIGHT_LEFT, "A 1")
    assert instruction_of(on[1]) == "Merge left onto Autoestrada do Norte (A 1)"


def test_number_on_the_ramp_wins_over_that_of_the_junction(draw_map: Any) -> None:
    ways = {**RAMPS, 11: ([2, 5], RAMPS[11][1] | {"junction:ref": "12A"})}  # type: ignore[operator]
    graph = drawn(draw_map, MOTORWAY, ways, point_tags={2: {"highway": "motorway_junction", "ref": "12"}})
    assert steps_of(graph, driven(graph, 1, 2, 5))[1].exits == "12A"


def test_slip_road_is_a_turn_foundwhere_it_leaves(draw_map: Any) -> None:
    places = {1: (0, 0), 2: (0, 100), 3: (0, 150), 4: (50, 150), 5: (300, 150), 6: (0, 300), 7: (-300, 150)}
    main = {"highway": "secondary"}
    ways = {
        10: ([1, 2, 3, 6], main | {"name": "North Road"}),
        11: ([7, 3, 4, 5], main | {"name": "East Road"}),
        12: ([2, 4], {"highway": "secondary_link", **ONEWAY}),
    }
    graph = drawn(draw_map, places, ways)
    turn = steps_of(graph, driven(graph, 1, 2, 4, 5))[1:-1]
    assert [(step.type, step.modifier, step.name) for step in turn] == [("turn", "right", "East Road")]
    assert said(graph, 1, 2, 3, 6) == []


# a road of two carriageways, 20 m apart, crossed by a street:   3 ←─── 4 ←─── 5
#                                                                      │
#                                                         6 ───→ 7 ───→ 8
CARRIAGEWAYS = {
    3: (-300, 20),
    4: (0, 20),
    5: (300, 20),
    6: (-300, 0),
    7: (0, 0),
    8: (300, 0),
    9: (0, 300),
    10: (0, -300),
}
AVENUE = street("Avenida", oneway="yes", highway="primary")
CROSSED = {
    10: ([6, 7, 8], AVENUE),
    11: ([5, 4, 3], AVENUE),
    12: ([10, 7, 4, 9], street("Rua")),
    13: ([3, 6], street("West End")),
    14: ([8, 5], street("East End")),
}


def test_two_carriageways_are_one_road_to_a_driver(draw_map: Any) -> None:
    graph = drawn(draw_map, CARRIAGEWAYS, CROSSED)
    assert said(graph, 6, 7, 8) == []
    assert said(graph, 10, 7, 4, 9) == []
    assert said(graph, 6, 7, 4, 9) == ["turn left Rua"]
    assert said(graph, 10, 7, 4, 3) == ["turn left Avenida"]
    assert said(graph, 6, 7, 10) == ["turn right Rua"]
    assert said(graph, 6, 7, 4, 3) == ["continue uturn Avenida"]


def test_island_on_a_road_is_nothing(draw_map: Any) -> None:
    places = {1: (0, 0), 2: (100, 0), 3: (110, 4), 4: (110, -4), 5: (120, 0), 6: (300, 0)}
    ways = {
        10: ([1, 2], street("A")),
        11: ([5, 3, 2], street("A", oneway="yes")),
        12: ([2, 4, 5], street("A", oneway="yes")),
        13: ([5, 6], street("A")),
    }
    graph = drawn(draw_map, places, ways)
    assert said(graph, 1, 2, 5, 6) == said(graph, 6, 5, 2, 1) == []


def test_staggered_crossing_over_a_named_road_stays_two_turns(draw_map: Any) -> None:
    places = {1: (0, 0), 2: (0, 100), 3: (25, 100), 4: (25, 200), 5: (-200, 100), 6: (300, 100)}
    ways = {10: ([1, 2], street("A")), 11: ([5, 2, 3, 6], street("B")), 12: ([3, 4], street("C"))}
    graph = drawn(draw_map, places, ways)
    assert said(graph, 1, 2, 3, 4) == ["end of road right B", "turn left C"]


def test_fork_and_a_turn_behind_it_stay_two(draw_map: Any) -> None:
    places = {1: (0, 0), 2: (0, 200), 3: (2, 225), 4: (200, 260), 5: (120, 380), 6: (-200, 240)}
    ways = {
        10: ([1, 2], street("A")),
        11: ([2, 3], street("")),
        12: ([3, 4], street("B")),
        13: ([2, 5], street("C")),
        14: ([3, 6], street("D")),
    }
    found = said(drawn(draw_map, places, ways), 1, 2, 3, 4)
    assert found == ["fork slight left", "end of road right B"]


def test_ferry_is_notified_and_so_is_leaving_it(draw_map: Any) -> None:
    places = {1: (0, 0), 2: (200, 0), 3: (1200, 0), 4: (1500, 0)}
    ways = {
        10: ([1, 2], street("Quay")),
        11: ([2, 3], {"route": "ferry", "name": "The Ferry", "motor_vehicle": "yes", "duration": "00:10"}),
        12: ([3, 4], street("Island Road")),
    }
    graph = import_region(draw_map(places, ways), [], "ferry", ferries=True)
    steps = steps_of(graph, driven(graph, 1, 2, 3, 4))
    assert [step.type.value for step in steps[1:-1]] == ["notification", "notification"]
    assert [step.mode.value for step in steps[:3]] == ["driving", "ferry", "driving"]
    assert [instruction_of(step) for step in steps[1:3]] == [
        "Take the ferry The Ferry",
        "Leave the ferry onto Island Road",
    ]


def test_lanes_are_valid_where_their_arrow_is_the_nearest_to_the_turn(draw_map: Any) -> None:
    left = lanes_for("left|through|through;right", -85.0)
    assert [lane.valid for lane in left] == [True, False, False]
    assert [lane.valid for lane in lanes_for("left|through|through;right", 3.0)] == [False, True, True]
    assert lanes_for("left|through|through;right", 88.0)[2].indications == ("straight", "right")
    assert [lane.valid for lane in lanes_for("reverse|left|", -170.0)] == [True, False, False]
    assert [lane.valid for lane in lanes_for("none|through;right", -90.0)] == [True, False]
    assert lanes_for("||", 0.0) == lanes_for("", 0.0) == ()
    places = {1: (0, 0), 2: (0, 200), 3: (0, 400), 4: (-200, 200)}
    ways = {
        10: ([1, 2], street("A", oneway="yes", turn__lanes="left|through")),
        11: ([2, 3], street("A")),
        12: ([2, 4], street("B")),
        13: ([3, 1], street("Round", oneway="yes")),
    }
    graph = drawn(draw_map, places, ways)
    step = steps_of(graph, driven(graph, 1, 2, 4))[1]
    assert [(lane.indications, lane.valid) for lane in step.lanes] == [(("left",), True), (("straight",), False)]
    assert step.lanes == step.intersections[0].lanes


@pytest.mark.parametrize(
    ("turn_deg", "modifier"),
    [(0.0, "straight"), (-20.0, "straight"), (30.0, "slight right"), (-90.0, "left"), (130.0, "sharp right")],
)
def test_modifier_names_the_size_and_side_of_a_turn(turn_deg: float, modifier: str) -> None:
    assert modifier_of(turn_deg) == modifier


def test_labels_are_of_one_road_by_name_or_number() -> None:
    assert same_road(label_of("Rua do Doutor Alfredo de Magalhães", ""), label_of("Rua Doutor Alfredo Magalhaes", ""))
    assert same_road(label_of("Autoestrada Porto - Amarante", "A 4"), label_of("Porto - Amarante", "A4;IP 4"))
    assert same_road(label_of("Main Street", "B 9"), label_of("", "B 9"))
    assert same_road(label_of("CG-2", ""), label_of("CG-2 - Avinguda", "CG 2"))
    assert not same_road(label_of("Main Street", "B 9"), label_of("High Street", "B 9"))
    assert not same_road(label_of("Rua A", ""), label_of("Rua B", ""))
    assert not same_road(label_of("", ""), label_of("", ""))


def test_rows_without_lanes_of_their_own_are_not_counted_as_any() -> None:
    assert lanes_for("nonsense|nonsense", 0.0) == ()


@pytest.mark.parametrize(
    ("number", "text"), [(1, "1st"), (2, "2nd"), (3, "3rd"), (4, "4th"), (11, "11th"), (22, "22nd")]
)
def test_exits_are_counted_in_words(number: int, text: str) -> None:
    assert ordinal(number) == text


def test_what_is_known_of_a_graph_goes_with_its_arrays(draw_map: Any) -> None:
    places = {1: (0, 0), 2: (0, 200), 3: (0, 400)}
    graph = drawn(draw_map, places, {10: ([1, 2, 3], street("A"))})
    before = len(surroundings._known)
    assert surroundings.surroundings_of(graph) is surroundings.surroundings_of(graph)
    assert len(surroundings._known) == before + 1
    del graph
    gc.collect()
    assert len(surroundings._known) <= before
