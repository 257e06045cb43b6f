"""What the battery holds, from measured energy over the fall of its charge, trip by trip.

A charge is shown in steps, a current sensor has an offset, a charge counted in ampere-hours gives less energy when the
battery is empty, and so does a cold one. The capacity is that at the middle of the charge and at WARM_C.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np
from scipy.stats import t as student_t

from diagnosis.answer.results import CapacityDrift, CapacityEstimate, CapacityKind
from diagnosis.recordings.recording import Detail
from energy.units import JOULE_PER_WH, ZERO_CELSIUS_K

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from numpy.typing import NDArray

    from diagnosis.recordings.recording import Recording

CAPACITY: Final = "usable_capacity_wh"  # the field of a vehicle
LEAST_FALL_FRAC: Final = 0.04  # of a trip
LEAST_FALL_STEPS: Final = 4.0  # of the charge's own
LEAST_IN_ALL_FRAC: Final = 0.2  # of all trips together
CLEAR_TRIPS: Final = 4  # from which on trips show themselves how they scatter
NOTHING_HALF: Final = 3.0  # half width in logarithms: the interval spans a factor of 400, and drives tell nothing
WIDEST_FRAC: Final = 0.15  # half width of an interval, beyond which nothing is said
AGREES_FRAC: Final = 0.08  # half width up to which a battery is said to be as its file has it
DISPLAY_FRAC: Final = 0.04  # by which a displayed charge is off as a rule (assumed)
LEAST_RATIO: Final = 0.5  # of the file's capacity, below which no battery is driven (assumed)
OTHER_BATTERY_RATIO: Final = 0.75  # below which a battery has rather another size than an age
EVENT_STEPS: Final = 0.25  # standard deviation of the charge as it changes, in steps: it is shown late (assumed)
OFFSET_W: Final = 40.0  # standard deviation of the current sensor's offset, as power (assumed: 0.1 A)
GAUGE_FRAC: Final = 0.01  # standard deviation of the current sensor's gain (assumed)
SCATTER_FRAC: Final = 0.02  # of single trips, where too few show it
LEAST_SCATTER_FRAC: Final = 0.005
OUTLIER_SD: Final = 4.0
OUTLIER_FRAC: Final = 0.06
WARM_C: Final = 20.0
COLD_C: Final = 10.0
SLOPE: Final = (0.08, 0.08)  # relative rise of voltage over the whole charge, mean and standard deviation (assumed)
CHILL: Final = (-0.02, 0.015)  # relative change of energy over 10 K below WARM_C, mean and standard deviation (assumed)
ROUNDED_SD: Final = math.sqrt(2.0 / 12.0)  # of the difference of two rounded numbers, in steps
WHOLE_PERCENT: Final = 0.01
EPOCH_S: Final = 1e8  # times from here on are of a calendar
YEAR_S: Final = 365.25 * 86_400.0
LEAST_YEARS: Final = 0.5
DRIFT_TRIPS: Final = 8
LEAST_DRIFT_FRAC: Final = 0.01  # a year
MOST_ROUNDS: Final = 50


@dataclass(frozen=True, slots=True)
class Discharge:
    """What one trip took: energy [Wh] and fall of the charge with its standard deviation, how long, and where."""

    trip_id: str
    energy_wh: float
    fall_frac: float
    fall_sd_frac: float
    hours: float
    middle_frac: float
    temp_c: float | None
    begins_s: float | None


def capacity_of(recordings: Sequence[Recording], file_wh: float) -> CapacityEstimate | None:
    """What the battery holds by drives that have power and charge; None where they don't tell.

    A charge as it is displayed counts before any other, where drives have it: it is the one that routes are asked with.
    file_wh: what the vehicle's file has [Wh].
    """
    displayed = any(recording.displayed_frac is not None for recording in recordings)
    found = _estimate(recordings, file_wh, displayed=displayed)
    return _estimate(recordings, file_wh, displayed=False) if found is None and displayed else found


def _estimate(recordings: Sequence[Recording], file_wh: float, *, displayed: bool) -> CapacityEstimate | None:
    points = [
        point
        for recording in recordings
        if (point := discharge_of(recording, displayed=displayed)) is not None and point.energy_wh > 0.0
    ]
    points = _without_outliers(points)
    if sum(point.fall_frac for point in points) < LEAST_IN_ALL_FRAC:
        return None
    center, half = _fitted(points)
    if half > NOTHING_HALF:
        return None
    value_wh = math.exp(center)
    low_wh, high_wh = value_wh * math.exp(-half), value_wh * math.exp(half)
    known = [point.temp_c for point in points if point.temp_c is not None]
    kind = _kind(value_wh, (low_wh, high_wh), half, file_wh)
    drift = _drift(points) if kind is not CapacityKind.NOT_CLEAR else None
    median_c = float(np.median(known)) if known else None
    return CapacityEstimate(
        kind=kind,
        value_wh=value_wh,
        ci95_wh=(low_wh, high_wh),
        file_wh=file_wh,
        trips=tuple(point.trip_id for point in points),
        fall_frac=sum(point.fall_frac for point in points),
        displayed=displayed,
        median_c=median_c,
        drift=drift,
        is_carried=kind is CapacityKind.LESS and len(points) >= CLEAR_TRIPS,
        text=_text(kind, value_wh, (low_wh, high_wh), file_wh, median_c, drift, len(points)),
    )


def _kind(value_wh: float, ci95_wh: tuple[float, float], half: float, file_wh: float) -> CapacityKind:
    if half > WIDEST_FRAC or value_wh < LEAST_RATIO * file_wh:
        return CapacityKind.NOT_CLEAR
    if ci95_wh[1] < (1.0 - DISPLAY_FRAC) * file_wh:
        return CapacityKind.LESS
    if ci95_wh[0] > (1.0 + DISPLAY_FRAC) * file_wh:
        return CapacityKind.MORE
    return CapacityKind.AS_IN_FILE if half <= AGREES_FRAC else CapacityKind.NOT_CLEAR


def discharge_of(recording: Recording, *, displayed: bool = False) -> Discharge | None:
    """Energy and fall of the charge of a trip between two moments at which the charge changed; None where too small.

    So a charge in steps of half a percent is known as closely as one of a hundredth. Stretches beside gaps count each
    for itself, since what was taken in a gap is not known.
    """
    charge = recording.displayed_frac if displayed else recording.soc_frac
    if charge is None or recording.detail in (Detail.CHARGE, Detail.COUNTER) or not recording.power_w.any():
        return None
    if recording.detail is Detail.TOTALS:
        pieces = [_whole_drive(recording, charge)]
    else:
        pieces = list(_pieces(recording, charge))
    if not pieces:
        return None
    energy_wh, fall, seconds = (float(sum(piece[k] for piece in pieces)) for k in (0, 1, 3))
    fall_sd = math.hypot(*(piece[2] for piece in pieces))
    if fall < LEAST_FALL_FRAC or fall_sd * LEAST_FALL_STEPS > fall:
        return None
    temp_k = recording.battery_k if recording.battery_k is not None else recording.ambient_k
    known = temp_k is not None and not bool(np.isnan(temp_k).all())
    begins_s = float(recording.time_s[0])
    return Discharge(
        trip_id=recording.id,
        energy_wh=energy_wh,
        fall_frac=fall,
        fall_sd_frac=fall_sd,
        hours=seconds / 3600.0,
        middle_frac=float(sum(piece[1] * piece[4] for piece in pieces)) / fall,
        temp_c=float(np.nanmedian(temp_k)) - ZERO_CELSIUS_K if temp_k is not None and known else None,
        begins_s=begins_s if begins_s >= EPOCH_S else None,
    )


Piece = tuple[float, float, float, float, float]  # energy [Wh], fall and its standard deviation, seconds, middle


def _whole_drive(recording: Recording, charge: NDArray[np.float64]) -> Piece:
    seconds = float(recording.time_s[-1] - recording.time_s[0])
    energy_wh = float(recording.power_w[0]) * seconds / JOULE_PER_WH
    middle = 0.5 * float(charge[0] + charge[-1])
    return energy_wh, float(charge[0] - charge[-1]), ROUNDED_SD * WHOLE_PERCENT, seconds, middle


def _pieces(recording: Recording, charge: NDArray[np.float64]) -> Iterator[Piece]:
    """Each stretch without a gap, from the first fall of the charge to its last."""
    time_s, power_w = recording.time_s, recording.power_w
    broken = recording.gap_steps(time_s)
    step_j = np.where(broken, 0.0, 0.5 * (power_w[1:] + power_w[:-1]) * np.diff(time_s))
    drawn_j = np.concatenate(([0.0], np.cumsum(step_j)))
    edges = np.concatenate(([0], np.flatnonzero(broken) + 1, [time_s.size]))
    for begin, end in zip(edges[:-1].tolist(), edges[1:].tolist(), strict=True):
        at = begin + np.flatnonzero(~np.isnan(charge[begin:end]))
        if at.size < 2:
            continue
        shown = charge[at]
        falls = np.flatnonzero(np.diff(shown) < 0.0)
        if falls.size < 2:
            continue
        first, last = int(falls[0]), int(falls[-1])
        # at a change the charge is between both values; when that was is known to a sample
        high, low = (0.5 * float(shown[k] + shown[k + 1]) for k in (first, last))
        sizes = [float(shown[k] - shown[k + 1]) for k in (first, last)]
        from_j, to_j = (0.5 * float(drawn_j[at[k]] + drawn_j[at[k + 1]]) for k in (first, last))
        from_s, to_s = (0.5 * float(time_s[at[k]] + time_s[at[k + 1]]) for k in (first, last))
        if high > low:
            sd = EVENT_STEPS * math.hypot(*sizes)
            yield (to_j - from_j) / JOULE_PER_WH, high - low, sd, to_s - from_s, 0.5 * (high + low)


def _columns(points: Sequence[Discharge]) -> NDArray[np.float64]:
    """Level, place on the charge, and tens of kelvin below WARM_C of each trip, float64 (n, 3)."""
    chill = [0.0 if point.temp_c is None else max(WARM_C - point.temp_c, 0.0) / 10.0 for point in points]
    return np.column_stack([np.ones(len(points)), [point.middle_frac - 0.5 for point in points], chill])


def _known_var(points: Sequence[Discharge]) -> NDArray[np.float64]:
    """Variance of each trip's relative capacity by steps of the charge and an offset of the current, float64 (n,)."""
    return np.array(
        [
            (point.fall_sd_frac / point.fall_frac) ** 2 + (OFFSET_W * point.hours / point.energy_wh) ** 2
            for point in points
        ]
    )


