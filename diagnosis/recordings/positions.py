"""Way and direction of a drive from its recorded positions."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

import numpy as np

from routing.graph.earth import EARTH_RADIUS_M

if TYPE_CHECKING:
    from numpy.typing import NDArray

AROUND_S: Final = 2.0  # positions so long before and after a step tell its direction
MOVED_M: Final = 10.0  # and do so from this way on, beyond what a receiver at rest wanders

FASTEST_MPS: Final = 100.0  # no car is elsewhere so fast
ASTRAY_M: Final = 300.0  # beyond what receivers wander
MOST_JUMPS: Final = 10_000
LONGEST_ASTRAY_S: Final = 120.0  # a receiver that was wrong for longer may be right


def east_north_m(
    latitude_deg: NDArray[np.float64], longitude_deg: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Metres east and north of the first position, each float64 (n,), on the plane that touches the mean latitude.

    Errs by less than 1 % within 100 km. Longitudes may pass 180°.
    """
    scale = math.pi / 180.0 * EARTH_RADIUS_M
    turn_deg = (longitude_deg - longitude_deg[0] + 180.0) % 360.0 - 180.0
    east = turn_deg * scale * math.cos(math.radians(float(latitude_deg.mean())))
    return east, (latitude_deg - latitude_deg[0]) * scale


def stray(
    time_s: NDArray[np.float64], latitude_deg: NDArray[np.float64], longitude_deg: NDArray[np.float64]
) -> NDArray[np.bool_]:
    """Which positions are where no car is at that time, bool (n,): away from those before, which it comes back to.

    time_s, latitude_deg, longitude_deg: float64 (n,), positions NaN where not known.
    """
    bad = np.zeros(time_s.size, np.bool_)
    known = np.flatnonzero(~(np.isnan(latitude_deg) | np.isnan(longitude_deg)))
    if known.size < 3:
        return bad
    same = (np.diff(latitude_deg[known]) == 0.0) & (np.diff(longitude_deg[known]) == 0.0)
    fresh = np.flatnonzero(np.append(True, ~same))  # a position that is held is that of its first row
    at_s, lat, lon = time_s[known[fresh]], latitude_deg[known[fresh]], longitude_deg[known[fresh]]
    scale = math.pi / 180.0 * EARTH_RADIUS_M

    def apart_m(first: NDArray[np.intp] | int, second: NDArray[np.intp] | int) -> NDArray[np.float64]:
        east = ((lon[second] - lon[first] + 180.0) % 360.0 - 180.0) * np.cos(np.radians(lat[first]))
        return np.asarray(scale * np.hypot(east, lat[second] - lat[first]), np.float64)

    rows = np.arange(fresh.size)
    astray = np.zeros(fresh.size, np.bool_)
    jumps = np.flatnonzero(apart_m(rows[:-1], rows[1:]) > ASTRAY_M + FASTEST_MPS * np.diff(at_s)) + 1
    begin = 0
    for row in jumps[:MOST_JUMPS].tolist():
        if row < begin:
            continue
        before = row - 1
        later = rows[row : int(np.searchsorted(at_s, at_s[before] + LONGEST_ASTRAY_S, side="right"))]
        back = later[apart_m(before, later) <= ASTRAY_M + FASTEST_MPS * (at_s[later] - at_s[before])]
        if back.size:
            astray[row : int(back[0])] = True
            begin = int(back[0]) + 1
        elif at_s[before] - at_s[0] <= LONGEST_ASTRAY_S and begin == 0:
            astray[:row] = True  # what was wrong from the start on
    bad[known] = np.repeat(astray, np.diff(np.append(fresh, known.size)))
    return bad


def heading_of_positions(
    at_s: NDArray[np.float64],
    time_s: NDArray[np.float64],
    latitude_deg: NDArray[np.float64],
    longitude_deg: NDArray[np.float64],
) -> NDArray[np.float64] | None:
    """East and north part of the direction of travel of each step between at_s, float64 (n−1, 2); None if unknown.

    at_s: float64 (n,), rising [s]. time_s, latitude_deg, longitude_deg: float64 (m,), NaN where not known. A step in
    which the vehicle hardly moves has the direction of the step before, at the start that of the first known one.
    """
    known = ~(np.isnan(latitude_deg) | np.isnan(longitude_deg))
    if np.count_nonzero(known) < 2:
        return None
    east, north = east_north_m(latitude_deg[known], longitude_deg[known])
    begin, end = at_s[:-1] - AROUND_S, at_s[1:] + AROUND_S
    step = np.column_stack(
        [np.interp(end, time_s[known], way) - np.interp(begin, time_s[known], way) for way in (east, north)]
    )
    return _unit(step, np.hypot(step[:, 0], step[:, 1]) >= MOVED_M)


def heading_of_compass(
    at_s: NDArray[np.float64], time_s: NDArray[np.float64], heading_rad: NDArray[np.float64]
) -> NDArray[np.float64] | None:
    """East and north part of a recorded heading in the middle of each step, float64 (n−1, 2); None if never known.

    heading_rad: float64 (m,), clockwise from north, NaN where not known. Between samples the two parts are linear, so
    that 359° and 1° meet at north.
    """
    known = ~np.isnan(heading_rad)
    if not known.any():
        return None
    middle = 0.5 * (at_s[:-1] + at_s[1:])
    angle = heading_rad[known]
    parts = np.column_stack([np.interp(middle, time_s[known], part) for part in (np.sin(angle), np.cos(angle))])
    return _unit(parts, np.hypot(parts[:, 0], parts[:, 1]) >= 1e-3)


def _unit(step: NDArray[np.float64], good: NDArray[np.bool_]) -> NDArray[np.float64] | None:
    """Rows scaled to length 1; those that are not good repeat the good one before them, the first ones that after."""
    if not good.any():
        return None
    index = np.maximum.accumulate(np.where(good, np.arange(good.size), int(np.argmax(good))))
    chosen = step[index]
    return np.asarray(np.clip(chosen / np.hypot(chosen[:, 0], chosen[:, 1])[:, None], -1.0, 1.0), np.float64)
