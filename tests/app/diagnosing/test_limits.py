"""A process held to its memory, and words for how it has ended."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from app.diagnosing.limits import how_ended

pytestmark = pytest.mark.nojit

HELD = """
from app.diagnosing.limits import held_memory
with held_memory(64 * 1024 * 1024):
    bytearray(30_000_000)
    try:
        bytearray(200_000_000)
    except MemoryError:
        print("refused")
print(len(bytearray(200_000_000)))
"""


@pytest.mark.skipif(not Path("/proc/self/status").exists(), reason="memory is limited on Linux")
def test_memory_beyond_what_is_held_is_refused_until_it_is_lifted() -> None:
    done = subprocess.run([sys.executable, "-c", HELD], capture_output=True, text=True, check=True)
    assert done.stdout.split() == ["refused", "200000000"]


@pytest.mark.parametrize(
    ("exit_code", "text"),
    [
        (-9, "its process was ended by SIGKILL, most likely since the system ran out of memory"),
        (-11, "its process was ended by SIGSEGV"),
        (-99, "its process was ended by signal 99"),
        (1, "its process ended (exit code 1)"),
        (None, "its process ended (exit code None)"),
    ],
)
def test_end_of_a_process_is_told_by_its_signal(exit_code: int | None, text: str) -> None:
    assert how_ended(exit_code) == text
