"""A plan as one route: the figures of the plan, the charge going on from leg to leg."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from routing.charging.route import route_of_plan
from routing.links.spans import ChainMaker
from routing.places import LinkPosition, Point, SnappedPoint
from routing.route.route import LegEnd
from tests.routing.charging.worlds import World, drawn_world

if TYPE_CHECKING:
    from routing.charging.plan import Plan
    from routing.queries import RouteQuery
    from routing.route.route import Route, RouteLeg

HERE = Point(46.0, 8.0)


def snapped(place: LinkPosition) -> SnappedPoint:
    return SnappedPoint(HERE, HERE, 0.0, place.link_idx, place.offset_m, "")


def is_via(leg: RouteLeg | None) -> bool:
    return leg is not None and leg.ends_at is LegEnd.VIA


def plan_and_route(world: World, query: RouteQuery | None = None, **change: Any) -> list[tuple[Plan, Route]]:
    asked = world.query if query is None else query
    answer = world.planner().plan(
        asked, replace(world.charging, **change), world.vehicle_charging, world.stations, world.places
    )
    chains = ChainMaker(world.graph)
    return [
        (plan, route_of_plan(chains, asked, plan, snapped(world.places[0][0]), world.places[1:-1]))
        for plan in answer.plans
    ]


@pytest.mark.parametrize("seed", range(30))
def test_route_of_a_drawn_plan_has_its_figures(seed: int) -> None:
    world = drawn_world(seed)
    for plan, route in plan_and_route(world, speed_caps_mps=(11.0,), alternatives=2):
        assert route.name == plan.name
        assert route.feasible
        ends = [leg.ends_at for leg in route.legs]
        assert ends[-1] is LegEnd.GOAL
        assert ends.count(LegEnd.STOP) == len(plan.stops)
        assert ends.count(LegEnd.VIA) <= len(world.places) - 2
        assert route.duration_s == pytest.approx(plan.driving_s, rel=1e-9, abs=1e-9)
        assert route.energy_j == pytest.approx(plan.energy_j, rel=1e-9, abs=1e-3)
        assert route.stop_s == pytest.approx(plan.charging_s + plan.overhead_s, rel=1e-9, abs=1e-9)
        between = [leg for leg in route.legs if leg.ends_at is not LegEnd.VIA]
        for leg, planned in zip(between, plan.legs, strict=True):
            assert leg.soc_end_frac == pytest.approx(planned.soc_end_frac, abs=1e-9)
            assert leg.speed_cap_mps == planned.speed_cap_mps
        starts = [leg for before, leg in zip([None, *route.legs], route.legs, strict=False) if not is_via(before)]
        for leg, planned in zip(starts, plan.legs, strict=True):
            assert leg.soc_start_frac == pytest.approx(planned.soc_start_frac, abs=1e-9)
        assert route.soc_min_frac == pytest.approx(min(leg.soc_min_frac for leg in plan.legs), abs=1e-9)
        assert not np.any(np.array(route.links.soc_end_frac) < world.query.reserve_soc_frac - 1e-9)


def test_drawn_plans_are_of_all_kinds() -> None:
    found = [pair for seed in range(30) for pair in plan_and_route(drawn_world(seed))]
    assert {0, 1, 2} <= {len(plan.stops) for plan, _ in found}
    assert any(leg.ends_at is LegEnd.VIA for _, route in found for leg in route.legs)


def test_a_journey_to_where_it_begins_may_be_a_stop_alone() -> None:
    world = drawn_world(1)
    station = world.stations[0]
    world = replace(world, places=(station.position, station.position))
    query = replace(world.query, soc_frac=0.2, reserve_soc_frac=0.0)
    found = plan_and_route(world, query, arrive_soc_frac=0.1, goal_soc_frac=0.5, max_soc_frac=0.6)
    for plan, route in found:
        assert route.distance_m == sum(leg.distance_m for leg in plan.legs)
        assert len(route.legs) == len(plan.legs)
        assert route.soc_end_frac == pytest.approx(plan.legs[-1].soc_end_frac, abs=1e-9)
        assert route.soc_end_frac >= 0.5 - 1e-9
    assert found
