"""Of very many stations a few are chosen: nothing better is lost, or by no more than the plan says."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
import pytest

from energy.charging.charging import Connector
from routing.charging.choice.choice import Few
from routing.charging.choice.crowd import Crowd
from routing.charging.plan import Objective
from routing.charging.planner import ChargingPlanner
from routing.charging.sites import usable_sites
from routing.links.spans import ChainMaker
from routing.route.best_path import RouteSearch
from routing.stations.station import Socket
from tests.routing.charging.test_planner import CAR, QUERY, ROAD, USUAL, at, station
from tests.routing.charging.worlds import drawn_world

if TYPE_CHECKING:
    from routing.charging.plan import ChargingAnswer, ChargingQuery
    from routing.stations.station import Station
    from tests.routing.charging.worlds import World

EQUAL_FRAC = 1e-9
AT_ENDS = Few(a_stretch=0, at_ends=1, more=1)
A_FEW = Few(a_stretch=1, at_ends=1, more=2)


def answered(world: World, few: Few | None) -> ChargingAnswer:
    """What is answered by looking at few stations, or at all of them."""
    chains = ChainMaker(world.graph)
    search = RouteSearch(world.graph, chains)
    planner = ChargingPlanner(search, chains) if few is None else ChargingPlanner(search, chains, many_sites=1, few=few)
    return planner.plan(world.query, world.charging, world.vehicle_charging, world.stations, world.places)


def test_a_plan_over_few_stations_is_the_best_of_all_or_says_by_how_much_it_may_not_be() -> None:
    proven, bounded, none = 0, 0, 0
    for seed in range(60):
        world = drawn_world(seed)
        whole, few = answered(world, None), answered(world, AT_ENDS)
        assert bool(whole.plans) == bool(few.plans), seed
        if not few.plans:
            none += 1
            continue
        best, found = whole.plans[0], few.plans[0]
        assert found.objective >= best.objective * (1.0 - EQUAL_FRAC), seed
        if found.short_by is not None:
            assert found.objective - found.short_by <= best.objective * (1.0 + EQUAL_FRAC), seed
            proven += found.short_by == 0.0
            bounded += found.short_by > 0.0
    assert proven >= 10
    assert bounded >= 2
    assert none >= 5


def many_on_a_road(count: int, seed: int) -> tuple[Station, ...]:
    rng = np.random.default_rng(seed)
    return tuple(
        station(f"s{k}", float(rng.uniform(1.0, 14.0)), float(rng.choice([11e3, 30e3, 50e3, 60e3])))
        for k in range(count)
    )


def planned(
    stations: tuple[Station, ...], charging: ChargingQuery, few: Few | None, to: float = 14.5
) -> ChargingAnswer:
    search, chains = RouteSearch(ROAD, ChainMaker(ROAD)), ChainMaker(ROAD)
    planner = ChargingPlanner(search, chains) if few is None else ChargingPlanner(search, chains, many_sites=8, few=few)
    return planner.plan(QUERY, charging, CAR, stations, [at(0.5), at(to)])


@pytest.mark.parametrize("objective", [Objective.TIME, Objective.COST])
def test_few_of_sixty_stations_on_a_road_serve_as_well_as_all(objective: Objective) -> None:
    for seed in range(3):
        stations, charging = many_on_a_road(60, seed), replace(USUAL, objective=objective)
        best, found = (planned(stations, charging, few).plans[0] for few in (None, A_FEW))
        assert found.short_by is not None
        assert best.objective * (1.0 - EQUAL_FRAC) <= found.objective <= 1.02 * best.objective
        assert found.objective - found.short_by <= best.objective * (1.0 + EQUAL_FRAC)


def test_no_plan_over_few_stations_is_none_over_all_of_them_and_names_what_is_missing() -> None:
    stations = many_on_a_road(40, 5)
    asked = replace(USUAL, goal_soc_frac=0.89)
    whole, few = (planned(stations, asked, few).no_plan for few in (None, A_FEW))
    assert whole is not None
    assert few is not None
    assert few.missing_j == pytest.approx(whole.missing_j)
    assert few.from_station == whole.from_station
    assert few.helps == whole.helps


def test_of_stations_at_one_place_those_that_others_stand_in_for_are_left_out_and_told_as_fallbacks() -> None:
    copies = tuple(station(f"c{k}", 5.5, output_w) for k, output_w in enumerate([50e3] * 30 + [60e3, 22e3]))
    other = replace(copies[0], id="type2", sockets=(Socket(Connector.TYPE2, 11e3),))
    crowd = Crowd.of(usable_sites(CAR, USUAL, (*copies, other)))
    assert [site.station.id for site, kept in zip(crowd.sites, crowd.kept, strict=True) if kept] == ["c30"]
    dearer = replace(USUAL, network_factors={"n": 2.0})
    free = Crowd.of(usable_sites(CAR, dearer, (replace(copies[30], network="n"), copies[0])))
    assert free.kept.all()
    hours = Crowd.of(usable_sites(CAR, USUAL, (replace(copies[30], opening_hours="Mo-Su 12:00-13:00"), copies[0])))
    assert hours.kept.all()
    plan = planned((*copies, other), USUAL, A_FEW, to=10.5).plans[0]
    assert [stop.station.id for stop in plan.stops if stop.station is not None] == ["c30"]
    assert not plan.stops[0].gatekeeper
    assert plan.stops[0].fallback is not None
    assert plan.stops[0].fallback.drive_s == 0.0


def test_of_few_stations_a_goal_asked_for_nearly_full_is_come_to_where_it_is_of_all() -> None:
    found = 0
    for seed in range(40):
        world = drawn_world(seed)
        goal_soc_frac = (0.7, 0.85, 0.97)[seed % 3]
        asked = replace(world, charging=replace(world.charging, max_soc_frac=1.0, goal_soc_frac=goal_soc_frac))
        whole, few = answered(asked, None), answered(asked, AT_ENDS)
        assert bool(few.plans) >= bool(whole.plans), seed
        found += bool(few.plans)
    assert 5 <= found <= 35, found


def test_further_plans_over_few_stations_are_what_their_names_say() -> None:
    met = set()
    for seed in range(2):
        asked = replace(USUAL, objective=Objective.COST, alternatives=3)
        best, *others = planned(many_on_a_road(40, seed), asked, A_FEW).plans
        for other in others:
            met.add(other.name)
            assert other.objective >= best.objective * (1.0 - EQUAL_FRAC) or other.name == "fastest"
            if other.name == "fewest stops":
                assert len(other.stops) < len(best.stops)
            elif other.name == "fastest":
                took_s, best_s = (plan.driving_s + plan.charging_s + plan.overhead_s for plan in (other, best))
                assert took_s <= best_s * (1.0 + EQUAL_FRAC)
            else:
                assert min(stop.arrive_soc_frac for stop in other.stops) >= USUAL.arrive_soc_frac + 0.05 - 1e-9
    assert "most reserve" in met
