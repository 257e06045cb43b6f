"""Routes of 25 km, ranges and searches from one place to all, on a graph of any size.

Times are the processor's for this process: nothing here waits or runs on several threads, so that on a quiet machine
they are those of the clock, and other work on the machine changes them little.
"""

from __future__ import annotations

import math
import time
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from benchmarks.scale.opening import SMALL_GRAPH, space_of, the_vehicle
from benchmarks.scale.pairs import draw_pairs
from benchmarks.scale.regions import RegionShape, shape_of
from benchmarks.searches import Spread, Yardstick, draw_sources, spread
from routing.graph.files import load_graph
from routing.graph.snap import RoadIndex
from routing.places import LinkPosition
from routing.planner import Planner
from routing.queries import RangeQuery, RouteQuery
from routing.search.found import Limits
from routing.search.search import find_path
from routing.search.workspaces import WorkspacePool
from routing.weights import ECO

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from pathlib import Path

    from benchmarks.scale.pairs import NodePair
    from energy.vehicle.files import AnyVehicle
    from routing.graph.road_graph import RoadGraph
    from routing.search.space import SearchSpace

SOC_FRAC: Final = 0.9
RESERVE_SOC_FRAC: Final = 0.1
RANGE_SOC_FRAC: Final = 0.3
BANDS_SOC_FRAC: Final = (0.15, 0.2, 0.25)


@dataclass(frozen=True, slots=True)
class RouteFigures:
    """Routes between places 25 km apart, spreads over pairs, each the median of its repetitions [s].

    whole: through the planner, places on roads, answer and all. first: the search alone where no drive is known yet;
    again: where all are. snap: of both places. labels_settled: by the search.
    """

    whole_s: Spread
    first_s: Spread
    again_s: Spread
    snap_s: Spread
    labels_settled: Spread


@dataclass(frozen=True, slots=True)
class AllFigures:
    """Searches from one place to all, spreads over sources [s].

    first: where no drive is known yet. again: median of repetitions. scalar: Dijkstra by time, before each.
    labels_per_link: made, over all links; rows: of the table of drives afterwards.
    """

    first_s: Spread
    again_s: Spread
    scalar_s: Spread
    over_scalar: Spread
    labels_per_link: float
    rows: int


@dataclass(frozen=True, slots=True)
class Searched:
    """Everything searched on one graph; area_s: whole ranges with four bands, from 30 % to 10 % of charge."""

    shape: RegionShape
    routes: RouteFigures
    to_all: AllFigures
    area_s: Spread


def search_graph(folder: Path, pairs: int, ranges: int, sources: int, repeat: int, seed: int) -> Searched:
    """Search on a stored graph; kernels are compiled on a small one before."""
    vehicle = the_vehicle()
    small = load_graph(SMALL_GRAPH)
    Planner(small).warm_up(vehicle)
    graph = load_graph(folder)
    drawn = draw_pairs(graph, pairs, np.random.default_rng(seed))
    space = space_of(graph, vehicle)
    to_all = _to_all(graph, space, sources, repeat, np.random.default_rng(seed))
    first, again, settled, snap = _searches(graph, space, drawn, repeat)
    del space  # the planner has one of its own
    planner = Planner(graph)
    routes = RouteFigures(_whole_s(planner, vehicle, drawn, repeat), first, again, snap, settled)
    return Searched(shape_of(graph), routes, to_all, _areas_s(planner, vehicle, drawn[:ranges], repeat))


def _searches(
    graph: RoadGraph, space: SearchSpace, pairs: Sequence[NodePair], repeat: int
) -> tuple[Spread, Spread, Spread, Spread]:
    """Of first and later searches [s], labels settled, and of putting both places on roads [s]."""
    index, pool = RoadIndex(graph), WorkspacePool(graph.link_count)
    index.snap("start", pairs[0].start, math.inf)
    space.lower_bound.costs()
    first, again, snapping, settled = [], [], [], []
    for pair in pairs:
        began = time.process_time()
        _, starts = index.snap("start", pair.start, math.inf)
        _, goals = index.snap("goal", pair.goal, math.inf)
        snapping.append(time.process_time() - began)
        space.drives.forget()
        began = time.process_time()
        _, counts = find_path(space, pool, ECO, Limits(), starts, goals)
        first.append(time.process_time() - began)
        again.append(_median_s(lambda: find_path(space, pool, ECO, Limits(), starts, goals), repeat))  # noqa: B023
        settled.append(float(counts.labels_settled))
    return spread(np.array(first)), spread(np.array(again)), spread(np.array(settled)), spread(np.array(snapping))


def _whole_s(planner: Planner, vehicle: AnyVehicle, pairs: Sequence[NodePair], repeat: int) -> Spread:
    """Of whole routes, the first ask of each left out [s]."""
    took = []
    for pair in pairs:
        query = RouteQuery(pair.start, pair.goal, SOC_FRAC, vehicle, RESERVE_SOC_FRAC, (("eco", ECO),))
        planner.route(query)
        took.append(_median_s(lambda: planner.route(query), repeat))  # noqa: B023
    return spread(np.array(took))


def _areas_s(planner: Planner, vehicle: AnyVehicle, pairs: Sequence[NodePair], repeat: int) -> Spread:
    """Of whole ranges around the starts, the first ask of each left out [s]."""
    took = []
    for pair in pairs:
        query = RangeQuery(pair.start, RANGE_SOC_FRAC, vehicle, RESERVE_SOC_FRAC, BANDS_SOC_FRAC)
        planner.range(query)
        took.append(_median_s(lambda: planner.range(query), repeat))  # noqa: B023
    return spread(np.array(took))


def _to_all(graph: RoadGraph, space: SearchSpace, sources: int, repeat: int, rng: np.random.Generator) -> AllFigures:
    pool, yardstick = WorkspacePool(graph.link_count), Yardstick(graph)
    times = np.empty((sources, repeat, 2))
    first, labels = [], []
    for s, source in enumerate(draw_sources(graph, sources, rng)):
        start = [LinkPosition(source, 0.0)]
        space.drives.forget()
        began = time.process_time()
        _, counts = find_path(space, pool, ECO, Limits(), start, ())
        first.append(time.process_time() - began)
        labels.append(counts.labels_made / graph.link_count)
        for r in range(repeat):
            began = time.process_time()
            yardstick.settle(yardstick.free_flow, source)
            settled = time.process_time()
            find_path(space, pool, ECO, Limits(), start, ())
            times[s, r] = settled - began, time.process_time() - settled
    of_source = np.median(times, axis=1)
    return AllFigures(
        first_s=spread(np.array(first)),
        again_s=spread(of_source[:, 1]),
        scalar_s=spread(of_source[:, 0]),
        over_scalar=spread(np.median(times[:, :, 1] / times[:, :, 0], axis=1)),
        labels_per_link=float(np.mean(labels)),
        rows=space.drives.rows,
    )


def _median_s(work: Callable[[], object], repeat: int) -> float:
    took = []
    for _ in range(repeat):
        began = time.process_time()
        work()
        took.append(time.process_time() - began)
    return float(np.median(took))
