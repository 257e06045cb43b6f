"""Baselines on sums of a trip, which know neither windows nor effects: what a diagnosis must beat to be worth its name.

Ridge on three numbers a trip, and non-negative least squares on seven. Both are fitted to the relative error of trips.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np
from scipy.optimize import nnls

from diagnosis.causes.driven import driven
from diagnosis.fit.windows import trip_of, windows_of
from energy.units import JOULE_PER_KWH, ZERO_CELSIUS_K
from proof.answers import Rule

if TYPE_CHECKING:
    from collections.abc import Collection, Sequence

    from numpy.typing import NDArray

    from diagnosis.recordings.reading import Recording
    from energy.vehicle.vehicle import Vehicle

RIDGE_NAME: Final = "ridge on three numbers a trip"
SUMS_NAME: Final = "regression on seven sums a trip"
WARM_C: Final = 20.0
HOT_C: Final = 22.0
WARM_UP_S: Final = 600.0
LEAST_KWH: Final = 0.3  # relative errors of less energy count as of so much
PENALTIES: Final = (1e-3, 1e-2, 1e-1, 1.0)


@dataclass(frozen=True, slots=True)
class TripSums:
    """One trip: measured energy, that of the vehicle's file, and the numbers that baselines are fitted on.

    three: of the ridge: energy of the file [kWh], hours, hours times kelvins of cold. seven: energy of the file without
    its auxiliaries, hours, hours of cold, warm-up times cold, hours of heat, kilometres of cold, warm-up times how cold
    the battery was at the start.
    """

    id: str
    measured_kwh: float
    file_kwh: float
    three: NDArray[np.float64]
    seven: NDArray[np.float64]


def trip_sums(recording: Recording, vehicle: Vehicle) -> TripSums:
    """The sums of one recording, of its windows that were measured."""
    trip = trip_of(recording, driven(recording, vehicle))
    windows = windows_of(trip, ())
    inside = trip.window >= 0
    duration_s = trip.drive.duration_s[inside]
    hours = float(duration_s.sum()) / 3600.0
    air_c = WARM_C if trip.drive.ambient_k is None else trip.drive.ambient_k - ZERO_CELSIUS_K
    battery_c = air_c
    if recording.battery_k is not None and not np.isnan(recording.battery_k).all():
        battery_c = float(recording.battery_k[~np.isnan(recording.battery_k)][0]) - ZERO_CELSIUS_K
    cold, hot, cold_battery = max(WARM_C - air_c, 0.0), max(air_c - HOT_C, 0.0), max(WARM_C - battery_c, 0.0)
    warm_up_h = float((np.exp(-trip.drive.since_s[inside] / WARM_UP_S) * duration_s).sum()) / 3600.0
    file_kwh = float(windows.simulated_j.sum()) / JOULE_PER_KWH
    km = float(windows.distance_m.sum()) / 1000.0
    driving_kwh = file_kwh - vehicle.aux_power_w * hours / 1000.0
    sums = (driving_kwh, hours, hours * cold, warm_up_h * cold, hours * hot, km * cold, warm_up_h * cold_battery)
    measured_kwh = float(windows.measured_j.sum()) / JOULE_PER_KWH
    return TripSums(recording.id, measured_kwh, file_kwh, np.array([file_kwh, hours, hours * cold]), np.array(sums))


def ridge_kwh(fitted: Sequence[TripSums], asked: Sequence[TripSums]) -> NDArray[np.float64]:
    """Energies by a ridge about the file's own; the penalty is the best on trips left out, float64 (n,) [kWh]."""
    columns, measured = np.array([trip.three for trip in fitted]), np.array([trip.measured_kwh for trip in fitted])
    weight = 1.0 / np.maximum(np.abs(measured), LEAST_KWH)
    scale = np.maximum(columns.std(axis=0), 1e-9)
    design, target = columns / scale * weight[:, None], (measured - columns[:, 0]) * weight

    def fit(rows: NDArray[np.bool_], penalty: float) -> NDArray[np.float64]:
        gram = design[rows].T @ design[rows] + penalty * np.eye(design.shape[1])
        return np.asarray(np.linalg.solve(gram, design[rows].T @ target[rows]), np.float64)

    every = np.arange(measured.size)
    errors = [sum(abs(float(design[k] @ fit(every != k, penalty) - target[k])) for k in every) for penalty in PENALTIES]
    beta = fit(every >= 0, PENALTIES[int(np.argmin(errors))])
    wanted = np.array([trip.three for trip in asked])
    return np.asarray(wanted / scale @ beta + wanted[:, 0], np.float64)


def sums_kwh(fitted: Sequence[TripSums], asked: Sequence[TripSums]) -> NDArray[np.float64]:
    """Energies of trips by non-negative least squares on the seven sums, (n,) [kWh]."""
    measured = np.array([trip.measured_kwh for trip in fitted])
    weight = 1.0 / np.maximum(np.abs(measured), LEAST_KWH)
    beta, _ = nnls(np.array([trip.seven for trip in fitted]) * weight[:, None], measured * weight)
    return np.asarray(np.array([trip.seven for trip in asked]) @ beta, np.float64)


def trip_sum_rules(recordings: Sequence[Recording], vehicle: Vehicle, held_out: Collection[str]) -> tuple[Rule, ...]:
    """Both baselines as rules that claim nothing."""
    sums = [trip_sums(recording, vehicle) for recording in recordings]
    fitted = [trip for trip in sums if trip.id not in held_out]
    asked = [trip for trip in sums if trip.id in held_out]
    return (
        Rule(RIDGE_NAME, (), tuple(ridge_kwh(fitted, asked).tolist())),
        Rule(SUMS_NAME, (), tuple(sums_kwh(fitted, asked).tolist())),
    )
