"""Compiled: rings around the bands of a grid, with no more points than a tolerance asks for."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from energy.compiled.kernels_borrow import borrowed
from routing.range.kernels_grid import LEVEL_BITS, LEVEL_MASK

CUTS = 16  # a ring's points are on edges of the grid, at multiples of this part of one, and on none of its nodes
ROW_STEP = np.array((0, 1, 0, -1))  # east, north, west, south
COLUMN_STEP = np.array((1, 0, -1, 0))


class Marks(NamedTuple):
    """What is kept of each grid node while the bands of one answer are drawn, all zero on entry.

    ring: int32 (rows, columns, 2) number of the last ring that passed west of the node, and east of it. limit: uint8
    (rows, columns, 4) how far out from the node, in each direction, the last ring there went [1/CUTS].
    """

    ring: NDArray[np.int32]
    limit: NDArray[np.uint8]


class Band(NamedTuple):
    """A band of a grid, and how rings are drawn around it.

    key: int32 (rows, columns) as nearest_roads leaves it, no band at its rim. level: the band's number. off_road: how
    far off a road it reaches [cells]. slack: how far a ring may be moved along an edge [1/CUTS].
    """

    key: NDArray[np.int32]
    level: int
    off_road: float
    slack: int


class Edge(NamedTuple):
    """An edge of the grid: from the node at row and column into a way, an index of ROW_STEP."""

    row: int
    column: int
    way: int


class Walk(NamedTuple):
    """The crossings of a ring with edges of the grid, (P,) each, in order, the band on the left.

    x, y: the node of the edge within the band [1/CUTS]. way: where the other one is, an index of ROW_STEP. low, high:
    how far from the first node the ring may cross, and at: where it does if it has a point there.
    """

    x: NDArray[np.int32]
    y: NDArray[np.int32]
    way: NDArray[np.uint8]
    at: NDArray[np.uint8]
    low: NDArray[np.uint8]
    high: NDArray[np.uint8]


class Rings(NamedTuple):
    """Rings of one band: points int32 (P, 2) [1/CUTS], without the repeated first one; first (R + 1,), shell (R,)."""

    point: NDArray[np.int32]
    first: NDArray[np.int32]
    shell: NDArray[np.int32]


@njit(nogil=True, cache=True)
def crossings(key: NDArray[np.int32], change: NDArray[np.int32]) -> tuple[int, int]:
    """How often bands cross edges of the grid, summed over all bands, and how many nodes differ from the one west.

    change: (rows · columns,), filled with those, row by row.
    """
    rows, columns = key.shape
    total = changes = 0
    for row in range(rows):
        line = key[row]
        if row > 0:
            below = key[row - 1]
            for column in range(columns):
                total += abs((line[column] & LEVEL_MASK) - (below[column] & LEVEL_MASK))
        for column in range(1, columns):
            more = (line[column] & LEVEL_MASK) - (line[column - 1] & LEVEL_MASK)
            if more != 0:
                total += abs(more)
                change[changes] = row * columns + column
                changes += 1
    return total, changes


@njit(nogil=True, cache=True)
def crossing_at(inner: int, outer: int, off_road: float) -> int:
    """Where a ring crosses the edge between two grid nodes, from the inner one [1/CUTS], 1..CUTS − 1.

    inner, outer: their keys. Half-way between their nearest roads as seen along the edge, or off_road from the road.
    It is the same for all bands that the edge leads out of, and for any charge.
    """
    near, far = math.sqrt(inner >> LEVEL_BITS), math.sqrt(outer >> LEVEL_BITS)
    part = 0.5 * (1.0 + far - near) if far <= off_road else (off_road - near) / (far - near)
    return min(max(math.floor(CUTS * part + 0.5), 1), CUTS - 1)


@njit(nogil=True, cache=True)
def walk_round(band: Band, first: Edge, ring: int, marks: Marks, walk: Walk) -> int:
    """Follow the ring of a number that leaves a band through an edge; the number of its crossings.

    Nodes of the band that touch across a corner only are not joined.
    """
    key, level, slack = band.key, band.level, band.slack
    row, column, way = first.row, first.column, first.way
    count = 0
    while True:
        crossing = crossing_at(key[row, column], key[row + ROW_STEP[way], column + COLUMN_STEP[way]], band.off_road)
        low, high = max(crossing - slack, 1), min(crossing + slack, CUTS - 1)
        limit = marks.limit[row, column, way]
        if limit > 0:
            high = min(high, limit)
            low = min(low, high)
        walk.x[count], walk.y[count], walk.way[count] = CUTS * column, CUTS * row, way
        walk.at[count], walk.low[count], walk.high[count] = min(max(crossing, low), high), low, high
        if way == 2:
            marks.ring[row, column, 0] = ring
        elif way == 0:
            marks.ring[row, column, 1] = ring
        count += 1
        ahead = (way + 1) & 3
        next_row, next_column = row + ROW_STEP[ahead], column + COLUMN_STEP[ahead]
        if (key[next_row, next_column] & LEVEL_MASK) < level:
            way = ahead
        else:
            row, column = next_row, next_column
            over_row, over_column = row + ROW_STEP[way], column + COLUMN_STEP[way]
            if (key[over_row, over_column] & LEVEL_MASK) >= level:
                row, column, way = over_row, over_column, (way + 3) & 3
        if row == first.row and column == first.column and way == first.way:
            return count


@njit(nogil=True, cache=True)
def steps_seen(walk: Walk, count: int, begin: int, most: int) -> int:
    """How many crossings further a ring's next point can be, at most `most`; 1 at least.

    The line there from the point at crossing `begin` stays between low and high at all crossings that it skips.
    """
    x0 = walk.x[begin] + COLUMN_STEP[walk.way[begin]] * walk.at[begin]
    y0 = walk.y[begin] + ROW_STEP[walk.way[begin]] * walk.at[begin]
    left_x = left_y = right_x = right_y = 0
    seen = 1
    for step in range(1, most + 1):
        k = (begin + step) % count
        east, north = COLUMN_STEP[walk.way[k]], ROW_STEP[walk.way[k]]
        x, y = walk.x[k] - x0, walk.y[k] - y0
        to_x, to_y = x + east * walk.at[k], y + north * walk.at[k]
        low_x, low_y = x + east * walk.low[k], y + north * walk.low[k]
        high_x, high_y = x + east * walk.high[k], y + north * walk.high[k]
        if step == 1:
            left_x, left_y, right_x, right_y = low_x, low_y, high_x, high_y
            continue
        if (
            right_x * to_y - right_y * to_x >= 0
            and to_x * left_y - to_y * left_x >= 0
            and to_x * right_x + to_y * right_y > 0
        ):
            seen = step
        if low_x * left_y - low_y * left_x > 0:
            left_x, left_y = low_x, low_y
        if right_x * high_y - right_y * high_x > 0:
            right_x, right_y = high_x, high_y
        if right_x * left_y - right_y * left_x < 0:
            break
    return seen


@njit(nogil=True, cache=True)
def limit_rings(walk: Walk, count: int, begin: int, steps: int, marks: Marks) -> None:
    """Keep where the line over some crossings from one on lies, that later rings stay within it."""
    end = (begin + steps) % count
    x0 = walk.x[begin] + COLUMN_STEP[walk.way[begin]] * walk.at[begin]
    y0 = walk.y[begin] + ROW_STEP[walk.way[begin]] * walk.at[begin]
    go_x = walk.x[end] + COLUMN_STEP[walk.way[end]] * walk.at[end] - x0
    go_y = walk.y[end] + ROW_STEP[walk.way[end]] * walk.at[end] - y0
    for step in range(steps):
        k = (begin + step) % count
        way = walk.way[k]
        out = int(walk.at[k])
        if step > 0:
            # along a line of latitude the crossing is where the line comes to that latitude, and so on
            x, y = walk.x[k] - x0, walk.y[k] - y0
            part, whole = (y * go_x - x * go_y, go_y) if ROW_STEP[way] == 0 else (x * go_y - y * go_x, go_x)
            sign = COLUMN_STEP[way] + ROW_STEP[way]
            out = int((sign * part) // whole)
        marks.limit[walk.y[k] // CUTS, walk.x[k] // CUTS, way] = out


@njit(nogil=True, cache=True)
def put_ring(walk: Walk, count: int, marks: Marks, point: NDArray[np.int32], points: int) -> int:
    """Write the points of a ring behind `points` others, and how many there are then."""
    begin = steps_seen(walk, count, 0, count) % count  # a point that is needed, unless the ring begins amid a line
    first = points
    done = 0
    while done < count:
        k = (begin + done) % count
        point[points, 0] = walk.x[k] + COLUMN_STEP[walk.way[k]] * walk.at[k]
        point[points, 1] = walk.y[k] + ROW_STEP[walk.way[k]] * walk.at[k]
        points += 1
        steps = steps_seen(walk, count, k, count - done)
        limit_rings(walk, count, k, steps, marks)
        done += steps
    come_x, come_y = point[first, 0] - point[points - 1, 0], point[first, 1] - point[points - 1, 1]
    go_x, go_y = point[first + 1, 0] - point[first, 0], point[first + 1, 1] - point[first, 1]
    if come_x * go_y == come_y * go_x:
        point[first] = point[points - 1]
        points -= 1
    return points


@njit(nogil=True, cache=True)
def put_rings(band: Band, change: NDArray[np.int32], marks: Marks, ring: int, walk: Walk, rings: Rings) -> int:
    """Draw the rings around the nodes of a grid that are in a band, shells counter-clockwise and holes clockwise.

    change: as crossings fills it. marks: those of all bands of an answer, drawn after all that hold this one: it stays
    within them. ring: number of rings drawn before. A ring crosses each edge that leads out of the band once and no
    other edge, wherever its points are within the band's slack of crossing_at: so rings are simple, and don't meet. The
    number of this band's rings.
    """
    key, change, level = borrowed(band.key), borrowed(change), band.level
    band = Band(key, level, band.off_road, band.slack)
    marks = Marks(borrowed(marks.ring), borrowed(marks.limit))
    walk = Walk(
        borrowed(walk.x),
        borrowed(walk.y),
        borrowed(walk.way),
        borrowed(walk.at),
        borrowed(walk.low),
        borrowed(walk.high),
    )
    rings = Rings(borrowed(rings.point), borrowed(rings.first), borrowed(rings.shell))
    columns = key.shape[1]
    count = points = 0
    rings.first[0] = 0
    shell = 0
    for place in change:
        row, column = place // columns, place % columns
        west, east = (key[row, column - 1] & LEVEL_MASK) >= level, (key[row, column] & LEVEL_MASK) >= level
        if west == east:
            continue
        if east:
            known = marks.ring[row, column, 0]
            # what is met first of a part of the band is its shell, from the south-west
            if known > ring:
                shell = rings.shell[known - ring - 1]
                continue
            shell = count
            length = walk_round(band, Edge(row, column, 2), ring + count + 1, marks, walk)
        else:
            # and of a hole, the edge west of its southernmost row
            if marks.ring[row, column - 1, 1] > ring:
                continue
            length = walk_round(band, Edge(row, column - 1, 0), ring + count + 1, marks, walk)
        points = put_ring(walk, length, marks, rings.point, points)
        rings.shell[count] = shell
        count += 1
        rings.first[count] = points
    return count
