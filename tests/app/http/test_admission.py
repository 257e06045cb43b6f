"""Calls and works in parts on threads: order, fairness, limits, clients that go away."""

from __future__ import annotations

import asyncio
import threading
import time
from collections.abc import AsyncIterator, Callable, Sequence
from contextlib import asynccontextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING, TypeVar

import pytest
from starlette.requests import Request

from app.errors.raised import OverloadedError
from app.http.admission import LONG_S, Admission, Cost, Outcome
from app.observation import Observation, Stage, note_labels, observing, stage
from routing.errors import AbandonedError, TimeUpError
from routing.time_budget import time_budget
from tests.apart import run_apart

if TYPE_CHECKING:
    from collections.abc import Coroutine

    from starlette.types import Message

T = TypeVar("T")
THREADS = 2


@dataclass
class Numbers:
    """Parts that a function makes of their numbers."""

    part_count: int
    make: Callable[[int], int]

    def part(self, idx: int) -> int:
        return self.make(idx)

    def whole(self, parts: Sequence[int]) -> list[int]:
        return list(parts)


class Client:
    """The other end of a request, which may hang up."""

    def __init__(self) -> None:
        self.gone = asyncio.Event()
        self.request = Request({"type": "http", "method": "GET", "path": "/", "headers": []}, self.receive)

    async def receive(self) -> Message:
        await self.gone.wait()
        return {"type": "http.disconnect"}


def run(body: Callable[[], Coroutine[None, None, T]]) -> T:
    return run_apart(lambda: asyncio.wait_for(body(), 30.0))


@asynccontextmanager
async def admission(limit_s: float = 20.0, threads: int = THREADS, queue: int = 100) -> AsyncIterator[Admission]:
    running = Admission(threads, limit_s, queue)
    try:
        yield running
    finally:
        running.close()


def until_stopped() -> None:
    """Work like a search, which asks its budget every now and then."""
    while True:
        time_budget().check()
        time.sleep(0.002)


@pytest.mark.parametrize("count", [0, 1, 7])
def test_parts_come_together_in_their_order_whichever_ends_first(count: int) -> None:
    def slow_first(idx: int) -> int:
        time.sleep(0.02 if idx == 0 else 0.0)
        return idx * idx

    async def body() -> list[int]:
        async with admission() as searches:
            return await searches.run_parts(Client().request, lambda: Numbers(count, slow_first), count)

    assert run(body) == [idx * idx for idx in range(count)]


def test_parts_run_on_all_threads_at_once_while_nothing_else_is_asked() -> None:
    both = threading.Barrier(THREADS, timeout=10.0)

    async def body() -> list[int]:
        async with admission() as searches:
            return await searches.run_parts(
                Client().request, lambda: Numbers(THREADS, lambda idx: both.wait()), THREADS
            )

    assert sorted(run(body)) == [0, 1]


def test_short_call_goes_before_the_parts_that_wait() -> None:
    order: list[int] = []

    def part(idx: int) -> int:
        time.sleep(0.01)
        order.append(idx)
        return idx

    async def body() -> None:
        async with admission() as searches:
            client = Client()
            work = asyncio.create_task(searches.run_parts(client.request, lambda: Numbers(50, part), 50))
            await asyncio.sleep(0.1)
            await searches.run(client.request, lambda: order.append(-1))
            await work

    run(body)
    assert order.index(-1) < 40


def test_short_call_runs_while_others_have_turned_out_long() -> None:
    async def body() -> None:
        async with admission() as searches:
            clients = [Client() for _ in range(2 * THREADS)]
            slow = [asyncio.create_task(searches.run(client.request, until_stopped)) for client in clients]
            await asyncio.sleep(1.5 * LONG_S)
            assert await searches.run(Client().request, lambda: "answered") == "answered"
            assert not any(call.done() for call in slow)
            for client in clients:
                client.gone.set()
            ends = await asyncio.gather(*slow, return_exceptions=True)
            assert all(isinstance(end, AbandonedError) for end in ends)

    run(body)


def test_call_of_a_client_that_has_gone_stops() -> None:
    async def body() -> None:
        async with admission() as searches:
            client = Client()
            call = asyncio.create_task(searches.run(client.request, until_stopped))
            await asyncio.sleep(0.05)
            assert searches.running[Cost.SHORT] == 1
            client.gone.set()
            with pytest.raises(AbandonedError):
                await call
            assert searches.running[Cost.SHORT] == 0

    run(body)


