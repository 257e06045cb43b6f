"""One-to-all searches with physics against a scalar-weight Dijkstra with the same heap on the same links."""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from benchmarks.kernels_yardstick import scalar_dijkstra
from energy.chain.chain import LinkModel, StopRule
from energy.stops import StopSettings
from energy.units import JOULE_PER_WH
from routing.places import LinkPosition
from routing.search.found import Limits
from routing.search.search import find_path, reach
from routing.search.space import search_space
from routing.search.workspaces import WorkspacePool
from routing.weights import ECO

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    from energy.vehicle.vehicle import Vehicle
    from routing.graph.road_graph import RoadGraph
    from routing.search.found import SearchCounts
    from routing.search.space import SearchSpace

TARGET_RATIO: Final = 2.5
RESERVE_SOC_FRAC: Final = 0.1
LEAST_REACHED_FRAC: Final = 0.5  # of all links, for a source to count
TRIES: Final = 100


@dataclass(frozen=True, slots=True)
class Spread:
    """Median, quartiles and extremes of some figures."""

    median: float
    lower_quartile: float
    upper_quartile: float
    least: float
    most: float


@dataclass(frozen=True, slots=True)
class SearchCase:
    """What is searched: eco, by stop rule and charge at the start, None where no limit of the battery is held.

    From a full battery is the hard case: what it cannot take up on a descent makes labels hard to compare.
    """

    stops: StopRule
    soc_frac: float | None


CASES: Final = tuple(SearchCase(stops, soc) for stops in (StopRule.EXPECTED, StopRule.NONE) for soc in (None, 0.8, 1.0))


@dataclass(frozen=True, slots=True)
class SearchFigures:
    """Figures of one case over all sources; a ratio is of the search to the scalar run timed right before it.

    reached_frac: median share of links that can be entered; labels a link: made and settled over links reached, means.
    crowded, below_zero: the kernel's counters, summed over sources.
    """

    case: SearchCase
    search_s: Spread
    scalar_length_s: Spread
    scalar_time_s: Spread
    over_length: Spread
    over_time: Spread
    reached_frac: float
    labels_made_per_link: float
    labels_settled_per_link: float
    crowded: int
    below_zero: int

    @property
    def worst_ratio(self) -> float:
        """The larger of the two median ratios."""
        return max(self.over_length.median, self.over_time.median)

    @property
    def met(self) -> bool:
        """Whether the target holds against both scalar weights."""
        return self.worst_ratio <= TARGET_RATIO


def spread(values: NDArray[np.float64]) -> Spread:
    """Median, quartiles and extremes."""
    return Spread(*(float(x) for x in np.quantile(values, (0.5, 0.25, 0.75, 0.0, 1.0))))


class Yardstick:
    """The scalar one-to-all Dijkstra on a graph's links; keeps its arrays between runs."""

    def __init__(self, graph: RoadGraph) -> None:
        self._graph = graph
        self.length = np.ascontiguousarray(graph.length_m)
        self.free_flow = graph.length_m / graph.speed_limit_mps
        self._distance = np.empty(graph.link_count)
        pushes = graph.successor.size + 1  # each transition improves its target at most once
        self._heap_key, self._heap_item = np.empty(pushes), np.empty(pushes, np.int32)

    def settle(self, weight: NDArray[np.float64], source: int) -> int:
        """How many links a run from a source settles."""
        self._distance.fill(np.inf)
        g = self._graph
        arguments = (g.successor_first, g.successor, weight, source, self._distance, self._heap_key, self._heap_item)
        return int(scalar_dijkstra(*arguments))

    def seconds(self, weight: NDArray[np.float64], source: int) -> float:
        """How long a run from a source takes, the clearing of distances included [s]."""
        began = time.perf_counter()
        self.settle(weight, source)
        return time.perf_counter() - began


