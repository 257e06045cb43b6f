"""What stations are asked for in an address."""

from __future__ import annotations

import re
from typing import Final

from pydantic import BaseModel, ConfigDict, Field, NaiveDatetime, field_validator
from pydantic_core import PydanticCustomError

from energy.charging.charging import MOST_POWER_W, Connector
from routing.stations.selection import StationFilter
from routing.stations.station import Access

MOST_STATIONS: Final = 5000  # of one answer
STATIONS_A_PAGE: Final = 500
LONGEST_LIST: Final = 400  # characters
LONGEST_ID: Final = 400
_NUMBER: Final = r"-?[0-9]{1,3}(?:\.[0-9]{1,15})?"
BBOX_PATTERN: Final = rf"^{_NUMBER}(?:,{_NUMBER}){{3}}$"


def list_pattern(names: list[str]) -> str:
    """Of names separated by commas."""
    choice = "|".join(names)
    return rf"^(?:{choice})(?:,(?:{choice}))*$"


CONNECTOR_NAMES: Final = [connector.value for connector in Connector]
ACCESS_NAMES: Final = [access.value for access in Access]


class StationParameters(BaseModel):
    """Which stations are asked for, and which page of them."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)

    bbox: str | None = Field(
        default=None,
        max_length=LONGEST_LIST,
        json_schema_extra={"pattern": BBOX_PATTERN},
        description="west,south,east,north [deg]; west above east goes over the antimeridian",
        examples=["-36.9,44.2,-36.5,44.5"],
    )
    connectors: str | None = Field(
        default=None,
        max_length=LONGEST_LIST,
        json_schema_extra={"pattern": list_pattern(CONNECTOR_NAMES)},
        description="stations with one of these plugs, separated by commas: " + ", ".join(CONNECTOR_NAMES),
        examples=["ccs2,type2"],
    )
    min_power_kw: float = Field(
        default=0.0,
        ge=0,
        le=MOST_POWER_W / 1000.0,
        description="least output of a socket, of the plugs asked for [kW]; a socket without a known output has none",
    )
    network: str | None = Field(
        default=None, max_length=200, description="a part of the name of its network or operator, in any case"
    )
    access: str | None = Field(
        default=None,
        max_length=LONGEST_LIST,
        json_schema_extra={"pattern": list_pattern(ACCESS_NAMES)},
        description="who may charge there, separated by commas: " + ", ".join(ACCESS_NAMES),
    )
    open_at: NaiveDatetime | None = Field(
        default=None,
        description="local time at the station such as 2026-11-30T08:15: without those that are closed then; of each "
        "answered it is said whether it is open or not known",
    )
    limit: int = Field(default=STATIONS_A_PAGE, ge=1, le=MOST_STATIONS, description="stations of one answer")
    after: str | None = Field(
        default=None, max_length=LONGEST_ID, description="id of the last station of the answer before; from `next`"
    )

    @field_validator("bbox")
    @classmethod
    def _readable_bbox(cls, value: str | None) -> str | None:
        if value is not None:
            bbox_from_text(value)
        return value

    @field_validator("connectors")
    @classmethod
    def _readable_connectors(cls, value: str | None) -> str | None:
        return _checked(value, CONNECTOR_NAMES)

    @field_validator("access")
    @classmethod
    def _readable_access(cls, value: str | None) -> str | None:
        return _checked(value, ACCESS_NAMES)

    def as_filter(self) -> StationFilter:
        """The filter, in SI units."""
        return StationFilter(
            bbox=None if self.bbox is None else bbox_from_text(self.bbox),
            connectors=frozenset(Connector(name) for name in _listed(self.connectors)),
            min_power_w=1000.0 * self.min_power_kw,
            network=self.network or "",
            access=frozenset(Access(name) for name in _listed(self.access)),
            open_at=self.open_at,
        )


def bbox_from_text(text: str) -> tuple[float, float, float, float]:
    """Bounds out of a query parameter."""
    allowed = "west,south,east,north in degrees: lon -180..180, lat -90..90, south at most north"
    if re.fullmatch(BBOX_PATTERN.strip("^$"), text) is None:
        raise PydanticCustomError("bbox", "{allowed}", {"allowed": allowed})
    west, south, east, north = (float(part) for part in text.split(","))
    if not (-180.0 <= west <= 180.0 and -180.0 <= east <= 180.0 and -90.0 <= south <= north <= 90.0):
        raise PydanticCustomError("bbox", "{allowed}", {"allowed": allowed})
    return west, south, east, north


def _listed(text: str | None) -> list[str]:
    return [] if text is None else text.split(",")


def _checked(text: str | None, names: list[str]) -> str | None:
    if any(name not in names for name in _listed(text)):
        raise PydanticCustomError(
            "names", "{allowed}", {"allowed": f"names separated by commas, of {', '.join(names)}"}
        )
    return text
