"""Recorded drives in windows: measured and simulated energy, and what every column would add, ready to be fitted."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Final

import numpy as np

from diagnosis.causes.climate import CLIMATE_EFFECTS, climate_w
from diagnosis.causes.driven import ROUGHER_M, rougher_grade
from diagnosis.causes.nuisance import PARAMETERS, SENSOR_COLUMNS
from energy.units import GRAVITY_MPS2

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from numpy.typing import NDArray

    from diagnosis.causes.driven import ReplayedDrive
    from diagnosis.causes.terms import Candidate
    from diagnosis.recordings.reading import Recording
    from energy.replay.replay import DrivenProfile

HILL_FRAC: Final = 0.01
TOTALS_S: Final = 3600.0  # windows of that length hold whole drives
FINE_WINDOW_S: Final = 13.0  # windows are no longer where samples are close enough to see accelerations
WINDOW_S: Final = 10.0  # long against the lag between speed and current, short against what changes in a drive
PARAMETER_NAMES: Final = tuple(parameter.name for parameter in PARAMETERS)
SENSOR_NAMES: Final = tuple(sensor.name for sensor in SENSOR_COLUMNS)
FREE: Final = PARAMETER_NAMES + SENSOR_NAMES


@dataclass(frozen=True, slots=True)
class Windows:
    """One trip in n windows of equal length, each array with one value a window, float64 (n,).

    measured_j, simulated_j: from the battery; the latter by the vehicle without effects. dynamic_w: root mean square of
    the simulated power, which tells how much a sensor's error matters. hill_w: power that a grade of 1 % would take
    where no height was recorded, 0 where it was. places: means of what was recorded, by name.
    columns_j: float64 (n, p) in the order of names. climate_j: what heater and air conditioning took by their recorded
    columns, None where these do not say; climate_names: columns that stand for it.
    """

    trip_id: str
    ambient_k: float | None
    begin_s: NDArray[np.float64]
    duration_s: NDArray[np.float64]
    distance_m: NDArray[np.float64]
    standing_s: NDArray[np.float64]
    measured_j: NDArray[np.float64]
    simulated_j: NDArray[np.float64]
    dynamic_w: NDArray[np.float64]
    hill_w: NDArray[np.float64]
    places: Mapping[str, NDArray[np.float64]]
    names: tuple[str, ...]
    columns_j: NDArray[np.float64]
    climate_j: NDArray[np.float64] | None = None
    climate_names: frozenset[str] = frozenset()

    def residual_j(self) -> NDArray[np.float64]:
        """Measured less simulated energy of each window, and less that of the recorded climate, float64 (n,) [J]."""
        known_j = 0.0 if self.climate_j is None else self.climate_j
        return np.asarray(self.measured_j - self.simulated_j - known_j, np.float64)

    def fitted_columns_j(self) -> NDArray[np.float64]:
        """Columns that residual_j is fitted by: those that stand for a recorded climate are 0, float64 (n, p) [J]."""
        return self.columns_j if self.climate_j is None else self.columns_j * ~self._of_climate()

    def climate_columns_j(self) -> NDArray[np.float64]:
        """Columns that climate_j is fitted by, all others 0, float64 (n, p) [J]."""
        return self.columns_j * self._of_climate()

    def _of_climate(self) -> NDArray[np.bool_]:
        return np.array([name in self.climate_names for name in self.names], np.bool_)

    def column(self, name: str) -> NDArray[np.float64]:
        """Energy of one unit of a column, float64 (n,) [J]."""
        return self.columns_j[:, self.names.index(name)]

    def with_column(self, name: str, column_j: NDArray[np.float64]) -> Windows:
        """The windows with one column more, float64 (n,) [J], behind those that they have."""
        return replace(self, names=(*self.names, name), columns_j=np.column_stack((self.columns_j, column_j)))


@dataclass(frozen=True, slots=True)
class WindowedTrip:
    """A recording with its replay, and which window each step belongs to, int64 (steps,), −1 where power is unknown."""

    recording: Recording
    drive: ReplayedDrive
    window: NDArray[np.int64]
    rougher: DrivenProfile


def trip_of(recording: Recording, drive: ReplayedDrive, window_s: float = WINDOW_S) -> WindowedTrip:
    """A recorded drive split into windows."""
    window = (np.maximum(drive.since_s, 0.0) / window_s).astype(np.int64)
    window[recording.gap_steps(drive.profile.time_s)] = -1
    known = np.unique(window[window >= 0])
    dense = np.where(window >= 0, np.searchsorted(known, window), -1)
    return WindowedTrip(recording, drive, dense, rougher_grade(recording, ROUGHER_M))


def windows_of(trip: WindowedTrip, candidates: Sequence[Candidate]) -> Windows:
    """A trip's windows with the columns of all parameters, sensors and candidates, in that order."""
    drive, recording = trip.drive, trip.recording
    columns = [parameter.column_j(drive) for parameter in PARAMETERS]
    columns += [sensor.column_j(drive, trip.rougher) for sensor in SENSOR_COLUMNS]
    columns += [candidate.term.column_j(drive, candidate.shape) for candidate in candidates]
    climate = climate_w(recording)
    way_m = drive.profile.step_m()
    duration_s = summed(trip, drive.duration_s)
    since = summed(trip, (drive.since_s - 0.5 * drive.duration_s) * drive.duration_s) / duration_s
    return Windows(
        trip_id=recording.id,
        ambient_k=drive.ambient_k,
        begin_s=since,
        duration_s=duration_s,
        distance_m=summed(trip, way_m),
        standing_s=summed(trip, np.where(way_m <= 0.0, drive.duration_s, 0.0)),
        measured_j=summed(trip, _drawn_j(trip, recording.power_w)),
        simulated_j=summed(trip, drive.power_w * drive.duration_s),
        dynamic_w=np.sqrt(summed(trip, drive.power_w**2 * drive.duration_s) / duration_s),
        hill_w=_hill_w(trip, duration_s),
        places={
            name: summed(trip, values * drive.duration_s) / duration_s
            for name, values in drive.channels.items()
            if name not in ("heading_rad", "wind_from_rad")
        }
        | _headings(trip, duration_s)
        | {"grade_frac": summed(trip, drive.grade_frac * drive.duration_s) / duration_s},
        names=FREE + tuple(candidate.label for candidate in candidates),
        columns_j=np.column_stack([summed(trip, column) for column in columns]),
        climate_j=None if climate is None else summed(trip, _drawn_j(trip, climate)),
        climate_names=frozenset(
            candidate.label for candidate in candidates if candidate.term.effect in CLIMATE_EFFECTS
        ),
    )


