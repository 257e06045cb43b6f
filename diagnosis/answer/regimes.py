"""Where measured and simulated energy part: power by regime, with intervals that take the trip as the unit."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np
from scipy import stats

from diagnosis.errors import DiagnosisError
from diagnosis.fit.axes import AXES, Axis
from energy.units import JOULE_PER_KWH

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from numpy.typing import NDArray

    from diagnosis.fit.windows import Windows

__all__ = ["CONFIDENCE_FRAC", "EDGES", "Axis", "RegimeResidual", "regimes", "where"]

CONFIDENCE_FRAC: Final = 0.95
STANDING_FRAC: Final = 0.9  # of a window, from which on it counts as standstill


# of the axes that have regimes, in the order that answers have them
EDGES: Final[Mapping[Axis, tuple[float, ...]]] = {
    Axis.STANDSTILL: (0.0, STANDING_FRAC, 1.0),
    Axis.SPEED: (0.0, 5.0, 30.0, 50.0, 70.0, 100.0, 130.0, 200.0),
    Axis.SINCE_START: (0.0, 2.0, 5.0, 10.0, 20.0, 40.0, 1440.0),
    Axis.POWER: (-200.0, -5.0, 0.0, 5.0, 10.0, 20.0, 200.0),
    Axis.AMBIENT: (-50.0, -5.0, 5.0, 15.0, 22.0, 28.0, 55.0),
    Axis.GRADE: (-30.0, -3.0, -1.0, 1.0, 3.0, 30.0),
    Axis.SOC: (0.0, 20.0, 40.0, 60.0, 80.0, 90.0, 100.0),
}


@dataclass(frozen=True, slots=True)
class RegimeResidual:
    """What windows of one regime took more than simulated.

    low, high: of the axis; high belongs to the last regime only. mean_w: residual energy over time, with the interval
    that the delete-one-trip jackknife gives [W]; None where fewer than two trips have such windows. energy_kwh: over
    all trips. duration_s, trips: how much there is of it.
    """

    axis: Axis
    low: float
    high: float
    mean_w: float
    low_w: float | None
    high_w: float | None
    energy_kwh: float
    duration_s: float
    trips: int

    @property
    def departs(self) -> bool:
        """Whether the interval leaves 0 out."""
        return self.low_w is not None and self.high_w is not None and (self.low_w > 0.0 or self.high_w < 0.0)


def where(regime: RegimeResidual) -> str:
    """Where a regime is, in words that follow a verb."""
    if regime.axis is Axis.STANDSTILL:
        return "at standstill" if regime.low >= STANDING_FRAC else "while driving"
    axis = AXES[regime.axis]
    return f"at {axis.label[0].lower()}{axis.label[1:]} {regime.low:g} to {regime.high:g} {axis.unit}"


def regimes(
    trips: Sequence[Windows],
    axis: Axis,
    residual_w: Sequence[NDArray[np.float64]],
    edges: Sequence[float] | None = None,
) -> tuple[RegimeResidual, ...]:
    """Residual power of windows, float64 (n,) a trip [W], in each regime of an axis that any lies in, in order.

    Trips without a value on the axis (no recorded temperature) are left out.
    Raises DiagnosisError without trips and for edges that do not rise.
    """
    if not trips:
        raise DiagnosisError("no trips, at least one is needed")
    bounds = np.array(EDGES[axis] if edges is None else edges, np.float64)
    if bounds.size < 2 or not bool(np.all(np.diff(bounds) > 0.0)):
        raise DiagnosisError(f"edges of {axis} are {bounds.tolist()}, allowed: at least two, rising")
    residual, duration = (np.zeros((len(trips), bounds.size - 1)) for _ in range(2))
    for k, trip in enumerate(trips):
        values = AXES[axis].values(trip)
        if values is None:
            continue
        place = np.searchsorted(bounds, values, side="right") - 1
        place[values == bounds[-1]] = bounds.size - 2
        inside = (place >= 0) & (place < bounds.size - 1)
        left_j = residual_w[k] * trip.duration_s
        residual[k] = np.bincount(place[inside], weights=left_j[inside], minlength=bounds.size - 1)
        duration[k] = np.bincount(place[inside], weights=trip.duration_s[inside], minlength=bounds.size - 1)
    return tuple(
        _regime(axis, float(bounds[b]), float(bounds[b + 1]), residual[:, b], duration[:, b])
        for b in range(bounds.size - 1)
        if duration[:, b].any()
    )


def _regime(
    axis: Axis, low: float, high: float, residual_j: NDArray[np.float64], duration_s: NDArray[np.float64]
) -> RegimeResidual:
    """One regime from each trip's residual energy and time in it."""
    there = duration_s > 0.0
    energy_j, time_s, n = float(residual_j.sum()), float(duration_s.sum()), int(there.sum())
    mean_w = energy_j / time_s
    low_w = high_w = None
    if n >= 2:
        without = (energy_j - residual_j[there]) / (time_s - duration_s[there])
        sd = math.sqrt((n - 1) / n * float(np.square(without - without.mean()).sum()))
        half = float(stats.t.ppf(0.5 + 0.5 * CONFIDENCE_FRAC, n - 1)) * sd
        low_w, high_w = mean_w - half, mean_w + half
    return RegimeResidual(axis, low, high, mean_w, low_w, high_w, energy_j / JOULE_PER_KWH, time_s, n)
