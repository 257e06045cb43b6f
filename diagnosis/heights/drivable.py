"""Heights of the ground that a road can't follow, as above a tunnel, below a bridge, or beside a stray position."""

from __future__ import annotations

from bisect import bisect_right
from typing import TYPE_CHECKING, Final

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

# Speeds and the steepest grades of roads that are driven at them: STEEPEST_GRADE of routing.importers.heights.profile,
# from streets at 20 % to motorways at 7 %.
SPEEDS_MPS: Final = (50.0 / 3.6, 80.0 / 3.6, 110.0 / 3.6)
STEEPEST: Final = (0.20, 0.12, 0.07)


def steepest_grade(speed_mps: NDArray[np.float64]) -> NDArray[np.float64]:
    """Steepest grade of a road that is driven so fast, float64 (k,) [-]."""
    return np.interp(speed_mps, SPEEDS_MPS, STEEPEST)


def drivable(height_m: NDArray[np.float64], climb_m: NDArray[np.float64]) -> NDArray[np.bool_]:
    """The largest set of heights among which no road is too steep, bool (k,); with both ends, where these fit together.

    A drive seldom begins or ends in a tunnel or on a bridge, and its whole climb hangs on its ends.
    height_m: float64 (k,) along a way [m]; climb_m: float64 (k,) rising, what a road may climb from the way's beginning
    on at its steepest [m]. Heights i before j fit together where |h_j − h_i| ≤ c_j − c_i, that is where c + h and c − h
    both do not fall; so the largest set is the longest subsequence that does not fall in c − h, in the order of c + h
    (Schensted 1961, doi 10.4153/CJM-1961-015-3). O(k log k).
    """
    rises, falls = climb_m + height_m, climb_m - height_m
    order = np.lexsort((falls, rises))
    if height_m.size and rises[0] <= rises[-1] and falls[0] <= falls[-1]:
        beside = (rises >= rises[0]) & (falls >= falls[0]) & (rises <= rises[-1]) & (falls <= falls[-1])
        order = order[beside[order]]
    ends: list[float] = []  # least end of a subsequence of each length, and which height that is
    last: list[int] = []
    before = np.full(height_m.size, -1)
    for k in order.tolist():
        length = bisect_right(ends, falls[k])
        before[k] = last[length - 1] if length else -1
        if length == len(ends):
            ends.append(float(falls[k]))
            last.append(k)
        else:
            ends[length], last[length] = float(falls[k]), k
    kept = np.zeros(height_m.size, np.bool_)
    k = last[-1] if last else -1
    while k >= 0:
        kept[k] = True
        k = int(before[k])
    return kept
