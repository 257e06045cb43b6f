"""Residuals by place: found where they were planted, nothing lost on the way, and maps that viewers read."""

from __future__ import annotations

import json
import math
from dataclasses import replace

import numpy as np
import pytest
import shapely
from scipy import stats

from diagnosis.answer.places import COLOURS, TripResidual, colour, link_features, link_residuals
from diagnosis.errors import DiagnosisError
from diagnosis.matching.map_matcher import MapMatcher
from tests.diagnosis.map_drives import link_between, steady, streets, whole

pytestmark = pytest.mark.nojit

# 1 --- 2 --- 3 --- 4, 500 m each
ROAD = {k: (500.0 * (k - 1), 0.0) for k in range(1, 5)}


@pytest.fixture(scope="module")
def road():
    return streets(ROAD, [(1, 2), (2, 3), (3, 4)])


@pytest.fixture(scope="module")
def matcher(road):
    return MapMatcher(road)


def driven(graph, matcher, trip_id, places=(1, 2, 3, 4), power_w=lambda link: 0.0 * link, speed_mps=10.0):
    """A matched drive with a residual power that depends on the link."""
    drive = steady(graph, whole(graph, places), speed_mps, trip_id=trip_id)
    time_s = drive.recording.time_s
    residual = TripResidual(trip_id, time_s, power_w(drive.link[:-1]) * np.diff(time_s))
    return residual, matcher.match(drive.recording), drive.recording


def test_power_planted_on_one_link_is_found_on_that_link(road, matcher):
    middle = link_between(road, 2, 3)
    trips = [
        driven(road, matcher, f"T{k}", power_w=lambda link: np.where(link == middle, 900.0, 0.0)) for k in range(3)
    ]
    found = {residual.place: residual for residual in link_residuals([(trip, match) for trip, match, _ in trips])}
    assert set(found) == {link_between(road, k, k + 1) for k in (1, 2, 3)}
    there = found[middle]
    assert there.trips == there.passes == 3
    assert there.mean_w == pytest.approx(900.0, rel=0.02)  # a step of a second belongs to both links at their border
    assert there.wh_per_km == pytest.approx(900.0 / 3600.0 / 10.0 * 1000.0, rel=0.02)
    assert there.distance_m == pytest.approx(1500.0, abs=0.1)
    assert there.duration_s == pytest.approx(150.0, abs=0.5)
    assert there.departs
    for place in set(found) - {middle}:
        assert abs(found[place].mean_w) < 20.0


def test_energy_on_all_links_is_that_of_the_matched_steps(road, matcher):
    rng = np.random.default_rng(2)
    trip, match, recording = driven(road, matcher, "T1")
    trip = replace(trip, residual_j=rng.normal(0.0, 3000.0, trip.residual_j.size))
    assert match.matched_frac == pytest.approx(1.0)
    found = link_residuals([(trip, match)])
    assert sum(residual.energy_j for residual in found) == pytest.approx(trip.residual_j.sum())
    assert sum(residual.duration_s for residual in found) == pytest.approx(recording.time_s[-1])
    assert sum(residual.distance_m for residual in found) == pytest.approx(recording.distance_m())


def test_both_directions_of_a_road_are_places_of_their_own(road, matcher):
    there = driven(road, matcher, "out", power_w=lambda link: 500.0 + 0.0 * link)
    back = driven(road, matcher, "back", places=(4, 3, 2, 1), power_w=lambda link: -500.0 + 0.0 * link)
    found = {residual.place: residual.mean_w for residual in link_residuals([there[:2], back[:2]])}
    assert found[link_between(road, 2, 3)] == pytest.approx(500.0)
    assert found[link_between(road, 3, 2)] == pytest.approx(-500.0)


def test_interval_takes_the_trip_as_the_unit(road, matcher):
    powers = (200.0, 500.0, 350.0, 800.0)
    trips = [driven(road, matcher, f"T{k}", power_w=lambda link, w=w: w + 0.0 * link) for k, w in enumerate(powers)]
    link = link_between(road, 2, 3)
    (found,) = [residual for residual in link_residuals([trip[:2] for trip in trips]) if residual.place == link]
    # trips of one length: the jackknife of their mean is the standard error of the mean
    half = stats.t.ppf(0.975, 3) * np.std(powers, ddof=1) / 2.0
    assert found.mean_w == pytest.approx(np.mean(powers))
    assert found.mean_w_ci95 == pytest.approx((np.mean(powers) - half, np.mean(powers) + half))
    (alone,) = [residual for residual in link_residuals([trips[0][:2]]) if residual.place == link]
    assert alone.mean_w_ci95 is None
    assert not alone.departs


