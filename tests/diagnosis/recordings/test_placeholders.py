"""Values within range that stand for none: taken out and told; what a car can be at stays."""

from __future__ import annotations

import numpy as np
import pytest

from diagnosis.recordings.notes import NoteKind
from tests.diagnosis.recorded_drives import drive, plain_csv

DRIVEN = drive()
N = DRIVEN.time_s.size


def with_value(good, bad, at):
    values = np.full(N, good)
    values[at] = bad
    return values


@pytest.mark.parametrize(
    ("name", "channel", "good", "bad", "at"),
    [
        ("ambient_c", "ambient_k", 5.0, -40.0, [0, 1, 2]),
        ("ambient_c", "ambient_k", 5.0, 50.0, [400]),
        ("ambient_c", "ambient_k", 5.0, -50.0, slice(-9, None)),
        ("battery_c", "battery_k", 21.0, -40.0, [10, 300, 301]),
        ("soc_percent", "soc_frac", 80.0, 0.0, [0, 1, 500]),
        ("displayed_soc_percent", "displayed_frac", 80.0, 0.0, [799]),
    ],
)
def test_values_that_come_and_go_at_once_are_taken_out(read, name, channel, good, bad, at):
    recording = read(plain_csv(DRIVEN, **{name: with_value(good, bad, at)}))
    taken = np.zeros(N, np.bool_)
    taken[at] = True
    np.testing.assert_array_equal(np.isnan(getattr(recording, channel)), taken)
    (note,) = [note for note in recording.notes if note.channel == channel and note.kind is NoteKind.REPAIRED]
    assert str(np.count_nonzero(taken)) in note.text


@pytest.mark.parametrize(
    ("name", "channel", "values"),
    [
        ("ambient_c", "ambient_k", np.linspace(-44.0, -36.0, N)),
        ("ambient_c", "ambient_k", np.linspace(30.0, 5.0, N)),
        ("battery_c", "battery_k", np.linspace(-25.0, 20.0, N)),
        ("soc_percent", "soc_frac", np.maximum(np.linspace(4.0, -1.0, N), 0.0)),
        ("soc_percent", "soc_frac", np.ones(N)),
    ],
)
def test_what_weather_and_a_battery_can_be_at_stays(read, name, channel, values):
    recording = read(plain_csv(DRIVEN, **{name: values}))
    assert not np.isnan(getattr(recording, channel)).any()
    if channel == "soc_frac":
        assert recording.soc_frac == pytest.approx(values / 100.0)


def test_sensor_at_minus_40_all_along_is_left_out(read):
    recording = read(plain_csv(DRIVEN, ambient_c=np.full(N, -40.0)))
    assert recording.ambient_k is None
    assert any("which loggers write for no reading" in note.text for note in recording.notes)


@pytest.mark.parametrize("name", ["soc_percent", "displayed_soc_percent"])
def test_charge_that_is_a_share_in_a_column_of_percent_is_converted_and_told(read, name):
    recording = read(plain_csv(DRIVEN, **{name: np.linspace(0.8, 0.7, N)}))
    assert recording.soc_frac[[0, -1]] == pytest.approx([0.8, 0.7])
    assert any(note.kind is NoteKind.UNIT and "is a share of 1" in note.text for note in recording.notes)


@pytest.mark.parametrize(
    ("at", "place"), [([0, 1, 2], (0.0, 0.0)), ([300], (0.0, 11.0)), ([300, 301, 302], (48.0, 11.5))]
)
def test_positions_where_no_car_is_at_that_time_do_not_refuse_the_drive(read, at, place):
    latitude, longitude = DRIVEN.lat_deg.copy(), DRIVEN.lon_deg.copy()
    latitude[at], longitude[at] = place
    recording = read(plain_csv(DRIVEN, lat=latitude, lon=longitude))
    assert np.isnan(recording.latitude_deg[at]).all()
    assert any("where no car is" in note.text for note in recording.notes if note.kind is NoteKind.REPAIRED)
    assert any("as fast" in note.text for note in recording.notes if note.kind is NoteKind.CHECKED)
