"""Charging stops from Python: the same plans as over HTTP, frozen, and ready for the map."""

from __future__ import annotations

import math
import pickle
from dataclasses import replace
from datetime import UTC, datetime
from typing import TYPE_CHECKING, Any, cast

import pytest

import joulepath
from app.schemas.route import RouteRequest
from app.schemas.vehicles.vehicle import InlineVehicle
from app.service.service import Service
from energy.errors import VehicleError
from joulepath import Charging, Graph, Stay, Vehicle
from routing.charging.sites import usable_sites
from routing.errors import QueryError
from routing.stations.names import StationNames
from tests.app.charged import CAR, LOW, ROUTE, charged_settings

if TYPE_CHECKING:
    from app.schemas.route import RouteResponse

START, GOAL = (46.5, 8.003), (46.518, 8.02)


@pytest.fixture(scope="module")
def service(tmp_path_factory: pytest.TempPathFactory) -> Service:
    return Service(charged_settings(tmp_path_factory.mktemp("graphs")))


@pytest.fixture(scope="module")
def grid(service: Service) -> Graph:
    return Graph.load(service.settings.graph_dirs[0] / "grid")


@pytest.fixture(scope="module")
def small(service: Service) -> Vehicle:
    return Vehicle(service.fleet.from_sent(InlineVehicle.model_validate(CAR))[0])


def answered(service: Service, charging: dict[str, Any], **change: object) -> RouteResponse:
    return service.route(RouteRequest.model_validate(ROUTE | {"charging": charging} | change))


def test_stations_come_with_the_graph(grid: Graph) -> None:
    assert grid.station_count == 4
    assert {station.id for station in grid.stations.stations} == {"osm:n1", "osm:n2", "ocm:3", "ocm:4"}


def test_plan_is_that_of_http(service: Service, grid: Graph, small: Vehicle) -> None:
    sent = {
        "overhead_s": 60.0,
        "goal_soc": 0.3,
        "arrive_soc": 0.02,
        "objective": "cost",
        "networks": {"avoided": ["Ionity"]},
        "alternatives": 1,
    }
    answer = answered(service, sent, via=[{"lat": 46.51, "lon": 8.01}])
    routes = joulepath.route(
        grid,
        small,
        start=START,
        goal=GOAL,
        via=[(46.51, 8.01)],
        soc_frac=LOW,
        charging=Charging(
            overhead_s=60.0,
            goal_soc_frac=0.3,
            arrive_soc_frac=0.02,
            objective="cost",
            avoided_networks=("ionity",),
            alternatives=1,
        ),
    )
    assert [route.name for route in routes] == [route.name for route in answer.routes]
    for route, told in zip(routes, answer.routes, strict=True):
        assert route.charging is not None
        assert told.charging is not None
        assert (route.total_s, route.duration_s, route.soc_end_frac) == (told.total_s, told.duration_s, told.soc_end)
        assert route.charging.objective == told.charging.objective_value
        assert route.charging.total_s == told.charging.totals.total_s
        assert route.charging.waiting_s == told.charging.totals.waiting_s
        assert len(route.charging.halts) == len(told.charging.halts)
        assert [leg.ends_at for leg in route.legs] == [leg.ends_at.value for leg in told.legs]
        for stop, there in zip(route.charging.stops, told.charging.stops, strict=True):
            assert there.station is not None
            assert (stop.station, stop.leg) == (there.station.id, there.leg)
            assert (stop.soc_arrive_frac, stop.soc_depart_frac) == (there.arrive_soc, there.depart_soc)
            assert (stop.charged_kwh, stop.drawn_kwh) == (there.charged_kwh, there.drawn_kwh)
            assert (stop.arrive_s, stop.depart_s) == (there.arrive_s, there.depart_s)
            assert (stop.overhead_s, stop.waiting_s) == (there.overhead_s, there.waiting_s)
            assert stop.__geo_interface__["geometry"]["type"] == "Point"
    assert any(route.charging is not None and route.charging.stops for route in routes)
    assert pickle.loads(pickle.dumps(routes))[0].charging == routes[0].charging


def test_opening_hours_count_from_the_departure_that_is_given_and_by_its_season(
    service: Service, grid: Graph, small: Vehicle
) -> None:
    slow: dict[str, Any] = {"stations": ("osm:n1",), "goal_soc_frac": 0.3, "arrive_soc_frac": 0.02, "overhead_s": 60.0}
    early = datetime(2026, 11, 30, 7, 50, 30)
    places: dict[str, Any] = {"start": START, "goal": GOAL, "soc_frac": LOW}
    by_charging = joulepath.route(grid, small, **places, charging=Charging(**slow, departure=early))
    by_conditions = joulepath.route(
        grid, small, **places, charging=Charging(**slow), conditions=joulepath.Conditions(departure=early)
    )
    assert by_charging[0].charging == by_conditions[0].charging
    assert by_charging[0].charging is not None
    (stop,) = by_charging[0].charging.stops
    assert stop.arrive_s + stop.waiting_s == pytest.approx(570.0)  # at 8:00
    sent = {"stations": ["osm:n1"], "departure_time": early.isoformat(), "overhead_s": 60.0, "arrive_soc": 0.02}
    (there,) = answered(service, sent | {"goal_soc": 0.3}).routes
    assert there.charging is not None
    assert there.charging.stops[0].waiting_s == stop.waiting_s
    summer = tuple(
        replace(station, opening_hours="Apr-Oct 00:00-24:00; Nov-Mar off") for station in grid.stations.stations
    )
    names = StationNames("grid", replace(grid.stations, stations=summer))
    vehicle = small.model.charging
    assert vehicle is not None
    (asked, given) = (Charging(departure=early).in_si(vehicle, names, other) for other in (None, early))
    assert asked == given
    assert asked.departure == early
    assert usable_sites(vehicle, asked, summer) == []
    july = replace(asked, departure=datetime(2026, 7, 6, 7, 50))
    assert usable_sites(vehicle, july, summer)


