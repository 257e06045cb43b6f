"""The plan of a small world is the best of all orders of stops, all ways and all charges."""

from __future__ import annotations

import math

import pytest

from routing.charging.plan import Objective
from tests.routing.charging.worlds import drawn_world, least_cost

EQUAL_FRAC = 1e-6
# up to three stops by each objective, over via points, with fixed stays, and no plan at all
SEEDS = (13, 18, 31, 38, 48, 51, 123, 138, 212)


@pytest.mark.parametrize("seed", SEEDS)
def test_a_plan_costs_what_the_best_of_all_journeys_costs_and_is_proven_but_by_energy(seed: int) -> None:
    world = drawn_world(seed)
    answer = world.planner().plan(world.query, world.charging, world.vehicle_charging, world.stations, world.places)
    least = least_cost(world)
    if least == math.inf:
        assert answer.plans == ()
        assert answer.no_plan is not None
        return
    (plan,) = answer.plans
    assert plan.objective == pytest.approx(least, rel=EQUAL_FRAC)
    if world.charging.objective is Objective.ENERGY:  # a halt without a charge may help, which is not looked for
        assert plan.short_by is None
        assert plan.unproven != ""
    else:
        assert plan.short_by == 0.0
        assert plan.unproven == ""
