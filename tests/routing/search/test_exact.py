"""The compiled search, its networkx twin and the enumeration of all ways find the same costs."""

from __future__ import annotations

import itertools
import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import HealthCheck, assume, given, settings
from hypothesis import strategies as st

from energy.chain.chain import Chain, LinkModel, StopRule, simulate_chain
from energy.chain.kernels_link import link_energy
from energy.conditions import STILL, Conditions, RoadSurface
from energy.force.effects import drive_of
from energy.force.kernels_physics import ROAD_WARM_UP, accepted_j, cabin_energy_j, road_in_time
from energy.stops import StopSettings
from energy.units import JOULE_PER_KWH
from energy.vehicle.coefficients import EffectCoefficients
from energy.vehicle.vehicle import Vehicle
from routing.errors import SearchLimitError
from routing.graph.networkx_graph import to_networkx
from routing.graph.road_graph import GraphMeta, LooseLinks, LooseNodes, RoadGraph, Terrain, assemble_graph
from routing.places import LinkPosition
from routing.search.found import Limits, PathOptions
from routing.search.reference import EnergySearch
from routing.search.search import find_path, reach
from routing.search.space import search_space
from routing.search.workspaces import WorkspacePool
from routing.weights import ECO, Weights

META = GraphMeta("drawn", "test", "none", "none", Terrain.SYNTHETIC, "drawn", 0.0, (0.0, 0.0, 0.0, 0.0))
TWIN_LABELS = 4000
SPEEDS = np.array([10.0, 30.0, 50.0, 90.0, 130.0]) / 3.6


def vehicle(accel=(1.4, 1.2, 1.0, 0.7, 0.5), decel=(1.3, 1.2, 1.1, 1.0, 0.9), **changes) -> Vehicle:
    bounds = np.array([0.0, 20.0, 40.0, 60.0, 90.0, 140.0]) / 3.6
    values = {
        "id": "drawn",
        "name": "drawn",
        "mass_kg": 1800.0,
        "road_load_a_n": 120.0,
        "road_load_b_n_per_mps": -1.5,
        "road_load_c_n_per_mps2": 0.5,
        "drive_eff": 0.9,
        "recuperation_eff": 0.6,
        "aux_power_w": 600.0,
        "usable_capacity_wh": 3000.0,
    } | changes
    return Vehicle(accel_speed_mps=bounds, accel_mps2=np.array(accel), decel_mps2=-np.array(decel), **values)


def graph_of(links, heights) -> RoadGraph:
    """A graph from (tail, head, length, speed, cross) rows; straight lines drawn apart so that twins are told apart."""
    n = len(links)
    tail, head = (np.array([row[k] for row in links], np.int32) for k in (0, 1))
    length = np.array([row[2] for row in links])
    nodes = len(heights)
    lon, lat = np.arange(nodes) * 10_000, np.arange(nodes) ** 2 * 10_000
    geometry_lon = np.column_stack((lon[tail], lon[head])).ravel().astype(np.int32)
    geometry_lat = np.column_stack((lat[tail], lat[head])).ravel().astype(np.int32)
    return assemble_graph(
        META,
        ("",),
        LooseNodes(lat / 1e7, lon / 1e7, np.array(heights), np.arange(nodes)),
        LooseLinks(
            tail=tail,
            head=head,
            length_m=length,
            speed_limit_mps=np.array([row[3] for row in links]),
            functional_class=np.full(n, 6, np.int8),
            cross=np.array([row[4] for row in links], np.int8),
            urban=np.ones(n, bool),
            structure=np.zeros(n, bool),
            way_id=np.arange(n),
            name_idx=np.zeros(n, np.int32),
            geometry_first=np.arange(n + 1) * 2,
            geometry_lon_e7=geometry_lon,
            geometry_lat_e7=geometry_lat,
            forbidden_turns=np.empty((0, 2), np.int64),
        ),
    )


