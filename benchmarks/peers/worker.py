"""An engine in a process of its own, asked line by line."""

from __future__ import annotations

import subprocess
from contextlib import contextmanager
from typing import TYPE_CHECKING, Final

from benchmarks.graphs import ROOT
from benchmarks.peers.environments import PeerUnavailableError, clean_environment, said_last
from benchmarks.peers.questions import READY, EngineAnswer, Question, answer_of, line_of

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

STOP_S: Final = 10.0
ONE_THREAD: Final = {
    "OMP_NUM_THREADS": "1",
    "OPENBLAS_NUM_THREADS": "1",
    "NUMBA_NUM_THREADS": "1",
    "RAYON_NUM_THREADS": "1",
}


class Worker:
    """A process that has said it is ready, and answers one line a line."""

    def __init__(self, engine: str, process: subprocess.Popen[str], log: Path) -> None:
        self._engine = engine
        self._process = process
        self._log = log

    def ask(self, question: Question) -> EngineAnswer:
        """The answer, which may be a refusal; raises PeerUnavailableError where the process has ended."""
        try:
            self._write(line_of(question))
            line = self._line()
        except BrokenPipeError:
            line = ""
        if not line:
            raise self.ended()
        return answer_of(line)

    def wait_until_ready(self) -> None:
        """Wait for it to load; raises PeerUnavailableError where it ends instead."""
        if self._line().strip() != READY:
            raise self.ended()

    def ended(self) -> PeerUnavailableError:
        """Why the process is no more."""
        return PeerUnavailableError(self._engine, said_last(self._log.read_text(encoding="utf-8", errors="replace")))

    def _write(self, line: str) -> None:
        assert self._process.stdin is not None
        self._process.stdin.write(line)
        self._process.stdin.flush()

    def _line(self) -> str:
        assert self._process.stdout is not None
        return self._process.stdout.readline()


@contextmanager
def working(engine: str, command: list[str], log: Path, **settings: str) -> Iterator[Worker]:
    """A worker that is ready, on one thread; raises PeerUnavailableError where it does not get that far."""
    environment = clean_environment(**ONE_THREAD, **settings)
    with log.open("wb") as said:
        process = subprocess.Popen(
            command, cwd=ROOT, env=environment, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=said, text=True
        )
    try:
        worker = Worker(engine, process, log)
        worker.wait_until_ready()
        yield worker
    finally:
        process.terminate()
        try:
            process.communicate(timeout=STOP_S)
        except subprocess.TimeoutExpired:
            process.kill()
            process.communicate()
