"""What of a map's ground is kept: the layer and class that tags stand for.

Names of layers and classes are those of the OpenMapTiles schema where it has them, so that styles made for
it draw them.

Values of keys: OpenStreetMap wiki, Key:natural, Key:landuse, Key:waterway, Key:water, Key:leisure, Key:place.
"""

from __future__ import annotations

from enum import StrEnum
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from collections.abc import Mapping


class Layer(StrEnum):
    """A layer of the ground, in the order in which they are drawn."""

    LANDCOVER = "landcover"
    LANDUSE = "landuse"
    WATER = "water"
    WATERWAY = "waterway"
    BOUNDARY = "boundary"
    PLACE = "place"


AREAS: Final = frozenset((Layer.LANDCOVER, Layer.LANDUSE, Layer.WATER))
KEYS: Final = ("natural", "landuse", "waterway", "leisure", "place", "boundary")
OCEAN: Final = "ocean"
_NATURAL: Final[Mapping[str, tuple[Layer, str]]] = {
    "wood": (Layer.LANDCOVER, "wood"),
    "scrub": (Layer.LANDCOVER, "grass"),
    "heath": (Layer.LANDCOVER, "grass"),
    "grassland": (Layer.LANDCOVER, "grass"),
    "fell": (Layer.LANDCOVER, "grass"),
    "bare_rock": (Layer.LANDCOVER, "rock"),
    "scree": (Layer.LANDCOVER, "rock"),
    "shingle": (Layer.LANDCOVER, "rock"),
    "sand": (Layer.LANDCOVER, "sand"),
    "beach": (Layer.LANDCOVER, "sand"),
    "dune": (Layer.LANDCOVER, "sand"),
    "glacier": (Layer.LANDCOVER, "ice"),
    "wetland": (Layer.LANDCOVER, "wetland"),
}
_LANDUSE: Final[Mapping[str, tuple[Layer, str]]] = {
    "forest": (Layer.LANDCOVER, "wood"),
    "grass": (Layer.LANDCOVER, "grass"),
    "meadow": (Layer.LANDCOVER, "grass"),
    "village_green": (Layer.LANDCOVER, "grass"),
    "recreation_ground": (Layer.LANDCOVER, "grass"),
    "farmland": (Layer.LANDCOVER, "farmland"),
    "orchard": (Layer.LANDCOVER, "farmland"),
    "vineyard": (Layer.LANDCOVER, "farmland"),
    "basin": (Layer.WATER, "lake"),
    "reservoir": (Layer.WATER, "lake"),
    "salt_pond": (Layer.WATER, "pond"),
    "residential": (Layer.LANDUSE, "residential"),
    "commercial": (Layer.LANDUSE, "commercial"),
    "retail": (Layer.LANDUSE, "retail"),
    "industrial": (Layer.LANDUSE, "industrial"),
    "railway": (Layer.LANDUSE, "railway"),
    "port": (Layer.LANDUSE, "industrial"),
    "quarry": (Layer.LANDUSE, "quarry"),
    "military": (Layer.LANDUSE, "military"),
    "cemetery": (Layer.LANDUSE, "cemetery"),
}
_LEISURE: Final[Mapping[str, tuple[Layer, str]]] = {
    "park": (Layer.LANDCOVER, "grass"),
    "golf_course": (Layer.LANDCOVER, "grass"),
    "common": (Layer.LANDCOVER, "grass"),
}
_WATER: Final[Mapping[str, str]] = {
    **dict.fromkeys(("river", "canal", "stream", "oxbow"), "river"),
    **dict.fromkeys(("pond", "basin", "reflecting_pool", "moat", "wastewater"), "pond"),
}
_WATER_AREAS: Final = frozenset(("riverbank", "dock", "boatyard"))
WATERWAYS: Final = frozenset(("river", "canal", "stream"))
PLACES: Final[Mapping[str, int]] = {  # rank: what is named first
    "city": 1,
    "town": 2,
    "village": 3,
    "suburb": 4,
    "borough": 4,
    "island": 4,
    "quarter": 5,
    "hamlet": 5,
    "neighbourhood": 6,
    "isolated_dwelling": 7,
    "locality": 7,
}


def area_kind(tags: Mapping[str, str]) -> tuple[Layer, str] | None:
    """Layer and class of a closed way or a multipolygon, None for what is not drawn."""
    natural = tags.get("natural", "")
    if natural == "water":
        return Layer.WATER, _WATER.get(tags.get("water", ""), "lake")
    if natural in _NATURAL:
        return _NATURAL[natural]
    if tags.get("waterway") in _WATER_AREAS:
        return Layer.WATER, "river" if tags["waterway"] == "riverbank" else "dock"
    landuse = tags.get("landuse", "")
    if landuse in _LANDUSE:
        return _LANDUSE[landuse]
    return _LEISURE.get(tags.get("leisure", ""))


def line_kind(tags: Mapping[str, str]) -> tuple[Layer, str] | None:
    """Layer and class of a way as a line: waterways in the open and borders, None for what is not drawn."""
    waterway = tags.get("waterway")
    if waterway in WATERWAYS:
        hidden = tags.get("tunnel", "no") != "no" or (tags.get("intermittent") == "yes" and waterway == "stream")
        return None if hidden else (Layer.WATERWAY, str(waterway))
    level = border_level(tags)
    return None if level is None else (Layer.BOUNDARY, str(level))


def border_level(tags: Mapping[str, str]) -> int | None:
    """The level of an administrative boundary that is drawn, 2 for countries."""
    text = tags.get("admin_level", "")
    if tags.get("boundary") != "administrative" or len(text) != 1 or not "2" <= text <= "6":
        return None
    return int(text)
