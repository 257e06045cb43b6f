"""Trips that are unlike the others."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from diagnosis.answer.results import Unexplained
from diagnosis.fit.levels import levels
from diagnosis.fit.selection import LEAST_TRIPS, NULL_DRAWS
from energy.units import JOULE_PER_KWH

if TYPE_CHECKING:
    from diagnosis.fit.model import Model


ODD_FRAC: Final = 0.3  # of the energy that a trip moved
ODD_TYPICAL: Final = 8.0  # typical errors
MOST_ODD_FRAC: Final = 0.2


def odd_trips(model: Model) -> dict[str, Unexplained]:
    """Trips by the fit of the others so far off that they are no drives of this vehicle, or no sound recordings.

    Only few can be; more would say that the model is wrong for all.
    """
    names, errors, left_j = [], [], []
    for k, trip in enumerate(model.windows):
        residual_j = float((model.residual_w(k, left_out=True) * trip.duration_s).sum())
        names.append(trip.trip_id)
        left_j.append(residual_j)
        errors.append(residual_j / max(float(np.abs(trip.measured_j).sum()), 1.0))
    values = np.array(errors)
    away = np.abs(values - np.median(values))
    typical = 1.4826 * float(np.median(away))
    odd = away > max(ODD_FRAC, ODD_TYPICAL * typical)
    if not 0 < int(odd.sum()) <= MOST_ODD_FRAC * odd.size or odd.size - int(odd.sum()) < LEAST_TRIPS:
        return {}
    level = levels(model)
    if (
        level is not None
        and set(np.array(names)[odd].tolist()) <= set(level.trips)
        and len(level.trips) > int(odd.sum())
    ):
        return {}  # a box or a load that other trips carry too
    found = {}
    for k in np.flatnonzero(odd).tolist():
        mean_w = left_j[k] / float(model.windows[k].duration_s.sum())
        text = (
            f"Trip {names[k]} took {values[k]:+.0%} of the energy that it moved more than the others tell: another"
            " vehicle or load, or a faulty recording. It was left out of the fit."
        )
        found[names[k]] = Unexplained(
            "trip", "", float(k), float(k), mean_w, None, left_j[k] / JOULE_PER_KWH, 1.0 / NULL_DRAWS, (names[k],), text
        )
    return found
