"""What the battery's voltage tells of its inner resistance, and whether the recorded power holds what it loses.

V = V₀(charge) − R·I + drift. Differences over LAG_S take away what drifts, so that R is the slope of voltage over
current; means over BIN_S take away most of the noise and of what is sampled at other moments. R falls with warmth like
2^((23 °C − T)/D).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np
from scipy import stats

from energy.force.effects import RESISTANCE_REFERENCE_K

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from diagnosis.recordings.recording import Recording

BIN_S: Final = 5.0
LAG_BINS: Final = 2  # 10 s: what differs by then is resistance and fast polarisation, which lose alike
METERED_S: Final = 60.0  # over which power and voltage times current are held together: shorter, moments differ
LEAST_STEP_A: Final = 5.0  # smaller differences of the current tell more of noise
LEAST_STEPS: Final = 20  # of a trip
LEAST_TRIPS: Final = 4
DOUBLING_K: Final = 23.0  # of the resistance where the drives' temperatures do not tell
LEAST_SPREAD_K: Final = 6.0  # of temperatures over trips, below which they do not
DOUBLINGS_K: Final = (10.0, 200.0)
SENSOR_SD_FRAC: Final = 0.01  # of the gain of voltage and current sensors, which no spread of drives shows
MOST_OHM: Final = 2.0
NOISY_FRAC: Final = 0.5  # a slope that is less sure than this share of itself is none


@dataclass(frozen=True, slots=True)
class BatteryLoss:
    """Inner resistance of the battery over the drives, and how much of its loss the recorded power holds.

    ohm: at 23 °C, with its 95 % interval ohm_ci95. doubling_k: cooling that doubles it. volt: mean of the drives.
    share, share_sd: of its loss that is in the recorded power, by the power over voltage times current: 0 at the
    terminals, 1 upstream of the resistance; None where the current was not recorded. by_recording: whether the
    temperature is the battery's own, not the air's. trips: how many drives it is seen on.
    """

    ohm: float
    ohm_ci95: tuple[float, float]
    doubling_k: float
    volt: float
    share: float | None
    share_sd: float | None
    trips: int

    def ohm_at(self, kelvin: NDArray[np.float64] | float) -> NDArray[np.float64]:
        """Resistance at temperatures [K], of the same shape [Ω]."""
        return np.asarray(self.ohm * np.exp2((RESISTANCE_REFERENCE_K - np.asarray(kelvin)) / self.doubling_k))


@dataclass(frozen=True, slots=True)
class _TripSlope:
    """Of one drive: slope of voltage over current [Ω], its weight, temperature [K], voltage [V], and sums of P − V·I.

    excess: of P − V·I on V·I out and in and on I²·R for R = 1 Ω, the normal equations (3, 3) and (3,); None without a
    current.
    """

    ohm: float
    weight: float
    kelvin: float | None
    volt: float
    excess: tuple[NDArray[np.float64], NDArray[np.float64]] | None


def battery_loss(recordings: Sequence[Recording]) -> BatteryLoss | None:
    """The battery's resistance by drives with voltage; None where too few tell it."""
    slopes = [slope for slope in map(_slope, recordings) if slope is not None]
    if len(slopes) < LEAST_TRIPS:
        return None
    ohm, doubling_k = _by_temperature(slopes)
    without = np.array([_by_temperature([*slopes[:k], *slopes[k + 1 :]])[0] for k in range(len(slopes))])
    half = float(np.hypot(stats.t.ppf(0.975, len(slopes) - 1) * _jackknife_sd(without), 1.96 * SENSOR_SD_FRAC * ohm))
    if not 0.0 < ohm <= MOST_OHM or half > NOISY_FRAC * ohm:
        return None
    metered = [slope for slope in slopes if slope.excess is not None]
    share = share_sd = None
    if len(metered) >= LEAST_TRIPS:
        share = _share(metered, ohm, doubling_k)
        shares = [_share([*metered[:k], *metered[k + 1 :]], ohm, doubling_k) for k in range(len(metered))]
        share_sd = float(np.hypot(_jackknife_sd(np.array(shares)), 0.5 * half / ohm * abs(share)))
    return BatteryLoss(
        ohm=ohm,
        ohm_ci95=(ohm - half, ohm + half),
        doubling_k=doubling_k,
        volt=float(np.mean([slope.volt for slope in slopes])),
        share=share,
        share_sd=share_sd,
        trips=len(slopes),
    )


