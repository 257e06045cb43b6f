"""The graphs that a process answers on, each loaded once with its planner, and again when it has changed on disk."""

from __future__ import annotations

from dataclasses import dataclass
from threading import Lock
from typing import TYPE_CHECKING

from app.caches import CacheFigures
from app.sharing.sources import look_again
from routing.cache_budget import DEFAULT_BYTES, CacheBudget
from routing.errors import GraphNotFoundError
from routing.graph.files import load_meta
from routing.planner import Planner
from routing.stations.selection import StationIndex

if TYPE_CHECKING:
    from pathlib import Path

    from app.sharing.sources import GraphSource, Reloaded
    from energy.vehicle.files import AnyVehicle
    from routing.errors import GraphFormatError
    from routing.graph.road_graph import RoadGraph


@dataclass(frozen=True, slots=True)
class _Loaded:
    """A planner, the version of the graph that it answers on, and its stations, or why they can't be read."""

    planner: Planner
    version: str
    stations: StationIndex
    problem: GraphFormatError | None


class Atlas:
    """Planners by graph name; a graph is loaded when it is first asked for.

    cache_limit_bytes: of what all planners keep between queries.
    """

    def __init__(
        self,
        source: GraphSource,
        *,
        snap_limit_m: float,
        label_limit: int | None,
        cache_limit_bytes: int = DEFAULT_BYTES,
    ) -> None:
        self.budget = CacheBudget(cache_limit_bytes)
        self._source = source
        self._folders = dict(source.folders())
        self._snap_limit_m = snap_limit_m
        self._label_limit = label_limit
        self._loaded: dict[str, _Loaded] = {}
        self._bbox: dict[str, tuple[float, float, float, float]] = {}
        self._lock = Lock()
        self._reloading = Lock()

    @property
    def names(self) -> tuple[str, ...]:
        """Names of all graphs."""
        return tuple(self._folders)

    def cache_figures(self) -> dict[str, CacheFigures]:
        """What the planners keep between queries, by kind."""
        held = self.budget.held_bytes()
        return {
            kind: CacheFigures(held.get(kind, 0), counts.hits, counts.misses, counts.dropped)
            for kind, counts in self.budget.counts().items()
        }

    def is_loaded(self, name: str) -> bool:
        """Whether a graph is in memory; asked without waiting for one that is being loaded."""
        return name in self._loaded

    def folder(self, name: str) -> Path:
        """The folder of one graph; raises GraphNotFoundError."""
        folder = self._folders.get(name)
        if folder is None:
            raise GraphNotFoundError(name, self.names)
        return folder

    def bbox(self, name: str) -> tuple[float, float, float, float]:
        """West, south, east, north of one graph [deg], which need not be loaded for it; raises GraphNotFoundError."""
        folder = self.folder(name)
        loaded = self._loaded.get(name)
        if loaded is not None:
            return loaded.planner.graph.meta.bbox
        if name not in self._bbox:
            self._bbox[name] = load_meta(folder).bbox
        return self._bbox[name]

    def planner(self, name: str) -> Planner:
        """The planner of one graph; raises GraphNotFoundError, or GraphFormatError while loading it."""
        return self._of(name).planner

    def planner_with_stations(self, name: str) -> tuple[Planner, StationIndex, str]:
        """The planner of one graph, the stations on that very graph, and the version of both.

        Raises as planner does, and GraphFormatError where the stations can't be read.
        """
        loaded = self._of(name)
        if loaded.problem is not None:
            raise loaded.problem.with_traceback(None)  # which would grow with each time it is raised
        return loaded.planner, loaded.stations, loaded.version

    def drawn(self, name: str) -> tuple[RoadGraph, StationIndex]:
        """What maps show of one graph: its roads, and its stations, none where they can't be read; as planner does."""
        loaded = self._of(name)
        return loaded.planner.graph, loaded.stations

    def _of(self, name: str) -> _Loaded:
        folder = self.folder(name)
        loaded = self._loaded.get(name)
        if loaded is not None:
            return loaded
        with self._lock:
            if name not in self._loaded:
                self._loaded[name] = self._load(folder)
            return self._loaded[name]

    def version(self, name: str) -> str:
        """The version of a graph that is loaded, "" before it is; raises GraphNotFoundError."""
        self.folder(name)
        loaded = self._loaded.get(name)
        return "" if loaded is None else loaded.version

    def load_all(self, vehicle: AnyVehicle) -> None:
        """Load every graph and compile its kernels, with a vehicle to try them on."""
        for name in self.names:
            self.planner(name).warm_up(vehicle)

    def reload(self, vehicle: AnyVehicle, needed: str) -> Reloaded:
        """Take in what has changed on disk; requests under way end on what they began with.

        A graph that can't be read stays as it was, if it was there. vehicle: to warm up with. needed: a graph that must
        be there. Raises GraphNotFoundError where it is not, and GraphFormatError where a folder can't be looked
        through; nothing has changed then.
        """
        with self._reloading:
            before = self._folders
            known = {name: (folder, self.version(name)) for name, folder in before.items()}

            def read(folder: Path) -> _Loaded:
                loaded = self._load(folder, whole=folder in before.values())
                loaded.planner.warm_up(vehicle)
                return loaded

            look = look_again(self._source, known, read, needed)
            old = [
                loaded.planner
                for name, loaded in self._loaded.items()
                if name in look.fresh or name not in look.folders
            ]
            with self._lock:
                kept = {name: loaded for name, loaded in self._loaded.items() if name in look.folders}
                self._loaded, self._folders, self._bbox = kept | look.fresh, look.folders, {}
            for planner in old:
                planner.forget()
            return look.changes(before)

    def _load(self, folder: Path, *, whole: bool = False) -> _Loaded:
        """A graph, and its stations; whole: these must be readable, too."""
        stored = self._source.load(folder)
        if whole:
            stored.whole()
        planner = Planner(
            stored.graph, snap_limit_m=self._snap_limit_m, label_limit=self._label_limit, budget=self.budget
        )
        return _Loaded(planner, stored.version, StationIndex(stored.stations), stored.problem)
