"""Routes over via points: rest at each, charge and clock carried on, order kept."""

from __future__ import annotations

import itertools
import math
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from energy.battery import soc_along
from energy.chain.chain import StopRule
from energy.conditions import STILL, Conditions
from energy.errors import LinkError
from energy.force.effects import drive_of
from energy.force.kernels_physics import cabin_energy_j
from energy.units import JOULE_PER_WH
from energy.vehicle.coefficients import EffectCoefficients
from energy.vehicle.files import load_vehicles
from routing.errors import NoPathError, PointFarFromRoadError, PointOutsideMapError
from routing.graph.road_graph import RoadGraph
from routing.places import LinkSpan, Point
from routing.planner import Planner
from routing.queries import RouteQuery
from routing.route.route import LegEnd
from routing.route.via import WayFinder
from routing.weights import BALANCED, ECO, FASTEST, Weights
from tests.routing.drawn_streets import SOUTH, STEP, WEST, drawn_streets

if TYPE_CHECKING:
    from collections.abc import Sequence

    from energy.vehicle.vehicle import Vehicle

pytestmark = pytest.mark.nojit

# 3 ------- 2 ------- 5     both ways but 1 → 4 → 5; signals at 2
# |       / |       /       0 lies 400 m above the sea, 2 lies at 600 m
# |     /   |     /         0 - 2 is a slow short cut
# 0 ------- 1 → 4
PLACES = [(0, 0), (2, 0), (2, 2), (0, 2), (3, 0), (4, 2)]  # 0.01° east and north
HEIGHTS_M = [400.0, 430.0, 600.0, 480.0, 500.0, 560.0]
BOTH_WAYS = [(0, 1), (1, 2), (2, 3), (3, 0), (0, 2), (2, 5)]
ONE_WAY = [(1, 4), (4, 5)]
LINKS = [pair for a, b in BOTH_WAYS for pair in ((a, b), (b, a))] + ONE_WAY
COLD = Conditions(ambient_k=263.15)
CARS = load_vehicles(Path(__file__).resolve().parents[3] / "data" / "vehicles")
KONA, I3 = CARS["hyundai-kona-64"], CARS["bmw-i3-60ah"]
WARMING = replace(I3, effects=replace(I3.effects, tyre_warm_up_frac=0.4, tyre_time_s=300.0))
SMALL = replace(KONA, usable_capacity_wh=2000.0)
DRAGLESS = replace(
    KONA,
    road_load_b_n_per_mps=0.0,
    road_load_c_n_per_mps2=0.0,
    accel_speed_mps=np.array([0.0, 50.0]),
    accel_mps2=np.array([1.0]),
    decel_mps2=np.array([-1.2]),
)


def ring_map(heights_m: Sequence[float] = HEIGHTS_M) -> RoadGraph:
    slow = [{a, b} == {0, 2} for a, b in LINKS]
    cross = np.array([3 if head == 2 else 0 for _, head in LINKS])
    return drawn_streets(
        "ring", PLACES, LINKS, heights_m, speed_limit_mps=np.where(slow, 30.0, 90.0) / 3.6, cross=cross
    )


@pytest.fixture(scope="module")
def planner() -> Planner:
    return Planner(ring_map())


@pytest.fixture(scope="module")
def level_planner() -> Planner:
    return Planner(ring_map([400.0] * len(PLACES)))


def along(a: int, b: int, share: float) -> Point:
    """A place on the straight line between two nodes."""
    (east_a, north_a), (east_b, north_b) = PLACES[a], PLACES[b]
    east, north = east_a + share * (east_b - east_a), north_a + share * (north_b - north_a)
    return Point(SOUTH + north * STEP / 1e7, WEST + east * STEP / 1e7)


AHEAD_OF_A_CREST = (along(3, 2, 0.5), along(3, 2, 0.9375), along(2, 1, 0.5))  # start, via point, goal


def ask(start: Point, goal: Point, *via: Point, soc: float = 0.8, car=KONA, **changes) -> RouteQuery:
    return replace(RouteQuery(start, goal, soc, car, via=via), **changes)


