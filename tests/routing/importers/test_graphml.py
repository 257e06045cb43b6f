"""Graphs from GraphML files laid out as OSMnx writes them."""

from __future__ import annotations

import gzip
from pathlib import Path
from typing import Any

import networkx as nx
import numpy as np
import pytest
import shapely
from rasterio.crs import CRS
from rasterio.warp import transform

from energy.stops import Cross, FunctionalClass
from routing.errors import GraphFormatError, ImportFailedError
from routing.graph.road_graph import RoadGraph, Terrain
from routing.importers.graphml import _values
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
        ({**NODES, 1: {"x": "1.5"}}, "epsg:4326", r"node 1 y None: is missing, allowed: -90\.\.90 deg"),
        ({**NODES, 1: {"x": "1.5", "y": "95"}}, "epsg:4326", r"node 1 y 95\.0: allowed: -90\.\.90 deg"),
        ({**NODES, 1: {"x": "42.0", "y": "151.5"}}, "epsg:4326", "longitude swapped"),
        ({**NODES, 1: {"x": "429000", "y": "42.0"}}, "epsg:4326", r"x 429000\.0: .* in metres needs its crs"),
        ({**NODES, 1: {"x": "1.5", "y": "nan"}}, "epsg:4326", "node 1 y nan"),
        (NODES, "epsg:32631", "looks like degrees, but the graph's crs is EPSG:32631"),
        (NODES, "{'a':" * 5000, "crs {'a':.*: allowed: epsg:4326"),
        (NODES, '{"a":' * 50_000, 'crs {"a":.*: allowed: epsg:4326'),
        (NODES, "a plane drawing", "crs a plane drawing: allowed: epsg:4326"),
        # GDAL would fetch the one and open the other
        (NODES, "http://localhost:1/crs.xml", "crs http://localhost:1/crs.xml: allowed: epsg:4326"),
        (NODES, "/etc/hostname", "crs /etc/hostname: allowed: epsg:4326"),
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


SAME_PLACE = (
    *("epsg:4326", "EPSG:4326", "WGS84", "WGS 84", "urn:ogc:def:crs:EPSG::4326", "urn:ogc:def:crs:OGC:1.3:CRS84"),
    *(
        "EPSG 4326",
        "epsg::4326",
        "4326.0",
        "WGS_1984",
        "GCS_WGS_1984",
        "wgs-84",
        "http://www.opengis.net/def/crs/EPSG/0/4326",
    ),
    *("http://www.opengis.net/gml/srs/epsg.xml#4326", "https://www.opengis.net/def/crs/OGC/1.3/CRS84"),
    '{"type": "name", "properties": {"name": "urn:ogc:def:crs:OGC:1.3:CRS84"}}',
    *("OGC:CRS84", "{'init': 'epsg:4326'}", "+init=epsg:4326", "+proj=longlat +datum=WGS84 +no_defs"),
)


@pytest.mark.parametrize("crs", SAME_PLACE)
def test_every_name_of_wgs_84_leaves_the_places_as_they_are(tmp_path: Path, crs: str) -> None:
    graph = import_region(write(tmp_path / "named.graphml", crs=crs), [], "named")
    assert sorted(graph.node_lon_deg.tolist()) == pytest.approx([1.5, 1.505, 1.51], abs=1e-7)
    assert graph.node_lat_deg.max() == pytest.approx(42.01, abs=1e-7)


def projected(crs: str) -> tuple[dict[int, dict[str, str]], list[tuple[int, int, dict[str, str]]]]:
    """NODES and EDGES in another coordinate system, as osmnx.project_graph makes them."""

    def at(lon: float, lat: float) -> tuple[float, float]:
        x, y = transform("EPSG:4326", crs, [lon], [lat])[:2]
        return float(x[0]), float(y[0])

    nodes = {}
    for node, data in NODES.items():
        x, y = at(float(data["x"]), float(data["y"]))
        nodes[node] = {**data, "lon": data["x"], "lat": data["y"], "x": str(x), "y": str(y)}
    edges = []
    for u, v, data in EDGES:
        moved = dict(data)
        if "geometry" in data:
            line = [at(x, y) for x, y in shapely.get_coordinates(shapely.from_wkt(data["geometry"])).tolist()]
            moved["geometry"] = shapely.LineString(line).wkt
        edges.append((u, v, moved))
    return nodes, edges


