"""Trips that are unlike the others."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from diagnosis.answer.results import Unexplained
from diagnosis.fit.levels import levels
from diagnosis.fit.noise import whitened
from diagnosis.fit.selection import LEAST_TRIPS, NULL_DRAWS
from energy.units import JOULE_PER_KWH

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from diagnosis.fit.model import Model


ODD_FRAC: Final = 0.12  # of the energy that a trip moved
ODD_TYPICAL: Final = 6.0  # typical errors
RESTLESS: Final = 2.0  # times the scatter of windows that trips usually have about the fit of the others
RESTLESS_TYPICAL: Final = 8.0  # typical departures of that
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
    odd = (away > max(ODD_FRAC, ODD_TYPICAL * typical)) | _restless(model)
    if not 0 < int(odd.sum()) <= MOST_ODD_FRAC * odd.size or odd.size - int(odd.sum()) < LEAST_TRIPS:
        return {}
    level = levels(model)
    if level is not None and set(np.array(names)[odd].tolist()) <= set(level.trips):
        return {}  # a box or a load that other trips carry too
    found = {}
    for k in np.flatnonzero(odd).tolist():
        mean_w = left_j[k] / float(model.windows[k].duration_s.sum())
        which = "more" if values[k] > 0.0 else "less"
        text = (
            f"Trip {names[k]} took {abs(values[k]):.0%} of the energy that it moved {which} than the others tell, or"
            " took it otherwise: another vehicle or load, or a faulty recording. It was left out of the fit."
        )
        found[names[k]] = Unexplained(
            "trip", "", float(k), float(k), mean_w, None, left_j[k] / JOULE_PER_KWH, 1.0 / NULL_DRAWS, (names[k],), text
        )
    return found


def _restless(model: Model) -> NDArray[np.bool_]:
    """Trips whose windows scatter far more about the fit of the others than trips do, bool (K,)."""
    scatter = np.array(
        [
            float(np.sqrt(np.mean(np.square(whitened(root, model.residual_w(k, left_out=True))))))
            for k, root in enumerate(model.roots)
        ]
    )
    sizes = np.log(np.maximum(scatter, 1e-9))
    away = sizes - float(np.median(sizes))
    typical = 1.4826 * float(np.median(np.abs(away)))
    return np.asarray(away > max(np.log(RESTLESS), RESTLESS_TYPICAL * typical), np.bool_)
