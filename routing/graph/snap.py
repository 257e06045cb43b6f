"""Where a coordinate meets the road network."""

from __future__ import annotations

import threading
from typing import TYPE_CHECKING, Final

import numpy as np
import shapely

from routing.errors import PointFarFromRoadError, PointOutsideMapError
from routing.graph.earth import METRE_PER_DEGREE
from routing.graph.nearest import RoadTree
from routing.places import LinkPosition, Point, SnappedPoint

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from routing.graph.kernels_nearest import Boxes
    from routing.graph.road_graph import RoadGraph

END_MARGIN_M: Final = 0.01  # a snapped place keeps this far from a link's ends, so that it is on one link only


class RoadIndex:
    """A spatial index of the roads of one graph; safe to share between threads, built at the first question."""

    def __init__(self, graph: RoadGraph) -> None:
        self._graph = graph
        self._lock = threading.Lock()
        self._tree: RoadTree | None = None

    def _indexed(self) -> RoadTree:
        with self._lock:
            if self._tree is None:
                self._tree = RoadTree(self._graph)
            return self._tree

    @property
    def boxes(self) -> Boxes:
        """The roads in boxes, near ones side by side."""
        return self._indexed().boxes

    def snap(self, field: str, point: Point, limit_m: float) -> tuple[SnappedPoint, tuple[LinkPosition, ...]]:
        """The nearest place on a road, and its position on each direction of that road.

        Raises PointOutsideMapError outside the map's bounds, PointFarFromRoadError beyond limit_m.
        """
        west, south, east, north = self._graph.meta.bbox
        if not (south <= point.lat_deg <= north and west <= point.lon_deg <= east):
            raise PointOutsideMapError(field, point.lat_deg, point.lon_deg, self._graph.meta.bbox)
        link_idx = self._indexed().nearest(point)
        offset_m, distance_m, on_road = self._project(link_idx, point)
        if distance_m > limit_m:
            raise PointFarFromRoadError(field, point.lat_deg, point.lon_deg, distance_m, limit_m)
        length_m = float(self._graph.length_m[link_idx])
        margin = min(END_MARGIN_M, 0.25 * length_m)
        offset_m = min(max(offset_m, margin), length_m - margin)
        positions = [LinkPosition(link_idx, offset_m)]
        reverse = int(self._graph.reverse_idx[link_idx])
        if reverse >= 0:
            positions.append(LinkPosition(reverse, length_m - offset_m))
        name = self._graph.names[int(self._graph.name_idx[link_idx])]
        return SnappedPoint(point, on_road, distance_m, link_idx, offset_m, name), tuple(positions)

    def _project(self, link_idx: int, point: Point) -> tuple[float, float, Point]:
        """Offset along a link, distance to it and the place on it, in a plane that touches the earth at the point."""
        lonlat = self._graph.geometry(link_idx)
        scale = np.array((METRE_PER_DEGREE * np.cos(np.radians(point.lat_deg)), METRE_PER_DEGREE))
        line = shapely.LineString((lonlat - (point.lon_deg, point.lat_deg)) * scale)
        share = line.project(shapely.Point(0.0, 0.0), normalized=True)
        foot = line.interpolate(share, normalized=True)
        place = Point(point.lat_deg + foot.y / float(scale[1]), point.lon_deg + foot.x / float(scale[0]))
        return share * float(self._graph.length_m[link_idx]), float(np.hypot(foot.x, foot.y)), place


def part_of_line(lonlat: NDArray[np.float64], from_frac: float, to_frac: float) -> NDArray[np.float64]:
    """The stretch of a polyline between two shares of its length, float64 (k, 2), at least two points."""
    if from_frac <= 0.0 and to_frac >= 1.0:
        return lonlat
    shrink = np.cos(np.radians(lonlat[:, 1].mean()))
    step = np.hypot(np.diff(lonlat[:, 0]) * shrink, np.diff(lonlat[:, 1]))
    along = np.concatenate(([0.0], np.cumsum(step)))
    low, high = from_frac * along[-1], to_frac * along[-1]
    inside = (along > low) & (along < high)
    at = np.concatenate(([low], along[inside], [high]))
    return np.column_stack((np.interp(at, along, lonlat[:, 0]), np.interp(at, along, lonlat[:, 1])))
