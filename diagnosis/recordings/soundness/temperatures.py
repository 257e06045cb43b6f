"""Temperatures of the air whose unit is doubted: in °F in some files of a set, or in all, and read as °C.

One file alone hardly shows it; beside the battery's temperature at the start, and beside the other drives, it does.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Final

import numpy as np

from diagnosis.recordings.notes import Note, NoteKind
from energy.units import ZERO_CELSIUS_K

if TYPE_CHECKING:
    from collections.abc import Sequence

    from diagnosis.recordings.recording import Recording

HOTTEST_C: Final = 48.0  # of the air that cars are driven in, nearly anywhere
APART_K: Final = 14.0  # from the battery at the start, from which on a temperature of the air is doubted
NEAR_K: Final = 10.0  # to the battery, within which it then must be in the other unit
AGREEING_K: Final = 8.0  # usual distance of the other drives' temperatures from their batteries'
START_S: Final = 60.0


def with_doubts(recordings: Sequence[Recording]) -> list[Recording]:
    """The recordings, temperatures of the air left out where they seem to be in °F, with a note on each."""
    doubted = [_is_fahrenheit(recording) for recording in recordings]
    agreeing = [
        abs(known[0] - known[1])
        for recording, doubt in zip(recordings, doubted, strict=True)
        if not doubt and (known := _air_and_battery_c(recording)) is not None
    ]
    usual_k = float(np.median(agreeing)) if agreeing else 0.0
    return [
        _without_air(recording) if doubt and usual_k <= AGREEING_K else recording
        for recording, doubt in zip(recordings, doubted, strict=True)
    ]


def _is_fahrenheit(recording: Recording) -> bool:
    if recording.ambient_k is None or bool(np.isnan(recording.ambient_k).all()):
        return False
    air_c = float(np.nanmedian(recording.ambient_k)) - ZERO_CELSIUS_K
    if air_c > HOTTEST_C:
        return True
    known = _air_and_battery_c(recording)
    if known is None:
        return False
    air_c, battery_c = known
    return air_c - battery_c > APART_K and abs(_from_fahrenheit_c(air_c) - battery_c) <= NEAR_K


def _air_and_battery_c(recording: Recording) -> tuple[float, float] | None:
    """Median temperature of the air, and that of the battery at the start, or None where one is not known."""
    if recording.ambient_k is None or recording.battery_k is None:
        return None
    begin = recording.battery_k[recording.time_s <= recording.time_s[0] + START_S]
    if bool(np.isnan(recording.ambient_k).all()) or bool(np.isnan(begin).all()):
        return None
    return float(np.nanmedian(recording.ambient_k)) - ZERO_CELSIUS_K, float(np.nanmedian(begin)) - ZERO_CELSIUS_K


def _from_fahrenheit_c(value: float) -> float:
    return (value - 32.0) / 1.8


def _without_air(recording: Recording) -> Recording:
    assert recording.ambient_k is not None, "only a known temperature is doubted"
    air_c = float(np.nanmedian(recording.ambient_k)) - ZERO_CELSIUS_K
    text = (
        f"{air_c:.0f} °C may be {air_c:.0f} °F, which is {_from_fahrenheit_c(air_c):.0f} °C: so say the battery and the"
        " other drives; left out"
    )
    return replace(recording, ambient_k=None, notes=(*recording.notes, Note(NoteKind.UNIT, "ambient_k", text)))
