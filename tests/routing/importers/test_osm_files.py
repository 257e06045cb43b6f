"""OpenStreetMap files as people bring them: any order, packing and ids, with deleted objects and doubled ways."""

from __future__ import annotations

import bz2
import gzip
import struct
import zlib
from itertools import permutations
from pathlib import Path
from typing import Any

import numpy as np
import osmium
import pytest

from energy.stops import FunctionalClass
from routing.errors import ImportFailedError
from routing.graph.road_graph import RoadGraph
from routing.graph.snap import RoadIndex
from routing.importers.region import import_region
from routing.places import Point

# a ring of 1-2-3-4, at 50.7° N: 0.01° east are 706.4 m, 0.01° north 1112.5 m
PLACES = {1: (50.70, 8.60), 2: (50.70, 8.61), 3: (50.71, 8.61), 4: (50.71, 8.60)}
RESIDENTIAL = '<tag k="highway" v="residential"/>'


def node(ref: int, tags: str = "", marks: str = "", place: tuple[float, float] | None = None) -> str:
    lat, lon = place or PLACES[abs(ref)]
    return f'<node id="{ref}" version="1" lat="{lat}" lon="{lon}" {marks}>{tags}</node>'


def way(ref: int, points: list[int], tags: str = RESIDENTIAL, marks: str = "") -> str:
    nodes = "".join(f'<nd ref="{point}"/>' for point in points)
    return f'<way id="{ref}" version="1" {marks}>{nodes}{tags}</way>'


def osm(*objects: str) -> str:
    return "<?xml version='1.0' encoding='UTF-8'?>\n<osm version='0.6'>" + "\n".join(objects) + "</osm>"


def graph_of(tmp_path: Path, *objects: str) -> RoadGraph:
    path = tmp_path / "map.osm"
    path.write_text(osm(*objects))
    return import_region(path, [], "map")


NODES = [node(ref) for ref in PLACES]
RING = way(10, [1, 2, 3, 4, 1])


def arrays_equal(a: RoadGraph, b: RoadGraph) -> bool:
    names = ("tail", "head", "length_m", "cross", "way_id", "reverse_idx", "node_lat_deg", "successor")
    return all(np.array_equal(getattr(a, name), getattr(b, name)) for name in names)


@pytest.mark.parametrize("marks", ['action="delete"', "action='delete' visible='true'", 'visible="false"'])
def test_a_way_marked_as_deleted_is_no_road(tmp_path: Path, marks: str) -> None:
    graph = graph_of(tmp_path, *NODES, RING, way(11, [1, 3], marks=marks))
    assert set(graph.way_id.tolist()) == {10}


def test_a_way_that_is_modified_is_a_road(tmp_path: Path) -> None:
    graph = graph_of(tmp_path, *NODES, RING, way(11, [1, 3], marks='action="modify" visible="true"'))
    assert set(graph.way_id.tolist()) == {10, 11}


def test_a_tag_that_speaks_of_deleting_deletes_nothing(tmp_path: Path) -> None:
    note = """<tag k="note" v="was action='delete' once"/>"""
    graph = graph_of(tmp_path, *NODES, RING, way(11, [1, 3], RESIDENTIAL + note))
    assert set(graph.way_id.tolist()) == {10, 11}


def test_a_deleted_barrier_blocks_nothing(tmp_path: Path) -> None:
    bollard = node(2, '<tag k="barrier" v="bollard"/>', 'action="delete"')
    moved = [node(1), node(3), node(4), bollard, node(5, place=(50.705, 8.61))]
    graph = graph_of(tmp_path, *moved, way(10, [1, 3, 4, 1]), way(11, [1, 5, 3]))
    assert "way_points_blocked" not in graph.meta.dropped


def test_a_deleted_restriction_forbids_nothing(tmp_path: Path) -> None:
    members = (
        '<member type="way" ref="11" role="from"/>'
        '<member type="node" ref="2" role="via"/>'
        '<member type="way" ref="12" role="to"/>'
    )
    tags = '<tag k="type" v="restriction"/><tag k="restriction" v="no_left_turn"/>'
    ways = [way(11, [1, 2]), way(12, [2, 3]), way(13, [3, 4, 1]), way(14, [2, 4])]
    counts = []
    for marks in ("", 'action="delete"'):
        relation = f'<relation id="1" version="1" {marks}>{members}{tags}</relation>'
        counts.append(graph_of(tmp_path, *NODES, *ways, relation).successor.size)
    assert counts[1] == counts[0] + 1


