"""Stations and a small town, drawn for tests."""

from __future__ import annotations

from dataclasses import replace

from energy.charging.charging import Connector
from routing.places import Point
from routing.stations.station import Socket, Station, StationSource

TYPE2 = Socket(Connector.TYPE2, 22_000.0, 2, 3)
CCS = Socket(Connector.CCS2, 150_000.0, 1)
SOURCE = StationSource("drawn", "drawn by a test", "CC0-1.0")


def place(east_m: float, north_m: float) -> Point:
    """A place by metres east and north of 42° N 1.5° E, as draw_map takes them."""
    return Point(42.0 + north_m / 111_073.38, 1.5 + east_m / 82_850.76)


def station(key: str, east_m: float, north_m: float, /, **fields: object) -> Station:
    """A station of the drawn source."""
    drawn = Station(f"drawn:{key}", place(east_m, north_m), (TYPE2,), source=SOURCE.key)
    return replace(drawn, **fields)  # type: ignore[arg-type]
