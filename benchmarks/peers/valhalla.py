"""Valhalla from its package: tiles of the same map, and a process that answers from them."""

from __future__ import annotations

from contextlib import contextmanager
from typing import TYPE_CHECKING, Final

from benchmarks.graphs import ROOT
from benchmarks.peers.environments import Wanted, environment, run_for
from benchmarks.peers.worker import Worker, working

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

NAME: Final = "Valhalla"
VERSION: Final = "3.9.1"
WANTED: Final = Wanted(NAME, (f"pyvalhalla=={VERSION}",), least=(3, 12), most=(3, 14))
WORKER: Final = "benchmarks.peers.valhalla_worker"


@contextmanager
def valhalla(map_path: Path, cache: Path, scratch: Path) -> Iterator[Worker]:
    """The engine on a map; raises PeerUnavailableError."""
    python = str(environment(WANTED, cache))
    folder = scratch / "valhalla"
    run_for(NAME, [python, "-m", WORKER, "build", str(map_path.resolve()), str(folder)], cwd=ROOT)
    with working(NAME, [python, "-m", WORKER, "serve", str(folder)], scratch / "valhalla.log") as worker:
        yield worker
