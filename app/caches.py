"""What is kept in memory between requests, as those who run the service see it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping


@dataclass(frozen=True, slots=True)
class CacheFigures:
    """How much a cache holds [B], and how often what was asked for was there or had to be made.

    hits, misses, dropped: since the start of the process; None where they are not counted. dropped: to make room.
    """

    bytes: int
    hits: int | None = None
    misses: int | None = None
    dropped: int | None = None


class CacheRegistry:
    """Caches by kind; each says its figures when it is asked, from any thread and without waiting for a search."""

    def __init__(self) -> None:
        self._sources: list[Callable[[], Mapping[str, CacheFigures]]] = []

    def add(self, source: Callable[[], Mapping[str, CacheFigures]]) -> None:
        """Ask one more source from now on: figures by kind, of a small and fixed set of kinds."""
        self._sources.append(source)

    def figures(self) -> dict[str, CacheFigures]:
        """Figures of all caches by kind; kinds that several sources have are added up."""
        found: dict[str, CacheFigures] = {}
        for source in self._sources:
            for kind, figures in source().items():
                found[kind] = figures if kind not in found else _sum(found[kind], figures)
        return found


def _sum(a: CacheFigures, b: CacheFigures) -> CacheFigures:
    return CacheFigures(
        a.bytes + b.bytes, _both(a.hits, b.hits), _both(a.misses, b.misses), _both(a.dropped, b.dropped)
    )


def _both(a: int | None, b: int | None) -> int | None:
    return b if a is None else a if b is None else a + b
