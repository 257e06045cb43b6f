"""The memory that caches of all graphs share: one number of bytes, and the least recently used goes first."""

from __future__ import annotations

import threading
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from collections.abc import Callable, Hashable

DEFAULT_BYTES: Final = 2**30
MOST_ITEMS: Final = 512  # those of small graphs take few bytes, but looking through them takes time


@dataclass(frozen=True, slots=True)
class _Item:
    kind: str
    size: Callable[[], int]
    drop: Callable[[], None]


@dataclass(slots=True)
class KindCounts:
    """How things of a kind were used so far: they were there, had to be made, were dropped to make room."""

    hits: int = 0
    misses: int = 0
    dropped: int = 0


class CacheBudget:
    """Keeps what caches hold below a number of bytes; safe between threads.

    A cache says each time that it uses something, how large that is by now and how to drop it. What a query is at work
    with stays in memory until it ends, whether it is dropped or not.
    """

    def __init__(self, limit_bytes: int = DEFAULT_BYTES) -> None:
        self.limit_bytes = limit_bytes
        self._items: dict[tuple[int, Hashable], _Item] = {}
        self._lock = threading.Lock()
        self._counts: dict[str, KindCounts] = {}

    def used(self, owner: object, key: Hashable, kind: str, size: Callable[[], int], drop: Callable[[], None]) -> None:
        """Note that something is used now; others are dropped where all together is too large.

        owner: the cache that keeps it under a key. size: how large it is now [B].
        """
        place = id(owner), key
        with self._lock:
            counts = self._counts.setdefault(kind, KindCounts())
            if self._items.pop(place, None) is None:
                counts.misses += 1
            else:
                counts.hits += 1
            self._items[place] = _Item(kind, size, drop)
            over = sum(item.size() for item in self._items.values()) - self.limit_bytes
            dropped = []
            for oldest in list(self._items):
                if oldest == place or (over <= 0 and len(self._items) <= MOST_ITEMS):
                    break
                item = self._items.pop(oldest)
                over -= item.size()
                dropped.append(item)
                self._counts[item.kind].dropped += 1
        for item in dropped:
            item.drop()

    def forget(self, owner: object) -> None:
        """Drop all that an owner keeps."""
        with self._lock:
            dropped = [self._items.pop(place) for place in list(self._items) if place[0] == id(owner)]
        for item in dropped:
            item.drop()

    def held_bytes(self) -> dict[str, int]:
        """Bytes held by kind."""
        held: dict[str, int] = {}
        with self._lock:
            for item in self._items.values():
                held[item.kind] = held.get(item.kind, 0) + item.size()
        return held

    @property
    def dropped(self) -> int:
        """How many things were dropped so far."""
        with self._lock:
            return sum(counts.dropped for counts in self._counts.values())

    def counts(self) -> dict[str, KindCounts]:
        """How things were used so far, by kind."""
        with self._lock:
            return {kind: replace(counts) for kind, counts in self._counts.items()}
