"""Roads as vector tiles."""

from __future__ import annotations

import gzip
import math
from dataclasses import replace
from typing import TYPE_CHECKING, Final

import numpy as np
import pytest
import shapely

from app.settings import BUNDLED_DATA
from app.tiles.address import TileAddress
from app.tiles.errors import TileOutOfRangeError
from app.tiles.roads import FIRST_ZOOM, RoadTiles
from energy.stops import FunctionalClass
from routing.graph.files import load_graph
from routing.graph.road_graph import RoadGraph, Terrain
from tests.app.conftest import SOUTH, SPACING_DEG, WEST, street_grid
from tests.app.tiles.tile_reader import Feature, read_tile

if TYPE_CHECKING:
    from collections.abc import Iterator

EDGE_UNITS: Final = 64


@pytest.fixture(scope="module")
def grid() -> RoadGraph:
    """The street grid; each street has a name of its own."""
    return street_grid("grid", Terrain.SYNTHETIC)


def plain(graph: RoadGraph) -> RoadGraph:
    """A graph whose links differ in their places only."""
    count = graph.link_count
    return replace(graph, names=("Ring",), name_idx=np.zeros(count, np.int32), speed_limit_mps=np.full(count, 50 / 3.6))


def units(address: TileAddress, lon_deg: float, lat_deg: float) -> tuple[float, float]:
    """A place in the units of a tile, by the formula of the slippy map."""
    scale = 2**address.z
    x = (lon_deg + 180) / 360 * scale
    y = (1 - math.log(math.tan(math.radians(lat_deg)) + 1 / math.cos(math.radians(lat_deg))) / math.pi) / 2 * scale
    return (x - address.x) * 4096, (y - address.y) * 4096


def tile_at(zoom: int, lon_deg: float, lat_deg: float) -> TileAddress:
    x, y = units(TileAddress(0, 0, 0), lon_deg, lat_deg)
    return TileAddress(zoom, int(x / 4096 * 2**zoom), int(y / 4096 * 2**zoom))


def drawn(graph: RoadGraph, address: TileAddress) -> list[Feature]:
    return [feature for layer in read_tile(RoadTiles(graph).tile(address)) for feature in layer.features]


WHOLE = tile_at(12, WEST + SPACING_DEG, SOUTH + SPACING_DEG)  # the grid is 0.02° wide, this tile 0.088°


def test_street_is_drawn_once_for_both_directions(grid: RoadGraph) -> None:
    features = drawn(grid, WHOLE)
    assert sorted(str(feature.attributes["name"]) for feature in features) == sorted(grid.names)
    assert [len(feature.parts) for feature in features] == [1] * 12


def test_street_lies_where_its_ends_are(grid: RoadGraph) -> None:
    (street,) = (feature for feature in drawn(grid, WHOLE) if feature.attributes["name"] == "Street 0")
    ends = [units(WHOLE, WEST, SOUTH), units(WHOLE, WEST + SPACING_DEG, SOUTH)]
    np.testing.assert_allclose(sorted(street.parts[0]), ends, atol=0.51)


def test_street_carries_its_attributes(grid: RoadGraph) -> None:
    bridge = replace(grid, structure=np.arange(24) < 24)
    (street,) = (feature for feature in drawn(bridge, WHOLE) if feature.attributes["name"] == "Street 3")
    expected = {"class": "tertiary", "name": "Street 3", "speed_kmh": 80, "oneway": False, "structure": True}
    assert street.attributes == expected


def test_road_without_a_name_has_no_name_attribute(grid: RoadGraph) -> None:
    assert all("name" not in feature.attributes for feature in drawn(replace(plain(grid), names=("",)), WHOLE))


def test_streets_with_equal_attributes_merge_up_to_their_junctions(grid: RoadGraph) -> None:
    # four chains around the corners, which have two streets each, and four spokes from the middle
    parts = [part for feature in drawn(plain(grid), WHOLE) for part in feature.parts]
    assert sorted(len(part) for part in parts) == [2, 2, 2, 2, 3, 3, 3, 3]


@pytest.mark.parametrize(("zoom", "count"), [(10, 8), (12, 12)])
def test_streets_of_other_speeds_merge_only_where_speeds_are_not_told(grid: RoadGraph, zoom: int, count: int) -> None:
    graph = replace(plain(grid), speed_limit_mps=(50 + grid.way_id) / 3.6)
    assert sum(len(f.parts) for f in drawn(graph, tile_at(zoom, WEST + 0.01, SOUTH + 0.01))) == count


def test_oneway_runs_from_its_tail_to_its_head(grid: RoadGraph) -> None:
    names = tuple(f"{tail}-{head}" for tail, head in zip(grid.tail, grid.head, strict=True))
    oneways = replace(grid, reverse_idx=np.full(24, -1, np.int32), names=names, name_idx=np.arange(24, dtype=np.int32))
    features = drawn(oneways, WHOLE)
    assert len(features) == 24
    for feature in features:
        assert feature.attributes["oneway"] is True
        ends = [int(node) for node in str(feature.attributes["name"]).split("-")]
        expected = [units(WHOLE, grid.node_lon_deg[node], grid.node_lat_deg[node]) for node in ends]
        np.testing.assert_allclose(feature.parts[0], expected, atol=0.51)