UTM_ON_CRS84 = CRS.from_epsg(32631).to_wkt().replace("WGS 84", "CRS84")


@pytest.mark.parametrize(
    "crs",
    [
        *("EPSG:32631", "EPSG:3857", "+proj=utm +zone=31 +datum=WGS84", CRS.from_epsg(32631).to_wkt(), UTM_ON_CRS84),
    ],
)
def test_a_projected_graph_is_put_back_to_its_places(tmp_path: Path, crs: str) -> None:
    nodes, edges = projected(crs)
    plain = import_region(write(tmp_path / "plain.graphml"), [], "plain")
    graph = import_region(write(tmp_path / "metres.graphml", nodes, edges, crs), [], "metres")
    assert graph.node_lon_deg == pytest.approx(plain.node_lon_deg, abs=2e-7)
    assert graph.node_lat_deg == pytest.approx(plain.node_lat_deg, abs=2e-7)
    assert graph.length_m == pytest.approx(plain.length_m)
    assert graph.geometry_lat_e7 == pytest.approx(plain.geometry_lat_e7, abs=2)
    assert graph.reverse_idx.tolist() == plain.reverse_idx.tolist()


@pytest.mark.parametrize(
    "crs",
    [
        *("EPSG 32631", "epsg::32631", "urn:ogc:def:crs:EPSG::32631", "http://www.opengis.net/def/crs/EPSG/0/32631"),
        "{'datum': 'WGS84', 'ellps': 'WGS84', 'proj': 'utm', 'zone': 31, 'units': 'm', 'no_defs': True}",  # OSMnx 0.10
    ],
)
def test_every_name_of_a_projection_puts_a_graph_back_to_its_places(tmp_path: Path, crs: str) -> None:
    nodes, edges = projected("EPSG:32631")
    graph = import_region(write(tmp_path / "named.graphml", nodes, edges, crs), [], "named")
    assert sorted(graph.node_lon_deg.tolist()) == pytest.approx([1.5, 1.505, 1.51], abs=2e-7)


def test_a_projected_graph_with_lines_in_degrees_is_refused(tmp_path: Path) -> None:
    nodes, _ = projected("EPSG:32631")
    with pytest.raises(ImportFailedError, match=r"geometry .*looks like degrees"):
        import_region(write(tmp_path / "mixed.graphml", nodes, EDGES, "EPSG:32631"), [], "mixed")


def test_a_place_beyond_its_projection_is_named(tmp_path: Path) -> None:
    nodes, edges = projected("EPSG:32631")
    nodes[2]["x"] = "1e30"
    with pytest.raises(ImportFailedError, match=r"node x, y .*EPSG:32631"):
        import_region(write(tmp_path / "far.graphml", nodes, edges, "EPSG:32631"), [], "far")


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("LINESTRING (429000 4650000, 429500 4650000, 430000 4650000)", r"geometry of edge 1 -> 2 .*in metres"),
        ("LINESTRING (42 1.5, 41.999 1.505, 42 1.51)", r"geometry of edge 1 -> 2 .*longitude are swapped"),
        ("LINESTRING (1.6 42, 1.605 42, 1.61 42)", r"geometry of edge 1 -> 2 .*ends 8\d\d\d m from its nodes"),
        ("LINESTRING (1.5 42, 1.505 41", r"geometry of edge 1 -> 2 .*WKT LINESTRING"),
        ("POINT (1.5 42)", r"geometry of edge 1 -> 2 .*WKT LINESTRING"),
        ("MULTILINESTRING ((1.5 42, 1.504 42), (1.506 42, 1.51 42))", r"geometry of edge 1 -> 2 .*WKT LINESTRING"),
        ("GEOMETRYCOLLECTION (" * 50_000, r"geometry of edge 1 -> 2 .*WKT LINESTRING"),
        ("LINESTRING (1.5 42, nan nan, 1.51 42)", r"geometry of edge 1 -> 2 .*LINESTRING"),
    ],
)
def test_a_line_that_does_not_join_its_nodes_is_named(tmp_path: Path, line: str, message: str) -> None:
    edges = [(1, 2, {**EDGES[0][2], "geometry": line}), *EDGES[1:]]
    with pytest.raises(ImportFailedError, match=message):
        import_region(write(tmp_path / "line.graphml", edges=edges), [], "line")


