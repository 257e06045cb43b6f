"""Takes what can be searched for from the objects of an OpenStreetMap file, as they are read for the roads."""

from __future__ import annotations

import re
from array import array
from itertools import pairwise
from typing import TYPE_CHECKING, Any, Final

import shapely

from routing.gazetteer.entries import Box, Collected, Entry, House, Kind, Piece
from routing.gazetteer.importance import LEVELS, PLACES, STREETS, point_of_interest, with_population
from routing.gazetteer.words import number_value

if TYPE_CHECKING:
    from collections.abc import Collection, Mapping, Sequence

KEYS: Final = ("name", "place", "addr:housenumber", "addr:interpolation", "brand")
_ANY_OF: Final = frozenset((*KEYS, "ref", "operator"))
LONGEST_NAME: Final = 200  # characters
MOST_NAMES: Final = 60  # of a thing, in other languages
MOST_NUMBERS: Final = 400  # of an interpolation
UNDEFINED: Final = 2**31 - 1  # what osmium has for a coordinate that it does not know
E7: Final = 1e7
_LANGUAGE: Final = re.compile(r"name:([a-z]{2,3}(?:[-_][A-Za-z]{2,4})?)\Z")
_FOUND_BY: Final = ("alt_name", "old_name", "short_name", "official_name", "loc_name", "reg_name", "nat_name", "iata")
_UNSAID: Final = ("fixme", "?", "unknown", "yes", "no")
_STEPS: Final = {"odd": 2, "even": 2, "all": 1, "alphabetic": 0}


