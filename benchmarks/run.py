"""`joulepath bench`: all measurements in one run."""

from __future__ import annotations

import argparse
import io
import os
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path
from subprocess import CalledProcessError
from typing import TYPE_CHECKING, Final

import numpy as np
from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

from benchmarks.graphs import ROOT, Made, import_in_process, load_in_process, synthesize_in_process
from benchmarks.machine import this_machine
from benchmarks.models import measure_models
from benchmarks.peers.environments import default_cache
from benchmarks.queries import measure_queries
from benchmarks.report import BenchSettings, GraphFigures, Report, print_report, report_json
from benchmarks.scale.regions import cache_folder
from benchmarks.scale.report import print_scale, scale_json
from benchmarks.scale.run import LINKS, measure_scale, scale_settings
from benchmarks.searches import draw_sources, measure_searches
from benchmarks.terrain import write_hills
from energy.vehicle.files import load_vehicle
from routing.errors import RoutingError
from routing.graph.files import load_graph

if TYPE_CHECKING:
    from collections.abc import Callable

VEHICLE: Final = "hyundai-kona-64"
SMALLEST_SYNTH_LINKS: Final = 500
PAGE_WIDTH: Final = 160  # where the output is no terminal


@dataclass(frozen=True, slots=True)
class RegionMap:
    """A map file to import and its elevation file, None for made-up hills."""

    name: str
    map_file: str
    dem_file: str | None


REGIONS: Final = (
    RegionMap("porto", "porto.osm.pbf", None),
    RegionMap("andorra", "andorra.osm.pbf", "N42E001.hgt.zip"),
)


def main(argv: list[str]) -> int:
    """Measure and print; 0, whether the target is met or not, 1 where measuring failed."""
    asked = _options().parse_args(argv)
    errors = Console(stderr=True, soft_wrap=True)
    if asked.web:
        return _measure_web(asked, errors)
    if asked.peers:
        return _measure_peers(asked, errors)
    if asked.scale:
        return _measure_scale(asked, errors)
    machine = this_machine()
    notes: list[str] = []
    if machine.load >= 1.0:
        notes.append(f"the machine was not quiet: load {machine.load:.2f} before the run")
    try:
        with tempfile.TemporaryDirectory(prefix="joulepath-bench-") as scratch, _progress(errors) as progress:
            made = _make_graphs(asked.maps, asked.synth_links, asked.seed, Path(scratch), notes, progress)
            graphs = [_measure(figures, folder, asked, progress) for figures, folder in made]
    except (CalledProcessError, ValueError, RoutingError) as error:
        errors.print(str(error), style="red", markup=False, highlight=False)
        return 1
    settings = BenchSettings(VEHICLE, asked.seed, asked.sources, asked.repeat, asked.pairs, asked.ranges)
    report = Report(machine, os.getloadavg()[0], settings, graphs, notes)
    if asked.json:
        print(report_json(report))
    else:
        _show(lambda console: print_report(report, console))
    return 0


def _show(prints: Callable[[Console], None]) -> None:
    """Print to the terminal, or as a page of fixed width where there is none."""
    console = Console(highlight=False)
    if console.is_terminal:
        prints(console)
        return
    page = Console(highlight=False, file=io.StringIO(), record=True, width=PAGE_WIDTH)
    prints(page)
    print("\n".join(line.rstrip() for line in page.export_text().splitlines()))


def _measure_peers(asked: argparse.Namespace, errors: Console) -> int:
    from benchmarks.peers import run, tables

    order = run.Order(asked.maps, asked.peer_cache, asked.seed, asked.pairs, asked.ranges)
    try:
        with _progress(errors) as progress:
            report = run.measure_peers(order, progress)
    except (CalledProcessError, RuntimeError, ValueError, RoutingError) as error:
        errors.print(str(error), style="red", markup=False, highlight=False)
        return 1
    if asked.json:
        print(tables.report_json(report))
    else:
        _show(lambda console: tables.print_report(report, console))
    return 0


def _measure_scale(asked: argparse.Namespace, errors: Console) -> int:
    settings = scale_settings(asked.scale_links, asked.seed, asked.pairs, asked.ranges, asked.sources, asked.repeat)
    try:
        with _progress(errors) as progress:
            bar = progress.add_task("", total=None)
            report = measure_scale(settings, asked.scale_cache, lambda step: progress.update(bar, description=step))
    except (CalledProcessError, OSError) as error:
        errors.print(str(error), style="red", markup=False, highlight=False)
        return 1
    if asked.json:
        print(scale_json(report))
    else:
        _show(lambda console: print_scale(report, console))
    return 0


def _measure_web(asked: argparse.Namespace, errors: Console) -> int:
    try:
        from benchmarks.web import print_web  # a browser's driver is among what tests need, not what the service needs
    except ModuleNotFoundError as error:
        errors.print(f"{error}; `make test` installs it", style="red", markup=False, highlight=False)
        return 1
    try:
        print_web(asked.repeat, asked.json)
    except RuntimeError as error:
        errors.print(str(error), style="red", markup=False, highlight=False)
        return 1
    return 0


