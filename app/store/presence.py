"""Whether an SQLite database is still where it was: from its first use on, a marker lies beside its file."""

from __future__ import annotations

from pathlib import Path
from typing import Final

SUFFIX: Final = ".expected"
TEXT: Final = (
    "joulepath keeps vehicles and diagnoses in the file {name} beside this one.\n"
    "Where that is gone or empty, it is not made anew: put it back from a backup,\n"
    "or remove this file to begin with an empty database.\n"
)


class Marker:
    """Remembers that a database was there, also where nothing can be written beside it: then for this process."""

    def __init__(self, file: Path) -> None:
        self.file = file
        self.path = file.with_name(file.name + SUFFIX)
        self._remembered = False

    @property
    def is_expected(self) -> bool:
        """Whether the database was there before."""
        return self._remembered or self.path.exists()

    @property
    def is_missing(self) -> bool:
        """Whether there is no file, or one of no bytes, as SQLite makes at the first look into a file."""
        try:
            return self.file.stat().st_size == 0
        except FileNotFoundError:
            return True

    def note(self) -> None:
        """Expect the database from now on."""
        if self.path.exists():
            return
        try:
            self.path.write_text(TEXT.format(name=self.file.name), encoding="utf-8")
        except OSError:
            self._remembered = True
