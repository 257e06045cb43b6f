"""Heights of the terrain from GeoTIFF, .hgt and .hgt.zip files."""

from __future__ import annotations

import gzip
import itertools
import lzma
import math
import re
import zipfile
import zlib
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np
import rasterio
from rasterio.enums import ColorInterp
from rasterio.errors import RasterioIOError
from rasterio.warp import transform, transform_bounds
from rasterio.windows import Window
from scipy.ndimage import distance_transform_edt, gaussian_filter
from scipy.spatial import cKDTree

from routing.errors import ImportFailedError
from routing.graph.earth import METRE_PER_DEGREE
from routing.importers.heights.cells import (
    HIGHEST_M,
    LOWEST_M,
    decoded_heights,
    metres_per_unit,
    refuse_shaded,
    undeclared_voids,
)

if TYPE_CHECKING:
    from collections import Counter
    from collections.abc import Callable, Iterator, Sequence

    from numpy.typing import NDArray

OUTSIDE_ALLOWED_FRAC: Final = 0.05  # of the points: extracts keep whole ways, which reach past their rim (assumed)
_HGT_NAME = re.compile(r"([NS])(\d{2})([EW])(\d{3})", re.IGNORECASE)
_HGT_VOID: Final = -32768
_HGT_SIZES: Final = (1201, 3601)
_HEIGHT_NAME: Final = re.compile(r"elev|height|altitude|\b(?:dem|dtm|dsm|z)\b", re.IGNORECASE)
_TIFF: Final = (b"II*\0", b"MM\0*", b"II+\0", b"MM\0+")
_LONGEST_HGT: Final = 2 * 3601**2  # bytes
_MAX_CELLS: Final = 600_000_000  # decoded for one map
_BLOCK: Final = 3700  # cells along a side that are looked at together: a degree by seconds in one
_MARGIN: Final = 128  # cells around those that a map needs: what fills a void is seldom farther off (assumed)
_MAX_PACKED_BYTES: Final = 1 << 28  # of one tile or strip of a file, which is unpacked as a whole
_CACHE_MB: Final = 64
UNDECLARED: Final = "elevation_cells_void_undeclared"  # a key of GraphMeta.dropped
FINER_FRAC: Final = 0.9  # where tiles overlap, one whose cells are smaller than this part of the other's is taken
_TOO_HIGH_FRAC: Final = 0.01
_MARKS: Final = 16  # void marks have few values, heights in another unit many (assumed)

Bounds = tuple[float, float, float, float]


