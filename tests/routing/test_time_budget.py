"""Queries that are stopped: by the clock, and because nobody waits any more."""

from __future__ import annotations

import threading
import time
from dataclasses import replace
from pathlib import Path

import pytest

from energy.vehicle.files import AnyVehicle, load_vehicles
from routing.errors import AbandonedError, TimeUpError
from routing.graph.files import load_graph
from routing.places import Point
from routing.planner import Planner
from routing.queries import ParetoSettings, RangeQuery, RouteQuery, Trip
from routing.route.route import ParetoProof
from routing.time_budget import TimeBudget, time_budget, within
from routing.weights import ECO, FASTEST

DATA = Path(__file__).parents[2] / "data"


@pytest.fixture(scope="module")
def planner() -> Planner:
    return Planner(load_graph(DATA / "graphs" / "highlands"))


@pytest.fixture(scope="module")
def vehicle() -> AnyVehicle:
    return load_vehicles(DATA / "vehicles")["hyundai-kona-64"]


def across(planner: Planner, vehicle: AnyVehicle) -> RouteQuery:
    """From the west of the map to its east."""
    graph = planner.graph
    west, east = (
        Point(float(graph.node_lat_deg[k]), float(graph.node_lon_deg[k]))
        for k in (int(graph.node_lon_deg.argmin()), int(graph.node_lon_deg.argmax()))
    )
    return RouteQuery(west, east, 0.9, vehicle, weightings=(("eco", ECO), ("fastest", FASTEST)))


@pytest.mark.parametrize("trip", list(Trip))
def test_area_whose_time_is_up_stops_and_the_next_one_is_whole(
    planner: Planner, vehicle: AnyVehicle, trip: Trip
) -> None:
    query = RangeQuery(across(planner, vehicle).start, 0.9, vehicle, trip=trip)
    with within(TimeBudget(0.0)), pytest.raises(TimeUpError, match="no answer within 0 s"):
        planner.range(query)
    whole = planner.range(query)
    assert whole.stats.labels_settled > planner.graph.link_count / 2
    with within(TimeBudget(600.0)):
        assert planner.range(query).bands[0].area == whole.bands[0].area


def test_search_stops_soon_after_it_is_abandoned(planner: Planner, vehicle: AnyVehicle) -> None:
    query = RangeQuery(across(planner, vehicle).start, 0.9, vehicle)
    planner.range(query)  # what a vehicle needs is made
    budget, stopped = TimeBudget(), threading.Event()

    def again_and_again() -> None:
        try:
            with within(budget):
                while True:
                    planner.range(query)
        except AbandonedError:
            stopped.set()

    thread = threading.Thread(target=again_and_again)
    thread.start()
    time.sleep(0.05)
    budget.abandon()
    assert stopped.wait(20.0)
    thread.join()


def test_vehicle_that_nobody_has_asked_for_is_given_up_while_the_graph_is_seen_as_its_own(
    planner: Planner, vehicle: AnyVehicle
) -> None:
    """That takes seconds for a million links."""
    query = replace(across(planner, vehicle), vehicle=replace(vehicle, aux_power_w=1234.5))
    with within(TimeBudget(0.0)), pytest.raises(TimeUpError):
        planner.route(query)
    assert len(planner.route(query).routes) == 2


def test_routes_found_in_time_are_answered_and_the_others_named(planner: Planner, vehicle: AnyVehicle) -> None:
    query = across(planner, vehicle)
    whole = planner.route(query)
    with within(TimeBudget(0.0)):
        part = planner.route(query)
    assert [route.name for route in part.routes] == ["eco"]
    assert part.routes[0].distance_m == whole.routes[0].distance_m
    assert "routes 'fastest' are not answered: 0 s were not enough" in part.warnings


def test_pareto_set_whose_time_is_up_says_what_it_proves(planner: Planner, vehicle: AnyVehicle) -> None:
    query = replace(across(planner, vehicle), pareto=ParetoSettings(epsilon_frac=0.001))
    with within(TimeBudget(0.0)):
        answer = planner.route(query)
    assert answer.routes[-1].name == "eco"
    assert answer.pareto is not None
    assert answer.pareto.proof in (ParetoProof.NONE, ParetoProof.WEIGHTINGS)
    assert answer.warnings


def test_budget_is_that_of_its_own_thread() -> None:
    seen = []
    with within(TimeBudget(5.0)) as _:
        thread = threading.Thread(target=lambda: seen.append(time_budget().limit_s))
        thread.start()
        thread.join()
        assert time_budget().limit_s == 5.0
    assert seen == [float("inf")]
    assert time_budget().limit_s == float("inf")
