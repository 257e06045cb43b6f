"""Compiled: drawn vehicles driven along the legs of a plan, and the charge that each of them needs for a leg."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

import energy.compiled.cache  # noqa: F401  (sets the cache folder before anything is compiled)


class Legs(NamedTuple):
    """Legs of a plan over n links, leg k over links first[k]..first[k + 1]; charges are fractions.

    first: int64 (L + 1,). depart_frac: (L,) charge with which each is begun. gain_j: (L,) what a fixed stay before it
    charges, NaN where it is charged up to depart_frac. least_frac: (L,) that each may end with. reserve_frac: below
    which it never may be.
    """

    first: NDArray[np.int64]
    depart_frac: NDArray[np.float64]
    gain_j: NDArray[np.float64]
    least_frac: NDArray[np.float64]
    reserve_frac: float


class Outcomes(NamedTuple):
    """What became of s drives on each of L legs, float64 (L, s): charge at its beginning and its end, the least on the
    way, and the least with which it would have been kept, above 1 where none would do. chained: the least with which it
    and all legs after it up to the next stop that is charged as planned would have been kept.
    """

    start: NDArray[np.float64]
    arrive: NDArray[np.float64]
    lowest: NDArray[np.float64]
    needed: NDArray[np.float64]
    chained: NDArray[np.float64]


@njit(nogil=True, cache=True)
def needed_frac(
    energy_j: NDArray[np.float64],
    dissipated_j: NDArray[np.float64],
    residual: float,
    capacity_j: float,
    begin: int,
    end: int,
    arrive_frac: float,
    reserve_frac: float,
) -> float:
    """Least charge before links begin..end with which they end with arrive_frac and never below the reserve.

    Backwards: what is needed before each link. Above 1 where no battery holds enough at the beginning or on the way.
    """
    needed = most = max(arrive_frac, reserve_frac)
    for k in range(end - 1, begin - 1, -1):
        needed = max(needed + (energy_j[k] + residual * dissipated_j[k]) / capacity_j, reserve_frac)
        most = max(most, needed)
    return needed if most <= 1.0 else most


@njit(nogil=True, cache=True)
def drive_legs(
    energy_j: NDArray[np.float64],
    dissipated_j: NDArray[np.float64],
    capacity_j: NDArray[np.float64],
    residual: NDArray[np.float64],
    legs: Legs,
    outcomes: Outcomes,
    first_drive: int,
) -> None:
    """Drive m vehicles, each with r residuals: drive first_drive + i·r + j is vehicle i with its residual j.

    energy_j, dissipated_j: (m, n). capacity_j: (m,). residual: (m, r), fractions of the dissipated energy. What a full
    battery can't take is lost. A stop is left with no less than it is come to with, and a drive that runs out of charge
    goes on as if it had been helped.
    """
    count = legs.depart_frac.size
    for i in range(energy_j.shape[0]):
        energy, dissipated, full_j = energy_j[i], dissipated_j[i], capacity_j[i]
        for j in range(residual.shape[1]):
            drive, more = first_drive + i * residual.shape[1] + j, residual[i, j]
            soc = 0.0
            for leg in range(count):
                gain = legs.gain_j[leg] / full_j
                soc = max(soc, legs.depart_frac[leg]) if math.isnan(gain) else min(soc + gain, 1.0)
                outcomes.start[leg, drive] = soc
                lowest = soc
                for k in range(legs.first[leg], legs.first[leg + 1]):
                    soc = min(soc - (energy[k] + more * dissipated[k]) / full_j, 1.0)
                    lowest = min(lowest, soc)
                outcomes.arrive[leg, drive], outcomes.lowest[leg, drive] = soc, lowest
            for leg in range(count - 1, -1, -1):
                begin, end, least = legs.first[leg], legs.first[leg + 1], legs.least_frac[leg]
                needed = needed_frac(energy, dissipated, more, full_j, begin, end, least, legs.reserve_frac)
                outcomes.needed[leg, drive] = outcomes.chained[leg, drive] = needed
                if leg + 1 < count and not math.isnan(legs.gain_j[leg + 1]):
                    ahead = outcomes.chained[leg + 1, drive]
                    onward = ahead - legs.gain_j[leg + 1] / full_j
                    if ahead > 1.0:
                        outcomes.chained[leg, drive] = max(needed, ahead)
                    elif onward > least:
                        outcomes.chained[leg, drive] = needed_frac(
                            energy, dissipated, more, full_j, begin, end, onward, legs.reserve_frac
                        )
