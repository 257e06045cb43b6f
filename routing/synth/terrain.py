"""Synthetic terrain: mountain ranges carved by rivers above a rolling plain."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np
from scipy import ndimage
from scipy.sparse import csr_array
from scipy.sparse.csgraph import breadth_first_order, minimum_spanning_tree

if TYPE_CHECKING:
    from numpy.typing import NDArray

NEIGHBOURS: Final = ((0, 1), (1, 0), (1, 1), (1, -1), (0, -1), (-1, 0), (-1, -1), (-1, 1))

# All values below are assumed: chosen so that the drawn relief resembles a young mountain range.
RANGE_WAVELENGTH_M: Final = 55_000.0
RANGE_STRETCH: Final = 2.2  # a range is that much longer than wide
LOWLAND_SHARE: Final = 0.38
SUMMIT_M: Final = 2_550.0  # height of the 99.9th percentile above the plain
LOWLAND_M: Final = (90.0, 330.0)
EROSION_STEPS: Final = 45
# Grids grow with the region until they have so many cells, then their cells do, up to the second length.
EROSION_CELLS: Final = 500_000
EROSION_CELL_M: Final = (400.0, 1_200.0)
TERRAIN_CELLS: Final = 8_000_000
TERRAIN_CELL_M: Final = (125.0, 300.0)


@dataclass(frozen=True, slots=True)
class Landscape:
    """Heights over a rectangle, origin in its south-west corner.

    ground_m: float32 (rows, cols), height at cell centres, row 0 in the south [m].
    flow_km2: float32 (rows, cols), area that drains through a cell [km²].
    """

    extent_x_m: float
    extent_y_m: float
    cell_m: float
    ground_m: NDArray[np.float32]
    flow_km2: NDArray[np.float32]

    def sample_m(self, x_m: NDArray[np.float64], y_m: NDArray[np.float64]) -> NDArray[np.float64]:
        """Height at points, bilinear, float64 (n,) [m]."""
        return _bilinear(self.ground_m, self.cell_m, x_m, y_m)


def _bilinear(
    field: NDArray[np.float32], cell_m: float, x_m: NDArray[np.float64], y_m: NDArray[np.float64]
) -> NDArray[np.float64]:
    at = np.array([y_m / cell_m - 0.5, x_m / cell_m - 0.5])
    value: NDArray[np.float64] = ndimage.map_coordinates(field, at, output=np.float64, order=1, mode="nearest")
    return value


def fractal_field(
    shape: tuple[int, int],
    cell_m: float,
    wavelength_m: float,
    rng: np.random.Generator,
    *,
    decay: float = 2.2,
    stretch: float = 1.0,
    strike_rad: float = 0.0,
) -> NDArray[np.float64]:
    """Gaussian noise of mean 0 and standard deviation 1 whose amplitude falls with frequency above 1/wavelength.

    decay: exponent of the fall; stretch: how much longer features are along strike_rad (from the x axis).
    """
    spectrum = np.fft.rfft2(rng.standard_normal(shape))
    fy = np.fft.fftfreq(shape[0], cell_m)[:, None]
    fx = np.fft.rfftfreq(shape[1], cell_m)[None, :]
    along = (fx * np.cos(strike_rad) + fy * np.sin(strike_rad)) * stretch
    across = fy * np.cos(strike_rad) - fx * np.sin(strike_rad)
    spectrum *= (1.0 + (along**2 + across**2) * wavelength_m**2) ** (-decay / 2.0)
    spectrum[0, 0] = 0.0
    noise: NDArray[np.float64] = np.fft.irfft2(spectrum, s=shape)
    noise /= max(float(noise.std()), 1e-12)
    return noise


def build_landscape(extent_x_m: float, extent_y_m: float, rng: np.random.Generator) -> Landscape:
    """A landscape of the given size in O(cells · log cells): erosion on a coarse grid, detail on a fine one."""
    area_m2 = extent_x_m * extent_y_m
    coarse_m = float(np.clip(np.sqrt(area_m2 / EROSION_CELLS), *EROSION_CELL_M))
    shape = (max(24, round(extent_y_m / coarse_m)), max(24, round(extent_x_m / coarse_m)))
    wavelength_m = min(RANGE_WAVELENGTH_M, 0.8 * max(extent_x_m, extent_y_m))
    ranges = fractal_field(
        shape, coarse_m, wavelength_m, rng, decay=4.0, stretch=RANGE_STRETCH, strike_rad=float(rng.uniform(0.15, 0.6))
    ) + 0.10 * fractal_field(shape, coarse_m, 15_000.0, rng)
    rank = (np.argsort(np.argsort(ranges, axis=None, kind="stable"), kind="stable") / ranges.size).reshape(shape)
    lowland = rank < LOWLAND_SHARE
    plain01 = _unit(fractal_field(shape, coarse_m, 25_000.0, rng, decay=3.0))
    plain_m = LOWLAND_M[0] + (LOWLAND_M[1] - LOWLAND_M[0]) * plain01
    rise = np.clip((rank - LOWLAND_SHARE) / (1.0 - LOWLAND_SHARE), 0.0, 1.0)
    uplift = (0.18 + rise) * (1.0 + 0.25 * fractal_field(shape, coarse_m, 12_000.0, rng))
    ground, flow_cells = _erode(plain_m, np.maximum(uplift, 0.03), lowland, rng)
    above = ground - plain_m
    ground = plain_m + above * (SUMMIT_M / max(float(np.quantile(above, 0.999)), 1e-9))
    ground = ndimage.gaussian_filter(ground, 0.7)

    fine_m = float(np.clip(np.sqrt(area_m2 / TERRAIN_CELLS), *TERRAIN_CELL_M))
    rows, cols = round(extent_y_m / fine_m), round(extent_x_m / fine_m)
    y = ((np.arange(rows) + 0.5) * (shape[0] / rows) - 0.5)[:, None]
    x = ((np.arange(cols) + 0.5) * (shape[1] / cols) - 0.5)[None, :]
    at = np.array(np.broadcast_arrays(y, x))
    smooth = ndimage.map_coordinates(ground.astype(np.float32), at, order=3, mode="nearest")
    flow = np.exp(ndimage.map_coordinates(np.log(flow_cells).astype(np.float32), at, order=1, mode="nearest"))
    relief_m = np.minimum(
        8.0 + 0.30 * np.maximum(smooth - ndimage.minimum_filter(smooth, max(3, round(2_500.0 / fine_m))), 0.0), 140.0
    )
    relief_m = ndimage.gaussian_filter(relief_m, 1_200.0 / fine_m)
    detail = fractal_field((rows, cols), fine_m, 2_500.0, rng, decay=3.2)
    return Landscape(
        extent_x_m=extent_x_m,
        extent_y_m=extent_y_m,
        cell_m=extent_x_m / cols,
        ground_m=np.maximum(smooth + 0.45 * relief_m * detail, 2.0).astype(np.float32),
        flow_km2=(flow * (coarse_m / 1_000.0) ** 2).astype(np.float32),
    )


def _unit(field: NDArray[np.float64]) -> NDArray[np.float64]:
    unit: NDArray[np.float64] = np.clip(0.5 + field / 5.0, 0.0, 1.0)
    return unit


def _erode(
    base_m: NDArray[np.float64], uplift: NDArray[np.float64], fixed: NDArray[np.bool_], rng: np.random.Generator
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Heights after uplift against river incision, and the number of cells draining through each cell.

    Stream power law with m = 0.5, n = 1, solved implicitly from the outlets upwards (Braun and Willett 2013,
    doi:10.1016/j.geomorph.2012.10.008). Cells of `fixed` are the base level. Units are free: the caller rescales.
    """
    shape = base_m.shape
    still = fixed.ravel()
    lift = np.where(still, 0.0, uplift.ravel())
    height = base_m.ravel() / 1_000.0 + np.where(still, 0.0, 0.05 * rng.random(base_m.size))
    area = np.ones(height.size)
    for _ in range(EROSION_STEPS):
        receiver = _receivers(height.reshape(shape), still)
        order, bounds = _upstream_order(receiver)
        area = np.ones(height.size)
        for level in range(bounds.size - 2, 0, -1):
            cells = order[bounds[level] : bounds[level + 1]]
            np.add.at(area, receiver[cells], area[cells])
        incision = 0.6 * np.sqrt(area)
        height = height + lift
        for level in range(1, bounds.size - 1):
            cells = order[bounds[level] : bounds[level + 1]]
            height[cells] = (height[cells] + incision[cells] * height[receiver[cells]]) / (1.0 + incision[cells])
    return height.reshape(shape) * 1_000.0, area.reshape(shape)


