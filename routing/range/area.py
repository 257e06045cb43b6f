"""Polygons around the roads that a charge can reach, drawn on a grid of what road is nearest."""

from __future__ import annotations

import threading
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np
import shapely

from routing.graph.earth import E7, EARTH_RADIUS_M, METRE_PER_DEGREE
from routing.range.kernels_grid import (
    LEVEL_MASK,
    NOWHERE,
    Energies,
    Grid,
    RoadLines,
    Seen,
    Unsure,
    count_nodes,
    nearest_roads,
    put_roads,
    widen_extent,
)
from routing.range.kernels_outline import CUTS, Band, Marks, Rings, Walk, crossings, put_rings
from routing.range.kernels_rings import close_rings
from routing.range.rings import AreaRings, shape_of

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from routing.graph.kernels_nearest import Boxes
    from routing.graph.road_graph import RoadGraph
    from routing.graph.snap import RoadIndex
    from routing.places import Point
    from routing.search.found import Reach

GRID_CELLS: Final = 800  # along the longer side, at most; half as many at least where cells are not at their least
LEAST_CELL_M: Final = 10.0
OFF_ROAD_CELLS: Final = 3.0  # the area reaches this far off a road,
OFF_ROAD_M: Final = 400.0  # at least and at most these two
SPACING_M: Final = (30.0, 60.0)  # of the places on a road whose energy is looked at: a cell, within these
SLACK: Final = 0  # how far a boundary may be moved along an edge of the grid for fewer points [1/CUTS of it]: more
# than that and more charge would no longer cover all that less does
DISTANCE_CAP_CELLS: Final = 1  # beyond how far an area reaches off a road, distances are all alike


@dataclass(frozen=True, slots=True)
class RoadEnergies:
    """Battery energy of driving to a place, from it, or there and back [J], inf where the charge does not suffice.

    Or instead of all energies the time of driving there [s], or the distance [m].

    node_energy_j: float64 (N,). tail_energy_j, head_energy_j: float64 (M,) at a link's ends, of those who drive on it;
    None where those are the energies of its nodes.
    from_m, to_m: float64 (M,) the stretch of a link for whose places the charge suffices; to_m is −1 where there is
    none. most_energy_j: what is taken where such a stretch ends within the link.
    """

    node_energy_j: NDArray[np.float64]
    tail_energy_j: NDArray[np.float64] | None
    head_energy_j: NDArray[np.float64] | None
    from_m: NDArray[np.float64]
    to_m: NDArray[np.float64]
    most_energy_j: float


def energies_of_reach(graph: RoadGraph, reached: Reach) -> RoadEnergies:
    """The energies of driving to a place and stopping there."""
    return RoadEnergies(
        node_energy_j=reached.node_energy_j,
        tail_energy_j=None,
        head_energy_j=None,
        from_m=np.zeros(graph.link_count),
        to_m=reached.link_reach_m,
        most_energy_j=reached.most_energy_j,
    )


@dataclass(frozen=True, slots=True)
class ReachableArea:
    """One band: its polygons and how well they tell reachable nodes from others.

    rings: of the area. tolerance_m: how far the boundary may have been moved for fewer points. off_road_m: how far off
    a road it lies where there are no other roads. cell_m: of the grid that it is drawn on. false_in_frac: share of the
    covered nodes that can't be reached. false_out_frac: share of the reachable nodes that are left out.
    """

    area: shapely.MultiPolygon
    rings: AreaRings
    area_m2: float
    tolerance_m: float
    node_count: int
    false_in_frac: float
    false_out_frac: float
    off_road_m: float
    cell_m: float