def lost_in_a_stop_j(car: Vehicle, speed_mps: float) -> float:
    """Kinetic energy of a speed, less what is left of it once it was recuperated and given back."""
    return (1.0 / car.drive_eff - car.recuperation_eff) * 0.5 * car.mass_kg * car.rotating_mass_coef * speed_mps**2


def route(planner: Planner, query: RouteQuery):
    (only,) = planner.route(query).routes
    return only


def spans_of(found) -> tuple[LinkSpan, ...]:
    return tuple(LinkSpan(link.link_idx, link.from_m, link.to_m, link.rest) for link in found.links)


def link_of(planner: Planner, a: int, b: int) -> int:
    (link,) = np.flatnonzero((planner.graph.tail == a) & (planner.graph.head == b)).tolist()
    return int(link)


def way(planner: Planner, found) -> list[tuple[int, int]]:
    graph = planner.graph
    return [(int(graph.tail[link.link_idx]), int(graph.head[link.link_idx])) for link in found.links]


streets = st.sampled_from(BOTH_WAYS)  # from and to each of them there is a way
spots = st.builds(lambda street, share: along(*street, share), streets, st.floats(0.05, 0.95))
rules = st.sampled_from(list(StopRule))
weathers = st.sampled_from([STILL, COLD])
cars = st.sampled_from([KONA, SMALL, WARMING])


@settings(max_examples=30, deadline=None)
@given(
    st.lists(spots, min_size=3, max_size=6),
    st.floats(0.05, 1.0),
    rules,
    weathers,
    cars,
    st.sampled_from([ECO, FASTEST, BALANCED]),
)
def test_route_over_via_points_is_what_its_links_give_in_order(planner, places, soc, rule, conditions, car, weights):
    start, *via, goal = places
    query = ask(start, goal, *via, soc=soc, car=car, stop_rule=rule, conditions=conditions)
    answer = planner.route(replace(query, weightings=(("asked", weights),)))
    (found,) = answer.routes
    if not found.links:
        assert len({(place.link_idx, round(place.offset_m)) for place in (answer.start, *answer.via, answer.goal)}) <= 2
        return
    driven = planner.simulate(
        spans_of(found), car, conditions=conditions, stop_rule=rule, soc_start_frac=query.soc_frac
    )
    assert found.energy_j == driven.energy_j
    assert found.duration_s == driven.duration_s
    assert found.parts == driven.parts
    charge, _ = soc_along(np.array([link.energy_j for link in driven.links]), soc, car.usable_capacity_wh)
    assert [link.soc_end_frac for link in found.links] == charge.tolist()
    # legs lie end to end, each of them ends where it should
    assert len(found.legs) == len(via) + 1
    assert found.legs[0].from_m == 0.0
    assert all(a.to_m == b.from_m for a, b in itertools.pairwise(found.legs))
    assert found.legs[-1].to_m == pytest.approx(found.distance_m, rel=1e-12)
    assert sum(leg.energy_j for leg in found.legs) == pytest.approx(found.energy_j, rel=1e-9, abs=1e-6)
    assert sum(leg.duration_s for leg in found.legs) == pytest.approx(found.duration_s, rel=1e-12)
    for leg, place in zip(found.legs, (*answer.via, answer.goal), strict=True):
        if leg.last_link is None:
            continue
        last = found.links[leg.last_link]
        assert last.soc_end_frac == leg.soc_end_frac
        assert last.result.stop_probability_frac == 1.0
        assert last.result.standstill_s == 0.0
        length_m = float(planner.graph.length_m[place.link_idx])
        offset_m = last.to_m if last.link_idx == place.link_idx else length_m - last.to_m
        assert offset_m == pytest.approx(place.offset_m, abs=1e-6)
        lon, lat = found.geometry[last.geometry_end_idx]
        assert (lat, lon) == pytest.approx((place.on_road.lat_deg, place.on_road.lon_deg), abs=1e-6)
    ends = [link.geometry_end_idx for link in found.links]
    assert ends == sorted(set(ends))
    assert ends[0] > 0
    assert ends[-1] == len(found.geometry) - 1


