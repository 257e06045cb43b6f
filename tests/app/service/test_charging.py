"""Charging stops as a use case: what is kept between requests, and taken in anew with a graph."""

from __future__ import annotations

from typing import TYPE_CHECKING

from app.schemas.route import RouteRequest
from app.service.service import Service
from routing.graph.files import load_graph
from routing.stations.files import load_stations, save_stations
from routing.stations.station import Stations
from tests.app.charged import ROUTE, charged_settings

if TYPE_CHECKING:
    from pathlib import Path

    from app.schemas.route import RouteResponse


def asked(service: Service) -> RouteResponse:
    return service.route(RouteRequest.model_validate(ROUTE))


def test_ways_between_stations_are_kept_for_the_next_request_and_given_up_with_their_graph(tmp_path: Path) -> None:
    service = Service(charged_settings(tmp_path))
    first, second = asked(service), asked(service)
    assert first.planning is not None
    assert second.planning is not None
    assert first.planning.leg_searches > second.planning.leg_searches
    assert second.routes == first.routes
    budget = service.atlas.budget
    assert budget.held_bytes()["legs"] > 0
    service.atlas.planner("grid").forget()
    assert "legs" not in budget.held_bytes()
    assert asked(service).routes == first.routes


def test_a_plan_stops_at_the_stations_that_a_reload_has_brought(tmp_path: Path) -> None:
    settings = charged_settings(tmp_path)
    service = Service(settings)
    service.load_all()

    def stopped_at() -> list[str]:
        (route,) = asked(service).routes
        assert route.charging is not None
        return [stop.station.id for stop in route.charging.stops if stop.station is not None]

    (before,) = stopped_at()
    folder = tmp_path / "grid"
    grid = load_graph(folder)
    stations = load_stations(folder, grid)
    fewer = tuple(station for station in stations.stations if station.id != before)
    save_stations(folder, grid, Stations(fewer, stations.sources))
    assert service.reload_graphs().replaced == ["grid"]
    (after,) = stopped_at()
    assert after != before
