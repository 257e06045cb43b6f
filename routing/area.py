"""Polygons around the roads that a charge can reach, by contouring a field of distances on a grid."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final, cast

import numpy as np
import shapely
from contourpy import FillType, contour_generator

from routing.graph import E7, EARTH_RADIUS_M
from routing.kernels_area import Energies, Grid, Roads, inside_depth, put_roads, widen_extent

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from routing.graph import RoadGraph
    from routing.query import Point
    from routing.search import Reach

METRE_PER_DEGREE: Final = EARTH_RADIUS_M * np.pi / 180.0
GRID_CELLS: Final = 800  # along the longer side, at most; half as many at least where cells are not at their least
LEAST_CELL_M: Final = 10.0
OFF_ROAD_CELLS: Final = 3.0  # the area reaches this far off a road,
OFF_ROAD_M: Final = 400.0  # at least and at most these two
SPACING_M: Final = (30.0, 60.0)  # of the places on a road whose energy is looked at: a cell, within these
CUTS: Final = 16  # a boundary crosses an edge of the grid at an odd multiple of this part of it
LEAST_DEPTH: Final = 0.1  # cells; of a grid node within an area, and off it
HOME_DEPTH: Final = 0.5  # cells; of the origin, at least


@dataclass(frozen=True, slots=True)
class RoadEnergies:
    """Battery energy of driving to a place, from it, or there and back [J], inf where the charge does not suffice.

    node_energy_j: float64 (N,). tail_energy_j, head_energy_j: float64 (M,) at a link's ends, of those who drive on it.
    from_m, to_m: float64 (M,) the stretch of a link for whose places the charge suffices; to_m is −1 where there is
    none. most_energy_j: what is taken where such a stretch ends within the link.
    """

    node_energy_j: NDArray[np.float64]
    tail_energy_j: NDArray[np.float64]
    head_energy_j: NDArray[np.float64]
    from_m: NDArray[np.float64]
    to_m: NDArray[np.float64]
    most_energy_j: float


def energies_of_reach(graph: RoadGraph, reached: Reach) -> RoadEnergies:
    """The energies of driving to a place and stopping there."""
    return RoadEnergies(
        node_energy_j=reached.node_energy_j,
        tail_energy_j=reached.node_energy_j[graph.tail],
        head_energy_j=reached.node_energy_j[graph.head],
        from_m=np.zeros(graph.link_count),
        to_m=reached.link_reach_m,
        most_energy_j=reached.most_energy_j,
    )


@dataclass(frozen=True, slots=True)
class ReachableArea:
    """One band: its polygons and how well they tell reachable nodes from others.

    false_in_frac: share of the covered nodes that can't be reached. false_out_frac: share of the reachable nodes
    that are left out.
    """

    area: shapely.MultiPolygon
    area_m2: float
    node_count: int
    false_in_frac: float
    false_out_frac: float


def reachable_areas(
    graph: RoadGraph, cases: Sequence[tuple[RoadEnergies, float]], origin: Point
) -> tuple[ReachableArea, ...]:
    """For each case and its budget of battery energy [J], the area around the places that take no more.

    The boundary runs half-way between reachable and unreachable roads, and at most OFF_ROAD_M off a road. Polygons
    are valid, right-handed (RFC 7946), contain the origin and nest where the roads in reach do, since all are drawn on
    one grid. More charge covers what less does, but for a cell at the boundary where the grid becomes coarser.
    Lon/lat [deg], whole multiples of 1e-7.
    """
    roads = _roads(graph)
    energies = {id(reached): _energies(reached) for reached, _ in cases}
    frame = _Frame.around(origin, _extent_e7(roads, energies, cases, origin))
    cells = {key: frame.cell_energies(roads, found) for key, found in energies.items()}
    return tuple(
        _area_of(graph, frame, frame.window(cells[id(reached)], budget), reached, budget) for reached, budget in cases
    )


def _area_of(graph: RoadGraph, frame: _Frame, window: _Window, reached: RoadEnergies, budget_j: float) -> ReachableArea:
    shape = frame.polygons(window)
    reachable = reached.node_energy_j <= budget_j
    covered = _covered(graph, frame, window, shape)
    return ReachableArea(
        area=shape,
        area_m2=_area_m2(shape),
        node_count=int(reachable.sum()),
        false_in_frac=float((covered & ~reachable).sum() / max(covered.sum(), 1)),
        false_out_frac=float((reachable & ~covered).sum() / max(reachable.sum(), 1)),
    )


def _covered(graph: RoadGraph, frame: _Frame, window: _Window, shape: shapely.MultiPolygon) -> NDArray[np.bool_]:
    """Which nodes lie in a band's polygons, bool (N,).

    A node amid four grid nodes of one side lies on that side; the polygons are asked about the others.
    """
    column, row = frame.places(graph.node_lon_deg, graph.node_lat_deg)
    column, row = column - window.column, row - window.row
    rows, columns = window.depth.shape
    seen = np.flatnonzero((column >= 0) & (row >= 0) & (column < columns - 1) & (row < rows - 1))
    at = row[seen].astype(np.int64) * columns + column[seen].astype(np.int64)
    inside = (window.depth > 0.0).ravel()
    corners = inside[at].astype(np.int8) + inside[at + 1] + inside[at + columns] + inside[at + columns + 1]
    covered = np.zeros(graph.node_count, bool)
    covered[seen] = corners == 4
    asked = seen[(corners > 0) & (corners < 4)]
    shapely.prepare(shape)
    covered[asked] = shapely.contains_xy(shape, graph.node_lon_deg[asked], graph.node_lat_deg[asked])
    return covered


def _roads(graph: RoadGraph) -> Roads:
    return Roads(
        graph.node_lon_deg,
        graph.node_lat_deg,
        graph.length_m,
        graph.reverse_idx,
        graph.geometry_first,
        graph.geometry_lon_e7,
        graph.geometry_lat_e7,
    )


def _energies(reached: RoadEnergies) -> Energies:
    return Energies(
        reached.node_energy_j,
        reached.tail_energy_j,
        reached.head_energy_j,
        reached.from_m,
        reached.to_m,
        reached.most_energy_j,
    )


def _extent_e7(
    roads: Roads, energies: dict[int, Energies], cases: Sequence[tuple[RoadEnergies, float]], origin: Point
) -> NDArray[np.int64]:
    """West, south, east, north of the origin and all links in reach of the largest budgets, int64 (4,) [1e-7 deg]."""
    home = np.rint(np.array((origin.lon_deg, origin.lat_deg)) * E7).astype(np.int64)
    extent = np.concatenate((home, home))
    per_lat = 1.2 * E7 / METRE_PER_DEGREE  # with room for lengths that are measured otherwise
    per_m = (per_lat / float(np.cos(np.radians(min(abs(origin.lat_deg) + 5.0, 89.0)))), per_lat)
    for key, found in energies.items():
        widen_extent(roads, found, max(budget for reached, budget in cases if id(reached) == key), per_m, extent)
    return extent


@dataclass(frozen=True, slots=True)
class _Window:
    """A part of the grid, from a row and column on: how deep its nodes lie within a band, (rows, columns) [cells]."""

    row: int
    column: int
    depth: NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class _Frame:
    """A regular grid over the reachable part of the map.

    The origin of the range is a node of the grid, and its cells are as large as a step of a ladder says: whatever the
    charge, places fall into the same cells, or else an area would jump to and fro as the charge grows. Its nodes are
    whole multiples of CUTS · 1e-7 deg apart: so are the places where a boundary crosses a line of the grid.
    """

    grid: Grid
    home: tuple[int, int]  # row and column of the origin
    shape: tuple[int, int]  # rows, columns

    @classmethod
    def around(cls, origin: Point, extent_e7: NDArray[np.int64]) -> _Frame:
        home_e7 = np.rint(np.array((origin.lon_deg, origin.lat_deg)) * E7).astype(np.int64)
        per_e7 = METRE_PER_DEGREE / E7 * np.array((np.cos(np.radians(origin.lat_deg)), 1.0))
        size_m = float(((extent_e7[2:] - extent_e7[:2]) * per_e7).max())
        cell_m = LEAST_CELL_M * 2.0 ** max(0, int(np.ceil(np.log2(max(size_m, 1.0) / (GRID_CELLS * LEAST_CELL_M)))))
        step: NDArray[np.int64] = CUTS * np.rint(cell_m / per_e7 / CUTS).astype(np.int64)
        step_lon, step_lat = step.tolist()
        rim = _rim_cells(cell_m)
        before = -((extent_e7[:2] - home_e7) // step) + rim
        after = -((home_e7 - extent_e7[2:]) // step) + rim
        west, south = (home_e7 - before * step).tolist()
        columns, rows = (before + after + 1).tolist()
        return cls(Grid(west, south, step_lon, step_lat, cell_m), (int(before[1]), int(before[0])), (rows, columns))

    def places(
        self, lon_deg: NDArray[np.float64], lat_deg: NDArray[np.float64]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Columns and rows of the grid node south-west of places, as floating-point numbers."""
        grid = self.grid
        column = np.floor((lon_deg * E7 - grid.west_e7) / grid.step_lon_e7)
        row = np.floor((lat_deg * E7 - grid.south_e7) / grid.step_lat_e7)
        return column, row

    def cell_energies(self, roads: Roads, energies: Energies) -> NDArray[np.float64]:
        """Energy of the road that speaks for each grid node, (rows, columns) [J]; NaN: no road, inf: out of reach."""
        cells = np.full(self.shape, np.nan)
        offset = np.full(self.shape, np.inf, np.float32)
        spacing_m = float(np.clip(self.grid.cell_m, *SPACING_M))
        put_roads(roads, energies, self.grid, spacing_m, cells, offset)
        return cells

    def window(self, cell_energy_j: NDArray[np.float64], budget_j: float) -> _Window:
        """The part of the grid that the area of a budget lies in."""
        rim = _rim_cells(self.grid.cell_m)
        reach = cell_energy_j <= budget_j
        reach[self.home] = True
        rows, columns = np.flatnonzero(reach.any(axis=1)), np.flatnonzero(reach.any(axis=0))
        top, left = max(int(rows[0]) - rim, 0), max(int(columns[0]) - rim, 0)
        part = cell_energy_j[top : int(rows[-1]) + rim + 1, left : int(columns[-1]) + rim + 1]
        off_road = _off_road_m(self.grid.cell_m) / self.grid.cell_m
        depth = inside_depth(np.ascontiguousarray(part), budget_j, off_road, LEAST_DEPTH)
        at_home = self.home[0] - top, self.home[1] - left
        depth[at_home] = max(depth[at_home], HOME_DEPTH)  # in every band, so that they stay nested
        return _Window(top, left, depth)

    def polygons(self, window: _Window) -> shapely.MultiPolygon:
        """Where a band is deeper than 0; shells counter-clockwise, holes clockwise.

        Rings don't touch: none passes through a grid node, and each crosses an edge of the grid at one of CUTS / 2
        places of its own. So they are valid as they are.
        """
        contours = contour_generator(z=window.depth, fill_type=FillType.ChunkCombinedOffsetOffset)
        found = cast("tuple[list[NDArray[np.generic]], ...]", contours.filled(0.0, np.inf))
        points, ring_first, shell_first = found[0][0].astype(np.float64), found[1][0], found[2][0].astype(np.int64)
        corner = np.floor(points)
        cut = CUTS * corner + 2.0 * np.floor((points - corner) * (CUTS // 2)) + 1.0
        # one coordinate is that of a line of the grid, from which the other one keeps its distance
        whole = np.rint(points)
        on_line = np.abs(points - whole) < 0.5 * LEAST_DEPTH / (2.0 + LEAST_DEPTH)
        place = np.where(on_line, CUTS * whole, cut).astype(np.int64)
        place, ring_first = _without_straight(place, ring_first.astype(np.int64))
        grid = self.grid
        lonlat_e7 = place * (grid.step_lon_e7 // CUTS, grid.step_lat_e7 // CUTS) + (
            grid.west_e7 + window.column * grid.step_lon_e7,
            grid.south_e7 + window.row * grid.step_lat_e7,
        )
        firsts = ring_first, shell_first, np.array((0, shell_first.size - 1))
        areas = shapely.from_ragged_array(shapely.GeometryType.MULTIPOLYGON, lonlat_e7 / E7, firsts)
        return cast("shapely.MultiPolygon", areas[0])


def _without_straight(
    place: NDArray[np.int64], ring_first: NDArray[np.int64]
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Closed rings of points without those on the straight line between their neighbours; int64 (P, 2), (R+1,)."""
    number = np.arange(place.shape[0])
    begin, end = ring_first[:-1], ring_first[1:] - 1  # the end repeats the beginning
    before, after = number - 1, number + 1
    before[begin], after[end] = end - 1, begin + 1
    come, go = place - place[before], place[after] - place
    bend = come[:, 0] * go[:, 1] != come[:, 1] * go[:, 0]
    bend[end] = False
    kept = np.concatenate(([0], np.cumsum(bend)))
    count = kept[ring_first[1:]] - kept[ring_first[:-1]] + 1  # and the repeated first one
    first = np.concatenate((np.zeros(1, np.int64), np.cumsum(count)))
    rings = np.empty((int(first[-1]), 2), np.int64)
    closing = np.zeros(rings.shape[0], bool)
    closing[first[1:] - 1] = True
    rings[~closing] = place[bend]
    rings[first[1:] - 1] = rings[first[:-1]]
    return rings, first


def _off_road_m(cell_m: float) -> float:
    return max(OFF_ROAD_M, OFF_ROAD_CELLS * cell_m)


def _rim_cells(cell_m: float) -> int:
    """Grid cells around the roads in reach; a road out of reach farther off is nowhere in the area the nearer one."""
    return int(np.ceil(2.0 * _off_road_m(cell_m) / cell_m)) + 2


def _area_m2(shape: shapely.MultiPolygon) -> float:
    """Area on the mean sphere, by Lambert's cylindrical equal-area projection [m²]."""

    def equal_area(lonlat: NDArray[np.float64]) -> NDArray[np.float64]:
        return np.column_stack((np.radians(lonlat[:, 0]), np.sin(np.radians(lonlat[:, 1])))) * EARTH_RADIUS_M

    return float(shapely.transform(shape, equal_area).area)
