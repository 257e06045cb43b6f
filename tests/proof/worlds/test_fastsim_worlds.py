from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest

from diagnosis.recordings.reading import read_recording
from energy.replay.replay import replay
from energy.vehicle.files import load_vehicle
from proof.worlds.fastsim_worlds import START_LIMIT_W, FastsimOrder, fastsim_world
from proof.worlds.world import World, write_world

if TYPE_CHECKING:
    from pathlib import Path

SEED = 4


def residual_share(world: World, folder: Path) -> tuple[np.ndarray, np.ndarray]:
    """What the nameplate's replay misses of each trip [-], and the trip's air temperature [°C]."""
    write_world(world, folder)
    vehicle = load_vehicle(folder / "vehicle.toml")
    drives = [read_recording(path) for path in sorted(folder.glob("*.csv"))]
    missed = [1.0 - replay(vehicle, drive.profile()).energy_j / drive.energy_j() for drive in drives]
    return np.array(missed), np.array([recording.channels["ambient_c"].mean() for recording in world.recordings])


def test_without_climate_the_nameplate_fits_fastsims_drives(tmp_path: Path) -> None:
    world, label = fastsim_world(FastsimOrder(climate=False, trips=(6, 6)), np.random.SeedSequence(SEED))
    missed, _ = residual_share(world, tmp_path)
    assert np.abs(missed).max() < 0.08
    assert (label.families, dict(label.effects)) == ((), {})


def test_with_climate_the_replay_misses_what_the_label_says(tmp_path: Path) -> None:
    world, label = fastsim_world(FastsimOrder(climate=True, trips=(6, 6)), np.random.SeedSequence(SEED))
    missed, air_c = residual_share(world, tmp_path)
    truth = label.effects["cabin_climate"]
    hidden = np.array([truth.energy_kwh[trip] / label.energy_kwh[trip] for trip in label.energy_kwh])
    assert label.families == ("thermal",)
    assert missed == pytest.approx(hidden, abs=0.06)
    assert missed[np.argmin(air_c)] > 0.2


def test_the_heaters_start_is_limited(tmp_path: Path) -> None:
    order = FastsimOrder(climate=True, trips=(3, 3), air_c=(-10.0, -5.0))
    world, _ = fastsim_world(order, np.random.SeedSequence(SEED))
    for recording in world.recordings:
        standing = recording.channels["speed_kmh"][:4] == 0.0
        assert recording.channels["power_w"][:4][standing].max() < START_LIMIT_W + 600.0