def _levels(points: Sequence[Discharge]) -> NDArray[np.float64]:
    return np.log([point.energy_wh / point.fall_frac for point in points])


def _without_outliers(points: Sequence[Discharge]) -> list[Discharge]:
    """Trips that agree with most others; a jump of the charge or another car's drive does not."""
    if len(points) < CLEAR_TRIPS:
        return list(points)
    prior = np.array([0.0, SLOPE[0], CHILL[0]])
    rest = _levels(points) - _columns(points) @ prior
    apart = np.abs(rest - np.median(rest))
    allowed = max(OUTLIER_FRAC, OUTLIER_SD * 1.4826 * float(np.median(apart)))
    known_sd = np.sqrt(_known_var(points))
    return [
        point
        for point, off, sd in zip(points, apart, known_sd, strict=True)
        if off <= max(allowed, OUTLIER_SD * float(sd))
    ]


def _solved(
    levels: NDArray[np.float64],
    columns: NDArray[np.float64],
    var: NDArray[np.float64],
    priors: Sequence[tuple[float, float] | None],
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Coefficients by weighted least squares with priors (mean and standard deviation), and their covariance."""
    normal = (columns / var[:, None]).T @ columns
    right = (columns / var[:, None]).T @ levels
    for k, prior in enumerate(priors):
        if prior is not None:
            normal[k, k] += 1.0 / prior[1] ** 2
            right[k] += prior[0] / prior[1] ** 2
    covariance = np.linalg.inv(normal)
    return np.asarray(covariance @ right, np.float64), np.asarray(covariance, np.float64)


def _scatter_var(
    levels: NDArray[np.float64],
    columns: NDArray[np.float64],
    known: NDArray[np.float64],
    priors: Sequence[tuple[float, float] | None],
) -> float:
    """Variance of trips beyond what is known of them (Paule and Mandel 1982), at least LEAST_SCATTER_FRAC²."""
    if levels.size < CLEAR_TRIPS:
        return SCATTER_FRAC**2
    low, high = LEAST_SCATTER_FRAC**2, 1.0
    for _ in range(MOST_ROUNDS):
        middle = math.sqrt(low * high)
        beta, _covariance = _solved(levels, columns, known + middle, priors)
        if float(((levels - columns @ beta) ** 2 / (known + middle)).sum()) > levels.size - 1:
            low = middle
        else:
            high = middle
    return high


def _fitted(points: Sequence[Discharge]) -> tuple[float, float]:
    """Logarithm of the capacity [ln Wh] and half width of its 95 % interval [-], by a jackknife over trips."""
    levels, columns, known = _levels(points), _columns(points), _known_var(points)
    priors = (None, SLOPE, CHILL)
    var = known + _scatter_var(levels, columns, known, priors)
    beta, covariance = _solved(levels, columns, var, priors)
    n = len(points)
    spread, reach = math.sqrt(float(covariance[0, 0])), 1.96
    if n >= CLEAR_TRIPS:
        without = np.array([_solved(*_left_out(levels, columns, var, k), priors)[0][0] for k in range(n)])
        jackknife = math.sqrt((n - 1) / n * float(((without - without.mean()) ** 2).sum()))
        spread, reach = max(spread, jackknife), float(student_t.ppf(0.975, n - 1))
    share = (1.0 / var) / (1.0 / var).sum()
    offset = OFFSET_W * float(share @ [point.hours / point.energy_wh for point in points])
    return float(beta[0]), math.hypot(reach * spread, 1.96 * offset, 1.96 * GAUGE_FRAC)


def _left_out(
    levels: NDArray[np.float64], columns: NDArray[np.float64], var: NDArray[np.float64], k: int
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    return np.delete(levels, k), np.delete(columns, k, axis=0), np.delete(var, k)


def _drift(points: Sequence[Discharge]) -> CapacityDrift | None:
    """How the capacity changes with the date, where that is clear over half a year and more."""
    dated = [(point, point.begins_s) for point in points if point.begins_s is not None]
    if len(dated) < DRIFT_TRIPS:
        return None
    own = [point for point, _ in dated]
    years = np.array([begins_s for _, begins_s in dated]) / YEAR_S
    if float(np.ptp(years)) < LEAST_YEARS:
        return None
    levels, known = _levels(own), _known_var(own)
    columns = np.column_stack([_columns(own), years - years.mean()])
    priors = (None, SLOPE, CHILL, None)
    var = known + _scatter_var(levels, columns, known, priors)
    beta, covariance = _solved(levels, columns, var, priors)
    n = len(own)
    without = np.array([_solved(*_left_out(levels, columns, var, k), priors)[0][3] for k in range(n)])
    jackknife = math.sqrt((n - 1) / n * float(((without - without.mean()) ** 2).sum()))
    half = float(student_t.ppf(0.975, n - 2)) * max(jackknife, math.sqrt(float(covariance[3, 3])))
    slope = float(beta[3])
    if abs(slope) - half < 0.0 or abs(slope) < LEAST_DRIFT_FRAC:
        return None
    return CapacityDrift(slope, (slope - half, slope + half), float(np.ptp(years)))


def _text(
    kind: CapacityKind,
    value_wh: float,
    ci95_wh: tuple[float, float],
    file_wh: float,
    median_c: float | None,
    drift: CapacityDrift | None,
    trips: int,
) -> str:
    """What is said of it, in a sentence or two; nothing where it agrees with the file and does not drift."""
    size = f"{value_wh / 1000.0:.1f} kWh ({ci95_wh[0] / 1000.0:.1f}..{ci95_wh[1] / 1000.0:.1f})"
    size += " by one drive" if trips == 1 else ""
    cold = f", on drives with a battery at {median_c:.0f} °C" if median_c is not None and median_c < COLD_C else ""
    found = []
    if kind is CapacityKind.LESS:
        other = ", or the file is of a larger battery" if value_wh < OTHER_BATTERY_RATIO * file_wh else ""
        found.append(
            f"The battery holds {size}{cold} where its file has {file_wh / 1000.0:g}: aged, or its display counts"
            f" otherwise{other}. That changes ranges, not consumption."
        )
    elif kind is CapacityKind.MORE:
        found.append(
            f"A full charge stands for {size}{cold} where the vehicle's file has {file_wh / 1000.0:g} usable: the"
            " charge that was recorded counts more than the part that drives use, or the file is of a smaller battery."
        )
    if drift is not None:
        low, high = (f"{100.0 * bound:+.1f}" for bound in drift.ci95_frac_per_year)
        found.append(
            f"What it holds changes by {100.0 * drift.frac_per_year:+.1f} % a year ({low}..{high}), by drives over"
            f" {drift.years:.1f} years."
        )
    return " ".join(found)