@pytest.mark.parametrize("value", ["{[]}", "{{}}", "[" * 5000, "{'a': }"])
def test_a_text_that_is_a_list_of_nothing_known_is_a_plain_text(tmp_path: Path, value: str) -> None:
    edges = [(1, 2, {**EDGES[0][2], "name": value}), *EDGES[1:]]
    graph = import_region(write(tmp_path / "odd.graphml", edges=edges), [], "odd")
    assert graph.names[graph.name_idx[link_of(graph, 1, 2)]] == value


@pytest.mark.parametrize("line", ["LINESTRING EMPTY", "MULTILINESTRING EMPTY"])
def test_an_empty_line_is_none(tmp_path: Path, line: str) -> None:
    edges = [(u, v, {**data, "geometry": line}) for u, v, data in EDGES]
    graph = import_region(write(tmp_path / "empty.graphml", edges=edges), [], "empty")
    assert graph.geometry(link_of(graph, 1, 2)).tolist() == [[1.5, 42.0], [1.51, 42.0]]


@pytest.mark.parametrize(
    "line",
    [
        "LINESTRING Z (1.5 42 7, 1.505 41.999 8, 1.51 42 9)",
        "LineString(1.5 42, 1.505 41.999, 1.51 42)",
        "MULTILINESTRING ((1.5 42, 1.505 41.999), (1.505 41.999, 1.51 42))",
        "LINESTRING (1.5 42, 1.5050001 41.9990001, 1.51 42)",
    ],
)
def test_a_line_in_another_form_pairs_both_directions(tmp_path: Path, line: str) -> None:
    edges = [(1, 2, {**EDGES[0][2], "geometry": line}), *EDGES[1:]]
    graph = import_region(write(tmp_path / "form.graphml", edges=edges), [], "form")
    there, back = link_of(graph, 1, 2), link_of(graph, 2, 1)
    assert graph.reverse_idx[there] == back
    assert graph.geometry(there) == pytest.approx(np.array([[1.5, 42.0], [1.505, 41.999], [1.51, 42.0]]), abs=2e-7)


@pytest.mark.parametrize(("length", "paired"), [("860.5", True), ("865", True), ("1200", False)])
def test_a_direction_without_its_line_is_paired_by_its_length(tmp_path: Path, length: str, paired: bool) -> None:
    bare = {k: x for k, x in EDGES[1][2].items() if k != "geometry"}
    edges = [EDGES[0], (2, 1, {**bare, "length": length}), *EDGES[2:]]
    graph = import_region(write(tmp_path / "bare.graphml", edges=edges), [], "bare")
    assert bool(graph.reverse_idx[link_of(graph, 1, 2)] == link_of(graph, 2, 1)) is paired


@pytest.mark.parametrize(
    ("text", "values"),
    [
        ("['50', nan]", ["50"]),
        ("[nan, 'a']", ["a"]),
        ('[nan, "L\'Hospitalet"]', ["L'Hospitalet"]),
        ("[None, 'nan street']", ["nan street"]),
        ("[np.float64(41.3), np.float64(50.0)]", ["41.3", "50.0"]),
        ("[np.str_('A (B)'), nan]", ["A (B)"]),
        ("np.float64(41.3)", ["41.3"]),
        ("np.nan", []),
        ("[np.nan, <NA>, 'a']", ["a"]),
        ("[null]", ["[null]"]),
        ("(1, 2)", ["1", "2"]),
        ("{'x'}", ["x"]),
        ("[Foo]", ["[Foo]"]),
    ],
)
def test_a_list_in_text_has_its_values_and_not_its_gaps(text: str, values: list[str]) -> None:
    assert _values(text) == values


def test_the_lowest_limit_of_a_list_with_gaps_holds(tmp_path: Path) -> None:
    edges = [(u, v, {**data, "maxspeed": "['60', nan, '40']"}) for u, v, data in EDGES]
    graph = import_region(write(tmp_path / "gaps.graphml", edges=edges), [], "gaps")
    assert graph.speed_limit_mps * 3.6 == pytest.approx(40.0)


