"""The search finds what Bellman-Ford finds on the expanded state graph, without potential and without dominance."""

from __future__ import annotations

import itertools
import math
import os
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from energy.chain.chain import LinkModel, StopRule
from energy.conditions import STILL, Conditions
from energy.force.kernels_physics import cabin_energy_j
from energy.stops import StopSettings
from energy.vehicle.coefficients import EffectCoefficients
from energy.vehicle.files import load_vehicles
from energy.vehicle.vehicle import Vehicle
from routing.dominance.kernels_rules import DESCENT_J, DESCENT_MPS
from routing.graph.road_graph import RoadGraph
from routing.importers.region import DEFAULT_SMOOTHING_M, import_region
from routing.places import LinkPosition, Point
from routing.planner import Planner
from routing.queries import RangeQuery
from routing.search.found import Limits, PathOptions
from routing.search.search import find_path, reach
from routing.search.space import potential_share, search_space
from routing.search.workspaces import WorkspacePool
from routing.weights import ECO, Weights
from tests.routing.search.expanded_states import StateGraph
from tests.routing.search.test_exact import LEARNED, WEATHER, charges, maps, never_full, rules, vehicles, weightings
from tests.routing.search.test_real import cut_out

VEHICLES = Path(__file__).resolve().parents[3] / "data/vehicles"
KONA, I3 = "hyundai-kona-64", "bmw-i3-60ah"
MOST_LINKS, MOST_LABELS = 14, 1200
STRONG_TYRES = EffectCoefficients(tyre_warm_up_frac=0.4, tyre_time_s=600.0)
CLIMATE = [
    Conditions(ambient_k=258.0),
    Conditions(ambient_k=310.0, cabin_start_k=330.0),
    Conditions(ambient_k=268.0, regen_limited=True),
]
drawn = settings(max_examples=80, deadline=None, suppress_health_check=[HealthCheck.too_slow])


def compare_routes(graph, car, weights, limits, rule, sky, data):
    """A search's cost to two places against the cheapest of all ways of so many links, and of all if that is whole."""
    space = search_space(graph, car, LinkModel.INTEGRATED, rule, StopSettings(), sky)
    start_link = data.draw(st.integers(0, graph.link_count - 1))
    start = LinkPosition(start_link, float(graph.length_m[start_link]) * data.draw(st.sampled_from((0.0, 0.4))))
    states = StateGraph(graph, space, limits, weights)
    fronts = states.fronts([start], MOST_LINKS, MOST_LABELS)
    pareto = limits.held and (weights.time > 0.0 or weights.distance > 0.0)
    pool = WorkspacePool(graph.link_count)
    for goal_link in data.draw(st.lists(st.integers(0, graph.link_count - 1), min_size=2, max_size=2)):
        goal = LinkPosition(goal_link, float(graph.length_m[goal_link]) * data.draw(st.sampled_from((0.7, 1.0))))
        path, counts = find_path(space, pool, weights, limits, [start], [goal], PathOptions(pareto))
        assert counts.reduced_below_zero == 0
        assert counts.unpaid_j == 0.0
        found, expected = math.inf if path is None else path.cost, states.cheapest(fronts, goal)
        assert found <= expected + 1e-9
        if fronts.whole or (path is not None and len(path.links) <= fronts.links):
            assert found >= expected or found == pytest.approx(expected, rel=1e-9, abs=1e-9)


@drawn
@given(maps(), vehicles, weightings, charges, rules, st.data())
def test_route_costs_what_the_cheapest_way_through_the_states_costs(graph, car, weights, limits, rule, data):
    compare_routes(graph, car, weights, limits, rule, STILL, data)


@drawn
@given(maps(), vehicles, weightings, charges, rules, st.sampled_from(WEATHER), st.data())
def test_route_in_any_weather_costs_what_the_cheapest_way_costs(graph, car, weights, limits, rule, sky, data):
    compare_routes(graph, car, weights, limits, rule, sky, data)


