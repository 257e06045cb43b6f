"""Places as they are answered: as Photon and Nominatim write them, by their public documentation."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from app.schemas.base import Answered


class PlacePoint(Answered):
    """GeoJSON Point: longitude, latitude [deg]."""

    type: Literal["Point"] = "Point"
    coordinates: tuple[float, float]


class PhotonProperties(Answered):
    """What Photon says of a place; parts that are not known are left out."""

    osm_type: Literal["N", "W", "R"] | None = Field(default=None, description="of the object on OpenStreetMap")
    osm_id: int | None = Field(default=None, description="its id")
    osm_key: str = Field(description="its main tag")
    osm_value: str = Field(description="value of that")
    type: str = Field(description="house, street, locality, district, city, county, state, country or other")
    name: str | None = Field(default=None, description="in the language asked for where the map has it")
    housenumber: str | None = Field(default=None, description="as on the map")
    street: str | None = Field(default=None, description="that it lies on")
    locality: str | None = Field(default=None, description="that it is part of")
    district: str | None = Field(default=None, description="that it is part of")
    city: str | None = Field(default=None, description="that it is part of")
    county: str | None = Field(default=None, description="that it is part of")
    state: str | None = Field(default=None, description="that it is part of")
    country: str | None = Field(default=None, description="that it is part of")
    countrycode: str | None = Field(default=None, description="ISO 3166-1, capital letters")
    postcode: str | None = Field(default=None, description="postal code")
    extent: tuple[float, float, float, float] | None = Field(
        default=None, description="west, north, east, south [deg], as Photon orders it"
    )
    extra: dict[str, str | float] | None = Field(
        default=None,
        description="graph; match, 0..1; distance_m from the place asked about; asked_housenumber and "
        "nearest_housenumber where a street has not the number asked for, and this is the place of the nearest one",
    )


class PhotonFeature(Answered):
    """GeoJSON Feature of a place."""

    type: Literal["Feature"] = "Feature"
    geometry: PlacePoint
    properties: PhotonProperties


class PhotonCollection(Answered):
    """Places, the likeliest first."""

    type: Literal["FeatureCollection"] = "FeatureCollection"
    features: list[PhotonFeature]


class NominatimPlace(Answered):
    """A place as Nominatim writes it in json and jsonv2."""

    place_id: int = Field(description="position in the index; another after the map is imported again")
    licence: str = Field(description="of the data")
    osm_type: Literal["node", "way", "relation"] | None = Field(default=None, description="of the object of the map")
    osm_id: int | None = Field(default=None, description="its id on OpenStreetMap")
    lat: str = Field(description="latitude [deg]")
    lon: str = Field(description="longitude [deg]")
    category: str | None = Field(default=None, description="main tag, in jsonv2")
    class_: str | None = Field(default=None, alias="class", description="main tag, in json")
    type: str = Field(description="value of the main tag")
    place_rank: int = Field(description="4 for a country to 30 for a house")
    importance: float = Field(description="0..1")
    addresstype: str = Field(description="the part of an address that it is")
    name: str = Field(description="in the language asked for where the map has it")
    display_name: str = Field(description="name and address in a line")
    address: dict[str, str] | None = Field(default=None, description="parts of the address, by kind")
    boundingbox: tuple[str, str, str, str] = Field(description="south, north, west, east [deg]")


class NominatimError(Answered):
    """What Nominatim answers where there is nothing near."""

    error: str = Field(description="what is wrong")


class NominatimProperties(Answered):
    """What Nominatim says of a place in geojson."""

    place_id: int = Field(description="position in the index")
    osm_type: Literal["node", "way", "relation"] | None = Field(default=None, description="of the object of the map")
    osm_id: int | None = Field(default=None, description="its id on OpenStreetMap")
    place_rank: int = Field(description="4 for a country to 30 for a house")
    category: str = Field(description="main tag")
    type: str = Field(description="value of the main tag")
    importance: float = Field(description="0..1")
    addresstype: str = Field(description="the part of an address that it is")
    name: str = Field(description="in the language asked for where the map has it")
    display_name: str = Field(description="name and address in a line")
    address: dict[str, str] | None = Field(default=None, description="parts of the address, by kind")


class NominatimFeature(Answered):
    """GeoJSON Feature of a place, as Nominatim writes it."""

    type: Literal["Feature"] = "Feature"
    properties: NominatimProperties
    bbox: tuple[float, float, float, float] = Field(description="west, south, east, north [deg]")
    geometry: PlacePoint


class NominatimCollection(Answered):
    """Places as Nominatim writes them in geojson."""

    type: Literal["FeatureCollection"] = "FeatureCollection"
    licence: str = Field(description="of the data")
    features: list[NominatimFeature]