def test_negative_ids_give_the_same_roads_as_positive_ones(tmp_path: Path) -> None:
    plain = graph_of(tmp_path, *NODES, RING, way(11, [1, 3]))
    drafted = graph_of(tmp_path, *(node(-ref) for ref in PLACES), way(-10, [-1, -2, -3, -4, -1]), way(-11, [-1, -3]))
    assert sorted(drafted.length_m.tolist()) == sorted(plain.length_m.tolist())
    assert set(drafted.way_id.tolist()) == {-10, -11}
    assert set(drafted.node_id.tolist()) >= {-1, -3}
    assert np.unique(drafted.node_id).size == drafted.node_count


def test_a_bollard_among_negative_ids_cuts_the_way_and_keeps_ids_apart(tmp_path: Path) -> None:
    bollard = node(-2, '<tag k="barrier" v="bollard"/>')
    graph = graph_of(
        tmp_path, node(-1), bollard, node(-3), node(-4), way(-10, [-1, -2, -3, -4, -1]), way(-11, [-1, -3])
    )
    assert graph.meta.dropped["way_points_blocked"] == 1
    assert np.unique(graph.node_id).size == graph.node_count


def test_old_and_new_ids_in_one_file_are_both_read(tmp_path: Path) -> None:
    graph = graph_of(tmp_path, *NODES, node(-5, place=(50.705, 8.615)), RING, way(-11, [2, -5, 3]))
    assert set(graph.way_id.tolist()) == {10, -11}


@pytest.mark.parametrize("order", list(permutations(range(3))))
def test_objects_in_any_order_give_the_same_graph(tmp_path: Path, order: tuple[int, ...]) -> None:
    points = [node(1), node(2, '<tag k="highway" v="traffic_signals"/>'), node(3, '<tag k="barrier" v="bollard"/>')]
    ways = [RING, way(11, [1, 3]), way(12, [2, 4])]
    relation = (
        '<relation id="1" version="1"><member type="way" ref="12" role="from"/><member type="node" ref="2" role="via"/>'
        '<member type="way" ref="10" role="to"/>'
        '<tag k="type" v="restriction"/><tag k="restriction" v="no_left_turn"/></relation>'
    )
    groups = [[*points, node(4)], ways, [relation]]
    sorted_graph = graph_of(tmp_path, *(one_object for group in groups for one_object in group))
    graph = graph_of(tmp_path, *(one_object for k in order for one_object in groups[k]))
    assert arrays_equal(graph, sorted_graph)
    assert graph.meta.dropped == sorted_graph.meta.dropped


@pytest.mark.parametrize("name", ["map.osm", "map.xml", "map.osm.gz", "map.osm.bz2", "map.osm.pbf", "map.bin"])
def test_every_packing_gives_the_same_graph_whatever_the_name(tmp_path: Path, name: str) -> None:
    text = osm(*NODES, RING, way(11, [1, 3]))
    plain = tmp_path / "plain.osm"
    plain.write_text(text)
    expected = import_region(plain, [], "plain")
    path = tmp_path / name
    if name.endswith(".pbf"):
        with osmium.SimpleWriter(str(path)) as writer:
            for entity in osmium.FileProcessor(str(plain)):
                writer.add(entity)
    elif name.endswith((".gz", ".bin")):
        path.write_bytes(gzip.compress(text.encode(), mtime=0))
    else:
        path.write_bytes(bz2.compress(text.encode()) if name.endswith(".bz2") else text.encode())
    assert arrays_equal(import_region(path, [], "packed"), expected)


@pytest.mark.parametrize("encoding", ["utf-8-sig", "utf-16", "utf-16-le", "utf-16-be"])
@pytest.mark.parametrize("name", ["map.osm", "map.bin"])
def test_every_encoding_of_a_text_gives_the_same_roads(tmp_path: Path, name: str, encoding: str) -> None:
    text = osm(*NODES, RING, way(11, [1, 3], marks="action='delete'"), way(12, [2, 4]))
    path = tmp_path / name
    path.write_bytes(text.replace("UTF-8", encoding.removesuffix("-sig")[:6]).encode(encoding))
    assert set(import_region(path, [], "map").way_id.tolist()) == {10, 12}


