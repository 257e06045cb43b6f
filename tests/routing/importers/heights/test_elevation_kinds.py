"""Elevation files of odd kinds are read rightly, or refused with the reason and what is allowed."""

from __future__ import annotations

import gzip
import zipfile
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
import rasterio
from rasterio import Affine
from rasterio.crs import CRS
from rasterio.warp import transform

from routing.errors import ImportFailedError
from routing.importers.heights.elevation import sample_heights

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import NDArray

CELL = 1.0 / 1200.0
ROWS, COLUMNS = 60, 80
NORTH_UP = Affine(CELL, 0.0, 8.0, 0.0, -CELL, 50.55)
LON, LAT = np.linspace(8.005, 8.06, 40), np.linspace(50.51, 50.545, 40)


def height_at(lon: NDArray[np.float64], lat: NDArray[np.float64]) -> NDArray[np.float64]:
    """A plane that rises to the north-east, which bilinear reading meets exactly."""
    return np.asarray(300.0 + 1000.0 * (lon - 8.0) + 2000.0 * (lat - 50.5))


def plane(place: Affine = NORTH_UP, crs: Any = None, rows: int = ROWS, columns: int = COLUMNS) -> NDArray[np.float64]:
    """The heights of that plane at the centres of a raster's cells."""
    column, row = np.meshgrid(np.arange(columns) + 0.5, np.arange(rows) + 0.5)
    x = place.a * column + place.b * row + place.c
    y = place.d * column + place.e * row + place.f
    if crs is not None:
        lon, lat = transform(crs, "EPSG:4326", x.ravel(), y.ravel())[:2]
        x, y = np.reshape(lon, x.shape), np.reshape(lat, y.shape)
    return height_at(x, y)


def write(path: Path, bands: NDArray[Any], place: Affine = NORTH_UP, crs: Any = "EPSG:4326", **more: Any) -> Path:
    bands = bands if bands.ndim == 3 else bands[None]
    size = {"width": bands.shape[2], "height": bands.shape[1], "count": len(bands), "dtype": bands.dtype}
    with rasterio.open(path, "w", **{"driver": "GTiff", "crs": crs, "transform": place, **size, **more}) as raster:
        raster.write(bands)
    return path


def assert_plane(path: Path, within_m: float = 0.01) -> None:
    found, outside = sample_heights([path], LON, LAT)
    assert not outside.any()
    np.testing.assert_allclose(found, height_at(LON, LAT), atol=within_m)


def refusal(path: Path) -> str:
    with pytest.raises(ImportFailedError) as error:
        sample_heights([path], LON, LAT)
    assert error.value.field == "dem"
    assert path.name in str(error.value)
    return str(error.value)


@pytest.mark.parametrize("kind", ["int16", "uint16", "int32", "uint32", "float32", "float64"])
def test_every_type_of_number_is_read(tmp_path: Path, kind: str) -> None:
    assert_plane(write(tmp_path / "kind.tif", plane().astype(kind)), 0.01 if kind[0] == "f" else 1.0)


@pytest.mark.parametrize("degrees", [30.0, 90.0, 200.0])
def test_rotated_raster_is_read_at_its_place(tmp_path: Path, degrees: float) -> None:
    cos, sin = CELL * np.cos(np.radians(degrees)), CELL * np.sin(np.radians(degrees))
    middle = Affine(cos, -sin, 8.033 - 85.0 * (cos - sin), sin, cos, 50.527 - 85.0 * (sin + cos))
    assert_plane(write(tmp_path / "turned.tif", plane(middle, rows=170, columns=170).astype(np.float32), middle))


