"""Work in parts on a pool of threads: order, fairness, limits."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import pytest

from app.errors.raised import TimeLimitError
from app.http.deadline import DeadlinePool

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


@pytest.fixture
def pool() -> Iterator[DeadlinePool]:
    running = DeadlinePool(THREADS, 20.0)
    yield running
    running.close()


@pytest.mark.parametrize("count", [0, 1, 7])
def test_parts_come_together_in_their_order_whichever_ends_first(pool: DeadlinePool, count: int) -> None:
    def slow_first(idx: int) -> int:
        time.sleep(0.02 if idx == 0 else 0.0)
        return idx * idx

    assert pool.run_parts(lambda: Numbers(count, slow_first)) == [idx * idx for idx in range(count)]


def test_parts_run_on_all_threads_at_once(pool: DeadlinePool) -> None:
    both = threading.Barrier(THREADS, timeout=10.0)
    assert sorted(pool.run_parts(lambda: Numbers(THREADS, lambda idx: both.wait()))) == [0, 1]


def test_other_calls_get_their_turn_between_parts(pool: DeadlinePool) -> None:
    begun, order = threading.Event(), []

    def part(idx: int) -> int:
        begun.set()
        time.sleep(0.0 if -1 in order else 0.01)
        order.append(idx)
        return idx

    work = threading.Thread(target=lambda: pool.run_parts(lambda: Numbers(500, part)))
    work.start()
    assert begun.wait(10.0)
    pool.run(lambda: order.append(-1))
    work.join()
    assert order.index(-1) < 500


def test_part_that_raises_ends_the_work_with_its_error(pool: DeadlinePool) -> None:
    done = []

    def part(idx: int) -> int:
        if idx == 3:
            raise ValueError("the fourth")
        done.append(idx)
        return idx

    with pytest.raises(ValueError, match="the fourth"):
        pool.run_parts(lambda: Numbers(100, part))
    assert len(done) < 20


def test_parts_that_take_longer_than_the_limit_are_given_up() -> None:
    pool, begun = DeadlinePool(1, 0.1), []

    def part(idx: int) -> int:
        begun.append(idx)
        time.sleep(0.06)
        return idx

    with pytest.raises(TimeLimitError, match=r"within 0\.1 s"):
        pool.run_parts(lambda: Numbers(100, part))
    time.sleep(0.2)
    assert len(begun) <= 3
    pool.close()
