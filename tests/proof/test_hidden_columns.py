"""Real drives with hidden columns: what is compared, and that the tool never sees the columns."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest

from diagnosis.recordings.notes import Note, NoteKind
from diagnosis.recordings.reading import read_recordings
from diagnosis.recordings.recording import Recording
from proof.answers import read_answer
from proof.carriers import HIDDEN, carrier_vehicle, carriers_of
from proof.errors import ProofError
from proof.hidden_columns import (
    correlation,
    figures_of,
    hidden_power_w,
    hidden_trips,
    scored,
    slope,
    split_answered,
    split_seeds,
)
from proof.plans import CarrierOrder, places
from proof.sealed import WORLDS, make_into
from proof.tool import read
from proof.worlds.making import make_world
from proof.worlds.orders import WantedEffect, WorldOrder
from proof.worlds.trips import WorldRegime
from proof.worlds.world import WorldKind, write_world
from tests.proof.made_up import HELD_OUT, answer, trip

if TYPE_CHECKING:
    from pathlib import Path

TIME_S = np.arange(101.0)


def recording(name: str, heater_w: float | None, aircon_w: float | None, *notes: Note) -> Recording:
    """A hundred seconds with constant climate columns."""
    constant = {
        key: None if value is None else np.full(101, value) for key, value in (("h", heater_w), ("a", aircon_w))
    }
    zero = np.zeros(101)
    return Recording(name, TIME_S, zero, zero, heater_w=constant["h"], aircon_w=constant["a"], notes=notes)


@pytest.fixture(scope="module")
def drives(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    """A folder of eight heated drives with a heater column, and the vehicle's file beside it."""
    folder = tmp_path_factory.mktemp("drives")
    regime = WorldRegime(minutes=(5.0, 7.0), air_c=(-10.0, 20.0))
    order = WorldOrder(WorldKind.SINGLE, (WantedEffect("cabin_heating", 0.12),), (10, 10), regime)
    world, label = make_world(order, np.random.SeedSequence(8))
    write_world(world, folder / "all")
    vehicle = (folder / "all" / "vehicle.toml").rename(folder / "vehicle.toml")
    for path in (folder / "all").glob("*.csv"):
        header, *rows = path.read_text(encoding="utf-8").splitlines()
        mean_w = label.effects["cabin_heating"].energy_kwh[path.stem] * 3.6e6 / len(rows)
        rows = [f"{row},{mean_w:.1f},0.0" for row in rows]
        path.write_text("\n".join([f"{header},heater_w,aircon_w", *rows]) + "\n", encoding="utf-8")
    return folder / "all", vehicle


def test_hidden_power_is_the_mean_of_both_columns() -> None:
    assert hidden_power_w(recording("A", 1000.0, 200.0)) == (pytest.approx(1200.0), "")


def test_a_stuck_or_missing_column_leaves_the_trip_out_and_says_why() -> None:
    stuck = Note(NoteKind.STUCK, "heater_w", "taken out")
    assert hidden_power_w(recording("A", None, 300.0, stuck)) == (None, "no column of heater, heater is stuck")
    assert hidden_power_w(recording("A", 300.0, None)) == (None, "no column of air conditioning")


def test_trips_are_averaged_over_the_splits_that_held_them_out() -> None:
    """T3 is held out in both: after 2.2 and 1.9 of 2.0 kWh; 0.5 kWh thermal in 1800 s is 1 kW."""
    both = [answer(trips=(trip("T1"), trip(HELD_OUT[0], after=after))) for after in (2.2, 1.9)]
    fitted, kept = hidden_trips(both, {"T1": (900.0, ""), "T3": (None, "stuck")})
    assert (fitted.held_out, fitted.after_frac, fitted.claimed_held_out_w) == (0, None, None)
    assert (fitted.claimed_w, fitted.hidden_w) == (pytest.approx(1000.0), 900.0)
    assert (kept.held_out, kept.after_frac, kept.why) == (2, pytest.approx(0.075), "stuck")
    assert figures_of((fitted, kept))[1].value == pytest.approx(0.075)


