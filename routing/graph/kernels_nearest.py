"""Compiled: the road nearest to a place, through a tree of boxes."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

import energy.compiled.cache  # noqa: F401  (sets the cache folder before anything is compiled)

E7 = 1e7
FAN = 16  # boxes in a box
TIE_M = 1e-7  # roads whose distances differ by at most that are equally near; rounding makes less than 1e-8 m of it
ROUNDING_M = 1e-6  # distances to a box and to the road in it are computed differently
WEST, SOUTH, EAST, NORTH = range(4)


class Boxes(NamedTuple):
    """Boxes around R roads, those of near roads side by side, and around FAN of them each, up to one around all.

    road: int32 (R,) one link of each road. box: int32 (B, 4), west, south, east, north [1e-7 deg], a level after the
    other, from that of the roads up; level_first: int64 (L + 1,) where levels begin. Box k of a level holds boxes
    FAN·k to FAN·k + FAN − 1 of the level below.
    """

    road: NDArray[np.int32]
    box: NDArray[np.int32]
    level_first: NDArray[np.int64]


class Lines(NamedTuple):
    """The polylines of links, as in RoadGraph."""

    geometry_first: NDArray[np.int64]
    geometry_lon_e7: NDArray[np.int32]
    geometry_lat_e7: NDArray[np.int32]


@njit(nogil=True, cache=True)
def line_distance_m(lines: Lines, link: int, lon_deg: float, lat_deg: float, east_m: float, north_m: float) -> float:
    """Distance from a place to a link's line [m], exactly 0 at its points.

    east_m, north_m: metres of a degree of longitude and of latitude.
    """
    begin, end = lines.geometry_first[link], lines.geometry_first[link + 1]
    x0 = (lines.geometry_lon_e7[begin] / E7 - lon_deg) * east_m
    y0 = (lines.geometry_lat_e7[begin] / E7 - lat_deg) * north_m
    least = math.hypot(x0, y0)
    for k in range(begin + 1, end):
        x1 = (lines.geometry_lon_e7[k] / E7 - lon_deg) * east_m
        y1 = (lines.geometry_lat_e7[k] / E7 - lat_deg) * north_m
        least = min(least, math.hypot(x1, y1))
        dx, dy = x1 - x0, y1 - y0
        length2 = dx * dx + dy * dy
        along = -(x0 * dx + y0 * dy)
        if 0.0 < along < length2:
            least = min(least, math.hypot(x0 + along / length2 * dx, y0 + along / length2 * dy))
        x0, y0 = x1, y1
    return least


@njit(nogil=True, cache=True)
def foot_on_line(
    lines: Lines, link: int, lon_deg: float, lat_deg: float, east_m: float, north_m: float
) -> tuple[float, float, float]:
    """The place on a link's line that is nearest to a place: the share of the line up to it, and where it lies [m].

    Where: east and north of the place asked. Of places equally near it is the first. east_m, north_m: metres of a
    degree of longitude and of latitude.
    """
    begin, end = lines.geometry_first[link], lines.geometry_first[link + 1]
    x = (lines.geometry_lon_e7[begin:end] / E7 - lon_deg) * east_m
    y = (lines.geometry_lat_e7[begin:end] / E7 - lat_deg) * north_m
    least = math.inf
    foot_m = whole_m = 0.0
    for k in range(x.size - 1):
        dx, dy = x[k + 1] - x[k], y[k + 1] - y[k]
        length2 = dx * dx + dy * dy
        length_m = math.sqrt(length2)
        part = -(x[k] * dx + y[k] * dy) / length2 if length2 > 0.0 else 0.0
        if part <= 0.0:
            away_m = math.sqrt(x[k] * x[k] + y[k] * y[k])
        elif part >= 1.0:
            away_m = math.sqrt(x[k + 1] * x[k + 1] + y[k + 1] * y[k + 1])
        else:
            away_m = abs((y[k] * dx - x[k] * dy) / length2) * length_m
        if away_m < least:
            least, foot_m = away_m, whole_m + min(max(part, 0.0), 1.0) * length_m
        whole_m += length_m
    share = foot_m / whole_m if whole_m > 0.0 else 0.0
    at_m, done_m = share * whole_m, 0.0
    for k in range(x.size - 1):
        dx, dy = x[k + 1] - x[k], y[k + 1] - y[k]
        length_m = math.sqrt(dx * dx + dy * dy)
        if done_m + length_m > at_m:
            part = (at_m - done_m) / length_m
            return share, x[k] + part * dx, y[k] + part * dy
        done_m += length_m
    return share, x[-1], y[-1]


@njit(nogil=True, cache=True)
def nearest_link(boxes: Boxes, lines: Lines, lon_deg: float, lat_deg: float, east_m: float, north_m: float) -> int:
    """The link of the road nearest to a place; -1 where no road is.

    Of the roads that are at most TIE_M farther away than the nearest, it is the one of the least number: so the last
    bit of a cosine does not decide between roads equally near. east_m, north_m: metres of a degree of longitude and of
    latitude. O(log R) for roads that overlap little.
    """
    least_m, _ = roads_within(boxes, lines, lon_deg, lat_deg, east_m, north_m, math.inf)
    return int(roads_within(boxes, lines, lon_deg, lat_deg, east_m, north_m, least_m + TIE_M)[1])


@njit(nogil=True, cache=True)
def roads_within(
    boxes: Boxes, lines: Lines, lon_deg: float, lat_deg: float, east_m: float, north_m: float, within_m: float
) -> tuple[float, int]:
    """The least number of a link at most within_m from a place, -1 where there is none; and within_m.

    For an infinite within_m, the distance of the nearest road [m] and its link. The rest as for nearest_link.
    """
    level_first, box, road = boxes.level_first, boxes.box, boxes.road
    top = level_first.size - 2
    stack_level = np.empty(FAN * (top + 1) + 1, np.int64)
    stack_box = np.empty(FAN * (top + 1) + 1, np.int64)
    stack_m = np.empty(FAN * (top + 1) + 1)
    stack_level[0], stack_box[0], stack_m[0] = top, 0, 0.0
    waiting = 1 if road.size > 0 else 0
    nearest = within_m == math.inf
    bound_m = within_m
    least_link = -1
    lon_e7, lat_e7 = lon_deg * E7, lat_deg * E7
    while waiting > 0:
        waiting -= 1
        level, held = stack_level[waiting], stack_box[waiting]
        if stack_m[waiting] > bound_m + ROUNDING_M:
            continue
        if level == 0:
            link = road[held]
            if not nearest and 0 <= least_link < link:
                continue
            away_m = line_distance_m(lines, link, lon_deg, lat_deg, east_m, north_m)
            if away_m <= bound_m:
                least_link = link
                if nearest:
                    bound_m = away_m
            continue
        below = level_first[level - 1]
        nearest_m = math.inf
        nearest_place = waiting
        for k in range(FAN * held, min(FAN * held + FAN, level_first[level] - below)):
            at = below + k
            east = max(box[at, WEST] - lon_e7, lon_e7 - box[at, EAST], 0.0) * (east_m / E7)
            north = max(box[at, SOUTH] - lat_e7, lat_e7 - box[at, NORTH], 0.0) * (north_m / E7)
            away_m = math.hypot(east, north)
            if away_m > bound_m + ROUNDING_M:
                continue
            stack_level[waiting], stack_box[waiting], stack_m[waiting] = level - 1, k, away_m
            if away_m < nearest_m:
                nearest_m, nearest_place = away_m, waiting
            waiting += 1
        # the nearest one is looked at first
        if nearest_place < waiting:
            last = waiting - 1
            swapped, swapped_m = stack_box[last], stack_m[last]
            stack_box[last], stack_m[last] = stack_box[nearest_place], stack_m[nearest_place]
            stack_box[nearest_place], stack_m[nearest_place] = swapped, swapped_m
    return bound_m, int(least_link)
