"""Workspaces that searches take and give back."""

from __future__ import annotations

import threading
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from routing.cache_budget import CacheBudget
from routing.links.aligned import aligned
from routing.lower_bound.lower_bound import GoalBoundScratch
from routing.places import LinkPosition
from routing.search.kernels_workspace import COUNTERS, LABELS, Workspace

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from routing.lower_bound.kernels_lower_bound import GoalBound
    from routing.search.space import SearchSpace


WORKSPACES_KEPT: Final = 4
LABEL_BYTES: Final = 8 * 8 + 4 * 4 + 8 + 4  # of its numbers and pointers, and its place in the heap


def new_workspace(links: int, capacity: int) -> Workspace:
    """Arrays for one search; pages that the search never touches cost nothing."""
    return Workspace(
        number=aligned(8 * capacity, 0).reshape(capacity, 8),
        pointer=np.empty((capacity, 4), np.int32),
        heap_key=aligned(capacity, 1),
        heap_label=np.empty(capacity, np.int32),
        bag=np.zeros((links + 1, 4)),
        counter=np.zeros(COUNTERS, np.int64),
    )


def grown(ws: Workspace) -> Workspace:
    """The same workspace with twice the capacity, content kept."""
    old = ws.pointer.shape[0]
    new = new_workspace(ws.bag.shape[0] - 1, 2 * old)
    for small, large in ((ws.number, new.number), (ws.pointer, new.pointer)):
        large[:old] = small
    new.heap_key[:old] = ws.heap_key
    new.heap_label[:old] = ws.heap_label
    return new._replace(bag=ws.bag, counter=ws.counter)


@dataclass(frozen=True, slots=True)
class _Free:
    """A workspace that no search has, the number of its next search, and how many labels were made in it at most."""

    ws: Workspace
    epoch: int
    touched: int


class WorkspacePool:
    """Workspaces for searches on one graph, lent to one search each; safe between threads.

    budget: of the memory that caches may take; without it one of its own.
    """

    def __init__(self, links: int, budget: CacheBudget | None = None) -> None:
        self._links = links
        self._budget = CacheBudget() if budget is None else budget
        self._free: list[_Free] = []
        self._touched: dict[int, int] = {}  # most labels made in a workspace, by its bag, which stays when it grows
        self._bound_scratch: list[GoalBoundScratch] = []
        self._lock = threading.Lock()

    @property
    def held_bytes(self) -> int:
        """Memory of what is free: arrays as far as searches have touched them [B]."""
        with self._lock:
            touched = sum(LABEL_BYTES * free.touched + free.ws.bag.nbytes for free in self._free)
            return touched + sum(scratch.held_bytes for scratch in self._bound_scratch)

    def take(self) -> tuple[Workspace, int]:
        """A workspace and the epoch number that its next search must use."""
        with self._lock:
            if self._free:
                free = self._free.pop()
                self._touched[id(free.ws.bag)] = free.touched
                return free.ws, free.epoch
        return new_workspace(self._links, 2 * self._links + 4096), 1

    def give_back(self, ws: Workspace, epoch: int) -> None:
        """Return a workspace; only a few are kept."""
        with self._lock:
            touched = max(self._touched.pop(id(ws.bag), 0), int(ws.counter[LABELS]))
            if len(self._free) < WORKSPACES_KEPT and epoch < 2_000_000_000:
                self._free.append(_Free(ws, epoch + 1, touched))
        self._budget.used(self, "free", "workspaces", lambda: self.held_bytes, self._drop)

    def _drop(self) -> None:
        with self._lock:
            self._free.clear()
            self._bound_scratch.clear()

    @contextmanager
    def directed(
        self, space: SearchSpace, starts: Sequence[LinkPosition], goals: Sequence[LinkPosition]
    ) -> Iterator[GoalBound]:
        """What directs a search to its goals; for one search."""
        with self._lock:
            scratch = self._bound_scratch.pop() if self._bound_scratch else None
        if scratch is None:
            scratch = GoalBoundScratch(self._links)
        try:
            yield space.lower_bound.towards(scratch, starts[0].link_idx, [goal.link_idx for goal in goals])
        finally:
            with self._lock:
                if len(self._bound_scratch) < WORKSPACES_KEPT:
                    self._bound_scratch.append(scratch)
