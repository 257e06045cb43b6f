"""Route and simulation queries on a hand-made map: special places, charge limits, and what is refused."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from energy.chain.chain import LinkModel, StopRule
from energy.conditions import Conditions, RoadSurface
from energy.errors import ConditionsError, LinkError
from energy.vehicle.vehicle import Vehicle
from routing.errors import PointFarFromRoadError, PointOutsideMapError, QueryError
from routing.graph.conditional_limits import EVERY_DAY, ConditionalLimits
from routing.graph.road_graph import RoadGraph, Terrain
from routing.places import LinkSpan, Point
from routing.planner import Planner
from routing.queries import RangeQuery, RouteQuery
from routing.weights import BALANCED, ECO, FASTEST, Weights
from tests.routing.drawn_streets import SOUTH, STEP, WEST, drawn_streets

pytestmark = pytest.mark.nojit

#            4            nodes 0.01° apart; 2 → 4 → 1 is a oneway, all else runs both ways; signals at 2
#          /   \
# 0 ---- 1 ---- 2 ---- 3
PLACES = [(0, 0), (1, 0), (2, 0), (3, 0), (1.5, 3)]
HEIGHTS_M = [500.0, 520.0, 600.0, 560.0, 590.0]
LINKS = [(0, 1), (1, 0), (1, 2), (2, 1), (2, 3), (3, 2), (2, 4), (4, 1)]


def street_map(heights_m=HEIGHTS_M, terrain=Terrain.SYNTHETIC) -> RoadGraph:
    limits_mps, cross = np.full(len(LINKS), 50.0 / 3.6), np.array([3 if head == 2 else 0 for _, head in LINKS])
    return drawn_streets("streets", PLACES, LINKS, heights_m, speed_limit_mps=limits_mps, cross=cross, terrain=terrain)


def car(**changes) -> Vehicle:
    values = {
        "id": "drawn",
        "name": "drawn",
        "mass_kg": 1800.0,
        "road_load_a_n": 120.0,
        "road_load_b_n_per_mps": 1.5,
        "road_load_c_n_per_mps2": 0.4,
        "drive_eff": 0.9,
        "recuperation_eff": 0.6,
        "aux_power_w": 600.0,
        "usable_capacity_wh": 20_000.0,
        "accel_speed_mps": np.array([0.0, 10.0, 40.0]),
        "accel_mps2": np.array([1.2, 0.8]),
        "decel_mps2": np.array([-1.2, -0.9]),
    } | changes
    return Vehicle(**values)


@pytest.fixture(scope="module")
def planner() -> Planner:
    return Planner(street_map())


def along(a: int, b: int, share: float) -> Point:
    """A place on the straight line between two nodes."""
    (east_a, north_a), (east_b, north_b) = PLACES[a], PLACES[b]
    east, north = east_a + share * (east_b - east_a), north_a + share * (north_b - north_a)
    return Point(SOUTH + north * STEP / 1e7, WEST + east * STEP / 1e7)


def link_of(planner: Planner, a: int, b: int) -> int:
    graph = planner.graph
    (link,) = np.flatnonzero((graph.tail == a) & (graph.head == b)).tolist()
    return int(link)


def query(start: Point, goal: Point, soc: float = 0.8, **changes) -> RouteQuery:
    return replace(RouteQuery(start, goal, soc, car()), **changes)


def way(planner: Planner, route) -> list[tuple[int, int]]:
    graph = planner.graph
    return [(int(graph.tail[link.link_idx]), int(graph.head[link.link_idx])) for link in route.links]


@pytest.mark.parametrize("soc", [0.0, 0.5, 1.0])
def test_route_from_a_place_to_itself_takes_nothing(planner, soc):
    here = along(1, 2, 0.3)
    answer = planner.route(
        query(here, here, soc, reserve_soc_frac=soc, weightings=(("eco", ECO), ("fastest", FASTEST)))
    )
    for route, stats in zip(answer.routes, answer.stats, strict=True):
        assert route.feasible
        assert (route.distance_m, route.duration_s, route.energy_j, route.parts.total_j()) == (0.0, 0.0, 0.0, 0.0)
        assert route.soc_start_frac == route.soc_end_frac == route.soc_min_frac == soc
        assert len(route.links) == 0
        assert route.geometry.shape == (2, 2)
        assert stats.labels_made == 0


def test_goal_ahead_on_the_same_link_is_reached_on_a_part_of_it(planner):
    (route,) = planner.route(query(along(1, 2, 0.2), along(1, 2, 0.7))).routes
    assert way(planner, route) == [(1, 2)]
    length = float(planner.graph.length_m[link_of(planner, 1, 2)])
    assert route.distance_m == pytest.approx(0.5 * length, rel=1e-4)
    assert route.climb_m == pytest.approx(40.0, rel=1e-4)
    assert route.descent_m == 0.0
    (link,) = route.links
    span = (LinkSpan(link.link_idx, link.from_m, link.to_m),)
    assert planner.simulate(span, car()).energy_j == route.energy_j
    assert link.stop_probability_frac == 1.0


def test_goal_behind_on_the_same_street_is_reached_on_its_other_direction(planner):
    (route,) = planner.route(query(along(1, 2, 0.7), along(1, 2, 0.2))).routes
    assert way(planner, route) == [(2, 1)]
    assert route.distance_m == pytest.approx(0.5 * float(planner.graph.length_m[link_of(planner, 1, 2)]), rel=1e-4)
    assert route.descent_m == pytest.approx(40.0, rel=1e-4)
    np.testing.assert_allclose(route.geometry[0, 0], along(1, 2, 0.7).lon_deg, atol=1e-6)
    np.testing.assert_allclose(route.geometry[-1, 0], along(1, 2, 0.2).lon_deg, atol=1e-6)


def test_goal_ahead_on_a_oneway_is_reached_on_a_part_of_it(planner):
    (route,) = planner.route(query(along(2, 4, 0.2), along(2, 4, 0.9))).routes
    assert way(planner, route) == [(2, 4)]


def test_goal_behind_on_a_oneway_is_reached_the_way_round(planner):
    (route,) = planner.route(query(along(2, 4, 0.6), along(2, 4, 0.4))).routes
    assert way(planner, route) == [(2, 4), (4, 1), (1, 2), (2, 4)]
    first, last = route.links[0], route.links[-1]
    length = float(planner.graph.length_m[first.link_idx])
    assert (first.from_m, first.to_m) == (pytest.approx(0.6 * length, rel=1e-4), length)
    assert (last.from_m, last.to_m) == (0.0, pytest.approx(0.4 * length, rel=1e-4))
    ring = sum(float(planner.graph.length_m[link_of(planner, a, b)]) for a, b in ((2, 4), (4, 1), (1, 2)))
    assert route.distance_m == pytest.approx(ring - 0.2 * length, rel=1e-4)
    assert route.climb_m == pytest.approx(route.descent_m + route.links[0].grade_frac * -0.2 * length, abs=0.1)


def test_goal_on_every_place_can_be_driven_to_from_every_other_one(planner):
    places = [along(a, b, share) for a, b in LINKS for share in (0.0, 0.5)]
    for start in places:
        for goal in places:
            (route,) = planner.route(query(start, goal)).routes
            assert route.feasible
            assert route.geometry.shape[0] >= 2


@pytest.mark.parametrize("rule", list(StopRule))
def test_stop_rules_on_a_route_past_signals_give_their_own_stops(planner, rule):
    answer = planner.route(query(along(0, 1, 0.5), along(2, 3, 0.5), stop_rule=rule))
    (route,) = answer.routes
    assert way(planner, route) == [(0, 1), (1, 2), (2, 3)]
    probability = [link.stop_probability_frac for link in route.links[:-1]]
    spans = tuple(LinkSpan(link.link_idx, link.from_m, link.to_m) for link in route.links)
    result = planner.simulate(spans, car(), stop_rule=rule)
    assert result.energy_j == pytest.approx(route.energy_j, rel=1e-12)
    assert result.duration_s == pytest.approx(route.duration_s, rel=1e-12)
    if rule is StopRule.NONE:
        assert probability == [0.0, 0.0]
    elif rule is StopRule.CROSSINGS:
        assert probability == [0.0, 1.0]
    elif rule is StopRule.COUNTED:
        assert set(probability) <= {0.0, 1.0}
        assert any("counted" in warning for warning in answer.warnings)
    else:
        assert probability[0] == 0.0
        assert 0.0 < probability[1] < 1.0


def test_expected_stops_take_longer_than_none(planner):
    ends = along(0, 1, 0.5), along(2, 3, 0.5)
    none, expected = (
        planner.route(query(*ends, stop_rule=rule)).routes[0] for rule in (StopRule.NONE, StopRule.EXPECTED)
    )
    assert expected.duration_s > none.duration_s


def test_reserve_of_all_charge_lets_descend_but_not_climb(planner):
    up, down = (along(0, 1, 0.5), along(1, 2, 0.9)), (along(1, 2, 0.9), along(1, 2, 0.2))
    (climb,) = planner.route(query(*up, 0.6, reserve_soc_frac=0.6)).routes
    assert not climb.feasible
    (descent,) = planner.route(query(*down, 0.6, reserve_soc_frac=0.6)).routes
    assert descent.feasible
    assert descent.soc_end_frac > 0.6


def test_empty_battery_uphill_is_infeasible_with_all_its_energy_missing(planner):
    (route,) = planner.route(query(along(0, 1, 0.1), along(1, 2, 0.9), 0.0)).routes
    assert not route.feasible
    highest = max(np.cumsum([link.result.energy_j for link in route.links]))
    assert route.deficit_j == pytest.approx(highest, rel=1e-9)
    assert route.soc_min_frac < 0.0
    assert route.furthest is not None
    assert route.furthest.lon_deg == pytest.approx(along(0, 1, 0.1).lon_deg, abs=1e-6)


def test_fastest_route_out_of_reach_says_that_it_shows_the_least_energy_way(planner):
    weightings = (("eco", ECO), ("fastest", FASTEST))
    answer = planner.route(query(along(0, 1, 0.1), along(1, 2, 0.9), 0.0, weightings=weightings))
    eco, fastest = answer.routes
    assert not eco.feasible
    assert not fastest.feasible
    assert fastest.energy_j == pytest.approx(eco.energy_j, rel=1e-12)
    assert [w for w in answer.warnings if "'fastest' shows the least-energy way" in w]
    assert not [w for w in answer.warnings if "'eco'" in w]


def test_remedy_of_an_infeasible_route_makes_it_feasible_and_less_does_not(planner):
    asked = query(
        along(0, 1, 0.1), along(2, 3, 0.9), 0.15, reserve_soc_frac=0.1, vehicle=car(usable_capacity_wh=3000.0)
    )
    (short,) = planner.route(asked).routes
    assert not short.feasible
    assert short.remedy is not None
    needed = short.remedy.soc_start_needed_frac
    assert 0.15 < needed < 1.0
    assert short.remedy.charge_needed_wh == pytest.approx((needed - 0.15) * 3000.0, rel=1e-9)
    assert short.deficit_j == pytest.approx(short.remedy.charge_needed_wh * 3600.0, rel=1e-9)
    assert planner.route(replace(asked, soc_frac=needed + 1e-9)).routes[0].feasible
    assert not planner.route(replace(asked, soc_frac=needed - 1e-6)).routes[0].feasible


def test_furthest_point_of_an_infeasible_route_is_where_the_reserve_is_met(planner):
    asked = query(along(0, 1, 0.1), along(2, 3, 0.9), 0.06, vehicle=car(usable_capacity_wh=3000.0))
    (route,) = planner.route(asked).routes
    assert not route.feasible
    assert route.furthest is not None
    charge = [route.soc_start_frac, *(link.soc_end_frac for link in route.links)]
    k = next(k for k, soc in enumerate(charge) if soc < 0.0)
    share = charge[k - 1] / (charge[k - 1] - charge[k])
    link = route.links[k - 1]
    a, b = way(planner, route)[k - 1]
    length = float(planner.graph.length_m[link.link_idx])
    expected = along(a, b, (link.from_m + share * (link.to_m - link.from_m)) / length)
    assert route.furthest.lat_deg == pytest.approx(expected.lat_deg, abs=1e-6)
    assert route.furthest.lon_deg == pytest.approx(expected.lon_deg, abs=1e-6)


def test_remedy_behind_a_descent_that_fills_the_battery_asks_for_more_than_full():
    # 0 → 1 fills the battery, 1 → 2 climbs more than it holds: no charge at departure helps
    planner = Planner(street_map([500.0, 200.0, 500.0, 480.0, 400.0]))
    asked = query(along(0, 1, 0.05), along(1, 2, 0.95), 0.5, vehicle=car(usable_capacity_wh=600.0))
    (route,) = planner.route(asked).routes
    assert not route.feasible
    assert route.braked_away_j > 0.0
    assert max(link.soc_end_frac for link in route.links) == 1.0
    assert route.remedy is not None
    # full at 1, then short by the deficit
    assert route.remedy.soc_start_needed_frac == pytest.approx(1.0 + route.deficit_j / 3600.0 / 600.0, rel=1e-9)
    assert not planner.route(replace(asked, soc_frac=1.0)).routes[0].feasible


@pytest.mark.parametrize("rule", list(StopRule))
@pytest.mark.parametrize("model", list(LinkModel))
def test_feasible_routes_miss_nothing_and_others_say_how_much(planner, rule, model):
    for soc in np.linspace(0.0, 0.2, 21).tolist():
        asked = query(
            along(0, 1, 0.1),
            along(2, 3, 0.9),
            soc,
            vehicle=car(usable_capacity_wh=3000.0),
            weightings=(("eco", ECO), ("balanced", BALANCED), ("fastest", FASTEST)),
            stop_rule=rule,
            link_model=model,
        )
        for route in planner.route(asked).routes:
            assert route.feasible == (route.soc_min_frac >= -1e-9)
            assert route.feasible == (route.deficit_j == 0.0)
            assert route.feasible == (route.remedy is None)
            assert route.feasible == (route.furthest is None)


@pytest.mark.parametrize("terrain", list(Terrain))
def test_warnings_of_an_answer_name_terrain_that_is_not_measured(terrain):
    planner = Planner(street_map([0.0] * 5 if terrain is Terrain.ABSENT else HEIGHTS_M, terrain))
    answer = planner.route(query(along(0, 1, 0.5), along(1, 2, 0.5)))
    found = [warning for warning in answer.warnings if "terrain" in warning]
    assert len(found) == (terrain is not Terrain.MEASURED)


ENDS = along(0, 1, 0.5), along(1, 2, 0.5)


@pytest.mark.parametrize("soc", [math.nan, -0.1, 1.1, math.inf, -math.inf])
def test_charge_outside_its_range_is_refused(planner, soc):
    for ask in (lambda: planner.route(query(*ENDS, soc)), lambda: planner.range(RangeQuery(ENDS[0], soc, car()))):
        with pytest.raises(QueryError) as refusal:
            ask()
        error = refusal.value
        assert (error.field, error.allowed) == ("soc_frac", "0..1")
        assert str(soc) in str(error)


@pytest.mark.parametrize("reserve", [0.51, 1.0, -0.01, math.nan])
def test_reserve_above_the_charge_is_refused(planner, reserve):
    for ask in (
        lambda: planner.route(query(*ENDS, 0.5, reserve_soc_frac=reserve)),
        lambda: planner.range(RangeQuery(ENDS[0], 0.5, car(), reserve)),
    ):
        with pytest.raises(QueryError) as refusal:
            ask()
        assert refusal.value.field == "reserve_soc_frac"
        assert refusal.value.allowed == "0..0.5 (soc_frac)"
        assert str(reserve) in str(refusal.value)


@pytest.mark.parametrize(
    ("weights", "field"),
    [
        (Weights(0.0, 0.0, 0.0), "weights (mine)"),
        (Weights(math.nan, 0.0, 0.0), "weights.energy (mine)"),
        (Weights(1.0, -1e-9, 0.0), "weights.time (mine)"),
        (Weights(1.0, 0.0, math.inf), "weights.distance (mine)"),
        (Weights(-1.0, 1.0, 1.0), "weights.energy (mine)"),
    ],
)
def test_weights_out_of_range_are_refused(planner, weights, field):
    with pytest.raises(QueryError) as refusal:
        planner.route(query(*ENDS, weightings=(("eco", ECO), ("mine", weights))))
    assert refusal.value.field == field
    assert "allowed" in str(refusal.value)


def test_query_without_weightings_is_refused(planner):
    with pytest.raises(QueryError, match="weightings"):
        planner.route(query(*ENDS, weightings=()))


@pytest.mark.parametrize("band", [0.05, 0.61, -0.1, math.nan])
def test_bands_outside_reserve_and_charge_are_refused(planner, band):
    with pytest.raises(QueryError) as refusal:
        planner.range(RangeQuery(ENDS[0], 0.6, car(), 0.1, (0.3, band)))
    assert refusal.value.field == "bands_soc_frac"
    assert refusal.value.value is band
    assert refusal.value.allowed == "0.1 (reserve_soc_frac)..0.6 (soc_frac)"


OUTSIDE = Point(45.0, 8.005)
FAR = Point(SOUTH + 0.03, WEST)


def test_points_outside_the_map_are_refused_by_their_field(planner):
    inside = ENDS[0]
    for field, ask in (
        ("start", lambda: planner.route(query(OUTSIDE, inside))),
        ("goal", lambda: planner.route(query(inside, OUTSIDE))),
        ("origin", lambda: planner.range(RangeQuery(OUTSIDE, 0.5, car()))),
    ):
        with pytest.raises(PointOutsideMapError) as refusal:
            ask()
        assert refusal.value.field == field
        assert (refusal.value.lat, refusal.value.lon) == (45.0, 8.005)


def test_points_far_from_any_road_are_refused_by_their_field(planner):
    inside = ENDS[0]
    for field, ask in (
        ("start", lambda: planner.route(query(FAR, inside))),
        ("goal", lambda: planner.route(query(inside, FAR))),
        ("origin", lambda: planner.range(RangeQuery(FAR, 0.5, car()))),
    ):
        with pytest.raises(PointFarFromRoadError) as refusal:
            ask()
        assert refusal.value.field == field
        assert refusal.value.distance_m > refusal.value.limit_m == 1000.0


def whole(planner: Planner, *links: tuple[int, int]) -> list[LinkSpan]:
    idx = [link_of(planner, a, b) for a, b in links]
    return [LinkSpan(link, 0.0, float(planner.graph.length_m[link])) for link in idx]


def refused(planner: Planner, spans: list[LinkSpan]) -> LinkError:
    with pytest.raises(LinkError) as refusal:
        planner.simulate(tuple(spans), car())
    return refusal.value


def test_simulation_of_links_in_the_wrong_order_is_refused_at_the_turn(planner):
    error = refused(planner, whole(planner, (0, 1), (2, 3), (1, 2)))
    assert (error.field, error.position) == ("id", 1)
    assert f"follow link {link_of(planner, 0, 1)}" in error.allowed


def test_simulation_of_a_u_turn_on_the_road_is_refused(planner):
    error = refused(planner, whole(planner, (0, 1), (1, 2), (2, 1)))
    assert (error.field, error.position) == ("id", 2)


@pytest.mark.parametrize("link", [-1, 8, 2**31 - 1])
def test_simulation_of_an_unknown_link_is_refused(planner, link):
    error = refused(planner, [*whole(planner, (0, 1)), LinkSpan(link, 0.0, 1.0)])
    assert (error.field, error.position, error.value, error.allowed) == ("id", 1, link, "0..7")


@pytest.mark.parametrize("stretch", [(0.0, 0.5), (0.5, 1.0)])
def test_simulation_with_a_gap_between_links_is_refused(planner, stretch):
    first, second = whole(planner, (0, 1), (1, 2))
    if stretch == (0.0, 0.5):
        spans = [replace(first, to_m=0.5 * first.to_m), second]
    else:
        spans = [first, replace(second, from_m=0.5 * second.to_m)]
    error = refused(planner, spans)
    assert (error.field, error.position) == (("to_m", 0) if stretch == (0.0, 0.5) else ("from_m", 1))
    assert "no gap" in error.allowed


@pytest.mark.parametrize(
    ("from_m", "to_m"), [(-1.0, 10.0), (10.0, 10.0), (10.0, 5.0), (0.0, 1e6), (math.nan, 10.0), (0.0, math.nan)]
)
def test_simulation_of_a_stretch_that_leaves_its_link_is_refused(planner, from_m, to_m):
    error = refused(planner, [LinkSpan(link_of(planner, 1, 2), from_m, to_m)])
    assert (error.field, error.position) == ("from_m" if math.isnan(from_m) or from_m < 0.0 else "to_m", 0)


def test_simulation_of_nothing_is_refused(planner):
    assert refused(planner, []).allowed == "at least one link"


def test_simulation_in_parts_of_one_link_each_adds_distance_up(planner):
    spans = whole(planner, (0, 1), (1, 2), (2, 4), (4, 1), (1, 0), (0, 1))
    result = planner.simulate(tuple(spans), car())
    assert result.distance_m == pytest.approx(sum(span.to_m for span in spans), rel=1e-12)
    assert sum(link.energy_j for link in result.links) == pytest.approx(result.energy_j, rel=1e-12)


def test_limit_in_the_wet_holds_on_wet_roads_alone():
    plain = street_map()
    slow = np.flatnonzero((plain.tail == 1) & (plain.head == 2))
    always = {"days": np.array([EVERY_DAY]), "begin_min": np.array([0]), "end_min": np.array([1440])}
    limits = ConditionalLimits(link=slow, limit_mps=np.array([20.0 / 3.6]), wet=np.array([True]), **always)
    planner = Planner(replace(plain, conditional=limits))
    kmh, duration_s = {}, {}
    for road in RoadSurface:
        (route,) = planner.route(query(along(0, 1, 0.5), along(2, 3, 0.5), conditions=Conditions(road=road))).routes
        kmh[road] = [round(link.speed_limit_mps * 3.6) for link in route.links]
        duration_s[road] = route.duration_s
    assert kmh == {RoadSurface.DRY: [50, 50, 50], RoadSurface.WET: [50, 20, 50], RoadSurface.SNOW: [50, 50, 50]}
    (evening,) = planner.route(
        query(along(0, 1, 0.5), along(2, 3, 0.5), conditions=Conditions(departure_min=1200))
    ).routes
    assert evening.duration_s == duration_s[RoadSurface.DRY]
    # some 760 m at 20 instead of 50 km/h
    assert duration_s[RoadSurface.WET] - duration_s[RoadSurface.DRY] == pytest.approx(
        0.76 * 3600 * (1 / 20 - 1 / 50), abs=10
    )


def test_limit_at_hours_holds_at_a_departure_within_them():
    plain = street_map()
    slow = np.flatnonzero((plain.tail == 1) & (plain.head == 2))
    workdays = {"days": np.array([0b0011111]), "begin_min": np.array([420]), "end_min": np.array([1020])}
    limits = ConditionalLimits(link=slow, limit_mps=np.array([20.0 / 3.6]), wet=np.array([False]), **workdays)
    planner = Planner(replace(plain, conditional=limits))
    for departure_min, kmh in ((None, 50), (8 * 60, 20), (17 * 60, 50), (5 * 1440 + 8 * 60, 50)):
        driven_in = Conditions(departure_min=departure_min)
        (route,) = planner.route(query(along(0, 1, 0.5), along(2, 3, 0.5), conditions=driven_in)).routes
        assert round(route.links[1].speed_limit_mps * 3.6) == kmh


def test_departure_outside_the_week_is_refused():
    with pytest.raises(ConditionsError, match="departure_min"):
        Conditions(departure_min=7 * 1440)