def _drawn_j(trip: WindowedTrip, power_w: NDArray[np.float64]) -> NDArray[np.float64]:
    """Energy of each step of the replay by a power at the recording's samples, float64 (steps,) [J]."""
    time_s = trip.recording.time_s
    drawn_j = np.concatenate(([0.0], np.cumsum(0.5 * (power_w[1:] + power_w[:-1]) * np.diff(time_s))))
    return np.diff(np.interp(trip.drive.profile.time_s, time_s, drawn_j))


def is_heightless(trips: Sequence[Windows]) -> bool:
    """Whether most trips have no height."""
    return 2 * sum(bool(trip.hill_w.any()) for trip in trips) > len(trips)


def measured_size_j(trips: Sequence[Windows]) -> float:
    """Energy that trips moved, their sizes added up, so that shares of it have a meaning where some gave back [J]."""
    return sum(abs(float(trip.measured_j.sum())) for trip in trips)


def summed(trip: WindowedTrip, values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Sum over the steps of each window, float64 (n,)."""
    inside = trip.window >= 0
    count = int(trip.window.max(initial=-1)) + 1
    return np.asarray(np.bincount(trip.window[inside], weights=values[inside], minlength=count), np.float64)


def _hill_w(trip: WindowedTrip, duration_s: NDArray[np.float64]) -> NDArray[np.float64]:
    drive = trip.drive
    if "altitude_m" in drive.channels:
        return np.zeros_like(duration_s)
    weight_n = drive.vehicle.mass_kg * GRAVITY_MPS2
    return summed(trip, drive.work_j(HILL_FRAC * weight_n)) / duration_s


def _headings(trip: WindowedTrip, duration_s: NDArray[np.float64]) -> dict[str, NDArray[np.float64]]:
    heading = trip.drive.channels.get("heading_rad")
    if heading is None:
        return {}
    east, north = (
        summed(trip, part * trip.drive.duration_s) / duration_s for part in (np.sin(heading), np.cos(heading))
    )
    return {"heading_rad": np.asarray(np.arctan2(east, north) % (2.0 * np.pi), np.float64)}
