"""Elevation rasters as people bring them: other units, coded colours, voids without a mark, tiles of several sizes."""

from __future__ import annotations

from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import rasterio
from rasterio import Affine
from rasterio.enums import ColorInterp

from routing.errors import ImportFailedError
from routing.importers.heights.elevation import UNDECLARED, read_tile, sample_heights
from routing.importers.region import import_region

CELL = 1.0 / 1200.0  # 92.7 m
ROWS, COLUMNS = 60, 80
SLOPE_M = np.tile(300.0 + 2.0 * np.arange(COLUMNS), (ROWS, 1)) + np.arange(ROWS)[:, None]  # no two alike side by side


def write(
    path: Path, bands: np.ndarray, cell: float = CELL, crs: Any = "EPSG:4326", west: float = 8.0, **more: Any
) -> Path:
    """A GeoTIFF whose north-west corner lies at 50.55° N; bands: (rows, columns) or (count, rows, columns)."""
    bands = bands if bands.ndim == 3 else bands[None]
    form: dict[str, Any] = {
        "driver": "GTiff",
        "width": bands.shape[2],
        "height": bands.shape[1],
        "count": len(bands),
        "dtype": bands.dtype,
        "crs": crs,
        "transform": Affine(cell, 0.0, west, 0.0, -cell, 50.55),
    }
    with rasterio.open(path, "w", **{**form, **more}) as raster:
        raster.write(bands)
    return path


def terrarium(height_m: np.ndarray) -> np.ndarray:
    whole = np.rint((height_m + 32768.0) * 256.0).astype(np.int64)
    return np.stack((whole >> 16, whole >> 8 & 255, whole & 255)).astype(np.uint8)


def mapbox(height_m: np.ndarray) -> np.ndarray:
    whole = np.rint((height_m + 10000.0) * 10.0).astype(np.int64)
    return np.stack((whole >> 16, whole >> 8 & 255, whole & 255)).astype(np.uint8)


@pytest.mark.parametrize(
    ("unit", "metres"),
    [
        ("m", 1.0),
        ("metre", 1.0),
        ("Meters", 1.0),
        ("metres above EGM96", 1.0),
        ("ft", 0.3048),
        ("Feet", 0.3048),
        ("US survey foot", 1200.0 / 3937.0),
        ("US_survey_foot", 1200.0 / 3937.0),
        ("ftUS", 1200.0 / 3937.0),
        ("us-ft", 1200.0 / 3937.0),
        ("dm", 0.1),
        ("cm", 0.01),
    ],
)
def test_heights_are_converted_from_the_unit_of_their_band(tmp_path: Path, unit: str, metres: float) -> None:
    path = write(tmp_path / "unit.tif", (SLOPE_M / metres).astype(np.float32))
    with rasterio.open(path, "r+") as raster:
        raster.units = (unit,)
    assert read_tile(path).height_m == pytest.approx(SLOPE_M, rel=1e-6)


def test_a_unit_holds_after_scale_and_offset(tmp_path: Path) -> None:
    path = write(tmp_path / "unit.tif", np.rint(SLOPE_M).astype(np.int16))
    with rasterio.open(path, "r+") as raster:
        raster.scales, raster.offsets, raster.units = (2.0,), (100.0,), ("ft",)
    assert read_tile(path).height_m == pytest.approx((np.rint(SLOPE_M) * 2.0 + 100.0) * 0.3048, rel=1e-6)


def test_the_unit_of_a_vertical_system_is_that_of_the_heights(tmp_path: Path) -> None:
    path = write(tmp_path / "compound.tif", (SLOPE_M / 0.3048).astype(np.float32), crs="EPSG:4326+6360")  # ftUS
    assert read_tile(path).height_m == pytest.approx(SLOPE_M, rel=1e-5)


@pytest.mark.parametrize("unit", ["degree", "percent", "furlong"])
def test_a_unit_that_is_no_length_is_named(tmp_path: Path, unit: str) -> None:
    path = write(tmp_path / "unit.tif", SLOPE_M.astype(np.float32))
    with rasterio.open(path, "r+") as raster:
        raster.units = (unit,)
    with pytest.raises(ImportFailedError, match=f"unit of its heights is '{unit}', allowed: m, ft"):
        read_tile(path)


@pytest.mark.parametrize("code", [terrarium, mapbox])
@pytest.mark.parametrize("base_m", [-400.0, 0.0, 1500.0, 8000.0])
def test_heights_coded_as_colours_are_decoded(tmp_path: Path, code: Any, base_m: float) -> None:
    height = SLOPE_M - 300.0 + base_m
    path = write(tmp_path / "coded.tif", code(height), photometric="RGB")
    assert read_tile(path).height_m == pytest.approx(height, abs=0.06)  # Mapbox has steps of 0.1 m


