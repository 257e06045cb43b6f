"""Values within range that a logger writes where it knows none: far positions, −40 °C, a charge of 0 for a moment.

Also a charge that is a share where its column says percent.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from diagnosis.recordings.notes import NoteKind
from diagnosis.recordings.positions import stray
from diagnosis.recordings.soundness.repairs import noted
from energy.units import ZERO_CELSIUS_K

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from diagnosis.recordings.recording import Recording

TEMPERATURES: Final = ("ambient_k", "battery_k")
CHARGES: Final = ("soc_frac", "displayed_frac")
NO_READING_K: Final = ZERO_CELSIUS_K - 40.0  # a byte of 0 in OBD, which counts from -40 °C
APART_K: Final = 20.0  # from the usual temperature of a drive, that no weather and no battery is
STEEP_K: Final = 10.0  # from one known sample to the next
STEEP_S: Final = 60.0
LEAST_FALL: Final = 0.05  # of the charge, to 0 and back
SHARE: Final = 0.0101  # the most that a charge of 0 to 1 is where it is read as percent
LEAST_LEVELS: Final = 3  # a battery of 1 % and less has fewer in whole percent


def without_placeholders(recording: Recording) -> Recording:
    """The recording without values that stand for none, and with charges in their unit; each with a note."""
    recording = _without_stray_positions(recording)
    for name in TEMPERATURES:
        recording = _without_jumps(recording, name)
    for name in CHARGES:
        recording = _with_share(_without_zeros(recording, name), name)
    return recording


def _without_stray_positions(recording: Recording) -> Recording:
    latitude, longitude = recording.latitude_deg, recording.longitude_deg
    if latitude is None or longitude is None:
        return recording
    bad = stray(recording.time_s, latitude, longitude)
    if not bad.any():
        return recording
    at_s = recording.time_s[int(np.argmax(bad))]
    text = f"positions where no car is at that time taken out: {np.count_nonzero(bad)}, the first at {at_s:.1f} s"
    return noted(
        replace(
            recording, latitude_deg=np.where(bad, np.nan, latitude), longitude_deg=np.where(bad, np.nan, longitude)
        ),
        NoteKind.REPAIRED,
        "latitude_deg",
        text,
    )


def _without_jumps(recording: Recording, name: str) -> Recording:
    """Take out temperatures far from the usual one that come and go at once, and a sensor at −40 °C all along."""
    values: NDArray[np.float64] | None = getattr(recording, name)
    if values is None or np.isnan(values).all():
        return recording
    usual_k = float(np.nanmedian(values))
    if bool((values[~np.isnan(values)] == NO_READING_K).all()):
        text = "-40 °C all along, which loggers write for no reading: left out"
        return _changed(recording, name, None, NoteKind.STUCK, text)
    far = np.abs(values - usual_k) > APART_K
    if not far.any():
        return recording
    known = np.flatnonzero(~np.isnan(values))
    steep = np.abs(np.diff(values[known])) > STEEP_K
    steep &= np.diff(recording.time_s[known]) <= STEEP_S
    begins = np.concatenate(([0], np.flatnonzero(steep) + 1, [known.size]))
    bad = np.zeros(values.size, np.bool_)
    for begin, end in zip(begins[:-1].tolist(), begins[1:].tolist(), strict=True):
        run = known[begin:end]
        bad[run] = begins.size > 2 and bool(far[run].all())
    if not bad.any():
        return recording
    at = int(np.argmax(bad))
    text = (
        f"values taken out that come and go at once: {np.count_nonzero(bad)}, the first"
        f" {values[at] - ZERO_CELSIUS_K:.4g} °C at {recording.time_s[at]:.1f} s, where"
        f" {usual_k - ZERO_CELSIUS_K:.4g} °C is usual"
    )
    return _changed(recording, name, np.where(bad, np.nan, values), NoteKind.REPAIRED, text)


def _without_zeros(recording: Recording, name: str) -> Recording:
    """Take out charges of 0 that are more before or behind."""
    values: NDArray[np.float64] | None = getattr(recording, name)
    if values is None or not bool((values == 0.0).any()) or not bool((values > LEAST_FALL).any()):
        return recording
    known = np.flatnonzero(~np.isnan(values))
    charge = values[known]
    last = int(np.flatnonzero(charge > 0.0)[-1])
    falls = np.flatnonzero((charge[:-1] == 0.0) != (charge[1:] == 0.0))
    steep = bool((np.abs(np.diff(charge))[falls] > LEAST_FALL).all())
    bad = np.zeros(values.size, np.bool_)
    bad[known[charge == 0.0]] = steep
    if not steep or not bad.any():
        return recording
    when = f", the last before {recording.time_s[known[last]]:.1f} s" if last + 1 == charge.size else ""
    text = f"charges of 0 for moments taken out: {np.count_nonzero(bad)}{when}"
    return _changed(recording, name, np.where(bad, np.nan, values), NoteKind.REPAIRED, text)


def _with_share(recording: Recording, name: str) -> Recording:
    """A charge of 0 to 1 that was read as percent, times a hundred."""
    values: NDArray[np.float64] | None = getattr(recording, name)
    if values is None or np.isnan(values).all():
        return recording
    known = values[~np.isnan(values)]
    if float(known.max()) > SHARE or np.unique(known).size < LEAST_LEVELS:
        return recording
    text = f"is a share of 1, declared as percent: it is at most {100.0 * known.max():.3g} %; converted"
    return _changed(recording, name, 100.0 * values, NoteKind.UNIT, text)


def _changed(
    recording: Recording, name: str, values: NDArray[np.float64] | None, kind: NoteKind, text: str
) -> Recording:
    channel: dict[str, Any] = {name: values}
    return noted(replace(recording, **channel), kind, name, text)
