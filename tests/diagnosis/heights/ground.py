"""Elevation files and drives over them, whose heights are known."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import rasterio
from rasterio import Affine

from diagnosis.recordings.reading import Recording
from routing.graph.earth import METRE_PER_DEGREE

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from numpy.typing import NDArray

LAT_DEG, LON_DEG = 48.0, 11.0
EAST_M = METRE_PER_DEGREE * np.cos(np.radians(LAT_DEG))
CELL_DEG = 0.0004  # 44 m from north to south
ROWS, COLUMNS = 51, 401  # 12 km from west to east


def write_ground(
    path: Path, hill: Callable[[NDArray[np.float64]], NDArray[np.float64]], *, void: slice | None = None
) -> Path:
    """A GeoTIFF of a ground whose height hangs on the metres east of LON_DEG alone; void: columns without height."""
    east_m = (np.arange(COLUMNS) + 0.5) * CELL_DEG * EAST_M
    height_m = np.tile(hill(east_m), (ROWS, 1)).astype(np.float32)
    if void is not None:
        height_m[:, void] = -9999.0
    transform = Affine(CELL_DEG, 0.0, LON_DEG, 0.0, -CELL_DEG, LAT_DEG + 0.5 * ROWS * CELL_DEG)
    shape = {"width": COLUMNS, "height": ROWS, "count": 1, "dtype": "float32"}
    with rasterio.open(path, "w", driver="GTiff", crs="EPSG:4326", transform=transform, nodata=-9999.0, **shape) as new:
        new.write(height_m, 1)
    return path


def eastward(way_m: float = 8000.0, speed_mps: float = 20.0, step_s: float = 1.0, **more: Any) -> Recording:
    """A drive from 1 km east of LON_DEG on, at one speed, with positions and without height."""
    time_s = np.arange(0.0, way_m / speed_mps + step_s, step_s)
    east_m = 1000.0 + speed_mps * time_s
    channels: dict[str, Any] = {
        "speed_mps": np.full(time_s.size, speed_mps),
        "power_w": np.full(time_s.size, 5000.0),
        "latitude_deg": np.full(time_s.size, LAT_DEG),
        "longitude_deg": LON_DEG + east_m / EAST_M,
    }
    return Recording(id="east", time_s=time_s, **{**channels, **more})


def east_of(recording: Recording) -> NDArray[np.float64]:
    """Metres east of LON_DEG by a speed that never changes, float64 (n,)."""
    return 1000.0 + float(recording.speed_mps[0]) * recording.time_s
