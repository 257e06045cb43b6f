"""Recordings matched to links: the right ones under a receiver's errors, and nothing claimed where none is known."""

from __future__ import annotations

import itertools
from dataclasses import replace

import numpy as np
import pytest

from diagnosis.errors import DiagnosisError
from diagnosis.matching.map_matcher import GapReason, MapMatcher, MatchSettings, NoPositionsError, OutsideMapError
from diagnosis.matching.matched_way import entered_m, smoothed_m
from diagnosis.matching.tracks import headings_rad, odometer_m, positions_deg, thinned
from routing.graph.earth import METRE_PER_DEGREE
from routing.places import LinkSpan, Point
from routing.queries import RouteQuery
from routing.weights import FASTEST
from tests.diagnosis.map_drives import drive_at, drive_planned, link_between, steady, whole

EAST_DEGREE_M = METRE_PER_DEGREE * np.cos(np.radians(45.0))


@pytest.fixture(scope="module")
def matcher(town):
    return MapMatcher(town)


def moved(recording, east_m=0.0, north_m=0.0):
    """The recording with its positions shifted, by the same or each by its own."""
    return replace(
        recording,
        latitude_deg=recording.latitude_deg + north_m / METRE_PER_DEGREE,
        longitude_deg=recording.longitude_deg + east_m / EAST_DEGREE_M,
    )


def without_positions(recording, lost):
    """The recording with no position where lost is true."""
    lat, lon = (np.where(lost, np.nan, x) for x in (recording.latitude_deg, recording.longitude_deg))
    return replace(recording, latitude_deg=lat, longitude_deg=lon)


def links_of(match):
    """Links in driving order, over all stretches."""
    return [int(link) for stretch in match.stretches for link in stretch.links]


def assert_permitted(graph, match):
    for stretch in match.stretches:
        for before, after in itertools.pairwise(stretch.links.tolist()):
            assert after in graph.successors(before)


def assert_consistent(graph, match):
    """Stretches are whole inside, samples lie on their links, and times rise."""
    assert_permitted(graph, match)
    for part in match.stretches:
        length = graph.length_m[part.links]
        assert part.from_m[1:] == pytest.approx(0.0, abs=1e-9)
        assert part.to_m[:-1] == pytest.approx(length[:-1])
        assert 0.0 <= part.from_m[0] < part.to_m[0] <= length[0] + 1e-9
        assert bool((np.diff(part.enter_s) >= 0.0).all())
        assert part.along_m[-1] == pytest.approx((part.to_m - part.from_m).sum())
        here = slice(part.first, part.last + 1)
        assert set(match.link[here].tolist()) <= set(part.links.tolist())
        assert bool((match.position_m[here] <= graph.length_m[match.link[here]] + 1e-9).all())
    inside = np.concatenate([np.arange(part.first, part.last + 1) for part in match.stretches])
    assert np.array_equal(np.flatnonzero(match.link >= 0), inside)


# on a drawn map


@pytest.mark.nojit
def test_exact_positions_give_each_sample_its_link_and_place(town, matcher):
    drive = steady(town, whole(town, [3, 4, 5, 6, 10, 9]))
    match = matcher.match(drive.recording)
    assert_consistent(town, match)
    assert np.array_equal(match.link, drive.link)
    assert match.position_m == pytest.approx(drive.position_m, abs=0.2)  # stored geometry is rounded to 11 mm
    assert match.matched_frac == pytest.approx(1.0)
    assert match.mean_offset_m < 0.02
    assert match.gaps == ()


@pytest.mark.nojit
@pytest.mark.parametrize("east_m", [-1e-6, -1e-9, 1e-9, 1e-6])
def test_sample_at_a_junction_is_on_the_link_that_is_entered_whatever_its_last_bit(town, matcher, east_m):
    drive = steady(town, whole(town, [3, 4, 5, 6, 10, 9]))
    match = matcher.match(moved(drive.recording, east_m))
    assert_consistent(town, match)
    assert np.array_equal(match.link, drive.link)
    assert match.position_m[[20, 40, 60, 80]] == pytest.approx(0.0, abs=1e-4)


