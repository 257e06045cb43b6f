"""Ferries from drawn OpenStreetMap files: left out and told, or brought in as links with a duration."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from energy.chain.chain import LinkModel, StopRule
from energy.stops import StopSettings
from routing.errors import GraphFormatError, ImportFailedError
from routing.graph.ferries import Ferries, ferries_from
from routing.graph.files import load_graph, save_graph
from routing.graph.networkx_graph import read_graphml, write_graphml
from routing.graph.road_graph import RoadGraph
from routing.importers.ferries import ASSUMED_MPS, duration_s, ferry_speed, takes_cars
from routing.importers.region import LONGEST_LINK_M, import_region
from routing.search.space import search_space
from tests.routing.importers.heights.test_elevation import write_geotiff
from tests.routing.search.test_exact import vehicle

STREET = {"highway": "residential"}
FERRY = {"route": "ferry", "name": "Northern Line", "duration": "00:20"}
# two squares of 200 m sides, 4 km apart; 3 and 11 are quays, 20 and 21 lie in between
PLACES = {1: (0, 0), 2: (200, 0), 3: (200, 200), 4: (0, 200)}
PLACES |= {11: (200, 4200), 12: (400, 4200), 13: (400, 4400), 14: (200, 4400), 15: (200, 4600)}
PLACES |= {20: (200, 1200), 21: (200, 3200), 30: (5000, 200)}
SHORES = {10: ([1, 2, 3, 4, 1], STREET), 11: ([11, 12, 13, 14, 11], STREET), 12: ([14, 15], STREET)}
LINE = [3, 20, 21, 11]


def sound(
    draw_map: Any, tags: dict[str, str], *, ferries: bool = True, line: list[int] = LINE, **more: Any
) -> RoadGraph:
    path = draw_map(PLACES, {**SHORES, 20: (line, tags)}, **more)
    return import_region(path, [], "sound", ferries=ferries)


def ferry_links(graph: RoadGraph) -> list[int]:
    return np.flatnonzero(graph.way_id == 20).tolist()


@pytest.mark.parametrize(
    ("value", "seconds"),
    [
        ("00:20", 1200.0),
        ("1:05", 3900.0),
        ("26:00", 93_600.0),
        ("00:07:30", 450.0),
        ("5", 300.0),
        ("90", 5400.0),
        ("2.5", 150.0),
        ("PT20M", 1200.0),
        ("PT1H30M", 5400.0),
        ("pt1h30m", 5400.0),
        ("P1DT2H", 93_600.0),
        ("PT45S", 45.0),
        ("PT022506", 8706.0),
        (" 00:20 ", 1200.0),
        ("00:20; 00:25", 1500.0),
        ("", None),
        ("soon", None),
        ("1:75", None),
        ("00:00", None),
        ("-5", None),
        ("P", None),
        ("PT", None),
        ("20 min to 1 h", None),
        ("00:20;soon", None),
    ],
)
def test_duration_is_read_in_each_form_of_the_wiki_and_else_not(value: str, seconds: float | None) -> None:
    assert duration_s(value) == seconds


@pytest.mark.parametrize(
    ("tags", "taken"),
    [
        ({}, True),
        ({"motor_vehicle": "yes"}, True),
        ({"motorcar": "yes", "access": "no"}, True),
        ({"motor_vehicle": "yes", "foot": "yes", "bicycle": "yes"}, True),
        ({"motor_vehicle": "no"}, False),
        ({"motorcar": "no", "motor_vehicle": "yes"}, False),
        ({"vehicle": "no"}, False),
        ({"access": "no"}, False),
        ({"access": "private"}, False),
        ({"foot": "yes"}, False),
        ({"foot": "yes", "bicycle": "yes"}, False),
        ({"motor_vehicle": "no", "motorcar:forward": "yes"}, True),
    ],
)
def test_ferries_take_cars_by_the_hierarchy_of_classes(tags: dict[str, str], taken: bool) -> None:
    assert takes_cars(tags) == taken


def test_ferries_are_left_out_and_told_by_length_and_name_unless_asked_for(draw_map: Any, tmp_path: Path) -> None:
    graph = sound(draw_map, FERRY, ferries=False)
    assert graph.ferries is None
    assert ferry_links(graph) == []
    assert graph.meta.dropped["ferries"] == 1
    assert graph.meta.dropped["ferries_m"] == pytest.approx(4000, abs=2)
    (told,) = graph.meta.ferries_left_out
    assert (told.name, told.length_m) == ("Northern Line", pytest.approx(4000.0, rel=1e-3))
    assert (told.lat_deg, told.lon_deg) == pytest.approx((42.0018, 1.50241), abs=1e-5)
    save_graph(graph, tmp_path / "graph")
    assert load_graph(tmp_path / "graph").meta == graph.meta
    assert not (tmp_path / "graph" / "ferries.json").exists()


def test_a_ferry_joins_the_shores_with_its_duration_shared_by_length(draw_map: Any) -> None:
    graph = sound(draw_map, FERRY)
    links = ferry_links(graph)
    assert graph.ferries is not None
    assert graph.ferries.link.tolist() == links
    assert set(graph.way_id.tolist()) == {10, 11, 12, 20}
    assert float(graph.length_m[links].max()) <= LONGEST_LINK_M
    assert graph.ferries.duration_s.sum() == pytest.approx(2.0 * 1200.0, rel=1e-12)  # there and back
    assert graph.ferries.duration_s / graph.length_m[links] == pytest.approx(1200.0 / graph.length_m[links].sum() * 2.0)
    assert "ferries" not in graph.meta.dropped
    assert graph.names[graph.name_idx[links[0]]] == "Northern Line"
    assert not graph.cross[links].any()


@pytest.mark.parametrize(
    ("tags", "key", "count"),
    [
        ({"duration": "an hour or so"}, "ferry_durations_not_used", 1),
        ({"duration": "00:00:30"}, "ferry_durations_not_used", 1),  # 480 km/h
        ({"duration": "36:00"}, "ferry_durations_not_used", 1),  # 0.03 m/s
        ({}, "ferry_durations_not_used", 0),
    ],
)
def test_a_ferry_whose_duration_is_not_known_goes_at_an_assumed_speed_and_is_told(
    draw_map: Any, tags: dict[str, str], key: str, count: int
) -> None:
    graph = sound(draw_map, {"route": "ferry", **tags})
    assert graph.speed_limit_mps[ferry_links(graph)] == pytest.approx(ASSUMED_MPS)
    assert graph.meta.dropped["ferries_at_assumed_speed"] == 1
    assert graph.meta.dropped.get(key, 0) == count


def test_the_duration_of_a_line_of_ways_holds_for_those_that_say_none(draw_map: Any) -> None:
    ways = {**SHORES, 20: ([3, 20], {"route": "ferry"}), 21: ([20, 21, 11], {"route": "ferry", "name": "x"})}
    line = ([("w", 20, ""), ("w", 21, "")], {"type": "route", "route": "ferry", "duration": "00:40"})
    graph = import_region(draw_map(PLACES, ways, relations=[line]), [], "line", ferries=True)
    assert graph.ferries is not None
    assert graph.ferries.duration_s.sum() == pytest.approx(2.0 * 2400.0, rel=1e-3)
    assert "ferries_at_assumed_speed" not in graph.meta.dropped


def test_a_duration_of_a_line_that_is_not_understood_is_told(draw_map: Any) -> None:
    line = ([("w", 20, "")], {"type": "route", "route": "ferry", "duration": "a while"})
    graph = sound(draw_map, {"route": "ferry"}, relations=[line])
    assert graph.meta.dropped["ferry_durations_not_used"] == 1
    assert graph.meta.dropped["ferries_at_assumed_speed"] == 1


@pytest.mark.parametrize("tags", [{"motor_vehicle": "no"}, {"foot": "yes"}, {"access": "private"}])
@pytest.mark.parametrize("ferries", [False, True])
def test_a_ferry_without_cars_is_left_out_with_its_reason(draw_map: Any, tags: dict[str, str], ferries: bool) -> None:
    graph = sound(draw_map, {**FERRY, **tags}, ferries=ferries)
    assert ferry_links(graph) == []
    assert graph.meta.dropped["ways_without_access"] == 1
    assert "ferries" not in graph.meta.dropped


def test_a_oneway_ferry_is_not_taken_back(draw_map: Any) -> None:
    graph = sound(draw_map, {**FERRY, "oneway": "yes"})
    assert ferry_links(graph) == []  # nothing comes back from the island
    ways = {**SHORES, 20: (LINE, {**FERRY, "oneway": "yes"}), 21: (LINE, {**FERRY, "oneway": "-1"})}
    graph = import_region(draw_map(PLACES, ways), [], "both", ferries=True)
    assert (graph.reverse_idx[ferry_links(graph)] != np.array(ferry_links(graph))).all()
    north = graph.node_lat_deg[graph.head] > graph.node_lat_deg[graph.tail]
    assert north[graph.way_id == 20].all()
    assert not north[graph.way_id == 21].any()


def test_a_ferry_that_leads_nowhere_is_left_out_and_told(draw_map: Any) -> None:
    graph = sound(draw_map, FERRY, line=[3, 30])
    assert graph.ferries is None
    assert graph.meta.dropped["ferries_that_lead_nowhere"] == 1


def test_who_drives_to_the_quay_may_turn_there_and_nobody_turns_on_board(draw_map: Any) -> None:
    ways = {10: ([1, 2, 4, 1], STREET), 13: ([2, 3], STREET), 11: SHORES[11], 20: (LINE, FERRY)}
    graph = import_region(draw_map(PLACES, ways), [], "quay", ferries=True)
    (onto_quay,) = np.flatnonzero((graph.way_id == 13) & (graph.node_id[graph.head] == 3)).tolist()
    assert int(graph.reverse_idx[onto_quay]) in graph.successors(onto_quay).tolist()
    for link in ferry_links(graph):
        assert int(graph.reverse_idx[link]) not in graph.successors(link).tolist()


def test_both_ends_of_a_ferry_are_level_and_the_sea_needs_no_height(draw_map: Any, tmp_path: Path) -> None:
    # heights rise by 2 m a cell of 83 m from west to east, and the island is 5 m higher; a tile on each shore alone
    ways = {**SHORES, 20: (LINE, FERRY)}
    east = np.tile(2.0 * np.arange(15, dtype=np.float32), (10, 1))
    tiles = [
        write_geotiff(tmp_path / "south.tif", east, 1.495, 42.006, 0.001),
        write_geotiff(tmp_path / "north.tif", east + 5.0, 1.495, 42.044, 0.001),
    ]
    graph = import_region(draw_map(PLACES, ways), tiles, "tides", ferries=True)
    assert graph.ferries is not None
    assert "roads_without_height" not in graph.meta.dropped
    assert not graph.climb_m(graph.ferries.link).any()
    assert np.ptp(graph.node_height_m) > 1.0
    assert np.isfinite(graph.node_height_m).all()
    space = search_space(graph, vehicle(), LinkModel.INTEGRATED, StopRule.NONE, StopSettings())
    assert space.conserving


def test_ferries_last_in_files_and_exports(draw_map: Any, tmp_path: Path) -> None:
    graph = sound(draw_map, FERRY)
    assert graph.ferries is not None
    save_graph(graph, tmp_path / "graph")
    write_graphml(graph, tmp_path / "graph.graphml")
    for again in (load_graph(tmp_path / "graph"), read_graphml(tmp_path / "graph.graphml")):
        assert again.ferries is not None
        assert again.ferries.columns() == graph.ferries.columns()
        assert again.meta == graph.meta


@pytest.mark.parametrize(
    "columns",
    [
        {"link": [1], "duration_s": [0.0]},
        {"link": [1], "duration_s": [float("nan")]},
        {"link": [1, 1], "duration_s": [5.0, 5.0]},
        {"link": [4], "duration_s": [5.0]},
        {"link": [-1], "duration_s": [5.0]},
        {"link": [0], "duration_s": [5.0]},  # climbs
        {"link": [1], "duration_s": [5.0, 6.0]},
        {"link": [], "duration_s": []},
        {"link": [1]},
        {"link": ["a"], "duration_s": [5.0]},
    ],
)
def test_damaged_ferries_are_refused(columns: dict[str, list[Any]]) -> None:
    climb_m = np.array([2.0, 0.0, 0.0, 0.0])
    with pytest.raises((KeyError, TypeError, ValueError)):
        ferries_from(columns, climb_m)


def test_a_damaged_file_of_ferries_is_refused_by_its_name(draw_map: Any, tmp_path: Path) -> None:
    save_graph(sound(draw_map, FERRY), tmp_path / "graph")
    (tmp_path / "graph" / "ferries.json").write_text(json.dumps({"link": [10**6], "duration_s": [1.0]}))
    with pytest.raises(GraphFormatError, match=r"ferries\.json"):
        load_graph(tmp_path / "graph")


def test_ferries_of_some_links_keep_their_durations_under_new_numbers() -> None:
    ferries = Ferries(np.array([1, 4, 5]), np.array([10.0, 40.0, 50.0]))
    kept, rank = np.array([0, 1, 3, 5]), np.array([3, 2, 1, 0])
    moved = ferries.of_links(kept, rank)
    assert moved is not None
    assert moved.columns() == {"link": [0, 2], "duration_s": [50.0, 10.0]}
    assert ferries.of_links(np.array([0, 2]), np.array([0, 1])) is None


def test_ferries_of_graphml_and_maps_of_ferries_alone_are_refused(draw_map: Any, tmp_path: Path) -> None:
    graph = sound(draw_map, FERRY)
    write_graphml(graph, tmp_path / "graph.graphml")
    with pytest.raises(ImportFailedError, match="ferries"):
        import_region(tmp_path / "graph.graphml", [], "again", ferries=True)
    with pytest.raises(ImportFailedError, match="no way in it"):
        import_region(draw_map(PLACES, {20: (LINE, FERRY)}), [], "sea", ferries=True)


def test_a_speed_is_as_its_tag_says_within_what_ferries_sail() -> None:
    assert ferry_speed("00:10", 3000.0).mps == 5.0
    assert ferry_speed("00:10", 3000.0).assumed is False
    assert ferry_speed("00:01", 3000.0).not_used
    assert ferry_speed(None, 3000.0).assumed
