"""Recordings that requests name: files below the configured folder, and names of uploaded files."""

from __future__ import annotations

from pathlib import Path, PurePosixPath, PureWindowsPath
from typing import TYPE_CHECKING, Final

from app.errors.diagnosing import SourceError
from diagnosis.recordings.files import is_recording_name, recording_id

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

MAX_NAME_BYTES: Final = 200


def files_below(folder: Path, patterns: Sequence[str]) -> tuple[Path, ...]:
    """Files that patterns or folders name below a folder, relative to it; nothing outside of it is ever named.

    Raises SourceError naming a pattern that is not relative, leads outside, or stands for no recording.
    """
    root = folder.resolve()
    found: list[Path] = []
    for k, pattern in enumerate(patterns):
        field = f"recordings[{k}]"
        parts = (*PurePosixPath(pattern).parts, *PureWindowsPath(pattern).parts)
        absolute = PurePosixPath(pattern).is_absolute() or PureWindowsPath(pattern).anchor
        if absolute or ".." in parts:
            raise SourceError(field, pattern, "a path below the folder of recordings, without ..")
        files = _inside(root, _matches(root, pattern, field))
        if not files:
            raise SourceError(field, pattern, "a recording, a folder with some, or a pattern, that is there")
        found += files
    return tuple(dict.fromkeys(found))


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


def _matches(root: Path, pattern: str, field: str) -> list[Path]:
    try:
        matched = sorted(root.glob(pattern)) if pattern != "." else [root]
        return [file for path in matched for file in (_files_in(path) if path.is_dir() else [path])]
    except (ValueError, NotImplementedError, IndexError, OSError) as error:  # of pathlib, on patterns it can't read
        raise SourceError(field, pattern, f"a path or pattern ({error})") from error


def _inside(root: Path, files: Iterable[Path]) -> list[Path]:
    """Of files, the recordings that lie below a folder also when links are followed, relative to it."""
    return [
        path.relative_to(root)
        for path in files
        if is_recording_name(path.name) and path.is_file() and path.resolve().is_relative_to(root)
    ]


def _files_in(folder: Path) -> list[Path]:
    return sorted(path for path in folder.iterdir() if path.is_file())
