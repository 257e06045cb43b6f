"""Whether a way over roads beyond the map could be as short as a route."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

import numpy as np

from routing.graph.earth import great_circle_m
from routing.numerals import decimals_apart

if TYPE_CHECKING:
    from collections.abc import Sequence

    from routing.graph.rim import MapRim
    from routing.graph.road_graph import RoadGraph
    from routing.places import Point
    from routing.route.route import Route

FIRST_ENDS: Final = 64  # of these, looked at before the others
MOST_ENDS: Final = 1000  # cut roads looked at in pairs, those of the shortest detours


def beyond_map_m(graph: RoadGraph, rim: MapRim, start: Point, goal: Point, longest_m: float) -> float:
    """The least that a way may have that leaves the map at one cut road and comes back at another, inf where ≥ longest.

    In straight lines, so roads beyond the map make it longer.
    """
    ends = rim.node_idx
    lat_deg, lon_deg = graph.node_lat_deg[ends], graph.node_lon_deg[ends]
    out_m = great_circle_m(start.lat_deg, start.lon_deg, lat_deg, lon_deg)
    back_m = great_circle_m(lat_deg, lon_deg, goal.lat_deg, goal.lon_deg)
    near = np.flatnonzero(out_m + back_m < longest_m)  # no other can be on such a way
    near = near[np.argsort((out_m + back_m)[near], kind="stable")[:MOST_ENDS]]
    if near.size < 2:
        return math.inf
    detour_m = (out_m + back_m)[near]
    count = min(FIRST_ENDS, near.size)
    while True:
        here = near[:count]
        outside_m = great_circle_m(lat_deg[here, None], lon_deg[here, None], lat_deg[here], lon_deg[here])
        np.fill_diagonal(outside_m, np.inf)
        least_m = float((out_m[here, None] + outside_m + back_m[here]).min())
        # a way over an end is no shorter than the detour to it: ends that lie farther off are on no shorter one
        needed = int(np.searchsorted(detour_m, least_m))
        if needed <= count:
            return least_m if least_m < longest_m else math.inf
        count = min(needed, 4 * count)


def beyond_map_warnings(
    graph: RoadGraph, rim: MapRim, places: Sequence[Point], routes: Sequence[Route]
) -> tuple[str, ...]:
    """A warning where any route, or a leg of it, could be beaten beyond the map; places: start, via points, goal."""
    for route in routes:
        for leg, start, goal in zip(route.legs, places[:-1], places[1:], strict=False):
            driven_m = leg.to_m - leg.from_m
            least_m = beyond_map_m(graph, rim, start, goal, driven_m)
            if least_m < driven_m:
                decimals = decimals_apart(least_m / 1000.0, driven_m / 1000.0, 1)
                return (
                    f"the best way may leave this map: route {route.name!r} has {driven_m / 1000.0:.{decimals}f} km "
                    f"where a way over roads that the map cuts off could have {least_m / 1000.0:.{decimals}f} km or "
                    "more; roads beyond are not known",
                )
    return ()
