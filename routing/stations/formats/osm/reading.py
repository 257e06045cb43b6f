"""Reads the charging stations of an OpenStreetMap PBF or XML file."""

from __future__ import annotations

from collections import Counter, defaultdict
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, Final

import numpy as np
import osmium
import shapely
from shapely.ops import nearest_points

from routing.errors import ImportFailedError
from routing.graph.earth import E7
from routing.importers.osm_files import check_strings, deleted_objects, open_osm
from routing.places import Point
from routing.stations.formats.osm.tags import (
    LIFE_CYCLE,
    POINT_TAG,
    STATION_TAG,
    LeftOut,
    access_of,
    capacity_of,
    charge_of,
    fee_of,
    operational_of,
    reason_to_leave_out,
    sockets_of,
)
from routing.stations.station import Access, Socket, Station, StationSource

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping
    from pathlib import Path

    from shapely.geometry.base import BaseGeometry

OSM_KEY: Final = "osm"
POINT_REACH_M: Final = 60.0  # from a station drawn as a point, within which a charge point is its own; assumed
_METRE_DEG: Final = 1.0 / 111_195.0
_TAGS: Final = (
    STATION_TAG,
    POINT_TAG,
    *((f"{prefix}:{key}", value) for prefix in LIFE_CYCLE for key, value in (STATION_TAG, POINT_TAG)),
)


_ENDINGS: Final = (".pbf", ".osm", ".osm.gz", ".osm.bz2")
_PEEKED_BYTES: Final = 4096


@dataclass(frozen=True, slots=True)
class MapStations:
    """The stations of a map, not placed on roads yet, and how many were left out, by reason."""

    stations: tuple[Station, ...]
    source: StationSource
    left_out: Mapping[str, int]


@dataclass(slots=True)
class _Drawn:
    """A station or charge point as the map draws it: tags, and its shape as nodes and ways, or a place of its own."""

    id: str
    tags: dict[str, str]
    location: tuple[int, int] | None = None
    lines: list[list[int]] = field(default_factory=list)
    points: list[int] = field(default_factory=list)
    way_members: list[int] = field(default_factory=list)

    @property
    def is_point(self) -> bool:
        return self.tags.get(POINT_TAG[0]) == POINT_TAG[1] and self.tags.get(STATION_TAG[0]) != STATION_TAG[1]


def read_osm_stations(path: Path) -> MapStations:
    """The charging stations of an OSM file, drawn as points, areas or relations, in O(file).

    Charge points, and stations drawn within another one's area, are parts of it: their sockets count where the station
    itself names none. A charge point beside no station is one of its own. Raises ImportFailedError where the file is
    missing or damaged.
    """
    if not path.is_file():
        raise ImportFailedError("map", path, "is a folder, allowed: a file" if path.is_dir() else "no such file")
    check_strings(path)
    file, deleted = open_osm(path), deleted_objects(path)
    try:
        drawn, retrieved = _drawn(file, deleted)
        location = _locations(file, drawn, deleted)
    except (RuntimeError, ValueError, osmium.InvalidLocationError) as error:
        raise ImportFailedError("map", path, f"not a readable OSM file ({error})") from error
    source = StationSource(
        OSM_KEY, "© OpenStreetMap contributors", "ODbL-1.0", "https://www.openstreetmap.org/copyright", retrieved
    )
    left_out: Counter[str] = Counter()
    shapes: list[tuple[_Drawn, BaseGeometry]] = []
    for thing in drawn:
        reason = reason_to_leave_out(thing.tags)
        shape = _shape(thing, location)
        if reason is not None or shape is None:
            left_out[reason or LeftOut.NO_PLACE] += 1
        else:
            shapes.append((thing, shape))
    return MapStations(_stations(shapes), source, {str(reason): count for reason, count in sorted(left_out.items())})


def is_osm(path: Path) -> bool:
    """Whether a file is one of OpenStreetMap, by its name or what it begins with; False where it can't be read."""
    if path.name.lower().endswith(_ENDINGS):
        return True
    try:
        with path.open("rb") as file:
            begin = file.read(_PEEKED_BYTES)
    except OSError:
        return False
    return b"OSMHeader" in begin[:64] or b"<osm" in begin.replace(b"\0", b"")