@dataclass(frozen=True, slots=True)
class Placement:
    """Where the cells of a raster lie.

    rows, columns: its size; crs: its coordinate system, None for lon and lat. inverse: affine map from there to cells,
    column = a·x + b·y + c, row = d·x + e·y + f. bounds: west, south, east, north [deg]. cell_m: length of a step from
    row to row [m].
    """

    rows: int
    columns: int
    crs: str | None
    inverse: tuple[float, float, float, float, float, float]
    bounds: tuple[float, float, float, float]
    cell_m: float

    def cells(
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
        slack = 0.5 + 1e-6
        inside = (
            near
            & (column >= -slack)
            & (column <= self.columns - 1 + slack)
            & (row >= -slack)
            & (row <= self.rows - 1 + slack)
        )
        column = np.clip(np.where(inside, column, 0.0), 0.0, self.columns - 1.0)
        return column, np.clip(np.where(inside, row, 0.0), 0.0, self.rows - 1.0), inside

    def part(self, window: Window) -> Placement:
        """The same of some of the cells."""
        a, b, c, d, e, f = self.inverse
        inverse = a, b, c - window.col_off, d, e, f - window.row_off
        return replace(self, rows=int(window.height), columns=int(window.width), inverse=inverse)


@dataclass(frozen=True, slots=True)
class Tile:
    """Cells of one elevation raster without voids.

    height_m: float32 (rows, columns) [m], at the centres of cells; place: where these lie, but for its bounds, which
    are those of the whole raster. void: bool (rows, columns), heights that were filled; None where none was.
    undeclared: how many of them no mark of the file named: blocks of one value with a cliff around.
    """

    name: str
    height_m: NDArray[np.float32]
    place: Placement
    void: NDArray[np.bool_] | None
    undeclared: int = 0

    @property
    def bounds(self) -> tuple[float, float, float, float]:
        """West, south, east, north of the raster [deg]."""
        return self.place.bounds

    @property
    def void_cells(self) -> int:
        """How many heights were filled."""
        return 0 if self.void is None else int(self.void.sum())

    @property
    def cell_m(self) -> float:
        """Width of a cell from north to south [m]."""
        return self.place.cell_m

    def sample(self, lon_deg: NDArray[np.float64], lat_deg: NDArray[np.float64]) -> NDArray[np.float64]:
        """Heights by bilinear interpolation, float64 (k,) [m]; NaN more than half a cell outside the cell centres."""
        column, row, inside = self.place.cells(lon_deg, lat_deg)
        rows, columns = self.height_m.shape
        j, i = np.minimum(column.astype(np.int64), columns - 2), np.minimum(row.astype(np.int64), rows - 2)
        u, v = column - j, row - i
        z = self.height_m
        top = z[i, j] * (1.0 - u) + z[i, j + 1] * u
        bottom = z[i + 1, j] * (1.0 - u) + z[i + 1, j + 1] * u
        return np.where(inside, top * (1.0 - v) + bottom * v, np.nan)

    def measured(self, lon_deg: NDArray[np.float64], lat_deg: NDArray[np.float64]) -> NDArray[np.bool_]:
        """Whether points lie in a cell that has a height of its own, bool (k,)."""
        column, row, inside = self.place.cells(lon_deg, lat_deg)
        if self.void is None:
            return inside
        return inside & ~self.void[np.rint(row).astype(np.int64), np.rint(column).astype(np.int64)]


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
        extent, tiles = tiles_at(path, lon_deg, lat_deg)
        bounds.append(extent)
        for tile, at in tiles:
            found_m = tile.sample(lon_deg[at], lat_deg[at])
            own = tile.measured(lon_deg[at], lat_deg[at])
            finer = (own == measured[at]) & (tile.cell_m < FINER_FRAC * cell_m[at])
            better = ~np.isnan(found_m) & (np.isnan(height_m[at]) | (own & ~measured[at]) | finer)
            chosen = at[better]
            height_m[chosen], measured[chosen], cell_m[chosen] = found_m[better], own[better], tile.cell_m
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


def tiles_at(
    path: Path, lon_deg: NDArray[np.float64], lat_deg: NDArray[np.float64]
) -> tuple[Bounds, Iterator[tuple[Tile, NDArray[np.int64]]]]:
    """The bounds of an elevation file, and its parts one after the other, each with the points in it, int64 (k,).

    Of a raster only the cells that points lie in are read, with a margin of _MARGIN cells. So a void is filled, and
    found where no mark declares it, by what lies in its part. Raises ImportFailedError as read_tile, also while the
    parts are read, and where they have more than _MAX_CELLS cells.
    """
    data = _hgt_data(path)
    if data is None:
        place = _placement(path)
        return place.bounds, _raster_tiles(path, place, lon_deg, lat_deg)
    tile = _hgt_tile(path, *data)
    return tile.bounds, iter([(tile, np.flatnonzero(tile.place.cells(lon_deg, lat_deg)[2]))])


def read_tile(path: Path) -> Tile:
    """One elevation file as a whole; its kind is told by its content: .hgt, packed by zip or gzip, or GeoTIFF.

    Raises ImportFailedError where it is no elevation model, and for a raster of more than _BLOCK² cells.
    """
    data = _hgt_data(path)
    if data is not None:
        return _hgt_tile(path, *data)
    place = _placement(path)
    whole = Window(0, 0, place.columns, place.rows)
    _check_cells(path, place, place.rows * place.columns, _BLOCK**2)
    tile = _raster_part(path, place, whole)
    if tile is None:
        count = place.rows * place.columns
        raise ImportFailedError("dem", path, f"all {count} cells are void or outside {LOWEST_M:g}..{HIGHEST_M:g} m")
    return tile


def _hgt_data(path: Path) -> tuple[str, bytes] | None:
    """Name and content of an .hgt file, packed or not; None for what GDAL has to read."""
    if not path.is_file():
        raise ImportFailedError("dem", path, "no such file")
    with path.open("rb") as file:
        head = file.read(4)
        if head == b"PK\x03\x04":
            return _zipped(path)
        if head[:2] == b"\x1f\x8b":
            return _gzipped(path)
        name = path.name.lower()
        if head in _TIFF or not (name.endswith(".hgt") or (_HGT_NAME.search(name) and _is_hgt_size(path))):
            if name.endswith(".zip"):
                raise ImportFailedError("dem", path, "not a readable zip archive (File is not a zip file)")
            return None
        return path.name, head + file.read(_LONGEST_HGT + 1 - len(head))


def _is_hgt_size(path: Path) -> bool:
    return path.stat().st_size in [2 * size**2 for size in _HGT_SIZES]


def _zipped(path: Path) -> tuple[str, bytes]:
    try:
        with zipfile.ZipFile(path) as archive:
            members = [m for m in archive.namelist() if m.lower().endswith(".hgt")]
            if len(members) != 1:
                rasters = [m for m in archive.namelist() if m.lower().endswith((".tif", ".tiff"))]
                hint = f"; unpack {rasters[0]}" if rasters else ""
                raise ImportFailedError("dem", path, f"holds {len(members)} .hgt files, allowed: 1{hint}")
            with archive.open(members[0]) as member:
                return members[0], member.read(_LONGEST_HGT + 1)  # whatever size it claims
    except (zipfile.BadZipFile, OSError, EOFError, RuntimeError, ValueError, zlib.error, lzma.LZMAError) as error:
        raise ImportFailedError("dem", path, f"not a readable zip archive ({error})") from error


def _gzipped(path: Path) -> tuple[str, bytes]:
    try:
        with gzip.open(path) as member:
            data = member.read(_LONGEST_HGT + 1)
    except (OSError, EOFError, zlib.error) as error:
        raise ImportFailedError("dem", path, f"not a readable gzip file ({error})") from error
    if len(data) not in [2 * size**2 for size in _HGT_SIZES] and not path.name.lower().endswith(".hgt.gz"):
        kind = "a GeoTIFF" if data[:4] in _TIFF else "something else than .hgt"
        raise ImportFailedError("dem", path, f"is {kind} packed by gzip, allowed: .hgt.gz; unpack it")
    return path.name, data


def _hgt_tile(path: Path, name: str, data: bytes) -> Tile:
    """An SRTM tile: big-endian int16 rows from north to south; the name gives the south-west corner."""
    corner = _HGT_NAME.search(Path(name).name) or _HGT_NAME.search(path.name)
    if corner is None:
        raise ImportFailedError("dem", path, f"the name {name} gives no corner, allowed: such as N42E001.hgt")
    size = next((s for s in _HGT_SIZES if len(data) == 2 * s * s), None)
    if size is None:
        found = f"{len(data)} bytes" if len(data) <= _LONGEST_HGT else f"more than {_LONGEST_HGT} bytes"
        raise ImportFailedError(
            "dem", path, f"{found}, allowed: {2 * 1201**2} (1201 x 1201) or {2 * 3601**2} (3601 x 3601)"
        )
    south = float(corner[2]) * (1.0 if corner[1].upper() == "N" else -1.0)
    west = float(corner[4]) * (1.0 if corner[3].upper() == "E" else -1.0)
    raw = np.frombuffer(data, ">i2").reshape(size, size)
    if _impossible_frac(raw) > _TOO_HIGH_FRAC >= _impossible_frac(raw.view("<i2")):
        reason = "its numbers have the low byte first, allowed: the high byte first, as SRTM has them"
        raise ImportFailedError("dem", path, reason)
    cell_m = METRE_PER_DEGREE / size
    filled = _filled(path, raw.astype(np.float32), raw == _HGT_VOID, cell_m)
    if filled is None:
        raise ImportFailedError(
            "dem", path, f"all {size * size} cells are void or outside {LOWEST_M:g}..{HIGHEST_M:g} m"
        )
    height_m, void, undeclared = filled
    scale = float(size - 1)  # samples lie on the tile's edges, cell centres in the terms of Tile: hence the half
    inverse = (scale, 0.0, -west * scale + 0.5, 0.0, -scale, (south + 1.0) * scale + 0.5)
    place = Placement(size, size, None, inverse, (west, south, west + 1.0, south + 1.0), cell_m)
    return Tile(path.name, height_m, place, void, undeclared)


def _impossible_frac(height_m: NDArray[np.int16]) -> float:
    """Which part of an .hgt tile's heights can be none, 0..1."""
    known = height_m[height_m != _HGT_VOID]
    return float(np.mean((known < LOWEST_M) | (known > HIGHEST_M))) if known.size else 0.0


def _placement(path: Path) -> Placement:
    """Where the cells of a raster lie, and whether it can be read in parts."""
    with _opened(path) as raster:
        if raster.crs is None:
            reason = "has no coordinate system, needed: such as EPSG:4326; of a grid without one a .prj file beside it"
            raise ImportFailedError("dem", path, reason)
        if min(raster.width, raster.height) < 2:
            raise ImportFailedError("dem", path, f"{raster.width} x {raster.height} cells, allowed: 2 x 2 and more")
        packed_bytes = max(
            rows * columns * np.dtype(kind).itemsize
            for (rows, columns), kind in zip(raster.block_shapes, raster.dtypes, strict=True)
        )
        if packed_bytes > _MAX_PACKED_BYTES:
            rows, columns = raster.block_shapes[0]
            raise ImportFailedError(
                "dem",
                path,
                f"{raster.width} x {raster.height} cells in parts of {columns} x {rows}, allowed: parts of "
                f"{_MAX_PACKED_BYTES >> 20} MB; write it in tiles (gdal_translate -co TILED=YES)",
            )
        place = raster.transform
        if place.is_identity:
            raise ImportFailedError("dem", path, "says nowhere where its cells lie, needed: their size and a corner")
        corners = list(itertools.product((0, raster.width), (0, raster.height)))
        xs = [place.a * column + place.b * row + place.c for column, row in corners]
        ys = [place.d * column + place.e * row + place.f for column, row in corners]
        west, south, east, north = min(xs), min(ys), max(xs), max(ys)
        try:
            bounds = transform_bounds(raster.crs, "EPSG:4326", west, south, east, north)
        except Exception as error:  # as in _opened
            name = raster.crs.to_wkt().partition('"')[2].partition('"')[0]
            reason = f"its coordinate system {name!r} is tied to no place on earth, allowed: such as EPSG:4326"
            raise ImportFailedError("dem", path, reason) from error
        if not all(map(math.isfinite, bounds)) or bounds[1] < -91.0 or bounds[3] > 91.0 or not place.determinant:
            reason = (
                f"spans {west:g}..{east:g}, {south:g}..{north:g} in its coordinate system, which is no place on earth"
            )
            raise ImportFailedError("dem", path, reason)
        if bounds[0] > bounds[2]:  # over the antimeridian
            bounds = (bounds[0], bounds[1], bounds[2] + 360.0, bounds[3])
        share = math.hypot(place.b, place.e) / (north - south)  # of a step from row to row in the height of the whole
        return Placement(
            rows=raster.height,
            columns=raster.width,
            crs=None if raster.crs.to_epsg() == 4326 else raster.crs.to_wkt(),
            inverse=tuple(~place)[:6],
            bounds=bounds,
            cell_m=(bounds[3] - bounds[1]) * METRE_PER_DEGREE * share,
        )


@contextmanager
def _opened(path: Path) -> Iterator[Any]:
    """A raster, whose errors are refusals."""
    try:
        with rasterio.Env(GDAL_CACHEMAX=_CACHE_MB), rasterio.open(path) as raster:
            yield raster
    except ImportFailedError:
        raise
    except RasterioIOError as error:
        size = path.stat().st_size
        kinds = "GeoTIFF and other rasters of GDAL, .hgt, .hgt.gz or .hgt.zip"
        reason = f"not a readable raster of {size} bytes ({error}), allowed: {kinds}"
        raise ImportFailedError("dem", path, reason) from error
    except Exception as error:  # what rasterio raises for GDAL's errors has no public base
        raise ImportFailedError("dem", path, f"not a readable raster ({error})") from error


def _check_cells(path: Path, place: Placement, count: int, most: int) -> None:
    if count > most:
        raise ImportFailedError(
            "dem",
            path,
            f"{place.columns} x {place.rows} cells, of which the map needs {count}, allowed: {most}; give a "
            "coarser one, or one in several files",
        )


def _raster_tiles(
    path: Path, place: Placement, lon_deg: NDArray[np.float64], lat_deg: NDArray[np.float64]
) -> Iterator[tuple[Tile, NDArray[np.int64]]]:
    """The parts of a raster that points lie in, with these points."""
    column, row, inside = place.cells(lon_deg, lat_deg)
    at = np.flatnonzero(inside)
    block = (row[at] // _BLOCK).astype(np.int64) * (place.columns // _BLOCK + 1) + (column[at] // _BLOCK).astype(
        np.int64
    )
    parts = []
    for number in np.unique(block):
        chosen = at[block == number]
        spans = []
        for cell, size in ((row[chosen], place.rows), (column[chosen], place.columns)):
            first = max(int(cell.min()) - _MARGIN, 0)
            spans.append((first, min(int(cell.max()) + 2 + _MARGIN, size)))
        parts.append((Window.from_slices(*spans), chosen))
    _check_cells(path, place, sum(int(window.height * window.width) for window, _ in parts), _MAX_CELLS)
    empty = 0
    for window, chosen in parts:
        tile = _raster_part(path, place, window)
        if tile is None:
            empty += int(window.height * window.width)
        else:
            yield tile, chosen
    if empty and empty == sum(int(window.height * window.width) for window, _ in parts):
        raise ImportFailedError("dem", path, f"all {empty} cells are void or outside {LOWEST_M:g}..{HIGHEST_M:g} m")


def _raster_part(path: Path, place: Placement, window: Window) -> Tile | None:
    """Cells of a raster, None where all are void."""
    with _opened(path) as raster:
        height_m, masked = _heights(path, raster, window, place.cell_m)
    filled = _filled(path, height_m, masked, place.cell_m)
    return None if filled is None else Tile(path.name, filled[0], place.part(window), filled[1], filled[2])


def _heights(path: Path, raster: Any, window: Window, cell_m: float) -> tuple[NDArray[np.float32], NDArray[np.bool_]]:
    """Heights of cells of a raster [m] and which its file marks as void: float32 and bool (rows, columns)."""
    coloured = {ColorInterp.red, ColorInterp.green, ColorInterp.blue} <= set(raster.colorinterp)
    if raster.count in (3, 4) and set(raster.dtypes) == {"uint8"}:
        height_m = decoded_heights(path, raster.read(window=window), cell_m)
        return height_m, np.isnan(height_m)
    if coloured or ColorInterp.palette in raster.colorinterp:
        kind = "colours" if coloured else "colours of a palette"
        raise ImportFailedError("dem", path, f"its bands are {kind} and no heights, allowed: one band of heights")
    band = _height_band(path, raster)
    number_type = raster.dtypes[band - 1]
    if np.dtype(number_type).kind not in "iuf":
        raise ImportFailedError("dem", path, f"its band is of type {number_type}, allowed: whole or real numbers")
    raw = raster.read(band, masked=True, window=window)
    unit = raster.units[band - 1] or raster.tags(band).get("units") or raster.tags(band).get("UNITTYPE")
    scale, offset = raster.scales[band - 1], raster.offsets[band - 1]
    if number_type == "uint8" and not unit and (scale, offset) == (1.0, 0.0):
        refuse_shaded(path, raw, cell_m)
    metres = metres_per_unit(path, unit, raster.crs.to_wkt())
    with np.errstate(over="ignore", invalid="ignore"):
        height_m = np.asarray(raw.data, np.float32) * np.float32(scale) + np.float32(offset)
        height_m = height_m * np.float32(metres)
    void = np.ma.getmaskarray(raw)
    for number, kind in enumerate(raster.colorinterp, start=1):
        if kind is ColorInterp.alpha:  # GDAL masks by it in bands of whole numbers only
            void = void | (raster.read(number, window=window) == 0)
    return height_m, void


def _height_band(path: Path, raster: Any) -> int:
    """The number of the band that holds heights: the only one beside masks, or named so, or else with a unit."""
    bands = [k for k, kind in enumerate(raster.colorinterp, start=1) if kind is not ColorInterp.alpha]
    if len(bands) == 1:
        return bands[0]
    named = [k for k in bands if _HEIGHT_NAME.search(raster.descriptions[k - 1] or "")]
    named = named or [k for k in bands if raster.units[k - 1]]
    if len(named) == 1:
        return named[0]
    raise ImportFailedError(
        "dem",
        path,
        f"it has {len(bands)} bands, of which {len(named) or 'none'} are named elevation, height, dem or the like, "
        "or have a unit; allowed: one",
    )


def _filled(
    path: Path, height_m: NDArray[np.float32], void: NDArray[np.bool_], cell_m: float
) -> tuple[NDArray[np.float32], NDArray[np.bool_] | None, int] | None:
    """Heights with voids filled: the nearest known height, then blurred inside the void by its own depth; which.

    None where all are void. The number is that of cells which no mark names as void, see undeclared_voids.
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
        return None
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
