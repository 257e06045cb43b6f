"""Axes of the report's plots: scales, ticks and the frame that they stand in; templates/axes.html draws them."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from diagnosis.report.text import fixed

if TYPE_CHECKING:
    from collections.abc import Sequence

TICK_STEPS: Final = (1.0, 2.0, 5.0, 10.0)
LETTER_PX: Final = 6.6  # width of a letter at the size of the style sheet


@dataclass(frozen=True, slots=True)
class Tick:
    """A value of a scale: its pixel, its text, and the class of the line that it draws across the plot."""

    at: float
    text: str
    grid: str


@dataclass(frozen=True, slots=True)
class Scale:
    """Straight way from values (low..high) to pixels (start..end)."""

    low: float
    high: float
    start: float
    end: float

    def at(self, value: float) -> float:
        """Pixel of a value."""
        return self.start + (value - self.low) / (self.high - self.low) * (self.end - self.start)

    def ticks(self, most: int) -> list[float]:
        """At most so many round values within the scale, at least two steps apart where it can be."""
        step = _step((self.high - self.low) / max(most, 1))
        first, last = math.ceil(self.low / step - 1e-9), math.floor(self.high / step + 1e-9)
        return [k * step for k in range(first, last + 1)]

    def labels(self, most: int) -> list[Tick]:
        """The same ticks as they are drawn."""
        ticks = self.ticks(most)
        return [Tick(self.at(tick), tick_text(tick, ticks), "zero" if tick == 0.0 else "grid") for tick in ticks]


@dataclass(frozen=True, slots=True)
class Frame:
    """The rectangle of a plot's data within its picture [px], and its scales; y grows upwards."""

    x: Scale
    y: Scale

    @property
    def corners(self) -> tuple[float, float, float, float]:
        """Left, right, top, bottom."""
        return self.x.start, self.x.end, self.y.end, self.y.start


def scale(values: Sequence[float], start: float, end: float, *, zero: bool = False, margin: float = 0.06) -> Scale:
    """A scale that holds all finite values, and 0 where wanted, with a margin on sides that 0 does not close."""
    known = [value for value in values if math.isfinite(value)] + ([0.0] if zero else [])
    low, high = (min(known), max(known)) if known else (0.0, 1.0)
    if low == high:
        low, high = (low - 1.0, high + 1.0) if low != 0.0 else (0.0, 1.0)
    reach = margin * (high - low)
    low, high = low - (0.0 if zero and low == 0.0 else reach), high + (0.0 if zero and high == 0.0 else reach)
    return Scale(low, high, start, end)


def tick_text(tick: float, ticks: Sequence[float]) -> str:
    """A tick's value with the decimals that its step needs."""
    step = abs(ticks[1] - ticks[0]) if len(ticks) > 1 else abs(tick) or 1.0
    return fixed(tick, max(0, -math.floor(math.log10(step) + 1e-9)))


def shortened(text: str, width_px: float) -> str:
    """A text that fits a width, without its middle where it is longer, so that ids keep both ends."""
    most = max(int(width_px / LETTER_PX), 3)
    if len(text) <= most:
        return text
    tail = (most - 1) // 2
    return f"{text[: most - 1 - tail]}…{text[len(text) - tail :]}"


def _step(least: float) -> float:
    """Smallest of 1, 2, 5 × 10ⁿ that is at least so much."""
    size = 10.0 ** math.floor(math.log10(least))
    return next(size * factor for factor in TICK_STEPS if size * factor >= least * (1.0 - 1e-9))
