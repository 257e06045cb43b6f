"""Files of a stored graph: read whole, held against the hashes that meta.json has of them, exchanged as a folder."""

from __future__ import annotations

import ctypes
import hashlib
import json
import os
from io import BytesIO
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from routing.errors import GraphFormatError

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

META_FILE: Final = "meta.json"
SEAL: Final = "sha256"  # of each other file, in meta.json, which is written last
WRITTEN: Final = "a graph written by `joulepath import`"
_HERE: Final = -100  # AT_FDCWD
_EXCHANGE: Final = 2  # RENAME_EXCHANGE of renameat2, Linux 3.15 with glibc 2.28 or musl 1.2.4


class GraphFiles:
    """The files of one stored graph as they are now; nothing that happens to them later changes what was read.

    Memory-mapped files would end the process where they are cut while it runs. sealed: whether meta.json has hashes,
    as all graphs have that were written since; others are read as they are.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.path = str(folder)
        try:
            self._place = _place(folder / META_FILE)
            self.meta_text = (folder / META_FILE).read_bytes()
            self.raw = json.loads(self.meta_text)
        except (OSError, ValueError, RecursionError) as error:
            raise GraphFormatError(self.path, META_FILE, f"unreadable ({error})", WRITTEN) from error
        seal = self.raw.get(SEAL) if isinstance(self.raw, dict) else None
        if seal is not None and not (isinstance(seal, dict) and all(isinstance(text, str) for text in seal.values())):
            raise GraphFormatError(self.path, META_FILE, f"damaged ({SEAL} is no table of hashes)", WRITTEN)
        self._seal: Mapping[str, str] | None = seal

    @property
    def sealed(self) -> bool:
        """Whether the graph has hashes of its files."""
        return self._seal is not None

    @property
    def version(self) -> str:
        """A name for these very contents, where the graph is sealed."""
        return hashlib.sha256(self.meta_text).hexdigest()[:16]

    def has(self, file: str) -> bool:
        """Whether the graph has a file that not every graph has."""
        if self._seal is not None:
            return file in self._seal
        return (self.folder / file).exists()

    def read(self, file: str) -> bytes:
        """A file's content; raises GraphFormatError where it is missing or not the one that was written."""
        try:
            content = (self.folder / file).read_bytes()
        except OSError as error:
            raise GraphFormatError(self.path, file, f"unreadable ({error})", WRITTEN) from error
        if self._seal is not None and hashlib.sha256(content).hexdigest() != self._seal.get(file):
            allowed = f"the file that {META_FILE} has the hash of; import the map again, or copy all files again"
            raise GraphFormatError(self.path, file, "changed since the graph was written", allowed)
        return content

    def is_current(self) -> bool:
        """Whether meta.json is still the one that was read, and not another of the same content."""
        file = self.folder / META_FILE
        try:
            return _place(file) == self._place and file.read_bytes() == self.meta_text
        except OSError:
            return False


def _place(file: Path) -> tuple[int, int, int]:
    """What tells a file from another that takes its place."""
    status = file.stat()
    return status.st_dev, status.st_ino, status.st_mtime_ns


def array_bytes(array: np.ndarray[Any, Any]) -> bytes:
    """A .npy file of an array."""
    buffer = BytesIO()
    np.save(buffer, array, allow_pickle=False)
    return buffer.getvalue()


def seal_of(files: Mapping[str, bytes]) -> dict[str, str]:
    """Hashes of files by name, as meta.json has them."""
    return {file: hashlib.sha256(content).hexdigest() for file, content in sorted(files.items())}


def exchanged(first: Path, second: Path) -> bool:
    """Whether both have taken each other's place, so that there was something in each at any time."""
    rename = getattr(ctypes.CDLL(None), "renameat2", None) if os.name == "posix" else None
    if rename is None:
        return False
    return bool(rename(_HERE, os.fsencode(first), _HERE, os.fsencode(second), _EXCHANGE) == 0)