@pytest.mark.nojit
@pytest.mark.parametrize("east_m", [-1e-6, -1e-9, 1e-9, 1e-6])
def test_link_is_entered_before_a_stop_at_the_junction_that_it_begins_at(town, matcher, east_m):
    spans = whole(town, [3, 4, 5, 6])
    way_m = np.concatenate((np.arange(0.0, 200.0, 10.0), np.full(60, 200.0), np.arange(210.0, 590.0, 10.0)))
    drive = drive_at(town, spans, np.arange(way_m.size, dtype=np.float64), way_m)
    (stretch,) = matcher.match(moved(drive.recording, east_m)).stretches
    assert stretch.enter_s[1] == pytest.approx(21.0, abs=0.01)  # the speed falls in the two seconds around 20


@pytest.mark.nojit
def test_place_up_to_a_millimetre_before_a_link_is_at_its_beginning():
    begin_m = np.array([0.0, 200.0, 200.0005, 350.0])
    along_m = np.array([0.0, 199.9985, np.nextafter(200.0, 0.0), 200.0, 200.0001, 201.0, 349.9995, 350.0 + 1e-9])
    entered = entered_m(along_m, begin_m)
    assert entered.tolist() == [0.0, 199.9985, 200.0005, 200.0005, 200.0005, 201.0, 350.0, 350.0 + 1e-9]


@pytest.mark.nojit
def test_links_are_entered_when_the_odometer_gets_there(town, matcher):
    spans = whole(town, [3, 4, 5, 6])
    (stretch,) = matcher.match(steady(town, spans, 8.0).recording).stretches
    ends_m = np.cumsum([span.to_m for span in spans])
    assert stretch.enter_s[1:3] == pytest.approx(ends_m[:2] / 8.0, abs=0.05)
    assert stretch.enter_s[0] == 0.0


@pytest.mark.nojit
@pytest.mark.parametrize(("places", "north_m"), [([3, 13, 14, 6], 8.0), ([6, 15, 16, 3], -8.0)])
def test_carriageway_is_told_by_its_direction_where_positions_lie_on_the_other_one(town, matcher, places, north_m):
    drive = steady(town, whole(town, places))
    match = matcher.match(moved(drive.recording, north_m=north_m))
    assert {link_between(town, a, b) for a, b in itertools.pairwise(places)} <= set(links_of(match))
    (other,) = {(13, 14), (15, 16)} - {(places[1], places[2])}
    assert link_between(town, *other) not in links_of(match)


@pytest.mark.nojit
def test_forbidden_turn_is_not_matched_and_reported(town, matcher):
    first, then = (link_between(town, *pair) for pair in ((4, 5), (5, 9)))
    assert then not in town.successors(first)
    spans = whole(town, [3, 4, 5, 9, 8])
    match = matcher.match(steady(town, spans).recording)
    assert_consistent(town, match)
    assert {link_between(town, 3, 4), link_between(town, 9, 8)} <= set(links_of(match))
    (gap,) = match.gaps
    assert gap.reason is GapReason.NO_WAY
    assert 18.0 < gap.begin_s < gap.end_s < 62.0  # near place 5, or on one of the two links that meet there


@pytest.mark.nojit
def test_turning_back_on_a_street_splits_the_match(town, matcher):
    out, back = link_between(town, 3, 4), link_between(town, 4, 3)
    spans = (LinkSpan(out, 0.0, 120.0), LinkSpan(back, 80.0, 200.0), *whole(town, [3, 7]))
    match = matcher.match(steady(town, spans).recording)
    assert_consistent(town, match)
    assert links_of(match) == [out, back, link_between(town, 3, 7)]
    assert [gap.reason for gap in match.gaps] == [GapReason.NO_WAY]
    assert match.matched_frac > 0.85


