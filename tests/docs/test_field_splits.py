"""Recorded drives in part: thinned as a rarer logger would have, split and scored, and claims of subsets counted."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from diagnosis.recordings.recording import Recording
from docs.field_splits import VARIANTS, SplitErrors, Variant, agreement, split_errors, thinned
from energy.vehicle.files import load_vehicle
from energy.vehicle.vehicle import Vehicle
from tests.diagnosis.planted_drives import drive, heater

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture(scope="module")
def car() -> Vehicle:
    found = load_vehicle(ROOT / "data/vehicles/bmw-i3-60ah.toml")
    assert isinstance(found, Vehicle)
    return found


@pytest.fixture(scope="module")
def drives(car: Vehicle) -> list[Recording]:
    return [drive(car, number, heater) for number in range(24)]


@pytest.fixture(scope="module")
def split(car: Vehicle, drives: list[Recording]) -> SplitErrors:
    return split_errors(drives, car, Variant("all", lambda recording: recording, 12), 3)


def test_a_thinned_drive_has_the_samples_of_a_rarer_logger(drives: list[Recording]) -> None:
    rare = thinned(drives[0], 10.0)
    assert set(np.diff(rare.time_s)) == {10.0}
    np.testing.assert_array_equal(rare.speed_mps, drives[0].speed_mps[::10])


def test_a_split_with_a_heater_beats_file_and_refit_and_names_it(split: SplitErrors) -> None:
    assert split.tool < 0.5 * min(split.file, split.refitted)
    assert split.named == ("thermal",)
    assert split.carried
    assert split.routes < 0.5 * split.file


def test_baselines_stand_beside_it(split: SplitErrors) -> None:
    assert split.sums < split.file
    assert split.ridge < split.file


def test_subsets_name_what_all_drives_name(
    car: Vehicle, drives: list[Recording], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("docs.field_splits.SUBSETS", 3)
    agreeing, total = agreement(drives, car, 5)
    assert agreeing == total > 0


def test_variants_are_told_by_different_names() -> None:
    assert len({variant.name for variant in VARIANTS}) == len(VARIANTS)
