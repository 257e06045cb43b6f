"""Units of speed and power held against positions and against physics that every car shares."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from diagnosis.recordings.notes import Note, NoteKind, RecordingError
from diagnosis.recordings.positions import east_north_m
from diagnosis.recordings.soundness.signs import PUSH_SAMPLES, PUSH_W_PER_KG
from energy.units import JOULE_PER_KWH

if TYPE_CHECKING:
    from collections.abc import Iterator

    from numpy.typing import NDArray

    from diagnosis.recordings.recording import Recording

WINDOW_S: Final = 10.0
LEAST_WINDOW_M: Final = 20.0  # shorter ways are lost in what a receiver wanders
WINDOWS: Final = 20
WAY_M: Final = 1000.0
WRONG_FACTOR: Final = 1.25  # no speedometer and no bend of a road explains more
ODD_FACTOR: Final = 1.07
EVEN_SPREAD: Final = 1.3  # ratio of the quartiles below which windows agree
UNITS_BY_FACTOR: Final = (
    (3.6, "metres a second"),
    (1.609344, "miles an hour"),
    (1.0 / 1.609344, "km/h declared as miles an hour"),
    (1.0 / 3.6, "km/h declared as metres a second"),
)
LIGHTEST_KG: Final = 250.0
HEAVIEST_KG: Final = 8000.0
SLOW_MPS: Final = 14.0  # a car that never reaches 50 km/h, and moves like a lorry, may be recorded in m/s
ENERGY_WAY_M: Final = 2000.0


def check_way(recording: Recording, path: str) -> None:
    """Raises RecordingError where the positions prove that the speed is in another unit than declared."""
    ratios, way_m = way_ratios(recording)
    if ratios.size < WINDOWS or way_m < WAY_M:
        return
    low, factor, high = np.quantile(ratios, (0.25, 0.5, 0.75)).tolist()
    if 1.0 / WRONG_FACTOR <= factor <= WRONG_FACTOR or high > EVEN_SPREAD * low:
        return
    unit = next((name for value, name in UNITS_BY_FACTOR if abs(factor / value - 1.0) < 0.12), "another unit")
    found = f"too {'low' if factor > 1.0 else 'high'}: by their positions the car drove {factor:.2f} times as fast"
    raise RecordingError(path, 2, "speed", found, f"speed in the unit that its column declares; this looks like {unit}")


def plausibility_notes(recording: Recording) -> Iterator[Note]:
    """Notes on a speed that the positions contradict, and on a mass or consumption that no car has."""
    yield from _way_notes(recording)
    yield from _mass_notes(recording)
    if recording.energy_j() < 0.0 and recording.distance_m() > ENERGY_WAY_M:
        text = f"{recording.energy_j() / JOULE_PER_KWH:.2f} kWh over {recording.distance_m() / 1000.0:.1f} km"
        yield Note(NoteKind.SUSPECT, "power_w", f"{text}: a long descent, or the sign is wrong")


def apparent_mass_kg(recording: Recording) -> float | None:
    """Mass that power tells where the car gains speed, slope of power over v·dv/dt [kg]; None for too little of it.

    Losses of the drive are in it (the BMW i3 files, of a car with 1.3 t, tell 1.7–2.4 t): it finds wrong units only.
    """
    step_s = max(1.0, float(np.median(np.diff(recording.time_s))))
    at_s = np.arange(recording.time_s[0], recording.time_s[-1], step_s)
    if at_s.size < 3:
        return None
    speed = np.interp(at_s, recording.time_s, recording.speed_mps)
    power = np.interp(at_s, recording.time_s, recording.power_w)
    push = speed * np.gradient(speed, step_s)
    gains = (push > 0.2 * PUSH_W_PER_KG) & ~np.append(recording.gap_steps(at_s), False)
    if np.count_nonzero(gains) < PUSH_SAMPLES:
        return None
    x, y = push[gains] - push[gains].mean(), power[gains] - power[gains].mean()
    return float(x @ y / (x @ x)) if float(x @ x) > 0.0 else None


def _way_notes(recording: Recording) -> Iterator[Note]:
    ratios, way_m = way_ratios(recording)
    if ratios.size < WINDOWS or way_m < WAY_M:
        return
    factor = float(np.median(ratios))
    text = f"by the positions {factor:.2f} times as fast, in {ratios.size} stretches of {WINDOW_S:g} s"
    even = 1.0 / ODD_FACTOR <= factor <= ODD_FACTOR
    yield Note(NoteKind.CHECKED if even else NoteKind.SUSPECT, "speed_mps", text)


def _mass_notes(recording: Recording) -> Iterator[Note]:
    mass_kg = apparent_mass_kg(recording)
    if mass_kg is None or recording.distance_m() < WAY_M:
        return
    wh_per_km = recording.energy_j() / recording.distance_m() / 3.6
    seen = f"power follows the gain of speed as that of {mass_kg:.3g} kg, at {wh_per_km:.3g} Wh/km"
    if 0.0 <= mass_kg < LIGHTEST_KG and wh_per_km < 60.0:
        yield Note(NoteKind.SUSPECT, "power_w", f"{seen}: power in kW, or speed in another unit?")
    elif mass_kg > HEAVIEST_KG and float(recording.speed_mps.max()) < SLOW_MPS:
        yield Note(NoteKind.SUSPECT, "speed_mps", f"{seen}: speed in metres a second, or time in another unit?")
    elif mass_kg > HEAVIEST_KG:
        yield Note(NoteKind.SUSPECT, "time_s", f"{seen}: time that runs too slow, or power in another unit?")
    elif 0.0 <= mass_kg < LIGHTEST_KG:
        yield Note(
            NoteKind.SUSPECT, "time_s", f"{seen}: time that runs too fast, or a power too smooth to tell a mass?"
        )


def way_ratios(recording: Recording) -> tuple[NDArray[np.float64], float]:
    """Straight way by the positions over way by the speed in windows, float64 (k,), and the sum of the former [m]."""
    latitude, longitude = recording.latitude_deg, recording.longitude_deg
    none = np.empty(0, np.float64), 0.0
    if latitude is None or longitude is None:
        return none
    known = ~(np.isnan(latitude) | np.isnan(longitude))
    if np.count_nonzero(known) < WINDOWS:
        return none
    time_s = recording.time_s[known]
    east, north = east_north_m(latitude[known], longitude[known])
    at_s = np.arange(time_s[0], time_s[-1], WINDOW_S)
    if at_s.size < WINDOWS:
        return none
    straight_m = np.hypot(np.diff(np.interp(at_s, time_s, east)), np.diff(np.interp(at_s, time_s, north)))
    step = 0.5 * (recording.speed_mps[1:] + recording.speed_mps[:-1]) * np.diff(recording.time_s)
    way_m = np.diff(np.interp(at_s, recording.time_s, np.concatenate(([0.0], np.cumsum(step)))))
    apart_s = np.diff(time_s)[np.clip(np.searchsorted(time_s, at_s, side="right") - 1, 0, time_s.size - 2)]
    heard = np.maximum(apart_s[:-1], apart_s[1:]) <= 0.5 * WINDOW_S
    good = heard & ~recording.gap_steps(at_s) & (way_m >= LEAST_WINDOW_M) & (straight_m > 0.0)
    return straight_m[good] / way_m[good], float(straight_m[good].sum())
