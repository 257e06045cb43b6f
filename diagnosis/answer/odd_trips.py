"""Trips that are unlike the others."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from diagnosis.answer.results import Unexplained
from diagnosis.fit.levels import levels
from diagnosis.fit.model import residual_w
from diagnosis.fit.noise import whitened
from diagnosis.fit.selection import LEAST_TRIPS, NULL_DRAWS
from energy.units import JOULE_PER_KWH

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from diagnosis.fit.model import Model
    from diagnosis.fit.windows import Windows


ODD_FRAC: Final = 0.12  # of the energy that a trip moved
ODD_TYPICAL: Final = 6.0  # typical errors
RESTLESS: Final = 2.0  # times the scatter of windows that trips usually have about the fit of the others
RESTLESS_TYPICAL: Final = 8.0  # typical departures of that
MOST_ODD_FRAC: Final = 0.2


def odd_trips(model: Model) -> dict[str, Unexplained]:
    """Trips by the fit of the others so far off that they are no drives of this vehicle, or no sound recordings.

    Only few can be; more would say that the model is wrong for all.
    """
    errors, scatter = _departures(model)
    odd = _far(errors, errors, scatter, scatter)
    if not 0 < int(odd.sum()) <= MOST_ODD_FRAC * odd.size or odd.size - int(odd.sum()) < LEAST_TRIPS:
        return {}
    names = [trip.trip_id for trip in model.windows]
    level = levels(model)
    if level is not None and set(np.array(names)[odd].tolist()) <= set(level.trips):
        return {}  # a box or a load that other trips carry too
    return {
        names[k]: _told(model.windows[k], model.residual_w(k, left_out=True), float(errors[k]), k, "It was left out.")
        for k in np.flatnonzero(odd).tolist()
    }


def odd_among(model: Model, kept: Sequence[Windows]) -> tuple[Unexplained, ...]:
    """Trips that were not fitted and are as far off from those that were; none where most of them are."""
    if not kept:
        return ()
    errors, scatter = _departures(model)
    residuals = [residual_w(trip, model.solution, model.solution.coefficients) for trip in kept]
    own = np.array([_error(trip, residual) for trip, residual in zip(kept, residuals, strict=True)])
    own_scatter = np.array(
        [_scatter(model.noise.root(trip), residual) for trip, residual in zip(kept, residuals, strict=True)]
    )
    odd = _far(own, errors, own_scatter, scatter)
    if int(odd.sum()) > max(MOST_ODD_FRAC * len(kept), 1.0):
        return ()
    count = len(model.windows)
    return tuple(
        _told(kept[k], residuals[k], float(own[k]), count + k, "It was held out.") for k in np.flatnonzero(odd).tolist()
    )


def _departures(model: Model) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Of each fitted trip by the fit of the others: the share that is left, and how its windows scatter, (K,) each."""
    residuals = [model.residual_w(k, left_out=True) for k in range(len(model.windows))]
    errors = [_error(trip, residual) for trip, residual in zip(model.windows, residuals, strict=True)]
    scatter = [_scatter(root, residual) for root, residual in zip(model.roots, residuals, strict=True)]
    return np.array(errors), np.array(scatter)


def _error(trip: Windows, residual: NDArray[np.float64]) -> float:
    return float((residual * trip.duration_s).sum()) / max(float(np.abs(trip.measured_j).sum()), 1.0)


def _scatter(root: NDArray[np.float64], residual: NDArray[np.float64]) -> float:
    return float(np.sqrt(np.mean(np.square(whitened(root, residual)))))


def _far(
    errors: NDArray[np.float64],
    usual_errors: NDArray[np.float64],
    scatter: NDArray[np.float64],
    usual_scatter: NDArray[np.float64],
) -> NDArray[np.bool_]:
    """Which trips err far more than is usual, or have windows that scatter far more, bool (n,)."""
    away = np.abs(errors - np.median(usual_errors))
    typical = 1.4826 * float(np.median(np.abs(usual_errors - np.median(usual_errors))))
    sizes, usual = (np.log(np.maximum(values, 1e-9)) for values in (scatter, usual_scatter))
    restless = sizes - float(np.median(usual))
    typically = 1.4826 * float(np.median(np.abs(usual - np.median(usual))))
    far = away > max(ODD_FRAC, ODD_TYPICAL * typical)
    return np.asarray(far | (restless > max(np.log(RESTLESS), RESTLESS_TYPICAL * typically)), np.bool_)


def _told(trip: Windows, residual: NDArray[np.float64], error: float, place: int, fate: str) -> Unexplained:
    left_j = float((residual * trip.duration_s).sum())
    which = "more" if error > 0.0 else "less"
    text = (
        f"Trip {trip.trip_id} took {abs(error):.0%} of the energy that it moved {which} than the others tell, or took"
        f" it otherwise: another vehicle or load, or a faulty recording. {fate}"
    )
    mean_w = left_j / float(trip.duration_s.sum())
    at = float(place)
    return Unexplained(
        "trip", "", at, at, mean_w, None, left_j / JOULE_PER_KWH, 1.0 / NULL_DRAWS, (trip.trip_id,), text
    )