@pytest.mark.parametrize("parts", [2, 3])
@pytest.mark.parametrize("pack", [gzip.compress, bz2.compress])
def test_a_file_packed_in_several_streams_is_read_to_its_end(tmp_path: Path, parts: int, pack: Any) -> None:
    text = osm(*NODES, RING, way(11, [1, 3])).encode()
    step = -(-len(text) // parts)
    path = tmp_path / "map.osm.packed"
    path.write_bytes(b"".join(pack(text[begin : begin + step]) for begin in range(0, len(text), step)))
    assert set(import_region(path, [], "map").way_id.tolist()) == {10, 11}


def test_ways_that_carry_the_places_of_their_points_need_no_nodes(tmp_path: Path) -> None:
    """As Overpass writes with `out geom`."""
    points = "".join(f'<nd ref="{ref}" lat="{lat}" lon="{lon}"/>' for ref, (lat, lon) in PLACES.items())
    bounds = '<bounds minlat="50.7" minlon="8.6" maxlat="50.71" maxlon="8.61"/>'
    graph = graph_of(tmp_path, f'<way id="10">{bounds}{points}{RESIDENTIAL}</way>')
    assert graph.length_m.sum() == pytest.approx(2.0 * (706.4 + 1112.5 + 706.2), rel=1e-3)


@pytest.mark.parametrize("options", ["pbf_dense_nodes=false", "pbf_compression=none", "pbf_compression=lz4"])
def test_every_form_of_pbf_gives_the_same_roads(tmp_path: Path, options: str) -> None:
    path = tmp_path / "map.osm.pbf"
    with osmium.SimpleWriter(osmium.io.File(str(path), f"pbf,{options}")) as writer:
        for ref, (lat, lon) in PLACES.items():
            writer.add_node(osmium.osm.mutable.Node(id=ref, location=(lon, lat)))
        writer.add_way(osmium.osm.mutable.Way(id=10, nodes=[1, 2, 3, 4], tags={"highway": "residential"}))
    assert arrays_equal(import_region(path, [], "map"), graph_of(tmp_path, *NODES, way(10, [1, 2, 3, 4])))


def test_ways_of_a_pbf_that_carry_places_need_no_nodes(tmp_path: Path) -> None:
    """As osmium add-locations-to-ways writes, which leaves out nodes without tags."""
    plain, path = tmp_path / "plain.osm", tmp_path / "map.osm.pbf"
    plain.write_text(osm(*NODES, RING, way(11, [1, 3])))
    with osmium.SimpleWriter(osmium.io.File(str(path), "pbf,locations_on_ways=true")) as writer:
        for entity in osmium.FileProcessor(str(plain)).with_locations():
            if entity.is_way():
                writer.add(entity)
    assert arrays_equal(import_region(path, [], "map"), import_region(plain, [], "plain"))


def test_an_object_that_is_there_again_after_it_was_deleted_is_used(tmp_path: Path) -> None:
    graph = graph_of(tmp_path, *NODES, RING, way(11, [1, 3], marks='visible="false"'), way(11, [1, 3]))
    assert 11 in graph.way_id.tolist()
    graph = graph_of(tmp_path, *NODES, RING, way(11, [1, 3]), way(11, [1, 3], marks='visible="false"'))
    assert 11 not in graph.way_id.tolist()


def test_a_history_in_xml_is_refused_by_its_name(tmp_path: Path) -> None:
    path = tmp_path / "map.osh.gz"
    path.write_bytes(gzip.compress(osm(*NODES, RING, RING.replace('version="1"', 'version="2"')).encode(), mtime=0))
    with pytest.raises(ImportFailedError, match="history"):
        import_region(path, [], "map")


def test_a_folder_is_named_as_one(tmp_path: Path) -> None:
    with pytest.raises(ImportFailedError, match="is a folder, allowed: a file"):
        import_region(tmp_path, [], "map")


def test_deleted_objects_of_a_packed_file_are_passed_over(tmp_path: Path) -> None:
    text = osm(*NODES, RING, way(11, [1, 3], marks='action="delete"')).encode()
    for name, packed in (("a.osm.gz", gzip.compress(text, mtime=0)), ("a.osm.bz2", bz2.compress(text))):
        (tmp_path / name).write_bytes(packed)
        assert set(import_region(tmp_path / name, [], "a").way_id.tolist()) == {10}


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b'{"version": 0.6, "elements": []}', r"is JSON, allowed: \.osm.*out:xml"),
        (b'{"type": "FeatureCollection", "features": []}', "is GeoJSON, .*where roads join"),
        (b"PK\x03\x04rest", "is a zip archive"),
        (b"\xfd7zXZ\x00rest", "is packed with xz, .*unpack it"),
        (b"\x28\xb5\x2f\xfdrest", "is packed with zstd"),
        (b"7z\xbc\xaf\x27\x1crest", "is a 7z archive"),
        (b"<osmChange version='0.6'><create/></osmChange>", r"holds changes of a map \(osmChange\)"),
        (gzip.compress(b"<osmChange version='0.6'/>", mtime=0), "holds changes of a map"),
        (b"<osm version='0.6'><remark> runtime error: Query timed out </remark></osm>", "not whole, .*Query timed out"),
        (
            osm('<way id="1"><center lat="50.7" lon="8.6"/><nd ref="1"/></way>').encode(),
            "has centres instead of points",
        ),
        (osm(RING).encode(), r"lacks 4 points of its 1 roads, .*\(\._;>;\);"),
        (osm(f"<way id='1' version='1'>{RESIDENTIAL}</way>").encode(), "lacks all points of its 1 roads"),
        (
            osm(*NODES, way(10, [1, 2], RESIDENTIAL.replace("/>", "/><tag k='access' v='no'/>"))).encode(),
            "ways_without_access 1",
        ),
        (gzip.compress(b"<osm version='0.6'>", mtime=0)[:-6], "not a readable OSM file"),
    ],
)
def test_a_file_of_another_kind_is_refused_by_its_content(tmp_path: Path, content: bytes, message: str) -> None:
    path = tmp_path / "map.osm"
    path.write_bytes(content)
    with pytest.raises(ImportFailedError, match=message):
        import_region(path, [], "map")


