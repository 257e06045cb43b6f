"""Temperatures of the air whose unit is doubted: in °F in some files of a set, or in all, and read as °C.

One file alone hardly shows it; beside the battery's temperature at the start, the heater and the other drives it does.
What is 20 to 48 °F and has none of these beside it cannot be told from a warm day.
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
COLDEST_F: Final = 20.0  # as °C it is a warm day; below it, °C and °F are both cold
HEATED_C: Final = 22.0  # air from which on no cabin is heated by HEATED_W in the mean of a drive
HEATED_W: Final = 1800.0  # on BMW i3 drives at 16 to 31 °C it is 1.2 kW at most
HEATED_NEAR_K: Final = 8.0  # to the battery, within which the air's unit is not doubted
DATED_S: Final = 1e8  # times since 1970 are larger, those since a start are not
SEASON_S: Final = 14.0 * 86_400.0
LEAST_NEIGHBOURS: Final = 3
EVEN_K: Final = 12.0  # between the coldest and the warmest of the drives within a season, that they are a measure
SEASON_NEAR_K: Final = 8.0


def with_doubts(recordings: Sequence[Recording]) -> list[Recording]:
    """The recordings, temperatures of the air left out where they seem to be in °F, with a note on each."""
    doubted = [_is_fahrenheit(recording) for recording in recordings]
    agreeing = [
        abs(known[0] - known[1])
        for recording, doubt in zip(recordings, doubted, strict=True)
        if not doubt and (known := _air_and_battery_c(recording)) is not None
    ]
    usual_k = float(np.median(agreeing)) if agreeing else 0.0
    found: list[Recording] = []
    for k, (recording, doubt) in enumerate(zip(recordings, doubted, strict=True)):
        if doubt and usual_k <= AGREEING_K:
            hot = (_air_c(recording) or 0.0) > HOTTEST_C
            found.append(_without_air(recording, "what air can be" if hot else "the battery and the other drives"))
        elif not doubt and _is_heated(recording):
            found.append(_without_air(recording, "the heater"))
        elif not doubt and _is_out_of_season(k, recordings):
            found.append(_without_air(recording, "the drives of the days before and after"))
        else:
            found.append(recording)
    return found


def _is_heated(recording: Recording) -> bool:
    """Whether the cabin is heated as in the cold, while the air is warm as °C and cold as °F."""
    air_c = _air_c(recording)
    if air_c is None or not HEATED_C <= air_c <= HOTTEST_C or recording.heater_w is None:
        return False
    known = _air_and_battery_c(recording)
    if known is not None and abs(known[0] - known[1]) <= HEATED_NEAR_K:
        return False
    heater_w = recording.heater_w[~np.isnan(recording.heater_w)]
    return bool(heater_w.size and float(heater_w.mean()) >= HEATED_W)


def _is_out_of_season(at: int, recordings: Sequence[Recording]) -> bool:
    """Whether the air is 19 K and more above that of all drives within two weeks, and near theirs as °F."""
    air_c, begin_s = _air_c(recordings[at]), float(recordings[at].time_s[0])
    if air_c is None or begin_s < DATED_S or not COLDEST_F <= air_c <= HOTTEST_C:
        return False
    others = [
        other_c
        for k, other in enumerate(recordings)
        if k != at and abs(float(other.time_s[0]) - begin_s) <= SEASON_S and (other_c := _air_c(other)) is not None
    ]
    if len(others) < LEAST_NEIGHBOURS or max(others) - min(others) > EVEN_K:
        return False
    return abs(_from_fahrenheit_c(air_c) - float(np.median(others))) <= SEASON_NEAR_K


def _air_c(recording: Recording) -> float | None:
    """Median temperature of the air, or None."""
    if recording.ambient_k is None or bool(np.isnan(recording.ambient_k).all()):
        return None
    return float(np.nanmedian(recording.ambient_k)) - ZERO_CELSIUS_K


def _is_fahrenheit(recording: Recording) -> bool:
    air_c = _air_c(recording)
    if air_c is None:
        return False
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


def _without_air(recording: Recording, told_by: str) -> Recording:
    assert recording.ambient_k is not None, "only a known temperature is doubted"
    air_c = float(np.nanmedian(recording.ambient_k)) - ZERO_CELSIUS_K
    text = (
        f"{air_c:.0f} °C may be {air_c:.0f} °F, which is {_from_fahrenheit_c(air_c):.0f} °C: so say {told_by}; left out"
    )
    return replace(recording, ambient_k=None, notes=(*recording.notes, Note(NoteKind.UNIT, "ambient_k", text)))
