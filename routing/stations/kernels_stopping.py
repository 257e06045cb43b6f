"""Compiled: the road at which a vehicle stops for a place beside it."""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

import energy.compiled.cache  # noqa: F401  (sets the cache folder before anything is compiled)
from routing.graph.kernels_nearest import E7, EAST, FAN, NORTH, SOUTH, TIE_M, WEST, Boxes, Lines, line_distance_m


@njit(nogil=True, cache=True)
def stopping_links(
    boxes: Boxes,
    lines: Lines,
    extra_m: NDArray[np.float64],
    lon_deg: NDArray[np.float64],
    lat_deg: NDArray[np.float64],
    within_m: float,
    metre_per_deg: float,
    link: NDArray[np.int32],
    away_m: NDArray[np.float64],
    share: NDArray[np.float64],
) -> None:
    """For each of n places the road with the least sum of its distance and extra_m, of those at most within_m away.

    extra_m: float64 (M,) of each link, infinite where no vehicle stops. Writes link, int32 (n,), -1 where there is
    none, away_m, its distance [m], and share, where along it the place is, 0..1. Of roads equally good within TIE_M the
    one of the least number. O(n log R) for roads that overlap little.
    """
    level_first, box, road = boxes.level_first, boxes.box, boxes.road
    top = level_first.size - 2
    stack_level = np.empty(FAN * (top + 1) + 1, np.int64)
    stack_box = np.empty(FAN * (top + 1) + 1, np.int64)
    for place in range(lon_deg.size):
        lon, lat = lon_deg[place], lat_deg[place]
        east_m = metre_per_deg * math.cos(math.radians(lat))
        lon_e7, lat_e7 = lon * E7, lat * E7
        best, best_link, best_away = math.inf, -1, math.inf
        stack_level[0], stack_box[0] = top, 0
        waiting = 1 if road.size > 0 else 0
        while waiting > 0:
            waiting -= 1
            level, held = stack_level[waiting], stack_box[waiting]
            at = level_first[level] + held
            east = max(box[at, WEST] - lon_e7, lon_e7 - box[at, EAST], 0.0) * (east_m / E7)
            north = max(box[at, SOUTH] - lat_e7, lat_e7 - box[at, NORTH], 0.0) * (metre_per_deg / E7)
            if math.hypot(east, north) > min(best + TIE_M, within_m):
                continue
            if level == 0:
                candidate = road[held]
                if extra_m[candidate] == math.inf:
                    continue
                distance_m = line_distance_m(lines, candidate, lon, lat, east_m, metre_per_deg)
                if distance_m > within_m:
                    continue
                score = distance_m + extra_m[candidate]
                if score < best - TIE_M or (score <= best + TIE_M and candidate < best_link):
                    best, best_link, best_away = score, candidate, distance_m
                continue
            below = level_first[level] - level_first[level - 1]
            for k in range(FAN * held, min(FAN * held + FAN, below)):
                stack_level[waiting], stack_box[waiting] = level - 1, k
                waiting += 1
        link[place], away_m[place], share[place] = best_link, best_away, 0.0
        if best_link >= 0:
            share[place] = share_along(lines, best_link, lon, lat, east_m, metre_per_deg)


@njit(nogil=True, cache=True)
def share_along(lines: Lines, link: int, lon_deg: float, lat_deg: float, east_m: float, north_m: float) -> float:
    """Share of a link's line at which it is nearest to a place, 0..1."""
    begin, end = lines.geometry_first[link], lines.geometry_first[link + 1]
    x0 = (lines.geometry_lon_e7[begin] / E7 - lon_deg) * east_m
    y0 = (lines.geometry_lat_e7[begin] / E7 - lat_deg) * north_m
    least, way, found = math.hypot(x0, y0), 0.0, 0.0
    for k in range(begin + 1, end):
        x1 = (lines.geometry_lon_e7[k] / E7 - lon_deg) * east_m
        y1 = (lines.geometry_lat_e7[k] / E7 - lat_deg) * north_m
        dx, dy = x1 - x0, y1 - y0
        length = math.hypot(dx, dy)
        if length > 0.0:
            part = min(max(-(x0 * dx + y0 * dy) / (length * length), 0.0), 1.0)
            away = math.hypot(x0 + part * dx, y0 + part * dy)
            if away < least:
                least, found = away, way + part * length
        way += length
        x0, y0 = x1, y1
    return min(found / way, 1.0) if way > 0.0 else 0.0