@pytest.mark.parametrize(
    "place",
    [
        Affine(CELL, 0.0, 8.0, 0.0, CELL, 50.5),
        Affine(-CELL, 0.0, 8.0 + COLUMNS * CELL, 0.0, -CELL, 50.55),
        Affine(CELL, 0.0, 368.0, 0.0, -CELL, 50.55),
    ],
    ids=["south up", "west to the right", "0 to 360 degrees"],
)
def test_raster_the_other_way_round_is_read_at_its_place(tmp_path: Path, place: Affine) -> None:
    here = Affine(place.a, 0.0, place.c - 360.0 * (place.c > 180.0), 0.0, place.e, place.f)
    assert_plane(write(tmp_path / "round.tif", plane(here).astype(np.float32), place))


@pytest.mark.parametrize("code", ["EPSG:32632", "EPSG:3857", "EPSG:3035", "EPSG:25832+5783", "EPSG:31467"])
def test_projected_raster_is_read_at_its_place(tmp_path: Path, code: str) -> None:
    crs = CRS.from_user_input(code)
    x, y = transform("EPSG:4326", crs, [8.0, 8.0667, 8.0, 8.0667], [50.5, 50.5, 50.55, 50.55])[:2]
    cell = (max(x) - min(x)) / COLUMNS * 1.1
    place = Affine(cell, 0.0, min(x) - 3 * cell, 0.0, -cell, max(y) + 3 * cell)
    assert_plane(write(tmp_path / "p.tif", plane(place, crs, 90, 110).astype(np.float32), place, crs), 0.05)


@pytest.mark.parametrize("code", ["EPSG:32760", "EPSG:32701", "EPSG:3832"])
def test_projected_raster_over_the_antimeridian_is_read_on_both_sides(tmp_path: Path, code: str) -> None:
    lon, lat = np.array([179.8, 179.95, -179.95, -179.8]), np.array([-17.0, -16.95, -17.02, -16.97])
    crs = CRS.from_user_input(code)
    x, y = transform("EPSG:4326", crs, [179.7, -179.7, 179.7, -179.7], [-17.1, -17.1, -16.9, -16.9])[:2]
    cell = (max(x) - min(x)) / 200.0
    place = Affine(cell, 0.0, min(x) - 3 * cell, 0.0, -cell, max(y) + 3 * cell)
    rows = int((max(y) - min(y)) / cell) + 6
    rise_m = 300.0 + np.arange(206.0) * np.ones((rows, 1))  # a metre a column
    found, outside = sample_heights([write(tmp_path / "fiji.tif", rise_m.astype(np.float32), place, crs)], lon, lat)
    assert not outside.any()
    column = (np.array(transform("EPSG:4326", crs, lon, lat)[0]) - place.c) / cell - 0.5
    np.testing.assert_allclose(found, 300.0 + column, atol=0.01)


@pytest.mark.parametrize(("code", "metres"), [("EPSG:4326+6360", 1200.0 / 3937.0), ("EPSG:4326+8228", 0.3048)])
@pytest.mark.parametrize("version", ["1.0", "1.1"])
def test_vertical_system_in_feet_holds(tmp_path: Path, code: str, metres: float, version: str) -> None:
    heights = (plane() / metres).astype(np.float32)
    crs = CRS.from_user_input(code)
    assert_plane(write(tmp_path / "feet.tif", heights, crs=crs, GEOTIFF_VERSION=version))


@pytest.mark.parametrize("unit", ["[m]", "masl", "unknown", "m a.s.l.", "Meter (EGM2008)"])
def test_units_that_mean_metres_or_nothing_are_read(tmp_path: Path, unit: str) -> None:
    path = write(tmp_path / "unit.tif", plane().astype(np.float32))
    with rasterio.open(path, "r+") as raster:
        raster.units = (unit,)
    assert_plane(path)


@pytest.mark.parametrize("unit", ["1", "degrees", "meters/second", "m^2"])
def test_units_that_are_no_lengths_are_refused(tmp_path: Path, unit: str) -> None:
    path = write(tmp_path / "unit.tif", plane().astype(np.float32))
    with rasterio.open(path, "r+") as raster:
        raster.units = (unit,)
    assert repr(unit) in refusal(path)


