"""Squares of the map, by which things are found that are near a place."""

from __future__ import annotations

import math
from typing import Final

CELLS_A_DEGREE: Final = 100  # squares of 0.01 degrees, about 1 km
COARSE: Final = 10  # times as wide
_ROW: Final = 1 << 17  # more than there are squares in a row


def cell_of(lat: float, lon: float) -> int:
    """The square that a place lies in."""
    return cell_at(math.floor(lat * CELLS_A_DEGREE), math.floor(lon * CELLS_A_DEGREE))


def cell_at(row: int, column: int) -> int:
    """The square in a row from the equator and a column from Greenwich."""
    return row * _ROW + column


def cells_around(lat: float, lon: float, ring: int) -> list[int]:
    """The squares that are so many away from that of a place, itself for 0; narrow ones near the poles are more."""
    row, column = math.floor(lat * CELLS_A_DEGREE), math.floor(lon * CELLS_A_DEGREE)
    widen = min(20, round(1.0 / max(0.05, math.cos(math.radians(lat)))))
    wide = ring * widen
    cells = []
    for north in range(-ring, ring + 1):
        for east in range(-wide, wide + 1):
            if max(abs(north), abs(east) / widen) > ring - 1 or ring == 0:
                cells.append((row + north) * _ROW + _wrapped(column + east))
    return cells


def coarse_word(lat: float, lon: float) -> str:
    """The wide square that a place lies in, as a word of the index."""
    return f"q{math.floor(lat * CELLS_A_DEGREE / COARSE) + 900}x{_wrapped_coarse(lon)}"


def coarse_words_around(lat: float, lon: float) -> list[str]:
    """The wide square of a place and the eight around it."""
    step = COARSE / CELLS_A_DEGREE
    return [coarse_word(lat + north * step, lon + east * step) for north in (-1, 0, 1) for east in (-1, 0, 1)]


def _wrapped(column: int) -> int:
    half = 180 * CELLS_A_DEGREE
    return (column + half) % (2 * half) - half


def _wrapped_coarse(lon: float) -> int:
    return math.floor(((lon + 180.0) % 360.0) * CELLS_A_DEGREE / COARSE)
