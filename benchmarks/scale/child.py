"""One measurement in a fresh process, told as one line of JSON; the process that asked reads it back."""

from __future__ import annotations

import json
import subprocess
import sys
from dataclasses import asdict
from pathlib import Path
from typing import Any

from benchmarks.graphs import ROOT
from benchmarks.scale.opening import ArraySize, Opened, Step, load_seconds, open_graph
from benchmarks.scale.regions import Shape
from benchmarks.scale.searches import AllFigures, RouteFigures, Searched, search_graph
from benchmarks.searches import Spread


def loaded_in_process(folder: Path) -> tuple[float, float]:
    """How long a fresh process takes to load a graph, by the clock and of the processor [s]."""
    told = _told(["load", str(folder)])
    return float(told["load_s"]), float(told["processor_s"])


def opened_in_process(folder: Path, seed: int) -> Opened:
    """What opening a graph takes in a fresh process."""
    told = _told(["open", str(folder), str(seed)])
    return Opened(
        before_mb=told["before_mb"],
        peak_mb=told["peak_mb"],
        steps=tuple(Step(**step) for step in told["steps"]),
        arrays=tuple(ArraySize(**array) for array in told["arrays"]),
    )


def searched_in_process(folder: Path, pairs: int, ranges: int, sources: int, repeat: int, seed: int) -> Searched:
    """What searches on a graph take in a fresh process."""
    told = _told(["search", str(folder), *map(str, (pairs, ranges, sources, repeat, seed))])
    routes = RouteFigures(**{name: Spread(**value) for name, value in told["routes"].items()})
    to_all: dict[str, Any] = {
        name: Spread(**value) if isinstance(value, dict) else value for name, value in told["to_all"].items()
    }
    return Searched(Shape(**told["shape"]), routes, AllFigures(**to_all), Spread(**told["area_s"]))


def _told(arguments: list[str]) -> dict[str, Any]:
    command = [sys.executable, "-m", "benchmarks.scale.child", *arguments]
    done = subprocess.run(command, cwd=ROOT, stdout=subprocess.PIPE, text=True, check=True)
    told: dict[str, Any] = json.loads(done.stdout)
    return told


def main(arguments: list[str]) -> int:
    """Measure one thing and tell it."""
    kind, folder = arguments[0], Path(arguments[1])
    told: dict[str, Any]
    if kind == "load":
        told = dict(zip(("load_s", "processor_s"), load_seconds(folder), strict=True))
    elif kind == "open":
        told = asdict(open_graph(folder, int(arguments[2])))
    else:
        pairs, ranges, sources, repeat, seed = map(int, arguments[2:])
        told = asdict(search_graph(folder, pairs, ranges, sources, repeat, seed))
    print(json.dumps(told))
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
