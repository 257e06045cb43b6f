"""Recordings read in a process of their own, and the memory that it took at most."""

from __future__ import annotations

import json
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Final

REPOSITORY: Final = Path(__file__).resolve().parents[2]
READ: Final = """
import json, sys
from pathlib import Path

def peak_mb():  # of this program alone: getrusage counts the one that began it, too
    status = Path("/proc/self/status").read_text().split()
    return int(status[status.index("VmHWM:") + 1]) / 1024

import diagnosis.recordings.reading as reading
from diagnosis.recordings.files import UnpackedBytes
import pyarrow.parquet
begin_mb = peak_mb()
together = UnpackedBytes(int(sys.argv[2])) if sys.argv[2] != "0" else None
found, errors = reading.read_recordings([Path(sys.argv[1])], together=together)
print(json.dumps([peak_mb() - begin_mb, len(found), [str(error) for error in errors]]))
"""


@dataclass(frozen=True, slots=True)
class Measured:
    """Memory beyond that of the process at its begin [MB], how many drives were read, and the errors."""

    peak_mb: float
    drives: int
    errors: list[str]


def read_apart(folder: Path, most_bytes: int = 0) -> Measured:
    """What reading a folder of recordings takes; most_bytes: that may be unpacked of all of them, 0 for no limit."""
    done = subprocess.run(
        [sys.executable, "-c", READ, str(folder), str(most_bytes)],
        capture_output=True,
        text=True,
        check=True,
        cwd=REPOSITORY,
        timeout=60.0,
    )
    peak_mb, drives, errors = json.loads(done.stdout)
    return Measured(peak_mb, drives, errors)