def draw_sources(graph: RoadGraph, count: int, rng: np.random.Generator) -> list[int]:
    """Random links from which most of the graph can be reached."""
    yardstick = Yardstick(graph)
    sources: list[int] = []
    for _ in range(TRIES * count):
        if len(sources) == count:
            break
        link = int(rng.integers(graph.link_count))
        if yardstick.settle(yardstick.length, link) >= LEAST_REACHED_FRAC * graph.link_count:
            sources.append(link)
    if len(sources) < count:
        raise ValueError(f"graph {graph.meta.name!r}: few links lead to most others")
    return sources


def measure_searches(
    graph: RoadGraph,
    vehicle: Vehicle,
    sources: list[int],
    repeat: int,
    progress: Callable[[float], None] = lambda done: None,
) -> list[SearchFigures]:
    """Time every case from every source, repeat times, each run right after its two scalar runs."""
    pool = WorkspacePool(graph.link_count)
    yardstick = Yardstick(graph)
    spaces = {
        rule: search_space(graph, vehicle, LinkModel.INTEGRATED, rule, StopSettings())
        for rule in dict.fromkeys(case.stops for case in CASES)
    }
    # times: (case, source, repetition, [length, free flow, search])
    times = np.empty((len(CASES), len(sources), repeat, 3))
    counts: list[list[SearchCounts]] = [[] for _ in CASES]
    reached = np.empty((len(CASES), len(sources)))
    for s, source in enumerate(sources):
        start = [LinkPosition(source, 0.0)]
        for c, case in enumerate(CASES):  # untimed: compiles, touches pages, lets the workspace grow
            found = reach(spaces[case.stops], pool, _limits(case, vehicle), start, graph.head, graph.node_count)
            counts[c].append(found.counts)
            reached[c, s] = np.count_nonzero(found.link_reach_m >= 0.0)
        for r in range(repeat):
            for c, case in enumerate(CASES):
                space, limits = spaces[case.stops], _limits(case, vehicle)
                times[c, s, r] = _round(yardstick, space, pool, limits, source)
        progress((s + 1) / len(sources))
    return [_figures(case, times[c], counts[c], reached[c], graph.link_count) for c, case in enumerate(CASES)]


def _limits(case: SearchCase, vehicle: Vehicle) -> Limits:
    capacity_j = vehicle.usable_capacity_wh * JOULE_PER_WH
    if case.soc_frac is None:
        return Limits()
    return Limits(-(1.0 - case.soc_frac) * capacity_j, (case.soc_frac - RESERVE_SOC_FRAC) * capacity_j)


def _round(
    yardstick: Yardstick, space: SearchSpace, pool: WorkspacePool, limits: Limits, source: int
) -> tuple[float, float, float]:
    """Times of the scalar runs by length and by free-flow time, and of the search [s]."""
    length_s = yardstick.seconds(yardstick.length, source)
    free_flow_s = yardstick.seconds(yardstick.free_flow, source)
    start = [LinkPosition(source, 0.0)]
    began = time.perf_counter()
    find_path(space, pool, ECO, limits, start, ())
    return length_s, free_flow_s, time.perf_counter() - began


def _figures(
    case: SearchCase,
    times: NDArray[np.float64],
    counts: list[SearchCounts],
    reached: NDArray[np.float64],
    links: int,
) -> SearchFigures:
    of_source = np.median(times, axis=1)
    ratio = np.median(times[:, :, 2:] / times[:, :, :2], axis=1)
    return SearchFigures(
        case=case,
        search_s=spread(of_source[:, 2]),
        scalar_length_s=spread(of_source[:, 0]),
        scalar_time_s=spread(of_source[:, 1]),
        over_length=spread(ratio[:, 0]),
        over_time=spread(ratio[:, 1]),
        reached_frac=float(np.median(reached)) / links,
        labels_made_per_link=float(np.mean([k.labels_made for k in counts] / reached)),
        labels_settled_per_link=float(np.mean([k.labels_settled for k in counts] / reached)),
        crowded=sum(k.crowded for k in counts),
        below_zero=sum(k.reduced_below_zero for k in counts),
    )
