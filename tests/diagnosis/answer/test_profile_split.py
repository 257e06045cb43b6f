"""Planning error and model error told apart: each planted alone shows in its own place."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from diagnosis.answer.profile_split import NothingMatchedError, profile_split, profile_table, stop_count
from diagnosis.answer.results import ProfileSplit
from diagnosis.errors import DiagnosisError
from diagnosis.matching.map_matcher import MapMatcher
from energy.conditions import Conditions
from energy.replay.replay import DrivenProfile, replay
from routing.graph.files import load_graph
from routing.places import LinkSpan, Point
from routing.planner import Planner
from routing.queries import RouteQuery
from routing.weights import FASTEST
from tests.diagnosis.map_drives import drive_at, drive_planned, streets, whole

J_PER_KWH = 3.6e6
# 1 --- 2 --- 3 --- 4 --- 5, 1 km each; 40 m up to 3 and down again
PLACES = {k: (1000.0 * (k - 1), 0.0) for k in range(1, 6)}
HEIGHT_M = {1: 0.0, 2: 20.0, 3: 40.0, 4: 20.0, 5: 0.0}


@pytest.fixture(scope="module")
def hill():
    return Planner(streets(PLACES, [(k, k + 1) for k in range(1, 5)], height_m=HEIGHT_M))


@pytest.fixture(scope="module")
def matcher(hill):
    return MapMatcher(hill.graph)


def measured(recording, vehicle, height_m, factor=1.0, conditions=None):
    """The recording with the power that the model takes at its speed and heights, times a factor."""
    conditions = conditions or Conditions()
    profile = DrivenProfile(recording.time_s, recording.speed_mps, elevation_m=height_m)
    result = replay(vehicle, profile, conditions=conditions, smoothing_m=1.0)
    middle_s = 0.5 * (recording.time_s[1:] + recording.time_s[:-1])
    return replace(recording, power_w=factor * np.interp(recording.time_s, middle_s, result.power_w))


def heights(graph, drive):
    tail, head = graph.node_height_m[graph.tail], graph.node_height_m[graph.head]
    share = drive.position_m / graph.length_m[drive.link]
    return tail[drive.link] + share * (head - tail)[drive.link]


def drive_as_planned(hill, kona):
    return drive_planned(hill, kona, whole(hill.graph, (1, 2, 3, 4, 5)))


def test_drive_as_planned_by_a_true_model_has_neither_error(hill, matcher, kona):
    drive = drive_as_planned(hill, kona)
    recording = measured(drive.recording, kona, heights(hill.graph, drive))
    split = profile_split(recording, matcher.match(recording), hill, kona)
    assert split.trip_id == "T1"
    assert split.driven_kwh == pytest.approx(split.measured_kwh, rel=0.01)
    assert split.planned_kwh == pytest.approx(split.driven_kwh, rel=0.02)
    assert split.planned_s == pytest.approx(split.driven_s, rel=0.02)
    assert split.planned_stops == split.driven_stops == 0


def test_wrong_model_shows_between_replay_and_measurement_alone(hill, matcher, kona):
    drive = drive_as_planned(hill, kona)
    plain = measured(drive.recording, kona, heights(hill.graph, drive))
    loaded = measured(drive.recording, kona, heights(hill.graph, drive), factor=1.2)
    match = matcher.match(plain)
    true, wrong = (profile_split(recording, match, hill, kona) for recording in (plain, loaded))
    assert (wrong.planned_kwh, wrong.driven_kwh) == (true.planned_kwh, true.driven_kwh)
    assert wrong.measured_kwh == pytest.approx(1.2 * true.measured_kwh)


def test_slower_drive_with_stops_shows_between_plan_and_replay_alone(hill, matcher, kona):
    spans = whole(hill.graph, (1, 2, 3, 4, 5))
    time_s = np.arange(0.0, 900.0)
    # 8 m/s, standing still for a minute at 1500 m and at 2500 m
    way_m = 8.0 * np.interp(time_s, [0.0, 187.0, 247.0, 372.0, 432.0, 619.0], [0.0, 187.0, 187.0, 312.0, 312.0, 499.0])
    drive = drive_at(hill.graph, spans, time_s[:619], way_m[:619])
    recording = measured(drive.recording, kona, heights(hill.graph, drive))
    split = profile_split(recording, matcher.match(recording), hill, kona)
    assert split.driven_stops == 2
    assert split.planned_stops == 0.0
    assert split.driven_s == pytest.approx(618.0, abs=2.0)
    assert split.planned_s == pytest.approx(4000.0 / (50.0 / 3.6), rel=0.05)
    assert split.driven_kwh == pytest.approx(split.measured_kwh, rel=0.02)
    assert split.planned_kwh > 1.05 * split.driven_kwh  # 50 km/h against 29


def test_climb_of_the_way_is_in_plan_and_replay(hill, matcher, kona):
    spans = whole(hill.graph, (1, 2, 3))
    drive = drive_at(hill.graph, spans, np.arange(200.0), 10.0 * np.arange(200.0), odometer_scale=0.97)
    recording = replace(drive.recording, id="up")
    flat = Planner(streets(PLACES, [(k, k + 1) for k in range(1, 5)]))
    match = matcher.match(recording)
    up = profile_split(recording, match, hill, kona)
    level = profile_split(recording, match, flat, kona)
    rise_kwh = (kona.mass_kg * 9.81 * 39.8 / kona.drive_eff) / J_PER_KWH  # 1990 m of 2000 driven
    assert up.driven_kwh - level.driven_kwh == pytest.approx(rise_kwh, rel=0.03)
    assert up.planned_kwh - level.planned_kwh == pytest.approx(rise_kwh, rel=0.03)


def test_conditions_act_on_plan_and_replay_alike(hill, matcher, kona):
    drive = drive_as_planned(hill, kona)
    match = matcher.match(drive.recording)
    still = profile_split(drive.recording, match, hill, kona)
    idle = profile_split(drive.recording, match, hill, kona, conditions=Conditions(aux_power_w=3000.0))
    more_w = (3000.0 - kona.aux_power_w) / kona.aux_move_eff
    assert idle.driven_kwh - still.driven_kwh == pytest.approx(more_w * still.driven_s / J_PER_KWH, rel=0.01)
    assert idle.planned_kwh - still.planned_kwh == pytest.approx(more_w * still.planned_s / J_PER_KWH, rel=0.01)


def test_only_what_was_matched_is_compared(hill, matcher, kona):
    drive = drive_as_planned(hill, kona)
    lost = np.where((drive.recording.time_s > 100.0) & (drive.recording.time_s < 200.0), 0.01, 0.0)  # a km off
    recording = replace(drive.recording, latitude_deg=drive.recording.latitude_deg + lost)
    match = matcher.match(recording)
    assert len(match.stretches) == 2
    split = profile_split(recording, match, hill, kona)
    kept_s = sum(recording.time_s[part.last] - recording.time_s[part.first] for part in match.stretches)
    assert split.driven_s == pytest.approx(kept_s)
    assert split.measured_kwh == pytest.approx(1000.0 * kept_s / J_PER_KWH)
    # the second stretch begins at speed, so it is planned without a start from rest
    assert split.planned_s == pytest.approx(split.driven_s, rel=0.05)


def test_recording_that_lies_on_no_link_is_an_error_that_says_why(hill, matcher, kona):
    drive = drive_as_planned(hill, kona)
    away = replace(drive.recording, latitude_deg=drive.recording.latitude_deg + 0.01)
    inside = np.where(np.arange(away.time_s.size) == 5, drive.recording.latitude_deg, away.latitude_deg)
    away = replace(away, latitude_deg=inside)
    with pytest.raises(NothingMatchedError, match=r"recording 'T1' lies on no link \(off_road\)"):
        profile_split(away, matcher.match(away), hill, kona)
    with pytest.raises(DiagnosisError, match="recording 'T2' comes with the match of recording 'T1'"):
        profile_split(replace(drive.recording, id="T2"), matcher.match(drive.recording), hill, kona)


@pytest.mark.parametrize(
    ("speed_mps", "stops"),
    [
        ([0.0, 0.0, 10.0, 10.0, 0.0], 0),  # where it begins and ends is none
        ([0.0, 10.0, 0.0, 0.0, 10.0, 0.0], 1),
        ([10.0, 0.0, 1.0, 0.0, 1.0, 10.0], 1),  # creeping is the same stop
        ([10.0, 1.0, 10.0], 0),  # slow, but never still
        ([5.0, 0.2, 5.0, 0.2, 5.0], 2),
    ],
)
def test_stops_are_counted_where_the_drive_goes_on(speed_mps, stops):
    assert stop_count(np.array(speed_mps)) == stops


def test_table_tells_errors_apart_by_cause():
    splits = [
        ProfileSplit("a", 2.2, 2.0, 1.6, 900.0, 1000.0, 3.0, 4),
        ProfileSplit("b", 1.8, 2.0, 1.6, 1100.0, 1000.0, 5.0, 4),
        ProfileSplit("c", 1.6, 1.6, 1.6, 1000.0, 1000.0, 2.0, 0),  # without stops: not in their row
    ]
    rows = {line.split(" | ")[0].strip("| "): line for line in profile_table(splits).splitlines()[2:]}
    assert set(rows) >= {"energy: profile", "energy: vehicle model", "energy: both together", "travel time", "stops"}
    assert rows["energy: profile"].startswith("| energy: profile | 3 | +0.0 %")
    assert "| 3 | +16.7 % |" in rows["energy: vehicle model"]
    assert "| 3 | +16.7 % |" in rows["energy: both together"]
    assert rows["travel time"].endswith("| 10.0 % |")
    assert rows["stops"].startswith("| stops | 2 | +0.0 % |")
    assert "| 1 | +37.5 % | – | – |" in profile_table(splits[:1]).splitlines()[4]


def test_split_on_a_bundled_map_closes_between_plan_and_measurement(kona):
    planner = Planner(load_graph(Path(__file__).parents[3] / "data/graphs/highlands"))
    graph = planner.graph
    start, goal = (Point(float(graph.node_lat_deg[k]), float(graph.node_lon_deg[k])) for k in (4000, 4300))
    (route,) = planner.route(RouteQuery(start, goal, 1.0, kona, weightings=(("fastest", FASTEST),))).routes
    spans = tuple(LinkSpan(link.link_idx, link.from_m, link.to_m) for link in route.links)
    drive = drive_planned(planner, kona, spans, error_sd_m=5.0, odometer_scale=1.02)
    recording = measured(drive.recording, kona, heights(graph, drive))
    split = profile_split(recording, MapMatcher(graph).match(recording), planner, kona)
    assert split.planned_kwh == pytest.approx(route.energy_j / J_PER_KWH, rel=0.03)
    assert split.driven_kwh == pytest.approx(split.measured_kwh, rel=0.03)