def test_call_ends_at_its_limit() -> None:
    async def body() -> float:
        async with admission(limit_s=0.3) as searches:
            began = time.monotonic()
            with pytest.raises(TimeUpError, match=r"within 0\.3 s"):
                await searches.run(Client().request, until_stopped)
            return time.monotonic() - began

    assert run(body) < 1.3


def test_call_that_would_not_be_ready_in_time_is_refused_at_once() -> None:
    async def body() -> None:
        async with admission(limit_s=0.5, threads=1) as searches:
            client = Client()
            for _ in range(30):  # calls take a tenth of a second
                await searches.run(client.request, lambda: time.sleep(0.1))
            calls = [asyncio.create_task(searches.run(client.request, lambda: time.sleep(0.1))) for _ in range(20)]
            ends = await asyncio.gather(*calls, return_exceptions=True)
            refused = [end for end in ends if isinstance(end, OverloadedError)]
            assert 12 <= len(refused) <= 18
            assert sum(end is None for end in ends) >= 2
            assert all(1 <= end.retry_s <= 3 for end in refused)

    run(body)


@pytest.mark.parametrize("cost", [Cost.SHORT, Cost.LONG])
def test_call_is_tried_when_nothing_is_ahead_of_it_however_long_the_last_ones_took(cost: Cost) -> None:
    async def body() -> None:
        async with admission(limit_s=0.2) as searches:
            client = Client()
            for _ in range(3):
                with pytest.raises(TimeUpError):
                    await searches.run(client.request, until_stopped, cost)
            assert await searches.run(client.request, lambda: "answered", cost) == "answered"

    run(body)


def test_work_is_tried_when_nothing_is_ahead_of_it_however_long_the_last_parts_took() -> None:
    async def body() -> None:
        async with admission(limit_s=0.5) as searches:
            slow = Numbers(2, lambda idx: time.sleep(0.3) or idx)
            assert await searches.run_parts(Client().request, lambda: slow, 2) == [0, 1]
            quick = Numbers(20, lambda idx: idx)
            assert await searches.run_parts(Client().request, lambda: quick, 20) == list(range(20))

    run(body)


def test_no_more_calls_wait_than_the_queue_holds() -> None:
    async def body() -> None:
        async with admission(threads=1, queue=3) as searches:
            client = Client()
            calls = [asyncio.create_task(searches.run(client.request, until_stopped)) for _ in range(6)]
            await asyncio.sleep(0.05)
            assert searches.waiting[Cost.SHORT] == 3
            client.gone.set()
            ends = await asyncio.gather(*calls, return_exceptions=True)
            assert [type(end) for end in ends].count(OverloadedError) == 2

    run(body)


def test_clients_that_have_gone_leave_their_places_in_the_queue() -> None:
    async def body() -> None:
        async with admission(threads=1, queue=3) as searches:
            held, gone = Client(), Client()
            first = asyncio.create_task(searches.run(held.request, until_stopped))
            calls = [asyncio.create_task(searches.run(gone.request, until_stopped)) for _ in range(3)]
            await asyncio.sleep(0.05)
            assert searches.waiting[Cost.SHORT] == 3
            gone.gone.set()
            await asyncio.sleep(0.05)
            last = asyncio.create_task(searches.run(held.request, lambda: "answered"))
            ends = await asyncio.gather(*calls, return_exceptions=True)
            assert all(isinstance(end, AbandonedError) for end in ends)
            assert searches.waiting[Cost.SHORT] == 1
            held.gone.set()
            await asyncio.gather(first, last, return_exceptions=True)

    run(body)


def test_calls_that_are_not_answered_are_counted_by_the_reason() -> None:
    async def body() -> None:
        async with admission(threads=1, queue=2) as searches:
            client = Client()
            calls = [asyncio.create_task(searches.run(client.request, until_stopped)) for _ in range(6)]
            await asyncio.sleep(0.05)
            client.gone.set()
            await asyncio.gather(*calls, return_exceptions=True)
            counted = {of: count for of, count in searches.unanswered.items() if count}
            assert counted == {(Cost.SHORT, Outcome.REFUSED): 3, (Cost.SHORT, Outcome.ABANDONED): 3}
        async with admission(limit_s=0.1) as searches:
            for cost in (Cost.SHORT, Cost.MIDDLE, Cost.LONG):
                with pytest.raises(TimeUpError):
                    await searches.run(Client().request, until_stopped, cost)
            with pytest.raises(TimeUpError):
                await searches.run_parts(Client().request, lambda: Numbers(1, lambda _: until_stopped()), 1)
            counted = {of: count for of, count in searches.unanswered.items() if count}
            assert counted == {(cost, Outcome.LATE): 1 for cost in Cost}

    run(body)


