"""Checks of a recorded drive: what is missing, stuck, jumping or upside down; all is noted, the certain repaired."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Final

import numpy as np

from diagnosis.recordings.notes import Note, NoteKind, RecordingError
from diagnosis.recordings.recording import Detail, channels_of
from diagnosis.recordings.soundness.charging import charging_at_standstill, without_charging
from diagnosis.recordings.soundness.clock import check_pace, pace_notes
from diagnosis.recordings.soundness.heights import with_telling_height
from diagnosis.recordings.soundness.lag import without_lag
from diagnosis.recordings.soundness.placeholders import without_placeholders
from diagnosis.recordings.soundness.plausibility import check_way, plausibility_notes
from diagnosis.recordings.soundness.repairs import (
    JUMP_ELEVATION_M,
    JUMP_MPS2,
    is_frozen,
    repaired,
    same_runs,
    without_empty,
    without_impossible,
)
from diagnosis.recordings.soundness.sampling import line_notes, with_held_noted, without_held_positions
from diagnosis.recordings.soundness.signs import push_powers_w
from diagnosis.recordings.soundness.units import factor_notes, with_units
from energy.units import JOULE_PER_KWH

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from numpy.typing import NDArray

    from diagnosis.recordings.recording import Recording

GAP_STEPS: Final = 10.0  # a step so many times the median one is a gap, from GAP_S on
GAP_S: Final = 2.0
SURE_GAP_S: Final = 60.0  # and one of this length is in any case
HOUR_S: Final = 3600.0
JUMP_SOC_FRAC: Final = 0.05
DRIFT_M: Final = 3.0  # heights that change by more than that at standstill are late or drift
DISTINCT: Final = 20
WHOLE_TIMES: Final = 5.0
CHARGE_FRAC: Final = 0.05  # least fall of the charge that tells a capacity
MOST_S: Final = 1e6  # longer than any drive without charging
MOST_STEP_S: Final = 60.0
RANGE_MPS: Final = 10.0
SLOWEST_MPS2: Final = 0.1  # a drive of so much change of speed never has less
COARSE_S: Final = 5.0


def checked(recording: Recording, path: str) -> Recording:
    """The recording with notes on all that was found; what is certainly not the drive is taken out or repaired.

    Raises RecordingError where power has the wrong sign, the clock or the speed the wrong unit.
    """
    _check_clock(recording, path)
    recording = without_held_positions(without_placeholders(recording))
    if recording.is_one_number:
        if recording.detail is not Detail.PROFILE:
            check_pace(_with_gaps(recording), path)
        recording = with_units(_with_gaps(recording))
        check_way(recording, path)
        recording = with_telling_height(without_empty(recording))
        return _with_notes(recording, (_missing, _gaps, _whole_metres, _late_height, _coarse, factor_notes))
    recording = without_charging(recording, charging_at_standstill(recording), "while standing", path)
    recording = with_held_noted(repaired(recording))
    check_pace(_with_gaps(recording), path)
    _check_sign(recording, path)
    recording = with_units(_with_gaps(recording))
    check_way(recording, path)
    recording = with_telling_height(without_impossible(without_empty(without_lag(recording))))
    checks = (
        _missing,
        _gaps,
        _frozen,
        _jumps,
        _whole_metres,
        _late_height,
        _capacity,
        _twice,
        _coarse,
        plausibility_notes,
        pace_notes,
        line_notes,
        factor_notes,
    )
    return _with_notes(recording, checks)


def _with_notes(recording: Recording, checks: Sequence[Callable[[Recording], Iterator[Note]]]) -> Recording:
    return replace(recording, notes=(*recording.notes, *(note for check in checks for note in check(recording))))


def _check_clock(recording: Recording, path: str) -> None:
    step_s = float(np.median(np.diff(recording.time_s)))
    if step_s > MOST_STEP_S:
        found = f"{step_s:g} later a row, as a rule"
        allowed = "seconds, a row at least a minute; divide milliseconds by 1000"
        raise RecordingError(path, 2, "time", found, allowed)
    lasts_s = float(recording.time_s[-1] - recording.time_s[0])
    if lasts_s > MOST_S:
        raise RecordingError(path, 2, "time", f"{lasts_s:g} later at the end", f"seconds, at most {MOST_S:g} in all")
    fastest_mps2 = float((np.abs(np.diff(recording.speed_mps)) / np.diff(recording.time_s)).max())
    if fastest_mps2 < SLOWEST_MPS2 and np.ptp(recording.speed_mps) > RANGE_MPS:
        found = f"too slow: the speed changes by {np.ptp(recording.speed_mps):.0f} m/s, never faster than"
        allowed = "seconds; divide milliseconds by 1000"
        raise RecordingError(path, 2, "time", f"{found} {fastest_mps2:.2g} m/s²", allowed)


def _check_sign(recording: Recording, path: str) -> None:
    """Power is higher while the car gains speed than while it loses it, or its sign is wrong."""
    powers = push_powers_w(recording)
    if powers is not None and powers[0] < powers[1]:
        found = f"{powers[0]:.0f} W on average while accelerating and {powers[1]:.0f} W while braking"
        allowed = "positive for discharge, so higher while accelerating; turn the sign of power, or else of current"
        raise RecordingError(path, 2, "power", found, allowed)


def _with_gaps(recording: Recording) -> Recording:
    step_s = np.diff(recording.time_s)
    usual_s = float(np.median(step_s))
    long = step_s > max(GAP_S, min(GAP_STEPS * usual_s, max(SURE_GAP_S, 3.0 * usual_s)))
    found = zip(recording.time_s[:-1][long].tolist(), recording.time_s[1:][long].tolist(), strict=True)
    return replace(recording, gaps=tuple(sorted({*recording.gaps, *found})))


def _missing(recording: Recording) -> Iterator[Note]:
    for name, values in channels_of(recording).items():
        missing = np.isnan(values)
        count = int(np.count_nonzero(missing))
        if count == 0:
            continue
        last = int(np.flatnonzero(~missing)[-1])
        first = int(np.argmin(missing))
        where = ""
        if last + 1 < values.size:
            where = f", among them all after {recording.time_s[last]:.1f} s"
        elif first > 0:
            where = f", among them all before {recording.time_s[first]:.1f} s"
        yield Note(NoteKind.MISSING, name, f"{count} of {values.size} samples missing{where}")


def _gaps(recording: Recording) -> Iterator[Note]:
    if not recording.gaps:
        return
    begin, end = max(recording.gaps, key=lambda gap: gap[1] - gap[0])
    text = (
        f"gaps: {len(recording.gaps)}, the longest {end - begin:.1f} s after {begin:.1f} s; their energy is not counted"
    )
    if abs(end - begin - HOUR_S) < SURE_GAP_S:
        text += "; an hour may be a clock that was put forward"
    yield Note(NoteKind.GAP, "time_s", text)


def _frozen(recording: Recording) -> Iterator[Note]:
    for first, last in same_runs(recording):
        if is_frozen(recording, first, last):
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


def _whole_metres(recording: Recording) -> Iterator[Note]:
    height = recording.elevation_m
    if height is None:
        return
    lowest, highest = float(np.nanmin(height)), float(np.nanmax(height))
    if highest - lowest >= DRIFT_M and _in_whole_metres(height[~np.isnan(height)]):
        text = "in whole metres: a grade is known over some 200 m of way only, over which replays smooth it"
        yield Note(NoteKind.SUSPECT, "elevation_m", text)


def _in_whole_metres(height_m: NDArray[np.float64]) -> bool:
    """Whether heights are whole metres, or straight lines between such: whole ones are by far the most frequent."""
    hundredths, counts = np.unique(np.round(100.0 * height_m) % 100.0, return_counts=True)
    whole = int(counts[hundredths == 0.0].sum())
    others = counts[hundredths != 0.0]
    return whole == height_m.size or (others.size >= DISTINCT and whole > WHOLE_TIMES * float(np.median(others)))


def _late_height(recording: Recording) -> Iterator[Note]:
    """Heights that go on changing while the car stands: the sensor is late, or drifts."""
    height = recording.elevation_m
    if height is None:
        return
    stands = (
        (recording.speed_mps[:-1] == 0.0) & (recording.speed_mps[1:] == 0.0) & ~recording.gap_steps(recording.time_s)
    )
    change = np.abs(np.diff(height))
    change = np.where(stands & ~np.isnan(change), change, 0.0)
    total_m = float(change.sum())
    if total_m <= DRIFT_M:
        return
    moving_s = np.maximum.accumulate(np.where(stands, recording.time_s[0], recording.time_s[1:]))
    since_s = float((change * (recording.time_s[1:] - moving_s)).sum()) / total_m
    climbs_m = float(np.nansum(np.abs(np.diff(height))))
    text = f"changes by {total_m:.0f} of {climbs_m:.0f} m while standing, on average {since_s:.0f} s after stopping"
    yield Note(NoteKind.LAG, "elevation_m", f"{text}: late, or drifting")


def _capacity(recording: Recording) -> Iterator[Note]:
    """The charge that power and SoC together tell, which shows a wrong unit of either."""
    if recording.soc_frac is None or recording.gaps:
        return
    known = np.flatnonzero(~np.isnan(recording.soc_frac))
    first, last = int(known[0]), int(known[-1])
    fall = float(recording.soc_frac[first] - recording.soc_frac[last])
    if fall >= CHARGE_FRAC:
        part = slice(first, last + 1)
        energy_j = float(np.trapezoid(recording.power_w[part], recording.time_s[part]))
        text = f"falls by {fall:.1%} while the battery gives {energy_j / JOULE_PER_KWH:.2f} kWh"
        yield Note(NoteKind.CHECKED, "soc_frac", f"{text}: 100 % would be {energy_j / JOULE_PER_KWH / fall:.1f} kWh")


def _twice(recording: Recording) -> Iterator[Note]:
    """Power recorded twice, by itself and as voltage times current, and not the same."""
    if recording.voltage_v is None or recording.current_a is None:
        return
    product = recording.voltage_v * recording.current_a
    apart = np.abs(product - recording.power_w)
    apart = apart[~np.isnan(apart)]
    usual_w = float(np.median(np.abs(recording.power_w)))
    if apart.size and float(np.median(apart)) > max(100.0, 0.05 * usual_w):
        other_way = float(np.nansum(product * recording.power_w)) < 0.0
        text = f"differs from voltage times current by {np.median(apart):.0f} W as a rule, of {usual_w:.0f} W"
        yield Note(
            NoteKind.SUSPECT, "power_w", text + (", whose sign is the other" if other_way else "") + "; power counts"
        )


def _coarse(recording: Recording) -> Iterator[Note]:
    step_s = float(np.median(np.diff(recording.time_s)))
    if step_s > COARSE_S:
        text = f"{step_s:g} s apart as a rule: accelerations between samples are not seen, and their power is"
        yield Note(NoteKind.SUSPECT, "time_s", text)
