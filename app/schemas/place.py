"""Places: coordinates as they are sent, where they met a road, and GeoJSON geometries (RFC 7946)."""

from __future__ import annotations

from typing import Annotated, Final, Literal

from pydantic import BeforeValidator, Discriminator, Field, Tag, model_validator

from app.schemas.base import Answered, Latitude, Longitude, Sent, refusal

MAX_PLACES: Final = 1000  # in one list, which the service's own limit may be set to


class LatLon(Sent):
    """A place by named coordinates [deg, WGS 84]."""

    lat: Latitude = Field(description="latitude [deg], -90..90")
    lon: Longitude = Field(description="longitude [deg], -180..180")

    @model_validator(mode="before")
    @classmethod
    def _not_swapped(cls, value: object) -> object:
        if isinstance(value, dict):
            _refuse_swapped("lat", value.get("lat"), value.get("lon"))
        return value


def _pair_not_swapped(value: object) -> object:
    if isinstance(value, (list, tuple)) and len(value) == 2:
        _refuse_swapped("[1]", value[1], value[0])
    return value


def _refuse_swapped(field: str, lat: object, lon: object) -> None:
    """Refuse a latitude out of range that would be a longitude beside a longitude that would be a latitude."""
    if not (isinstance(lat, (int, float)) and isinstance(lon, (int, float))) or isinstance(lon, bool):
        return
    if abs(lon) <= 90.0 < abs(lat) <= 180.0:
        bound = "at most 90" if lat > 0 else "at least -90"
        raise refusal(field, lat, f"{bound}; did you mean lat {lon}, lon {lat}?")


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


class PlaceFeature(Answered):
    """GeoJSON Feature of a snapped place, on the road."""

    type: Literal["Feature"] = "Feature"
    geometry: PointGeometry
    properties: PlaceProperties
