"""Drives that carry no conclusion, or should not be there, are told as such and break nothing."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from diagnosis.answer.results import Verdict
from diagnosis.engine import diagnose
from diagnosis.errors import DiagnosisError
from diagnosis.recordings.reading import Recording
from energy.vehicle.coefficients import EffectCoefficients
from energy.vehicle.files import load_vehicle
from tests.diagnosis.planted_drives import drive

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture(scope="module")
def car():
    return load_vehicle(ROOT / "data" / "vehicles" / "bmw-i3-60ah.toml")


def test_a_trip_of_another_vehicle_is_told_and_left_out(car):
    drives = [drive(car, number) for number in range(12)]
    drives[5] = replace(drive(replace(car, mass_kg=2.2 * car.mass_kg, road_load_a_n=300.0), 5), id="T5")
    found = diagnose(drives, car)
    (odd,) = [structure for structure in found.unexplained if structure.axis == "trip"]
    assert odd.trips == ("T5",)
    assert "T5" not in found.fitted_trips
    assert found.findings == ()
    assert found.after.mape < 0.03


def test_recordings_too_coarse_for_anything_are_not_fitted_and_named(car):
    fine = drive(car, 1)
    kept = slice(0, None, 50)
    coarse = [
        replace(
            recording, time_s=recording.time_s[kept], speed_mps=recording.speed_mps[kept],
            power_w=recording.power_w[kept], elevation_m=recording.elevation_m[kept],
            ambient_k=recording.ambient_k[kept],
        )
        for recording in (drive(car, number) for number in range(8))
    ]  # fmt: skip
    found = diagnose([*coarse[:1], *coarse[2:], fine], car)
    assert found.verdict is Verdict.TOO_FEW_TRIPS
    assert {note.trip_id for note in found.data_quality if note.kind == "unfit"} == {
        recording.id for recording in coarse
    } - {"T1"}


def test_drives_that_never_move_or_draw_nothing_are_refused(car):
    time = np.arange(200.0)
    still = [Recording(f"S{k}", time, np.zeros(200), np.full(200, 500.0)) for k in range(8)]
    with pytest.raises(DiagnosisError, match="no recording moves"):
        diagnose(still, car)
    idle = [replace(drive(car, k), power_w=np.zeros_like(drive(car, k).power_w)) for k in range(7)]
    with pytest.raises(DiagnosisError, match="power_w is 0"):
        diagnose(idle, car)


def test_a_wrong_mass_is_not_called_nothing(car):
    heavy = replace(car, mass_kg=1.25 * car.mass_kg)
    found = diagnose([drive(car, number) for number in range(14)], heavy)
    assert found.verdict is Verdict.PARAMETER_ERROR
    assert found.findings == ()
    assert found.parameters
    assert found.routes.mape < 0.03


def test_vehicles_at_the_edge_of_what_a_vehicle_can_be_are_fitted(car):
    for edge in (
        replace(car, aux_power_w=0.0),
        replace(car, recuperation_eff=0.0),
        replace(car, drive_eff=1.0),
        replace(
            car, effects=EffectCoefficients(drive_loss_w_per_n2=1e-4, regen_always_limited=True, tyre_warm_up_frac=0.1)
        ),
    ):
        found = diagnose([drive(car, number) for number in range(7)], edge)
        assert all(np.isfinite(account.explained_kwh) for account in found.trips)


def test_drives_that_give_back_more_than_they_take_have_no_relative_error(car):
    drives = [drive(car, number) for number in range(8)]
    charged = [replace(recording, power_w=recording.power_w - 40_000.0) for recording in drives]
    found = diagnose(charged, car)
    assert found.before is None
    assert found.verdict is not Verdict.NOTHING_MISSING  # 40 kW that the file does not know of


def vertical(recording):
    """A drive whose height rises by 150 m for good from one sample to the next, at walking pace."""
    steps = np.arange(120.0)
    height_m = np.where(steps < 60.0, 500.0, 650.0)
    return replace(recording, time_s=steps, speed_mps=np.ones(120), power_w=np.full(120, 900.0), elevation_m=height_m,
                   ambient_k=None)  # fmt: skip


def test_a_drive_that_cannot_be_replayed_is_unfit_and_the_others_go_on(car):
    drives = [drive(car, number) for number in range(8)]
    drives[2] = vertical(drives[2])
    found = diagnose(drives, car)
    (note,) = [note for note in found.data_quality if note.kind == "unfit"]
    assert (note.trip_id, note.channel) == ("T2", "elevation_m")
    assert "cannot be replayed: elevation_m at sample" in note.text
    assert len(found.trips) == 7
    assert "T2" not in found.fitted_trips


def test_drives_of_which_none_can_be_replayed_are_refused_by_name(car):
    with pytest.raises(DiagnosisError, match="trip T1 cannot be replayed: elevation_m at sample"):
        diagnose([vertical(drive(car, 1))], car)


def test_a_drive_of_one_step_with_positions_stands_beside_the_others(car):
    two = np.arange(2.0)
    short = Recording("short", two, 3.0 + two, np.full(2, 2000.0), latitude_deg=48.0 + 1e-5 * two,
                      longitude_deg=11.0 + 1e-5 * two)  # fmt: skip
    found = diagnose([short, drive(car, 1)], car)
    assert {account.id for account in found.trips} == {"short", "T1"}
    assert next(account for account in found.trips if account.id == "short").distance_km == pytest.approx(0.0035)
