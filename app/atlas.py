"""The graphs that a process answers on, each loaded once with its planner."""

from __future__ import annotations

from threading import Lock
from typing import TYPE_CHECKING

from routing.cache_budget import DEFAULT_BYTES, CacheBudget
from routing.errors import GraphNotFoundError
from routing.graph.files import load_graph, load_meta
from routing.planner import Planner

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

    from energy.vehicle.files import AnyVehicle


class Atlas:
    """Planners by graph name; a graph is loaded when it is first asked for.

    cache_limit_bytes: of what all planners keep between queries.
    """

    def __init__(
        self,
        folders: Mapping[str, Path],
        *,
        snap_limit_m: float,
        label_limit: int | None,
        cache_limit_bytes: int = DEFAULT_BYTES,
    ) -> None:
        self.budget = CacheBudget(cache_limit_bytes)
        self._folders = dict(folders)
        self._snap_limit_m = snap_limit_m
        self._label_limit = label_limit
        self._planners: dict[str, Planner] = {}
        self._bbox: dict[str, tuple[float, float, float, float]] = {}
        self._lock = Lock()

    @property
    def names(self) -> tuple[str, ...]:
        """Names of all graphs."""
        return tuple(self._folders)

    def folder(self, name: str) -> Path:
        """The folder of one graph; raises GraphNotFoundError."""
        if name not in self._folders:
            raise GraphNotFoundError(name, self.names)
        return self._folders[name]

    def bbox(self, name: str) -> tuple[float, float, float, float]:
        """West, south, east, north of one graph [deg], which need not be loaded for it; raises GraphNotFoundError."""
        folder = self.folder(name)
        if name not in self._bbox:
            self._bbox[name] = load_meta(folder).bbox
        return self._bbox[name]

    def planner(self, name: str) -> Planner:
        """The planner of one graph; raises GraphNotFoundError, or GraphFormatError while loading it."""
        if name not in self._folders:
            raise GraphNotFoundError(name, self.names)
        with self._lock:
            if name not in self._planners:
                self._planners[name] = Planner(
                    load_graph(self._folders[name]),
                    snap_limit_m=self._snap_limit_m,
                    label_limit=self._label_limit,
                    budget=self.budget,
                )
            return self._planners[name]

    def load_all(self, vehicle: AnyVehicle) -> None:
        """Load every graph and compile its kernels, with a vehicle to try them on."""
        for name in self.names:
            self.planner(name).warm_up(vehicle)
