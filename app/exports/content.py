"""What files are written of: routes and areas that were found, with the request that they answer."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from energy.units import JOULE_PER_KWH, METRE_PER_KM, SECOND_PER_MINUTE

if TYPE_CHECKING:
    from app.conversions.charging.plans import PlannedStops
    from app.schemas.range import RangeRequest
    from app.schemas.route import RouteRequest
    from routing.charging.plan import Plan
    from routing.graph.road_graph import RoadGraph
    from routing.range.bands import RangeAnswer
    from routing.route.route import Route, RouteAnswer


@dataclass(frozen=True, slots=True)
class RouteContent:
    """An answered route request."""

    answer: RouteAnswer
    understood: RouteRequest
    graph: RoadGraph
    planned: PlannedStops | None

    @property
    def plans(self) -> list[Plan | None]:
        """The charging stops of each route, None where it has none planned."""
        if self.planned is None or not self.planned.plans:
            return [None] * len(self.answer.routes)
        return list(self.planned.plans)


@dataclass(frozen=True, slots=True)
class RangeContent:
    """An answered range request."""

    answer: RangeAnswer
    understood: RangeRequest
    graph: RoadGraph


def summary_of(route: Route) -> str:
    """The figures of a route in words."""
    total_min = (route.duration_s + route.stop_s) / SECOND_PER_MINUTE
    text = (
        f"{route.distance_m / METRE_PER_KM:.1f} km, {total_min:.0f} min, {route.energy_j / JOULE_PER_KWH:.2f} kWh, "
        f"charge {100.0 * route.soc_start_frac:.0f} % to {100.0 * route.soc_end_frac:.0f} %"
    )
    return text if route.feasible else f"{text}; beyond the charge by {route.deficit_j / JOULE_PER_KWH:.2f} kWh"


def data_note(graph: RoadGraph) -> str:
    """Whose data an answer rests on."""
    meta = graph.meta
    parts = (meta.attribution or meta.source, meta.licence, f"heights {meta.terrain.value}")
    return "; ".join(part for part in parts if part)
