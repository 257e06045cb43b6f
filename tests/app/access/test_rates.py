"""Buckets of units: what flows in, what is refused and for how long, and that they stay few."""

from __future__ import annotations

import pytest

from app.access.errors import RateLimitedError
from app.access.rates import RateLimits

MIDNIGHT_S = 1_000_000 * 86_400.0


def test_bucket_empties_refuses_and_fills_with_time() -> None:
    limits = RateLimits(per_s=2.0, burst=10.0, daily_quota=0)
    limits.take("a", 10.0, now_s=100.0)
    with pytest.raises(RateLimitedError) as refused:
        limits.take("a", 4.0, now_s=100.5)  # holds 1, lacks 3, at 2 a second
    assert refused.value.retry_s == 2
    limits.take("b", 10.0, now_s=100.5)  # another client has its own
    limits.take("a", 4.0, now_s=102.0)
    with pytest.raises(RateLimitedError):
        limits.take("a", 0.5, now_s=102.0)
    limits.take("a", 10.0, now_s=1000.0)  # no fuller than full
    with pytest.raises(RateLimitedError):
        limits.take("a", 0.5, now_s=1000.0)


def test_clock_that_goes_back_takes_nothing_away() -> None:
    limits = RateLimits(per_s=2.0, burst=10.0, daily_quota=0)
    limits.take("a", 1.0, now_s=100.0)
    limits.take("a", 9.0, now_s=50.0)


def test_quota_holds_until_midnight_and_a_key_may_have_its_own() -> None:
    limits = RateLimits(per_s=0.0, burst=10.0, daily_quota=5)
    for _ in range(5):
        limits.take("a", 1.0, now_s=MIDNIGHT_S + 86_000.0)
    with pytest.raises(RateLimitedError, match="5 units a day; again in 400 s"):
        limits.take("a", 1.0, now_s=MIDNIGHT_S + 86_000.0)
    limits.take("a", 1.0, now_s=MIDNIGHT_S + 86_400.0)
    limits.take("b", 6.0, daily_quota=6, now_s=MIDNIGHT_S)
    with pytest.raises(RateLimitedError):
        limits.take("b", 1.0, daily_quota=6, now_s=MIDNIGHT_S)


def test_refused_units_count_against_nothing() -> None:
    limits = RateLimits(per_s=1.0, burst=5.0, daily_quota=8)
    limits.take("a", 5.0, now_s=MIDNIGHT_S)
    with pytest.raises(RateLimitedError):
        limits.take("a", 3.0, now_s=MIDNIGHT_S)
    limits.take("a", 3.0, now_s=MIDNIGHT_S + 3.0)


def test_without_limits_nothing_is_remembered() -> None:
    limits = RateLimits(per_s=0.0, burst=1.0, daily_quota=0)
    for _ in range(100):
        limits.take("a", 100.0)
    assert len(limits) == 0


def test_clients_beyond_the_most_are_forgotten_from_the_one_that_asked_longest_ago() -> None:
    limits = RateLimits(per_s=1.0, burst=1.0, daily_quota=0, most_clients=100)
    limits.take("steady", 1.0, now_s=100.0)
    for count in range(1000):
        limits.take(f"passing {count}", 1.0, now_s=100.0)
        with pytest.raises(RateLimitedError):
            limits.take("steady", 1.0, now_s=100.0)
    assert len(limits) == 100
    limits.take("passing 0", 1.0, now_s=100.0)