def without_and_with(planner: Planner, start: Point, via: Point, goal: Point):
    """Thriftiest, fastest and shortest routes straight to the goal, and over a via point.

    A stop saves drag, and where a table of accelerations falls it may even save time: this car has neither.
    """
    weightings = (("eco", ECO), ("fastest", FASTEST), ("shortest", Weights(0.0, 0.0, 1.0)))
    query = ask(start, goal, car=DRAGLESS, stop_rule=StopRule.NONE, weightings=weightings)
    return (planner.route(replace(query, via=places)).routes for places in ((), (via,)))


@settings(max_examples=25, deadline=None)
@given(spots, spots, spots)
def test_via_point_on_level_roads_never_takes_less_where_slow_is_not_cheap(level_planner, start, via, goal):
    free, over = without_and_with(level_planner, start, via, goal)
    assert over[0].energy_j >= free[0].energy_j - 1e-6
    assert over[1].duration_s >= free[1].duration_s - 1e-9
    assert over[2].distance_m >= free[2].distance_m - 1e-6


@settings(max_examples=25, deadline=None)
@given(spots, spots, spots)
@example(*AHEAD_OF_A_CREST)
def test_via_point_on_hills_saves_at_most_what_a_stop_loses(planner, start, via, goal):
    free, over = without_and_with(planner, start, via, goal)
    assert over[0].energy_j >= free[0].energy_j - lost_in_a_stop_j(DRAGLESS, 90.0 / 3.6)
    assert over[1].duration_s >= free[1].duration_s - 1e-9
    assert over[2].distance_m >= free[2].distance_m - 1e-6


def test_via_point_ahead_of_a_crest_saves_driving_up_what_the_descent_gives(planner):
    free, over = (eco for eco, *_ in without_and_with(planner, *AHEAD_OF_A_CREST))
    assert [way(planner, route) for route in (free, over)] == [[(3, 2), (2, 1)], [(3, 2), (3, 2), (2, 1)]]
    # 96 m after the stop the crest is passed at 14 m/s instead of 25: less speed is gained uphill and more downhill,
    # where gaining it takes less than 1/η_dis as the brakes would have to hold the car
    assert over.links[1].to_m - over.links[1].from_m == pytest.approx(96.5, abs=0.1)
    up, down = (sum(link.result.energy_j for link in links) for links in (over.links[:2], over.links[2:]))
    saved_up_j, more_down_j = free.links[0].result.energy_j - up, down - free.links[1].result.energy_j
    assert 0.0 < more_down_j < saved_up_j
    assert free.energy_j - over.energy_j == pytest.approx(saved_up_j - more_down_j, rel=1e-6)
    assert saved_up_j - more_down_j < lost_in_a_stop_j(DRAGLESS, 25.0)


@pytest.mark.parametrize("car", [KONA, I3])
def test_via_point_on_the_way_adds_the_stop_alone(planner, car):
    query = ask(along(0, 2, 0.3), along(2, 0, 0.2), car=car, stop_rule=StopRule.NONE)  # at 30 km/h drag is small
    free, over = (route(planner, replace(query, via=via)) for via in ((), (along(0, 2, 0.5),)))
    assert way(planner, over) == way(planner, free) * 2
    assert over.distance_m == pytest.approx(free.distance_m, rel=1e-12)
    assert (over.climb_m, over.descent_m) == pytest.approx((free.climb_m, free.descent_m))
    assert over.duration_s > free.duration_s
    assert 0.0 < over.energy_j - free.energy_j < 1.5 * lost_in_a_stop_j(car, 30.0 / 3.6)


def test_order_of_via_points_is_that_asked(planner):
    start, goal = along(0, 1, 0.2), along(0, 1, 0.3)
    farther, nearer = along(2, 5, 0.5), along(2, 3, 0.5)
    first, second = (route(planner, ask(start, goal, *via)) for via in ((farther, nearer), (nearer, farther)))
    # which of the two is met first
    assert way(planner, first).index((2, 5)) < way(planner, first).index((2, 3))
    assert way(planner, second).index((3, 2)) < way(planner, second).index((2, 5))


def test_vehicle_may_turn_round_at_a_via_point(planner):
    via = along(2, 5, 0.5)
    found = route(planner, ask(along(2, 5, 0.1), along(2, 5, 0.2), via))
    assert way(planner, found) == [(2, 5), (5, 2)]
    there, back = found.links
    assert (there.rest, back.rest) == (True, False)
    assert there.to_m + back.from_m == pytest.approx(float(planner.graph.length_m[there.link_idx]))


