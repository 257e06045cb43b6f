"""Searches in a bounded pool of threads, each waited for no longer than allowed."""

from __future__ import annotations

import time
from concurrent.futures import FIRST_COMPLETED, ThreadPoolExecutor, wait
from typing import TYPE_CHECKING, Protocol, TypeVar

from app.errors.raised import TimeLimitError

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from concurrent.futures import Future

T = TypeVar("T")
Part = TypeVar("Part")
Whole = TypeVar("Whole", covariant=True)


class PartedWork(Protocol[Part, Whole]):
    """Work that is done in parts, in any order and side by side, and then put together."""

    @property
    def part_count(self) -> int:
        """How many parts there are."""

    def part(self, idx: int) -> Part:
        """Do one part."""

    def whole(self, parts: Sequence[Part]) -> Whole:
        """Put all parts together, given in their order."""


class DeadlinePool:
    """Runs calls on a fixed number of threads.

    A call that has not begun by its deadline never runs. One that is under way can't be interrupted: it ends at the
    latest at the planner's label limit, and its answer is dropped.
    """

    def __init__(self, threads: int, limit_s: float) -> None:
        self._threads = threads
        self._pool = ThreadPoolExecutor(threads, thread_name_prefix="search")
        self._limit_s = limit_s

    def run(self, call: Callable[[], T]) -> T:
        """What the call returns; raises TimeLimitError when it takes longer than the limit."""
        return self._result(self._pool.submit(call), self._limit_s)

    def run_parts(self, prepare: Callable[[], PartedWork[Part, Whole]]) -> Whole:
        """The whole of the work that prepare returns, its parts done by all threads.

        No more parts wait at a time than there are threads, so that other calls get their turn in between. Raises
        TimeLimitError when all of it takes longer than the limit, and what a part raises; the other parts then end with
        those under way.
        """
        until = time.monotonic() + self._limit_s
        work = self.run(prepare)
        parts: dict[int, Part] = {}
        begun: dict[Future[Part], int] = {}
        waiting = iter(range(work.part_count))
        try:
            while len(parts) < work.part_count:
                while len(begun) < self._threads and (idx := next(waiting, None)) is not None:
                    begun[self._pool.submit(work.part, idx)] = idx
                done = wait(begun, max(until - time.monotonic(), 0.0), FIRST_COMPLETED).done
                if not done:
                    raise TimeLimitError(self._limit_s)
                for future in done:
                    parts[begun.pop(future)] = future.result()
        finally:
            for future in begun:
                future.cancel()
        last = self._pool.submit(work.whole, [parts[idx] for idx in range(work.part_count)])
        return self._result(last, max(until - time.monotonic(), 0.0))

    def _result(self, future: Future[T], wait_s: float) -> T:
        if not wait((future,), wait_s).done:
            future.cancel()
            raise TimeLimitError(self._limit_s)
        return future.result()

    def close(self) -> None:
        """Drop what has not begun."""
        self._pool.shutdown(wait=False, cancel_futures=True)