@pytest.mark.parametrize("access", ["['yes', 'private']", "['private', 'yes']", "[nan, 'no']"])
def test_an_edge_of_which_a_part_is_closed_is_closed(tmp_path: Path, access: str) -> None:
    """OSMnx joins ways to an edge whose lists have the values of its parts."""
    edges = [*EDGES, (3, 2, {"osmid": "109", "highway": "residential", "access": access, "length": "1250"})]
    graph = import_region(write(tmp_path / "part.graphml", edges=edges), [], "part")
    assert 109 not in graph.way_id
    assert graph.meta.dropped["ways_without_access"] == 1


def test_a_track_that_is_open_to_cars_is_a_road(tmp_path: Path) -> None:
    track = {"osmid": "109", "highway": "track", "length": "1250"}
    graph = import_region(
        write(tmp_path / "t.graphml", edges=[*EDGES, (3, 2, {**track, "motor_vehicle": "yes"})]), [], "track"
    )
    assert 109 in graph.way_id


def ladder(factor: float) -> tuple[dict[int, dict[str, str]], list[tuple[int, int, dict[str, str]]]]:
    """Twelve streets east of each other along 42° N, 0.01° or 828.5 m each, their stated lengths times a factor."""
    nodes = {k: {"y": "42.0", "x": f"{1.5 + 0.01 * k:.2f}"} for k in range(13)}
    data = {"highway": "residential", "length": f"{828.5076 * factor:.3f}"}
    pairs = [(k, k + 1) for k in range(12)]
    return nodes, [(u, v, {**data, "osmid": str(a)}) for a, b in pairs for u, v in ((a, b), (b, a))]


@pytest.mark.parametrize(
    ("factor", "counted"), [(1 / 0.3048, 12), (1 / 0.9144, 12), (0.001, 12), (1.3456, 12), (1.0, 0)]
)
def test_lengths_that_are_all_in_another_unit_are_those_of_the_lines(
    tmp_path: Path, factor: float, counted: int
) -> None:
    graph = import_region(write(tmp_path / "unit.graphml", *ladder(factor)), [], "unit")
    assert graph.length_m.sum() == pytest.approx(2 * 12 * 828.5076, rel=1e-6)
    assert graph.meta.dropped.get("stated_lengths_implausible", 0) == counted


def test_a_length_that_is_longer_than_its_line_holds_where_others_are_not(tmp_path: Path) -> None:
    nodes, edges = ladder(1.0)
    edges = [(u, v, {**data, "length": "1200"} if data["osmid"] == "3" else data) for u, v, data in edges]
    graph = import_region(write(tmp_path / "bends.graphml", nodes, edges), [], "bends")
    assert graph.length_m[graph.way_id == 3].sum() == pytest.approx(2400.0)


@pytest.mark.parametrize(("x", "y"), [("lon", "lat"), ("longitude", "latitude"), ("lng", "lat")])
def test_nodes_that_name_longitude_and_latitude_lie_there(tmp_path: Path, x: str, y: str) -> None:
    nodes = {k: {x: data["x"], y: data["y"]} for k, data in NODES.items()}
    graph = import_region(write(tmp_path / "named.graphml", nodes, crs="None"), [], "named")
    assert sorted(graph.node_lon_deg.tolist()) == pytest.approx([1.5, 1.505, 1.51], abs=1e-7)


@pytest.mark.parametrize("name", ["town.graphml", "town.graphml.gz", "town.xml"])
@pytest.mark.parametrize(
    "namespace", ["http://graphml.graphdrawing.org/xmlns", "http://graphml.graphdrawing.org/xmlns/1.0rc", ""]
)
def test_a_graphml_is_read_whatever_its_name_packing_and_namespace(tmp_path: Path, name: str, namespace: str) -> None:
    text = write(tmp_path / "plain.graphml").read_text(encoding="utf-8")
    text = text.replace(' xmlns="http://graphml.graphdrawing.org/xmlns"', f' xmlns="{namespace}"' if namespace else "")
    path = tmp_path / name
    path.write_bytes(gzip.compress(text.encode(), mtime=0) if name.endswith(".gz") else text.encode())
    assert import_region(path, [], "town").link_count == 5


