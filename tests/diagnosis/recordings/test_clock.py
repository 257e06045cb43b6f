"""Time in another unit than seconds is refused or told, by speed, ground, charge and mass; true clocks are not."""

from __future__ import annotations

import numpy as np
import pytest

from diagnosis.recordings.notes import NoteKind, RecordingError
from diagnosis.recordings.soundness.clock import usual_swing_mps2
from tests.diagnosis.recorded_drives import drive, plain_csv


def doubts(recording):
    return [note.text for note in recording.notes if note.kind is NoteKind.SUSPECT and note.channel == "time_s"]


@pytest.mark.parametrize("factor", [60.0, 100.0, 1000.0])
def test_time_that_runs_too_fast_is_refused_by_how_the_speed_swings(read, factor):
    driven = drive()
    with pytest.raises(RecordingError, match=r"time is too fast: the speed swings by .* m/s²"):
        read(plain_csv(driven, time_s=driven.time_s / factor))


def test_bad_samples_of_speed_do_not_doubt_the_clock(read):
    driven = drive()
    speed = np.where(np.isin(np.arange(driven.time_s.size) % 80, (35, 40, 45)), 45.0, driven.speed_mps)
    recording = read(plain_csv(driven, speed_kmh=3.6 * speed))
    assert usual_swing_mps2(recording) < 4.0


def test_many_rows_within_seconds_are_told_where_the_speed_tells_nothing(read):
    driven = drive(400.0)
    steady = plain_csv(driven, time_s=driven.time_s / 1000.0, speed_kmh=np.full(400, 90.0), power_w=np.full(400, 9e3))
    assert doubts(read(steady)) == ["400 rows within 0.399 s: is time in seconds?"]


def test_time_that_runs_ten_times_too_fast_is_told(read):
    driven = drive()
    assert any("too fast" in text for text in doubts(read(plain_csv(driven, time_s=driven.time_s / 10.0))))


@pytest.mark.parametrize("factor", [0.1, 10.0])
def test_time_is_held_against_positions(read, factor):
    driven = drive()
    text = plain_csv(driven, time_s=driven.time_s * factor, lat=driven.lat_deg, lon=driven.lon_deg)
    with pytest.raises(RecordingError, match=f"time is too {'slow' if factor > 1 else 'fast'}: by its positions"):
        read(text)


def test_time_is_held_against_the_odometer(read):
    driven = drive()
    way_km = np.cumsum(driven.speed_mps) / 1000.0
    assert way_km[-1] > 2.0
    with pytest.raises(RecordingError, match="by its odometer the car drove"):
        read(plain_csv(driven, time_s=driven.time_s / 10.0, odometer_km=1000.0 + way_km))


def test_time_ten_times_too_slow_is_told_by_the_mass(read):
    driven = drive()
    assert any("too slow" in text for text in doubts(read(plain_csv(driven, time_s=driven.time_s * 10.0))))


def test_battery_that_no_car_has_doubts_the_time(read):
    driven = drive()
    charge = np.linspace(1.0, 0.02, driven.time_s.size)
    (text,) = doubts(read(plain_csv(driven, soc_frac=charge)))
    assert "tell a battery of" in text


@pytest.mark.parametrize("step_s", [0.1, 1.0, 5.0])
def test_true_clock_is_not_doubted(read, step_s):
    driven = drive(step_s=step_s)
    recording = read(plain_csv(driven, lat=driven.lat_deg, lon=driven.lon_deg))
    assert [text for text in doubts(recording) if "run" in text] == []
    assert 0.1 < usual_swing_mps2(recording) < 4.0
