"""Searches in a bounded pool of threads, each waited for no longer than allowed."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor, wait
from typing import TYPE_CHECKING, TypeVar

from app.errors import TimeLimitError

if TYPE_CHECKING:
    from collections.abc import Callable

T = TypeVar("T")


class DeadlinePool:
    """Runs calls on a fixed number of threads.

    A call that has not begun by its deadline never runs. One that is under way can't be interrupted: it ends at the
    latest at the planner's label limit, and its answer is dropped.
    """

    def __init__(self, threads: int, limit_s: float) -> None:
        self._pool = ThreadPoolExecutor(threads, thread_name_prefix="search")
        self._limit_s = limit_s

    def run(self, call: Callable[[], T]) -> T:
        """What the call returns; raises TimeLimitError when it takes longer than the limit."""
        future = self._pool.submit(call)
        if not wait((future,), self._limit_s).done:
            future.cancel()
            raise TimeLimitError(self._limit_s)
        return future.result()

    def close(self) -> None:
        """Drop what has not begun."""
        self._pool.shutdown(wait=False, cancel_futures=True)
