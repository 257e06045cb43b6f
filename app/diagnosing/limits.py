"""What one diagnosis may take, and how its process is held to it."""

from __future__ import annotations

import signal
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from collections.abc import Iterator

STATUS: Final = Path("/proc/self/status")
OUT_OF_MEMORY_SCORE: Final = Path("/proc/self/oom_score_adj")
FIRST_TO_GO: Final = "1000"  # of the scale's -1000 to 1000


@dataclass(frozen=True, slots=True)
class JobLimits:
    """Of one diagnosis: memory beyond program and graph [B], time from its begin [s], what its files unpack to [B]."""

    memory_bytes: int
    time_s: float
    unpacked_bytes: int


@contextmanager
def held_memory(more_bytes: int) -> Iterator[None]:
    """Limits the memory that this process writes to, to so much more than it has already, for a while.

    Beyond it, allocations fail as MemoryError. Nothing is limited where the system does not say how much there is.
    """
    used = _data_bytes()
    if used is None:
        yield
        return
    import resource  # which not every system has

    before = resource.getrlimit(resource.RLIMIT_DATA)
    most = min(used + more_bytes, *(limit for limit in before if limit != resource.RLIM_INFINITY), 2**62)
    resource.setrlimit(resource.RLIMIT_DATA, (most, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_DATA, before)


def go_first() -> None:
    """Have the system end this process, and not the service, where all of its memory is used up."""
    with suppress(OSError):
        OUT_OF_MEMORY_SCORE.write_text(FIRST_TO_GO, encoding="ascii")


def how_ended(exit_code: int | None) -> str:
    """In words, why a process has ended without an outcome."""
    if exit_code is None or exit_code >= 0:
        return f"its process ended (exit code {exit_code})"
    with suppress(ValueError):
        name = signal.Signals(-exit_code).name
        likely = ", most likely since the system ran out of memory" if name == "SIGKILL" else ""
        return f"its process was ended by {name}{likely}"
    return f"its process was ended by signal {-exit_code}"


def _data_bytes() -> int | None:
    """Memory of this process that counts for its limit of data [B]; None where the system does not say."""
    try:
        lines = STATUS.read_text(encoding="ascii", errors="replace").splitlines()
    except OSError:
        return None
    kilobytes = next((line.split()[1] for line in lines if line.startswith("VmData:")), None)
    return None if kilobytes is None else 1024 * int(kilobytes)
