"""OpenStreetMap files by their content: their form, deleted objects, texts that osmium can't take."""

from __future__ import annotations

import bz2
import gzip
import re
import struct
import zlib
from typing import IO, TYPE_CHECKING, Final
from xml.parsers import expat

import numpy as np
import osmium
import shapely

from routing.errors import ImportFailedError

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from routing.graph.cut_roads import Box


_FORMS: Final = {"gzip": "osm.gz", "bzip2": "osm.bz2", "pbf": "osm.pbf", "xml": "osm"}
_ARCHIVES: Final = {  # first bytes of what has to be unpacked first
    b"PK\x03\x04": "a zip archive",
    b"\xfd7zXZ\x00": "packed with xz",
    b"\x28\xb5\x2f\xfd": "packed with zstd",
    b"7z\xbc\xaf\x27\x1c": "a 7z archive",
    b"Rar!": "a rar archive",
}
_WIDE_MARKS: Final = (b"\xff\xfe", b"\xfe\xff", b"<\x00", b"\x00<")  # how a text in UTF-16 begins
_BZIP2_STREAM: Final = re.compile(rb"BZh[1-9]1AY&SY")
_BZIP2_CHUNK: Final = 5000  # bytes that libbz2 reads at once
_MOST_UNPACKED_BYTES: Final = 512 << 20
_END_BYTES: Final = 4096  # in which Overpass remarks that it did not finish
_KINDS: Final = {"node": "n", "way": "w", "relation": "r"}
_MARK: Final = re.compile(rb"\b(?:action\s*=\s*[\"']delete|visible\s*=\s*[\"']false)[\"']")
_LONGEST_MARK: Final = 64  # bytes that two chunks share, so that a mark between them is seen
_BOUNDS: Final = re.compile(rb"<bounds\b([^>]*)>")
_OBJECT: Final = re.compile(rb"<(?:node|way|relation)\b")
_ADMINISTRATIVE: Final = ("boundary", "administrative")
_WITHIN_FRAC: Final = 0.98  # of a map's points that lie in the region that it is of; assumed
_FILLED_FRAC: Final = 0.5  # of a region that the map's points span; assumed
_CHUNK: Final = 1 << 20
_MOST_HEADER_BYTES: Final = 64 * 1024  # limits of PBF
_MOST_BLOB_BYTES: Final = 32 * 1024 * 1024
_VARINT, _FIXED_64, _BYTES, _FIXED_32 = 0, 1, 2, 5  # kinds of fields in PBF


def open_osm(path: Path) -> osmium.io.File | osmium.io.FileBuffer:
    """The file for osmium, XML, gzip, bzip2 and PBF told by their first bytes and not by the name.

    Raises ImportFailedError for JSON, archives, files of changes or with the history of objects, and for what Overpass
    did not finish.
    """
    form = _form(path)
    allowed = "allowed: .osm, .osm.gz, .osm.bz2 or .pbf"
    if form == "json":
        with path.open("rb") as file:
            begin = file.read(_END_BYTES)
        geojson = b"Feature" in begin
        hint = "GeoJSON does not say where roads join" if geojson else "ask Overpass for [out:xml]"
        raise ImportFailedError("map", path, f"is {'GeoJSON' if geojson else 'JSON'}, {allowed}; {hint}")
    if form in _ARCHIVES.values():
        raise ImportFailedError("map", path, f"is {form}, {allowed}; unpack it")
    if ".osh" in path.suffixes:
        reason = "holds the history of objects, allowed: one version of each (osmium time-filter makes it)"
        raise ImportFailedError("map", path, reason)
    if form in ("gzip", "bzip2", "xml"):
        _refuse_no_map(path, form)
    if form == "bzip2" and _ends_in_a_short_stream(path):  # osmium would stop before it
        with bz2.open(path) as file:
            try:
                text = file.read(_MOST_UNPACKED_BYTES)
            except (OSError, EOFError) as error:
                raise ImportFailedError("map", path, f"not a readable OSM file ({error})") from error
        return osmium.io.FileBuffer(text, "osm")
    return osmium.io.File(str(path), _FORMS[form]) if form in _FORMS else osmium.io.File(str(path))


def is_graphml(path: Path) -> bool:
    """Whether a file, packed or not, is GraphML by its first element, whatever its name."""
    try:
        form = _form(path)
        if form not in ("gzip", "xml"):
            return False
        with _unpacked(path, form) as file:
            return b"<graphml" in file.read(_END_BYTES).replace(b"\0", b"")
    except (OSError, EOFError, zlib.error):
        return False  # reading it says so


