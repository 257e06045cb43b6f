"""Made-up elevation over a map, for maps that come without: smooth hills, the same for the same seed."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

import numpy as np
import osmium
import rasterio
from rasterio import Affine

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import NDArray

CELL_DEG: Final = 1.0 / 3600.0  # 1″, as the finest free elevation models have
MARGIN_DEG: Final = 0.1  # extracts keep whole ways, which reach past their rim
WAVES: Final = 48
SHORTEST_M: Final = 1000.0
LONGEST_M: Final = 5000.0
HIGHEST_M: Final = 300.0
METRE_PER_DEG: Final = 111_195.0


def map_bounds(map_path: Path) -> tuple[float, float, float, float]:
    """West, south, east, north [deg] as the map file's header says; ValueError where it says nothing."""
    box = osmium.io.Reader(str(map_path)).header().box()
    if not box.valid():
        raise ValueError(f"{map_path.name} has no bounding box in its header")
    low, high = box.bottom_left, box.top_right
    return low.lon, low.lat, high.lon, high.lat


def hills_m(
    bounds: tuple[float, float, float, float], rng: np.random.Generator
) -> tuple[NDArray[np.float32], tuple[float, float]]:
    """Heights float32 (rows, columns) [m] in 0..300 from north to south, and the north-west corner, lon and lat [deg].

    A sum of plane waves of 1 to 5 km in random directions, longer ones higher in proportion.
    """
    west, south, east, north = bounds
    west, south, east, north = west - MARGIN_DEG, south - MARGIN_DEG, east + MARGIN_DEG, north + MARGIN_DEG
    columns, rows = math.ceil((east - west) / CELL_DEG), math.ceil((north - south) / CELL_DEG)
    squeeze = math.cos(math.radians(0.5 * (south + north)))
    x = (np.arange(columns, dtype=np.float64) + 0.5) * CELL_DEG * METRE_PER_DEG * squeeze
    y = (np.arange(rows, dtype=np.float64) + 0.5) * CELL_DEG * METRE_PER_DEG
    height = np.zeros((rows, columns))
    for _ in range(WAVES):
        wavelength = SHORTEST_M * (LONGEST_M / SHORTEST_M) ** rng.random()
        direction, phase = rng.uniform(0.0, 2.0 * math.pi, 2)
        number = 2.0 * math.pi / wavelength
        # cos(a + b) from the cosines and sines of the rows and of the columns
        a, b = number * math.cos(direction) * x + phase, number * math.sin(direction) * y
        height += wavelength * (np.outer(np.cos(b), np.cos(a)) - np.outer(np.sin(b), np.sin(a)))
    height -= height.min()
    height *= HIGHEST_M / height.max()
    return height.astype(np.float32), (west, north)


def write_hills(map_path: Path, out: Path, seed: int) -> None:
    """Write a GeoTIFF of made-up hills that covers a map."""
    height, (west, north) = hills_m(map_bounds(map_path), np.random.default_rng(seed))
    with rasterio.open(
        out,
        "w",
        driver="GTiff",
        width=height.shape[1],
        height=height.shape[0],
        count=1,
        dtype="float32",
        crs="EPSG:4326",
        transform=Affine(CELL_DEG, 0.0, west, 0.0, -CELL_DEG, north),
        compress="deflate",
    ) as raster:
        raster.write(height, 1)
