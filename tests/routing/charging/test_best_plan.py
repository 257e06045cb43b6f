"""The plan of a small world is the best of all orders of stops, all ways and all charges."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from routing.charging.plan import Objective
from routing.charging.route import halt_leg, route_of_plan
from routing.links.spans import ChainMaker
from routing.places import Point, SnappedPoint
from routing.stations.station import Price
from tests.routing.charging.worlds import drawn_world, least_cost

EQUAL_FRAC = 1e-6
HERE = Point(46.0, 8.0)
START = SnappedPoint(HERE, HERE, 0.0, 0, 0.0, "")
# up to three stops by each objective, over via points, with fixed stays, with halts without a charge, and no plan
SEEDS = (13, 18, 31, 38, 48, 51, 123, 138, 212, 1070, 1119)
UNTRIED = "not all charges ahead of halts at which nothing is charged were compared"
AHEAD_OF_HALTS = (123, 1070)  # energy is short by joules, since halts after a charge save some
HALTS = {1070: ["s0", "s1"], 1119: ["s0"]}


@pytest.mark.parametrize("seed", SEEDS)
def test_a_plan_costs_what_the_best_of_all_journeys_costs_and_is_proven(seed: int) -> None:
    world = drawn_world(seed)
    answer = world.planner().plan(world.query, world.charging, world.vehicle_charging, world.stations, world.places)
    least = least_cost(world)
    if least == math.inf:
        assert answer.plans == ()
        assert answer.no_plan is not None
        return
    (plan,) = answer.plans
    assert plan.objective == pytest.approx(least, rel=EQUAL_FRAC)
    assert plan.short_by is not None
    if seed in AHEAD_OF_HALTS:
        assert 0.0 < plan.short_by <= 1e-4 * plan.objective
        assert plan.unproven == UNTRIED
        return
    assert plan.short_by == 0.0
    assert plan.unproven == ""


@pytest.mark.parametrize("seed", [8, 15])
def test_a_plan_by_prices_where_time_is_worth_little_is_off_by_no_more_than_it_says(seed: int) -> None:
    world = drawn_world(seed)
    rng = np.random.default_rng(seed + 10**6)
    dear = float(rng.uniform(0.3, 0.6))
    price = [Price(currency="EUR", per_kwh=dear * float(rng.uniform(1.0, 1.3))) for _ in world.stations]
    stations = tuple(replace(station, price=p) for station, p in zip(world.stations, price, strict=True))
    charging = replace(world.charging, objective=Objective.COST, time_value_per_h=float(rng.choice([0.0, 1e-3, 0.05])))
    world = replace(world, charging=charging, stations=stations, query=replace(world.query, soc_frac=0.6))
    (plan,) = world.planner().plan(world.query, charging, world.vehicle_charging, stations, world.places).plans
    least = least_cost(world)
    assert plan.short_by is not None
    assert plan.objective >= least * (1.0 - EQUAL_FRAC)
    assert plan.objective - plan.short_by <= least * (1.0 + EQUAL_FRAC)
    assert (plan.unproven == UNTRIED) == (seed == 15)


@pytest.mark.parametrize("seed", HALTS)
def test_a_halt_that_helps_without_a_charge_is_no_stop_and_takes_its_time(seed: int) -> None:
    world = drawn_world(seed)
    answer = world.planner().plan(world.query, world.charging, world.vehicle_charging, world.stations, world.places)
    (plan,) = answer.plans
    halts = [halt for leg in plan.legs for halt in leg.halts]
    assert [halt.station.id for halt in halts] == HALTS[seed]
    assert all(stop.station is None for stop in plan.stops)
    assert sum("serves better than passing it" in text for text in answer.warnings) == len(halts)
    total_s = plan.driving_s + plan.charging_s + plan.overhead_s
    waits_s = sum(stop.depart_s - stop.arrive_s for stop in plan.stops) + sum(halt.overhead_s for halt in halts)
    assert total_s == pytest.approx(sum(leg.time_s for leg in plan.legs) + waits_s)
    factors = [world.charging.network_factors.get(halt.station.network, 1.0) for halt in halts]
    counted_s = total_s + sum((f - 1.0) * halt.overhead_s for f, halt in zip(factors, halts, strict=True))
    assert plan.objective == pytest.approx(plan.energy_j + counted_s, rel=1e-9)
    assert all(halt.overhead_s == world.charging.overhead_s and halt.arrive_s < total_s for halt in halts)
    assert plan.halts == tuple(halts)
    assert plan.waiting_s == sum(halt.waiting_s for halt in halts) == 0.0
    places = {station.id: station.position for station in world.stations}
    assert all(halt.position in places[halt.station.id] for halt in halts)
    assert all(leg.soc_min_frac <= halt.soc_frac <= 1.0 for leg in plan.legs for halt in leg.halts)
    route = route_of_plan(ChainMaker(world.graph), world.query, plan, START, world.places[1:-1])
    assert route.duration_s + route.stop_s == pytest.approx(total_s)
    ends = {
        round(end_m, 6) for end_m in np.cumsum([span.to_m - span.from_m for leg in plan.legs for span in leg.spans])
    }
    assert all(round(halt.along_m, 6) in ends for halt in halts)
    legs = [route.legs[halt_leg(halt, route)] for halt in halts]
    assert all(leg.from_m <= halt.along_m <= leg.to_m + 1e-6 for halt, leg in zip(halts, legs, strict=True))
