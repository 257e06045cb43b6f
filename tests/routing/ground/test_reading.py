"""What is read of a map's ground, how it is kept, and what of it a zoom level shows."""

from __future__ import annotations

from typing import TYPE_CHECKING

import geopandas
import pytest
import shapely

from routing.errors import GraphFormatError
from routing.ground.files import GROUND_FILE, GroundFile, ground_bytes, open_ground
from routing.ground.kinds import Layer
from routing.ground.levels import ground_of
from routing.ground.osm import GroundReader
from routing.importers.beside import ReadTogether
from routing.importers.osm import read_osm

if TYPE_CHECKING:
    from pathlib import Path

    from routing.ground.features import Ground
    from tests.routing.conftest import DrawMap

POINTS = {
    1: (0.0, 0.0),
    2: (2000.0, 0.0),
    10: (0.0, 0.0),
    11: (1000.0, 0.0),
    12: (1000.0, 1000.0),
    13: (0.0, 1000.0),
    20: (200.0, 200.0),
    21: (800.0, 200.0),
    22: (800.0, 800.0),
    23: (200.0, 800.0),
    30: (1500.0, 0.0),
    31: (1600.0, 500.0),
    32: (1700.0, 900.0),
    40: (1200.0, 100.0),
    41: (1203.0, 100.0),
    42: (1203.0, 103.0),
    50: (500.0, 500.0),
    51: (600.0, 500.0),
}
WAYS = {
    100: ([1, 2], {"highway": "residential"}),
    101: ([10, 11, 12, 13, 10], {}),
    102: ([20, 21, 22, 23, 20], {"landuse": "residential"}),
    103: ([30, 31, 32], {"waterway": "river", "name": "Douro", "name:en": "River Douro"}),
    104: ([30, 31], {"waterway": "river", "tunnel": "yes"}),
    105: ([40, 41, 42, 40], {"natural": "water", "water": "pond"}),
    106: ([10, 11], {}),
    107: ([13, 12], {"boundary": "administrative", "admin_level": "8"}),
    108: ([12, 32], {"boundary": "administrative", "admin_level": "4"}),
}
TAGS = {50: {"place": "town", "name": "Vila", "population": "150 000"}, 51: {"place": "village"}}
RELATIONS = [
    ([("w", 101, "outer"), ("w", 102, "inner")], {"type": "multipolygon", "landuse": "forest"}),
    (
        [("w", 106, "outer"), ("w", 108, "outer")],
        {"type": "boundary", "boundary": "administrative", "admin_level": "2"},
    ),
    ([("w", 999, "outer")], {"type": "multipolygon", "natural": "water"}),
]
BOX = (1.5, 42.0, 1.525, 42.01)


@pytest.fixture
def ground(draw_map: DrawMap) -> Ground:
    reader = GroundReader()
    read_osm(draw_map(POINTS, WAYS, TAGS, RELATIONS), beside=ReadTogether(reader))
    return ground_of(reader.found, BOX)


def finest(ground: Ground, layer: Layer) -> list[tuple[str, dict[str, str], shapely.Geometry]]:
    shapes = ground.layers[layer]
    return [
        (kind, dict(names), shape)
        for kind, names, shape, last in zip(shapes.kind, shapes.names, shapes.shape, shapes.last_zoom, strict=True)
        if last == 14
    ]


def test_a_forest_of_a_relation_has_its_clearing(ground: Ground) -> None:
    ((kind, _, shape),) = finest(ground, Layer.LANDCOVER)
    assert kind == "wood"
    assert shape.area == pytest.approx(0.64 * shapely.box(*shape.bounds).area, rel=0.01)


def test_built_up_land_and_water_are_areas_and_rivers_in_the_open_lines(ground: Ground) -> None:
    assert [kind for kind, _, _ in finest(ground, Layer.LANDUSE)] == ["residential"]
    ((kind, names, line),) = finest(ground, Layer.WATERWAY)
    assert (kind, names) == ("river", {"": "Douro", "en": "River Douro"})
    assert line.geom_type == "LineString"


