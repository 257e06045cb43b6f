"""Which left-out effects a set of drives speaks for, and which of them it cannot tell apart.

The vehicle's own parameters are always free, so that what they can explain is never called physics. An effect is added
while it stands out between trips (jackknife t), helps to predict trips left out, and holds a share of the energy.
The default thresholds are a prototype's; they are not yet calibrated on simulated nulls of the data at hand.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Final

import numpy as np

from diagnosis.errors import DiagnosisError
from diagnosis.trip_fit import Fit, fit_trips, left_out_j

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from numpy.typing import NDArray

    from diagnosis.exposures import Column, TripWindows

THRESHOLD_T: Final = 4.0
LEAST_SHARE_FRAC: Final = 0.01
RIVAL_SE: Final = 2.0
RIVAL_LOSS_FRAC: Final = 0.05
LEAST_TRIPS: Final = 6  # fewer say too little about how trips differ


@dataclass(frozen=True, slots=True)
class Finding:
    """An effect that the drives speak for.

    coefficient and sd in the column's unit; t: their ratio. energy_share_frac: of all measured energy. ambiguous_with:
    effects of other families that would predict left-out trips as well in its place.
    """

    column: Column
    coefficient: float
    sd: float
    t: float
    energy_share_frac: float
    ambiguous_with: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Selection:
    """Findings in the order in which they were found, and the fit with them and the parameters."""

    findings: tuple[Finding, ...]
    fit: Fit
    columns: tuple[Column, ...]


def select(
    trips: Sequence[TripWindows],
    columns: Sequence[Column],
    free: Sequence[str],
    *,
    prior_sd: Mapping[str, float] | None = None,
    threshold_t: float = THRESHOLD_T,
    least_share_frac: float = LEAST_SHARE_FRAC,
) -> Selection:
    """Forward selection of effects among the columns that are not always free.

    Raises DiagnosisError with fewer than LEAST_TRIPS trips, and where free names no column.
    """
    if len(trips) < LEAST_TRIPS:
        raise DiagnosisError(f"{len(trips)} trips, at least {LEAST_TRIPS} are needed to name a cause")
    by_name = {column.name: column for column in columns}
    for name in free:
        if name not in by_name:
            raise DiagnosisError(f"free names {name!r}, allowed: {tuple(by_name)}")
    chosen = [by_name[name] for name in free]
    priors = {name: sd for name, sd in (prior_sd or {}).items() if name in by_name}
    found: list[Column] = []
    loss = _losses(trips, chosen, priors)
    while True:
        best: tuple[float, Column, NDArray[np.float64]] | None = None
        for candidate in columns:
            if candidate in chosen:
                continue
            trial = [*chosen, candidate]
            fit = _fitted(trips, trial, priors)
            if _stands_out(fit, candidate, trips, threshold_t, least_share_frac):
                trial_loss = _losses(trips, trial, priors)
                if trial_loss.sum() < loss.sum() and (best is None or trial_loss.sum() < best[0]):
                    best = (float(trial_loss.sum()), candidate, trial_loss)
        if best is None:
            break
        found.append(best[1])
        chosen.append(best[1])
        loss = best[2]
    # a later effect may have taken over what an earlier one stood for
    fit = _fitted(trips, chosen, priors)
    for column in list(found):
        if not _stands_out(fit, column, trips, threshold_t, least_share_frac):
            found.remove(column)
            chosen.remove(column)
            fit = _fitted(trips, chosen, priors)
    loss = _losses(trips, chosen, priors)
    findings = tuple(
        Finding(
            column,
            float(fit.coefficients[fit.names.index(column.name)]),
            float(fit.jackknife_sd[fit.names.index(column.name)]),
            fit.t_value(column.name),
            _share(fit, column, trips),
            _rivals(trips, columns, chosen, column, priors, loss),
        )
        for column in found
    )
    return Selection(findings, fit, tuple(chosen))


def narrowed(trip: TripWindows, columns: Sequence[Column]) -> TripWindows:
    """The same windows with some of their columns only, in the order given."""
    names = tuple(column.name for column in columns)
    return replace(trip, names=names, columns_j=trip.columns_j[:, [trip.names.index(name) for name in names]])


def _fitted(trips: Sequence[TripWindows], columns: Sequence[Column], priors: Mapping[str, float]) -> Fit:
    names = {column.name for column in columns}
    return fit_trips(
        [narrowed(trip, columns) for trip in trips],
        columns,
        prior_sd={name: sd for name, sd in priors.items() if name in names},
    )


def _losses(
    trips: Sequence[TripWindows], columns: Sequence[Column], priors: Mapping[str, float]
) -> NDArray[np.float64]:
    """Squared residual of each trip by the fit of the others, float64 (trips,) [J²]."""
    names = {column.name for column in columns}
    return left_out_j(
        [narrowed(trip, columns) for trip in trips],
        columns,
        prior_sd={name: sd for name, sd in priors.items() if name in names},
    )


def _share(fit: Fit, column: Column, trips: Sequence[TripWindows]) -> float:
    """Energy of a column over all that was measured [-]."""
    coefficient = float(fit.coefficients[fit.names.index(column.name)])
    energy_j = sum(float(trip.columns_j[:, trip.names.index(column.name)].sum()) for trip in trips)
    return coefficient * energy_j / sum(float(trip.measured_j.sum()) for trip in trips)


def _stands_out(
    fit: Fit, column: Column, trips: Sequence[TripWindows], threshold_t: float, least_share_frac: float
) -> bool:
    t = fit.t_value(column.name)
    return math.isfinite(t) and abs(t) >= threshold_t and abs(_share(fit, column, trips)) >= least_share_frac


def _rivals(
    trips: Sequence[TripWindows],
    columns: Sequence[Column],
    chosen: Sequence[Column],
    column: Column,
    priors: Mapping[str, float],
    loss: NDArray[np.float64],
) -> tuple[str, ...]:
    """Effects of other families that do on left-out trips what a column does.

    In its place they lose no more than RIVAL_SE standard errors, or than RIVAL_LOSS_FRAC of what the column gained.
    """
    found = []
    gained = float((_losses(trips, [one for one in chosen if one is not column], priors) - loss).sum())
    for rival in columns:
        if rival in chosen or rival.family is column.family:
            continue
        worse = _losses(trips, [rival if one is column else one for one in chosen], priors) - loss
        lost = float(worse.sum())
        if lost <= max(RIVAL_SE * float(worse.std(ddof=1)) * math.sqrt(worse.size), RIVAL_LOSS_FRAC * gained):
            found.append(rival.name)
    return tuple(found)
