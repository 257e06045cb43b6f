"""OSRM's nearest service: the roads nearest to a place."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from app.http.faces.answering import whole_from
from app.http.faces.electric import range_request
from app.http.faces.osrm.errors import OsrmCode, OsrmError
from app.http.faces.osrm.waypoints import waypoint
from app.service.roads import roads_near

if TYPE_CHECKING:
    from app.http.faces.electric import Electric
    from app.http.faces.osrm.asked import OsrmRequest
    from app.service.service import Service

OPTIONS: Final = frozenset({"number"})
MOST: Final = 100


def asked_nearest(asked: OsrmRequest) -> int:
    """How many roads are asked for; refuses options that can't be heeded."""
    asked.check_options(OPTIONS)
    text = asked.options.get("number", "1")
    number = whole_from(text)
    if number is None or number < 1:
        raise OsrmError(OsrmCode.INVALID_QUERY, "number", text[:200], f"1..{MOST}")
    if number > MOST:
        raise OsrmError(OsrmCode.TOO_BIG, "number", text, f"1..{MOST}")
    return number


def nearest_answer(asked: OsrmRequest, electric: Electric, number: int, service: Service) -> dict[str, object]:
    """The nearest roads, and their nodes, as OSRM answers them."""
    roads = roads_near(service, range_request(asked.places[0], electric), number)
    asked.check_moved([roads[0].place.distance_m])
    written: dict[str, object] = {"code": "Ok"}
    if not asked.flag("skip_waypoints"):
        written["waypoints"] = [{"nodes": list(road.nodes), **waypoint(road.place)} for road in roads]
    return written
