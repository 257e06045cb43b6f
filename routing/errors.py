"""Errors that the routing package raises, with their facts as attributes."""

from __future__ import annotations

from energy.errors import Refusal


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


class GraphFormatError(Refusal, RoutingError):
    """A stored graph that can't be read: another format version, a missing or damaged array."""

    def __init__(self, path: str, field: str, value: object, allowed: str) -> None:
        self.path = path
        super().__init__(field, value, allowed, subject=f"{field} of graph {path}")


class ImportFailedError(RoutingError):
    """Outside map or elevation data that can't be turned into a graph."""

    def __init__(self, field: str, value: object, reason: str) -> None:
        self.field = field
        self.value = value
        self.reason = reason
        super().__init__(f"{field} {value}: {reason}")


class PointOutsideMapError(Refusal, RoutingError):
    """A coordinate outside the bounding box of the graph."""

    code = "point_outside_map"

    def __init__(self, field: str, lat: float, lon: float, bbox: tuple[float, float, float, float]) -> None:
        self.lat = lat
        self.lon = lon
        self.bbox = bbox
        west, south, east, north = bbox
        allowed = f"lat {south:g}..{north:g}, lon {west:g}..{east:g}"
        super().__init__(
            field,
            {"lat": lat, "lon": lon},
            allowed,
            message=f"{field} (lat {lat:g}, lon {lon:g}) is outside the map, allowed: {allowed}",
        )


class PointFarFromRoadError(Refusal, RoutingError):
    """A coordinate whose nearest drivable road is too far away."""

    code = "point_far_from_road"

    def __init__(self, field: str, lat: float, lon: float, distance_m: float, limit_m: float) -> None:
        self.lat = lat
        self.lon = lon
        self.distance_m = distance_m
        self.limit_m = limit_m
        super().__init__(
            field,
            {"lat": lat, "lon": lon},
            f"at most {limit_m:g} m from a road, this is {distance_m:.0f} m",
            message=(
                f"{field} (lat {lat:g}, lon {lon:g}) is {distance_m:.0f} m from the nearest road, "
                f"allowed: at most {limit_m:.0f} m"
            ),
        )


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
            refused = ("conditions", f"road load of {least_load_n:.1f} N", "a road load of at least 0 N")
            gains = f"the road load, {least_load_n:.1f} N at its least under these conditions,"
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
