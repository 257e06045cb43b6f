"""A route as a track: where the vehicle is, how high and when, point by point."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from typing import TYPE_CHECKING

import numpy as np

from routing.graph.earth import great_circle_m
from routing.route.route import LegEnd

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from routing.charging.plan import Plan
    from routing.route.route import Route


@dataclass(frozen=True, slots=True)
class Track:
    """Points of a line: float64 (P,) degrees, heights above sea [m] and time since departure [s], which never falls.

    At a charging stop there are two points at the same place, on arrival and on departure.
    """

    lon_deg: NDArray[np.float64]
    lat_deg: NDArray[np.float64]
    height_m: NDArray[np.float64]
    time_s: NDArray[np.float64]


def track_of(route: Route, plan: Plan | None) -> Track:
    """The track of a route; plan: its charging stops, at which time passes.

    Heights and times at the ends of links are those of the answer. Between them, along a link, a height rises evenly,
    as the model has it, and speed is taken to be even, which it is not.
    """
    lon, lat = route.geometry.T
    step_m = np.asarray(great_circle_m(lat[:-1], lon[:-1], lat[1:], lon[1:]))
    along_m = np.concatenate((np.zeros(1), np.cumsum(step_m)))
    end = np.asarray(route.links.geometry_end_idx, np.int64)
    at_m = np.concatenate((np.zeros(1), along_m[end]))
    height = np.interp(along_m, at_m, np.concatenate(([route.height_start_m], route.links.height_end_m)))
    time = np.interp(along_m, at_m, np.concatenate((np.zeros(1), np.cumsum(route.links.results.duration_s))))
    points = np.column_stack((lon, lat, height, time))
    for position, pause_s in reversed(_pauses(route, plan)):
        behind = points[position:].copy()
        behind[:, 3] += pause_s
        points = np.concatenate((points[: position + 1], behind))
    return Track(*points.T)


def _pauses(route: Route, plan: Plan | None) -> list[tuple[int, float]]:
    """For each charging stop where in the line it is, and how long it takes [s]."""
    if plan is None:
        return []
    stops = iter(plan.stops)
    pauses, position = [], 0
    for leg in route.legs:
        if leg.last_link is not None:
            position = route.links.geometry_end_idx[leg.last_link]
        if leg.ends_at is LegEnd.STOP:
            stop = next(stops)
            pauses.append((position, float(stop.depart_s - stop.arrive_s)))
    return pauses


def times_of(track: Track, departure: datetime | None) -> list[str]:
    """The time at each point, to the second, as XML writes it.

    departure: local time, which then has no zone; without it, the route begins now, in universal time.
    """
    begin = departure or datetime.now(UTC).replace(microsecond=0)
    zone = "" if begin.tzinfo is None else "Z"
    whole = np.rint(track.time_s).astype(np.int64).tolist()
    return [
        (begin + timedelta(seconds=seconds)).replace(tzinfo=None).isoformat(timespec="seconds") + zone
        for seconds in whole
    ]
