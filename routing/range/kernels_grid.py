"""Compiled: how far the nodes of a grid are from the nearest road, and in how many bands that one is."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from energy.compiled.kernels_borrow import borrowed
from routing.graph.kernels_nearest import EAST, FAN, NORTH, SOUTH, WEST, Boxes

LEVEL_BITS = 16  # of a key: in how many bands a road is; the bits above hold a square of a distance
LEVEL_MASK = (1 << LEVEL_BITS) - 1
NOWHERE = (1 << 31) - 1  # key of a grid node that no road speaks for
OFFSET_STEPS = 1 << 14  # of the square of a distance of one cell
BLOCK = 64  # columns whose nearest roads are looked for together


class RoadLines(NamedTuple):
    """Where the roads of a graph lie, as in RoadGraph."""

    tail: NDArray[np.int32]
    head: NDArray[np.int32]
    length_m: NDArray[np.float64]
    reverse_idx: NDArray[np.int32]
    geometry_first: NDArray[np.int64]
    geometry_lon_e7: NDArray[np.int32]
    geometry_lat_e7: NDArray[np.int32]


class Energies(NamedTuple):
    """What driving takes, as in area.RoadEnergies; by_node: those at a link's ends are those of its nodes."""

    node_energy_j: NDArray[np.float64]
    tail_energy_j: NDArray[np.float64]
    head_energy_j: NDArray[np.float64]
    from_m: NDArray[np.float64]
    to_m: NDArray[np.float64]
    most_energy_j: float
    by_node: bool


class Grid(NamedTuple):
    """Nodes of a regular grid; west, south is the node (0, 0). All whole numbers are in 1e-7 degrees."""

    west_e7: int
    south_e7: int
    step_lon_e7: int
    step_lat_e7: int
    cell_m: float


class Seen(NamedTuple):
    """Nodes of the graph on a grid, (n,) each: int32 number, bands they are in, the grid node south-west of them."""

    node: NDArray[np.int32]
    level: NDArray[np.int32]
    cell: NDArray[np.int32]


class Unsure(NamedTuple):
    """Nodes that lie within more bands than `least` or not, and in no more than `most`; int32 (n,) each."""

    node: NDArray[np.int32]
    level: NDArray[np.int32]
    least: NDArray[np.int32]
    most: NDArray[np.int32]


@njit(nogil=True, cache=True)
def borrowed_roads(r: RoadLines) -> RoadLines:
    """The same roads with borrowed arrays."""
    return RoadLines(
        borrowed(r.tail),
        borrowed(r.head),
        borrowed(r.length_m),
        borrowed(r.reverse_idx),
        borrowed(r.geometry_first),
        borrowed(r.geometry_lon_e7),
        borrowed(r.geometry_lat_e7),
    )


@njit(nogil=True, cache=True)
def borrowed_energies(e: Energies) -> Energies:
    """The same energies with borrowed arrays."""
    return Energies(
        borrowed(e.node_energy_j),
        borrowed(e.tail_energy_j),
        borrowed(e.head_energy_j),
        borrowed(e.from_m),
        borrowed(e.to_m),
        e.most_energy_j,
        e.by_node,
    )


@njit(nogil=True, cache=True)
def energy_line(r: RoadLines, e: Energies, link: int, length_m: float) -> tuple[float, float, float, float]:
    """The stretch of a link for whose places the charge suffices [m], least energy at its start [J] and slope [J/m].

    The energy is taken as linear along the stretch. Where there is none its end is before its start.
    """
    begin_m, end_m = e.from_m[link], e.to_m[link]
    if end_m < begin_m:
        return 0.0, -1.0, math.inf, 0.0
    # where the stretch ends within the link, all that there is is taken
    begin = end = e.most_energy_j
    if begin_m <= 0.0:
        begin = e.node_energy_j[r.tail[link]] if e.by_node else e.tail_energy_j[link]
    if end_m >= length_m:
        end = e.node_energy_j[r.head[link]] if e.by_node else e.head_energy_j[link]
    # a start on the link itself may leave one end of it out of reach
    if not math.isfinite(begin):
        begin = end
    if not math.isfinite(end) or end_m <= begin_m:
        return begin_m, end_m, begin, 0.0
    return begin_m, end_m, begin, (end - begin) / (end_m - begin_m)