@pytest.mark.parametrize("packing", ["none", "zlib"])
def test_a_text_with_a_byte_of_zero_in_it_is_refused(tmp_path: Path, packing: str) -> None:
    path = tmp_path / "map.osm.pbf"
    with osmium.SimpleWriter(osmium.io.File(str(path), f"pbf,pbf_compression={packing}")) as writer:
        for ref, (lat, lon) in PLACES.items():
            writer.add_node(osmium.osm.mutable.Node(id=ref, location=(lon, lat)))
        writer.add_way(osmium.osm.mutable.Way(id=10, nodes=[1, 2], tags={"highway": "primary", "max speed": "50"}))
    content = path.read_bytes()
    if packing == "none":
        path.write_bytes(content.replace(b"max speed", b"max\0speed"))
    else:
        begin = content.rindex(b"OSMData")
        packed = content.index(b"\x78", begin)
        block = zlib.decompress(content[packed:]).replace(b"max speed", b"max\0speed")
        blob = b"\x10" + _varint(len(block)) + b"\x1a"
        again = zlib.compress(block)
        blob += _varint(len(again)) + again
        header = b"\x0a\x07OSMData\x18" + _varint(len(blob))
        path.write_bytes(content[: begin - 6] + struct.pack(">I", len(header)) + header + blob)
    with pytest.raises(ImportFailedError, match=r"'max\\\\0speed' holds a byte of zero"):
        import_region(path, [], "map")


def _varint(number: int) -> bytes:
    return bytes([number]) if number < 128 else bytes([number & 0x7F | 0x80]) + _varint(number >> 7)


def test_a_file_with_the_history_of_objects_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "map.osh.pbf"
    header = osmium.io.Header()
    header.has_multiple_object_versions = True
    with osmium.SimpleWriter(osmium.io.File(str(path), "osh.pbf"), 4096, header) as writer:
        for ref, (lat, lon) in PLACES.items():
            writer.add_node(osmium.osm.mutable.Node(id=ref, location=(lon, lat), version=1))
        writer.add_way(osmium.osm.mutable.Way(id=1, nodes=[1, 2], tags={"highway": "residential"}, version=1))
    with pytest.raises(ImportFailedError, match="history"):
        import_region(path, [], "map")


