"""Tracks in GPX: places and times, and the speed that follows from them; no power, so a profile to drive only."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Final
from xml.etree import ElementTree

import numpy as np

from diagnosis.recordings.formats.named_columns import MOST_KMH
from diagnosis.recordings.formats.tables import Column, LogTable, check_rows
from diagnosis.recordings.notes import Note, NoteKind, RecordingError, shown
from diagnosis.recordings.positions import east_north_m, stray
from diagnosis.recordings.recording import Detail, Recording
from energy.units import KMH_PER_MPS

if TYPE_CHECKING:
    from xml.etree.ElementTree import Element

    from numpy.typing import NDArray

TIME: Final = Column("time", "time_s", -1e12, 1e12)
LATITUDE: Final = Column("lat", "latitude_deg", -90.0, 90.0)
LONGITUDE: Final = Column("lon", "longitude_deg", -180.0, 180.0)
HEIGHT: Final = Column("ele", "elevation_m", -500.0, 9000.0)
SPEED: Final = Column("speed", "speed_mps", 0.0, MOST_KMH / KMH_PER_MPS)
ALLOWED: Final = "GPX with a track: trkpt with lat, lon and time"
GPX: Final = re.compile(r"<(?:\w+:)?gpx\b")
POINT_END: Final = re.compile(r"</((?:\w+:)?)trkpt\s*>")
MOST_STRAY_FRAC: Final = 0.05
ELEMENT_BYTES: Final = 200  # that an element takes once it is read, and an attribute; measured
ATTRIBUTE_BYTES: Final = 100
MOST_READ_BYTES: Final = 1_500_000_000
MOST_LOOKS: Final = 4  # at an element: each is in a track, and in a point of it
MEAN_S: Final = 4.0  # over which positions are averaged for a speed, so that a receiver at rest does not drive


def is_gpx(text: str) -> bool:
    """Whether a text is GPX."""
    head = text[:4000].lower()
    return head.lstrip("\ufeff \t\r\n").startswith("<") and GPX.search(head) is not None


def read_gpx(path: str, drive_id: str, text: str) -> Recording:
    """The tracks of a GPX file as one profile: speed by what points carry [m/s], else by their positions.

    Raises RecordingError where it is no GPX, has a document type, or fewer than two points with a time.
    """
    if re.search(r"<!(?:DOCTYPE|ENTITY)", text, re.IGNORECASE):
        raise RecordingError(path, 1, "the file", "XML with a document type", ALLOWED)
    size = ELEMENT_BYTES * (text.count("<") - text.count("</")) + ATTRIBUTE_BYTES * text.count("=")
    if size > MOST_READ_BYTES:
        found = f"XML that takes {size / 1e9:.1f} GB once it is read"
        raise RecordingError(path, 1, "the file", found, f"at most {MOST_READ_BYTES / 1e9:g} GB; split it into drives")
    root, notes = _root(path, text.strip("\ufeff \t\r\n"))
    tracks = _tracks(path, root)
    check_rows(path, sum(map(len, tracks)))
    points = [point for track in _in_order(tracks, notes) for point in track]
    if len(points) < 2:
        raise RecordingError(path, 1, "the track", f"{len(points)} points with a time", f"at least 2; {ALLOWED}")
    names = (TIME.name, LATITUDE.name, LONGITUDE.name, HEIGHT.name, SPEED.name)
    columns = tuple([point[k] for point in points] for k in range(len(names)))
    table = LogTable(path, drive_id, names, columns, range(1, len(points) + 1))
    time_s, _ = table.times(TIME)
    latitude, longitude = (table.values(column) for column in (LATITUDE, LONGITUDE))
    bad = np.isnan(latitude) | np.isnan(longitude)
    if np.count_nonzero(bad) > MOST_STRAY_FRAC * bad.size:
        table.values(LATITUDE, required=True)  # tells which
        table.values(LONGITUDE, required=True)
    bad |= stray(time_s, latitude, longitude)
    if bad.any():
        found = f"points left out, where no car is, or whose place is none: {np.count_nonzero(bad)}"
        notes.append(Note(NoteKind.REPAIRED, "latitude_deg", found))
    fresh = np.append(True, np.diff(time_s) > 0.0) & ~bad
    time_s = time_s[fresh]
    if time_s.size < 2:
        raise RecordingError(path, 1, "time", "always the same", "rising")
    latitude, longitude = latitude[fresh], longitude[fresh]
    height_m, own = (table.values(column)[fresh] for column in (HEIGHT, SPEED))
    if np.isnan(own).any():
        speed_mps, how = _speed_mps(time_s, latitude, longitude), "by the positions of its points"
    else:
        speed_mps, how = own, "as its points carry it"
    all_notes = (
        Note(NoteKind.READ, "speed_mps", f"a track of {time_s.size} points; speed {how}"),
        Note(NoteKind.MISSING, "power_w", "a track has no power: a profile to drive, from which nothing is learned"),
        *notes,
        *table.notes,
    )
    return Recording(
        id=drive_id,
        time_s=time_s,
        speed_mps=speed_mps,
        power_w=np.zeros(time_s.size),
        elevation_m=None if np.isnan(height_m).all() else height_m,
        latitude_deg=latitude,
        longitude_deg=longitude,
        notes=all_notes,
        detail=Detail.PROFILE,
    )


def _root(path: str, text: str) -> tuple[Element, list[Note]]:
    """The file's element, without what a cut at its end has spoilt, which is noted."""
    try:
        return _parsed(text), []
    except ElementTree.ParseError as error:
        ends = list(POINT_END.finditer(text))
        if ends:
            prefix = ends[-1][1]
            whole = "".join(f"</{prefix}{name}>" for name in ("trkseg", "trk", "gpx"))
            try:
                note = Note(NoteKind.REPAIRED, "", "the file ends in the midst of a track: read up to there")
                return _parsed(text[: ends[-1].end()] + whole), [note]
            except ElementTree.ParseError:
                pass  # broken elsewhere
        found = f"broken XML ({shown(str(error))})"
        raise RecordingError(path, error.position[0], "the file", found, ALLOWED) from error


