"""Stations as they are answered: GeoJSON (RFC 7946) with their sources."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from app.schemas.base import Answered
from app.schemas.stations.facts import PriceAnswer, SocketAnswer, StationSourceAnswer
from routing.stations.opening import Opening
from routing.stations.station import Access


class StationPoint(Answered):
    """Where a station is: longitude, latitude [deg]."""

    type: Literal["Point"] = "Point"
    coordinates: tuple[float, float]


class StationRoad(Answered):
    """A place on a road from which a station is reached."""

    link: int = Field(description="directed link of the graph")
    offset_m: float = Field(description="from where the link begins [m]")


class StationProperties(Answered):
    """What is known of a station."""

    name: str
    operator: str
    network: str
    sockets: list[SocketAnswer]
    power_kw: float | None = Field(description="greatest output of a socket [kW]; null where none is known")
    capacity: int | None = Field(description="vehicles at a time")
    access: Access
    fee: bool | None
    price: PriceAnswer | None
    opening_hours: str | None = Field(description="in the syntax of OpenStreetMap")
    open: Opening | None = Field(description="at the time that is asked for; null where none is")
    operational: bool | None = Field(description="false where the source says that it is out of order")
    source: str = Field(description="key of sources")
    merged: list[str] = Field(description="ids of what was told of the same station elsewhere")
    road_distance_m: float = Field(description="from the road that it is reached from [m]")
    roads: list[StationRoad] = Field(description="one for each direction that may be driven")


class StationFeature(Answered):
    """GeoJSON Feature of one station."""

    type: Literal["Feature"] = "Feature"
    id: str
    geometry: StationPoint
    properties: StationProperties


class StationCollection(Answered):
    """One page of the stations of a graph, ordered by id."""

    type: Literal["FeatureCollection"] = "FeatureCollection"
    features: list[StationFeature]
    graph: str
    sources: list[StationSourceAnswer] = Field(description="to be named wherever the stations are shown")
    matched: int = Field(description="how many stations are as asked for, on all pages")
    returned: int
    next: str | None = Field(description="address of the next page, from the root of the host; null on the last one")
    left_out: dict[str, int] = Field(description="what the import of the stations left out, by reason")
    warnings: list[str]
