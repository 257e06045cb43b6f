"""Compiled: time at stations by charge, and the charges at which it may pay to go on."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

import energy.compiled.cache  # noqa: F401  (sets the cache folder before anything is compiled)

FLAT_FRAC = 1e-12  # of the terms of a derivative, below which it is none


class Curves(NamedTuple):
    """Power by charge of all kinds of sockets, one after the other; curve k has the points first[k]..first[k + 1].

    first: int64 (K + 1,). charge_j: (n,), from 0 to the capacity in each. power_w: (n,), linear between them.
    since_s: (n,) time from an empty battery.
    """

    first: NDArray[np.int64]
    charge_j: NDArray[np.float64]
    power_w: NDArray[np.float64]
    since_s: NDArray[np.float64]


@njit(nogil=True, cache=True)
def piece_s(power_w: float, other_w: float, step_j: float) -> float:
    """Time of charging step_j while power goes linearly from one to another: step/(P1 − P0)·ln(P1/P0) [s]."""
    share = (other_w - power_w) / power_w
    if abs(share) < 1e-6:  # ln(1 + x)/x = 1 − x/2 + x²/3, of which the rest is below rounding
        return step_j / power_w * (1.0 - share * (0.5 - share / 3.0))
    return step_j / power_w * math.log1p(share) / share


@njit(nogil=True, cache=True)
def piece_at(curves: Curves, curve: int, charge_j: float) -> int:
    """The point of a curve at or before a charge, not its last one."""
    low, high = curves.first[curve], curves.first[curve + 1] - 1
    while high - low > 1:
        middle = (low + high) >> 1
        if curves.charge_j[middle] <= charge_j:
            low = middle
        else:
            high = middle
    return int(low)


@njit(nogil=True, cache=True)
def power_in(curves: Curves, k: int, charge_j: float) -> float:
    """Power at a charge in the piece after point k [W]."""
    share = (charge_j - curves.charge_j[k]) / (curves.charge_j[k + 1] - curves.charge_j[k])
    power: float = curves.power_w[k] + share * (curves.power_w[k + 1] - curves.power_w[k])
    return power


@njit(nogil=True, cache=True)
def since_empty_s(curves: Curves, curve: int, charge_j: float) -> float:
    """Time from an empty battery to a charge, T of docs/charging.md [s]."""
    k = piece_at(curves, curve, charge_j)
    step_j = charge_j - curves.charge_j[k]
    if step_j == 0.0:
        return float(curves.since_s[k])
    return float(curves.since_s[k]) + piece_s(curves.power_w[k], power_in(curves, k, charge_j), step_j)


class Price(NamedTuple):
    """What charging costs at a station: by its time and by what the battery gains, in the units of the objective."""

    a_second: float
    a_joule: float


@njit(nogil=True, cache=True)
def turning_charges(
    curves: Curves,
    here: int,
    price: Price,
    there: int,
    other: Price,
    energy_j: float,
    low_j: float,
    high_j: float,
    out: NDArray[np.float64],
) -> int:
    """Charges in (low_j, high_j] at which leaving costs less than just before and no more than just after.

    φ(d) = cost here of charging to d, less cost at the next station of charging from 0 to d − energy_j, which spares
    it. Written to out, whose length bounds them; returns how many. φ' has the sign of a quadratic on each pair of
    pieces: a_s·Q − b_s·P + (a_j − b_j)·P·Q with P here and Q there, both linear.
    """
    found, falling, flat_from = 0, False, -1.0
    k, m = piece_at(curves, here, low_j), piece_at(curves, there, low_j - energy_j)
    last_k, last_m = curves.first[here + 1] - 2, curves.first[there + 1] - 2
    at_j = low_j
    while at_j < high_j:
        to_j = high_j
        if k < last_k:
            to_j = min(to_j, curves.charge_j[k + 1])
        if m < last_m:
            to_j = min(to_j, curves.charge_j[m + 1] + energy_j)
        if to_j > at_j:
            p0, p1 = power_in(curves, k, at_j), power_in(curves, k, to_j)
            q0, q1 = power_in(curves, m, at_j - energy_j), power_in(curves, m, to_j - energy_j)
            dp, dq, more = p1 - p0, q1 - q0, price.a_joule - other.a_joule
            c0 = price.a_second * q0 - other.a_second * p0 + more * p0 * q0
            c1 = price.a_second * dq - other.a_second * dp + more * (p0 * dq + q0 * dp)
            c2 = more * dp * dq
            size = price.a_second * max(q0, q1) + other.a_second * max(p0, p1) + abs(more) * max(p0, p1) * max(q0, q1)
            first, second = roots_in(c0, c1, c2)
            share = 0.0
            for part in range(3):
                until = first if part == 0 else (second if part == 1 else 1.0)
                if until <= share:
                    continue
                middle = 0.5 * (share + until)
                slope = c0 + middle * (c1 + middle * c2)
                here_j = at_j + share * (to_j - at_j)
                if slope < -FLAT_FRAC * size:
                    falling, flat_from = True, -1.0
                elif falling and slope > FLAT_FRAC * size:
                    if found < out.size:
                        out[found] = here_j if flat_from < 0.0 else flat_from
                        found += 1
                    falling, flat_from = False, -1.0
                elif falling and flat_from < 0.0:
                    flat_from = here_j
                share = until
        if k < last_k and curves.charge_j[k + 1] <= to_j:
            k += 1
        if m < last_m and curves.charge_j[m + 1] + energy_j <= to_j:
            m += 1
        at_j = to_j
    if falling and found < out.size:
        out[found] = high_j if flat_from < 0.0 else flat_from
        found += 1
    return found


@njit(nogil=True, cache=True)
def roots_in(c0: float, c1: float, c2: float) -> tuple[float, float]:
    """Where c0 + c1·x + c2·x² is 0 in (0, 1), ascending; 1 for none."""
    low, high = 1.0, 1.0
    if abs(c2) <= 1e-14 * (abs(c0) + abs(c1)):
        if c1 != 0.0:
            low = -c0 / c1
    else:
        square = c1 * c1 - 4.0 * c2 * c0
        if square >= 0.0:
            q = -0.5 * (c1 + math.copysign(math.sqrt(square), c1))  # without cancellation
            low = q / c2
            high = c0 / q if q != 0.0 else low
    low = low if 0.0 < low < 1.0 else 1.0
    high = high if 0.0 < high < 1.0 else 1.0
    return min(low, high), max(low, high)
