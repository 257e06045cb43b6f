"""Drives without power: read by their charge, and one energy each."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from diagnosis.answer.results import Verdict
from diagnosis.engine import diagnose
from diagnosis.recordings.charge import with_power_of_charge
from diagnosis.recordings.notes import RecordingError
from diagnosis.recordings.reading import read_recording
from diagnosis.recordings.recording import Detail
from energy.vehicle.files import load_vehicle
from tests.diagnosis.planted_drives import drive

ROOT = Path(__file__).resolve().parents[3]


@pytest.fixture(scope="module")
def car():
    return load_vehicle(ROOT / "data/vehicles/bmw-i3-60ah.toml")


def written(folder, header, rows):
    path = folder / "drive.csv"
    path.write_text("\n".join([header, *rows]) + "\n", encoding="utf-8")
    return path


def falling(recording, car, resolution=1e-4):
    """The recording with its charge in place of its power."""
    drawn_j = np.concatenate(
        ([0.0], np.cumsum(0.5 * (recording.power_w[1:] + recording.power_w[:-1]) * np.diff(recording.time_s)))
    )
    charge = np.round((0.9 - drawn_j / 3600.0 / car.usable_capacity_wh) / resolution) * resolution
    return replace(recording, power_w=np.zeros_like(recording.power_w), soc_frac=charge, detail=Detail.CHARGE)


def test_a_file_with_charge_and_no_power_is_read(tmp_path):
    rows = [f"{k},{30 + k % 7},{0.8 - 1e-5 * k:.5f}" for k in range(300)]
    recording = read_recording(written(tmp_path, "time_s,speed_kmh,soc_frac", rows))
    assert recording.detail is Detail.CHARGE
    assert not recording.power_w.any()
    (known,) = with_power_of_charge([recording], 20_000.0)
    assert known.energy_j() / 3.6e6 == pytest.approx(299e-5 * 20.0, rel=1e-6)


def test_telemetry_with_charge_and_no_power_is_read(tmp_path):
    rows = [f"{1.6e9 + 2 * k:.0f},{40 + k % 5},{80.0 - 0.01 * k:.2f}" for k in range(200)]
    assert read_recording(written(tmp_path, "utc,speed,soc", rows)).detail is Detail.CHARGE


def test_a_file_without_power_and_charge_is_refused(tmp_path):
    with pytest.raises(RecordingError, match="power_w, or voltage_v and current_a, or soc_frac"):
        read_recording(written(tmp_path, "time_s,speed_kmh", ["0,10", "1,11", "2,12"]))


def test_a_charge_that_hardly_falls_tells_no_energy(car):
    flat = replace(falling(drive(car, 1), car), soc_frac=np.full(drive(car, 1).time_s.size, 0.7))
    (known,) = with_power_of_charge([flat], car.usable_capacity_wh)
    assert not known.power_w.any()


def test_drives_with_charge_alone_say_so_first_and_name_no_number(car):
    drives = [falling(drive(car, number), car) for number in range(12)]
    found = diagnose(drives, car)
    assert found.text.startswith("No power was recorded on any drive")
    assert found.findings == ()
    assert found.parameter_errors == ()
    measured = [drive(car, number).energy_j() / 3.6e6 for number in range(12)]
    assert [trip.measured_kwh for trip in found.trips] == pytest.approx(measured, abs=0.01)


def test_beside_drives_with_power_those_without_are_left_out_and_named(car):
    drives = [drive(car, number) for number in range(8)]
    drives[3] = falling(drives[3], car)
    found = diagnose(drives, car)
    assert "T3" not in found.fitted_trips
    assert any(note.trip_id == "T3" and note.kind == "unfit" for note in found.data_quality)


def test_one_drive_alone_is_held_against_the_model(car):
    found = diagnose([drive(car, 4)], car)
    assert found.verdict is Verdict.TOO_FEW_TRIPS
    assert "T4 took" in found.text
    (account,) = found.trips
    assert sum(account.by_family_kwh.values()) == pytest.approx(account.after_kwh, rel=1e-6)
    assert account.by_family_kwh["aerodynamic"] > 0.0


def test_the_charge_on_the_display_tells_the_energy_where_it_is_there(car):
    recording = falling(drive(car, 1), car)
    shown = replace(recording, id="D", displayed_frac=np.linspace(0.9, 0.4, recording.time_s.size))
    plain, found = with_power_of_charge([recording, shown], car.usable_capacity_wh)
    assert plain.energy_j() < 0.5 * found.energy_j()
    assert found.energy_j() / 3600.0 == pytest.approx(0.5 * car.usable_capacity_wh, rel=1e-6)