def test_edges_without_a_highway_are_named_as_the_reason(tmp_path: Path) -> None:
    edges = [(u, v, {"length": data["length"]}) for u, v, data in EDGES]
    with pytest.raises(ImportFailedError, match="5 of them have no `highway`"):
        import_region(write(tmp_path / "gephi.graphml", edges=edges), [], "gephi")


def test_a_line_against_its_edge_is_turned(tmp_path: Path) -> None:
    edges = [(1, 2, {**EDGES[0][2], "geometry": BACK}), *EDGES[1:]]
    graph = import_region(write(tmp_path / "turned.graphml", edges=edges), [], "turned")
    there, back = link_of(graph, 1, 2), link_of(graph, 2, 1)
    assert graph.geometry(there).tolist() == [[1.5, 42.0], [1.505, 41.999], [1.51, 42.0]]
    assert graph.reverse_idx[there] == back
    assert graph.length_m[[there, back]] == pytest.approx([860.5, 860.5])


def test_latitude_for_longitude_is_told_by_the_lengths(tmp_path: Path) -> None:
    # 0.01° east at 42° are 828.6 m, 0.005° east and 0.01° north are 1185.5 m
    nodes = {k: {"x": data["y"], "y": data["x"]} for k, data in NODES.items()}
    edges = [(u, v, {"osmid": str(u + v), "highway": "primary", "length": m}) for u, v, m in STRAIGHT]
    with pytest.raises(ImportFailedError, match="latitude and longitude are swapped"):
        import_region(write(tmp_path / "swapped.graphml", nodes, edges), [], "swapped")
    right = import_region(write(tmp_path / "right.graphml", NODES, edges), [], "right")
    assert sorted(right.length_m.tolist()) == pytest.approx([828.6, 1185.5, 1185.5])


STRAIGHT = [(1, 2, "828.6"), (2, 1, "828.6"), (2, 3, "1185.5"), (3, 1, "1185.5")]
ABSENT = ("", "nan", "NaN", "None", "<NA>", "NULL", "null", "N/A")


@pytest.mark.parametrize("text", ABSENT)
def test_a_text_for_a_missing_value_is_no_value(tmp_path: Path, text: str) -> None:
    missing = dict.fromkeys(("bridge", "tunnel", "name", "ref", "junction", "access", "maxspeed", "speed_kph"), text)
    edges = [(u, v, {**data, **missing, "name": f"['{text}', '{text}']"}) for u, v, data in EDGES]
    nodes = {k: {**data, "elevation": text} for k, data in NODES.items()}
    graph = import_region(write(tmp_path / "missing.graphml", nodes, edges), [], "missing")
    assert graph.link_count == 5
    assert not graph.structure.any()
    assert set(graph.names) == {""}
    assert graph.meta.terrain is Terrain.ABSENT
    assert graph.meta.dropped.get("speed_limits_implausible", 0) == 0
    without = [
        (u, v, {k: x for k, x in data.items() if k not in missing and k not in ("geometry", "length")})
        for u, v, data in EDGES
    ]
    given = [(u, v, {**data, "geometry": text, "length": text}) for u, v, data in without]
    expected = import_region(write(tmp_path / "bare.graphml", NODES, without), [], "bare")
    graph = import_region(write(tmp_path / "given.graphml", NODES, given), [], "given")
    assert graph.length_m.tolist() == expected.length_m.tolist()


def test_a_missing_narrow_access_leaves_the_wide_one(tmp_path: Path) -> None:
    closed = (3, 2, {"osmid": "109", "highway": "residential", "motorcar": "nan", "access": "no", "length": "1250"})
    graph = import_region(write(tmp_path / "closed.graphml", edges=[*EDGES, closed]), [], "closed")
    assert 109 not in graph.way_id
    assert graph.meta.dropped["ways_without_access"] == 1