@pytest.mark.nojit
def test_positions_that_wander_at_standstill_move_nothing(town, matcher):
    spans = whole(town, [3, 4, 5, 6])
    way_m = np.concatenate((np.arange(0.0, 300.0, 10.0), np.full(60, 300.0), np.arange(310.0, 590.0, 10.0)))
    drive = drive_at(town, spans, np.arange(way_m.size, dtype=np.float64), way_m)
    stands = drive.recording.speed_mps == 0.0
    assert stands.sum() > 55
    wander = np.where(stands, 25.0 * np.sin(0.3 * np.arange(way_m.size)), 0.0)
    match = matcher.match(moved(drive.recording, wander, -wander))
    assert links_of(match) == [span.link_idx for span in spans]
    assert np.ptp(match.position_m[stands]) == 0.0
    assert match.position_m[stands][0] == pytest.approx(100.0, abs=10.0)


@pytest.mark.nojit
@pytest.mark.parametrize("repeats", [False, True])
def test_way_without_positions_is_bridged_whether_they_are_missing_or_repeated(town, matcher, repeats):
    drive = steady(town, whole(town, [3, 4, 8, 9, 10, 6]))
    time = drive.recording.time_s
    lost = (time > 15.0) & (time < 55.0)  # two corners
    recording = without_positions(drive.recording, lost)
    if repeats:
        last = np.maximum.accumulate(np.where(lost, 0, np.arange(time.size)))
        lat, lon = recording.latitude_deg[last], recording.longitude_deg[last]
        recording = replace(recording, latitude_deg=lat, longitude_deg=lon)
    match = matcher.match(recording)
    assert np.mean(match.link == drive.link) > 0.98
    assert match.gaps == ()
    assert bool(np.isnan(match.offset_m[lost]).all())


@pytest.mark.nojit
def test_long_way_without_positions_is_a_gap(town):
    matcher = MapMatcher(town, MatchSettings(bridge_m=300.0))
    drive = steady(town, whole(town, [3, 4, 8, 9, 10, 6]))
    time = drive.recording.time_s
    match = matcher.match(without_positions(drive.recording, (time > 15.0) & (time < 55.0)))
    (gap,) = match.gaps
    assert gap.reason is GapReason.NO_POSITIONS
    assert gap.driven_m == pytest.approx(400.0, abs=60.0)  # the odometer leads on for 25 m at either side
    assert len(match.stretches) == 2
    assert match.matched_frac == pytest.approx(1.0 - gap.driven_m / 990.0, abs=0.01)


@pytest.mark.nojit
def test_pause_of_the_recording_is_a_gap_since_its_odometer_is_not_known(town, matcher):
    drive = steady(town, whole(town, [3, 4, 8, 9, 10, 6]))
    kept = (drive.recording.time_s < 25.0) | (drive.recording.time_s > 60.0)
    channels = ("time_s", "speed_mps", "power_w", "latitude_deg", "longitude_deg")
    recording = replace(drive.recording, **{name: getattr(drive.recording, name)[kept] for name in channels})
    match = matcher.match(recording)
    assert [gap.reason for gap in match.gaps] == [GapReason.PAUSE]
    assert np.mean(match.link == drive.link[kept]) > 0.95
    assert len(match.stretches) == 2


@pytest.mark.nojit
def test_pause_at_standstill_is_in_no_stretch(town, matcher):
    spans = whole(town, [3, 4, 5, 6])
    way_m = np.concatenate((np.arange(0.0, 300.0, 10.0), np.full(60, 300.0), np.arange(310.0, 590.0, 10.0)))
    drive = drive_at(town, spans, np.arange(way_m.size, dtype=np.float64), way_m)
    later = drive.recording.time_s + np.where(np.arange(way_m.size) > 60, 500.0, 0.0)
    match = matcher.match(replace(drive.recording, time_s=later))
    assert_consistent(town, match)
    assert len(match.stretches) == 2
    for part in match.stretches:
        assert np.diff(later[part.first : part.last + 1]).max() == 1.0