def test_via_point_may_be_passed_on_the_same_link(planner):
    found = route(planner, ask(along(1, 4, 0.1), along(1, 4, 0.9), along(1, 4, 0.4), along(1, 4, 0.5)))
    assert way(planner, found) == [(1, 4)] * 3
    assert [link.rest for link in found.links] == [True, True, False]
    assert [link.stop_probability_frac for link in found.links] == [1.0] * 3


def test_clock_is_carried_on_so_that_the_cabin_is_heated_up_once(planner):
    start, via, goal = along(0, 1, 0.3), along(2, 5, 0.5), along(0, 3, 0.3)
    whole = route(planner, ask(start, goal, via, conditions=COLD))
    physics = drive_of(KONA, COLD).physics
    assert whole.parts.cabin_j == pytest.approx(cabin_energy_j(physics, 0.0, whole.duration_s), rel=1e-9)
    apart = [route(planner, ask(*ends, conditions=COLD)) for ends in ((start, via), (via, goal))]
    assert sum(part.parts.cabin_j for part in apart) > 1.05 * whole.parts.cabin_j
    assert apart[0].energy_j == pytest.approx(whole.legs[0].energy_j, rel=1e-9)


@pytest.mark.parametrize("car", [KONA, WARMING, SMALL], ids=["cabin", "tyres", "full-battery"])
def test_each_leg_is_searched_from_the_charge_and_clock_of_the_one_before(planner, car):
    soc = 1.0 if car is SMALL else 0.8
    query = ask(along(2, 5, 0.6), along(2, 1, 0.5), along(1, 4, 0.1), along(2, 3, 0.2), soc=soc, car=car)
    query = replace(query, conditions=COLD if car is not SMALL else STILL)
    found = route(planner, query)
    places = [planner._roads.snap("", place, 100.0)[1] for place in (query.start, *query.via, query.goal)]
    searched = WayFinder(planner._search, query, places).best(ECO)
    assert searched.spans == spans_of(found)
    charge = [soc, *(leg.soc_end_frac for leg in found.legs)]
    for leg, searched_leg, (before, after) in zip(found.legs, searched.found, itertools.pairwise(charge), strict=True):
        # what the search paid, a full battery included, is what the drive takes in the leg
        assert searched_leg.path.energy_j == pytest.approx(
            (before - after) * car.usable_capacity_wh * JOULE_PER_WH, abs=1.0
        )
        assert searched_leg.path.time_s == pytest.approx(leg.duration_s, rel=1e-9)
    assert (found.braked_away_j > 0.0) == (car is SMALL)


def all_ways(graph: RoadGraph, starts, goals, most_links: int):
    """All ways of at most most_links links from a place to a place, as stretches."""
    found = []

    def drive(before, link, offset_m):
        for goal in goals:
            if goal.link_idx == link and goal.offset_m > offset_m:
                found.append((*before, LinkSpan(link, offset_m, goal.offset_m)))
        if len(before) + 1 < most_links:
            stretch = LinkSpan(link, offset_m, float(graph.length_m[link]))
            for following in graph.successors(link).tolist():
                drive((*before, stretch), following, 0.0)

    for start in starts:
        drive((), start.link_idx, start.offset_m)
    return found


