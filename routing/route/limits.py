"""The battery's limits on a path, and whether a path that was found without them is the best with them."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from energy.battery import soc_along
from energy.units import JOULE_PER_WH
from routing.search.found import Limits

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray


def charge_limits(soc_frac: float, reserve_frac: float, capacity_j: float) -> Limits:
    """Battery energy from departure on that fills the battery, and that reaches the reserve."""
    return Limits(-(1.0 - soc_frac) * capacity_j, (soc_frac - reserve_frac) * capacity_j)


def is_best_within(
    limits: Limits,
    energy_j: NDArray[np.float64],
    soc_frac: float,
    capacity_wh: float,
    *,
    energy_weighted: bool,
    accepted_whole_j: Callable[[], NDArray[np.float64]] | None,
) -> bool:
    """Whether a path that is the best without limits surely is the best with them.

    It never takes the charge below the reserve, and costs what the search without limits says: a battery that is
    overfilled on the way, or so full that it takes up less, loses energy, which changes the cost only where energy is
    weighted. It only ever takes energy from other paths too.

    energy_j: float64 (n,) battery energy of each link [J], with what a nearly full battery refuses. soc_frac: charge at
    its start. accepted_whole_j: the same as if nothing were refused; None for a vehicle whose battery refuses nothing
    before it is full.
    """
    soc, braked_away_j = soc_along(energy_j, soc_frac, capacity_wh)
    if float(((soc_frac - soc) * (capacity_wh * JOULE_PER_WH)).max()) > limits.most_energy_j:
        return False
    if not energy_weighted:
        return True
    if braked_away_j.any():
        return False
    return accepted_whole_j is None or np.array_equal(energy_j, accepted_whole_j())
