"""A smooth height surface through the heights of a road graph."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np
from scipy import sparse
from scipy.interpolate import RectBivariateSpline
from scipy.sparse.linalg import splu

from app.tiles.address import east_from_lon, lat_deg_from_south, lon_deg_from_east, south_from_lat
from routing.graph.earth import E7

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from routing.graph.road_graph import RoadGraph

MAX_SAMPLES: Final = 400_000  # geometry points that are read of a large graph
MAX_CELLS: Final = 25_000  # of the surface's grid without its margin; so many take 0.3 s
CELLS_A_SAMPLE: Final = 2
MIN_SIDE_FRAC: Final = 0.1  # of the longer side, so that roads along one line have a grid as well
MIN_CELL: Final = 2.0**-24  # share of the map's width, 2.4 m at the equator
BINS_A_CELL: Final = 2  # along each side; samples of one bin are averaged
MARGIN_CELLS: Final = 16
FADE_CELLS: Final = 48  # beyond the box of the roads
# weights of bending and of slope against one sample's misfit, set by eye: less bending shows the road's cuts and
# fills as bumps, more flattens the valleys; slope keeps the surface from running off where no road is
BENDING_WEIGHT: Final = 1.0
SLOPE_WEIGHT: Final = 0.005
OVERSHOOT_FRAC: Final = 0.25  # of the span of heights, that the surface may rise or fall beyond it


@dataclass(frozen=True, slots=True)
class SurfaceGrid:
    """Where the grid points of a surface lie: its first point and spacing in map shares, and its size."""

    west: float
    north: float
    cell: float
    rows: int
    columns: int

    def place(
        self, east: NDArray[np.float64], south: NDArray[np.float64]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Column and row, with fractions, of map shares."""
        return (east - self.west) / self.cell, (south - self.north) / self.cell

    def bounds_deg(self) -> tuple[float, float, float, float]:
        """West, south, east and north end [deg] of the roads and of what fades around them."""
        spare = (FADE_CELLS - MARGIN_CELLS) * self.cell
        width, depth = (self.columns - 1) * self.cell, (self.rows - 1) * self.cell
        return (
            max(lon_deg_from_east(self.west - spare), -180.0),
            lat_deg_from_south(self.north + depth + spare),
            min(lon_deg_from_east(self.west + width + spare), 180.0),
            lat_deg_from_south(self.north - spare),
        )


def surface_grid(graph: RoadGraph) -> SurfaceGrid:
    """The grid for a graph's heights: its box with a margin, in cells by the number of its roads' points."""
    lon_e7, lat_e7 = graph.geometry_lon_e7, graph.geometry_lat_e7
    west, east = east_from_lon(np.array([lon_e7.min(), lon_e7.max()]) / E7).tolist()
    north, south = south_from_lat(np.array([lat_e7.max(), lat_e7.min()]) / E7).tolist()
    width, depth = east - west, south - north
    least = MIN_SIDE_FRAC * max(width, depth)
    cells = min(MAX_CELLS, CELLS_A_SAMPLE * lon_e7.size)
    cell = max(math.sqrt(max(width, least) * max(depth, least) / cells), MIN_CELL)
    columns, rows = (math.ceil(size / cell) + 1 + 2 * MARGIN_CELLS for size in (width, depth))
    return SurfaceGrid(west - MARGIN_CELLS * cell, north - MARGIN_CELLS * cell, cell, rows, columns)


class HeightSurface:
    """Height by place, twice differentiable everywhere: a thin plate under tension through road heights.

    The plate minimises the weighted squares of misfit, second and first differences on a grid in Mercator map shares
    (smoothing splines of Wahba, "Spline Models for Observational Data", 1990, DOI 10.1137/1.9781611970128; tension as
    in Smith and Wessel 1990, DOI 10.1190/1.1442837), and is read between grid points by a bicubic spline. It passes
    roads within some tens of metres: made for shading, not for measuring.
    """

    def __init__(self, graph: RoadGraph, grid: SurfaceGrid) -> None:
        east, south, height_m = _road_heights(graph)
        self._grid = grid
        column, row, binned_m = _binned(*grid.place(east, south), height_m, grid.columns)
        plate_m = _plate(column, row, binned_m, (grid.rows, grid.columns))
        spare_m = OVERSHOOT_FRAC * float(np.ptp(height_m))
        plate_m = np.clip(plate_m, height_m.min() - spare_m, height_m.max() + spare_m)
        self._mean_m = float(plate_m.mean())
        self._spline = RectBivariateSpline(np.arange(grid.rows), np.arange(grid.columns), plate_m)

    def heights_m(self, east: NDArray[np.float64], south: NDArray[np.float64]) -> NDArray[np.float64]:
        """Heights on a grid, float64 (rows, columns) [m]; east and south are map shares, ascending.

        Beyond the box of the roads it fades to the mean height, which shades nothing.
        """
        column, row = self._grid.place(east, south)
        rows, columns = _eased(row, self._grid.rows - 1), _eased(column, self._grid.columns - 1)
        kept = np.outer(_kept_relief(row, self._grid.rows - 1), _kept_relief(column, self._grid.columns - 1))
        return np.asarray(self._mean_m + kept * (self._spline(rows, columns) - self._mean_m), np.float64)


