"""Stations that are chosen: to go over as via points, and not to use."""

from __future__ import annotations

from dataclasses import replace
from itertools import islice
from typing import TYPE_CHECKING

import pytest

from routing.charging.plan import FixedStay, Objective
from routing.errors import QueryError
from tests.routing.charging.worlds import drawn_world

if TYPE_CHECKING:
    from collections.abc import Iterator

    from routing.charging.plan import ChargingAnswer, ChargingQuery, Plan
    from tests.routing.charging.worlds import World

SEEDS = range(60)


def answer(
    world: World, charging: ChargingQuery, via: tuple[str, ...] = (), stays: tuple[FixedStay, ...] = ()
) -> ChargingAnswer:
    """The answer of a world over stations as via points."""
    positions = {station.id: station.position for station in world.stations}
    start, goal = world.places[0], world.places[-1]
    query = replace(world.query, via=tuple(world.query.start for _ in via))
    places = [start, *(positions[name] for name in via), goal]
    charging = replace(charging, stays=stays)
    return world.planner().plan(query, charging, world.vehicle_charging, world.stations, places)


def stops(plan: Plan) -> list[str]:
    return [stop.station.id for stop in plan.stops if stop.station is not None]


def took_s(plan: Plan) -> float:
    return plan.driving_s + plan.charging_s + plan.overhead_s


def planned_worlds() -> Iterator[tuple[World, Plan]]:
    """Worlds in which a plan stops somewhere."""
    for seed in SEEDS:
        world = drawn_world(seed)
        plans = answer(world, world.charging).plans
        if plans and plans[0].stops:
            yield world, plans[0]


def test_excluded_stations_are_not_used_and_never_make_a_plan_better():
    found = 0
    for world, plan in planned_worlds():
        gone = stops(plan)[0]
        others = answer(world, replace(world.charging, excluded_stations=frozenset({gone}))).plans
        if others:
            found += 1
            assert gone not in stops(others[0])
            assert others[0].objective >= plan.objective * (1.0 - 1e-9)
    assert found >= 3


def test_chosen_station_is_charged_at_where_charge_is_needed_and_never_makes_a_plan_faster():
    found, slower, charged = 0, 0, 0
    for world, plan in planned_worlds():
        in_time = world.charging.objective is Objective.TIME and set(world.charging.network_factors.values()) == {1.0}
        for station in world.stations:
            charging = replace(world.charging, via_stations=((0, station.id),))
            over = answer(world, charging, (station.id,)).plans
            if not over:
                continue
            found += 1
            charged += station.id in stops(over[0])
            if station.id in stops(plan):
                assert station.id in stops(over[0])
            if in_time:
                slower += 1
                assert took_s(over[0]) >= took_s(plan) * (1.0 - 1e-9)
    assert slower >= 3
    assert charged > 0.7 * found > 5


def test_via_point_that_is_no_usable_station_is_refused_by_its_name():
    world, _ = next(planned_worlds())
    charging = replace(world.charging, via_stations=((0, "nowhere"),))
    with pytest.raises(QueryError, match=r"via_stations\[0\]\.station"):
        answer(world, charging, (world.stations[0].id,))
    with pytest.raises(QueryError, match=r"via_stations\[0\]\.via"):
        answer(world, replace(charging, via_stations=((3, "s0"),)), (world.stations[0].id,))


def test_stay_at_a_via_point_is_taken_before_its_station_charges():
    both = 0
    for world, plan in islice(planned_worlds(), 20):
        name = stops(plan)[0]
        for power_w in (0.0, 2e3):
            stay = FixedStay(0, 400.0, power_w)
            charging = replace(world.charging, via_stations=((0, name),))
            plans = answer(world, charging, (name,), (stay,)).plans
            if not plans:
                continue
            rows = [None if stop.station is None else stop.station.id for stop in plans[0].stops]
            assert rows.count(None) == 1
            at = rows.index(None)
            taken = plans[0].stops[at]
            assert taken.depart_s - taken.arrive_s == pytest.approx(400.0)
            if rows[at + 1 : at + 2] == [name]:
                both += 1
                after = plans[0].stops[at + 1]
                assert after.arrive_s == pytest.approx(taken.depart_s)
                assert after.arrive_soc_frac == pytest.approx(taken.depart_soc_frac)
    assert both >= 1
