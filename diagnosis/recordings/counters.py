"""Counters of way and energy: what they rose by, and the speed or power that follows from that.

A counter is known to a sample at the moments at which it changes, however large its steps are.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

LEAST_STEPS: Final = 5.0  # of a counter, that a drive must take to tell anything
WINDOW_S: Final = 10.0  # over which energies are compared
WINDOW_SAMPLES: Final = 3.0
FINE_FRAC: Final = 0.05  # of a window's energy or way, that a step may be
MOST_W: Final = 1_000_000.0  # from a battery (assumed), and back into it
MOST_BACK_W: Final = 400_000.0
SAME: Final = 1e-9
SAME_FRAC: Final = 1e-3  # of a usual change, below which two are the same but for their digits


@dataclass(frozen=True, slots=True)
class Count:
    """What a counter rose by between two moments [s] at which it changed, and in how many changes."""

    rise: float
    from_s: float
    to_s: float
    changes: int


def counts(
    time_s: NDArray[np.float64], values: NDArray[np.float64], broken: NDArray[np.bool_] | None = None
) -> list[Count]:
    """Each stretch without a gap, from the first change of a counter to its last.

    time_s, values: float64 (n,), NaN where not known. broken: bool (n−1,), steps with a gap in them.
    """
    breaks = np.flatnonzero(broken) + 1 if broken is not None else np.empty(0, np.int64)
    edges = np.concatenate(([0], breaks, [time_s.size]))
    found = []
    for begin, end in zip(edges[:-1].tolist(), edges[1:].tolist(), strict=True):
        at = begin + np.flatnonzero(~np.isnan(values[begin:end]))
        changed = np.flatnonzero(np.abs(np.diff(values[at])) > SAME) if at.size > 1 else np.empty(0, np.int64)
        if changed.size < 2:
            continue
        first, last = int(changed[0]), int(changed[-1])
        from_s, to_s = (0.5 * float(time_s[at[k]] + time_s[at[k + 1]]) for k in (first, last))
        rise = float(values[at[last + 1]] - values[at[first + 1]])
        found.append(Count(rise, from_s, to_s, int(changed.size) - 1))
    return found


def step_of(values: NDArray[np.float64]) -> float:
    """The step of a counter: its least change, or the least by which changes differ; 0 where it never changes."""
    change = np.abs(np.diff(values[~np.isnan(values)]))
    change = np.sort(change[change > SAME])
    if not change.size:
        return 0.0
    apart = np.diff(change)
    apart = apart[apart > SAME_FRAC * change[change.size // 2]]
    return float(min(change[0], apart.min(initial=np.inf)))


def rate(time_s: NDArray[np.float64], values: NDArray[np.float64]) -> NDArray[np.float64]:
    """What a counter rises by in a second, float64 (n,), evenly from each of its changes to the next.

    values: float64 (n,) without NaN.
    """
    changed = np.flatnonzero(np.abs(np.diff(values)) > SAME) + 1
    knots = np.unique(np.concatenate(([0], changed, [values.size - 1])))
    even = np.interp(time_s, time_s[knots], values[knots])
    return np.asarray(np.gradient(even, time_s), np.float64)


def is_fine(time_s: NDArray[np.float64], values: NDArray[np.float64]) -> bool:
    """Whether a counter's step is at most FINE_FRAC of what it rises by in a usual window."""
    if values.size < 2:
        return False
    window_s = max(WINDOW_S, WINDOW_SAMPLES * float(np.median(np.diff(time_s))))
    spans = counts(time_s, values)
    lasts_s = sum(span.to_s - span.from_s for span in spans)
    if lasts_s <= 0.0:
        return False
    usual = abs(sum(span.rise for span in spans)) / lasts_s * window_s
    return 0.0 < step_of(values) <= FINE_FRAC * usual


def mean_rate(time_s: NDArray[np.float64], values: NDArray[np.float64]) -> float | None:
    """What a counter rises by in a second between its first change and its last; None for fewer than LEAST_STEPS."""
    spans = counts(time_s, values)
    rise, lasts_s = sum(span.rise for span in spans), sum(span.to_s - span.from_s for span in spans)
    if not spans or lasts_s <= 0.0 or abs(rise) < LEAST_STEPS * step_of(values):
        return None
    return rise / lasts_s


def is_of_energy(time_s: NDArray[np.float64], used_j: NDArray[np.float64]) -> bool:
    """Whether a counter can be of the energy that left a battery: more at the end, and never faster than any car.

    One that is set back on the way, or counts what is left, is not.
    """
    if used_j.size < 2 or used_j[-1] <= used_j[0]:
        return False
    power_w = np.diff(used_j) / np.diff(time_s)
    return float(power_w.max()) <= MOST_W and float(power_w.min()) >= -MOST_BACK_W


def only_rises(values: NDArray[np.float64]) -> bool:
    """Whether a counter never falls, as one that is set back on the way does."""
    known = values[~np.isnan(values)]
    return known.size > 1 and bool((np.diff(known) >= -SAME).all())