def _drawn(file: Any, deleted: frozenset[tuple[str, int]]) -> tuple[list[_Drawn], str]:
    """All stations and charge points, and when the file is from."""
    found: dict[str, _Drawn] = {}
    reader = osmium.FileProcessor(file)
    retrieved = reader.header.get("osmosis_replication_timestamp", "") or reader.header.get("timestamp", "")
    entity: Any
    for entity in reader.with_filter(osmium.filter.TagFilter(*_TAGS)):
        kind = entity.type_str()
        if not entity.visible or (kind, entity.id) in deleted:
            continue
        thing = _Drawn(f"{OSM_KEY}:{kind}{entity.id}", {tag.k: tag.v for tag in entity.tags})
        if entity.is_node():
            if entity.location.valid():
                thing.location = (entity.location.x, entity.location.y)
        elif entity.is_way():
            thing.lines.append([node.ref for node in entity.nodes])
        elif entity.is_relation():
            thing.points = [member.ref for member in entity.members if member.type == "n"]
            thing.way_members = [member.ref for member in entity.members if member.type == "w"]
        found[thing.id] = thing
    return list(found.values()), str(retrieved)[:10]


def _locations(file: Any, drawn: Iterable[_Drawn], deleted: frozenset[tuple[str, int]]) -> dict[int, tuple[int, int]]:
    """Places of all nodes that shapes need; the ways of relations are read first."""
    wanted_ways: dict[int, list[_Drawn]] = defaultdict(list)
    location: dict[int, tuple[int, int]] = {}
    for thing in drawn:
        for way in thing.way_members:
            wanted_ways[way].append(thing)
    entity: Any
    if wanted_ways:
        for entity in _by_id(file, osmium.osm.WAY, wanted_ways):
            if entity.id in wanted_ways and entity.visible and ("w", entity.id) not in deleted:
                refs = [node.ref for node in entity.nodes]
                for thing in wanted_ways[entity.id]:
                    thing.lines.append(refs)
    wanted = {ref for thing in drawn for line in (*thing.lines, thing.points) for ref in line}
    if wanted:
        for entity in _by_id(file, osmium.osm.NODE, wanted):
            if entity.id in wanted and entity.location.valid() and ("n", entity.id) not in deleted:
                location[entity.id] = (entity.location.x, entity.location.y)
    if wanted - location.keys():  # ways may carry the places of their points, as `out geom` of Overpass has them
        for entity in osmium.FileProcessor(file, osmium.osm.WAY).with_filter(osmium.filter.TagFilter(*_TAGS)):
            for node in entity.nodes:
                if node.location.valid():
                    location.setdefault(node.ref, (node.location.x, node.location.y))
    return location


def _by_id(file: Any, kind: Any, wanted: Iterable[int]) -> Any:
    """The objects of a kind with some ids; all of them where an id is negative, which the filter can't hold."""
    ids = list(wanted)
    reader = osmium.FileProcessor(file, kind)
    return reader.with_filter(osmium.filter.IdFilter(ids)) if min(ids) >= 0 else reader


def _shape(thing: _Drawn, location: Mapping[int, tuple[int, int]]) -> BaseGeometry | None:
    """A point, or the area that lines enclose, in degrees; None where no place is known."""
    if thing.location is not None:
        return shapely.Point(thing.location[0] / E7, thing.location[1] / E7)
    lines = [[(x / E7, y / E7) for ref in line if ref in location for x, y in (location[ref],)] for line in thing.lines]
    rings = [shapely.Polygon(line) for line in lines if len(line) > 3 and line[0] == line[-1]]
    rings = [ring for ring in rings if ring.is_valid and ring.area > 0.0]
    if rings:
        return max(rings, key=lambda ring: ring.area)
    points = [place for line in lines for place in line]
    points += [(location[ref][0] / E7, location[ref][1] / E7) for ref in thing.points if ref in location]
    return shapely.MultiPoint(points).convex_hull if points else None


