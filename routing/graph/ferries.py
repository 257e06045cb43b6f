"""Links over which a ferry carries the vehicle, and for how long."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from numpy.typing import NDArray


@dataclass(frozen=True, slots=True)
class Ferries:
    """One row a link that is a ferry; both of its ends have the same height, for on board nothing is taken or given.

    link: int64 (F,) ascending; duration_s: float64 (F,) > 0 time on board [s].
    """

    link: NDArray[np.int64]
    duration_s: NDArray[np.float64]

    def carried_s(self, links: NDArray[np.integer]) -> NDArray[np.float64] | None:
        """Time on board of each of some links, 0 on roads, float64 (k,) [s]; None where all of them are roads."""
        at = np.minimum(np.searchsorted(self.link, links), self.link.size - 1)
        aboard = self.link[at] == links
        return np.where(aboard, self.duration_s[at], 0.0) if aboard.any() else None

    def of_links(self, kept: NDArray[np.int64], rank: NDArray[np.int64]) -> Ferries | None:
        """The rows of some links under new numbers; kept: int64 (K,) their links, rank: int64 (K,) the new numbers."""
        new = np.full(int(max(self.link.max(initial=-1), kept.max(initial=-1))) + 1, -1, np.int64)
        new[kept] = rank
        link, duration_s = new[self.link], self.duration_s
        order = np.argsort(link, kind="stable")
        order = order[link[order] >= 0]
        return Ferries(link[order], duration_s[order]) if order.size else None

    def with_links(self, of: NDArray[np.int64], rank: NDArray[np.int64]) -> Ferries:
        """These ferries, and copies of some links; of, rank: int64 (C,) the links and the copies, which come last."""
        carried_s = self.carried_s(of)
        if carried_s is None:
            return self
        aboard = carried_s > 0.0
        link = np.concatenate((self.link, rank[aboard]))
        return Ferries(link, np.concatenate((self.duration_s, carried_s[aboard])))

    def columns(self) -> dict[str, list[Any]]:
        """The columns as JSON takes them."""
        return {"link": self.link.tolist(), "duration_s": self.duration_s.tolist()}


def ferries_from(columns: Mapping[str, Sequence[Any]], climb_m: NDArray[np.float64]) -> Ferries:
    """What columns() gave; climb_m: float64 (M,) height gained along each link of the graph [m].

    Raises KeyError, TypeError, ValueError or OverflowError where they are damaged.
    """
    link, duration_s = np.array(columns["link"], np.int64), np.array(columns["duration_s"], np.float64)
    if link.ndim != 1 or link.size == 0 or duration_s.shape != link.shape:
        raise ValueError("columns of different length, or none")
    if not 0 <= int(link.min()) <= int(link.max()) < climb_m.size:
        raise ValueError("ferries on unknown links")
    if bool((np.diff(link) <= 0).any()):
        raise ValueError("links not ascending")
    if not bool(((duration_s > 0.0) & np.isfinite(duration_s)).all()):
        raise ValueError("durations out of range")
    if bool((climb_m[link] != 0.0).any()):
        raise ValueError("a ferry whose ends differ in height")
    return Ferries(link, duration_s)
