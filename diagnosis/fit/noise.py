"""How residuals of a fit scatter: in single windows, over minutes, and from trip to trip.

The covariance of a trip's residual powers is a sum of kernels: white noise that grows with power, wander that is
forgotten within seconds to half an hour, and what a trip has of its own: a level, a rolling resistance, a drag. Their
variances are found from products of residuals. Whitening makes least squares efficient, so that standstill, where
little is uncertain, tells of power that does not move the car; inference rests on trips all the same.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Final

import numpy as np
from scipy.linalg import solve_triangular
from scipy.optimize import nnls

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from numpy.typing import NDArray

    from diagnosis.fit.windows import Windows

WANDER_S: Final = (30.0, 120.0, 480.0, 1800.0)
DYNAMIC_WANDER_S: Final = 30.0
TINY: Final = 1e-30
FLOOR_W: Final = 25.0  # of white noise in a window: what resolution of sensors leaves
LEVEL_FLOOR_W: Final = 20.0  # of a trip's level: lights, fans
ROLLING_FLOOR_N: Final = 2.0  # of a trip's rolling resistance: tyres and load differ from day to day
BINS: Final = 8
MOST_WINDOWS: Final = 400  # of a trip, for the estimate of noise
OUTLIER: Final = 5.0  # windows beyond so many typical sizes count as that many when scatter is estimated
FULL_WINDOW_FRAC: Final = 0.3  # ends of trips are shorter and noisier, but not without bound
CLIMATE_WHITE_W: Final = 100.0
CLIMATE_WANDER_W: Final = 400.0
CLIMATE_WANDER_S: Final = 300.0
CLIMATE_LEVEL_W: Final = 300.0
KERNELS: Final = (
    "white",
    "white_dynamic",
    *(f"wander_{tau:g}s" for tau in WANDER_S),
    "dynamic_wander",
    "level",
    "rolling",
    "drag",
    "mean_grade",
    "hills",
)
HILLS_M: Final = 500.0  # way within which a road forgets its grade
MEAN_GRADE_FLOOR: Final = 0.4  # of a drive without height [%]: 40 m up or down on 10 km
HILLS_FLOOR: Final = 1.5  # likewise of its stretches, gentle country


@dataclass(frozen=True, slots=True)
class Noise:
    """Variance of each kernel, float64 (12,) in the order of KERNELS.

    In W², of dynamic ones [-], of rolling resistance [N²], of drag [(N/(m/s)²)²], of grades that no height tells [%²].
    """

    variance: NDArray[np.float64]
    window_s: float

    def covariance_w2(self, trip: Windows) -> NDArray[np.float64]:
        """Covariance of the mean powers of a trip's windows, float64 (n, n) [W²]."""
        total = np.zeros((trip.begin_s.size, trip.begin_s.size))
        for size, kernel in zip(self.variance, _kernels(trip, self.window_s), strict=True):
            if size > 0.0:
                total += size * kernel
        return total

    def expected_w(self, trip: Windows, residual_w: NDArray[np.float64]) -> dict[str, NDArray[np.float64]]:
        """What each kernel is expected to have contributed to the residual powers of a trip, (n,) each [W]."""
        weighed = np.linalg.solve(self.covariance_w2(trip), residual_w)
        kernels = zip(KERNELS, self.variance, _kernels(trip, self.window_s), strict=True)
        return {name: size * (kernel @ weighed) for name, size, kernel in kernels}

    def root(self, trip: Windows) -> NDArray[np.float64]:
        """Lower Cholesky factor of the covariance, float64 (n, n) [W]."""
        return np.asarray(np.linalg.cholesky(self.covariance_w2(trip)), np.float64)


def climate_root(trip: Windows) -> NDArray[np.float64]:
    """Lower Cholesky factor of the covariance of a recorded climate's powers about terms of temperature, (n, n) [W].

    How drivers set it and how heaters switch is assumed: what counts for inference is how trips differ.
    """
    apart_s = np.abs(trip.begin_s[:, None] - trip.begin_s[None, :])
    wander = CLIMATE_WANDER_W**2 * np.exp(-apart_s / CLIMATE_WANDER_S) + CLIMATE_LEVEL_W**2
    return np.asarray(np.linalg.cholesky(wander + CLIMATE_WHITE_W**2 * np.eye(trip.begin_s.size)), np.float64)


def whitened(root: NDArray[np.float64], values_w: NDArray[np.float64]) -> NDArray[np.float64]:
    """Powers of a trip's windows, (n,) or (n, p) [W], turned by the covariance's root so that they scatter by 1."""
    return np.asarray(solve_triangular(root, values_w, lower=True, check_finite=False), np.float64)