@njit(nogil=True, cache=True)
def widen_extent(
    r: RoadLines, e: Energies, budget_j: float, e7_per_m: tuple[float, float], extent_e7: NDArray[np.int64]
) -> None:
    """Let extent_e7 (west, south, east, north) hold every link on which some place takes no more than the budget.

    e7_per_m: 1e-7 degrees of longitude and latitude a metre, at least.
    """
    r, e = borrowed_roads(r), borrowed_energies(e)
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
        begin_m, end_m, begin, slope = energy_line(r, e, link, length)
        if min(begin, begin + (end_m - begin_m) * slope) > budget_j:
            continue
        for k in range(first, r.geometry_first[link + 1]):
            extent_e7[0] = min(extent_e7[0], r.geometry_lon_e7[k])
            extent_e7[1] = min(extent_e7[1], r.geometry_lat_e7[k])
            extent_e7[2] = max(extent_e7[2], r.geometry_lon_e7[k])
            extent_e7[3] = max(extent_e7[3], r.geometry_lat_e7[k])


@njit(nogil=True, cache=True)
def level_of(energy_j: float, budget_j: NDArray[np.float64]) -> int:
    """In how many bands a place is: how many budgets, which descend, suffice for its energy."""
    level = 0
    while level < budget_j.size and energy_j <= budget_j[level]:
        level += 1
    return level


@njit(nogil=True, cache=True)
def put_place(x: float, y: float, level: int, key: NDArray[np.int32]) -> None:
    """Let a place speak for the grid node next to it, unless one nearer to that node does; x, y in cells.

    Of places as near the one in fewest bands speaks, so that more charge brings no node of the grid out of a band.
    """
    column, row = math.floor(x + 0.5), math.floor(y + 0.5)
    if row < 0 or column < 0 or row >= key.shape[0] or column >= key.shape[1]:
        return
    away = int(((x - column) * (x - column) + (y - row) * (y - row)) * OFFSET_STEPS)
    key[row, column] = min(key[row, column], away << LEVEL_BITS | level)


@njit(nogil=True, cache=True)
def put_along(
    r: RoadLines,
    e: Energies,
    budget_j: NDArray[np.float64],
    grid: Grid,
    link: int,
    spacing_m: float,
    key: NDArray[np.int32],
) -> None:
    """Put places every spacing_m along a road, which are as near to each other as they can be, onto the grid."""
    length = r.length_m[link]
    count = int(length / spacing_m)
    if count == 0:
        return
    back = r.reverse_idx[link]
    from_m, to_m, begin, slope = energy_line(r, e, link, length)
    back_from_m, back_to_m, back_begin, back_slope = from_m, -1.0, math.inf, 0.0
    if back >= 0:
        back_from_m, back_to_m, back_begin, back_slope = energy_line(r, e, back, length)
    # nearly all roads are in the same bands from end to end
    level, best_level = 0, 0
    if to_m >= from_m:
        end = begin + (to_m - from_m) * slope
        best_level = level_of(min(begin, end), budget_j)
        if from_m == 0.0 and to_m == length:
            level = level_of(max(begin, end), budget_j)
    if back_to_m >= back_from_m:
        end = back_begin + (back_to_m - back_from_m) * back_slope
        best_level = max(best_level, level_of(min(back_begin, end), budget_j))
        if back_from_m == 0.0 and back_to_m == length:
            level = max(level, level_of(max(back_begin, end), budget_j))
    per_lon, per_lat = 1.0 / grid.step_lon_e7, 1.0 / grid.step_lat_e7
    first, last = r.geometry_first[link], r.geometry_first[link + 1] - 1
    drawn = 0.0
    for k in range(first, last):
        dx = (r.geometry_lon_e7[k + 1] - r.geometry_lon_e7[k]) * per_lon
        dy = (r.geometry_lat_e7[k + 1] - r.geometry_lat_e7[k]) * per_lat
        drawn += math.sqrt(dx * dx + dy * dy)
    step, step_m = drawn / (count + 1.0), length / (count + 1.0)
    passed, number = 0.0, 1
    for k in range(first, last):
        x = (r.geometry_lon_e7[k] - grid.west_e7) * per_lon
        y = (r.geometry_lat_e7[k] - grid.south_e7) * per_lat
        dx = (r.geometry_lon_e7[k + 1] - r.geometry_lon_e7[k]) * per_lon
        dy = (r.geometry_lat_e7[k + 1] - r.geometry_lat_e7[k]) * per_lat
        long = math.sqrt(dx * dx + dy * dy)
        per_long = 1.0 / long if long > 0.0 else 0.0
        while number <= count and number * step <= passed + long:
            if level != best_level:
                at_m = number * step_m
                back_m = length - at_m
                energy = math.inf
                if from_m <= at_m <= to_m:
                    energy = begin + (at_m - from_m) * slope
                if back_from_m <= back_m <= back_to_m:
                    energy = min(energy, back_begin + (back_m - back_from_m) * back_slope)
                put_place(
                    x + (number * step - passed) * per_long * dx,
                    y + (number * step - passed) * per_long * dy,
                    level_of(energy, budget_j),
                    key,
                )
            else:
                part = (number * step - passed) * per_long
                put_place(x + part * dx, y + part * dy, level, key)
            number += 1
        passed += long


