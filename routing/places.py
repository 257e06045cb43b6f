"""Places: points on the map, where they are on a link, and stretches of links."""

from __future__ import annotations

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
