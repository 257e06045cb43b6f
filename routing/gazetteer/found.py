"""What a search finds: things with their address, in a language."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from routing.gazetteer.entries import Box, Kind

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence


@dataclass(frozen=True, slots=True)
class Near:
    """Where answers are wanted near [deg]."""

    lat: float
    lon: float


@dataclass(frozen=True, slots=True)
class FoundPlace:
    """A thing that was found, at lat, lon [deg].

    osm_type: n, w, r, or empty for what no object of the map stands for. match: how well the text fits, 0..1. score: by
    which answers are ordered. asked_number: a house number that was asked for and that the street has not; then
    nearest_number is the one nearest to it, whose place this is. distance_m: from the place asked about.
    """

    place_id: int
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
    address: Mapping[Kind, str] = field(default_factory=dict)
    country_code: str = ""
    match: float = 1.0
    score: float = 1.0
    asked_number: str = ""
    nearest_number: str = ""
    distance_m: float | None = None

    def label(self) -> str:
        """Name and address in a line, the nearest first, no part twice."""
        road = " ".join(part for part in (self.street, self.number) if part)
        name = self.name if self.kind is not Kind.HOUSE else ""
        line = [name, road if road != name else ""]
        order = (Kind.DISTRICT, Kind.CITY, Kind.COUNTY, Kind.STATE)
        line += [self.address.get(kind, "") for kind in order]
        line += [self.postcode if self.kind is not Kind.POSTCODE else "", self.address.get(Kind.COUNTRY, "")]
        return ", ".join(dict.fromkeys(part for part in line if part))


def in_language(name: str, names: Mapping[str, str], languages: Sequence[str]) -> str:
    """The name in the first language that has one, with or without its script or country; else the local one."""
    for language in languages:
        wanted = language.replace("_", "-")
        base = wanted.partition("-")[0]
        for key in (wanted, base):
            if key in names:
                return names[key]
        if base == "en" and not name.isascii() and "int" in names:
            return names["int"]
    return name
