"""Whether power that is said to be heat is there at standstill too, where nothing moves the car."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np
from scipy import stats

from diagnosis.fit.jackknife import additions, equations

if TYPE_CHECKING:
    from collections.abc import Collection

    from diagnosis.fit.model import Model

COLUMN: Final = "standing"
LEAST_EFFECTIVE: Final = 2.5  # drives that tell, below which no spread is known
MOST_HALF: Final = 0.6  # of what is claimed, beyond which standstill tells nothing


@dataclass(frozen=True, slots=True)
class Standing:
    """Power at standstill over what some terms say of it [-], with its 95 % interval."""

    ratio: float
    low: float
    high: float


def at_standstill(model: Model, labels: Collection[str]) -> Standing | None:
    """What standstill shows of terms that do not move the car; None where too few drives stood, or too shortly.

    Terms stay as they are where the car moves, and may be of another size where it stands.
    """
    windows = []
    for trip in model.windows:
        claimed_j = sum(
            (model.solution.value(label) * trip.column(label) for label in labels), np.zeros(trip.begin_s.size)
        )
        standing = trip.standing_s / trip.duration_s
        unknown = 1.0 if trip.climate_j is None else 0.0
        windows.append(trip.with_column(COLUMN, np.asarray(unknown * claimed_j * standing, np.float64)))
    system = equations(windows, model.roots, model.system.prior.with_free())
    beside = [name for name in model.solution.names if name in model.system.names]
    added = additions(system, beside, [COLUMN])
    half = float(stats.t.ppf(0.975, max(added.effective[0] - 1.0, 1.0)) * added.sd[0])
    ratio = 1.0 + float(added.coefficients[0])
    if added.effective[0] < LEAST_EFFECTIVE or half > MOST_HALF:
        return None
    return Standing(ratio, ratio - half, ratio + half)
