"""What a run over graphs of many sizes found, as tables or as JSON."""

from __future__ import annotations

import json
from dataclasses import asdict
from typing import TYPE_CHECKING

from benchmarks.report import markdown_table
from benchmarks.scale.run import EXPONENT_TARGET, GROWTH_TARGET, LOAD_TARGET_S

if TYPE_CHECKING:
    from collections.abc import Callable

    from rich.console import Console
    from rich.table import Table

    from benchmarks.scale.opening import Step
    from benchmarks.scale.run import ScaleReport, SizeFigures
    from benchmarks.searches import Spread


def scale_json(report: ScaleReport) -> str:
    """The report as one JSON object, verdicts included."""
    fields = asdict(report)
    fields["route_growth"], fields["exponent"] = report.route_growth, report.exponent
    for size, said in zip(report.sizes, fields["sizes"], strict=True):
        said["load_met"] = size.load_met
    return json.dumps(fields, indent=1)


def print_scale(report: ScaleReport, console: Console) -> None:
    """Print the report as tables."""
    machine, asked = report.machine, report.settings
    console.print(
        f"{machine.cpu}, {machine.cores} cores, {machine.memory_gb:.0f} GB; Python {machine.python}, "
        f"numpy {machine.numpy}, numba {machine.numba}; load {machine.load:.2f} before, {report.load_after:.2f} after",
    )
    console.print(
        f"vehicle {asked.vehicle}; seed {asked.seed}; {asked.pairs} pairs, {asked.ranges} ranges, "
        f"{asked.sources} sources; {asked.repeat} repetitions",
    )
    tables = (_making, _shapes, _loading, _times, _memory, _arrays, _routes, _to_all)
    for table in tables:
        console.print()
        console.print(table(report))
    console.print()
    for line in verdicts(report):
        console.print(line)


def verdicts(report: ScaleReport) -> tuple[str, ...]:
    """Whether targets are met, a line each."""
    slowest_s = max(size.load_s.median for size in report.sizes)
    growth, exponent = report.route_growth, report.exponent
    return (
        f"load: {slowest_s:.2f} s at most, target <= {LOAD_TARGET_S:g} s: {_verdict(slowest_s <= LOAD_TARGET_S)}",
        f"route of 25 km, largest over smallest graph: {growth:.2f}, target <= {GROWTH_TARGET:g}: "
        f"{_verdict(growth <= GROWTH_TARGET)}",
        f"one to all grows with the links to the power of {exponent:.2f}, target <= {EXPONENT_TARGET:g}: "
        f"{_verdict(exponent <= EXPONENT_TARGET)}",
    )


def _verdict(met: bool) -> str:
    return "met" if met else "missed"


def _making(report: ScaleReport) -> Table:
    table = markdown_table(
        "Making, each in a fresh process", (), ("links", "nodes", "make s", "save s", "peak MB", "saved MB", "kept")
    )
    for size in report.sizes:
        m = size.made
        figures = (f"{m.make_s:.1f}", f"{m.save_s:.2f}", f"{m.peak_mb:.0f}", f"{m.saved_mb:.1f}")
        table.add_row(str(m.links), str(m.nodes), *figures, "yes" if size.kept else "no")
    return table


def _shapes(report: ScaleReport) -> Table:
    heads = ("links", "km²", "links/km²", "road km/km²", "m/link", "turns/link", "points/link", "urban")
    table = markdown_table("What the regions look like", (), heads)
    for size in report.sizes:
        s = size.searched.shape
        row = (f"{s.area_km2:.0f}", f"{s.links_per_km2:.2f}", f"{s.road_km_per_km2:.2f}", f"{s.link_m:.0f}")
        table.add_row(str(size.made.links), *row, f"{s.turns:.2f}", f"{s.points:.2f}", f"{s.urban_frac:.0%}")
    return table


def _loading(report: ScaleReport) -> Table:
    heads = ("links", "load s", "processor s", "private MB", "mapped MB", "target")
    table = markdown_table("Loading, each time in a fresh process", (), heads)
    for size in report.sizes:
        load = size.opened.steps[0]
        memory = (_number(load.private_mb), _number(load.mapped_mb))
        table.add_row(
            str(size.made.links),
            _spread(size.load_s, 1.0, 3),
            f"{size.load_processor_s.median:.3f}",
            *memory,
            _verdict(size.load_met),
        )
    return table


