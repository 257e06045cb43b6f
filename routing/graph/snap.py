"""Where a coordinate meets the road network."""

from __future__ import annotations

import math
import threading
from typing import TYPE_CHECKING, Final

import numpy as np

from routing.errors import NearestRoad, PointFarFromRoadError, PointOutsideMapError
from routing.graph.earth import great_circle_m
from routing.graph.nearest import RoadTree
from routing.places import LinkPosition, Point, SnappedPoint

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from routing.graph.kernels_nearest import Boxes
    from routing.graph.road_graph import RoadGraph

END_MARGIN_M: Final = 0.01  # a snapped place keeps this far from a link's ends, so that it is on one link only

NEAR_M: Final = 100.0  # to a road, within which a place is moved there without a word; assumed
NAMED_M: Final = 50_000.0  # a refused place so far from the map at most is told its nearest road; assumed
FLAT_M: Final = 200_000.0  # within which the plane that touches the earth at a place does for distances from it


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

        A place outside the map's bounds is taken as well where a road is near. Raises PointOutsideMapError outside the
        bounds, PointFarFromRoadError inside, beyond limit_m of any road.
        """
        west, south, east, north = bbox = self._graph.meta.bbox
        lat, lon = point.lat_deg, point.lon_deg
        here = beside(point, bbox)
        inside = south <= lat <= north and west <= here.lon_deg <= east
        away_m = beyond_m(point, bbox)
        if not inside and not away_m <= min(max(limit_m, NAMED_M), FLAT_M):
            raise self._outside(field, point, limit_m)
        roads = self._indexed()
        link_idx = roads.nearest(here)
        share, distance_m, on_road = roads.foot(link_idx, here)
        name = self._graph.names[int(self._graph.name_idx[link_idx])]
        if distance_m > limit_m:
            nearest = NearestRoad(distance_m, name, on_road.lat_deg, on_road.lon_deg)
            if inside:
                raise PointFarFromRoadError(field, lat, lon, nearest, limit_m)
            raise self._outside(field, point, limit_m, nearest)
        length_m = float(self._graph.length_m[link_idx])
        margin = min(END_MARGIN_M, 0.25 * length_m)
        offset_m = min(max(share * length_m, margin), length_m - margin)
        positions = [LinkPosition(link_idx, offset_m)]
        reverse = int(self._graph.reverse_idx[link_idx])
        if reverse >= 0:
            positions.append(LinkPosition(reverse, length_m - offset_m))
        for place in tuple(positions):  # who may not go on as others arrives on a copy
            positions += [LinkPosition(copy, place.offset_m) for copy in self._graph.copies_of(place.link_idx)]
        return SnappedPoint(point, on_road, distance_m, link_idx, offset_m, name), tuple(positions)

    def near(self, field: str, point: Point, limit_m: float, count: int) -> list[SnappedPoint]:
        """The nearest place on each of the nearest roads, at most count, the nearest first and none beyond limit_m.

        Raises as snap does, where no road is so near.
        """
        nearest = self.snap(field, point, limit_m)[0]
        here, roads = beside(point, self._graph.meta.bbox), self._indexed()
        places = [nearest]
        for link_idx in roads.near(here, count):
            share, distance_m, on_road = roads.foot(link_idx, here)
            if link_idx == nearest.link_idx or distance_m > limit_m or len(places) == count:
                continue
            offset_m = share * float(self._graph.length_m[link_idx])
            name = self._graph.names[int(self._graph.name_idx[link_idx])]
            places.append(SnappedPoint(point, on_road, distance_m, link_idx, offset_m, name))
        return places

    def _outside(
        self, field: str, point: Point, limit_m: float, nearest: NearestRoad | None = None
    ) -> PointOutsideMapError:
        meta, lat, lon = self._graph.meta, point.lat_deg, point.lon_deg
        return PointOutsideMapError(
            field,
            lat,
            lon,
            meta.bbox,
            nearest,
            whose=f"graph {meta.name!r}",
            away_m=beyond_m(point, meta.bbox),
            swapped=beyond_m(Point(lon, lat), meta.bbox) <= limit_m,
        )


def beside(point: Point, bbox: tuple[float, float, float, float]) -> Point:
    """A place on a map's side of the antimeridian: beyond ±180° where it lies there from the map's middle."""
    middle_deg = 0.5 * (bbox[0] + bbox[2])
    if not 180.0 < abs(point.lon_deg - middle_deg) < math.inf:
        return point
    return Point(point.lat_deg, middle_deg + math.remainder(point.lon_deg - middle_deg, 360.0))


def beyond_m(point: Point, bbox: tuple[float, float, float, float]) -> float:
    """How far a place is from a map's bounds, west, south, east, north [deg]: in m; infinite for what is no place."""
    if not (math.isfinite(point.lat_deg) and math.isfinite(point.lon_deg)):
        return math.inf
    west, south, east, north = bbox
    here = beside(point, bbox)
    lat, lon = min(max(point.lat_deg, south), north), min(max(here.lon_deg, west), east)
    if lat == point.lat_deg and lon == here.lon_deg:
        return 0.0
    return float(great_circle_m(point.lat_deg, point.lon_deg, lat, lon))


def moved_warnings(fields: Sequence[str], points: Sequence[SnappedPoint]) -> tuple[str, ...]:
    """What is to be said of places that are far off the road that they were moved to, by their fields."""
    return tuple(
        f"{field} is {point.distance_m:.0f} m from the nearest road{f' {point.road_name!r}' if point.road_name else ''}"
        " and was moved there"
        for field, point in zip(fields, points, strict=True)
        if point.distance_m > NEAR_M
    )


def place_on_road(graph: RoadGraph, asked: Point, place: LinkPosition) -> SnappedPoint:
    """A place that was asked for, met at a given place on a road, such as that of a station."""
    there = road_point(graph, place)
    name = graph.names[int(graph.name_idx[place.link_idx])]
    away_m = float(great_circle_m(asked.lat_deg, asked.lon_deg, there.lat_deg, there.lon_deg))
    return SnappedPoint(asked, there, away_m, place.link_idx, place.offset_m, name)


def road_point(graph: RoadGraph, place: LinkPosition) -> Point:
    """Where a place on a link is on the map."""
    share = min(max(place.offset_m / float(graph.length_m[place.link_idx]), 1e-9), 1.0)
    lon, lat = part_of_line(graph.geometry(place.link_idx), 0.0, share)[-1].tolist()
    return Point(lat, lon)


def part_of_line(lonlat: NDArray[np.float64], from_frac: float, to_frac: float) -> NDArray[np.float64]:
    """The stretch of a polyline between two shares of its length, float64 (k, 2), at least two points."""
    if from_frac <= 0.0 and to_frac >= 1.0:
        return lonlat
    lon, lat = lonlat[:, 0], lonlat[:, 1]
    shrink = np.cos(np.radians(lat.mean()))
    along = np.zeros(lon.size)
    np.cumsum(np.hypot((lon[1:] - lon[:-1]) * shrink, lat[1:] - lat[:-1]), out=along[1:])
    low, high = from_frac * along[-1], to_frac * along[-1]
    at = np.array((low, *along[(along > low) & (along < high)].tolist(), high))
    part = np.empty((at.size, 2))
    part[:, 0], part[:, 1] = np.interp(at, along, lon), np.interp(at, along, lat)
    return part