def _options() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="joulepath bench", description="Speed and memory, as ratios in one run.")
    maps = ROOT.parent / "shared/data/maps"
    parser.add_argument("--maps", type=Path, default=maps, metavar="DIR", help="folder of the map files")
    parser.add_argument("--seed", type=int, default=1, help="of sources, pairs, hills and the synthetic region")
    parser.add_argument(
        "--sources", type=_at_least(1), default=15, help="one-to-all searches a graph and case; with --scale 3 at most"
    )
    parser.add_argument("--repeat", type=_at_least(1), default=3, help="timings of each search; their median counts")
    parser.add_argument("--pairs", type=_at_least(1), default=40, help="routes a graph and weighting")
    parser.add_argument("--ranges", type=_at_least(1), default=10, help="range queries a graph")
    parser.add_argument(
        "--synth-links",
        type=_at_least(SMALLEST_SYNTH_LINKS),
        default=100_000,
        help="links of the synthetic region",
    )
    instead = parser.add_mutually_exclusive_group()
    instead.add_argument("--web", action="store_true", help="measure the web map in a browser instead of all else")
    instead.add_argument("--peers", action="store_true", help="measure RouteE Compass and Valhalla beside ours instead")
    parser.add_argument(
        "--peer-cache", type=Path, default=default_cache(), metavar="DIR", help="folder of their environments"
    )
    instead.add_argument("--scale", action="store_true", help="measure what grows with the graph instead of all else")
    parser.add_argument(
        "--scale-links",
        type=_sizes,
        default=LINKS,
        metavar="N,…",
        help="links of the regions that --scale makes",
    )
    parser.add_argument(
        "--scale-cache", type=Path, default=cache_folder(), metavar="DIR", help="where --scale keeps them"
    )
    parser.add_argument("--json", action="store_true", help="print one JSON object")
    return parser


def _at_least(least: int) -> Callable[[str], int]:
    def number(text: str) -> int:
        value = int(text)
        if value < least:
            raise argparse.ArgumentTypeError(f"is {value}, allowed: at least {least}")
        return value

    return number


def _sizes(text: str) -> tuple[int, ...]:
    return tuple(_at_least(SMALLEST_SYNTH_LINKS)(size) for size in text.split(","))


def _make_graphs(
    maps: Path, synth_links: int, seed: int, scratch: Path, notes: list[str], progress: Progress
) -> list[tuple[Made, Path]]:
    """Every graph whose files are there, made in the scratch folder; what is missing goes to the notes."""
    made = []
    for region in REGIONS:
        map_path = maps / region.map_file
        needed = [map_path, *([maps / region.dem_file] if region.dem_file else [])]
        missing = [path.name for path in needed if not path.is_file()]
        if missing:
            notes.append(f"{region.name} left out: no {' and no '.join(missing)} in {maps}")
            continue
        bar = progress.add_task(f"import {region.name}", total=None)
        dem_path = needed[-1]
        if region.dem_file is None:
            dem_path = scratch / f"{region.name}-hills.tif"
            write_hills(map_path, dem_path, seed)
        folder = scratch / region.name
        made.append((import_in_process(region.name, map_path, [dem_path], folder), folder))
        progress.update(bar, total=1.0, completed=1.0)
    bar = progress.add_task("generate synth", total=None)
    made.append((synthesize_in_process("synth", synth_links, seed, scratch / "synth"), scratch / "synth"))
    progress.update(bar, total=1.0, completed=1.0)
    return made


def _measure(made: Made, folder: Path, asked: argparse.Namespace, progress: Progress) -> GraphFigures:
    loaded = load_in_process(folder)
    graph = load_graph(folder)
    vehicle = load_vehicle(ROOT / "data/vehicles" / f"{VEHICLE}.toml")
    bar = progress.add_task(f"search {made.name}", total=1.0)
    sources = draw_sources(graph, asked.sources, np.random.default_rng(asked.seed))
    searches = measure_searches(
        graph, vehicle, sources, asked.repeat, lambda done: progress.update(bar, completed=done)
    )
    bar = progress.add_task(f"ask {made.name}", total=1.0)
    queries = measure_queries(
        graph,
        vehicle,
        asked.pairs,
        asked.ranges,
        np.random.default_rng(asked.seed),
        lambda done: progress.update(bar, completed=done),
    )
    bar = progress.add_task(f"drive {made.name}", total=1.0)
    models = measure_models(
        graph,
        vehicle,
        asked.pairs,
        asked.repeat,
        np.random.default_rng(asked.seed),
        lambda done: progress.update(bar, completed=done),
    )
    return GraphFigures(made, loaded, searches, queries, models)


def _progress(console: Console) -> Progress:
    columns = (TextColumn("{task.description}"), BarColumn(), TimeElapsedColumn())
    return Progress(*columns, console=console, disable=not console.is_terminal)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
