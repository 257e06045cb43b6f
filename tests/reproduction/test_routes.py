"""The rebuilt routes have what the source prints of them, and nothing in them depends on a result."""

from __future__ import annotations

import itertools
from pathlib import Path

import numpy as np
import pytest

from energy.chain.chain import LinkModel, StopRule, simulate_chain
from energy.vehicle.files import load_vehicle
from energy.vehicle.vehicle import Vehicle
from reproduction.published import TABLE_IV, TRIP_COUNT, TYPE_OF, RouteType, SourceRoute
from reproduction.routes import SOURCE_RUNS, source_route
from reproduction.runs import SourceModel, drive_source_trips, route_energies_j, type_averages

SEEDS = (1, 2, 3)
VEHICLES = Path(__file__).resolve().parents[2] / "data" / "vehicles"


@pytest.fixture(scope="module")
def kona() -> Vehicle:
    """The source's car as bundled."""
    vehicle = load_vehicle(VEHICLES / "hyundai-kona-64.toml")
    assert isinstance(vehicle, Vehicle)
    return vehicle


@pytest.mark.parametrize("route", SourceRoute)
@pytest.mark.parametrize("seed", SEEDS)
def test_route_has_the_distance_stops_and_standstill_of_table_iv(route, seed):
    chain = source_route(route, seed)
    published = TABLE_IV[TYPE_OF[route]]
    assert chain.length_m.sum() == pytest.approx(1000.0 * published.distance_km)
    assert set(chain.stop_probability_frac) == {0.0, 1.0}
    assert chain.stop_probability_frac.sum() == published.stops
    assert chain.stop_probability_frac[-1] == 0.0  # the arrival is not one of the stops
    assert chain.stop_time_s @ chain.stop_probability_frac == pytest.approx(published.standstill_s)


@pytest.mark.parametrize("route", SourceRoute)
def test_links_are_as_long_as_those_of_the_route_with_906(route):
    lengths = source_route(route, 1).length_m
    assert lengths.mean() == pytest.approx(113_000.0 / 906.0, rel=0.002)
    assert lengths.min() >= 15.0


@pytest.mark.parametrize("route", SourceRoute)
@pytest.mark.parametrize("seed", SEEDS)
def test_round_trip_ends_as_high_as_it_starts(route, seed):
    chain = source_route(route, seed)
    climbs = chain.grade_frac * chain.length_m
    assert climbs.sum() == pytest.approx(0.0, abs=1e-8)
    assert np.abs(chain.grade_frac).max() < 0.15
    heights = np.concatenate(([0.0], np.cumsum(climbs)))
    middle_m = np.interp(0.5 * chain.length_m.sum(), np.concatenate(([0.0], np.cumsum(chain.length_m))), heights)
    expected_m = {SourceRoute.MOUNTAIN: 750.0, SourceRoute.COUNTRY_1: 505.0}.get(route)
    if expected_m is not None:
        assert middle_m == pytest.approx(expected_m, abs=15.0)  # the corner lies inside a link


@pytest.mark.parametrize(
    ("route", "limits_kmh"),
    [
        (SourceRoute.HIGHWAY, {50.0, 90.0, 130.0}),
        (SourceRoute.MOUNTAIN, {50.0, 70.0, 90.0}),
        (SourceRoute.COUNTRY_1, {50.0, 90.0}),
        (SourceRoute.COUNTRY_2, {50.0, 90.0}),
        (SourceRoute.URBAN, {50.0}),
    ],
)
def test_limits_are_those_of_the_road_law(route, limits_kmh):
    assert set(np.round(source_route(route, 1).speed_limit_mps * 3.6, 6)) == limits_kmh


def test_nobody_stops_on_the_motorway():
    chain = source_route(SourceRoute.HIGHWAY, 1)
    assert not np.any(chain.stop_probability_frac[chain.speed_limit_mps > 130.0 / 3.6 - 1e-9])


def test_slow_runs_keep_to_90_on_the_same_road():
    fast, slow = source_route(SourceRoute.HIGHWAY, 1), source_route(SourceRoute.HIGHWAY, 1, speed_cap_kmh=90.0)
    assert slow.speed_limit_mps.max() == 25.0
    np.testing.assert_array_equal(slow.grade_frac, fast.grade_frac)
    np.testing.assert_array_equal(slow.stop_probability_frac, fast.stop_probability_frac)


def test_same_seed_gives_the_same_route_and_another_another():
    for route, name in itertools.product(SourceRoute, ("length_m", "grade_frac", "stop_probability_frac")):
        first = getattr(source_route(route, 7), name)
        np.testing.assert_array_equal(first, getattr(source_route(route, 7), name))
        assert not np.array_equal(first, getattr(source_route(route, 8), name))


def test_fewer_stops_are_some_of_the_same_ones():
    whole, part = source_route(SourceRoute.URBAN, 1), source_route(SourceRoute.URBAN, 1, stop_share_frac=0.3)
    assert part.stop_probability_frac.sum() == 46
    assert np.all(part.stop_probability_frac <= whole.stop_probability_frac)
    assert part.stop_time_s.max() == whole.stop_time_s.max() == 21.0
    np.testing.assert_array_equal(part.grade_frac, whole.grade_frac)
    assert source_route(SourceRoute.URBAN, 1, stop_share_frac=0.0).stop_probability_frac.sum() == 0.0
    with pytest.raises(ValueError, match=r"stop_share_frac is 1\.5"):
        source_route(SourceRoute.URBAN, 1, stop_share_frac=1.5)


def test_runs_are_the_sources_23_trips():
    assert sum(run.trip_count for run in SOURCE_RUNS) == 23
    for route, count in TRIP_COUNT.items():
        assert sum(run.trip_count for run in SOURCE_RUNS if run.route is route) == count
    assert [(run.trip_count, run.speed_cap_kmh) for run in SOURCE_RUNS[:2]] == [(2, 90.0), (3, None)]


def test_driven_trips_average_to_a_table_iv(kona):
    model = SourceModel("fast", lambda vehicle, chain: simulate_chain(vehicle, chain, link_model=LinkModel.INTEGRATED))
    records = drive_source_trips(kona, model, 1)
    assert len({record.trip_id for record in records}) == len(records) == 23
    columns = type_averages(records)
    for kind in RouteType:
        assert columns[kind].mass_kg == TABLE_IV[kind].mass_kg
        assert columns[kind].distance_km == pytest.approx(TABLE_IV[kind].distance_km)
        assert columns[kind].stops == TABLE_IV[kind].stops
    # two slow and three fast runs on the highway
    highway = [record for record in records if record.route_type == SourceRoute.HIGHWAY.value]
    slow, fast = highway[0].energy_j, highway[-1].energy_j
    assert slow < fast
    assert route_energies_j(records)[SourceRoute.HIGHWAY] == pytest.approx((2.0 * slow + 3.0 * fast) / 5.0)


def test_certain_stops_make_the_stop_rules_agree(kona):
    chain = source_route(SourceRoute.URBAN, 1)
    expected, counted = (simulate_chain(kona, chain, stop_rule=rule) for rule in (StopRule.EXPECTED, StopRule.COUNTED))
    assert counted.energy_j == pytest.approx(expected.energy_j, rel=1e-12)
    assert counted.stop_count == expected.stop_count == 154
