"""The table of drives: a search that adds up what is known answers like one that drives every link."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from energy.chain.chain import LinkModel, StopRule
from energy.conditions import STILL
from energy.stops import StopSettings
from energy.vehicle.coefficients import EffectCoefficients
from energy.vehicle.consumption_table import ConsumptionTableVehicle
from energy.vehicle.files import load_vehicles
from routing.cache_budget import CacheBudget
from routing.dominance.kernels_dominates import least_slack_j
from routing.dominance.kernels_rules import UNEVEN_J
from routing.dominance.kernels_slack import Entry, LinkAhead, greatest_of_sums, state_slack
from routing.graph.road_graph import RoadGraph
from routing.links.drives import LEAST_ROWS, Drives
from routing.links.spans import ChainMaker
from routing.places import LinkPosition
from routing.route.best_path import RouteSearch
from routing.search.found import Limits, PathOptions
from routing.search.search import find_path, reach
from routing.search.space import SearchSpace, search_space
from routing.search.workspaces import WorkspacePool
from tests.routing.search.test_exact import (
    LEARNED,
    LOSSY,
    SPEEDS,
    WEATHER,
    charges,
    graph_of,
    maps,
    vehicle,
    vehicles,
    weightings,
)

RULES = st.sampled_from([StopRule.EXPECTED, StopRule.NONE, StopRule.CROSSINGS])
BUNDLED = load_vehicles(Path(__file__).resolve().parents[3] / "data/vehicles").values()
TABLE_CARS = [car for car in BUNDLED if isinstance(car, ConsumptionTableVehicle)]


def without_table(space: SearchSpace, graph: RoadGraph) -> SearchSpace:
    """The same space with a table that has room for nothing."""
    return replace(space, drives=Drives(graph.successor_first, most_rows=1))


def grid(side: int = 60) -> RoadGraph:
    """A square of streets over waves of hills, each a link either way, limits and crossings from a fixed seed."""
    rng = np.random.default_rng(3)
    links = []
    for a in range(side * side):
        right, up = a + 1, a + side
        for b in [right] * (right % side > 0) + [up] * (up < side * side):
            length = float(rng.uniform(20.0, 300.0))
            for tail, head in ((a, b), (b, a)):
                links.append((tail, head, length, float(rng.choice(SPEEDS)), int(rng.integers(4))))
    return graph_of(links, [20.0 * float(np.sin(0.3 * a) + np.cos(0.07 * a)) for a in range(side * side)])


@pytest.fixture(scope="module")
def streets() -> RoadGraph:
    return grid()


def space_of(graph, car=None, rule=StopRule.EXPECTED, sky=STILL) -> SearchSpace:
    return search_space(graph, car or vehicle(), LinkModel.INTEGRATED, rule, StopSettings(), sky)


UNHELD = Limits()


def reached(graph, space, limits=UNHELD, link=0):
    start = LinkPosition(link, 0.3 * float(graph.length_m[link]))
    return reach(space, WorkspacePool(graph.link_count), limits, [start], graph.head, graph.node_count)


def same(first, second):
    np.testing.assert_allclose(first.node_energy_j, second.node_energy_j, rtol=1e-9, atol=1e-6)
    np.testing.assert_allclose(first.link_reach_m, second.link_reach_m, rtol=1e-9, atol=1e-6)
    assert first.counts.labels_made == second.counts.labels_made
    assert first.counts.reduced_below_zero == second.counts.reduced_below_zero == 0


@settings(max_examples=150, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(
    maps(nodes=6),
    st.one_of(vehicles, st.sampled_from(TABLE_CARS)),
    charges,
    RULES,
    st.sampled_from([STILL, *WEATHER]),
    st.sampled_from([EffectCoefficients(), LOSSY, *LEARNED]),
)
def test_second_search_reaches_what_a_search_without_a_table_reaches(graph, car, limits, rule, sky, learned):
    if isinstance(car, ConsumptionTableVehicle):
        sky = STILL
    else:
        car = replace(car, effects=learned)
    space = space_of(graph, car, rule, sky)
    driven = reached(graph, without_table(space, graph), limits)
    for _ in range(2):
        same(reached(graph, space, limits), driven)


@settings(max_examples=150, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(maps(nodes=6), vehicles, weightings, charges, RULES, st.sampled_from([STILL, *WEATHER]), st.data())
def test_way_found_with_a_table_filled_elsewhere_is_that_found_without(graph, car, weights, limits, rule, sky, data):
    space = space_of(graph, car, rule, sky)
    reached(graph, space, link=data.draw(st.integers(0, graph.link_count - 1)))
    ends = [data.draw(st.integers(0, graph.link_count - 1)) for _ in range(2)]
    start = LinkPosition(ends[0], 0.4 * float(graph.length_m[ends[0]]))
    goal = LinkPosition(ends[1], 0.7 * float(graph.length_m[ends[1]]))
    pool = WorkspacePool(graph.link_count)
    pareto = limits.held and (weights.time > 0.0 or weights.distance > 0.0)
    known, driven = (
        find_path(s, pool, weights, limits, [start], [goal], PathOptions(pareto, begin_s=40.0))[0]
        for s in (space, without_table(space, graph))
    )
    assert (known is None) == (driven is None)
    if known is not None and driven is not None:
        assert known.cost == pytest.approx(driven.cost, rel=1e-9)
        assert known.energy_j == pytest.approx(driven.energy_j, rel=1e-9, abs=1e-3)
        assert known.links == driven.links


@pytest.mark.parametrize("rule", [StopRule.EXPECTED, StopRule.NONE])
def test_table_grows_during_a_search_and_a_repeated_search_adds_nothing(streets, rule):
    space = space_of(streets, rule=rule)
    first = reached(streets, space)
    assert space.drives.rows > LEAST_ROWS
    rows = space.drives.rows
    second = reached(streets, space)
    assert space.drives.rows == rows
    driven = reached(streets, without_table(space, streets))
    same(first, driven)
    same(second, driven)


def test_full_table_answers_like_an_endless_one(streets):
    space = space_of(streets)
    scarce = replace(space, drives=Drives(streets.successor_first, most_rows=5000))
    for link in (0, 700):
        same(reached(streets, scarce, link=link), reached(streets, space, link=link))
    assert 4900 < scarce.drives.rows <= 5000


def test_search_beside_one_that_fills_reads_the_table_and_leaves_it_alone(streets):
    space = space_of(streets)
    reached(streets, space, Limits(most_energy_j=4e5))
    rows = space.drives.rows
    with space.drives.lent() as lent:
        assert lent.table.fills
        beside = reached(streets, space)
        assert space.drives.rows == rows
    same(beside, reached(streets, space))
    assert space.drives.rows > rows


def test_searches_at_once_on_an_empty_table_answer_like_one_after_the_other(streets):
    links = [0, 3000, 7000] * 3
    space = space_of(streets)
    with ThreadPoolExecutor(4) as threads:
        together = list(threads.map(lambda link: reached(streets, space, link=link), links))
    for link, found in zip(links[:3], together[:3], strict=True):
        driven = reached(streets, without_table(space, streets), link=link)
        same(found, driven)
    for found, again in zip(together[:3], together[6:], strict=True):
        same(found, again)


def test_tyres_that_warm_up_keep_drives_out_of_the_table(streets):
    car = vehicle(effects=EffectCoefficients(tyre_warm_up_frac=0.4, tyre_time_s=600.0))
    space = space_of(streets, car)
    reached(streets, space)
    assert space.drives.rows == 0


@settings(max_examples=400, deadline=None)
@given(
    speeds=st.tuples(st.floats(0.0, 36.0), st.floats(0.0, 36.0)),
    stopped=st.tuples(st.sampled_from((0.0, 0.1, 0.35, 1.0)), st.sampled_from((0.0, 0.1, 0.35, 1.0))),
    length=st.sampled_from((1.0, 10.0, 40.0, 120.0, 500.0, 3000.0)),
    limit=st.sampled_from(SPEEDS.tolist()),
    car=vehicles,
    learned=st.sampled_from([EffectCoefficients(), LOSSY, *LEARNED]),
)
def test_quick_bound_asks_for_no_more_than_the_whole_one(speeds, stopped, length, limit, car, learned):
    graph = graph_of([(0, 1, length, limit, 1), (1, 0, 30.0, SPEEDS[4], 1)], [0.0, 0.2])
    space = space_of(graph, replace(car, effects=learned))
    link = int(np.flatnonzero(graph.tail == 0)[0])
    (v_a, v_b), k = (min(v, limit) for v in speeds), int(space.arrays.top_class[link])
    ahead = LinkAhead(link, length, limit, k)
    entry_a, entry_b = Entry(v_a, stopped[0], 0.0), Entry(v_b, stopped[1], 0.0)
    whole_j, _, _, _ = state_slack(space.slack, space.half_inertia_kg, ahead, entry_a, entry_b)
    kinetic_j = space.slack.drive_factor * space.half_inertia_kg
    accel = greatest_of_sums(space.slack.accel_sum)
    uneven_j = float(space.slack.bounds[UNEVEN_J, k])
    if entry_a != entry_b:
        assert least_slack_j(kinetic_j, accel, uneven_j, length, limit, entry_a, entry_b) <= whole_j


def test_forgotten_table_is_filled_anew_and_one_that_is_being_filled_is_kept(streets):
    space = space_of(streets)
    first = reached(streets, space)
    with space.drives.lent() as lent:
        assert lent.table.fills
        space.drives.forget()
        assert space.drives.rows > 0
    space.drives.forget()
    assert space.drives.rows == 0
    same(reached(streets, space), first)
    assert space.drives.rows > 0


def test_only_what_was_asked_for_last_is_kept_where_memory_is_short(streets):
    skies = [replace(STILL, payload_kg=100.0 * k) for k in range(6)]
    probe = space_of(streets)
    reached(streets, probe)
    table_bytes = probe.drives.held_bytes
    budget = CacheBudget(3 * table_bytes)
    search = RouteSearch(streets, ChainMaker(streets), budget=budget)

    def asked(sky):
        return search.space(vehicle(), LinkModel.INTEGRATED, StopRule.EXPECTED, StopSettings(), sky)

    spaces = [asked(sky) for sky in skies]
    for sky in skies:
        reached(streets, asked(sky))
        assert sum(budget.held_bytes().values()) <= 4 * table_bytes  # the last one has grown since
    asked(skies[-1])
    assert sum(budget.held_bytes().values()) <= 3 * table_bytes
    assert budget.dropped > 0
    assert [space.drives.rows > 0 for space in spaces[:2]] == [False, False]
    assert asked(skies[-1]).drives.rows > 0
    same(reached(streets, asked(skies[0])), reached(streets, space_of(streets, sky=skies[0])))
