"""Heights of the terrain from GeoTIFF, .hgt and .hgt.zip files."""

from __future__ import annotations

import lzma
import re
import zipfile
import zlib
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np
import rasterio
from rasterio.enums import ColorInterp
from rasterio.warp import transform, transform_bounds
from scipy.ndimage import distance_transform_edt, gaussian_filter
from scipy.spatial import cKDTree

from routing.errors import ImportFailedError
from routing.graph.earth import METRE_PER_DEGREE
from routing.importers.elevation_cells import (
    HIGHEST_M,
    LOWEST_M,
    decoded_heights,
    metres_per_unit,
    undeclared_voids,
)

if TYPE_CHECKING:
    from collections import Counter
    from collections.abc import Callable, Sequence

    from numpy.typing import NDArray

OUTSIDE_ALLOWED_FRAC: Final = 0.05  # of the points: extracts keep whole ways, which reach past their rim (assumed)
_HGT_NAME = re.compile(r"([NS])(\d{2})([EW])(\d{3})", re.IGNORECASE)
_HGT_VOID: Final = -32768
_LONGEST_HGT: Final = 2 * 3601**2  # bytes
_MAX_CELLS: Final = 600_000_000
UNDECLARED: Final = "elevation_cells_void_undeclared"  # a key of GraphMeta.dropped
FINER_FRAC: Final = 0.9  # where tiles overlap, one whose cells are smaller than this part of the other's is taken
_TOO_HIGH_FRAC: Final = 0.01
_MARKS: Final = 16  # void marks have few values, heights in another unit many (assumed)


@dataclass(frozen=True, slots=True)
class Tile:
    """One elevation raster without voids.

    height_m: float32 (rows, columns) [m], at the centres of cells; crs: its coordinate system, None for lon and lat.
    column_x, column_y, row_x, row_y, origin: inverse affine map, column = origin[0] + column_x·x + column_y·y.
    bounds: west, south, east, north [deg]; void: bool (rows, columns), heights that were filled; None where none was.
    undeclared: how many of them no mark of the file named: blocks of one value with a cliff around.
    """

    name: str
    height_m: NDArray[np.float32]
    crs: str | None
    inverse: tuple[float, float, float, float, float, float]
    bounds: tuple[float, float, float, float]
    void: NDArray[np.bool_] | None
    undeclared: int = 0

    @property
    def void_cells(self) -> int:
        """How many heights were filled."""
        return 0 if self.void is None else int(self.void.sum())

    @property
    def cell_m(self) -> float:
        """Width of a cell from north to south [m]."""
        return float((self.bounds[3] - self.bounds[1]) * METRE_PER_DEGREE / self.height_m.shape[0])

    def sample(self, lon_deg: NDArray[np.float64], lat_deg: NDArray[np.float64]) -> NDArray[np.float64]:
        """Heights by bilinear interpolation, float64 (k,) [m]; NaN more than half a cell outside the cell centres."""
        column, row, inside = self._cells(lon_deg, lat_deg)
        rows, columns = self.height_m.shape
        j, i = np.minimum(column.astype(np.int64), columns - 2), np.minimum(row.astype(np.int64), rows - 2)
        u, v = column - j, row - i
        z = self.height_m
        top = z[i, j] * (1.0 - u) + z[i, j + 1] * u
        bottom = z[i + 1, j] * (1.0 - u) + z[i + 1, j + 1] * u
        return np.where(inside, top * (1.0 - v) + bottom * v, np.nan)

    def measured(self, lon_deg: NDArray[np.float64], lat_deg: NDArray[np.float64]) -> NDArray[np.bool_]:
        """Whether points lie in a cell that has a height of its own, bool (k,)."""
        column, row, inside = self._cells(lon_deg, lat_deg)
        if self.void is None:
            return inside
        return inside & ~self.void[np.rint(row).astype(np.int64), np.rint(column).astype(np.int64)]

    def _cells(
        self, lon_deg: NDArray[np.float64], lat_deg: NDArray[np.float64]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.bool_]]:
        """Columns and rows of points, from the centre of the first cell, and whether they lie within the raster."""
        west, south, east, north = self.bounds
        x, y = np.asarray(lon_deg, np.float64), np.asarray(lat_deg, np.float64)
        if east > 180.0:  # rasters from 0 to 360°, or over the antimeridian
            x = np.where(x < west - 1.0, x + 360.0, x)
        near = (x >= west - 1.0) & (x <= east + 1.0) & (y >= south - 1.0) & (y <= north + 1.0)
        if self.crs is not None:
            xs, ys = np.full(x.size, np.inf), np.full(x.size, np.inf)
            if bool(near.any()):  # far from its region a projection has no place
                xs[near], ys[near] = transform("EPSG:4326", self.crs, x[near], y[near])[:2]
            x, y = np.where(near, xs, 0.0), np.where(near, ys, 0.0)
        a, b, c, d, e, f = self.inverse
        column, row = a * x + b * y + c - 0.5, d * x + e * y + f - 0.5
        rows, columns = self.height_m.shape
        slack = 0.5 + 1e-6
        inside = (
            near & (column >= -slack) & (column <= columns - 1 + slack) & (row >= -slack) & (row <= rows - 1 + slack)
        )
        column = np.clip(np.where(inside, column, 0.0), 0.0, columns - 1.0)
        return column, np.clip(np.where(inside, row, 0.0), 0.0, rows - 1.0), inside


