"""What plans promise: against drives drawn anew, and by the rules that promises must obey."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import pairwise
from types import MappingProxyType

import numpy as np
import pytest

from energy.conditions import Conditions
from energy.vehicle.vehicle import Vehicle
from routing.charging.plan import ChargingAnswer, Fallback, FixedStay, HelpKind, Plan
from routing.charging.planner import ChargingPlanner
from routing.charging.promise import kernels_promise as kernels
from routing.charging.promise.promise import turning_points
from routing.links.spans import ChainMaker
from routing.route.best_path import RouteSearch
from tests.routing.charging.promise.drives import kept_drives, promised
from tests.routing.charging.test_planner import CAR, FOUR, PLANNER, QUERY, ROAD, USUAL, ask, at, plan_of, station
from tests.routing.charging.worlds import AC_EFF, AC_W, World, drawn_world

SD = MappingProxyType(
    {
        "mass_kg": 75.0,
        "road_load_a_n": 6.0,
        "road_load_c_n_per_mps2": 0.02,
        "drive_eff": 0.03,
        "recuperation_eff": 0.08,
        "aux_power_w": 150.0,
    }
)
DRIVES = 4000
SEED = 7


def uncertain(vehicle: object) -> Vehicle:
    assert isinstance(vehicle, Vehicle)
    capacity_sd = 0.02 * vehicle.usable_capacity_wh
    return replace(vehicle, sd=MappingProxyType({**SD, "usable_capacity_wh": capacity_sd}))


def certain(vehicle: object) -> Vehicle:
    assert isinstance(vehicle, Vehicle)
    return replace(vehicle, sd=MappingProxyType({}), residual_sd_frac=0.0)


UNSURE = replace(QUERY, vehicle=uncertain(QUERY.vehicle))


def hilly(seed: int) -> World:
    """A drawn world of a vehicle that is not certain, with enough charge for plans in most of them."""
    world = drawn_world(seed)
    query = replace(world.query, vehicle=uncertain(world.query.vehicle), soc_frac=0.9)
    return replace(world, query=query, charging=replace(world.charging, max_soc_frac=1.0))


def asked(world: World, **changes: object) -> ChargingAnswer:
    charging = replace(world.charging, **changes)  # type: ignore[arg-type]
    return world.planner().plan(world.query, charging, world.vehicle_charging, world.stations, world.places)


def planned(world: World, **changes: object) -> Plan | None:
    answer = asked(world, **changes)
    return answer.plans[0] if answer.plans else None


@pytest.mark.parametrize("confidence", [None, 0.8, 0.95])
def test_drives_on_a_road_keep_what_is_promised_within_two_points(confidence: float | None) -> None:
    charging = replace(USUAL, confidence=confidence)
    plan = plan_of(ask(charging, UNSURE))
    assert plan.stops
    shares = kept_drives(ROAD, UNSURE, charging, plan, DRIVES, SEED)
    np.testing.assert_allclose(shares.mean(axis=1), promised(plan), atol=0.02)
    assert plan.kept_probability_frac is not None
    assert shares.all(axis=0).mean() == pytest.approx(plan.kept_probability_frac, abs=0.02)


@pytest.mark.parametrize("seed", [10, 16, 33])
def test_drives_in_the_hills_keep_what_is_promised_within_two_points(seed: int) -> None:
    world = hilly(seed)
    plan = planned(world, confidence=0.9)
    assert plan is not None
    shares = kept_drives(world.graph, world.query, world.charging, plan, DRIVES, SEED)
    np.testing.assert_allclose(shares.mean(axis=1), promised(plan), atol=0.02)


def test_drives_in_the_cold_keep_what_is_promised_within_two_points() -> None:
    query, charging = replace(UNSURE, conditions=Conditions(ambient_k=268.15)), replace(USUAL, confidence=0.9)
    plan = plan_of(ask(charging, query))
    shares = kept_drives(ROAD, query, charging, plan, DRIVES, SEED)
    np.testing.assert_allclose(shares.mean(axis=1), promised(plan), atol=0.02)
    assert min(promised(plan)) >= 0.9


def test_drives_under_a_speed_cap_keep_what_is_promised_within_two_points() -> None:
    charging = replace(USUAL, confidence=0.9, speed_caps_mps=(20.0,), overhead_s=900.0)
    plan = plan_of(ask(charging, UNSURE))
    assert any(leg.speed_cap_mps is not None for leg in plan.legs)
    shares = kept_drives(ROAD, UNSURE, charging, plan, DRIVES, SEED)
    np.testing.assert_allclose(shares.mean(axis=1), promised(plan), atol=0.02)
    assert min(promised(plan)) >= 0.9


def test_a_confidence_is_kept_at_every_stop_and_by_no_more_charge_than_it_takes() -> None:
    for confidence in (0.6, 0.75, 0.9, 0.99):
        plan = plan_of(ask(replace(USUAL, confidence=confidence), UNSURE))
        assert min(promised(plan)) >= confidence
        assert promised(plan)[-1] == pytest.approx(confidence, abs=0.002)


def test_more_confidence_is_never_faster_and_never_leaves_a_station_with_less_for_the_goal() -> None:
    plans = [plan_of(ask(replace(USUAL, confidence=c), UNSURE)) for c in (0.5, 0.6, 0.75, 0.9, 0.95, 0.99)]
    objectives = [plan.objective for plan in plans]
    assert objectives == sorted(objectives)
    left = [plan.legs[-1].soc_end_frac for plan in plans]
    assert left == sorted(left)


def test_more_confidence_is_never_faster_in_the_hills() -> None:
    compared = 0
    for seed in range(14):
        world = hilly(seed)
        costs = [plan.objective if (plan := planned(world, confidence=c)) else math.inf for c in (0.6, 0.8, 0.95)]
        compared += math.isfinite(costs[1])
        for less, more in pairwise(costs):
            assert less <= more + 1e-6 * abs(less), seed
    assert compared >= 5


def test_quantiles_rise_and_hold_the_charge_on_arrival_by_the_mean() -> None:
    plan = plan_of(ask(USUAL, UNSURE))
    found = [stop.arrive_quantiles_frac for stop in plan.stops] + [plan.goal_quantiles_frac]
    means = [stop.arrive_soc_frac for stop in plan.stops] + [plan.legs[-1].soc_end_frac]
    for quantiles, mean, leg in zip(found, means, plan.legs, strict=True):
        assert quantiles is not None
        assert leg.soc_min_p10_frac is not None
        low, middle, high = quantiles
        assert low < middle < high
        assert middle == pytest.approx(mean, abs=0.01)
        assert leg.soc_min_p10_frac <= low
    assert promised(plan)[-1] == pytest.approx(0.5, abs=0.03)  # what is asked for is what the mean just keeps


def test_a_vehicle_that_is_certain_arrives_with_what_the_plan_says() -> None:
    query = replace(QUERY, vehicle=certain(QUERY.vehicle))
    plan = plan_of(ask(USUAL, query))
    assert promised(plan) == [1.0] * len(plan.legs)
    assert plan.goal_quantiles_frac == pytest.approx((plan.legs[-1].soc_end_frac,) * 3, abs=1e-9)
    sure = plan_of(ask(replace(USUAL, confidence=0.99), query))
    assert sure.objective == pytest.approx(plan.objective)


def test_a_whole_journey_is_kept_no_more_often_than_its_least_sure_leg_and_more_than_by_chance() -> None:
    plan = plan_of(ask(replace(USUAL, confidence=0.8), UNSURE))
    assert len(plan.legs) >= 3
    assert plan.kept_probability_frac is not None
    assert plan.kept_probability_frac <= min(promised(plan))
    assert plan.kept_probability_frac > math.prod(promised(plan))  # legs are of one vehicle and one residual


def test_a_confidence_counts_what_a_fixed_stay_on_the_way_charges() -> None:
    stay = FixedStay(0, 1800.0, 11e3)
    charging = replace(USUAL, stays=(stay,), confidence=0.9)
    plan = plan_of(ask(charging, UNSURE, via=(5.5,)))
    assert "stay" in [stop.station.id if stop.station else "stay" for stop in plan.stops]
    assert min(promised(plan)) >= 0.9


def test_a_fixed_stay_that_fills_any_battery_bounds_journeys_like_one_that_just_fills_it() -> None:
    world = hilly(10)
    counts = []
    for batteries in (1.0, 50.0):
        stay = FixedStay(0, batteries * world.capacity_j / (AC_W * AC_EFF), AC_W)
        half = replace(stay, seconds=36e4, power_w=AC_W * stay.seconds / 36e4)
        answer = asked(world, stays=(half,), confidence=0.9)
        counts.append((answer.plans[0].objective, answer.stats.leg_searches))
    assert counts[0] == counts[1]


def test_without_a_plan_of_a_confidence_one_that_is_kept_is_named() -> None:
    stations = (station("only", 5.5),)
    missing = ask(replace(USUAL, confidence=0.999), UNSURE, stations, to=11.5).no_plan
    assert missing is not None
    (named,) = [each for each in missing.helps if each.kind is HelpKind.CONFIDENCE]
    assert named.value is not None
    kept = named.value
    assert 0.5 < kept < 0.999
    assert named.text.startswith(f"a confidence of {kept:g} ")
    assert ask(replace(USUAL, confidence=kept), UNSURE, stations, to=11.5).plans
    assert not ask(replace(USUAL, confidence=kept + 0.005), UNSURE, stations, to=11.5).plans


def test_the_plan_is_the_same_every_time() -> None:
    charging = replace(USUAL, confidence=0.9)
    assert plan_of(ask(charging, UNSURE)) == plan_of(ask(charging, UNSURE))


def test_a_charge_is_needed_on_a_leg_where_and_only_where_it_is_kept() -> None:
    rng = np.random.default_rng(3)
    for _ in range(300):
        n = int(rng.integers(1, 9))
        energy = rng.normal(0.05, 0.15, (1, n))
        lost = rng.uniform(0.0, 0.1, (1, n))
        arrive, reserve = float(rng.uniform(0.0, 0.9)), float(rng.uniform(0.0, 0.2))
        residual = np.array([[float(rng.normal(0.0, 0.3))]])

        legs = kernels.Legs(np.array([0, n]), np.array([0.7]), np.array([np.nan]), np.array([arrive]), reserve)
        outcomes = kernels.Outcomes(*(np.empty((1, 1)) for _ in range(5)))
        kernels.drive_legs(energy, lost, np.ones(1), residual, legs, outcomes, 0)
        needed, used = float(outcomes.needed[0, 0]), energy[0] + residual[0, 0] * lost[0]
        if needed > 1.0:
            assert not kept(used, 1.0, arrive, reserve)
        else:
            assert kept(used, min(needed + 1e-9, 1.0), arrive, reserve)
            assert needed <= reserve or not kept(used, needed - 1e-9, arrive, reserve)


def kept(used: np.ndarray, start: float, arrive: float, reserve: float) -> bool:
    soc = lowest = start
    for step in used:
        soc = min(soc - step, 1.0)
        lowest = min(lowest, soc)
    return soc >= max(arrive, reserve) and lowest >= reserve


def test_turning_points_are_those_of_turns_beyond_a_level() -> None:
    assert turning_points([1.0, 2.0, 1.9, 3.0, 1.0, 1.05, 0.5, 2.0], 0.5) == [3, 6]
    assert turning_points([1.0, 2.0, 3.0], 0.5) == []
    assert turning_points([], 0.5) == []
    assert turning_points([-1.0, -2.0, 1.0, 0.8], 0.5) == [1, 2]


def test_the_fallback_is_the_station_that_is_reached_soonest_and_not_in_the_plan() -> None:
    stations = (*FOUR, station("beside", 6.9), station("nearby", 9.8))
    plan = plan_of(ask(replace(USUAL, confidence=0.9), UNSURE, stations))
    planned_ids = {stop.station.id for stop in plan.stops if stop.station is not None}
    for stop in plan.stops:
        assert stop.station is not None
        assert stop.fallback is not None
        assert stop.fallback.station.id not in planned_ids
        assert stop.fallback.reached
        assert stop.arrive_quantiles_frac is not None
        assert stop.fallback.arrive_soc_frac < stop.arrive_quantiles_frac[0]
    alone = plan_of(ask(USUAL, UNSURE, (station("only", 6.1),), to=10.5))
    assert [stop.fallback for stop in alone.stops] == [None]


def test_a_fallback_beyond_what_is_left_is_named_as_not_reached() -> None:
    stations = (station("behind", 0.6), station("only", 6.4))
    plan = plan_of(ask(USUAL, UNSURE, stations, to=11.5))
    (stop,) = plan.stops
    assert stop.station is not None
    assert stop.station.id == "only"
    assert stop.fallback is not None
    assert stop.fallback.station.id == "behind"
    assert not stop.fallback.reached


def fallback_of(hours: dict[str, str], departure_min: float | None) -> Fallback:
    """The fallback of the only stop of a plan that begins at a time, beside stations of these hours."""
    stations = (
        station("only", 6.4),
        station("near", 6.5, 20e3, opening_hours=hours.get("near", "24/7")),
        station("far", 6.7, 20e3, opening_hours=hours.get("far", "24/7")),
    )
    charging = replace(USUAL, stations=("only", *hours), departure_min=departure_min)
    (stop,) = plan_of(ask(charging, UNSURE, stations, to=10.5)).stops
    assert stop.station is not None
    assert stop.station.id == "only"
    assert stop.fallback is not None
    return stop.fallback


def test_a_fallback_that_is_closed_when_the_vehicle_comes_is_passed_over_for_an_open_one() -> None:
    day = {"near": "Mo-Su 08:00-20:00", "far": "24/7"}
    assert fallback_of(day, 12 * 60.0).station.id == "near"
    assert fallback_of(day, None).station.id == "near"
    night = fallback_of(day, 22 * 60.0)
    assert (night.station.id, night.wait_s, night.open_soc_frac) == ("far", 0.0, night.arrive_soc_frac)


def test_a_fallback_that_opens_soon_says_how_long_it_waits_and_what_is_left_then() -> None:
    open_at = fallback_of({"near": "24/7"}, 7 * 60.0)
    late = fallback_of({"near": "Mo-Su 09:00-20:00"}, 7 * 60.0)
    assert late.reached
    assert late.drive_s == open_at.drive_s
    assert late.arrive_soc_frac == open_at.arrive_soc_frac == open_at.open_soc_frac
    begun = fallback_of({"near": "Mo-Su 09:00-20:00"}, 8 * 60.0)
    assert late.wait_s - begun.wait_s == pytest.approx(3600.0)
    standing_w = UNSURE.vehicle.aux_power_w / UNSURE.vehicle.aux_idle_eff
    taken_frac = standing_w * late.wait_s / (5500.0 * 3600.0)
    assert late.arrive_soc_frac - late.open_soc_frac == pytest.approx(taken_frac)


def test_a_fallback_in_a_night_is_looked_for_beyond_many_closed_stations() -> None:
    shut = tuple(station(f"shut{k}", 6.42 + 0.01 * k, 20e3, opening_hours="Mo-Su 08:00-20:00") for k in range(20))
    stations = (station("only", 6.4), *shut, station("open", 6.7, 20e3))
    charging = replace(USUAL, departure_min=22 * 60.0)
    (stop,) = plan_of(ask(charging, UNSURE, stations, to=10.5)).stops
    assert stop.fallback is not None
    assert stop.fallback.station.id == "open"
    assert stop.fallback.wait_s == 0.0


def test_a_gatekeeper_is_a_station_without_which_there_is_no_plan() -> None:
    told = []
    for seed in range(40):
        world = hilly(seed)
        plan = planned(world)
        if plan is None:
            continue
        for stop in plan.stops:
            if stop.station is None:
                continue
            others = tuple(other for other in world.stations if other.id != stop.station.id)
            without = asked(replace(world, stations=others))
            assert stop.gatekeeper == (not without.plans), seed
            told.append(stop.gatekeeper)
    assert sum(told) >= 5
    assert len(told) - sum(told) >= 5


def test_the_only_station_of_a_road_is_a_gatekeeper_also_of_a_confidence() -> None:
    charging = replace(USUAL, confidence=0.9)
    (stop,) = plan_of(ask(charging, UNSURE, (station("only", 6.1),), to=10.5)).stops
    assert stop.gatekeeper
    found = plan_of(ask(charging, UNSURE, (station("only", 6.1), station("other", 5.7)), to=10.5)).stops
    assert not any(stop.gatekeeper for stop in found)


def test_a_gatekeeper_of_a_confidence_is_a_station_without_which_no_plan_is_as_sure() -> None:
    told = []
    for seed in range(40):
        world = hilly(seed)
        plan = planned(world, confidence=0.7)
        for stop in () if plan is None else plan.stops:
            if stop.station is not None and stop.gatekeeper is not None:
                others = tuple(other for other in world.stations if other.id != stop.station.id)
                assert stop.gatekeeper == (planned(replace(world, stations=others), confidence=0.7) is None), seed
                told.append(stop.gatekeeper)
    assert sum(told) >= 3
    assert len(told) - sum(told) >= 3


def test_on_a_large_graph_a_gatekeeper_is_not_known_where_no_plan_is_found_without_it() -> None:
    chains = ChainMaker(ROAD)
    planner = ChargingPlanner(RouteSearch(ROAD, chains), chains, many_links=0)
    only = planner.plan(UNSURE, USUAL, CAR, (station("only", 6.1),), [at(0.5), at(10.5)])
    assert [stop.gatekeeper for stop in only.plans[0].stops] == [None]
    assert any("1 station" in warning and "not known" in warning for warning in only.warnings)
    for confidence in (None, 0.9):
        stations = (station("only", 6.1), station("other", 5.7))
        both = planner.plan(UNSURE, replace(USUAL, confidence=confidence), CAR, stations, [at(0.5), at(10.5)])
        assert [stop.gatekeeper for stop in both.plans[0].stops] == [False]
        assert not both.warnings


def test_what_is_promised_is_said_of_alternatives_as_well() -> None:
    charging = replace(USUAL, alternatives=3, confidence=0.9, overhead_s=0.0)
    answer = PLANNER.plan(UNSURE, charging, CAR, FOUR, [at(0.5), at(14.5)])
    assert len(answer.plans) >= 2
    for plan in answer.plans:
        assert min(promised(plan)) >= 0.9
