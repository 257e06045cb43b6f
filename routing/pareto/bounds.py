"""What no way can be better than in time and energy at once, and how near given routes come to that."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from energy.units import JOULE_PER_KWH, SECOND_PER_HOUR

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from routing.weights import Weights

ROUNDING_FRAC: Final = 1e-9  # searches and simulation add up in another order
WIDEST: Final = 100.0  # an ε beyond which nothing is said
HALVINGS: Final = 34


@dataclass(frozen=True, slots=True, order=True)
class Trade:
    """What a way takes: time [s] and charge used [J]."""

    time_s: float
    energy_j: float


class LowerBounds:
    """Lower bounds on the time and energy of all ways, from searches that are done."""

    def __init__(self) -> None:
        self._weightings: list[tuple[float, float, float]] = []  # worth of a joule, of a second, least cost
        self._time_s: NDArray[np.float64] | None = None
        self._energy_j: NDArray[np.float64] = np.empty(0)
        self._epsilon_frac = self._slack_j = 0.0

    def add_weighting(self, weights: Weights, cost: float) -> None:
        """No way costs less by these weights, of which that of distance is 0."""
        per_j, per_s = weights.energy / JOULE_PER_KWH, weights.time / SECOND_PER_HOUR
        self._weightings.append((per_j, per_s, cost + ROUNDING_FRAC * abs(cost)))

    def add_cover(self, trades: Sequence[Trade], epsilon_frac: float, slack_j: float) -> None:
        """For each way one of these takes at most 1 + epsilon_frac times its time and slack_j more energy."""
        self._time_s = np.array([trade.time_s for trade in trades])
        self._energy_j = np.array([trade.energy_j for trade in trades])
        self._epsilon_frac, self._slack_j = epsilon_frac, slack_j

    def nothing_below(self, time_s: float, energy_j: float) -> bool:
        """Whether it is proven that no way takes both less time and less energy, each of which may be inf."""
        for per_j, per_s, cost in self._weightings:
            if (energy_j * per_j if per_j > 0.0 else 0.0) + (time_s * per_s if per_s > 0.0 else 0.0) <= cost:
                return True
        if self._time_s is None:
            return False
        reach_s = (1.0 + self._epsilon_frac) * time_s * (1.0 - ROUNDING_FRAC)
        reach_j = energy_j + self._slack_j - ROUNDING_FRAC * abs(energy_j)
        return not bool(((self._time_s < reach_s) & (self._energy_j < reach_j)).any())

    def step_gap(self, before: Trade | None, after: Trade | None, reference_j: float, most_j: float) -> float:
        """Least ε with which two routes, neighbours in time, cover every way that is faster than after is.

        A way is covered that takes at least the time of after / (1 + ε), or at least the energy of before less
        ε · reference_j. before, after: None before the fastest and after the thriftiest. Ways use at most most_j.
        inf where no ε up to 100 is proven.
        """

        def holds(epsilon: float) -> bool:
            time_s = math.inf if after is None else after.time_s / (1.0 + epsilon)
            energy_j = most_j * (1.0 + ROUNDING_FRAC) if before is None else before.energy_j - epsilon * reference_j
            return self.nothing_below(time_s, energy_j)

        if holds(0.0):
            return 0.0
        low, high = 0.0, 1.0
        while not holds(high):
            low, high = high, 2.0 * high
            if high > WIDEST:
                return math.inf
        for _ in range(HALVINGS):
            middle = 0.5 * (low + high)
            low, high = (low, middle) if holds(middle) else (middle, high)
        return high

    def gap(self, front: Sequence[Trade], reference_j: float, most_j: float) -> float:
        """Least ε with which routes cover every way; front: none better than another in both, by time."""
        steps = zip((None, *front), (*front, None), strict=True)
        return max(self.step_gap(before, after, reference_j, most_j) for before, after in steps)


def undominated(trades: Sequence[Trade]) -> list[int]:
    """Places of those that no other one is as good as in both time and energy, by time; the first of equal ones."""
    kept: list[int] = []
    for k in sorted(range(len(trades)), key=lambda k: (trades[k], k)):
        if not kept or trades[k].energy_j < trades[kept[-1]].energy_j:
            kept.append(k)
    return kept


def chosen(
    bounds: LowerBounds, front: Sequence[Trade], reference_j: float, most_j: float, epsilon_frac: float, most: int
) -> list[int]:
    """Places of a few routes of a front that still cover every way within ε where that is possible, at most most ≥ 2.

    The first and the last stay. Others are left out one by one, first those that the proof needs least.
    """
    kept = list(range(len(front)))

    def without(place: int) -> float:
        return bounds.step_gap(front[kept[place - 1]], front[kept[place + 1]], reference_j, most_j)

    gaps = [without(place) for place in range(1, len(kept) - 1)]
    while gaps:
        least = min(range(len(gaps)), key=gaps.__getitem__)
        if gaps[least] > epsilon_frac and len(kept) <= most:
            break
        del kept[least + 1], gaps[least]
        for place in (least, least + 1):
            if 1 <= place < len(kept) - 1:
                gaps[place - 1] = without(place)
    return kept
