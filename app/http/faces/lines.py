"""Lines of routes as other engines send them: with six decimals, cut at legs, simplified for a map."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING, Final

import numpy as np
from shapely import LineString, get_coordinates

from routing.graph.earth import great_circle_m

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from routing.places import SnappedPoint
    from routing.route.route import Route, RouteAnswer

DECIMALS: Final = 6  # 11 cm
SCREEN_POINTS: Final = 1000.0  # along the longer side of a line's box, of which one is not seen


@dataclass(frozen=True, slots=True)
class RouteLine:
    """A route's line, float64 (k, 2) lon, lat [deg], and the rows at which its legs begin and end."""

    lonlat: NDArray[np.float64]
    legs: tuple[tuple[int, int], ...]

    def simplified(self) -> NDArray[np.float64]:
        """The line without what is not seen where it fills a screen; ends of legs are kept."""
        extent = np.ptp(self.lonlat, axis=0).max()
        rows = sorted({0, self.lonlat.shape[0] - 1, *(row for leg in self.legs for row in leg)})
        parts = [self.lonlat[:1]]
        for begin, end in pairwise(rows):
            line = LineString(self.lonlat[begin : end + 1])
            parts.append(get_coordinates(line.simplify(extent / SCREEN_POINTS, preserve_topology=False))[1:])
        return np.concatenate(parts)


def route_line(route: Route, answer: RouteAnswer) -> RouteLine:
    """A route's line; the places asked for lie on it to the last decimal, so that clients find them there."""
    lonlat = route.geometry.round(DECIMALS)
    legs = tuple(leg_rows(route))
    places = places_of(answer)
    if len(legs) == len(places) - 1:
        lonlat[0] = lonlat_of(places[0])
        for (_, end), place in zip(legs, places[1:], strict=True):
            lonlat[end] = lonlat_of(place)
    return RouteLine(lonlat, legs)


def leg_rows(route: Route) -> list[tuple[int, int]]:
    """First and last row of the geometry for each leg, the same where nothing is driven."""
    ends = route.links.geometry_end_idx
    rows, at = [], 0
    for leg in route.legs:
        end = at if leg.last_link is None else ends[leg.last_link]
        rows.append((at, end))
        at = end
    return rows


def places_of(answer: RouteAnswer) -> tuple[SnappedPoint, ...]:
    """The places asked for, in their order."""
    return (answer.start, *answer.via, answer.goal)


def lonlat_of(place: SnappedPoint) -> list[float]:
    """Where a place met the road: longitude, latitude [deg]."""
    return [round(place.on_road.lon_deg, DECIMALS), round(place.on_road.lat_deg, DECIMALS)]


def lonlat(at: tuple[float, float]) -> list[float]:
    """Longitude and latitude of a place by latitude and longitude [deg]."""
    return [round(at[1], DECIMALS), round(at[0], DECIMALS)]


def distinct(routes: Sequence[Route]) -> list[Route]:
    """Routes without those that drive the same links as one before them."""
    seen: list[list[int]] = []
    kept = []
    for route in routes:
        if route.links.link_idx not in seen:
            seen.append(route.links.link_idx)
            kept.append(route)
    return kept


def heights_along(route: Route) -> NDArray[np.float64]:
    """Height of the road at each point of a route's geometry [m], float64 (k,), straight between ends of links."""
    links, line = route.links, route.geometry
    if len(links) == 0:
        return np.full(line.shape[0], route.height_start_m)
    step_m = np.asarray(great_circle_m(line[:-1, 1], line[:-1, 0], line[1:, 1], line[1:, 0]), np.float64)
    along_m = np.concatenate(([0.0], np.cumsum(step_m)))
    rows = np.concatenate(([0], links.geometry_end_idx))
    return np.interp(along_m, along_m[rows], np.concatenate(([route.height_start_m], links.height_end_m)))


def box_of(lonlat: NDArray[np.float64]) -> list[float]:
    """West, south, east, north [deg] of a line."""
    return [*lonlat.min(axis=0).tolist(), *lonlat.max(axis=0).tolist()]