def test_a_way_that_is_there_twice_is_one_road(tmp_path: Path) -> None:
    street = way(10, [1, 2, 3, 4])
    graph = graph_of(tmp_path, *NODES, street, street.replace("residential", "tertiary"))
    assert set(graph.functional_class.tolist()) == {FunctionalClass.TERTIARY}  # the later one holds
    assert graph.length_m.sum() == pytest.approx(2.0 * (706.4 + 1112.5 + 706.2), rel=1e-3)


def test_a_ferry_is_no_road_even_where_it_is_drawn_as_one(tmp_path: Path) -> None:
    ferry = '<tag k="route" v="ferry"/><tag k="duration" v="00:20"/>'
    graph = graph_of(tmp_path, *NODES, RING, way(11, [1, 3], ferry), way(12, [2, 4], RESIDENTIAL + ferry))
    assert set(graph.way_id.tolist()) == {10}
    assert graph.meta.dropped["ferries"] == 2


TWIN_PLACES = {1: (50.70, 8.600), 2: (50.70, 8.604), 3: (50.70, 8.608), 4: (50.703, 8.604), 5: (50.70, 8.590)}
ONEWAY = RESIDENTIAL + '<tag k="oneway" v="yes"/>'


@pytest.mark.parametrize(
    "doubled",
    [
        [way(10, [1, 2, 3]), way(11, [3, 2, 1], ONEWAY)],
        [way(11, [3, 2, 1], ONEWAY), way(10, [1, 2, 3])],
        [way(10, [1, 2, 3]), way(11, [1, 2, 3], ONEWAY)],
        [way(10, [1, 2, 3]), way(11, [3, 2, 1]), way(12, [1, 2, 3], ONEWAY)],
        [way(10, [3, 2, 1]), way(11, [3, 2, 1], ONEWAY), way(12, [1, 2, 3], ONEWAY)],
    ],
)
def test_a_two_way_street_keeps_its_reverse_whatever_else_is_drawn_on_it(tmp_path: Path, doubled: list[str]) -> None:
    nodes = [node(ref, place=place) for ref, place in TWIN_PLACES.items()]
    graph = graph_of(tmp_path, *nodes, *doubled, way(20, [1, 4, 3]), way(21, [1, 5]))
    twoway = [k for k in range(graph.link_count) if graph.way_id[k] in (10, 20, 21)]
    reverse = graph.reverse_idx[twoway]
    assert (reverse >= 0).all()
    assert graph.way_id[reverse].tolist() == graph.way_id[twoway].tolist()
    assert graph.tail[reverse].tolist() == graph.head[twoway].tolist()
    assert (graph.reverse_idx[reverse] == twoway).all()


def test_a_street_drawn_twice_lets_no_one_turn_back_at_a_junction(tmp_path: Path) -> None:
    nodes = [node(ref, place=place) for ref, place in TWIN_PLACES.items()]
    doubled = [way(10, [1, 2, 3]), way(11, [3, 2, 1], ONEWAY)]
    graph = graph_of(tmp_path, *nodes, *doubled, way(20, [1, 4, 3]), way(21, [1, 5]))
    assert {10, 11} <= set(graph.way_id.tolist())
    for k in np.flatnonzero(np.isin(graph.way_id, (10, 11))).tolist():
        after = graph.successors(k)
        assert after.size
        assert (graph.head[after] != graph.tail[k]).all()


EAST = 0.01 * 106_598.0  # 0.01° of longitude at 16.8° S on WGS 84: π/180·a·cos φ/√(1 − e² sin² φ)


@pytest.mark.parametrize("turned", [False, True])
@pytest.mark.parametrize("last", [-179.99, 180.0, -180.0])
def test_a_road_over_the_antimeridian_has_the_length_of_the_short_way(
    tmp_path: Path, turned: bool, last: float
) -> None:
    lon = {1: 179.97, 2: 179.98, 3: 179.99, 4: last, 5: -179.98, 6: -179.97}
    nodes = [node(ref, place=(-16.8, x)) for ref, x in lon.items()]
    points = [6, 5, 4, 3, 2, 1] if turned else [1, 2, 3, 4, 5, 6]
    graph = graph_of(tmp_path, *nodes, way(10, points))
    assert graph.length_m.sum() == pytest.approx(2.0 * 6.0 * EAST, rel=1e-4)
    span = np.diff(graph.geometry_lon_e7.astype(np.int64))
    span[graph.geometry_first[1:-1] - 1] = 0
    assert np.abs(span).max() < 0.03e7  # no line runs round the world
    assert (graph.reverse_idx >= 0).all()
    assert np.hypot(*graph.heading().T) == pytest.approx(1.0, abs=2e-3)
    for k in range(graph.link_count):
        assert graph.successors(k).size >= 1


