"""Takes the ground from the objects of an OpenStreetMap file, as they are read for the roads."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

import osmium
import shapely

from routing.ground.features import RawGround
from routing.ground.kinds import KEYS, PLACES, Layer, area_kind, border_level, line_kind

if TYPE_CHECKING:
    from collections.abc import Collection, Mapping, Sequence

_KEYS: Final = frozenset(KEYS)
LANGUAGES: Final = ("de", "en", "es", "fr", "it", "pt")  # of names that are kept beside the local one
LONGEST_NAME: Final = 100  # characters
UNDEFINED: Final = 2**31 - 1  # what osmium has for a coordinate that it does not know
PEOPLE: Final = ((1_000_000, 2), (100_000, 1))  # a place of so many is named so many ranks earlier


class GroundReader:
    """Collects water, woods, built-up land, borders, coast and places from objects in any order.

    Of a way that is there twice the later one holds. Ways must come with the places of their points; those without are
    counted as left out.
    """

    keys = KEYS

    def __init__(self) -> None:
        self.found = RawGround()
        self._ways: dict[int, tuple[str, tuple[Layer, str], Mapping[str, str]] | None] = {}
        self._coast: dict[int, str] = {}
        self._relations: dict[int, tuple[tuple[Layer, str], Mapping[str, str]]] = {}
        self._border_of: dict[int, int] = {}  # ways of borders that may have no tags of their own
        self._wkb = osmium.geom.WKBFactory()

    def add(self, entity: Any, tags: Mapping[str, str], places: Sequence[tuple[int, int]] | None) -> None:
        """Take an object and its tags."""
        if _KEYS.isdisjoint(tags):
            return
        if entity.is_way():
            self._add_way(entity, tags)
        elif entity.is_node():
            self._add_node(entity, tags)
        elif entity.is_relation():
            self._add_relation(entity, tags)

    @property
    def areas(self) -> Collection[int]:
        """Relations whose areas are wanted, to be handed to add_area."""
        return self._relations.keys()

    @property
    def lines(self) -> Collection[int]:
        """Ways that are wanted once more, to be handed to add_line."""
        return [way for way in self._border_of if way not in self._ways]

    def add_area(self, relation: int, shape_wkb: str) -> None:
        """Take the area of a relation, as well-known binary in hexadecimal."""
        found = self._relations.pop(relation, None)
        if found is not None:
            self.found.add(found[0], found[1], shape_wkb)

    def add_line(self, way: Any) -> None:
        """Take a way of a border."""
        shape = self._line(way)
        if shape is not None:
            self._ways[way.id] = shape, (Layer.BOUNDARY, str(self._border_of[way.id])), {}

    def finish(self, country: str | None) -> RawGround:
        """All that was found."""
        self.found.leave_out("areas that the map has in part", len(self._relations))
        for way_id, row in self._ways.items():
            if row is None:
                continue
            shape, kind, names = row
            if kind[0] is Layer.BOUNDARY:
                kind = Layer.BOUNDARY, min(kind[1], str(self._border_of.get(way_id, kind[1])))
            self.found.add(kind, names, shape)
        self.found.coast += self._coast.values()
        self._ways, self._coast = {}, {}
        return self.found

    def _add_way(self, way: Any, tags: Mapping[str, str]) -> None:
        if tags.get("natural") == "coastline":
            shape = self._line(way)
            if shape is not None:
                self._coast[way.id] = shape
        kind = area_kind(tags) if way.is_closed() else None
        if kind is not None:
            shape = self._area(way)
        else:
            kind = line_kind(tags)
            shape = None if kind is None else self._line(way)
        if kind is None or shape is None:
            self._ways.pop(way.id, None)
            return
        self._ways[way.id] = shape, kind, {} if kind[0] is Layer.BOUNDARY else _names(tags)

    def _add_node(self, node: Any, tags: Mapping[str, str]) -> None:
        place = tags.get("place", "")
        if place not in PLACES or not tags.get("name", "").strip() or not node.location.valid():
            return
        people = tags.get("population", "").replace(" ", "").replace(",", "").replace(".", "")
        number = int(people) if people.isascii() and people.isdigit() and len(people) < 11 else 0
        rank = PLACES[place] - next((ranks for least, ranks in PEOPLE if number >= least), 0)
        point = shapely.to_wkb(shapely.Point(node.location.lon, node.location.lat), hex=True)
        self.found.add((Layer.PLACE, place), _names(tags), point, max(rank, 0))

    def _add_relation(self, relation: Any, tags: Mapping[str, str]) -> None:
        level = border_level(tags)
        if level is not None:
            for member in relation.members:
                if member.type == "w":
                    self._border_of[member.ref] = min(level, self._border_of.get(member.ref, level))
        kind = area_kind(tags) if tags.get("type") == "multipolygon" else None
        if kind is not None and relation.id >= 0:
            self._relations[relation.id] = kind, _names(tags)

    def _line(self, way: Any) -> str | None:
        try:
            return str(self._wkb.create_linestring(way))
        except (RuntimeError, osmium.InvalidLocationError):
            points = _points(way)
            if len(set(points)) > 1:
                return str(shapely.to_wkb(shapely.LineString(points), hex=True))
            self.found.leave_out("lines whose points the map lacks")
            return None

    def _area(self, way: Any) -> str | None:
        """The rim of an area as a line, which becomes an area with all others at once."""
        try:
            if len(way.nodes) > 3:
                return str(self._wkb.create_linestring(way))
        except (RuntimeError, osmium.InvalidLocationError):
            points = _points(way)
            if len(set(points)) > 2:
                return str(shapely.to_wkb(shapely.LineString([*points, points[0]]), hex=True))
        self.found.leave_out("areas whose points the map lacks")
        return None


def _points(way: Any) -> list[tuple[float, float]]:
    return [(node.x / 1e7, node.y / 1e7) for node in way.nodes if node.x != UNDEFINED]


def _names(tags: Mapping[str, str]) -> dict[str, str]:
    """Names by language, "" for the local one, in other languages where they differ from it."""
    local = tags.get("name", "").strip()[:LONGEST_NAME]
    if not local:
        return {}
    names = {"": local}
    for language in LANGUAGES:
        other = tags.get(f"name:{language}", "").strip()[:LONGEST_NAME]
        if other and other != local:
            names[language] = other
    return names