@drawn
@given(
    maps(),
    vehicles,
    st.sampled_from([ECO, Weights(1.0, 10.0, 0.0)]),
    st.one_of(never_full, charges),
    rules,
    st.sampled_from([STILL, *CLIMATE]),
    st.sampled_from(LEARNED),
    st.data(),
)
def test_route_while_cabin_and_tyres_warm_up_costs_what_the_cheapest_way_costs(
    graph, car, weights, limits, rule, sky, learned, data
):
    compare_routes(graph, replace(car, effects=learned), weights, limits, rule, sky, data)


@pytest.fixture(scope="module")
def andorra(tmp_path_factory: pytest.TempPathFactory) -> RoadGraph:
    """Andorra with measured heights."""
    real = Path(__file__).resolve().parents[3].parent / "shared/data/maps"
    if not real.is_dir():
        if os.environ.get("CI"):
            pytest.fail(f"no real maps in {real}: CI must have them")
        pytest.skip("no real maps beside the repository (shared/data/maps)")
    return import_region(
        real / "andorra.osm.pbf", [real / "N42E001.hgt.zip"], "andorra", smoothing_m=DEFAULT_SMOOTHING_M
    )


@pytest.fixture(scope="module")
def cars() -> dict[str, Vehicle]:
    return dict(load_vehicles(VEHICLES))


def compare_nodes(graph, car, rule, limits, sky, start, most_labels=200_000):
    """Least energy to stop at every node, by the search and by Bellman-Ford over states; whether over all of them."""
    space = search_space(graph, car, LinkModel.INTEGRATED, rule, StopSettings(), sky)
    states = StateGraph(graph, space, limits, ECO)
    fronts = states.fronts([start], 10_000, most_labels)
    reached = reach(space, WorkspacePool(graph.link_count), limits, [start], graph.head, graph.node_count)
    least = np.full(graph.node_count, np.inf)
    at_link = states.arrivals_at_ends(fronts)
    np.minimum.at(least, graph.head[list(at_link)], list(at_link.values()))
    there = np.isfinite(least)
    assert reached.counts.unpaid_j == 0.0
    assert (reached.node_energy_j[there] <= least[there] + 1e-3).all()
    if fronts.whole:
        assert (reached.node_energy_j >= least * (1.0 - 1e-9 * np.sign(least)) - 1e-3).all()
    return int(there.sum()), fronts.whole


@pytest.mark.shared_data
@pytest.mark.parametrize("limits", [Limits(), Limits(-2e5, 6e6), Limits(0.0, 2e7)])
@pytest.mark.parametrize("car", [KONA, I3])
def test_every_node_of_a_whole_map_costs_what_bellman_ford_says(andorra, cars, car, limits):
    reached, whole = compare_nodes(andorra, cars[car], StopRule.NONE, limits, STILL, LinkPosition(4000, 0.0))
    assert whole
    assert reached > (3000 if limits == Limits() else 200)


TOWN, PASS = (42.5063, 1.5218), (42.5428, 1.7336)