class AreaMaker:
    """Draws areas on the roads of one graph; safe to share between threads."""

    def __init__(self, graph: RoadGraph, index: RoadIndex) -> None:
        self._graph = graph
        self._index = index
        self._roads = _roads(graph)
        self._lock = threading.Lock()
        self._holds: NDArray[np.int8] | None = None

    def areas(self, cases: Sequence[tuple[RoadEnergies, float]], origin: Point) -> tuple[ReachableArea, ...]:
        """For each case and its budget of battery energy [J], the area around the places that take no more.

        Cases that reach more come before those that reach less. The boundary runs half-way between reachable and
        unreachable roads, and at most OFF_ROAD_M off a road. Polygons are valid, right-handed (RFC 7946), contain the
        origin and nest where the roads in reach do, since all are drawn on one grid. More charge covers what less does,
        but for the tolerance, and for a cell at the boundary where the grid becomes coarser. Lon/lat [deg], whole
        multiples of 1e-7.
        """
        energies = {id(reached): _energies(reached) for reached, _ in cases}
        budgets = {key: np.array(sorted({b for r, b in cases if id(r) == key}, reverse=True)) for key in energies}
        extent_e7 = _extent_e7(self._roads, energies, budgets, origin)
        frame = _Frame.around(origin, extent_e7)
        sheets = {key: self._sheet(frame, found, budgets[key]) for key, found in energies.items()}
        marks = Marks(np.zeros((*frame.shape, 2), np.int32), np.zeros((*frame.shape, 4), np.uint8))
        drawn, rings = [], 0
        for reached, budget in cases:
            sheet = sheets[id(reached)]
            band = 1 + int(np.searchsorted(-budgets[id(reached)], -budget))
            outline = frame.outline(sheet, band, marks, rings)
            rings += outline.ring_first.size - 1
            drawn.append(self._area(sheet, band, outline, frame.grid.cell_m))
        return tuple(drawn)

    def _sheet(self, frame: _Frame, energies: Energies, budget_j: NDArray[np.float64]) -> _Sheet:
        boxes = self._index.boxes
        key = np.full(frame.shape, NOWHERE, np.int32)
        seen = Seen(*np.empty((3, self._graph.node_count), np.int32))
        grid = frame.grid
        spacing_m = float(np.clip(grid.cell_m, *SPACING_M))
        nodes = put_roads(boxes, self._held(boxes), self._roads, energies, budget_j, grid, spacing_m, key, seen)
        seen = Seen(*(part[:nodes] for part in seen))
        off_road = _off_road_cells(grid.cell_m)
        nearest_roads(key, int(np.ceil(off_road)) + DISTANCE_CAP_CELLS, off_road)
        key[frame.home] |= LEVEL_MASK  # in every band, so that they stay nested
        change = np.empty(key.size, np.int32)
        total, changes = crossings(key, change)
        count = np.zeros((3, budget_j.size + 1), np.int64)
        unsure = Unsure(*np.empty((4, nodes), np.int32))
        found = count_nodes(seen, key, count, unsure)
        within = count[:, ::-1].cumsum(axis=1)[:, ::-1]  # in so many bands at least
        return _Sheet(key, change[:changes], total, within, Unsure(*(part[:found] for part in unsure)))

    def _held(self, boxes: Boxes) -> NDArray[np.int8]:
        """Of which ends each road is the first, so that nodes are looked at once; int8 (R,) as in put_roads."""
        with self._lock:
            if self._holds is None:
                ends = np.column_stack((self._graph.tail[boxes.road], self._graph.head[boxes.road])).ravel()
                first = np.empty(self._graph.node_count, np.int64)
                first[ends[::-1]] = np.arange(ends.size)[::-1]  # of several the last one written stays
                mine = (first[ends] == np.arange(ends.size)).reshape(-1, 2)
                self._holds = (mine[:, 0] + 2 * mine[:, 1]).astype(np.int8)
            return self._holds

    def _area(self, sheet: _Sheet, band: int, rings: AreaRings, cell_m: float) -> ReachableArea:
        """A band with its shares, which are counted by the polygons where the grid alone can't tell."""
        reached, covered, both = sheet.within[:, band].tolist()
        unsure = sheet.unsure
        asked = np.flatnonzero((unsure.least < band) & (unsure.most >= band))
        node = unsure.node[asked]
        shape = shape_of(rings)
        shapely.prepare(shape)
        inside = shapely.contains_xy(shape, self._graph.node_lon_deg[node], self._graph.node_lat_deg[node])
        covered += int(np.count_nonzero(inside))
        both += int(np.count_nonzero(unsure.level[asked[inside]] >= band))
        return ReachableArea(
            area=shape,
            rings=rings,
            area_m2=area_of_rings_m2(rings),
            tolerance_m=(SLACK + 0.5) / CUTS * cell_m,
            node_count=reached,
            false_in_frac=(covered - both) / max(covered, 1),
            false_out_frac=(reached - both) / max(reached, 1),
            off_road_m=_off_road_cells(cell_m) * cell_m,
            cell_m=cell_m,
        )


