"""Halts at which nothing is charged, as they are answered: over HTTP, as GeoJSON and from Python the same."""

from __future__ import annotations

import json
from dataclasses import replace
from typing import TYPE_CHECKING

import pytest

from app.conversions.charging.plans import PlannedStops
from app.conversions.lean.colours import MARKERS
from app.conversions.route import route_features_json, route_response
from app.schemas.route import RouteFeatureCollection, RouteRequest
from joulepath.charging import plan_of
from routing.charging.plan import PlanStats
from routing.charging.route import route_of_plan
from routing.links.spans import ChainMaker
from routing.places import Point, SnappedPoint
from routing.route.route import RouteAnswer
from routing.stations.names import StationNames
from routing.stations.station import Stations, StationSource
from tests.routing.charging.worlds import drawn_world

if TYPE_CHECKING:
    from routing.charging.plan import Plan
    from routing.route.route import Route
    from tests.routing.charging.worlds import World

HERE = Point(46.0, 8.0)
SOURCE = StationSource("drawn", "drawn at random", "CC0-1.0")
PLACE = {"lat": 46.0, "lon": 8.0}
UNDERSTOOD = RouteRequest.model_validate(
    {
        "start": PLACE,
        "goal": PLACE,
        "soc": 0.5,
        "vehicle": "drawn",
        "graph": "drawn",
        "charging": {"departure_time": "2026-11-30T08:15", "objective": "energy"},
    }
)


@pytest.fixture(scope="module")
def halted() -> tuple[World, Plan, Route]:
    """A world whose best plan halts at two stations."""
    world = drawn_world(1070)
    world = replace(world, stations=tuple(replace(station, source="drawn") for station in world.stations))
    answer = world.planner().plan(world.query, world.charging, world.vehicle_charging, world.stations, world.places)
    (plan,) = answer.plans
    start = SnappedPoint(HERE, HERE, 0.0, 0, 0.0, "")
    return world, plan, route_of_plan(ChainMaker(world.graph), world.query, plan, start, world.places[1:-1])


def test_halts_are_told_like_stops_but_apart_from_them(halted: tuple[World, Plan, Route]) -> None:
    world, plan, route = halted
    at = SnappedPoint(HERE, HERE, 0.0, 0, 0.0, "")
    answer = RouteAnswer((route,), at, at, (), (), tuple(at for _ in world.query.via))
    planned = PlannedStops((plan,), None, PlanStats(0, 0, 0, 0, 0.0), {"drawn": SOURCE})
    (found,) = route_response(answer, UNDERSTOOD, world.graph, planned).routes
    assert found.charging is not None
    assert [halt.station.id for halt in found.charging.halts] == ["s0", "s1"]
    for halt, inside in zip(found.charging.halts, plan.halts, strict=True):
        assert (halt.arrive_s, halt.soc, halt.along_m) == (inside.arrive_s, inside.soc_frac, inside.along_m)
        assert halt.depart_s - halt.arrive_s == pytest.approx(halt.overhead_s)
        assert (halt.waiting_s, halt.link_id) == (0.0, inside.position.link_idx)
        assert halt.arrive_time is not None
        assert found.legs[halt.leg].from_m <= halt.along_m <= found.legs[halt.leg].to_m + 1e-6
    assert [source.key for source in found.charging.sources] == ["drawn"]
    assert found.charging.totals.waiting_s == 0.0
    features = RouteFeatureCollection.model_validate_json(
        route_features_json(answer, UNDERSTOOD.model_copy(update={"compact": False}), world.graph, planned)
    ).model_dump(mode="json", by_alias=True)["features"]
    points = [feature for feature in features if feature["properties"].get("kind") == "halt"]
    kept = [halt.model_dump(mode="json") for halt in found.charging.halts]
    assert [point["properties"] for point in points] == [
        {**halt, "kind": "halt", "route": "best", "marker-color": MARKERS["halt"]} for halt in kept
    ]
    assert [point["geometry"]["coordinates"] for point in points] == [
        [halt["at"]["lon"], halt["at"]["lat"]] for halt in kept
    ]


def test_halts_from_python_are_those_of_http(halted: tuple[World, Plan, Route]) -> None:
    world, plan, route = halted
    names = StationNames("drawn", Stations(world.stations, (SOURCE,), {}))
    found = plan_of(plan, route, names, world.charging.objective)
    assert [(halt.station, halt.soc_frac) for halt in found.halts] == [
        (halt.station.id, halt.soc_frac) for halt in plan.halts
    ]
    assert found.waiting_s == 0.0
    assert found.sources == ("drawn at random (CC0-1.0)",)
    shown = json.loads(json.dumps(found.halts[0].__geo_interface__))
    assert shown["geometry"]["type"] == "Point"
    assert shown["properties"]["overhead_s"] == plan.halts[0].overhead_s
