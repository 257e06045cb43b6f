"""The report's plots as inline SVG: trips met, residual power by regime, trips over time, energy by family.

Colours come from the page's style sheet by class, so that plots follow light, dark and paper.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

import numpy as np

from diagnosis.answer.regimes import Axis
from diagnosis.answer.results import TripTimeline
from diagnosis.causes.families import Family
from diagnosis.report.axes import (
    LETTER_PX,
    Frame,
    Scale,
    cut,
    frame_lines,
    line,
    panel_title,
    picture,
    scale,
    tick_text,
    y_axis,
)
from diagnosis.report.markup import Html, element
from diagnosis.report.text import AXIS_NAMES, FAMILY_NAMES, SPACE, fixed, number, quantity, regime_range, spoken
from energy.units import KMH_PER_MPS

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from numpy.typing import NDArray

    from diagnosis.answer.regimes import Regime
    from diagnosis.answer.results import TripAccount

PANEL_PX: Final = 340.0
WIDE_PX: Final = 760.0
SMOOTHED_S: Final = 60.0
MOST_POINTS: Final = 240  # of a line; longer trips are smoothed over more than SMOOTHED_S
MOST_BARS: Final = 60
MOST_LEVEL: Final = 4  # labels on one line
ROW_PX: Final = 20.0
FARTHEST: Final = 3.0  # whiskers are cut at the largest mean and so many times the middle half width
KNOWN_FAMILIES: Final = frozenset(family.value for family in Family)


def fit_panel(
    trips: Sequence[TripAccount],
    kwh: Callable[[TripAccount], float],
    title: str,
    class_: str,
    reach: tuple[float, float],
) -> Html:
    """Measured against modelled energy [kWh], one mark a trip: filled where it was held out, hollow where fitted.

    reach: ends of both axes, so that panels compare.
    """
    frame = Frame(Scale(*reach, 52, PANEL_PX - 12), Scale(*reach, 292, 44))
    marks = [
        element(
            "circle",
            element("title", f"{one.id}: measured {quantity(one.measured_kwh, None, 'kWh')}, model {number(kwh(one))}"),
            cx=frame.x.at(one.measured_kwh),
            cy=frame.y.at(kwh(one)),
            r=4,
            class_=f"{class_} {'held' if one.held_out else 'fitted'}",
        )
        for one in sorted(trips, key=lambda trip: trip.held_out)
        if math.isfinite(one.measured_kwh) and math.isfinite(kwh(one))
    ]
    left, right, top, bottom = frame.corners
    return picture(
        PANEL_PX,
        336,
        title,
        f"Scatter plot of {len(marks)} drives: measured energy to the right, the model's energy upwards, both in kWh. "
        "On the diagonal the model is right. The numbers are in the table of drives.",
        panel_title(title),
        frame_lines(frame, "measured [kWh]", "model [kWh]"),
        line(left, bottom, right, top, "ideal"),
        *marks,
    )


def energy_reach(trips: Sequence[TripAccount]) -> tuple[float, float]:
    """From 0, or the least energy below it, to beyond the largest [kWh], by measurement or by model."""
    whole = scale([kwh for one in trips for kwh in (one.measured_kwh, one.before_kwh, one.after_kwh)], 0, 1, zero=True)
    return whole.low, whole.high


def regime_panel(axis: Axis, before: Sequence[Regime], after: Sequence[Regime]) -> Html:
    """Residual power of each regime of an axis [W], before and after, with their intervals."""
    name, unit = AXIS_NAMES[axis]
    ranges = sorted({(one.low, one.high) for one in (*before, *after)})
    frame = Frame(Scale(0.0, float(len(ranges)), 58, PANEL_PX - 8), _residual_scale([*before, *after]))
    _, _, _, bottom = frame.corners
    stagger_px = 13 if len(ranges) > MOST_LEVEL else 0
    labels = [
        element("text", text, x=frame.x.at(k + 0.5), y=bottom + 16 + stagger_px * (k % 2), text_anchor="middle")
        for k, text in enumerate(_range_labels(axis, ranges))
    ]
    marks = [
        _whisker(one, frame, ranges.index((one.low, one.high)) + shift, class_)
        for regimes, class_, shift in ((before, "before", 0.38), (after, "after", 0.62))
        for one in regimes
    ]
    label = name if not unit else f"{name} [{unit}]"
    return picture(
        PANEL_PX,
        264,
        name,
        "Mean measured power less the model's in watts for each range, before and after, with 95 % intervals. "
        "The numbers are in the table of ranges.",
        panel_title(name),
        y_axis(frame, "measured − model [W]"),
        *labels,
        element("text", label, x=(58 + PANEL_PX) / 2, y=bottom + 48, text_anchor="middle", class_="label"),
        *marks,
    )


def trip_panel(trip: TripAccount) -> Html:
    """Measured power and the model's before and after over a trip's time [kW], smoothed, with the speed below."""
    lines = smoothed(trip.timeline)
    end_min = float((lines.begin_s + lines.duration_s).max()) / 60.0 if lines.begin_s.size else 1.0
    x = Scale(0.0, end_min, 52, WIDE_PX - 12)
    powers_kw = [values / 1000.0 for values in (lines.measured_w, lines.before_w, lines.after_w)]
    speed_kmh = lines.speed_mps * KMH_PER_MPS
    frame = Frame(x, scale(np.concatenate(powers_kw).tolist(), 214, 44, zero=True))
    speed = Frame(x, scale(speed_kmh.tolist(), 310, 252, zero=True))
    title = f"{trip.id}, {'held out' if trip.held_out else 'fitted'}"
    return picture(
        WIDE_PX,
        352,
        title,
        f"Power over {quantity(trip.duration_s / 60.0, None, 'min')}: measured, model before, model after; speed. "
        f"Measured {quantity(trip.measured_kwh, None, 'kWh')}, before {quantity(trip.before_kwh, None, 'kWh')}, "
        f"after {quantity(trip.after_kwh, None, 'kWh')}.",
        panel_title(cut(title, WIDE_PX)),
        y_axis(frame, "power [kW]"),
        *(
            _path(frame, lines, values, class_)
            for values, class_ in zip(powers_kw, ("measured", "before", "after"), strict=True)
        ),
        frame_lines(speed, "time since the start [min]", "speed [km/h]", most_x=12, most_y=2),
        _path(speed, lines, speed_kmh, "speed"),
    )


def smoothed(timeline: TripTimeline) -> TripTimeline:
    """A trip's means over steps of SMOOTHED_S or, for at most MOST_POINTS of them, longer ones.

    Empty steps are left out. A window belongs to the step that its middle lies in and counts by its length.
    """
    if not timeline.begin_s.size:
        return timeline
    step_s = max(SMOOTHED_S, float((timeline.begin_s + timeline.duration_s).max()) / MOST_POINTS)
    place = ((timeline.begin_s + 0.5 * timeline.duration_s) // step_s).astype(np.int64)
    time_s = np.bincount(place, weights=timeline.duration_s)
    there = np.flatnonzero(time_s > 0.0)

    def mean(values: NDArray[np.float64]) -> NDArray[np.float64]:
        sums = np.bincount(place, weights=values * timeline.duration_s)
        return np.asarray(sums[there] / time_s[there], np.float64)

    return TripTimeline(
        np.asarray(there * step_s, np.float64),
        np.full(there.size, step_s),
        mean(timeline.speed_mps),
        mean(timeline.measured_w),
        mean(timeline.before_w),
        mean(timeline.after_w),
    )


def energy_bars(trips: Sequence[TripAccount]) -> Html:
    """A bar a trip [kWh]: what each family takes, with the measured energy as a mark.

    Shares below 0 lie to the left of 0. In the order given; the first MOST_BARS only.
    """
    shown = trips[:MOST_BARS]
    label_px = 12 + LETTER_PX * min(max((len(bar_label(one)) for one in shown), default=1), 30)
    ends = [end for one in shown for end in (*_ends(one), one.measured_kwh)]
    x = scale(ends, label_px, WIDE_PX - 16, zero=True, margin=0.03)
    bottom = 34 + ROW_PX * len(shown)
    ticks = x.ticks(8)
    grid = [
        element(
            "g",
            line(x.at(tick), 30, x.at(tick), bottom, "zero" if tick == 0.0 else "grid"),
            element("text", tick_text(tick, ticks), x=x.at(tick), y=24, text_anchor="middle"),
        )
        for tick in ticks
    ]
    return picture(
        WIDE_PX,
        bottom + 8,
        "Energy of each drive by family",
        f"Stacked bars of {len(shown)} drives in kWh: what each family takes; a diamond marks "
        "the measured energy. The numbers are in the table of drives.",
        element("text", "kWh", x=4, y=24, class_="label"),
        *grid,
        *(_bar(one, x, 34 + ROW_PX * (k + 0.5)) for k, one in enumerate(shown)),
    )


def families(trips: Sequence[TripAccount]) -> tuple[str, ...]:
    """Families that hold energy on any trip, known ones in the order of `Family`, then others by name."""
    there = {name for one in trips for name, kwh in one.by_family_kwh.items() if kwh != 0.0}
    known = [family.value for family in Family if family.value in there]
    return (*known, *sorted(there - KNOWN_FAMILIES))


def family_name(name: str) -> str:
    """What a family is called."""
    return FAMILY_NAMES.get(name, spoken(name))


def family_class(name: str) -> str:
    """Class of a family's colour in the style sheet; families that it does not know share one."""
    return f"f-{name}" if name in KNOWN_FAMILIES else "f-other"


