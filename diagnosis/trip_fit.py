"""Coefficients of columns fitted over trips, with intervals from leaving out one trip at a time, and scores on others.

Windows of one trip share weather, load and sensor, so the trip is the unit: each counts the same, and spreads
come from the delete-one-trip jackknife. Parameters may carry a prior standard deviation about the vehicle's own values,
which keeps those apart that a few drives cannot separate.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from scipy.optimize import lsq_linear

from diagnosis.errors import DiagnosisError
from diagnosis.exposures import weighted_columns

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from numpy.typing import NDArray

    from diagnosis.exposures import Column, TripWindows


@dataclass(frozen=True, slots=True)
class Fit:
    """Coefficients in the units of their columns, float64 (k,), and their jackknife standard deviations (k,).

    window_sd_j: spread of what is left in a window, trips weighted alike. trips: how many were fitted.
    """

    names: tuple[str, ...]
    coefficients: NDArray[np.float64]
    jackknife_sd: NDArray[np.float64]
    window_sd_j: float
    trips: int

    def t_value(self, name: str) -> float:
        """Coefficient over its jackknife standard deviation; 0 where both are 0."""
        k = self.names.index(name)
        sd = float(self.jackknife_sd[k])
        value = float(self.coefficients[k])
        return value / sd if sd > 0.0 else math.copysign(math.inf, value) if value else 0.0


@dataclass(frozen=True, slots=True)
class Score:
    """Errors of trip energies, positive where the model takes more [-]: mean size, mean, standard deviation."""

    trips: int
    mape_frac: float
    bias_frac: float
    sd_frac: float


def fit_trips(
    trips: Sequence[TripWindows],
    columns: Sequence[Column],
    *,
    prior_sd: Mapping[str, float] | None = None,
) -> Fit:
    """Least squares of what trips took more than simulated, each trip with the same weight.

    prior_sd: standard deviation of a coefficient about 0 by column name, in its unit. Columns that can only add
    energy get coefficients ≥ 0.

    Raises DiagnosisError with fewer than three trips, since no spread between trips can then be told, with windows of
    other columns, and for a prior that names no column or is not positive.
    """
    grams, best, without, _ = _all_but_one(trips, columns, prior_sd)
    n = len(trips)
    sd = np.sqrt((n - 1) / n * np.square(without - without.mean(axis=0)).sum(axis=0))
    names = tuple(column.name for column in columns)
    return Fit(names, best, sd, math.sqrt(max(_left(_summed(grams), best) / n, 0.0)), n)


def left_out_j(
    trips: Sequence[TripWindows], columns: Sequence[Column], *, prior_sd: Mapping[str, float] | None = None
) -> NDArray[np.float64]:
    """Mean square of each trip's windows by the fit of the other trips, float64 (trips,) [J²]; raises as fit_trips."""
    grams, _, without, _ = _all_but_one(trips, columns, prior_sd)
    return np.array([max(_left(gram, beta), 0.0) for gram, beta in zip(grams, without, strict=True)])


def _all_but_one(
    trips: Sequence[TripWindows], columns: Sequence[Column], prior_sd: Mapping[str, float] | None
) -> tuple[list[_Gram], NDArray[np.float64], NDArray[np.float64], float]:
    """Each trip's normal equations, coefficients of all trips, those without each trip (trips, k), and the scatter."""
    if len(trips) < 3:
        raise DiagnosisError(f"{len(trips)} trips, at least 3 are needed to tell how trips differ")
    names = tuple(column.name for column in columns)
    for trip in trips:
        if trip.names != names:
            raise DiagnosisError(f"trip {trip.trip_id} has columns {trip.names}, allowed: {names}")
    for name, sd in (prior_sd or {}).items():
        if name not in names or not 0.0 < sd < math.inf:
            raise DiagnosisError(f"prior_sd[{name!r}] is {sd:g}, allowed: a positive number for one of {names}")
    lower = np.array([0.0 if column.positive else -np.inf for column in columns])
    prior = np.array([(prior_sd or {}).get(name, math.inf) for name in names])
    grams = [_gram(trip) for trip in trips]
    everything = _summed(grams)
    # a first pass without prior tells how far windows scatter, which the prior is weighed against
    first = _solved(everything, lower, np.full(prior.size, math.inf), 1.0)
    scatter_j = math.sqrt(max(_left(everything, first) / len(trips), 1e-12))
    best = _solved(everything, lower, prior, scatter_j)
    without = np.array(
        [
            _solved(_summed([gram for i, gram in enumerate(grams) if i != k]), lower, prior, scatter_j)
            for k in range(len(grams))
        ]
    )
    return grams, best, without, scatter_j