@pytest.mark.nojit
def test_drive_off_all_roads_lies_on_no_link(town, matcher):
    drive = steady(town, whole(town, [7, 8, 9, 10, 9, 8, 7][:4]))
    time = drive.recording.time_s
    away = np.interp(time, [15.0, 25.0, 40.0, 50.0], [0.0, 300.0, 300.0, 0.0])
    match = matcher.match(moved(drive.recording, north_m=away))
    far = away > 150.0
    assert bool((match.link[far] == -1).all())
    assert bool(np.isnan(match.position_m[far]).all())
    assert [gap.reason for gap in match.gaps] == [GapReason.OFF_ROAD]
    assert len(match.stretches) == 2


@pytest.mark.nojit
def test_single_stray_position_does_not_leave_the_road(town, matcher):
    drive = steady(town, whole(town, [3, 4, 5, 6]))
    stray = np.where(np.arange(drive.recording.time_s.size) == 30, 90.0, 0.0)
    match = matcher.match(moved(drive.recording, north_m=stray))
    assert np.mean(match.link == drive.link) > 0.98
    assert match.gaps == ()


@pytest.mark.nojit
def test_odometer_that_counts_too_much_does_not_matter(town, matcher):
    drive = steady(town, whole(town, [3, 4, 5, 6, 10, 9, 8]), odometer_scale=1.06)
    assert drive.right_frac(matcher.match(drive.recording).link) > 0.97


# what is refused


@pytest.mark.nojit
def test_recording_without_positions_is_an_error_that_names_the_channel(town, matcher):
    recording = steady(town, whole(town, [3, 4])).recording
    with pytest.raises(NoPositionsError, match="'T1': longitude_deg is not recorded") as caught:
        matcher.match(replace(recording, longitude_deg=None))
    assert caught.value.channel == "longitude_deg"
    nowhere = np.full(recording.time_s.size, np.nan)
    with pytest.raises(NoPositionsError, match="without a value in all 20 samples"):
        matcher.match(replace(recording, latitude_deg=nowhere))
    with pytest.raises(NoPositionsError, match="without a value"):  # 0° N 0° E is none
        matcher.match(replace(recording, latitude_deg=0.0 * recording.time_s, longitude_deg=0.0 * recording.time_s))


@pytest.mark.nojit
def test_recording_of_another_place_is_an_error_with_both_bounding_boxes(town, matcher):
    recording = moved(steady(town, whole(town, [3, 4, 5])).recording, east_m=50_000.0)
    with pytest.raises(OutsideMapError, match=r"graph 'drawn', lat 44\.99809\.\.45\.00180, lon 5") as caught:
        matcher.match(recording)
    assert caught.value.bbox[0] == pytest.approx(5.0 + 50_000.0 / EAST_DEGREE_M)
    assert caught.value.map_bbox == town.meta.bbox


@pytest.mark.nojit
def test_recording_that_stands_still_is_matched_to_nothing(town, matcher):
    recording = replace(steady(town, whole(town, [3, 4])).recording, speed_mps=np.zeros(20))
    match = matcher.match(recording)
    assert match.stretches == ()
    assert match.gaps == ()
    assert match.matched_frac == 0.0
    assert bool((match.link == -1).all())


@pytest.mark.nojit
@pytest.mark.parametrize(("field", "value"), [("position_sd_m", ()), ("position_sd_m", (4.0, 0.0)), ("step_m", np.nan)])
def test_settings_that_cannot_be_are_refused(field, value):
    with pytest.raises(DiagnosisError, match=f"{field} is .*, allowed:"):
        MatchSettings(**{field: value})


# parts of the model


