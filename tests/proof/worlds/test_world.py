from __future__ import annotations

import re
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
import pytest

from diagnosis.recordings.reading import read_recording
from proof.worlds.causes import CAUSES
from proof.worlds.making import make_world
from proof.worlds.orders import WorldOrder, single
from proof.worlds.sealing import SealError, check_seal, seal, write_labels
from proof.worlds.world import DECIMALS, World, WorldKind, WorldLabel, write_world

if TYPE_CHECKING:
    from pathlib import Path


@pytest.fixture(scope="module")
def windy() -> tuple[World, WorldLabel]:
    return make_world(replace(single("wind_known", 0.05), trips=(4, 4)), np.random.SeedSequence(21))


def test_recordings_read_back_as_they_were_sensed(tmp_path: Path, windy: tuple[World, WorldLabel]) -> None:
    world, _ = windy
    write_world(world, tmp_path)
    for recording in world.recordings:
        read = read_recording(tmp_path / f"{recording.id}.csv")
        assert read.id == recording.id
        assert read.time_s == pytest.approx(recording.channels["time_s"])
        assert read.speed_mps == pytest.approx(recording.channels["speed_kmh"] / 3.6, abs=1e-3)
        assert read.power_w == pytest.approx(recording.channels["power_w"], abs=0.51)
        assert read.wind_speed_mps is not None
        assert read.heading_rad is not None


def test_channels_stay_within_what_a_recording_may_hold(windy: tuple[World, WorldLabel]) -> None:
    ranges = {
        "speed_kmh": (0.0, 200.0),
        "elevation_m": (-500.0, 9000.0),
        "ambient_c": (-50.0, 56.0),
        "soc_frac": (0.0, 1.0),
        "heading_deg": (0.0, 360.0),
        "wind_speed_mps": (0.0, 60.0),
    }
    for recording in windy[0].recordings:
        for name, (low, high) in ranges.items():
            assert low <= recording.channels[name].min() <= recording.channels[name].max() <= high


def test_the_tools_folder_holds_vehicle_and_recordings_and_no_word_of_the_label(
    tmp_path: Path, windy: tuple[World, WorldLabel]
) -> None:
    world, label = windy
    write_world(world, tmp_path)
    assert {path.name for path in tmp_path.iterdir()} == {
        "vehicle.toml",
        *(f"{recording.id}.csv" for recording in world.recordings),
    }
    words = {*WorldKind, *CAUSES, *(cause.family for cause in CAUSES.values()), label.world_id, "seed", "strength"}
    for path in tmp_path.iterdir():
        text = path.read_text(encoding="utf-8")
        if path.suffix == ".csv":
            header, _, text = text.partition("\n")
            assert set(header.split(",")) <= set(DECIMALS)
        assert not [word for word in words if re.search(rf"\b{word}\b", text.replace("[mass]", ""))]


def test_vehicle_files_of_a_null_world_and_of_one_with_an_effect_differ_in_numbers_only(
    windy: tuple[World, WorldLabel],
) -> None:
    calm, _ = make_world(WorldOrder(WorldKind.NULL, trips=(3, 3)), np.random.SeedSequence(22))
    texts = [re.sub(r"-?\d+(\.\d+)?", "#", world.vehicle_toml) for world in (calm, windy[0])]
    assert texts[0] == texts[1]


def test_the_name_of_a_world_does_not_tell_its_kind(windy: tuple[World, WorldLabel]) -> None:
    assert re.fullmatch(r"w[0-9a-f]{12}", windy[0].id)


def test_worlds_without_an_effect_may_have_the_channels_that_would_show_it() -> None:
    names = set()
    for seed in range(12):
        world, _ = make_world(WorldOrder(WorldKind.NULL, trips=(1, 1)), np.random.SeedSequence(seed))
        channels = world.recordings[0].channels
        names |= set(channels)
        for quiet in ("wet", "payload_kg"):
            assert not channels.get(quiet, np.zeros(1)).any()
    assert names == set(DECIMALS)


def test_a_seal_is_kept_by_the_labels_that_it_was_made_of(tmp_path: Path, windy: tuple[World, WorldLabel]) -> None:
    sealed = write_labels([windy[1]], tmp_path)
    assert sealed == seal([windy[1]])
    check_seal(tmp_path, sealed)


@pytest.mark.parametrize("change", ["digit", "gone", "added"])
def test_a_seal_shows_a_label_that_was_changed_removed_or_added(
    tmp_path: Path, windy: tuple[World, WorldLabel], change: str
) -> None:
    label = windy[1]
    sealed = write_labels([label], tmp_path)
    path = tmp_path / label.world_id / "label.json"
    if change == "digit":
        path.write_text(path.read_text(encoding="utf-8").replace("wind", "mass", 1), encoding="utf-8")
    elif change == "gone":
        path.unlink()
    else:
        write_labels([replace(label, world_id="w000000000000")], tmp_path)
    expected = {"digit": "is changed", "gone": "is missing", "added": "is there but not sealed"}[change]
    with pytest.raises(SealError, match=expected):
        check_seal(tmp_path, sealed)


def test_the_label_of_another_truth_has_another_seal(windy: tuple[World, WorldLabel]) -> None:
    label = windy[1]
    assert seal([label]) != seal([replace(label, energy_kwh={**label.energy_kwh, "T001": 1.0})])
