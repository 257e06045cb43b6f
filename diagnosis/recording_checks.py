"""Checks of a recorded drive: what is missing, stuck, jumping or upside down; all is noted, the certain repaired."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from enum import StrEnum
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from diagnosis.errors import DiagnosisError

if TYPE_CHECKING:
    from collections.abc import Iterator

    from numpy.typing import NDArray

    from diagnosis.recordings import Recording

REQUIRED: Final = ("time_s", "speed_mps", "power_w")
GAP_STEPS: Final = 10.0  # a step so many times the median one is a gap, from GAP_S on
GAP_S: Final = 2.0
FROZEN_S: Final = 30.0  # speed and power, to the last digit, don't stay the same for so long and so many samples
FROZEN_SAMPLES: Final = 100
JUMP_MPS2: Final = 10.0  # more than tyres hold on a dry road
JUMP_ELEVATION_M: Final = 10.0  # from one sample to the next
JUMP_SOC_FRAC: Final = 0.05
FLAT_M: Final = 5000.0  # way over which a height that never changes is worth a note
BEYOND_BATTERY_W: Final = 300.0  # a consumer draws more than the battery gives, beyond what delays explain
STANDING_S: Final = 10.0
PUSH_W_PER_KG: Final = 5.0  # v·a from which a car certainly accelerates, and below the negative of which it brakes
PUSH_SAMPLES: Final = 30
CHARGE_FRAC: Final = 0.05  # least fall of the charge that tells a capacity
MOST_S: Final = 1e6  # longer than any drive without charging
J_PER_KWH: Final = 3.6e6


class NoteKind(StrEnum):
    """What a note is about."""

    GAP = "gap"
    FROZEN = "frozen"
    JUMP = "jump"
    MISSING = "missing"
    STUCK = "stuck"
    REPAIRED = "repaired"
    IGNORED = "ignored"
    CHECKED = "checked"


@dataclass(frozen=True, slots=True)
class Note:
    """One thing that was found in a recording; channel: a field of Recording, or "" for all of it."""

    kind: NoteKind
    channel: str
    text: str


class RecordingError(DiagnosisError):
    """A recording that can't be read: names file, row (1 is the header), column, value and what is allowed."""

    def __init__(self, path: str, row: int, column: str, value: str, allowed: str) -> None:
        self.path = path
        self.row = row
        self.column = column
        self.value = value
        self.allowed = allowed
        super().__init__(f"{path}, row {row}: {column} is {value}, allowed: {allowed}")


def checked(recording: Recording, path: str) -> Recording:
    """The recording with notes on all that was found; a frozen end, empty and impossible channels are taken out.

    Raises RecordingError where power has the wrong sign or the clock the wrong unit.
    """
    recording = _without_frozen_end(recording)
    recording = _without_empty(recording)
    _check_clock(recording, path)
    _check_sign(recording, path)
    recording = _without_impossible(recording)
    notes = [note for check in (_gaps, _frozen, _jumps, _flat, _capacity) for note in check(recording)]
    return replace(recording, notes=(*recording.notes, *notes))


def _channels(recording: Recording) -> dict[str, NDArray[np.float64]]:
    found = {field.name: getattr(recording, field.name) for field in fields(recording)}
    return {name: values for name, values in found.items() if isinstance(values, np.ndarray)}


def _noted(recording: Recording, kind: NoteKind, channel: str, text: str) -> Recording:
    return replace(recording, notes=(*recording.notes, Note(kind, channel, text)))


def _without(recording: Recording, channel: str) -> Recording:
    absent: dict[str, Any] = {channel: None}
    return replace(recording, **absent)


def _same_runs(recording: Recording) -> Iterator[tuple[int, int]]:
    """First and last sample of each run in which neither speed nor power changes."""
    changes = (np.diff(recording.speed_mps) != 0.0) | (np.diff(recording.power_w) != 0.0)
    edges = np.concatenate(([0], np.flatnonzero(changes) + 1, [recording.time_s.size]))
    for begin, end in zip(edges[:-1].tolist(), edges[1:].tolist(), strict=True):
        yield begin, end - 1


def _is_frozen(recording: Recording, first: int, last: int) -> bool:
    """Whether a run of the same speed and power is more than a parked car, and less than the whole recording."""
    lasts = float(recording.time_s[last] - recording.time_s[first])
    alive = recording.speed_mps[last] != 0.0 or recording.power_w[last] != 0.0
    return first > 0 and alive and lasts >= FROZEN_S and last - first >= FROZEN_SAMPLES


def _without_frozen_end(recording: Recording) -> Recording:
    first, last = max(_same_runs(recording), key=lambda run: run[1])
    if not _is_frozen(recording, first, last):
        return recording
    time = recording.time_s
    text = (
        f"cut off at {time[first]:.1f} s: speed ({recording.speed_mps[last] * 3.6:.2f} km/h) and power"
        f" ({recording.power_w[last]:.0f} W) stay the same to the last digit for the {time[last] - time[first]:.1f} s"
        " up to the end"
    )
    kept: dict[str, Any] = {name: values[: first + 1] for name, values in _channels(recording).items()}
    return _noted(replace(recording, **kept), NoteKind.REPAIRED, "", text)


def _without_empty(recording: Recording) -> Recording:
    for name, values in _channels(recording).items():
        missing = np.isnan(values)
        count = int(np.count_nonzero(missing))
        if count == 0 or name in REQUIRED:
            continue
        if count == values.size:
            recording = _noted(_without(recording, name), NoteKind.MISSING, name, "no value at all")
            continue
        last = int(np.flatnonzero(~missing)[-1])
        first = int(np.argmin(missing))
        where = ""
        if last + 1 < values.size:
            where = f", among them all after {recording.time_s[last]:.1f} s"
        elif first > 0:
            where = f", among them all before {recording.time_s[first]:.1f} s"
        text = f"{count} of {values.size} samples missing{where}"
        recording = _noted(recording, NoteKind.MISSING, name, text)
    return recording


