"""Many polylines at once, as ragged arrays."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray


@dataclass(frozen=True, slots=True)
class Polylines:
    """first: int64 (n+1,) where each line's points begin; x_m, y_m: float64 (k,) [m]."""

    first: NDArray[np.int64]
    x_m: NDArray[np.float64]
    y_m: NDArray[np.float64]

    @property
    def count(self) -> int:
        """Number of lines."""
        return int(self.first.size - 1)

    def line_of_point(self) -> NDArray[np.int64]:
        """The line each point belongs to, int64 (k,)."""
        return np.repeat(np.arange(self.count), np.diff(self.first))

    def is_end(self) -> NDArray[np.bool_]:
        """Whether a point is the first or last of its line, bool (k,)."""
        end = np.zeros(self.x_m.size, bool)
        end[self.first[:-1]] = True
        end[self.first[1:] - 1] = True
        return end

    def position_m(self) -> NDArray[np.float64]:
        """Distance of each point from the start of its line, along the line, float64 (k,) [m]."""
        step = np.hypot(np.diff(self.x_m, prepend=self.x_m[:1]), np.diff(self.y_m, prepend=self.y_m[:1]))
        step[self.first[:-1]] = 0.0
        total = np.cumsum(step)
        position: NDArray[np.float64] = total - np.repeat(total[self.first[:-1]], np.diff(self.first))
        return position

    def length_m(self) -> NDArray[np.float64]:
        """Length of each line, float64 (n,) [m]."""
        length: NDArray[np.float64] = self.position_m()[self.first[1:] - 1]
        return length

    def take(self, lines: NDArray[np.int64]) -> Polylines:
        """Some of the lines, in the order given."""
        point = ragged_indices(self.first[lines], self.first[lines + 1])
        return Polylines(offsets(np.diff(self.first)[lines]), self.x_m[point], self.y_m[point])


def offsets(counts: NDArray[np.int64]) -> NDArray[np.int64]:
    """Where the parts of a ragged array begin, int64 (n+1,)."""
    return np.concatenate((np.zeros(1, np.int64), np.cumsum(counts, dtype=np.int64)))


def ragged_indices(begin: NDArray[np.int64], end: NDArray[np.int64]) -> NDArray[np.int64]:
    """begin[0]..end[0]-1, begin[1]..end[1]-1, … in one array."""
    counts = end - begin
    first = offsets(counts)
    return np.repeat(begin - first[:-1], counts) + np.arange(int(first[-1]))


def smoothed(values: NDArray[np.float64], pinned: NDArray[np.bool_], passes: int) -> NDArray[np.float64]:
    """Values along lines after repeated averaging of neighbours with weights 1, 2, 1; pinned ones stay.

    The first and last value of every line must be pinned, which keeps lines apart.
    """
    out = values.copy()
    free = np.flatnonzero(~pinned)
    for _ in range(passes):
        out[free] = 0.5 * out[free] + 0.25 * (out[free - 1] + out[free + 1])
    return out


def resampled(lines: Polylines, spacing_m: NDArray[np.float64] | float) -> tuple[Polylines, NDArray[np.float64]]:
    """Lines with even spacing near spacing_m (a value, or one a line), ends kept, and the position of each new point
    as a fractional index into the old points, for values that travel along. At least two points a line."""
    position = lines.position_m()
    length = position[lines.first[1:] - 1]
    counts = np.maximum(1, np.round(length / spacing_m)).astype(np.int64) + 1
    first = offsets(counts)
    apart_m = 1.0  # between lines on the common axis, so that interpolation never mixes two lines
    start = np.concatenate(([0.0], np.cumsum(length + apart_m)))[:-1]
    old_axis = position + np.repeat(start, np.diff(lines.first))
    fraction = (np.arange(int(first[-1])) - np.repeat(first[:-1], counts)) / np.repeat(counts - 1, counts)
    new_axis = np.repeat(start, counts) + fraction * np.repeat(length, counts)
    index = np.interp(new_axis, old_axis, np.arange(old_axis.size, dtype=np.float64))
    index[first[:-1]] = lines.first[:-1]
    index[first[1:] - 1] = lines.first[1:] - 1
    return Polylines(first, at_index(lines.x_m, index), at_index(lines.y_m, index)), index


def at_index(values: NDArray[np.float64], index: NDArray[np.float64]) -> NDArray[np.float64]:
    """Values at fractional indices, linear."""
    below = np.floor(index).astype(np.int64)
    above = np.minimum(below + 1, values.size - 1)
    part = index - below
    out: NDArray[np.float64] = values[below] * (1.0 - part) + values[above] * part
    return out


def normals(lines: Polylines) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Unit vectors to the left of the lines at their points, float64 (k,) each."""
    point = np.arange(lines.x_m.size)
    owner = lines.line_of_point()
    before = np.maximum(point - 1, lines.first[:-1][owner])
    after = np.minimum(point + 1, lines.first[1:][owner] - 1)
    dx, dy = lines.x_m[after] - lines.x_m[before], lines.y_m[after] - lines.y_m[before]
    norm = np.maximum(np.hypot(dx, dy), 1e-9)
    return -dy / norm, dx / norm
