"""Drives without height get that of the ground or of the road below them, and say so."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
import pytest

from diagnosis.heights.filling import with_heights
from diagnosis.heights.sources import ElevationFiles, GraphHeights
from diagnosis.matching.matched_drives import MatchedDrives
from diagnosis.recordings.notes import NoteKind
from diagnosis.recordings.recording import Detail
from energy.replay.replay import graded
from routing.errors import ImportFailedError
from routing.graph.road_graph import Terrain
from tests.diagnosis.heights.ground import COLUMNS, east_of, eastward, write_ground
from tests.diagnosis.map_drives import steady, streets, whole

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import NDArray

    from diagnosis.recordings.recording import Recording


def slope(east_m: NDArray[np.float64]) -> NDArray[np.float64]:
    return 500.0 + 0.03 * east_m


def filled(recording: Recording, *paths: Path) -> Recording:
    (found,) = with_heights([recording], [ElevationFiles(paths)])
    return found


def note(recording: Recording, kind: NoteKind) -> str:
    (text,) = [found.text for found in recording.notes if found.kind is kind and found.channel == "elevation_m"]
    return text


def road(height_m: dict[int, float] | None = None):
    """Three straight streets of 1 km in a row, from 0 to 3."""
    return streets({k: (1000.0 * k, 0.0) for k in range(4)}, [(0, 1), (1, 2), (2, 3)], height_m=height_m)


# elevation files


def test_drive_on_a_slope_gets_its_height(tmp_path: Path) -> None:
    recording = filled(eastward(), write_ground(tmp_path / "dem.tif", slope))
    assert recording.elevation_m == pytest.approx(slope(east_of(recording)), abs=0.01)
    assert recording.elevation_source == "dem.tif"
    text = "filled in from dem.tif, cells of 44 m, smoothed over 200 m of way; 100% of its way is on it"
    assert note(recording, NoteKind.FILLED) == text


@pytest.mark.parametrize("step_s", [5.0, 25.0, 60.0])
def test_rare_positions_give_the_heights_of_the_positions(tmp_path: Path, step_s: float) -> None:
    recording = filled(eastward(step_s=step_s), write_ground(tmp_path / "dem.tif", slope))
    assert recording.elevation_m == pytest.approx(slope(east_of(recording)), abs=0.01)


def test_noise_of_the_ground_is_smoothed_along_the_way(tmp_path: Path) -> None:
    noise_m = np.random.default_rng(3).normal(0.0, 3.0, COLUMNS)
    path = write_ground(tmp_path / "dem.tif", lambda east_m: slope(east_m) + noise_m)
    grade = graded(filled(eastward(), path).profile()).grade_frac
    # noise of 3 m in cells of 30 m along the way: 3 m · √(30 / 200) over a length of 200 m is 0.6 % of grade
    assert float(np.std(grade - 0.03)) < 0.01
    assert float(np.mean(grade)) == pytest.approx(0.03, abs=0.001)


def test_recorded_height_stays(tmp_path: Path) -> None:
    height_m = np.linspace(0.0, 5.0, eastward().time_s.size)
    recording = filled(eastward(elevation_m=height_m), write_ground(tmp_path / "dem.tif", slope))
    assert recording.elevation_m is height_m
    assert (recording.elevation_source, recording.notes) == ("", ())


def test_mountain_above_a_tunnel_is_bridged(tmp_path: Path) -> None:
    def mountain(east_m: NDArray[np.float64]) -> NDArray[np.float64]:
        return slope(east_m) + np.where(np.abs(east_m - 5000.0) < 600.0, 400.0, 0.0)

    recording = filled(eastward(), write_ground(tmp_path / "dem.tif", mountain))
    # within the 100 m on each side that smoothing mixes with the mountain the road is not known to better than that
    assert recording.elevation_m == pytest.approx(slope(east_of(recording)), abs=12.0)
    assert "are bridged, too steep for a road" in note(recording, NoteKind.FILLED)


def test_ground_that_no_road_follows_is_not_the_drive_s(tmp_path: Path) -> None:
    def peaks(east_m: NDArray[np.float64]) -> NDArray[np.float64]:
        return 500.0 + 300.0 * np.sin(east_m / 150.0)

    recording = filled(eastward(), write_ground(tmp_path / "dem.tif", peaks))
    assert recording.elevation_m is None
    assert "would be too steep for a road, at most 30%" in note(recording, NoteKind.MISSING)


@pytest.mark.parametrize(
    ("void", "kept"),
    [(slice(100, 110), True), (slice(100, 160), False)],  # 300 m, which is bridged, and 1.8 of 8 km
)
def test_ground_without_height_is_bridged_where_it_is_short(tmp_path: Path, void: slice, kept: bool) -> None:
    recording = filled(eastward(), write_ground(tmp_path / "dem.tif", slope, void=void))
    assert (recording.elevation_m is not None) == kept
    if kept:  # the half cells beside the void are mixed with what the reader put into it
        assert recording.elevation_m == pytest.approx(slope(east_of(recording)), abs=0.1)
    else:
        assert note(recording, NoteKind.MISSING) == (
            "not filled in from dem.tif: 77% of its way is on it, 95% are needed"
        )


def test_drive_beside_the_files_stays_without_height(tmp_path: Path) -> None:
    north = replace(eastward(), latitude_deg=np.full(eastward().time_s.size, 49.0))
    recording = filled(north, write_ground(tmp_path / "dem.tif", slope))
    assert recording.elevation_m is None
    assert note(recording, NoteKind.MISSING) == "not filled in from dem.tif: 0% of its way is on it, 95% are needed"


def test_drive_without_positions_is_told(tmp_path: Path) -> None:
    blind = replace(eastward(), latitude_deg=None)
    recording = filled(blind, write_ground(tmp_path / "dem.tif", slope))
    assert note(recording, NoteKind.MISSING) == "not filled in from dem.tif: latitude_deg is not recorded"


def test_sums_of_a_drive_stay_as_they_are(tmp_path: Path) -> None:
    sums = replace(eastward(), latitude_deg=None, longitude_deg=None, detail=Detail.TOTALS)
    assert filled(sums, write_ground(tmp_path / "dem.tif", slope)) is sums


def test_heights_on_both_sides_of_a_gap_are_their_own(tmp_path: Path) -> None:
    drive = eastward()
    kept = (drive.time_s < 100.0) | (drive.time_s >= 200.0)
    channels = {
        name: getattr(drive, name)[kept] for name in ("time_s", "speed_mps", "power_w", "latitude_deg", "longitude_deg")
    }
    recording = filled(replace(drive, **channels, gaps=((99.0, 200.0),)), write_ground(tmp_path / "dem.tif", slope))
    assert recording.elevation_m == pytest.approx(slope(east_of(recording)), abs=0.01)


def test_stray_position_moves_no_height(tmp_path: Path) -> None:
    drive = eastward()
    lon = drive.longitude_deg.copy()
    lon[200] += 0.04  # 3 km
    recording = filled(replace(drive, longitude_deg=lon), write_ground(tmp_path / "dem.tif", slope))
    assert recording.elevation_m == pytest.approx(slope(east_of(recording)), abs=0.01)


def test_first_file_named_wins_and_the_next_one_goes_on(tmp_path: Path) -> None:
    low = write_ground(tmp_path / "low.tif", slope, void=slice(150, COLUMNS))
    high = write_ground(tmp_path / "high.tif", lambda east_m: slope(east_m) + 5.0)
    recording = filled(eastward(), low, high)
    east_m = east_of(recording)
    assert recording.elevation_m[east_m < 4000.0] == pytest.approx(slope(east_m[east_m < 4000.0]), abs=0.01)
    assert recording.elevation_m[east_m > 5000.0] == pytest.approx(slope(east_m[east_m > 5000.0]) + 5.0, abs=0.01)
    assert recording.elevation_source == "low.tif, high.tif"


def test_file_that_is_not_there_is_named(tmp_path: Path) -> None:
    with pytest.raises(ImportFailedError, match=r"gone\.tif: no such file"):
        ElevationFiles((tmp_path / "gone.tif",))


# graphs


def test_matched_drive_gets_the_heights_of_its_links() -> None:
    graph = road({0: 100.0, 1: 130.0, 2: 120.0, 3: 120.0})
    drive = steady(graph, whole(graph, (0, 1, 2, 3)))
    (recording,) = with_heights([drive.recording], [GraphHeights(MatchedDrives(graph))])
    way_m = 10.0 * drive.recording.time_s
    expected = np.interp(way_m, np.arange(4) * float(graph.length_m[0]), [100.0, 130.0, 120.0, 120.0])
    assert recording.elevation_m == pytest.approx(expected, abs=0.5)
    text = "filled in from graph drawn, straight between its nodes; 100% of its way is on it"
    assert note(recording, NoteKind.FILLED) == text


def test_graph_without_terrain_fills_nothing() -> None:
    graph = road()
    level = replace(graph, meta=replace(graph.meta, terrain=Terrain.ABSENT))
    drive = steady(graph, whole(graph, (0, 1, 2, 3)))
    (recording,) = with_heights([drive.recording], [GraphHeights(MatchedDrives(level))])
    assert recording.elevation_m is None
    assert note(recording, NoteKind.MISSING) == "not filled in from graph drawn: it has no heights"


def test_drive_that_leaves_the_graph_stays_without_height() -> None:
    graph = road({0: 100.0, 1: 130.0, 2: 120.0, 3: 120.0})
    drive = steady(graph, whole(graph, (0, 1, 2, 3))).recording
    lat = drive.latitude_deg.copy()
    lat[150:] += 0.02  # 2 km north of the last street and a half
    (recording,) = with_heights([replace(drive, latitude_deg=lat)], [GraphHeights(MatchedDrives(graph))])
    assert recording.elevation_m is None
    assert "of its way is on it, 95% are needed" in note(recording, NoteKind.MISSING)


def test_next_source_fills_what_the_first_does_not_know(tmp_path: Path) -> None:
    graph = road({0: 100.0, 1: 130.0, 2: 120.0, 3: 120.0})
    elsewhere = steady(graph, whole(graph, (0, 1, 2, 3))).recording
    sources = [ElevationFiles((write_ground(tmp_path / "dem.tif", slope),)), GraphHeights(MatchedDrives(graph))]
    done: list[float] = []
    first, second = with_heights([eastward(), elsewhere], sources, done.append)
    assert (first.elevation_source, second.elevation_source) == ("dem.tif", "graph drawn")
    assert [found.kind for found in second.notes] == [NoteKind.MISSING, NoteKind.FILLED]
    assert done == [0.5, 1.0]