@pytest.mark.parametrize(
    ("car", "conditions", "soc", "weights"),
    [
        (KONA, STILL, 0.8, ECO),
        (KONA, COLD, 0.8, ECO),
        (WARMING, COLD, 0.8, ECO),
        (SMALL, STILL, 1.0, ECO),
        (SMALL, STILL, 1.0, BALANCED),
        (SMALL, STILL, 0.36, BALANCED),
        (SMALL, STILL, 0.36, FASTEST),
        (SMALL, STILL, 0.3, FASTEST),
    ],
)
def test_no_way_of_all_costs_less_than_is_said(planner, car, conditions, soc, weights):
    start, via, goal = along(2, 5, 0.3), along(0, 1, 0.2), along(2, 3, 0.2)
    query = ask(start, goal, via, soc=soc, car=car, conditions=conditions, weightings=(("asked", weights),))
    answer = planner.route(query)
    (found,) = answer.routes
    positions = [planner._roads.snap("", place, 100.0)[1] for place in (start, via, goal)]
    legs = [all_ways(planner.graph, *ends, 5) for ends in itertools.pairwise(positions)]
    capacity_wh = car.usable_capacity_wh

    def cost_of(driven) -> tuple[float, float]:
        charge, _ = soc_along(np.array([link.energy_j for link in driven.links]), soc, capacity_wh)
        used_kwh = (soc - float(charge[-1])) * capacity_wh / 1000.0
        rest = weights.time * driven.duration_s / 3600.0 + weights.distance * driven.distance_m / 1000.0
        return weights.energy * used_kwh + rest, float(charge.min())

    def drive(spans):
        return planner.simulate(spans, car, conditions=conditions, soc_start_frac=soc)

    costs = []
    for first, second in itertools.product(*legs):
        cost, lowest = cost_of(drive((*first[:-1], replace(first[-1], rest=True), *second)))
        if lowest >= 0.0:
            costs.append(cost)
    assert found.feasible == (len(costs) > 0)
    mine, _ = cost_of(drive(spans_of(found)))
    said = [float(text.split(" at most ")[1].split()[0]) for text in answer.warnings if " at most " in text]
    assert len(costs) == 0 or min(costs) >= mine - sum(said) * 1.01 - 1e-9
    if weights == ECO and conditions == STILL:
        assert said == []
        assert mine == pytest.approx(min(costs), abs=1e-9)


def test_fastest_legs_that_run_the_charge_out_give_way_to_ones_that_keep_it(planner):
    query = ask(along(0, 1, 0.2), along(0, 3, 0.3), along(2, 5, 0.7), along(2, 3, 0.5), car=SMALL)
    eco, fastest = (
        route(planner, replace(query, soc_frac=1.0, weightings=(weighting,)))
        for weighting in (("eco", ECO), ("fastest", FASTEST))
    )
    assert eco.soc_min_frac > fastest.soc_min_frac
    reserve = 0.5 * (eco.soc_min_frac + fastest.soc_min_frac)
    answer = planner.route(replace(query, soc_frac=1.0, reserve_soc_frac=reserve, weightings=(("fastest", FASTEST),)))
    (kept,) = answer.routes
    assert kept.feasible
    assert kept.soc_min_frac >= reserve
    assert fastest.duration_s < kept.duration_s <= eco.duration_s
    (note,) = (text for text in answer.warnings if "not proven best" in text)
    assert float(note.split("at most ")[1].split()[0]) == pytest.approx(
        (kept.duration_s - fastest.duration_s) / 3600.0, rel=0.01
    )


@pytest.mark.parametrize("weights", [ECO, FASTEST])
def test_leg_beyond_the_charge_leaves_the_rest_answered(planner, weights):
    via = along(2, 3, 0.5)
    query = ask(along(0, 1, 0.2), along(0, 3, 0.3), via, along(2, 5, 0.7), soc=0.05, car=SMALL)
    answer = planner.route(replace(query, weightings=(("asked", weights),)))
    (found,) = answer.routes
    assert not found.feasible
    assert found.deficit_j == pytest.approx(-found.soc_min_frac * SMALL.usable_capacity_wh * JOULE_PER_WH)
    assert found.furthest is not None
    assert found.legs[0].soc_end_frac < 0.0
    assert all(leg.first_link is not None for leg in found.legs)
    assert any("least-energy way" in text for text in answer.warnings) == (weights == FASTEST)
    enough = route(planner, replace(query, soc_frac=found.remedy.soc_start_needed_frac + 1e-9))
    assert enough.feasible
    assert way(planner, enough) == way(planner, found)