def _slope(recording: Recording) -> _TripSlope | None:
    if recording.voltage_v is None or recording.is_one_number:
        return None
    volt = recording.voltage_v
    power_w = recording.power_w
    amps = recording.current_a if recording.current_a is not None else power_w / np.where(volt > 1.0, volt, np.nan)
    known = ~(np.isnan(volt) | np.isnan(amps)) & (volt > 1.0)
    if known.sum() < LEAST_STEPS:
        return None
    volt_5, amps_5 = (_means(recording.time_s, values, known, BIN_S) for values in (volt, amps))
    step_v, step_a = volt_5[LAG_BINS:] - volt_5[:-LAG_BINS], amps_5[LAG_BINS:] - amps_5[:-LAG_BINS]
    use = np.isfinite(step_v) & (np.abs(step_a) >= LEAST_STEP_A)
    if use.sum() < LEAST_STEPS:
        return None
    x, y = step_a[use] - step_a[use].mean(), step_v[use] - step_v[use].mean()
    square = float(x @ x)
    if square <= 0.0:
        return None
    slope = -float(x @ y) / square
    residual = y + slope * x
    variance = float(residual @ residual) / max(use.sum() - 2, 1) / square
    excess = None
    if recording.current_a is not None:
        terminal_w = volt * amps
        parts = (np.maximum(terminal_w, 0.0), np.minimum(terminal_w, 0.0), amps**2, power_w - terminal_w)
        means = np.column_stack([_means(recording.time_s, part, known, METERED_S) for part in parts])
        columns, beyond = np.split(means[np.isfinite(means).all(axis=1)], [3], axis=1)
        excess = (columns.T @ columns, columns.T @ beyond[:, 0])
    kelvin = recording.battery_k if recording.battery_k is not None else recording.ambient_k
    known_k = None if kelvin is None or bool(np.isnan(kelvin).all()) else float(np.nanmedian(kelvin))
    return _TripSlope(slope, 1.0 / max(variance, 1e-12), known_k, float(volt[known].mean()), excess)


def _by_temperature(slopes: Sequence[_TripSlope]) -> tuple[float, float]:
    """Resistance at 23 °C [Ω] and the cooling that doubles it [K], by weighted least squares on the logarithm."""
    ohm = np.array([slope.ohm for slope in slopes])
    typical = float(np.median(ohm))
    sane = (ohm > 0.2 * typical) & (ohm < 5.0 * typical)
    if typical <= 0.0 or not sane.any():
        return typical, DOUBLING_K
    # a drive's slope is never surer than some percent: charge and age of the current differ
    weight = np.array([1.0 / (1.0 / slope.weight + (0.05 * typical) ** 2) for slope in slopes])[sane]
    log = np.log2(ohm[sane])
    colder = [None if slope.kelvin is None else RESISTANCE_REFERENCE_K - slope.kelvin for slope in slopes]
    if any(value is None for value in colder):
        return float(np.exp2(np.average(log, weights=weight))), DOUBLING_K
    cold_k = np.array(colder, np.float64)[sane]
    middle = np.average(cold_k, weights=weight)
    spread = np.sqrt(np.average((cold_k - middle) ** 2, weights=weight))
    per_k = 1.0 / DOUBLING_K
    if spread >= LEAST_SPREAD_K:
        per_k = float(np.average((cold_k - middle) * log, weights=weight) / spread**2)
        per_k = float(np.clip(per_k, 1.0 / DOUBLINGS_K[1], 1.0 / DOUBLINGS_K[0]))
    return float(np.exp2(np.average(log - per_k * cold_k, weights=weight))), 1.0 / per_k


def _share(slopes: Sequence[_TripSlope], ohm: float, doubling_k: float) -> float:
    """Share of the loss I²·R that recorded power holds beyond V·I, factors on V·I out and in being free [-]."""
    gram, vector = np.zeros((3, 3)), np.zeros(3)
    for slope in slopes:
        assert slope.excess is not None, "asked of drives with a current"
        colder_k = 0.0 if slope.kelvin is None else RESISTANCE_REFERENCE_K - slope.kelvin
        scale = np.array([1.0, 1.0, ohm * np.exp2(colder_k / doubling_k)])
        gram += slope.excess[0] * np.outer(scale, scale)
        vector += slope.excess[1] * scale
    size = np.sqrt(np.maximum(np.diag(gram), 1e-30))
    return float(np.linalg.lstsq(gram / np.outer(size, size), vector / size, rcond=1e-9)[0][2] / size[2])


def _means(
    time_s: NDArray[np.float64], values: NDArray[np.float64], known: NDArray[np.bool_], bin_s: float
) -> NDArray[np.float64]:
    """Means of known samples over stretches of bin_s from the first on, float64 (bins,), NaN where none is known."""
    number = ((time_s - time_s[0]) / bin_s).astype(np.int64)
    bins = int(number[-1]) + 1
    count = np.bincount(number[known], minlength=bins).astype(np.float64)
    sums = np.bincount(number[known], weights=values[known], minlength=bins)
    return np.asarray(np.divide(sums, count, out=np.full(bins, np.nan), where=count > 0.0), np.float64)


def _jackknife_sd(without: NDArray[np.float64]) -> float:
    n = without.size
    return float(np.sqrt((n - 1) / n * np.square(without - without.mean()).sum()))
