"""Compiled: fewer points around areas, none of which comes to cross itself or another.

A point b between a and c is left out where no other point lies in the triangle a b c: then the line that takes its
place crosses none (a line that enters the triangle without ending in it would have to cross a b or b c before). Rings
that hold each other, share points or run along each other so stay as they are to each other. Points that several rings
share are left out of all of them, or of none.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from energy.compiled.kernels_borrow import borrowed

LEAST_POINTS = 3  # of a ring
ROUNDS = 4  # of growing tolerance, so that what matters least goes first


class Outlines(NamedTuple):
    """All rings, one behind the other, without the first point of each repeated at its end.

    x, y: int64 (P,) places in whole units; a triangle is below 2^30 of them wide, so that it is told exactly. before,
    after: int64 (P,), the points beside each in its ring; a point that is its own neighbour is never left out. ring:
    int32 (P,). first, size, point_count: int64 (R,), where a ring begins, how many points it had, and how many it still
    has. twin: int64 (P,), the next point at the same place, round and round. kept: bool (P,).
    """

    x: NDArray[np.int64]
    y: NDArray[np.int64]
    before: NDArray[np.int64]
    after: NDArray[np.int64]
    ring: NDArray[np.int32]
    first: NDArray[np.int64]
    size: NDArray[np.int64]
    point_count: NDArray[np.int64]
    twin: NDArray[np.int64]
    kept: NDArray[np.bool_]


class Squares(NamedTuple):
    """Points by the square of a grid that they lie in: int64 `first` (squares + 1,) into `point` (P,).

    unit: side of a square. columns, rows: how many there are, from the least x and y on.
    """

    first: NDArray[np.int64]
    point: NDArray[np.int64]
    unit: int
    columns: int
    rows: int
    x: int
    y: int


@njit(nogil=True, cache=True)
def _turn(ax: int, ay: int, bx: int, by: int, cx: int, cy: int) -> int:
    """Twice the area of a triangle, above 0 where it turns left."""
    return (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)


@njit(nogil=True, cache=True)
def _off(lines: Outlines, a: int, c: int, scale: tuple[float, float]) -> float:
    """How far the points of the ring between a and c lie off the line from a to c at most, squared [m²]."""
    first, size = lines.first[lines.ring[a]], lines.size[lines.ring[a]]
    ux, uy = float(lines.x[c] - lines.x[a]) * scale[0], float(lines.y[c] - lines.y[a]) * scale[1]
    along = ux * ux + uy * uy
    worst = 0.0
    at = a
    while True:
        at += 1
        if at == first + size:
            at = first
        if at == c:
            return worst
        vx, vy = float(lines.x[at] - lines.x[a]) * scale[0], float(lines.y[at] - lines.y[a]) * scale[1]
        share = (vx * ux + vy * uy) / along if along > 0.0 else 0.0
        share = min(max(share, 0.0), 1.0)
        dx, dy = vx - share * ux, vy - share * uy
        worst = max(worst, dx * dx + dy * dy)


@njit(nogil=True, cache=True)
def _same(lines: Outlines, p: int, q: int) -> bool:
    return bool(lines.x[p] == lines.x[q] and lines.y[p] == lines.y[q])


@njit(nogil=True, cache=True)
def _twins_agree(lines: Outlines, b: int, a: int, c: int) -> bool:
    """Whether all rings that go over b come from a and go to c, or the other way, and can do without it."""
    at = b
    while True:
        if lines.kept[at]:
            p, q = lines.before[at], lines.after[at]
            if lines.point_count[lines.ring[at]] <= LEAST_POINTS:
                return False
            if not (_same(lines, p, a) and _same(lines, q, c)) and not (_same(lines, p, c) and _same(lines, q, a)):
                return False
        at = lines.twin[at]
        if at == b:
            return True


@njit(nogil=True, cache=True)
def _is_line(lines: Outlines, a: int, c: int) -> bool:
    """Whether a ring goes from a to c already, or back."""
    at = a
    while True:
        if lines.kept[at] and (_same(lines, lines.before[at], c) or _same(lines, lines.after[at], c)):
            return True
        at = lines.twin[at]
        if at == a:
            return False


@njit(nogil=True, cache=True)
def _is_empty(lines: Outlines, squares: Squares, a: int, b: int, c: int) -> bool:
    """Whether no point lies in a triangle or on its sides, besides those at its corners."""
    ax, ay, bx, by, cx, cy = lines.x[a], lines.y[a], lines.x[b], lines.y[b], lines.x[c], lines.y[c]
    west, east = min(ax, bx, cx), max(ax, bx, cx)
    south, north = min(ay, by, cy), max(ay, by, cy)
    is_left_turn = _turn(ax, ay, bx, by, cx, cy) >= 0
    unit = squares.unit
    for row in range((south - squares.y) // unit, (north - squares.y) // unit + 1):
        begin = squares.first[row * squares.columns + (west - squares.x) // unit]
        end = squares.first[row * squares.columns + (east - squares.x) // unit + 1]
        for k in range(begin, end):
            p = squares.point[k]
            if not lines.kept[p]:
                continue
            x, y = lines.x[p], lines.y[p]
            if x < west or x > east or y < south or y > north:
                continue
            if (x == ax and y == ay) or (x == bx and y == by) or (x == cx and y == cy):
                continue
            u, v, w = _turn(ax, ay, bx, by, x, y), _turn(bx, by, cx, cy, x, y), _turn(cx, cy, ax, ay, x, y)
            if (u >= 0 and v >= 0 and w >= 0) if is_left_turn else (u <= 0 and v <= 0 and w <= 0):
                return False
    return True


@njit(nogil=True, cache=True)
def leave_out_points(lines: Outlines, squares: Squares, scale: tuple[float, float], tolerance_m: float) -> int:
    """Leave out points (`kept`) as long as none lies farther than the tolerance off the line that is left; how many.

    scale: metres a unit of x and y. No ring may cross another or itself before, and none does afterwards.
    """
    lines = Outlines(
        borrowed(lines.x),
        borrowed(lines.y),
        borrowed(lines.before),
        borrowed(lines.after),
        borrowed(lines.ring),
        borrowed(lines.first),
        borrowed(lines.size),
        borrowed(lines.point_count),
        borrowed(lines.twin),
        borrowed(lines.kept),
    )
    total = 0
    for k in range(ROUNDS):
        limit = tolerance_m * 2.0 ** (k + 1 - ROUNDS)
        removed = 1
        while removed > 0:
            removed = 0
            skipped = -1  # the neighbour of what was left out waits a turn, so that points go evenly
            for b in range(lines.x.size):
                if not lines.kept[b] or b == skipped:
                    continue
                a, c = lines.before[b], lines.after[b]
                if a == b or lines.point_count[lines.ring[b]] <= LEAST_POINTS or _same(lines, a, c):
                    continue
                if _off(lines, a, c, scale) > limit * limit or not _twins_agree(lines, b, a, c):
                    continue
                if _is_line(lines, a, c) or not _is_empty(lines, squares, a, b, c):
                    continue
                at = b
                while True:
                    if lines.kept[at]:
                        lines.kept[at] = False
                        lines.point_count[lines.ring[at]] -= 1
                        p, q = lines.before[at], lines.after[at]
                        lines.after[p] = q
                        lines.before[q] = p
                        removed += 1
                    at = lines.twin[at]
                    if at == b:
                        break
                skipped = c
            total += removed
    return total
