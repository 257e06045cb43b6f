"""Errors that the routing package raises, with their facts as attributes."""

from __future__ import annotations


class RoutingError(Exception):
    """Root of what the routing package raises."""


class GraphNotFoundError(RoutingError):
    """No graph of that name or path is there."""

    def __init__(self, name: str, known: tuple[str, ...]) -> None:
        self.name = name
        self.known = known
        super().__init__(f"graph {name!r} is unknown, known: {', '.join(known) or 'none'}")


class GraphFormatError(RoutingError):
    """A stored graph that can't be read: another format version, a missing or damaged array."""

    def __init__(self, path: str, field: str, value: object, allowed: str) -> None:
        self.path = path
        self.field = field
        self.value = value
        self.allowed = allowed
        super().__init__(f"{field} of graph {path} is {value}, allowed: {allowed}")


class ImportFailedError(RoutingError):
    """Outside map or elevation data that can't be turned into a graph."""

    def __init__(self, field: str, value: object, reason: str) -> None:
        self.field = field
        self.value = value
        self.reason = reason
        super().__init__(f"{field} {value}: {reason}")


class PointOutsideMapError(RoutingError):
    """A coordinate outside the bounding box of the graph."""

    def __init__(self, field: str, lat: float, lon: float, bbox: tuple[float, float, float, float]) -> None:
        self.field = field
        self.lat = lat
        self.lon = lon
        self.bbox = bbox
        west, south, east, north = bbox
        super().__init__(
            f"{field} (lat {lat:g}, lon {lon:g}) is outside the map, "
            f"allowed: lat {south:g}..{north:g}, lon {west:g}..{east:g}"
        )


class PointFarFromRoadError(RoutingError):
    """A coordinate whose nearest drivable road is too far away."""

    def __init__(self, field: str, lat: float, lon: float, distance_m: float, limit_m: float) -> None:
        self.field = field
        self.lat = lat
        self.lon = lon
        self.distance_m = distance_m
        self.limit_m = limit_m
        super().__init__(
            f"{field} (lat {lat:g}, lon {lon:g}) is {distance_m:.0f} m from the nearest road, "
            f"allowed: at most {limit_m:.0f} m"
        )


class QueryError(RoutingError):
    """A query value out of range: names field, value and range."""

    def __init__(self, field: str, value: object, allowed: str) -> None:
        self.field = field
        self.value = value
        self.allowed = allowed
        super().__init__(f"{field} is {value}, allowed: {allowed}")


class NoPathError(RoutingError):
    """The goal can't be reached by any road, whatever the charge."""


class NegativeCycleError(RoutingError):
    """A drive that gains energy on a cycle, so that no cheapest route exists.

    least_load_n: the least road load on any link [N]. Where it is negative that is the cause, else the printed model.
    """

    def __init__(self, link_idx: int, least_load_n: float = 0.0) -> None:
        self.link_idx = link_idx
        self.least_load_n = least_load_n
        if least_load_n < 0.0:
            gains = f"the road load, {least_load_n:.1f} N at its least under these conditions,"
            remedy = "choose conditions in which it is at least 0 N"
        else:
            gains, remedy = "the link model", "use link_model 'integrated', which conserves energy"
        super().__init__(f"{gains} gains energy on a cycle through link {link_idx}: no cheapest route exists; {remedy}")


class SearchLimitError(RoutingError):
    """The search needed more labels than allowed."""

    def __init__(self, labels: int, limit: int) -> None:
        self.labels = labels
        self.limit = limit
        super().__init__(f"the search needed {labels} labels, allowed: at most {limit}")
