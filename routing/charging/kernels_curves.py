"""Compiled: the charges at which it may pay to go on to the next station."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from energy.charging.kernels_charging import ChargeCurves, piece_at, power_on

FLAT_FRAC = 1e-12  # of the terms of a derivative, below which it is none


class Price(NamedTuple):
    """What charging costs at a station: by its time and by what the battery gains, in the units of the objective."""

    a_second: float
    a_joule: float


@njit(nogil=True, cache=True)
def turning_charges(
    curves: ChargeCurves,
    here: int,
    price: Price,
    there: int,
    other: Price,
    energy_frac: float,
    low_frac: float,
    high_frac: float,
    out: NDArray[np.float64],
) -> int:
    """Charges in (low_frac, high_frac] at which leaving costs less than just before and no more than just after.

    φ(d) = cost here of charging to d, less cost at the next station of charging from 0 to d − energy_frac, which spares
    it. Written to out, whose length bounds them; returns how many. φ' has the sign of a quadratic on each pair of
    pieces: a_s·Q − b_s·P + (a_j − b_j)·P·Q with P here and Q there, both linear.
    """
    found, falling, flat_from = 0, False, -1.0
    k, m = piece_at(curves, here, low_frac), piece_at(curves, there, low_frac - energy_frac)
    last_k, last_m = curves.first[here + 1] - 2, curves.first[there + 1] - 2
    at_frac = low_frac
    while at_frac < high_frac:
        to_frac = high_frac
        if k < last_k:
            to_frac = min(to_frac, curves.soc_frac[k + 1])
        if m < last_m:
            to_frac = min(to_frac, curves.soc_frac[m + 1] + energy_frac)
        if to_frac > at_frac:
            p0, p1 = power_on(curves, k, at_frac), power_on(curves, k, to_frac)
            q0, q1 = power_on(curves, m, at_frac - energy_frac), power_on(curves, m, to_frac - energy_frac)
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
                here_frac = at_frac + share * (to_frac - at_frac)
                if slope < -FLAT_FRAC * size:
                    falling, flat_from = True, -1.0
                elif falling and slope > FLAT_FRAC * size:
                    if found < out.size:
                        out[found] = here_frac if flat_from < 0.0 else flat_from
                        found += 1
                    falling, flat_from = False, -1.0
                elif falling and flat_from < 0.0:
                    flat_from = here_frac
                share = until
        if k < last_k and curves.soc_frac[k + 1] <= to_frac:
            k += 1
        if m < last_m and curves.soc_frac[m + 1] + energy_frac <= to_frac:
            m += 1
        at_frac = to_frac
    if falling and found < out.size:
        out[found] = high_frac if flat_from < 0.0 else flat_from
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