class PlaceReader:
    """Collects named things, streets and house numbers from objects in any order.

    keys: of tags of which objects must have one to be of interest. Ways must come with the places of their points;
    those without are counted as left out.
    """

    keys = KEYS

    def __init__(self) -> None:
        self.found = Collected()
        self._shapes: dict[int, Mapping[str, str]] = {}  # tags of relations that are areas
        self._assembled: set[int] = set()
        self._numbered: dict[int, House] = {}
        self._interpolations: list[tuple[str, tuple[int, ...], tuple[tuple[int, int], ...]]] = []

    @property
    def areas(self) -> Collection[int]:
        """Relations whose areas are wanted."""
        return self._shapes.keys()

    @property
    def lines(self) -> Collection[int]:
        """Ways that are wanted once more: none."""
        return ()

    def add(self, entity: Any, tags: Mapping[str, str], places: Sequence[tuple[int, int]] | None) -> None:
        """Take an object and its tags. places: of the points of a road, where they were read."""
        if _ANY_OF.isdisjoint(tags):
            return
        if entity.is_way():
            highway = tags.get("highway")
            if highway is not None and "area" not in tags:
                self._add_piece(entity, highway, tags, places)
            elif "name" in tags or "addr:housenumber" in tags or "brand" in tags:
                self._add_area_of_way(entity, tags)
            if "addr:interpolation" in tags:
                self._add_interpolation(entity, tags)
        elif entity.is_node():
            if entity.location.valid():
                place = entity.location.x, entity.location.y
                self._add_thing("n", entity.id, tags, place, None)
        elif entity.is_relation():
            self._add_relation(entity.id, tags)

    def add_area(self, relation: int, shape_wkb: str) -> None:
        """Take the area of a relation, as well-known binary in hexadecimal."""
        tags = self._shapes.get(relation)
        if tags is None:
            return
        shape = shapely.from_wkb(shape_wkb)
        if not shape.is_empty:
            self._assembled.add(relation)
            self._add_shape(relation, tags, shape)

    def add_line(self, way: Any) -> None:
        """Take a way that is wanted; none is."""

    def finish(self, country: str | None) -> Collected:
        """All that was found."""
        self.found.country = (country or "").lower()
        self._name_regions()
        self.found.leave_out("areas of relations that the map has in part", len(self._shapes.keys() - self._assembled))
        self._interpolate()
        return self.found

    def _add_piece(
        self, way: Any, highway: str, tags: Mapping[str, str], places: Sequence[tuple[int, int]] | None
    ) -> None:
        if highway not in STREETS:
            if "name" in tags and highway in ("services", "rest_area"):
                self._add_area_of_way(way, tags)
            return
        name = tags.get("name", "").strip() or (tags.get("ref", "").strip() if STREETS[highway] > 0.3 else "")
        if not name:
            return
        points = _flat_points(way) if places is None else array("i", [value for place in places for value in place])
        if len(points) < 4:
            self.found.leave_out("streets whose points the map lacks")
            return
        names = names_of(tags)
        if "ref" in tags and STREETS[highway] > 0.3 and tags["ref"] != name:
            names = {**names, "*ref": tags["ref"].replace(";", " ")}
        self.found.pieces.append(
            Piece(way.id, name[:LONGEST_NAME], names, highway, points, tags.get("postal_code", "").strip())
        )

    def _add_area_of_way(self, way: Any, tags: Mapping[str, str]) -> None:
        points = _points(way)
        if not points:
            self.found.leave_out("things whose points the map lacks")
            return
        xs, ys = [x for x, _ in points], [y for _, y in points]
        west, south, east, north = min(xs), min(ys), max(xs), max(ys)
        place = (west + east) // 2, (south + north) // 2
        if not way.is_closed():
            place = points[len(points) // 2]
        self._add_thing("w", way.id, tags, place, (west / E7, south / E7, east / E7, north / E7))

    def _add_thing(
        self, osm_type: str, osm_id: int, tags: Mapping[str, str], place: tuple[int, int], box: Box | None
    ) -> None:
        """A place, a point of interest, a house number, or several of these."""
        number = tags.get("addr:housenumber", "").strip()
        street = (tags.get("addr:street") or tags.get("addr:place") or "").strip()
        postcode = tags.get("addr:postcode", "").strip()
        if number:
            house = House(
                osm_type,
                osm_id,
                number[:LONGEST_NAME],
                street[:LONGEST_NAME],
                place[0],
                place[1],
                postcode,
                tags.get("addr:city", "").strip()[:LONGEST_NAME],
            )
            if osm_type == "n":
                self._numbered[osm_id] = house
            if street:
                self.found.houses.append(house)
            elif "addr:interpolation" not in tags:
                self.found.leave_out("house numbers without a street")
        kind, key, value, importance = self._kind_of(tags)
        if kind is None:
            return
        name = tags.get("name", "").strip() or tags.get("brand", "").strip() or tags.get("operator", "").strip()
        if not name or name.casefold() in _UNSAID:
            return
        population = tags.get("population", "").replace(" ", "").replace(",", "").replace(".", "")
        people = int(population) if population.isascii() and population.isdigit() and len(population) < 11 else 0
        self.found.entries.append(
            Entry(
                kind,
                osm_type,
                osm_id,
                key,
                value,
                name[:LONGEST_NAME],
                names_of(tags),
                place[1] / E7,
                place[0] / E7,
                with_population(importance, people) if key == "place" else importance,
                box,
                street[:LONGEST_NAME],
                number[:LONGEST_NAME],
                (postcode or tags.get("postal_code", "")).strip()[:20],
                tags.get("addr:city", "").strip()[:LONGEST_NAME],
                people,
            )
        )

    def _kind_of(self, tags: Mapping[str, str]) -> tuple[Kind | None, str, str, float]:
        place = tags.get("place", "")
        if place in PLACES:
            kind, importance = PLACES[place]
            return kind, "place", place, importance
        point = point_of_interest(tags)
        if point is None:
            return None, "", "", 0.0
        if "name" not in tags and point[0] not in ("amenity", "shop", "tourism"):
            return None, "", "", 0.0
        kind = Kind.STATION if point[1] == "charging_station" else Kind.POINT
        return kind, *point

    def _add_relation(self, osm_id: int, tags: Mapping[str, str]) -> None:
        form = tags.get("type")
        is_boundary = tags.get("boundary") == "administrative" and "name" in tags
        if form not in ("multipolygon", "boundary"):
            if form in ("site", "public_transport") and "name" in tags:
                self.found.leave_out("relations that are no areas")
            return
        if is_boundary or self._kind_of(tags)[0] is not None or "addr:housenumber" in tags:
            self._shapes[osm_id] = tags

    def _name_regions(self) -> None:
        """Names of the country and the state, which extracts have no whole boundary of."""
        of_level: dict[int, list[Mapping[str, str]]] = {2: [], 4: []}
        for tags in self._shapes.values():
            level = _level_of(tags)
            if level in of_level:
                of_level[level].append(tags)
        coded = [tags for tags in of_level[2] if tags.get("ISO3166-1", tags.get("ISO3166-1:alpha2"))]
        for tags in coded:
            code = tags.get("ISO3166-1:alpha2", tags.get("ISO3166-1", "")).lower()
            if code == self.found.country or (len(coded) == 1 and not self.found.country):
                self.found.country = code
                self.found.country_names = {"": tags["name"], **names_of(tags)}
        if len(of_level[4]) == 1 and len(coded) <= 1:
            self.found.state_names = {"": of_level[4][0]["name"], **names_of(of_level[4][0])}

    def _add_shape(self, osm_id: int, tags: Mapping[str, str], shape: shapely.geometry.base.BaseGeometry) -> None:
        middle = shape.representative_point()
        place = round(middle.x * E7), round(middle.y * E7)
        west, south, east, north = shape.bounds
        level = _level_of(tags)
        if not level:
            self._add_thing("r", osm_id, tags, place, (west, south, east, north))
            return
        if level in LEVELS or level in (9, 10, 11):
            entry = Entry(
                Kind.COUNTRY
                if level == 2
                else Kind.STATE
                if level < 6
                else Kind.COUNTY
                if level < 8
                else Kind.DISTRICT,
                "r",
                osm_id,
                "boundary",
                "administrative",
                tags["name"].strip()[:LONGEST_NAME],
                names_of(tags),
                middle.y,
                middle.x,
                LEVELS.get(level, 0.4),
                (west, south, east, north),
                area=shape,
                level=level,
            )
            self.found.entries.append(entry)

    def _add_interpolation(self, way: Any, tags: Mapping[str, str]) -> None:
        refs, points = [], []
        for node in way.nodes:
            if node.location.valid():
                refs.append(node.ref)
                points.append((node.location.x, node.location.y))
        self._interpolations.append((tags["addr:interpolation"].strip().lower(), tuple(refs), tuple(points)))

    def _interpolate(self) -> None:
        """House numbers between those at the points of ways that say that there are some, evenly along the way."""
        for rule, refs, points in self._interpolations:
            step = int(rule) if rule.isascii() and rule.isdigit() and 0 < int(rule) < 100 else _STEPS.get(rule, 0)
            if not step:
                self.found.leave_out("interpolations of house numbers that are not understood")
                continue
            at = [k for k, ref in enumerate(refs) if ref in self._numbered]
            for begin, end in pairwise(at):
                self._between(self._numbered[refs[begin]], self._numbered[refs[end]], step, points[begin : end + 1])

    def _between(self, first: House, last: House, step: int, points: tuple[tuple[int, int], ...]) -> None:
        low, high = number_value(first.number), number_value(last.number)
        street = first.street or last.street
        if low is None or high is None or not street or abs(high - low) > step * MOST_NUMBERS:
            self.found.leave_out("interpolations of house numbers that are not understood")
            return
        line = shapely.LineString(points)
        sign = 1 if high > low else -1
        for number in range(low + sign * step, high, sign * step):
            place = line.interpolate((number - low) / (high - low), normalized=True)
            x, y = round(place.x), round(place.y)
            self.found.houses.append(
                House(first.osm_type, first.osm_id, str(number), street, x, y, first.postcode, first.city)
            )


def _flat_points(way: Any) -> array[int]:
    """The same, one number after the other, for what is kept of all ways."""
    flat = array("i", [value for node in way.nodes for value in (node.x, node.y)])
    return flat if UNDEFINED not in flat else array("i", [value for place in _points(way) for value in place])


def _points(way: Any) -> list[tuple[int, int]]:
    """Points of a way as lon, lat [1e-7 deg], without those whose place is not known."""
    return [place for node in way.nodes if (place := (node.x, node.y))[0] != UNDEFINED]


def names_of(tags: Mapping[str, str]) -> dict[str, str]:
    """Names by language, int for the international one; under keys that begin with a star those only to find by."""
    names: dict[str, str] = {}
    for key, value in tags.items():
        if key.startswith("name:") and len(names) < MOST_NAMES:
            found = _LANGUAGE.match(key)
            if found:
                names[found[1].replace("_", "-")] = value[:LONGEST_NAME]
    if "int_name" in tags:
        names["int"] = tags["int_name"][:LONGEST_NAME]
    names |= {f"*{key}": tags[key][:LONGEST_NAME] for key in _FOUND_BY if key in tags}
    return names


def _level_of(tags: Mapping[str, str]) -> int:
    level = tags.get("admin_level", "")
    is_boundary = tags.get("boundary") == "administrative" and "name" in tags
    return int(level) if is_boundary and level.isascii() and level.isdigit() and len(level) < 3 else 0
