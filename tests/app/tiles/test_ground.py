"""The ground as layers of vector tiles: areas with their holes, lines, and named places."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest
import shapely

from app.atlas import Atlas
from app.sharing.sources import GraphsOnDisk
from app.tiles.address import TileAddress
from app.tiles.ground import GroundTiles
from app.tiles.shelf import TileShelf
from routing.graph.files import save_graph
from routing.graph.road_graph import Terrain
from routing.ground.features import RawGround
from routing.ground.files import GROUND_FILE, GroundFile, ground_bytes
from routing.ground.kinds import Layer
from routing.ground.levels import ground_of
from tests.app.conftest import street_grid
from tests.app.tiles.tile_reader import Layer as ReadLayer
from tests.app.tiles.tile_reader import read_tile

if TYPE_CHECKING:
    from pathlib import Path

TILE = TileAddress(12, 2064, 1515)
WEST, SOUTH, EAST, NORTH = TILE.bounds_deg()


def at(x: float, y: float) -> tuple[float, float]:
    """A place by its shares of the tile's sides, from the west and from the south."""
    return WEST + x * (EAST - WEST), SOUTH + y * (NORTH - SOUTH)


def area(*corners: tuple[float, float], hole: tuple[tuple[float, float], ...] = ()) -> str:
    holes = [[at(*corner) for corner in hole]] if hole else []
    return str(shapely.to_wkb(shapely.Polygon([at(*corner) for corner in corners], holes), hex=True))


@pytest.fixture
def layers(tmp_path: Path) -> dict[str, ReadLayer]:
    raw = RawGround()
    hole = ((0.4, 0.4), (0.4, 0.6), (0.6, 0.6), (0.6, 0.4))
    raw.add((Layer.LANDCOVER, "wood"), {}, area((0.2, 0.2), (0.2, 0.8), (0.8, 0.8), (0.8, 0.2), hole=hole))
    raw.add((Layer.LANDCOVER, "wood"), {}, area((-2.0, 0.9), (3.0, 0.9), (3.0, 3.0)))
    raw.add((Layer.WATER, "lake"), {"": "See", "en": "Lake"}, area((0.1, 0.1), (0.1, 0.15), (0.15, 0.15)))
    line = shapely.LineString([at(-1.0, 0.5), at(2.0, 0.5)])
    raw.add((Layer.WATERWAY, "river"), {}, str(shapely.to_wkb(line, hex=True)))
    raw.add((Layer.BOUNDARY, "2"), {}, str(shapely.to_wkb(line, hex=True)))
    for name, rank, x in (("Dorf", 3, 0.3), ("Stadt", 1, 0.6), ("Fern", 0, 1.5)):
        point = shapely.to_wkb(shapely.Point(at(x, 0.5)), hex=True)
        raw.add((Layer.PLACE, "town"), {"": name}, str(point), rank)
    ground = ground_of(raw, (WEST, SOUTH, EAST, NORTH))
    (tmp_path / GROUND_FILE).write_bytes(ground_bytes(ground, "somebody"))
    found = read_tile(GroundTiles(GroundFile(tmp_path)).tile(TILE))
    return {layer.name: layer for layer in found}


def signed_area(ring: list[tuple[int, int]]) -> float:
    x, y = np.array(ring, np.float64).T
    return float(np.dot(x, np.roll(y, -1)) - np.dot(y, np.roll(x, -1))) / 2.0


def test_layers_come_in_the_order_in_which_they_are_drawn(layers: dict[str, ReadLayer]) -> None:
    assert list(layers) == ["landcover", "water", "waterway", "boundary", "place"]


def test_areas_of_a_class_are_one_feature_of_outer_rings_with_their_holes(layers: dict[str, ReadLayer]) -> None:
    (wood,) = layers["landcover"].features
    assert (wood.kind, wood.attributes) == (3, {"class": "wood"})
    sizes = sorted(signed_area(ring) for ring in wood.parts)
    assert sizes[0] == pytest.approx(-((0.2 * 4096) ** 2), rel=0.02)
    assert sum(size > 0.0 for size in sizes) == 2
    assert max(sizes) == pytest.approx((0.6 * 4096) ** 2, rel=0.02)
    outer = next(k for k, ring in enumerate(wood.parts) if signed_area(ring) == max(sizes))
    assert signed_area(wood.parts[outer + 1]) == sizes[0]  # a hole follows its outer ring


def test_areas_are_cut_at_the_rim(layers: dict[str, ReadLayer]) -> None:
    points = np.array([point for ring in layers["landcover"].features[0].parts for point in ring])
    assert points.min() >= -64
    assert points.max() <= 4096 + 64


def test_water_is_named(layers: dict[str, ReadLayer]) -> None:
    (lake,) = layers["water"].features
    assert lake.attributes == {"class": "lake", "name": "See", "name:en": "Lake"}


def test_lines_go_through_the_tile(layers: dict[str, ReadLayer]) -> None:
    for name, attributes in (("waterway", {"class": "river"}), ("boundary", {"admin_level": 2})):
        (line,) = layers[name].features
        assert (line.kind, line.attributes) == (2, attributes)
        ((begin, end),) = line.parts
        assert {begin[0], end[0]} == {-64, 4096 + 64}


def test_places_in_the_tile_come_by_rank(layers: dict[str, ReadLayer]) -> None:
    places = layers["place"].features
    assert [place.attributes["name"] for place in places] == ["Stadt", "Dorf"]
    assert places[1].point[0] == pytest.approx(0.3 * 4096, abs=2)


def test_ground_that_cannot_be_read_leaves_the_roads(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    save_graph(street_grid("grid", Terrain.ABSENT), tmp_path / "grid")
    (tmp_path / "grid" / GROUND_FILE).write_bytes(b"torn")
    atlas = Atlas(GraphsOnDisk(lambda: {"grid": tmp_path / "grid"}), snap_limit_m=1000.0, label_limit=None)
    tiles = TileShelf(atlas).graph_tiles("grid")
    assert tiles.ground is None
    assert GROUND_FILE in caplog.text


def test_a_tile_elsewhere_has_no_bytes(tmp_path: Path) -> None:
    (tmp_path / GROUND_FILE).write_bytes(ground_bytes(ground_of(RawGround(), (0.0, 0.0, 1.0, 1.0)), "somebody"))
    assert GroundTiles(GroundFile(tmp_path)).tile(TILE) == b""
