"""Errors of the app itself."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from starlette.exceptions import HTTPException

from energy.errors import LinkError, Refusal
from routing.places import place_text

if TYPE_CHECKING:
    from collections.abc import Sequence

    from app.schemas.places.named import PlaceOption
    from routing.places import Point


class OverloadedError(Refusal):
    """More is asked of the service than it can answer in time; retry_s: when to ask again [s]."""

    code = "overloaded"

    def __init__(self, retry_s: float) -> None:
        self.retry_s = max(1, math.ceil(retry_s))
        message = f"so many requests are waiting that this one would take too long; try again in {self.retry_s} s"
        super().__init__("", None, "fewer requests at a time", message=message)


class PlacesApartError(Refusal):
    """Places of one request that no graph holds together: each by its field, with the graphs that hold it."""

    code = "point_outside_map"

    def __init__(self, apart: tuple[str, Point, list[str]], other: tuple[str, Point, list[str]]) -> None:
        field, place, _ = apart
        texts = [
            f"{name} ({place_text(at.lat_deg, at.lon_deg)}) is on {_graphs_text(graphs)}"
            for name, at, graphs in (apart, other)
        ]
        allowed = "all places of a request on one graph"
        super().__init__(
            field,
            {"lat": place.lat_deg, "lon": place.lon_deg},
            f"{allowed}; {texts[1]}",
            message=f"{texts[0]}, but {texts[1]}, allowed: {allowed}",
        )


class NoPlacesError(Refusal):
    """A graph without an index of places, or with an empty one, on which nothing can be searched for by name."""

    code = "no_places"

    def __init__(self, graph: str, *, empty: bool = False) -> None:
        allowed = "a graph with an index of places, which `joulepath places build` gives it"
        lack = "an empty index" if empty else "no index"
        super().__init__("graph", graph, allowed, message=f"graph {graph!r} has {lack} of places, allowed: {allowed}")


class PlaceTextError(Refusal):
    """A text that is not taken for a place; suggestions: places that it may have meant, the likeliest first.

    others: further texts of the same request that are not taken either.
    """

    def __init__(self, field: str, text: str, allowed: str, suggestions: Sequence[PlaceOption]) -> None:
        self.suggestions = suggestions
        self.others: tuple[PlaceTextError, ...] = ()
        super().__init__(field, text, allowed)

    def __str__(self) -> str:
        return "; ".join([super().__str__(), *map(str, self.others)])


class UnknownPlaceError(PlaceTextError):
    """A text that no place of a graph fits; found: what is most like it."""

    code = "unknown_place"

    def __init__(self, field: str, text: str, graph: str, found: Sequence[PlaceOption]) -> None:
        like = f"; the most like it: {_options_text(found)}" if found else "; nothing is like it"
        super().__init__(field, text, f"a place on graph {graph!r}, or its coordinates{like}", found)


class AmbiguousPlaceError(PlaceTextError):
    """A text that several places fit as well, apart from each other."""

    code = "ambiguous_place"

    def __init__(self, field: str, text: str, graph: str, found: Sequence[PlaceOption]) -> None:
        found_text = _options_text(found)
        allowed = f"a text that fits a single place on graph {graph!r}, or its coordinates; found: {found_text}"
        super().__init__(field, text, allowed, found)


def _options_text(found: Sequence[PlaceOption]) -> str:
    return "; ".join(f"{place.label} (lat {place.lat:.5f}, lon {place.lon:.5f})" for place in found)


def _graphs_text(names: list[str]) -> str:
    return f"graph{'s' if len(names) > 1 else ''} {' and '.join(map(repr, names))}"


class NotReadyError(Exception):
    """Graphs are not loaded yet."""

    def __init__(self, reason: str = "graphs are being loaded and kernels compiled") -> None:
        self.reason = reason
        super().__init__(f"{reason}; try again in a moment")


class BodyTooLargeError(Refusal):
    """A request body above the limit."""

    code = "body_too_large"

    def __init__(self, limit_bytes: int) -> None:
        self.limit_bytes = limit_bytes
        allowed = f"at most {limit_bytes} bytes"
        super().__init__("", None, allowed, message=f"the request body is too large, allowed: {allowed}")


class OversizedBodyError(Refusal):
    """A list or an object in a request that is longer than any request needs."""

    code = "invalid_request"

    def __init__(self, field: str, value: str, allowed: str) -> None:
        super().__init__(field, value, allowed, subject=field or "the body")


class RefusedBodyError(HTTPException):
    """Carries a refusal through the framework, which takes any other error of reading a body for malformed JSON."""

    def __init__(self, refusal: Refusal) -> None:
        self.refusal = refusal
        super().__init__(422)


class CommandError(Exception):
    """A command that can't be carried out, with the reason as its message."""


class ChainLinkError(LinkError):
    """A link given by its numbers that cannot be driven: field and value are those that were sent."""

    @property
    def request_field(self) -> str:
        """The field of the link at its position in the chain."""
        return f"chain[{self.position}].{self.field}"
