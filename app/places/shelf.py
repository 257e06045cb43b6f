"""The opened indexes of places of all graphs, each opened anew when its file has changed."""

from __future__ import annotations

import os
from threading import Lock
from typing import TYPE_CHECKING

from app.errors.raised import NoPlacesError
from routing.gazetteer.files import PLACES_FILE
from routing.gazetteer.gazetteer import Gazetteer

if TYPE_CHECKING:
    from app.atlas import Atlas

    Stamp = tuple[int, int, int]


class PlacesShelf:
    """Indexes by the name of their graph; every process opens the files by itself, which no one writes to."""

    def __init__(self, atlas: Atlas) -> None:
        self._atlas = atlas
        self._open: dict[str, tuple[Stamp, Gazetteer]] = {}
        self._lock = Lock()

    def find(self, name: str) -> Gazetteer | None:
        """The index of a graph, None where it has none; raises GraphNotFoundError or GraphFormatError."""
        folder = self._atlas.folder(name)
        try:
            status = os.stat(folder / PLACES_FILE)
        except OSError:
            return None
        stamp = status.st_ino, status.st_mtime_ns, status.st_size
        known = self._open.get(name)
        if known is not None and known[0] == stamp:
            return known[1]
        with self._lock:
            known = self._open.get(name)
            if known is None or known[0] != stamp:
                known = self._open[name] = (stamp, Gazetteer(folder))  # who searches the old one goes on on it
        return known[1]

    def of_graph(self, name: str) -> Gazetteer:
        """The index of a graph; raises NoPlacesError where it has none, else as find does."""
        found = self.find(name)
        if found is None:
            raise NoPlacesError(name)
        return found

    def chosen(self, graph: str | None, default: str) -> dict[str, Gazetteer]:
        """The index of the graph that is asked for, else those of all graphs that have one, the default graph's first.

        Raises NoPlacesError where there is none, else as find does.
        """
        if graph is not None:
            return {graph: self.of_graph(graph)}
        names = sorted(self._atlas.names, key=lambda name: name != default)
        found = {name: index for name in names if (index := self.find(name)) is not None}
        if not found:
            raise NoPlacesError(default)
        return found