def sample_heights(
    paths: Sequence[Path],
    lon_deg: NDArray[np.float64],
    lat_deg: NDArray[np.float64],
    progress: Callable[[float], None] | None = None,
    dropped: Counter[str] | None = None,
) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """Terrain heights at points, float64 (k,) [m], and which points lie outside all files, bool (k,).

    Points outside take the nearest height, so that smoothing can run; the importer leaves their roads out.
    Tiles are read one after the other. Where they overlap a measured height comes before a filled one, then the finer
    tile, then the first one named. dropped gains UNDECLARED, cells that were voids though no mark said so. Raises
    ImportFailedError when a file is no elevation model, or when more than OUTSIDE_ALLOWED_FRAC of the points lie
    outside all of them.
    """
    height_m, cell_m = np.full(lon_deg.size, np.nan), np.full(lon_deg.size, np.inf)
    measured = np.zeros(lon_deg.size, np.bool_)
    bounds = []
    for count, path in enumerate(paths):
        tile = read_tile(path)
        bounds.append(tile.bounds)
        found_m = tile.sample(lon_deg, lat_deg)
        own = tile.measured(lon_deg, lat_deg)
        finer = (own == measured) & (tile.cell_m < FINER_FRAC * cell_m)
        better = ~np.isnan(found_m) & (np.isnan(height_m) | (own & ~measured) | finer)
        height_m[better], measured[better], cell_m[better] = found_m[better], own[better], tile.cell_m
        if dropped is not None:
            dropped[UNDECLARED] += tile.undeclared
        if progress:
            progress((count + 1) / len(paths))
    outside = np.isnan(height_m)
    share = float(outside.mean())
    if share > OUTSIDE_ALLOWED_FRAC:
        covered = "; ".join(_box(b) for b in bounds)
        here = _box((float(lon_deg.min()), float(lat_deg.min()), float(lon_deg.max()), float(lat_deg.max())))
        raise ImportFailedError(
            "dem",
            ", ".join(path.name for path in paths),
            f"does not cover the map: {100.0 * share:.1f} % of the road points lie outside, "
            f"allowed: {100.0 * OUTSIDE_ALLOWED_FRAC:g} %; the map spans {here}, the elevation model {covered}",
        )
    if bool(outside.any()):
        squeeze = float(np.cos(np.radians(lat_deg.mean())))
        known = cKDTree(np.column_stack((lon_deg[~outside] * squeeze, lat_deg[~outside])))
        nearest = known.query(np.column_stack((lon_deg[outside] * squeeze, lat_deg[outside])))[1]
        height_m[outside] = height_m[~outside][nearest]
    return height_m, outside


