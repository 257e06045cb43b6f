"""Trips that are unlike the others."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from diagnosis.answer.results import Unexplained
from diagnosis.fit.levels import levels
from diagnosis.fit.model import residual_w
from diagnosis.fit.noise import whitened
from diagnosis.fit.selection import LEAST_TRIPS, NULL_DRAWS
from diagnosis.fit.windows import FINE_WINDOW_S
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
OWN_SD_FRACS: Final = {
    "mass_kg": 0.15,
    "road_load_a_n": 0.25,
    "road_load_c_n_per_mps2": 0.25,
    "drive_eff": 0.03,
    "recuperation_eff": 0.1,
}
DRAW_W: Final = 200.0
OWN_TYPICAL: Final = 20.0  # times what trips usually gain with numbers of their own
ALIKE_FRAC: Final = 0.05  # of its energy, within which a trip took as much as the others tell
LEAST_OWN_GAIN: Final = 30.0


def odd_trips(model: Model) -> dict[str, Unexplained]:
    """Trips by the fit of the others so far off that they are no drives of this vehicle, or no sound recordings.

    Only few can be; more would say that the model is wrong for all.
    """
    usual = _departures(model)
    odd = _far(usual, usual)
    errors = usual.errors
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
    residuals = [residual_w(trip, model.solution, model.solution.coefficients) for trip in kept]
    departures = _departures_of(model, kept, [model.noise.root(trip) for trip in kept], residuals)
    odd, own = _far(departures, _departures(model)), departures.errors
    if int(odd.sum()) > max(MOST_ODD_FRAC * len(kept), 1.0):
        return ()
    count = len(model.windows)
    return tuple(
        _told(kept[k], residuals[k], float(own[k]), count + k, "It was held out.") for k in np.flatnonzero(odd).tolist()
    )


@dataclass(frozen=True, slots=True)
class _Departures:
    """How far K trips are from a model, float64 (K,) each.

    errors: share of the energy that is left; scatter: of windows, over what the noise makes of them; own: log
    likelihood that a trip gains with numbers of the vehicle of its own, 0 where samples are too rare to tell.
    """

    errors: NDArray[np.float64]
    scatter: NDArray[np.float64]
    own: NDArray[np.float64]


def _departures(model: Model) -> _Departures:
    """Of each fitted trip by the fit of the others."""
    residuals = [model.residual_w(k, left_out=True) for k in range(len(model.windows))]
    return _departures_of(model, model.windows, model.roots, residuals)


def _departures_of(
    model: Model,
    trips: Sequence[Windows],
    roots: Sequence[NDArray[np.float64]],
    residuals: Sequence[NDArray[np.float64]],
) -> _Departures:
    fine = model.noise.window_s <= FINE_WINDOW_S
    each = list(zip(trips, roots, residuals, strict=True))
    return _Departures(
        np.array([_error(trip, residual) for trip, _, residual in each]),
        np.array([_scatter(root, residual) for _, root, residual in each]),
        np.array([_own_gain(model, trip, root, residual) if fine else 0.0 for trip, root, residual in each]),
    )


def _own_gain(model: Model, trip: Windows, root: NDArray[np.float64], residual: NDArray[np.float64]) -> float:
    """Log likelihood that a trip gains with a car of its own, beyond what a constant draw of its own gains.

    Its numbers are about those of the vehicle by OWN_SD_FRACS, as cars differ that somebody takes for one another.
    """
    columns = np.column_stack([*(trip.column(name) for name in OWN_SD_FRACS), trip.duration_s])
    sizes = [share * abs(float(getattr(model.vehicle, name))) for name, share in OWN_SD_FRACS.items()]
    turned = whitened(root, columns / trip.duration_s[:, None]) * np.array([*sizes, DRAW_W])
    side = turned.T @ whitened(root, residual)
    gram = turned.T @ turned + np.eye(side.size)
    draw = float(side[-1] ** 2 / gram[-1, -1])
    return 0.5 * (float(side @ np.linalg.solve(gram, side)) - draw)


def _error(trip: Windows, residual: NDArray[np.float64]) -> float:
    return float((residual * trip.duration_s).sum()) / max(float(np.abs(trip.measured_j).sum()), 1.0)


def _scatter(root: NDArray[np.float64], residual: NDArray[np.float64]) -> float:
    return float(np.sqrt(np.mean(np.square(whitened(root, residual)))))


def _far(trips: _Departures, usual: _Departures) -> NDArray[np.bool_]:
    """Which trips err far more than is usual, have windows that scatter far more, or ask for another car, bool (n,)."""
    away = np.abs(trips.errors - np.median(usual.errors))
    typical = 1.4826 * float(np.median(np.abs(usual.errors - np.median(usual.errors))))
    sizes, usually = (np.log(np.maximum(values, 1e-9)) for values in (trips.scatter, usual.scatter))
    restless = sizes - float(np.median(usually))
    typically = 1.4826 * float(np.median(np.abs(usually - np.median(usually))))
    far = away > max(ODD_FRAC, ODD_TYPICAL * typical)
    far |= restless > max(np.log(RESTLESS), RESTLESS_TYPICAL * typically)
    return np.asarray(far | (trips.own > max(LEAST_OWN_GAIN, OWN_TYPICAL * float(np.median(usual.own)))), np.bool_)


def _told(trip: Windows, residual: NDArray[np.float64], error: float, place: int, fate: str) -> Unexplained:
    left_j = float((residual * trip.duration_s).sum())
    which = "more" if error > 0.0 else "less"
    how = (
        f"took {abs(error):.0%} of the energy that it moved {which} than the others tell"
        if abs(error) >= ALIKE_FRAC
        else "took its energy otherwise than the others tell"
    )
    text = f"Trip {trip.trip_id} {how}: another vehicle or load, or a faulty recording. {fate}"
    mean_w = left_j / float(trip.duration_s.sum())
    at = float(place)
    return Unexplained(
        "trip", "", at, at, mean_w, None, left_j / JOULE_PER_KWH, 1.0 / NULL_DRAWS, (trip.trip_id,), text
    )
