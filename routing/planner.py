"""Route and range queries answered on one graph: snap, search, unpack."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from routing.graph import RoadGraph
    from routing.query import RangeAnswer, RangeQuery, RouteAnswer, RouteQuery


class Planner:
    """Answers queries on one frozen graph; safe to share between threads."""

    def __init__(self, graph: RoadGraph, *, snap_limit_m: float = 1000.0, label_limit: int = 50_000_000) -> None:
        self.graph = graph

    def route(self, query: RouteQuery) -> RouteAnswer:
        """One route for each weighting of the query."""
        raise NotImplementedError

    def range(self, query: RangeQuery) -> RangeAnswer:
        """The reachable area with its bands."""
        raise NotImplementedError

    def warm_up(self) -> None:
        """Compile the kernels for this graph's arrays before the first query."""
        raise NotImplementedError
