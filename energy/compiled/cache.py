"""Where compiled kernels are cached: a folder keyed by the kernels' own text, so that an edit is never missed.

numba's disk cache looks only at the file of the function it caches; a kernel that calls a jitted function
of another file would keep the old one. Importing this module before a kernel is compiled sets the folder.
"""

from __future__ import annotations

import hashlib
import os
from pathlib import Path
from typing import Final

import numba

PACKAGES: Final = ("diagnosis", "energy", "routing")


def _cache_folder() -> Path:
    root = Path(__file__).resolve().parents[2]
    digest = hashlib.sha256(numba.__version__.encode())
    for path in sorted(path for package in PACKAGES for path in (root / package).rglob("kernels*.py")):
        digest.update(path.relative_to(root).as_posix().encode())
        digest.update(path.read_bytes())
    home = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
    return home / "joulepath" / "kernels" / digest.hexdigest()[:16]


if not os.environ.get("NUMBA_CACHE_DIR"):
    setattr(numba.config, "CACHE_DIR", str(_cache_folder()))  # noqa: B010  (numba's stubs don't know it)
