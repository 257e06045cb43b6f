"""Plans on a straight road: which stations they call at, what they keep, and what is said where there is none."""

from __future__ import annotations

from dataclasses import replace
from datetime import datetime
from typing import TYPE_CHECKING

import numpy as np
import pytest

from energy.charging.charging import Charging, Connector, PowerCurve
from routing.charging.plan import ChargingAnswer, ChargingQuery, FixedStay, Help, HelpKind, Objective, Plan
from routing.charging.planner import ChargingPlanner
from routing.errors import QueryError, TimeUpError
from routing.links.spans import ChainMaker
from routing.places import LinkPosition, Point
from routing.queries import RouteQuery
from routing.route.best_path import RouteSearch
from routing.stations.station import Access, Price, Socket, Station
from routing.time_budget import TimeBudget, within
from tests.routing.charging.worlds import drawn_world, small_car
from tests.routing.drawn_streets import drawn_streets

if TYPE_CHECKING:
    from routing.graph.road_graph import RoadGraph

CROSSINGS = 16
SPACING = 4.0  # of a STEP, which is some 0.77 km here
CURVE = PowerCurve(np.array([0.0, 0.5, 1.0]), np.array([60e3, 60e3, 10e3]))
CAR = Charging((Connector.CCS2, Connector.TYPE2), CURVE, ac_power_w=11e3, ac_phases=3, dc_eff=0.95)
HERE = Point(46.0, 8.0)


def road() -> RoadGraph:
    """A road both ways, 15 links of some 3.1 km, 120 km/h."""
    places = [(SPACING * k, 0.0) for k in range(CROSSINGS)]
    links = [link for k in range(CROSSINGS - 1) for link in ((k, k + 1), (k + 1, k))]
    n = len(links)
    return drawn_streets(
        "road",
        places,
        links,
        np.zeros(CROSSINGS),
        speed_limit_mps=np.full(n, 120.0 / 3.6),
        cross=np.zeros(n, np.int64),
    )


ROAD = road()
PLANNER = ChargingPlanner(RouteSearch(ROAD, ChainMaker(ROAD)), ChainMaker(ROAD))


def at(crossing: float) -> tuple[LinkPosition, ...]:
    """Both positions of a place so many crossings along the road."""
    first = int(crossing)
    part = crossing - first
    ahead = next(
        link
        for link in range(ROAD.link_count)
        if ROAD.node_id[ROAD.tail[link]] == first and ROAD.node_id[ROAD.head[link]] == first + 1
    )
    back = int(ROAD.reverse_idx[ahead])
    length_m = float(ROAD.length_m[ahead])
    return LinkPosition(ahead, part * length_m), LinkPosition(back, (1.0 - part) * length_m)


def station(name: str, crossing: float, output_w: float = 50e3, **changes: object) -> Station:
    base = Station(
        id=name, at=HERE, sockets=(Socket(Connector.CCS2, output_w),), name=name, position=at(crossing), source="test"
    )
    return replace(base, **changes)  # type: ignore[arg-type]


FOUR = tuple(station(name, crossing) for name, crossing in (("a", 3.5), ("b", 6.5), ("c", 9.5), ("d", 12.5)))
QUERY = RouteQuery(HERE, HERE, 0.9, small_car(5500.0), reserve_soc_frac=0.05)
USUAL = ChargingQuery(overhead_s=120.0, max_soc_frac=0.9)


def ask(
    charging: ChargingQuery = USUAL,
    query: RouteQuery = QUERY,
    stations: tuple[Station, ...] = FOUR,
    to: float = 14.5,
    via: tuple[float, ...] = (),
) -> ChargingAnswer:
    query = replace(query, via=(HERE,) * len(via))
    places = [at(0.5), *(at(k) for k in via), at(to)]
    return PLANNER.plan(query, charging, CAR, stations, places)


def plan_of(answer: ChargingAnswer) -> Plan:
    assert answer.no_plan is None
    return answer.plans[0]


def calls_of(plan: Plan) -> list[str]:
    return [stop.station.id if stop.station is not None else "stay" for stop in plan.stops]


def test_a_goal_within_the_charge_is_driven_to_without_a_stop() -> None:
    plan = plan_of(ask(to=4.5))
    assert plan.stops == ()
    assert len(plan.legs) == 1
    assert plan.short_by == 0.0


