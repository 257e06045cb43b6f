"""Builds the manual as a site out of the pages of the repository: `python -m docs.manual [FOLDER]`.

It asks no other host. A link that leads nowhere fails the build.
"""

from __future__ import annotations

import shutil
import sys
import tempfile
from pathlib import Path
from typing import Final

from sphinx.cmd.build import build_main

from docs.manual.reference import write_reference

ROOT: Final = Path(__file__).resolve().parents[2]
DEFAULT: Final = ROOT / "manual"


def build(out: Path) -> int:
    """Write the site to a folder, whole or not at all; 0 where all went well."""
    write_reference(ROOT / "docs" / "reference")
    with tempfile.TemporaryDirectory(dir=out.parent, prefix=".manual.") as scratch:
        made = Path(scratch) / "site"
        flags = ["-q", "-W", "--keep-going", "-b", "html", "-d", f"{scratch}/doctrees", "-c", str(ROOT / "docs/manual")]
        failed = build_main([*flags, str(ROOT), str(made)])
        if failed:
            return failed
        shutil.rmtree(out, ignore_errors=True)
        made.rename(out)
    return 0


if __name__ == "__main__":
    sys.exit(build(Path(sys.argv[1]).resolve() if len(sys.argv) > 1 else DEFAULT))