def bar_label(trip: TripAccount) -> str:
    """What stands beside a trip's bar."""
    degrees = "" if trip.ambient_c is None else f" {fixed(trip.ambient_c, 0)}{SPACE}°C"
    return f"{cut(trip.id, 22 * LETTER_PX)}{degrees}{' ●' if trip.held_out else ''}"


def _bar(trip: TripAccount, x: Scale, middle_px: float) -> Html:
    segments: list[Html] = []
    above = below = 0.0
    for name, kwh in _shares(trip):
        start = above if kwh >= 0.0 else below
        above, below = above + max(kwh, 0.0), below + min(kwh, 0.0)
        left, right = sorted((x.at(start), x.at(start + kwh)))
        said = element("title", f"{trip.id}: {family_name(name)} {quantity(kwh, None, 'kWh')}")
        box = {"x": left, "y": middle_px - 6, "width": right - left, "height": 12}
        segments.append(element("rect", said, **box, class_=f"share {family_class(name)}"))
    label = element("text", bar_label(trip), x=x.start - 8, y=middle_px + 4, text_anchor="end")
    if not math.isfinite(trip.measured_kwh):
        return element("g", label, *segments)
    at = x.at(trip.measured_kwh)
    said = element("title", f"{trip.id}: measured {quantity(trip.measured_kwh, None, 'kWh')}")
    points = " ".join(f"{at + dx:.1f},{middle_px + dy:.1f}" for dx, dy in ((-5, 0), (0, -5), (5, 0), (0, 5)))
    return element("g", label, *segments, element("polygon", said, points=points, class_="measured-mark"))


