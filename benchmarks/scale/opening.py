"""What opening a graph takes in a fresh process, step by step: time, memory, and how large each array is."""

from __future__ import annotations

import math
import time
from dataclasses import dataclass, fields
from typing import TYPE_CHECKING, Final

import numpy as np

from benchmarks.graphs import ROOT, difference_mb
from benchmarks.machine import peak_memory_mb, private_memory_mb, resident_memory_mb
from benchmarks.scale.pairs import draw_pairs
from energy.chain.chain import LinkModel, StopRule
from energy.stops import StopSettings
from energy.vehicle.files import load_vehicle
from routing.graph.files import load_graph
from routing.graph.road_graph import ARRAY_NAMES
from routing.graph.snap import RoadIndex
from routing.places import LinkPosition
from routing.search.found import Limits
from routing.search.search import find_path
from routing.search.space import search_space
from routing.search.workspaces import WorkspacePool
from routing.weights import ECO

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path
    from typing import TypeVar

    from energy.vehicle.files import AnyVehicle
    from routing.graph.road_graph import RoadGraph
    from routing.search.space import SearchSpace

    T = TypeVar("T")

VEHICLE: Final = "hyundai-kona-64"
SMALL_GRAPH: Final = ROOT / "data/graphs/coquimbo"  # on which kernels are compiled before anything counts


@dataclass(frozen=True, slots=True)
class Step:
    """One step: its time by the clock and of the processor, and the memory that it left resident.

    private_mb: of this process alone; mapped_mb: pages of files. None where the system does not say.
    """

    name: str
    seconds: float
    processor_s: float
    private_mb: float | None
    mapped_mb: float | None


@dataclass(frozen=True, slots=True)
class ArraySize:
    """What one array takes, room that nothing took yet included.

    kind: `graph` is mapped from files, `space` and `guide` are of a vehicle and its conditions, `drives` is what
    searches remember for them, `workspace` is of one search at a time.
    """

    kind: str
    name: str
    size_bytes: int


@dataclass(frozen=True, slots=True)
class Opened:
    """All steps in order, the process before them and its most at any time [MB], and the arrays after them."""

    before_mb: float | None
    peak_mb: float
    steps: tuple[Step, ...]
    arrays: tuple[ArraySize, ...]


def the_vehicle() -> AnyVehicle:
    """The vehicle that all measurements are made with."""
    return load_vehicle(ROOT / "data/vehicles" / f"{VEHICLE}.toml")


def space_of(graph: RoadGraph, vehicle: AnyVehicle) -> SearchSpace:
    """The graph as a vehicle sees it, with what a query takes by default."""
    return search_space(graph, vehicle, LinkModel.INTEGRATED, StopRule.EXPECTED, StopSettings())


def load_seconds(folder: Path) -> tuple[float, float]:
    """What this process' first load of a graph takes, by the clock and of the processor [s]."""
    began, processor = time.perf_counter(), time.process_time()
    load_graph(folder)
    return time.perf_counter() - began, time.process_time() - processor


def open_graph(folder: Path, seed: int) -> Opened:
    """Load a graph and search on it, each step once; kernels are compiled on a small graph before."""
    vehicle = the_vehicle()
    _walk(SMALL_GRAPH, vehicle, 0, _Steps())
    steps = _Steps()
    before_mb = resident_memory_mb()
    arrays = _walk(folder, vehicle, seed, steps)
    return Opened(before_mb, peak_memory_mb(), tuple(steps.taken), arrays)


class _Steps:
    """Takes the time and the memory of one step after the other."""

    def __init__(self) -> None:
        self.taken: list[Step] = []

    def take(self, name: str, work: Callable[[], T]) -> T:
        resident, private = resident_memory_mb(), private_memory_mb()
        began, processor = time.perf_counter(), time.process_time()
        done = work()
        seconds, processor_s = time.perf_counter() - began, time.process_time() - processor
        more_mb = difference_mb(private_memory_mb(), private)
        mapped_mb = difference_mb(difference_mb(resident_memory_mb(), resident), more_mb)
        self.taken.append(Step(name, seconds, processor_s, more_mb, mapped_mb))
        return done


def _walk(folder: Path, vehicle: AnyVehicle, seed: int, steps: _Steps) -> tuple[ArraySize, ...]:
    """Every step from opening a graph to searching all of it."""
    graph = steps.take("load", lambda: load_graph(folder))
    (pair,) = draw_pairs(graph, 1, np.random.default_rng(seed), apart_m=5000.0 if folder == SMALL_GRAPH else 25_000.0)
    index = RoadIndex(graph)
    _, starts = steps.take("first place on a road", lambda: index.snap("start", pair.start, math.inf))
    _, goals = index.snap("goal", pair.goal, math.inf)
    space = steps.take("vehicle and conditions", lambda: space_of(graph, vehicle))
    steps.take("room for least costs", space.lower_bound.costs)
    pool = WorkspacePool(graph.link_count)

    def search(begin: tuple[LinkPosition, ...], end: tuple[LinkPosition, ...]) -> None:
        find_path(space, pool, ECO, Limits(), begin, end)

    steps.take("first route of 25 km", lambda: search(starts, goals))
    steps.take("same route again", lambda: search(starts, goals))
    steps.take("one to all", lambda: search(starts, ()))
    steps.take("one to all again", lambda: search(starts, ()))
    return _array_sizes(graph, space, pool)


def _array_sizes(graph: RoadGraph, space: SearchSpace, pool: WorkspacePool) -> tuple[ArraySize, ...]:
    of_graph = [(name, getattr(graph, name)) for name in ARRAY_NAMES]
    known = {id(array) for _, array in of_graph}
    of_space = [(name, kept) for name, kept in space.arrays._asdict().items() if isinstance(kept, np.ndarray)]
    # columns of a table are views of it, which take nothing
    of_space = [(name, array) for name, array in of_space if id(array) not in known and array.base is None]
    with space.drives.lent() as lent:
        of_drives = [(name, kept) for name, kept in lent.table._asdict().items() if isinstance(kept, np.ndarray)]
    costs = space.lower_bound.costs()
    guide = {field.name: getattr(costs, field.name) for field in fields(costs)}
    of_guide = [(name, array) for name, array in guide.items() if isinstance(array, np.ndarray)]
    ws, epoch = pool.take()
    of_workspace = list(ws._asdict().items())
    pool.give_back(ws, epoch)
    groups = (
        ("graph", of_graph),
        ("space", of_space),
        ("guide", of_guide),
        ("drives", of_drives),
        ("workspace", of_workspace),
    )
    return tuple(ArraySize(kind, name, int(a.nbytes)) for kind, arrays in groups for name, a in arrays)
