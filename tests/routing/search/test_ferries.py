"""Ferries in searches: the compiled search, its networkx twin, the enumeration of all ways and the simulation agree."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import HealthCheck, assume, given, settings
from hypothesis import strategies as st

from energy.chain.chain import LinkModel, StopRule, simulate_chain
from energy.chain.kernels_link import link_energy
from energy.conditions import STILL, Conditions
from energy.force.effects import drive_of
from energy.force.kernels_physics import accepted_j, cabin_energy_j, road_in_time
from energy.stops import StopSettings
from energy.units import JOULE_PER_KWH
from routing.graph.ferries import Ferries
from routing.graph.networkx_graph import to_networkx
from routing.importers.ferries import levelled
from routing.links.spans import ChainMaker
from routing.places import LinkPosition, LinkSpan
from routing.search.found import Limits, Measure, PathOptions
from routing.search.reference import EnergySearch
from routing.search.search import find_path, find_paths, reach, reach_by
from routing.search.space import search_space
from routing.search.workspaces import WorkspacePool
from routing.weights import ECO, FASTEST
from tests.routing.search.test_exact import (
    LEARNED,
    SPEEDS,
    TWIN_LABELS,
    WEATHER,
    answered,
    charges,
    far_behind,
    graph_of,
    maps,
    never_full,
    rules,
    vehicle,
    vehicles,
    weightings,
)

STEEPEST = 0.6
COLD = Conditions(ambient_k=258.0)


@st.composite
def sounds(draw, nodes=4):
    """A map of which some links are ferries: what they join is level."""
    graph = draw(maps(nodes))
    count = draw(st.integers(1, max(graph.link_count // 2, 1)))
    link = sorted(draw(st.permutations(range(graph.link_count)))[:count])
    duration_s = np.array([draw(st.sampled_from((20.0, 300.0, 3600.0))) for _ in link])
    ferry = np.zeros(graph.link_count, bool)
    ferry[link] = True
    height_m = levelled(graph.node_height_m, graph.tail, graph.head, ferry)
    graph = replace(graph, node_height_m=height_m, ferries=Ferries(np.array(link, np.int64), duration_s))
    assume(not ferry.all())
    assume((np.abs(graph.climb_m()) <= STEEPEST * graph.length_m).all())
    return graph


def road_links(graph):
    return np.flatnonzero(~graph.is_ferry()).tolist()


def cheapest_by_enumeration(graph, space, weights, limits, start, goal, most_links):
    """Least cost over every way of at most most_links links: before a ferry one stops, on board all is still."""
    g, p = space.arrays, space.physics
    carried_s = dict(zip(graph.ferries.link.tolist(), graph.ferries.duration_s.tolist(), strict=True))
    best = math.inf

    def drive(link, offset, v, stopped, energy, clock, carried, distance, depth):
        nonlocal best

        def cost_of(e, t, d):
            return weights.energy * e / JOULE_PER_KWH + weights.time * t / 3600.0 + weights.distance * d / 1000.0

        def go_on(following, used, end, p_stop, t, aboard, ds):
            if used <= limits.most_energy_j:
                drive(following, 0.0, end, p_stop, used, clock + t, carried + aboard, distance + ds, depth + 1)

        ds = g.length_m[link] - offset
        if link in carried_s:
            if depth < most_links:
                for following in graph.successors(link).tolist():
                    go_on(following, energy, 0.0, 0.0, 0.0, carried_s[link], ds)
            return
        limit = g.speed_limit_mps[link]
        if link == goal.link_idx and goal.offset_m > offset:
            way = goal.offset_m - offset
            road = road_in_time(p, g.roads, link, clock, way / limit)
            e, t, _ = link_energy(p, road, way, v, stopped, limit, limit, 1.0, 0.0)
            e = accepted_j(p, energy, e + cabin_energy_j(p, clock, clock + t), limits.least_energy_j)
            used = max(energy + e, limits.least_energy_j)
            if used <= limits.most_energy_j:
                best = min(best, cost_of(used, clock + t + carried, distance + way))
        if depth == most_links:
            return
        road = road_in_time(p, g.roads, link, clock, ds / limit)
        p_stop, wait = g.stop_probability_frac[link], g.stop_time_s[link]
        for following in graph.successors(link).tolist():
            ahead = 0.0 if following in carried_s else g.speed_limit_mps[following]
            e, t, end = link_energy(p, road, ds, v, stopped, limit, ahead, p_stop, wait)
            e = accepted_j(p, energy, e + cabin_energy_j(p, clock, clock + t), limits.least_energy_j)
            go_on(following, max(energy + e, limits.least_energy_j), end, p_stop, t, 0.0, ds)

    drive(start.link_idx, start.offset_m, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1)
    return best


def compare(graph, car, weights, limits, rule, sky, data):
    start_link, goal_link = (data.draw(st.sampled_from(road_links(graph))) for _ in range(2))
    start = LinkPosition(start_link, float(graph.length_m[start_link]) * data.draw(st.sampled_from((0.0, 0.4))))
    goal = LinkPosition(goal_link, float(graph.length_m[goal_link]) * data.draw(st.sampled_from((0.7, 1.0))))
    stops = StopSettings()
    space = search_space(graph, car, LinkModel.INTEGRATED, rule, stops, sky)
    pool = WorkspacePool(graph.link_count)
    pareto = limits.held and (weights.time > 0.0 or weights.distance > 0.0)
    path, counts = find_path(space, pool, weights, limits, [start], [goal], PathOptions(pareto))
    found = math.inf if path is None else path.cost
    exported = to_networkx(graph)
    edges = {row["idx"]: (u, v, k) for u, v, k, row in exported.edges(keys=True, data=True)}
    twin = EnergySearch(
        exported,
        drive_of(car, sky),
        stops if rule is StopRule.EXPECTED else None,
        weights,
        limits,
        None if limits.held else far_behind(space, weights),
        TWIN_LABELS,
    )
    label = answered(twin.route, [(edges[start_link], start.offset_m)], [(edges[goal_link], goal.offset_m)])
    assert found == pytest.approx(math.inf if label is None else label.cost, rel=1e-9, abs=1e-9)
    depth = 9 if graph.link_count <= 6 else 7
    enumerated = cheapest_by_enumeration(graph, space, weights, limits, start, goal, depth)
    assert found <= enumerated + 1e-9
    if path is None or len(path.links) <= depth:
        assert found == pytest.approx(enumerated, rel=1e-9, abs=1e-9)
    assert counts.reduced_below_zero == 0
    if not limits.held:
        alone, _ = find_path(space, pool, weights, limits, [start], [goal], PathOptions(directed=False))
        (many,), _ = find_paths(space, pool, weights, limits, [start], [[goal]])
        assert [None if way is None else way.cost for way in (alone, many)] == pytest.approx(
            [None if path is None else path.cost] * 2
        )


@settings(max_examples=250, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(sounds(), vehicles, weightings, charges, rules, st.data())
def test_search_with_ferries_equals_twin_and_enumeration(graph, car, weights, limits, rule, data):
    compare(graph, car, weights, limits, rule, STILL, data)


@settings(max_examples=200, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(
    sounds(),
    vehicles,
    weightings,
    st.one_of(never_full, charges),
    rules,
    st.sampled_from([STILL, COLD, *WEATHER]),
    st.sampled_from(LEARNED),
    st.data(),
)
def test_search_with_ferries_in_any_weather_equals_twin_and_enumeration(
    graph, car, weights, limits, rule, sky, learned, data
):
    compare(graph, replace(car, effects=learned), weights, limits, rule, sky, data)


@settings(max_examples=120, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(
    sounds(nodes=6),
    vehicles,
    st.sampled_from([ECO, FASTEST]),
    rules,
    st.sampled_from([STILL, COLD, WEATHER[3]]),
    st.data(),
)
def test_found_way_over_ferries_takes_what_the_simulation_says(graph, car, weights, rule, sky, data):
    space = search_space(graph, car, LinkModel.INTEGRATED, rule, StopSettings(), sky)
    ends = [data.draw(st.sampled_from(road_links(graph))) for _ in range(2)]
    start, goal = LinkPosition(ends[0], 0.0), LinkPosition(ends[1], float(graph.length_m[ends[1]]))
    path, _ = find_path(space, WorkspacePool(graph.link_count), weights, Limits(), [start], [goal])
    assume(path is not None)
    chain = ChainMaker(graph).chain(
        tuple(LinkSpan(k, 0.0, float(graph.length_m[k])) for k in path.links), StopSettings(), sky
    )
    driven = simulate_chain(car, chain, conditions=sky, stop_rule=rule)
    assert path.energy_j == pytest.approx(driven.energy_j, rel=1e-9, abs=1e-6)
    assert path.time_s == pytest.approx(driven.duration_s, rel=1e-9)
    ferry = graph.is_ferry()[list(path.links)]
    aboard = dict(zip(graph.ferries.link.tolist(), graph.ferries.duration_s.tolist(), strict=True))
    assert driven.links.energy_j[ferry].tolist() == [0.0] * int(ferry.sum())
    assert not driven.links.parts_j[ferry].any()
    assert driven.links.duration_s[ferry].tolist() == [aboard[k] for k in path.links if k in aboard]
    before = np.flatnonzero(ferry[1:])
    assert not driven.links.speed_end_mps[before].any()
    assert not driven.links.speed_end_mps[ferry].any()
    assert driven.parts.total_j() == pytest.approx(driven.energy_j, rel=1e-9, abs=1e-3)


@settings(max_examples=80, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(sounds(nodes=6), vehicles, charges, rules, st.sampled_from([STILL, COLD]))
def test_reach_over_ferries_is_that_of_the_routes_to_each_node(graph, car, limits, rule, sky):
    space = search_space(graph, car, LinkModel.INTEGRATED, rule, StopSettings(), sky)
    pool, start = WorkspacePool(graph.link_count), LinkPosition(road_links(graph)[0], 0.0)
    reached = reach(space, pool, limits, [start], graph.head, graph.node_count)
    assert (reached.link_reach_m[graph.is_ferry()] == -1.0).all()
    by_time = reach_by(space, pool, Measure.TIME, 1e5, [start], graph.head, graph.node_count)
    for node in range(graph.node_count):
        into = np.flatnonzero((graph.head == node) & ~graph.is_ferry())
        if not into.size or ((graph.head == node) & graph.is_ferry()).any():
            continue
        ends = [LinkPosition(k, float(graph.length_m[k])) for k in into.tolist()]
        path, _ = find_path(space, pool, ECO, limits, [start], ends)
        assert reached.node_energy_j[node] == pytest.approx(math.inf if path is None else path.energy_j, abs=1e-3)
        path, _ = find_path(space, pool, FASTEST, Limits(), [start], ends)
        assert by_time.node_least[node] == pytest.approx(math.inf if path is None else path.time_s, rel=1e-9)


def test_a_ferry_costs_its_time_and_nothing_else():
    road = SPEEDS[2]
    links = [
        (0, 1, 500.0, road, 0),
        (1, 2, 900.0, road, 0),
        (2, 3, 500.0, road, 0),
        (1, 2, 4000.0, road, 0),
        (3, 0, 900.0, road, 0),
    ]
    graph = graph_of(links, [0.0] * 4)
    ferry = int(np.flatnonzero(graph.length_m == 900.0)[0])
    around = int(np.flatnonzero(graph.length_m == 4000.0)[0])
    graph = replace(graph, ferries=Ferries(np.array([ferry]), np.array([1800.0])))
    space = search_space(graph, vehicle(), LinkModel.INTEGRATED, StopRule.NONE, StopSettings())
    pool = WorkspacePool(graph.link_count)
    first, last = int(np.flatnonzero(graph.tail == 0)[0]), int(np.flatnonzero(graph.head == 3)[0])
    start, goal = LinkPosition(first, 0.0), LinkPosition(last, 500.0)
    eco, _ = find_path(space, pool, ECO, Limits(), [start], [goal])
    fastest, _ = find_path(space, pool, FASTEST, Limits(), [start], [goal])
    assert (eco.links, fastest.links) == ((first, ferry, last), (first, around, last))
    # each leg from rest to rest, as if the ferry were not there
    leg, _ = find_path(space, pool, ECO, Limits(), [start], [LinkPosition(first, 500.0)])
    assert eco.energy_j == pytest.approx(2.0 * leg.energy_j, rel=1e-12)
    assert eco.time_s == pytest.approx(2.0 * leg.time_s + 1800.0, rel=1e-12)