def _refuse_no_map(path: Path, form: str) -> None:
    """Raise ImportFailedError where an XML file holds changes of a map, or a query that Overpass gave up."""
    try:
        with _unpacked(path, form) as file:
            begin = file.read(_END_BYTES).replace(b"\0", b"")
    except (OSError, EOFError, ValueError, zlib.error):
        return  # a damaged file: reading its roads says so
    if b"<osmChange" in begin:
        reason = "holds changes of a map (osmChange), allowed: the map itself; osmium apply-changes makes it"
        raise ImportFailedError("map", path, reason)
    if b"<center " in begin:
        reason = "has centres instead of points, needed: ways with their nodes (Overpass: out body; >; out skel;)"
        raise ImportFailedError("map", path, reason)
    if form == "xml":
        with path.open("rb") as file:
            file.seek(max(0, path.stat().st_size - _END_BYTES))
            begin += file.read().replace(b"\0", b"")
    remark = re.search(rb"<remark>([^<]*error[^<]*)</remark>", begin)
    if remark:
        shown = " ".join(remark[1].decode("utf-8", "replace").split())[:200]
        raise ImportFailedError("map", path, f"is not whole, Overpass says: {shown}; ask for less, or for more time")


def _ends_in_a_short_stream(path: Path) -> bool:
    """Whether the last of several bzip2 streams, as pbzip2 writes them, lies within the last read of the file."""
    size = path.stat().st_size
    with path.open("rb") as file:
        file.seek(max(1, size - _BZIP2_CHUNK))
        return bool(_BZIP2_STREAM.search(file.read()))


def deleted_objects(path: Path) -> frozenset[tuple[str, int]]:
    """Kind (n, w, r) and id of what an XML file marks by action="delete" or visible="false".

    JOSM keeps deleted objects in its files until they are uploaded; osmium does not read its `action`. Of an object
    that is there twice the later one holds. Empty for other files: PBF has no action, and its `visible` osmium reads.
    """
    form = _form(path)
    if form not in ("gzip", "bzip2", "xml"):
        return frozenset()
    found: set[tuple[str, int]] = set()

    def begin(name: str, attributes: dict[str, str]) -> None:
        marked = attributes.get("action") == "delete" or attributes.get("visible") == "false"
        if name not in _KINDS:
            return
        key = (_KINDS[name], int(attributes.get("id", "0")))
        if marked:
            found.add(key)
        else:
            found.discard(key)

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


def header_boxes(path: Path, header: osmium.io.Header) -> tuple[Box, ...]:
    """The boxes west, south, east, north [deg] that a file says it is of; several in XML, as JOSM writes them."""
    texts: list[tuple[str | None, ...]] = []
    form = _form(path)
    if form in ("gzip", "bzip2", "xml"):
        with _unpacked(path, form) as file:
            head = file.read(_CHUNK)
        found = _OBJECT.search(head)
        for bounds in _BOUNDS.findall(head[: found.start() if found else len(head)]):
            values = dict(re.findall(r"(\w+)\s*=\s*[\"']([^\"']*)[\"']", bounds.decode("utf-8", "replace")))
            texts.append(tuple(values.get(key) for key in ("minlon", "minlat", "maxlon", "maxlat")))
    else:
        box = header.box()
        if box.valid():
            low, high = box.bottom_left, box.top_right
            texts.append((str(low.lon), str(low.lat), str(high.lon), str(high.lat)))
    boxes: list[Box] = []
    for text in texts:
        try:
            west, south, east, north = (float(value) for value in text if value is not None)
        except ValueError:
            continue
        if -180.0 <= west < east <= 180.0 and -90.0 <= south < north <= 90.0:
            boxes.append((west, south, east, north))
    return tuple(boxes)


def region_boundary(
    file: osmium.io.File | osmium.io.FileBuffer, lon_e7: Sequence[int], lat_e7: Sequence[int]
) -> shapely.MultiPolygon | None:
    """The area of the smallest administrative boundary in a file that holds nearly all of its points, and is filled.

    Extracts of countries and regions reach a little beyond the boundary, which they hold as a whole. None where the
    file has none that is whole, or is not sorted by id, as building areas needs.
    """
    place = np.column_stack((lon_e7, lat_e7)) / 1e7
    hull: shapely.geometry.base.BaseGeometry | None = None
    factory, wanted = osmium.geom.WKBFactory(), osmium.filter.TagFilter(_ADMINISTRATIVE)
    chosen: shapely.MultiPolygon | None = None
    try:
        processor = osmium.FileProcessor(file).with_areas(wanted).with_filter(wanted)
        for entity in processor.with_filter(osmium.filter.EntityFilter(osmium.osm.AREA)):
            assert isinstance(entity, osmium.osm.Area)
            area = shapely.from_wkb(bytes.fromhex(factory.create_multipolygon(entity)))
            if not isinstance(area, shapely.MultiPolygon) or not area.is_valid:
                continue
            if hull is None:  # which few files need
                hull = shapely.MultiPoint(place).convex_hull
            if hull.intersection(area).area < _FILLED_FRAC * area.area:
                continue
            within_frac = float(shapely.contains_xy(area, place[:, 0], place[:, 1]).mean())
            if within_frac >= _WITHIN_FRAC and (chosen is None or area.area < chosen.area):
                chosen = area
    except (RuntimeError, ValueError, osmium.InvalidLocationError, shapely.errors.GEOSException):
        return None
    return chosen