def test_request_is_observed_on_its_threads_and_its_waiting_is_its_own() -> None:
    first, second = Observation("first"), Observation("second")

    def search() -> None:
        with stage(Stage.SEARCH):
            note_labels(7)
            time.sleep(0.1)

    async def observed_call(observed: Observation, searches: Admission) -> None:
        with observing(observed):
            await searches.run(Client().request, search)

    async def body() -> None:
        async with admission(threads=1) as searches:
            await asyncio.gather(observed_call(first, searches), observed_call(second, searches))

    run(body)
    assert first.labels_settled == second.labels_settled == 7
    assert first.stage_s[Stage.WAIT] < 0.09 < second.stage_s[Stage.WAIT]
    assert all(observed.stage_s[Stage.SEARCH] >= 0.1 for observed in (first, second))


def test_works_take_turns_and_the_one_of_fewest_parts_is_next() -> None:
    order: list[str] = []

    async def body() -> None:
        async with admission() as searches:

            async def work(name: str, parts: int) -> None:
                made = Numbers(parts, lambda idx: time.sleep(0.005) or idx)
                await searches.run_parts(Client().request, lambda: made, parts)
                order.append(name)

            await asyncio.gather(work("first", 20), work("large", 40), work("small", 4), work("middle", 20))

    run(body)
    assert order == ["first", "small", "middle", "large"]


def test_work_that_comes_too_late_is_refused_and_the_others_are_answered() -> None:
    async def body() -> list[object]:
        async with admission(limit_s=1.0) as searches:
            made = Numbers(10, lambda idx: time.sleep(0.05) or idx)
            await searches.run_parts(Client().request, lambda: made, 10)
            return await asyncio.gather(
                *(searches.run_parts(Client().request, lambda: made, 10) for _ in range(8)), return_exceptions=True
            )

    ends = run(body)
    answered = sum(end == list(range(10)) for end in ends)
    assert 2 <= answered <= 5
    assert all(isinstance(end, (OverloadedError, TimeUpError)) for end in ends if end != list(range(10)))
    assert sum(isinstance(end, OverloadedError) for end in ends) >= 2


def test_part_that_raises_ends_the_work_with_its_error() -> None:
    done: list[int] = []

    def part(idx: int) -> int:
        if idx == 3:
            raise ValueError("the fourth")
        done.append(idx)
        return idx

    async def body() -> None:
        async with admission() as searches:
            with pytest.raises(ValueError, match="the fourth"):
                await searches.run_parts(Client().request, lambda: Numbers(100, part), 100)
            assert await searches.run_parts(Client().request, lambda: Numbers(2, lambda idx: idx), 2) == [0, 1]

    run(body)
    assert len(done) < 20


def test_parts_that_take_longer_than_the_limit_are_given_up() -> None:
    begun: list[int] = []

    def part(idx: int) -> int:
        begun.append(idx)
        time.sleep(0.06)
        return idx

    async def body() -> None:
        async with admission(limit_s=0.11, threads=1) as searches:
            with pytest.raises((TimeUpError, OverloadedError)):
                await searches.run_parts(Client().request, lambda: Numbers(100, part), 100)
            await asyncio.sleep(0.2)

    run(body)
    assert len(begun) <= 4


def test_short_call_does_not_wait_for_areas() -> None:
    begun = threading.Event()

    def area() -> None:
        begun.set()
        until_stopped()

    async def body() -> None:
        async with admission() as searches:
            client = Client()
            areas = [asyncio.create_task(searches.run(client.request, area, Cost.MIDDLE)) for _ in range(2 * THREADS)]
            assert await asyncio.to_thread(begun.wait, 10.0)
            assert searches.running[Cost.MIDDLE] == THREADS
            assert await searches.run(Client().request, lambda: "answered") == "answered"
            client.gone.set()
            ends = await asyncio.gather(*areas, return_exceptions=True)
            assert all(isinstance(end, AbandonedError) for end in ends)

    run(body)
