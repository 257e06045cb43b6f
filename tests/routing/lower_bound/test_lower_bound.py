"""The lower bound that directs a search: it never exceeds what any drive takes, and changes the work but no answer."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from scipy.sparse import coo_array
from scipy.sparse.csgraph import dijkstra

from energy.chain.chain import LinkModel, StopRule
from energy.chain.kernels_link import link_energy
from energy.conditions import STILL
from energy.force.kernels_physics import ROAD_WAIT, road_at
from energy.stops import StopSettings
from energy.vehicle.files import load_vehicles
from routing.lower_bound.kernels_least import SLOWEST, STOPPED_LEAST, STOPPED_MOST, Reduction, least_towards_any
from routing.lower_bound.kernels_lower_bound import FARTHEST, INTO_J, INTO_M, INTO_S, INTO_TAIL, cost_to_goal
from routing.lower_bound.lower_bound import GoalBoundScratch
from routing.places import LinkPosition
from routing.search.found import Limits, PathOptions
from routing.search.search import find_path
from routing.search.space import potential_share, search_space
from routing.search.workspaces import WorkspacePool
from routing.weights import ECO
from tests.routing.search.test_exact import (
    LEARNED,
    LOSSY,
    WEATHER,
    charges,
    graph_of,
    maps,
    rules,
    vehicle,
    vehicles,
    weightings,
)
from tests.routing.search.test_real import REPOSITORY, andorra, planner  # noqa: F401  (fixtures)

skies = st.sampled_from([STILL, *WEATHER])
learned = st.sampled_from([None, LOSSY, *LEARNED])


def space_of(graph, car, rule, sky=STILL):
    return search_space(graph, car, LinkModel.INTEGRATED, rule, StopSettings(), sky)


def tables_of(space):
    """Entries (M, 3) and least costs (M, 2), by link."""
    g, costs = space.arrays, space.lower_bound.costs()
    known = (costs.physics, Reduction(potential_share(space.physics), space.slack.sag_n), g.row, g.roads)
    turns = (g.successor_first, g.successor, costs.entry)
    return costs.entry, np.array([least_towards_any(*known, *turns, link) for link in range(g.row.shape[0])])


def tables():
    """Cars that know nothing but what each speed takes."""
    cars = load_vehicles(REPOSITORY / "data/vehicles").values()
    return [car for car in cars if not hasattr(car, "mass_kg")]


@settings(max_examples=120, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(maps(), vehicles, rules, skies, learned, st.floats(0.0, 1.0), st.floats(0.0, 1.0))
def test_no_entry_of_a_link_takes_less_than_the_least_and_none_leaves_it_slower(
    graph, car, rule, sky, effects, share, between
):
    car = car if effects is None else replace(car, effects=effects)
    space = space_of(graph, car, rule, sky)
    p, g, alpha = space.physics, space.arrays, potential_share(space.physics)
    entry, least = tables_of(space)
    for link in range(graph.link_count):
        limit = g.speed_limit_mps[link]
        low = entry[link, SLOWEST]
        assert low <= limit
        v = min(low + share * (limit - low), limit)
        stopped = entry[link, STOPPED_LEAST] + between * (entry[link, STOPPED_MOST] - entry[link, STOPPED_LEAST])
        p_stop = g.stop_probability_frac[link]
        for following in graph.successors(link).tolist():
            target = g.speed_limit_mps[following]
            e, t, end = link_energy(
                p, road_at(g.roads, link), g.length_m[link], v, stopped, limit, target, p_stop, g.roads[link, ROAD_WAIT]
            )
            kinetic = space.half_inertia_kg * ((1.0 - p_stop) * end**2 - (1.0 - stopped) * v**2)
            climb = graph.node_height_m[graph.head[link]] - graph.node_height_m[graph.tail[link]]
            assert least[link, 0] <= max(e - alpha * (p.weight_n * climb + kinetic), 0.0) + 1e-6
            assert least[link, 1] <= t * (1.0 + 1e-12) + 1e-9
            a_metre = space.lower_bound.costs().least_a_metre
            taken = e - alpha * (p.weight_n * climb + kinetic), t, 1.0 * g.length_m[link]
            assert (a_metre * g.length_m[link] <= np.array(taken) * (1.0 + 1e-9) + 1e-6).all()
            assert end >= entry[following, SLOWEST]
            assert entry[following, STOPPED_LEAST] <= p_stop <= entry[following, STOPPED_MOST]


@settings(max_examples=120, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(maps(nodes=6), vehicles, weightings, charges, rules, skies, learned, st.data())
def test_directed_search_answers_what_an_undirected_one_does(graph, car, weights, limits, rule, sky, effects, data):
    car = car if effects is None else replace(car, effects=effects)
    space = space_of(graph, car, rule, sky)
    links = data.draw(st.lists(st.integers(0, graph.link_count - 1), min_size=3, max_size=3))
    start, *goals = (LinkPosition(link, 0.5 * float(graph.length_m[link])) for link in links)
    pareto = limits.held and (weights.time > 0.0 or weights.distance > 0.0)
    pool = WorkspacePool(graph.link_count)
    (path, counts), (plain, _) = (
        find_path(space, pool, weights, limits, [start], goals, PathOptions(pareto, begin_s=30.0, directed=directed))
        for directed in (True, False)
    )
    assert counts.reduced_below_zero == 0
    assert (path is None) == (plain is None)
    if path is not None:
        assert path.cost == pytest.approx(plain.cost, rel=1e-9, abs=1e-9)


@pytest.mark.parametrize("car", tables(), ids=lambda car: car.id)
def test_bound_of_consumption_tables_holds_on_a_chain_of_links(car):
    links = [(k, (k + 1) % 5, 40.0 + 200.0 * k, 8.0 + 4.0 * k, k % 4) for k in range(5)]
    links += [(b, a, length, limit, cross) for a, b, length, limit, cross in links]
    graph = graph_of(links, [0.0, 3.0, 1.0, 6.0, 2.0])
    space = space_of(graph, car, StopRule.EXPECTED)
    start, goal = LinkPosition(0, 0.0), LinkPosition(graph.link_count - 1, 5.0)
    (path, counts), (plain, _) = (
        find_path(
            space, WorkspacePool(graph.link_count), ECO, Limits(), [start], [goal], PathOptions(directed=directed)
        )
        for directed in (True, False)
    )
    assert path is not None
    assert path.cost == pytest.approx(plain.cost, rel=1e-12)
    assert counts.reduced_below_zero == 0


def asked(bound, weights, node):
    return cost_to_goal(bound, *weights, node)


def test_costs_to_the_goal_are_those_of_scipy_and_never_more_beyond_the_radius(andorra):  # noqa: F811
    space = space_of(andorra, vehicle(), StopRule.EXPECTED)
    weights = (1.0 / 3.6e6, 0.002, 1e-5)
    costs = space.lower_bound.costs()
    _, least = tables_of(space)
    costs.into[:, [INTO_J, INTO_S]] = np.nan
    to = np.repeat(np.arange(andorra.node_count), np.diff(costs.into_first))
    length_m = costs.into[:, INTO_M]
    table = np.column_stack((np.maximum(least[costs.into_link], costs.least_a_metre[:2] * length_m[:, None]), length_m))
    price = table @ np.array(weights)
    order = np.argsort(-price)  # of parallel links the last one written stays
    matrix = {}
    for a, b, c in zip(to[order], costs.into[order, INTO_TAIL].astype(int), price[order], strict=True):
        matrix[int(a), int(b)] = c
    row, column = np.array(list(matrix)).T
    shape = (andorra.node_count, andorra.node_count)
    goal = 1000
    expected = dijkstra(
        coo_array((list(matrix.values()), (row, column)), shape=shape).tocsr(), indices=andorra.tail[goal]
    )
    scratch = GoalBoundScratch(andorra.link_count)
    for farthest in (math.inf, float(np.median(expected))):
        bound = space.lower_bound.towards(scratch, 4000, [goal])
        bound.reach[FARTHEST] = farthest
        got = np.array([asked(bound, weights, node) for node in range(andorra.node_count)])
        line_m = np.linalg.norm(bound.place_m - bound.start_m, axis=1)
        straight_cost = line_m * bound.line_to_road * (bound.least_a_metre @ np.array(weights))
        near = expected + straight_cost <= min(farthest, 1e9)
        assert near.sum() > 0
        assert got[near] == pytest.approx(expected[near], rel=1e-9, abs=1e-12)
        assert (got <= expected * (1.0 + 1e-9)).all()
        assert (got[~near] >= farthest - straight_cost[~near] - 1e-9).all()


def test_nothing_leads_to_the_goal_of_a_road_that_none_enters():
    graph = graph_of([(0, 1, 300.0, 15.0, 0), (1, 0, 300.0, 15.0, 0)], [0.0, 0.0])
    space = space_of(graph, vehicle(), StopRule.NONE)
    bound = space.lower_bound.towards(GoalBoundScratch(graph.link_count), 1, [0])
    bound.into_first[:] = 0  # as if no link led anywhere
    assert asked(bound, (1.0, 0.0, 0.0), int(graph.tail[0])) == 0.0
    assert asked(bound, (1.0, 0.0, 0.0), int(graph.head[0])) == math.inf


def test_directed_searches_on_andorra_settle_less_than_half_of_the_labels(andorra):  # noqa: F811
    space = space_of(andorra, vehicle(), StopRule.EXPECTED)
    pool = WorkspacePool(andorra.link_count)
    rng = np.random.default_rng(20261122)
    settled = np.zeros(2)
    for start, goal in rng.choice(andorra.link_count, (40, 2), replace=False).tolist():
        ends = [LinkPosition(start, 0.0)], [LinkPosition(goal, 0.5 * float(andorra.length_m[goal]))]
        answers = [
            find_path(space, pool, ECO, Limits(), *ends, PathOptions(directed=directed)) for directed in (True, False)
        ]
        assert answers[0][0].cost == pytest.approx(answers[1][0].cost, rel=1e-9)
        settled += [counts.labels_settled for _, counts in answers]
        assert answers[0][1].reduced_below_zero == 0
    assert settled[0] < 0.5 * settled[1]


def test_least_costs_of_a_flat_road_without_stops_are_those_of_driving_at_the_limit():
    links = [(k, (k + 1) % 4, 2000.0, 15.0, 0) for k in range(4)]
    graph = graph_of(links, [0.0] * 4)
    space = space_of(graph, vehicle(), StopRule.NONE)
    p = space.physics
    entry, least = tables_of(space)
    e, t, _ = link_energy(p, road_at(space.arrays.roads, 0), 2000.0, 15.0, 0.0, 15.0, 15.0, 0.0, 0.0)
    assert least[:, 0] == pytest.approx(e, rel=1e-9)
    assert least[:, 1] == pytest.approx(t, rel=1e-12)
    assert entry[:, SLOWEST] == pytest.approx(15.0)


def test_least_costs_are_kept_from_one_search_to_the_next_and_computed_where_it_came_only(andorra):  # noqa: F811
    space = space_of(andorra, vehicle(), StopRule.EXPECTED)
    start, goal = LinkPosition(100, 0.0), LinkPosition(int(andorra.successors(100)[0]), 1.0)
    pool = WorkspacePool(andorra.link_count)
    answers = [find_path(space, pool, ECO, Limits(), [start], [goal]) for _ in range(2)]
    known = np.isfinite(space.lower_bound.costs().into[:, INTO_J])
    assert 0 < known.sum() < 0.5 * known.size
    assert answers[0][0] == answers[1][0]
    assert answers[0][1].labels_made == answers[1][1].labels_made
