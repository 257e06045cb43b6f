"""Numbers in messages, with as many digits as make them true."""

from __future__ import annotations

MOST_DECIMALS = 16


def decimals_apart(low: float, high: float, least: int = 0) -> int:
    """How many decimals, at least so many, two numbers need for the higher one to read as the higher one."""
    return next((d for d in range(least, MOST_DECIMALS) if round(high, d) > round(low, d)), MOST_DECIMALS)


def text_above(value: float, bound: float, least: int = 0) -> str:
    """A number with as many decimals as tell it from a bound below it."""
    return f"{value:.{decimals_apart(bound, value, least)}f}"


def text_below(value: float, bound: float, least: int = 0) -> str:
    """A number with as many decimals as tell it from a bound above it."""
    return f"{value:.{decimals_apart(value, bound, least)}f}"
