"""State of charge along a chain of link energies, with the battery's two limits (MODEL.md section 5)."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from energy.units import JOULE_PER_WH

if TYPE_CHECKING:
    from numpy.typing import NDArray


def soc_along(
    energy_j: NDArray[np.float64], soc_start_frac: float, capacity_wh: float
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """State of charge after each link and the energy braked away in it.

    energy_j: float64 (n,) battery energy a link [J], negative where recuperated.
    Returns soc_frac float64 (n,), clamped at 1 and *not* clamped below (a negative value is missing energy),
    and braked_away_j float64 (n,) >= 0: what no longer fitted into the full battery and went to the friction brakes.
    """
    capacity_j = capacity_wh * JOULE_PER_WH
    soc_frac = np.empty(energy_j.size)
    braked_away_j = np.zeros(energy_j.size)
    soc = soc_start_frac
    for k, energy in enumerate(energy_j.tolist()):
        soc -= energy / capacity_j
        if soc > 1.0:
            braked_away_j[k] = (soc - 1.0) * capacity_j
            soc = 1.0
        soc_frac[k] = soc
    return soc_frac, braked_away_j
