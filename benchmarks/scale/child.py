"""One measurement in a fresh process, printed as a line of JSON; the process that asked reads it back."""

from __future__ import annotations

import json
import subprocess
import sys
from dataclasses import asdict
from pathlib import Path
from typing import Any

from benchmarks.graphs import ROOT
from benchmarks.scale.opening import ArraySize, Opened, Step, load_seconds, open_graph
from benchmarks.scale.regions import RegionShape
from benchmarks.scale.searches import AllFigures, RouteFigures, Searched, search_graph
from benchmarks.searches import Spread


def loaded_in_process(folder: Path) -> tuple[float, float]:
    """How long a fresh process takes to load a graph, by the clock and of the processor [s]."""
    measured = _measured_in_process(["load", str(folder)])
    return float(measured["load_s"]), float(measured["processor_s"])


def opened_in_process(folder: Path, seed: int) -> Opened:
    """What opening a graph takes in a fresh process."""
    measured = _measured_in_process(["open", str(folder), str(seed)])
    return Opened(
        before_mb=measured["before_mb"],
        peak_mb=measured["peak_mb"],
        steps=tuple(Step(**step) for step in measured["steps"]),
        arrays=tuple(ArraySize(**array) for array in measured["arrays"]),
    )


def searched_in_process(folder: Path, pairs: int, ranges: int, sources: int, repeat: int, seed: int) -> Searched:
    """What searches on a graph take in a fresh process."""
    measured = _measured_in_process(["search", str(folder), *map(str, (pairs, ranges, sources, repeat, seed))])
    routes = RouteFigures(**{name: Spread(**value) for name, value in measured["routes"].items()})
    to_all: dict[str, Any] = {
        name: Spread(**value) if isinstance(value, dict) else value for name, value in measured["to_all"].items()
    }
    return Searched(RegionShape(**measured["shape"]), routes, AllFigures(**to_all), Spread(**measured["area_s"]))


def _measured_in_process(arguments: list[str]) -> dict[str, Any]:
    command = [sys.executable, "-m", "benchmarks.scale.child", *arguments]
    done = subprocess.run(command, cwd=ROOT, stdout=subprocess.PIPE, text=True, check=True)
    measured: dict[str, Any] = json.loads(done.stdout)
    return measured


def main(arguments: list[str]) -> int:
    """Measure one thing and print it."""
    kind, folder = arguments[0], Path(arguments[1])
    measured: dict[str, Any]
    if kind == "load":
        measured = dict(zip(("load_s", "processor_s"), load_seconds(folder), strict=True))
    elif kind == "open":
        measured = asdict(open_graph(folder, int(arguments[2])))
    else:
        pairs, ranges, sources, repeat, seed = map(int, arguments[2:])
        measured = asdict(search_graph(folder, pairs, ranges, sources, repeat, seed))
    print(json.dumps(measured))
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
