"""The service as a process of its own, with low limits, and clients that do not keep to the rules."""

from __future__ import annotations

import os
import re
import socket
import subprocess
import sys
import time
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Final

from tests.app.expected import database_in

if TYPE_CHECKING:
    from collections.abc import Iterator

ROOT: Final = Path(__file__).resolve().parents[2]
LISTENING: Final = re.compile(r"(?:Uvicorn running|serving) on http://127\.0\.0\.1:(\d+)")
START_S: Final = 300.0  # a first start compiles
PATIENCE_S: Final = 30.0


@dataclass(frozen=True)
class ServerProcess:
    """A running service."""

    port: int
    process: subprocess.Popen[bytes]
    log: Path

    def connect(self, sent: bytes = b"") -> socket.socket:
        """A connection that has sent this."""
        connection = socket.create_connection(("127.0.0.1", self.port), timeout=PATIENCE_S)
        connection.sendall(sent)
        return connection

    def ask(self, request: bytes) -> bytes:
        """All that the service sends until it closes the connection."""
        with self.connect(request) as connection:
            return received(connection)

    def get(self, path: str, headers: str = "") -> bytes:
        """The answer of GET."""
        return self.ask(f"GET {path} HTTP/1.1\r\nHost: 127.0.0.1\r\nConnection: close\r\n{headers}\r\n".encode())


@contextmanager
def small_server(folder: Path, descriptors: int = 1024, **settings: str) -> Iterator[ServerProcess]:
    """The server with a small application (small_server.py), on a socket that it is given."""
    log = folder / "server.log"
    environment = {name: value for name, value in os.environ.items() if not name.startswith("JOULEPATH_")}
    with socket.create_server(("127.0.0.1", 0)) as listening, log.open("wb") as said:
        port, handed_on = listening.getsockname()[1], listening.fileno()
        command = f'ulimit -n {descriptors}; exec "{sys.executable}" -m tests.app.small_server {handed_on}'
        process = subprocess.Popen(
            ["sh", "-c", command],
            cwd=ROOT,
            env=environment | settings,
            stdout=said,
            stderr=said,
            pass_fds=[handed_on],
        )
    try:
        yield ServerProcess(port, process, log)
    finally:
        process.kill()
        process.wait()


def received(connection: socket.socket) -> bytes:
    """What arrives until the other side closes."""
    whole = b""
    while True:
        try:
            part = connection.recv(65536)
        except ConnectionError:
            return whole
        if not part:
            return whole
        whole += part


@contextmanager
def server_process(folder: Path, graph_dir: Path, descriptors: int = 1024, **settings: str) -> Iterator[ServerProcess]:
    """A service on the hand-made graphs; descriptors: that it may have open."""
    log = folder / "server.log"
    environment = {name: value for name, value in os.environ.items() if not name.startswith("JOULEPATH_")}
    environment |= {
        "JOULEPATH_DATABASE_URL": database_in(folder),
        "JOULEPATH_GRAPH_DIRS": str(graph_dir),
        "JOULEPATH_DEFAULT_GRAPH": "grid",
        **settings,
    }
    command = f'ulimit -n {descriptors}; exec "{sys.executable}" -m app.cli serve --port 0'
    with log.open("wb") as said:
        process = subprocess.Popen(["sh", "-c", command], cwd=ROOT, env=environment, stdout=said, stderr=said)
    try:
        until = time.monotonic() + START_S
        while not (found := LISTENING.search(log.read_text(errors="replace"))):
            assert process.poll() is None, log.read_text(errors="replace")
            assert time.monotonic() < until, log.read_text(errors="replace")
            time.sleep(0.02)
        yield ServerProcess(int(found.group(1)), process, log)
    finally:
        process.terminate()
        try:
            process.wait(PATIENCE_S)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()
