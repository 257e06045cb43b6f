"""Reading in a process of its own, which is replaced where it hangs, dies or takes too much memory."""

from __future__ import annotations

import multiprocessing
import resource
import tempfile
import warnings
from multiprocessing.connection import Connection
from pathlib import Path

from tests.fuzz.reading import Ending, ending_of
from tests.fuzz.samples import samples

HANG_S = 30.0
MOST_MB = 1000.0


def serve(line: Connection) -> None:
    """Read the files that are named over the line; answers are the ending and the growth of memory [MB]."""
    warnings.simplefilter("ignore")
    with tempfile.TemporaryDirectory() as folder:
        for name, content in samples().items():  # all that is loaded and compiled once counts for no file
            path = Path(folder) / name
            path.write_bytes(content)
            ending_of(path)
        before_mb = _peak_mb()
        line.send("ready")
        while True:
            name, content = line.recv()
            path = Path(folder) / name
            path.write_bytes(content)
            line.send((ending_of(path), _peak_mb() - before_mb))


def _peak_mb() -> float:
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0


class Reader:
    """A process that reads files, and is replaced where it hangs or dies."""

    def __init__(self) -> None:
        self._begin()

    def _begin(self) -> None:
        context = multiprocessing.get_context("spawn")
        self._line, other = context.Pipe()
        self._process = context.Process(target=serve, args=(other,), daemon=True)
        self._process.start()
        other.close()
        self._line.recv()

    def ending(self, name: str, content: bytes) -> Ending:
        """How reading ended, in a fresh process after a failure of memory, a hang or a crash."""
        self._line.send((name, content))
        try:
            if not self._line.poll(HANG_S):
                ending = Ending("failed", f"no end after {HANG_S:g} s")
            else:
                ending, grown_mb = self._line.recv()
                if grown_mb <= MOST_MB:
                    return ending
                ending = Ending("failed", f"took {grown_mb:.0f} MB")
        except EOFError:
            self._process.join()
            ending = Ending("failed", f"the process died with code {self._process.exitcode}")
        self.close()
        self._begin()
        return ending

    def close(self) -> None:
        """End the process."""
        self._process.kill()
        self._process.join()
