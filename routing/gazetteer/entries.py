"""What an index is made of: named things on the map, pieces of streets, house numbers, boundaries."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import StrEnum
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from array import array
    from collections.abc import Mapping

    import shapely

Box = tuple[float, float, float, float]  # west, south, east, north [deg]


class Kind(StrEnum):
    """What a thing is to who searches; the names are those of Photon's layers but for stations and points."""

    COUNTRY = "country"
    STATE = "state"
    COUNTY = "county"
    CITY = "city"
    DISTRICT = "district"
    LOCALITY = "locality"
    STREET = "street"
    HOUSE = "house"
    POSTCODE = "postcode"
    STATION = "station"
    POINT = "point"
    COORDINATES = "coordinates"


@dataclass(slots=True)
class Entry:
    """A thing with a name.

    names: by language, and those by which it is found only, under keys that begin with a star. at: lat, lon [deg].
    street, number, postcode: its address as tagged. level: of an administrative boundary, else 0. parents: positions of
    the entries of which it is a part, by kind. further: words by which it is found beside its name.
    lines: of a street, as of its pieces.
    """

    kind: Kind
    osm_type: str
    osm_id: int
    key: str
    value: str
    name: str
    names: Mapping[str, str]
    lat: float
    lon: float
    importance: float
    box: Box | None = None
    street: str = ""
    number: str = ""
    postcode: str = ""
    city_name: str = ""
    population: int = 0
    area: shapely.geometry.base.BaseGeometry | None = None
    level: int = 0
    parents: dict[Kind, int] = field(default_factory=dict)
    further: tuple[str, ...] = ()
    lines: tuple[array[int], ...] = ()


@dataclass(frozen=True, slots=True)
class Piece:
    """A piece of a street: names, the value of its highway tag, and lon, lat of its points in turn [1e-7 deg].

    way: its id on OpenStreetMap, 0 where it has none.
    """

    way: int
    name: str
    names: Mapping[str, str]
    value: str
    points: array[int]
    postcode: str = ""


@dataclass(frozen=True, slots=True)
class House:
    """A house number of a street, or of a place without streets; lon, lat [1e-7 deg]."""

    osm_type: str
    osm_id: int
    number: str
    street: str
    lon_e7: int
    lat_e7: int
    postcode: str = ""
    city: str = ""


@dataclass(slots=True)
class Collected:
    """All that was read of a map; left_out: counts by reason. country: code of ISO 3166-1, small letters, or empty."""

    entries: list[Entry] = field(default_factory=list)
    pieces: list[Piece] = field(default_factory=list)
    houses: list[House] = field(default_factory=list)
    left_out: dict[str, int] = field(default_factory=dict)
    country: str = ""
    country_names: Mapping[str, str] = field(default_factory=dict)
    state_names: Mapping[str, str] = field(default_factory=dict)

    def leave_out(self, reason: str, count: int = 1) -> None:
        """Count what is not taken."""
        if count:
            self.left_out[reason] = self.left_out.get(reason, 0) + count


SETTLEMENTS: Final = ("city", "town", "village")
