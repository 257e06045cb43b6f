"""Axes of the report's plots: scales, ticks and the frame that they stand in."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from diagnosis.report.markup import Html, element
from diagnosis.report.text import fixed

if TYPE_CHECKING:
    from collections.abc import Sequence

TICK_STEPS: Final = (1.0, 2.0, 5.0, 10.0)
LETTER_PX: Final = 6.6  # width of a letter at the size of the style sheet
TITLE_PX: Final = 15.0  # baseline of a panel's title


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


def picture(width: float, height: float, title: str, description: str, *children: str | None) -> Html:
    """A picture that shrinks with the page; title and description are what a screen reader says."""
    return element(
        "svg",
        *children,
        viewBox=f"0 0 {width:g} {height:g}",
        role="img",
        aria_label=f"{title}. {description}",
        style=f"max-width:{width:g}px",
    )


def frame_lines(frame: Frame, x_label: str, y_label: str, *, most_x: int = 5, most_y: int = 5) -> Html:
    """Grid, ticks and labels of both axes."""
    left, right, _, bottom = frame.corners
    ticks = frame.x.ticks(most_x)
    return element(
        "g",
        y_axis(frame, y_label, most_y),
        *(
            element("text", tick_text(tick, ticks), x=frame.x.at(tick), y=bottom + 16, text_anchor="middle")
            for tick in ticks
        ),
        line(left, bottom, right, bottom, "axis"),
        element("text", x_label, x=(left + right) / 2, y=bottom + 34, text_anchor="middle", class_="label"),
    )


def y_axis(frame: Frame, label: str, most: int = 5) -> Html:
    """Horizontal grid with its ticks' values at the left; the label stands above the axis, upright."""
    left, right, top, _ = frame.corners
    ticks = frame.y.ticks(most)
    rows = [
        element(
            "g",
            line(left, frame.y.at(tick), right, frame.y.at(tick), "zero" if tick == 0.0 else "grid"),
            element("text", tick_text(tick, ticks), x=left - 6, y=frame.y.at(tick) + 4, text_anchor="end"),
        )
        for tick in ticks
    ]
    return element("g", *rows, element("text", label, x=4, y=top - 9, class_="label"))


def tick_text(tick: float, ticks: Sequence[float]) -> str:
    """A tick's value with the decimals that its step needs."""
    step = abs(ticks[1] - ticks[0]) if len(ticks) > 1 else abs(tick) or 1.0
    return fixed(tick, max(0, -math.floor(math.log10(step) + 1e-9)))


def line(x1: float, y1: float, x2: float, y2: float, class_: str) -> Html:
    """A straight line."""
    return element("line", x1=x1, y1=y1, x2=x2, y2=y2, class_=class_)


def panel_title(text: str) -> Html:
    """The title at the top left of a panel."""
    return element("text", text, x=4, y=TITLE_PX, class_="title")


def cut(text: str, width_px: float) -> str:
    """A text that fits a width, cut in its middle where it is longer, so that ids keep both ends."""
    most = max(int(width_px / LETTER_PX), 3)
    if len(text) <= most:
        return text
    tail = (most - 1) // 2
    return f"{text[: most - 1 - tail]}…{text[len(text) - tail :]}"


def _step(least: float) -> float:
    """Smallest of 1, 2, 5 × 10ⁿ that is at least so much."""
    size = 10.0 ** math.floor(math.log10(least))
    return next(size * factor for factor in TICK_STEPS if size * factor >= least * (1.0 - 1e-9))