def test_a_goal_beyond_the_charge_takes_stops_that_add_up() -> None:
    plan = plan_of(ask())
    assert len(plan.stops) >= 1
    assert len(plan.legs) == len(plan.stops) + 1
    total_s = plan.driving_s + plan.charging_s + plan.overhead_s
    assert plan.objective == pytest.approx(total_s, rel=1e-9)
    assert plan.short_by == 0.0
    for stop, before, after in zip(plan.stops, plan.legs, plan.legs[1:], strict=False):
        assert stop.arrive_soc_frac == before.soc_end_frac >= 0.1 - 1e-9
        assert stop.depart_soc_frac == after.soc_start_frac > stop.arrive_soc_frac
        assert stop.charged_j == pytest.approx((stop.depart_soc_frac - stop.arrive_soc_frac) * 5500.0 * 3600.0)
        assert stop.drawn_j == pytest.approx(stop.charged_j / 0.95)
        assert sum(seconds for _, _, seconds in stop.power_bands) == pytest.approx(stop.charging_s)
    assert plan.legs[-1].soc_end_frac == pytest.approx(0.1)


def test_the_same_question_again_searches_nothing() -> None:
    first = ask()
    again = ask()
    assert again.stats.leg_searches == 0
    assert again.plans == first.plans


def test_stations_are_left_out_by_network_list_connector_power_access_and_state() -> None:
    usual = calls_of(plan_of(ask()))
    left_out = usual[0]
    others = [name for name in "abcd" if name != left_out]

    def with_one(**changes: object) -> tuple[Station, ...]:
        return tuple(replace(s, **changes) if s.id == left_out else s for s in FOUR)  # type: ignore[arg-type]

    answers = (
        ask(replace(USUAL, excluded_networks=frozenset({"n"})), stations=with_one(network="n")),
        ask(replace(USUAL, stations=tuple(others))),
        ask(replace(USUAL, connectors=(Connector.CCS2,)), stations=with_one(sockets=(Socket(Connector.TYPE2, 22e3),))),
        ask(replace(USUAL, min_power_w=40e3), stations=with_one(sockets=(Socket(Connector.CCS2, 30e3),))),
        ask(stations=with_one(access=Access.PRIVATE)),
        ask(stations=with_one(operational=False)),
        ask(stations=with_one(sockets=(Socket(Connector.CHADEMO, 50e3),))),
    )
    for answer in answers:
        assert left_out not in calls_of(plan_of(answer))


def test_an_avoided_network_is_called_at_where_the_detour_costs_more() -> None:
    networks = tuple(replace(s, network="n" if s.id in "ac" else "m") for s in FOUR)
    little = calls_of(plan_of(ask(replace(USUAL, network_factors={"m": 1.0001}), stations=networks)))
    much = calls_of(plan_of(ask(replace(USUAL, network_factors={"m": 50.0}), stations=networks)))
    assert sum(name in "bd" for name in much) <= sum(name in "bd" for name in little)


def test_the_objective_cost_prefers_a_cheap_station_and_energy_takes_no_more_than_time() -> None:
    cheap = tuple(replace(s, price=Price(currency="EUR", per_kwh=0.2 if s.id == "c" else 0.9)) for s in FOUR)
    by_cost = plan_of(ask(replace(USUAL, objective=Objective.COST, time_value_per_h=1.0), stations=cheap))
    by_time = plan_of(ask(stations=cheap))
    assert by_cost.price is not None
    assert by_time.price is not None
    assert by_cost.price <= by_time.price
    assert "c" in calls_of(by_cost)
    by_energy = plan_of(ask(replace(USUAL, objective=Objective.ENERGY), stations=cheap))
    assert by_energy.energy_j <= by_time.energy_j + 1.0


def test_a_via_point_is_driven_to_within_a_leg_and_one_that_is_a_station_may_be_charged_at() -> None:
    past = plan_of(ask(via=(5.2,)))
    rests = [span for leg in past.legs for span in leg.spans if span.rest]
    assert any(span.link_idx == at(5.2)[0].link_idx and span.to_m == at(5.2)[0].offset_m for span in rests)
    assert past.objective == pytest.approx(past.driving_s + past.charging_s + past.overhead_s)
    called = plan_of(ask(stations=(FOUR[1], FOUR[2]), via=(6.5,)))
    assert "b" in calls_of(called)