def cheapest_by_enumeration(graph, space, weights, limits, start, goal, most_links):
    """Least cost over every way of at most most_links links, each driven link by link with nothing left out."""
    g, p = space.arrays, space.physics
    best = math.inf

    def drive(link, offset, v, stopped, energy, time, distance, depth):
        nonlocal best
        limit = g.speed_limit_mps[link]

        def cost_of(e, t, d):
            return weights.energy * e / JOULE_PER_KWH + weights.time * t / 3600.0 + weights.distance * d / 1000.0

        if link == goal.link_idx and goal.offset_m > offset:
            ds = goal.offset_m - offset
            road = road_in_time(p, g.roads, link, time, ds / limit)
            e, t, _ = link_energy(p, road, ds, v, stopped, limit, limit, 1.0, 0.0)
            e = accepted_j(p, energy, e + cabin_energy_j(p, time, time + t), limits.least_energy_j)
            used = max(energy + e, limits.least_energy_j)
            if used <= limits.most_energy_j:
                best = min(best, cost_of(used, time + t, distance + ds))
        if depth == most_links:
            return
        ds = g.length_m[link] - offset
        road = road_in_time(p, g.roads, link, time, ds / limit)
        p_stop, wait = g.stop_probability_frac[link], g.stop_time_s[link]
        for following in graph.successors(link).tolist():
            e, t, end = link_energy(p, road, ds, v, stopped, limit, g.speed_limit_mps[following], p_stop, wait)
            e = accepted_j(p, energy, e + cabin_energy_j(p, time, time + t), limits.least_energy_j)
            used = max(energy + e, limits.least_energy_j)
            if used <= limits.most_energy_j:
                drive(following, 0.0, end, p_stop, used, time + t, distance + ds, depth + 1)

    drive(start.link_idx, start.offset_m, 0.0, 0.0, 0.0, 0.0, 0.0, 1)
    return best


def answered(search, *positions):
    """What a twin's search answers; maps on which equal states never recur are too much for it and are set aside."""
    answer, enough = None, True
    try:
        answer = search(*positions)
    except SearchLimitError:
        enough = False
    assume(enough)
    return answer


def far_behind(space, weights):
    """Dominance that needs no theorem: a lead of the whole kinetic energy at the top speed, and of five minutes."""
    p = space.physics
    worth = p.drive_factor * 2.0 * space.half_inertia_kg * SPEEDS[-1] ** 2 + 300.0 * (p.aux_move_w + p.cabin_w)
    worth += p.cabin_start_w * (300.0 + p.cabin_time_s)
    worth += 2.0 * p.drive_factor * space.arrays.roads[:, ROAD_WARM_UP].max() * SPEEDS[-1] * p.tyre_time_s
    lead = weights.energy * worth / JOULE_PER_KWH + weights.time * 300.0 / 3600.0
    return lambda a, b: a.cost + lead <= b.cost


@st.composite
def maps(draw, nodes=4):
    """A ring with chords on hilly ground: short and long links, every cross, some oneway."""
    count = draw(st.integers(3, nodes))
    heights = [draw(st.floats(0.0, 60.0)) for _ in range(count)]
    pairs = [(k, (k + 1) % count) for k in range(count)]
    others = [q for q in itertools.permutations(range(count), 2) if q not in pairs]
    pairs += draw(st.lists(st.sampled_from(others), unique=True, max_size=4)) if others else []
    links = []
    for a, b in pairs:
        least = 1.5 * abs(heights[a] - heights[b]) + 2.0
        length = draw(st.sampled_from((1.0, 7.0, 25.0, 60.0, 150.0, 700.0))) + least
        links.append((a, b, length, draw(st.sampled_from(SPEEDS.tolist())), draw(st.integers(0, 3))))
    return graph_of(links, heights)