def _check_clock(recording: Recording, path: str) -> None:
    step_s = float(np.median(np.diff(recording.time_s)))
    if step_s > 60.0:
        raise RecordingError(path, 2, "time", f"{step_s:g} later a row, as a rule", "seconds, a row at least a minute")
    lasts_s = float(recording.time_s[-1] - recording.time_s[0])
    if lasts_s > MOST_S:
        raise RecordingError(path, 2, "time", f"{lasts_s:g} later at the end", f"seconds, at most {MOST_S:g} in all")


def _check_sign(recording: Recording, path: str) -> None:
    """Power is higher while the car gains speed than while it loses it, or its sign is wrong."""
    push = recording.speed_mps * np.gradient(recording.speed_mps, recording.time_s)
    gains, loses = push > PUSH_W_PER_KG, push < -PUSH_W_PER_KG
    if min(np.count_nonzero(gains), np.count_nonzero(loses)) < PUSH_SAMPLES:
        return
    gain_w, lose_w = float(recording.power_w[gains].mean()), float(recording.power_w[loses].mean())
    if gain_w < lose_w:
        found = f"{gain_w:.0f} W on average while accelerating and {lose_w:.0f} W while braking"
        raise RecordingError(path, 2, "power", found, "positive for discharge, so higher while accelerating")


def _without_impossible(recording: Recording) -> Recording:
    """Take out a consumer that draws more than the whole battery gives while the car stands."""
    step_s = np.diff(recording.time_s, append=recording.time_s[-1])
    standing = recording.speed_mps == 0.0
    stands_s = float(step_s[standing].sum())
    for name in ("heater_w", "aircon_w"):
        draw = getattr(recording, name)
        if draw is None or stands_s < STANDING_S:
            continue
        beyond_s = float(step_s[standing & (draw > recording.power_w + BEYOND_BATTERY_W)].sum())
        if beyond_s > 0.5 * stands_s:
            text = (
                f"taken out: at standstill above the battery's whole power for {beyond_s:.0f} of {stands_s:.0f} s, on"
                f" average {np.nanmean(draw[standing]):.0f} W of {recording.power_w[standing].mean():.0f} W"
            )
            recording = _noted(_without(recording, name), NoteKind.STUCK, name, text)
    return recording


def _gaps(recording: Recording) -> Iterator[Note]:
    step_s = np.diff(recording.time_s)
    long = step_s > max(GAP_S, GAP_STEPS * float(np.median(step_s)))
    if long.any():
        at = int(np.argmax(step_s))
        text = f"gaps: {np.count_nonzero(long)}, the longest {step_s[at]:.1f} s after {recording.time_s[at]:.1f} s"
        yield Note(NoteKind.GAP, "time_s", text)


def _frozen(recording: Recording) -> Iterator[Note]:
    for first, last in _same_runs(recording):
        if _is_frozen(recording, first, last):
            begin, end = recording.time_s[first], recording.time_s[last]
            yield Note(NoteKind.FROZEN, "", f"speed and power stay the same from {begin:.1f} s to {end:.1f} s")


def _jumps(recording: Recording) -> Iterator[Note]:
    step_s = np.diff(recording.time_s)
    for name, values, limit, unit in (
        ("speed_mps", recording.speed_mps, JUMP_MPS2 * step_s, "m/s"),
        ("elevation_m", recording.elevation_m, np.full(step_s.size, JUMP_ELEVATION_M), "m"),
        ("soc_frac", recording.soc_frac, np.full(step_s.size, JUMP_SOC_FRAC), "of the charge"),
    ):
        if values is None:
            continue
        rise = np.abs(np.diff(values))
        jumps = rise > np.where(step_s > GAP_S, np.inf, limit)
        if jumps.any():
            at = int(np.argmax(np.where(jumps, rise, 0.0)))
            text = (
                f"jumps: {np.count_nonzero(jumps)}, the largest {rise[at]:.2f} {unit} at {recording.time_s[at]:.1f} s"
            )
            yield Note(NoteKind.JUMP, name, text)


def _flat(recording: Recording) -> Iterator[Note]:
    height = recording.elevation_m
    if height is not None and recording.distance_m() > FLAT_M and np.nanmin(height) == np.nanmax(height):
        way_km = recording.distance_m() / 1000.0
        text = f"always {np.nanmin(height):g} m over {way_km:.1f} km: a flat road or a stuck sensor"
        yield Note(NoteKind.STUCK, "elevation_m", text)


def _capacity(recording: Recording) -> Iterator[Note]:
    """The charge that power and SoC together tell, which shows a wrong unit of either."""
    if recording.soc_frac is None:
        return
    known = np.flatnonzero(~np.isnan(recording.soc_frac))
    first, last = int(known[0]), int(known[-1])
    fall = float(recording.soc_frac[first] - recording.soc_frac[last])
    if fall >= CHARGE_FRAC:
        part = slice(first, last + 1)
        energy_j = float(np.trapezoid(recording.power_w[part], recording.time_s[part]))
        text = f"falls by {fall:.1%} while the battery gives {energy_j / J_PER_KWH:.2f} kWh"
        yield Note(NoteKind.CHECKED, "soc_frac", f"{text}: 100 % would be {energy_j / J_PER_KWH / fall:.1f} kWh")