def test_a_via_point_behind_the_goal_is_driven_to_first() -> None:
    plan = plan_of(ask(to=3.2, via=(6.2,)))
    assert plan.legs[-1].spans[-1].link_idx == at(3.2)[1].link_idx


def test_a_fixed_stay_charges_and_takes_its_time() -> None:
    stay = FixedStay(via_idx=0, seconds=3600.0, power_w=11e3)
    plan = plan_of(ask(replace(USUAL, stays=(stay,)), stations=(), via=(5.2,), to=9.2))
    assert calls_of(plan) == ["stay"]
    (stop,) = plan.stops
    assert stop.depart_soc_frac == 1.0
    assert stop.depart_s - stop.arrive_s == 3600.0
    without = ask(replace(USUAL, stays=()), stations=(), via=(5.2,), to=9.2)
    assert without.plans == ()


def test_what_is_charged_at_the_goal_need_not_be_brought_there() -> None:
    asked = replace(USUAL, goal_soc_frac=0.6)
    night = replace(asked, stays=(FixedStay(None, 8 * 3600.0, 3.7e3),))
    brought, charged = plan_of(ask(asked)), plan_of(ask(night))
    assert brought.legs[-1].soc_end_frac >= 0.6 - 1e-9
    assert charged.legs[-1].soc_end_frac < 0.6
    assert charged.goal_stay is not None
    assert charged.goal_stay.depart_soc_frac >= 0.6
    assert charged.objective < brought.objective


def test_a_closed_station_is_waited_for_or_passed() -> None:
    closed = tuple(replace(s, opening_hours="Mo-Su 12:00-13:00" if s.id in "bc" else "24/7") for s in FOUR)
    passed = ask(replace(USUAL, departure_min=6 * 60.0), stations=(*closed, station("e", 8.0 + 0.1, 20e3)))
    assert set(calls_of(plan_of(passed))) <= {"a", "d", "e"}
    only = tuple(s for s in closed if s.id in "bc")
    waited = plan_of(ask(replace(USUAL, departure_min=11.5 * 60.0), stations=only))
    first = waited.stops[0]
    assert first.depart_s >= 1800.0
    assert "opening hours" in waited.unproven
    unasked = plan_of(ask(stations=only))
    assert unasked.objective < waited.objective
    assert waited.short_by == pytest.approx(waited.objective - unasked.objective)


def test_a_plan_that_finds_its_stations_open_is_proven_whatever_others_do() -> None:
    day = tuple(replace(s, opening_hours="Mo-Su 06:00-22:00" if s.id in "bd" else "24/7") for s in FOUR)
    asked = plan_of(ask(replace(USUAL, departure_min=10 * 60.0), stations=day))
    unasked = plan_of(ask(stations=day))
    assert calls_of(asked) == calls_of(unasked)
    assert (asked.objective, asked.short_by, asked.unproven) == (pytest.approx(unasked.objective), 0.0, "")


def test_a_station_that_is_never_open_is_not_called_at() -> None:
    never = tuple(replace(s, opening_hours="off") if s.id == "b" else s for s in FOUR)
    assert "b" not in calls_of(plan_of(ask(replace(USUAL, departure_min=0.0), stations=never)))


def test_hours_of_a_season_are_those_of_the_week_of_departure() -> None:
    summer = tuple(replace(s, opening_hours="Apr-Oct 00:00-24:00; Nov-Mar off") for s in FOUR)

    def calls(day: datetime) -> list[str]:
        asked = replace(USUAL, departure_min=day.weekday() * 1440.0, departure=day)
        answer = ask(asked, stations=summer)
        return calls_of(plan_of(answer)) if answer.plans else []

    assert calls(datetime(2026, 7, 15))
    assert not calls(datetime(2026, 12, 15))


def test_too_few_stops_are_named_and_not_a_charge_that_is_not_missing() -> None:
    missing = ask(replace(USUAL, most_stops=1)).no_plan
    assert missing is not None
    assert "at most 1 stop" in missing.reason
    assert missing.missing_j == 0.0


