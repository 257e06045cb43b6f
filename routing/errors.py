"""Errors that the routing package raises, with their facts as attributes."""

from __future__ import annotations

import math
from dataclasses import dataclass

from energy.errors import Refusal
from routing.numerals import text_above, text_below
from routing.places import degrees_text, place_text, swapped_question


class RoutingError(Exception):
    """Root of what the routing package raises."""


class GraphNotFoundError(Refusal, RoutingError):
    """No graph of that name or path is there."""

    code = "unknown_graph"

    def __init__(self, name: str, known: tuple[str, ...]) -> None:
        self.name = name
        self.known = known
        names = ", ".join(known)
        super().__init__(
            "graph", name, f"one of {names}", message=f"graph {name!r} is unknown, known: {names or 'none'}"
        )

    def __reduce__(self) -> tuple[type[GraphNotFoundError], tuple[object, ...]]:
        return type(self), (self.name, self.known)


class GraphFormatError(Refusal, RoutingError):
    """A stored graph that can't be read: another format version, a missing or damaged array."""

    def __init__(self, path: str, field: str, value: object, allowed: str) -> None:
        self.path = path
        super().__init__(field, value, allowed, subject=f"{field} of graph {path}")

    def __reduce__(self) -> tuple[type[GraphFormatError], tuple[object, ...]]:
        return type(self), (self.path, self.field, self.value, self.allowed)


class ImportFailedError(RoutingError):
    """Outside map or elevation data that can't be turned into a graph."""

    def __init__(self, field: str, value: object, reason: str) -> None:
        self.field = field
        self.value = value
        self.reason = reason
        super().__init__(f"{field} {value}: {reason}")


class PointOutsideMapError(Refusal, RoutingError):
    """A coordinate outside the bounding box of the graph, and farther from its roads than allowed.

    bbox: west, south, east, north [deg]. swapped: whether the place would lie inside, or as near as needed, with lat
    and lon exchanged. nearest: of the roads, None where it was not looked for. whose: the map is, such as "graph
    'highlands'". away_m: how far the place is from the bounding box [m].
    """

    code = "point_outside_map"

    def __init__(
        self,
        field: str,
        lat: float,
        lon: float,
        bbox: tuple[float, float, float, float],
        nearest: NearestRoad | None = None,
        *,
        whose: str = "",
        away_m: float = math.inf,
        swapped: bool = False,
    ) -> None:
        self.lat = lat
        self.lon = lon
        self.bbox = bbox
        self.nearest = nearest
        self.away_m = away_m
        west, south, east, north = bbox
        self.swapped = swapped or (south <= lon <= north and west <= lat <= east)
        allowed = _extent(lat, lon, bbox)
        of = f" of {whose}" if whose else ""
        away = f", {away_m / 1000.0:.0f} km away" if math.isfinite(away_m) and not self.swapped else ""
        road = away if nearest is None else f", {nearest.text()}"
        hint = swapped_question(lat, lon) if self.swapped else ""
        super().__init__(
            field,
            {"lat": lat, "lon": lon},
            allowed,
            message=f"{field} ({place_text(lat, lon)}) is outside the map{of}{road}, allowed: {allowed}{hint}",
        )


class PointFarFromRoadError(Refusal, RoutingError):
    """A coordinate whose nearest drivable road is too far away."""

    code = "point_far_from_road"

    def __init__(self, field: str, lat: float, lon: float, nearest: NearestRoad, limit_m: float) -> None:
        self.lat = lat
        self.lon = lon
        self.nearest = nearest
        self.distance_m = nearest.distance_m
        self.limit_m = limit_m
        super().__init__(
            field,
            {"lat": lat, "lon": lon},
            f"at most {limit_m:g} m from a road, this is {nearest.distance_text(limit_m)} m",
            message=f"{field} ({place_text(lat, lon)}) is {nearest.text(limit_m)}, allowed: at most {limit_m:g} m",
        )


@dataclass(frozen=True, slots=True)
class NearestRoad:
    """The road nearest to a place: how far away it is, its name or "", and where on it [deg]."""

    distance_m: float
    name: str
    lat: float
    lon: float

    def distance_text(self, limit_m: float = 0.0) -> str:
        """The distance [m] with as many decimals as tell it from a limit below it."""
        return text_above(self.distance_m, limit_m)

    def text(self, limit_m: float = 0.0) -> str:
        """How far the road is, its name and place."""
        name = f" {self.name!r}" if self.name else ""
        return f"{self.distance_text(limit_m)} m from the nearest road{name} at {place_text(self.lat, self.lon)}"


def _extent(lat: float, lon: float, bbox: tuple[float, float, float, float]) -> str:
    """A map's extent with as many decimals, 4 at least, as a place outside needs for not being shown inside."""
    west, south, east, north = bbox
    decimals, outside = 4, (south <= lat <= north, west <= lon <= east)
    while decimals < 16:
        shown = [round(x, decimals) for x in bbox]
        at_lat, at_lon = round(lat, max(decimals, 7)), round(lon, max(decimals, 7))
        if (shown[1] <= at_lat <= shown[3], shown[0] <= at_lon <= shown[2]) == outside:
            break
        decimals += 1
    west_text, south_text, east_text, north_text = (degrees_text(x, decimals) for x in bbox)
    return f"lat {south_text}..{north_text}, lon {west_text}..{east_text}"


class QueryError(Refusal, RoutingError):
    """A query value out of range."""

    code = "invalid_request"


class NoPathError(RoutingError):
    """The goal can't be reached by any road, whatever the charge."""


class NegativeCycleError(Refusal, RoutingError):
    """A drive that gains energy on a cycle, so that no cheapest route exists.

    least_load_n: the least road load on any link [N]. Where it is negative that is the cause, else the printed model.
    """

    code = "energy_gain"

    def __init__(self, link_idx: int, least_load_n: float = 0.0) -> None:
        self.link_idx = link_idx
        self.least_load_n = least_load_n
        if least_load_n < 0.0:
            below_0_n = text_below(least_load_n, 0.0, 1)
            refused = ("conditions", f"road load of {below_0_n} N", "a road load of at least 0 N")
            gains = f"the road load, {below_0_n} N at its least under these conditions,"
            remedy = "choose conditions in which it is at least 0 N"
        else:
            refused = ("link_model", "printed", "integrated")
            gains, remedy = "the link model", "use link_model 'integrated', which conserves energy"
        super().__init__(
            *refused,
            message=f"{gains} gains energy on a cycle through link {link_idx}: no cheapest route exists; {remedy}",
        )


class SearchLimitError(Refusal, RoutingError):
    """The search needed more labels than allowed."""

    code = "search_limit"

    def __init__(self, labels: int, limit: int) -> None:
        self.labels = labels
        self.limit = limit
        super().__init__(
            "",
            labels,
            f"at most {limit} labels",
            message=f"the search needed {labels} labels, allowed: at most {limit}",
        )


class TimeUpError(Refusal, RoutingError):
    """The time that a query may take is used up."""

    code = "time_limit"

    def __init__(self, limit_s: float) -> None:
        self.limit_s = limit_s
        remedy = "ask for a shorter route, less charge, fewer alternatives or places"
        super().__init__("", None, f"at most {limit_s:g} s", message=f"no answer within {limit_s:g} s; {remedy}")


class AbandonedError(RoutingError):
    """A query that was stopped because nobody waits for its answer any more."""

    def __init__(self) -> None:
        super().__init__("nobody waits for the answer any more")
