"""Where files lie: those that come with joulepath, and those that are the user's own."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Final

import platformdirs

NAME: Final = "joulepath"
ROOT: Final = Path(__file__).resolve().parents[1]  # of a checkout, or where packages are installed


def bundled_folder(*parts: str) -> Path:
    """A folder that comes with joulepath, as `data`, `graphs`: in the public package, or beside it in a checkout."""
    installed = ROOT / NAME / Path(*parts)
    return installed if installed.is_dir() else ROOT / Path(*parts)


def user_folder() -> Path:
    """The user's own data: graphs and stored vehicles. It need not exist.

    XDG_DATA_HOME/joulepath where that is an absolute path, else what the system provides for it: ~/.local/share on
    Linux, ~/Library/Application Support on macOS, AppData\\Local on Windows.
    """
    given = os.environ.get("XDG_DATA_HOME", "")
    return Path(given) / NAME if os.path.isabs(given) else Path(platformdirs.user_data_dir(NAME, appauthor=False))


def user_graphs_folder() -> Path:
    """Where graphs of one's own lie, one in each subfolder; it need not exist."""
    return user_folder() / "graphs"
