"""Polygons around the roads that a charge can reach, by contouring a field of distances on a grid."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING, Final

import numpy as np
import shapely
from contourpy import FillType, contour_generator
from scipy.ndimage import distance_transform_edt
from shapely.geometry.polygon import orient

from routing.graph import E7, EARTH_RADIUS_M

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from routing.graph import RoadGraph
    from routing.query import Point
    from routing.search import Reach

METRE_PER_DEGREE: Final = EARTH_RADIUS_M * np.pi / 180.0
GRID_CELLS: Final = 800  # along the longer side, at most; half as many at least where cells are not at their least
LEAST_CELL_M: Final = 20.0
OFF_ROAD_CELLS: Final = 3.0  # the area reaches this far off a road,
OFF_ROAD_M: Final = 400.0  # at least and at most these two
COORDINATE_DECIMALS: Final = 6  # 0.1 m


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
    Lon/lat [deg].
    """
    samples = {id(reached): _road_samples(graph, reached) for reached, _ in cases}
    lonlat = next(iter(samples.values()))[0]
    inside = [samples[id(reached)][1] <= budget for reached, budget in cases]
    frame = _Frame.around(origin, lonlat[np.logical_or.reduce(inside)])
    cell, offset = frame.cells_of(lonlat)
    seen = np.all((cell >= 0) & (cell < frame.shape), axis=1)
    cell, offset = cell[seen], offset[seen]
    node_lonlat = np.column_stack((graph.node_lon_deg, graph.node_lat_deg))
    areas: list[ReachableArea] = []
    spot = frame.spot(origin)  # in every band, so that they stay nested
    for (reached, budget), within in zip(cases, inside, strict=True):
        shape = _rounded(frame.polygons(_field(frame, cell, offset, within[seen])).union(spot))
        reachable = reached.node_energy_j <= budget
        shapely.prepare(shape)
        covered = shapely.contains_xy(shape, node_lonlat[:, 0], node_lonlat[:, 1])
        areas.append(
            ReachableArea(
                area=shape,
                area_m2=_area_m2(shape),
                node_count=int(reachable.sum()),
                false_in_frac=float((covered & ~reachable).sum() / max(covered.sum(), 1)),
                false_out_frac=float((reachable & ~covered).sum() / max(reachable.sum(), 1)),
            )
        )
    return tuple(areas)


def _road_samples(graph: RoadGraph, reached: RoadEnergies) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Places on roads (S, 2) lon/lat [deg] and the least energy that they take (S,) [J], inf where out of reach.

    Nodes are exact; between them the energy is taken as linear, up to where the link can be driven at all.
    """
    spacing_m = 60.0
    forward = np.flatnonzero((graph.reverse_idx < 0) | (np.arange(graph.link_count) < graph.reverse_idx))
    count = np.floor(graph.length_m[forward] / spacing_m).astype(np.int64)
    road = np.repeat(forward, count)
    number = np.arange(road.size) - np.repeat(np.cumsum(count) - count, count)
    share = (number + 1.0) / (np.repeat(count, count) + 1.0)
    lon, lat = graph.geometry_lon_e7 / E7, graph.geometry_lat_e7 / E7
    shrink = np.cos(np.radians(lat.mean()))
    along = np.concatenate(([0.0], np.cumsum(np.hypot(np.diff(lon) * shrink, np.diff(lat)))))
    begin, end = along[graph.geometry_first[road]], along[graph.geometry_first[road + 1] - 1]
    at = begin + share * (end - begin)
    energy = _energy_along(graph, reached, road, share)
    reverse = graph.reverse_idx[road]
    both = reverse >= 0
    energy[both] = np.minimum(
        energy[both], _energy_along(graph, reached, reverse[both].astype(np.int64), 1.0 - share[both])
    )
    lonlat = np.column_stack((np.interp(at, along, lon), np.interp(at, along, lat)))
    nodes = np.column_stack((graph.node_lon_deg, graph.node_lat_deg))
    return np.concatenate((nodes, lonlat)), np.concatenate((reached.node_energy_j, energy))


def _energy_along(
    graph: RoadGraph, reached: RoadEnergies, link: NDArray[np.int64], share: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Least energy at a share of a link's length [J], inf off the stretch for which the charge suffices."""
    begin_m, end_m, length_m = reached.from_m[link], reached.to_m[link], graph.length_m[link]
    tail, head = reached.tail_energy_j[link], reached.head_energy_j[link]
    # where the stretch ends within the link, all that there is is taken
    begin = np.where(begin_m > 0.0, reached.most_energy_j, tail)
    end = np.where(end_m < length_m, reached.most_energy_j, head)
    at_m = share * length_m
    with np.errstate(invalid="ignore", divide="ignore"):
        energy = begin + (at_m - begin_m) / (end_m - begin_m) * (end - begin)
    # a start on the link itself may leave one end of it out of reach
    energy = np.where(np.isfinite(energy), energy, np.where(np.isfinite(begin), begin, end))
    return np.where((at_m >= begin_m) & (at_m <= end_m), energy, np.inf)


