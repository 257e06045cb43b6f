"""Terrain heights from files, and road profiles made of them."""

from __future__ import annotations

import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import rasterio
from rasterio import Affine

from routing.errors import ImportFailedError
from routing.graph.road_graph import RoadGraph, Terrain
from routing.importers.heights.elevation import read_tile, sample_heights
from routing.importers.region import GRADE_TOLERANCE_M, import_region

STREET = {"highway": "residential"}


def write_geotiff(
    path: Path, height_m: np.ndarray, west: float, north: float, cell: float, crs: str = "EPSG:4326", **more: Any
) -> Path:
    with rasterio.open(
        path,
        "w",
        driver="GTiff",
        width=height_m.shape[1],
        height=height_m.shape[0],
        count=1,
        dtype=height_m.dtype,
        crs=crs,
        transform=Affine(cell, 0.0, west, 0.0, -cell, north),
        **more,
    ) as raster:
        raster.write(height_m, 1)
    return path


def write_hgt(path: Path, height_m: np.ndarray) -> Path:
    path.write_bytes(height_m.astype(">i2").tobytes())
    return path


def at(paths: list[Path], lon: float, lat: float) -> float:
    return float(sample_heights(paths, np.array([lon]), np.array([lat]))[0][0])


def test_geotiff_is_read_between_cell_centres(tmp_path: Path) -> None:
    # cell centres at lon 0.5 and 1.5, lat 1.5 (upper row) and 0.5
    path = write_geotiff(tmp_path / "dem.tif", np.array([[10, 20], [30, 60]], np.float32), 0.0, 2.0, 1.0)
    assert at([path], 0.5, 1.5) == pytest.approx(10.0)
    assert at([path], 1.5, 0.5) == pytest.approx(60.0)
    # the middle: (10 + 20 + 30 + 60) / 4
    assert at([path], 1.0, 1.0) == pytest.approx(30.0)
    # a quarter east, three quarters south: 0.75*0.25*10 + 0.25*0.25*20 + 0.75*0.75*30 + 0.25*0.75*60
    assert at([path], 0.75, 0.75) == pytest.approx(1.875 + 1.25 + 16.875 + 11.25)
    # in the outer half of a rim cell: the rim's height
    assert at([path], 0.0, 2.0) == pytest.approx(10.0)


def test_geotiff_in_metres_is_read_at_the_right_place(tmp_path: Path) -> None:
    # UTM 31: easting 500 000 m is 3° E; cells of 1000 m whose height is their number from the west
    height = np.tile(np.arange(100.0, dtype=np.float32), (100, 1))
    path = write_geotiff(tmp_path / "utm.tif", height, 450_000.0, 4_700_000.0, 1000.0, crs="EPSG:32631")
    assert at([path], 3.0, 42.2) == pytest.approx(49.5, abs=1e-3)  # 50 km east of the rim, half a cell from centre 49


def test_geotiff_with_scale_and_offset_applies_them(tmp_path: Path) -> None:
    path = write_geotiff(tmp_path / "scaled.tif", np.full((3, 3), 100, np.int16), 0.0, 3.0, 1.0)
    with rasterio.open(path, "r+") as raster:
        raster.scales, raster.offsets = (0.1,), (5.0,)
    assert at([path], 1.5, 1.5) == pytest.approx(15.0)


