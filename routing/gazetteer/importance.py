"""How much is thought of a thing on the map by who does not say which one is meant, 0..1; assumed, in steps of 0.01."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

from routing.gazetteer.entries import Kind

if TYPE_CHECKING:
    from collections.abc import Mapping

# kinds of places that are indexed, with importance and kind
PLACES: Final[Mapping[str, tuple[Kind, float]]] = {
    "country": (Kind.COUNTRY, 0.8),
    "state": (Kind.STATE, 0.7),
    "province": (Kind.STATE, 0.6),
    "region": (Kind.STATE, 0.55),
    "county": (Kind.COUNTY, 0.55),
    "city": (Kind.CITY, 0.66),
    "town": (Kind.CITY, 0.58),
    "village": (Kind.CITY, 0.48),
    "municipality": (Kind.CITY, 0.5),
    "borough": (Kind.DISTRICT, 0.45),
    "suburb": (Kind.DISTRICT, 0.45),
    "quarter": (Kind.DISTRICT, 0.4),
    "neighbourhood": (Kind.DISTRICT, 0.36),
    "hamlet": (Kind.DISTRICT, 0.36),
    "isolated_dwelling": (Kind.LOCALITY, 0.22),
    "farm": (Kind.LOCALITY, 0.2),
    "locality": (Kind.LOCALITY, 0.24),
    "square": (Kind.STREET, 0.34),
    "island": (Kind.LOCALITY, 0.4),
    "islet": (Kind.LOCALITY, 0.25),
}
STREETS: Final[Mapping[str, float]] = {
    **dict.fromkeys(("motorway", "trunk"), 0.34),
    **dict.fromkeys(("primary", "secondary"), 0.32),
    "tertiary": 0.29,
    "pedestrian": 0.3,
    "unclassified": 0.25,
    "residential": 0.25,
    "living_street": 0.25,
    **dict.fromkeys(("motorway_link", "trunk_link", "primary_link", "secondary_link", "tertiary_link"), 0.2),
    "road": 0.22,
    "service": 0.17,
    "track": 0.12,
    "steps": 0.16,
    "footway": 0.14,
    "path": 0.12,
    "cycleway": 0.12,
    "bridleway": 0.1,
    "busway": 0.12,
    "corridor": 0.08,
    "raceway": 0.12,
}
# points of interest by key and value; "" for any other value of the key
POINTS: Final[Mapping[str, Mapping[str, float]]] = {
    "aeroway": {"aerodrome": 0.46, "terminal": 0.32},
    "railway": {"station": 0.42, "halt": 0.34, "tram_stop": 0.2, "subway_entrance": 0.12},
    "public_transport": {"station": 0.34},
    "amenity": {
        "hospital": 0.36,
        "university": 0.36,
        "townhall": 0.32,
        "theatre": 0.28,
        "bus_station": 0.32,
        "": 0.15,
        "college": 0.26,
        "school": 0.22,
        "place_of_worship": 0.22,
        "marketplace": 0.27,
        "library": 0.24,
        "courthouse": 0.24,
        "embassy": 0.22,
        "police": 0.22,
        "fire_station": 0.2,
        "cinema": 0.25,
        "fuel": 0.2,
        "pharmacy": 0.18,
        "ferry_terminal": 0.3,
        "parking": 0.16,
        "arts_centre": 0.24,
        "charging_station": 0.16,
        "conference_centre": 0.28,
        "clinic": 0.24,
        "post_office": 0.2,
    },
    "tourism": {
        "museum": 0.32,
        "attraction": 0.3,
        "zoo": 0.36,
        "theme_park": 0.36,
        "gallery": 0.26,
        "viewpoint": 0.22,
        "hotel": 0.24,
        "hostel": 0.2,
        "guest_house": 0.17,
        "camp_site": 0.22,
        "alpine_hut": 0.24,
        "": 0.15,
    },
    "leisure": {"stadium": 0.36, "park": 0.28, "sports_centre": 0.24, "garden": 0.22, "marina": 0.26, "": 0.14},
    "historic": {"castle": 0.34, "fort": 0.3, "monument": 0.28, "memorial": 0.17, "ruins": 0.22, "": 0.18},
    "shop": {"mall": 0.34, "department_store": 0.28, "supermarket": 0.22, "": 0.13},
    "natural": {"peak": 0.28, "beach": 0.28, "water": 0.26, "saddle": 0.24, "glacier": 0.26, "bay": 0.24, "": 0.14},
    "mountain_pass": {"yes": 0.32},
    "man_made": {"lighthouse": 0.24, "tower": 0.2, "bridge": 0.28, "pier": 0.2},
    "healthcare": {"": 0.16},
    "office": {"government": 0.22, "diplomatic": 0.2, "": 0.1},
    "craft": {"": 0.1},
    "landuse": {"cemetery": 0.22, "industrial": 0.22, "retail": 0.22, "commercial": 0.2, "winter_sports": 0.3},
    "highway": {"services": 0.32, "rest_area": 0.26, "motorway_junction": 0.14},
    "building": {"": 0.13},
}
LEAST_POPULATION: Final = 100
LEVELS: Final = {2: 0.8, 3: 0.6, 4: 0.65, 5: 0.55, 6: 0.5, 7: 0.5, 8: 0.46}  # of boundaries
_FAMOUS: Final = 0.12


def with_population(importance: float, population: int) -> float:
    """Of a settlement: 0.01 for each fourth part of a power of ten above 100 people."""
    if population <= LEAST_POPULATION:
        return importance
    return min(0.95, importance + 0.04 * (math.log10(population) - 2.0))


def point_of_interest(tags: Mapping[str, str]) -> tuple[str, str, float] | None:
    """Key, value and importance of what may be searched for beside places and streets, None for what is not."""
    found: tuple[str, str, float] | None = None
    for key, values in POINTS.items():
        value = tags.get(key)
        if value is None or value == "no":
            continue
        importance = values.get(value, values.get(""))
        if importance is not None and (found is None or importance > found[2]):
            found = key, value, importance
    if found is not None and ("wikidata" in tags or "wikipedia" in tags):
        return found[0], found[1], min(0.6, found[2] + _FAMOUS)
    return found
