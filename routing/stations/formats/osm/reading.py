"""Reads the charging stations of an OpenStreetMap PBF or XML file."""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Final

import osmium
import shapely

from routing.errors import ImportFailedError
from routing.graph.earth import E7
from routing.importers.osm_files import check_strings, deleted_objects, open_osm
from routing.places import Point
from routing.stations.formats.gathering import Gathering, ReadStations
from routing.stations.formats.osm.parts import Drawing, place_of_shape, without_parts
from routing.stations.formats.osm.station import OSM_KEY, is_charge_point, osm_source, osm_station
from routing.stations.formats.osm.tags import TOLD_TAGS, LeftOut
from routing.stations.notes import LeftOutError

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping
    from pathlib import Path

    from shapely.geometry.base import BaseGeometry

FORMAT: Final = "OpenStreetMap"
_ENDINGS: Final = (".pbf", ".osm", ".osm.gz", ".osm.bz2")
_PEEKED_BYTES: Final = 4096


@dataclass(slots=True)
class _Drawn:
    """A station or charge point as the map draws it: tags, and its shape as nodes and ways, or a place of its own."""

    id: str
    tags: dict[str, str]
    location: tuple[int, int] | None = None
    lines: list[list[int]] = field(default_factory=list)
    points: list[int] = field(default_factory=list)
    way_members: list[int] = field(default_factory=list)
    members: tuple[str, ...] = ()  # ids


def read_osm_stations(path: Path) -> ReadStations:
    """The charging stations of an OSM file, drawn as points, areas or relations, without their parts, in O(file).

    Raises ImportFailedError where the file is missing or damaged.
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
    gathering = Gathering(str(path), "object")
    shapes = _shapes(drawn, location)
    drawings: dict[str, Drawing] = {}
    for thing in drawn:
        gathering.number = thing.id
        try:
            shape = shapes.get(thing.id)
            at = Point(0.0, 0.0) if shape is None else place_of_shape(shape)
            station = osm_station(thing.tags, at, thing.id.removeprefix(f"{OSM_KEY}:"), gathering)
            if shape is None:
                raise LeftOutError(LeftOut.NO_PLACE.value, "place", "missing", "points that are in the file")
        except LeftOutError as error:
            gathering.leave_out(thing.id, error)
            continue
        gathering.stations[thing.id] = station
        drawings[thing.id] = Drawing(shape, is_charge_point(thing.tags), thing.members)
    gathering.unite_parts(without_parts(gathering.stations, drawings))
    return gathering.result(FORMAT, osm_source(retrieved))


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
    for entity in reader.with_filter(osmium.filter.TagFilter(*TOLD_TAGS)):
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
            thing.members = tuple(f"{OSM_KEY}:{member.type}{member.ref}" for member in entity.members)
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
        for entity in osmium.FileProcessor(file, osmium.osm.WAY).with_filter(osmium.filter.TagFilter(*TOLD_TAGS)):
            for node in entity.nodes:
                if node.location.valid():
                    location.setdefault(node.ref, (node.location.x, node.location.y))
    return location


def _by_id(file: Any, kind: Any, wanted: Iterable[int]) -> Any:
    """The objects of a kind with some ids; all of them where an id is negative, which the filter can't hold."""
    ids = list(wanted)
    reader = osmium.FileProcessor(file, kind)
    return reader.with_filter(osmium.filter.IdFilter(ids)) if min(ids) >= 0 else reader


def _shapes(drawn: Iterable[_Drawn], location: Mapping[int, tuple[int, int]]) -> dict[str, BaseGeometry]:
    """Shapes by id; a relation of nothing but other things has the middles of those."""
    found = {thing.id: shape for thing in drawn if (shape := _shape(thing, location)) is not None}
    for thing in drawn:
        if thing.id not in found:
            middles = [found[member].centroid for member in thing.members if member in found]
            if middles:
                found[thing.id] = shapely.MultiPoint(middles)
    return found


def _shape(thing: _Drawn, location: Mapping[int, tuple[int, int]]) -> BaseGeometry | None:
    """A point, the areas that lines enclose together, or all points, in degrees; None where no place is known."""
    if thing.location is not None:
        return shapely.Point(thing.location[0] / E7, thing.location[1] / E7)
    lines = [[(x / E7, y / E7) for ref in line if ref in location for x, y in (location[ref],)] for line in thing.lines]
    rings = shapely.polygonize([shapely.LineString(line) for line in lines if len(line) > 1])
    if rings.area > 0.0:
        return shapely.union_all(list(rings.geoms))
    points = [place for line in lines for place in line]
    points += [(location[ref][0] / E7, location[ref][1] / E7) for ref in thing.points if ref in location]
    return shapely.MultiPoint(points) if points else None
