"""Time that runs in another unit than seconds, told by how fast the speed swings, by positions, odometer and charge.

Way over time by the speed and way by the ground are of one clock where time is in seconds. A clock a hundred times too
fast makes cars gain 100 km/h in 0.1 s, and a kilometre of positions take the time of ten metres.
"""

from __future__ import annotations

import itertools
from typing import TYPE_CHECKING, Final

import numpy as np

from diagnosis.recordings.counters import only_rises
from diagnosis.recordings.notes import Note, NoteKind, RecordingError
from diagnosis.recordings.positions import east_north_m
from energy.units import JOULE_PER_KWH

if TYPE_CHECKING:
    from collections.abc import Iterator

    from numpy.typing import NDArray

    from diagnosis.recordings.recording import Recording

SWING_MPS: Final = 6.0  # a change of speed that no noise of a sensor makes
LEAST_SWINGS: Final = 2
SWING_STEPS: Final = 3  # that a swing takes at least: a single bad sample of speed is none
SHORT_S: Final = 30.0  # no drive of so many rows is over so soon (assumed)
SHORT_ROWS: Final = 300
FASTEST_MPS2: Final = 20.0  # as a rule over swings: twice what tyres hold, so that no car does
FAST_MPS2: Final = 5.0  # what the hardest driving does as a rule
SLOW_MPS2: Final = 0.06  # a tenth of what the calmest driving does as a rule
LEAST_WAY_M: Final = 500.0
WAY_FACTOR: Final = 8.0  # way by the ground over that by the speed: units of speed explain 3.6 at most
STEP_M: Final = 20.0  # positions nearer to each other are noise
SMALLEST_KWH: Final = 2.0  # what no traction battery falls short of, and what none of a car exceeds (assumed)
LARGEST_KWH: Final = 1000.0
LEAST_FALL: Final = 0.05


def check_pace(recording: Recording, path: str) -> None:
    """Raises RecordingError where time runs so fast or slow that no car drives so."""
    allowed = "seconds; divide milliseconds by 1000, multiply what is divided already"
    swing_mps2 = usual_swing_mps2(recording)
    if swing_mps2 is not None and swing_mps2 > FASTEST_MPS2:
        found = f"too fast: the speed swings by {swing_mps2:.3g} m/s² as a rule, and tyres hold 10"
        raise RecordingError(path, 2, "time", found, allowed)
    for factor, what in ground_factors(recording):
        if not 1.0 / WAY_FACTOR < factor < WAY_FACTOR:
            pace = "fast" if factor > 1.0 else "slow"
            found = f"too {pace}: by its {what} the car drove {factor:.3g} times as far as by speed and time"
            raise RecordingError(path, 2, "time", found, f"{allowed}; or a speed in the unit that its column declares")


def pace_notes(recording: Recording) -> Iterator[Note]:
    """Notes on a time that may run too fast or too slow."""
    swing_mps2 = usual_swing_mps2(recording)
    if swing_mps2 is not None and not SLOW_MPS2 < swing_mps2 < FAST_MPS2:
        pace = "fast" if swing_mps2 >= FAST_MPS2 else "slow"
        text = f"may run too {pace}: the speed swings by {swing_mps2:.2g} m/s² as a rule; is time in seconds?"
        yield Note(NoteKind.SUSPECT, "time_s", text)
    lasts_s = float(recording.time_s[-1] - recording.time_s[0])
    if recording.time_s.size >= SHORT_ROWS and lasts_s < SHORT_S and swing_mps2 is None:
        text = f"{recording.time_s.size} rows within {lasts_s:.3g} s: is time in seconds?"
        yield Note(NoteKind.SUSPECT, "time_s", text)
    capacity_kwh = told_capacity_kwh(recording)
    if capacity_kwh is not None and not SMALLEST_KWH < capacity_kwh < LARGEST_KWH:
        text = f"power over time and the fall of the charge tell a battery of {capacity_kwh:.3g} kWh"
        yield Note(NoteKind.SUSPECT, "time_s", f"{text}: time, power or charge in another unit?")


