"""Temperatures that are in °F are doubted by the battery and the other drives, and no others are."""

from __future__ import annotations

from dataclasses import replace

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


DAY_S = 86_400.0


def on_day(day, air_c, heater_w=None, battery_c=None):
    heater = None if heater_w is None else np.full(TIME.size, heater_w)
    return replace(drive(f"D{day}", air_c, battery_c), time_s=1.76e9 + DAY_S * day + TIME, heater_w=heater)


def test_drive_in_fahrenheit_below_48_is_doubted_by_the_drives_of_its_days():
    winter = [on_day(day, 2.0 + day % 4) for day in range(6)]
    fahrenheit = on_day(6, 1.8 * 1.0 + 32.0)
    assert doubted([*winter, fahrenheit]) == ["D6"]
    assert "days before and after" in with_doubts([*winter, fahrenheit])[6].notes[0].text


def test_warm_drives_are_not_doubted_by_the_season_where_it_may_be_so():
    summer = [on_day(day, 18.0 + 2.0 * day) for day in range(5)]
    assert doubted([*summer, on_day(5, 34.0)]) == []  # as °F it were 1 °C
    winter = [on_day(day, 2.0) for day in range(5)]
    assert doubted([*winter, on_day(5, 21.0 - 4.0)]) == []
    assert doubted([*winter, on_day(120, 34.0)]) == []
    assert doubted([on_day(0, 2.0), on_day(1, 3.0), on_day(2, 34.0)]) == []
    spring = [on_day(day, 3.0 + 4.0 * day) for day in range(5)]
    assert doubted([*spring, on_day(5, 34.0)]) == []
    assert doubted([replace(recording, time_s=TIME) for recording in (*winter, on_day(6, 34.0))]) == []


@pytest.mark.parametrize(
    ("heater_w", "battery_c", "count"), [(2500.0, None, 1), (2500.0, 2.0, 1), (2500.0, 31.0, 0), (900.0, None, 0)]
)
def test_heater_at_work_on_a_warm_day_doubts_its_temperature(heater_w, battery_c, count):
    assert len(doubted([on_day(0, 35.0, heater_w, battery_c)])) == count
    assert doubted([on_day(0, 15.0, heater_w, battery_c)]) == []
