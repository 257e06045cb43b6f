"""Serpentines: roads lengthened in meanders where the ground is steeper than their grade allows."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np
from scipy import ndimage
from scipy.special import j0

from routing.synth.polylines import Polylines, at_index, normals, smoothed

if TYPE_CHECKING:
    from numpy.typing import NDArray

MOST_WINDING: Final = 3.4  # road length per length of its corridor
_PHASES: Final = 128
_ANGLES: Final = np.linspace(0.0, 2.0, 81)


def _meander_tables() -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Advance and sideways offset of the sine-generated curve over one wave, in wavelengths, by (swing angle, phase).

    Langbein and Leopold 1966, USGS Professional Paper 422-H: heading = swing · sin(phase).
    """
    phase = np.linspace(0.0, 2.0 * np.pi, _PHASES + 1)
    middle = 0.5 * (phase[1:] + phase[:-1])
    heading = _ANGLES[:, None] * np.cos(middle)[None, :]
    zero = np.zeros((_ANGLES.size, 1))
    advance = np.hstack((zero, np.cumsum(np.cos(heading), axis=1)))
    aside = np.hstack((zero, np.cumsum(np.sin(heading), axis=1)))
    wave = advance[:, -1:]
    return advance / wave, aside / wave


_ADVANCE, _ASIDE = _meander_tables()


def winding_needed(
    lines: Polylines, height_m: NDArray[np.float64], easy_grade: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Road length per corridor length at each point, float64 (k,) in 1..MOST_WINDING, so that grades stay easy."""
    position = lines.position_m()
    owner = lines.line_of_point()
    point = np.arange(position.size)
    before = np.maximum(point - 2, lines.first[:-1][owner])
    after = np.minimum(point + 2, lines.first[1:][owner] - 1)
    grade = np.abs(height_m[after] - height_m[before]) / np.maximum(position[after] - position[before], 1.0)
    needed = np.clip(grade / easy_grade[owner], 1.0, MOST_WINDING)
    needed = ndimage.maximum_filter1d(needed, 5)
    needed[lines.is_end()] = 1.0
    winding: NDArray[np.float64] = smoothed(needed, lines.is_end(), 5)
    return np.where(winding < 1.08, 1.0, winding)


def meandered(lines: Polylines, winding: NDArray[np.float64], rng: np.random.Generator) -> Polylines:
    """The lines with meanders of the given winding laid on them; same point count, ends kept.

    Points should be much closer than a meander, 8 m or so.
    """
    owner = lines.line_of_point()
    position = lines.position_m()
    end = lines.is_end()
    swing = np.interp(1.0 / winding, j0(_ANGLES[::-1]), _ANGLES[::-1])
    restless = smoothed(np.where(end, 0.0, rng.standard_normal(position.size)), end, 60)
    wave_m = np.clip(760.0 / winding, 200.0, 520.0) * np.exp(np.clip(3.5 * restless, -0.6, 0.6))
    step = np.diff(position, prepend=0.0)
    step[lines.first[:-1]] = 0.0
    turns = np.cumsum(step / wave_m)
    turns -= np.repeat(turns[lines.first[:-1]], np.diff(lines.first))
    turns += rng.random(lines.count)[owner]
    part = turns - np.floor(turns)
    at = np.array([swing / _ANGLES[1], part * _PHASES])
    advance = ndimage.map_coordinates(_ADVANCE, at, order=1, mode="nearest") - part
    aside = ndimage.map_coordinates(_ASIDE, at, order=1, mode="nearest")
    along_m = np.clip(position + advance * wave_m, 0.0, np.repeat(lines.length_m(), np.diff(lines.first)))
    nx, ny = normals(lines)
    axis = np.concatenate(([0.0], np.cumsum(lines.length_m() + 1.0)))[:-1]  # one common axis with gaps between lines
    index = np.interp(along_m + axis[owner], position + axis[owner], np.arange(position.size, dtype=np.float64))
    index = np.where(end, np.arange(position.size), index)
    near = np.rint(index).astype(np.int64)
    shift_m = np.where(end | (winding <= 1.0), 0.0, aside * wave_m)
    x, y = at_index(lines.x_m, index), at_index(lines.y_m, index)
    return Polylines(lines.first, x + nx[near] * shift_m, y + ny[near] * shift_m)