def _box(bounds: tuple[float, float, float, float]) -> str:
    west, south, east, north = bounds
    return f"lat {south:.4f}..{north:.4f}, lon {west:.4f}..{east:.4f}"


def read_tile(path: Path) -> Tile:
    """One elevation file; its kind is told by the ending: .hgt, .hgt.zip (or .zip with one .hgt), else GeoTIFF."""
    if not path.is_file():
        raise ImportFailedError("dem", path, "no such file")
    name = path.name.lower()
    if name.endswith(".zip"):
        try:
            with zipfile.ZipFile(path) as archive:
                members = [m for m in archive.namelist() if m.lower().endswith(".hgt")]
                if len(members) != 1:
                    raise ImportFailedError("dem", path, f"holds {len(members)} .hgt files, allowed: 1")
                with archive.open(members[0]) as member:
                    data = member.read(_LONGEST_HGT + 1)  # whatever size it claims
                return _hgt_tile(path, members[0], data)
        except (zipfile.BadZipFile, OSError, EOFError, RuntimeError, ValueError, zlib.error, lzma.LZMAError) as error:
            raise ImportFailedError("dem", path, f"not a readable zip archive ({error})") from error
    if name.endswith(".hgt"):
        with path.open("rb") as file:
            return _hgt_tile(path, path.name, file.read(_LONGEST_HGT + 1))
    return _geotiff_tile(path)


def _hgt_tile(path: Path, name: str, data: bytes) -> Tile:
    """An SRTM tile: big-endian int16 rows from north to south; the name gives the south-west corner."""
    corner = _HGT_NAME.search(Path(name).name) or _HGT_NAME.search(path.name)
    if corner is None:
        raise ImportFailedError("dem", path, f"the name {name} gives no corner, allowed: such as N42E001.hgt")
    size = next((s for s in (1201, 3601) if len(data) == 2 * s * s), None)
    if size is None:
        found = f"{len(data)} bytes" if len(data) <= _LONGEST_HGT else f"more than {_LONGEST_HGT} bytes"
        raise ImportFailedError(
            "dem", path, f"{found}, allowed: {2 * 1201**2} (1201 x 1201) or {2 * 3601**2} (3601 x 3601)"
        )
    south = float(corner[2]) * (1.0 if corner[1].upper() == "N" else -1.0)
    west = float(corner[4]) * (1.0 if corner[3].upper() == "E" else -1.0)
    raw = np.frombuffer(data, ">i2").reshape(size, size)
    cell_m = METRE_PER_DEGREE / size
    height_m, void, undeclared = _filled(path, raw.astype(np.float32), raw == _HGT_VOID, cell_m)
    scale = float(size - 1)  # samples lie on the tile's edges, cell centres in the terms of Tile: hence the half
    inverse = (scale, 0.0, -west * scale + 0.5, 0.0, -scale, (south + 1.0) * scale + 0.5)
    return Tile(path.name, height_m, None, inverse, (west, south, west + 1.0, south + 1.0), void, undeclared)


def _geotiff_tile(path: Path) -> Tile:
    try:
        with rasterio.open(path) as raster:
            if raster.crs is None:
                raise ImportFailedError("dem", path, "has no coordinate system, needed: such as EPSG:4326")
            if raster.width * raster.height > _MAX_CELLS or min(raster.width, raster.height) < 2:
                raise ImportFailedError(
                    "dem", path, f"{raster.width} x {raster.height} cells, allowed: 2 x 2 to {_MAX_CELLS:.0e} cells"
                )
            inverse = ~raster.transform
            crs = None if raster.crs.to_epsg() == 4326 else raster.crs.to_wkt()
            bounds = transform_bounds(raster.crs, "EPSG:4326", *raster.bounds)
            cell_m = (bounds[3] - bounds[1]) * METRE_PER_DEGREE / raster.height
            height, masked = _heights(path, raster, cell_m)
    except ImportFailedError:
        raise
    except Exception as error:  # what rasterio raises for GDAL's errors has no public base
        raise ImportFailedError("dem", path, f"not a readable raster ({error})") from error
    height_m, void, undeclared = _filled(path, height, masked, cell_m)
    return Tile(path.name, height_m, crs, tuple(inverse)[:6], bounds, void, undeclared)