@pytest.mark.parametrize("hidden", [(0, 0, 0, 0), (0, 0, 0, 255), (255, 255, 255, 255), (131, 7, 9, 0)])
def test_coded_heights_have_voids_where_nothing_is_seen(tmp_path: Path, hidden: tuple[int, ...]) -> None:
    bands = np.concatenate((terrarium(SLOPE_M), np.full((1, ROWS, COLUMNS), 255, np.uint8)))
    bands[:, :10, :10] = np.array(hidden)[:, None, None]
    tile = read_tile(write(tmp_path / "clear.tif", bands, photometric="RGB", alpha="YES"))
    assert tile.void_cells == 100
    assert tile.height_m[20:] == pytest.approx(SLOPE_M[20:], abs=0.01)


def pictures() -> dict[str, np.ndarray]:
    rng = np.random.default_rng(2)
    rolling = 128.0 + 100.0 * np.sin(np.arange(COLUMNS) / 5.0) * np.cos(np.arange(ROWS) / 5.0)[:, None]
    jpeg = terrarium(SLOPE_M).astype(np.int64) + rng.integers(-2, 3, (3, ROWS, COLUMNS))
    return {
        "photo": np.stack((rolling, rolling[::-1], rng.uniform(0, 255, rolling.shape))).astype(np.uint8),
        "grey": np.full((3, ROWS, COLUMNS), 131, np.uint8),
        "shaded": np.repeat(rolling[None], 3, axis=0).astype(np.uint8),
        "lossy": np.clip(jpeg, 0, 255).astype(np.uint8),
        "black": np.zeros((3, ROWS, COLUMNS), np.uint8),
    }


@pytest.mark.parametrize("name", list(pictures()))
def test_colours_that_code_no_heights_are_refused(tmp_path: Path, name: str) -> None:
    path = write(tmp_path / f"{name}.tif", pictures()[name], photometric="RGB")
    with pytest.raises(ImportFailedError, match="its 3 bands of bytes are colours and no heights"):
        read_tile(path)


def test_a_palette_and_deep_colours_are_refused(tmp_path: Path) -> None:
    path = write(tmp_path / "palette.tif", (SLOPE_M % 250).astype(np.uint8), photometric="palette")
    with rasterio.open(path, "r+") as raster:
        raster.write_colormap(1, {k: (k, 0, 0, 255) for k in range(256)})
        raster.colorinterp = (ColorInterp.palette,)
    deep = write(tmp_path / "deep.tif", np.repeat(SLOPE_M[None], 3, axis=0).astype(np.uint16), photometric="RGB")
    for file in (path, deep):
        with pytest.raises(ImportFailedError, match="bands are colours"):
            read_tile(file)


@pytest.mark.parametrize("value", [0, 1, 9, 255, 900, 2000])
@pytest.mark.parametrize("kind", [np.int16, np.float32])
def test_a_block_of_one_value_with_a_cliff_around_is_a_void(tmp_path: Path, value: int, kind: Any) -> None:
    height = SLOPE_M + (150.0 if value == 255 else 0.0)  # so that 255 lies below
    broken = height.copy()
    broken[20:32, 30:44] = value
    tile = read_tile(write(tmp_path / "hole.tif", broken.astype(kind)))
    assert tile.undeclared == 14 * 16  # the cells around go with it
    assert tile.height_m == pytest.approx(height, abs=20.0)


@pytest.mark.parametrize("part", [np.s_[:, 60:], np.s_[:15, :], np.s_[40:, 60:], np.s_[25:26, 25:26]])
def test_zeros_at_the_rim_or_alone_are_voids(tmp_path: Path, part: Any) -> None:
    broken = SLOPE_M.copy()
    broken[part] = 0.0
    tile = read_tile(write(tmp_path / "collar.tif", broken.astype(np.int16)))
    assert tile.undeclared >= (broken == 0.0).sum()
    assert tile.height_m.min() > 290.0


def test_a_void_whose_rim_was_resampled_leaves_no_ring(tmp_path: Path) -> None:
    broken = SLOPE_M.copy()
    broken[19:33, 29:45] *= 0.5
    broken[20:32, 30:44] = 0.0
    tile = read_tile(write(tmp_path / "soft.tif", broken.astype(np.float32)))
    assert tile.height_m == pytest.approx(SLOPE_M, abs=20.0)


def test_a_void_without_a_mark_is_told(draw_map: Any, tmp_path: Path) -> None:
    broken = np.full((400, 400), 800.0, np.int16)
    broken[100:300, 100:150] = 0
    form = {"transform": Affine(1e-4, 0.0, 1.48, 0.0, -1e-4, 42.02)}
    dem = write(tmp_path / "hole.tif", broken, **form)
    path = draw_map({1: (-1500, 0), 2: (1500, 0)}, {10: ([1, 2], {"highway": "primary"})})
    graph = import_region(path, [dem], "told")
    assert graph.node_height_m == pytest.approx(800.0, abs=0.1)
    assert graph.meta.dropped[UNDECLARED] == 202 * 52


