"""What is known of ways between two places covers every way, and what is not known is bounded."""

from __future__ import annotations

import math

import numpy as np
import pytest

from routing.charging.legs import LegCounts, LegFinder, LegStore, Place
from routing.charging.ways import Line, Way, joined, likely_between
from routing.links.spans import ChainMaker
from routing.route.best_path import RouteSearch
from routing.search.found import Limits
from routing.search.search import find_path
from routing.search.search_back import search_back
from routing.weights import ECO, FASTEST, Weights
from tests.routing.charging.worlds import World, drawn_world, trails

MIXED = Weights(0.05, 1.0, 0.0)
SEEDS = (3, 17, 43, 100, 105)
NOISE = 1e-6


def takes(way: Way) -> tuple[float, ...]:
    return way.time_s, way.energy_j, way.need_j, way.spill_j, way.longest_j


def finder_of(world: World) -> LegFinder:
    search = RouteSearch(world.graph, ChainMaker(world.graph))
    return LegFinder(LegStore(search), world.query, (MIXED, FASTEST, ECO), LegCounts())


@pytest.mark.parametrize("seed", SEEDS)
def test_every_way_is_no_better_than_a_known_one_or_a_bound(seed: int) -> None:
    world = drawn_world(seed)
    here, there = world.places[0], world.places[-1]
    (pair,) = finder_of(world).pairs(here, [there])
    for trail in trails(world, here, there):
        assert any(
            all(a <= b + NOISE * abs(b) + 1e-3 for a, b in zip(takes(way), trail.takes, strict=True))
            for way in (*pair.ways, *pair.bounds())
        )


@pytest.mark.parametrize("seed", SEEDS)
def test_refining_ends_with_all_ways(seed: int) -> None:
    world = drawn_world(seed)
    here, there = world.places[0], world.places[-1]
    finder = finder_of(world)
    (pair,) = finder.pairs(here, [there])
    while pair.bounds():
        assert finder.refined(here, there, pair.bounds()[0], math.inf, math.inf, world.capacity_j * 100.0)
        (pair,) = finder.pairs(here, [there])
    found = sorted(takes(way) for way in pair.ways)
    expected = sorted(trail.takes for trail in trails(world, here, there))
    assert len(found) == len(expected)
    np.testing.assert_allclose(found, expected, rtol=1e-9, atol=1e-3)


@pytest.mark.parametrize("seed", SEEDS)
def test_ways_that_were_compared_up_to_a_time_are_compared_on_where_more_is_asked_for(seed: int) -> None:
    world = drawn_world(seed)
    here, there = world.places[0], world.places[-1]
    finder = finder_of(world)
    trails_there = sorted(trail.takes for trail in trails(world, here, there))
    for most_s in (1.1 * trails_there[0][0], 2.0 * trails_there[-1][0]):
        while any(
            finder.refined(here, there, bound, most_s, math.inf, world.capacity_j * 100.0)
            for bound in finder.pairs(here, [there])[0].bounds()
        ):
            pass
        (pair,) = finder.pairs(here, [there])
        found = [takes(way) for way in pair.ways]
        for trail in (trail for trail in trails_there if trail[0] <= most_s):
            assert any(np.allclose(way, trail, rtol=1e-9, atol=1e-3) for way in found)
    assert len(pair.ways) == len(trails_there)


