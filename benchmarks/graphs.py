"""Graphs made and loaded in a fresh process each, which reports its time and memory as one line of JSON."""

from __future__ import annotations

import json
import subprocess
import sys
import time
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path
from typing import Final

import numpy as np

from benchmarks.machine import peak_memory_mb, private_memory_mb, resident_memory_mb

ROOT: Final = Path(__file__).resolve().parent.parent
LOADS: Final = 7


@dataclass(frozen=True, slots=True)
class Made:
    """One graph made and saved by a fresh process.

    make_s: import or generation alone; process_s: all of the process, from the interpreter's start to its end.
    idle_mb: resident before the work, with libraries loaded; peak_mb: most at any time.
    """

    name: str
    kind: str  # "import" | "synth"
    nodes: int
    links: int
    make_s: float
    save_s: float
    process_s: float
    idle_mb: float
    peak_mb: float
    saved_mb: float


@dataclass(frozen=True, slots=True)
class LoadedGraph:
    """One graph loaded by a fresh process, its files in the page cache.

    load_s: median of several; added_mb: resident after the first load; touched_mb: after reading every array to its
    end; private_mb: how much of that no file backs, which is what one more process costs. None where the system
    does not say.
    """

    load_s: float
    added_mb: float | None
    touched_mb: float | None
    private_mb: float | None


def import_in_process(name: str, map_path: Path, dem_paths: list[Path], folder: Path) -> Made:
    """Import a map in a fresh process."""
    return _made(name, "import", [str(folder), str(map_path), *map(str, dem_paths)])


def synthesize_in_process(name: str, links: int, seed: int, folder: Path) -> Made:
    """Generate a synthetic region in a fresh process."""
    return _made(name, "synth", [str(folder), str(links), str(seed)])


def load_in_process(folder: Path) -> LoadedGraph:
    """Load a saved graph in a fresh process."""
    return LoadedGraph(**_measured_in_process(["load", str(folder)])[0])


def _made(name: str, kind: str, arguments: list[str]) -> Made:
    measured, process_s = _measured_in_process([kind, *arguments])
    folder = Path(arguments[0])
    saved_mb = sum(path.stat().st_size for path in folder.iterdir()) / 1e6
    nodes, links = int(measured.pop("nodes")), int(measured.pop("links"))
    return Made(name=name, kind=kind, nodes=nodes, links=links, process_s=process_s, saved_mb=saved_mb, **measured)


def _measured_in_process(arguments: list[str]) -> tuple[dict[str, float], float]:
    """What a fresh process says, and how long it took [s]; its complaints go to stderr."""
    began = time.perf_counter()
    command = [sys.executable, "-m", "benchmarks.graphs", *arguments]
    done = subprocess.run(command, cwd=ROOT, stdout=subprocess.PIPE, text=True, check=True)
    return json.loads(done.stdout), time.perf_counter() - began


def _make(kind: str, arguments: list[str]) -> dict[str, float]:
    from routing.graph.files import save_graph

    folder = Path(arguments[0])
    if kind == "import":
        from routing.importers.region import import_region

        make = partial(import_region, Path(arguments[1]), [Path(x) for x in arguments[2:]], folder.name)
    else:
        from routing.synth import synthesize

        size, seed = int(arguments[1]), int(arguments[2])
        make = partial(synthesize, folder.name, seed=seed, width_km=None, height_km=None, links_target=size)
    idle_mb = peak_memory_mb()
    began = time.perf_counter()
    graph = make()
    made = time.perf_counter()
    save_graph(graph, folder)
    return {
        "nodes": graph.node_count,
        "links": graph.link_count,
        "make_s": made - began,
        "save_s": time.perf_counter() - made,
        "idle_mb": idle_mb,
        "peak_mb": peak_memory_mb(),
    }


def _load(folder: Path) -> LoadedGraph:
    from routing.graph.files import load_graph
    from routing.graph.road_graph import ARRAY_NAMES

    before, private = resident_memory_mb(), private_memory_mb()
    times = [time.perf_counter()]
    graph = load_graph(folder)
    times.append(time.perf_counter())
    loaded = resident_memory_mb()
    for name in ARRAY_NAMES:
        np.max(getattr(graph, name))
    touched, private_after = resident_memory_mb(), private_memory_mb()
    took = [times[1] - times[0]]
    for _ in range(LOADS - 1):
        began = time.perf_counter()
        load_graph(folder)
        took.append(time.perf_counter() - began)
    return LoadedGraph(
        float(np.median(took)),
        difference_mb(loaded, before),
        difference_mb(touched, before),
        difference_mb(private_after, private),
    )


def difference_mb(later: float | None, earlier: float | None) -> float | None:
    """The difference of two figures, None where one of them is."""
    return None if later is None or earlier is None else later - earlier


def main(arguments: list[str]) -> int:
    """Do one thing and print what it took."""
    kind = arguments[0]
    measured = asdict(_load(Path(arguments[1]))) if kind == "load" else _make(kind, arguments[1:])
    print(json.dumps(measured))
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