@pytest.mark.parametrize("kind", list(FunctionalClass))
def test_class_appears_at_its_first_zoom(grid: RoadGraph, kind: FunctionalClass) -> None:
    graph = replace(grid, functional_class=np.full(24, kind, np.int8))
    first = FIRST_ZOOM[kind]
    # a grid this small is less than half a pixel below zoom 7
    assert bool(drawn(graph, tile_at(max(first, 7), 8.01, 46.51)))
    assert first == 0 or not drawn(graph, tile_at(first - 1, 8.01, 46.51))


def test_more_important_roads_come_later(grid: RoadGraph) -> None:
    kinds = np.array([7, 0, 5, 2] * 6, np.int8)[np.argsort(np.argsort(grid.way_id, kind="stable"))]
    graph = replace(grid, functional_class=np.maximum(kinds, kinds[grid.reverse_idx]))
    order = [FunctionalClass[str(f.attributes["class"]).upper()] for f in drawn(graph, tile_at(13, 8.005, 46.505))]
    assert len(set(order)) > 1
    assert order == sorted(order, reverse=True)


def test_road_goes_on_in_the_next_tile_where_it_left_this_one(grid: RoadGraph) -> None:
    # at zoom 14 tiles are 0.015° high, less than the grid
    upper = tile_at(14, WEST, SOUTH + 2 * SPACING_DEG)
    assert SOUTH < upper.bounds_deg()[1] < SOUTH + 2 * SPACING_DEG
    lower = TileAddress(14, upper.x, upper.y + 1)
    at_border = [
        shapely.MultiLineString([part for f in drawn(plain(grid), address) for part in f.parts]).intersection(
            shapely.LineString([(-10_000, y), (10_000, y)])
        )
        for address, y in ((upper, 4096), (lower, 0))
    ]
    places = [sorted(point.x for point in points.geoms) for points in at_border]
    assert len(places[0]) == 3  # the three streets to the north
    np.testing.assert_allclose(places[0], places[1], atol=1.0)


def test_lines_end_at_the_buffer_of_the_tile(grid: RoadGraph) -> None:
    upper = tile_at(14, WEST, SOUTH + 2 * SPACING_DEG)
    points = np.array([point for f in drawn(grid, upper) for part in f.parts for point in part])
    assert points[:, 1].max() == 4096 + EDGE_UNITS
    assert points.min() >= -EDGE_UNITS


def test_tile_without_roads_has_no_bytes(grid: RoadGraph) -> None:
    assert RoadTiles(grid).tile(TileAddress(12, 0, 0)) == b""


@pytest.mark.parametrize(("x", "y", "field"), [(4, 0, "x"), (-1, 0, "x"), (0, 4, "y")])
def test_address_beyond_the_pyramid_is_refused(x: int, y: int, field: str) -> None:
    with pytest.raises(TileOutOfRangeError, match=rf"{field} is .*, allowed: 0\.\.3 at zoom 2"):
        TileAddress(2, x, y)


def test_bounds_of_a_tile_are_those_of_the_slippy_map() -> None:
    # zoom 1 halves the map at the equator and at Greenwich; its ends are at 85.0511°
    west, south, east, north = TileAddress(1, 1, 0).bounds_deg()
    assert (west, south, east) == pytest.approx((0, 0, 180), abs=1e-12)
    assert north == pytest.approx(85.0511288, abs=1e-7)


def tiles_over(graph: RoadGraph, zoom: int) -> Iterator[TileAddress]:
    west, south, east, north = graph.meta.bbox
    first, last = tile_at(zoom, west, north), tile_at(zoom, east, south)
    return (TileAddress(zoom, x, y) for x in range(first.x, last.x + 1) for y in range(first.y, last.y + 1))


@pytest.mark.parametrize("name", ["highlands", "coquimbo"])
def test_tiles_of_bundled_graphs_are_small_at_every_zoom_of_an_overview(name: str) -> None:
    graph = load_graph(BUNDLED_DATA / "graphs" / name)
    roads = RoadTiles(graph)
    for zoom in range(7, 12):
        sizes = [len(gzip.compress(roads.tile(address))) for address in tiles_over(graph, zoom)]
        assert max(sizes) < 100_000, zoom


def test_simplified_roads_stay_within_half_a_pixel_of_the_real_ones() -> None:
    graph = load_graph(BUNDLED_DATA / "graphs" / "highlands")
    windiest = int(np.argmax(np.diff(graph.geometry_first)))
    address = tile_at(12, *graph.geometry(windiest)[0])
    lines = [part for feature in drawn(graph, address) for part in feature.parts]
    tree = shapely.STRtree([shapely.LineString(line) for line in lines])
    shown = graph.functional_class <= FunctionalClass.RESIDENTIAL
    points = np.repeat(shown, np.diff(graph.geometry_first))
    lon, lat = graph.geometry_lon_e7[points] / 1e7, graph.geometry_lat_e7[points] / 1e7
    west, south, east, north = address.bounds_deg()
    inside = (lon > west) & (lon < east) & (lat > south) & (lat < north)
    real = np.array([units(address, *place) for place in zip(lon[inside], lat[inside], strict=True)])
    assert len(real) > 1000
    _, distance = tree.query_nearest(shapely.points(real), return_distance=True, all_matches=False)
    assert distance.max() < 4.0
    assert sum(len(line) for line in lines) < 0.5 * len(real)