@pytest.mark.parametrize("seed", SEEDS)
def test_ways_that_were_compared_up_to_an_energy_are_bounded_beyond_it_and_compared_on(seed: int) -> None:
    world = drawn_world(seed)
    here, there = world.places[0], world.places[-1]
    finder = finder_of(world)
    trails_there = [trail.takes for trail in trails(world, here, there)]
    energies = sorted(trail[1] for trail in trails_there)
    for most_j in (0.5 * (energies[0] + energies[-1]), energies[-1] + 1.0):
        while any(
            finder.refined(here, there, bound, math.inf, most_j, world.capacity_j * 100.0)
            for bound in finder.pairs(here, [there])[0].bounds()
        ):
            pass
        (pair,) = finder.pairs(here, [there])
        ways, bounds = [takes(way) for way in pair.ways], [takes(bound) for bound in pair.bounds()]
        for trail in trails_there:
            if trail[1] <= most_j:
                assert any(np.allclose(way, trail, rtol=1e-9, atol=1e-3) for way in ways)
            assert any(
                all(a <= b + NOISE * abs(b) + 1e-3 for a, b in zip(known, trail, strict=True))
                for known in (*ways, *bounds)
            )
    assert len(pair.ways) == len(trails_there)


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize("weights", [FASTEST, MIXED, ECO])
def test_the_bound_of_an_ended_search_is_never_above_the_best_way(seed: int, weights: Weights) -> None:
    world = drawn_world(seed)
    search = RouteSearch(world.graph, ChainMaker(world.graph))
    space = search.space_of(world.query, world.query.vehicle)
    sources = [world.places[0], *(station.position for station in world.stations)]
    for labels in (1, 4, 10_000):
        with search_back(space, search.pool, weights, sources[0], world.places[-1]) as back:
            found = back.least_costs(sources, labels)
        for bound, source in zip(found.tolist(), sources, strict=True):
            path, _ = find_path(space, search.pool, weights, Limits(), source, world.places[-1])
            least = math.inf if path is None else path.cost
            assert bound <= least + 1e-9 * abs(least)
            if labels == 10_000 and path is not None:
                assert bound == pytest.approx(least, rel=1e-9)


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize("weights", [FASTEST, MIXED, ECO])
def test_a_search_along_a_way_finds_the_best_ways_to_other_places(seed: int, weights: Weights) -> None:
    world = drawn_world(seed)
    search = RouteSearch(world.graph, ChainMaker(world.graph))
    space = search.space_of(world.query, world.query.vehicle)
    start, goal = world.places[0], world.places[-1]
    targets = [*(station.position for station in world.stations), goal]
    met: list[float] = []

    def is_enough(_: int, cost: float, via: float) -> bool:
        assert cost <= via + 1e-9 * abs(via) or weights.energy > 0.0  # ways down to the goal give something back
        met.append(via)
        return False

    with search_back(space, search.pool, weights, start, goal) as back:
        costs, paths = back.on_the_way(start, targets, is_enough, lambda costs: range(costs.size))
    assert met == sorted(met)
    for k, target in enumerate(targets):
        path, _ = find_path(space, search.pool, weights, Limits(), start, target)
        assert math.isinf(costs[k]) == (path is None)
        if path is not None:
            assert costs[k] == pytest.approx(path.cost, rel=1e-9)
            assert paths[k].cost == costs[k]


def test_one_way_after_the_other_does_to_a_battery_what_both_do() -> None:
    rng = np.random.default_rng(7)
    capacity = 100.0
    for _ in range(200):
        profiles = []
        for steps in (rng.normal(0.0, 20.0, 5), rng.normal(0.0, 20.0, 4)):
            used = np.concatenate(([0.0], np.cumsum(steps)))
            falls = used - np.minimum.accumulate(used)
            profiles.append((steps, Way(1.0, used[-1], used.max(), falls[-1], falls.max())))
        whole = joined(profiles[0][1], profiles[1][1])
        for start in np.linspace(0.0, capacity, 21).tolist():
            charge, lowest = start, start
            for step in np.concatenate([steps for steps, _ in profiles]).tolist():
                charge = min(charge - step, capacity)
                lowest = min(lowest, charge)
            possible = start >= whole.need_j - 1e-9 and capacity >= whole.longest_j - 1e-9
            assert possible == (lowest >= -1e-9)
            if possible:
                assert charge == pytest.approx(min(start - whole.energy_j, capacity - whole.spill_j))


@pytest.mark.parametrize("seed", SEEDS)
def test_what_a_way_likely_takes_costs_no_more_than_the_best_way(seed: int) -> None:
    world = drawn_world(seed)
    finder = finder_of(world)
    start, goal = world.places[0], world.places[-1]
    unit = Line.of(MIXED, 0.0)

    def best(here: Place, there: Place) -> Way | None:
        return finder.pairs(here, [there])[0].best(MIXED)

    for here in world.stations:
        for there in world.stations:
            way = best(here.position, there.position)
            onward = best(here.position, goal), best(there.position, goal)
            so_far = best(start, there.position), best(start, here.position)
            likely = likely_between(MIXED, [onward, so_far])
            assert bool(likely) == any(None not in ways for ways in (onward, so_far))
            for bound in likely:
                assert bound.is_bound
                cost = unit.a_second * bound.time_s + unit.a_joule * bound.energy_j
                if way is not None and bound.time_s > 0.0:
                    assert cost <= unit.a_second * way.time_s + unit.a_joule * way.energy_j + 1e-9
