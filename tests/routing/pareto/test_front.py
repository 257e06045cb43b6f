"""The Pareto set of time and energy: what it claims holds for every way of a small map."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, assume, given, settings
from hypothesis import strategies as st

from energy.chain.chain import LinkModel, StopRule
from energy.chain.kernels_link import link_energy
from energy.conditions import STILL, Conditions
from energy.force.kernels_physics import accepted_j, cabin_energy_j, road_in_time
from energy.stops import StopSettings
from energy.units import JOULE_PER_WH
from energy.vehicle.files import load_vehicles
from routing.errors import NoPathError, QueryError
from routing.graph.files import load_graph
from routing.links.spans import ChainMaker
from routing.pareto import all_ways
from routing.pareto.all_ways import Cover, uncovered_ways
from routing.pareto.bounds import LowerBounds, Trade, chosen, undominated
from routing.pareto.front import ParetoSearch
from routing.places import LinkPosition, Point
from routing.planner import Planner
from routing.queries import ParetoSettings, RouteQuery
from routing.route.best_path import RouteSearch
from routing.route.limits import charge_limits
from routing.route.route import ParetoProof
from routing.search.found import Limits
from routing.search.space import search_space
from routing.weights import ECO, FASTEST, Weights
from tests.routing.search.test_exact import LEARNED, LOSSY, SPEEDS, WEATHER, graph_of, maps, rules, vehicle, vehicles

DATA = Path(__file__).resolve().parents[3] / "data"
KONA = load_vehicles(DATA / "vehicles")["hyundai-kona-64"]
HEIGHTS_M = st.floats(0.0, 60.0)
NOWHERE = Point(0.0, 0.0)
EVERYTHING = Limits()
MOST_LINKS = 7


def trades_by_enumeration(graph, space, limits, start, goal, most_links=MOST_LINKS):
    """Time and charge used of every way of at most most_links links that keeps the limits, driven link by link."""
    g, p = space.arrays, space.physics
    trades = []

    def drive(link, offset, v, stopped, energy, time, depth):
        limit = g.speed_limit_mps[link]
        p_stop, wait = g.stop_probability_frac[link], g.stop_time_s[link]

        def after(ds, target, stop, waiting):
            road = road_in_time(p, g.roads, link, time, ds / limit)
            e, t, end = link_energy(p, road, ds, v, stopped, limit, target, stop, waiting)
            e = accepted_j(p, energy, e + cabin_energy_j(p, time, time + t), limits.least_energy_j)
            return max(energy + e, limits.least_energy_j), time + t, end

        if link == goal.link_idx and goal.offset_m > offset:
            used, ended, _ = after(goal.offset_m - offset, limit, 1.0, 0.0)
            if used <= limits.most_energy_j:
                trades.append(Trade(ended, used))
        if depth == most_links:
            return
        for following in graph.successors(link).tolist():
            used, ended, end = after(g.length_m[link] - offset, g.speed_limit_mps[following], p_stop, wait)
            if used <= limits.most_energy_j:
                drive(following, 0.0, end, p_stop, used, ended, depth + 1)

    drive(start.link_idx, start.offset_m, 0.0, 0.0, 0.0, 0.0, 1)
    return trades


@st.composite
def ladders(draw):
    """Nodes in a row with two or three links from each to the next, and one back on which start and goal lie."""
    stages = draw(st.integers(2, 4))
    heights = [draw(HEIGHTS_M) for _ in range(stages + 1)]
    links = []
    for k in range(stages):
        for _ in range(draw(st.integers(2, 3))):
            length = draw(st.one_of(st.sampled_from((12.0, 80.0)), st.floats(200.0, 900.0))) + 1.5 * abs(
                heights[k] - heights[k + 1]
            )
            links.append((k, k + 1, length, draw(st.sampled_from(SPEEDS.tolist())), draw(st.integers(0, 3))))
    back_m = 400.0 + 1.5 * abs(heights[0] - heights[-1])
    links.append((stages, 0, back_m, SPEEDS[2], 0))
    graph = graph_of(links, heights)
    back = int(np.flatnonzero(graph.tail == stages)[0])
    return graph, LinkPosition(back, 0.4 * back_m), LinkPosition(back, 0.3 * back_m)


@st.composite
def drawn(draw):
    """A map with a start and a goal, each somewhere on a link."""
    if draw(st.integers(0, 3)) > 0:
        return draw(ladders())
    graph = draw(maps())
    links = [draw(st.integers(0, graph.link_count - 1)) for _ in range(2)]
    shares = draw(st.sampled_from((0.0, 0.4))), draw(st.sampled_from((0.7, 1.0)))
    return graph, *(LinkPosition(k, float(graph.length_m[k]) * share) for k, share in zip(links, shares, strict=True))


def front_of(graph, query, *places):
    search = RouteSearch(graph, ChainMaker(graph))
    try:
        return ParetoSearch(search, query, query.pareto, [(place,) for place in places]).front()
    except NoPathError:
        return None


def ask(car, soc=0.5, **changes):
    return replace(RouteQuery(NOWHERE, NOWHERE, soc, car, pareto=ParetoSettings()), **changes)


epsilons = st.sampled_from([0.001, 0.003, 0.01, 0.05])
charges = st.sampled_from([(0.9, 0.0), (1.0, 0.0), (0.8, 0.1), (0.98, 0.7), (0.5, 0.3), (0.5, 0.0)])


@settings(max_examples=120, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(
    drawn(),
    vehicles,
    rules,
    charges,
    st.sampled_from([STILL, *WEATHER]),
    st.sampled_from([None, LOSSY, *LEARNED]),
    epsilons,
    st.integers(2, 6),
)
def test_claim_holds_for_every_way_of_a_small_map(places, car, rule, charge, sky, effects, epsilon, most):
    car = car if effects is None else replace(car, effects=effects)
    graph, start, goal = places
    soc, reserve = charge
    asked = ask(car, soc, reserve_soc_frac=reserve, stop_rule=rule, conditions=sky)
    query = replace(asked, pareto=ParetoSettings(epsilon, most))
    front = front_of(graph, query, start, goal)
    assume(front is not None)
    claim = front.claim
    space = search_space(graph, car, LinkModel.INTEGRATED, rule, StopSettings(), sky)
    limits = charge_limits(soc, reserve, car.usable_capacity_wh * JOULE_PER_WH)
    every = trades_by_enumeration(graph, space, limits, start, goal)
    if claim.epsilon_frac is None:
        assert claim.unproven
        return
    assert len(front.ways) <= most
    assert all(way.kept for way in front.ways)
    trades = [way.trade for way in front.ways]
    assert undominated(trades) == list(range(len(trades)))
    assert claim.slack_j == pytest.approx(claim.epsilon_frac * claim.reference_j)
    for way in every:
        late_s, more_j = way.time_s * (1.0 + claim.epsilon_frac) + 1e-6, way.energy_j + claim.slack_j + 1e-2
        assert any(trade.time_s <= late_s and trade.energy_j <= more_j for trade in trades), (way, trades, claim)


@settings(max_examples=200, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(
    drawn(),
    vehicles,
    rules,
    st.sampled_from([STILL, *WEATHER]),
    st.booleans(),
    st.sampled_from([0.0, 0.01, 0.1]),
    st.sampled_from([0, 1, 2, 100]),
    st.data(),
)
def test_ways_compared_by_labels_cover_every_way_even_where_all_entries_share_states(
    places, car, rule, sky, lossy, epsilon, states_a_link, data
):
    car = replace(car, effects=LOSSY) if lossy else car
    graph, start, goal = places
    space = search_space(graph, car, LinkModel.INTEGRATED, rule, StopSettings(), sky)
    every = trades_by_enumeration(graph, space, EVERYTHING, start, goal)
    given_points = data.draw(st.lists(st.sampled_from(every), max_size=1)) if every else []
    slack_j = data.draw(st.sampled_from([0.0, 3e3]))
    longest_s = data.draw(st.sampled_from([math.inf, *(way.time_s for way in given_points)]))
    cover = Cover(tuple((way.time_s, way.energy_j) for way in given_points), epsilon, slack_j, longest_s)
    found = uncovered_ways(space, [start], [goal], cover, states_a_link=states_a_link)
    least = [*given_points, *(Trade(path.time_s, path.energy_j) for path in found.paths)]
    for way in every:
        late_s, more_j = way.time_s * (1.0 + epsilon) + 1e-6, way.energy_j + slack_j + 1e-2
        covered = any(trade.time_s <= late_s and trade.energy_j <= more_j for trade in least)
        assert covered or way.time_s > longest_s
    search = RouteSearch(graph, ChainMaker(graph))
    for path in found.paths:
        asked = ask(car, stop_rule=rule, conditions=sky)
        energy_j, time_s = search.link_energies(asked, search.spans(path), None)
        assert path.energy_j <= energy_j.sum() + 1e-2
        assert path.time_s <= time_s.sum() + 1e-6
        if found.shared == 0:
            assert (path.energy_j, path.time_s) == pytest.approx((energy_j.sum(), time_s.sum()), rel=1e-9, abs=1e-3)


def three_roads():
    """Three roads from a start to a goal on the plain: motorway, country road, and one of which half is motorway.

    The last is between the others in time and energy, but nearer to none of them than their mean by any weighting.
    """
    links = [
        (0, 1, 200.0, SPEEDS[3], 0),
        (1, 2, 2600.0, SPEEDS[4], 0),
        (2, 4, 2600.0, SPEEDS[4], 0),
        (1, 3, 2600.0, SPEEDS[3], 0),
        (3, 4, 2600.0, SPEEDS[3], 0),
        (1, 5, 2620.0, SPEEDS[4], 0),
        (5, 4, 2620.0, SPEEDS[3], 0),
        (4, 0, 4000.0, SPEEDS[3], 0),
    ]
    graph = graph_of(links, [0.0] * 6)
    back = int(np.flatnonzero(graph.tail == 4)[0])
    first = int(np.flatnonzero(graph.tail == 0)[0])
    return graph, LinkPosition(first, 0.0), LinkPosition(back, 300.0)


@pytest.mark.nojit
def test_route_that_no_weighting_is_best_in_is_found_by_comparing_all_ways():
    graph, start, goal = three_roads()
    asked = ask(vehicle(), stop_rule=StopRule.NONE)
    front = front_of(graph, replace(asked, pareto=ParetoSettings(0.005, 5)), start, goal)
    assert [way.weights for way in front.ways] == [FASTEST, None, ECO]
    assert front.claim.proof is ParetoProof.ALL_WAYS
    assert front.claim.epsilon_frac <= 0.005
    fastest, between, eco = (way.trade for way in front.ways)
    share = (between.time_s - fastest.time_s) / (eco.time_s - fastest.time_s)
    assert between.energy_j > fastest.energy_j + share * (eco.energy_j - fastest.energy_j)
    coarse = front_of(graph, replace(asked, pareto=ParetoSettings(0.5, 5)), start, goal)
    assert coarse.claim.proof is ParetoProof.WEIGHTINGS
    assert len(coarse.ways) == 2


@pytest.mark.nojit
def test_fewer_routes_than_needed_widen_the_claim_instead_of_breaking_it():
    graph, start, goal = three_roads()
    asked = ask(vehicle(), stop_rule=StopRule.NONE)
    narrow, wide = (front_of(graph, replace(asked, pareto=ParetoSettings(0.005, most)), start, goal) for most in (3, 2))
    assert [way.weights for way in wide.ways] == [FASTEST, ECO]
    assert wide.claim.found == narrow.claim.found == 3
    late, more = (
        wide.ways[-1].trade.time_s / narrow.ways[1].trade.time_s - 1.0,
        (wide.ways[0].trade.energy_j - narrow.ways[1].trade.energy_j) / wide.claim.reference_j,
    )
    assert min(late, more) - 1e-6 <= wide.claim.epsilon_frac <= min(late, more) + 0.005
    assert wide.claim.epsilon_frac > narrow.claim.epsilon_frac


@pytest.mark.nojit
def test_claim_refers_to_what_is_lost_on_the_way_where_the_route_downhill_gains_charge():
    graph, start, goal = three_roads()
    heights = np.where(np.isin(graph.node_id, [0, 1]), 900.0, np.where(graph.node_id == 4, 0.0, 450.0))
    downhill = replace(graph, node_height_m=heights)
    flat, steep = (front_of(g, ask(vehicle(), stop_rule=StopRule.NONE), start, goal) for g in (graph, downhill))
    assert steep.ways[-1].trade.energy_j < 0.0 < flat.ways[-1].trade.energy_j
    assert steep.claim.reference_j > 0.3 * flat.claim.reference_j
    assert steep.claim.slack_j > 0.0 or steep.claim.epsilon_frac == 0.0


def test_claim_is_not_made_where_it_cannot_be():
    graph, start, goal = three_roads()
    counted = front_of(graph, ask(vehicle(), stop_rule=StopRule.COUNTED), start, goal)
    printed = front_of(graph, ask(vehicle(), link_model=LinkModel.PRINTED), start, goal)
    beyond = front_of(graph, ask(vehicle(), soc=0.01), start, goal)
    cold = ask(replace(vehicle(), effects=LEARNED[0]), conditions=Conditions(ambient_k=263.0))
    over = front_of(graph, cold, start, LinkPosition(goal.link_idx, 100.0), goal)
    for front in (counted, printed, beyond, over):
        assert front.claim.epsilon_frac is front.claim.slack_j is None
        assert front.claim.proof is ParetoProof.NONE
    assert "counted" in counted.claim.unproven
    assert "printed" in printed.claim.unproven
    assert "reserve" in beyond.claim.unproven
    assert "warm up" in over.claim.unproven
    assert not beyond.ways[0].kept


def test_ways_are_compared_within_a_wider_epsilon_where_room_is_scarce(monkeypatch):
    graph, start, goal = three_roads()
    query = replace(ask(vehicle(), stop_rule=StopRule.NONE), pareto=ParetoSettings(0.001, 5))
    narrow = front_of(graph, query, start, goal)
    assert narrow.claim.found == 3
    monkeypatch.setattr(all_ways, "MOST_LABELS", 4)
    scarce = front_of(graph, query, start, goal)
    assert scarce.claim.found < narrow.claim.found
    assert scarce.claim.proof is ParetoProof.WEIGHTINGS
    assert scarce.claim.epsilon_frac > narrow.claim.epsilon_frac
    monkeypatch.setattr(all_ways, "MOST_STATES", -60)
    assert front_of(graph, query, start, goal).claim == scarce.claim


def test_steps_between_routes_are_as_wide_as_the_bounds_leave_open():
    bounds = LowerBounds()
    bounds.add_weighting(FASTEST, 100.0 / 3600.0)
    bounds.add_weighting(ECO, 2.0)
    fast, slow = Trade(100.0, 4 * 3.6e6), Trade(200.0, 2 * 3.6e6)
    most_j = 10 * 3.6e6
    assert bounds.gap([fast, slow], 2 * 3.6e6, most_j) == pytest.approx(1.0)  # to 100 s, or to 2 kWh less
    # of kWh + 0.02/s: both cost 6; corner (200/(1+ε), 4 − 2ε) costs 6 where 4 − 2ε + 4/(1+ε) = 6: ε = √2 − 1
    bounds.add_weighting(Weights(1.0, 72.0, 0.0), 6.0)
    assert bounds.gap([fast, slow], 2 * 3.6e6, most_j) == pytest.approx(math.sqrt(2.0) - 1.0)
    # with a way at 150 s and 3 kWh all others are known to be within 1 % and 0.01 kWh of one of the three
    bounds.add_cover([fast, Trade(150.0, 3 * 3.6e6), slow], 0.01, 0.01 * 3.6e6)
    between = [fast, Trade(150.0, 3 * 3.6e6), slow]
    assert bounds.gap(between, 2 * 3.6e6, most_j) == pytest.approx(0.01)
    assert bounds.gap([fast, slow], 2 * 3.6e6, most_j) == pytest.approx(1.01 * 200.0 / 150.0 - 1.0, rel=1e-6)


def test_choice_leaves_out_what_the_proof_needs_least():
    bounds = LowerBounds()
    front = [Trade(100.0 + 10.0 * k, (10.0 - k) * 1e6) for k in range(6)]
    bounds.add_cover(front, 0.0, 0.0)
    everything = chosen(bounds, front, 1e6, 1e9, 0.0, 10)
    assert everything == list(range(6))
    # one left out is covered by the next one: 10 s late of 100 s to 140 s, least where the way is longest
    assert chosen(bounds, front, 1e6, 1e9, 0.072, 10) == [0, 1, 2, 3, 5]
    assert len(chosen(bounds, front, 1e6, 1e9, 0.0, 3)) == 3
    assert chosen(bounds, front[:1], 1e6, 1e9, 0.0, 3) == [0]


def test_undominated_keeps_the_first_of_equal_ones():
    trades = [Trade(3.0, 1.0), Trade(1.0, 5.0), Trade(2.0, 5.0), Trade(1.0, 5.0), Trade(2.0, 2.0), Trade(4.0, 1.0)]
    assert undominated(trades) == [1, 4, 0]


@pytest.mark.parametrize(("field", "value"), [("epsilon_frac", 0.0), ("epsilon_frac", 0.6), ("most", 1), ("most", 51)])
def test_settings_out_of_range_are_refused_with_the_range(field, value):
    graph, _, _ = three_roads()
    query = replace(ask(vehicle()), pareto=replace(ParetoSettings(), **{field: value}))
    with pytest.raises(QueryError) as refused:
        Planner(graph).route(query)
    assert refused.value.field == f"pareto.{field}"


@pytest.fixture(scope="module")
def highlands() -> Planner:
    return Planner(load_graph(DATA / "graphs" / "highlands"))


@pytest.mark.parametrize("soc", [0.8, 1.0])
def test_pareto_set_on_highlands_covers_the_best_routes_of_many_weightings(highlands, soc):
    start, goal = Point(44.4401, -36.781), Point(44.2838, -36.2298)
    asked = RouteQuery(start, goal, soc, KONA, pareto=ParetoSettings(0.004, 20))
    answer = highlands.route(asked)
    claim = answer.pareto
    assert claim.epsilon_frac is not None
    assert answer.routes[-1].name == "eco"
    assert [route.duration_s for route in answer.routes] == sorted(route.duration_s for route in answer.routes)
    weightings = tuple((f"{k}", Weights(1.0, float(worth), 0.0)) for k, worth in enumerate(np.geomspace(0.1, 1e3, 9)))
    for other in highlands.route(replace(asked, pareto=None, weightings=weightings)).routes:
        assert any(
            route.duration_s <= other.duration_s * (1.0 + claim.epsilon_frac) + 1e-6
            and used_j(route) <= used_j(other) + claim.slack_j + 1.0
            for route in answer.routes
        )


def used_j(route) -> float:
    return float(route.energy_j + route.braked_away_j)


def test_pareto_set_over_a_via_point_rests_there_and_is_proven_by_weightings(highlands):
    start, via, goal = Point(44.4401, -36.781), Point(44.36, -36.5), Point(44.2838, -36.2298)
    asked = RouteQuery(start, goal, 0.9, KONA, via=(via,), pareto=ParetoSettings(0.05, 6))
    answer = highlands.route(asked)
    assert answer.pareto.proof is ParetoProof.WEIGHTINGS
    assert len(answer.routes) >= 2
    assert all(sum(link.rest for link in route.links) == 1 and len(route.legs) == 2 for route in answer.routes)
    (eco,) = highlands.route(replace(asked, pareto=None)).routes
    assert answer.routes[-1].energy_j == pytest.approx(eco.energy_j)
