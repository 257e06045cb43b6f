"""Charging within a recording, which is no part of the drive."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from diagnosis.recordings.notes import Note, NoteKind, RecordingError
from diagnosis.recordings.recording import Recording, channels_of
from energy.units import JOULE_PER_KWH

if TYPE_CHECKING:
    from numpy.typing import NDArray

CHARGING_W: Final = -500.0  # a battery at standstill is given so much by a charger only
CHARGING_S: Final = 30.0


def charging_at_standstill(recording: Recording) -> NDArray[np.bool_]:
    """Samples at which the battery is charged while the car stands, CHARGING_S at least without a break, bool (n,)."""
    charged: NDArray[np.bool_] = (recording.speed_mps == 0.0) & (recording.power_w < CHARGING_W)
    for begin, end in _runs(charged):
        if recording.time_s[end - 1] - recording.time_s[begin] < CHARGING_S:
            charged[begin:end] = False
    return charged


def without_charging(recording: Recording, charging: NDArray[np.bool_], how: str, path: str) -> Recording:
    """The recording without the samples marked, a gap in their place, and with a note on each stretch.

    how: what the mark is, for the notes. Raises RecordingError where fewer than two samples are left.
    """
    if not charging.any():
        return recording
    keep = ~charging
    if np.count_nonzero(keep) < 2:
        raise RecordingError(path, 1, "the recording", f"charging only ({how})", "a drive")
    time_s, notes, gaps = recording.time_s, [], list(recording.gaps)
    for begin, end in _runs(charging):
        last = end - 1
        part = slice(begin, end)
        kwh = -float(np.trapezoid(recording.power_w[part], time_s[part])) / JOULE_PER_KWH
        text = f"charging cut out from {time_s[begin]:.1f} s to {time_s[last]:.1f} s, {kwh:.2f} kWh, {how}"
        notes.append(Note(NoteKind.REPAIRED, "", text))
        if begin > 0 and end < time_s.size:
            gaps.append((float(time_s[begin - 1]), float(time_s[end])))
    kept: dict[str, Any] = {name: values[keep] for name, values in channels_of(recording).items()}
    return replace(recording, **kept, notes=(*recording.notes, *notes), gaps=tuple(sorted(gaps)))


def _runs(marked: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """Begin and end (behind the last) of each run of marked samples."""
    edges = np.flatnonzero(np.diff(np.concatenate(([0], marked.astype(np.int8), [0]))))
    return list(zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True))
