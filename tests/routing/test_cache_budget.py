"""What is kept and what is dropped when caches share one number of bytes."""

from __future__ import annotations

import threading

import pytest

from routing.cache_budget import MOST_ITEMS, CacheBudget, KindCounts


class Cache:
    """A cache of things of given sizes [B]."""

    def __init__(self, budget: CacheBudget) -> None:
        self.budget, self.kept = budget, dict[str, int]()

    def use(self, name: str, size: int) -> None:
        self.kept[name] = size
        self.budget.used(self, name, "things", lambda: self.kept.get(name, 0), lambda: self.kept.pop(name, None))


def test_what_was_not_used_for_longest_goes_first() -> None:
    cache = Cache(CacheBudget(100))
    for name in "abc":
        cache.use(name, 30)
    cache.use("a", 30)
    cache.use("d", 40)
    assert set(cache.kept) == {"c", "a", "d"}
    assert cache.budget.held_bytes() == {"things": 100}
    assert cache.budget.dropped == 1
    assert cache.budget.counts() == {"things": KindCounts(hits=1, misses=4, dropped=1)}


def test_all_caches_share_the_limit_and_one_can_be_forgotten() -> None:
    budget = CacheBudget(100)
    first, second = Cache(budget), Cache(budget)
    first.use("x", 60)
    second.use("x", 30)
    second.use("y", 30)
    assert first.kept == {}
    budget.forget(second)
    assert second.kept == {}
    assert budget.held_bytes() == {}


def test_thing_that_has_grown_counts_as_it_is_now() -> None:
    cache = Cache(CacheBudget(100))
    cache.use("a", 10)
    cache.use("b", 10)
    cache.kept["a"] = 95
    cache.use("b", 10)
    assert set(cache.kept) == {"b"}


def test_thing_larger_than_the_limit_stays_until_the_next_is_used() -> None:
    cache = Cache(CacheBudget(0))
    cache.use("a", 10)
    assert set(cache.kept) == {"a"}
    cache.use("b", 10)
    assert set(cache.kept) == {"b"}


def test_number_of_things_is_bounded_too() -> None:
    cache = Cache(CacheBudget(10**9))
    for k in range(MOST_ITEMS + 10):
        cache.use(str(k), 1)
    assert len(cache.kept) == MOST_ITEMS


@pytest.mark.parametrize("threads", [8])
def test_many_threads_keep_to_the_limit(threads: int) -> None:
    budget = CacheBudget(1000)
    caches = [Cache(budget) for _ in range(threads)]

    def work(cache: Cache) -> None:
        for k in range(300):
            cache.use(str(k % 20), 40)

    running = [threading.Thread(target=work, args=(cache,)) for cache in caches]
    for thread in running:
        thread.start()
    for thread in running:
        thread.join()
    caches[0].use("last", 1)
    assert sum(budget.held_bytes().values()) <= 1000
