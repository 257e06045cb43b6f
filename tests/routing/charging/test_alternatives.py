"""Further plans against all numbers of stops and all reserves, tried one after the other."""

from __future__ import annotations

from dataclasses import replace

from routing.charging.plan import ChargingAnswer, Plan
from routing.charging.planner import FEWEST_COST, RESERVE_COST, RESERVE_STEP
from tests.routing.charging.promise.test_promise import hilly
from tests.routing.charging.worlds import World

SLACK = 1.0 + 1e-9


def answered(world: World, **changes: object) -> ChargingAnswer:
    charging = replace(world.charging, **changes)  # type: ignore[arg-type]
    return world.planner().plan(world.query, charging, world.vehicle_charging, world.stations, world.places)


def named(answer: ChargingAnswer, name: str) -> Plan | None:
    return next((plan for plan in answer.plans if plan.name == name), None)


def stops_at_stations(plan: Plan) -> int:
    return sum(stop.station is not None for stop in plan.stops)


def test_the_plan_of_fewest_stops_has_as_few_as_any_that_does_not_cost_far_more() -> None:
    fewer = 0
    for seed in range(40):
        world = hilly(seed)
        world = replace(world, charging=replace(world.charging, overhead_s=0.0))
        answer = answered(world, alternatives=3)
        if not answer.plans:
            continue
        best, found = answer.plans[0], named(answer, "fewest stops")
        for most in range(stops_at_stations(best)):
            tried = answered(world, most_stops=most)
            if tried.plans and tried.plans[0].objective <= best.objective * FEWEST_COST / SLACK:
                assert found is not None, seed
                assert stops_at_stations(found) == most, seed
                fewer += 1
                break
        else:
            assert found is None or found.objective <= best.objective * FEWEST_COST * SLACK, seed
    assert fewer >= 1


def test_the_plan_of_most_reserve_keeps_as_much_as_any_that_costs_little_more() -> None:
    more = 0
    for seed in range(12):
        world = hilly(seed)
        answer = answered(world, alternatives=3)
        found = named(answer, "most reserve")
        if found is None:
            continue
        asked, cost = world.charging, RESERVE_COST * answer.plans[0].objective
        kept = asked.arrive_soc_frac
        while (least := kept + RESERVE_STEP) <= asked.max_soc_frac - RESERVE_STEP + 1e-9:
            tried = answered(world, arrive_soc_frac=least, goal_soc_frac=max(asked.goal_soc_frac, least))
            if not tried.plans or tried.plans[0].objective > cost * SLACK:
                break
            kept = least
        assert min(leg.soc_end_frac for leg in found.legs) >= kept - 1e-6, seed
        more += kept > asked.arrive_soc_frac
    assert more >= 2
