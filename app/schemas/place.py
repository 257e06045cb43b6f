"""Places: coordinates as they are sent, where they met a road, and GeoJSON geometries (RFC 7946)."""

from __future__ import annotations

from typing import Annotated, Final, Literal

from pydantic import BeforeValidator, Discriminator, Field, Tag, model_validator

from app.schemas.base import Answered, Latitude, Longitude, Sent, refusal
from routing.places import can_only_be_swapped, swapped_question

MOST_TEXT_CHARS: Final = 200  # of a place's name
MAX_PLACES: Final = 1000  # in one list, which the service's own limit may be set to


class LatLon(Sent):
    """A place by named coordinates [deg, WGS 84]."""

    lat: Latitude = Field(description="latitude [deg], -90..90")
    lon: Longitude = Field(description="longitude [deg], -180..180")

    @model_validator(mode="before")
    @classmethod
    def _not_swapped(cls, value: object) -> object:
        if isinstance(value, dict):
            refuse_swapped("lat", value.get("lat"), value.get("lon"))
        return value


def _pair_not_swapped(value: object) -> object:
    if isinstance(value, (list, tuple)) and len(value) == 2:
        refuse_swapped("[1]", value[1], value[0])
    return value


def refuse_swapped(field: str, lat: object, lon: object) -> None:
    """Refuse a latitude that can only be a longitude, before either is checked by itself.

    Texts are taken for the numbers that they hold, as in an address. Raises PydanticCustomError.
    """
    lat_deg, lon_deg = _number(lat), _number(lon)
    if lat_deg is not None and lon_deg is not None and can_only_be_swapped(lat_deg, lon_deg):
        bound = "at most 90" if lat_deg > 0.0 else "at least -90"
        raise refusal(field, lat, bound + swapped_question(lat_deg, lon_deg))


def _number(value: object) -> float | None:
    """The number that a value is or holds as a text."""
    try:
        return float(value) if isinstance(value, (int, float, str)) and not isinstance(value, bool) else None
    except (OverflowError, ValueError):
        return None


LonLat = Annotated[
    tuple[Longitude, Latitude],
    BeforeValidator(_pair_not_swapped),
    Field(description="longitude, latitude [deg], in the order of GeoJSON"),
]


def _form_of_place(value: object) -> str | None:
    if isinstance(value, (dict, LatLon)):
        return "named"
    return "pair" if isinstance(value, (list, tuple)) else None


Place = Annotated[
    Annotated[LatLon, Tag("named")] | Annotated[LonLat, Tag("pair")],
    Discriminator(
        _form_of_place,
        custom_error_type="place",
        custom_error_message="an object with lat and lon, or a list [lon, lat]",
    ),
]


def _form_of_named_place(value: object) -> str | None:
    return "text" if isinstance(value, str) else _form_of_place(value)


PlaceText = Annotated[
    str,
    Field(min_length=1, max_length=MOST_TEXT_CHARS, description="name or address of a place, or coordinates as a text"),
]
PlaceOrText = Annotated[
    Annotated[LatLon, Tag("named")] | Annotated[LonLat, Tag("pair")] | Annotated[PlaceText, Tag("text")],
    Discriminator(
        _form_of_named_place,
        custom_error_type="place",
        custom_error_message="an object with lat and lon, a list [lon, lat], or a text that names a place",
    ),
]

Position = tuple[float, float]  # lon, lat [deg], at most 7 decimals


class Snapped(Answered):
    """Where a place met the road network."""

    asked: LatLon
    on_road: LatLon
    distance_m: float = Field(description="from the place asked to the road [m]")
    link_id: int = Field(description="directed link that was met")
    offset_m: float = Field(description="from the start of that link [m]")
    road_name: str


class PointGeometry(Answered):
    """GeoJSON Point."""

    type: Literal["Point"] = "Point"
    coordinates: Position


class LineString(Answered):
    """GeoJSON LineString."""

    type: Literal["LineString"] = "LineString"
    coordinates: list[Position]


class MultiLineStringGeometry(Answered):
    """GeoJSON MultiLineString."""

    type: Literal["MultiLineString"] = "MultiLineString"
    coordinates: list[list[Position]]


class MultiPolygonGeometry(Answered):
    """GeoJSON MultiPolygon: shells counter-clockwise, rings closed."""

    type: Literal["MultiPolygon"] = "MultiPolygon"
    coordinates: list[list[list[Position]]]


class PlaceProperties(Answered):
    """What a Point feature says of a snapped place."""

    kind: Literal["start", "via", "goal", "origin"]
    asked: LatLon
    distance_m: float
    link_id: int
    offset_m: float
    road_name: str
    marker_color: str = Field(alias="marker-color", description="colour of the marker, by simplestyle-spec")


class PlaceFeature(Answered):
    """GeoJSON Feature of a snapped place, on the road."""

    type: Literal["Feature"] = "Feature"
    geometry: PointGeometry
    properties: PlaceProperties
