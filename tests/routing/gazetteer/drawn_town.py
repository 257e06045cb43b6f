"""A small made-up town as an OpenStreetMap file: streets, house numbers, shops, places, a boundary."""

from __future__ import annotations

from typing import Any, Final

from routing.gazetteer.building import content_of
from routing.gazetteer.files import index_bytes, save_index
from routing.gazetteer.gazetteer import Gazetteer
from routing.gazetteer.osm import PlaceReader
from routing.importers.osm import read_osm

RUA: Final = "Rua de Santa Catarina"
POINTS: Final = {
    1: (0, 0),
    2: (200, 0),
    3: (400, 0),
    4: (600, 0),
    5: (0, 300),
    6: (600, 300),
    10: (20, 10),
    11: (120, 10),
    12: (220, 10),
    13: (500, 10),  # house numbers
    20: (300, 150),
    21: (8000, 8000),
    22: (310, 160),
    23: (30, -20),
    24: (40, 310),
    30: (7900, 8000),
    31: (8100, 8000),
    32: (7900, 8100),
    33: (8100, 8100),
    40: (-900, -900),
    41: (1500, -900),
    42: (1500, 1500),
    43: (-900, 1500),
}
WAYS: Final = {
    100: ([1, 2, 3], {"highway": "residential", "name": RUA, "postal_code": "4000-447"}),
    101: ([3, 4], {"highway": "pedestrian", "name": RUA, "name:en": "Saint Catherine Street"}),
    102: ([1, 5], {"highway": "primary", "name": "Avenida da Liberdade", "ref": "EN 14"}),
    103: ([5, 6], {"highway": "tertiary", "name": "Sendlinger Straße"}),
    104: ([30, 31], {"highway": "residential", "name": RUA}),
    105: ([32, 33], {"highway": "residential", "name": "Rua 25 de Abril"}),
    106: ([11, 12], {"addr:interpolation": "even"}),
    107: ([40, 41, 42, 43, 40], {"boundary": "administrative"}),
}
TAGS: Final = {
    10: {"addr:housenumber": "12", "addr:street": RUA, "addr:postcode": "4000-447", "addr:city": "Vila Nova"},
    11: {"addr:housenumber": "20", "addr:street": RUA},
    12: {"addr:housenumber": "30", "addr:street": RUA},
    13: {"addr:housenumber": "112A", "addr:street": RUA},
    20: {"place": "town", "name": "Vila Nova", "name:en": "New Town", "name:de": "Neustadt", "population": "20000"},
    21: {"place": "village", "name": "Outra Vila"},
    22: {"amenity": "cafe", "name": "Café Majestic", "addr:street": RUA, "addr:housenumber": "112"},
    23: {"amenity": "charging_station", "operator": "Mobi.E", "name": "Mobi Um"},
    24: {"amenity": "pharmacy", "name": "Farmácia São João"},
}
RELATIONS: Final = [
    (
        [("w", 107, "outer")],
        {"type": "boundary", "boundary": "administrative", "admin_level": "8", "name": "Vila Nova"},
    ),
]


def opened(path: Any, folder: Any, name: str = "town") -> Gazetteer:
    """The index of a drawn map, opened from a folder."""
    reader = PlaceReader()
    read_osm(path, beside=reader)
    save_index(folder, index_bytes(content_of(reader.found, None, name), path.name))
    return Gazetteer(folder)


def drawn_town(draw_map: Any) -> Any:
    """The map of the town."""
    return draw_map(POINTS, WAYS, TAGS, RELATIONS)
