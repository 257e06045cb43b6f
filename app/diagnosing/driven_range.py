"""The fastest and the steepest that recorded drives had, which requests with what was learned are held against."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from app.conversions.way_limits import OVER_M, held
from diagnosis.causes.driven import rougher_grade
from diagnosis.recordings.recording import Detail
from energy.errors import EnergyError
from energy.units import KMH_PER_MPS

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from diagnosis.recordings.recording import Recording

HELD_S: Final = 10.0  # in sum over all drives, so that a spike of a sensor does not count


def fastest_kmh(recordings: Sequence[Recording]) -> float | None:
    """The fastest speed that some drives held for HELD_S in sum [km/h]; None where only sums of them are known."""
    speed, duration_s = [np.zeros(0)], [np.zeros(0)]
    for recording in recordings:
        if recording.detail is not Detail.TOTALS:
            speed.append(0.5 * (recording.speed_mps[:-1] + recording.speed_mps[1:]))
            duration_s.append(np.where(recording.gap_steps(recording.time_s), 0.0, np.diff(recording.time_s)))
    fastest = _held(speed, duration_s, HELD_S)
    return None if fastest is None else KMH_PER_MPS * fastest


def steepest(recordings: Sequence[Recording]) -> tuple[float, float] | None:
    """The steepest descent and climb that OVER_M in sum of some drives had, rise over length; None without heights."""
    grade, way_m = [np.zeros(0)], [np.zeros(0)]
    for recording in recordings:
        known = recording.elevation_m is not None and not bool(np.isnan(recording.elevation_m).all())
        if not known or recording.detail is Detail.TOTALS:
            continue
        try:
            profile = rougher_grade(recording, OVER_M)
        except EnergyError:  # heights that jump say nothing of grades
            continue
        assert profile.grade_frac is not None, "it has heights"
        grade.append(profile.grade_frac)
        way_m.append(np.where(recording.gap_steps(profile.time_s), 0.0, profile.step_m()))
    high = _held(grade, way_m, OVER_M)
    low = _held([-values for values in grade], way_m, OVER_M)
    return None if low is None or high is None else (-low, high)


def _held(values: list[NDArray[np.float64]], weights: list[NDArray[np.float64]], least: float) -> float | None:
    """The highest value that is held for `least` in sum, half of all where that is little; None of none."""
    joined, weighed = np.concatenate(values), np.concatenate(weights)
    whole = float(weighed.sum())
    return held(joined, weighed, min(least, 0.5 * whole)) if whole > 0.0 else None
