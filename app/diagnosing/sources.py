"""Recordings that requests name: files below the configured folder, and names of uploaded files."""

from __future__ import annotations

import fnmatch
import os
import re
import stat
import time
from pathlib import Path, PurePosixPath, PureWindowsPath
from typing import TYPE_CHECKING, Final

from app.errors.diagnosing import SourceError
from diagnosis.recordings.files import is_recording_name, recording_id

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

MAX_NAME_BYTES: Final = 200
MOST_ENTRIES: Final = 100_000  # files and folders that the patterns of one request look at
MOST_SEARCH_S: Final = 5.0
CLOCK_EVERY: Final = 64  # entries between two looks at the clock
ANY_DEPTH: Final = "**"
MAGIC: Final = re.compile(r"[*?\[]")


def files_below(
    folder: Path, patterns: Sequence[str], *, most_entries: int = MOST_ENTRIES, most_s: float = MOST_SEARCH_S
) -> tuple[Path, ...]:
    """Files that patterns or folders name below a folder, relative to it; nothing outside of it is ever named.

    A pattern has `*`, `?` and `[…]` within names and `**` for folders of any depth, at most once; `**` follows no
    links. Takes O(parts of a pattern · entries of the folder) time, and looks at so many entries, and so long, for all
    patterns together. Raises SourceError naming a pattern that is not relative, leads outside, stands for no
    recording, or needs more.
    """
    search = _Search(folder.resolve(), most_entries, most_s)
    found: dict[Path, None] = {}
    for k, pattern in enumerate(patterns):
        field = f"recordings[{k}]"
        try:
            files = search.files(field, pattern, _parts(field, pattern))
        except (ValueError, OSError) as error:  # of names that no file can have
            raise SourceError(field, pattern, f"a path or pattern ({error})") from error
        if not files:
            raise SourceError(field, pattern, "a recording, a folder with some, or a pattern, that is there")
        found |= dict.fromkeys(files)
    return tuple(found)


def uploaded_name(filename: str, field: str) -> str:
    """The name of an uploaded file without folders; raises SourceError for one that no file can have."""
    name = PurePosixPath(filename.replace("\\", "/")).name
    try:
        size = len(name.encode("utf-8"))
    except UnicodeEncodeError:
        size = 0
    # the id is a part of addresses, where none or a dot means another place
    if not 0 < size <= MAX_NAME_BYTES or recording_id(Path(name)) in ("", ".", "..") or not name.isprintable():
        raise SourceError(field, filename, f"the name of a file, of at most {MAX_NAME_BYTES} bytes")
    return name


def _parts(field: str, pattern: str) -> tuple[str, ...]:
    """The names and patterns of names of which a pattern consists; raises SourceError."""
    parts = PurePosixPath(pattern).parts
    absolute = PurePosixPath(pattern).is_absolute() or PureWindowsPath(pattern).anchor
    if absolute or ".." in (*parts, *PureWindowsPath(pattern).parts):
        raise SourceError(field, pattern, "a path below the folder of recordings, without ..")
    if parts.count(ANY_DEPTH) > 1:
        raise SourceError(field, pattern, f"a pattern with at most one {ANY_DEPTH}")
    if any(ANY_DEPTH in part for part in parts if part != ANY_DEPTH):
        raise SourceError(
            field, pattern, f"a pattern with {ANY_DEPTH} only in place of a folder, as in {ANY_DEPTH}/*.csv"
        )
    return parts


class _Search:
    """Looks below a folder for what patterns name, within a number of entries and a time for all of them."""

    def __init__(self, root: Path, most_entries: int, most_s: float) -> None:
        self.root = str(root)
        self.most_entries = most_entries
        self.most_s = most_s
        self._end_s = time.monotonic() + most_s
        self._looked = 0
        self._field, self._pattern = "", ""

    def files(self, field: str, pattern: str, parts: Sequence[str]) -> list[Path]:
        """Recordings that a pattern names, and those in folders that it names, in order, relative to the root."""
        self._field, self._pattern = field, pattern
        found = [self.root]
        for part in parts:
            found = self._next(self._folders(found), part)
        folders = self._folders(found)
        named = {path for path in found if self._is_recording(path)}
        for folder in folders:
            named.update(path for path in self._entries(folder) if self._is_recording(path))
        return sorted(Path(path).relative_to(self.root) for path in named)

    def _next(self, folders: Sequence[str], part: str) -> list[str]:
        """What is in folders by a name or a pattern of names; of `**` they and all folders below them."""
        if part == ANY_DEPTH:
            return self._below(folders)
        if MAGIC.search(part) is None:
            self._look(len(folders))
            return [path for folder in folders if os.path.lexists(path := os.path.join(folder, part))]
        fits = re.compile(fnmatch.translate(part)).match  # no star of it is tried again once the next has its place
        return [path for folder in folders for path in self._entries(folder) if fits(os.path.basename(path))]

    def _below(self, folders: Sequence[str]) -> list[str]:
        found: list[str] = []
        waiting = list(folders)
        while waiting:
            folder = waiting.pop()
            found.append(folder)
            waiting += [path for path in self._entries(folder) if not os.path.islink(path) and os.path.isdir(path)]
        return found

    def _folders(self, paths: Sequence[str]) -> list[str]:
        """Those that are folders below the root also when links are followed, each once, rather by no link."""
        found: dict[tuple[int, int], str] = {}
        for path in sorted(paths, key=lambda path: (os.path.islink(path), path)):
            try:
                status = os.stat(path)
            except OSError:  # a link to nothing
                continue
            place = (status.st_dev, status.st_ino)
            if stat.S_ISDIR(status.st_mode) and place not in found and self._is_inside(path):
                found[place] = path
        return list(found.values())

    def _is_recording(self, path: str) -> bool:
        return is_recording_name(os.path.basename(path)) and os.path.isfile(path) and self._is_inside(path)

    def _is_inside(self, path: str) -> bool:
        """Whether a path in a folder below the root leads to a place below the root."""
        return not os.path.islink(path) or Path(os.path.realpath(path)).is_relative_to(self.root)

    def _entries(self, folder: str) -> Iterator[str]:
        """What is in a folder; nothing where it may not be read."""
        try:
            with os.scandir(folder) as entries:
                for entry in entries:
                    self._look(1)
                    yield entry.path
        except (PermissionError, FileNotFoundError):
            return

    def _look(self, count: int) -> None:
        """Count what is looked at; raises SourceError beyond the limits."""
        before = self._looked
        self._looked += count
        if self._looked > self.most_entries:
            allowed = f"patterns that look at no more than {self.most_entries} files and folders in all; name a folder"
            raise SourceError(self._field, self._pattern, allowed)
        if before // CLOCK_EVERY != self._looked // CLOCK_EVERY and time.monotonic() > self._end_s:
            allowed = f"patterns that are found within {self.most_s:g} s in all; name a folder"
            raise SourceError(self._field, self._pattern, allowed)
