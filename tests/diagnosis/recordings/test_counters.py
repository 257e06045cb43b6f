"""Counters of way and energy: read, held against speed and power, and in their place where those are missing."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from diagnosis.engine import diagnose
from diagnosis.recordings.counters import counts, is_fine, mean_rate, rate, step_of
from diagnosis.recordings.notes import NoteKind, RecordingError
from diagnosis.recordings.recording import Detail
from energy.vehicle.files import load_vehicle
from tests.diagnosis.planted_drives import drive as planted
from tests.diagnosis.recorded_drives import drive, plain_csv

ROOT = Path(__file__).resolve().parents[3]
LONG_S = 1600.0


def way_km(driven):
    step_s = np.diff(driven.time_s)
    return 1e-3 * np.concatenate(([0.0], np.cumsum(0.5 * (driven.speed_mps[1:] + driven.speed_mps[:-1]) * step_s)))


def used_wh(driven, power_w=None):
    power_w = driven.power_w if power_w is None else power_w
    step_s = np.diff(driven.time_s)
    return np.concatenate(([0.0], np.cumsum(0.5 * (power_w[1:] + power_w[:-1]) * step_s))) / 3600.0


def floored(values, step):
    return np.floor(values / step + 1e-9) * step


def without(text, *names):
    """A table of cells set off by commas without some columns."""
    rows = [line.split(",") for line in text.splitlines()]
    keep = [k for k, name in enumerate(rows[0]) if name not in names]
    return "\n".join(",".join(row[k] for k in keep) for row in rows) + "\n"


def texts(recording, kind, channel):
    return [note.text for note in recording.notes if note.kind is kind and note.channel == channel]


def test_a_counter_is_known_to_a_sample_between_its_changes_whatever_its_steps():
    time_s = np.arange(0.0, 1000.0)
    values = floored(0.013 * time_s, 1.0)
    (span,) = counts(time_s, values)
    assert span.rise == pytest.approx(11.0)
    assert span.changes == 11
    assert span.rise / (span.to_s - span.from_s) == pytest.approx(0.013, rel=2e-3)
    assert step_of(values) == 1.0
    assert mean_rate(time_s, values) == pytest.approx(0.013, rel=2e-3)
    assert mean_rate(time_s, floored(0.0041 * time_s, 1.0)) is None  # four steps
    assert not is_fine(time_s, values)
    fine = floored(0.55 * time_s, 0.1)
    assert is_fine(time_s, fine)
    assert rate(time_s, fine)[5:-5] == pytest.approx(0.55, abs=0.051)


def test_a_gap_splits_a_counter():
    time_s = np.arange(0.0, 100.0)
    values = np.where(time_s < 50.0, time_s, time_s + 500.0)
    broken = np.zeros(99, np.bool_)
    broken[49] = True
    assert [span.rise for span in counts(time_s, values, broken)] == [48.0, 48.0]


@pytest.mark.parametrize(("name", "per_km"), [("odometer_km", 1.0), ("odometer_mi", 1.0 / 1.609344)])
def test_an_odometer_in_either_unit_agrees_with_the_speed(read, name, per_km):
    driven = drive(LONG_S)
    recording = read(plain_csv(driven, **{name: 4567.0 + floored(per_km * way_km(driven), 0.1)}))
    (text,) = texts(recording, NoteKind.CHECKED, "speed_mps")
    assert float(text.split()[3]) == pytest.approx(1.0, abs=0.01)
    np.testing.assert_allclose(recording.speed_mps, driven.speed_mps, atol=1e-6)


def test_a_speed_in_miles_is_proven_by_the_odometer_and_converted(read):
    driven = drive(LONG_S)
    text = plain_csv(driven, speed_kmh=3.6 / 1.609344 * driven.speed_mps, odometer_km=floored(way_km(driven), 0.1))
    recording = read(text)
    np.testing.assert_allclose(recording.speed_mps, driven.speed_mps, atol=1e-6)
    (told,) = texts(recording, NoteKind.UNIT, "speed_mps")
    assert told.startswith("is in miles an hour, declared as km/h: by the odometer")


def test_an_odometer_in_miles_is_told_and_the_speed_is_left_alone(read):
    driven = drive(LONG_S)
    recording = read(plain_csv(driven, odometer_km=floored(way_km(driven) / 1.609344, 0.1)))
    np.testing.assert_allclose(recording.speed_mps, driven.speed_mps, atol=1e-6)
    (told,) = texts(recording, NoteKind.UNIT, "odometer_m")
    assert "may count miles" in told


def test_a_speed_that_is_a_tenth_fast_is_suspect_beside_the_odometer(read):
    driven = drive(LONG_S)
    recording = read(
        plain_csv(driven, speed_kmh=1.1 * 3.6 * driven.speed_mps, odometer_km=floored(way_km(driven), 0.1))
    )
    (told,) = texts(recording, NoteKind.SUSPECT, "speed_mps")
    assert "by the odometer 0.9" in told


def test_an_odometer_in_steps_of_a_kilometre_or_that_is_set_back_tells_nothing(read):
    driven = drive(LONG_S)
    for odometer_km in (floored(way_km(driven), 1.0), way_km(driven) % 5.0):
        recording = read(plain_csv(driven, odometer_km=odometer_km))
        assert not [note for note in recording.notes if "odometer" in note.text]


def test_without_a_speed_a_fine_odometer_gives_it_and_a_coarse_one_is_an_error(read):
    driven = drive(LONG_S)
    text = without(plain_csv(driven, odometer_km=floored(way_km(driven), 0.005)), "speed_kmh")
    recording = read(text)
    assert texts(recording, NoteKind.READ, "speed_mps") == ["by the odometer, in steps of 5 m"]
    assert recording.distance_m() == pytest.approx(1e3 * way_km(driven)[-1], rel=0.01)
    truth = np.interp(recording.time_s, driven.time_s, driven.speed_mps)
    assert np.median(recording.speed_mps[truth == 20.0]) == pytest.approx(20.0, abs=0.5)
    coarse = without(plain_csv(driven, odometer_km=floored(way_km(driven), 0.1)), "speed_kmh")
    with pytest.raises(
        RecordingError, match="speed_kmh is missing, allowed: a speed, or an odometer in steps of metres"
    ):
        read(coarse, "coarse.csv")


def test_without_power_a_fine_counter_of_energy_gives_it_in_windows(read):
    driven = drive(LONG_S)
    recording = read(without(plain_csv(driven, energy_wh=floored(used_wh(driven), 0.2)), "power_w"))
    assert recording.detail is Detail.SAMPLES
    assert recording.energy_j() / 3600.0 == pytest.approx(used_wh(driven)[-1], rel=0.01)
    truth, found = (
        np.interp(np.arange(0.0, LONG_S, 10.0), driven.time_s, wh)
        for wh in (used_wh(driven), used_wh(driven, recording.power_w))
    )
    assert np.abs(np.diff(truth) - np.diff(found)).max() < 3.0  # of windows of up to 70 Wh


def test_without_power_a_coarse_counter_gives_one_energy(read):
    driven = drive(LONG_S)
    recording = read(without(plain_csv(driven, energy_kwh=floored(used_wh(driven) / 1000.0, 0.1)), "power_w"))
    assert recording.detail is Detail.COUNTER
    assert recording.is_one_number
    assert recording.energy_j() / 3600.0 == pytest.approx(used_wh(driven)[-1], rel=0.1)


def test_a_counter_of_too_few_steps_leaves_the_charge_to_tell(read):
    driven = drive(LONG_S)
    charge = np.linspace(0.8, 0.7, driven.time_s.size)
    columns = {"energy_kwh": floored(used_wh(driven) / 1000.0, 1.0), "soc_frac": charge}
    assert read(without(plain_csv(driven, **columns), "power_w")).detail is Detail.CHARGE


@pytest.mark.parametrize(("factor", "kind"), [(1.0, NoteKind.CHECKED), (0.8, NoteKind.SUSPECT)])
def test_power_is_held_against_the_counter_of_energy(read, factor, kind):
    driven = drive(LONG_S)
    text = plain_csv(driven, power_w=factor * driven.power_w, energy_wh=floored(used_wh(driven), 10.0))
    (told,) = [note for note in texts(read(text), kind, "power_w") if "counter of energy" in note]
    assert "adds up to" in told


def test_a_counter_of_what_is_drawn_is_known_as_one(read):
    driven = drive(LONG_S)
    drawn = used_wh(driven, np.maximum(driven.power_w, 0.0))
    recording = read(plain_csv(driven, energy_wh=floored(drawn, 10.0)))
    (told,) = texts(recording, NoteKind.CHECKED, "used_j")
    assert "without recuperation" in told


def test_recuperation_is_held_against_its_counter(read):
    driven = drive(LONG_S)
    back = used_wh(driven, np.maximum(-driven.power_w, 0.0))
    assert texts(read(plain_csv(driven, regen_wh=-floored(back, 1.0))), NoteKind.CHECKED, "regen_j")
    assert texts(read(plain_csv(driven, regen_wh=floored(3.0 * back, 1.0)), "b.csv"), NoteKind.SUSPECT, "regen_j")


def test_rare_samples_of_power_give_way_to_a_fine_counter(read):
    driven = drive(LONG_S)
    fine = used_wh(driven)
    rare = replace(
        driven,
        time_s=driven.time_s[::5],
        speed_mps=driven.speed_mps[::5],
        power_w=driven.power_w[::5],
    )
    recording = read(plain_csv(rare, energy_wh=floored(fine[::5], 0.5)))
    assert texts(recording, NoteKind.READ, "power_w") == ["by the counter of energy, since samples are 5 s apart"]
    assert recording.energy_j() / 3600.0 == pytest.approx(fine[-1], rel=0.02)


@pytest.mark.parametrize("kind", ["left", "set back", "each"])
def test_a_column_that_is_no_counter_of_what_left_the_battery_takes_no_place(read, kind):
    driven = drive(LONG_S)
    used = used_wh(driven)
    column = {"left": 20_000.0 - used, "set back": used % 300.0, "each": np.append(np.diff(used), 0.0)}[kind]
    rare = replace(driven, time_s=driven.time_s[::5], speed_mps=driven.speed_mps[::5], power_w=driven.power_w[::5])
    recording = read(plain_csv(rare, energy_wh=column[::5]))
    np.testing.assert_allclose(recording.power_w, rare.power_w, rtol=1e-6)
    alone = read(
        without(plain_csv(driven, energy_wh=column, soc_frac=np.linspace(0.8, 0.7, used.size)), "power_w"), "b.csv"
    )
    assert alone.detail is Detail.CHARGE


def test_drives_with_a_coarse_counter_are_diagnosed_as_one_number_each():
    car = load_vehicle(ROOT / "data/vehicles/bmw-i3-60ah.toml")
    drives = []
    for number in range(8):
        recording = planted(car, number)
        mean_w = recording.energy_j() / (recording.time_s[-1] - recording.time_s[0])
        drives.append(replace(recording, power_w=np.full_like(recording.power_w, mean_w), detail=Detail.COUNTER))
    found = diagnose(drives, car)
    assert found.text.startswith("No power was recorded on any drive: each drive is one number, by its charge or a")
    assert len(found.fitted_trips) == 8
    for account, recording in zip(found.trips, drives, strict=True):
        assert account.measured_kwh == pytest.approx(recording.energy_j() / 3.6e6, rel=0.01)
