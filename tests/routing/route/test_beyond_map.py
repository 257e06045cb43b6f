"""Routes that may be beaten by a way over roads that the map cuts off."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from energy.vehicle.files import load_vehicles
from routing.graph.earth import great_circle_m
from routing.graph.rim import MapRim, map_rim
from routing.places import Point
from routing.planner import Planner
from routing.queries import ParetoSettings, RouteQuery
from routing.route.beyond_map import beyond_map_m
from tests.routing.drawn_streets import SOUTH, STEP, WEST, drawn_streets

KONA = load_vehicles(Path(__file__).resolve().parents[3] / "data/vehicles")["hyundai-kona-64"]
# 1   2 ... the map cuts both roads north of these; between them the way is 8 steps to the south and back
# |   |
# 0 - 3 (9 steps below 1 and 2)
DEEP = 9.0


@pytest.fixture(scope="module")
def horseshoe() -> Planner:
    places = [(0.0, 0.0), (0.0, DEEP), (2.0, DEEP), (2.0, 0.0)]
    streets = [(0, 1), (0, 3), (3, 2)]
    links = [*streets, *((b, a) for a, b in streets)]
    graph = drawn_streets(
        "horseshoe",
        places,
        links,
        np.zeros(4),
        speed_limit_mps=np.full(len(links), 50.0 / 3.6),
        cross=np.zeros(len(links), np.int64),
    )
    return Planner(graph)


def at(east: float, north: float) -> Point:
    return Point(SOUTH + north * STEP / 1e7, WEST + east * STEP / 1e7)


def warned(planner: Planner, start: Point, goal: Point, **changes) -> list[str]:
    answer = planner.route(RouteQuery(start, goal, 0.9, KONA, **changes))
    return [warning for warning in answer.warnings if "leave this map" in warning]


def test_route_round_a_horseshoe_warns_that_the_way_over_its_open_end_may_be_shorter(horseshoe):
    (warning,) = warned(horseshoe, at(0.0, 7.0), at(2.0, 7.0))
    assert "route 'eco'" in warning
    # 2 steps up, 2 across at 69 % of a step's length, and 2 down
    least_km = float(warning.split("could have ")[1].split(" km")[0])
    assert least_km == pytest.approx((4.0 + 2.0 * np.cos(np.radians(46.0))) * STEP / 1e7 * 111.195, abs=0.1)


def test_route_that_is_shorter_than_any_way_over_the_rim_is_not_doubted(horseshoe):
    assert warned(horseshoe, at(0.0, 2.0), at(2.0, 2.0)) == []
    assert warned(horseshoe, at(0.0, 8.5), at(0.0, 6.0)) == []


def test_leg_between_via_points_is_doubted_on_its_own(horseshoe):
    assert len(warned(horseshoe, at(0.0, 2.0), at(2.0, 2.0), via=(at(0.0, 8.0), at(2.0, 8.0)))) == 1
    assert warned(horseshoe, at(0.0, 7.0), at(2.0, 7.0), via=(at(1.0, 0.0),)) == []


def test_pareto_set_is_doubted_as_a_single_route_is(horseshoe):
    assert len(warned(horseshoe, at(0.0, 7.0), at(2.0, 7.0), pareto=ParetoSettings())) == 1


def test_way_over_the_rim_leaves_and_comes_back_at_different_roads(horseshoe):
    graph, rim = horseshoe.graph, map_rim(horseshoe.graph)
    assert rim.node.sum() == 2
    end = at(0.0, DEEP)
    assert beyond_map_m(graph, rim, end, end, 1e9) == pytest.approx(
        2.0 * 2.0 * np.cos(np.radians(SOUTH + DEEP * STEP / 1e7)) * STEP / 1e7 * 111_195.0, rel=1e-3
    )
    assert beyond_map_m(graph, rim, end, end, 1000.0) == np.inf


def test_way_beyond_the_map_is_the_least_over_all_pairs_of_many_cut_roads(horseshoe: Planner) -> None:
    rng = np.random.default_rng(5)
    graph = horseshoe.graph
    places = rng.uniform((50.0, 8.0), (50.6, 8.6), (400, 2))
    many = replace(graph, node_lat_deg=places[:, 0].copy(), node_lon_deg=places[:, 1].copy())
    rim = MapRim(np.ones(400, np.bool_), np.ones(graph.link_count, np.bool_))
    for a, b in rng.integers(0, 400, (8, 2)):
        start, goal = (Point(*places[k] + 0.05) for k in (a, b))
        out_m = great_circle_m(start.lat_deg, start.lon_deg, places[:, 0], places[:, 1])
        back_m = great_circle_m(goal.lat_deg, goal.lon_deg, places[:, 0], places[:, 1])
        between_m = great_circle_m(places[:, :1], places[:, 1:], places[:, 0], places[:, 1])
        np.fill_diagonal(between_m, np.inf)
        least_m = float((out_m[:, None] + between_m + back_m).min())
        assert beyond_map_m(many, rim, start, goal, 1e9) == pytest.approx(least_m)