weightings = st.sampled_from(
    [Weights(1.0, 0.0, 0.0), Weights(0.0, 1.0, 0.0), Weights(1.0, 10.0, 0.0), Weights(1.0, 3.0, 0.2)]
)
charges = st.sampled_from(
    [Limits(), Limits(0.0, 4e5), Limits(-1e4, 2e5), Limits(-1e6, 5e4), Limits(0.0, 1e5), Limits(-2e4, math.inf)]
)
never_full = st.sampled_from([Limits(), Limits(-math.inf, 4e5), Limits(-math.inf, 1e5), Limits(-math.inf, 3e4)])
vehicles = st.sampled_from(
    [
        vehicle(),
        vehicle(recuperation_eff=0.0),
        vehicle(drive_eff=1.0, recuperation_eff=1.0),
        vehicle(accel=(0.5, 1.5, 0.4, 1.0, 0.3)),
        vehicle(accel=(1.0,) * 5, road_load_b_n_per_mps=3.0, aux_power_w=5000.0),
    ]
)
rules = st.sampled_from([StopRule.EXPECTED, StopRule.NONE])
LOSSY = EffectCoefficients(battery_resistance_ohm=0.2, drive_loss_w_per_n2=3e-4, regen_cap_w=15_000.0)
LEARNED = [
    EffectCoefficients(tyre_warm_up_frac=0.4, tyre_time_s=90.0),
    EffectCoefficients(tyre_warm_up_frac=2.0, tyre_time_s=1200.0, regen_min_speed_mps=4.0),
    EffectCoefficients(regen_min_speed_mps=12.0, air_density_coef=0.0),
    EffectCoefficients(regen_always_limited=True, regen_cap_w=9000.0, regen_min_speed_mps=2.5),
    replace(LOSSY, tyre_warm_up_frac=0.8, tyre_time_s=300.0, regen_min_speed_mps=5.0, regen_always_limited=True),
    EffectCoefficients(
        tyre_warm_up_frac=0.3,
        cooling_target_k=297.0,
        cooling_soak_w_per_k=400.0,
        cooling_time_s=60.0,
        air_density_coef=2.0,
    ),
]
WEATHER = [
    Conditions(wind_speed_mps=8.0, wind_from_rad=1.0),
    Conditions(wind_speed_mps=30.0, wind_from_rad=4.0),
    Conditions(ambient_k=258.0, payload_kg=300.0),
    Conditions(ambient_k=310.0, cabin_start_k=330.0, road=RoadSurface.WET, drag_factor=1.3),
    Conditions(speed_factor=0.8, top_speed_mps=20.0, aux_power_w=3000.0),
    Conditions(regen_limited=True),
    Conditions(regen_limited=True, ambient_k=268.0, wind_speed_mps=5.0, road=RoadSurface.SNOW),
]