def _road_heights(graph: RoadGraph) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Map shares east and south, and height [m], along the roads on the ground, float64 (P,) each.

    Heights of nodes, in between in proportion to the way. Bridges and tunnels are left out, unless there is
    nothing else; of a large graph some roads are taken.
    """
    one_way = np.flatnonzero((graph.reverse_idx < 0) | (np.arange(graph.link_count) < graph.reverse_idx))
    on_ground = one_way[~graph.structure[one_way]]
    links = on_ground if on_ground.size else one_way
    links = links[:: math.ceil(graph.geometry_lon_e7.size / 2 / MAX_SAMPLES)]
    begin = graph.geometry_first[links]
    count = graph.geometry_first[links + 1] - begin
    first = np.cumsum(count) - count
    line = np.repeat(np.arange(links.size), count)
    point = np.arange(line.size) + np.repeat(begin - first, count)
    east = east_from_lon(graph.geometry_lon_e7[point] / E7)
    south = south_from_lat(graph.geometry_lat_e7[point] / E7)
    way = np.cumsum(np.hypot(np.diff(east, prepend=east[:1]), np.diff(south, prepend=south[:1])))
    done, whole = way - way[first][line], (way[first + count - 1] - way[first])[line]
    share = np.divide(done, whole, out=np.zeros_like(done), where=whole > 0)
    tail_m, head_m = graph.node_height_m[graph.tail[links]][line], graph.node_height_m[graph.head[links]][line]
    return east, south, tail_m + share * (head_m - tail_m)


def _binned(
    column: NDArray[np.float64], row: NDArray[np.float64], height_m: NDArray[np.float64], columns: int
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Mean place and height of the samples of each bin, so that a town does not outweigh its valley."""
    key = np.floor(row * BINS_A_CELL).astype(np.int64) * columns * BINS_A_CELL
    key += np.floor(column * BINS_A_CELL).astype(np.int64)
    _, member, count = np.unique(key, return_inverse=True, return_counts=True)
    mean_column, mean_row, mean_m = (np.bincount(member, values) / count for values in (column, row, height_m))
    return mean_column, mean_row, mean_m


def _plate(
    column: NDArray[np.float64], row: NDArray[np.float64], height_m: NDArray[np.float64], shape: tuple[int, int]
) -> NDArray[np.float64]:
    """Heights of the grid points that fit the samples with the least bending and slope, float64 shape [m]."""
    rows, columns = shape
    left, top = np.floor(column).astype(np.int64), np.floor(row).astype(np.int64)
    right_part, lower_part = column - left, row - top
    sample = np.arange(height_m.size)
    corners = [
        ((1 - right_part) * (1 - lower_part), top * columns + left),
        (right_part * (1 - lower_part), top * columns + left + 1),
        ((1 - right_part) * lower_part, (top + 1) * columns + left),
        (right_part * lower_part, (top + 1) * columns + left + 1),
    ]
    weights, points = (np.concatenate(part) for part in zip(*corners, strict=True))
    reading = sparse.csr_array((weights, (np.tile(sample, 4), points)), shape=(height_m.size, rows * columns))
    bending, slope = _roughness(rows, columns)
    equations = reading.T @ reading + BENDING_WEIGHT * bending + SLOPE_WEIGHT * slope
    # the matrix is symmetric and positive definite: no pivoting is needed
    factors = splu(
        sparse.csc_array(equations), permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True}
    )
    return np.asarray(factors.solve(reading.T @ height_m), np.float64).reshape(shape)


def _roughness(rows: int, columns: int) -> tuple[sparse.csr_array, sparse.csr_array]:
    """Quadratic forms of the squared second and first differences of a grid, (cells, cells) each."""
    across, down = sparse.eye_array(columns), sparse.eye_array(rows)
    step_x, step_y = (_difference(size, (-1.0, 1.0)) for size in (columns, rows))
    bend_x, bend_y = (_difference(size, (1.0, -2.0, 1.0)) for size in (columns, rows))
    slopes = (sparse.kron(down, step_x), sparse.kron(step_y, across))
    twist = sparse.kron(step_y, step_x)
    bends = (sparse.kron(down, bend_x), sparse.kron(bend_y, across), twist, twist)
    return sum(part.T @ part for part in bends), sum(part.T @ part for part in slopes)


def _difference(size: int, weights: tuple[float, ...]) -> sparse.dia_array:
    count = size - len(weights) + 1
    return sparse.diags_array(
        [np.full(count, weight) for weight in weights], offsets=range(len(weights)), shape=(count, size)
    )


def _eased(place: NDArray[np.float64], last: int) -> NDArray[np.float64]:
    """Grid places that come to rest smoothly at the ends of the grid, so that no edge shows there; never falling.

    place: ascending. A tanh may fall by its last bit where it should rise, and the spline takes no falling places.
    """
    low, high = float(MARGIN_CELLS), last - MARGIN_CELLS
    eased = np.where(place < low, low + MARGIN_CELLS * np.tanh((place - low) / MARGIN_CELLS), place)
    eased = np.where(place > high, high + MARGIN_CELLS * np.tanh((place - high) / MARGIN_CELLS), eased)
    return np.maximum.accumulate(eased)


def _kept_relief(place: NDArray[np.float64], last: int) -> NDArray[np.float64]:
    """Share of the relief that is kept at grid places: 1 within the box of the roads, 0 far beyond it."""
    beyond = np.maximum(MARGIN_CELLS - place, place - (last - MARGIN_CELLS))
    return np.asarray(0.5 + 0.5 * np.cos(np.pi * np.clip(beyond / FADE_CELLS, 0.0, 1.0)), np.float64)
