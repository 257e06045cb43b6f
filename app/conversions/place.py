"""Places between schemas and routing.queries, and coordinates for GeoJSON."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final, Literal

from app.conversions.lean.colours import MARKERS
from app.schemas.place import LatLon, PlaceFeature, PlaceProperties, PointGeometry, Position
from routing.places import Point

if TYPE_CHECKING:
    from collections.abc import Sequence

    from app.schemas.place import PlaceOrText
    from routing.places import SnappedPoint

DECIMALS: Final = 7  # 1e-7 degrees are 11 mm


def point_from_place(place: PlaceOrText) -> Point:
    """A place sent in either form; texts are looked up before."""
    assert not isinstance(place, str), "app.places.texts.with_places puts coordinates in place of texts"
    if isinstance(place, LatLon):
        return Point(place.lat, place.lon)
    return Point(lat_deg=place[1], lon_deg=place[0])


def lat_lon(point: Point) -> dict[str, float]:
    """The fields of a LatLon."""
    return {"lat": round(point.lat_deg, DECIMALS), "lon": round(point.lon_deg, DECIMALS)}


def exact_lat_lon(point: Point) -> LatLon:
    """A point exactly as it was asked for."""
    return LatLon(lat=point.lat_deg, lon=point.lon_deg)


def snapped(point: SnappedPoint) -> dict[str, object]:
    """Where a place met the road: the fields of a Snapped in their order."""
    return {
        "asked": {"lat": point.asked.lat_deg, "lon": point.asked.lon_deg},
        "on_road": lat_lon(point.on_road),
        "distance_m": point.distance_m,
        "link_id": point.link_idx,
        "offset_m": point.offset_m,
        "road_name": point.road_name,
    }


def place_feature(point: SnappedPoint, kind: Literal["start", "via", "goal", "origin"]) -> PlaceFeature:
    """A snapped place as a GeoJSON Point."""
    return PlaceFeature(
        geometry=PointGeometry(coordinates=position(point.on_road.lon_deg, point.on_road.lat_deg)),
        properties=PlaceProperties(
            kind=kind,
            asked=exact_lat_lon(point.asked),
            distance_m=point.distance_m,
            link_id=point.link_idx,
            offset_m=point.offset_m,
            road_name=point.road_name,
            **{"marker-color": MARKERS[kind]},
        ),
    )


def position(lon: float, lat: float) -> Position:
    """Coordinates in the order and precision of our GeoJSON."""
    return round(lon, DECIMALS), round(lat, DECIMALS)


def positions(points: Sequence[Sequence[float]]) -> list[Position]:
    """A line's or ring's coordinates."""
    return [position(lon, lat) for lon, lat in points]
