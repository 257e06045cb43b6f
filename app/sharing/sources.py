"""Where the graphs of an atlas come from, and what has changed of them."""

from __future__ import annotations

import hashlib
import logging
from dataclasses import dataclass
from typing import TYPE_CHECKING, Generic, Protocol, TypeVar

from routing.errors import GraphFormatError, GraphNotFoundError
from routing.graph.files import load_version, version_of
from routing.stations.files import NO_STATIONS, load_stations_version, stations_version

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping
    from pathlib import Path

    from routing.graph.road_graph import RoadGraph
    from routing.stations.station import Stations

LOG = logging.getLogger(__name__)
Read = TypeVar("Read")


@dataclass(frozen=True, slots=True)
class Stored:
    """A graph with the stations beside it, and the version of both.

    problem: why its stations can't be read, None where they can or there are none.
    """

    graph: RoadGraph
    version: str
    stations: Stations = NO_STATIONS
    problem: GraphFormatError | None = None

    def whole(self) -> Stored:
        """Itself; raises GraphFormatError where its stations can't be read."""
        if self.problem is not None:
            raise self.problem
        return self


class GraphSource(Protocol):
    """Graphs by their folders, of which each has a version."""

    def folders(self) -> Mapping[str, Path]:
        """The folder of each graph by its name, as they are now; raises GraphFormatError."""

    def version(self, folder: Path) -> str:
        """The version of a graph and its stations as they are now; raises GraphFormatError."""

    def load(self, folder: Path) -> Stored:
        """A graph with its stations; raises GraphFormatError where the graph can't be read."""


@dataclass(frozen=True, slots=True)
class GraphsOnDisk:
    """Graphs in folders on disk, which find looks up."""

    find: Callable[[], Mapping[str, Path]]

    def folders(self) -> Mapping[str, Path]:
        """The folder of each graph."""
        return self.find()

    def version(self, folder: Path) -> str:
        """The version in meta.json, with that of the stations where there are any."""
        return _version(version_of(folder), stations_version(folder))

    def load(self, folder: Path) -> Stored:
        """A graph, read into the memory of this process; without its stations where these can't be read."""
        graph, version = load_version(folder)
        try:
            stations, of_stations = load_stations_version(folder, graph)
        except GraphFormatError as error:
            LOG.warning("graph %s is answered on without its stations: %s", folder.name, error)
            return Stored(graph, _version(version, str(error)), problem=error)
        return Stored(graph, _version(version, of_stations), stations)


def _version(of_graph: str, of_stations: str) -> str:
    if not of_stations:
        return of_graph
    return hashlib.sha256(f"{of_graph} {of_stations}".encode()).hexdigest()[: len(of_graph)]


def folders_on_disk(folders: Mapping[str, Path]) -> GraphsOnDisk:
    """Graphs on disk, always the same folders."""
    return GraphsOnDisk(lambda: folders)


@dataclass(frozen=True, slots=True)
class Reloaded:
    """What a reload has changed: names of graphs; refused: those that can't be read, and why."""

    added: tuple[str, ...]
    replaced: tuple[str, ...]
    removed: tuple[str, ...]
    refused: dict[str, str]


@dataclass(frozen=True, slots=True)
class Look(Generic[Read]):
    """What a look at all graphs has found: where they are now, those read anew, those that can't be read and why."""

    folders: dict[str, Path]
    fresh: dict[str, Read]
    refused: dict[str, str]

    def changes(self, before: Mapping[str, Path]) -> Reloaded:
        """What is other than before."""
        return Reloaded(
            added=tuple(name for name in self.fresh if name not in before),
            replaced=tuple(name for name in self.fresh if name in before),
            removed=tuple(name for name in before if name not in self.folders),
            refused=self.refused,
        )


def look_again(
    source: GraphSource, known: Mapping[str, tuple[Path, str]], read: Callable[[Path], Read], needed: str
) -> Look[Read]:
    """Read what is new or has changed; a graph that can't be read stays where it was, if it was there.

    known: folder and version of each graph as it was read, version "" where it was not. needed: a graph that must be
    there. Raises GraphNotFoundError where it is not, and GraphFormatError where a folder can't be looked through.
    """
    folders = dict(source.folders())
    if needed not in folders:
        raise GraphNotFoundError(needed, tuple(folders))
    fresh: dict[str, Read] = {}
    refused: dict[str, str] = {}
    for name, folder in folders.items():
        try:
            if known.get(name) != (folder, source.version(folder)):
                fresh[name] = read(folder)
        except GraphFormatError as error:
            LOG.warning("graph %s is not taken in: %s", name, error)
            refused[name] = str(error)
    for name in refused:
        folders.pop(name)
        if name in known:
            folders[name] = known[name][0]
    return Look(dict(sorted(folders.items())), fresh, refused)
