"""Requests for diagnoses whose bodies are still arriving: each holds a place in the queue."""

from __future__ import annotations

import threading
from typing import TYPE_CHECKING

from app.errors.diagnosing import TooManyDiagnosesError

if TYPE_CHECKING:
    from collections.abc import Callable


class Arrival:
    """A place in the queue, from before a body is read until its diagnosis is queued or refused."""

    def __init__(self, leave: Callable[[], None]) -> None:
        self._leave: Callable[[], None] | None = leave

    def end(self) -> None:
        """Give the place back, once."""
        leave, self._leave = self._leave, None
        if leave is not None:
            leave()


class Arrivals:
    """How many bodies are arriving; methods may be called from any thread."""

    def __init__(self, limit: int) -> None:
        self.limit = limit
        self._count = 0
        self._lock = threading.Lock()

    def begin(self, unfinished: int) -> Arrival:
        """A place beside so many unfinished diagnoses; raises TooManyDiagnosesError where none is free."""
        with self._lock:
            if unfinished + self._count >= self.limit:
                raise TooManyDiagnosesError(self.limit)
            self._count += 1
        return Arrival(self._ended)

    def _ended(self) -> None:
        with self._lock:
            self._count -= 1