@pytest.mark.parametrize("size", [1201, 3601])
def test_hgt_takes_its_corner_from_the_name(tmp_path: Path, size: int) -> None:
    rows, columns = np.mgrid[0:size, 0:size]
    path = write_hgt(tmp_path / "N42E001.hgt", rows // 10 + columns)
    last = size - 1
    assert at([path], 1.0, 43.0) == pytest.approx(0.0)  # the first sample is the north-west corner
    assert at([path], 2.0, 43.0) == pytest.approx(last)
    assert at([path], 1.0, 42.0) == pytest.approx(last // 10)
    assert at([path], 1.25, 43.0) == pytest.approx(last / 4)


def test_hgt_in_the_south_west_counts_down(tmp_path: Path) -> None:
    height = np.zeros((1201, 1201))
    height[0, 0] = 100.0
    path = write_hgt(tmp_path / "S31W052.hgt", height)
    assert at([path], -52.0, -30.0) == pytest.approx(100.0)
    assert read_tile(path).bounds == (-52.0, -31.0, -51.0, -30.0)


@pytest.mark.parametrize(
    ("offset", "changed"),
    [
        (6, b"\x01\x00"),  # flags: encrypted
        (8, b"\x63\x00"),  # a method of packing that no one knows
        (40, b"\xff\xff\xff\xff"),  # the packed bytes themselves
    ],
)
def test_a_damaged_zip_is_refused(tmp_path: Path, offset: int, changed: bytes) -> None:
    packed = tmp_path / "N42E001.hgt.zip"
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("N42E001.hgt", bytes(2 * 1201**2))
    content = bytearray(packed.read_bytes())
    content[offset : offset + len(changed)] = changed
    directory = content.index(b"PK\x01\x02")
    if offset < 40:  # the directory at the end says it too, two bytes further on
        content[directory + offset + 2 : directory + offset + 4] = changed
    packed.write_bytes(content)
    with pytest.raises(ImportFailedError, match="not a readable zip"):
        read_tile(packed)


def test_a_zip_that_unpacks_to_more_than_a_tile_is_refused(tmp_path: Path) -> None:
    packed = tmp_path / "N42E001.hgt.zip"
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("N42E001.hgt", bytes(30_000_000))
    with pytest.raises(ImportFailedError, match="more than 25934402 bytes, allowed: 2884802"):
        read_tile(packed)


def test_hgt_in_a_zip_equals_the_plain_file(tmp_path: Path) -> None:
    plain = write_hgt(tmp_path / "N42E001.hgt", np.mgrid[0:1201, 0:1201][1])
    packed = tmp_path / "N42E001.hgt.zip"
    with zipfile.ZipFile(packed, "w") as archive:
        archive.write(plain, "N42E001.hgt")
    assert at([packed], 1.123, 42.5) == at([plain], 1.123, 42.5) == pytest.approx(0.123 * 1200)


def test_tiles_side_by_side_each_give_their_part(tmp_path: Path) -> None:
    west = write_hgt(tmp_path / "N42E001.hgt", np.full((1201, 1201), 100))
    east = write_hgt(tmp_path / "N42E002.hgt", np.full((1201, 1201), 200))
    height, outside = sample_heights([west, east], np.array([1.5, 2.5, 2.0]), np.array([42.5, 42.5, 42.5]))
    assert height.tolist() == [100.0, 200.0, 100.0]  # on the common edge the first tile's
    assert not outside.any()


def test_voids_are_filled_from_their_rim(tmp_path: Path) -> None:
    height = np.full((1201, 1201), 500)
    height[600:603, 600:603] = -32768
    tile = read_tile(write_hgt(tmp_path / "N42E001.hgt", height))
    assert tile.void_cells == 9
    assert tile.height_m == pytest.approx(500.0)


def test_only_cells_with_a_height_of_their_own_are_measured(tmp_path: Path) -> None:
    height = np.full((1201, 1201), 500)
    height[600, 600] = -32768  # at 42.5 N 1.5 E
    tile = read_tile(write_hgt(tmp_path / "N42E001.hgt", height))
    lon, lat = np.array([1.5, 1.5 + 0.4 / 1200, 1.5 + 0.6 / 1200, 3.0]), np.full(4, 42.5)
    assert tile.measured(lon, lat).tolist() == [False, False, True, False]
    assert tile.cell_m == pytest.approx(111_195.0 / 1201, rel=1e-3)


def test_voids_of_every_kind_are_seen(tmp_path: Path) -> None:
    height = np.full((20, 20), 7.0, np.float32)
    height[3, 3], height[5, 5], height[7, 7] = np.nan, -9999.0, 1e20
    path = write_geotiff(tmp_path / "dem.tif", height, 0.0, 20.0, 1.0, nodata=-9999.0)
    tile = read_tile(path)
    assert tile.void_cells == 3
    assert tile.height_m == pytest.approx(7.0)


def test_a_filled_void_lies_between_its_rims(tmp_path: Path) -> None:
    height = np.tile(np.linspace(0, 1000, 1201).astype(int), (1201, 1))
    height[500:700, 500:700] = -32768
    tile = read_tile(write_hgt(tmp_path / "N42E001.hgt", height))
    hole = tile.height_m[500:700, 500:700]
    assert hole.min() > 400.0
    assert hole.max() < 600.0


@pytest.mark.parametrize(
    ("name", "content", "message"),
    [
        ("N42E001.hgt", b"\0" * 1000, "1000 bytes, allowed: 2884802"),
        ("heights.hgt", b"\0" * 2884802, "gives no corner"),
        ("N42E001.hgt.zip", b"no zip", "not a readable zip"),
        ("dem.tif", b"no tiff", "not a readable raster"),
        ("N42E001.hgt", b"\x80\x00" * 1201**2, "are void"),
    ],
)
def test_a_broken_elevation_file_is_named(tmp_path: Path, name: str, content: bytes, message: str) -> None:
    path = tmp_path / name
    path.write_bytes(content)
    with pytest.raises(ImportFailedError, match=message) as caught:
        read_tile(path)
    assert caught.value.field == "dem"
    assert str(path) in str(caught.value)


def test_a_missing_elevation_file_is_named(tmp_path: Path) -> None:
    with pytest.raises(ImportFailedError, match="no such file"):
        read_tile(tmp_path / "gone.tif")


def test_an_elevation_model_elsewhere_names_both_bounds(draw_map: Any, tmp_path: Path) -> None:
    dem = write_hgt(tmp_path / "N50E010.hgt", np.zeros((1201, 1201)))
    path = draw_map({1: (0, 0), 2: (500, 0)}, {10: ([1, 2], STREET)})
    with pytest.raises(ImportFailedError, match=r"100\.0 % .* lat 42\.0000\.\.42\.0000, .* lat 50\.0000\.\.51\.0000"):
        import_region(path, [dem], "elsewhere")


def test_roads_past_the_rim_of_the_elevation_model_are_left_out(draw_map: Any, tmp_path: Path) -> None:
    # the model ends 50 m east of point 2; way 11 leads 60 m past it; 3 of 103 points lie outside
    dem = write_geotiff(tmp_path / "d.tif", np.zeros((40, 40), np.float32), 1.5 - 0.05, 42.02, 0.1 / 39.9)
    rim_m = (1.45 + 40 * 0.1 / 39.9 - 1.5) * 82_850.76
    points = {1: (0, 0), 2: (rim_m - 50, 0), 3: (rim_m + 60, 0)}
    graph = import_region(draw_map(points, {10: ([1, 2], STREET), 11: ([2, 3], STREET)}), [dem], "rim")
    assert set(graph.way_id.tolist()) == {10}
    assert graph.meta.dropped["roads_without_height"] == 1


def hill(tmp_path: Path, profile: Any) -> Path:
    """An elevation model whose height depends on the metres east of 1.5° only; cells of 20 m, 8 km wide."""
    east_m = (np.arange(400) + 0.5) * 20.0 - 4000.0
    cell = 20.0 / 82_850.76
    height = np.tile(profile(east_m).astype(np.float32), (60, 1))
    return write_geotiff(tmp_path / "hill.tif", height, 1.5 - 4000.0 / 82_850.76, 42.0 + 30 * cell, cell)


def heights_along(graph: RoadGraph) -> tuple[np.ndarray, np.ndarray]:
    order = np.argsort(graph.node_lon_deg)
    return (graph.node_lon_deg[order] - 1.5) * 82_850.76, graph.node_height_m[order]


def test_an_even_slope_stays_as_it_is_under_smoothing(draw_map: Any, tmp_path: Path) -> None:
    dem = hill(tmp_path, lambda x: 1000.0 + 0.05 * x)
    path = draw_map({1: (-3000, 0), 2: (3000, 0)}, {10: ([1, 2], STREET)})
    graph = import_region(path, [dem], "slope", smoothing_m=450.0)
    east_m, height = heights_along(graph)
    inner = np.abs(east_m) < 2000.0  # at a loose end of a road the kernel leans inwards
    assert height[inner] == pytest.approx(1000.0 + 0.05 * east_m[inner], abs=0.1)
    assert graph.meta.terrain is Terrain.MEASURED
    assert graph.meta.smoothing_m == 450.0
    assert "450 m" in graph.meta.elevation_method


def test_smoothing_has_the_variance_of_a_moving_average(draw_map: Any, tmp_path: Path) -> None:
    # a parabola h = x²/2R rises by variance/2R under any even kernel: smoothing_m²/12/2R
    radius_m, smoothing_m = 30_000.0, 600.0
    dem = hill(tmp_path, lambda x: x**2 / (2.0 * radius_m))
    points = {k: (-3000.0 + 30.0 * k, 0.0) for k in range(1, 201)}
    points[100] = (0.0, 0.0)
    ways = {10: (list(range(1, 101)), STREET), 11: (list(range(100, 201)), STREET)}
    graph = import_region(draw_map(points, ways), [dem], "parabola", smoothing_m=smoothing_m)
    middle = graph.node_height_m[graph.node_id == 100][0]
    assert middle == pytest.approx(smoothing_m**2 / 12.0 / (2.0 * radius_m), rel=0.05)  # 0.5 m


def test_smoothing_takes_noise_away_and_keeps_a_hill(draw_map: Any, tmp_path: Path) -> None:
    noise = np.random.default_rng(1).normal(0.0, 5.0, 400)
    dem = hill(tmp_path, lambda x: 500.0 + 300.0 * np.exp(-((x / 2500.0) ** 2)) + noise)
    path = draw_map({1: (-3500, 0), 2: (3500, 0)}, {10: ([1, 2], {"highway": "tertiary"})})
    rough, smooth = (import_region(path, [dem], "hill", smoothing_m=s) for s in (0.0, 300.0))
    # the ends lie 258 m below the top, which is climbed from both: 516 m
    assert np.maximum(rough.climb_m(), 0.0).sum() > 1.25 * 516.0
    assert np.maximum(smooth.climb_m(), 0.0).sum() < 1.1 * 516.0
    assert smooth.node_height_m.max() == pytest.approx(800.0, abs=8.0)


def test_links_end_where_the_grade_changes(draw_map: Any, tmp_path: Path) -> None:
    dem = hill(tmp_path, lambda x: 100.0 - 0.08 * np.abs(x))
    path = draw_map({1: (-600, 0), 2: (600, 0)}, {10: ([1, 2], STREET)})
    graph = import_region(path, [dem], "ridge", smoothing_m=60.0)
    east_m, height = heights_along(graph)
    ridge = np.abs(east_m).argmin()
    assert abs(east_m[ridge]) < 31.0  # a step
    assert height[ridge] == pytest.approx(100.0, abs=2.0)
    exact = 100.0 - 0.08 * np.abs(np.linspace(-500, 500, 51))
    between = np.interp(np.linspace(-500, 500, 51), east_m, height)
    assert np.abs(between - exact).max() < GRADE_TOLERANCE_M + 1.0


def test_a_bridge_runs_straight_over_the_valley_it_crosses(draw_map: Any, tmp_path: Path) -> None:
    dem = hill(tmp_path, lambda x: np.where(np.abs(x) < 200.0, 400.0, 500.0 + 0.02 * x))
    points = {1: (-1000, 0), 2: (-300, 0), 3: (0, 0), 4: (300, 0), 5: (1000, 0)}
    bridge = {**STREET, "bridge": "yes"}
    ways = {10: ([1, 2], STREET), 11: ([2, 3], bridge), 12: ([3, 4], bridge), 13: ([4, 5], STREET)}
    graph = import_region(draw_map(points, ways), [dem], "bridge", smoothing_m=90.0)
    height = {int(i): h for i, h in zip(graph.node_id, graph.node_height_m, strict=True)}
    assert height[2] == pytest.approx(494.0, abs=1.0)
    assert height[3] == pytest.approx((height[2] + height[4]) / 2.0, abs=1e-3)
    assert graph.structure.sum() == 4


def test_a_tunnel_junction_lies_between_its_three_mouths(draw_map: Any, tmp_path: Path) -> None:
    # mouths at -300, 300 (500 m high) under a mountain of 900 m; a junction inside at 0 with a branch to 0/300
    dem = hill(tmp_path, lambda x: np.where(np.abs(x) < 250.0, 900.0, 500.0))
    points = {
        1: (-900, 0),
        2: (-300, 0),
        3: (0, 0),
        4: (300, 0),
        5: (900, 0),
        6: (0, 300),
        7: (300, 300),
        8: (900, 300),
    }
    tunnel = {**STREET, "tunnel": "yes"}
    ways = {
        10: ([1, 2], STREET),
        11: ([2, 3], tunnel),
        12: ([3, 4], tunnel),
        13: ([4, 5], STREET),
        14: ([3, 6, 7], tunnel),
        15: ([7, 8], STREET),
    }
    graph = import_region(draw_map(points, ways), [dem], "fork", smoothing_m=90.0)
    assert graph.node_height_m[graph.node_id == 3][0] == pytest.approx(500.0, abs=1.0)
    assert graph.node_height_m.max() < 502.0


def test_grades_stay_within_the_limit_of_their_class(draw_map: Any, tmp_path: Path) -> None:
    dem = hill(tmp_path, lambda x: np.where(x > 0.0, 300.0, 0.0))  # a cliff of 300 m
    points = {1: (-3500, 0), 2: (3500, 0)}
    for highway, limit in (("motorway", 0.07), ("primary", 0.12), ("residential", 0.20)):
        path = draw_map(points, {10: ([1, 2], {"highway": highway, "oneway": "no"})})
        graph = import_region(path, [dem], "cliff", smoothing_m=0.0)
        grade = np.abs(graph.climb_m() / graph.length_m)
        assert grade.max() <= limit + 1e-9
        assert grade.max() == pytest.approx(limit, rel=0.02)
        # the cut is shared by both sides of the cliff
        east_m, height = heights_along(graph)
        assert np.interp(0.0, east_m, height) == pytest.approx(150.0, abs=3.0)
        assert height[0] == pytest.approx(0.0, abs=1e-6)
        assert height[-1] == pytest.approx(300.0, abs=1e-6)


def test_heights_below_the_sea_are_kept(draw_map: Any, tmp_path: Path) -> None:
    dem = hill(tmp_path, lambda x: np.full_like(x, -4.0))
    graph = import_region(draw_map({1: (0, 0), 2: (500, 0)}, {10: ([1, 2], STREET)}), [dem], "polder")
    assert graph.node_height_m == pytest.approx(-4.0)


@pytest.mark.parametrize("smoothing_m", [-1.0, 6000.0, float("nan")])
def test_smoothing_out_of_range_is_refused(tmp_path: Path, smoothing_m: float) -> None:
    with pytest.raises(ImportFailedError, match=r"smoothing_m .* allowed: 0\.\.5000 m"):
        import_region(tmp_path / "x.osm.pbf", [], "x", smoothing_m=smoothing_m)
