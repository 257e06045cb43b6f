"""Areas on maps that lie on both sides of 180°: drawn half a turn around, where the map is in one piece."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Final

import numpy as np
import shapely
from shapely.geometry.polygon import orient

from routing.graph.earth import E7
from routing.places import Point

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from routing.graph.road_graph import RoadGraph

HALF_TURN_DEG: Final = 180.0
DECIMALS: Final = 7
ROUNDING_DEG: Final = 1e-6  # far above what adding half a turn rounds off
SIDES: Final = ((-1.0, shapely.box(-180.0, -90.0, 0.0, 90.0)), (1.0, shapely.box(0.0, -90.0, 180.0, 90.0)))


def half_turned(graph: RoadGraph) -> RoadGraph:
    """The graph with its places half a turn farther around the earth where it then spans less, else the graph itself.

    So 180° and −180° become 0°.
    """
    turned_deg = _turned(graph.node_lon_deg)
    # of a map on one side both spans are the same, but for how they round
    if graph.node_count == 0 or np.ptp(graph.node_lon_deg) <= np.ptp(turned_deg) + ROUNDING_DEG:
        return graph
    lon_e7 = graph.geometry_lon_e7
    half_e7 = np.int32(HALF_TURN_DEG * E7)
    return replace(
        graph, node_lon_deg=turned_deg, geometry_lon_e7=np.where(lon_e7 > 0, lon_e7 - half_e7, lon_e7 + half_e7)
    )


def half_turned_point(point: Point) -> Point:
    """A place half a turn farther around the earth."""
    return Point(point.lat_deg, float(_turned(np.float64(point.lon_deg))))


def turned_back(drawn: shapely.MultiPolygon) -> shapely.MultiPolygon:
    """An area of the turned graph where it truly is, cut at 180° (RFC 7946, 3.1.9); lon/lat [deg]."""
    parts = [
        orient(part)
        for side, half in SIDES
        for part in _moved(shapely.set_precision(shapely.intersection(drawn, half), 10.0**-DECIMALS), side)
        if isinstance(part, shapely.Polygon) and not part.is_empty
    ]
    return shapely.MultiPolygon(parts)


def turned_back_lines(drawn: shapely.MultiLineString) -> shapely.MultiLineString:
    """Lines of the turned graph where they truly are, cut at 180°; lon/lat [deg]."""
    parts = [
        part
        for side, half in SIDES
        for part in _moved(shapely.intersection(drawn, half), side)
        if isinstance(part, shapely.LineString) and not part.is_empty
    ]
    return shapely.MultiLineString(parts)


def _turned(lon_deg: NDArray[np.float64] | np.float64) -> NDArray[np.float64]:
    return np.where(lon_deg > 0.0, lon_deg - HALF_TURN_DEG, lon_deg + HALF_TURN_DEG)


def _moved(shape: shapely.Geometry, side: float) -> list[shapely.Geometry]:
    """The parts of what lies on one side of 0° in the turned graph, half a turn back."""
    turn = (side * HALF_TURN_DEG, 0.0)
    return list(shapely.get_parts(shapely.transform(shape, lambda lonlat: np.round(lonlat - turn, DECIMALS))))
