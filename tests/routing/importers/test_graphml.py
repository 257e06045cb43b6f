"""Graphs from GraphML files laid out as OSMnx writes them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import networkx as nx
import numpy as np
import pytest

from energy.stops import Cross, FunctionalClass
from routing.errors import GraphFormatError, ImportFailedError
from routing.graph.road_graph import RoadGraph, Terrain
from routing.importers.region import import_region

# 1 to 2 two-way and bent, 2 to 3 two oneways, 3 to 1 a oneway, as osmnx.save_graphml writes it: every value is text
NODES: dict[int, dict[str, str]] = {
    1: {"y": "42.0", "x": "1.5", "street_count": "3"},
    2: {"y": "42.0", "x": "1.51", "street_count": "3", "highway": "traffic_signals"},
    3: {"y": "42.01", "x": "1.505", "street_count": "2"},
}
BENT = "LINESTRING (1.5 42, 1.505 41.999, 1.51 42)"
BACK = "LINESTRING (1.51 42, 1.505 41.999, 1.5 42)"
EDGES: list[tuple[int, int, dict[str, str]]] = [
    (
        1,
        2,
        {
            "osmid": "[100, 101]",
            "highway": "['tertiary', 'residential']",
            "maxspeed": "['50', '30']",
            "name": "['Long Street', 'Short Street']",
            "oneway": "False",
            "reversed": "False",
            "length": "860.5",
            "geometry": BENT,
        },
    ),
    (
        2,
        1,
        {
            "osmid": "[100, 101]",
            "highway": "['tertiary', 'residential']",
            "maxspeed": "50",
            "oneway": "False",
            "reversed": "True",
            "length": "860.5",
            "geometry": BACK,
        },
    ),
    (
        2,
        3,
        {
            "osmid": "102",
            "highway": "primary",
            "maxspeed": "30 mph",
            "oneway": "True",
            "reversed": "False",
            "length": "1190.0",
            "bridge": "yes",
        },
    ),
    (3, 1, {"osmid": "103", "highway": "unclassified", "oneway": "True", "reversed": "False", "length": "1190.0"}),
    (3, 2, {"osmid": "105", "highway": "secondary", "oneway": "True", "reversed": "False", "length": "1250.0"}),
]


def write(path: Path, nodes: Any = NODES, edges: Any = EDGES, crs: str = "epsg:4326") -> Path:
    graph = nx.MultiDiGraph(crs=crs, simplified="True")
    for node, data in nodes.items():
        graph.add_node(node, **data)
    for tail, head, data in edges:
        graph.add_edge(tail, head, **data)
    nx.write_graphml(graph, path)
    return path


def link_of(graph: RoadGraph, tail_id: int, head_id: int) -> int:
    ends = (graph.node_id[graph.tail] == tail_id) & (graph.node_id[graph.head] == head_id)
    (found,) = np.flatnonzero(ends).tolist()
    return int(found)


def test_graphml_gives_the_links_it_states(tmp_path: Path) -> None:
    graph = import_region(write(tmp_path / "town.graphml"), [], "town")
    assert (graph.node_count, graph.link_count) == (3, 5)
    there, back, bridge, last = link_of(graph, 1, 2), link_of(graph, 2, 1), link_of(graph, 2, 3), link_of(graph, 3, 1)
    assert graph.length_m[[there, back, bridge, last]] == pytest.approx([860.5, 860.5, 1190.0, 1190.0], rel=1e-12)
    assert graph.reverse_idx[there] == back
    assert graph.reverse_idx[bridge] == -1
    assert graph.speed_limit_mps[there] == pytest.approx(30 / 3.6)
    assert graph.speed_limit_mps[back] == pytest.approx(50 / 3.6)
    assert graph.speed_limit_mps[bridge] == pytest.approx(30 * 0.44704)
    assert graph.speed_limit_mps[last] == pytest.approx(60 / 3.6)  # the general default outside towns
    assert graph.functional_class[there] == FunctionalClass.TERTIARY
    assert graph.way_id[there] == 100
    assert graph.names[graph.name_idx[there]] == "Long Street"
    assert graph.structure[[there, bridge]].tolist() == [False, True]
    assert graph.geometry(there).tolist() == [[1.5, 42.0], [1.505, 41.999], [1.51, 42.0]]
    assert graph.cross[there] == Cross.LARGE
    assert graph.meta.terrain is Terrain.ABSENT


def test_graphml_with_elevation_keeps_it(tmp_path: Path) -> None:
    nodes = {k: {**data, "elevation": str(100.0 + 10.0 * k)} for k, data in NODES.items()}
    graph = import_region(write(tmp_path / "hills.graphml", nodes), [], "hills")
    assert graph.meta.terrain is Terrain.MEASURED
    assert graph.meta.smoothing_m == 0.0
    assert dict(zip(graph.node_id.tolist(), graph.node_height_m.tolist(), strict=True)) == pytest.approx(
        {1: 110.0, 2: 120.0, 3: 130.0}, abs=1e-9
    )


def test_graphml_with_elevation_on_some_nodes_is_refused(tmp_path: Path) -> None:
    nodes = {**NODES, 1: {**NODES[1], "elevation": "5"}}
    with pytest.raises(ImportFailedError, match="2 of 3 nodes have none"):
        import_region(write(tmp_path / "half.graphml", nodes), [], "half")


def test_graphml_edge_without_a_believable_length_takes_that_of_its_line(tmp_path: Path) -> None:
    edges = [*EDGES[:3], (3, 1, {**EDGES[3][2], "length": "0"}), EDGES[4]]
    graph = import_region(write(tmp_path / "zero.graphml", edges=edges), [], "zero")
    # 0.005° east at 42° on WGS 84 is 414.25 m, 0.01° north 1110.73 m; their hypotenuse
    assert graph.length_m[link_of(graph, 3, 1)] == pytest.approx(np.hypot(414.25, 1110.73), rel=1e-4)


def test_graphml_edges_that_cars_may_not_drive_are_dropped(tmp_path: Path) -> None:
    edges = [*EDGES, (3, 2, {"osmid": "104", "highway": "footway", "length": "1190"})]
    graph = import_region(write(tmp_path / "foot.graphml", edges=edges), [], "foot")
    assert graph.link_count == 5
    assert graph.meta.dropped["ways_without_access"] == 1


@pytest.mark.parametrize(
    ("nodes", "crs", "message"),
    [
        ({**NODES, 1: {"x": "1.5"}}, "epsg:4326", "node 1 y None"),
        ({**NODES, 1: {"x": "1.5", "y": "95"}}, "epsg:4326", r"node 1 y 95\.0: allowed: -90\.\.90 deg"),
        (NODES, "epsg:32631", "crs epsg:32631: allowed: epsg:4326"),
    ],
)
def test_graphml_out_of_range_names_the_value(tmp_path: Path, nodes: Any, crs: str, message: str) -> None:
    with pytest.raises(ImportFailedError, match=message):
        import_region(write(tmp_path / "bad.graphml", nodes, crs=crs), [], "bad")


def test_graphml_without_edges_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ImportFailedError, match="no edges"):
        import_region(write(tmp_path / "bare.graphml", edges=[]), [], "bare")


def test_graphml_that_is_none_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "text.graphml"
    path.write_text("not xml")
    with pytest.raises(GraphFormatError, match=r"text\.graphml"):
        import_region(path, [], "text")


def test_graphml_that_is_missing_is_named(tmp_path: Path) -> None:
    with pytest.raises(ImportFailedError, match="no such file"):
        import_region(tmp_path / "gone.graphml", [], "gone")
