"""Repairs of a recording: what is certainly not the drive is taken out, and each repair is noted."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from diagnosis.recordings.notes import Note, NoteKind
from diagnosis.recordings.recording import REQUIRED, Recording, channels_of

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from numpy.typing import NDArray

FROZEN_S: Final = 30.0  # speed and power, to the last digit, don't stay the same for so long and so many samples
FROZEN_SAMPLES: Final = 100
CONSUMERS: Final = ("heater_w", "aircon_w", "hvac_w")
CLIMATE: Final = ("heater_w", "aircon_w")  # which may both be on
BEYOND_BATTERY_W: Final = 300.0  # a consumer draws more than the battery gives, beyond what delays explain
STANDING_S: Final = 10.0
JUMP_MPS2: Final = 10.0  # more than tyres hold on a dry road
JUMP_ELEVATION_M: Final = 10.0  # from one sample to the next
SPIKE_SAMPLES: Final = 3
SPIKE_S: Final = 5.0
STOPPED_MPS: Final = 0.5


def repaired(recording: Recording) -> Recording:
    """The recording without a frozen end, empty channels, and dropouts of speed or spikes of height."""
    return _without_height_spikes(_without_dropouts(without_empty(_without_frozen_end(recording))))


def same_runs(recording: Recording) -> Iterator[tuple[int, int]]:
    """First and last sample of each run in which neither speed nor power changes."""
    changes = (np.diff(recording.speed_mps) != 0.0) | (np.diff(recording.power_w) != 0.0)
    edges = np.concatenate(([0], np.flatnonzero(changes) + 1, [recording.time_s.size]))
    for begin, end in zip(edges[:-1].tolist(), edges[1:].tolist(), strict=True):
        yield begin, end - 1


def is_frozen(recording: Recording, first: int, last: int) -> bool:
    """Whether a run of the same speed and power is more than a parked car, and less than the whole recording."""
    lasts = float(recording.time_s[last] - recording.time_s[first])
    alive = recording.speed_mps[last] != 0.0 or recording.power_w[last] != 0.0
    return first > 0 and alive and lasts >= FROZEN_S and last - first >= FROZEN_SAMPLES


def without_impossible(recording: Recording) -> Recording:
    """Take out consumers that draw more than the whole battery gives while the car stands, one or all together."""
    for names in (*((name,) for name in CONSUMERS), CLIMATE):
        known = [name for name in names if getattr(recording, name) is not None]
        text = _beyond_battery(recording, known)
        if text is not None:
            for name in known:
                recording = noted(_without(recording, name), NoteKind.STUCK, name, text)
    return recording


def _beyond_battery(recording: Recording, names: Sequence[str]) -> str | None:
    """How consumers draw more than the battery gives for most of the standstill; None where they do not."""
    step_s = np.diff(recording.time_s, append=recording.time_s[-1])
    standing = recording.speed_mps == 0.0
    stands_s = float(step_s[standing].sum())
    if not names or stands_s < STANDING_S:
        return None
    draw = np.sum([np.nan_to_num(getattr(recording, name)) for name in names], axis=0)
    beyond_s = float(step_s[standing & (draw > recording.power_w + BEYOND_BATTERY_W)].sum())
    if beyond_s <= 0.5 * stands_s:
        return None
    gives_w = float(recording.power_w[standing].mean())
    return (
        f"taken out: {'together ' if len(names) > 1 else ''}at standstill above the battery's whole power for"
        f" {beyond_s:.0f} of {stands_s:.0f} s, on average {draw[standing].mean():.0f} W of {gives_w:.0f} W"
    )


def without_empty(recording: Recording) -> Recording:
    """Take out channels without any value."""
    for name, values in channels_of(recording).items():
        if name not in REQUIRED and bool(np.isnan(values).all()):
            recording = noted(_without(recording, name), NoteKind.MISSING, name, "no value at all")
    return recording


def noted(recording: Recording, kind: NoteKind, channel: str, text: str) -> Recording:
    """The recording with one more note."""
    return replace(recording, notes=(*recording.notes, Note(kind, channel, text)))


def _without(recording: Recording, channel: str) -> Recording:
    absent: dict[str, Any] = {channel: None}
    return replace(recording, **absent)


def _without_frozen_end(recording: Recording) -> Recording:
    first, last = max(same_runs(recording), key=lambda run: run[1])
    if not is_frozen(recording, first, last):
        return recording
    time = recording.time_s
    text = (
        f"cut off at {time[first]:.1f} s: speed ({recording.speed_mps[last] * 3.6:.2f} km/h) and power"
        f" ({recording.power_w[last]:.0f} W) stay the same to the last digit for the {time[last] - time[first]:.1f} s"
        " up to the end"
    )
    kept: dict[str, Any] = {name: values[: first + 1] for name, values in channels_of(recording).items()}
    return noted(replace(recording, **kept), NoteKind.REPAIRED, "", text)


def _without_dropouts(recording: Recording) -> Recording:
    """Speeds of 0 for a few samples, faster down and up again than any brake, replaced by a straight line."""
    time_s, speed = recording.time_s, recording.speed_mps
    most = JUMP_MPS2 * np.diff(time_s)
    bad = np.zeros(speed.size, np.bool_)
    for first, behind in _spikes(time_s):
        falls = speed[first - 1] - speed[first] > most[first - 1]
        rises = speed[behind] - speed[behind - 1] > most[behind - 1]
        for k in np.flatnonzero(falls & rises).tolist():
            run = slice(int(first[k]), int(behind[k]))
            if float(speed[run].max()) <= STOPPED_MPS:
                bad[run] = True
    if not bad.any():
        return recording
    at = int(np.argmax(bad))
    text = f"dropouts to 0 bridged: {np.count_nonzero(bad)} samples, the first at {time_s[at]:.1f} s"
    speed = np.interp(time_s, time_s[~bad], speed[~bad])
    return noted(replace(recording, speed_mps=speed), NoteKind.REPAIRED, "speed_mps", text)


def _without_height_spikes(recording: Recording) -> Recording:
    """Heights that leave those on both sides for a few samples and come back, taken out."""
    height, time_s = recording.elevation_m, recording.time_s
    if height is None:
        return recording
    bad = np.zeros(height.size, np.bool_)
    for first, behind in _spikes(time_s):
        before, after = height[first - 1], height[behind]
        near = np.abs(after - before) <= 0.5 * JUMP_ELEVATION_M
        for k in np.flatnonzero(near & (np.abs(height[first] - before) > JUMP_ELEVATION_M)).tolist():
            run = slice(int(first[k]), int(behind[k]))
            if float(np.abs(height[run] - before[k]).min()) > JUMP_ELEVATION_M:
                bad[run] = True
    if not bad.any():
        return recording
    at = int(np.argmax(bad))
    text = f"spikes taken out: {np.count_nonzero(bad)} samples, the first {height[at]:g} m at {time_s[at]:.1f} s"
    return noted(replace(recording, elevation_m=np.where(bad, np.nan, height)), NoteKind.REPAIRED, "elevation_m", text)


def _spikes(time_s: NDArray[np.float64]) -> Iterator[tuple[NDArray[np.intp], NDArray[np.intp]]]:
    """Runs of 1 to SPIKE_SAMPLES samples, first and behind the last, with one on each side within SPIKE_S."""
    for length in range(1, SPIKE_SAMPLES + 1):
        first = np.arange(1, time_s.size - length)
        first = first[time_s[first + length] - time_s[first - 1] <= SPIKE_S]
        yield first, first + length
