"""Tables of the report: numbers as they are read, with their values for machines beside them."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final, NamedTuple, TypeAlias

from diagnosis.report.text import NONE, decimals, fixed, number, plain

if TYPE_CHECKING:
    from collections.abc import Sequence

    from diagnosis.answer.results import Interval

VALUE_DIGITS: Final = 6


@dataclass(frozen=True, slots=True)
class Number:
    """A number as text, with its value to VALUE_DIGITS for machines; None if it is not finite."""

    text: str
    value: str | None


class Bounds(NamedTuple):
    """Both ends of an interval."""

    low: Number
    high: Number


Cell: TypeAlias = "str | Number | Bounds"


@dataclass(frozen=True, slots=True)
class Header:
    """Head of a table's column, and whether numbers stand below it, which are aligned to the right."""

    text: str
    numeric: bool = False


@dataclass(frozen=True, slots=True)
class Table:
    """A table; the first cell of each row, and of the total, heads it. Raises ValueError where a row has other cells
    than there are headers."""

    caption: str
    headers: Sequence[Header]
    rows: Sequence[Sequence[Cell]]
    total: Sequence[Cell] | None = None

    def __post_init__(self) -> None:
        for row in (*self.rows, *([] if self.total is None else [self.total])):
            if len(row) != len(self.headers):
                raise ValueError(f"a row of {self.caption!r} has {len(row)} cells, allowed: {len(self.headers)}")


def data(value: float, text: str) -> Number:
    """A number with a text of its own."""
    return Number(text, f"{value:.{VALUE_DIGITS}g}" if math.isfinite(value) else None)


def number_as_chosen(value: float) -> Number:
    """A number that was chosen, or that nothing says the precision of."""
    return data(value, plain(value))


def cell(value: float, interval: Interval = None, *, signed: bool = False) -> Number:
    """A number rounded to its interval."""
    return data(value, number(value, interval, signed=signed))


def interval_cell(value: float, interval: Interval, *, signed: bool = False) -> Cell:
    """The interval of a value, rounded alike; a dash where there is none."""
    if interval is None:
        return NONE
    places = decimals(value, interval)
    return Bounds(*(data(bound, fixed(bound, places, signed=signed)) for bound in interval))


def headers(*texts: str) -> list[Header]:
    """Heads of a table whose first column names the row and whose others hold numbers."""
    return [Header(text, numeric=k > 0) for k, text in enumerate(texts)]
