"""Heights as raster-dem tiles."""

from __future__ import annotations

import warnings
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
import pytest
from rasterio.errors import NotGeoreferencedWarning
from rasterio.io import MemoryFile

from app.settings import BUNDLED_DATA
from app.tiles.address import TileAddress, east_from_lon, south_from_lat
from app.tiles.errors import TileOutOfRangeError
from app.tiles.heights import HeightTiles, terrarium_rgb
from app.tiles.png import png_from_rgb
from app.tiles.surface import HeightSurface, surface_grid
from routing.graph.files import load_graph
from routing.graph.road_graph import RoadGraph, Terrain
from tests.app.conftest import HEIGHTS_M, SOUTH, SPACING_DEG, WEST, street_grid

if TYPE_CHECKING:
    from numpy.typing import NDArray

NEAR = 2 * SPACING_DEG


@pytest.fixture(scope="module")
def grid() -> RoadGraph:
    return street_grid("grid", Terrain.SYNTHETIC)


def colours(png: bytes) -> NDArray[np.int64]:
    """Colours of a picture, read by another library."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", NotGeoreferencedWarning)
        with MemoryFile(png) as file, file.open() as picture:
            return np.moveaxis(picture.read(), 0, -1).astype(np.int64)


def heights_m(png: bytes) -> NDArray[np.float64]:
    """Heights of a terrarium picture, by its definition."""
    rgb = colours(png)
    return rgb[..., 0] * 256.0 + rgb[..., 1] + rgb[..., 2] / 256.0 - 32768.0


def heights_at(graph: RoadGraph, lon_deg: NDArray[np.float64], lat_deg: NDArray[np.float64]) -> NDArray[np.float64]:
    """Heights of the surface on a grid of places, rows from the north."""
    surface = HeightSurface(graph, surface_grid(graph))
    return surface.heights_m(east_from_lon(lon_deg), south_from_lat(lat_deg))


def finest_tile(graph: RoadGraph, zoom: int) -> TileAddress:
    lon, lat = np.float64(WEST + SPACING_DEG / 2), np.float64(SOUTH + SPACING_DEG / 2)
    return TileAddress(zoom, int(east_from_lon(lon) * 2**zoom), int(south_from_lat(lat) * 2**zoom))


def test_terrarium_colours_are_those_of_its_definition() -> None:
    # 32768 = 128 · 256; 1000.5 + 32768 = 131 · 256 + 232 + 128 / 256; −0.25 + 32768 = 127 · 256 + 255 + 192 / 256
    rgb = terrarium_rgb(np.array([0.0, 1000.5, -0.25]), 256)
    assert rgb.tolist() == [[128, 0, 0], [131, 232, 128], [127, 255, 192]]


def test_terrarium_heights_are_rounded_to_the_steps_asked_for() -> None:
    assert terrarium_rgb(np.array([10.6, 10.9]), 4)[:, 1:].tolist() == [[10, 128], [11, 0]]


def test_picture_reads_as_it_was_written() -> None:
    rgb = np.random.default_rng(4).integers(0, 256, (5, 7, 3)).astype(np.uint8)
    np.testing.assert_array_equal(colours(png_from_rgb(rgb)), rgb)


def test_surface_of_level_roads_is_level_everywhere(grid: RoadGraph) -> None:
    level = replace(grid, node_height_m=np.full(9, 321.0))
    far = np.array([-3.0, 0.0, 0.005, 0.02, 5.0])
    np.testing.assert_allclose(heights_at(level, WEST + far, SOUTH + far[::-1]), 321.0, atol=1e-6)


def test_surface_of_an_inclined_plane_is_that_plane(grid: RoadGraph) -> None:
    # 100 m in 0.01° to the east: bending is none, slope lays it back by a little at its ends
    plane = replace(grid, node_height_m=1e4 * (grid.node_lon_deg - WEST))
    lon = WEST + np.linspace(0, NEAR, 9)
    found = heights_at(plane, lon, SOUTH + np.array([NEAR, SPACING_DEG / 2, 0]))
    np.testing.assert_allclose(found, np.tile(1e4 * (lon - WEST), (3, 1)), atol=7.0)


def test_surface_passes_the_heights_of_the_nodes(grid: RoadGraph) -> None:
    found = heights_at(grid, WEST + SPACING_DEG * np.arange(3), SOUTH + SPACING_DEG * np.arange(3)[::-1])
    # rows of the surface go south, nodes are counted from the south; the pyramid's tip is rounded off
    np.testing.assert_allclose(found[::-1].ravel(), HEIGHTS_M, atol=20.0)
    assert found.argmax() == 4


def test_surface_leaves_out_bridges_and_tunnels(grid: RoadGraph) -> None:
    # a viaduct 5 km up in the middle, which all four of its streets lead to
    high = np.array(HEIGHTS_M)
    high[4] = 5000.0
    aloft = replace(grid, node_height_m=high, structure=(grid.tail == 4) | (grid.head == 4))
    assert heights_at(aloft, WEST + np.linspace(0, NEAR, 9), SOUTH + np.linspace(NEAR, 0, 9)).max() < 560


def test_surface_of_bridges_alone_is_theirs(grid: RoadGraph) -> None:
    aloft = replace(grid, structure=np.ones(24, bool))
    middle = (np.array([WEST + SPACING_DEG]), np.array([SOUTH + SPACING_DEG]))
    assert heights_at(aloft, *middle) == pytest.approx(heights_at(grid, *middle))


def test_surface_beyond_the_roads_fades_without_a_cliff(grid: RoadGraph) -> None:
    slope = replace(grid, node_height_m=1e4 * (grid.node_lon_deg - WEST))
    profile = heights_at(slope, np.linspace(WEST, WEST + 1.0, 2001), np.array([SOUTH + SPACING_DEG]))[0]
    steepest = np.abs(np.diff(profile))
    # 5 m in 0.0005° along the roads; from their end the height goes back to the mean of 100 m on a gentler slope
    assert steepest.max() < 7.0
    assert steepest[40:].max() < 6.0
    np.testing.assert_allclose(profile[-1000:], profile[-1])
    assert profile[-1] == pytest.approx(100.0, abs=10.0)


def test_surface_beyond_the_roads_is_found_with_a_tanh_that_wavers_in_its_last_bit(
    grid: RoadGraph, monkeypatch: pytest.MonkeyPatch
) -> None:
    lon, lat = np.linspace(WEST, WEST + 1.0, 2001), np.array([SOUTH + SPACING_DEG])
    wanted = heights_at(grid, lon, lat)
    exact = np.tanh

    def wavering(x: np.ndarray) -> np.ndarray:
        return np.nextafter(exact(x), np.where(np.arange(x.size) % 2, np.inf, -np.inf))

    monkeypatch.setattr(np, "tanh", wavering)
    np.testing.assert_allclose(heights_at(grid, lon, lat), wanted, rtol=1e-12)


@pytest.mark.parametrize("sides", [(True, False), (False, True)])
def test_surface_of_roads_on_one_line_is_found(grid: RoadGraph, sides: tuple[bool, bool]) -> None:
    squeezed = replace(
        grid,
        geometry_lon_e7=np.full_like(grid.geometry_lon_e7, WEST * 1e7) if sides[0] else grid.geometry_lon_e7,
        geometry_lat_e7=np.full_like(grid.geometry_lat_e7, SOUTH * 1e7) if sides[1] else grid.geometry_lat_e7,
    )
    found = heights_at(squeezed, WEST + np.linspace(0, NEAR, 5), SOUTH + np.linspace(NEAR, 0, 5))
    assert found.min() > 490
    assert found.max() < 570


def test_tiles_of_neighbours_go_on_where_the_other_ends(grid: RoadGraph) -> None:
    tiles = HeightTiles(grid)
    first = finest_tile(grid, tiles.max_zoom)
    west, east = (heights_m(tiles.tile(TileAddress(first.z, first.x + k, first.y))) for k in (0, 1))
    inside = np.abs(np.diff(np.hstack((west[:, -3:], east[:, :3])), axis=1))
    assert inside[:, 2].max() <= 1.5 * inside.max(axis=0)[[0, 1, 3, 4]].max() + 2 / 64


def test_tile_of_a_coarser_zoom_holds_the_mean_of_the_finer_ones(grid: RoadGraph) -> None:
    tiles = HeightTiles(grid)
    parent = finest_tile(grid, tiles.max_zoom - 1)
    quarter = heights_m(tiles.tile(TileAddress(tiles.max_zoom, 2 * parent.x, 2 * parent.y)))
    mean = quarter.reshape(128, 2, 128, 2).mean(axis=(1, 3))
    np.testing.assert_allclose(heights_m(tiles.tile(parent))[:128, :128], mean, atol=0.05)


def test_tile_beyond_the_finest_zoom_is_refused(grid: RoadGraph) -> None:
    tiles = HeightTiles(replace(grid, geometry_lon_e7=grid.geometry_lon_e7 * 2))
    assert 8 < tiles.max_zoom < 14
    with pytest.raises(TileOutOfRangeError, match=rf"z is 14, allowed: 0\.\.{tiles.max_zoom} for heights"):
        tiles.tile(finest_tile(grid, 14))


def test_surface_of_the_bundled_terrain_is_near_its_roads() -> None:
    graph = load_graph(BUNDLED_DATA / "graphs" / "highlands")
    tiles = HeightTiles(graph)
    z = tiles.max_zoom
    some = np.arange(0, graph.node_count, 50)
    x, y = east_from_lon(graph.node_lon_deg[some]) * 2**z, south_from_lat(graph.node_lat_deg[some]) * 2**z
    pictures = {
        place: heights_m(tiles.tile(TileAddress(z, *place)))
        for place in set(zip(x.astype(int).tolist(), y.astype(int).tolist(), strict=True))
    }
    found = np.array([pictures[int(a), int(b)][int(b % 1 * 256), int(a % 1 * 256)] for a, b in zip(x, y, strict=True)])
    missed_m = found - graph.node_height_m[some]
    assert np.ptp(graph.node_height_m) > 2000
    assert np.sqrt(np.mean(missed_m**2)) < 40
    assert abs(np.mean(missed_m)) < 10
