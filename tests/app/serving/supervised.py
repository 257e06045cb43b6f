"""A service of several processes, and clients that ask it while something happens to it."""

from __future__ import annotations

import json
import signal
import threading
import time
from collections import Counter
from contextlib import contextmanager
from dataclasses import dataclass
from http.client import HTTPConnection, HTTPException
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from tests.app.server_process import PATIENCE_S, server_process

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from tests.app.server_process import ServerProcess

TRIP: Final = {"start": {"lat": 46.5, "lon": 8.0}, "goal": {"lat": 46.52, "lon": 8.02}, "soc": 0.5}
WORKERS: Final = 2


@dataclass(frozen=True)
class Supervised:
    """A running service."""

    server: ServerProcess

    @property
    def pid(self) -> int:
        """The supervisor's."""
        return self.server.process.pid

    @property
    def log(self) -> str:
        """What it has said so far."""
        return self.server.log.read_text(errors="replace")

    def workers(self) -> set[int]:
        """Processes that serve now."""
        said = self.log
        alive = Path(f"/proc/{self.pid}/task/{self.pid}/children").read_text().split()
        return {int(pid) for pid in alive if f"worker {pid} serves" in said}

    def all_workers(self) -> set[int]:
        """Processes that serve, once there are as many as there should be."""
        until("all workers serve", lambda: len(self.workers()) == WORKERS)
        return self.workers()

    def ask(self, method: str, path: str, body: object = None, *, connection: HTTPConnection | None = None) -> Any:
        """Status and JSON of an answer, by default on a connection of its own."""
        asked = connection or HTTPConnection("127.0.0.1", self.server.port, timeout=PATIENCE_S)
        sent = None if body is None else json.dumps(body)
        asked.request(method, path, sent, {} if sent is None else {"Content-Type": "application/json"})
        answer = asked.getresponse()
        content = answer.read()
        if connection is None:
            asked.close()
        return answer.status, json.loads(content) if content else None

    def signal(self, number: signal.Signals) -> None:
        """Send a signal to the supervisor."""
        self.server.process.send_signal(number)


@contextmanager
def supervised(folder: Path, graph_dir: Path, **settings: str) -> Iterator[Supervised]:
    """A service of two workers."""
    with server_process(folder, graph_dir, JOULEPATH_WORKERS=str(WORKERS), **settings) as server:
        service = Supervised(server)
        service.all_workers()
        yield service


def until(what: str, holds: Callable[[], bool], within_s: float = PATIENCE_S) -> None:
    """Wait for something, and fail where it does not come."""
    end_s = time.monotonic() + within_s
    while not holds():
        assert time.monotonic() < end_s, what
        time.sleep(0.02)


class Askers:
    """Clients that ask for a route again and again, each on a connection that it keeps while it can.

    outcomes: how often each status came, -1 for an answer that did not come; durations: of the routes.
    """

    def __init__(self, service: Supervised, count: int) -> None:
        self.outcomes: Counter[int] = Counter()
        self.durations: set[float] = set()
        self._service = service
        self._stop = threading.Event()
        self._threads = [threading.Thread(target=self._ask) for _ in range(count)]

    def __enter__(self) -> Askers:
        for thread in self._threads:
            thread.start()
        until("answers come", lambda: self.outcomes[200] > len(self._threads))
        return self

    def __exit__(self, *_: object) -> None:
        self._stop.set()
        for thread in self._threads:
            thread.join()

    def await_more(self, count: int) -> None:
        """Wait for so many more answers."""
        enough = self.outcomes[200] + count
        until("more answers come", lambda: self.outcomes[200] >= enough)

    def _ask(self) -> None:
        connection = HTTPConnection("127.0.0.1", self._service.server.port, timeout=PATIENCE_S)
        while not self._stop.is_set():
            try:
                status, answer = self._service.ask("POST", "/route", TRIP, connection=connection)
            except (OSError, HTTPException):
                connection.close()
                time.sleep(0.02)
                status, answer = -1, None
            self.outcomes[status] += 1
            if status == 200:
                self.durations.add(answer["routes"][0]["duration_s"])
        connection.close()
