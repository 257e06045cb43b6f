"""Matrices: every entry is what the route of its pair answers alone, whatever the other places."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from energy.chain.chain import LinkModel, StopRule
from energy.conditions import STILL, Conditions
from energy.stops import StopSettings
from energy.vehicle.files import load_vehicles
from routing.errors import NoPathError, PointFarFromRoadError, PointOutsideMapError, QueryError
from routing.graph.road_graph import RoadGraph
from routing.places import Point
from routing.planner import Planner
from routing.queries import MatrixQuery, RouteQuery
from routing.route.matrix import MatrixRow, NotDriven
from routing.search.found import Limits
from routing.search.search import find_path, find_paths, reach
from routing.weights import BALANCED, ECO, FASTEST, Weights
from tests.routing.drawn_streets import SOUTH, STEP, WEST, drawn_streets

if TYPE_CHECKING:
    from collections.abc import Sequence

    from routing.places import LinkPosition
    from routing.route.matrix import MatrixEntry
    from routing.route.route import Route

SIDE = 5
SHUT = 0  # a street that no turn leads into
CARS = load_vehicles(Path(__file__).resolve().parents[3] / "data" / "vehicles")
KONA = CARS["hyundai-kona-64"]
CITY_CAR = replace(KONA, usable_capacity_wh=4000.0)
SMALL = replace(KONA, usable_capacity_wh=1500.0)
TABLE = replace(CARS["example-tomtom-table"], usable_capacity_wh=2000.0)
FADING = Conditions(ambient_k=268.15, regen_limited=True)
ANYWHERE = st.tuples(st.integers(0, SIDE * (SIDE - 1) * 2 - 1), st.floats(0.02, 0.98))


def hilly_grid() -> RoadGraph:
    """Streets both ways between 25 nodes, of many limits, and hills of up to 300 m; one of them is shut."""
    rng = np.random.default_rng(11)
    places = [(k % SIDE, k // SIDE) for k in range(SIDE * SIDE)]
    n = len(LINKS)
    graph = drawn_streets(
        "grid",
        places,
        LINKS,
        rng.uniform(400.0, 700.0, len(places)),
        detour=rng.uniform(1.0, 1.4, n),
        speed_limit_mps=rng.choice([30.0, 50.0, 80.0, 120.0], n) / 3.6,
        cross=rng.integers(0, 4, n),
    )
    into_shut = np.isin(graph.way_id[graph.successor], (2 * SHUT, 2 * SHUT + 1))
    first = np.concatenate(([0], np.cumsum(~into_shut)))[graph.successor_first]
    return replace(graph, successor_first=first, successor=graph.successor[~into_shut])


STREETS = [(k, k + 1) for k in range(SIDE * SIDE) if k % SIDE < SIDE - 1] + [
    (k, k + SIDE) for k in range(SIDE * (SIDE - 1))
]
LINKS = [pair for a, b in STREETS for pair in ((a, b), (b, a))]


@pytest.fixture(scope="module")
def planner() -> Planner:
    return Planner(hilly_grid())


def along(street: int, share: float) -> Point:
    """A place on a street between two nodes."""
    a, b = STREETS[street]
    east = (a % SIDE) + share * ((b % SIDE) - (a % SIDE))
    north = (a // SIDE) + share * ((b // SIDE) - (a // SIDE))
    return Point(SOUTH + north * STEP / 1e7, WEST + east * STEP / 1e7)


def rows_of(planner: Planner, query: MatrixQuery) -> list[MatrixRow]:
    work = planner.matrix(query)
    return [work.row(idx) for idx in range(work.row_count)]


def route_alone(planner: Planner, query: MatrixQuery, start: Point, goal: Point) -> Route | None:
    """The route of one pair, None without any."""
    alone = RouteQuery(
        start,
        goal,
        query.soc_frac,
        query.vehicle,
        query.reserve_soc_frac,
        (("asked", query.weights),),
        query.link_model,
        query.stop_rule,
        query.stop_settings,
        query.conditions,
    )
    try:
        return planner.route(alone).routes[0]
    except NoPathError:
        return None


def check_entry(entry: MatrixEntry, route: Route | None) -> None:
    if route is None:
        assert entry.reason is NotDriven.NO_PATH
        return
    assert entry.reason is (None if route.feasible else NotDriven.CHARGE)
    figures = (entry.energy_j, entry.duration_s, entry.distance_m, entry.soc_end_frac, entry.soc_min_frac)
    expected = (route.energy_j, route.duration_s, route.distance_m, route.soc_end_frac, route.soc_min_frac)
    assert figures == pytest.approx(expected, rel=1e-9, abs=1e-9)
    assert entry.deficit_j == pytest.approx(route.deficit_j, rel=1e-9, abs=1e-6)


def check_against_routes(planner: Planner, query: MatrixQuery) -> list[MatrixRow]:
    rows = rows_of(planner, query)
    for row, start in zip(rows, query.sources, strict=True):
        for entry, goal in zip(row.entries, query.targets, strict=True):
            check_entry(entry, route_alone(planner, query, start, goal))
    return rows


weightings = st.sampled_from([ECO, Weights(3.0), FASTEST, BALANCED, Weights(1.0, 2.0, 0.5), Weights(distance=1.0)])


@settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    st.lists(ANYWHERE, min_size=1, max_size=2),
    st.lists(ANYWHERE, min_size=1, max_size=5),
    weightings,
    st.floats(0.02, 1.0),
    st.floats(0.0, 0.5),
    st.sampled_from([KONA, SMALL, TABLE]),
    st.sampled_from(list(StopRule)),
    st.sampled_from([STILL, Conditions(ambient_k=263.15, payload_kg=200.0)]),
)
def test_every_entry_equals_the_route_of_its_pair(planner, sources, targets, weights, soc, spare, car, rule, weather):
    places = [tuple(along(*place) for place in side) for side in (sources, targets)]
    weather = STILL if car is TABLE else weather
    query = MatrixQuery(*places, soc, car, spare * soc, weights, stop_rule=rule, conditions=weather)
    check_against_routes(planner, query)


@pytest.mark.parametrize("weights", [ECO, Weights(1.0, 3.0)])
@pytest.mark.parametrize(("soc", "weather"), [(1.0, STILL), (0.97, FADING)])
def test_entries_from_a_nearly_full_battery_equal_their_routes(planner, weights, soc, weather) -> None:
    """Here, some best ways without limits waste what the battery refuses, and others are better with them."""
    sources, targets = (tuple(along(street, 0.5) for street in streets) for streets in ((1, 2), (4, 8, 12, 13, 16, 18)))
    query = MatrixQuery(sources, targets, soc, KONA, 0.0, weights, conditions=weather)
    rows = check_against_routes(planner, query)
    assert (sum(row.alone for row in rows) > 0) == (weights != ECO)


@pytest.mark.parametrize("weights", [ECO, FASTEST])
def test_entries_by_the_printed_equations_equal_their_routes(planner, weights) -> None:
    places = tuple(along(street, 0.6) for street in (SHUT, 9, 22, 31))
    query = MatrixQuery(places, places, 0.6, KONA, 0.0, weights, LinkModel.PRINTED)
    check_against_routes(planner, query)


def between_least_and_fastest(planner: Planner) -> MatrixQuery:
    """Fastest drives on a charge that the fastest way to the first target is too much for, but not the least energy."""
    sources, targets = (along(1, 0.3),), tuple(along(street, 0.5) for street in (39, 2, 19, 30, 36))
    query = MatrixQuery(sources, targets, 1.0, CITY_CAR, 0.1)
    least, fastest = (
        rows_of(planner, replace(query, weights=weights))[0].entries[0].soc_min_frac for weights in (ECO, FASTEST)
    )
    assert least > fastest + 0.02
    return replace(query, soc_frac=1.1 - 0.5 * (least + fastest), weights=FASTEST)


def test_entry_whose_fastest_way_takes_too_much_is_searched_alone(planner) -> None:
    (row,) = check_against_routes(planner, between_least_and_fastest(planner))
    assert row.alone > 0
    assert row.entries[0].reason is None


def test_entry_near_the_limits_that_is_not_proven_best_is_counted_and_told(planner) -> None:
    hasty = Planner(planner.graph)
    hasty._search.pareto_limit = 1
    work = hasty.matrix(between_least_and_fastest(planner))
    row = work.row(0)
    assert 0 < row.unproven <= row.alone
    assert row.short_by > 0.0
    assert f"{row.unproven} of 5 entries are good but not proven best" in work.answer([row]).warnings[-1]


def test_entry_into_a_shut_street_says_so_and_one_beyond_the_charge_what_is_missing(planner) -> None:
    sources, targets = (along(4, 0.5), along(SHUT, 0.5)), (along(SHUT, 0.5), along(39, 0.5))
    query = MatrixQuery(sources, targets, 0.02, KONA, 0.01)
    (into_shut, far), (stay, out_of_shut) = (row.entries for row in rows_of(planner, query))
    assert into_shut.reason is NotDriven.NO_PATH
    assert (into_shut.energy_j, into_shut.deficit_j) == (0.0, 0.0)
    assert stay.reason is None
    assert (stay.energy_j, stay.distance_m, stay.soc_end_frac) == (0.0, 0.0, 0.02)
    for entry in (far, out_of_shut):
        assert entry.reason is NotDriven.CHARGE
        missing_frac = 0.01 - entry.soc_min_frac
        assert entry.deficit_j == pytest.approx(missing_frac * KONA.usable_capacity_wh * 3600.0)


def test_targets_on_one_link_in_any_order_and_twice_are_told_apart(planner) -> None:
    shares = (0.7, 0.2, 0.7, 0.700001, 0.2000001)
    sources, targets = (along(5, 0.5), along(30, 0.5)), tuple(along(5, share) for share in shares)
    rows = check_against_routes(planner, MatrixQuery(sources, targets, 0.8, KONA))
    for row in rows:
        assert row.entries[0] == row.entries[2]
        assert len({entry.distance_m for entry in row.entries}) == 4


def positions(planner: Planner, places: Sequence[Point]) -> list[tuple[LinkPosition, ...]]:
    return [planner._roads.snap("place", place, 100.0)[1] for place in places]


def test_search_for_near_targets_ends_before_it_has_seen_the_map(planner) -> None:
    space = planner._search.space(KONA, LinkModel.INTEGRATED, StopRule.EXPECTED, StopSettings())
    (start, *goals) = positions(planner, (along(1, 0.5), along(1, 0.6), along(1, 0.7)))
    pool, graph = planner._search.pool, planner.graph
    _, near = find_paths(space, pool, ECO, Limits(), start, goals)
    everything = reach(space, pool, Limits(), start, graph.head, graph.node_count).counts
    assert near.labels_settled < 0.2 * everything.labels_settled


@pytest.mark.nojit
@pytest.mark.parametrize("weights", [ECO, FASTEST])
def test_one_search_for_all_finds_the_very_paths_of_single_searches(planner, weights) -> None:
    space = planner._search.space(KONA, LinkModel.INTEGRATED, StopRule.EXPECTED, StopSettings())
    (start, *goals) = positions(planner, [along(street, 0.35) for street in (6, 3, 11, 20, 33, 38, SHUT)])
    paths, _ = find_paths(space, planner._search.pool, weights, Limits(), start, goals)
    single = [find_path(space, planner._search.pool, weights, Limits(), start, goal)[0] for goal in goals]
    assert paths == single
    assert [path is None for path in paths] == [False] * 5 + [True]


def test_place_that_can_not_be_snapped_is_named_by_its_list_and_number(planner) -> None:
    here, there = along(0, 0.5), along(7, 0.5)
    with pytest.raises(PointOutsideMapError, match=r"^sources\[2\] \(lat 60, lon 8\)"):
        planner.matrix(MatrixQuery((here, there, Point(60.0, 8.0)), (here,), 0.5, KONA))
    middle = Point(SOUTH + 0.5 * STEP / 1e7, WEST + 0.5 * STEP / 1e7)
    strict = Planner(planner.graph, snap_limit_m=100.0)
    with pytest.raises(PointFarFromRoadError, match=r"^targets\[1\] "):
        strict.matrix(MatrixQuery((here,), (there, middle), 0.5, KONA))


@pytest.mark.parametrize(
    ("changes", "named"),
    [
        ({"sources": ()}, "sources is empty, allowed: at least one place"),
        ({"targets": ()}, "targets is empty"),
        ({"soc_frac": 1.2}, "soc_frac is 1.2, allowed: 0..1"),
        ({"reserve_soc_frac": 0.6}, "reserve_soc_frac is 0.6, allowed: 0..0.5"),
        ({"weights": Weights(0.0)}, "at least one above 0"),
    ],
)
def test_query_out_of_range_is_refused(planner, changes, named) -> None:
    here = (along(0, 0.5),)
    with pytest.raises(QueryError, match=named.replace(".", r"\.")):
        planner.matrix(replace(MatrixQuery(here, here, 0.5, KONA), **changes))
