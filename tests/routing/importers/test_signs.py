"""What drivers read on roads, from the tags of a map to the links of a graph."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import networkx as nx
import numpy as np
import pytest

from routing.errors import GraphFormatError
from routing.graph.files import load_graph, save_graph
from routing.graph.networkx_graph import from_networkx, to_networkx
from routing.graph.road_graph import RoadGraph
from routing.graph.signs import RoadSign
from routing.importers.region import import_region
from routing.importers.signs import sign_of

# a square of two ways that join at points 1 and 5, and a dead end at 3, to turn round in
PLACES = {1: (0, 0), 2: (200, 0), 3: (200, 200), 4: (0, 200), 5: (100, 0), 6: (300, 300)}
MAIN = {
    "highway": "trunk_link",
    "name": "Rua Um",
    "name:en": "First Street",
    "name:etymology": "first",
    "ref": "N 1",
    "destination:forward": "Porto;Braga",
    "destination:ref": "A 3",
    "lanes": "4",
    "turn:lanes:backward": "left|through",
    "oneway": "no",
}


def drawn(draw_map: Any, relations: Any = (), **more: Any) -> RoadGraph:
    ways = {
        10: ([1, 5], MAIN),
        11: ([5, 2, 3, 4, 1], {"highway": "residential", "name": "Rua Dois"}),
        12: ([3, 6], {"highway": "residential"}),
        **{int(k): way for k, way in more.items()},
    }
    return import_region(
        draw_map(PLACES, ways, {5: {"highway": "motorway_junction", "ref": "12B"}}, relations), [], "signs"
    )


def sign(graph: RoadGraph, tail_id: int, head_id: int) -> RoadSign:
    assert graph.signs is not None
    ends = (graph.node_id[graph.tail] == tail_id) & (graph.node_id[graph.head] == head_id) & (graph.way_id == 10)
    return graph.signs.signs[int(graph.signs.sign_idx[np.flatnonzero(ends)[0]])]


def test_sign_of_a_link_has_what_is_tagged_in_its_direction(draw_map: Any) -> None:
    graph = drawn(draw_map)
    ahead, back = sign(graph, 1, 5), sign(graph, 5, 1)
    both = RoadSign(
        highway="trunk_link", ref="N 1", destination_ref="A 3", lanes=2, names=(("en", "First Street"),)
    )  # 4 lanes are of both directions
    assert ahead == replace(both, destination="Porto;Braga")
    assert back == replace(both, turn_lanes="left|through")


def test_links_end_where_a_sign_changes_so_that_none_is_lost(draw_map: Any) -> None:
    graph = drawn(draw_map)  # two roads meet at point 5, with no third: a link may not run over both
    assert {graph.names[k] for k in graph.name_idx[graph.way_id == 10]} == {"Rua Um"}
    assert {graph.names[k] for k in graph.name_idx[graph.way_id == 11]} == {"Rua Dois"}
    assert graph.signs is not None
    assert [int(graph.node_id[k]) for k in graph.signs.exit_node] == [5]
    assert graph.signs.exit_ref == ("12B",)


def test_signs_come_back_from_files_and_exports(draw_map: Any, tmp_path: Path) -> None:
    graph = drawn(draw_map)
    save_graph(graph, tmp_path / "signs")
    for again in (load_graph(tmp_path / "signs"), from_networkx(to_networkx(graph))):
        assert graph.signs is not None
        assert again.signs is not None
        assert again.signs.sign_idx.tolist() == graph.signs.sign_idx.tolist()
        assert again.signs.exit_node.tolist() == graph.signs.exit_node.tolist()
        assert (again.signs.signs, again.signs.exit_ref) == (graph.signs.signs, graph.signs.exit_ref)
        assert again.signs.drives_left == graph.signs.drives_left


def test_file_of_signs_that_was_changed_is_refused(draw_map: Any, tmp_path: Path) -> None:
    save_graph(drawn(draw_map), tmp_path / "signs")
    file = tmp_path / "signs" / "signs.json"
    file.write_text(file.read_text(encoding="utf-8").replace("N 1", "N 2"), encoding="utf-8")
    with pytest.raises(GraphFormatError, match=r"signs\.json"):
        load_graph(tmp_path / "signs")


@pytest.mark.parametrize(
    "damage",
    [
        {"sign_idx": [0] * 4},
        {"sign_idx": [99] * 8},
        {"exit_node": [7777]},
        {"exit_ref": []},
        {"signs": [{"nonsense": "1"}] * 9},
        {"signs": [{"ref": 5}] * 9},
        {"signs": [{"lanes": -1}] * 9},
    ],
)
def test_signs_that_do_not_fit_their_graph_are_refused(draw_map: Any, damage: dict[str, Any]) -> None:
    export = to_networkx(drawn(draw_map))
    columns = json.loads(export.graph["joulepath_signs"])
    export.graph["joulepath_signs"] = json.dumps(columns | damage)
    with pytest.raises(GraphFormatError, match="damaged"):
        from_networkx(export)


def ring(east_m: float, way: int, *, clockwise: bool) -> tuple[dict[int, tuple[float, float]], list[int]]:
    places = {
        100 * way + k: (east_m + 10.0 * x, 10.0 * y) for k, (x, y) in enumerate([(-1, 0), (0, -1), (1, 0), (0, 1)])
    }
    order = [*places, min(places)]
    return places, order[::-1] if clockwise else order


@pytest.mark.parametrize("clockwise", [False, True])
@pytest.mark.parametrize("direction", ["yes", "-1"])
def test_traffic_keeps_to_the_side_that_rings_say(draw_map: Any, clockwise: bool, direction: str) -> None:
    places: dict[int, tuple[float, float]] = {}
    ways: dict[int, tuple[list[int], dict[str, str]]] = {}
    for k in range(3):
        found, order = ring(100.0 * k, k + 1, clockwise=clockwise)
        places |= found
        if direction == "-1":
            order = order[::-1]
        ways[k + 1] = (order, {"highway": "residential", "junction": "roundabout", "oneway": direction})
    for k in (1, 2):
        ways[10 + k] = ([100 * k + 2, 100 * (k + 1)], {"highway": "residential"})
    graph = import_region(draw_map(places, ways), [], "rings")
    assert graph.signs is not None
    assert graph.signs.drives_left == clockwise


def test_traffic_keeps_left_where_the_boundary_or_an_address_says_so(draw_map: Any) -> None:
    boundary = {"type": "boundary", "boundary": "administrative", "admin_level": "2", "ISO3166-1": "PT"}
    for tags, left in (({}, False), ({"driving_side": "left"}, True), ({"ISO3166-1": "GB"}, True)):
        graph = drawn(draw_map, [([("w", 10, "outer")], {**boundary, **tags})])
        assert graph.signs is not None
        assert graph.signs.drives_left == left


def test_name_in_another_language_is_kept_where_it_differs(draw_map: Any) -> None:
    ways = {
        20: ([2, 5], {"highway": "service", "name": "Rua", "name:pt": "Rua", "int_name": "Road"}),
        21: ([3, 5], {"highway": "service", "name": "Via", "name:pt": "Rua", "int_name": "Road"}),
    }
    graph = drawn(draw_map, **{str(k): way for k, way in ways.items()})
    assert graph.signs is not None
    names = {int(way): graph.signs.signs[k].names for way, k in zip(graph.way_id, graph.signs.sign_idx, strict=True)}
    assert names[20] == (("int", "Road"),)
    assert names[21] == (("int", "Road"), ("pt", "Rua"))


def test_plain_lanes_of_a_two_way_road_say_nothing_of_one_direction() -> None:
    tags = {"highway": "primary", "lanes": "3", "turn:lanes": "left|through|right", "junction": "Roundabout"}
    assert sign_of(tags, "forward", oneway=True).turn_lanes == "left|through|right"
    both = sign_of(tags, "forward", oneway=False)
    assert (both.turn_lanes, both.lanes, both.junction) == ("", 1, "roundabout")
    assert sign_of({"lanes": "many"}, "forward", oneway=True).lanes == 0


def test_graphml_brings_numbers_rings_and_lanes(tmp_path: Path) -> None:
    osmnx: nx.MultiDiGraph[Any] = nx.MultiDiGraph(crs="epsg:4326")
    for node, (x, y) in {1: (1.5, 42.0), 2: (1.51, 42.0), 3: (1.505, 42.01)}.items():
        osmnx.add_node(node, x=x, y=y)
    osmnx.nodes[2].update(highway="motorway_junction", ref="7")
    for u, v, tags in (
        (1, 2, {"highway": "trunk_link", "ref": "['A 1', 'IC 2']", "lanes": "2"}),
        (2, 3, {"highway": "primary", "junction": "roundabout"}),
        (3, 1, {"highway": "primary", "name": "Rua"}),
    ):
        osmnx.add_edge(u, v, osmid=10 * u + v, oneway=True, length=900.0, **tags)
    nx.write_graphml(osmnx, tmp_path / "osmnx.graphml")
    graph = import_region(tmp_path / "osmnx.graphml", [], "osmnx")
    assert graph.signs is not None
    by_way = {int(way): graph.signs.signs[k] for way, k in zip(graph.way_id, graph.signs.sign_idx, strict=True)}
    assert by_way[12] == RoadSign(highway="trunk_link", ref="A 1", lanes=2)
    assert by_way[23].junction == "roundabout"
    assert graph.signs.exit_ref == ("7",)
