"""Directions of roads where they leave a junction, from their lines there, and names of turns."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from routing.graph.earth import E7, EARTH_RADIUS_M
from routing.guidance.step import Modifier

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from routing.graph.road_graph import RoadGraph

LOOK_AHEAD_M: Final = 12.0  # how far along a road its direction is taken: beyond the bend of a kerb (assumed)
MOST_POINTS: Final = 8  # of a line that are looked at; where they are nearer to each other, so is the place
HALF_TURN_E7: Final = 1_800_000_000
# Limits of what is called straight, slight, plain and sharp [deg], as in OSRM's public documentation.
STRAIGHT_DEG: Final = 20.0
SLIGHT_DEG: Final = 40.0
PLAIN_DEG: Final = 120.0
UTURN_DEG: Final = 178.0

_RIGHT: Final = (Modifier.SLIGHT_RIGHT, Modifier.RIGHT, Modifier.SHARP_RIGHT)
_LEFT: Final = (Modifier.SLIGHT_LEFT, Modifier.LEFT, Modifier.SHARP_LEFT)


def leaving_deg(
    graph: RoadGraph, link: NDArray[np.int64], backwards: NDArray[np.bool_], look_ahead_m: float = LOOK_AHEAD_M
) -> NDArray[np.float64]:
    """Direction in which links leave their tails, or their heads where seen backwards, float64 (k,) [deg], 0 ≤ … < 360.

    To the place that is look_ahead_m along them, or to the other end of shorter ones.
    """
    begin, end = graph.geometry_first[link], graph.geometry_first[link + 1] - 1
    ahead = np.minimum(np.arange(MOST_POINTS), (end - begin)[:, None])
    point = np.where(backwards[:, None], end[:, None] - ahead, begin[:, None] + ahead)
    lon, lat = graph.geometry_lon_e7[point].astype(np.int64), graph.geometry_lat_e7[point].astype(np.int64)
    east = (lon - lon[:, :1] + HALF_TURN_E7) % (2 * HALF_TURN_E7) - HALF_TURN_E7  # the short way round
    to_m = EARTH_RADIUS_M * np.pi / 180.0 / E7
    x = east * (np.cos(np.radians(lat[:, :1] / E7)) * to_m)
    y = (lat - lat[:, :1]) * to_m
    step_m = np.hypot(np.diff(x), np.diff(y))
    done_m = np.cumsum(step_m, axis=1)
    row = np.arange(link.size)
    reached = done_m >= look_ahead_m
    at = np.where(reached.any(axis=1), reached.argmax(axis=1), MOST_POINTS - 2)
    over_m = np.maximum(done_m[row, at] - look_ahead_m, 0.0)
    back = over_m / np.maximum(step_m[row, at], 1e-9)
    x_at = x[row, at + 1] - back * (x[row, at + 1] - x[row, at])
    y_at = y[row, at + 1] - back * (y[row, at + 1] - y[row, at])
    bearing: NDArray[np.float64] = np.degrees(np.arctan2(x_at, y_at)) % 360.0
    return bearing


def bearing_deg(from_place: NDArray[np.float64], to_place: NDArray[np.float64]) -> float:
    """Direction from one place to a near one, lon and lat [deg] each, 0 ≤ … < 360."""
    east = (to_place[0] - from_place[0] + 180.0) % 360.0 - 180.0
    north = to_place[1] - from_place[1]
    shrink = np.cos(np.radians(0.5 * (from_place[1] + to_place[1])))
    return float(np.degrees(np.arctan2(east * shrink, north)) % 360.0)


def turned_deg(before_deg: float, after_deg: float) -> float:
    """Change of direction, -180 ≤ … < 180, to the right positive."""
    return (after_deg - before_deg + 180.0) % 360.0 - 180.0


def modifier_of(turn_deg: float) -> Modifier:
    """What a change of direction is called."""
    size = abs(turn_deg)
    if size <= STRAIGHT_DEG:
        return Modifier.STRAIGHT
    if size >= UTURN_DEG:
        return Modifier.UTURN
    grade = 0 if size <= SLIGHT_DEG else 1 if size <= PLAIN_DEG else 2
    return _RIGHT[grade] if turn_deg > 0.0 else _LEFT[grade]
