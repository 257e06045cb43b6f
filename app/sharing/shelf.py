"""Graphs in shared memory: read and held by one process, offered to others, which answer on them."""

from __future__ import annotations

import os
from dataclasses import dataclass, replace
from threading import Lock
from typing import TYPE_CHECKING

from app.sharing.memory import can_share, share_graph, shared_graph
from app.sharing.sources import Stored, look_again
from routing.errors import GraphFormatError

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from pathlib import Path

    from app.sharing.sources import GraphSource, Reloaded


@dataclass(frozen=True, slots=True)
class Offer:
    """One graph that a process offers to others; descriptor_idx: position of its memory among descriptors sent along.

    None where its memory was sent before, or where the system shares none: each process then reads the graph itself.
    problem: why its stations can't be read, None where they can.
    """

    name: str
    folder: Path
    version: str
    descriptor_idx: int | None = None
    problem: GraphFormatError | None = None


@dataclass(frozen=True, slots=True)
class _Held:
    """A graph as it was read, and the descriptor of its memory, None where the system shares none."""

    folder: Path
    version: str
    descriptor: int | None
    problem: GraphFormatError | None


class GraphShelf:
    """All graphs of a source, each read and checked once, and put into shared memory; not for several threads."""

    def __init__(self, source: GraphSource) -> None:
        self._source = source
        self._held: dict[str, _Held] = {}
        self._replaced: list[int] = []

    @property
    def names(self) -> tuple[str, ...]:
        """Names of all graphs."""
        return tuple(self._held)

    def refresh(self, needed: str) -> Reloaded:
        """Read what is new or has changed; raises GraphNotFoundError and GraphFormatError as look_again does.

        The memory of what was replaced stays until it is released.
        """
        before = {name: held.folder for name, held in self._held.items()}
        known = {name: (held.folder, held.version) for name, held in self._held.items()}

        def read(folder: Path) -> _Held:
            return self._read(folder, whole=folder in before.values())

        look = look_again(self._source, known, read, needed)
        held = {name: self._held[name] for name in look.folders if name not in look.fresh} | look.fresh
        self._replaced += [
            old.descriptor
            for name, old in self._held.items()
            if old.descriptor is not None and held.get(name) is not old
        ]
        self._held = dict(sorted(held.items()))
        return look.changes(before)

    def offers(self, only: Sequence[str] | None = None) -> tuple[tuple[Offer, ...], list[int]]:
        """All graphs, with the descriptors of all or only of some, for a process that has the others."""
        offers: list[Offer] = []
        descriptors: list[int] = []
        for name, held in self._held.items():
            sent = held.descriptor is not None and (only is None or name in only)
            offers.append(Offer(name, held.folder, held.version, len(descriptors) if sent else None, held.problem))
            if sent and held.descriptor is not None:
                descriptors.append(held.descriptor)
        return tuple(offers), descriptors

    def release(self) -> None:
        """Close the memory of what was replaced; who answers on it keeps it."""
        for descriptor in self._replaced:
            os.close(descriptor)
        self._replaced.clear()

    def _read(self, folder: Path, *, whole: bool) -> _Held:
        stored = self._source.load(folder)
        if whole:
            stored.whole()
        if not can_share():
            return _Held(folder, stored.version, None, stored.problem)
        try:
            memory = share_graph(stored.graph, f"joulepath-{stored.graph.meta.name}", stored.stations)
            return _Held(folder, stored.version, memory, stored.problem)
        except OSError as error:
            raise GraphFormatError(str(folder), "size", f"too large ({error})", "what memory there is") from error


class OfferedGraphs:
    """The graphs that another process offers, for an atlas; safe between threads."""

    def __init__(self, fallback: GraphSource) -> None:
        self._fallback = fallback
        self._offers: dict[Path, Offer] = {}
        self._memory: dict[Path, int] = {}
        self._lock = Lock()

    def take(self, offers: Sequence[Offer], descriptors: Sequence[int]) -> None:
        """Have these graphs from now on; the descriptors are closed once they are read."""
        with self._lock:
            self._offers = {offer.folder: offer for offer in offers}
            for offer in offers:
                if offer.descriptor_idx is not None:
                    self._close(offer.folder)
                    self._memory[offer.folder] = descriptors[offer.descriptor_idx]
            for folder in [folder for folder in self._memory if folder not in self._offers]:
                self._close(folder)

    def folders(self) -> Mapping[str, Path]:
        """The folder of each graph."""
        return {offer.name: folder for folder, offer in self._offers.items()}

    def version(self, folder: Path) -> str:
        """The version that is offered."""
        return self._offers[folder].version

    def load(self, folder: Path) -> Stored:
        """A graph in the memory that was offered, or read from disk where none was."""
        with self._lock:
            memory, offer = self._memory.get(folder), self._offers[folder]
            if memory is None:
                return replace(self._fallback.load(folder), version=offer.version)
            try:
                graph, stations = shared_graph(memory)
                return Stored(graph, offer.version, stations, offer.problem)
            finally:
                self._close(folder)

    def _close(self, folder: Path) -> None:
        memory = self._memory.pop(folder, None)
        if memory is not None:
            os.close(memory)
