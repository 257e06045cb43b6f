"""Which request is worked on next: searches on their own threads, short ones before long ones, none too late."""

from __future__ import annotations

import asyncio
import contextvars
import math
import time
from collections import deque
from concurrent.futures import ThreadPoolExecutor
from contextlib import asynccontextmanager, contextmanager
from dataclasses import dataclass, field
from enum import StrEnum
from functools import partial
from typing import TYPE_CHECKING, Any, Final, Generic, Protocol, TypeAlias, TypeVar

from app.errors.raised import OverloadedError
from app.observation import Observation, Stage, observation
from routing.errors import AbandonedError, TimeUpError
from routing.time_budget import TimeBudget, within

if TYPE_CHECKING:
    from collections.abc import AsyncIterator, Callable, Iterator, Mapping, Sequence

    from starlette.requests import Request

T = TypeVar("T")
_Worked: TypeAlias = tuple[float, Any, BaseException | None]
Part = TypeVar("Part")
Whole = TypeVar("Whole", covariant=True)

GRACE_S: Final = 0.5  # between the limit, when searches stop, and giving up what answers all the same
SHORT_BEFORE_LONG: Final = 8  # short calls that go first while a longer one waits
BUSY_S: Final = 2.0  # since the last short call, in which one thread is kept for the next
LONG_S: Final = 1.0  # from which on a call that was taken for short counts as long
MORE_AT_A_TIME: Final = 2  # short calls than threads: while one waits for Python's lock another computes
MOST_THREADS_FACTOR: Final = 4  # of the threads, with those whose calls have turned out long
NEW_FRAC: Final = 0.1  # of an average that a new value makes, once there are so many


class Cost(StrEnum):
    """How long a call is likely to take: short; middle, as areas do; one part of a larger work; long.

    A short or a middle one counts as long once it has turned out so.
    """

    SHORT = "short"
    MIDDLE = "middle"
    PART = "part"
    LONG = "long"


LONGER: Final = (Cost.MIDDLE, Cost.PART, Cost.LONG)  # than short ones, which do not wait for them


class Outcome(StrEnum):
    """Why a call was not answered: more was asked than can be ready, its time was up, its client has gone."""

    REFUSED = "refused"
    LATE = "late"
    ABANDONED = "abandoned"


class PartedWork(Protocol[Part, Whole]):
    """Work that is done in parts, in any order and side by side, and then put together."""

    @property
    def part_count(self) -> int:
        """How many parts there are."""

    def part(self, idx: int) -> Part:
        """Do one part."""

    def whole(self, parts: Sequence[Part]) -> Whole:
        """Put all parts together, given in their order."""


@dataclass(slots=True, eq=False)
class _Waiting(Generic[T]):
    """A call that waits for a thread; typical: whether the time that it takes tells of others of its cost.

    context: of the request, for the thread; observed: the request, whose waiting is noted.
    """

    call: Callable[[], T]
    cost: Cost
    budget: TimeBudget
    typical: bool
    context: contextvars.Context = field(default_factory=contextvars.copy_context)
    observed: Observation | None = field(default_factory=observation)
    since_s: float = field(default_factory=time.perf_counter)
    done: asyncio.Future[T] = field(default_factory=lambda: asyncio.get_running_loop().create_future())