def _parsed(text: str) -> Element:
    return ElementTree.fromstring(text.encode(), ElementTree.XMLParser(encoding="utf-8"))


def _in_order(tracks: list[list[tuple[str, ...]]], notes: list[Note]) -> list[list[tuple[str, ...]]]:
    """Tracks by their begin, where they are in another order and each has ISO 8601 of one zone."""
    known = [track for track in tracks if track]
    begins = [track[0][0] for track in known]
    if len({begin[10:11] + begin[19:] for begin in begins}) > 1 or begins == sorted(begins):
        return known
    notes.append(Note(NoteKind.REPAIRED, "time_s", "tracks put in the order of their begin"))
    return sorted(known, key=lambda track: track[0][0])


def _tracks(path: str, root: Element) -> list[list[tuple[str, ...]]]:
    """The points of each track, or of the file where it has none; RecordingError where they lie within each other."""
    looks = [MOST_LOOKS * sum(1 for _ in root.iter())]
    tracks = [_points(path, track, looks) for track in root.iter() if _tag(track) == "trkseg"]
    return tracks or [_points(path, root, looks)]


def _points(path: str, track: Element, looks: list[int]) -> list[tuple[str, ...]]:
    """Time, latitude, longitude, height and speed of each point of a track that has a time, as texts.

    looks: how many elements may still be looked at, counted down: each once, but for those within each other.
    """
    points: list[tuple[str, ...]] = []
    for point in track.iter():
        looks[0] -= 1
        if looks[0] < 0:
            raise RecordingError(path, 1, "the file", "tracks or points within each other", ALLOWED)
        if _tag(point) != "trkpt":
            continue
        inner = list(point.iter())
        looks[0] -= len(inner)
        own = {_tag(child): (child.text or "").strip() for child in inner if child is not point}
        if own.get("time"):
            place = (point.get(name, "").replace(",", ".") for name in ("lat", "lon"))
            points.append((own["time"], *place, own.get("ele", ""), own.get("speed", "")))
    return points


def _tag(element: Element) -> str:
    """The name of an element without its namespace."""
    return str(element.tag).rpartition("}")[2].lower()


def _speed_mps(
    time_s: NDArray[np.float64], latitude: NDArray[np.float64], longitude: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Speed by the way between the places MEAN_S around each point, float64 (n,), at most what cars drive."""
    east, north = east_north_m(latitude, longitude)
    begin, end = (np.clip(time_s + side * 0.5 * MEAN_S, time_s[0], time_s[-1]) for side in (-1.0, 1.0))
    step = [np.interp(end, time_s, way) - np.interp(begin, time_s, way) for way in (east, north)]
    return np.asarray(np.minimum(np.hypot(*step) / (end - begin), MOST_KMH / KMH_PER_MPS), np.float64)