@pytest.mark.parametrize("mark", [-np.inf, np.nan, np.finfo(np.float64).min, np.finfo(np.float32).max, -9999.0])
def test_voids_of_real_numbers_are_filled(tmp_path: Path, mark: float) -> None:
    heights = plane()
    heights[20:30, 20:30] = mark
    assert_plane(write(tmp_path / "void.tif", heights), 10.0)


@pytest.mark.parametrize("kind", ["uint16", "float32"])
def test_cells_that_are_transparent_are_voids(tmp_path: Path, kind: str) -> None:
    heights, alpha = plane(), np.full((ROWS, COLUMNS), 255.0)
    heights[20:30, 20:30], alpha[20:30, 20:30] = 150.0, 0.0
    assert_plane(write(tmp_path / "alpha.tif", np.stack((heights, alpha)).astype(kind), alpha="YES"), 10.0)


def test_of_several_bands_the_one_that_is_named_so_holds_the_heights(tmp_path: Path) -> None:
    path = write(tmp_path / "two.tif", np.stack((np.ones((ROWS, COLUMNS)), plane())).astype(np.float32))
    assert "it has 2 bands, of which none are named elevation" in refusal(path)
    with rasterio.open(path, "r+") as raster:
        raster.units = ("", "m")
    assert_plane(path)
    with rasterio.open(path, "r+") as raster:
        raster.descriptions = ("quality", "Elevation")
    assert_plane(path)
    with rasterio.open(path, "r+") as raster:
        raster.descriptions = ("height error", "height")
    assert "2 are named" in refusal(path)


def test_shaded_relief_in_bytes_is_refused_and_low_hills_in_bytes_are_read(tmp_path: Path) -> None:
    column, row = np.meshgrid(np.arange(COLUMNS), np.arange(ROWS))
    wave = 2.0 * np.pi / 22.0  # 2 km
    hills_m = 120.0 + 60.0 * np.sin(wave * column) * np.sin(wave * row)
    assert sample_heights([write(tmp_path / "hills.tif", hills_m.astype(np.uint8))], LON, LAT)[0].max() > 150.0
    rugged_m = np.random.default_rng(0).normal(500.0, 40.0, (ROWS, COLUMNS))
    shade = np.clip(128.0 + 2.0 * np.gradient(rugged_m, axis=1), 0.0, 255.0)
    assert "grey tones" in refusal(write(tmp_path / "shade.tif", shade.astype(np.uint8)))


def test_raster_without_a_place_is_refused(tmp_path: Path) -> None:
    heights = plane().astype(np.float32)
    with pytest.warns(rasterio.errors.NotGeoreferencedWarning):
        path = write(tmp_path / "nowhere.tif", heights, Affine.identity())
    assert "says nowhere where its cells lie" in refusal(path)
    assert "has no coordinate system" in refusal(write(tmp_path / "bare.tif", heights, crs=None))
    site = CRS.from_wkt('LOCAL_CS["building site",UNIT["metre",1]]')
    assert "'building site' is tied to no place" in refusal(write(tmp_path / "site.tif", heights, crs=site))
    far = Affine(CELL, 0.0, 8.0, 0.0, -CELL, 150.0)
    assert "no place on earth" in refusal(write(tmp_path / "far.tif", heights, far))


@pytest.mark.parametrize("shape", [(1, 1), (1, COLUMNS), (ROWS, 1)])
def test_raster_of_a_single_row_or_column_is_refused_with_its_size(tmp_path: Path, shape: tuple[int, int]) -> None:
    path = write(tmp_path / "thin.tif", np.full(shape, 300.0, np.float32))
    assert f"{shape[1]} x {shape[0]} cells, allowed: 2 x 2" in refusal(path)