class Admission:
    """Runs calls on threads of their own; to be used from one event loop.

    As many run at a time as there are threads asked for, long ones on one fewer, and of short ones MORE_AT_A_TIME where
    there are several threads. At least one short call may run at any time, whatever the others hold.

    A call has a time budget, within which searches stop by themselves. One that has not begun by then never runs. What
    can't be ready in time by what calls of its kind took of late is refused at once, unless nothing is ahead of it: of
    what is never tried nobody knows how long it takes by now. When the client goes away, its call is stopped.

    queue_limit: calls that may wait.
    """

    def __init__(self, threads: int, limit_s: float, queue_limit: int) -> None:
        self.limit_s = limit_s
        self._threads = threads
        self._queue_limit = queue_limit
        self._at_a_time = threads + min(MORE_AT_A_TIME, 2 * (threads - 1))  # one thread is one thread
        self._pool = ThreadPoolExecutor(MOST_THREADS_FACTOR * threads, thread_name_prefix="search")
        self._waiting: dict[Cost, deque[_Waiting[Any]]] = {cost: deque() for cost in Cost}
        self._running = dict.fromkeys(Cost, 0)
        self._mean_s = dict.fromkeys(Cost, 0.0)  # nothing is known yet
        self._unanswered = {(cost, outcome): 0 for cost in Cost for outcome in Outcome}
        self._known = dict.fromkeys(Cost, 0)
        self._last_short_s = -math.inf
        self._short_in_turn = 0
        self._parts_ahead = 0
        self._works: list[tuple[int, int, asyncio.Future[None]]] = []  # parts, number, turn; smallest first
        self._work_number = 0
        self._work_running = False

    @property
    def waiting(self) -> dict[Cost, int]:
        """Calls that wait, by cost."""
        return {cost: len(queue) for cost, queue in self._waiting.items()}

    @property
    def running(self) -> dict[Cost, int]:
        """Calls that run, by cost."""
        return dict(self._running)

    @property
    def unanswered(self) -> Mapping[tuple[Cost, Outcome], int]:
        """Calls that were not answered so far, by the cost that they came with and the reason."""
        return dict(self._unanswered)

    async def run(self, request: Request, call: Callable[[], T], cost: Cost = Cost.SHORT) -> T:
        """What a call returns.

        Raises OverloadedError where it can't be ready in time, TimeUpError when it was not, AbandonedError when the
        client has gone.
        """
        budget = TimeBudget(self.limit_s)
        with self._counted(cost):
            self._forget_over()
            wait_s = self._wait_s(cost)
            self._admit(cost, wait_s + self._mean_s[cost] if wait_s > 0.0 else 0.0)
            async with _watched(request, budget):
                return await self._result(self._submit(call, cost, budget), budget)

    async def run_parts(
        self, request: Request, prepare: Callable[[], PartedWork[Part, Whole]], part_count: int
    ) -> Whole:
        """The whole of the work that prepare returns, its parts done by all threads that others leave.

        One work runs at a time, that of the fewest parts first. part_count: as the request says. Raises as run does,
        and what a part raises; the other parts then end with those under way.
        """
        budget = TimeBudget(self.limit_s)
        first = self._parts_ahead == 0
        with self._counted(Cost.PART):
            self._admit(Cost.PART, 0.0 if first else self._parts_s(self._parts_ahead + part_count))
            async with _watched(request, budget):
                self._parts_ahead += part_count
                try:
                    await self._turn(part_count, budget)
                    try:
                        return await self._all_parts(prepare, budget, first)
                    finally:
                        self._end_turn()
                finally:
                    self._parts_ahead -= part_count

    def close(self) -> None:
        """Drop what has not begun, and let what runs stop soon."""
        for queue in self._waiting.values():
            for waiting in queue:
                waiting.budget.abandon()
            queue.clear()
        self._pool.shutdown(wait=False, cancel_futures=True)

    @contextmanager
    def _counted(self, cost: Cost) -> Iterator[None]:
        """Within it, a call that is not answered is counted."""
        try:
            yield
        except OverloadedError:
            self._unanswered[cost, Outcome.REFUSED] += 1
            raise
        except TimeUpError:
            self._unanswered[cost, Outcome.LATE] += 1
            raise
        except AbandonedError:
            self._unanswered[cost, Outcome.ABANDONED] += 1
            raise

    async def _all_parts(
        self, prepare: Callable[[], PartedWork[Part, Whole]], budget: TimeBudget, first: bool
    ) -> Whole:
        work = await self._result(self._submit(prepare, Cost.PART, budget, typical=False), budget)
        count = work.part_count
        if not first and self._parts_s(count) > budget.left_s:
            raise OverloadedError(self._parts_s(count))
        parts: dict[int, Part] = {}
        begun: dict[asyncio.Future[Part], int] = {}
        rest = iter(range(count))
        try:
            while len(parts) < count:
                while len(begun) < self._threads and (idx := next(rest, None)) is not None:
                    begun[self._submit(partial(work.part, idx), Cost.PART, budget).done] = idx
                await asyncio.wait(begun, timeout=budget.left_s + GRACE_S, return_when=asyncio.FIRST_COMPLETED)
                done = [future for future in begun if future.done()]
                if not done:
                    raise TimeUpError(self.limit_s)
                for future in done:
                    parts[begun.pop(future)] = future.result()
        finally:
            if begun:
                budget.abandon()
        in_order = [parts[idx] for idx in range(count)]
        return await self._result(self._submit(lambda: work.whole(in_order), Cost.PART, budget, typical=False), budget)

    async def _turn(self, part_count: int, budget: TimeBudget) -> None:
        """Wait until no other work runs and none of fewer parts waits."""
        if not self._work_running:
            self._work_running = True
            return
        began, observed = time.perf_counter(), observation()
        turn: asyncio.Future[None] = asyncio.get_running_loop().create_future()
        self._work_number += 1
        entry = (part_count, self._work_number, turn)
        self._works.append(entry)
        try:
            await asyncio.wait((turn,), timeout=max(budget.left_s, 0.0))
            if observed is not None:
                observed.add_time(Stage.WAIT, time.perf_counter() - began)
            if not turn.done():
                raise TimeUpError(self.limit_s)
        except BaseException:
            if turn.done():
                self._end_turn()
            else:
                self._works.remove(entry)
            raise

    def _end_turn(self) -> None:
        if not self._works:
            self._work_running = False
            return
        entry = min(self._works, key=lambda work: work[:2])
        self._works.remove(entry)
        entry[2].set_result(None)

    def _admit(self, cost: Cost, ready_s: float) -> None:
        """Refuse what would not be ready in time."""
        if len(self._waiting[cost]) >= self._queue_limit or ready_s > self.limit_s:
            raise OverloadedError(max(ready_s - self.limit_s, self._mean_s[cost]))

    def _forget_over(self) -> None:
        """Let no call wait whose client has gone, or whose time is up."""
        for queue in self._waiting.values():
            for waiting in [waiting for waiting in queue if waiting.budget.is_over]:
                queue.remove(waiting)
                _refuse_late(waiting)

    def _wait_s(self, cost: Cost) -> float:
        """How long a new call is likely to wait."""
        ahead = Cost if cost is Cost.LONG else dict.fromkeys((Cost.SHORT, cost))
        return sum(self._mean_s[kind] * len(self._waiting[kind]) for kind in ahead) / self._room(cost)

    def _parts_s(self, part_count: int) -> float:
        return self._mean_s[Cost.PART] * part_count / self._room(Cost.PART)

    def _room(self, cost: Cost) -> int:
        """Threads that calls of a cost may take now."""
        if cost in (Cost.SHORT, Cost.MIDDLE) or self._threads == 1:
            return self._threads
        busy = time.monotonic() - self._last_short_s < BUSY_S
        return self._threads - 1 if busy or cost is Cost.LONG else self._threads

    def _submit(self, call: Callable[[], T], cost: Cost, budget: TimeBudget, *, typical: bool = True) -> _Waiting[T]:
        waiting = _Waiting(call, cost, budget, typical)
        self._waiting[cost].append(waiting)
        if cost is Cost.SHORT:
            self._last_short_s = time.monotonic()
        self._dispatch()
        return waiting

    async def _result(self, waiting: _Waiting[T], budget: TimeBudget) -> T:
        await asyncio.wait((waiting.done,), timeout=max(budget.left_s, 0.0) + GRACE_S)
        if not waiting.done.done():
            budget.abandon()
            raise TimeUpError(self.limit_s)
        return waiting.done.result()

    def _dispatch(self) -> None:
        """Give free threads to those who wait."""
        while (waiting := self._next()) is not None:
            if waiting.budget.is_over:
                _refuse_late(waiting)
                continue
            loop = asyncio.get_running_loop()
            self._running[waiting.cost] += 1
            job = loop.run_in_executor(self._pool, waiting.context.run, _work, waiting)
            turns_long = loop.call_later(LONG_S, self._count_as_long, waiting, job)
            job.add_done_callback(partial(self._finished, waiting, turns_long))

    def _next(self) -> _Waiting[Any] | None:
        """The next call that a thread is free for: a short one before longer ones, but not always."""
        longer = [cost for cost in LONGER if self._waiting[cost] and self._has_room(cost)]
        short = bool(self._waiting[Cost.SHORT]) and self._has_room(Cost.SHORT)
        if short and (not longer or self._short_in_turn < SHORT_BEFORE_LONG):
            self._short_in_turn += 1
            return self._waiting[Cost.SHORT].popleft()
        if not longer:
            return None
        self._short_in_turn = 0
        return self._waiting[min(longer, key=lambda cost: self._waiting[cost][0].since_s)].popleft()

    def _has_room(self, cost: Cost) -> bool:
        """Whether one more call of a cost may run now."""
        short, longer = self._running[Cost.SHORT], sum(self._running[kind] for kind in LONGER)
        if cost is Cost.SHORT:
            most = MOST_THREADS_FACTOR * self._threads
            return short < max(self._at_a_time - longer, 1) and short + longer < most
        return longer < self._room(cost) and short + longer < self._at_a_time

    def _count_as_long(self, waiting: _Waiting[Any], job: asyncio.Future[Any]) -> None:
        if waiting.cost in (Cost.SHORT, Cost.MIDDLE) and not job.done():
            self._running[waiting.cost] -= 1
            waiting.cost = Cost.LONG
            self._running[waiting.cost] += 1
            self._dispatch()

    def _finished(self, waiting: _Waiting[Any], turns_long: asyncio.TimerHandle, job: asyncio.Future[_Worked]) -> None:
        turns_long.cancel()
        self._running[waiting.cost] -= 1
        if job.cancelled():
            waiting.done.cancel()
            return
        seconds, value, error = job.result()
        if waiting.typical and not isinstance(error, AbandonedError):
            self._known[waiting.cost] += 1
            new_frac = max(NEW_FRAC, 1.0 / self._known[waiting.cost])
            self._mean_s[waiting.cost] += (seconds - self._mean_s[waiting.cost]) * new_frac
        if not waiting.done.done():
            if error is None:
                waiting.done.set_result(value)
            else:
                waiting.done.set_exception(error)
                waiting.done.exception()  # asked for, also where nobody waits any more
        self._dispatch()


def _work(waiting: _Waiting[Any]) -> _Worked:
    """Carry a call out on this thread: how long it took [s], what it returned, what it raised."""
    began = time.perf_counter()
    if waiting.observed is not None:
        waiting.observed.add_time(Stage.WAIT, began - waiting.since_s)
    try:
        with within(waiting.budget):
            value = waiting.call()
    except BaseException as error:
        return time.perf_counter() - began, None, error
    return time.perf_counter() - began, value, None


def _refuse_late(waiting: _Waiting[Any]) -> None:
    """Let a call fail that nobody has begun in time."""
    if waiting.done.done():
        return
    try:
        waiting.budget.check()
    except (AbandonedError, TimeUpError) as error:
        waiting.done.set_exception(error)
        waiting.done.exception()


@asynccontextmanager
async def _watched(request: Request, budget: TimeBudget) -> AsyncIterator[None]:
    """Within it, a budget is abandoned when the client goes away."""
    watch = asyncio.create_task(_abandon_when_gone(request, budget))
    try:
        yield
    finally:
        watch.cancel()


async def _abandon_when_gone(request: Request, budget: TimeBudget) -> None:
    while (await request.receive())["type"] != "http.disconnect":
        pass
    budget.abandon()
