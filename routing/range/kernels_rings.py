"""Compiled: closed rings from those of a grid, and as JSON."""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from energy.compiled.kernels_borrow import borrowed
from routing.range.kernels_outline import Rings

UNITS = 10_000_000  # of a degree: numbers are written to seven decimals
LEAST_PLAIN = 100  # units, below which JSON's numbers have an exponent
POINT_BYTES = 28  # of a point at most, with brackets and commas: [-179.1234567,-89.1234567],
RING_BYTES = 3  # of what is around the points of a ring, and around the rings of a polygon
TEN = np.uint64(10)
ZERO, COMMA, POINT, MINUS, OPEN, CLOSE, EXPONENT = 48, 44, 46, 45, 91, 93, 101


@njit(nogil=True, cache=True)
def close_rings(
    rings: Rings,
    order: NDArray[np.int64],
    step_e7: tuple[int, int],
    south_west_e7: tuple[int, int],
    lonlat: NDArray[np.float64],
    ring_first: NDArray[np.int64],
) -> None:
    """Rings of a grid in an order, int64 (R,), into lonlat, float64 (P + R, 2) [deg], each with its first point again.

    step_e7: of a point's numbers, east and north [1e-7 deg]. ring_first: (R + 1,), filled with where each begins.
    """
    point, first = borrowed(rings.point), borrowed(rings.first)
    order, lonlat, ring_first = borrowed(order), borrowed(lonlat), borrowed(ring_first)
    at = 0
    ring_first[0] = 0
    for k in range(order.size):
        begin = at
        for row in range(first[order[k]], first[order[k] + 1]):
            for axis in range(2):
                lonlat[at, axis] = (point[row, axis] * step_e7[axis] + south_west_e7[axis]) / UNITS
            at += 1
        lonlat[at, 0], lonlat[at, 1] = lonlat[begin, 0], lonlat[begin, 1]
        at += 1
        ring_first[k + 1] = at


@njit(nogil=True, cache=True, inline="always")
def put_digits(number: np.uint64, size: int, text: NDArray[np.uint8], at: int) -> None:
    """Write the last `size` digits of a whole number; unsigned, which divides in a third of the time."""
    for k in range(at + size - 1, at - 1, -1):
        rest = number // TEN
        text[k] = ZERO + int(number - rest * TEN)
        number = rest


@njit(nogil=True, cache=True)
def put_number(value: float, text: NDArray[np.uint8], at: int) -> int:
    """Write a number rounded to seven decimals, with as few as it needs but one; where the text ends then."""
    rounded = np.rint(value * UNITS)
    if math.copysign(1.0, rounded) < 0.0:
        text[at] = MINUS
        at += 1
    units = int(abs(rounded))
    if 0 < units < LEAST_PLAIN:
        tens, last = units // 10, units % 10
        text[at] = ZERO + (tens if tens > 0 else last)
        at += 1
        if tens > 0 and last > 0:
            text[at], text[at + 1] = POINT, ZERO + last
            at += 2
        text[at], text[at + 1], text[at + 2] = EXPONENT, MINUS, ZERO + (6 if tens > 0 else 7)
        return at + 3
    degrees = units // UNITS
    size = 1 if degrees < 10 else 2 if degrees < 100 else 3
    put_digits(np.uint64(degrees), size, text, at)
    at += size
    text[at] = POINT
    begin = at + 1
    put_digits(np.uint64(units - degrees * UNITS), 7, text, begin)
    at = begin + 7
    while at > begin + 1 and text[at - 1] == ZERO:
        at -= 1
    return at


@njit(nogil=True, cache=True)
def write_polygons(
    lonlat: NDArray[np.float64],
    ring_first: NDArray[np.int64],
    polygon_first: NDArray[np.int64],
    text: NDArray[np.uint8],
) -> int:
    """Write polygons as nested lists of JSON, ASCII; how many bytes. Arrays as in AreaRings, |lonlat| below 1000 deg.

    text: with POINT_BYTES for each point, RING_BYTES for each ring and each polygon, and RING_BYTES more.
    """
    lonlat, ring_first = borrowed(lonlat), borrowed(ring_first)
    polygon_first, text = borrowed(polygon_first), borrowed(text)
    at = 1
    text[0] = OPEN
    for polygon in range(polygon_first.size - 1):
        text[at] = OPEN
        at += 1
        for ring in range(polygon_first[polygon], polygon_first[polygon + 1]):
            text[at] = OPEN
            at += 1
            for k in range(ring_first[ring], ring_first[ring + 1]):
                text[at] = OPEN
                at = put_number(lonlat[k, 0], text, at + 1)
                text[at] = COMMA
                at = put_number(lonlat[k, 1], text, at + 1)
                text[at], text[at + 1] = CLOSE, COMMA
                at += 2
            text[at - 1], text[at] = CLOSE, COMMA  # in place of the last comma
            at += 1
        text[at - 1], text[at] = CLOSE, COMMA
        at += 1
    if at > 1:
        at -= 1
    text[at] = CLOSE
    return at + 1
