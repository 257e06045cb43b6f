"""What the cells of an elevation raster mean: their unit, heights coded as colours, and voids that nobody declared."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from scipy.ndimage import binary_dilation, label

from routing.errors import ImportFailedError

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import NDArray

LOWEST_M: Final = -500.0  # the Dead Sea's shore lies at -430 m, Everest at 8849 m
HIGHEST_M: Final = 9000.0
FOOT_M: Final = 0.3048
US_SURVEY_FOOT_M: Final = 1200.0 / 3937.0

_UNITS: Final = {
    1.0: ("m", "metre", "metres", "meter", "meters", "mtr", "9001", "masl", "mamsl"),
    FOOT_M: ("ft", "foot", "feet", "international foot", "international feet", "ft int", "9002"),
    US_SURVEY_FOOT_M: (
        *("us survey foot", "us survey feet", "us surveyfoot", "survey foot", "survey feet", "ftus", "ft us", "us ft"),
        *("usft", "us foot", "us feet", "foot us", "feet us", "sft", "u s survey foot", "u s survey feet", "9003"),
    ),
    0.001: ("mm", "millimetre", "millimetres", "millimeter", "millimeters"),
    0.01: ("cm", "centimetre", "centimetres", "centimeter", "centimeters"),
    0.1: ("dm", "decimetre", "decimetres", "decimeter", "decimeters"),
    1000.0: ("km", "kilometre", "kilometres", "kilometer", "kilometers"),
}
_UNSAID: Final = ("", "unknown", "none", "undefined", "unspecified", "n/a")
_METRES_BY_NAME: Final = {name: metres for metres, names in _UNITS.items() for name in names}
_VERTICAL: Final = re.compile(r'VERT(?:_CS|CRS)\[.*?UNIT\["[^"]*",\s*([0-9.eE+-]+)', re.DOTALL)

# How far cells may differ from their neighbours in coded heights: a wrong reading jumps by whole steps of a byte, 256 m
_SMOOTH_M: Final = (20.0, 250.0)
_SMOOTH_FRAC: Final = 0.98
_IN_RANGE_FRAC: Final = 0.999

# Grey tones in a band of bytes: of hills 2 km long in cells of 90 m the frac is 0.04, of noise 1 (limits assumed)
_SMALL_CELL_M: Final = 200.0
_LEAST_TONES: Final = 20.0
_ROUGH_FRAC: Final = 0.15

# A cliff around a block of one value, per cell: no lake, sea or plateau has one on almost all of its rim (assumed)
_CLIFF_M: Final = 30.0
_CLIFF_GRADE: Final = 0.5
_CLIFF_AT_ZERO_M: Final = 15.0  # 0 is what writers leave where they know nothing
_CLIFF_AT_ZERO_GRADE: Final = 0.15
_RIM_FRAC: Final = 0.9
_LEAST_BLOCK: Final = 4
_LARGEST_FRAC: Final = 0.25  # of all cells: where one value prevails, it is the terrain and what it surrounds is none
_LARGEST_AT_ZERO_FRAC: Final = 0.45
_MOST_VALUES: Final = 12  # looked at, those with most cells at a cliff first


def metres_per_unit(path: Path, unit: str | None, wkt: str) -> float:
    """Metres in the unit of a raster's band, else in that of its vertical coordinate system, else 1.

    Raises ImportFailedError naming a unit that is no length known here.
    """
    name = re.sub(r"[\s_.\-()\[\]]+", " ", (unit or "").lower()).strip()
    if name in _UNSAID:
        vertical = _VERTICAL.search(wkt)
        return float(vertical[1]) if vertical else 1.0
    words = name.split()
    for count in range(len(words), 0, -1):  # "metres above EGM96" begins with a unit
        found = _METRES_BY_NAME.get(" ".join(words[:count]))
        if found is not None:
            return found
    raise ImportFailedError("dem", path, f"the unit of its heights is {unit!r}, allowed: m, ft, US survey foot, cm, km")


def decoded_heights(path: Path, bands: NDArray[np.uint8], cell_m: float) -> NDArray[np.float32]:
    """Heights coded in bands of bytes as terrarium or Mapbox tiles have them, float32 (rows, columns) [m].

    bands: uint8 (3 or 4, rows, columns), red, green, blue, alpha. Terrarium is red·256 + green + blue/256 − 32768,
    Mapbox (red·65536 + green·256 + blue)/10 − 10000 [m]. Taken where nearly all heights are possible and next to each
    other; black, white and transparent cells are voids, NaN. Raises ImportFailedError for other colours: pictures,
    shaded relief, lossy copies.
    """
    red, green, blue = (band.astype(np.float32) for band in bands[:3])
    empty = (bands[:3] == 0).all(axis=0) | (bands[:3] == 255).all(axis=0)  # neither code has a height there
    seen = np.logical_not(np.asarray(empty, np.bool_))
    if len(bands) > 3:
        seen &= bands[3] > 0
    grey = bool(((red == green) & (green == blue))[seen].all())
    for height_m in (
        red * 256.0 + green + blue / 256.0 - 32768.0,
        (red * 65536.0 + green * 256.0 + blue) * 0.1 - 10000.0,
    ):
        if not grey and _is_terrain(height_m, seen, cell_m):
            return np.where(seen, height_m, np.nan).astype(np.float32)
    raise ImportFailedError(
        "dem",
        path,
        f"its {len(bands)} bands of bytes are colours and no heights, allowed: one band of heights, or heights coded "
        "without loss as terrarium or Mapbox tiles have them",
    )


def refuse_shaded(path: Path, band: np.ma.MaskedArray[Any, Any], cell_m: float) -> None:
    """Raise ImportFailedError where a band of bytes is a picture of terrain and no heights.

    Grey tones of shaded relief or of a photograph differ from cell to cell nearly as much as far apart. Heights up to
    255 m do not, where cells are small. Bands of nearly one tone pass.
    """
    tones = np.ma.filled(band.astype(np.float32), np.nan)
    known = tones[np.isfinite(tones)]
    if cell_m > _SMALL_CELL_M or known.size == 0 or float(known.std()) < _LEAST_TONES:
        return
    steps = np.concatenate([np.diff(tones, axis=axis).ravel() for axis in (0, 1)])
    rough = float(np.nanmean(steps**2)) / (2.0 * float(known.var()))
    if rough > _ROUGH_FRAC:
        raise ImportFailedError(
            "dem",
            path,
            "its band of bytes changes from cell to cell as grey tones of a picture do, and heights don't; allowed: "
            "heights, with a unit where they are bytes",
        )


def _is_terrain(height_m: NDArray[np.float32], seen: NDArray[np.bool_], cell_m: float) -> bool:
    known = height_m[seen]
    if known.size == 0 or float(((known >= LOWEST_M) & (known <= HIGHEST_M)).mean()) < _IN_RANGE_FRAC:
        return False
    most_m = min(max(2.0 * cell_m, _SMOOTH_M[0]), _SMOOTH_M[1])
    for axis in (0, 1):
        both = _pairs(seen, axis)
        step_m = np.abs(np.diff(height_m, axis=axis))[both[0] & both[1]]
        if step_m.size and float((step_m <= most_m).mean()) < _SMOOTH_FRAC:
            return False
    return True


def undeclared_voids(height_m: NDArray[np.float32], void: NDArray[np.bool_], cell_m: float) -> NDArray[np.bool_] | None:
    """Cells in blocks of one value with a cliff on almost all of their rim, bool (rows, columns), None where none is.

    height_m: float32 (rows, columns) [m]; void: what is known to be none. Blocks are connected over edges of cells; the
    rim may run along the raster's. The cells around a block go with it: resampling mixes them with the void. Nothing is
    found in terrain whose steps are below the cliffs asked for, in
    O(cells); else O(cells) for each of at most _MOST_VALUES values.
    """
    z = np.where(void, np.float32(np.nan), height_m)
    cliff_m = max(_CLIFF_M, _CLIFF_GRADE * cell_m)
    at_zero_m = max(_CLIFF_AT_ZERO_M, _CLIFF_AT_ZERO_GRADE * cell_m)
    candidates = {0.0: at_zero_m} if bool((z == 0.0).any()) else {}
    candidates.update(dict.fromkeys(_values_at_cliffs(z, cliff_m), cliff_m))
    if 0.0 in candidates:
        candidates[0.0] = at_zero_m
    found = np.zeros(z.shape, np.bool_)
    for value, least_m in candidates.items():
        blocks = _blocks(z, np.float32(value), least_m)
        z[blocks] = np.nan  # is no cliff of the next value
        found |= blocks
    return binary_dilation(found, np.ones((3, 3), np.bool_)) if bool(found.any()) else None


def _values_at_cliffs(z: NDArray[np.float32], cliff_m: float) -> list[float]:
    """Values of cells whose neighbours are all either equal or beyond a cliff, and both occur; the frequent ones."""
    equal, beyond = np.zeros(z.shape, np.bool_), np.zeros(z.shape, np.bool_)
    between = np.zeros(z.shape, np.bool_)
    for axis in (0, 1):
        step_m = np.abs(np.diff(z, axis=axis))
        kinds = (step_m == 0.0, step_m >= cliff_m, (step_m > 0.0) & (step_m < cliff_m))
        if axis == 0 and not kinds[1].any() and not (np.abs(np.diff(z, axis=1)) >= cliff_m).any():
            return []
        for mark, kind in zip((equal, beyond, between), kinds, strict=True):
            for side in _pairs(mark, axis):
                side |= kind
    values, counts = np.unique(z[equal & beyond & ~between], return_counts=True)
    often = np.argsort(-counts)[:_MOST_VALUES]
    return [float(v) for v in values[often][counts[often] >= _LEAST_BLOCK]]


def _blocks(z: NDArray[np.float32], value: np.float32, cliff_m: float) -> NDArray[np.bool_]:
    """Blocks of one value that a cliff surrounds, all of them below or all above what is around, bool as z."""
    blocks: Any
    blocks, count = label(z == value)
    size = np.bincount(blocks.ravel(), minlength=count + 1)
    rim, below, above = np.zeros(count + 1), np.zeros(count + 1), np.zeros(count + 1)
    for axis in (0, 1):
        low, high = _pairs(blocks, axis)
        z_low, z_high = _pairs(z, axis)
        at = np.flatnonzero((low != high) & ~np.isnan(z_low) & ~np.isnan(z_high))
        for block, own, other in ((low, z_low, z_high), (high, z_high, z_low)):
            rise_m = other.ravel()[at] - own.ravel()[at]
            which = block.ravel()[at]
            rim += np.bincount(which, minlength=count + 1)
            below += np.bincount(which, rise_m >= cliff_m, count + 1)
            above += np.bincount(which, rise_m <= -cliff_m, count + 1)
    chosen = (rim > 0) & (np.maximum(below, above) >= _RIM_FRAC * rim)
    chosen &= (size >= _LEAST_BLOCK) | ((value == 0.0) & (rim >= 3))
    chosen &= size <= (_LARGEST_AT_ZERO_FRAC if value == 0.0 else _LARGEST_FRAC) * z.size
    chosen[0] = False
    result: NDArray[np.bool_] = chosen[blocks]
    return result


def _pairs(cells: NDArray[Any], axis: int) -> tuple[NDArray[Any], NDArray[Any]]:
    """Each cell and its neighbour along an axis, two views."""
    return (cells[:-1], cells[1:]) if axis == 0 else (cells[:, :-1], cells[:, 1:])