def predicted_j(trip: TripWindows, fit: Fit) -> float:
    """Energy of a trip by the model with its fitted columns [J]; its measured power is not used."""
    return float(trip.simulated_j.sum() + trip.columns_j.sum(axis=0) @ fit.coefficients)


def score(trips: Sequence[TripWindows], fit: Fit | None) -> Score:
    """How trips' energies are met by a fit, or by the vehicle as it is; to count, on trips that were not fitted.

    Raises DiagnosisError without trips, and where a trip's measured energy is not positive.
    """
    if not trips:
        raise DiagnosisError("no trips, at least one is needed")
    error = []
    for trip in trips:
        measured = float(trip.measured_j.sum())
        if measured <= 0.0:
            raise DiagnosisError(
                f"trip {trip.trip_id} took {measured:.0f} J, allowed: more than 0 for a relative error"
            )
        model = float(trip.simulated_j.sum()) if fit is None else predicted_j(trip, fit)
        error.append(model / measured - 1.0)
    values = np.array(error)
    sd = float(values.std(ddof=1)) if values.size > 1 else 0.0
    return Score(len(trips), float(np.abs(values).mean()), float(values.mean()), sd)


@dataclass(frozen=True, slots=True)
class _Gram:
    """Normal equations of one or more trips: XᵀX, Xᵀy and yᵀy."""

    matrix: NDArray[np.float64]
    vector: NDArray[np.float64]
    square: float


def _gram(trip: TripWindows) -> _Gram:
    columns, residual = weighted_columns([trip])
    return _Gram(columns.T @ columns, columns.T @ residual, float(residual @ residual))


def _summed(grams: Sequence[_Gram]) -> _Gram:
    return _Gram(
        np.sum([gram.matrix for gram in grams], axis=0),
        np.sum([gram.vector for gram in grams], axis=0),
        float(sum(gram.square for gram in grams)),
    )


def _left(gram: _Gram, coefficients: NDArray[np.float64]) -> float:
    """Sum of squares that coefficients leave."""
    return float(gram.square - 2.0 * coefficients @ gram.vector + coefficients @ gram.matrix @ coefficients)


def _solved(
    gram: _Gram, lower: NDArray[np.float64], prior_sd: NDArray[np.float64], window_sd_j: float
) -> NDArray[np.float64]:
    """Coefficients of bounded least squares with priors, from the normal equations, in scaled units."""
    matrix = gram.matrix + np.diag((window_sd_j / prior_sd) ** 2)
    scale = np.sqrt(np.diag(matrix))
    scale[scale == 0.0] = 1.0  # a column that is nothing in these trips gets 0
    values, vectors = np.linalg.eigh(matrix / np.outer(scale, scale))
    kept = values > 1e-10 * values.max()
    root = np.sqrt(values[kept])
    half = vectors[:, kept].T * root[:, None]
    right = (vectors[:, kept].T @ (gram.vector / scale)) / root
    found = lsq_linear(half, right, (lower, np.full(lower.size, np.inf)), method="bvls" if kept.all() else "trf")
    return np.asarray(found.x / scale, np.float64)
