"""Ranges back, and there and back, over ferries, held against forward searches."""

from __future__ import annotations

import math
from dataclasses import replace

from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from energy.chain.chain import LinkModel
from energy.conditions import STILL
from energy.stops import StopSettings
from routing.range.way_back import ReverseSearch
from routing.route.limits import charge_limits
from routing.search.search import reach
from routing.search.space import search_space
from routing.search.workspaces import WorkspacePool
from tests.routing.range.test_way_back import (
    MANY_LABELS,
    TOLERANCE_J,
    capacities,
    charges,
    levels,
    most_left_j,
    place_on,
    stop_rules,
    strengths,
    weathers,
)
from tests.routing.search.test_exact import vehicles
from tests.routing.search.test_ferries import road_links, sounds


def drawn(graph, car, rule, charge, capacity, sky, data):
    """The space, the goal, the charges and the answers of a map with ferries."""
    soc, reserve = charge
    space = search_space(graph, car, LinkModel.INTEGRATED, rule, StopSettings(), sky)
    goal = place_on(graph, data.draw(st.sampled_from(road_links(graph))), data.draw(st.sampled_from((0.1, 0.6))))
    asked = levels(soc, reserve, capacity)
    back, _ = ReverseSearch(graph, MANY_LABELS).way_back(space, goal).reverse(asked)
    limits = charge_limits(soc, reserve, capacity)
    out = reach(space, WorkspacePool(graph.link_count), limits, goal, graph.head, graph.node_count)
    both, _ = ReverseSearch(graph, MANY_LABELS).way_back(space, goal).round_trip(asked, out)
    ferry = graph.is_ferry()
    assert (back.to_m[ferry] == -1.0).all()
    assert (both.to_m[ferry] == -1.0).all()
    return space, goal, asked, back, out, both


def assert_same_bands(answered_j, most_j, asked):
    for band in asked.left_j:
        if abs(most_j - band) > TOLERANCE_J:
            assert (answered_j >= band) == (most_j >= band)


@settings(max_examples=80, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(sounds(nodes=6), vehicles, stop_rules, charges, capacities, st.data())
def test_bands_back_over_ferries_are_those_of_forward_searches(graph, car, rule, charge, capacity, data):
    space, goal, asked, back, out, both = drawn(graph, car, rule, charge, capacity, STILL, data)
    for node in range(graph.node_count):
        most_j = most_left_j(graph, space, node, goal, *charge, capacity)
        answered_j = asked.soc_j - back.node_energy_j[node]
        assert answered_j <= most_j + TOLERANCE_J
        assert_same_bands(answered_j, most_j, asked)
        arrival = charge[0] - out.node_energy_j[node] / capacity
        if math.isfinite(arrival):
            most_j = most_left_j(graph, space, node, goal, arrival, charge[1], capacity)
            assert_same_bands(asked.soc_j - both.node_energy_j[node], most_j, asked)


@settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(sounds(nodes=6), vehicles, strengths, weathers, stop_rules, charges, capacities, st.data())
def test_ranges_back_over_ferries_never_promise_more_than_a_forward_search_finds(
    graph, car, strength, sky, rule, charge, capacity, data
):
    car = replace(car, effects=strength)
    space, goal, asked, back, out, both = drawn(graph, car, rule, charge, capacity, sky, data)
    for node in range(graph.node_count):
        most_j = most_left_j(graph, space, node, goal, *charge, capacity)
        assert asked.soc_j - back.node_energy_j[node] <= most_j + TOLERANCE_J
        arrival = charge[0] - out.node_energy_j[node] / capacity
        if math.isfinite(both.node_energy_j[node]):
            most_j = most_left_j(graph, space, node, goal, arrival, charge[1], capacity)
            assert asked.soc_j - both.node_energy_j[node] <= most_j + TOLERANCE_J
