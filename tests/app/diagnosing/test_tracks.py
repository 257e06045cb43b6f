"""Recorded tracks: places at times, and residuals along stretches of them."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from app.diagnosing import tracks
from app.diagnosing.order import Diagnosed
from app.diagnosing.timelines import MOST_POINTS, trip_timeline
from app.diagnosing.tracks import places_at, track_features
from diagnosis.answer.results import TripAccount, TripTimeline
from diagnosis.recordings.reading import Recording
from routing.graph.earth import METRE_PER_DEGREE
from tests.app.conversions.test_learned_effects import NOTHING

if TYPE_CHECKING:
    from numpy.typing import NDArray

SPEED_MPS = 10.0
CLOCK_S = 5000.0


def northward(duration_s: int = 300, *, trip_id: str = "north", step_s: int = 1) -> Recording:
    """A drive from 45° N 5° E to the north at 10 m/s, a sample a second, a position each step_s."""
    time_s = np.arange(float(duration_s + 1))
    lat = 45.0 + SPEED_MPS * time_s / METRE_PER_DEGREE
    lat[time_s % step_s != 0.0] = np.nan
    return Recording(
        id=trip_id,
        time_s=CLOCK_S + time_s,
        speed_mps=np.full(time_s.size, SPEED_MPS),
        power_w=np.full(time_s.size, 1000.0),
        latitude_deg=lat,
        longitude_deg=np.full(time_s.size, 5.0),
    )


def account(recording: Recording, more_w: NDArray[np.float64] | None = None) -> TripAccount:
    """A trip's windows of 10 s, as a diagnosis has them, with so much power more than modelled in each."""
    seconds = float(recording.time_s[-1] - recording.time_s[0])
    begin_s = np.arange(0.0, seconds, 10.0)
    more_w = np.zeros(begin_s.size) if more_w is None else more_w
    constant = np.full(begin_s.size, 1000.0)
    timeline = TripTimeline(
        begin_s=begin_s + 4.5,  # the mean of ten steps' beginnings
        duration_s=np.full(begin_s.size, 10.0),
        speed_mps=np.full(begin_s.size, SPEED_MPS),
        measured_w=constant + more_w,
        before_w=constant,
        after_w=constant,
    )
    kwh = dict.fromkeys(("measured_kwh", "nameplate_kwh", "before_kwh", "after_kwh", "explained_kwh"), 1.0)
    return TripAccount(
        recording.id,
        held_out=False,
        ambient_c=None,
        distance_km=seconds * SPEED_MPS / 1000.0,
        duration_s=seconds,
        by_family_kwh={},
        timeline=timeline,
        **kwh,
    )


def features(*trips: tuple[TripAccount, Recording]) -> list[dict[str, Any]]:
    diagnosis = replace(NOTHING, trips=tuple(trip for trip, _ in trips))
    collection = track_features(Diagnosed(diagnosis, tuple(recording for _, recording in trips), ()))
    found: list[dict[str, Any]] = collection["features"]
    return found


def test_place_between_two_positions_follows_the_odometer() -> None:
    places = places_at(northward(step_s=20), CLOCK_S + np.array([0.0, 25.0, 300.0]))
    assert places is not None
    assert (places[:, 0] - 45.0) * METRE_PER_DEGREE == pytest.approx([0.0, 250.0, 3000.0], abs=0.01)
    assert places[:, 1] == pytest.approx([5.0, 5.0, 5.0])


def test_place_within_a_longer_dropout_or_beyond_the_ends_is_not_known() -> None:
    recording = northward()
    assert recording.latitude_deg is not None
    lat = recording.latitude_deg.copy()
    lat[100:130] = np.nan  # 310 m from the last position before to the first one after
    lat[:20] = np.nan
    places = places_at(replace(recording, latitude_deg=lat), CLOCK_S + np.array([10.0, 18.0, 99.0, 115.0, 131.0]))
    assert places is not None
    assert np.isnan(places[:, 0]).tolist() == [True, False, False, True, False]


def test_recording_without_positions_has_no_places_and_no_stretches() -> None:
    blind = replace(northward(), latitude_deg=None, longitude_deg=None)
    assert places_at(blind, blind.time_s) is None
    assert features((account(blind), blind)) == []


