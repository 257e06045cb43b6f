"""Compiled: the least energies of roads on a grid, and how far its cells are from roads in reach and beyond."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray


class Roads(NamedTuple):
    """Where the roads of a graph lie, as in RoadGraph."""

    node_lon_deg: NDArray[np.float64]
    node_lat_deg: NDArray[np.float64]
    length_m: NDArray[np.float64]
    reverse_idx: NDArray[np.int32]
    geometry_first: NDArray[np.int64]
    geometry_lon_e7: NDArray[np.int32]
    geometry_lat_e7: NDArray[np.int32]


class Energies(NamedTuple):
    """What driving takes, as in routing.area.RoadEnergies."""

    node_energy_j: NDArray[np.float64]
    tail_energy_j: NDArray[np.float64]
    head_energy_j: NDArray[np.float64]
    from_m: NDArray[np.float64]
    to_m: NDArray[np.float64]
    most_energy_j: float


class Grid(NamedTuple):
    """Nodes of a regular grid; west, south is the node (0, 0). All whole numbers are in 1e-7 degrees."""

    west_e7: int
    south_e7: int
    step_lon_e7: int
    step_lat_e7: int
    cell_m: float


@njit(nogil=True, cache=True)
def energy_line(e: Energies, link: int, length_m: float) -> tuple[float, float, float, float]:
    """The stretch of a link for whose places the charge suffices [m], least energy at its start [J] and slope [J/m].

    The energy is taken as linear along the stretch. Where there is none its end is before its start.
    """
    begin_m, end_m = e.from_m[link], e.to_m[link]
    if end_m < begin_m:
        return 0.0, -1.0, math.inf, 0.0
    # where the stretch ends within the link, all that there is is taken
    begin = e.most_energy_j if begin_m > 0.0 else e.tail_energy_j[link]
    end = e.most_energy_j if end_m < length_m else e.head_energy_j[link]
    # a start on the link itself may leave one end of it out of reach
    if not math.isfinite(begin):
        begin = end
    if not math.isfinite(end) or end_m <= begin_m:
        return begin_m, end_m, begin, 0.0
    return begin_m, end_m, begin, (end - begin) / (end_m - begin_m)


@njit(nogil=True, cache=True)
def widen_extent(
    r: Roads, e: Energies, budget_j: float, e7_per_m: tuple[float, float], extent_e7: NDArray[np.int64]
) -> None:
    """Let extent_e7 (west, south, east, north) hold every link on which some place takes no more than the budget.

    e7_per_m: 1e-7 degrees of longitude and latitude a metre, at least.
    """
    for link in range(r.length_m.size):
        if e.to_m[link] < e.from_m[link]:
            continue
        length = r.length_m[link]
        first = r.geometry_first[link]
        lon, lat = r.geometry_lon_e7[first], r.geometry_lat_e7[first]
        # a link that can't leave the extent needs no look at its points
        away_lon, away_lat = length * e7_per_m[0], length * e7_per_m[1]
        if (
            extent_e7[0] <= lon - away_lon
            and lon + away_lon <= extent_e7[2]
            and extent_e7[1] <= lat - away_lat
            and lat + away_lat <= extent_e7[3]
        ):
            continue
        begin_m, end_m, begin, slope = energy_line(e, link, length)
        if min(begin, begin + (end_m - begin_m) * slope) > budget_j:
            continue
        for k in range(first, r.geometry_first[link + 1]):
            extent_e7[0] = min(extent_e7[0], r.geometry_lon_e7[k])
            extent_e7[1] = min(extent_e7[1], r.geometry_lat_e7[k])
            extent_e7[2] = max(extent_e7[2], r.geometry_lon_e7[k])
            extent_e7[3] = max(extent_e7[3], r.geometry_lat_e7[k])


@njit(nogil=True, cache=True)
def put_place(
    x: float, y: float, energy_j: float, cell_energy_j: NDArray[np.float64], offset: NDArray[np.float32]
) -> None:
    """Let a place speak for the grid node next to it, unless one nearer to that node does; x, y in cells."""
    column, row = math.floor(x + 0.5), math.floor(y + 0.5)
    if row < 0 or column < 0 or row >= offset.shape[0] or column >= offset.shape[1]:
        return
    away = np.float32((x - column) ** 2 + (y - row) ** 2)
    if away < offset[row, column]:
        offset[row, column] = away
        cell_energy_j[row, column] = energy_j


@njit(nogil=True, cache=True)
def put_roads(
    r: Roads,
    e: Energies,
    grid: Grid,
    spacing_m: float,
    cell_energy_j: NDArray[np.float64],
    offset: NDArray[np.float32],
) -> None:
    """Energies of nodes and of places every spacing_m along links onto the grid nodes next to them.

    cell_energy_j: (rows, columns), NaN on entry, which stays where there is no road; inf: a road out of reach.
    offset: (rows, columns), inf on entry; the square of the distance of what speaks for a grid node [cells²].
    """
    rows, columns = offset.shape
    per_lon, per_lat = 1.0 / grid.step_lon_e7, 1.0 / grid.step_lat_e7
    for node in range(r.node_lon_deg.size):
        x = (r.node_lon_deg[node] * 1e7 - grid.west_e7) * per_lon
        y = (r.node_lat_deg[node] * 1e7 - grid.south_e7) * per_lat
        put_place(x, y, e.node_energy_j[node], cell_energy_j, offset)
    longest = 0
    for link in range(r.length_m.size):
        longest = max(longest, r.geometry_first[link + 1] - r.geometry_first[link])
    piece = np.empty(longest)
    for link in range(r.length_m.size):
        back = r.reverse_idx[link]
        length = r.length_m[link]
        count = int(length / spacing_m)
        if 0 <= back < link or count == 0:
            continue  # one direction of a two-way road is enough
        first, last = r.geometry_first[link], r.geometry_first[link + 1] - 1
        x = (r.geometry_lon_e7[first] - grid.west_e7) * per_lon
        y = (r.geometry_lat_e7[first] - grid.south_e7) * per_lat
        far = 1.1 * length / grid.cell_m + 2.0
        if x < -far or y < -far or x > columns + far or y > rows + far:
            continue
        drawn = 0.0
        for k in range(first, last):
            dx = (r.geometry_lon_e7[k + 1] - r.geometry_lon_e7[k]) * per_lon
            dy = (r.geometry_lat_e7[k + 1] - r.geometry_lat_e7[k]) * per_lat
            piece[k - first] = math.sqrt(dx * dx + dy * dy)
            drawn += piece[k - first]
        step, step_m = drawn / (count + 1.0), length / (count + 1.0)
        from_m, to_m, begin, slope = energy_line(e, link, length)
        back_from_m, back_to_m, back_begin, back_slope = from_m, -1.0, begin, slope
        if back >= 0:
            back_from_m, back_to_m, back_begin, back_slope = energy_line(e, back, length)
        passed, number = 0.0, 1
        for k in range(first, last):
            long = piece[k - first]
            while number <= count and number * step <= passed + long:
                part = (number * step - passed) / long if long > 0.0 else 0.0
                lon = r.geometry_lon_e7[k] + part * (r.geometry_lon_e7[k + 1] - r.geometry_lon_e7[k])
                lat = r.geometry_lat_e7[k] + part * (r.geometry_lat_e7[k + 1] - r.geometry_lat_e7[k])
                at_m = number * step_m
                back_m = length - at_m
                energy = math.inf
                if from_m <= at_m <= to_m:
                    energy = begin + (at_m - from_m) * slope
                if back_from_m <= back_m <= back_to_m:
                    energy = min(energy, back_begin + (back_m - back_from_m) * back_slope)
                x, y = (lon - grid.west_e7) * per_lon, (lat - grid.south_e7) * per_lat
                put_place(x, y, energy, cell_energy_j, offset)
                number += 1
            passed += long


@njit(nogil=True, cache=True)
def near_squares(site: NDArray[np.bool_], most: int) -> NDArray[np.int32]:
    """Square of the distance to the nearest site, (rows, columns) [cells²], at most `most` squared.

    Exact, one dimension after the other, in O(rows · columns · most); after Meijster, Roerdink and Hesselink 2000.
    """
    rows, columns = site.shape
    square = np.empty((rows, columns), np.int32)
    away = np.full(columns, most, np.int32)
    for row in range(rows):
        for column in range(columns):
            away[column] = 0 if site[row, column] else min(away[column] + 1, most)
            square[row, column] = away[column]
    away[:] = most
    for row in range(rows - 1, -1, -1):
        for column in range(columns):
            away[column] = min(away[column] + 1, square[row, column])
            square[row, column] = away[column] * away[column]
    least = np.empty(columns, np.int32)
    for row in range(rows):
        line = square[row]
        least[:] = line
        farthest = least.max()
        step = 1
        while step < most and step * step < farthest:
            add = np.int32(step * step)
            for column in range(columns - step):
                least[column] = min(least[column], np.int32(line[column + step] + add))
            for column in range(step, columns):
                least[column] = min(least[column], np.int32(line[column - step] + add))
            step += 1
        line[:] = least
    return square


@njit(nogil=True, cache=True)
def inside_depth(
    cell_energy_j: NDArray[np.float64], budget_j: float, off_road: float, least: float
) -> NDArray[np.float64]:
    """How deep each grid node lies within the area of a budget, negative outside it, (rows, columns) [cells].

    The distance to the nearest road out of reach less that to the nearest one in reach, at most off_road less the
    latter. Cut to −2..2, and kept `least` off 0, so that a line drawn at 0 passes by the grid nodes. Where more roads
    come into reach it grows. A node as far from both kinds is outside, one off_road from a road in reach is inside.
    """
    rows, columns = cell_energy_j.shape
    most = math.ceil(off_road) + 1
    to_reach = near_squares(cell_energy_j <= budget_j, most)
    to_beyond = near_squares(cell_energy_j > budget_j, most)
    root = np.sqrt(np.arange(most * most + 1).astype(np.float64))
    depth = np.empty((rows, columns))
    for row in range(rows):
        for column in range(columns):
            reach, beyond = root[to_reach[row, column]], root[to_beyond[row, column]]
            value = min(off_road, beyond) - reach
            if reach < beyond and reach <= off_road:
                depth[row, column] = min(max(value, least), 2.0)
            else:
                depth[row, column] = max(min(value, -least), -2.0)
    return depth
