"""The report's plots as inline SVG: trips met, residual power by regime, trips over time, energy by family.

Colours come from the page's style sheet by class, so that plots follow light, dark and paper.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from diagnosis.answer.regimes import Axis
from diagnosis.answer.results import TripTimeline
from diagnosis.causes.families import Family
from diagnosis.report.axes import LETTER_PX, Frame, Scale, scale, shortened
from diagnosis.report.rendering import rendered
from diagnosis.report.style import OTHER_FAMILY
from diagnosis.report.text import AXIS_NAMES, FAMILY_NAMES, SPACE, fixed, number, quantity, regime_range, spoken
from energy.units import KMH_PER_MPS

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from markupsafe import Markup
    from numpy.typing import NDArray

    from diagnosis.answer.regimes import RegimeResidual
    from diagnosis.answer.results import TripAccount

PANEL_PX: Final = 340.0
WIDE_PX: Final = 760.0
SMOOTHED_S: Final = 60.0
MOST_POINTS: Final = 240  # of a line; longer trips are smoothed over more than SMOOTHED_S
MOST_BARS: Final = 60
MOST_LEVEL: Final = 4  # labels on one line
STAGGER_PX: Final = 13.0  # every other label lower where they are more
ROW_PX: Final = 20.0
FARTHEST: Final = 3.0  # whiskers end at the largest mean and so many times the middle half width
KNOWN_FAMILIES: Final = frozenset(family.value for family in Family)


@dataclass(frozen=True, slots=True)
class Dot:
    """A drive of a scatter plot: its place [px], classes and what a pointer over it reads."""

    x: float
    y: float
    classes: str
    text: str


@dataclass(frozen=True, slots=True)
class MeanMark:
    """Mean power of a regime [px] in a series, before or after; whisker: ends of its interval, None without."""

    x: float
    y: float
    series: str
    text: str
    whisker: tuple[float, float] | None


@dataclass(frozen=True, slots=True)
class Share:
    """What a family takes of a bar [px]."""

    begin: float
    width: float
    family_class: str
    text: str


@dataclass(frozen=True, slots=True)
class Diamond:
    """The measured energy on a bar, by its corners."""

    points: str
    text: str


@dataclass(frozen=True, slots=True)
class Bar:
    """A drive's energy by family around its middle line [px]; measured: None where it is not known."""

    middle: float
    label: str
    shares: Sequence[Share]
    measured: Diamond | None


def fit_panel(
    trips: Sequence[TripAccount],
    kwh: Callable[[TripAccount], float],
    title: str,
    class_: str,
    reach: tuple[float, float],
) -> Markup:
    """Measured against modelled energy [kWh], one mark a trip: filled where it was held out, hollow where fitted.

    reach: ends of both axes, so that panels compare.
    """
    frame = Frame(Scale(*reach, 52, PANEL_PX - 12), Scale(*reach, 292, 44))
    marks = [
        Dot(
            frame.x.at(trip.measured_kwh),
            frame.y.at(kwh(trip)),
            f"{class_} {'held' if trip.held_out else 'fitted'}",
            f"{trip.id}: measured {quantity(trip.measured_kwh, None, 'kWh')}, model {number(kwh(trip))}",
        )
        for trip in sorted(trips, key=lambda trip: trip.held_out)
        if math.isfinite(trip.measured_kwh) and math.isfinite(kwh(trip))
    ]
    return rendered("fit_panel.html", width=PANEL_PX, title=title, frame=frame, marks=marks)


def energy_reach(trips: Sequence[TripAccount]) -> tuple[float, float]:
    """From 0, or the least energy below it, to beyond the largest [kWh], by measurement or by model."""
    whole = scale(
        [kwh for trip in trips for kwh in (trip.measured_kwh, trip.before_kwh, trip.after_kwh)], 0, 1, zero=True
    )
    return whole.low, whole.high


