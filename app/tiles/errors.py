"""Errors of tiles, with their facts as attributes."""

from __future__ import annotations

from energy.errors import Refusal


class TileError(Exception):
    """Root of what tiles raise."""


class TileOutOfRangeError(Refusal, TileError):
    """A zoom level, column or row that a pyramid of tiles does not have."""

    code = "invalid_request"


class HeightsAbsentError(Refusal, TileError):
    """Heights were asked for of a graph that has none."""

    code = "not_found"

    def __init__(self, graph_name: str) -> None:
        allowed = "a graph with heights (terrain measured or synthetic)"
        super().__init__(
            "name", graph_name, allowed, message=f"graph {graph_name!r} has no heights, allowed: {allowed}"
        )