@dataclass(frozen=True, slots=True)
class _Frame:
    """A regular grid over the reachable part of the map; west, south is the centre of cell (0, 0).

    The origin of the range is the centre of a cell, and cells are as large as a step of a ladder says: whatever the
    charge, places fall into the same cells, or else an area would jump to and fro as the charge grows.
    """

    west_deg: float
    south_deg: float
    step_lon_deg: float
    step_lat_deg: float
    cell_m: float
    shape: tuple[int, int]  # columns, rows

    @classmethod
    def around(cls, origin: Point, lonlat: NDArray[np.float64]) -> _Frame:
        home = np.array((origin.lon_deg, origin.lat_deg))
        per_deg = METRE_PER_DEGREE * np.array((np.cos(np.radians(origin.lat_deg)), 1.0))
        places = np.vstack((home, lonlat))
        low_m, high_m = (places.min(axis=0) - home) * per_deg, (places.max(axis=0) - home) * per_deg
        size_m = float((high_m - low_m).max())
        cell = LEAST_CELL_M * 2.0 ** max(0, int(np.ceil(np.log2(max(size_m, 1.0) / (GRID_CELLS * LEAST_CELL_M)))))
        # a road out of reach farther off than twice the rim of the area is nowhere in it the nearer one
        rim = int(np.ceil(2.0 * _off_road_m(cell) / cell)) + 2
        before = np.ceil(-low_m / cell).astype(np.int64) + rim
        after = np.ceil(high_m / cell).astype(np.int64) + rim
        west, south = (home - before * cell / per_deg).tolist()
        step_lon, step_lat = (cell / per_deg).tolist()
        columns, rows = (before + after + 1).tolist()
        return cls(west, south, step_lon, step_lat, cell, (columns, rows))

    def cells_of(self, lonlat: NDArray[np.float64]) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
        """Column and row (S, 2) of places, and their distance to the cell's centre (S,) in cells."""
        place = (lonlat - (self.west_deg, self.south_deg)) / (self.step_lon_deg, self.step_lat_deg)
        cell = np.rint(place)
        return cell.astype(np.int64), np.hypot(*(place - cell).T)

    def spot(self, place: Point) -> shapely.Polygon:
        """A small polygon around a place, half a cell wide."""
        angle = np.arange(12) * np.pi / 6.0
        ring = np.column_stack((np.cos(angle) * self.step_lon_deg, np.sin(angle) * self.step_lat_deg)) * 0.5
        return shapely.Polygon(np.add(ring, (place.lon_deg, place.lat_deg)))

    def polygons(self, field: NDArray[np.float64]) -> shapely.MultiPolygon:
        """Where a field (rows, columns) is above zero."""
        contours = contour_generator(z=field, fill_type=FillType.OuterOffset).filled(0.0, np.inf)
        scale, corner = (self.step_lon_deg, self.step_lat_deg), (self.west_deg, self.south_deg)
        polygons = []
        for points, offsets in zip(*contours, strict=True):
            rings = [points[a:b] * scale + corner for a, b in pairwise(offsets)]
            polygons.append(shapely.Polygon(rings[0], rings[1:]))
        return _multi(shapely.make_valid(shapely.MultiPolygon(polygons), method="structure"))


def _off_road_m(cell_m: float) -> float:
    return max(OFF_ROAD_M, OFF_ROAD_CELLS * cell_m)


def _field(
    frame: _Frame, cell: NDArray[np.int64], offset: NDArray[np.float64], inside: NDArray[np.bool_]
) -> NDArray[np.float64]:
    """Distance to the nearest road out of reach less that to the nearest one in reach, (rows, columns) [m]."""
    columns, rows = frame.shape
    flat = cell[:, 1] * columns + cell[:, 0]
    # of the places in one cell the one nearest to its centre speaks for it
    order = np.lexsort((offset, flat))
    first = np.ones(order.size, bool)
    first[1:] = flat[order][1:] != flat[order][:-1]
    chosen = order[first]
    reach = np.zeros(rows * columns, bool)
    beyond = np.zeros(rows * columns, bool)
    reach[flat[chosen]] = inside[chosen]
    beyond[flat[chosen]] = ~inside[chosen]
    most = _off_road_m(frame.cell_m)
    if not reach.any():
        return np.full((rows, columns), -most)
    to_reach = distance_transform_edt(~reach.reshape(rows, columns), sampling=frame.cell_m)
    field = most - to_reach
    if beyond.any():
        to_beyond = distance_transform_edt(~beyond.reshape(rows, columns), sampling=frame.cell_m)
        field = np.minimum(field, to_beyond - to_reach)
    return np.asarray(field, np.float64)


def _multi(shape: shapely.Geometry) -> shapely.MultiPolygon:
    """The polygons of any geometry, shells counter-clockwise."""
    parts = [p for p in shapely.get_parts(shape).tolist() if isinstance(p, shapely.Polygon) and not p.is_empty]
    nested = [q for p in shapely.get_parts(shape).tolist() if isinstance(p, shapely.MultiPolygon) for q in p.geoms]
    return shapely.MultiPolygon([orient(p) for p in [*parts, *nested]])


def _rounded(shape: shapely.Geometry) -> shapely.MultiPolygon:
    return _multi(shapely.set_precision(shape, 10.0**-COORDINATE_DECIMALS))


def _area_m2(shape: shapely.MultiPolygon) -> float:
    """Area on the mean sphere, by Lambert's cylindrical equal-area projection [m²]."""

    def equal_area(lonlat: NDArray[np.float64]) -> NDArray[np.float64]:
        return np.column_stack((np.radians(lonlat[:, 0]), np.sin(np.radians(lonlat[:, 1])))) * EARTH_RADIUS_M

    return float(shapely.transform(shape, equal_area).area)