@pytest.mark.parametrize("same", [(0,), (1,), (2,), (0, 1), (1, 2), (0, 0, 1, 1, 2)])
def test_via_point_at_its_neighbour_is_a_leg_of_nothing(planner, same):
    places = [along(0, 1, 0.3), along(2, 5, 0.5), along(2, 3, 0.6)]
    stops = sorted([0, 1, 2, *same])
    doubled = route(planner, ask(places[0], places[2], *[places[k] for k in stops[1:-1]]))
    plain = route(planner, ask(places[0], places[2], places[1]))
    assert doubled.energy_j == plain.energy_j
    assert doubled.duration_s == plain.duration_s
    nothing = [leg for leg in doubled.legs if leg.first_link is None]
    assert len(nothing) == len(same)
    assert len(doubled.legs) == 2 + len(same)
    for leg in nothing:
        assert (leg.last_link, leg.duration_s, leg.energy_j, leg.to_m) == (None, 0.0, 0.0, leg.from_m)
    driven = [leg for leg in doubled.legs if leg.first_link is not None]
    assert [replace(leg, ends_at=LegEnd.VIA) for leg in driven] == [
        replace(leg, ends_at=LegEnd.VIA) for leg in plain.legs
    ]


def test_via_points_all_at_the_start_and_goal_take_nothing(planner):
    here = along(0, 1, 0.3)
    answer = planner.route(ask(here, here, here, here))
    (found,) = answer.routes
    assert len(found.links) == 0
    assert found.energy_j == 0.0
    assert [(leg.first_link, leg.soc_end_frac) for leg in found.legs] == [(None, 0.8)] * 3
    assert answer.stats[0].method == "none"
    assert found.height_start_m == pytest.approx(409.0, abs=0.1)  # 400 m + 0.3 · 30 m


def test_round_trip_over_a_via_point_comes_back(planner):
    home = along(0, 1, 0.3)
    found = route(planner, ask(home, home, along(2, 5, 0.5)))
    assert found.distance_m > 5000.0
    assert found.geometry[0].tolist() == pytest.approx(found.geometry[-1].tolist(), abs=1e-9)
    assert found.links[-1].height_end_m == pytest.approx(found.height_start_m, abs=1e-6)


def test_height_of_link_ends_adds_up_to_climb_and_descent(planner):
    found = route(planner, ask(along(0, 1, 0.3), along(2, 3, 0.5), along(2, 5, 0.5)))
    steps = np.diff([found.height_start_m, *(link.height_end_m for link in found.links)])
    assert float(steps[steps > 0.0].sum()) == pytest.approx(found.climb_m)
    assert float(-steps[steps < 0.0].sum()) == pytest.approx(found.descent_m)
    assert found.links[-1].height_end_m == pytest.approx(540.0, abs=0.1)  # half-way from 600 m to 480 m


def test_rest_leaves_the_counters_of_stops_alone(planner):
    graph = planner.graph
    to_signals, onward = link_of(planner, 1, 2), link_of(planner, 2, 5)
    length_m = float(graph.length_m[to_signals])
    spans = (
        LinkSpan(to_signals, 0.0, 1000.0, True),
        LinkSpan(to_signals, 1000.0, length_m),
        LinkSpan(onward, 0.0, 900),
    )
    counted = planner.simulate(spans, KONA, stop_rule=StopRule.COUNTED)
    # the first request of its class stops, as without the rest before it
    assert [link.stop_probability_frac for link in counted.links] == [1.0, 1.0, 1.0]
    assert [link.standstill_s for link in counted.links] == [0.0, 21.0, 0.0]
    none = planner.simulate(spans, KONA, stop_rule=StopRule.NONE)
    assert [link.stop_probability_frac for link in none.links] == [1.0, 0.0, 1.0]


def test_stretches_that_do_not_meet_after_a_rest_are_refused(planner):
    graph = planner.graph
    there = link_of(planner, 0, 1)
    back = int(graph.reverse_idx[there])
    length_m = float(graph.length_m[there])
    resting, passing = LinkSpan(there, 0.0, 500.0, True), LinkSpan(there, 0.0, 500.0)
    for after in (LinkSpan(there, 500.0, length_m), LinkSpan(back, length_m - 500.0, length_m)):
        assert planner.simulate((resting, after), KONA).distance_m == pytest.approx(500.0 + after.to_m - after.from_m)
        with pytest.raises(LinkError, match="may follow"):
            planner.simulate((passing, after), KONA)
    for astray in (LinkSpan(there, 501.0, length_m), LinkSpan(back, 500.0, length_m)):
        with pytest.raises(LinkError, match="may follow"):
            planner.simulate((resting, astray), KONA)


