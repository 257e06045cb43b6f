"""What is known of a charging station."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import StrEnum
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Mapping

    from energy.charging.charging import Connector
    from routing.places import LinkPosition, Point


class Access(StrEnum):
    """Who may charge there."""

    PUBLIC = "public"
    CUSTOMERS = "customers"
    RESTRICTED = "restricted"
    PRIVATE = "private"
    UNKNOWN = "unknown"


@dataclass(frozen=True, slots=True)
class Socket:
    """Sockets of one kind at a station.

    output_w: most of each [W], None where it is not known. phases: of AC, None where not known. count: how many, ≥ 1.
    """

    connector: Connector
    output_w: float | None
    count: int = 1
    phases: int | None = None


@dataclass(frozen=True, slots=True)
class Station:
    """A charging station, at most one a place and operator.

    id: of its source, as `osm:n123`, `ocm:123`, `ocpi:…`. at: the place given. capacity: vehicles at a time, None where
    not known. opening_hours: in the syntax of OpenStreetMap, None where not known. price: as the source says it, and in
    numbers where it does: currency, per kWh, per minute, per session.
    position: on the roads, one for each direction that may be driven; snap_m: how far the road is from the place [m].
    operational: False where the source says that it is out of order; None where it says nothing.
    merged: ids of what was told of the same station elsewhere, and is united with it.
    """

    id: str
    at: Point
    sockets: tuple[Socket, ...]
    name: str = ""
    operator: str = ""
    network: str = ""
    capacity: int | None = None
    access: Access = Access.UNKNOWN
    fee: bool | None = None
    price: Price | None = None
    opening_hours: str | None = None
    operational: bool | None = None
    source: str = ""  # key of StationSource
    position: tuple[LinkPosition, ...] = ()
    snap_m: float = 0.0
    merged: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Price:
    """What charging costs: the source's words, and numbers where they were understood."""

    text: str = ""
    currency: str = ""
    per_kwh: float | None = None
    per_min: float | None = None
    per_session: float | None = None


@dataclass(frozen=True, slots=True)
class StationSource:
    """Where stations are from, which every answer names: key, name, licence, address, and when it was fetched."""

    key: str
    name: str
    licence: str
    url: str = ""
    retrieved: str = ""


@dataclass(frozen=True, slots=True)
class Stations:
    """All stations of one graph, snapped to its links, and their sources by key.

    left_out: how many were not taken, by reason.
    """

    stations: tuple[Station, ...]
    sources: tuple[StationSource, ...]
    left_out: Mapping[str, int] = field(default_factory=dict)