def test_no_plan_says_why(grid: Graph, small: Vehicle) -> None:
    routes = joulepath.route(grid, small, start=START, goal=GOAL, soc_frac=0.2, charging=Charging(goal_soc_frac=0.9))
    assert routes.no_plan is not None
    assert routes.no_plan.missing_kwh > 0.0
    assert [each.kind for each in routes.no_plan.helps] == ["max_soc"]
    assert routes.no_plan.helps[0].value == 1.0
    (route,) = routes
    assert (route.feasible, route.charging) == (False, None)


def test_stays_are_stops_without_a_station(grid: Graph, small: Vehicle) -> None:
    stays = (Stay(0, 3.0, 11.0), Stay("goal", 60.0))
    charging = Charging(stays=stays, arrive_soc_frac=0.02, goal_soc_frac=0.02)
    (route,) = joulepath.route(
        grid, small, start=START, goal=GOAL, via=[(46.518, 8.0)], soc_frac=LOW, charging=charging
    )
    assert route.charging is not None
    assert [stop.place for stop in route.charging.stops if stop.station == ""] == [None]


@pytest.mark.parametrize(
    ("charging", "said"),
    [
        (Charging(stations=("n2",)), r"charging.stations\[0\] is n2, .*did you mean 'osm:n2'"),
        (Charging(connectors=("schuko",)), r"charging.connectors\[0\] is 'schuko', allowed: type1"),
        (Charging(connectors=("ccs2", "CCS-2")), r"charging.connectors\[1\] is 'CCS-2', .*did you mean 'ccs2'\?"),
        (Charging(objective="fame"), "charging.objective is 'fame', allowed: time, energy, cost"),
        (Charging(avoided_networks=("Ionitty",)), r"charging.avoided_networks\[0\] is Ionitty"),
        (Charging(arrive_soc_frac=0.9), "charging.max_soc_frac is 0.8, allowed: above 0.9"),
        (Charging(stays=(Stay("home", 5.0),)), r"charging.stays\[0\].at is 'home'"),
        (Charging(stays=(Stay(3, 5.0),)), "charging.stays.via_idx is 3"),
        (
            Charging(departure=cast("datetime", "8:15")),
            "charging.departure is .8:15., allowed: a datetime, local",
        ),
        (Charging(departure=datetime(2026, 1, 1, tzinfo=UTC)), r"charging.departure is 2026-01-01T00:00:00\+00:00"),
        (Charging(connectors=cast("Any", "ccs2")), "charging.connectors is 'ccs2', allowed: several in a tuple"),
        (Charging(stays=(Stay("goal", cast("Any", "60")),)), r"charging.stays\[0\].minutes is '60', allowed: a number"),
        (Charging(stays=(Stay("goal", math.nan),)), r"charging.stays\[0\].minutes is nan, allowed: above 0"),
        (Charging(stays=cast("Any", [("goal", 60)])), r"charging.stays\[0\] is .*, allowed: a joulepath.Stay"),
        (Charging(speed_caps_kmh=cast("Any", ("x",))), r"charging.speed_caps_kmh\[0\] is 'x', allowed: a number"),
        (Charging(speed_caps_kmh=(5.0,)), r"charging.speed_caps_kmh\[0\] is 5.0, allowed: 30..200"),
        (Charging(max_soc_frac=cast("Any", "a")), "charging.max_soc_frac is 'a', allowed: a number"),
        (Charging(preferred_factor=0.0), "charging.preferred_factor is 0.0, allowed: 0.1..1"),
        (Charging(most_stops=cast("Any", 2.5)), "charging.most_stops is 2.5, allowed: a whole number, 0..50"),
        (Charging(alternatives=-1), "charging.alternatives is -1, allowed: a whole number, 0..3"),
        (
            Charging(via_stations=cast("Any", ("osm:n2",))),
            r"charging.via_stations\[0\] is 'osm:n2', allowed: \(position",
        ),
        (Charging(min_power_kw=500.0), "charging.min_power_kw is 500.0, allowed: at most 150"),
    ],
)
def test_what_is_unknown_or_out_of_range_is_refused(grid: Graph, small: Vehicle, charging: Charging, said: str) -> None:
    with pytest.raises(QueryError, match=said):
        joulepath.route(grid, small, start=START, goal=GOAL, soc_frac=LOW, charging=charging)


def test_stops_exclude_other_weightings_and_need_a_vehicle_that_charges(grid: Graph, small: Vehicle) -> None:
    places: dict[str, Any] = {"start": START, "goal": GOAL, "soc_frac": LOW, "charging": Charging()}
    with pytest.raises(QueryError, match="charging is sent with alternatives"):
        joulepath.route(grid, small, **places, alternatives=("fastest",))
    with pytest.raises(QueryError, match="stops is counted"):
        joulepath.route(grid, small, **places, stops="counted")
    with pytest.raises(VehicleError, match="charging of vehicle 'toyota-corolla-petrol' is None"):
        joulepath.route(grid, Vehicle.load("toyota-corolla-petrol"), **places)