def test_a_long_step_over_the_antimeridian_is_cut_where_it_crosses(tmp_path: Path) -> None:
    nodes = [node(1, place=(-16.8, 179.96)), node(2, place=(-16.9, -179.98)), node(3, place=(-16.8, -179.98))]
    graph = graph_of(tmp_path, *nodes, way(10, [1, 2]), way(11, [2, 3]))
    # 0.06° east at 16.85° S and 0.1° south: 6·EAST and 11 066 m; two thirds lie west of 180°
    long = np.hypot(6.0 * 0.01 * 106_571.0, 11_066.0)
    links = graph.way_id == 10
    assert graph.length_m[links].sum() == pytest.approx(2.0 * long, rel=1e-3)
    west = links & (np.minimum(graph.node_lon_deg[graph.tail], graph.node_lon_deg[graph.head]) > 0.0)
    assert graph.length_m[west].sum() == pytest.approx(2.0 * long * 2.0 / 3.0, rel=1e-3)
    at = np.flatnonzero(np.abs(graph.node_lon_deg) == 180.0)
    assert graph.node_lat_deg[at] == pytest.approx(-16.8 - 0.1 * 2.0 / 3.0, abs=1e-6)


def test_a_street_on_each_side_of_the_antimeridian_is_the_nearest_to_its_places(tmp_path: Path) -> None:
    nodes = [node(ref, place=(-16.8, x)) for ref, x in {1: 179.99, 2: -179.99}.items()]
    index = RoadIndex(graph_of(tmp_path, *nodes, way(10, [1, 2])))
    for lon in (179.995, -179.995):
        snapped, (there, _) = index.snap("start", Point(-16.8, lon), 50.0)
        assert snapped.distance_m == pytest.approx(0.0, abs=0.1)
        assert there.offset_m == pytest.approx(0.5 * EAST, rel=1e-3)


def test_a_built_up_area_over_the_antimeridian_holds_on_both_sides_and_nowhere_else(tmp_path: Path) -> None:
    lon = {1: 179.99, 2: -179.99, 3: -179.9, 4: -179.8}
    corners = {11: (-16.79, 179.98), 12: (-16.79, -179.98), 13: (-16.81, -179.98), 14: (-16.81, 179.98)}
    nodes = [node(ref, place=(-16.8, x)) for ref, x in lon.items()]
    nodes += [node(ref, place=place) for ref, place in corners.items()]
    area = way(20, [11, 12, 13, 14, 11], '<tag k="landuse" v="residential"/>')
    primary = '<tag k="highway" v="primary"/>'
    graph = graph_of(tmp_path, *nodes, area, way(10, [1, 2], primary), way(11, [2, 3, 4], primary))
    middle = (graph.node_lon_deg[graph.tail] + graph.node_lon_deg[graph.head]) / 2.0
    assert graph.urban[graph.way_id == 10].all()
    assert not graph.urban[(graph.way_id == 11) & (middle > -179.95)].any()


def test_a_file_in_an_encoding_that_no_one_knows_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "map.osm"
    path.write_text(osm(*NODES, RING, way(11, [1, 3], marks='action="delete"')).replace("UTF-8", "none"))
    with pytest.raises(ImportFailedError, match="not a readable OSM file"):
        import_region(path, [], "map")


def test_a_step_across_a_continent_is_cut_like_any_other(tmp_path: Path) -> None:
    graph = graph_of(tmp_path, node(1), node(2, place=(12.0, 8.6)), way(10, [1, 2]))
    # the meridian from 12° to 50.7° N on WGS 84 is 4291.6 km; the Gauss formula of one step has it within 1 %
    assert graph.length_m.sum() == pytest.approx(2.0 * 4291.6e3, rel=1e-2)
    assert graph.length_m.max() == pytest.approx(graph.length_m.mean(), rel=0.2)
