"""The roads of a graph in a tree of boxes, for finding the nearest one to a place."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from routing.graph.earth import E7, METRE_PER_DEGREE
from routing.graph.kernels_nearest import FAN, Boxes, Lines, foot_on_line, nearest_link
from routing.places import Point

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from routing.graph.road_graph import RoadGraph

CURVE_BITS: Final = 16  # of a place along each axis, for the order of roads


class RoadTree:
    """The roads of one graph by place, made in O(R log R + G) for R roads with G points; read-only afterwards."""

    def __init__(self, graph: RoadGraph) -> None:
        self.boxes = _packed(graph)
        self._lines = Lines(graph.geometry_first, graph.geometry_lon_e7, graph.geometry_lat_e7)

    def foot(self, link: int, point: Point) -> tuple[float, float, Point]:
        """The place on a link's line that is nearest to a point: share of the line up to it, how far it is [m], it.

        In the plane that touches the earth at the point.
        """
        east_m, north_m = METRE_PER_DEGREE * float(np.cos(np.radians(point.lat_deg))), METRE_PER_DEGREE
        share, east, north = foot_on_line(self._lines, link, point.lon_deg, point.lat_deg, east_m, north_m)
        place = Point(point.lat_deg + north / north_m, point.lon_deg + east / east_m)
        return float(share), float(np.hypot(east, north)), place

    def nearest(self, point: Point) -> int:
        """The link of the nearest road, of those equally near the one of the least number.

        Equally near are roads whose distances differ by at most TIE_M. Distances are those in the plane that touches
        the earth at the point.
        """
        east_m = METRE_PER_DEGREE * float(np.cos(np.radians(point.lat_deg)))
        return int(nearest_link(self.boxes, self._lines, point.lon_deg, point.lat_deg, east_m, METRE_PER_DEGREE))

    def near(self, point: Point, count: int) -> list[int]:
        """Links of the roads nearest to a point, at most count, the nearest first; in O(R).

        Distances are those to the boxes of roads first, so that only roads that may be among them are looked at.
        """
        east_m = METRE_PER_DEGREE * float(np.cos(np.radians(point.lat_deg)))
        box = self.boxes.box[: self.boxes.road.size] / E7
        low, high = np.array((point.lon_deg, point.lat_deg)) - box[:, 2:], box[:, :2] - (point.lon_deg, point.lat_deg)
        away_m = np.hypot(*(np.maximum(np.maximum(low, high), 0.0) * (east_m, METRE_PER_DEGREE)).T)
        found: list[tuple[float, int]] = []
        for k in np.argsort(away_m, kind="stable").tolist():
            if len(found) >= count and away_m[k] > found[count - 1][0]:
                break
            link = int(self.boxes.road[k])
            found = sorted([*found, (self.foot(link, point)[1], link)])[:count]
        return [link for _, link in found]


def _packed(graph: RoadGraph) -> Boxes:
    """Boxes around the roads of a graph; one direction of a two-way road is enough, no ferries, no copies."""
    link = np.arange(graph.link_count, dtype=np.int32)
    road = link[((graph.reverse_idx < 0) | (link < graph.reverse_idx)) & ~graph.is_ferry() & ~graph.is_copy()]
    box = np.empty((road.size, 4), np.int32)
    begin = graph.geometry_first[:-1]
    for column, line in enumerate((graph.geometry_lon_e7, graph.geometry_lat_e7)):
        box[:, column] = np.minimum.reduceat(line, begin)[road]
        box[:, column + 2] = np.maximum.reduceat(line, begin)[road]
    order = np.argsort(_curve_place(box), kind="stable")
    levels = [box[order]]
    while levels[-1].shape[0] > 1:
        first = np.arange(0, levels[-1].shape[0], FAN)
        low = np.minimum.reduceat(levels[-1][:, :2], first)
        levels.append(np.hstack((low, np.maximum.reduceat(levels[-1][:, 2:], first))))
    sizes = [level.shape[0] for level in levels]
    return Boxes(road[order], np.concatenate(levels), np.concatenate(([0], np.cumsum(sizes))).astype(np.int64))


def _curve_place(box: NDArray[np.int32]) -> NDArray[np.uint32]:
    """Where the middle of boxes lies on a Z-order curve through all of them, uint32 (n,) (Morton 1966)."""
    middle = box[:, :2].astype(np.int64) + box[:, 2:]
    low = middle.min(axis=0)
    step = ((middle.max(axis=0) - low) >> CURVE_BITS) + 1
    cell = ((middle - low) // step).astype(np.uint32)
    for shift, mask in ((8, 0x00FF00FF), (4, 0x0F0F0F0F), (2, 0x33333333), (1, 0x55555555)):
        cell = (cell | (cell << np.uint32(shift))) & np.uint32(mask)
    place: NDArray[np.uint32] = cell[:, 0] | (cell[:, 1] << np.uint32(1))
    return place
