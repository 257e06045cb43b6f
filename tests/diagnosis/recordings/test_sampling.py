"""Channels whose true samples are rarer than their rows are noticed; those that are not stay as they are."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from diagnosis.recordings.notes import NoteKind
from diagnosis.recordings.soundness.sampling import held_length_s, line_length_s
from tests.diagnosis.recorded_drives import drive, plain_csv


def held(values, rows):
    return values[(np.arange(values.size) // rows) * rows]


def wandering(step_s=1.0):
    """A drive whose speed is never straight for long."""
    driven = drive(step_s=step_s)
    t = driven.time_s
    speed = 15.0 + 6.0 * np.sin(t / 13.0) + 3.0 * np.sin(t / 5.3)
    return replace(driven, speed_mps=speed, power_w=speed * (1500.0 * np.gradient(speed, step_s) + 600.0) + 400.0)


def lines(time_s, values, apart_s):
    knots = np.arange(time_s[0], time_s[-1] + apart_s, apart_s)
    return np.interp(time_s, knots, np.interp(knots, time_s, values))


@pytest.mark.parametrize("rows", [5, 15, 30])
def test_positions_refreshed_more_rarely_than_rows_are_taken_out_between(read, rows):
    driven = drive()
    recording = read(plain_csv(driven, lat=held(driven.lat_deg, rows), lon=held(driven.lon_deg, rows)))
    np.testing.assert_allclose(recording.speed_mps, driven.speed_mps, atol=1e-6)
    known = np.flatnonzero(~np.isnan(recording.latitude_deg))
    assert set(range(0, driven.time_s.size, rows)) <= set(known.tolist())
    moved = np.flatnonzero(held(driven.speed_mps, rows) > 6.0)
    assert np.isnan(recording.latitude_deg[[k for k in moved if k % rows]]).all()
    assert any(f"each {rows} s" in note.text for note in recording.notes if note.kind is NoteKind.REPAIRED)


def test_positions_of_each_row_stay(read):
    driven = drive()
    recording = read(plain_csv(driven, lat=driven.lat_deg, lon=driven.lon_deg))
    assert not np.isnan(recording.latitude_deg).any()


@pytest.mark.parametrize(("column", "digits"), [("speed_kmh", 12), ("speed_kmh", 2), ("power_w", 1)])
def test_straight_lines_between_rare_samples_are_told_with_their_length(read, column, digits):
    driven = wandering()
    values = 3.6 * driven.speed_mps if column == "speed_kmh" else driven.power_w
    drawn = np.round(lines(driven.time_s, values, 10.0), digits)
    recording = read(plain_csv(driven, **{column: drawn}))
    channel = "speed_mps" if column == "speed_kmh" else "power_w"
    (text,) = [note.text for note in recording.notes if note.channel == channel and "straight lines" in note.text]
    assert "10 s apart" in text


@pytest.mark.parametrize("digits", [0, 1, 2, 12])
@pytest.mark.parametrize("step_s", [0.1, 1.0])
def test_channel_that_was_sampled_is_not_taken_for_lines(digits, step_s):
    driven = wandering(step_s)
    assert line_length_s(driven.time_s, np.round(3.6 * driven.speed_mps, digits)) is None
    assert held_length_s(driven.time_s, np.round(3.6 * driven.speed_mps, digits)) is None
    noisy = driven.power_w + np.random.default_rng(1).normal(0.0, 50.0, driven.power_w.size)
    assert line_length_s(driven.time_s, np.round(noisy, digits)) is None
    assert held_length_s(driven.time_s, np.round(noisy, digits)) is None


@pytest.mark.parametrize("rows", [5, 20])
@pytest.mark.parametrize("channel", ["speed_mps", "power_w"])
def test_channel_that_is_held_between_rare_samples_is_told_with_how_long(read, channel, rows):
    driven = wandering()
    driven = replace(driven, **{channel: held(np.round(getattr(driven, channel), 2), rows)})
    recording = read(plain_csv(driven))
    (text,) = [note.text for note in recording.notes if note.channel == channel and "is not known" in note.text]
    assert text.startswith(f"held for {rows} s")