@pytest.mark.parametrize(
    ("place", "error"), [(Point(50.0, 8.0), PointOutsideMapError), (Point(46.01, 8.03), PointFarFromRoadError)]
)
def test_via_point_that_does_not_snap_is_named_by_its_position(planner, place, error):
    near = Planner(planner.graph, snap_limit_m=100.0)
    with pytest.raises(error, match=r"via\[1\]") as caught:
        near.route(ask(along(0, 1, 0.3), along(2, 3, 0.5), along(2, 5, 0.5), place))
    assert caught.value.field == "via[1]"


def test_leg_without_a_way_is_named(planner):
    graph = planner.graph
    lost = link_of(planner, 1, 4)  # a link that nothing may follow
    begin, end = graph.successor_first[lost : lost + 2]
    first = graph.successor_first.copy()
    first[lost + 1 :] -= end - begin
    trap = Planner(replace(graph, successor_first=first, successor=np.delete(graph.successor, np.s_[begin:end])))
    with pytest.raises(NoPathError, match=r"from via\[0\] to goal"):
        trap.route(ask(along(0, 1, 0.3), along(2, 3, 0.5), along(1, 4, 0.5)))
    with pytest.raises(NoPathError, match=r"from start to goal"):
        trap.route(ask(along(1, 4, 0.5), along(2, 3, 0.5)))


def test_charge_along_a_route_has_the_quantiles_of_its_arrival_at_the_end(planner):
    query = ask(along(0, 1, 0.3), along(2, 3, 0.5), along(2, 5, 0.5), soc=0.5, car=I3, uncertainty=True)
    found = route(planner, query)
    low, high = ([getattr(link, f"soc_end_{name}_frac") for link in found.links] for name in ("p10", "p90"))
    assert (low[-1], high[-1]) == (found.uncertainty.arrival_soc_p10_frac, found.uncertainty.arrival_soc_p90_frac)
    assert all(a < link.soc_end_frac < b for a, link, b in zip(low, found.links, high, strict=True))
    assert high[-1] - low[-1] > high[0] - low[0] > 0.0
    certain = route(planner, replace(query, uncertainty=False))
    assert (
        {link.soc_end_p10_frac for link in certain.links} == {link.soc_end_p90_frac for link in certain.links} == {None}
    )


def test_bound_of_a_cabin_that_warms_up_decays_with_the_time_before_the_via_point(planner):
    start, near, far, goal = (along(*at) for at in ((0, 1, 0.3), (0, 1, 0.9), (2, 5, 0.9), (2, 3, 0.5)))

    def said(via: Point, **changes) -> float:
        (note,) = planner.route(ask(start, goal, via, conditions=COLD, **changes)).warnings[1:]
        return float(note.split("at most ")[1].split()[0])

    physics = drive_of(KONA, COLD).physics
    over = route(planner, ask(start, goal, far, conditions=COLD))
    left_j = physics.cabin_start_w * physics.cabin_time_s * math.exp(-over.legs[0].duration_s / physics.cabin_time_s)
    assert said(far) == pytest.approx(left_j / 3.6e6, rel=0.05)
    assert said(near) > said(far) > 0.0
    without = planner.route(ask(start, goal, far)).warnings
    assert not any("warm up" in text for text in without)


def test_weights_of_other_size_answer_the_same_way(planner):
    query = ask(along(0, 1, 0.3), along(2, 3, 0.5), along(2, 5, 0.5))
    plain, sevenfold = planner.route(replace(query, weightings=(("one", ECO), ("many", Weights(7.0))))).routes
    assert spans_of(plain) == spans_of(sevenfold)


def test_effects_of_learned_tyres_are_carried_over_a_via_point(planner):
    assert WARMING.effects != EffectCoefficients()
    start, via, goal = along(0, 1, 0.3), along(2, 5, 0.5), along(0, 3, 0.3)
    whole = route(planner, ask(start, goal, via, car=WARMING, conditions=COLD))
    apart = [route(planner, ask(*ends, car=WARMING, conditions=COLD)) for ends in ((start, via), (via, goal))]
    assert 0.0 < whole.parts.tyre_warm_up_j < 0.9 * sum(part.parts.tyre_warm_up_j for part in apart)