@settings(max_examples=250, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(maps(), vehicles, weightings, charges, rules, st.data())
def test_search_on_small_maps_equals_twin_and_enumeration(graph, car, weights, limits, rule, data):
    counts = compare(graph, car, weights, limits, rule, STILL, data)
    assert counts.reduced_below_zero == 0


@settings(max_examples=200, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(maps(), vehicles, weightings, charges, rules, st.sampled_from(WEATHER), st.booleans(), st.data())
def test_search_in_any_weather_equals_twin_and_enumeration(graph, car, weights, limits, rule, sky, lossy, data):
    car = replace(car, effects=LOSSY) if lossy else car
    counts = compare(graph, car, weights, limits, rule, sky, data)
    assert counts.reduced_below_zero == 0


@settings(max_examples=250, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(
    maps(),
    vehicles,
    weightings,
    st.one_of(never_full, charges),
    rules,
    st.sampled_from([STILL, *WEATHER]),
    st.sampled_from(LEARNED),
    st.data(),
)
def test_search_with_learned_effects_equals_twin_and_enumeration(graph, car, weights, limits, rule, sky, learned, data):
    counts = compare(graph, replace(car, effects=learned), weights, limits, rule, sky, data)
    assert counts.reduced_below_zero == 0


def compare(graph, car, weights, limits, rule, sky, data):
    start_link = data.draw(st.integers(0, graph.link_count - 1))
    goal_link = data.draw(st.integers(0, graph.link_count - 1))
    start = LinkPosition(start_link, float(graph.length_m[start_link]) * data.draw(st.sampled_from((0.0, 0.4))))
    goal = LinkPosition(goal_link, float(graph.length_m[goal_link]) * data.draw(st.sampled_from((0.7, 1.0))))
    stops = StopSettings()
    space = search_space(graph, car, LinkModel.INTEGRATED, rule, stops, sky)
    pareto = limits.held and (weights.time > 0.0 or weights.distance > 0.0)
    path, counts = find_path(
        space, WorkspacePool(graph.link_count), weights, limits, [start], [goal], PathOptions(pareto)
    )
    found = math.inf if path is None else path.cost

    edges = {data["idx"]: (u, v, k) for u, v, k, data in to_networkx(graph).edges(keys=True, data=True)}
    twin = EnergySearch(
        to_networkx(graph),
        drive_of(car, sky),
        stops if rule is StopRule.EXPECTED else None,
        weights,
        limits,
        None if limits.held else far_behind(space, weights),
        TWIN_LABELS,
    )
    label = answered(twin.route, [(edges[start_link], start.offset_m)], [(edges[goal_link], goal.offset_m)])
    assert counts.unpaid_j == 0.0
    assert found == pytest.approx(math.inf if label is None else label.cost, rel=1e-9, abs=1e-9)

    depth = 9 if graph.link_count <= 6 else 7
    enumerated = cheapest_by_enumeration(graph, space, weights, limits, start, goal, depth)
    assert found <= enumerated + 1e-9
    if path is None or len(path.links) <= depth:
        assert found == pytest.approx(enumerated, rel=1e-9, abs=1e-9)
    return counts


@settings(max_examples=120, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(maps(nodes=6), vehicles, charges, rules)
def test_reach_on_small_maps_equals_twin_at_every_node(graph, car, limits, rule):
    compare_reach(graph, car, limits, rule)


@settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(maps(), vehicles, st.one_of(never_full, charges), rules, st.sampled_from(LEARNED))
def test_reach_with_learned_effects_equals_twin_at_every_node(graph, car, limits, rule, learned):
    compare_reach(graph, replace(car, effects=learned), limits, rule)


def compare_reach(graph, car, limits, rule):
    stops = StopSettings()
    space = search_space(graph, car, LinkModel.INTEGRATED, rule, stops)
    start = LinkPosition(0, 0.3 * float(graph.length_m[0]))
    reached = reach(space, WorkspacePool(graph.link_count), limits, [start], graph.head, graph.node_count)
    nx_graph = to_networkx(graph)
    edges = {data["idx"]: (u, v, k) for u, v, k, data in nx_graph.edges(keys=True, data=True)}
    twin = EnergySearch(
        nx_graph,
        drive_of(car),
        stops if rule is StopRule.EXPECTED else None,
        ECO,
        limits,
        None if limits.held else far_behind(space, ECO),
        TWIN_LABELS,
    )
    expected = answered(twin.energy_to_nodes, [(edges[0], start.offset_m)])
    assert reached.counts.unpaid_j == 0.0
    for idx, node in enumerate(graph.node_id.tolist()):
        assert reached.node_energy_j[idx] == pytest.approx(expected.get(node, math.inf), rel=1e-9, abs=1e-3)


def test_lead_in_energy_that_a_full_battery_takes_does_not_outweigh_the_time_it_cost():
    # Two ways over the plain, a slow one that is a little cheaper in all and a fast one; then a descent that fills the
    # battery either way, so that only the time is left to tell them apart.
    links = [
        (0, 1, 1000.0, SPEEDS[3], 0),
        (1, 2, 2000.0, SPEEDS[3], 0),
        (1, 2, 2000.0, SPEEDS[2], 0),
        (2, 3, 5000.0, SPEEDS[2], 0),
        (3, 0, 5000.0, SPEEDS[2], 0),
    ]
    graph = graph_of(links, [300.0, 300.0, 300.0, 0.0])
    space = search_space(graph, vehicle(), LinkModel.INTEGRATED, StopRule.NONE, StopSettings())
    start, goal = LinkPosition(0, 0.0), LinkPosition(3, 5000.0)
    ways = {tuple(w): space.arrays.speed_limit_mps[w[1]] for w in ([0, k, 3] for k in (1, 2))}
    fast, slow = sorted(ways, key=lambda way: -ways[way])

    def found(weights, limits):
        path, _ = find_path(
            space, WorkspacePool(graph.link_count), weights, limits, [start], [goal], PathOptions(limits.held)
        )
        assert path is not None
        return path

    plain, hasty = found(Weights(1.0, 0.0, 0.0), Limits()), found(Weights(0.0, 1.0, 0.0), Limits())
    assert (plain.links, hasty.links) == (slow, fast)
    # an hour's worth at which the slow way is 1 % cheaper than the fast one, as long as all energy counts
    even = (hasty.energy_j - plain.energy_j) / JOULE_PER_KWH / ((plain.time_s - hasty.time_s) / 3600.0)
    weights = Weights(1.0, 0.99 * even, 0.0)
    assert found(weights, Limits()).links == slow
    assert found(weights, Limits(-100.0, math.inf)).links == fast


@settings(max_examples=80, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(maps(), vehicles, charges, rules, st.sampled_from([STILL, WEATHER[2], WEATHER[5]]), st.sampled_from(LEARNED))
def test_reach_with_learned_effects_is_that_of_the_routes_to_each_node(graph, car, limits, rule, sky, learned):
    car = replace(car, effects=learned)
    space = search_space(graph, car, LinkModel.INTEGRATED, rule, StopSettings(), sky)
    start, pool = LinkPosition(0, 0.0), WorkspacePool(graph.link_count)
    reached = reach(space, pool, limits, [start], graph.head, graph.node_count)
    for node in range(graph.node_count):
        ends = [LinkPosition(k, float(graph.length_m[k])) for k in np.flatnonzero(graph.head == node).tolist()]
        path, _ = find_path(space, pool, ECO, limits, [start], ends)
        assert reached.node_energy_j[node] == pytest.approx(math.inf if path is None else path.energy_j, abs=1e-3)


@settings(max_examples=80, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(maps(), vehicles, rules, st.sampled_from([STILL, *WEATHER]), st.sampled_from(LEARNED), st.data())
def test_found_way_with_learned_effects_takes_what_the_simulation_says(graph, car, rule, sky, learned, data):
    car = replace(car, effects=learned)
    space = search_space(graph, car, LinkModel.INTEGRATED, rule, StopSettings(), sky)
    goal_link = data.draw(st.integers(0, graph.link_count - 1))
    goal = LinkPosition(goal_link, float(graph.length_m[goal_link]))
    path, _ = find_path(space, WorkspacePool(graph.link_count), ECO, Limits(), [LinkPosition(0, 0.0)], [goal])
    assume(path is not None)
    links = list(path.links)
    chain = Chain(
        length_m=graph.length_m[links],
        grade_frac=space.arrays.grade_frac[links].copy(),
        speed_limit_mps=graph.speed_limit_mps[links],
        stop_probability_frac=space.arrays.stop_probability_frac[links].copy(),
        stop_time_s=space.arrays.stop_time_s[links].copy(),
        stop_class=np.zeros(len(links), np.int8),
        altitude_m=graph.altitude_m()[links],
        heading=graph.heading()[links],
    )
    driven = simulate_chain(car, chain, conditions=sky)
    assert path.energy_j == pytest.approx(driven.energy_j, rel=1e-9, abs=1e-6)
    assert path.time_s == pytest.approx(driven.duration_s, rel=1e-9)
    assert driven.parts.total_j() == pytest.approx(driven.energy_j, rel=1e-9, abs=1e-3)
