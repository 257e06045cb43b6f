"""Places on roads as OSRM names them."""

from __future__ import annotations

import base64
import struct
from typing import TYPE_CHECKING

from app.http.faces.lines import DECIMALS

if TYPE_CHECKING:
    from app.schemas.place import Snapped
    from routing.places import SnappedPoint


def waypoint(place: SnappedPoint) -> dict[str, object]:
    """A place of a route."""
    on_road = place.on_road
    return _waypoint(
        place.road_name, on_road.lon_deg, on_road.lat_deg, place.distance_m, place.link_idx, place.offset_m
    )


def waypoint_of(place: Snapped) -> dict[str, object]:
    """A place of a matrix."""
    on_road = place.on_road
    return _waypoint(place.road_name, on_road.lon, on_road.lat, place.distance_m, place.link_id, place.offset_m)


def _waypoint(
    name: str, lon: float, lat: float, distance_m: float, link_idx: int, offset_m: float
) -> dict[str, object]:
    hint = base64.urlsafe_b64encode(struct.pack("<if", link_idx, offset_m)).decode("ascii").rstrip("=")
    return {
        "hint": hint,
        "distance": round(distance_m, 6),
        "name": name,
        "location": [round(lon, DECIMALS), round(lat, DECIMALS)],
    }