def _heights(path: Path, raster: Any, cell_m: float) -> tuple[NDArray[np.float32], NDArray[np.bool_]]:
    """Heights of a raster [m] and which its file marks as void: float32 and bool (rows, columns)."""
    coloured = {ColorInterp.red, ColorInterp.green, ColorInterp.blue} <= set(raster.colorinterp)
    if raster.count in (3, 4) and set(raster.dtypes) == {"uint8"}:
        height_m = decoded_heights(path, raster.read(), cell_m)
        return height_m, np.isnan(height_m)
    if coloured or ColorInterp.palette in raster.colorinterp:
        kind = "colours" if coloured else "colours of a palette"
        raise ImportFailedError("dem", path, f"its bands are {kind} and no heights, allowed: one band of heights")
    if np.dtype(raster.dtypes[0]).kind not in "iuf":
        raise ImportFailedError("dem", path, f"its band is of type {raster.dtypes[0]}, allowed: whole or real numbers")
    raw = raster.read(1, masked=True)
    unit = raster.units[0] or raster.tags(1).get("units") or raster.tags(1).get("UNITTYPE")
    metres = metres_per_unit(path, unit, raster.crs.to_wkt())
    height_m = np.asarray(raw.data, np.float32) * np.float32(raster.scales[0]) + np.float32(raster.offsets[0])
    return height_m * np.float32(metres), np.ma.getmaskarray(raw)


def _filled(
    path: Path, height_m: NDArray[np.float32], void: NDArray[np.bool_], cell_m: float
) -> tuple[NDArray[np.float32], NDArray[np.bool_] | None, int]:
    """Heights with voids filled: the nearest known height, then blurred inside the void by its own depth; which.

    The number is that of cells which no mark names as void, see undeclared_voids.
    """
    with np.errstate(invalid="ignore"):
        high = ~void & np.isfinite(height_m) & (height_m > HIGHEST_M)
        void = void | ~np.isfinite(height_m) | (height_m < LOWEST_M) | (height_m > HIGHEST_M)
    _refuse_too_high(path, height_m, high)
    suspect = undeclared_voids(height_m, void, cell_m)
    undeclared = 0 if suspect is None else int(suspect.sum())
    if suspect is not None and undeclared + int(void.sum()) < height_m.size:
        void = void | suspect
    count = int(void.sum())
    if count == 0:
        return height_m, None, 0
    if count == height_m.size:
        raise ImportFailedError("dem", path, f"all {count} cells are void or outside {LOWEST_M:g}..{HIGHEST_M:g} m")
    depth, nearest = distance_transform_edt(void, return_indices=True)
    filled = np.where(void, height_m[tuple(nearest)], height_m).astype(np.float32)
    for _ in range(3):  # takes away the seams between regions of nearest heights
        blurred = gaussian_filter(filled, sigma=min(float(depth.max()), 20.0) / 2.0 + 0.5)
        filled = np.where(void, blurred, filled).astype(np.float32)
    return filled, void, undeclared


def _refuse_too_high(path: Path, height_m: NDArray[np.float32], high: NDArray[np.bool_]) -> None:
    """Raise where heights above the highest are many and of many values, which no mark for voids is."""
    count = int(high.sum())
    if count <= _TOO_HIGH_FRAC * height_m.size or np.unique(height_m[high][:: max(count // 4096, 1)]).size <= _MARKS:
        return
    raise ImportFailedError(
        "dem",
        path,
        f"{100.0 * count / height_m.size:.1f} % of its cells lie above {HIGHEST_M:g} m, up to "
        f"{float(height_m[high].max()):g}: not in metres, or no heights; allowed: {LOWEST_M:g}..{HIGHEST_M:g} m",
    )