def usual_swing_mps2(recording: Recording) -> float | None:
    """Median over swings of the speed of their change over their time [m/s²]; None for fewer than LEAST_SWINGS.

    A swing goes from one turning point to the next, where the speed came back by SWING_MPS. Its time is that between
    a tenth and nine tenths of it, so that a car that stands or cruises before does not count, and SWING_STEPS of the
    samples at least.
    """
    time_s, speed = recording.time_s, recording.speed_mps
    turns = _turning_points(speed)
    paces = []
    gaps = recording.gap_steps(time_s)
    for begin, end in itertools.pairwise(turns):
        if gaps[begin:end].any():
            continue
        part = speed[begin : end + 1]
        done = (part - part[0]) / (part[-1] - part[0])
        first = begin + int(np.flatnonzero(done <= 0.1)[-1])
        last = first + int(np.argmax(done[first - begin :] >= 0.9))
        if last - first < SWING_STEPS:
            continue
        paces.append(abs(float(speed[last] - speed[first])) / float(time_s[last] - time_s[first]))
    return float(np.median(paces)) if len(paces) >= LEAST_SWINGS else None


def ground_factors(recording: Recording) -> Iterator[tuple[float, str]]:
    """Way by the ground over that by speed and time, by positions and by the odometer, each where it is long enough."""
    driven_m = recording.distance_m()
    if driven_m <= 0.0:
        return
    latitude, longitude = recording.latitude_deg, recording.longitude_deg
    if latitude is not None and longitude is not None and not recording.gaps:
        known = ~(np.isnan(latitude) | np.isnan(longitude))
        if np.count_nonzero(known) > 1:
            way_m = _way_m(*east_north_m(latitude[known], longitude[known]))
            if way_m >= LEAST_WAY_M:
                yield way_m / driven_m, "positions"
    odometer_m = recording.odometer_m
    if odometer_m is not None and not recording.gaps and only_rises(odometer_m):
        counted = odometer_m[~np.isnan(odometer_m)]
        if counted.size > 1 and counted[-1] - counted[0] >= max(LEAST_WAY_M, 2000.0):
            yield float(counted[-1] - counted[0]) / driven_m, "odometer"


def told_capacity_kwh(recording: Recording) -> float | None:
    """Energy over the fall of the charge [kWh]; None where it falls by less than LEAST_FALL, or energy was not told."""
    charge = recording.soc_frac
    if charge is None or recording.gaps:
        return None
    known = np.flatnonzero(~np.isnan(charge))
    if known.size < 2:
        return None
    fall = float(charge[known[0]] - charge[known[-1]])
    energy_j = recording.energy_j()
    return energy_j / JOULE_PER_KWH / fall if fall >= LEAST_FALL and energy_j > 0.0 else None


def _turning_points(speed: NDArray[np.float64]) -> list[int]:
    """Samples at which the speed turns, each SWING_MPS at least from the one before."""
    values = speed.tolist()
    turns: list[int] = []
    low = high = 0
    rising = 0
    for k, value in enumerate(values):
        if value > values[high]:
            high = k
        if value < values[low]:
            low = k
        if rising <= 0 and value - values[low] >= SWING_MPS:
            turns.append(low)
            rising, high = 1, k
        elif rising >= 0 and values[high] - value >= SWING_MPS:
            turns.append(high)
            rising, low = -1, k
    if rising:
        turns.append(high if rising > 0 else low)
    return turns


def _way_m(east: NDArray[np.float64], north: NDArray[np.float64]) -> float:
    """Length of the way along positions that are STEP_M apart at least."""
    way_m, x, y = 0.0, float(east[0]), float(north[0])
    for other_x, other_y in zip(east.tolist(), north.tolist(), strict=True):
        step_m = float(np.hypot(other_x - x, other_y - y))
        if step_m >= STEP_M:
            way_m, x, y = way_m + step_m, other_x, other_y
    return way_m