def _shares(trip: TripAccount) -> list[tuple[str, float]]:
    """Families with their energies [kWh]; what is not finite is left out."""
    shares = [(name, trip.by_family_kwh[name]) for name in families([trip])]
    return [(name, kwh) for name, kwh in shares if math.isfinite(kwh)]


def _ends(trip: TripAccount) -> tuple[float, float]:
    """Ends of a trip's bar [kWh]."""
    values = [kwh for _, kwh in _shares(trip)]
    return sum(min(kwh, 0.0) for kwh in values), sum(max(kwh, 0.0) for kwh in values)


def _path(frame: Frame, lines: TripTimeline, values: NDArray[np.float64], class_: str) -> Html:
    """A line through the middles of steps, broken where a step is missing."""
    known = np.isfinite(values)
    middle_min = (lines.begin_s + 0.5 * lines.duration_s)[known] / 60.0
    length_min = lines.duration_s[known] / 60.0
    broken = np.diff(middle_min, prepend=-math.inf) > 1.5 * length_min
    parts = [
        f"{'M' if first else 'L'}{frame.x.at(at):.1f} {frame.y.at(value):.1f}"
        for at, value, first in zip(middle_min.tolist(), values[known].tolist(), broken.tolist(), strict=True)
    ]
    return element("path", d="".join(parts), class_=f"line {class_}")


def _whisker(regime: Regime, frame: Frame, place: float, class_: str) -> Html:
    """A mark with its interval, cut at the frame's ends."""
    at = frame.x.at(place)
    _, _, top, bottom = frame.corners

    def y(value: float) -> float:
        return min(max(frame.y.at(value), top), bottom)

    interval = None if regime.low_w is None or regime.high_w is None else (regime.low_w, regime.high_w)
    said = f"{class_}: {regime_range(regime.axis, regime.low, regime.high)}, {quantity(regime.mean_w, interval, 'W')}"
    whisker = None if interval is None else line(at, y(interval[0]), at, y(interval[1]), f"line {class_} whisker")
    return element("g", element("title", said), whisker, mean_mark(class_, at, y(regime.mean_w)))


def mean_mark(class_: str, x: float, y: float) -> Html:
    """A hollow circle before, a filled square after."""
    if class_ == "before":
        return element("circle", cx=x, cy=y, r=4, class_="before fitted")
    return element("rect", x=x - 3.5, y=y - 3.5, width=7, height=7, class_="after held")


def _residual_scale(regimes: Sequence[Regime]) -> Scale:
    """From 0 over all means to whiskers of usual length: one regime of two short trips must not flatten the others."""
    means = [abs(one.mean_w) for one in regimes]
    known = [(one.low_w, one.high_w) for one in regimes if one.low_w is not None and one.high_w is not None]
    middle = float(np.median([0.5 * (high - low) for low, high in known])) if known else 0.0
    reach = max(means, default=0.0) + FARTHEST * middle
    ends = [min(max(bound, -reach), reach) for pair in known for bound in pair]
    return scale([*(one.mean_w for one in regimes), *ends], 202, 44, zero=True)


def _range_labels(axis: Axis, ranges: Sequence[tuple[float, float]]) -> list[str]:
    """Short names of ranges: the unit stands at the axis."""
    unit = AXIS_NAMES[axis][1]
    texts = [regime_range(axis, low, high).removesuffix(f"{SPACE}{unit}") for low, high in ranges]
    return [text.replace(" to ", "…").replace("below ", "< ").replace("above ", "> ") for text in texts]
