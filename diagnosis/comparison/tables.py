"""The source's tables IV to VII, IX and X for any trips, as Markdown."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from energy.units import JOULE_PER_KWH, JOULE_PER_M_PER_KWH_PER_100KM, KMH_PER_MPS, METRE_PER_KM

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Sequence

    from diagnosis.comparison.comparison import (
        Averages,
        Distribution,
        MeanError,
        PairedTest,
        QuantityErrors,
        SeriesComparison,
        TripComparison,
    )

NONE: Final = "–"
METHOD: Final = (
    "Errors are relative to the measurement and positive where the simulation has more.",
    "Averages and errors are means over trips of each trip's own value; `pooled` is the ratio of sums.",
    "A trip whose measured value is not positive has no relative error of it and is left out of that mean.",
    "SD has n − 1; population SD has n.",
    "The interval of the mean is Student's t with n − 1 degrees of freedom at 95 %.",
    "95 % of trips: mean ± 1.96 SD, which supposes a normal distribution.",
    "Quartiles are interpolated linearly.",
    "The paired t-test is two-sided, on the energies in kWh.",
)

_AVERAGES: Final[tuple[tuple[str, Callable[[Averages], str]], ...]] = (
    ("total mass [kg]", lambda mean: NONE if mean.mass_kg is None else f"{mean.mass_kg:.0f}"),
    ("distance [km]", lambda mean: f"{mean.distance_m / METRE_PER_KM:.1f}"),
    ("travel time [h:mm:ss]", lambda mean: clock(mean.duration_s)),
    ("mean speed [km/h]", lambda mean: f"{mean.speed_mps * KMH_PER_MPS:.1f}"),
    ("mean speed, pooled [km/h]", lambda mean: f"{mean.pooled_speed_mps * KMH_PER_MPS:.1f}"),
    ("stops", lambda mean: f"{mean.stop_count:.1f}"),
    ("standstill [s]", lambda mean: f"{mean.standstill_s:.0f}"),
    ("consumption [kWh/100 km]", lambda mean: f"{mean.specific_j_per_m / JOULE_PER_M_PER_KWH_PER_100KM:.1f}"),
    (
        "consumption, pooled [kWh/100 km]",
        lambda mean: f"{mean.pooled_specific_j_per_m / JOULE_PER_M_PER_KWH_PER_100KM:.1f}",
    ),
    ("energy [kWh]", lambda mean: f"{mean.energy_j / JOULE_PER_KWH:.2f}"),
)
_ERRORS: Final[tuple[tuple[str, Callable[[QuantityErrors], MeanError]], ...]] = (
    ("distance", lambda errors: errors.distance),
    ("travel time", lambda errors: errors.duration),
    ("mean speed", lambda errors: errors.speed),
    ("stops", lambda errors: errors.stops),
    ("standstill", lambda errors: errors.standstill),
    ("consumption a km", lambda errors: errors.specific_energy),
    ("energy", lambda errors: errors.energy),
)


def markdown_page(comparison: TripComparison, pictures: Sequence[str] = ()) -> str:
    """All tables of a comparison, with the pictures of the same folder below them."""
    lines = ["# Simulated against measured trips", ""]
    for series in comparison.series:
        lines += [f"## {_cell(series.series)}", "", *_series_lines(comparison.measured, series)]
    lines += ["## How the figures are made", "", *(f"- {sentence}" for sentence in METHOD), ""]
    for name in pictures:
        lines += [f"![{name.removesuffix('.png').replace('-', ' ')}]({name})", ""]
    return "\n".join(lines)


def markdown_table(header: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """A Markdown table, first column to the left and the others to the right."""
    lines = [f"| {' | '.join(header)} |", "|---|" + "--:|" * (len(header) - 1)]
    lines += [f"| {' | '.join(row)} |" for row in rows]
    return "\n".join(lines)


def error_rows(series: SeriesComparison) -> list[tuple[str, ...]]:
    """Table V: one row a quantity, one column a route type."""
    return [(name, *(percent(of(kind.errors).mean_frac) for kind in series.types)) for name, of in _ERRORS]


def spread_rows(series: SeriesComparison) -> list[tuple[str, ...]]:
    """Tables VI and IX: one row a route type with trips, mean, SD, population SD and range of the energy error."""
    rows: list[tuple[str, ...]] = []
    for kind in series.types:
        spread = kind.energy_error
        if spread is None:
            rows.append((_cell(kind.route_type), "0", NONE, NONE, NONE, NONE))
            continue
        extremes = f"{percent(spread.minimum)} to {percent(spread.maximum)}"
        sds = (percent(spread.sd, signed=False), percent(spread.population_sd, signed=False))
        rows.append((_cell(kind.route_type), str(spread.count), percent(spread.mean), *sds, extremes))
    return rows


def overall_rows(spread: Distribution | None) -> list[tuple[str, str]]:
    """Tables VII and X: what is known of the energy errors of all trips."""
    if spread is None:
        return [("trips with a relative error", "0")]
    first, median, third = spread.quartiles
    return [
        ("trips with a relative error", str(spread.count)),
        ("mean", percent(spread.mean)),
        ("95 % confidence interval of the mean", _interval(spread.mean_low, spread.mean_high)),
        ("standard deviation", percent(spread.sd, signed=False)),
        ("95 % of trips are within", _interval(spread.trips_low, spread.trips_high)),
        (
            "minimum, quartiles, maximum",
            ", ".join(map(percent, (spread.minimum, first, median, third, spread.maximum))),
        ),
    ]


def paired_test_sentence(test: PairedTest | None) -> str:
    """What the paired t-test says, in one line."""
    if test is None:
        return "Paired t-test of the energies: needs at least two trips."
    difference = f"mean difference {test.difference_j / JOULE_PER_KWH:+.2f} kWh"
    if test.statistic is None or test.p_value is None:
        return f"Paired t-test of the energies: {difference}; all differences are equal, so there is no t."
    return (
        f"Paired t-test of the energies: {difference}, t = {test.statistic:.2f}, "
        f"{test.degrees_of_freedom} degrees of freedom, p = {test.p_value:.3g}."
    )


def partner_sentences(measured: str, series: SeriesComparison) -> list[str]:
    """Which trips were left out and why; nothing where all have a partner."""
    sentences = []
    for ids, what in (
        (series.measured_only, f"only in {measured}, left out"),
        (series.simulated_only, f"only in {series.series}, left out"),
        (series.undefined, "without a relative error, as the measured energy is not positive"),
    ):
        if ids:
            sentences.append(f"{len(ids)} {'trip' if len(ids) == 1 else 'trips'} {what}: {', '.join(ids)}")
    return sentences


def clock(seconds: float) -> str:
    """Seconds as h:mm:ss."""
    minutes, rest = divmod(round(seconds), 60)
    return f"{minutes // 60}:{minutes % 60:02d}:{rest:02d}"


def percent(value: float | None, *, signed: bool = True, digits: int = 1) -> str:
    """A fraction in percent, or a dash where there is none."""
    if value is None:
        return NONE
    text = f"{100.0 * value:{'+' if signed else ''}.{digits}f} %"
    return text.replace("-", "−")


def _series_lines(measured: str, series: SeriesComparison) -> list[str]:
    kinds = [_cell(kind.route_type) for kind in series.types]
    both = [f"{kind}, {which}" for kind in kinds for which in ("measured", "simulated")]
    rows = [
        (name, *(text for kind in series.types for text in (shown(kind.measured), shown(kind.simulated))))
        for name, shown in _AVERAGES
    ]
    lines = [f"{len(series.pairs)} trips in both {_cell(measured)} and {_cell(series.series)}.", ""]
    for sentence in partner_sentences(measured, series):
        lines += [_cell(sentence), ""]
    lines += ["Averages (as table IV of the source)", "", markdown_table(["", *both], rows), ""]
    lines += ["Mean errors (as table V)", "", markdown_table(["", *kinds], error_rows(series)), ""]
    header = ["route type", "trips", "mean", "SD", "population SD", "range"]
    lines += ["Energy error by route type (as table VI)", "", markdown_table(header, spread_rows(series)), ""]
    lines += [
        "Energy error of all trips (as table VII)",
        "",
        markdown_table(["", ""], overall_rows(series.energy_error)),
    ]
    return [*lines, "", paired_test_sentence(series.paired_test), ""]


def _interval(low: float | None, high: float | None) -> str:
    return NONE if low is None or high is None else f"{percent(low)} to {percent(high)}"


def _cell(text: str) -> str:
    """A text that keeps a Markdown table whole."""
    return text.replace("\\", "\\\\").replace("|", "\\|")