def _receivers(height: NDArray[np.float64], still: NDArray[np.bool_]) -> NDArray[np.int64]:
    """The cell each cell drains to: its steepest lower neighbour; a pit drains over its basin's lowest saddle."""
    rows, cols = height.shape
    padded = np.pad(height, 1, constant_values=np.inf)
    own = np.arange(rows * cols).reshape(rows, cols)
    receiver = own.copy()
    steepest = np.zeros_like(height)
    for dy, dx in NEIGHBOURS:
        drop = (height - padded[1 + dy : 1 + dy + rows, 1 + dx : 1 + dx + cols]) / np.hypot(dy, dx)
        better = drop > steepest
        steepest[better] = drop[better]
        receiver[better] = own[better] + dy * cols + dx
    flat = receiver.ravel()
    flat[still] = np.flatnonzero(still)
    root = flat.copy()
    while True:
        further = root[root]
        if np.array_equal(further, root):
            break
        root = further
    pits = np.flatnonzero((flat == np.arange(flat.size)) & ~still)
    if pits.size == 0:
        return flat
    basin = np.zeros(flat.size, np.int64)  # basin 0 is the base level
    basin[pits] = np.arange(1, pits.size + 1)
    basin = basin[root]
    here, there, saddle = [], [], []
    grid, level = basin.reshape(rows, cols), height
    for dy, dx in NEIGHBOURS[:4]:
        a = (slice(0, rows - dy), slice(max(0, -dx), cols - max(0, dx)))
        b = (slice(dy, rows), slice(max(0, dx), cols - max(0, -dx)))
        border = grid[a] != grid[b]
        here.append(own[a][border])
        there.append(own[b][border])
        saddle.append(np.maximum(level[a][border], level[b][border]))
    cell_a, cell_b, height_at = np.concatenate(here), np.concatenate(there), np.concatenate(saddle)
    swap = basin[cell_a] > basin[cell_b]
    cell_a, cell_b = np.where(swap, cell_b, cell_a), np.where(swap, cell_a, cell_b)
    by_height = np.argsort(height_at, kind="stable")
    key = basin[cell_a] * (pits.size + 1) + basin[cell_b]
    _, lowest = np.unique(key[by_height], return_index=True)
    pick = by_height[lowest]
    size = pits.size + 1
    weight = height_at[pick] - float(height_at.min()) + 1e-6
    tree = minimum_spanning_tree(csr_array((weight, (basin[cell_a[pick]], basin[cell_b[pick]])), shape=(size, size)))
    _, parent = breadth_first_order(tree, 0, directed=False, return_predecessors=True)
    child = np.flatnonzero(parent >= 0)
    upper = parent[child]
    pair = np.minimum(child, upper).astype(np.int64) * size + np.maximum(child, upper)
    saddle_idx = pick[np.searchsorted(key[pick], pair)]  # pick is sorted by key
    across = np.where(basin[cell_a[saddle_idx]] == child, cell_b[saddle_idx], cell_a[saddle_idx])
    flat[pits[child - 1]] = across
    return flat


def _upstream_order(receiver: NDArray[np.int64]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Cells sorted by their number of steps to the base level, and where each step count begins."""
    ancestor = receiver.copy()
    depth = (ancestor != np.arange(ancestor.size)).astype(np.int64)
    while True:
        gained = depth[ancestor]
        if not gained.any():
            break
        depth += gained
        ancestor = ancestor[ancestor]
    order = np.argsort(depth, kind="stable")
    bounds = np.concatenate(([0], np.cumsum(np.bincount(depth))))
    return order, bounds
