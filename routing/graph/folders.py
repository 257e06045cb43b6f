"""Stored graphs by their names, out of folders that hold one in each subfolder."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING

from routing.graph.files import load_meta

if TYPE_CHECKING:
    from collections.abc import Iterable
    from pathlib import Path


def graph_folders(parents: Iterable[Path]) -> dict[str, Path]:
    """Folder of each stored graph by its name, in alphabetic order; the first folder of a name wins.

    A parent that is not there, or that may not be looked at, holds none. Raises GraphFormatError where a folder's
    meta.json is damaged or of another version.
    """
    found: dict[str, Path] = {}
    for parent in parents:
        if not os.path.isdir(parent):
            continue
        for folder in sorted(parent.iterdir()):
            if not folder.name.startswith(".") and (folder / "meta.json").is_file():
                found.setdefault(load_meta(folder).name, folder)
    return dict(sorted(found.items()))