@pytest.mark.parametrize(
    ("elevation", "message"),
    [
        ("-9999", r"node 2 elevation -9999: allowed: -500\.\.9000 m"),
        ("29029", r"node 2 elevation 29029: allowed: -500\.\.9000 m"),
        ("inf", "node 2 elevation inf"),
        ("high", "node 2 elevation high: no number"),
        ("", "elevation .*1 of 3 nodes have none"),
        ("None", "elevation .*1 of 3 nodes have none"),
        ("nan", "elevation .*1 of 3 nodes have none"),
    ],
)
def test_an_elevation_that_is_none_is_named(tmp_path: Path, elevation: str, message: str) -> None:
    nodes = {k: {**data, "elevation": "100"} for k, data in NODES.items()}
    nodes[2]["elevation"] = elevation
    with pytest.raises(ImportFailedError, match=message):
        import_region(write(tmp_path / "high.graphml", nodes), [], "high")


def test_elevations_of_a_merged_junction_count_by_their_mean(tmp_path: Path) -> None:
    nodes = {k: {**data, "elevation": "100"} for k, data in NODES.items()}
    nodes[2]["elevation"] = "[100.0, 104.0]"
    graph = import_region(write(tmp_path / "merged.graphml", nodes), [], "merged")
    assert graph.node_height_m[graph.node_id == 2] == pytest.approx(102.0)


def test_a_speed_that_is_no_number_is_named_and_one_out_of_range_is_counted(tmp_path: Path) -> None:
    for text, kmh in (("fast", None), ("900", 60.0), ("-1", 60.0), ("48.3", 48.3), ("[60.0, 40.0]", 40.0)):
        edges = [*EDGES[:3], (3, 1, {**EDGES[3][2], "speed_kph": text}), EDGES[4]]
        path = write(tmp_path / "speed.graphml", edges=edges)
        if kmh is None:
            with pytest.raises(ImportFailedError, match=r"speed_kph fast: no number, allowed: 3\.\."):
                import_region(path, [], "speed")
            continue
        graph = import_region(path, [], "speed")
        assert graph.speed_limit_mps[link_of(graph, 3, 1)] == pytest.approx(kmh / 3.6)
        assert graph.meta.dropped.get("speed_limits_implausible", 0) == (kmh == 60.0)


def test_directions_whose_lists_differ_in_order_are_one_road(tmp_path: Path) -> None:
    turned = {**EDGES[1][2], "osmid": "[101, 100]", "highway": "['residential', 'tertiary']"}
    edges = [EDGES[0], (2, 1, turned), *EDGES[2:]]
    graph = import_region(write(tmp_path / "order.graphml", edges=edges), [], "order")
    assert graph.reverse_idx[link_of(graph, 1, 2)] == link_of(graph, 2, 1)


def test_parallel_edges_over_one_line_pair_one_to_one(tmp_path: Path) -> None:
    edges = [EDGES[0], EDGES[0], EDGES[1], EDGES[1], *EDGES[2:]]
    graph = import_region(write(tmp_path / "twice.graphml", edges=edges), [], "twice")
    links = np.flatnonzero(graph.way_id == 100)
    assert links.size == 4
    assert (graph.reverse_idx[links] >= 0).all()


def test_a_signal_counts_at_any_place_of_a_list(tmp_path: Path) -> None:
    nodes = {**NODES, 2: {**NODES[2], "highway": "['crossing', 'traffic_signals']"}}
    graph = import_region(write(tmp_path / "list.graphml", nodes), [], "list")
    assert graph.cross[link_of(graph, 1, 2)] == Cross.LARGE


def test_a_typed_graphml_equals_one_of_text(tmp_path: Path) -> None:
    """OSMnx writes text; networkx, geopandas and others write numbers and truth values with their types."""
    native = {"osmid": int, "length": float}
    nodes = {k: {**d, "x": float(d["x"]), "y": float(d["y"]), "street_count": 3} for k, d in NODES.items()}
    edges = [(u, v, {k: native.get(k, str)(x) if "[" not in x else x for k, x in d.items()}) for u, v, d in EDGES]
    for *_, data in edges:
        data.update(bridge=data.get("bridge") == "yes", tunnel=False, oneway=data["oneway"] == "True")
    text = import_region(write(tmp_path / "text.graphml"), [], "text")
    graph = import_region(write(tmp_path / "typed.graphml", nodes, edges), [], "typed")
    assert graph.length_m.tolist() == text.length_m.tolist()
    assert graph.structure.tolist() == text.structure.tolist()
    assert graph.way_id.tolist() == text.way_id.tolist()