@pytest.mark.nojit
def test_headings_are_derived_where_straight_and_the_receivers_own_is_believed_while_moving(town):
    recording = steady(town, whole(town, [3, 4, 8])).recording  # 200 m east, then north
    way = odometer_m(recording)
    _, _, fix = positions_deg(recording)
    at = np.array([10, 20, 30])
    derived = headings_rad(recording, way, fix, at)
    assert derived[[0, 2]] == pytest.approx([np.pi / 2.0, 0.0], abs=0.01)
    assert np.isnan(derived[1])  # the corner: the chord is 0.71 of the way
    slow = np.where(np.arange(way.size) < 20, 0.5, 10.0)
    own = headings_rad(replace(recording, heading_rad=np.full(way.size, 1.0), speed_mps=slow), way, fix, at)
    assert own == pytest.approx([np.pi / 2.0, 1.0, 1.0], abs=0.01)


@pytest.mark.nojit
def test_thinned_samples_are_a_step_apart_and_leave_standstill_out():
    way = np.array([0.0, 5.0, 19.0, 21.0, 21.0, 21.0, 30.0, 41.0, 70.0])
    assert thinned(way, 20.0).tolist() == [0, 3, 7, 8]


@pytest.mark.nojit
def test_smoothing_keeps_an_offset_and_a_scale_of_the_odometer_and_takes_noise_out():
    way = 20.0 * np.arange(200.0)
    truth = 30.0 + 1.02 * way
    assert smoothed_m(way, truth) == pytest.approx(truth, abs=1e-6)
    noisy = truth + np.random.default_rng(3).normal(0.0, 8.0, way.size)
    smooth = smoothed_m(way, noisy)
    assert np.abs(smooth - truth).mean() < 0.25 * np.abs(noisy - truth).mean()
    assert bool((np.diff(smooth) >= 0.0).all())


# on bundled maps


def routes(planner, vehicle, pairs):
    """Stretches of links of the fastest routes between pairs of nodes."""
    graph = planner.graph
    for a, b in pairs:
        start, goal = (Point(float(graph.node_lat_deg[k]), float(graph.node_lon_deg[k])) for k in (a, b))
        query = RouteQuery(start, goal, 1.0, vehicle, weightings=(("fastest", FASTEST),))
        (route,) = planner.route(query).routes
        yield tuple(LinkSpan(link.link_idx, link.from_m, link.to_m) for link in route.links)


def test_town_drives_are_on_the_right_link_for_the_most_part_of_their_way(coquimbo, kona):
    graph, matcher = coquimbo.graph, MapMatcher(coquimbo.graph)
    rng = np.random.default_rng(11)
    fine, coarse = [], []
    for seed, spans in enumerate(routes(coquimbo, kona, rng.integers(0, graph.node_count, (4, 2)))):
        drive = drive_planned(coquimbo, kona, spans, error_sd_m=5.0, odometer_scale=0.98, seed=seed)
        match = matcher.match(drive.recording)
        assert_consistent(graph, match)
        fine.append(drive.right_frac(match.link))
        drive = drive_planned(coquimbo, kona, spans, error_sd_m=10.0, odometer_scale=1.02, seed=seed)
        lost = np.arange(drive.recording.time_s.size) % 5 > 0
        coarse.append(drive.right_frac(matcher.match(without_positions(drive.recording, lost)).link))
    assert np.mean(fine) >= 0.97
    assert np.mean(coarse) >= 0.93


def test_likeliest_error_of_positions_grows_with_theirs(coquimbo, kona):
    (spans,) = routes(coquimbo, kona, [(100, 9000)])
    matches = [
        MapMatcher(coquimbo.graph).match(drive_planned(coquimbo, kona, spans, error_sd_m=sd_m).recording)
        for sd_m in (3.0, 9.0, 20.0)
    ]
    assert [match.position_sd_m for match in matches] == [4.0, 8.0, 16.0]
    assert [match.mean_offset_m for match in matches] == sorted(match.mean_offset_m for match in matches)
