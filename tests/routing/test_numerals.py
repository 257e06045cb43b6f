"""Numbers that read as what they are beside a bound."""

from __future__ import annotations

import math

import pytest

from routing.numerals import decimals_apart, text_above, text_below

pytestmark = pytest.mark.nojit


@pytest.mark.parametrize(
    ("value", "bound", "least", "text"),
    [
        (2310.4, 1000.0, 0, "2310"),
        (1000.4, 1000.0, 0, "1000.4"),
        (1000.0001, 1000.0, 0, "1000.0001"),
        (0.4, 0.0, 0, "0.4"),
        (0.04, 0.0, 1, "0.04"),
        (5.0, 0.0, 1, "5.0"),
        (0.02003, 0.02, 3, "0.02003"),
        (math.inf, 1.0, 0, "inf"),
    ],
)
def test_number_above_a_bound_never_reads_as_the_bound(value: float, bound: float, least: int, text: str) -> None:
    assert text_above(value, bound, least) == text
    assert text_below(-value, -bound, least) == f"-{text}"
    assert float(text) > bound


def test_two_numbers_need_as_many_decimals_as_tell_them_apart() -> None:
    assert decimals_apart(4.52, 4.54, 1) == 2
    assert decimals_apart(4.0, 9.0, 1) == 1