def _times(report: ScaleReport) -> Table:
    title = "Step by step in one fresh process, seconds of the processor"
    return _steps(report, title, lambda step, size: f"{step.processor_s:.3f}")


def _memory(report: ScaleReport) -> Table:
    def per_link(step: Step, size: SizeFigures) -> str:
        if step.private_mb is None or step.mapped_mb is None:
            return "?"
        return " + ".join(str(round(1e6 * mb / size.made.links)) for mb in (step.private_mb, step.mapped_mb))

    table = _steps(report, "What each step leaves resident, bytes a link: private + mapped", per_link)
    table.add_row("most of the process, MB", *(f"{size.opened.peak_mb:.0f}" for size in report.sizes))
    before = (_number(size.opened.before_mb, 0) for size in report.sizes)
    table.add_row("of which before the first step, MB", *before)
    return table


def _steps(report: ScaleReport, title: str, figure: Callable[[Step, SizeFigures], str]) -> Table:
    table = markdown_table(title, ("step",), tuple(f"{size.made.links} links" for size in report.sizes))
    for k, step in enumerate(report.sizes[0].opened.steps):
        table.add_row(step.name, *(figure(size.opened.steps[k], size) for size in report.sizes))
    return table


def _arrays(report: ScaleReport) -> Table:
    """Of the largest graph; arrays under half a byte a link go into the sum alone."""
    size = report.sizes[-1]
    table = markdown_table(f"Arrays at {size.made.links} links", ("kind", "array"), ("bytes a link", "MB"))
    for kind in dict.fromkeys(array.kind for array in size.opened.arrays):
        arrays = [array for array in size.opened.arrays if array.kind == kind]
        for array in arrays:
            if array.size_bytes >= 0.5 * size.made.links:
                table.add_row(kind, array.name, *_size(array.size_bytes, size))
        table.add_row(kind, "all", *_size(sum(array.size_bytes for array in arrays), size))
    return table


def _size(size_bytes: int, size: SizeFigures) -> tuple[str, str]:
    return f"{size_bytes / size.made.links:.1f}", f"{size_bytes / 1e6:.1f}"


def _routes(report: ScaleReport) -> Table:
    heads = ("links", "route ms", "search ms", "first search ms", "labels settled", "µs/label", "snap ms", "range ms")
    table = markdown_table(
        "Routes of 25 km and ranges, time of the processor: medians, quartiles in brackets", (), heads
    )
    for size in report.sizes:
        r = size.searched.routes
        table.add_row(
            str(size.made.links),
            _quartiles(r.whole_s),
            _quartiles(r.again_s),
            _quartiles(r.first_s),
            f"{r.labels_settled.median:.0f}",
            f"{1e6 * r.again_s.median / r.labels_settled.median:.2f}",
            f"{1e3 * r.snap_s.median:.2f}",
            _quartiles(size.searched.area_s),
        )
    return table


def _to_all(report: ScaleReport) -> Table:
    heads = (
        "links",
        "again ms",
        "ns/link",
        "first ms",
        "scalar ms",
        "scalar ns/link",
        "/ scalar",
        "labels/link",
        "rows",
    )
    table = markdown_table(
        "One to all, time of the processor: medians over sources, of ratios also least..most", (), heads
    )
    for size in report.sizes:
        a, links = size.searched.to_all, size.made.links
        table.add_row(
            str(links),
            f"{1e3 * a.again_s.median:.1f}",
            f"{1e9 * a.again_s.median / links:.0f}",
            f"{1e3 * a.first_s.median:.1f}",
            f"{1e3 * a.scalar_s.median:.1f}",
            f"{1e9 * a.scalar_s.median / links:.0f}",
            _spread(a.over_scalar, 1.0, 2),
            f"{a.labels_per_link:.2f}",
            str(a.rows),
        )
    return table


def _spread(figures: Spread, factor: float, digits: int) -> str:
    low, middle, high = (f"{factor * x:.{digits}f}" for x in (figures.least, figures.median, figures.most))
    return f"{middle} ({low}..{high})"


def _quartiles(figures: Spread) -> str:
    return f"{1e3 * figures.median:.1f} ({1e3 * figures.lower_quartile:.1f}..{1e3 * figures.upper_quartile:.1f})"


def _number(value: float | None, digits: int = 1) -> str:
    return "?" if value is None else f"{value:.{digits}f}"
