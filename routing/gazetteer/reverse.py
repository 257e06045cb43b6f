"""What is nearest to a place: a house number, a street by its lines, a point of interest, a settlement."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

from routing.gazetteer.cells import CELLS_A_DEGREE, cells_around
from routing.gazetteer.entries import Kind
from routing.gazetteer.files import line_points
from routing.graph.earth import METRE_PER_DEGREE

if TYPE_CHECKING:
    import sqlite3

HOUSE_M: Final = 60.0  # from a house within which a place is said to be its own; assumed
MOST_RINGS: Final = 40  # of squares that are looked through, about 40 km
MOST_CELLS: Final = 6000
MOST_STREETS: Final = 400  # whose lines are measured


@dataclass(frozen=True, slots=True)
class Hit:
    """Something near: the thing's position in the index, where it is nearest, and its house number's row or None."""

    distance_m: float
    place: int
    lat: float
    lon: float
    number: Any = None
    is_area: bool = False


def nearest(
    database: sqlite3.Connection, lat: float, lon: float, limit: int, radius_m: float, *, areas_only: bool = False
) -> list[Hit]:
    """The address of a place, then what else is near, the nearest first.

    The address is a house within 60 m that is not much farther than the nearest street, else that street.
    areas_only: towns and parts of them, no addresses.
    """
    shrink = max(0.01, math.cos(math.radians(lat)))
    streets: dict[int, Hit] = {}
    houses: list[Hit] = []
    things: dict[int, Hit] = {}
    looked = 0
    for ring in range(MOST_RINGS + 1):
        inner_m = (ring - 1) / CELLS_A_DEGREE * METRE_PER_DEGREE * 0.9
        enough = len(streets) + len(houses) + len(things) >= limit and (streets or things)
        if inner_m > radius_m or (ring > 1 and enough) or looked > MOST_CELLS:
            break
        cells = cells_around(lat, lon, ring)
        looked += len(cells)
        _look(database, cells, (lat, lon, shrink), streets, houses, things)
        if areas_only:
            streets, houses = {}, []
            things = {k: hit for k, hit in things.items() if hit.is_area}
    hits = _ordered(streets, houses, things)
    return [hit for hit in hits if hit.distance_m <= radius_m][:limit]


def _look(
    database: sqlite3.Connection,
    cells: list[int],
    at: tuple[float, float, float],
    streets: dict[int, Hit],
    houses: list[Hit],
    things: dict[int, Hit],
) -> None:
    lat, lon, shrink = at
    for begin in range(0, len(cells), 500):
        part = cells[begin : begin + 500]
        marks = ",".join("?" * len(part))
        rows = database.execute(
            "SELECT p.id, p.kind, p.lat, p.lon, p.line FROM places AS p WHERE p.id IN "
            f"(SELECT DISTINCT place FROM spots WHERE cell IN ({marks})) LIMIT ?",
            (*part, 20 * MOST_STREETS),
        )
        for place, kind, place_lat, place_lon, line in rows:
            if line is not None and place not in streets and len(streets) < MOST_STREETS:
                away_m, y, x = _on_line(line, lat, lon, shrink)
                streets[place] = Hit(away_m, place, y, x)
            elif line is None and kind not in (Kind.POSTCODE, Kind.COUNTRY, Kind.STATE, Kind.COUNTY):
                away_m = math.hypot(place_lat - lat, (place_lon - lon) * shrink) * METRE_PER_DEGREE
                things[place] = Hit(away_m, place, place_lat, place_lon, is_area=kind in (Kind.CITY, Kind.DISTRICT))
        rows = database.execute(
            f"SELECT number, label, lat, lon, postcode, osm_type, osm_id, street FROM houses WHERE cell IN ({marks})",
            part,
        )
        for *house, street in rows:
            away_m = math.hypot(house[2] - lat, (house[3] - lon) * shrink) * METRE_PER_DEGREE
            if away_m <= 4.0 * HOUSE_M:
                houses.append(Hit(away_m, street, house[2], house[3], tuple(house)))


def _ordered(streets: dict[int, Hit], houses: list[Hit], things: dict[int, Hit]) -> list[Hit]:
    """The address first, the rest by distance; of houses only the nearest few."""

    def away(hit: Hit) -> tuple[float, int]:
        return hit.distance_m, hit.place

    houses = sorted(houses, key=away)[:20]
    rest = sorted([*streets.values(), *things.values(), *houses], key=away)
    street_m = min((hit.distance_m for hit in streets.values()), default=math.inf)
    address = None
    if houses and houses[0].distance_m <= min(HOUSE_M, street_m + 30.0):
        address = houses[0]
    elif streets:
        address = min(streets.values(), key=away)
        if rest[0].distance_m < 0.2 * address.distance_m and address.distance_m > 200.0:
            address = None
    return rest if address is None else [address, *(hit for hit in rest if hit is not address)]


def _on_line(line: bytes, lat: float, lon: float, shrink: float) -> tuple[float, float, float]:
    """Distance [m] to a street's lines, and the nearest point of them as lat, lon."""
    best = (math.inf, lat, lon)
    for x0, y0, x1, y1 in line_points(line):
        dx, dy = (x1 - x0) * 1e-6 * shrink, (y1 - y0) * 1e-6
        px, py = (lon - x0 * 1e-6) * shrink, lat - y0 * 1e-6
        size = dx * dx + dy * dy
        part = 0.0 if size == 0.0 else min(1.0, max(0.0, (px * dx + py * dy) / size))
        away = math.hypot(px - part * dx, py - part * dy)
        if away < best[0]:
            best = (away, y0 * 1e-6 + part * dy, x0 * 1e-6 + part * dx / shrink)
    return best[0] * METRE_PER_DEGREE, best[1], best[2]
