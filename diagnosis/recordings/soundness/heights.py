"""Heights that tell no grade, which count as none: never changing, or known on a small part of the way."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Final

import numpy as np

from diagnosis.recordings.notes import NoteKind
from diagnosis.recordings.soundness.repairs import noted

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from diagnosis.recordings.recording import Recording

FLAT_M: Final = 1000.0  # way from which on a height that never changes is that of a stuck sensor, or tells no grade
BRIDGED_M: Final = 1000.0  # way between two known heights up to which a straight line stands for what is between
LEAST_KNOWN_FRAC: Final = 0.5  # of the way


def with_telling_height(recording: Recording) -> Recording:
    """The recording, its height taken out where it never changes or is known on less than half of the way."""
    height = recording.elevation_m
    if height is None:
        return recording
    known = ~np.isnan(height)
    way_km = recording.distance_m() / 1000.0
    lowest, highest = float(height[known].min()), float(height[known].max())
    if lowest == highest and 1000.0 * way_km > FLAT_M:
        text = f"taken out: always {lowest:g} m over {way_km:.1f} km: a flat road or a stuck sensor"
        return noted(replace(recording, elevation_m=None), NoteKind.STUCK, "elevation_m", text)
    known_frac = _known_frac(recording, known)
    if known_frac < LEAST_KNOWN_FRAC:
        text = f"taken out: known on {known_frac:.0%} of {way_km:.1f} km only"
        return noted(replace(recording, elevation_m=None), NoteKind.MISSING, "elevation_m", text)
    return recording


def _known_frac(recording: Recording, known: NDArray[np.bool_]) -> float:
    """Share of the way that lies between known heights near each other; samples that follow each other always are."""
    speed, time_s = recording.speed_mps, recording.time_s
    step_m = 0.5 * (speed[1:] + speed[:-1]) * np.diff(time_s)
    way_m = np.concatenate(([0.0], np.cumsum(np.where(recording.gap_steps(time_s), 0.0, step_m))))
    if way_m[-1] <= 0.0:
        return 1.0
    at = np.flatnonzero(known)
    span_m = np.diff(way_m[at])
    return float(span_m[(span_m <= BRIDGED_M) | (np.diff(at) == 1)].sum() / way_m[-1])