@njit(nogil=True, cache=True)
def put_end(
    node: int,
    point: int,
    r: RoadLines,
    e: Energies,
    budget_j: NDArray[np.float64],
    grid: Grid,
    key: NDArray[np.int32],
    seen: Seen,
    count: int,
) -> int:
    """Put the node at a point of a road's line onto the grid; how many are seen then."""
    x = (r.geometry_lon_e7[point] - grid.west_e7) * (1.0 / grid.step_lon_e7)
    y = (r.geometry_lat_e7[point] - grid.south_e7) * (1.0 / grid.step_lat_e7)
    level = level_of(e.node_energy_j[node], budget_j)
    put_place(x, y, level, key)
    column, row = math.floor(x), math.floor(y)
    if row < 0 or column < 0 or row >= key.shape[0] - 1 or column >= key.shape[1] - 1:
        return count
    seen.node[count], seen.level[count], seen.cell[count] = node, level, row * key.shape[1] + column
    return count + 1


@njit(nogil=True, cache=True)
def put_roads(
    b: Boxes,
    holds: NDArray[np.int8],
    r: RoadLines,
    e: Energies,
    budget_j: NDArray[np.float64],
    grid: Grid,
    spacing_m: float,
    key: NDArray[np.int32],
    seen: Seen,
) -> int:
    """Put the ends of roads and places every spacing_m along them onto the grid nodes next to them.

    holds: (R,) 1 where a road is the first one at its tail, 2 at its head, 3 at both. budget_j: descending. key:
    (rows, columns), NOWHERE on entry; above LEVEL_BITS the square of the distance of the place that speaks for a grid
    node, below in how many bands it is. seen: (N,), filled with the nodes of the graph on the grid; how many is
    returned.
    """
    west, south = grid.west_e7 - grid.step_lon_e7, grid.south_e7 - grid.step_lat_e7
    east = grid.west_e7 + key.shape[1] * grid.step_lon_e7
    north = grid.south_e7 + key.shape[0] * grid.step_lat_e7
    box, held, holds = borrowed(b.box), borrowed(b.road), borrowed(holds)
    r, e, budget_j, key = borrowed_roads(r), borrowed_energies(e), borrowed(budget_j), borrowed(key)
    seen = Seen(borrowed(seen.node), borrowed(seen.level), borrowed(seen.cell))
    boxed = b.level_first.size > 2
    nodes = 0
    for block in range((held.size + FAN - 1) // FAN):
        if boxed:
            at = b.level_first[1] + block
            if box[at, EAST] < west or box[at, WEST] > east or box[at, NORTH] < south or box[at, SOUTH] > north:
                continue
        for road in range(FAN * block, min(FAN * block + FAN, held.size)):
            if box[road, EAST] < west or box[road, WEST] > east or box[road, NORTH] < south or box[road, SOUTH] > north:
                continue
            link = held[road]
            if holds[road] & 1:
                nodes = put_end(r.tail[link], r.geometry_first[link], r, e, budget_j, grid, key, seen, nodes)
            if holds[road] & 2:
                nodes = put_end(r.head[link], r.geometry_first[link + 1] - 1, r, e, budget_j, grid, key, seen, nodes)
            put_along(r, e, budget_j, grid, link, spacing_m, key)
    return nodes


@njit(nogil=True, cache=True)
def nearest_roads(key: NDArray[np.int32], most: int, off_road: float) -> None:
    """Turn keys of places into keys of the nearest road: the square of its distance [cells²] and its number of bands.

    The square is at most `most` squared, and the bands are none where it exceeds off_road squared. Of roads as near the
    one in fewest bands counts: so each band has what is nearer to it than to any road out of it, for all bands at once.
    Exact, one dimension after the other, in O(rows · columns · most) and seldom that much; after Meijster, Roerdink and
    Hesselink 2000.
    """
    rows, columns = key.shape
    next_cell = np.int32(1 << LEVEL_BITS)
    farthest = np.int32(most << LEVEL_BITS)
    far_square = np.int32(most * most << LEVEL_BITS)
    off_square = int(off_road * off_road)
    away = np.full(columns, farthest, np.int32)
    for row in range(rows):
        line = key[row]
        for column in range(columns):
            value = min(away[column] + next_cell, farthest)
            if line[column] != NOWHERE:
                value = line[column] & LEVEL_MASK
            away[column] = value
            line[column] = value
    away[:] = farthest
    for row in range(rows - 1, -1, -1):
        line = key[row]
        for column in range(columns):
            value = min(np.int32(away[column] + next_cell), line[column])
            away[column] = value
            steps = value >> LEVEL_BITS
            line[column] = (steps * steps) << LEVEL_BITS | (value & LEVEL_MASK)
    wide = np.full(columns + 2 * most + BLOCK, far_square, np.int32)
    least = np.empty(BLOCK, np.int32)
    for row in range(rows):
        wide[most : most + columns] = key[row]
        for begin in range(0, columns, BLOCK):
            size = min(BLOCK, columns - begin)
            around = wide[begin : begin + BLOCK + 2 * most]
            middle = around[most : most + BLOCK]
            nearest, worst = around.min(), np.int32(0)
            for k in range(BLOCK):
                least[k] = middle[k]
                worst = max(worst, least[k])
            step = 1
            while step < most and (step * step << LEVEL_BITS) + nearest < worst:
                add = np.int32(step * step << LEVEL_BITS)
                before, after = around[most - step : most - step + BLOCK], around[most + step : most + step + BLOCK]
                worst = np.int32(0)
                for k in range(BLOCK):
                    value = min(np.int32(min(before[k], after[k]) + add), least[k])
                    least[k] = value
                    worst = max(worst, value)
                step += 1
            for k in range(size):
                value = least[k]
                key[row, begin + k] = value if value >> LEVEL_BITS <= off_square else value & ~LEVEL_MASK


@njit(nogil=True, cache=True)
def count_nodes(seen: Seen, key: NDArray[np.int32], count: NDArray[np.int64], unsure: Unsure) -> int:
    """How many nodes of the graph are in each band, and how many of them the grid alone says are covered.

    A node amid four grid nodes of one side lies on that side. count: int64 (3, bands + 1), zero on entry: nodes that
    are reached, are covered, are both in so many bands and no more. unsure: filled with nodes that may be amid
    grid nodes of both sides; how many is returned.
    """
    columns = key.shape[1]
    most = count.shape[1] - 1
    found = 0
    for k in range(seen.node.size):
        row, column = seen.cell[k] // columns, seen.cell[k] % columns
        a, b = key[row, column] & LEVEL_MASK, key[row, column + 1] & LEVEL_MASK
        c, d = key[row + 1, column] & LEVEL_MASK, key[row + 1, column + 1] & LEVEL_MASK
        least, highest = min(min(a, b), min(c, d), most), min(max(max(a, b), max(c, d)), most)
        level = seen.level[k]
        count[0, level] += 1
        count[1, least] += 1
        count[2, min(least, level)] += 1
        if least < highest:
            unsure.node[found], unsure.level[found] = seen.node[k], level
            unsure.least[found], unsure.most[found] = least, highest
            found += 1
    return found
