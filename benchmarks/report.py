"""What one run of the benchmarks found, as tables or as JSON."""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING

from rich import box
from rich.table import Table

from benchmarks.searches import RESERVE_SOC_FRAC, TARGET_RATIO

if TYPE_CHECKING:
    from rich.console import Console

    from benchmarks.graphs import LoadedGraph, Made
    from benchmarks.machine import Machine
    from benchmarks.models import ModelFigures
    from benchmarks.queries import QueryFigures
    from benchmarks.searches import SearchFigures, Spread


@dataclass(frozen=True, slots=True)
class BenchSettings:
    """What was asked for."""

    vehicle: str
    seed: int
    sources: int
    repeat: int
    pairs: int
    ranges: int


@dataclass(frozen=True, slots=True)
class GraphFigures:
    """Everything measured on one graph."""

    made: Made
    loaded: LoadedGraph
    searches: list[SearchFigures]
    queries: list[QueryFigures]
    models: ModelFigures | None


@dataclass(frozen=True, slots=True)
class Report:
    """One run; notes: what it had to leave out; load_after: of the machine, over the last minute."""

    machine: Machine
    load_after: float
    settings: BenchSettings
    graphs: list[GraphFigures]
    notes: list[str]


def report_json(report: Report) -> str:
    """The report as one JSON object, verdicts included."""
    fields = asdict(report)
    fields["target_ratio"] = TARGET_RATIO
    for graph, said in zip(report.graphs, fields["graphs"], strict=True):
        for figures, row in zip(graph.searches, said["searches"], strict=True):
            row["met"] = figures.met
    return json.dumps(fields, indent=2)


def print_report(report: Report, console: Console) -> None:
    """Print the report as tables."""
    machine, asked = report.machine, report.settings
    console.print(
        f"{machine.cpu}, {machine.cores} cores, {machine.memory_gb:.0f} GB; Python {machine.python}, "
        f"numpy {machine.numpy}, numba {machine.numba}; load {machine.load:.2f} before, {report.load_after:.2f} after",
    )
    console.print(
        f"vehicle {asked.vehicle}; seed {asked.seed}; {asked.sources} sources x {asked.repeat} repetitions, "
        f"{asked.pairs} pairs, {asked.ranges} ranges",
    )
    for note in report.notes:
        console.print(f"note: {note}", style="yellow", markup=False)
    for table in (_searches(report), _making(report), _loading(report), _queries(report), _models(report)):
        console.print()
        console.print(table)
    console.print()
    for graph in report.graphs:
        ratios = [f.worst_ratio for f in graph.searches]
        verdict = "met" if all(f.met for f in graph.searches) else "missed"
        console.print(
            f"{graph.made.name}: ratios {min(ratios):.2f} to {max(ratios):.2f}, target <= {TARGET_RATIO:g}: {verdict}"
        )


def markdown_table(title: str, words: tuple[str, ...], numbers: tuple[str, ...]) -> Table:
    """An empty table that is Markdown when printed; columns of words, then columns of figures."""
    table = Table(title=title, title_justify="left", title_style="bold", box=box.MARKDOWN)
    for heading in words:
        table.add_column(heading, overflow="fold")
    for heading in numbers:
        table.add_column(heading, justify="right", overflow="fold")
    return table


def _searches(report: Report) -> Table:
    title = (
        "One-to-all eco search over scalar Dijkstra by length and by free-flow time: "
        "medians, of ratios also least..most over sources"
    )
    numbers = (
        "search ms",
        "length ms",
        "time ms",
        "/ length",
        "/ time",
        "labels/link",
        "reached",
        "target",
    )
    table = markdown_table(title, ("graph", "stops", "limits"), numbers)
    for graph in report.graphs:
        for f in graph.searches:
            table.add_row(
                graph.made.name,
                f.case.stops.value,
                "unheld" if f.case.soc_frac is None else f"{f.case.soc_frac:.0%}..{RESERVE_SOC_FRAC:.0%}",
                f"{1e3 * f.search_s.median:.1f}",
                f"{1e3 * f.scalar_length_s.median:.1f}",
                f"{1e3 * f.scalar_time_s.median:.1f}",
                _ratio(f.over_length),
                _ratio(f.over_time),
                f"{f.labels_made_per_link:.2f}",
                f"{f.reached_frac:.0%}",
                "met" if f.met else "missed",
            )
    return table


def _making(report: Report) -> Table:
    numbers = ("nodes", "links", "make s", "save s", "process s", "idle MB", "peak MB", "peak B/link")
    table = markdown_table("Import or generation, each in a fresh process", ("graph", "how"), numbers)
    for m in (graph.made for graph in report.graphs):
        table.add_row(
            m.name,
            m.kind,
            str(m.nodes),
            str(m.links),
            f"{m.make_s:.2f}",
            f"{m.save_s:.2f}",
            f"{m.process_s:.2f}",
            f"{m.idle_mb:.0f}",
            f"{m.peak_mb:.0f}",
            f"{1e6 * (m.peak_mb - m.idle_mb) / m.links:.0f}",
        )
    return table


def _loading(report: Report) -> Table:
    numbers = ("saved MB", "B/link", "load ms", "load/make", "added MB", "touched MB", "private MB")
    table = markdown_table("Loading, each in a fresh process", ("graph",), numbers)
    for graph in report.graphs:
        made, loaded = graph.made, graph.loaded
        table.add_row(
            made.name,
            f"{made.saved_mb:.1f}",
            f"{1e6 * made.saved_mb / made.links:.0f}",
            f"{1e3 * loaded.load_s:.1f}",
            f"1/{made.make_s / loaded.load_s:.0f}",
            _megabytes(loaded.added_mb),
            _megabytes(loaded.touched_mb),
            _megabytes(loaded.private_mb),
        )
    return table


def _queries(report: Report) -> Table:
    numbers = ("answered", "refused", "median ms", "95 % ms", "search ms")
    table = markdown_table("Whole queries between random nodes (informative)", ("graph", "query"), numbers)
    for graph in report.graphs:
        for q in graph.queries:
            times = (_milliseconds(x) for x in (q.median_s, q.p95_s, q.search_median_s))
            table.add_row(graph.made.name, q.kind, str(q.count), str(q.refused), *times)
    return table


def _models(report: Report) -> Table:
    numbers = (
        "routes",
        "km",
        "links",
        "steps/km",
        "fast us/km",
        "steps us/km",
        "fast us/link",
        "steps us/link",
        "steps / fast",
        "compiled alone",
        "energy",
    )
    title = "Time-step model over fast model, stops at crossings: medians, of times also least..most over routes"
    table = markdown_table(title, ("graph",), numbers)
    for graph in report.graphs:
        if graph.models is not None:
            m = graph.models
            table.add_row(
                graph.made.name,
                str(m.routes),
                f"{m.km:.0f}",
                str(m.links),
                f"{m.steps_per_km:.0f}",
                f"{m.fast_us_per_km:.1f}",
                f"{m.steps_us_per_km:.1f}",
                f"{m.fast_us_per_link:.2f}",
                f"{m.steps_us_per_link:.2f}",
                _ratio(m.ratio),
                _ratio(m.kernel_ratio),
                f"{m.energy_ratio:.3f}",
            )
    return table


def _ratio(figures: Spread) -> str:
    return f"{figures.median:.2f} ({figures.least:.2f}..{figures.most:.2f})"


def _megabytes(value: float | None) -> str:
    return "?" if value is None else f"{value:.1f}"


def _milliseconds(value: float | None) -> str:
    return "-" if value is None else f"{1e3 * value:.1f}"
