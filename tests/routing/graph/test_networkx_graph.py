"""RoadGraph to networkx and GraphML, and back."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import networkx as nx
import numpy as np
import pytest

from routing.errors import GraphFormatError, ImportFailedError
from routing.graph.files import load_graph, save_graph
from routing.graph.networkx_graph import from_networkx, read_graphml, to_networkx, write_graphml
from routing.graph.road_graph import ARRAY_NAMES, RoadGraph
from routing.importers.region import import_region

STREET = {"highway": "residential", "name": "Ç & <b>"}


def assert_equal(a: RoadGraph, b: RoadGraph) -> None:
    for name in ARRAY_NAMES:
        x, y = getattr(a, name), getattr(b, name)
        assert x.dtype == y.dtype, name
        assert np.array_equal(x, y), name
    assert a.names == b.names
    assert a.meta == b.meta


@pytest.fixture
def crossing(draw_map: Any) -> RoadGraph:
    points = {1: (0, 0), 2: (100, 3), 3: (0, 100), 4: (-100, 0), 5: (0, -2000), 6: (70, 70)}
    ways = {
        10: ([4, 1, 2], STREET),
        11: ([5, 1, 3], {"highway": "primary", "maxspeed": "77 mph", "bridge": "yes"}),
        12: ([2, 6, 3], {"highway": "tertiary", "oneway": "yes"}),
        13: ([2, 3], {"highway": "service"}),
    }
    members = [("w", 12, "from"), ("n", 3, "via"), ("w", 11, "to")]
    relations = [(members, {"type": "restriction", "restriction": "no_left_turn"})]
    path = draw_map(points, ways, {1: {"highway": "traffic_signals"}}, relations)
    return import_region(path, [], "crossing")


def test_networkx_round_trip_is_exact(crossing: RoadGraph) -> None:
    assert_equal(from_networkx(to_networkx(crossing)), crossing)


def test_graphml_round_trip_is_exact(crossing: RoadGraph, tmp_path: Path) -> None:
    path = tmp_path / "out.graphml"
    write_graphml(crossing, path)
    assert_equal(read_graphml(path), crossing)
    assert [p.name for p in tmp_path.iterdir() if p.name.startswith(".")] == []


def test_round_trip_through_a_folder_and_graphml_is_exact(crossing: RoadGraph, tmp_path: Path) -> None:
    save_graph(crossing, tmp_path / "stored")
    write_graphml(load_graph(tmp_path / "stored"), tmp_path / "out.graphml")
    assert_equal(read_graphml(tmp_path / "out.graphml"), crossing)


def test_import_of_an_export_gives_the_same_graph_under_its_new_name(crossing: RoadGraph, tmp_path: Path) -> None:
    write_graphml(crossing, tmp_path / "out.graphml")
    again = import_region(tmp_path / "out.graphml", [], "again")
    assert again.meta.name == "again"
    assert_equal(replace(again, meta=crossing.meta), crossing)


def test_import_of_an_export_with_an_elevation_model_is_refused(crossing: RoadGraph, tmp_path: Path) -> None:
    write_graphml(crossing, tmp_path / "out.graphml")
    with pytest.raises(ImportFailedError, match="its own heights"):
        import_region(tmp_path / "out.graphml", [tmp_path / "dem.tif"], "again")


def test_export_is_laid_out_as_osmnx_does(crossing: RoadGraph) -> None:
    graph = to_networkx(crossing)
    assert isinstance(graph, nx.MultiDiGraph)
    assert graph.graph["crs"] == "epsg:4326"
    assert graph.number_of_nodes() == crossing.node_count
    assert graph.number_of_edges() == crossing.link_count
    junction = graph.nodes[1]
    assert (junction["x"], junction["y"]) == pytest.approx((1.5, 42.0))
    assert junction["street_count"] == 4
    edge = graph.edges[4, 1, 0]
    assert edge["osmid"] == 10
    assert edge["highway"] == "residential"
    assert edge["name"] == "Ç & <b>"
    assert edge["oneway"] is False
    assert edge["reversed"] is not graph.edges[1, 4, 0]["reversed"]
    assert edge["length"] == pytest.approx(100.0, rel=1e-4)
    assert next(iter(edge["geometry"].coords)) == pytest.approx((1.5 - 100.0 / 82_850.76, 42.0), abs=1e-7)
    assert any(data["oneway"] for *_, data in graph.edges(data=True))


def test_export_file_reads_back_by_the_rules_of_osmnx(crossing: RoadGraph, tmp_path: Path) -> None:
    # what osmnx.load_graphml relies on: whole-number nodes and keys, all values text, geometry as WKT
    write_graphml(crossing, tmp_path / "out.graphml")
    raw: Any = nx.read_graphml(tmp_path / "out.graphml", node_type=int, edge_key_type=int, force_multigraph=True)
    for _, data in raw.nodes(data=True):
        assert {"x", "y"} <= data.keys()
        assert all(isinstance(value, str) for value in data.values())
    for _, _, key, data in raw.edges(keys=True, data=True):
        assert isinstance(key, int)
        assert data["geometry"].startswith("LINESTRING (")
        assert data["oneway"] in ("True", "False")
        assert float(data["length"]) > 0.0


def test_export_of_another_version_is_refused(crossing: RoadGraph, tmp_path: Path) -> None:
    graph = to_networkx(crossing)
    graph.graph["joulepath_format_version"] = 99
    with pytest.raises(GraphFormatError, match=r"joulepath_format_version of graph .* is 99, allowed: 1"):
        from_networkx(graph)


def test_export_that_lost_an_edge_is_refused(crossing: RoadGraph) -> None:
    graph = to_networkx(crossing)
    graph.remove_edge(4, 1)
    with pytest.raises(GraphFormatError, match="gaps"):
        from_networkx(graph)


def test_export_that_lost_an_attribute_is_refused(crossing: RoadGraph) -> None:
    graph = to_networkx(crossing)
    del graph.edges[4, 1, 0]["cross"]
    with pytest.raises(GraphFormatError, match="cross"):
        from_networkx(graph)


@pytest.mark.parametrize(
    ("attribute", "value", "message"),
    [
        ("geometry", "LINESTRING (1 x)", "content of graph .*LINESTRING"),
        ("geometry", "GEOMETRYCOLLECTION (" * 50_000, "content of graph .*no LINESTRING"),
        ("functional_class", "1000", "content of graph .*1000"),
        ("reverse_idx", "9223372036854775808", "content of graph .*too large"),
    ],
)
def test_export_with_a_damaged_value_is_refused(crossing: RoadGraph, attribute: str, value: str, message: str) -> None:
    graph = to_networkx(crossing)
    graph.edges[4, 1, 0][attribute] = value
    with pytest.raises(GraphFormatError, match=message):
        from_networkx(graph)


def test_graph_of_others_is_no_export(crossing: RoadGraph) -> None:
    with pytest.raises(GraphFormatError, match="missing"):
        from_networkx(nx.MultiDiGraph(crs="epsg:4326"))


def test_write_that_fails_leaves_the_old_file(
    crossing: RoadGraph, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "out.graphml"
    path.write_text("old")

    def fail(*_: Any, **__: Any) -> None:
        raise OSError("disk full")

    monkeypatch.setattr(nx, "write_graphml_xml", fail)
    with pytest.raises(OSError, match="disk full"):
        write_graphml(crossing, path)
    assert [p.name for p in tmp_path.iterdir() if "graphml" in p.name] == ["out.graphml"]
    assert path.read_text() == "old"
