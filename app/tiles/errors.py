"""Errors of tiles, with their facts as attributes."""

from __future__ import annotations


class TileError(Exception):
    """Root of what tiles raise."""


class TileOutOfRangeError(TileError):
    """A zoom level, column or row that a pyramid of tiles does not have."""

    def __init__(self, field: str, value: int, allowed: str) -> None:
        self.field = field
        self.value = value
        self.allowed = allowed
        super().__init__(f"{field} is {value}, allowed: {allowed}")


class HeightsAbsentError(TileError):
    """Heights were asked for of a graph that has none."""

    def __init__(self, graph_name: str) -> None:
        self.field = "name"
        self.value = graph_name
        self.allowed = "a graph with heights (terrain measured or synthetic)"
        super().__init__(f"graph {graph_name!r} has no heights, allowed: {self.allowed}")