def test_a_speed_cap_is_kept_where_it_saves_time_and_never_makes_a_plan_slower() -> None:
    slow = tuple(replace(s, sockets=(Socket(Connector.CCS2, 5e3),)) for s in FOUR)
    free = plan_of(ask(stations=slow))
    capped = plan_of(ask(replace(USUAL, speed_caps_mps=(25.0, 20.0)), stations=slow))
    assert capped.objective < free.objective
    assert any(leg.speed_cap_mps in (25.0, 20.0) for leg in capped.legs)
    assert capped.energy_j < free.energy_j


def test_more_reserve_at_stops_is_kept_and_never_faster() -> None:
    plain, careful = plan_of(ask()), plan_of(ask(replace(USUAL, arrive_soc_frac=0.25, goal_soc_frac=0.25)))
    assert all(leg.soc_end_frac >= 0.25 - 1e-9 for leg in careful.legs)
    assert careful.objective >= plain.objective


def test_confidence_keeps_more_than_the_mean() -> None:
    sure = plan_of(ask(replace(USUAL, confidence=0.95)))
    mean = plan_of(ask(replace(USUAL, confidence=0.5)))
    plain = plan_of(ask())
    assert sure.legs[-1].soc_end_frac > plain.legs[-1].soc_end_frac + 0.005
    assert mean.objective == pytest.approx(plain.objective)
    assert sure.objective > plain.objective


def test_fewer_stops_may_be_asked_for() -> None:
    plain = plan_of(ask(replace(USUAL, overhead_s=0.0)))
    fewest = min(n for n in range(5) if ask(replace(USUAL, most_stops=n, overhead_s=0.0)).plans)
    answer = ask(replace(USUAL, most_stops=fewest, overhead_s=0.0))
    assert len(plan_of(answer).stops) == fewest <= len(plain.stops)


def test_alternatives_differ_from_the_best_plan() -> None:
    answer = ask(replace(USUAL, overhead_s=0.0, alternatives=3))
    names = [plan.name for plan in answer.plans]
    assert names[0] == "best"
    assert len(set(names)) == len(names) >= 2
    reserve = next(plan for plan in answer.plans if plan.name == "most reserve")
    assert min(leg.soc_end_frac for leg in reserve.legs) > min(leg.soc_end_frac for leg in answer.plans[0].legs)


def test_without_a_plan_the_failing_leg_and_what_would_help_are_said() -> None:
    answer = ask(replace(USUAL, max_soc_frac=0.85), stations=(FOUR[0], FOUR[1]), to=13.2)
    assert answer.plans == ()
    missing = answer.no_plan
    assert missing is not None
    assert missing.from_station is not None
    assert missing.from_station.id == "b"
    assert missing.last_reached is not None
    assert missing.last_reached.id == "b"
    assert 0.0 < missing.missing_j < 5500.0 * 3600.0
    assert missing.helps == (
        Help(HelpKind.SPEED_CAP, 110.0 / 3.6, "driving at most 110 km/h"),
        Help(HelpKind.MAX_SOC, 1.0, "charging to 100 % at stations"),
    )


def test_without_a_station_in_reach_more_charge_now_helps() -> None:
    answer = ask(query=replace(QUERY, soc_frac=0.2), stations=(FOUR[1],), to=9.2)
    missing = answer.no_plan
    assert missing is not None
    assert missing.from_station is None
    (charge,) = [each for each in missing.helps if each.kind is HelpKind.SOC]
    assert charge.value is not None
    percent = round(100.0 * charge.value)
    assert charge.text == f"departing with {percent} % instead of 20 %"
    assert ask(query=replace(QUERY, soc_frac=percent / 100.0), stations=(FOUR[1],), to=9.2).plans
    assert not ask(query=replace(QUERY, soc_frac=(percent - 1) / 100.0), stations=(FOUR[1],), to=9.2).plans


