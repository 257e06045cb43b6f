"""Road loads that fall below 0 under some conditions, which breaks the bound that labels are set by."""

from __future__ import annotations

import itertools
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from energy.chain.chain import LinkModel, StopRule
from energy.conditions import STILL, Conditions
from energy.force.effects import drive_of
from energy.force.kernels_force import road_load_n
from energy.force.kernels_physics import Road
from energy.stops import StopSettings
from routing.dominance.bounds import least_load_n, slack_rules
from routing.errors import NegativeCycleError, QueryError
from routing.places import LinkPosition, Point
from routing.planner import Planner
from routing.queries import RangeQuery, RouteQuery, Trip
from routing.search.found import Limits
from routing.search.search import find_path
from routing.search.space import search_space
from routing.search.workspaces import WorkspacePool
from routing.weights import ECO
from tests.routing.search.expanded_states import StateGraph
from tests.routing.search.test_exact import WEATHER, graph_of, maps, vehicle, vehicles

# drag that falls with the square of speed: nowhere negative in still air, but in a wind from ahead
FALLING = vehicle(road_load_a_n=900.0, road_load_b_n_per_mps=0.0, road_load_c_n_per_mps2=-0.25)
GALE = Conditions(wind_speed_mps=40.0, wind_from_rad=0.5)
# a oneway ring of straight roads, as graph_of places its nodes
RING = [(k, (k + 1) % 4, length, 55.0, 0) for k, length in enumerate((160.0, 350.0, 565.0, 1050.0))]


def space_of(graph, car, sky):
    return search_space(graph, car, LinkModel.INTEGRATED, StopRule.NONE, StopSettings(), sky)


@settings(max_examples=50, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(maps(), st.one_of(vehicles, st.just(FALLING)), st.sampled_from([STILL, GALE, *WEATHER]), st.integers(0, 99))
def test_least_load_and_its_fall_bound_the_load_at_every_speed(graph, car, sky, seed):
    space = space_of(graph, car, sky)
    rules = slack_rules(drive_of(car, sky).physics, space.arrays.roads, space.arrays.speed_limit_mps)
    for link in range(graph.link_count):
        speeds = np.sort(np.random.default_rng(seed).uniform(0.0, space.arrays.speed_limit_mps[link], 20))
        load = [road_load_n(Road(*space.arrays.roads[link, :5].tolist()), v) for v in speeds.tolist()]
        assert min(load) >= space.least_load_n - 1e-9
        falls = max(slow - fast for slow, fast in itertools.combinations(load, 2))
        assert falls <= rules.sag_n + 1e-9
    assert space.conserving == (space.least_load_n >= -1e-9)


def test_only_a_wind_takes_the_load_of_falling_drag_below_zero():
    graph = graph_of(RING, [0.0] * 4)
    assert space_of(graph, FALLING, STILL).conserving
    assert least_load_n(*_of(space_of(graph, vehicle(), GALE))) >= 0.0
    assert space_of(graph, FALLING, GALE).least_load_n < -100.0


def _of(space):
    return space.physics, space.arrays.roads, space.arrays.speed_limit_mps


@settings(max_examples=50, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(maps(), st.floats(5.0, 40.0), st.floats(0.0, 6.0), st.data())
def test_route_with_a_load_below_zero_is_corrected_and_costs_what_bellman_ford_says(graph, wind_mps, from_rad, data):
    space = space_of(graph, FALLING, Conditions(wind_speed_mps=wind_mps, wind_from_rad=from_rad))
    start = LinkPosition(0, 0.0)
    goal_link = data.draw(st.integers(0, graph.link_count - 1))
    goal = LinkPosition(goal_link, float(graph.length_m[goal_link]))
    path, counts = find_path(space, WorkspacePool(graph.link_count), ECO, Limits(), [start], [goal])
    assert counts.label_correcting == (not space.conserving)
    assert counts.reduced_below_zero == 0 or counts.label_correcting
    states = StateGraph(graph, space, Limits(), ECO)
    fronts = states.fronts([start], 14, 1500)
    expected = states.cheapest(fronts, goal)
    assert path is not None
    assert path.cost <= expected + 1e-9
    if fronts.whole or len(path.links) <= fronts.links:
        assert path.cost == pytest.approx(expected, rel=1e-9, abs=1e-9)


def test_answer_names_the_correcting_search_and_the_load():
    graph = graph_of(RING, [0.0, 4.0, 0.0, 4.0])
    planner, sky = Planner(graph), Conditions(wind_speed_mps=16.0, wind_from_rad=0.5)
    start, goal = (Point(float(graph.node_lat_deg[k]), float(graph.node_lon_deg[k])) for k in (0, 2))
    query = RouteQuery(start, goal, 0.9, FALLING, conditions=sky, stop_rule=StopRule.NONE)
    load_n = space_of(graph, FALLING, sky).least_load_n
    answer = planner.route(query)
    assert load_n < 0.0
    assert {stats.method for stats in answer.stats} == {"label-correcting"}
    assert f"the road load falls to {load_n:.1f} N under these conditions: label-correcting search" in answer.warnings
    area = planner.range(RangeQuery(start, 0.9, FALLING, conditions=sky, stop_rule=StopRule.NONE))
    assert area.stats.method == "label-correcting"
    with pytest.raises(QueryError, match=r"conditions is a road load of -\d+.\d N"):
        planner.range(RangeQuery(start, 0.9, FALLING, conditions=sky, stop_rule=StopRule.NONE, trip=Trip.REVERSE))


def test_wind_that_gives_more_than_a_round_takes_is_an_error_that_says_so():
    graph, free = graph_of(RING, [0.0] * 4), replace(FALLING, drive_eff=1.0, recuperation_eff=1.0, aux_power_w=0.0)
    planner = Planner(graph)
    start, goal = (Point(float(graph.node_lat_deg[k]), float(graph.node_lon_deg[k])) for k in (0, 2))
    with pytest.raises(NegativeCycleError, match=r"road load, -\d+.\d N at its least under these conditions"):
        planner.route(RouteQuery(start, goal, 0.9, free, conditions=GALE, stop_rule=StopRule.NONE))
