"""The source's figures 4 to 7 for any trips: histograms of energy errors, and box plots of errors and energies."""

from __future__ import annotations

import math
from io import BytesIO
from typing import TYPE_CHECKING, Final

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from energy.units import JOULE_PER_KWH

if TYPE_CHECKING:
    from collections.abc import Sequence

    from matplotlib.axes import Axes

    from diagnosis.comparison.comparison import Distribution, SeriesComparison, TripComparison

DPI: Final = 120
BIN_PERCENT: Final = 5.0
MOST_BINS: Final = 60
FONT_PT: Final = 12
BOX: Final = "#4a7ab5"
BOX_FILL: Final = "#dbe7f5"
MEDIAN: Final = "#c0392b"
MEAN: Final = "#111111"
TRIP: Final = "#5c6670"
ERROR_LABEL: Final = "energy error [%], positive: simulation larger"
LEGEND: Final = "circles: trips   cross: mean   red line: median   box: quartiles   whiskers: minimum and maximum"


def error_histogram_png(series: SeriesComparison, width_px: int = 960, height_px: int = 600) -> bytes:
    """Histogram of a series' energy errors in classes of 5 %, with their mean and normal density (figures 4, 5).

    Raises ValueError where no trip has a relative error.
    """
    spread = series.energy_error
    if spread is None:
        raise ValueError(f"series {series.series!r} has no relative error of energy")
    percents = 100.0 * np.array(error_fracs(series))
    edges = bin_edges(float(percents.min()), float(percents.max()))
    figure, axes = _figure(width_px, height_px)
    axes.hist(percents, bins=edges, color=BOX_FILL, edgecolor=BOX, linewidth=1.2)
    axes.axvline(0.0, color=TRIP, linewidth=1.0)
    axes.axvline(100.0 * spread.mean, color=MEAN, linestyle="--", linewidth=1.6, label=f"mean {spread.mean:+.1%}")
    if spread.sd is not None and spread.sd > 0.0:
        mean, sd = 100.0 * spread.mean, 100.0 * spread.sd
        x = np.linspace(min(edges[0], mean - 3.0 * sd), max(edges[-1], mean + 3.0 * sd), 400)
        density = np.exp(-0.5 * ((x - mean) / sd) ** 2) / (sd * math.sqrt(2.0 * math.pi))
        expected = density * percents.size * (edges[1] - edges[0])
        axes.plot(x, expected, color=MEDIAN, linewidth=1.6, label=f"normal distribution, SD {sd:.1f} %")
    axes.set_xlabel(ERROR_LABEL, fontsize=FONT_PT)
    axes.set_ylabel("number of trips", fontsize=FONT_PT)
    axes.yaxis.set_major_locator(MaxNLocator(integer=True))
    axes.set_ylim(bottom=0.0)
    axes.set_title(f"{_plain(series.series)}: energy errors of {percents.size} trips", fontsize=FONT_PT + 2)
    axes.legend(fontsize=FONT_PT - 1, frameon=False)
    return _png(figure)


def error_boxes_png(comparison: TripComparison) -> bytes:
    """Box plot of energy errors, a row a series (figure 6); series without a relative error are left out.

    Raises ValueError where that leaves none.
    """
    rows = [
        (series.series, [100.0 * error for error in error_fracs(series)], series.energy_error)
        for series in comparison.series
        if series.energy_error is not None
    ]
    return _boxes_png(
        [(name, values, spread, 100.0) for name, values, spread in rows],
        ERROR_LABEL,
        f"Energy errors against the series {_plain(comparison.measured)}",
        zero=True,
    )


def type_boxes_png(series: SeriesComparison) -> bytes:
    """Box plot of one series' energy errors, a row a route type; types without a relative error are left out."""
    rows: list[tuple[str, list[float], Distribution, float]] = []
    for kind in series.types:
        errors = [
            100.0 * error
            for pair in series.pairs
            if pair.measured.route_type == kind.route_type and (error := pair.energy_error_frac) is not None
        ]
        if kind.energy_error is not None:
            rows.append((kind.route_type, errors, kind.energy_error, 100.0))
    return _boxes_png(
        rows,
        ERROR_LABEL,
        f"{_plain(series.series)}: energy errors by route type",
        zero=True,
    )