def _roads(graph: RoadGraph) -> RoadLines:
    return RoadLines(
        graph.tail,
        graph.head,
        graph.length_m,
        graph.reverse_idx,
        graph.geometry_first,
        graph.geometry_lon_e7,
        graph.geometry_lat_e7,
    )


def _energies(reached: RoadEnergies) -> Energies:
    by_node = reached.tail_energy_j is None or reached.head_energy_j is None
    return Energies(
        reached.node_energy_j,
        reached.node_energy_j if reached.tail_energy_j is None else reached.tail_energy_j,
        reached.node_energy_j if reached.head_energy_j is None else reached.head_energy_j,
        reached.from_m,
        reached.to_m,
        reached.most_energy_j,
        by_node,
    )


def _extent_e7(
    roads: RoadLines, energies: dict[int, Energies], budgets: dict[int, NDArray[np.float64]], origin: Point
) -> NDArray[np.int64]:
    """West, south, east, north of the origin and all links in reach of the largest budgets, int64 (4,) [1e-7 deg]."""
    home = np.rint(np.array((origin.lon_deg, origin.lat_deg)) * E7).astype(np.int64)
    extent = np.concatenate((home, home))
    per_lat = 1.2 * E7 / METRE_PER_DEGREE  # with room for lengths that are measured otherwise
    per_m = (per_lat / float(np.cos(np.radians(min(abs(origin.lat_deg) + 5.0, 89.0)))), per_lat)
    for key, found in energies.items():
        widen_extent(roads, found, float(budgets[key][0]), per_m, extent)
    return extent


@dataclass(frozen=True, slots=True)
class _Sheet:
    """What the roads around an origin make of the grid, with one kind of energies.

    key: int32 (rows, columns) of the nearest road, as nearest_roads leaves it. change: as crossings fills it.
    crossing_count: of bands and edges of the grid. within: int64 (3, bands + 1), how many nodes are reached, are
    covered, are both in so many bands at least, as far as the grid tells. unsure: the nodes of which it doesn't.
    """

    key: NDArray[np.int32]
    change: NDArray[np.int32]
    crossing_count: int
    within: NDArray[np.int64]
    unsure: Unsure


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

    def outline(self, sheet: _Sheet, band: int, marks: Marks, rings_before: int) -> AreaRings:
        """A band's rings.

        marks: of the bands drawn before, which had rings_before rings.
        """
        room = sheet.crossing_count
        (x, y), (way, at, low, high) = np.empty((2, room), np.int32), np.empty((4, room), np.uint8)
        walk = Walk(x, y, way, at, low, high)
        rings = Rings(np.empty((room, 2), np.int32), np.empty(room, np.int32), np.empty(room, np.int32))
        outlined = Band(sheet.key, band, _off_road_cells(self.grid.cell_m), SLACK)
        count = put_rings(outlined, sheet.change, marks, rings_before, walk, rings)
        grid = self.grid
        step_e7 = grid.step_lon_e7 // CUTS, grid.step_lat_e7 // CUTS
        shell = rings.shell[:count]
        order = np.argsort(shell, kind="stable")  # the holes of a shell behind it
        lonlat, ring_first = np.empty((int(rings.first[count]) + count, 2)), np.empty(count + 1, np.int64)
        close_rings(rings, order, step_e7, (grid.west_e7, grid.south_e7), lonlat, ring_first)
        return AreaRings(lonlat, ring_first, np.append(np.flatnonzero(shell[order] == order), count))


def _off_road_cells(cell_m: float) -> float:
    return max(OFF_ROAD_M / cell_m, OFF_ROAD_CELLS)


def _rim_cells(cell_m: float) -> int:
    """Grid cells around the roads in reach; a road out of reach farther off is nowhere in the area the nearer one."""
    return int(np.ceil(2.0 * _off_road_cells(cell_m))) + 2


def area_of_rings_m2(rings: AreaRings) -> float:
    """Area on the mean sphere, by Lambert's cylindrical equal-area projection [m²]."""
    lonlat = rings.lonlat
    x, y = np.radians(lonlat[:, 0] - lonlat[0, 0]), np.sin(np.radians(lonlat[:, 1])) - np.sin(np.radians(lonlat[0, 1]))
    twice = (x[:-1] - x[1:]) * (y[:-1] + y[1:])
    twice[rings.ring_first[1:-1] - 1] = 0.0  # from one ring to the next
    return float(0.5 * twice.sum()) * EARTH_RADIUS_M**2
