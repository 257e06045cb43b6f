"""Which source made something, so that what an older one has left is not taken for its own."""

from __future__ import annotations

import hashlib
from functools import lru_cache
from pathlib import Path
from typing import Final

ROOT: Final = Path(__file__).resolve().parents[1]
OF_THE_TOOL: Final = ("diagnosis/**/*.py", "energy/**/*.py")
OF_THE_WORLDS: Final = ("proof/worlds/**/*.py", "proof/carriers.py")


@lru_cache(maxsize=4)
def source_hash(patterns: tuple[str, ...]) -> str:
    """SHA-256 over the source files that patterns name below the root of the packages."""
    found = hashlib.sha256()
    for path in sorted({path for pattern in patterns for path in ROOT.glob(pattern)}):
        found.update(path.relative_to(ROOT).as_posix().encode() + b"\0" + path.read_bytes() + b"\0")
    return found.hexdigest()