def estimated(trips: Sequence[Windows], residuals_w: Sequence[NDArray[np.float64]], window_s: float) -> Noise:
    """The noise of residual powers [W] of trips' windows, float64 (n,) each.

    Products of all pairs of a trip's residuals are regressed on the kernels with variances ≥ 0 (minimum norm quadratic
    estimation), in units of a rough scatter, outliers clipped, so that single events do not rule it.
    """
    floor, share = _rough(trips, residuals_w)
    size = len(KERNELS)
    matrix, vector = np.zeros((size, size)), np.zeros(size)
    for whole, whole_w in zip(trips, residuals_w, strict=True):
        trip, residual_w = _beginning(whole), whole_w[:MOST_WINDOWS]
        scale = np.sqrt(floor**2 + (share * trip.dynamic_w) ** 2)
        units = np.clip(residual_w / scale, -OUTLIER, OUTLIER)
        outer = np.outer(units, units)
        kernels = np.array([kernel / np.outer(scale, scale) for kernel in _kernels(trip, window_s)])
        flat = kernels.reshape(size, -1)
        weight = 1.0 / units.size  # the trip is the unit
        matrix += weight * (flat @ flat.T)
        vector += weight * (flat @ outer.ravel())
    norm = 1.0 / np.sqrt(np.maximum(np.diag(matrix), TINY))
    found, _ = nnls(matrix * np.outer(norm, norm) + 1e-9 * np.eye(size), vector * norm)
    variance = found * norm
    variance[KERNELS.index("white")] = max(variance[0], FLOOR_W**2)
    variance[KERNELS.index("level")] = max(variance[KERNELS.index("level")], LEVEL_FLOOR_W**2)
    variance[KERNELS.index("rolling")] = max(variance[KERNELS.index("rolling")], ROLLING_FLOOR_N**2)
    if any(trip.hill_w.any() for trip in trips):
        for name, floor_percent in (("mean_grade", MEAN_GRADE_FLOOR), ("hills", HILLS_FLOOR)):
            variance[KERNELS.index(name)] = max(variance[KERNELS.index(name)], floor_percent**2)
    return Noise(variance, window_s)


def _beginning(trip: Windows) -> Windows:
    """The first windows of a long trip, since products of all pairs grow with the square of their number."""
    if trip.begin_s.size <= MOST_WINDOWS:
        return trip
    first = slice(0, MOST_WINDOWS)
    return replace(
        trip,
        begin_s=trip.begin_s[first],
        duration_s=trip.duration_s[first],
        simulated_j=trip.simulated_j[first],
        dynamic_w=trip.dynamic_w[first],
        distance_m=trip.distance_m[first],
        hill_w=trip.hill_w[first],
        columns_j=trip.columns_j[first],
    )


def _kernels(trip: Windows, window_s: float) -> Iterator[NDArray[np.float64]]:
    """The kernels of a trip's windows in the order of KERNELS, each float64 (n, n)."""
    apart_s = np.abs(trip.begin_s[:, None] - trip.begin_s[None, :])
    full = np.clip(trip.duration_s / window_s, FULL_WINDOW_FRAC, 1.0)
    yield np.diag(1.0 / full)
    yield np.diag(trip.dynamic_w**2 / full)
    for tau_s in WANDER_S:
        yield np.exp(-apart_s / tau_s)
    yield np.outer(trip.dynamic_w, trip.dynamic_w) * np.exp(-apart_s / DYNAMIC_WANDER_S)
    yield np.ones_like(apart_s)
    for name in ("road_load_a_n", "road_load_c_n_per_mps2"):
        power_w = trip.column(name) / trip.duration_s
        yield np.outer(power_w, power_w)
    hilly = np.outer(trip.hill_w, trip.hill_w)
    yield hilly
    way_m = np.cumsum(trip.distance_m)
    yield hilly * np.exp(-np.abs(way_m[:, None] - way_m[None, :]) / HILLS_M)


def _rough(trips: Sequence[Windows], residuals_w: Sequence[NDArray[np.float64]]) -> tuple[float, float]:
    """Scatter from window to window: at rest [W], and as a share of the power, from typical sizes of differences."""
    jump = np.concatenate([np.abs(np.diff(residual_w)) for residual_w in residuals_w])
    dynamic = np.concatenate([np.maximum(trip.dynamic_w[1:], trip.dynamic_w[:-1]) for trip in trips])
    if jump.size < BINS:
        return 10.0 * FLOOR_W, 0.1
    edges = np.quantile(dynamic, np.linspace(0.0, 1.0, BINS + 1)[1:-1])
    place = np.searchsorted(edges, dynamic)
    used = [k for k in range(BINS) if np.any(place == k)]
    sd = np.array([1.4826 / np.sqrt(2.0) * np.median(jump[place == k]) for k in used]) + FLOOR_W
    mean_square = np.array([np.mean(dynamic[place == k] ** 2) for k in used])
    design = np.column_stack((np.ones(sd.size), mean_square)) / sd[:, None] ** 2
    (floor2, share2), _ = nnls(design, np.ones(sd.size))
    return float(np.sqrt(max(floor2, FLOOR_W**2))), float(np.sqrt(share2))
