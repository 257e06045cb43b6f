"""Rules that promises and remedies obey on any world: drawn ones, usual and as if they were large."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import pairwise

import pytest

from routing.charging.plan import ChargingAnswer, ChargingQuery, Help, HelpKind, Plan
from routing.charging.planner import ChargingPlanner
from routing.links.spans import ChainMaker
from routing.queries import RouteQuery
from routing.route.best_path import RouteSearch
from tests.routing.charging.promise.drives import promised
from tests.routing.charging.promise.test_promise import hilly
from tests.routing.charging.worlds import World

CONFIDENCES = (None, 0.6, 0.8, 0.95)
SHORT = ((0.3, 0.6), (0.2, 0.9))  # charges at departure and most charges with which many worlds have no plan
VARIED = ({}, {"most_stops": 1}, {"departure_min": 420.0}, {"overhead_s": 0.0, "goal_soc_frac": 0.5}, {"most_stops": 0})


def varied(seed: int) -> World:
    """A drawn world with a question that varies, some of its stations with hours."""
    world = hilly(seed)
    hours = ["Mo-Su 07:10-07:40" if k % 2 else "" for k in range(len(world.stations))]
    stations = tuple(replace(s, opening_hours=h) for s, h in zip(world.stations, hours, strict=True))
    charging = replace(world.charging, **VARIED[seed % len(VARIED)])  # type: ignore[arg-type]
    return replace(world, charging=charging, stations=stations)


def planner_of(world: World, *, large: bool = False) -> ChargingPlanner:
    chains = ChainMaker(world.graph)
    search = RouteSearch(world.graph, chains)
    return ChargingPlanner(search, chains, many_links=0) if large else ChargingPlanner(search, chains)


def answer(planner: ChargingPlanner, world: World, query: RouteQuery, charging: ChargingQuery) -> ChargingAnswer:
    return planner.plan(query, charging, world.vehicle_charging, world.stations, world.places)


def cost_of(plan: Plan | None) -> float:
    return math.inf if plan is None else plan.objective


def no_less(less: float, more: float) -> bool:
    return more >= less or more == pytest.approx(less, rel=1e-6)


@pytest.mark.parametrize("first", range(0, 25, 5))
def test_more_confidence_or_reserve_is_surer_and_never_cheaper_and_quantiles_rise(first: int) -> None:
    for seed in range(first, first + 5):
        world = varied(seed)
        planner = planner_of(world)
        costs, kept = [], []
        for confidence in CONFIDENCES:
            charging = replace(world.charging, confidence=confidence)
            plan = next(iter(answer(planner, world, world.query, charging).plans), None)
            costs.append(cost_of(plan))
            arrive = charging.arrive_soc_frac + 0.1
            more = replace(charging, arrive_soc_frac=arrive, goal_soc_frac=max(charging.goal_soc_frac, arrive))
            reserved = next(iter(answer(planner, world, world.query, more).plans), None)
            assert no_less(costs[-1], cost_of(reserved)), seed
            if plan is None:
                continue
            assert min(promised(plan)) >= (confidence or 0.0), seed
            if confidence is not None:
                kept.append(min(promised(plan)))
            for quantiles in (*(stop.arrive_quantiles_frac for stop in plan.stops), plan.goal_quantiles_frac):
                assert quantiles is not None
                assert quantiles == tuple(sorted(quantiles)), seed
        assert all(no_less(less, more) for less, more in pairwise(costs)), seed
        assert kept == sorted(kept), seed


def followed(query: RouteQuery, charging: ChargingQuery, remedy: Help) -> tuple[RouteQuery, ChargingQuery]:
    """A question that follows a remedy."""
    assert remedy.value is not None
    if remedy.kind is HelpKind.SPEED_CAP:
        return query, replace(charging, speed_caps_mps=(remedy.value,))
    if remedy.kind is HelpKind.MAX_SOC:
        return query, replace(charging, max_soc_frac=remedy.value)
    if remedy.kind is HelpKind.SOC:
        return replace(query, soc_frac=remedy.value), charging
    assert remedy.kind is HelpKind.CONFIDENCE
    return query, replace(charging, confidence=remedy.value)


@pytest.mark.parametrize("large", [False, True])
def test_each_remedy_gives_a_plan_when_it_is_followed_alone(large: bool) -> None:
    told: set[HelpKind] = set()
    for seed in (*range(16), 42, 60, 62):
        world = varied(seed)
        planner = planner_of(world, large=large)
        for confidence, (soc, most) in ((None, SHORT[1]), (0.95, SHORT[0]), (0.8, SHORT[1])):
            query = replace(world.query, soc_frac=soc)
            charging = replace(world.charging, confidence=confidence, max_soc_frac=most)
            missing = answer(planner, world, query, charging).no_plan
            for remedy in () if missing is None else missing.helps:
                told.add(remedy.kind)
                again = answer(planner_of(world, large=large), world, *followed(query, charging, remedy))
                assert again.plans, (seed, confidence, remedy)
    assert told == set(HelpKind) - {HelpKind.STATIONS}
