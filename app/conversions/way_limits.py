"""How fast and how steep ways are: what some of them in sum has."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np
import shapely

from energy.force.effects import drive_of
from energy.units import KMH_PER_MPS

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray
    from shapely import MultiPolygon

    from app.conversions.course import Course
    from energy.conditions import Conditions
    from energy.vehicle.files import AnyVehicle
    from routing.graph.road_graph import RoadGraph
    from routing.route.route import Route

OVER_M: Final = 200.0  # of way in sum that has to be as fast or as steep; heights of recordings are smoothed over it
AREA_FRAC: Final = 0.01  # of an area's links, likewise: somewhere in a large one it is always steep
MOST_NODES: Final = 20_000  # of an area that are looked at, a tenth of a second; a share of links needs no more


@dataclass(frozen=True, slots=True)
class WayLimits:
    """The fastest speed [km/h], the lowest and the highest grade (rise over length) that some of a way has."""

    speed_kmh: float
    grade: tuple[float, float]


def held(values: NDArray[np.float64], weights: NDArray[np.float64], least: float) -> float:
    """The highest value that is reached or exceeded for `least` in sum, float64 (n,) each, n ≥ 1; weights ≥ 0."""
    falling = np.argsort(values)[::-1]
    sums = np.cumsum(weights[falling])
    at = int(np.searchsorted(sums, least))
    return float(values[falling[min(at, falling.size - 1)]])


def way_limits(
    length_m: NDArray[np.float64],
    grade_frac: NDArray[np.float64],
    driven_mps: NDArray[np.float64],
    over_m: float = OVER_M,
) -> WayLimits | None:
    """What over_m of links in sum have, float64 (n,) each, half of them where they are short; None of no links."""
    if length_m.size == 0:
        return None
    over_m = min(over_m, 0.5 * float(length_m.sum()))
    fastest = held(driven_mps, length_m, over_m)
    low, high = -held(-grade_frac, length_m, over_m), held(grade_frac, length_m, over_m)
    return WayLimits(KMH_PER_MPS * fastest, (low, high))


def route_limits(routes: Sequence[Route], vehicle: AnyVehicle, conditions: Conditions) -> WayLimits | None:
    """What the fastest and the steepest of some routes have; None where nothing is driven."""
    drive = drive_of(vehicle, conditions)
    found = []
    for route in routes:
        links = route.links
        length_m = np.subtract(links.to_m, links.from_m)
        limits = way_limits(length_m, np.array(links.grade_frac), drive.driven_mps(np.array(links.speed_limit_mps)))
        found += [] if limits is None else [limits]
    if not found:
        return None
    lows, highs = zip(*(limits.grade for limits in found), strict=True)
    return WayLimits(max(limits.speed_kmh for limits in found), (min(lows), max(highs)))


def course_limits(course: Course) -> WayLimits | None:
    """What a course has."""
    chain = course.chain
    driven_mps = drive_of(course.vehicle, course.conditions).driven_mps(chain.speed_limit_mps)
    return way_limits(chain.length_m, chain.grade_frac, driven_mps)


def area_limits(
    area: MultiPolygon, graph: RoadGraph, vehicle: AnyVehicle, conditions: Conditions, most_nodes: int = MOST_NODES
) -> WayLimits | None:
    """What the links that begin within an area have, of one with many nodes a sample; None where there are none."""
    if area.is_empty:
        return None
    west, south, east, north = area.bounds
    lon, lat = graph.node_lon_deg, graph.node_lat_deg
    near = np.flatnonzero((lon >= west) & (lon <= east) & (lat >= south) & (lat <= north))
    near = near[:: -(-near.size // most_nodes) or 1]
    shapely.prepare(area)
    inside = np.zeros(graph.node_count, np.bool_)
    inside[near] = shapely.contains_xy(area, lon[near], lat[near])
    links = np.flatnonzero(inside[graph.tail])
    length_m = graph.length_m[links]
    grade_frac = np.clip(graph.climb_m(links) / length_m, -1.0, 1.0)
    driven_mps = drive_of(vehicle, conditions).driven_mps(graph.limit_mps(conditions)[links])
    return way_limits(length_m, grade_frac, driven_mps, max(OVER_M, AREA_FRAC * float(length_m.sum())))