def regime_panel(axis: Axis, before: Sequence[RegimeResidual], after: Sequence[RegimeResidual]) -> Markup:
    """Residual power of each regime of an axis [W], before and after, with their intervals."""
    name, unit = AXIS_NAMES[axis]
    ranges = sorted({(regime.low, regime.high) for regime in (*before, *after)})
    frame = Frame(Scale(0.0, float(len(ranges)), 58, PANEL_PX - 8), _residual_scale([*before, *after]))
    marks = [
        _mean(regime, frame, ranges.index((regime.low, regime.high)) + shift, series)
        for regimes, series, shift in ((before, "before", 0.38), (after, "after", 0.62))
        for regime in regimes
    ]
    return rendered(
        "regime_panel.html",
        width=PANEL_PX,
        title=name,
        label=name if not unit else f"{name} [{unit}]",
        frame=frame,
        ranges=_range_labels(axis, ranges),
        stagger_px=STAGGER_PX if len(ranges) > MOST_LEVEL else 0.0,
        marks=marks,
    )


def trip_panel(trip: TripAccount) -> Markup:
    """Measured power and the model's before and after over a trip's time [kW], smoothed, with the speed below."""
    lines = smoothed(trip.timeline)
    end_min = float((lines.begin_s + lines.duration_s).max()) / 60.0 if lines.begin_s.size else 1.0
    x = Scale(0.0, end_min, 52, WIDE_PX - 12)
    powers_kw = [values / 1000.0 for values in (lines.measured_w, lines.before_w, lines.after_w)]
    speed_kmh = lines.speed_mps * KMH_PER_MPS
    power = Frame(x, scale(np.concatenate(powers_kw).tolist(), 214, 44, zero=True))
    speed = Frame(x, scale(speed_kmh.tolist(), 310, 252, zero=True))
    title = f"{trip.id}, {'held out' if trip.held_out else 'fitted'}"
    return rendered(
        "trip_panel.html",
        width=WIDE_PX,
        title=title,
        short_title=shortened(title, WIDE_PX),
        description=(
            f"Power over {quantity(trip.duration_s / 60.0, None, 'min')}: measured, model before, model after; speed. "
            f"Measured {quantity(trip.measured_kwh, None, 'kWh')}, before {quantity(trip.before_kwh, None, 'kWh')}, "
            f"after {quantity(trip.after_kwh, None, 'kWh')}."
        ),
        power=power,
        lines=[
            (series, _way(power, lines, values))
            for series, values in zip(("measured", "before", "after"), powers_kw, strict=True)
        ],
        speed=speed,
        speed_line=_way(speed, lines, speed_kmh),
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


def energy_bars(trips: Sequence[TripAccount]) -> Markup:
    """A bar a trip [kWh]: what each family takes, with the measured energy as a mark.

    Shares below 0 lie to the left of 0. In the order given; the first MOST_BARS only.
    """
    shown = trips[:MOST_BARS]
    label_px = 12 + LETTER_PX * min(max((len(bar_label(trip)) for trip in shown), default=1), 30)
    ends = [end for trip in shown for end in (*_ends(trip), trip.measured_kwh)]
    x = scale(ends, label_px, WIDE_PX - 16, zero=True, margin=0.03)
    bottom = 34 + ROW_PX * len(shown)
    return rendered(
        "energy_bars.html",
        width=WIDE_PX,
        bottom=bottom,
        scale=x,
        bars=[_bar(trip, x, 34 + ROW_PX * (k + 0.5)) for k, trip in enumerate(shown)],
    )


def families(trips: Sequence[TripAccount]) -> tuple[str, ...]:
    """Families that hold energy on any trip, known ones in the order of `Family`, then others by name."""
    there = {name for trip in trips for name, kwh in trip.by_family_kwh.items() if kwh != 0.0}
    known = [family.value for family in Family if family.value in there]
    return (*known, *sorted(there - KNOWN_FAMILIES))


def family_name(name: str) -> str:
    """What a family is called."""
    return FAMILY_NAMES.get(name, spoken(name))


def family_class(name: str) -> str:
    """Class of a family's colour in the style sheet; families that it does not know share one."""
    return f"f-{name}" if name in KNOWN_FAMILIES else f"f-{OTHER_FAMILY}"


def bar_label(trip: TripAccount) -> str:
    """What stands beside a trip's bar."""
    degrees = "" if trip.ambient_c is None else f" {fixed(trip.ambient_c, 0)}{SPACE}°C"
    return f"{shortened(trip.id, 22 * LETTER_PX)}{degrees}{' ●' if trip.held_out else ''}"


def _bar(trip: TripAccount, x: Scale, middle_px: float) -> Bar:
    shares = []
    above = below = 0.0
    for name, kwh in _shares(trip):
        start = above if kwh >= 0.0 else below
        above, below = above + max(kwh, 0.0), below + min(kwh, 0.0)
        begin, end = sorted((x.at(start), x.at(start + kwh)))
        text = f"{trip.id}: {family_name(name)} {quantity(kwh, None, 'kWh')}"
        shares.append(Share(begin, end - begin, family_class(name), text))
    measured = None
    if math.isfinite(trip.measured_kwh):
        at = x.at(trip.measured_kwh)
        points = " ".join(f"{at + dx:.1f},{middle_px + dy:.1f}" for dx, dy in ((-5, 0), (0, -5), (5, 0), (0, 5)))
        measured = Diamond(points, f"{trip.id}: measured {quantity(trip.measured_kwh, None, 'kWh')}")
    return Bar(middle_px, bar_label(trip), shares, measured)


def _shares(trip: TripAccount) -> list[tuple[str, float]]:
    """Families with their energies [kWh]; what is not finite is left out."""
    shares = [(name, trip.by_family_kwh[name]) for name in families([trip])]
    return [(name, kwh) for name, kwh in shares if math.isfinite(kwh)]


def _ends(trip: TripAccount) -> tuple[float, float]:
    """Ends of a trip's bar [kWh]."""
    values = [kwh for _, kwh in _shares(trip)]
    return sum(min(kwh, 0.0) for kwh in values), sum(max(kwh, 0.0) for kwh in values)


def _way(frame: Frame, lines: TripTimeline, values: NDArray[np.float64]) -> str:
    """A line through the middles of steps, broken where a step is missing, as the d of an SVG path."""
    known = np.isfinite(values)
    middle_min = (lines.begin_s + 0.5 * lines.duration_s)[known] / 60.0
    length_min = lines.duration_s[known] / 60.0
    broken = np.diff(middle_min, prepend=-math.inf) > 1.5 * length_min
    return "".join(
        f"{'M' if first else 'L'}{frame.x.at(at):.1f} {frame.y.at(value):.1f}"
        for at, value, first in zip(middle_min.tolist(), values[known].tolist(), broken.tolist(), strict=True)
    )


def _mean(regime: RegimeResidual, frame: Frame, place: float, series: str) -> MeanMark:
    """A mark with its interval, which ends at the frame's ends."""
    _, _, top, bottom = frame.corners

    def y(value: float) -> float:
        return min(max(frame.y.at(value), top), bottom)

    interval = None if regime.low_w is None or regime.high_w is None else (regime.low_w, regime.high_w)
    text = f"{series}: {regime_range(regime.axis, regime.low, regime.high)}, {quantity(regime.mean_w, interval, 'W')}"
    whisker = None if interval is None else (y(interval[0]), y(interval[1]))
    return MeanMark(frame.x.at(place), y(regime.mean_w), series, text, whisker)


def _residual_scale(regimes: Sequence[RegimeResidual]) -> Scale:
    """From 0 over all means to whiskers of usual length: one regime of two short trips must not flatten the others."""
    means = [abs(regime.mean_w) for regime in regimes]
    known = [
        (regime.low_w, regime.high_w) for regime in regimes if regime.low_w is not None and regime.high_w is not None
    ]
    middle = float(np.median([0.5 * (high - low) for low, high in known])) if known else 0.0
    reach = max(means, default=0.0) + FARTHEST * middle
    ends = [min(max(bound, -reach), reach) for pair in known for bound in pair]
    return scale([*(regime.mean_w for regime in regimes), *ends], 202, 44, zero=True)


def _range_labels(axis: Axis, ranges: Sequence[tuple[float, float]]) -> list[str]:
    """Short names of ranges: the unit stands at the axis."""
    unit = AXIS_NAMES[axis][1]
    texts = [regime_range(axis, low, high).removesuffix(f"{SPACE}{unit}") for low, high in ranges]
    return [text.replace(" to ", "…").replace("below ", "< ").replace("above ", "> ") for text in texts]
