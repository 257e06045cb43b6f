"""Lag between the clocks of speed and power, from the work that gains and losses of speed take."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from diagnosis.recordings.notes import NoteKind
from diagnosis.recordings.recording import channels_of
from diagnosis.recordings.soundness.repairs import noted

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from diagnosis.recordings.recording import Recording

MOST_LAG_S: Final = 5.0
LEAST_LAG_S: Final = 0.3  # this and a sample; what is below is left to the fit, the BMW i3 files have 0.06 s at most
GRID_S: Final = 0.1
COARSEST_S: Final = 1.5  # samples further apart than that don't tell a lag
LEAST_S: Final = 300.0
MEAN_S: Final = 1.0
CLEAR_CORRELATION: Final = 0.6
CLEAR_GAIN: Final = 0.02  # of the variance of power that is explained
SHIFTED: Final = ("power_w", "voltage_v", "current_a")


def power_lag_s(recording: Recording) -> float | None:
    """By how much power is late against speed [s], negative where it is early; None where the drive does not tell.

    The lag within ±MOST_LAG_S at which a constant, v, v³ and d(½v²)/dt explain most of power: no vehicle is needed,
    since mass, losses and drag only scale what explains it. None unless the multiple correlation is at least
    CLEAR_CORRELATION, and both halves of the drive agree within LEAST_LAG_S or one sample.
    """
    time_s = recording.time_s
    sample_s = float(np.median(np.diff(time_s)))
    if sample_s > COARSEST_S or time_s[-1] - time_s[0] < LEAST_S:
        return None
    step_s = max(GRID_S, sample_s)
    at_s = np.arange(time_s[0], time_s[-1], step_s)
    window = np.ones(max(1, round(MEAN_S / step_s)))
    window /= window.size
    speed = np.convolve(np.interp(at_s, time_s, recording.speed_mps), window, "same")
    power = np.convolve(np.interp(at_s, time_s, recording.power_w), window, "same")
    causes = np.column_stack([speed, speed**3, np.gradient(0.5 * speed**2, step_s)])
    measured = ~np.append(recording.gap_steps(at_s), False)
    most = round(MOST_LAG_S / step_s)
    correlations = _correlations(causes, power, measured, most)
    lag_s, correlation = _peak(correlations, step_s)
    if correlation < CLEAR_CORRELATION:
        return None
    half = at_s.size // 2
    for part in (slice(0, half), slice(half, None)):
        part_s, _ = _peak(_correlations(causes[part], power[part], measured[part], most), step_s)
        if abs(part_s - lag_s) > max(LEAST_LAG_S, sample_s):
            return None
    gain = correlation**2 - float(correlations[most]) ** 2
    return lag_s if gain >= CLEAR_GAIN or abs(lag_s) < LEAST_LAG_S else None


def without_lag(recording: Recording) -> Recording:
    """The recording with power, voltage and current moved to the clock of the speed where they clearly lag.

    Samples for which the moved channels have no value, at one end and beside gaps, are dropped.
    """
    lag_s = power_lag_s(recording)
    time_s = recording.time_s
    if lag_s is None or abs(lag_s) < max(LEAST_LAG_S, float(np.median(np.diff(time_s)))):
        return recording
    at_s = time_s + lag_s
    keep = (at_s >= time_s[0]) & (at_s <= time_s[-1])
    gaps = []
    for begin, end in recording.gaps:
        keep &= ~((at_s > begin) & (at_s < end))
    for begin, end in recording.gaps:
        before, after = time_s[keep & (time_s <= begin)], time_s[keep & (time_s >= end)]
        if before.size and after.size:
            gaps.append((float(before[-1]), float(after[0])))
    moved: dict[str, Any] = {}
    for name, values in channels_of(recording).items():
        moved[name] = (np.interp(at_s, time_s, values) if name in SHIFTED else values)[keep]
    when = "later" if lag_s > 0.0 else "earlier"
    text = f"moved by {-lag_s:+.2f} s: it came {abs(lag_s):.2f} s {when} than the gain of speed that it was for"
    return noted(replace(recording, **moved, gaps=tuple(gaps)), NoteKind.LAG, "power_w", text)


def _correlations(
    causes: NDArray[np.float64], power: NDArray[np.float64], measured: NDArray[np.bool_], most: int
) -> NDArray[np.float64]:
    """Multiple correlation of causes, (n, m), with the power k steps later for k from −most to most, (2·most + 1,)."""
    n = power.size
    if np.count_nonzero(measured) < 10 * causes.shape[1] or n <= 2 * most:
        return np.zeros(2 * most + 1)
    x = np.where(measured[:, None], causes - causes[measured].mean(axis=0), 0.0)
    y = np.where(measured, power - power[measured].mean(), 0.0)
    spread = np.sqrt((x * x).sum(axis=0))
    if not spread.all() or not y.any():
        return np.zeros(2 * most + 1)
    x /= spread
    size = 2 ** (n + most).bit_length()  # room for the shifts, so that the ends do not meet
    products = np.fft.irfft(np.conj(np.fft.rfft(x, size, axis=0)) * np.fft.rfft(y, size)[:, None], size, axis=0)
    shifted = np.concatenate((products[size - most :], products[: most + 1]))
    explained = np.einsum("ki,ij,kj->k", shifted, np.linalg.pinv(x.T @ x, hermitian=True), shifted)
    return np.asarray(np.sqrt(np.maximum(explained, 0.0) / (y @ y)), np.float64)


def _peak(correlations: NDArray[np.float64], step_s: float) -> tuple[float, float]:
    """Lag [s] of the highest correlation, between steps by a parabola through three, and that correlation."""
    at, most = int(np.argmax(correlations)), correlations.size // 2
    if not 0 < at < correlations.size - 1:
        return (at - most) * step_s, float(correlations[at])
    before, peak, after = correlations[at - 1 : at + 2].tolist()
    bend = before - 2.0 * peak + after
    offset = 0.5 * (before - after) / bend if bend < 0.0 else 0.0
    return (at - most + offset) * step_s, float(peak)