def lake() -> np.ndarray:
    """A lake of one height among slopes of 60 %, with an outlet as flat as itself."""
    away = np.hypot(np.arange(COLUMNS) - 40.0, (np.arange(ROWS) - 30.0)[:, None])
    height = 500.0 + np.maximum(away - 12.0, 0.0) * 55.0
    height[28:33, 40:] = np.minimum(height[28:33, 40:], 500.0 - 2.0 * np.maximum(np.arange(40) - 12.0, 0.0))
    return height


def coast() -> np.ndarray:
    """The sea along a shore that rises gently for two thirds and as cliffs of 200 m for the rest."""
    inland = np.maximum(np.arange(COLUMNS) - 40.0, 0.0)
    height = np.tile(inland * 4.0, (ROWS, 1))
    height[40:] = np.where(inland > 0.0, 200.0 + inland, 0.0)
    return height


def terraces() -> np.ndarray:
    """Plateaus of one height each, 60 m above each other, with slopes of one cell between them."""
    return np.tile(np.repeat(np.arange(8) * 25.0 + 100.0, 10), (ROWS, 1))


@pytest.mark.parametrize("terrain", [lake, coast, terraces])
def test_lakes_coasts_and_plateaus_are_terrain(tmp_path: Path, terrain: Any) -> None:
    height = np.rint(terrain())
    tile = read_tile(write(tmp_path / "real.tif", height.astype(np.int16)))
    assert tile.void is None
    assert tile.height_m.tolist() == height.tolist()


def test_heights_in_another_unit_are_refused_by_their_range(tmp_path: Path) -> None:
    path = write(tmp_path / "cm.tif", (SLOPE_M * 100.0).astype(np.float32))
    with pytest.raises(ImportFailedError, match=r"100\.0 % of its cells lie above 9000 m, up to .*: not in metres"):
        read_tile(path)


def test_no_height_leaves_the_range_of_the_earth(tmp_path: Path) -> None:
    broken = SLOPE_M.copy()
    for k, mark in enumerate((-32768.0, -9999.0, -501.0, 9001.0, 9999.0, 32767.0, 1e30, np.inf, -np.inf, np.nan)):
        broken[3 * k : 3 * k + 2, 5:8] = mark
    tile = read_tile(write(tmp_path / "marks.tif", broken.astype(np.float32)))
    assert tile.void_cells >= 60
    assert tile.height_m == pytest.approx(SLOPE_M, abs=20.0)


def at(paths: list[Path], lon: float, lat: float) -> float:
    return float(sample_heights(paths, np.array([lon]), np.array([lat]))[0][0])


def test_of_tiles_that_overlap_the_finer_one_is_taken(tmp_path: Path) -> None:
    coarse = write(tmp_path / "coarse.tif", np.full((20, 20), 100.0, np.float32), cell=0.01)
    fine = write(tmp_path / "fine.tif", np.full((100, 100), 200.0, np.float32), cell=0.001)
    for paths in ([coarse, fine], [fine, coarse]):
        assert at(paths, 8.05, 50.5) == 200.0
        assert at(paths, 8.15, 50.4) == 100.0  # beyond the fine one


def test_a_void_of_one_tile_is_filled_from_another(tmp_path: Path) -> None:
    height = np.full((100, 100), 200.0, np.float32)
    height[20:60, 20:60] = -9999.0
    fine = write(tmp_path / "fine.tif", height, cell=0.001, nodata=-9999.0)
    coarse = write(tmp_path / "coarse.tif", np.full((20, 20), 130.0, np.float32), cell=0.01)
    for paths in ([coarse, fine], [fine, coarse]):
        assert at(paths, 8.04, 50.51) == 130.0
        assert at(paths, 8.01, 50.54) == 200.0
    assert at([fine], 8.04, 50.51) == pytest.approx(200.0)


def test_voids_without_a_mark_are_counted_over_all_tiles(tmp_path: Path) -> None:
    broken = SLOPE_M.copy()
    broken[20:24, 20:24] = 0.0
    paths = [write(tmp_path / f"{k}.tif", broken.astype(np.float32)) for k in range(2)]
    dropped: Counter[str] = Counter()
    sample_heights(paths, np.array([8.03]), np.array([50.52]), None, dropped)
    assert dropped == {UNDECLARED: 2 * 36}


def test_a_raster_from_0_to_360_degrees_is_found_from_the_west(tmp_path: Path) -> None:
    height = np.tile(np.arange(100.0, dtype=np.float32), (100, 1))
    path = write(tmp_path / "east.tif", height, cell=0.01, west=359.0)
    assert at([path], -0.5, 50.3) == pytest.approx(49.5, abs=1e-6)


def test_a_projected_raster_far_from_the_map_names_both_places(draw_map: Any, tmp_path: Path) -> None:
    form = {"transform": Affine(100.0, 0.0, 400_000.0, 0.0, -100.0, 5_600_000.0)}
    dem = write(tmp_path / "far.tif", SLOPE_M.astype(np.float32), crs="EPSG:32760", **form)
    path = draw_map({1: (0, 0), 2: (500, 0)}, {10: ([1, 2], {"highway": "primary"})})
    with pytest.raises(ImportFailedError, match="does not cover the map"):
        import_region(path, [dem], "far")
