"""What is said of journeys that the battery alone shows to be impossible: nothing is possible that it rules out."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from routing.charging.legs import LegStore
from routing.charging.plan import ChargingQuery
from routing.charging.sites import usable_sites
from routing.charging.task import Task
from routing.links.spans import ChainMaker
from routing.route.best_path import RouteSearch
from tests.routing.charging.test_planner import CAR, QUERY, ROAD, USUAL, ask, at, station
from tests.routing.charging.worlds import drawn_world

if TYPE_CHECKING:
    from tests.routing.charging.worlds import World

MANY_LINKS = 300_000


def task_of(world: World, legs: LegStore | None = None, **changes: object) -> Task:
    charging = replace(world.charging, **changes)  # type: ignore[arg-type]
    sites = usable_sites(world.vehicle_charging, charging, world.stations)
    legs = LegStore(RouteSearch(world.graph, ChainMaker(world.graph))) if legs is None else legs
    return Task(legs, world.query, charging, world.vehicle_charging, sites, world.places, None, 2.0, MANY_LINKS)


def test_no_journey_is_found_where_the_battery_rules_out_all_of_them() -> None:
    """With little charge or much asked for at the goal; `best` looks at all stations and asks the battery nothing."""
    ruled_out, found, missed = 0, 0, 0
    for seed in range(40):
        world = drawn_world(seed)
        for soc, goal in ((world.query.soc_frac, 0.1), (world.query.soc_frac, 0.7), (1.0, 0.8), (1.0, 1.0), (0.3, 0.1)):
            asked = replace(world, query=replace(world.query, soc_frac=soc))
            task = task_of(asked, goal_soc_frac=goal)
            plan = task.best()
            if task.is_shut_off():
                assert plan is None, (seed, soc, goal)
                ruled_out += 1
            elif plan is None:
                missed += 1
            else:
                found += 1
    assert ruled_out > 4 * missed, (ruled_out, missed)
    assert ruled_out >= 40
    assert found >= 25


def test_a_goal_is_reached_with_what_is_asked_less_what_is_missing_and_with_no_more() -> None:
    asked = replace(USUAL, goal_soc_frac=0.88)
    missing = ask(asked).no_plan
    assert missing is not None
    assert "the goal is not reached with what is asked for there" in missing.reason
    assert missing.from_station is not None
    assert missing.from_station.id == "d"
    had = asked.goal_soc_frac - missing.missing_j / (QUERY.vehicle.usable_capacity_wh * 3600.0)
    assert ask(replace(asked, goal_soc_frac=had - 1e-6)).plans
    assert not ask(replace(asked, goal_soc_frac=had + 1e-6)).plans


def test_a_full_battery_is_not_had_at_a_goal_that_links_lead_to() -> None:
    full = ChargingQuery(max_soc_frac=1.0, goal_soc_frac=1.0)
    missing = ask(full).no_plan
    assert missing is not None
    assert missing.missing_j > 0.0
    assert (
        ask(full, stations=(station("there", 14.5),), query=replace(QUERY, soc_frac=1.0), to=14.5).no_plan is not None
    )
    near = (station("there", 9.5), station("half way", 5.5))
    assert ask(full, stations=near, to=9.5).plans


def test_a_gap_between_stations_is_named_with_what_it_lacks() -> None:
    far = (station("a", 3.5), station("z", 13.5))
    missing = ask(stations=far).no_plan
    assert missing is not None
    assert "nothing that leads on is reached" in missing.reason
    assert missing.from_station is not None
    assert missing.from_station.id == "a"
    capacity_wh = QUERY.vehicle.usable_capacity_wh + missing.missing_j / 3600.0 / USUAL.max_soc_frac
    larger = replace(QUERY, vehicle=replace(QUERY.vehicle, usable_capacity_wh=1.15 * capacity_wh))
    assert ask(stations=far, query=larger).plans


def test_what_helps_helps() -> None:
    asked = replace(USUAL, goal_soc_frac=0.7, max_soc_frac=0.8)
    missing = ask(asked).no_plan
    assert missing is not None
    assert "charging to 100 % at stations" in [remedy.text for remedy in missing.helps]
    assert ask(replace(asked, max_soc_frac=1.0)).plans


def test_stations_beside_each_other_do_not_gain_by_stops_between_them() -> None:
    """What the last part of a link takes is left out, so that many stops along a road once seemed to fill a battery."""
    close = tuple(station(f"s{k}", 0.6 + 0.02 * k) for k in range(600))
    asked = replace(USUAL, max_soc_frac=0.8, goal_soc_frac=0.9)
    sites = usable_sites(CAR, asked, close)
    legs = LegStore(RouteSearch(ROAD, ChainMaker(ROAD)))
    task = Task(legs, QUERY, asked, CAR, sites, [at(0.5), at(13.5)], None, 2, MANY_LINKS)
    assert task.is_shut_off()
    shortage = task.shortage()
    assert shortage.at_goal
    assert shortage.missing_j > 0.01 * task.capacity_j


def test_ways_that_lead_to_a_goal_by_the_battery_are_a_journey() -> None:
    met = 0
    for seed in range(60):
        world = drawn_world(seed)
        legs = LegStore(RouteSearch(world.graph, ChainMaker(world.graph)))
        if len(world.places) > 2 or not (few := task_of(world, legs).chain()):
            continue
        kept = {site.station.id for site in few}
        only = replace(world, stations=tuple(stop for stop in world.stations if stop.id in kept))
        met += 1
        assert task_of(only, legs).found() is not None, seed
    assert met >= 10
