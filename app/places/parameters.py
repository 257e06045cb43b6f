"""What is asked of GET /search and GET /reverse, by the names that Photon and Nominatim have for it."""

from __future__ import annotations

import re
from typing import Any, Final, Literal

from pydantic import BaseModel, ConfigDict, Field, field_validator, model_validator

from app.schemas.base import refusal
from app.schemas.place import refuse_swapped
from app.stations.parameters import BBOX_PATTERN, bbox_from_text
from routing.gazetteer.found import Near
from routing.gazetteer.gazetteer import MOST_FOUND
from routing.gazetteer.words import MOST_QUERY_CHARS

Form = Literal["photon", "nominatim", "json", "jsonv2", "geojson"]
FORM_MEANS: Final = "photon: GeoJSON as of Photon; jsonv2, json, geojson: as of Nominatim; nominatim is jsonv2"
LANG_MEANS: Final = "languages of names, the preferred first, as de or pt-BR,en; without it those of Accept-Language"
MOST_RADIUS_KM: Final = 50.0
USUAL_RADIUS_KM: Final = 1.0
MOST_LANGUAGES: Final = 10
_LANGUAGE: Final = re.compile(r"[A-Za-z]{2,3}(?:[-_][A-Za-z0-9]{2,8}){0,2}\Z")
_PARTS: Final = ("amenity", "street", "city", "county", "state", "postalcode", "country")


class PlaceParameters(BaseModel):
    """What both share; parameters of Photon and Nominatim that are not known here are passed over."""

    model_config = ConfigDict(extra="ignore", frozen=True, allow_inf_nan=False, populate_by_name=True)

    graph: str | None = Field(default=None, max_length=200, description="name; without it, all graphs with an index")
    format: Form = Field(default="photon", description=FORM_MEANS)
    lang: str | None = Field(default=None, max_length=200, description=LANG_MEANS, examples=["de"])
    accept_language: str | None = Field(
        default=None, alias="accept-language", max_length=200, description="the same, as Nominatim calls it"
    )
    addressdetails: Literal["0", "1"] | None = Field(default=None, description="1 has Nominatim's forms with address")

    def languages(self, header: str) -> tuple[str, ...]:
        """Languages in order, of the parameters or else of the header."""
        return languages_in(self.lang or self.accept_language or header)


class SearchParameters(PlaceParameters):
    """A text to search for."""

    q: str | None = Field(
        default=None,
        min_length=1,
        max_length=MOST_QUERY_CHARS,
        description="what is searched for: names, addresses or coordinates, in any order",
        examples=["Mill Road"],
    )
    lat: float | None = Field(default=None, ge=-90, le=90, description="latitude that answers are wanted near [deg]")
    lon: float | None = Field(default=None, ge=-180, le=180, description="longitude that answers are wanted near [deg]")
    limit: int = Field(default=10, ge=1, le=MOST_FOUND, description="answers at most")
    bbox: str | None = Field(
        default=None,
        max_length=200,
        json_schema_extra={"pattern": BBOX_PATTERN},
        description="only within west,south,east,north [deg]",
    )
    viewbox: str | None = Field(
        default=None,
        max_length=200,
        json_schema_extra={"pattern": BBOX_PATTERN},
        description="as Nominatim has it: answers near its middle are preferred, with bounded=1 only those within",
    )
    bounded: Literal["0", "1"] = Field(default="0", description="1: only within viewbox")
    amenity: str | None = Field(default=None, max_length=MOST_QUERY_CHARS, description="in place of q: a name")
    street: str | None = Field(default=None, max_length=MOST_QUERY_CHARS, description="in place of q: with its number")
    city: str | None = Field(default=None, max_length=MOST_QUERY_CHARS, description="in place of q: a town")
    county: str | None = Field(default=None, max_length=MOST_QUERY_CHARS, description="in place of q: a county")
    state: str | None = Field(default=None, max_length=MOST_QUERY_CHARS, description="in place of q: a state")
    country: str | None = Field(default=None, max_length=MOST_QUERY_CHARS, description="in place of q: a country")
    postalcode: str | None = Field(default=None, max_length=20, description="in place of q: a postal code")

    @field_validator("bbox", "viewbox")
    @classmethod
    def _readable_box(cls, value: str | None) -> str | None:
        if value is not None:
            bbox_from_text(_ordered(value))
        return value

    @model_validator(mode="before")
    @classmethod
    def _not_swapped(cls, value: Any) -> Any:
        if isinstance(value, dict):
            refuse_swapped("lat", value.get("lat"), value.get("lon"))
        return value

    @model_validator(mode="after")
    def _asks_for_something(self) -> SearchParameters:
        if not self.text():
            raise refusal("q", self.q, "a text to search for, or its parts as street and city")
        if (self.lat is None) != (self.lon is None):
            missing = "lat" if self.lat is None else "lon"
            raise refusal(missing, None, "lat and lon together")
        return self

    def text(self) -> str:
        """What is searched for."""
        parts = [getattr(self, part) for part in _PARTS]
        text = self.q if self.q is not None else ", ".join(part for part in parts if part)
        return text.strip()[:MOST_QUERY_CHARS]

    def near(self) -> Near | None:
        """Where answers are preferred."""
        if self.lat is not None and self.lon is not None:
            return Near(self.lat, self.lon)
        if self.viewbox is not None:
            west, south, east, north = bbox_from_text(_ordered(self.viewbox))
            return Near((south + north) / 2.0, (west + east) / 2.0)
        return None

    def within(self) -> tuple[float, float, float, float] | None:
        """Where answers must lie: west, south, east, north [deg]."""
        if self.bbox is not None:
            return bbox_from_text(_ordered(self.bbox))
        return bbox_from_text(_ordered(self.viewbox)) if self.viewbox is not None and self.bounded == "1" else None


class ReverseParameters(PlaceParameters):
    """A place whose address is asked for."""

    lat: float = Field(ge=-90, le=90, description="latitude [deg]", examples=[44.4401])
    lon: float = Field(ge=-180, le=180, description="longitude [deg]", examples=[-36.781])
    limit: int = Field(default=1, ge=1, le=MOST_FOUND, description="answers at most, with format=photon")
    radius: float = Field(default=USUAL_RADIUS_KM, gt=0, le=5000, description="how far away answers may be [km], to 50")
    zoom: int = Field(default=18, ge=0, le=30, description="18: address, 16: street, 13: part of a town, 10: town")

    @model_validator(mode="before")
    @classmethod
    def _not_swapped(cls, value: Any) -> Any:
        if isinstance(value, dict):
            refuse_swapped("lat", value.get("lat"), value.get("lon"))
        return value


def _ordered(text: str) -> str:
    """A box with its corners in the usual order; viewbox may have any two."""
    parts = text.split(",")
    try:
        _, first, _, second = (float(part) for part in parts)
    except ValueError:
        return text
    south, north = (parts[1], parts[3]) if first <= second else (parts[3], parts[1])
    return f"{parts[0]},{south},{parts[2]},{north}"


def languages_in(text: str) -> tuple[str, ...]:
    """Languages of a list as Accept-Language has it (RFC 9110 section 12.5.4), the preferred first."""
    weighed = []
    for k, part in enumerate(text.split(",")[:MOST_LANGUAGES]):
        language, _, weight = (piece.strip() for piece in part.partition(";"))
        try:
            quality = float(weight.removeprefix("q=")) if weight else 1.0
        except ValueError:
            quality = 0.0
        if _LANGUAGE.match(language) and quality > 0.0:
            weighed.append((-quality, k, language))
    return tuple(language for _, _, language in sorted(weighed))
