"""Whole queries through the planner, as HTTP and the command line ask them."""

from __future__ import annotations

import time
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Final

import numpy as np

from routing.errors import RoutingError
from routing.places import Point
from routing.planner import Planner
from routing.queries import RangeQuery, RouteQuery
from routing.weights import BALANCED, ECO, FASTEST

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from energy.vehicle.vehicle import Vehicle
    from routing.graph.road_graph import RoadGraph
    from routing.weights import Weights

SOC_FRAC: Final = 0.9
RESERVE_SOC_FRAC: Final = 0.1
RANGE_SOC_FRAC: Final = 0.3  # a range that ends inside the larger graphs
BANDS_SOC_FRAC: Final = (0.15, 0.2, 0.25)
LABELS_PER_LINK: Final = 5  # lower than the planner's own limit: a search over it counts as refused
WEIGHTINGS: Final[tuple[tuple[str, Weights], ...]] = (("eco", ECO), ("fastest", FASTEST), ("balanced", BALANCED))


@dataclass(frozen=True, slots=True)
class QueryFigures:
    """Times of one kind of query [s]; search: of that the kernel's part; refused: without an answer, left out."""

    kind: str
    count: int
    refused: int
    median_s: float | None
    p95_s: float | None
    search_median_s: float | None


def measure_queries(
    graph: RoadGraph,
    vehicle: Vehicle,
    pairs: int,
    ranges: int,
    rng: np.random.Generator,
    progress: Callable[[float], None] = lambda done: None,
) -> list[QueryFigures]:
    """Time routes between random nodes, by weighting, and ranges from random nodes."""
    planner = Planner(graph, label_limit=LABELS_PER_LINK * graph.link_count)
    planner.warm_up(vehicle)
    ends = [(_point(graph, int(a)), _point(graph, int(b))) for a, b in rng.integers(graph.node_count, size=(pairs, 2))]
    origins = [_point(graph, int(node)) for node in rng.integers(graph.node_count, size=ranges)]

    def route(name: str, weights: Weights, start: Point, goal: Point) -> float:
        query = RouteQuery(start, goal, SOC_FRAC, vehicle, RESERVE_SOC_FRAC, ((name, weights),))
        return planner.route(query).stats[0].seconds

    def area(origin: Point) -> float:
        query = RangeQuery(origin, RANGE_SOC_FRAC, vehicle, RESERVE_SOC_FRAC, BANDS_SOC_FRAC)
        return planner.range(query).stats.seconds

    steps = len(WEIGHTINGS) + 1
    figures = []
    for k, (name, weights) in enumerate(WEIGHTINGS):
        asks = [partial(route, name, weights, start, goal) for start, goal in ends]
        figures.append(_timed(f"route, {name}", asks))
        progress((k + 1) / steps)
    figures.append(_timed(f"range, {len(BANDS_SOC_FRAC) + 1} bands", [partial(area, origin) for origin in origins]))
    progress(1.0)
    return figures


def _point(graph: RoadGraph, node: int) -> Point:
    return Point(float(graph.node_lat_deg[node]), float(graph.node_lon_deg[node]))


def _timed(kind: str, asks: Sequence[Callable[[], float]]) -> QueryFigures:
    """Ask each query once, after the first one has been asked untimed."""
    took, searching = [], []
    with suppress(RoutingError):
        asks[0]()
    for ask in asks:
        began = time.perf_counter()
        with suppress(RoutingError):
            searching.append(ask())
            took.append(time.perf_counter() - began)
    return QueryFigures(
        kind=kind,
        count=len(took),
        refused=len(asks) - len(took),
        median_s=float(np.median(took)) if took else None,
        p95_s=float(np.quantile(took, 0.95)) if took else None,
        search_median_s=float(np.median(searching)) if took else None,
    )