def test_correlation_and_slope_of_a_line_and_of_nothing() -> None:
    line = np.array([[0.0, 100.0], [1000.0, 1000.0], [2000.0, 1900.0]])
    assert (correlation(line), slope(line)) == (pytest.approx(1.0), pytest.approx(0.9))
    same = np.array([[5.0, 1.0], [5.0, 2.0]])
    assert np.isnan(correlation(same))
    assert np.isnan(slope(same))


def test_the_columns_are_hidden_from_the_tool_and_opened_for_scoring(drives: tuple[Path, Path], tmp_path: Path) -> None:
    folder, vehicle = drives
    seen, _ = read_recordings([folder], HIDDEN)
    assert all(recording.heater_w is None and recording.aircon_w is None for recording in seen)
    seeds = split_seeds(4)[:2]
    files = [tmp_path / f"{seed}.json" for seed in seeds]
    for seed, file in zip(seeds, files, strict=True):
        assert split_answered(folder, vehicle, seed, file) == seed
    proof = scored([read_answer(file) for file in files], seeds, folder)
    assert len(proof.trips) == 10
    assert sum(trip.held_out for trip in proof.trips) == 6
    assert all(trip.hidden_w is not None for trip in proof.trips)
    held_out_error = {figure.name: figure for figure in proof.figures}
    before, after = (held_out_error[f"held-out MAPE from recorded speed, {when}"].value for when in ("before", "after"))
    assert before is not None
    assert after is not None
    assert after < before


def test_a_split_that_was_answered_is_not_asked_again(drives: tuple[Path, Path], tmp_path: Path) -> None:
    file = tmp_path / "one.json"
    split_answered(*drives, 1, file)
    before = file.stat().st_mtime_ns
    split_answered(*drives, 1, file)
    assert file.stat().st_mtime_ns == before


def test_splits_differ_and_follow_the_seed() -> None:
    assert len(set(split_seeds(1))) == 10
    assert split_seeds(1) == split_seeds(1) != split_seeds(2)


def test_carriers_keep_the_energy_of_the_drives_and_lose_climate_columns(drives: tuple[Path, Path]) -> None:
    folder, vehicle = drives
    carried = {carrier.id: carrier for carrier in carriers_of(folder)}
    for recording in read_recordings([folder])[0]:
        channels = carried[recording.id].channels
        assert set(channels) == {"time_s", "speed_kmh", "power_w", "elevation_m", "ambient_c", *_optional(recording)}
        energy_j = np.trapezoid(channels["power_w"], channels["time_s"])
        assert energy_j == pytest.approx(recording.energy_j(), rel=0.03)
    car = carrier_vehicle(vehicle)
    assert 900.0 < car.mass_kg < 2700.0
    assert 0.3 < car.drag_area_m2 < 1.2


def test_a_carrier_world_is_read_like_any_other_and_does_not_tell_what_carried_it(
    drives: tuple[Path, Path], tmp_path: Path
) -> None:
    folder, vehicle = drives
    named = tmp_path / "some-car.toml"
    named.write_text(vehicle.read_text(encoding="utf-8").replace('id = "vehicle"', 'id = "some-car"'), encoding="utf-8")
    world_id = make_into(places((CarrierOrder(folder, named, WantedEffect("wet_road", 0.05)),), 2)[0], tmp_path)
    assert world_id is not None
    recordings, car, _ = read(tmp_path / WORLDS / world_id)
    assert (car.id, len(recordings)) == ("vehicle", 10)
    assert all(recording.wet_frac is not None for recording in recordings)


def _optional(recording: Recording) -> set[str]:
    return {"battery_c" for _ in [0] if recording.battery_k is not None} | {
        "soc_frac" for _ in [0] if recording.soc_frac is not None
    }


def test_a_folder_without_whole_drives_carries_nothing(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text("time_s,speed_kmh,power_w\n0,0,1\n1,0,1\n2,0,1\n", encoding="utf-8")
    with pytest.raises(ProofError, match="drives with height and temperature"):
        carriers_of(tmp_path)