@pytest.mark.shared_data
@pytest.mark.parametrize("limits", [Limits(), Limits(-2e5, 2e6), Limits(0.0, 1.5e6)])
@pytest.mark.parametrize("place", [TOWN, PASS])
@pytest.mark.parametrize("sky", [STILL, WEATHER[0]])
def test_every_node_of_a_cut_out_with_stops_costs_what_bellman_ford_says(andorra, cars, place, limits, sky):
    graph = cut_out(andorra, *place, 450)
    start = LinkPosition(graph.link_count // 2, 0.0)
    reached, whole = compare_nodes(graph, cars[KONA], StopRule.EXPECTED, limits, sky, start)
    assert whole
    assert reached > 20


@pytest.mark.shared_data
@pytest.mark.parametrize("limits", [Limits(0.0, 3e5), Limits(-2e4, 3e5), Limits(-math.inf, 3e5)])
@pytest.mark.parametrize("learned", [STRONG_TYRES, EffectCoefficients()])
def test_every_node_near_a_pass_while_warming_up_costs_what_bellman_ford_says(andorra, cars, limits, learned):
    graph, whole = cut_out(andorra, *PASS, 120), 0
    car, top = replace(cars[KONA], effects=learned), int(np.argmax(graph.node_height_m[graph.tail]))
    for link, sky in itertools.product((top, graph.link_count // 2), CLIMATE):
        start = LinkPosition(link, 0.0)
        whole += compare_nodes(graph, car, StopRule.EXPECTED, limits, sky, start, most_labels=2500)[1]
    assert whole >= 3


HOT = CLIMATE[1]


@pytest.fixture(scope="module")
def envalira(andorra: RoadGraph) -> RoadGraph:
    """Links around a pass."""
    return cut_out(andorra, *PASS, 120)


@pytest.mark.shared_data
def test_reach_whose_proof_takes_too_many_labels_is_within_what_it_says_of_the_least(envalira, cars):
    graph = envalira
    space = search_space(graph, cars[KONA], LinkModel.INTEGRATED, StopRule.EXPECTED, StopSettings(), HOT)
    pool, limits, away = WorkspacePool(graph.link_count), Limits(0.0, math.inf), []
    for link in (int(np.argmax(graph.node_height_m[graph.tail])), graph.link_count // 2):
        ask = (space, pool, limits, [LinkPosition(link, 0.0)], graph.head, graph.node_count)
        exact, hasty = reach(*ask), reach(*ask, label_limit=400)
        assert exact.counts.unpaid_j == 0.0
        there = np.isfinite(exact.node_energy_j)
        assert np.isfinite(hasty.node_energy_j[there]).all()
        above_j = hasty.node_energy_j[there] - exact.node_energy_j[there]
        assert (above_j >= -1e-3).all()
        assert (above_j <= hasty.counts.unpaid_j + 1e-3).all()
        away.append(float(above_j.max()))
    assert max(away) > 100.0


@pytest.mark.shared_data
def test_range_whose_proof_takes_too_many_labels_says_so(envalira, cars):
    graph = envalira
    top = int(np.argmax(graph.node_height_m))
    query = RangeQuery(
        origin=Point(float(graph.node_lat_deg[top]), float(graph.node_lon_deg[top])),
        soc_frac=1.0,
        vehicle=cars[KONA],
        reserve_soc_frac=0.99,
        conditions=HOT,
    )
    (said,) = (text for text in Planner(graph, label_limit=400).range(query).warnings if "battery fills up" in text)
    assert 0.0 < float(said.split("at most ")[1].split()[0]) < 1.0
    assert not any("battery fills up" in text for text in Planner(graph).range(query).warnings)


@drawn
@given(maps(), vehicles, rules, st.sampled_from([STILL, *WEATHER, *CLIMATE]), st.sampled_from(LEARNED), st.data())
def test_no_way_on_gives_back_more_than_the_descent_from_its_link(graph, car, rule, sky, learned, data):
    space = search_space(graph, replace(car, effects=learned), LinkModel.INTEGRATED, rule, StopSettings(), sky)
    states, descent, p = StateGraph(graph, space, Limits(), ECO), space.lower_bound.descent(), space.physics
    alpha = potential_share(p) * space.half_inertia_kg
    state, used, clock, entered = (data.draw(st.integers(0, graph.link_count - 1)), 0.0, 0.0, 0.0), 0.0, 0.0, []
    for _ in range(10):
        ways = states._transitions(state, clock)
        if not ways:
            break
        energy, time, _, state = ways[data.draw(st.integers(0, len(ways) - 1))]
        used += energy + cabin_energy_j(p, clock, clock + time)
        clock += time
        link, v, stopped, _ = state
        for before, most in entered:
            assert before - used <= most + 1e-6 * (1.0 + most)
        if v >= descent[link, DESCENT_MPS]:
            entered.append((used, float(descent[link, DESCENT_J]) + alpha * (1.0 - stopped) * v * v))
