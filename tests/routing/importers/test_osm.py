"""From drawn OpenStreetMap files to graphs."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from energy.conditions import Conditions, RoadSurface
from energy.stops import Cross, FunctionalClass
from routing.errors import ImportFailedError
from routing.graph.files import load_graph, save_graph
from routing.graph.networkx_graph import from_networkx, to_networkx
from routing.graph.road_graph import RoadGraph, Terrain
from routing.importers.osm import read_osm
from routing.importers.region import LONGEST_LINK_M, import_region

STREET = {"highway": "residential"}
MAIN = {"highway": "primary"}


def links_between(graph: RoadGraph, tail_id: int, head_id: int) -> list[int]:
    tails, heads = graph.node_id[graph.tail], graph.node_id[graph.head]
    return np.flatnonzero((tails == tail_id) & (heads == head_id)).tolist()


def link(graph: RoadGraph, tail_id: int, head_id: int) -> int:
    found = links_between(graph, tail_id, head_id)
    assert len(found) == 1, f"{len(found)} links {tail_id} -> {head_id}"
    return found[0]


def follows(graph: RoadGraph, a: int, b: int, c: int) -> bool:
    return link(graph, b, c) in graph.successors(link(graph, a, b)).tolist()


# A square 1-2-3-4 of 200 m sides with a street through its middle:   4---6---3
#                                                                     |   |   |
#                                                                     1---5---2
SQUARE = {1: (0, 0), 2: (200, 0), 3: (200, 200), 4: (0, 200), 5: (100, 0), 6: (100, 200)}


def test_import_of_a_square_has_nodes_at_crossings_and_equal_lengths_both_ways(draw_map: Any) -> None:
    path = draw_map(SQUARE, {10: ([1, 5, 2, 3, 6, 4, 1], STREET), 11: ([5, 6], MAIN)})
    graph = import_region(path, [], "square")
    # nodes 1 (end of the ring), 5 and 6 (crossings); 2, 3 and 4 are only shape
    assert sorted(graph.node_id.tolist()) == [1, 5, 6]
    assert graph.link_count == 8  # 1-5, 5-6 on two roads, 6-1: four roads, two directions
    through = next(k for k in links_between(graph, 5, 6) if graph.way_id[k] == 11)
    around = next(k for k in links_between(graph, 5, 6) if graph.way_id[k] == 10)
    assert graph.length_m[through] == pytest.approx(200.0, rel=1e-4)
    assert graph.length_m[around] == pytest.approx(100.0 + 200.0 + 100.0, rel=1e-4)
    assert len(graph.geometry(around)) == 4
    for k in range(8):
        assert graph.length_m[k] == graph.length_m[graph.reverse_idx[k]]
        assert graph.geometry(k).tolist() == graph.geometry(int(graph.reverse_idx[k]))[::-1].tolist()
    assert graph.functional_class[through] == FunctionalClass.PRIMARY
    assert graph.meta.terrain is Terrain.ABSENT
    assert graph.meta.licence == "ODbL-1.0"
    assert graph.meta.attribution == "© OpenStreetMap contributors"


def test_import_of_a_oneway_ring_drives_it_one_way(draw_map: Any) -> None:
    ring = {10: ([1, 2, 3, 4, 1], {**STREET, "oneway": "yes"}), 11: ([5, 6], STREET)}
    graph = import_region(draw_map(SQUARE, ring), [], "ring")
    assert graph.link_count == 2  # a closed way is cut in two; way 11 is connected to nothing
    assert graph.reverse_idx.tolist() == [-1, -1]
    assert graph.length_m.sum() == pytest.approx(800.0, rel=1e-4)
    assert graph.meta.dropped["not_connected"] == 2


def test_import_of_a_oneway_against_its_points_reverses_it(draw_map: Any) -> None:
    ways = {10: ([1, 5, 2, 3, 6, 4, 1], STREET), 11: ([5, 6], {**STREET, "oneway": "-1"})}
    graph = import_region(draw_map(SQUARE, ways), [], "reverse")
    assert [graph.way_id[k] for k in links_between(graph, 5, 6)] == [10]
    assert sorted(graph.way_id[k] for k in links_between(graph, 6, 5)) == [10, 11]


def test_import_takes_speeds_by_direction(draw_map: Any) -> None:
    tags = {**MAIN, "maxspeed:forward": "70", "maxspeed:backward": "40", "name": "Calle Mayor"}
    graph = import_region(draw_map(SQUARE, {10: ([1, 5, 2], STREET), 11: ([5, 6], tags)}), [], "speeds")
    there, back = link(graph, 5, 6), link(graph, 6, 5)
    assert graph.speed_limit_mps[there] == pytest.approx(70 / 3.6)
    assert graph.speed_limit_mps[back] == pytest.approx(40 / 3.6)
    assert graph.names[graph.name_idx[there]] == "Calle Mayor"


def test_import_keeps_limits_under_conditions_and_the_wet_ones_hold_on_a_wet_road(
    draw_map: Any, tmp_path: Path
) -> None:
    tags = {**MAIN, "maxspeed": "100", "maxspeed:forward:conditional": "80 @ wet; 30 @ (Mo-Fr 07:00-17:00)"}
    drawn = import_region(draw_map(SQUARE, {10: ([1, 5, 2], STREET), 11: ([5, 6], tags)}), [], "wet")
    save_graph(drawn, tmp_path / "wet")
    for graph in (drawn, load_graph(tmp_path / "wet"), from_networkx(to_networkx(drawn))):
        wet = Conditions(road=RoadSurface.WET)
        there, back = link(graph, 5, 6), link(graph, 6, 5)
        assert graph.speed_limit_mps[[there, back]] * 3.6 == pytest.approx([100, 100])
        assert graph.limit_mps(Conditions()) is graph.speed_limit_mps
        assert graph.limit_mps(wet)[[there, back]] * 3.6 == pytest.approx([80, 100])
        assert graph.conditional is not None
        assert graph.conditional.link.tolist() == [there, there]
        assert graph.conditional.days.tolist() == [0b1111111, 0b0011111]
        assert graph.conditional.begin_min.tolist() == [0, 420]
        monday_8, sunday_8 = 8 * 60, 6 * 1440 + 8 * 60
        assert graph.limit_mps(Conditions(departure_min=monday_8))[[there, back]] * 3.6 == pytest.approx([30, 100])
        assert graph.limit_mps(replace(wet, departure_min=sunday_8))[[there, back]] * 3.6 == pytest.approx([80, 100])
    assert import_region(draw_map(SQUARE, {10: ([1, 5, 2], STREET)}), [], "dry").conditional is None


def test_import_drops_what_cars_may_not_drive_and_says_so(draw_map: Any) -> None:
    ways = {
        10: ([1, 5, 2, 3, 6, 4, 1], STREET),
        11: ([5, 6], {**STREET, "access": "private"}),
        12: ([1, 3], {"highway": "service", "service": "driveway"}),
        13: ([2, 4], {"highway": "footway"}),
        14: ([2, 6], {**MAIN, "oneway": "reversible"}),
        15: ([1, 2], {"route": "ferry"}),
    }
    graph = import_region(draw_map(SQUARE, ways), [], "dropped")
    assert set(graph.way_id.tolist()) == {10}
    dropped = graph.meta.dropped
    assert dropped["ways_without_access"] == 1
    assert dropped["ways_driveway_or_parking"] == 1
    assert dropped["ways_reversible"] == 1
    assert dropped["ferries"] == 1


def test_import_with_a_bollard_lets_nothing_through(draw_map: Any) -> None:
    points = {**SQUARE, 7: (100, 100)}
    ways = {10: ([1, 5, 2, 3, 6, 4, 1], STREET), 11: ([5, 7, 6], STREET)}
    graph = import_region(draw_map(points, ways, {7: {"barrier": "bollard"}}), [], "bollard")
    stub = [k for k in range(graph.link_count) if graph.way_id[k] == 11]
    assert len(stub) == 4  # two dead ends of 100 m
    assert graph.length_m[stub] == pytest.approx(100.0, rel=1e-4)
    assert not [k for k in links_between(graph, 5, 6) if graph.way_id[k] == 11]
    assert graph.meta.dropped["way_points_blocked"] == 1


@pytest.mark.parametrize(
    ("tags", "drives"),
    [
        ({"motor_vehicle:backward": "private"}, (True, False)),
        ({"motorcar:forward": "no"}, (False, True)),
        ({"oneway": "YES"}, (True, False)),
        ({"access": "delivery"}, (False, False)),
        ({"oneway": "yes", "vehicle:forward": "no"}, (False, False)),
    ],
)
def test_import_drives_a_way_only_where_its_tags_let_a_car(
    draw_map: Any, tags: dict[str, str], drives: tuple[bool, bool]
) -> None:
    ways = {10: ([1, 5, 2, 3, 6, 4, 1], STREET), 11: ([5, 6], {**MAIN, **tags})}
    graph = import_region(draw_map(SQUARE, ways), [], "directions")
    of_way = [[k for k in links_between(graph, *ends) if graph.way_id[k] == 11] for ends in ((5, 6), (6, 5))]
    assert (bool(of_way[0]), bool(of_way[1])) == drives


@pytest.mark.parametrize(
    ("tags", "found"),
    [
        ({"highway": "track", "motor_vehicle": "yes"}, True),
        ({"highway": "pedestrian", "motorcar:forward": "yes", "motor_vehicle": "no"}, True),
        ({"highway": "cycleway", "motor_vehicle": "destination"}, False),
        ({"highway": "track", "vehicle": "yes"}, False),
        ({"highway": "primary", "construction": "primary"}, False),
    ],
)
def test_import_takes_a_way_of_others_only_where_it_is_open_to_cars(
    draw_map: Any, tags: dict[str, str], found: bool
) -> None:
    graph = import_region(draw_map(SQUARE, {10: ([1, 5, 2, 3, 6, 4, 1], STREET), 11: ([5, 6], tags)}), [], "track")
    assert (11 in graph.way_id.tolist()) is found


def test_import_counts_conditions_that_can_hold_for_cars_alone(draw_map: Any) -> None:
    lorries = {**MAIN, "hgv:conditional": "no @ (22:00-06:00)", "access:conditional": "no @ (weight>7.5)"}
    hours = {**MAIN, "motor_vehicle:conditional": "no @ (Mo-Fr 07:00-09:00)"}
    ways = {10: ([1, 5, 2, 3, 6, 4, 1], STREET), 11: ([5, 6], lorries)}
    assert "conditional_tags_ignored" not in import_region(draw_map(SQUARE, ways), [], "lorries").meta.dropped
    dropped = import_region(draw_map(SQUARE, {**ways, 11: ([5, 6], hours)}), [], "hours").meta.dropped
    assert dropped["conditional_tags_ignored"] == 1


@pytest.mark.parametrize(
    ("tags", "passes", "counted"),
    [
        ({"barrier": "sliding_gate"}, True, None),
        ({"barrier": "security_gate"}, True, None),
        ({"barrier": "cattle_guard"}, True, None),
        ({"barrier": "gate;bollard"}, False, "way_points_blocked"),
        ({"barrier": "horse_gate"}, False, "way_points_blocked"),
        ({"barrier": "gate", "access": "no", "motorcar": "yes"}, True, None),
        ({"barrier": "gate", "access": "delivery"}, False, "way_points_blocked"),
        ({"barrier": "force_field"}, False, "way_points_blocked_by_unknown_barriers"),
    ],
)
def test_import_with_a_barrier_tells_whether_it_is_known(
    draw_map: Any, tags: dict[str, str], passes: bool, counted: str | None
) -> None:
    ways = {10: ([1, 5, 2, 3, 6, 4, 1], STREET), 11: ([5, 7, 6], STREET)}
    graph = import_region(draw_map({**SQUARE, 7: (100, 100)}, ways, {7: tags}), [], "barrier")
    assert bool([k for k in links_between(graph, 5, 6) if graph.way_id[k] == 11]) is passes
    assert [key for key in graph.meta.dropped if key.startswith("way_points_blocked")] == ([counted] if counted else [])


def test_import_with_missing_points_cuts_the_way_there(draw_map: Any) -> None:
    ways = {10: ([1, 5, 2, 3, 6, 4, 1], STREET), 11: ([5, 999, 6], MAIN)}
    graph = import_region(draw_map(SQUARE, ways), [], "extract")
    assert set(graph.way_id.tolist()) == {10}
    assert graph.meta.dropped["way_points_missing"] == 1


CROSSROADS = {1: (0, 0), 2: (100, 0), 3: (0, 100), 4: (-100, 0), 5: (0, -100)}
ARMS = {k: ([1, k], STREET) for k in (2, 3, 4, 5)}  # way k leads from the middle to point k


def restriction(origin: int, via: int, target: int, **tags: str) -> tuple[list[tuple[str, int, str]], dict[str, str]]:
    members = [("w", origin, "from"), ("n", via, "via"), ("w", target, "to")]
    return members, {"type": "restriction", **tags}


def test_import_with_two_orders_permits_what_each_of_them_names(draw_map: Any) -> None:
    orders = [restriction(5, 1, 3, restriction="only_straight_on"), restriction(5, 1, 2, restriction="only_right_turn")]
    graph = import_region(draw_map(CROSSROADS, ARMS, relations=orders), [], "orders")
    assert [follows(graph, 5, 1, target) for target in (2, 3, 4)] == [True, True, False]
    assert follows(graph, 2, 1, 4)


def test_import_reads_roles_as_they_are_meant(draw_map: Any) -> None:
    members = [("w", 5, "From"), ("n", 1, "via "), ("w", 4, "TO")]
    path = draw_map(CROSSROADS, ARMS, relations=[(members, {"type": "restriction", "restriction": "no_left_turn"})])
    assert not follows(import_region(path, [], "roles"), 5, 1, 4)


@pytest.mark.parametrize("key", ["ISO3166-1", "ISO3166-1:alpha2"])
def test_import_takes_the_country_of_its_only_boundary(draw_map: Any, key: str) -> None:
    tags = {"type": "boundary", "boundary": "administrative", "admin_level": "2", key: "PT"}
    path = draw_map(
        SQUARE, {10: ([1, 5, 2], {"highway": "motorway", "oneway": "no"})}, relations=[([("w", 10, "outer")], tags)]
    )
    assert read_osm(path).country == "PT"


def test_import_with_no_left_turn_forbids_it_and_nothing_else(draw_map: Any) -> None:
    path = draw_map(CROSSROADS, ARMS, relations=[restriction(5, 1, 4, restriction="no_left_turn")])
    graph = import_region(path, [], "no left")
    assert not follows(graph, 5, 1, 4)
    assert follows(graph, 5, 1, 3)
    assert follows(graph, 5, 1, 2)
    assert follows(graph, 2, 1, 4)


@pytest.mark.parametrize(
    "tags",
    [
        {"restriction": "no_left_turn_on_red"},
        {"type": "restriction:hgv", "restriction": "no_left_turn"},
        {"restriction:bus": "no_left_turn"},
    ],
)
def test_import_with_a_restriction_that_is_not_for_cars_leaves_the_turn(draw_map: Any, tags: dict[str, str]) -> None:
    members, plain = restriction(5, 1, 4)
    graph = import_region(draw_map(CROSSROADS, ARMS, relations=[(members, {**plain, **tags})]), [], "not for cars")
    assert follows(graph, 5, 1, 4)


def test_import_with_only_straight_on_forbids_the_rest(draw_map: Any) -> None:
    path = draw_map(CROSSROADS, ARMS, relations=[restriction(5, 1, 3, restriction="only_straight_on")])
    graph = import_region(path, [], "only")
    assert follows(graph, 5, 1, 3)
    assert not follows(graph, 5, 1, 2)
    assert not follows(graph, 5, 1, 4)


def test_import_with_exempt_conditional_and_via_way_restrictions_counts_what_it_passes_over(draw_map: Any) -> None:
    via_way = ([("w", 5, "from"), ("w", 3, "via"), ("w", 4, "to")], {"type": "restriction", "restriction": "no_u_turn"})
    relations = [
        restriction(5, 1, 4, restriction="no_left_turn", **{"except": "motorcar"}),
        restriction(5, 1, 2, **{"restriction:conditional": "no_right_turn @ (Mo-Fr)"}),
        via_way,
        restriction(5, 1, 777, restriction="no_left_turn"),
    ]
    graph = import_region(draw_map(CROSSROADS, ARMS, relations=relations), [], "passed over")
    assert follows(graph, 5, 1, 4)
    assert follows(graph, 5, 1, 2)
    assert graph.meta.dropped["restrictions_conditional"] == 1
    assert graph.meta.dropped["restrictions_without_effect"] == 2  # way 777 is not there, ways 3 and 4 do not follow


# two carriageways, north 1 → 2 → 3 and south 6 → 5 → 4, joined at their ends and by a link 2 – 5
CARRIAGEWAYS = {1: (0, 0), 2: (100, 0), 3: (200, 0), 4: (0, 30), 5: (100, 30), 6: (200, 30), 7: (100, -80)}
ONEWAY_MAIN = {**MAIN, "oneway": "yes"}
LINKED = {
    12: ([1, 2], ONEWAY_MAIN),
    23: ([2, 3], ONEWAY_MAIN),
    65: ([6, 5], ONEWAY_MAIN),
    54: ([5, 4], ONEWAY_MAIN),
    25: ([2, 5], MAIN),
    36: ([3, 6], MAIN),
    41: ([4, 1], MAIN),
}
NO_TURNING_BACK = (
    [("w", 12, "from"), ("w", 25, "via"), ("w", 54, "to")],
    {"type": "restriction", "restriction": "no_u_turn"},
)


def may_drive(graph: RoadGraph, *nodes: int) -> bool:
    """Whether links from node to node may be driven one after the other, copies of links included."""
    here: set[int] = {k for k in links_between(graph, *nodes[:2]) if k < graph.road_link_count}
    for tail, head in pairwise(nodes[1:]):
        ahead = links_between(graph, tail, head)
        here = {to for at in here for to in graph.successors(at).tolist() if to in ahead}
    return bool(here)


def drives_back(graph: RoadGraph) -> bool:
    return may_drive(graph, 1, 2, 5, 4)


def test_import_with_a_ban_over_a_way_that_only_its_from_way_enters_forbids_its_last_turn(draw_map: Any) -> None:
    assert drives_back(import_region(draw_map(CARRIAGEWAYS, LINKED), [], "free"))
    graph = import_region(draw_map(CARRIAGEWAYS, LINKED, relations=[NO_TURNING_BACK]), [], "over a way")
    assert not drives_back(graph)
    assert follows(graph, 6, 5, 2)
    assert follows(graph, 6, 5, 4)
    assert follows(graph, 1, 2, 3)
    assert "restrictions_over_ways" not in graph.meta.dropped


def test_import_with_a_ban_over_a_way_that_others_enter_holds_for_those_whom_it_means(draw_map: Any) -> None:
    ways = {**LINKED, 72: ([7, 2], MAIN)}
    # from 7 over the link to 4 is no turning back, and from 1 over the link there is another way out
    ways[58] = ([5, 8], MAIN)
    points = {**CARRIAGEWAYS, 8: (100, 100)}
    graph = import_region(draw_map(points, ways, relations=[NO_TURNING_BACK]), [], "others")
    assert not drives_back(graph)
    assert may_drive(graph, 1, 2, 5, 8)
    assert may_drive(graph, 7, 2, 5, 4)
    assert may_drive(graph, 2, 5, 4)  # who departs there
    assert graph.link_count == graph.road_link_count + 1
    assert "restrictions_over_ways" not in graph.meta.dropped


def test_import_with_a_ban_over_a_way_that_leads_to_its_to_way_alone_forbids_its_first_turn(draw_map: Any) -> None:
    ways = {**LINKED, 72: ([7, 2], MAIN)}
    graph = import_region(draw_map(CARRIAGEWAYS, ways, relations=[NO_TURNING_BACK]), [], "first turn")
    assert not follows(graph, 1, 2, 5)
    assert follows(graph, 7, 2, 5)
    assert follows(graph, 2, 5, 4)
    assert "restrictions_over_ways" not in graph.meta.dropped


def test_import_with_a_ban_over_a_long_way_lets_those_who_depart_there_turn(draw_map: Any) -> None:
    points = CARRIAGEWAYS | {4: (0, 130), 5: (100, 130), 6: (200, 130)}
    graph = import_region(draw_map(points, LINKED, relations=[NO_TURNING_BACK]), [], "long")
    assert not drives_back(graph)
    assert may_drive(graph, 1, 2, 3)
    assert may_drive(graph, 2, 5, 4)
    assert "restrictions_over_ways" not in graph.meta.dropped


def test_import_with_an_order_over_a_way_keeps_it_for_those_who_enter_from_its_from_way(draw_map: Any) -> None:
    order = (NO_TURNING_BACK[0], {"type": "restriction", "restriction": "only_u_turn"})
    ways = {**LINKED, 72: ([7, 2], MAIN), 58: ([5, 8], MAIN)}
    graph = import_region(draw_map({**CARRIAGEWAYS, 8: (100, 100)}, ways, relations=[order]), [], "order")
    assert drives_back(graph)
    assert not may_drive(graph, 1, 2, 5, 8)
    assert may_drive(graph, 7, 2, 5, 8)
    assert may_drive(graph, 1, 2, 3)
    assert "restrictions_over_ways" not in graph.meta.dropped


def test_import_with_bans_over_several_ways_in_a_row_forbids_the_whole_way_alone(draw_map: Any) -> None:
    #  1 - 2 - 3 - 4 - 5 with arms 6 at 2, 7 at 3, 8 at 4 and a way back, so that every part has another way in and out
    points = {k: (100 * k, 0) for k in range(1, 6)} | {6: (200, 100), 7: (300, 100), 8: (400, 100)}
    ways = {k: ([k, k + 1], STREET) for k in range(1, 5)}
    ways |= {26: ([2, 6], STREET), 37: ([3, 7], STREET), 48: ([4, 8], STREET), 99: ([1, 6, 7, 8, 5], STREET)}
    members = [("w", 1, "from"), ("w", 2, "via"), ("w", 3, "via"), ("w", 4, "to")]
    ban = (members, {"type": "restriction", "restriction": "no_straight_on"})
    graph = import_region(draw_map(points, ways, relations=[ban]), [], "row")
    assert not may_drive(graph, 1, 2, 3, 4, 5)
    for way in ((1, 2, 3, 4, 8), (1, 2, 3, 7), (6, 2, 3, 4, 5), (7, 3, 4, 5), (5, 4, 3, 2, 1), (1, 2, 6)):
        assert may_drive(graph, *way)
    assert graph.link_count == graph.road_link_count + 2
    assert import_region(draw_map(points, ways), [], "free").copies is None


def test_import_with_a_ban_over_ways_that_would_cut_a_road_off_leaves_it_and_says_so(draw_map: Any) -> None:
    ways = {1: ([1, 2], STREET), 2: ([2, 3], STREET), 3: ([3, 4], {**STREET, "oneway": "yes"}), 4: ([4, 1], STREET)}
    points = {1: (0, 0), 2: (400, 0), 3: (800, 0), 4: (800, 400)}
    ban = ([("w", 1, "from"), ("w", 2, "via"), ("w", 3, "to")], {"type": "restriction", "restriction": "no_left_turn"})
    graph = import_region(draw_map(points, ways, relations=[ban]), [], "cut off")
    assert may_drive(graph, 1, 2, 3, 4)
    assert graph.copies is None
    assert graph.meta.dropped["restrictions_over_ways"] == 1


def test_import_with_a_restriction_from_a_way_that_runs_on_leaves_it(draw_map: Any) -> None:
    ways = {2: ([4, 1, 2], STREET), 3: ([5, 1, 3], STREET)}
    path = draw_map(CROSSROADS, ways, relations=[restriction(3, 1, 2, restriction="no_left_turn")])
    graph = import_region(path, [], "ambiguous")
    assert graph.meta.dropped["restrictions_not_understood"] == 1
    assert follows(graph, 5, 1, 4)


def test_import_of_a_long_road_cuts_it_and_keeps_its_length(draw_map: Any) -> None:
    graph = import_region(draw_map({1: (0, 0), 2: (4000, 0)}, {10: ([1, 2], MAIN)}), [], "long")
    assert graph.link_count == 6  # 4 km in three parts of at most 1.5 km
    assert graph.length_m.max() <= LONGEST_LINK_M
    assert graph.length_m.sum() == pytest.approx(8000.0, rel=1e-4)
    assert (graph.node_id < 0).sum() == 2
    assert (graph.reverse_idx >= 0).all()


def test_import_of_points_on_one_place_merges_them(draw_map: Any) -> None:
    points = {1: (0, 0), 2: (100, 0), 3: (100.2, 0), 4: (200, 0)}
    graph = import_region(draw_map(points, {10: ([1, 2], STREET), 11: ([2, 3], STREET), 12: ([3, 4], STREET)}), [], "m")
    assert graph.node_count == 3
    assert graph.link_count == 4
    assert graph.length_m.min() > 99.0


def test_import_of_a_cul_de_sac_loop_has_no_link_from_a_node_to_itself(draw_map: Any) -> None:
    points = {1: (0, 0), 2: (100, 0), 3: (130, 20), 4: (130, -20)}
    graph = import_region(draw_map(points, {10: ([1, 2, 3, 4, 2], STREET)}), [], "lollipop")
    assert (graph.tail != graph.head).all()
    assert graph.link_count == 6  # the stem and two halves of the loop, both ways


def cross_of(graph: RoadGraph, tail_id: int, head_id: int) -> Cross:
    return Cross(int(graph.cross[link(graph, tail_id, head_id)]))


def test_cross_of_signals_on_a_junction_is_large_from_all_sides(draw_map: Any) -> None:
    graph = import_region(draw_map(CROSSROADS, ARMS, {1: {"highway": "traffic_signals"}}), [], "lights")
    assert [cross_of(graph, k, 1) for k in (2, 3, 4, 5)] == [Cross.LARGE] * 4
    assert [cross_of(graph, 1, k) for k in (2, 3, 4, 5)] == [Cross.NONE] * 4


def test_cross_of_signals_on_the_approach_is_counted_once_at_the_junction(draw_map: Any) -> None:
    points = {**CROSSROADS, 6: (0, -15)}
    ways = {**ARMS, 5: ([1, 6, 5], STREET)}
    graph = import_region(draw_map(points, ways, {6: {"highway": "traffic_signals"}}), [], "approach")
    assert 6 not in graph.node_id
    assert cross_of(graph, 5, 1) is Cross.LARGE
    assert cross_of(graph, 1, 5) is Cross.NONE
    assert cross_of(graph, 2, 1) is Cross.NONE


def test_cross_of_signals_between_junctions_becomes_a_node_for_both_directions(draw_map: Any) -> None:
    points = {**CROSSROADS, 6: (0, -300), 5: (0, -600)}
    ways = {**ARMS, 5: ([1, 6, 5], STREET)}
    graph = import_region(draw_map(points, ways, {6: {"highway": "traffic_signals"}}), [], "midway")
    assert cross_of(graph, 1, 6) is Cross.LARGE
    assert cross_of(graph, 5, 6) is Cross.LARGE
    assert cross_of(graph, 6, 1) is Cross.NONE


def test_cross_of_signals_between_junctions_obeys_their_direction(draw_map: Any) -> None:
    points = {**CROSSROADS, 6: (0, -300), 5: (0, -600)}
    ways = {**ARMS, 5: ([1, 6, 5], STREET)}
    signals = {6: {"highway": "traffic_signals", "traffic_signals:direction": "forward"}}
    graph = import_region(draw_map(points, ways, signals), [], "midway")
    assert cross_of(graph, 1, 6) is Cross.LARGE  # along the way's points
    assert cross_of(graph, 5, 6) is Cross.NONE


def test_cross_of_two_signals_of_one_junction_is_counted_once(draw_map: Any) -> None:
    # a street 1-2-3-4 over two carriageways 20 m apart, lights on both
    points = {
        1: (0, 0),
        2: (100, 0),
        3: (120, 0),
        4: (220, 0),
        5: (100, 90),
        6: (100, -90),
        7: (120, 90),
        8: (120, -90),
    }
    oneway = {**MAIN, "oneway": "yes"}
    ways = {
        10: ([1, 2, 3, 4], STREET),
        11: ([5, 2, 6], oneway),
        12: ([8, 3, 7], oneway),
        13: ([7, 5], oneway),
        14: ([6, 8], oneway),
    }
    lights = {2: {"highway": "traffic_signals"}, 3: {"highway": "traffic_signals"}}
    graph = import_region(draw_map(points, ways, lights), [], "dual")
    assert cross_of(graph, 1, 2) is Cross.LARGE
    assert cross_of(graph, 2, 3) is Cross.NONE
    assert cross_of(graph, 4, 3) is Cross.LARGE
    assert cross_of(graph, 3, 2) is Cross.NONE
    assert cross_of(graph, 5, 2) is Cross.LARGE


def test_cross_of_stop_and_give_way_signs_holds_towards_the_junction(draw_map: Any) -> None:
    points = {**CROSSROADS, 6: (0, -10), 7: (0, 10)}
    ways = {**ARMS, 5: ([1, 6, 5], STREET), 3: ([1, 7, 3], STREET)}
    signs = {6: {"highway": "stop"}, 7: {"highway": "give_way", "direction": "backward"}}
    graph = import_region(draw_map(points, ways, signs), [], "signs")
    assert cross_of(graph, 5, 1) is Cross.LARGE
    assert cross_of(graph, 3, 1) is Cross.MEDIUM
    assert cross_of(graph, 2, 1) is Cross.NONE
    assert cross_of(graph, 1, 5) is Cross.NONE


def test_cross_of_a_stop_sign_on_the_junction_holds_for_the_lesser_roads(draw_map: Any) -> None:
    ways = {2: ([1, 2], MAIN), 4: ([1, 4], MAIN), 3: ([1, 3], STREET), 5: ([1, 5], STREET)}
    graph = import_region(draw_map(CROSSROADS, ways, {1: {"highway": "stop"}}), [], "stop")
    assert [cross_of(graph, k, 1) for k in (2, 3, 4, 5)] == [Cross.NONE, Cross.LARGE, Cross.NONE, Cross.LARGE]


def test_cross_of_an_all_way_stop_holds_for_all_roads(draw_map: Any) -> None:
    ways = {2: ([1, 2], MAIN), 4: ([1, 4], MAIN), 3: ([1, 3], STREET), 5: ([1, 5], STREET)}
    graph = import_region(draw_map(CROSSROADS, ways, {1: {"highway": "stop", "stop": "all"}}), [], "all")
    assert [cross_of(graph, k, 1) for k in (2, 3, 4, 5)] == [Cross.LARGE] * 4


@pytest.mark.parametrize(
    ("tags", "level"),
    [
        ({"highway": "crossing", "crossing": "traffic_signals"}, Cross.SMALL),
        ({"railway": "level_crossing"}, Cross.SMALL),
        ({"highway": "mini_roundabout"}, Cross.MEDIUM),
        ({"highway": "crossing", "crossing": "zebra"}, Cross.NONE),
    ],
)
def test_cross_of_a_lesser_control_midway_holds_both_ways(draw_map: Any, tags: dict[str, str], level: Cross) -> None:
    points = {1: (0, 0), 2: (300, 0), 3: (600, 0)}
    graph = import_region(draw_map(points, {10: ([1, 2, 3], STREET)}, {2: tags}), [], "midway")
    if level is Cross.NONE:
        assert 2 not in graph.node_id
    else:
        assert cross_of(graph, 1, 2) is level
        assert cross_of(graph, 3, 2) is level


def test_cross_of_a_minor_road_grows_with_the_difference_of_class(draw_map: Any) -> None:
    ways = {
        2: ([1, 2], {"highway": "secondary"}),
        4: ([1, 4], {"highway": "secondary"}),
        3: ([1, 3], {"highway": "tertiary"}),
        5: ([1, 5], STREET),
    }
    graph = import_region(draw_map(CROSSROADS, ways), [], "minor")
    assert cross_of(graph, 3, 1) is Cross.SMALL
    assert cross_of(graph, 5, 1) is Cross.MEDIUM
    assert cross_of(graph, 2, 1) is Cross.NONE


def test_cross_of_a_road_that_changes_class_is_none(draw_map: Any) -> None:
    graph = import_region(draw_map(SQUARE, {10: ([1, 5], STREET), 11: ([5, 2], MAIN)}), [], "joint")
    assert cross_of(graph, 1, 5) is Cross.NONE


def test_cross_at_a_roundabout_is_medium_on_entry_and_none_inside(draw_map: Any) -> None:
    points = {1: (20, 0), 2: (0, 20), 3: (-20, 0), 4: (0, -20), 5: (120, 0), 6: (-120, 0)}
    ring = {**STREET, "junction": "roundabout"}
    ways = {10: ([1, 2, 3, 4, 1], ring), 11: ([5, 1], STREET), 12: ([3, 6], STREET)}
    graph = import_region(draw_map(points, ways), [], "ring")
    assert cross_of(graph, 5, 1) is Cross.MEDIUM
    assert cross_of(graph, 6, 3) is Cross.MEDIUM
    assert cross_of(graph, 1, 5) is Cross.NONE
    assert cross_of(graph, 1, 3) is Cross.NONE
    assert links_between(graph, 3, 1)
    assert graph.reverse_idx[link(graph, 1, 3)] == -1


def test_cross_on_a_motorway_is_none_and_a_ramp_stops_at_the_road_it_meets(draw_map: Any) -> None:
    points = {1: (0, 0), 2: (500, 0), 3: (1000, 0), 4: (700, 100), 5: (700, 300), 6: (400, 100), 7: (1000, 100)}
    ways = {
        10: ([1, 2, 3], {"highway": "motorway"}),
        11: ([2, 4], {"highway": "motorway_link", "oneway": "yes"}),
        12: ([6, 4, 7], {"highway": "secondary"}),
        13: ([6, 1], {"highway": "motorway_link", "oneway": "yes"}),
        14: ([3, 7], {"highway": "motorway_link", "oneway": "yes"}),
    }
    graph = import_region(draw_map(points, ways, {2: {"highway": "stop"}}), [], "motorway")
    assert cross_of(graph, 1, 2) is Cross.NONE
    assert cross_of(graph, 6, 1) is Cross.NONE  # joins a motorway
    assert cross_of(graph, 2, 4) is Cross.MEDIUM
    assert graph.functional_class[link(graph, 2, 4)] == FunctionalClass.TRUNK


def test_urban_follows_tags_then_density(draw_map: Any) -> None:
    # a grid of streets 100 m apart: 20 km a km², and a road that leads 3 km away from it
    points = {r * 10 + c + 1: (100.0 * c, 100.0 * r) for r in range(8) for c in range(8)}
    ways: dict[int, Any] = {}
    for i in range(8):
        ways[100 + i] = ([i * 10 + c + 1 for c in range(8)], STREET)
        ways[200 + i] = ([r * 10 + i + 1 for r in range(8)], STREET)
    points |= {900: (3700, 700), 901: (4000, 700), 902: (4300, 700)}
    ways[300] = ([78, 900], MAIN)
    ways[301] = ([900, 901], {**MAIN, "maxspeed:type": "ES:urban"})
    graph = import_region(draw_map(points, ways), [], "town")
    assert graph.urban[link(graph, 34, 35)]
    assert graph.urban[link(graph, 900, 901)]
    far = np.flatnonzero((graph.way_id == 300) & (graph.node_id[graph.head] == 900))
    assert not graph.urban[far].any()
    assert graph.speed_limit_mps[far] == pytest.approx(90 / 3.6)  # ES, from the one tag that names a country
    assert graph.speed_limit_mps[link(graph, 34, 35)] == pytest.approx(30 / 3.6)


def test_speed_of_an_unsigned_road_in_bends_is_what_the_bends_allow(draw_map: Any) -> None:
    # 20 corners of 90° on steps of 100 m: κ = 20 * (π/2) / 2100 m, v = √(2.5/κ) = 12.93 m/s = 46.5, so 45 km/h
    points = {k + 1: (100.0 * ((k + 1) // 2), 100.0 * (k // 2)) for k in range(22)}
    for tags, kmh in (({}, 45.0), ({"maxspeed": "80"}, 80.0)):
        graph = import_region(draw_map(points, {10: (list(range(1, 23)), {**MAIN, **tags})}), [], "bends")
        assert not graph.urban.any()
        assert graph.speed_limit_mps * 3.6 == pytest.approx(kmh, abs=0.1)


@pytest.mark.parametrize("content", [b"", b"this is not a map", b"\x00\x00\x00\x0d\x0a\x09OSMHeader garbage"])
def test_import_of_a_broken_file_names_it(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "broken.osm.pbf"
    path.write_bytes(content)
    with pytest.raises(ImportFailedError, match=r"broken\.osm\.pbf") as caught:
        import_region(path, [], "broken")
    assert caught.value.field == "map"
    assert [p.name for p in tmp_path.iterdir()] == ["broken.osm.pbf"]


@pytest.mark.shared_data
def test_import_of_a_truncated_file_fails(real_maps: Path, tmp_path: Path) -> None:
    path = tmp_path / "half.osm.pbf"
    path.write_bytes((real_maps / "andorra.osm.pbf").read_bytes()[:1_000_000])
    with pytest.raises(ImportFailedError, match="not a readable OSM file"):
        import_region(path, [], "half")


def test_import_of_a_missing_file_names_it(tmp_path: Path) -> None:
    with pytest.raises(ImportFailedError, match="no such file"):
        import_region(tmp_path / "nowhere.osm.pbf", [], "nowhere")


def test_import_of_a_map_without_roads_says_what_it_needs(draw_map: Any) -> None:
    path = draw_map(SQUARE, {10: ([1, 2], {"highway": "footway"})})
    with pytest.raises(ImportFailedError, match="drivable"):
        import_region(path, [], "paths")


def test_import_reports_progress_stage_by_stage(draw_map: Any) -> None:
    calls: list[tuple[str, float]] = []
    path = draw_map(SQUARE, {10: ([1, 5, 2, 3, 6, 4, 1], STREET)})
    import_region(path, [], "p", progress=lambda label, done: calls.append((label, done)))
    assert [label for label, done in calls if done == 1.0] == ["read map", "cut links", "assemble graph"]
    assert all(0.0 <= done <= 1.0 for _, done in calls)


@pytest.mark.shared_data
def test_import_of_andorra_is_plausible(real_maps: Path) -> None:
    graph = import_region(real_maps / "andorra.osm.pbf", [real_maps / "N42E001.hgt.zip"], "andorra")
    assert 800.0 < graph.node_height_m.min() < 900.0
    assert 2390.0 < graph.node_height_m.max() < 2430.0
    assert graph.meta.terrain is Terrain.MEASURED
    assert read_osm(real_maps / "andorra.osm.pbf").country == "AD"
    # Port d'Envalira, the highest paved pass of the Pyrenees, lies at 2408 m
    pass_links = np.flatnonzero(np.array(graph.names, object)[graph.name_idx] == "Port d'Envalira")
    assert graph.node_height_m[graph.tail[pass_links]].max() == pytest.approx(2408.0, abs=5.0)
    grade = graph.climb_m() / graph.length_m
    assert np.abs(grade).max() < 0.21
    twin = graph.reverse_idx
    assert (graph.length_m[twin >= 0] == graph.length_m[twin[twin >= 0]]).all()
    assert not graph.cross[graph.functional_class == FunctionalClass.MOTORWAY].any()
