"""Channels whose true samples are rarer than their rows: positions held, values drawn as straight lines between."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Final

import numpy as np

from diagnosis.recordings.notes import Note, NoteKind
from diagnosis.recordings.recording import channels_of
from diagnosis.recordings.soundness.repairs import noted

if TYPE_CHECKING:
    from collections.abc import Iterator

    from numpy.typing import NDArray

    from diagnosis.recordings.recording import Recording

MOVED_M: Final = 5.0  # by the speed since the last sample, from which on the same position is an old one
HELD_FRAC: Final = 0.5  # of the samples while moving, from which on positions are refreshed more rarely than rows
LINES: Final = ("speed_mps", "power_w", "elevation_m", "voltage_v", "current_a")
HELD: Final = ("speed_mps", "power_w", "current_a")
HELD_STEPS: Final = 5.0  # of the channel's resolution, in the usual change: a coarse channel holds its values, too
LEAST_SAMPLES: Final = 60
LEAST_KNOTS: Final = 8
LINE_FRAC: Final = 0.7  # of the samples that change, which go on as straight as before
STRAIGHT_FRAC: Final = 0.002  # of a change, up to which the next one is the same
CLEAR_STEPS: Final = 20.0  # of the channel's resolution, that a change must have to be looked at
LEAST_RUN: Final = 4.0  # samples a line, in the mean


def without_held_positions(recording: Recording) -> Recording:
    """The recording with positions only where they were refreshed, if they stay for most samples while the car drives.

    A held position is that of an earlier moment: read as new, the car jumps between places at which it stands.
    """
    latitude, longitude = recording.latitude_deg, recording.longitude_deg
    if latitude is None or longitude is None:
        return recording
    known = np.flatnonzero(~(np.isnan(latitude) | np.isnan(longitude)))
    if known.size < LEAST_SAMPLES:
        return recording
    same = (np.diff(latitude[known]) == 0.0) & (np.diff(longitude[known]) == 0.0)
    step_m = 0.5 * (recording.speed_mps[1:] + recording.speed_mps[:-1]) * np.diff(recording.time_s)
    way_m = np.concatenate(([0.0], np.cumsum(step_m)))[known]
    refreshed = np.maximum.accumulate(np.where(np.append(True, ~same), np.arange(known.size), 0))
    old = way_m - way_m[refreshed] > MOVED_M
    moving = np.append(False, np.diff(way_m) > 0.0)
    if np.count_nonzero(old) <= HELD_FRAC * np.count_nonzero(moving):
        return recording
    bad = np.zeros(latitude.size, np.bool_)
    bad[known[old]] = True
    fresh_s = np.diff(recording.time_s[known[np.unique(refreshed[moving])]])
    every = f", each {float(np.median(fresh_s)):.3g} s as a rule" if fresh_s.size else ""
    text = f"positions are refreshed more rarely than rows{every}: {np.count_nonzero(bad)} old ones taken out"
    fresh = replace(
        recording, latitude_deg=np.where(bad, np.nan, latitude), longitude_deg=np.where(bad, np.nan, longitude)
    )
    return noted(fresh, NoteKind.REPAIRED, "latitude_deg", text)


def line_notes(recording: Recording) -> Iterator[Note]:
    """Notes on channels that are straight lines between rare samples."""
    channels = channels_of(recording)
    for name in LINES:
        values = channels.get(name)
        apart_s = None if values is None else line_length_s(recording.time_s, values)
        if apart_s is not None:
            text = (
                f"straight lines between samples {apart_s:.3g} s apart as a rule: interpolated, what was between them"
                " is not known"
            )
            yield Note(NoteKind.SUSPECT, name, text)


def with_held_noted(recording: Recording) -> Recording:
    """The recording with notes on channels that are held from one sample to the next, before a lag moves them."""
    for name in HELD:
        values = channels_of(recording).get(name)
        apart_s = None if values is None else held_length_s(recording.time_s, values)
        if apart_s is not None:
            text = f"held for {apart_s:.3g} s from one sample to the next as a rule: what was between is not known"
            recording = noted(recording, NoteKind.SUSPECT, name, text)
    return recording


def held_length_s(time_s: NDArray[np.float64], values: NDArray[np.float64]) -> float | None:
    """Usual time for which a channel is held between its true samples [s]; None where it is not.

    time_s, values: float64 (n,), NaN where not known. Held is what changes by many steps of its resolution at once, and
    then not for LEAST_RUN samples and more as a rule.
    """
    known = ~np.isnan(values)
    if np.count_nonzero(known) < LEAST_SAMPLES:
        return None
    at_s, found = time_s[known], values[known]
    change = np.abs(np.diff(found))
    changes = np.flatnonzero(change > 0.0)
    if changes.size < LEAST_KNOTS:
        return None
    resolution = float(np.diff(np.unique(found)).min())
    run = np.diff(changes)
    if float(np.median(run)) < LEAST_RUN or float(np.median(change[changes])) < HELD_STEPS * resolution:
        return None
    return float(np.median(np.diff(at_s[changes + 1])))


def line_length_s(time_s: NDArray[np.float64], values: NDArray[np.float64]) -> float | None:
    """Usual time between the true samples of a channel that is linear between them [s]; None where it is not.

    time_s, values: float64 (n,), NaN where not known. Looked at are changes that are large beside the channel's
    resolution: of these nearly all go on to the last digits, and a few bend.
    """
    known = ~np.isnan(values)
    if np.count_nonzero(known) < LEAST_SAMPLES:
        return None
    at_s, found = time_s[known], values[known]
    slope = np.diff(found) / np.diff(at_s)
    levels = np.unique(found)
    resolution = float(np.diff(levels).min(initial=np.inf)) if levels.size > 1 else np.inf
    step_s = np.diff(at_s)
    clear = np.abs(np.diff(found)) >= CLEAR_STEPS * resolution
    clear = clear[1:] & clear[:-1]
    if np.count_nonzero(clear) < LEAST_SAMPLES // 2:
        return None
    tolerance = np.maximum(
        STRAIGHT_FRAC * np.abs(slope[:-1]), 1.01 * resolution * (1.0 / step_s[1:] + 1.0 / step_s[:-1])
    )
    bends = np.abs(np.diff(slope)) > tolerance
    straight = np.count_nonzero(~bends[clear]) / np.count_nonzero(clear)
    knots = np.flatnonzero(bends) + 1
    if (
        straight < LINE_FRAC
        or knots.size < LEAST_KNOTS
        or np.count_nonzero(clear) < LEAST_RUN * np.count_nonzero(bends[clear])
    ):
        return None
    return float(np.median(np.diff(at_s[knots])))