def test_passes_count_each_time_and_trips_once(road, matcher):
    loop = {**ROAD, 5: (500.0, 300.0), 6: (1000.0, 300.0)}
    graph = streets(loop, [(1, 2), (2, 3), (3, 4), (3, 6), (6, 5), (5, 2)])
    places = (1, 2, 3, 6, 5, 2, 3, 4)
    trip, match, _ = driven(graph, MapMatcher(graph), "T1", places=places)
    found = {residual.place: residual for residual in link_residuals([(trip, match)])}
    twice = found[link_between(graph, 2, 3)]
    assert (twice.trips, twice.passes) == (1, 2)
    assert twice.distance_m == pytest.approx(1000.0, abs=1.0)


def test_features_are_geojson_with_the_roads_own_lines(road, matcher):
    trips = [driven(road, matcher, f"T{k}", power_w=lambda link: 40.0 * (link - 2.0)) for k in range(3)]
    residuals = link_residuals([trip[:2] for trip in trips])
    collection = json.loads(json.dumps(link_features(residuals, road), allow_nan=False))
    assert collection["type"] == "FeatureCollection"
    assert len(collection["features"]) == len(residuals) == 3
    for feature, residual in zip(collection["features"], residuals, strict=True):
        assert feature["type"] == "Feature"
        line = shapely.geometry.shape(feature["geometry"])
        assert np.array(line.coords) == pytest.approx(road.geometry(residual.place), abs=1e-7)
        properties = feature["properties"]
        assert properties["link"] == residual.place
        assert properties["mean_w"] == pytest.approx(residual.mean_w, abs=0.05)
        assert properties["ci95"][0] <= properties["mean_w"] + 0.05
        assert (properties["trips"], properties["passes"]) == (3, 3)
        assert properties["stroke"] in COLOURS
        assert set(properties) >= {"wh_per_km", "energy_wh", "stroke-opacity", "stroke-width"}


def test_colour_is_blue_below_red_above_and_pale_in_the_middle():
    assert colour(0.0, 100.0) == COLOURS[4] == "#f7f7f7"
    assert colour(-500.0, 100.0) == colour(-100.0, 100.0) == COLOURS[0]
    assert colour(100.0, 100.0) == COLOURS[-1]
    assert colour(50.0, 100.0) == COLOURS[6]
    assert colour(5.0, 0.0) == COLOURS[4]


def test_place_where_nothing_moved_has_no_consumption_for_its_length(road, matcher):
    trip, match, _ = driven(road, matcher, "T1", places=(1, 2), power_w=lambda link: 300.0 + 0.0 * link)
    (stretch,) = match.stretches
    standing = replace(match, stretches=(replace(stretch, to_m=stretch.from_m),))
    (found,) = link_residuals([(trip, standing)])
    assert found.mean_w == pytest.approx(300.0)
    assert math.isnan(found.wh_per_km)
    (feature,) = json.loads(json.dumps(link_features([found], road), allow_nan=False))["features"]
    assert feature["properties"]["wh_per_km"] is None


@pytest.mark.parametrize(
    ("time_s", "residual_j", "message"),
    [
        ([0.0, 1.0], [1.0, 2.0], "time_s of trip 'T1' has 2 edges, allowed: 3"),
        ([0.0, 1.0, 1.0], [1.0, 2.0], "allowed: rising"),
        ([0.0, 1.0, 2.0], [1.0, math.nan], "residual_j of trip 'T1', step 1, is not finite"),
    ],
)
def test_residual_that_cannot_be_is_refused(time_s, residual_j, message):
    with pytest.raises(DiagnosisError, match=message):
        TripResidual("T1", np.array(time_s), np.array(residual_j))


def test_trips_that_do_not_belong_together_are_refused(road, matcher):
    trip, match, _ = driven(road, matcher, "T1")
    other = replace(trip, trip_id="T2")
    with pytest.raises(DiagnosisError, match="trip 'T2' comes with the match of recording 'T1'"):
        link_residuals([(other, match)])
    with pytest.raises(DiagnosisError, match="trip 'T1' is there 2 times"):
        link_residuals([(trip, match), (trip, match)])
