"""Bands by energy, time and distance: what single routes take, and what bands by charge answer."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
import shapely

from energy.units import JOULE_PER_WH
from energy.vehicle.files import load_vehicles
from routing.errors import QueryError
from routing.graph.files import load_graph
from routing.places import Point
from routing.planner import Planner
from routing.queries import By, RangeQuery, RouteQuery, Trip
from routing.weights import FASTEST, SHORTEST

ROOT = Path(__file__).resolve().parents[3]
KONA = load_vehicles(ROOT / "data/vehicles")["hyundai-kona-64"]
CAPACITY_J = KONA.usable_capacity_wh * JOULE_PER_WH
HOME = Point(-29.95, -71.25)
QUERY = RangeQuery(HOME, 0.9, KONA)


@pytest.fixture(scope="module")
def planner() -> Planner:
    return Planner(load_graph(ROOT / "data/graphs/coquimbo"))


@pytest.mark.parametrize(("by", "limit"), [(By.TIME, 480.0), (By.DISTANCE, 6000.0)])
def test_nodes_within_a_limit_are_those_to_which_a_route_keeps_it(planner, by, limit):
    graph = planner.graph
    (band,) = planner.range(replace(QUERY, by=by, limits=(limit,))).bands
    assert (band.soc_left_frac, band.limit, band.edge_left_j) == (None, limit, None)
    weights = FASTEST if by is By.TIME else SHORTEST
    inside = wrong = 0
    nodes = np.random.default_rng(8).choice(graph.node_count, 150, replace=False)
    for node in nodes.tolist():
        place = Point(float(graph.node_lat_deg[node]), float(graph.node_lon_deg[node]))
        (route,) = planner.route(RouteQuery(HOME, place, 0.9, KONA, weightings=(("way", weights),))).routes
        taken = route.duration_s if by is By.TIME else route.distance_m
        covered = band.area.contains(shapely.Point(place.lon_deg, place.lat_deg))
        inside += covered
        wrong += covered != (taken <= limit)
    assert 0.2 * nodes.size < inside < 0.8 * nodes.size
    assert wrong <= 0.03 * nodes.size


@pytest.mark.parametrize("by", [By.TIME, By.DISTANCE])
def test_bands_by_way_nest_the_outermost_first_and_are_counted_as_others(planner, by):
    limits = (300.0, 600.0, 900.0) if by is By.TIME else (2000.0, 4000.0, 8000.0)
    answer = planner.range(replace(QUERY, by=by, limits=limits))
    assert [band.limit for band in answer.bands] == sorted(limits, reverse=True)
    for outer, inner in pairwise(answer.bands):
        assert inner.area.difference(outer.area).area <= 1e-12 * outer.area.area
        assert inner.node_count < outer.node_count
    for band in answer.bands:
        assert band.false_in_frac <= 0.03
        assert band.false_out_frac <= 0.03
        if by is By.DISTANCE:
            assert band.road_reach.farthest_m == pytest.approx(band.limit, rel=0.05)
            assert max(band.bearing_reach_m) <= band.limit + 420.0


@pytest.mark.parametrize("trip", list(Trip))
def test_bands_by_energy_are_those_of_the_charge_that_it_leaves(planner, trip):
    most_j = 0.03 * CAPACITY_J
    by_energy = planner.range(replace(QUERY, by=By.ENERGY, limits=(0.5 * most_j, most_j), trip=trip))
    by_charge = planner.range(replace(QUERY, reserve_soc_frac=0.87, bands_soc_frac=(0.885,), trip=trip))
    for energy, charge in zip(by_energy.bands, by_charge.bands, strict=True):
        assert energy.soc_left_frac == pytest.approx(charge.soc_left_frac)
        assert energy.node_count == pytest.approx(charge.node_count, rel=0.01)
    assert [band.limit for band in by_energy.bands] == [most_j, 0.5 * most_j]


@pytest.mark.parametrize(("soc", "reserve", "share"), [(0.3, 0.1, 0.2), (0.55, 0.0, 0.55), (0.29, 0.1, 0.19)])
def test_limit_of_all_that_the_battery_may_give_is_taken_however_it_rounds(planner, soc, reserve, share):
    changes = {"soc_frac": soc, "reserve_soc_frac": reserve, "by": By.ENERGY}
    (band,) = planner.range(replace(QUERY, **changes, limits=(share * CAPACITY_J,))).bands
    assert band.soc_left_frac == pytest.approx(reserve)
    with pytest.raises(QueryError, match=rf"allowed: at most the {share * CAPACITY_J / 3.6e6:.9g} kWh"):
        planner.range(replace(QUERY, **changes, limits=(share * CAPACITY_J * (1.0 + 1e-8),)))


def test_places_that_the_charge_does_not_suffice_for_are_warned_of(planner):
    short = planner.range(replace(QUERY, soc_frac=0.005, by=By.TIME, limits=(900.0,)))
    assert any("do not look at the charge" in warning for warning in short.warnings)
    assert not any("do not look" in w for w in planner.range(replace(QUERY, by=By.TIME, limits=(900.0,))).warnings)


def test_area_by_time_that_the_map_ends_says_so(planner):
    answer = planner.range(replace(QUERY, by=By.TIME, limits=(1e5,)))
    assert answer.bands[0].map_edge is not None
    assert any("reached with time to spare" in warning for warning in answer.warnings)


@pytest.mark.parametrize(("soc", "reserve"), [(0.3, 0.1), (0.7, 0.1), (0.9, 0.2)])
def test_energy_limit_may_be_all_that_is_held_above_the_reserve(planner, soc, reserve):
    held_j = round((soc - reserve) * 64.0, 9) * 3.6e6  # of the Kona's 64 kWh, as it is typed
    limits = {"by": By.ENERGY, "limits": (held_j,)}
    (band,) = planner.range(replace(QUERY, soc_frac=soc, reserve_soc_frac=reserve, **limits)).bands
    assert band.soc_left_frac == pytest.approx(reserve)
    assert band.soc_left_frac >= reserve


@pytest.mark.parametrize(
    ("changes", "field"),
    [
        ({"by": By.TIME}, "limits"),
        ({"by": By.DISTANCE, "limits": (0.0,)}, "limits"),
        ({"by": By.ENERGY, "limits": (1.1 * CAPACITY_J,)}, "limits"),
        ({"limits": (60.0,)}, "limits"),
        ({"by": By.TIME, "limits": (60.0,), "bands_soc_frac": (0.5,)}, "bands_soc_frac"),
        ({"by": By.TIME, "limits": (60.0,), "trip": Trip.REVERSE}, "by"),
        ({"by": By.DISTANCE, "limits": (60.0,), "uncertainty": True}, "by"),
    ],
)
def test_limits_that_cannot_be_drawn_are_refused_by_name(planner, changes, field):
    with pytest.raises(QueryError) as refused:
        planner.range(replace(QUERY, **changes))
    assert refused.value.field == field
