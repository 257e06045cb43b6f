"""Compiled: time from a charge to another on curves of power that are linear between points.

On a piece where the power is p + g·x, x the charge beyond the piece's beginning, a battery of C joules takes

    C·∫dx/(p + g·x) = C·x/p · ln(1 + u)/u  with u = g·x/p,

which is solved for x as x = p·t/C · (e^w − 1)/w with w = g·t/C. Both stay exact where g is 0 or next to it.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

import energy.compiled.cache  # noqa: F401  (sets the cache folder before anything is compiled)
from energy.compiled.kernels_borrow import borrowed


class ChargeCurves(NamedTuple):
    """Curves of power of one battery, one behind the other: curve k has the points first[k] to first[k + 1].

    first: int64 (m + 1,). soc_frac: float64 (n,), rising from 0 to 1 within each curve. power_w: float64 (n,), > 0.
    seconds: float64 (n,), from empty to each point. capacity_j: of the battery [J].
    """

    first: NDArray[np.int64]
    soc_frac: NDArray[np.float64]
    power_w: NDArray[np.float64]
    seconds: NDArray[np.float64]
    capacity_j: float


@njit(nogil=True, cache=True)
def borrowed_curves(curves: ChargeCurves) -> ChargeCurves:
    """The same curves with their arrays borrowed, for a kernel that reads them often."""
    return ChargeCurves(
        borrowed(curves.first),
        borrowed(curves.soc_frac),
        borrowed(curves.power_w),
        borrowed(curves.seconds),
        curves.capacity_j,
    )


@njit(nogil=True, cache=True)
def piece_at(curves: ChargeCurves, curve: int, soc_frac: float) -> int:
    """First point of the piece that a charge within 0..1 lies on; the last piece holds the full battery."""
    low = int(curves.first[curve])
    high = int(curves.first[curve + 1]) - 1
    while high - low > 1:
        middle = (low + high) >> 1
        if curves.soc_frac[middle] <= soc_frac:
            low = middle
        else:
            high = middle
    return low


@njit(nogil=True, cache=True)
def slope_of(curves: ChargeCurves, piece: int) -> float:
    """Rise of power with charge on a piece [W]."""
    rise = curves.power_w[piece + 1] - curves.power_w[piece]
    return float(rise / (curves.soc_frac[piece + 1] - curves.soc_frac[piece]))


@njit(nogil=True, cache=True)
def power_on(curves: ChargeCurves, piece: int, soc_frac: float) -> float:
    """Power at a charge of a piece [W], between those of its ends."""
    share = (soc_frac - curves.soc_frac[piece]) / (curves.soc_frac[piece + 1] - curves.soc_frac[piece])
    return float(curves.power_w[piece] * (1.0 - share) + curves.power_w[piece + 1] * share)


@njit(nogil=True, cache=True)
def power_at(curves: ChargeCurves, curve: int, soc_frac: float) -> float:
    """Power into the battery at a charge within 0..1 [W]."""
    return power_on(curves, piece_at(curves, curve, soc_frac), soc_frac)


@njit(nogil=True, cache=True)
def seconds_on(curves: ChargeCurves, piece: int, start_frac: float, end_frac: float) -> float:
    """Time from one charge to a higher one of the same piece [s]."""
    power = power_on(curves, piece, start_frac)
    gained = end_frac - start_frac
    u = slope_of(curves, piece) * gained / power
    factor = math.log1p(u) / u if u != 0.0 else 1.0
    return curves.capacity_j * gained / power * factor


@njit(nogil=True, cache=True)
def seconds_to(curves: ChargeCurves, curve: int, soc_frac: float) -> float:
    """Time from empty to a charge within 0..1 [s]; it rises with the charge."""
    piece = piece_at(curves, curve, soc_frac)
    return float(curves.seconds[piece]) + seconds_on(curves, piece, float(curves.soc_frac[piece]), soc_frac)


@njit(nogil=True, cache=True)
def seconds_between(curves: ChargeCurves, curve: int, start_frac: float, end_frac: float) -> float:
    """Time from a charge to another, no lower one, both within 0..1 [s]."""
    start = piece_at(curves, curve, start_frac)
    end = piece_at(curves, curve, end_frac)
    if start == end:
        return seconds_on(curves, start, start_frac, end_frac)
    return (
        seconds_on(curves, start, start_frac, float(curves.soc_frac[start + 1]))
        + float(curves.seconds[end] - curves.seconds[start + 1])
        + seconds_on(curves, end, float(curves.soc_frac[end]), end_frac)
    )


@njit(nogil=True, cache=True)
def soc_after(curves: ChargeCurves, curve: int, start_frac: float, seconds: float) -> float:
    """Charge after a time at least 0 from a charge within 0..1; 1 once the battery is full."""
    piece = piece_at(curves, curve, start_frac)
    low_frac = start_frac
    left = seconds
    to_end = seconds_on(curves, piece, start_frac, curves.soc_frac[piece + 1])
    if left >= to_end:
        last = curves.first[curve + 1] - 1
        piece += 1
        at = curves.seconds[piece] + (left - to_end)
        if piece == last or at >= curves.seconds[last]:
            return 1.0
        high = last
        while high - piece > 1:
            middle = (piece + high) >> 1
            if curves.seconds[middle] <= at:
                piece = middle
            else:
                high = middle
        low_frac = curves.soc_frac[piece]
        left = at - curves.seconds[piece]
    w = slope_of(curves, piece) * left / curves.capacity_j
    factor = math.expm1(w) / w if w != 0.0 else 1.0
    gained = power_on(curves, piece, low_frac) * left / curves.capacity_j * factor
    return min(low_frac + gained, float(curves.soc_frac[piece + 1]))


@njit(nogil=True, cache=True)
def seconds_between_all(
    curves: ChargeCurves, curve: int, start_frac: NDArray[np.float64], end_frac: NDArray[np.float64]
) -> NDArray[np.float64]:
    """`seconds_between` of each pair, float64 (n,) [s]."""
    curves = borrowed_curves(curves)
    found = np.empty(start_frac.size, np.float64)
    for k in range(start_frac.size):
        found[k] = seconds_between(curves, curve, start_frac[k], end_frac[k])
    return found


@njit(nogil=True, cache=True)
def soc_after_all(
    curves: ChargeCurves, curve: int, start_frac: NDArray[np.float64], seconds: NDArray[np.float64]
) -> NDArray[np.float64]:
    """`soc_after` of each pair, float64 (n,)."""
    curves = borrowed_curves(curves)
    found = np.empty(start_frac.size, np.float64)
    for k in range(start_frac.size):
        found[k] = soc_after(curves, curve, start_frac[k], seconds[k])
    return found


@njit(nogil=True, cache=True)
def most_stationary(curves: ChargeCurves, curve_a: int, curve_b: int) -> int:
    """How many charges `stationary_charges` may find at most."""
    points_a = curves.first[curve_a + 1] - curves.first[curve_a]
    points_b = curves.first[curve_b + 1] - curves.first[curve_b]
    return 2 * int(points_a + points_b)


@njit(nogil=True, cache=True)
def stationary_charges(
    curves: ChargeCurves,
    curve_a: int,
    curve_b: int,
    shift_frac: float,
    price_per_w: float,
    found: NDArray[np.float64],
    weight_a: float = 1.0,
    weight_b: float = 1.0,
) -> int:
    """How many charges d are written to found, rising, with w_a/P_a(d) − w_b/P_b(d − shift) + price = 0.

    d is within 0..1 and so is d − shift; the shift may be negative. price_per_w [1/W]: linear term of the cost of a
    charge over the capacity [s/J]. weight_a, weight_b: w_a, w_b ≥ 0, what a second of each counts. On each pair of
    pieces it is w_a·P_b − w_b·P_a + price·P_a·P_b = 0, linear or quadratic in d. Where both sides agree on a whole
    interval nothing is found there: its ends are points of the curves. found: float64, at least `most_stationary` long.
    """
    curves = borrowed_curves(curves)
    count = 0
    low = max(0.0, shift_frac)
    high = min(1.0, 1.0 + shift_frac)
    if not low < high:
        return 0
    a = piece_at(curves, curve_a, low)
    b = piece_at(curves, curve_b, min(max(low - shift_frac, 0.0), 1.0))
    last_a = curves.first[curve_a + 1] - 2
    last_b = curves.first[curve_b + 1] - 2
    while True:
        end_a = curves.soc_frac[a + 1] if a < last_a else 1.0
        end_b = curves.soc_frac[b + 1] + shift_frac if b < last_b else 1.0 + shift_frac
        end = min(end_a, end_b, high)
        if end > low:
            count = _stationary_on(curves, a, b, shift_frac, price_per_w, low, end, found, count, weight_a, weight_b)
            low = end
        if end >= high:
            return count
        if end_a <= end_b:
            a += 1
        if end_b <= end_a:
            b += 1


@njit(nogil=True, cache=True)
def _stationary_on(
    curves: ChargeCurves,
    a: int,
    b: int,
    shift_frac: float,
    price_per_w: float,
    low: float,
    high: float,
    found: NDArray[np.float64],
    count: int,
    weight_a: float,
    weight_b: float,
) -> int:
    """As `stationary_charges`, on low..high, which one piece of each curve covers; x runs from 0 to 1 on it."""
    scale = max(curves.power_w[a], curves.power_w[a + 1], curves.power_w[b], curves.power_w[b + 1])
    price = price_per_w * scale
    from_a, to_a = power_on(curves, a, low) / scale, power_on(curves, a, high) / scale
    from_b, to_b = power_on(curves, b, low - shift_frac) / scale, power_on(curves, b, high - shift_frac) / scale
    rise_a, rise_b = to_a - from_a, to_b - from_b
    square = price * rise_a * rise_b
    linear = weight_a * rise_b - weight_b * rise_a + price * (from_a * rise_b + from_b * rise_a)
    constant = weight_a * from_b - weight_b * from_a + price * from_a * from_b
    first = second = -1.0
    if square == 0.0:
        if linear != 0.0:
            first = -constant / linear
    else:
        under = linear * linear - 4.0 * square * constant
        if under >= 0.0:
            half = -0.5 * (linear + math.copysign(math.sqrt(under), linear))
            first = half / square
            if half != 0.0:
                second = constant / half
    if second < first:
        first, second = second, first
    for k in range(2):
        x = first if k == 0 else second
        if 0.0 <= x <= 1.0:
            d = min(low + x * (high - low), high)
            if count == 0 or d > found[count - 1]:
                found[count] = d
                count += 1
    return count