def test_kinds_are_known_by_content_whatever_their_ending(tmp_path: Path) -> None:
    raster = write(tmp_path / "right.tif", plane().astype(np.float32))
    for name in ("N50E008.hgt", "heights.img", "heights"):
        (tmp_path / name).write_bytes(raster.read_bytes())
        assert_plane(tmp_path / name)
    place = Affine(1.0 / 1200, 0.0, 8.0 - 0.5 / 1200, 0.0, -1.0 / 1200, 51.0 + 0.5 / 1200)
    tile = np.rint(plane(place, rows=1201, columns=1201) + 1000.0).astype(">i2")
    for name in ("N50E008.hgt", "N50E008.tif", "N50E008.dem"):
        (tmp_path / name).write_bytes(tile.tobytes())
        found = sample_heights([tmp_path / name], LON, LAT)[0]
        np.testing.assert_allclose(found, height_at(LON, LAT) + 1000.0, atol=1.0)
    (tmp_path / "N50E008.hgt.gz").write_bytes(gzip.compress(tile.tobytes(), 1))
    found = sample_heights([tmp_path / "N50E008.hgt.gz"], LON, LAT)[0]
    np.testing.assert_allclose(found, height_at(LON, LAT) + 1000.0, atol=1.0)
    (tmp_path / "N50E008.hgt").write_bytes(tile.astype("<i2").tobytes())
    assert "low byte first" in refusal(tmp_path / "N50E008.hgt")


def test_packed_files_of_other_kinds_are_refused_with_what_to_do(tmp_path: Path) -> None:
    raster = write(tmp_path / "right.tif", plane().astype(np.float32))
    (tmp_path / "right.tif.gz").write_bytes(gzip.compress(raster.read_bytes()))
    assert "is a GeoTIFF packed by gzip, allowed: .hgt.gz; unpack it" in refusal(tmp_path / "right.tif.gz")
    (tmp_path / "torn.hgt.gz").write_bytes(gzip.compress(bytes(5000))[:30])
    assert "not a readable gzip file" in refusal(tmp_path / "torn.hgt.gz")
    with zipfile.ZipFile(tmp_path / "right.zip", "w") as archive:
        archive.write(raster, "inside/right.tif")
    assert "holds 0 .hgt files, allowed: 1; unpack inside/right.tif" in refusal(tmp_path / "right.zip")
    (tmp_path / "empty.tif").write_bytes(b"")
    assert "of 0 bytes" in refusal(tmp_path / "empty.tif")


def test_ascii_grid_needs_a_system_beside_it(tmp_path: Path) -> None:
    rows = "\n".join(" ".join(f"{value:.3f}" for value in row) for row in plane())
    for corner, shift in (("corner", 0.0), ("center", CELL / 2.0)):
        path = tmp_path / f"{corner}.asc"
        head = f"ncols {COLUMNS}\nnrows {ROWS}\nxll{corner} {8.0 + shift}\nyll{corner} {50.5 + shift}\n"
        path.write_text(f"{head}cellsize {CELL}\nNODATA_value -9999\n{rows}\n")
        assert "a .prj file beside it" in refusal(path)
        path.with_suffix(".prj").write_text(CRS.from_epsg(4326).to_wkt())
        assert_plane(path, 0.05)


def test_tile_that_touches_a_corner_of_the_map_gives_that_corner(tmp_path: Path) -> None:
    corner = Affine(CELL, 0.0, 8.0, 0.0, -CELL, 50.5125)
    small = write(tmp_path / "corner.tif", (plane(corner) + 40.0).astype(np.float32), corner)
    whole = write(tmp_path / "whole.tif", plane().astype(np.float32))
    found, outside = sample_heights([small, whole], LON, LAT)
    assert not outside.any()
    rise_m = found - height_at(LON, LAT)
    np.testing.assert_allclose(rise_m, np.where(LAT <= 50.5125, 40.0, 0.0), atol=0.9)
    assert "does not cover the map" in refusal(small)
