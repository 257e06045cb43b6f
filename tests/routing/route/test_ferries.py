"""Queries on a map of two shores and a ferry between them."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import shapely

from energy.conditions import Conditions
from routing.errors import PointFarFromRoadError
from routing.graph.rim import map_rim
from routing.importers.region import import_region
from routing.places import Point
from routing.planner import Planner
from routing.queries import By, MatrixQuery, Outline, ParetoSettings, RangeQuery, RouteQuery, Trip
from routing.weights import BALANCED, ECO, FASTEST
from tests.routing.importers.test_ferries import FERRY, LINE, PLACES, SHORES
from tests.routing.test_planner import car

COLD = Conditions(ambient_k=258.0)
METRE_EAST, METRE_NORTH = 1.0 / 82_850.76, 1.0 / 111_073.38
BOTH_WAYS = (Trip.OUT, Trip.REVERSE, Trip.ROUND)


def place(east_m: float, north_m: float) -> Point:
    return Point(42.0 + north_m * METRE_NORTH, 1.5 + east_m * METRE_EAST)


SOUTH, NORTH, SEA = place(0.0, 100.0), place(400.0, 4300.0), place(200.0, 2200.0)


@pytest.fixture
def planner(draw_map: Any) -> Planner:
    return Planner(import_region(draw_map(PLACES, {**SHORES, 20: (LINE, FERRY)}), [], "sound", ferries=True))


def query(**changes: Any) -> RouteQuery:
    values = {"start": SOUTH, "goal": NORTH, "soc_frac": 0.8, "vehicle": car()} | changes
    return RouteQuery(**values)


@pytest.mark.parametrize("conditions", [Conditions(), COLD])
def test_a_route_over_a_ferry_keeps_the_charge_and_tells_the_ferry(planner: Planner, conditions: Conditions) -> None:
    weightings = (("eco", ECO), ("fastest", FASTEST), ("balanced", BALANCED))
    answer = planner.route(query(weightings=weightings, conditions=conditions))
    for route in answer.routes:
        aboard = np.isin(route.links.link_idx, np.flatnonzero(planner.graph.way_id == 20))
        assert aboard.sum() == 3
        assert (
            np.array(route.links.soc_end_frac)[aboard].tolist() == [route.links.soc_end_frac[aboard.argmax() - 1]] * 3
        )
        assert route.duration_s > 1200.0
        assert not route.links.results.energy_j[aboard].any()
    told = [warning for warning in answer.warnings if "ferry" in warning]
    assert len(told) == 3
    assert all("'Northern Line' (20 min)" in warning and "for 20 min" in warning for warning in told)


def test_a_route_that_stays_ashore_says_nothing_of_ferries(planner: Planner) -> None:
    answer = planner.route(query(goal=place(200.0, 100.0)))
    assert not any("ferr" in warning for warning in answer.warnings)


def test_nobody_starts_or_ends_on_board(planner: Planner) -> None:
    for field in ("start", "goal"):
        with pytest.raises(PointFarFromRoadError, match=f"^{field}"):
            planner.route(query(**{field: SEA}))


def test_matrix_entries_over_ferries_are_those_of_their_routes(planner: Planner) -> None:
    for conditions in (Conditions(), COLD):
        for weights in (ECO, BALANCED):
            asked = MatrixQuery((SOUTH,), (NORTH,), 0.8, car(), weights=weights, conditions=conditions)
            search = planner.matrix(asked)
            answer = search.answer([search.row(0)])
            (route,) = planner.route(query(weightings=(("w", weights),), conditions=conditions)).routes
            entry = answer.rows[0].entries[0]
            assert entry.energy_j == pytest.approx(route.energy_j, rel=1e-9)
            assert entry.duration_s == pytest.approx(route.duration_s, rel=1e-9)
            assert any("has ferries" in warning for warning in answer.warnings)


def test_the_legs_of_a_way_over_a_ferry_and_back_are_those_of_its_links(planner: Planner) -> None:
    answer = planner.route(query(via=(NORTH,), goal=SOUTH, conditions=COLD))
    (route,) = answer.routes
    assert route.duration_s == pytest.approx(sum(leg.duration_s for leg in route.legs))
    assert route.duration_s > 2400.0
    assert [leg.soc_end_frac for leg in route.legs][-1] == route.soc_end_frac


@pytest.mark.parametrize("conditions", [Conditions(), COLD])
def test_a_pareto_set_over_a_ferry_is_proven(planner: Planner, conditions: Conditions) -> None:
    answer = planner.route(query(pareto=ParetoSettings(), conditions=conditions))
    assert answer.pareto is not None
    assert answer.pareto.unproven is None
    assert min(route.energy_j for route in answer.routes) == pytest.approx(
        planner.route(query(conditions=conditions)).routes[0].energy_j, rel=1e-9
    )


@pytest.mark.parametrize("trip", BOTH_WAYS)
@pytest.mark.parametrize("outline", [Outline.ROADS, Outline.FILLED])
def test_areas_reach_both_shores_and_not_the_sea(planner: Planner, trip: Trip, outline: Outline) -> None:
    answer = planner.range(RangeQuery(SOUTH, 0.8, car(), trip=trip, outline=outline))
    (band,) = answer.bands
    assert band.area.contains(shapely.Point(NORTH.lon_deg, NORTH.lat_deg))
    assert not band.area.contains(shapely.Point(SEA.lon_deg, SEA.lat_deg))
    assert len(band.area.geoms) == 2
    assert band.false_out_frac == 0.0
    assert any("has ferries" in warning for warning in answer.warnings)


def test_bands_by_time_count_the_time_on_board(planner: Planner) -> None:
    (fastest,) = planner.route(query(weightings=(("fastest", FASTEST),))).routes
    limits = (fastest.duration_s + 60.0, 1200.0)
    far, near = planner.range(RangeQuery(SOUTH, 0.8, car(), by=By.TIME, limits=limits)).bands
    assert far.area.contains(shapely.Point(NORTH.lon_deg, NORTH.lat_deg))
    assert len(near.area.geoms) == 1


def test_a_quay_is_no_end_of_the_map(planner: Planner) -> None:
    graph = planner.graph
    rim = map_rim(graph)
    ends = graph.node_id[rim.node_idx].tolist()
    assert 3 not in ends
    assert 11 not in ends
