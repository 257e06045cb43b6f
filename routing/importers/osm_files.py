"""OpenStreetMap files by their content, and the objects in them that editors marked as deleted."""

from __future__ import annotations

import bz2
import gzip
import re
import zlib
from typing import IO, TYPE_CHECKING, Final
from xml.parsers import expat

import osmium

from routing.errors import ImportFailedError

if TYPE_CHECKING:
    from pathlib import Path


_FORMS: Final = {"gzip": "osm.gz", "bzip2": "osm.bz2", "pbf": "osm.pbf", "xml": "osm"}
_KINDS: Final = {"node": "n", "way": "w", "relation": "r"}
_MARK: Final = re.compile(rb"\b(?:action\s*=\s*[\"']delete|visible\s*=\s*[\"']false)[\"']")
_LONGEST_MARK: Final = 64  # bytes that two chunks share, so that a mark between them is seen
_CHUNK: Final = 1 << 20


def open_osm(path: Path) -> osmium.io.File:
    """The file for osmium, XML, gzip, bzip2 and PBF told by their first bytes and not by the name.

    Raises ImportFailedError for the JSON of Overpass and for zip archives.
    """
    form = _form(path)
    allowed = "allowed: .osm, .osm.gz, .osm.bz2 or .pbf"
    if form == "json":
        raise ImportFailedError("map", path, f"is JSON, {allowed}; ask Overpass for [out:xml]")
    if form == "zip":
        raise ImportFailedError("map", path, f"is a zip archive, {allowed}; unpack it")
    return osmium.io.File(str(path), _FORMS[form]) if form in _FORMS else osmium.io.File(str(path))


def deleted_objects(path: Path) -> frozenset[tuple[str, int]]:
    """Kind (n, w, r) and id of what an XML file marks by action="delete" or visible="false".

    JOSM keeps deleted objects in its files until they are uploaded; osmium does not read its `action`. Empty for other
    files: PBF has no action, and its `visible` osmium reads.
    """
    form = _form(path)
    if form not in ("gzip", "bzip2", "xml"):
        return frozenset()
    found: set[tuple[str, int]] = set()

    def begin(name: str, attributes: dict[str, str]) -> None:
        marked = attributes.get("action") == "delete" or attributes.get("visible") == "false"
        if marked and name in _KINDS:
            found.add((_KINDS[name], int(attributes.get("id", "0"))))

    try:
        with _unpacked(path, form) as file:
            if not _has_mark(file):
                return frozenset()
        with _unpacked(path, form) as file:
            parser = expat.ParserCreate()
            parser.StartElementHandler = begin
            parser.ParseFile(file)
    except (OSError, EOFError, LookupError, ValueError, zlib.error, expat.ExpatError):
        pass  # a damaged file: reading its roads says so
    return frozenset(found)


def _unpacked(path: Path, form: str) -> IO[bytes] | gzip.GzipFile | bz2.BZ2File:
    if form == "gzip":
        return gzip.open(path)
    return bz2.open(path) if form == "bzip2" else path.open("rb")


def _has_mark(file: IO[bytes] | gzip.GzipFile | bz2.BZ2File) -> bool:
    before = b""
    while chunk := file.read(_CHUNK):
        if _MARK.search(before + chunk):
            return True
        before = chunk[-_LONGEST_MARK:]
    return False


def _form(path: Path) -> str | None:
    with path.open("rb") as file:
        head = file.read(64)
    text = head.removeprefix(b"\xef\xbb\xbf").lstrip()
    if head.startswith(b"\x1f\x8b"):
        return "gzip"
    if head.startswith(b"BZh"):
        return "bzip2"
    if b"OSMHeader" in head:
        return "pbf"
    if head.startswith(b"PK\x03\x04"):
        return "zip"
    if text.startswith((b"{", b"[")):
        return "json"
    return "xml" if text.startswith(b"<") else None
