"""Where an area ends because the map does, though charge is left."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np
import shapely
from scipy.spatial import cKDTree

from routing.graph.earth import METRE_PER_DEGREE

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from routing.graph.rim import MapRim
    from routing.graph.road_graph import RoadGraph
    from routing.range.area import ReachableArea, RoadEnergies

AROUND: Final = 1.5  # an outline is the map's as far as so many times from a cut road as it lies off roads; assumed
STEPS: Final = 8  # in which an outline's distances are looked at, of the distance at which it lies off roads


@dataclass(frozen=True, slots=True)
class MapEdge:
    """The part of a band's outline that is the map's and not the battery's.

    line: lon/lat [deg]; may be empty where the area reaches farther than the cut road. whole_map: every node of the map
    is reached with charge left, so that the whole outline is the map's. least_energy_j: what the trip to or from a
    place of the rim takes at least, there and back where the band is of round trips.
    """

    line: shapely.MultiLineString
    whole_map: bool
    least_energy_j: float


def map_edge(
    graph: RoadGraph, rim: MapRim, energies: RoadEnergies, budget_j: float, drawn: ReachableArea
) -> MapEdge | None:
    """Where a band of a budget [J] is ended by the map; None where charge is left at no place of its rim."""
    spare = energies.node_energy_j < budget_j
    whole_map = bool(spare.all())
    reached = rim.node & spare
    if whole_map:
        ends = reached if reached.any() else spare
        shells = [polygon.exterior.coords for polygon in drawn.area.geoms]
        return MapEdge(shapely.MultiLineString(shells), True, float(energies.node_energy_j[ends].min()))
    if not reached.any():
        return None
    lines = _near_lines(graph, drawn, np.flatnonzero(reached), np.flatnonzero(~spare))
    return MapEdge(shapely.MultiLineString(lines), False, float(energies.node_energy_j[reached].min()))


def _near_lines(
    graph: RoadGraph, drawn: ReachableArea, ends: NDArray[np.int64], beyond: NDArray[np.int64]
) -> list[NDArray[np.float64]]:
    """The stretches of an area's outline that lie nearer to one of the ends than to any node beyond the charge."""
    middle_deg = float(np.radians(drawn.area.centroid.y))
    scale = METRE_PER_DEGREE * np.array((np.cos(middle_deg), 1.0))
    node_m = np.column_stack((graph.node_lon_deg, graph.node_lat_deg)) * scale
    most_m = AROUND * drawn.off_road_m
    ends_tree, beyond_tree = (cKDTree(node_m[nodes], balanced_tree=False) for nodes in (ends, beyond))
    lines: list[NDArray[np.float64]] = []
    for polygon in drawn.area.geoms:
        for ring in (polygon.exterior, *polygon.interiors):
            step_deg = drawn.off_road_m / STEPS / METRE_PER_DEGREE
            lonlat = shapely.get_coordinates(shapely.segmentize(ring, step_deg))[:-1]
            end_m = np.asarray(ends_tree.query(lonlat * scale, distance_upper_bound=most_m)[0])
            near = np.flatnonzero(np.isfinite(end_m))
            beyond_m = np.asarray(beyond_tree.query(lonlat[near] * scale, distance_upper_bound=most_m)[0])
            mine = np.zeros(len(lonlat), np.bool_)
            mine[near] = end_m[near] <= beyond_m
            lines += _runs(lonlat, mine)
    return lines


def _runs(ring: NDArray[np.float64], mine: NDArray[np.bool_]) -> list[NDArray[np.float64]]:
    """The stretches of a ring, given without its repeated first point, of which all points are marked."""
    if mine.all():
        return [np.vstack((ring, ring[:1]))]
    begin = int(np.flatnonzero(~mine)[0])
    ring, mine = np.roll(ring, -begin, axis=0), np.roll(mine, -begin)
    change = np.flatnonzero(np.diff(np.concatenate((mine, (False,))).astype(np.int8)))
    return [ring[first + 1 : last + 1] for first, last in change.reshape(-1, 2) if last > first + 1]