def _stations(shapes: list[tuple[_Drawn, BaseGeometry]]) -> tuple[Station, ...]:
    """Stations, each with what is drawn within it."""
    whole = [k for k, (thing, _) in enumerate(shapes) if not thing.is_point]
    parts: dict[int, list[_Drawn]] = defaultdict(list)
    within: set[int] = set()
    if whole:
        areas = np.array([shapes[k][1] for k in whole], np.object_)
        tree = shapely.STRtree(areas)
        for k, (thing, shape) in enumerate(shapes):
            owner = _owner(k, thing, shape, tree, whole, shapes)
            if owner is not None and owner not in within:
                parts[owner].append(thing)
                within.add(k)
    return tuple(_station(thing, shape, parts.get(k, [])) for k, (thing, shape) in enumerate(shapes) if k not in within)


def _owner(
    k: int,
    thing: _Drawn,
    shape: BaseGeometry,
    tree: shapely.STRtree,
    whole: list[int],
    shapes: list[tuple[_Drawn, BaseGeometry]],
) -> int | None:
    """The station that something is a part of: whose area it lies in, or for a charge point the nearest one."""
    if not isinstance(shape, shapely.Point):
        return None
    inside = [whole[i] for i in tree.query(shape, predicate="within").tolist()]
    areas = [owner for owner in inside if owner != k and shapes[owner][1].area > 0.0]
    if areas:
        return int(min(areas))
    if not thing.is_point:
        return None
    x, y = shape.x, shape.y
    shrink = max(float(np.cos(np.radians(y))), 0.01)
    reach = POINT_REACH_M * _METRE_DEG
    near = []
    for i in tree.query(shapely.box(x - reach / shrink, y - reach, x + reach / shrink, y + reach)).tolist():
        other, area = shapes[whole[i]]
        place = nearest_points(area, shape)[0]
        away_m = float(np.hypot((place.x - x) * shrink, place.y - y)) / _METRE_DEG
        if away_m <= POINT_REACH_M and _alike(thing.tags, other.tags):
            near.append((away_m, whole[i]))
    return min(near)[1] if near else None


def _alike(tags: Mapping[str, str], others: Mapping[str, str]) -> bool:
    """Whether two things may have one operator: no key of both says otherwise."""
    keys = ("operator", "network", "brand")
    return all(tags[key].casefold() == others[key].casefold() for key in keys if key in tags and key in others)


def _station(thing: _Drawn, shape: BaseGeometry, parts: list[_Drawn]) -> Station:
    middle = shape.representative_point() if shape.area > 0.0 else shape.centroid
    at = Point(round(middle.y, 7), round(middle.x, 7))
    tags = thing.tags
    of_parts = [sockets_of(part.tags, at) for part in parts if reason_to_leave_out(part.tags) is None]
    own = sockets_of(tags, at)
    capacity = capacity_of(tags)
    if capacity is None and parts:
        capacity = sum(capacity_of(part.tags) or 1 for part in parts)
    hours = tags.get("opening_hours", "").strip()
    return Station(
        id=thing.id,
        at=at,
        sockets=own or _added_up(of_parts),
        name=tags.get("name", "").strip() or _number_of(tags),
        operator=tags.get("operator", "").strip(),
        network=tags.get("network", "").strip() or tags.get("brand", "").strip(),
        capacity=capacity,
        access=_access_by(thing, parts),
        fee=fee_of(tags),
        price=charge_of(tags),
        opening_hours=hours or None,
        operational=operational_of(tags),
        source=OSM_KEY,
        merged=tuple(sorted(part.id for part in parts)),
    )


def _number_of(tags: Mapping[str, str]) -> str:
    """The number that a station without a name goes by."""
    ref = tags.get("ref", "").strip()
    return "" if ref.casefold() in ("fixme", "?", "unknown") else ref


def _access_by(thing: _Drawn, parts: list[_Drawn]) -> Access:
    every = (access_of(part.tags) for part in (thing, *parts))
    return next((access for access in every if access is not Access.UNKNOWN), Access.UNKNOWN)


def _added_up(parts: Iterable[tuple[Socket, ...]]) -> tuple[Socket, ...]:
    counts: dict[Socket, int] = {}
    for sockets in parts:
        for socket in sockets:
            single = replace(socket, count=1)
            counts[single] = counts.get(single, 0) + socket.count
    return tuple(replace(socket, count=count) for socket, count in counts.items())
