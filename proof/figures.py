"""Figures of a proof with their intervals and targets, from scored worlds."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from diagnosis.comparison.coverage import wilson_interval

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Sequence

    from numpy.typing import NDArray

DRAWS: Final = 2000
SEED: Final = 1


@dataclass(frozen=True, slots=True)
class Target:
    """What a figure is to reach: at least low, at most high, None for no bound on that side."""

    low: float | None = None
    high: float | None = None

    def met(self, value: float) -> bool:
        """Whether a value lies within."""
        return (self.low is None or value >= self.low) and (self.high is None or value <= self.high)


@dataclass(frozen=True, slots=True)
class Figure:
    """One line of the table: value with its 95 % interval and target.

    successes, trials: of a share, else None. is_share: whether the value is shown in percent. value None: there was
    nothing to count.
    """

    group: str
    name: str
    value: float | None
    low: float | None
    high: float | None
    target: Target | None = None
    successes: int | None = None
    trials: int | None = None
    is_share: bool = True

    @property
    def met(self) -> bool | None:
        """Whether the target is met; None without a target or a value."""
        return None if self.target is None or self.value is None else self.target.met(self.value)


def share(group: str, name: str, hits: Iterable[bool], target: Target | None = None) -> Figure:
    """The share of hits, with Wilson's interval."""
    counted = [bool(hit) for hit in hits]
    if not counted:
        return Figure(group, name, None, None, None, target, 0, 0)
    low, high = wilson_interval(sum(counted), len(counted))
    return Figure(group, name, sum(counted) / len(counted), low, high, target, sum(counted), len(counted))


def drawn(
    group: str,
    name: str,
    rows: NDArray[np.float64],
    figure_of: Callable[[NDArray[np.float64]], float],
    target: Target | None = None,
    *,
    is_share: bool = False,
) -> Figure:
    """A figure of rows (worlds or trips), float64 (n, m), with the interval that drawing rows anew gives."""
    if rows.shape[0] == 0:
        return Figure(group, name, None, None, None, target, is_share=is_share)
    value = figure_of(rows)
    low = high = None
    if rows.shape[0] > 2:
        picks = np.random.default_rng(SEED).integers(0, rows.shape[0], (DRAWS, rows.shape[0]))
        low, high = (
            float(quantile) for quantile in np.nanquantile([figure_of(rows[pick]) for pick in picks], (0.025, 0.975))
        )
    return Figure(group, name, value, low, high, target, is_share=is_share)


def rms_ratio(mean_squares: NDArray[np.float64]) -> float:
    """Root of the mean of the first column over that of the last, each a world's mean square error."""
    return float(np.sqrt(mean_squares[:, 0].mean() / mean_squares[:, -1].mean()))


def gap_closed(mean_squares: NDArray[np.float64]) -> float:
    """How much of the way from the base (second column) to the oracle (last) the tool (first) has gone, in RMS [-]."""
    tool, base, oracle = np.sqrt(mean_squares.mean(axis=0)).tolist()
    return float((base - tool) / (base - oracle)) if base != oracle else float("nan")


def missed(figures: Sequence[Figure]) -> tuple[Figure, ...]:
    """Figures that have a target and a value, and are off it."""
    return tuple(figure for figure in figures if figure.met is False)
