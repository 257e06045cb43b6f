"""GeoJSON of stations: points with documented names, OpenStreetMap's tags or the names of the American register."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

import shapely

from routing.stations.formats import alternative_fuels
from routing.stations.formats.entries import dicts, member
from routing.stations.formats.gathering import Gathering, clean
from routing.stations.formats.numbers import degrees_of, place_of
from routing.stations.formats.osm.parts import Drawing, place_of_shape, without_parts
from routing.stations.formats.osm.station import OSM_KEY, SOCKET, is_charge_point, osm_source, osm_station
from routing.stations.formats.osm.tags import STATION_TAG, is_told
from routing.stations.formats.plain import COLUMNS, station_of
from routing.stations.formats.tables import folded
from routing.stations.notes import LeftOutError, StationFileError, shown
from routing.stations.station import Station, StationSource

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from shapely.geometry.base import BaseGeometry

    from routing.places import Point

NAME: Final = "GeoJSON"
MOST_CORNERS: Final = 10_000  # of an outline
HALF_ROUND_DEG: Final = 180.0
MOST_POLYGONS: Final = 100  # of one station
MOST_PROPERTIES: Final = 500
KINDS: Final = ("node", "way", "relation")
VALUES: Final = {folded(name): value for value, names in reversed(COLUMNS.items()) for name in reversed(names)}
WGS_84: Final = ("CRS84", "4326")


def recognises(entry: Mapping[str, Any]) -> bool:
    """Whether an object is a feature of GeoJSON, or an element of OpenStreetMap as Overpass gives it in JSON."""
    return (entry.get("type") == "Feature" and "geometry" in entry) or _is_element(entry)


def read(
    entries: Iterator[tuple[int, Any]], members: Mapping[str, Any], gathering: Gathering, retrieved: str
) -> StationSource:
    """Gather the stations of the features; where they are from."""
    sources: dict[str, None] = {}
    drawings: dict[str, Drawing] = {}
    for number, entry in entries:
        gathering.number = number
        try:
            station, drawing = _station(entry, gathering)
            gathering.add(station)
            sources[station.source] = None
            if drawing is not None:
                drawings[station.id] = drawing
        except LeftOutError as error:
            gathering.leave_out(number, error)
    _check_reference(members, gathering.path)
    gathering.unite_parts(without_parts(gathering.stations, drawings))
    if list(sources) == [OSM_KEY]:
        return osm_source(retrieved)
    if list(sources) == [alternative_fuels.KEY]:
        source = alternative_fuels.SOURCE
        return StationSource(source.key, source.name, source.licence, source.url, retrieved)
    gathering.rekey(gathering.own_key)
    mixed = " (with stations of OpenStreetMap, ODbL-1.0)" if OSM_KEY in sources else ""
    return StationSource(gathering.own_key, "a file of its own", f"as its author says{mixed}", "", retrieved)


def _check_reference(members: Mapping[str, Any], path: str) -> None:
    """Raises StationFileError for coordinates that are not longitude and latitude, as its end may say."""
    name = member(members.get("crs"), "properties", "name")
    if isinstance(name, str) and not name.endswith(WGS_84):
        raise StationFileError(path, "", "crs", shown(name), "longitude and latitude of WGS 84")


def _is_element(entry: Mapping[str, Any]) -> bool:
    return entry.get("type") in KINDS and "id" in entry and ("tags" in entry or "lat" in entry or "nodes" in entry)


def _station(entry: Any, gathering: Gathering) -> tuple[Station, Drawing | None]:
    """The station of an entry, and how it is drawn where it is one of OpenStreetMap; raises LeftOutError."""
    if not isinstance(entry, dict):
        raise LeftOutError("no object", "entry", shown(entry), "a feature")
    if _is_element(entry):
        return _element(entry, gathering)
    properties = entry.get("properties")
    if not isinstance(properties, dict):
        properties = {}
    if len(properties) > MOST_PROPERTIES:
        found, allowed = f"{len(properties)} properties", f"at most {MOST_PROPERTIES}"
        raise LeftOutError("too many properties", "properties", found, allowed)
    at = _place(entry.get("geometry"))
    nested = properties.get("tags")
    tags = _texts(nested if isinstance(nested, dict) else properties)
    values: dict[str, Any] = {}
    for name, value in properties.items():
        known = VALUES.get(folded(name[:40]))
        if known is not None and value is not None:
            values.setdefault(known, value)
    has_sockets = any(SOCKET.fullmatch(key) for key in tags)
    if has_sockets or (is_told(tags) and "plugs" not in values):
        shape = _outline(entry["geometry"]) or shapely.Point(at.lon_deg, at.lat_deg)
        if shape.area > 0.0:
            at = place_of_shape(shape)
        asked = tags if is_told(tags) else {**tags, STATION_TAG[0]: STATION_TAG[1]}
        station = osm_station(asked, at, _osm_id(entry, properties, at, gathering), gathering)
        return station, Drawing(shape, is_charge_point(asked))
    if "fuel_type_code" in properties:
        return alternative_fuels.json_station(properties, gathering, at), None
    if isinstance(entry.get("id"), str | int):
        values.setdefault("id", entry["id"])

    price = values.get("price")
    if isinstance(price, dict):  # as GET /graphs/{name}/stations has it
        values |= {name: price[name] for name in ("currency", "per_kwh", "per_min", "per_session") if name in price}
        values["price"] = price.get("text")

    def cell(value: str) -> Any:
        found = values.get(value, "")
        return str(found).lower() if isinstance(found, bool) else found

    return station_of(cell, gathering, gathering.own_key, at=at), None


def _element(entry: Mapping[str, Any], gathering: Gathering) -> tuple[Station, Drawing]:
    """The station of an element of Overpass, which has a place, a centre, or the places of its corners."""
    tags = _texts(entry["tags"]) if isinstance(entry.get("tags"), dict) else {}
    if not is_told(tags):
        raise LeftOutError("no charging station", "amenity", shown(tags.get("amenity", "missing")), "charging_station")
    corners = [[member(corner, "lon"), member(corner, "lat")] for corner in dicts(entry.get("geometry"), MOST_CORNERS)]
    shape = _outline({"type": "Polygon", "coordinates": [corners]}) if corners else None
    if shape is not None:
        at = place_of_shape(shape)
    else:
        place = entry if "lat" in entry else entry.get("center")
        at = place_of(member(place, "lat"), member(place, "lon"))
        shape = shapely.Point(at.lon_deg, at.lat_deg)
    members = [
        f"{OSM_KEY}:{clean(part.get('type'), 1)}{clean(part.get('ref'), 20)}" for part in dicts(entry.get("members"))
    ]
    station = osm_station(tags, at, f"{entry['type'][0]}{clean(entry.get('id'), 20)}", gathering)
    return station, Drawing(shape, is_charge_point(tags), tuple(members))


def _outline(geometry: Any) -> BaseGeometry | None:
    """The areas of a polygon or several [deg], without their holes; None for other shapes and what is broken."""
    coordinates = member(geometry, "coordinates")
    polygons = {"Polygon": [coordinates], "MultiPolygon": coordinates}.get(member(geometry, "type"))
    areas = []
    for polygon in polygons[:MOST_POLYGONS] if isinstance(polygons, list) else ():
        ring = polygon[0] if isinstance(polygon, list) and polygon else None
        corners = [
            (lon, lat)
            for corner in (ring[:MOST_CORNERS] if isinstance(ring, list) else ())
            if isinstance(corner, list) and len(corner) >= 2
            if (lon := degrees_of(corner[0])) is not None and (lat := degrees_of(corner[1])) is not None
        ]
        if len(corners) > 3 and corners[0] == corners[-1]:
            area = shapely.Polygon(corners)
            west, south, east, north = area.bounds
            if (
                area.is_valid
                and east - west <= HALF_ROUND_DEG
                and max(-south, north) <= 90.0
                and max(-west, east) <= 180.0
            ):
                areas.append(area)
    found = shapely.union_all(areas)
    return found if found.area > 0.0 else None


def _texts(properties: Mapping[str, Any]) -> dict[str, str]:
    return {key: str(value) for key, value in properties.items() if isinstance(value, str | int | float)}


def _osm_id(entry: Mapping[str, Any], properties: Mapping[str, Any], at: Point, gathering: Gathering) -> str:
    """The id of an object as n123, of "node/123" or of type and id; else its place."""
    named = clean(entry.get("id") or properties.get("@id") or properties.get("osm_id"), 40)
    kind, _, number = named.rpartition("/")
    kind = kind.rpartition("/")[2] or clean(properties.get("type") or properties.get("osm_type"), 10)
    number = number if number.isdigit() else clean(properties.get("id"), 20)
    if kind in KINDS and number.isdigit():
        return f"{kind[0]}{number}"
    return gathering.free_id(f"osm:{at.lat_deg:.6f},{at.lon_deg:.6f}").removeprefix("osm:")


def _place(geometry: object) -> Point:
    """The place of a point, or the middle of what an outline spans."""
    kind, coordinates = member(geometry, "type"), member(geometry, "coordinates")
    if not isinstance(coordinates, list):
        raise LeftOutError("no place", "geometry", shown(kind), "a Point or Polygon with coordinates")
    if kind == "Point":
        return _point(coordinates)
    if kind == "MultiPoint" and len(coordinates) == 1:
        return _point(coordinates[0])
    depth = {"Polygon": 1, "MultiPolygon": 2, "LineString": 0}.get(kind if isinstance(kind, str) else "")
    if depth is None:
        raise LeftOutError("no place", "geometry", shown(kind), "Point, Polygon, MultiPolygon or LineString")
    for _ in range(depth):
        coordinates = coordinates[0] if isinstance(coordinates, list) and coordinates else None
    corners = coordinates[:MOST_CORNERS] if isinstance(coordinates, list) else []
    pairs = [
        (degrees_of(corner[1]), degrees_of(corner[0]))
        for corner in corners
        if isinstance(corner, list) and len(corner) >= 2
    ]
    lats = [lat for lat, _ in pairs if lat is not None]
    lons = [lon for _, lon in pairs if lon is not None]
    if not lats or not lons:
        raise LeftOutError("no place", "coordinates", "an outline without corners", "pairs of longitude and latitude")
    if max(lons) - min(lons) > HALF_ROUND_DEG:  # over the antimeridian
        lons = [lon % (2.0 * HALF_ROUND_DEG) for lon in lons]
    lon_deg = (min(lons) + max(lons)) / 2.0
    if lon_deg > HALF_ROUND_DEG:
        lon_deg -= 2.0 * HALF_ROUND_DEG
    return place_of((min(lats) + max(lats)) / 2.0, lon_deg)


def _point(coordinates: object) -> Point:
    if not isinstance(coordinates, list) or len(coordinates) < 2:
        raise LeftOutError("no place", "coordinates", shown(coordinates), "longitude and latitude")
    return place_of(coordinates[1], coordinates[0])
