"""The text of a file of stations, unpacked and decoded within a limit of size."""

from __future__ import annotations

import codecs
import gzip
import os
import zlib
from typing import TYPE_CHECKING, Final

from routing.stations.notes import StationFileError

if TYPE_CHECKING:
    from pathlib import Path

MOST_BYTES: Final = 150_000_000  # packed and unpacked; takes up to five times as much while it is read
GZIP_MAGIC: Final = b"\x1f\x8b"
PACKED: Final = (
    (b"PK\x03\x04", "a zip or Excel file"),
    (b"%PDF", "a PDF"),
    (b"BZh", "packed with bzip2"),
    (b"\xfd7zXZ\x00", "packed with xz"),
    (b"\x28\xb5\x2f\xfd", "packed with zstd"),
    (b"\xd0\xcf\x11\xe0", "an old Excel file"),
    (b"PAR1", "Parquet"),
)
UTF32_MARKS: Final = (codecs.BOM_UTF32_LE, codecs.BOM_UTF32_BE)
UTF16_MARKS: Final = (codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)
ALLOWED: Final = "text in UTF-8 or Windows-1252 (CSV or JSON), or gzip of it"


def text_of(path: Path) -> str:
    """The text in a file: UTF-8, UTF-16 or UTF-32 with a byte order mark, else Windows-1252; also of gzip.

    Raises StationFileError for one that is larger than MOST_BYTES, before it is read whole, for a broken or packed one
    and for what is no text; OSError where it can't be opened.
    """
    content = _content(path)
    for begin, kind in PACKED:
        if content.startswith(begin):
            raise StationFileError(str(path), "", "the file", kind, ALLOWED)
    try:
        if content.startswith(UTF32_MARKS):
            return content.decode("utf-32")
        if content.startswith(UTF16_MARKS):
            return content.decode("utf-16")
    except UnicodeDecodeError as error:
        found = f"broken UTF-16 or UTF-32 ({error.reason})"
        raise StationFileError(str(path), "", "the file", found, ALLOWED) from error
    content = content.rstrip(b"\0")
    zero = content.find(b"\0")
    if zero >= 0:
        line = content.count(b"\n", 0, zero) + 1
        found = "binary (it has a byte of zero), or UTF-16 without a mark"
        raise StationFileError(str(path), f"line {line}", "the file", found, ALLOWED)
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError:
        return _damaged_text(content)


def _damaged_text(content: bytes) -> str:
    """The text of bytes that are no UTF-8: Windows-1252, or UTF-8 in which fewer letters are broken than whole."""
    text = content.decode("utf-8-sig", "replace")
    broken = text.count("\ufffd")
    whole = len(text) - len(text.encode("ascii", "ignore")) - broken
    if whole > broken:
        return text
    del text  # it may take as much as all else together
    return content.decode("cp1252", "replace")


def _content(path: Path) -> bytes:
    with path.open("rb") as file:
        before = os.fstat(file.fileno())
        _check_size(path, before.st_size)
        if not file.peek(len(GZIP_MAGIC)).startswith(GZIP_MAGIC):
            content = file.read(MOST_BYTES + 1)
        else:
            try:
                with gzip.GzipFile(fileobj=file) as packed:
                    content = packed.read(MOST_BYTES + 1)
            except (OSError, EOFError, zlib.error) as error:
                found = f"not gzip ({error})"
                raise StationFileError(str(path), "", "the file", found, "a whole gzip file") from error
        after = os.fstat(file.fileno())
    if (after.st_size, after.st_mtime_ns) != (before.st_size, before.st_mtime_ns):
        found = f"written while it is read ({before.st_size} bytes, then {after.st_size})"
        raise StationFileError(str(path), "", "the file", found, "a file that is finished")
    _check_size(path, len(content))
    return content


def _check_size(path: Path, size: int) -> None:
    if size > MOST_BYTES:
        found = f"larger than {MOST_BYTES / 1e6:g} MB unpacked"
        allowed = f"at most {MOST_BYTES / 1e6:g} MB; only the region that is planned in"
        raise StationFileError(str(path), "", "the file", found, allowed)