def test_stretches_are_whole_windows_of_at_least_250_m_and_share_out_all_energy() -> None:
    recording = northward()
    more_w = np.arange(30.0)
    found = features((account(recording, more_w), recording))
    assert [stretch["properties"]["t_s"] for stretch in found] == [
        30.0 * k for k in range(10)
    ]  # 300 m of three windows each
    assert [stretch["properties"]["mean_w"] for stretch in found] == [3.0 * k + 1.0 for k in range(10)]
    assert sum(stretch["properties"]["energy_wh"] for stretch in found) == pytest.approx(
        10.0 * more_w.sum() / 3600.0, abs=0.01
    )
    # 1 W at 36 km/h is 1/36 Wh/km
    assert found[3]["properties"]["wh_per_km"] == pytest.approx(10.0 / 36.0, abs=0.005)
    for k, stretch in enumerate(found):
        line = np.array(stretch["geometry"]["coordinates"])
        ends_m = (line[[0, -1], 1] - 45.0) * METRE_PER_DEGREE
        assert ends_m == pytest.approx([300.0 * k, 300.0 * (k + 1)], abs=0.2)
        assert line.shape[0] <= 14


def test_short_rest_of_a_track_joins_the_stretch_before_it() -> None:
    recording = northward(310)  # 100 m more than ten stretches
    found = features((account(recording), recording))
    assert [stretch["properties"]["duration_s"] for stretch in found] == [*[30.0] * 9, 40.0]


def test_stretch_ends_where_positions_are_missing() -> None:
    recording = northward()
    assert recording.latitude_deg is not None
    lat = recording.latitude_deg.copy()
    lat[100:141] = np.nan
    gappy = replace(recording, latitude_deg=lat)
    spans = [
        (stretch["properties"]["t_s"], stretch["properties"]["t_s"] + stretch["properties"]["duration_s"])
        for stretch in features((account(gappy), gappy))
    ]
    # 99 s is the last position before the gap and 141 s the first one after it
    assert all(end <= 100.0 or begin >= 140.0 for begin, end in spans)
    assert max(end for _, end in spans) == 300.0


def test_stretches_grow_where_there_would_be_too_many(monkeypatch: pytest.MonkeyPatch) -> None:
    recording = northward()
    monkeypatch.setattr(tracks, "MOST_STRETCHES", 5)
    assert len(features((account(recording), recording))) == 5


def test_stretches_are_red_where_more_was_measured_and_blue_where_less() -> None:
    recording = northward(60)
    first, last = features((account(recording, np.repeat([-500.0, 500.0], 3)), recording))
    assert (first["properties"]["stroke"], last["properties"]["stroke"]) == ("#2166ac", "#b2182b")


def test_car_that_stands_has_no_stretch() -> None:
    recording = northward()
    standing = replace(
        recording, speed_mps=np.zeros_like(recording.time_s), latitude_deg=np.full(recording.time_s.size, 45.0)
    )
    assert features((account(standing), standing)) == []


@pytest.mark.parametrize(("windows", "merged"), [(600, 1), (601, 2), (1805, 4)])
def test_long_trip_has_at_most_600_points_that_keep_its_energy(windows: int, merged: int) -> None:
    recording = northward(10 * windows)
    trip = account(recording, np.arange(float(windows)))
    timeline = trip_timeline(trip, recording)
    assert len(timeline.t_s) == -(-windows // merged) <= MOST_POINTS
    assert timeline.t_s[1] == 10.0 * merged
    energy_j = np.dot(timeline.measured_w, timeline.duration_s)
    assert energy_j == pytest.approx(10.0 * trip.timeline.measured_w.sum(), rel=1e-4)
    assert timeline.lat is not None
    # the middle of the first point
    assert timeline.lat[0] == pytest.approx(45.0 + 5.0 * merged * SPEED_MPS / METRE_PER_DEGREE, abs=1e-6)


def test_trip_without_a_window_has_a_timeline_without_points() -> None:
    recording = northward()
    trip = account(recording)
    nothing = TripTimeline(*(np.empty(0) for _ in range(6)))
    timeline = trip_timeline(replace(trip, timeline=nothing), recording)
    assert (timeline.t_s, timeline.measured_w, timeline.lat) == ([], [], [])
