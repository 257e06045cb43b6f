"""From where a charge suffices for a drive to a place, and for one there and back, held against forward searches."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from energy.chain.chain import LinkModel, StopRule
from energy.conditions import STILL, Conditions, RoadSurface
from energy.stops import StopSettings
from energy.vehicle.coefficients import EffectCoefficients
from routing.errors import SearchLimitError
from routing.places import LinkPosition
from routing.range.way_back import BackCharges, ReverseSearch
from routing.route.limits import charge_limits
from routing.search.found import Limits
from routing.search.search import find_path, reach
from routing.search.space import search_space
from routing.search.workspaces import WorkspacePool
from routing.weights import ECO
from tests.routing.search.test_exact import SPEEDS, cheapest_by_enumeration, graph_of, maps, vehicle, vehicles

TOLERANCE_J = 40.0  # 0.01 Wh: two drives that differ by 1 mm/s count as met
CAPACITY_J = 1e6
MANY_LABELS = 1_000_000

stop_rules = st.sampled_from([StopRule.EXPECTED, StopRule.NONE, StopRule.CROSSINGS])
charges = st.sampled_from([(0.3, 0.0), (0.7, 0.25), (0.95, 0.05), (1.0, 0.0)])  # soc, reserve
capacities = st.sampled_from([1e5, 3e5, CAPACITY_J])
weathers = st.sampled_from(
    [
        Conditions(wind_speed_mps=8.0, wind_from_rad=1.0, payload_kg=300.0),
        Conditions(ambient_k=258.0),
        Conditions(ambient_k=310.0, cabin_start_k=330.0, road=RoadSurface.WET),
        Conditions(regen_limited=True),
        Conditions(regen_limited=True, ambient_k=268.0, road=RoadSurface.SNOW),
    ]
)
strengths = st.sampled_from(
    [
        EffectCoefficients(),
        EffectCoefficients(tyre_warm_up_frac=0.4, tyre_time_s=90.0),
        EffectCoefficients(battery_resistance_ohm=0.2, drive_loss_w_per_n2=3e-4, regen_cap_w=15_000.0),
    ]
)


def place_on(graph, link, share):
    """A place on a road, as a position on each of its directions."""
    length = float(graph.length_m[link])
    twin = int(graph.reverse_idx[link])
    here = [LinkPosition(link, share * length)]
    return here if twin < 0 else [*here, LinkPosition(twin, (1.0 - share) * length)]


def departures(graph, node):
    """From rest at a node, in any direction."""
    return [LinkPosition(link, 0.0) for link in np.flatnonzero(graph.tail == node).tolist()]


def levels(soc, reserve, capacity):
    return BackCharges(
        soc_j=soc * capacity,
        reserve_j=reserve * capacity,
        full_j=capacity,
        left_j=tuple((reserve + share * (soc - reserve)) * capacity for share in (0.0, 0.3, 0.8)),
    )


def most_left_j(graph, space, node, goal, soc, reserve, capacity):
    """Charge left at the goal by the exact forward search from a node, −inf where it is out of reach."""
    limits = charge_limits(soc, reserve, capacity)
    path, _ = find_path(space, WorkspacePool(graph.link_count), ECO, limits, departures(graph, node), goal)
    return -math.inf if path is None else soc * capacity - path.energy_j


def drawn(graph, car, rule, charge, capacity, sky, data):
    """The space, the goal, the charges and both answers of a map."""
    soc, reserve = charge
    space = search_space(graph, car, LinkModel.INTEGRATED, rule, StopSettings(), sky)
    goal = place_on(graph, data.draw(st.integers(0, graph.link_count - 1)), data.draw(st.sampled_from((0.1, 0.6))))
    asked = levels(soc, reserve, capacity)
    back, _ = ReverseSearch(graph, MANY_LABELS).way_back(space, goal).reverse(asked)
    limits = charge_limits(soc, reserve, capacity)
    out = reach(space, WorkspacePool(graph.link_count), limits, goal, graph.head, graph.node_count)
    both, _ = ReverseSearch(graph, MANY_LABELS).way_back(space, goal).round_trip(asked, out)
    return space, goal, asked, back, out, both


@settings(max_examples=90, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(maps(nodes=6), vehicles, stop_rules, charges, capacities, st.data())
def test_reverse_bands_on_small_maps_are_those_of_forward_searches(graph, car, rule, charge, capacity, data):
    space, goal, asked, back, _, _ = drawn(graph, car, rule, charge, capacity, STILL, data)
    for node in range(graph.node_count):
        most_j = most_left_j(graph, space, node, goal, *charge, capacity)
        answered_j = asked.soc_j - back.node_energy_j[node]
        assert answered_j <= most_j + TOLERANCE_J
        for band in asked.left_j:
            if abs(most_j - band) > TOLERANCE_J:
                assert (answered_j >= band) == (most_j >= band)


def test_reverse_keeps_a_way_that_is_faster_than_the_label_it_shares():
    # 0 → 1 falls by 5 m, 1 → 2 climbs 64 %; from 5 the climb is entered at 30 km/h and takes more than there is. Who
    # comes from 0 is faster by less than 1 m/s, which is enough for the 8 m to the goal
    streets = [(0, 1, 34.5, 50.0), (1, 2, 84.0, 50.0), (1, 3, 3.0, 10.0), (1, 4, 3.0, 10.0), (2, 3, 84.0, 10.0)]
    streets += [(3, 4, 3.0, 10.0), (4, 5, 3.0, 10.0), (5, 0, 10.5, 30.0), (5, 1, 3.0, 30.0)]
    links = [(tail, head, length_m, limit_kmh / 3.6, 0) for tail, head, length_m, limit_kmh in streets]
    graph = graph_of(links, [5.0, 0.0, 54.0, 0.0, 0.0, 0.0])
    space = search_space(graph, vehicle(recuperation_eff=0.0), LinkModel.INTEGRATED, StopRule.NONE, StopSettings())
    goal = [LinkPosition(1, 8.4)]
    most_j = most_left_j(graph, space, 0, goal, 0.3, 0.0, 1e5)
    back, _ = ReverseSearch(graph, MANY_LABELS).way_back(space, goal).reverse(levels(0.3, 0.0, 1e5))
    assert most_j > 0.0
    assert 3e4 - back.node_energy_j[0] == pytest.approx(most_j, abs=TOLERANCE_J)


@settings(max_examples=70, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(maps(nodes=6), vehicles, stop_rules, charges, capacities, st.data())
def test_round_trip_bands_on_small_maps_are_those_of_driving_there_and_back(graph, car, rule, charge, capacity, data):
    space, goal, asked, _, out, both = drawn(graph, car, rule, charge, capacity, STILL, data)
    for node in range(graph.node_count):
        answered_j = asked.soc_j - both.node_energy_j[node]
        arrival = charge[0] - out.node_energy_j[node] / capacity
        if not math.isfinite(arrival):
            assert answered_j == -math.inf
            continue
        most_j = most_left_j(graph, space, node, goal, arrival, charge[1], capacity)
        for band in asked.left_j:
            if abs(most_j - band) > TOLERANCE_J:
                assert (answered_j >= band) == (most_j >= band)


@settings(max_examples=90, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(maps(nodes=6), vehicles, strengths, weathers, stop_rules, charges, capacities, st.data())
def test_reverse_in_any_weather_never_promises_more_than_a_forward_search_finds(
    graph, car, strength, sky, rule, charge, capacity, data
):
    car = replace(car, effects=strength)
    space, goal, asked, back, out, both = drawn(graph, car, rule, charge, capacity, sky, data)
    for node in range(graph.node_count):
        most_j = most_left_j(graph, space, node, goal, *charge, capacity)
        assert asked.soc_j - back.node_energy_j[node] <= most_j + TOLERANCE_J
        arrival = charge[0] - out.node_energy_j[node] / capacity
        if math.isfinite(both.node_energy_j[node]):
            most_j = most_left_j(graph, space, node, goal, arrival, charge[1], capacity)
            assert asked.soc_j - both.node_energy_j[node] <= most_j + TOLERANCE_J


@settings(max_examples=20, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(maps(), vehicles, st.sampled_from([StopRule.EXPECTED, StopRule.NONE]), st.data())
def test_reverse_on_small_maps_takes_no_more_than_any_way_where_no_limit_acts(graph, car, rule, data):
    charge = (0.7, 0.1)
    space, goal, _, back, _, _ = drawn(graph, car, rule, charge, CAPACITY_J, STILL, data)
    for node in range(graph.node_count):
        least, free = (
            min(
                cheapest_by_enumeration(graph, space, ECO, limits, start, end, 8)
                for start in departures(graph, node)
                for end in goal
            )
            for limits in (charge_limits(*charge, CAPACITY_J), Limits())
        )
        if least > free + 1e-9:
            continue  # a full battery or the reserve acts: of such places the bands alone are told
        # ways of more links than were enumerated may take less; that none takes less than is told, exact searches show
        assert back.node_energy_j[node] / 3.6e6 <= least + 1e-5


def straight(heights, reserve_frac=0.0, soc_frac=0.5, **changes):
    """A two-way road over nodes 700 m apart, and the energy from each to a place at its first node."""
    pairs = [(k, k + 1) for k in range(len(heights) - 1)]
    links = [(a, b, 700.0, SPEEDS[2], 0) for pair in pairs for a, b in (pair, pair[::-1])]
    graph = graph_of(links, heights)
    space = search_space(graph, vehicle(**changes), LinkModel.INTEGRATED, StopRule.NONE, StopSettings())
    goal = place_on(graph, int(np.flatnonzero((graph.tail == 0) & (graph.head == 1))[0]), 1e-4)
    asked = BackCharges(soc_frac * CAPACITY_J, reserve_frac * CAPACITY_J, CAPACITY_J, (reserve_frac * CAPACITY_J,))
    back = ReverseSearch(graph, MANY_LABELS).way_back(space, goal)
    return graph, back, asked


def test_reverse_over_a_pass_needs_the_charge_for_its_top_although_the_way_gains() -> None:
    # up to the pass 1800 kg · 9.81 m/s² · 15 m / 0.9 = 0.29 MJ, the speed of 50 km/h 0.19 MJ, rolling 0.09 MJ and more
    _, back, asked = straight([0.0, 30.0, 60.0, 75.0, 60.0], soc_frac=0.9)
    enough, _ = back.reverse(asked)
    short, _ = back.reverse(replace(asked, soc_j=0.5 * CAPACITY_J))
    assert enough.node_energy_j[4] < 0.5 * CAPACITY_J
    assert enough.node_energy_j[3] < 0.0
    assert short.node_energy_j[3] < 0.0
    assert math.isinf(short.node_energy_j[4])


def test_reverse_downhill_with_a_full_battery_leaves_no_more_than_full() -> None:
    _, back, asked = straight([0.0, 60.0, 120.0, 180.0], soc_frac=1.0)
    energies, _ = back.reverse(asked)
    assert energies.node_energy_j[3] >= 0.0


def test_reverse_of_a_road_in_part_begins_where_the_charge_suffices() -> None:
    graph, back, asked = straight([0.0] * 8, soc_frac=1.0)
    whole, _ = back.reverse(asked)
    edge = float(whole.node_energy_j[3])
    less = replace(asked, soc_j=edge + 0.5 * (float(whole.node_energy_j[4]) - edge))
    part, _ = back.reverse(less)
    towards = int(np.flatnonzero((graph.tail == 4) & (graph.head == 3))[0])
    assert math.isinf(part.node_energy_j[4])
    assert 0.0 < part.from_m[towards] < graph.length_m[towards]
    assert part.to_m[towards] == graph.length_m[towards]


def test_round_trip_of_a_road_in_part_ends_where_one_must_turn() -> None:
    graph, back, asked = straight([0.0] * 8)
    space = back._space
    goal = [LinkPosition(int(link), float(x)) for link, x in zip(back._goal.link, back._goal.offset_m, strict=True)]

    def there_and_back(soc_j):
        limits = charge_limits(soc_j / CAPACITY_J, 0.0, CAPACITY_J)
        out = reach(space, WorkspacePool(graph.link_count), limits, goal, graph.head, graph.node_count)
        return back.round_trip(replace(asked, soc_j=soc_j), out)[0]

    whole = there_and_back(CAPACITY_J)
    edge, beyond = float(whole.node_energy_j[1]), float(whole.node_energy_j[2])
    assert beyond < CAPACITY_J
    part = there_and_back(0.5 * (edge + beyond))
    away = int(np.flatnonzero((graph.tail == 1) & (graph.head == 2))[0])
    assert math.isinf(part.node_energy_j[2])
    assert 0.0 < part.to_m[away] < graph.length_m[away]
    # driving on and coming back take the same on the flat, so that half of the charge turns half-way
    assert part.to_m[away] == pytest.approx(0.5 * graph.length_m[away], rel=0.1)


def test_reverse_where_no_link_may_follow_the_last_one_is_that_of_all_others() -> None:
    graph, back, asked = straight([0.0] * 4)
    whole, _ = back.reverse(asked)
    first = np.minimum(graph.successor_first, graph.successor_first[-2])
    blocked = replace(graph, successor_first=first, successor=graph.successor[: first[-1]])
    space = search_space(blocked, vehicle(), LinkModel.INTEGRATED, StopRule.NONE, StopSettings())
    without_turns, _ = ReverseSearch(blocked, MANY_LABELS).way_back(space, place_on(blocked, 0, 1e-4)).reverse(asked)
    assert (blocked.tail[-1], blocked.head[-1]) == (3, 2)
    assert math.isinf(without_turns.node_energy_j[3])
    assert without_turns.node_energy_j[:3].tolist() == whole.node_energy_j[:3].tolist()


def test_reverse_beyond_the_label_limit_raises_search_limit_error() -> None:
    graph, back, asked = straight([0.0] * 8)
    few = ReverseSearch(graph, 3).way_back(back._space, place_on(graph, 0, 0.5))
    with pytest.raises(SearchLimitError, match="allowed: at most 3"):
        few.reverse(asked)
