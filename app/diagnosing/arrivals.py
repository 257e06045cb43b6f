"""Uploads that are still arriving: how many at a time, and the files that they are written to meanwhile."""

from __future__ import annotations

import shutil
import threading
from collections import Counter
from typing import TYPE_CHECKING

from app.errors.diagnosing import TooManyUploadsError, UploadsFullError

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path


class Arrival:
    """One upload, from before its body is read until its diagnosis is queued or refused; folder: for its files."""

    def __init__(self, folder: Path, leave: Callable[[], None]) -> None:
        self.folder = folder
        self._leave: Callable[[], None] | None = leave

    def end(self) -> None:
        """Let another one arrive, and remove what has not been taken out of the folder; once."""
        leave, self._leave = self._leave, None
        if leave is not None:
            shutil.rmtree(self.folder, ignore_errors=True)
            leave()


class Arrivals:
    """How many uploads are arriving; methods may be called from any thread.

    limit: of all at a time. Half of them, but at least one, may be of one client. new_folder: makes one.
    """

    def __init__(self, limit: int, new_folder: Callable[[], Path]) -> None:
        self.limit = limit
        self.client_limit = max(limit // 2, 1)
        self._new_folder = new_folder
        self._by_client: Counter[str | None] = Counter()
        self._lock = threading.Lock()

    def begin(self, client: str | None) -> Arrival:
        """Take an upload of a client, None where it is not known apart from others and has no limit of its own.

        Raises TooManyUploadsError, and UploadsFullError where no folder can be made.
        """
        with self._lock:
            if client is not None and self._by_client[client] >= self.client_limit:
                raise TooManyUploadsError(self.client_limit, "of one client")
            if self._by_client.total() >= self.limit:
                raise TooManyUploadsError(self.limit, "in all")
            self._by_client[client] += 1
        try:
            return Arrival(self._new_folder(), lambda: self._ended(client))
        except BaseException as error:
            self._ended(client)
            if isinstance(error, OSError):
                raise UploadsFullError(error) from error
            raise

    def _ended(self, client: str | None) -> None:
        with self._lock:
            self._by_client[client] -= 1
            if not self._by_client[client]:
                del self._by_client[client]


class ArrivingFile:
    """A file that is written to the disk from its first byte on, and held open only while a part is written."""

    def __init__(self, path: Path) -> None:
        self.path = path

    def write(self, data: bytes) -> int:
        """Append bytes; raises OSError."""
        with self.path.open("ab") as file:
            return file.write(data)

    def seek(self, offset: int, whence: int = 0) -> int:
        """The file is whole: it is there even where it has no byte."""
        self.path.touch()
        return 0

    def close(self) -> None:
        """Nothing is open."""