def _unpacked(path: Path, form: str) -> IO[bytes] | gzip.GzipFile | bz2.BZ2File:
    if form == "gzip":
        return gzip.open(path)
    return bz2.open(path) if form == "bzip2" else path.open("rb")


def _has_mark(file: IO[bytes] | gzip.GzipFile | bz2.BZ2File) -> bool:
    before = b""
    while chunk := file.read(_CHUNK).replace(b"\0", b""):  # UTF-16 has a zero in each letter of a mark
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
    for mark, archive in _ARCHIVES.items():
        if head.startswith(mark):
            return archive
    if head.startswith(_WIDE_MARKS):
        return "xml"
    if text.startswith((b"{", b"[")):
        return "json"
    return "xml" if text.startswith(b"<") else None


def check_strings(path: Path) -> None:
    """Raise ImportFailedError where a string holds a byte of zero, O(file).

    osmium takes a tag as two texts that each end with a zero, and reads beyond its memory where one has a zero within.
    What is damaged in another way is left to osmium, which says so.
    """
    if _form(path) != "pbf":
        return
    with path.open("rb") as file:
        try:
            while (blob := _next_blob(file)) is not None:
                try:
                    _check_table(path, _unpacked_block(blob))
                except (zlib.error, IndexError, ValueError):
                    continue
        except (IndexError, ValueError):
            return


def _next_blob(file: IO[bytes]) -> bytes | None:
    """The next block of data as it is packed, b"" for one that is no data, None at the end."""
    length = file.read(4)
    if len(length) < 4:
        return None
    header_bytes = struct.unpack(">I", length)[0]
    if header_bytes > _MOST_HEADER_BYTES:
        raise ValueError("no header of a block")
    header = _fields(file.read(header_bytes))
    size = next((value for number, value in header if number == 3 and isinstance(value, int)), 0)
    if size > _MOST_BLOB_BYTES:
        raise ValueError("no block")
    blob = file.read(size)
    return blob if (1, b"OSMData") in header else b""


def _unpacked_block(blob: bytes) -> bytes:
    """A block of data; b"" where it is packed in another way than by zlib, or not at all."""
    for number, value in _fields(blob):
        if isinstance(value, bytes) and number == 1:
            return value
        if isinstance(value, bytes) and number == 3:
            return zlib.decompressobj().decompress(value, _MOST_BLOB_BYTES)
    return b""


def _check_table(path: Path, block: bytes) -> None:
    table = next((value for number, value in _fields(block, first=1) if number == 1), b"")
    if not isinstance(table, bytes) or table.count(0) == table[:2].count(0):  # the first is empty
        return
    for _, text in _fields(table):
        if isinstance(text, bytes) and 0 in text:
            shown = text[:40].decode("utf-8", "replace").replace("\0", "\\0")
            raise ImportFailedError("map", path, f"damaged: the text {shown!r} holds a byte of zero, allowed: none")


def _fields(message: bytes, first: int | None = None) -> list[tuple[int, int | bytes]]:
    """Numbers and values of a protobuf message's fields, up to the first of number `first` where it is named."""
    found: list[tuple[int, int | bytes]] = []
    at = 0
    while at < len(message):
        key, at = _varint(message, at)
        number, kind = key >> 3, key & 7
        value: int | bytes
        if kind == _VARINT:
            value, at = _varint(message, at)
        elif kind in (_FIXED_64, _FIXED_32):
            width = 8 if kind == _FIXED_64 else 4
            value, at = message[at : at + width], at + width
        elif kind == _BYTES:
            size, at = _varint(message, at)
            value, at = message[at : at + size], at + size
        else:
            raise ValueError("no field")
        found.append((number, value))
        if number == first:
            break
    return found


def _varint(message: bytes, at: int) -> tuple[int, int]:
    value = shift = 0
    while True:
        byte = message[at]
        value |= (byte & 0x7F) << shift
        at, shift = at + 1, shift + 7
        if byte < 0x80:
            return value, at
        if shift > 63:
            raise ValueError("no number")