def test_an_undirected_graph_is_driven_as_its_oneways_say(tmp_path: Path) -> None:
    graph = nx.MultiGraph(crs="epsg:4326")
    for node, data in NODES.items():
        graph.add_node(node, **data)
    graph.add_edge(1, 2, **EDGES[0][2])
    # stored from 1 to 3, driven from 3 to 1
    graph.add_edge(1, 3, **{**EDGES[3][2], "from": "3", "to": "1"})
    graph.add_edge(2, 3, **{**EDGES[4][2], "oneway": "False"})
    graph.add_node(4, y="42.02", x="1.505")  # a dead end to turn in
    graph.add_edge(3, 4, osmid="106", highway="residential", oneway="False", length="1110.7")
    path = tmp_path / "undirected.graphml"
    nx.write_graphml(graph, path)
    read = import_region(path, [], "undirected")
    ends = set(zip(read.node_id[read.tail].tolist(), read.node_id[read.head].tolist(), strict=True))
    assert ends == {(1, 2), (2, 1), (3, 1), (2, 3), (3, 2), (3, 4), (4, 3)}
    assert read.reverse_idx[link_of(read, 1, 2)] == link_of(read, 2, 1)
    assert read.geometry(link_of(read, 2, 1)).tolist() == [[1.51, 42.0], [1.505, 41.999], [1.5, 42.0]]


def test_an_undirected_graph_whose_oneways_tell_no_direction_is_refused(tmp_path: Path) -> None:
    graph = nx.MultiGraph(crs="epsg:4326")
    for node, data in NODES.items():
        graph.add_node(node, **data)
    graph.add_edge(1, 2, **EDGES[0][2])
    graph.add_edge(1, 3, **EDGES[3][2])
    path = tmp_path / "undirected.graphml"
    nx.write_graphml(graph, path)
    with pytest.raises(ImportFailedError, match=r"1 oneway edges of .* lack `from` and `to`"):
        import_region(path, [], "undirected")


def test_nodes_with_names_are_numbered(tmp_path: Path) -> None:
    nodes = {f"n{k}": data for k, data in NODES.items()}
    edges = [(f"n{u}", f"n{v}", data) for u, v, data in EDGES]
    graph = import_region(write(tmp_path / "named.graphml", nodes, edges), [], "named")
    assert graph.link_count == 5
    assert graph.node_id.tolist() == [0, 1, 2]


def test_ids_beyond_what_an_array_holds_are_numbered(tmp_path: Path) -> None:
    nodes = {10**20 + k: data for k, data in NODES.items()}
    edges = [(10**20 + u, 10**20 + v, {**data, "osmid": "1" * 30}) for u, v, data in EDGES]
    graph = import_region(write(tmp_path / "long.graphml", nodes, edges), [], "long")
    assert graph.node_id.tolist() == [0, 1, 2]
    assert set(graph.way_id.tolist()) == {0}


def test_a_graph_over_the_antimeridian_keeps_its_lengths_and_heights(tmp_path: Path) -> None:
    nodes = {
        1: {"y": "-16.8", "x": "179.99", "elevation": "10"},
        2: {"y": "-16.8", "x": "-179.98", "elevation": "40"},
    }
    edges = [(u, v, {"osmid": "5", "highway": "primary", "length": "3198"}) for u, v in ((1, 2), (2, 1))]
    graph = import_region(write(tmp_path / "far.graphml", nodes, edges), [], "far")
    assert graph.length_m.sum() == pytest.approx(2.0 * 3198.0)
    at = np.flatnonzero(np.abs(graph.node_lon_deg) == 180.0)
    assert graph.node_height_m[at] == pytest.approx(20.0)  # a third of the way


def test_graphml_in_an_encoding_that_no_one_knows_is_refused(tmp_path: Path) -> None:
    path = write(tmp_path / "coded.graphml")
    path.write_text(path.read_text(encoding="utf-8").replace("utf-8", "none", 1), encoding="utf-8")
    with pytest.raises(GraphFormatError, match="unknown encoding"):
        import_region(path, [], "coded")
