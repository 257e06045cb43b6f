"""Where the graphs of an atlas come from, and what has changed of them."""

from __future__ import annotations

import logging
from dataclasses import dataclass
from typing import TYPE_CHECKING, Generic, Protocol, TypeVar

from routing.errors import GraphFormatError, GraphNotFoundError
from routing.graph.files import load_version, version_of

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping
    from pathlib import Path

    from routing.graph.road_graph import RoadGraph

LOG = logging.getLogger(__name__)
Read = TypeVar("Read")


class GraphSource(Protocol):
    """Graphs by their folders, of which each has a version."""

    def folders(self) -> Mapping[str, Path]:
        """The folder of each graph by its name, as they are now; raises GraphFormatError."""

    def version(self, folder: Path) -> str:
        """The version of a graph as it is now; raises GraphFormatError."""

    def load(self, folder: Path) -> tuple[RoadGraph, str]:
        """A graph, and its version; raises GraphFormatError."""


@dataclass(frozen=True, slots=True)
class GraphsOnDisk:
    """Graphs in folders on disk, which find looks up."""

    find: Callable[[], Mapping[str, Path]]

    def folders(self) -> Mapping[str, Path]:
        """The folder of each graph."""
        return self.find()

    def version(self, folder: Path) -> str:
        """The version in meta.json."""
        return version_of(folder)

    def load(self, folder: Path) -> tuple[RoadGraph, str]:
        """A graph, read into the memory of this process."""
        return load_version(folder)


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
