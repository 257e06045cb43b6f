"""Large elevation rasters: only what a map needs of them is read, and that is the same as of a small one."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import rasterio
from rasterio import Affine
from rasterio.windows import Window

from routing.errors import ImportFailedError
from routing.importers.heights.elevation import read_tile, sample_heights

MEASURE = """
import resource, sys
from pathlib import Path
import numpy as np
from routing.importers.heights.elevation import sample_heights
before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
height_m, outside = sample_heights([Path(sys.argv[1])], np.linspace(1.0, 1.5, 999), np.linspace(42.0, 42.3, 999))
assert not outside.any()
print(float(height_m.max()), (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before) / 1024.0)
"""


def sparse(path: Path, cells: int, **more: Any) -> Path:
    """A GeoTIFF of 4 by 4 degrees from 40° N 0° E, of which nothing is written."""
    form: dict[str, Any] = {"compress": "deflate", "tiled": True, "blockxsize": 512, "blockysize": 512, **more}
    place = Affine(4.0 / cells, 0.0, 0.0, 0.0, -4.0 / cells, 44.0)
    shape: dict[str, Any] = {"width": cells, "height": cells, "count": 1, "dtype": "float32", "crs": "EPSG:4326"}
    with rasterio.open(path, "w", driver="GTiff", transform=place, SPARSE_OK=True, **shape, **form):
        pass
    return path


def test_small_map_of_a_large_raster_takes_little_memory(tmp_path: Path) -> None:
    path = sparse(tmp_path / "sparse.tif", 20_000)
    # a cell is 0.0002°; a hill of 256 m in one tile of 512 cells, at 1.024..1.126° E, 41.952..42.054° N
    rise_m = 255.5 - np.abs(np.arange(512) - 255.5)
    hill_m = np.minimum(rise_m, rise_m[:, None]).astype(np.float32)
    with rasterio.open(path, "r+") as raster:
        raster.write(hill_m[None], window=Window(5120, 9728, 512, 512))
    done = subprocess.run([sys.executable, "-c", MEASURE, str(path)], capture_output=True, text=True, check=True)
    highest_m, taken_mb = map(float, done.stdout.split())
    assert 100.0 < highest_m <= 255.5
    assert taken_mb < 350.0  # as a whole: 1600 MB of heights alone


def test_map_that_needs_too_many_cells_is_refused_with_the_size_of_the_file_and_the_limit(tmp_path: Path) -> None:
    path = sparse(tmp_path / "huge.tif", 30_000)
    lon, lat = (axis.ravel() for axis in np.meshgrid(np.linspace(0.01, 3.99, 50), np.linspace(40.01, 43.99, 50)))
    with pytest.raises(ImportFailedError, match=r"huge\.tif: 30000 x 30000 cells, .* needs \d+, allowed: 600000000"):
        sample_heights([path], lon, lat)
    assert sample_heights([path], lon[:3], lat[:3])[0].tolist() == [0.0, 0.0, 0.0]


def test_raster_that_is_unpacked_as_a_whole_only_is_refused_where_it_is_large(tmp_path: Path) -> None:
    path = sparse(tmp_path / "strip.tif", 20_000, tiled=False, blockxsize=None, blockysize=20_000)
    with pytest.raises(ImportFailedError, match=r"strip\.tif: 20000 x 20000 cells in parts of 20000 x 20000, allowed"):
        sample_heights([path], np.array([1.0]), np.array([42.0]))


def test_heights_in_parts_are_those_of_the_whole(tmp_path: Path) -> None:
    rows, columns = 40, 3800
    height_m = np.random.default_rng(3).uniform(0.0, 20.0, (rows, columns)).astype(np.float32)
    place = Affine(0.001, 0.0, 5.0, 0.0, -0.001, 46.0)
    shape: dict[str, Any] = {"width": columns, "height": rows, "count": 1, "dtype": "float32", "crs": "EPSG:4326"}
    with rasterio.open(tmp_path / "wide.tif", "w", driver="GTiff", transform=place, **shape) as raster:
        raster.write(height_m, 1)
    # at the centres of cells, on both sides of where parts meet, and half-way between centres
    column = np.concatenate((np.arange(0.0, 3800.0, 7.0), np.arange(3690.0, 3709.0, 0.5)))
    row = (np.arange(column.size) % (rows - 1)).astype(float)
    found, outside = sample_heights([tmp_path / "wide.tif"], 5.0005 + 0.001 * column, 45.9995 - 0.001 * row)
    low, share = np.floor(column).astype(int), column % 1.0
    high = np.minimum(low + 1, columns - 1)
    at = row.astype(int)
    expected = height_m[at, low] * (1.0 - share) + height_m[at, high] * share
    assert not outside.any()
    np.testing.assert_allclose(found, expected, atol=1e-4)
    np.testing.assert_allclose(
        found, read_tile(tmp_path / "wide.tif").sample(5.0005 + 0.001 * column, 45.9995 - 0.001 * row)
    )
