"""A service in a process of its own, as `joulepath serve` starts it, and what the system says of that process."""

from __future__ import annotations

import os
import re
import subprocess
import sys
import time
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

ROOT: Final = Path(__file__).resolve().parents[2]
START_LIMIT_S: Final = 300.0  # a first start compiles
TICKS: Final = os.sysconf("SC_CLK_TCK")
PAGE_BYTES: Final = os.sysconf("SC_PAGE_SIZE")


class Served:
    """A running service: where it listens, and its process."""

    def __init__(self, url: str, process: subprocess.Popen[bytes], log: Path) -> None:
        self.url = url
        self.process = process
        self.log = log

    @property
    def alive(self) -> bool:
        """Whether the process runs."""
        return self.process.poll() is None

    def cpu_s(self) -> float:
        """Processor time that it has used so far [s]."""
        after_name = Path(f"/proc/{self.process.pid}/stat").read_text().rpartition(")")[2].split()
        return (int(after_name[11]) + int(after_name[12])) / TICKS

    def held_bytes(self) -> int:
        """Memory that is its own or shared, as far as it lies in memory [B]."""
        return held_bytes(self.process.pid)


def held_bytes(pid: int) -> int:
    """Memory of a process, as far as it lies in memory [B]."""
    return int(Path(f"/proc/{pid}/statm").read_text().split()[1]) * PAGE_BYTES


@contextmanager
def served(folder: Path, settings: Mapping[str, object]) -> Iterator[Served]:
    """A service on a free port, its settings by their names without JOULEPATH_; the folder takes log and database."""
    log = folder / "log.txt"
    command = [sys.executable, "-m", "app.cli", "serve", "--host", "127.0.0.1", "--port", "0"]
    plain = {name: value for name, value in os.environ.items() if not name.startswith("JOULEPATH_")}
    plain["JOULEPATH_DATABASE_URL"] = f"sqlite:///{folder / 'vehicles.sqlite'}"
    plain |= {f"JOULEPATH_{name.upper()}": str(value) for name, value in settings.items()}
    with (
        log.open("wb") as written,
        subprocess.Popen(command, cwd=ROOT, env=plain, stdout=written, stderr=written) as process,
    ):
        try:
            yield Served(_address(log, process), process, log)
        finally:
            process.terminate()
            try:
                process.wait(20.0)
            except subprocess.TimeoutExpired:
                process.kill()


def _address(log: Path, process: subprocess.Popen[bytes]) -> str:
    until = time.monotonic() + START_LIMIT_S
    while time.monotonic() < until:
        said = log.read_text(encoding="utf-8")
        if found := re.search(r"running on (http://127\.0\.0\.1:\d+)", said):
            return found[1]
        assert process.poll() is None, said
        time.sleep(0.05)
    raise AssertionError(f"the server does not listen: {log.read_text(encoding='utf-8')}")