@pytest.mark.parametrize(
    ("changes", "field"),
    [
        ({"arrive_soc_frac": 1.5}, "charging.arrive_soc_frac"),
        ({"max_soc_frac": 0.05}, "charging.max_soc_frac"),
        ({"arrive_soc_frac": 0.01}, "charging.arrive_soc_frac"),
        ({"confidence": 1.0}, "charging.confidence"),
        ({"overhead_s": -1.0}, "charging.overhead_s"),
        ({"network_factors": {"n": 0.0}}, "charging.network_factors[n]"),
        ({"speed_caps_mps": (1.0,)}, "charging.speed_caps_mps"),
        ({"stays": (FixedStay(0, 10.0),)}, "charging.stays.via_idx"),
        ({"most_stops": -1}, "charging.most_stops"),
    ],
)
def test_what_is_out_of_range_is_refused_by_its_name(changes: dict[str, object], field: str) -> None:
    with pytest.raises(QueryError, match=field.split("[")[0].replace(".", r"\.")):
        ask(replace(USUAL, **changes))  # type: ignore[arg-type]


def test_a_time_that_is_over_before_any_plan_is_an_error() -> None:
    graph = road()
    planner = ChargingPlanner(RouteSearch(graph, ChainMaker(graph)), ChainMaker(graph))
    with within(TimeBudget(0.0)), pytest.raises(TimeUpError):
        planner.plan(QUERY, USUAL, CAR, FOUR, [at(0.5), at(14.5)])


def test_on_a_graph_of_many_links_a_plan_is_as_good_here_and_carries_a_bound() -> None:
    chains = ChainMaker(ROAD)
    thinned = ChargingPlanner(RouteSearch(ROAD, chains), chains, many_links=0)
    stations = (*FOUR, *(station(f"e{k}", 1.2 + 0.2 * k, 20e3) for k in range(60)))
    places = [at(0.5), at(14.5)]
    whole = plan_of(PLANNER.plan(QUERY, USUAL, CAR, stations, places))
    few = plan_of(thinned.plan(QUERY, USUAL, CAR, stations, places))
    assert whole.short_by == 0.0
    assert few.short_by is not None
    assert few.objective - few.short_by <= whole.objective + 1e-6 <= few.objective + 2e-6
    assert few.objective <= 1.1 * whole.objective


def test_stations_by_the_dozen_are_planned_over_as_few_are() -> None:
    useless = tuple(station(f"far{k}", 1.1 + 0.2 * k, 3e3) for k in range(60))
    few, many = plan_of(ask()), plan_of(ask(stations=(*useless, *FOUR)))
    assert many.objective == pytest.approx(few.objective, rel=1e-9)
    assert many.short_by == 0.0


def test_a_journey_may_begin_at_a_station_or_end_where_it_begins() -> None:
    low = replace(QUERY, soc_frac=0.1)
    places = [FOUR[0].position, at(9.2)]
    plan = plan_of(PLANNER.plan(low, USUAL, CAR, FOUR, places))
    assert plan.legs[0].spans == ()
    assert plan.legs[0].distance_m == 0.0
    assert calls_of(plan)[0] == "a"
    assert plan.stops[0].arrive_soc_frac == 0.1
    here = plan_of(PLANNER.plan(QUERY, USUAL, CAR, FOUR, [at(4.2), at(4.2)]))
    assert here.stops == ()
    assert here.objective == 0.0


def test_two_stations_at_one_place_are_told_apart() -> None:
    slow = replace(FOUR[1], id="slow", sockets=(Socket(Connector.CCS2, 7e3),))
    plan = plan_of(ask(stations=(slow, *FOUR)))
    assert "slow" not in calls_of(plan)


def test_a_proof_ends_after_labels_and_says_by_no_less_how_much_another_plan_may_be_better() -> None:
    shorts, objectives = [], []
    for labels in (0, 0, 100_000, 1_000_000):
        world = drawn_world(13)
        chains = ChainMaker(world.graph)
        planner = ChargingPlanner(RouteSearch(world.graph, chains), chains, proof_labels=labels)
        answer = planner.plan(world.query, world.charging, world.vehicle_charging, world.stations, world.places)
        plan = plan_of(answer)
        assert plan.short_by is not None
        shorts.append(plan.short_by)
        objectives.append(plan.objective)
    assert shorts[0] == shorts[1] > shorts[2] > shorts[3] == 0.0
    for short_by, objective in zip(shorts, objectives, strict=True):
        assert objective - short_by <= objectives[3] * (1.0 + 1e-9)
