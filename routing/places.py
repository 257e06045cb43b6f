"""Places: points on the map, where they are on a link, and stretches of links."""

from __future__ import annotations

import math
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Point:
    """A place on the map [deg, WGS 84]."""

    lat_deg: float
    lon_deg: float


@dataclass(frozen=True, slots=True)
class SnappedPoint:
    """Where a point met the road network."""

    asked: Point
    on_road: Point
    distance_m: float
    link_idx: int
    offset_m: float
    road_name: str


@dataclass(frozen=True, slots=True)
class LinkSpan:
    """A directed link driven from from_m to to_m of its length [m].

    rest: the vehicle comes to rest there, for no time and whatever the stop rule. The next stretch may then go on
    from that place on the same link, or turn there.
    """

    link_idx: int
    from_m: float
    to_m: float
    rest: bool = False


@dataclass(frozen=True, slots=True)
class LinkPosition:
    """A place on a directed link, offset_m from its tail."""

    link_idx: int
    offset_m: float


def degrees_text(value: float, decimals: int = 7) -> str:
    """Degrees without zeros at the end; 7 decimals are 11 mm."""
    return f"{value:.{decimals}f}".rstrip("0").rstrip(".") if math.isfinite(value) else str(value)


def place_text(lat_deg: float, lon_deg: float) -> str:
    """A place as messages name it."""
    return f"lat {degrees_text(lat_deg)}, lon {degrees_text(lon_deg)}"


def can_only_be_swapped(lat_deg: float, lon_deg: float) -> bool:
    """Whether a latitude is out of range that would be a longitude, beside a longitude that would be a latitude."""
    return abs(lon_deg) <= 90.0 < abs(lat_deg) <= 180.0


def swapped_question(lat_deg: float, lon_deg: float) -> str:
    """What is asked at the end of a message where latitude and longitude seem to be swapped."""
    return f"; did you mean {place_text(lon_deg, lat_deg)}?"
