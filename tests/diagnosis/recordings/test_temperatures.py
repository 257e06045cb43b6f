"""Temperatures that are in °F are doubted by the battery and the other drives, and no others are."""

from __future__ import annotations

import numpy as np
import pytest

from diagnosis.recordings.notes import NoteKind
from diagnosis.recordings.recording import Recording
from diagnosis.recordings.soundness.temperatures import with_doubts

TIME = np.arange(120.0)


def drive(name, air_c, battery_c=None):
    speed = np.full(TIME.size, 10.0)
    battery_k = None if battery_c is None else np.full(TIME.size, battery_c + 273.15)
    air_k = None if air_c is None else np.full(TIME.size, air_c + 273.15)
    return Recording(name, TIME, speed, np.full(TIME.size, 4000.0), ambient_k=air_k, battery_k=battery_k)


def doubted(recordings):
    return [
        recording.id
        for recording in with_doubts(recordings)
        if any(note.kind is NoteKind.UNIT for note in recording.notes)
    ]


def test_a_drive_in_fahrenheit_among_others_is_doubted_and_its_temperature_left_out():
    drives = [drive(f"T{k}", 3.0 * k, 3.0 * k + 4.0) for k in range(8)]
    drives[3] = drive("T3", 1.8 * 9.0 + 32.0, 13.0)
    assert doubted(drives) == ["T3"]
    assert with_doubts(drives)[3].ambient_k is None
    assert with_doubts(drives)[2].ambient_k is drives[2].ambient_k


def test_hotter_than_air_can_be_is_doubted_without_a_battery():
    assert doubted([drive("A", 52.0), drive("B", 20.0), drive("C", None)]) == ["A"]


@pytest.mark.parametrize("air_c", [-20.0, -5.0, 10.0, 30.0])
def test_a_car_from_a_warm_or_a_cold_garage_is_not_doubted(air_c):
    drives = [drive(f"T{k}", air_c, air_c + shift) for k, shift in enumerate((0.0, 3.0, 25.0 if air_c < 0.0 else 5.0))]
    assert doubted(drives) == []
    assert doubted([drive("T0", 33.0, 20.0), drive("T1", 31.0, 29.0)]) == []


def test_where_the_other_drives_do_not_agree_either_nothing_is_concluded():
    drives = [drive(f"T{k}", 5.0, 25.0) for k in range(4)]
    assert doubted([*drives, drive("T9", 45.0, 14.0)]) == []
