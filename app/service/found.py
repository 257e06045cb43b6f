"""Routes as they were found, for answers in other forms than the service's own."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from app.conversions.route import asked_places
from routing.guidance.steps import steps_of

if TYPE_CHECKING:
    from app.conversions.charging.plans import PlannedStops
    from app.schemas.route import RouteRequest
    from routing.graph.road_graph import RoadGraph
    from routing.guidance.step import Step
    from routing.route.route import Route, RouteAnswer


@dataclass(frozen=True, slots=True)
class FoundRoutes:
    """What a route request is answered with, before it is written.

    request: as understood. planned: charging stops, None where none were asked for.
    """

    answer: RouteAnswer
    request: RouteRequest
    graph: RoadGraph
    planned: PlannedStops | None

    def steps(self, route: Route, language: str = "") -> tuple[Step, ...]:
        """What a driver is told on one of the routes; language: in which roads are named, where the map has that."""
        return steps_of(self.graph, route, asked=asked_places(self.request), language=language)
