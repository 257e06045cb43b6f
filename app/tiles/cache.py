"""Tiles that were made, kept in memory up to a number of bytes."""

from __future__ import annotations

from collections import OrderedDict
from threading import Lock
from typing import TYPE_CHECKING, Final

from app.caches import CacheFigures

if TYPE_CHECKING:
    from collections.abc import Callable, Hashable


ENTRY_BYTES: Final = 300  # measured, of a key and what refers to it: most tiles of a pyramid are empty


class TileCache:
    """Bytes by key; the ones least recently asked for are dropped first. For any number of threads.

    limit_bytes: of tiles with ENTRY_BYTES for each.
    """

    def __init__(self, limit_bytes: int) -> None:
        self._limit_bytes = limit_bytes
        self._kept: OrderedDict[Hashable, bytes] = OrderedDict()
        self._size_bytes = 0
        self._hits = self._misses = self._dropped = 0
        self._lock = Lock()

    def figures(self) -> CacheFigures:
        """What it holds, and how it was used."""
        with self._lock:
            return CacheFigures(self._size_bytes, self._hits, self._misses, self._dropped)

    def get(self, key: Hashable, make: Callable[[], bytes]) -> bytes:
        """What is kept under a key, made where it is not; threads that ask for it meanwhile may make it again."""
        with self._lock:
            kept = self._kept.get(key)
            if kept is not None:
                self._kept.move_to_end(key)
                self._hits += 1
                return kept
            self._misses += 1
        made = make()
        with self._lock:
            if key not in self._kept:
                self._kept[key] = made
                self._size_bytes += ENTRY_BYTES + len(made)
            while self._size_bytes > self._limit_bytes:
                _, dropped = self._kept.popitem(last=False)
                self._size_bytes -= ENTRY_BYTES + len(dropped)
                self._dropped += 1
        return made
