"""The folder of a service's uploaded files, and what services that are gone have left of theirs."""

from __future__ import annotations

import logging
import os
import shutil
import stat
import tempfile
import time
from contextlib import suppress
from pathlib import Path
from typing import Final

LOG: Final = logging.getLogger(__name__)
PREFIX: Final = "joulepath-spool-"
UNLOCKED_PREFIX: Final = "joulepath-diagnoses-"  # of versions that did not lock their folders
ABANDONED_S: Final = 86_400.0  # without a change in one of those


class Spool:
    """A folder for uploads that is locked as long as its process lives, so that others know whether it is in use.

    Raises OSError where it can't be made.
    """

    def __init__(self) -> None:
        self.folder, self._lock = _locked_folder()

    def new_folder(self) -> Path:
        """A folder for the files of one diagnosis; raises OSError."""
        return Path(tempfile.mkdtemp(dir=self.folder))

    def close(self) -> None:
        """Remove the folder with all that is in it."""
        shutil.rmtree(self.folder, ignore_errors=True)
        os.close(self._lock)


def sweep() -> list[Path]:
    """Remove the folders of services of this user that are gone, and return them."""
    removed: list[Path] = []
    try:
        with os.scandir(tempfile.gettempdir()) as entries:
            named = [Path(entry.path) for entry in entries if entry.name.startswith((PREFIX, UNLOCKED_PREFIX))]
    except OSError:
        return removed
    for folder in named:
        with suppress(OSError):
            if _is_abandoned(folder):
                shutil.rmtree(folder, ignore_errors=True)
                removed.append(folder)
                LOG.info("removed %s, which a service that is gone has left", folder)
    return removed


def _locked_folder() -> tuple[Path, int]:
    """A new folder, and what holds its lock."""
    while True:
        folder = Path(tempfile.mkdtemp(prefix=PREFIX))
        with suppress(FileNotFoundError, BlockingIOError):  # swept in the moment before it was locked
            lock = _lock(folder)
            if folder.exists():
                return folder, lock
            os.close(lock)


def _is_abandoned(folder: Path) -> bool:
    """Whether a folder is one of this user that no process holds; raises OSError, as where it is held."""
    status = folder.lstat()
    if not stat.S_ISDIR(status.st_mode) or status.st_uid != os.getuid():
        return False
    if folder.name.startswith(UNLOCKED_PREFIX):
        return time.time() - status.st_mtime > ABANDONED_S
    os.close(_lock(folder))
    return True


def _lock(folder: Path) -> int:
    """A descriptor that holds the folder's lock until it is closed, or its process ends; BlockingIOError if held."""
    import fcntl  # which not every system has

    descriptor = os.open(folder, os.O_RDONLY | os.O_DIRECTORY | os.O_NOFOLLOW)
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        os.close(descriptor)
        raise
    return descriptor
