"""How long a query may work. Searches ask after every few thousand labels, so that one can be stopped from outside."""

from __future__ import annotations

import math
import threading
import time
from contextlib import contextmanager
from contextvars import ContextVar
from typing import TYPE_CHECKING, Final

from routing.errors import AbandonedError, TimeUpError

if TYPE_CHECKING:
    from collections.abc import Iterator


class TimeBudget:
    """A time to be ready by, and whether anybody still waits; may be asked and abandoned from any thread.

    limit_s: from now on [s], inf for none.
    """

    def __init__(self, limit_s: float = math.inf) -> None:
        self.limit_s = limit_s
        self._until_s = time.monotonic() + limit_s
        self._abandoned = threading.Event()

    @property
    def left_s(self) -> float:
        """What is left of it [s], negative when it is used up."""
        return self._until_s - time.monotonic()

    @property
    def abandoned(self) -> bool:
        """Whether nobody waits for the answer any more."""
        return self._abandoned.is_set()

    @property
    def is_over(self) -> bool:
        """Whether work on it is to stop; it stays so."""
        return self._abandoned.is_set() or time.monotonic() > self._until_s

    def abandon(self) -> None:
        """Let whatever works on it stop soon."""
        self._abandoned.set()

    def check(self) -> None:
        """Raise AbandonedError where nobody waits any more, and TimeUpError where the time is used up."""
        if self._abandoned.is_set():
            raise AbandonedError
        if time.monotonic() > self._until_s:
            raise TimeUpError(self.limit_s)


UNLIMITED: Final = TimeBudget()
_ACTIVE: Final[ContextVar[TimeBudget]] = ContextVar("time_budget", default=UNLIMITED)


def time_budget() -> TimeBudget:
    """The budget that the query of this thread works within."""
    return _ACTIVE.get()


@contextmanager
def within(budget: TimeBudget) -> Iterator[None]:
    """Within it, queries of this thread keep to a budget."""
    token = _ACTIVE.set(budget)
    try:
        yield
    finally:
        _ACTIVE.reset(token)
