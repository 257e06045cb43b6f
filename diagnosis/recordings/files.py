"""Files of recordings: which are meant, and what is in them, within a limit of size."""

from __future__ import annotations

import codecs
import glob
import gzip
import os
import zlib
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Final

from diagnosis.recordings.notes import RecordingError

if TYPE_CHECKING:
    from collections.abc import Iterable

MOST_BYTES: Final = (
    100_000_000  # ten samples a second of 48 columns for nine hours; takes up to 1.6 GB while it is read
)
ENDINGS: Final = (".csv", ".jsonl", ".parquet", ".gpx")
NAMED_ENDINGS: Final = (*ENDINGS, ".json")  # of files that are named; of folders other .json files are not taken
GZIP_MAGIC: Final = b"\x1f\x8b"
ZIP_MAGIC: Final = b"PK\x03\x04"
UTF32_MARKS: Final = (codecs.BOM_UTF32_LE, codecs.BOM_UTF32_BE)
UTF16_MARKS: Final = (codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)


@dataclass(slots=True)
class UnpackedBytes:
    """How much may be unpacked of all files that are read together, and how much was [B]."""

    most: int
    spent: int = 0

    @property
    def remaining(self) -> int:
        """What may still be unpacked [B]."""
        return max(self.most - self.spent, 0)

    def spend(self, path: str, size: int) -> None:
        """Count what a file has unpacked; raises RecordingError beyond the limit."""
        self.spent += size
        if self.spent > self.most:
            found = f"beyond the {self.most / 1e6:g} MB that may be unpacked of all files"
            allowed = f"at most {self.most / 1e6:g} MB in all; leave out drives, columns or samples"
            raise RecordingError(path, 1, "the file", found, allowed)


def recording_files(paths: Iterable[Path | str]) -> list[Path]:
    """The files that paths name: files as they are, those of folders and of patterns such as "drives/*.csv".

    Of a folder the .csv, .jsonl, .parquet and .gpx files, each also with .gz, in order of their names; folders within
    it are left aside. No file comes twice. A path that nothing is found for is returned as it is, to fail
    when it is opened.
    """
    found: dict[Path, None] = {}
    for named in paths:
        path = Path(named)
        if path.is_dir():
            inside = sorted(file for file in path.iterdir() if file.is_file() and is_recording_name(file.name))
            found.update(dict.fromkeys(inside))
        elif path.exists() or not glob.has_magic(str(path)):
            found[path] = None
        else:
            matches = [Path(match) for match in sorted(glob.glob(str(path), recursive=True))]
            found.update(dict.fromkeys([match for match in matches if match.is_file()] or [path]))
    return list(found)


def is_recording_name(name: str) -> bool:
    """Whether a file's name has the ending of a recording."""
    return name.lower().removesuffix(".gz").endswith(ENDINGS)


def recording_id(path: Path) -> str:
    """A recording's id, its file's name without .gz and without .csv, .jsonl, .json, .parquet or .gpx."""
    name = path.name.removesuffix(".gz")
    for ending in NAMED_ENDINGS:
        name = name.removesuffix(ending)
    return name


def file_content(path: Path, most_bytes: int = MOST_BYTES, together: UnpackedBytes | None = None) -> bytes:
    """What is in a file, unpacked where it is gzip, of at most most_bytes packed and unpacked.

    together: what may be unpacked of this file and others. Raises RecordingError for a larger file before it is read
    whole, and for a broken one; OSError where it can't be opened.
    """
    most = most_bytes if together is None else min(most_bytes, together.remaining)
    with path.open("rb") as file:
        _check_size(path, os.fstat(file.fileno()).st_size, most_bytes)
        if file.peek(len(GZIP_MAGIC)).startswith(GZIP_MAGIC):
            try:
                with gzip.GzipFile(fileobj=file) as packed:
                    content = packed.read(most + 1)
            except (OSError, EOFError, zlib.error) as error:
                raise RecordingError(str(path), 1, "the file", f"not gzip ({error})", "a whole gzip file") from error
        else:
            content = file.read(most + 1)
    _check_size(path, len(content), most_bytes)
    if together is not None:
        together.spend(str(path), len(content))
    return content


def text_of(path: Path, content: bytes) -> str:
    """The text of a file in UTF-8, UTF-16 or UTF-32 with a byte order mark, or latin-1, in which each byte is a letter.

    Bytes of zero at the end, which a logger without power leaves, are cut off. Raises RecordingError for what is no
    text.
    """
    if content.startswith(ZIP_MAGIC):
        raise RecordingError(str(path), 1, "the file", "a zip or Excel file", "text (save it as CSV), or gzip of it")
    try:
        if content.startswith(UTF32_MARKS):
            return content.decode("utf-32").rstrip("\0")
        if content.startswith(UTF16_MARKS):
            return content.decode("utf-16").rstrip("\0")
    except UnicodeDecodeError as error:
        raise RecordingError(
            str(path), 1, "the file", f"broken UTF-16 or UTF-32 ({error.reason})", "UTF-8 text"
        ) from error
    content = content.rstrip(b"\0")
    if b"\0" in content:
        row = content.count(b"\n", 0, content.index(b"\0")) + 1
        found = "binary (it has a byte of zero), or UTF-16 without a mark"
        raise RecordingError(str(path), row, "the file", found, "text in UTF-8")
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError:
        return content.decode("latin-1")


def _check_size(path: Path, size: int, most_bytes: int) -> None:
    if size > most_bytes:
        found = f"larger than {most_bytes / 1e6:g} MB unpacked"
        allowed = f"at most {most_bytes / 1e6:g} MB; split it into drives, or leave out columns and samples"
        raise RecordingError(str(path), 1, "the file", found, allowed)