def energy_boxes_png(comparison: TripComparison) -> bytes:
    """Box plot of energies: the measured trips, then a row a series over the trips it shares with them (figure 7).

    Where series lack different trips, each series is preceded by the measured trips that it has.
    """
    rows: list[tuple[str, list[float], Distribution, float]] = []
    shown: tuple[str, ...] = ()
    for series in comparison.series:
        ids = tuple(pair.measured.trip_id for pair in series.pairs)
        if ids != shown:
            measured = [pair.measured.energy_j / JOULE_PER_KWH for pair in series.pairs]
            rows.append((comparison.measured, measured, series.measured_energy_j, 1.0 / JOULE_PER_KWH))
            shown = ids
        simulated = [pair.simulated.energy_j / JOULE_PER_KWH for pair in series.pairs]
        rows.append((series.series, simulated, series.simulated_energy_j, 1.0 / JOULE_PER_KWH))
    return _boxes_png(rows, "energy of a trip [kWh]", "Energies of the trips", zero=False)


def error_fracs(series: SeriesComparison) -> list[float]:
    """Relative energy errors of a series' trips that have one [-]."""
    return [error for pair in series.pairs if (error := pair.energy_error_frac) is not None]


def bin_edges(low_percent: float, high_percent: float) -> list[float]:
    """Edges of equal classes at multiples of their width, 5 % or, where that makes more than 60, wider.

    low_percent ≤ high_percent; a value on an edge belongs to the class above it, so the last edge is above all.
    """
    width = BIN_PERCENT
    while (high_percent - low_percent) / width > MOST_BINS - 2:
        width *= 2.0
    first = math.floor(low_percent / width)
    last = math.floor(high_percent / width) + 1
    return [k * width for k in range(first, last + 1)]


def _boxes_png(
    rows: Sequence[tuple[str, list[float], Distribution, float]], label: str, title: str, *, zero: bool
) -> bytes:
    """Rows from the top: name, values as drawn, their distribution, and the factor from its unit to the drawn one."""
    if not rows:
        raise ValueError("no values to draw a box of")
    figure, axes = _figure(960, 190 + 90 * len(rows))
    if zero:
        axes.axvline(0.0, color=TRIP, linewidth=1.0)
    height = 0.5
    for row, (_, values, spread, factor) in enumerate(rows):
        first, median, third = (factor * quartile for quartile in spread.quartiles)
        low, high = factor * spread.minimum, factor * spread.maximum
        axes.plot([low, first], [row, row], color=BOX, linewidth=1.4)
        axes.plot([third, high], [row, row], color=BOX, linewidth=1.4)
        for end in (low, high):
            axes.plot([end, end], [row - 0.25 * height, row + 0.25 * height], color=BOX, linewidth=1.4)
        axes.barh(
            row, third - first, left=first, height=height, facecolor=BOX_FILL, edgecolor=BOX, linewidth=1.4, zorder=2
        )
        axes.plot([median, median], [row - 0.5 * height, row + 0.5 * height], color=MEDIAN, linewidth=2.2, zorder=3)
        axes.plot(
            values, _spread_rows(values, row), "o", markerfacecolor="none", markeredgecolor=TRIP, markersize=6, zorder=4
        )
        axes.plot([factor * spread.mean], [row], "x", color=MEAN, markersize=11, markeredgewidth=2.2, zorder=5)
    axes.set_yticks(
        range(len(rows)), [f"{_plain(name)}\n{len(values)} trips" for name, values, _, _ in rows], fontsize=FONT_PT
    )
    axes.set_ylim(len(rows) - 0.4, -0.6)
    axes.grid(axis="x", color="#e3e6e8", linewidth=0.8, zorder=0)
    axes.set_axisbelow(True)
    axes.set_xlabel(label, fontsize=FONT_PT)
    figure.supxlabel(LEGEND, fontsize=FONT_PT - 2, color=TRIP)
    axes.set_title(title, fontsize=FONT_PT + 2)
    return _png(figure)


def _spread_rows(values: Sequence[float], row: float) -> list[float]:
    """Heights of the circles: three lanes in turn by rank, so that near neighbours stay apart."""
    lanes = (-0.11, 0.0, 0.11)
    heights = [0.0] * len(values)
    for rank, position in enumerate(sorted(range(len(values)), key=values.__getitem__)):
        heights[position] = row + lanes[rank % len(lanes)]
    return heights


def _plain(name: str) -> str:
    """A name as matplotlib shows it unchanged: a $ would start a formula; cut where it would fill the picture."""
    return (name if len(name) <= 20 else f"{name[:19]}…").replace("$", r"\$")


def _figure(width_px: int, height_px: int) -> tuple[Figure, Axes]:
    figure = Figure(figsize=(width_px / DPI, height_px / DPI), dpi=DPI, layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.add_subplot()
    axes.tick_params(labelsize=FONT_PT)
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)
    return figure, axes


def _png(figure: Figure) -> bytes:
    file = BytesIO()
    figure.savefig(file, format="png", dpi=DPI)
    return file.getvalue()