def test_what_is_too_small_to_be_seen_is_not_kept(ground: Ground) -> None:
    assert finest(ground, Layer.WATER) == []  # a pond of three metres


def test_a_border_is_of_the_highest_level_that_it_belongs_to(ground: Ground) -> None:
    assert sorted(kind for kind, _, _ in finest(ground, Layer.BOUNDARY)) == ["2", "2"]


def test_places_have_a_name_and_a_rank_by_their_people(ground: Ground) -> None:
    ((kind, names, point),) = finest(ground, Layer.PLACE)
    assert (kind, names) == ("town", {"": "Vila"})
    assert ground.layers[Layer.PLACE].rank.tolist() == [1]
    assert point.x == pytest.approx(1.5 + 500.0 / 82_850.76, abs=1e-6)


def test_areas_that_the_map_has_in_part_are_counted(ground: Ground) -> None:
    assert ground.left_out == {"areas that the map has in part": 1}


def test_farther_out_shapes_have_fewer_points_and_the_small_ones_are_gone(ground: Ground) -> None:
    shapes = ground.layers[Layer.LANDCOVER]
    assert shapes.last_zoom.min() > 7  # a kilometre is four pixels at zoom 7, and fewer farther out
    assert shapes.first_zoom.tolist() == sorted(shapes.first_zoom.tolist())


def test_another_program_reads_the_file(ground: Ground, tmp_path: Path) -> None:
    path = tmp_path / GROUND_FILE
    path.write_bytes(ground_bytes(ground, "somebody"))
    frame = geopandas.read_file(path, layer="landuse")
    assert frame.crs.to_epsg() == 4326
    assert set(frame["class"]) == {"residential"}
    assert frame.total_bounds == pytest.approx(shapely.total_bounds(ground.layers[Layer.LANDUSE].shape))


def test_the_same_ground_gives_the_same_file(ground: Ground) -> None:
    assert ground_bytes(ground, "somebody") == ground_bytes(ground, "somebody")


def test_a_view_has_what_meets_it_at_its_zoom(ground: Ground, tmp_path: Path) -> None:
    (tmp_path / GROUND_FILE).write_bytes(ground_bytes(ground, "somebody"))
    kept = GroundFile(tmp_path)
    assert kept.shown(Layer.LANDCOVER, 14, BOX).kind == ["wood"]
    assert kept.shown(Layer.LANDCOVER, 14, (1.52, 42.0, 1.53, 42.01)).kind == []
    assert kept.shown(Layer.LANDCOVER, 0, BOX).kind == []
    assert kept.shown(Layer.PLACE, 14, BOX).names == [{"": "Vila"}]


def test_a_graph_without_the_file_has_no_ground(tmp_path: Path) -> None:
    assert open_ground(tmp_path) is None


@pytest.mark.parametrize("content", [b"", b"SQLite format 3\0 and no more", b"PK\x03\x04"])
def test_a_damaged_file_is_told(content: bytes, tmp_path: Path) -> None:
    (tmp_path / GROUND_FILE).write_bytes(content)
    with pytest.raises(GraphFormatError, match=GROUND_FILE):
        open_ground(tmp_path)


def test_nodes_behind_their_ways_leave_the_ground_out_and_the_roads_in(tmp_path: Path) -> None:
    path = tmp_path / "odd.osm"
    path.write_text(
        '<osm version="0.6"><way id="2"><nd ref="1"/><nd ref="2"/><tag k="highway" v="residential"/></way>'
        '<way id="3"><nd ref="1"/><nd ref="2"/><nd ref="3"/><nd ref="1"/><tag k="natural" v="water"/></way>'
        '<node id="1" lat="42" lon="1.5"/><node id="2" lat="42.01" lon="1.5"/><node id="3" lat="42.01" lon="1.51"/>'
        "</osm>"
    )
    reader = GroundReader()
    assert read_osm(path, beside=reader).ways.forward_mps.size == 1
    assert reader.found.left_out == {"areas whose points the map lacks": 1}
