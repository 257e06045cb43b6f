"""RouteE Compass from its package: the same graph in its files, and a process that answers from them."""

from __future__ import annotations

import os
import shutil
from contextlib import contextmanager
from typing import TYPE_CHECKING, Final

from benchmarks.peers.environments import PeerUnavailableError, Wanted, environment, run_for
from benchmarks.peers.routee_files import write_compass_files
from benchmarks.peers.worker import Worker, working

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    from routing.graph.road_graph import RoadGraph

NAME: Final = "RouteE Compass"
VERSION: Final = "0.19.5"
CAPACITY_KWH: Final = 60.0  # battery_capacity of 2017_CHEVROLET_Bolt.json in the package
# it imports requests, which it declares as an extra only
WANTED: Final = Wanted(NAME, (f"nrel-routee-compass=={VERSION}", "requests>=2.28,<3"), least=(3, 10), most=(3, 13))
IMPORT: Final = "import nrel.routee.compass"
# from glibc 2.38 on, programs are linked with these names of C23; what they add, binary literals, is not used here
NEWER_NAMES: Final = {
    "strtol": "long",
    "strtoul": "unsigned long",
    "strtoll": "long long",
    "strtoull": "unsigned long long",
}


def newer_names_source() -> str:
    """C source of the newer names by the older ones."""
    functions = (
        f"{kind} __isoc23_{name}(const char *text, char **end, int radix) {{ return {name}(text, end, radix); }}"
        for name, kind in NEWER_NAMES.items()
    )
    return "\n".join(("#include <stdlib.h>", *functions, ""))


@contextmanager
def routee(graph: RoadGraph, cache: Path, scratch: Path) -> Iterator[Worker]:
    """The engine on a graph; raises PeerUnavailableError."""
    python = str(environment(WANTED, cache))
    settings = _preload(python, cache)
    folder = scratch / "routee"
    write_compass_files(graph, folder)
    command = [python, "-m", "benchmarks.peers.routee_worker", "serve", str(folder)]
    with working(NAME, command, scratch / "routee.log", **settings) as worker:
        yield worker


def _preload(python: str, cache: Path) -> dict[str, str]:
    """The setting that lets an older glibc load the engine; empty where none is needed."""
    try:
        run_for(NAME, [python, "-c", IMPORT])
    except PeerUnavailableError as error:
        if "__isoc23_" not in error.reason:
            raise
    else:
        return {}
    library = compiled(newer_names_source(), cache)
    before = os.environ.get("LD_PRELOAD")
    return {"LD_PRELOAD": f"{library}:{before}" if before else str(library)}


def compiled(source: str, folder: Path) -> Path:
    """A shared library of a C source, in a folder; raises PeerUnavailableError."""
    compiler = shutil.which("cc") or shutil.which("gcc") or shutil.which("clang")
    if compiler is None:
        raise PeerUnavailableError(NAME, "needs glibc >= 2.38, or a C compiler to stand in for its newer names")
    folder.mkdir(parents=True, exist_ok=True)
    path, library = folder / "newer_names.c", folder / "newer_names.so"
    path.write_text(source, encoding="utf-8")
    run_for(NAME, [compiler, "-shared", "-fPIC", "-O2", "-o", str(library), str(path)])
    return library
