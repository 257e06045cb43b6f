"""A place that a request names by a text, once it is found: coordinates that know what they were found by."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final, cast

from pydantic import Field, PrivateAttr

from app.schemas.base import Answered
from app.schemas.place import LatLon

if TYPE_CHECKING:
    from collections.abc import Iterable

PLACES_MEANS: Final = "what texts of the request were taken for; empty where all places were sent as coordinates"


class PlaceOption(Answered):
    """A place that a text may mean."""

    label: str = Field(description="name and address in a line")
    kind: str = Field(description="city, street, house, station, point …")
    lat: float = Field(description="latitude [deg]")
    lon: float = Field(description="longitude [deg]")
    match: float = Field(description="how well the text fits, 0..1")


class PlaceNamed(PlaceOption):
    """What a text of the request was taken for, and what else it may mean."""

    field: str = Field(description="of the request, such as goal or via[0]")
    text: str = Field(description="as it was sent")
    graph: str = Field(description="on which it was found")
    asked_number: str | None = Field(description="house number that the street has not; null where it was found")
    nearest_number: str | None = Field(description="house number nearest to it, whose place was taken")
    alternatives: list[PlaceOption] = Field(description="what else the text may mean, the likeliest first")


class NamedPlace(LatLon):
    """Coordinates found by a text; requests and answers show it as any other place."""

    _named: PlaceNamed | None = PrivateAttr(default=None)

    @classmethod
    def of(cls, named: PlaceNamed) -> NamedPlace:
        """The place of what was found."""
        place = cls(lat=named.lat, lon=named.lon)
        place._named = named
        return place


def named_places(places: Iterable[object]) -> list[PlaceNamed]:
    """What the texts of a request were taken for, in its order."""
    found = [place._named for place in places if isinstance(place, NamedPlace)]
    return cast("list[PlaceNamed]", [named for named in found if named is not None])
