"""Valhalla's heights along a shape, and roads near places."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

import numpy as np

from app.http.faces.electric import range_request
from app.http.faces.lines import DECIMALS
from app.http.faces.polylines import encoded
from app.http.faces.valhalla.asked import DECIMALS as FORMS
from app.http.faces.valhalla.asked import lonlat_sent
from app.http.faces.valhalla.errors import ValhallaError
from app.service.roads import road_heights, roads_near
from routing.errors import PointFarFromRoadError, PointOutsideMapError
from routing.graph.earth import great_circle_m
from routing.places import Point

if TYPE_CHECKING:
    from app.http.faces.electric import Electric
    from app.http.faces.valhalla.asked import ValhallaRequest
    from app.service.service import Service

MOST_POINTS: Final = 10_000
LEAST_APART_M: Final = 10.0
MOST_LOCATED: Final = 20


def height_answer(asked: ValhallaRequest, electric: Electric, service: Service) -> dict[str, Any]:
    """Height of the road at each place of a shape; null where none is near, or the map has no heights."""
    lonlat, sent = asked.shape(MOST_POINTS)
    apart_m = asked.number("resample_distance", 0.0, 1e9)
    if apart_m is not None:
        if apart_m < LEAST_APART_M:
            raise ValhallaError(313, f"{LEAST_APART_M:g}")
        lonlat = _resampled(np.array(lonlat, np.float64), apart_m)
        if "shape" in sent:
            sent = {"shape": [{"lon": round(lon, DECIMALS), "lat": round(lat, DECIMALS)} for lon, lat in lonlat]}
        else:
            form = asked.fields.get("shape_format", "polyline6")
            sent = {"encoded_polyline": encoded(np.array(lonlat), FORMS[form])}
    digits = asked.fields.get("height_precision", 0)
    digits = digits if digits in (1, 2) and not isinstance(digits, bool) else 0
    places = [Point(lat, lon) for lon, lat in lonlat]
    found = road_heights(service, [range_request(place, electric) for place in _tried(lonlat)], places)
    heights = [None if height is None else round(height, digits) if digits else round(height) for height in found]
    if not asked.flag("range"):
        return {**sent, "height": heights} | asked.asked_id
    ranges = [round(along) for along in _along_m(np.array(lonlat, np.float64)).tolist()]
    pairs = [[along, height] for along, height in zip(ranges, heights, strict=True)]
    return {**sent, "range_height": pairs} | asked.asked_id


def _tried(lonlat: list[tuple[float, float]]) -> list[tuple[float, float]]:
    """Places of a shape that its graph is looked for by: the first, one in the middle, the last."""
    return [lonlat[0], lonlat[len(lonlat) // 2], lonlat[-1]]


def _along_m(line: np.ndarray[Any, np.dtype[np.float64]]) -> np.ndarray[Any, np.dtype[np.float64]]:
    step_m = np.asarray(great_circle_m(line[:-1, 1], line[:-1, 0], line[1:, 1], line[1:, 0]), np.float64)
    return np.concatenate(([0.0], np.cumsum(step_m)))


def _resampled(line: np.ndarray[Any, np.dtype[np.float64]], apart_m: float) -> list[tuple[float, float]]:
    along_m = _along_m(line)
    if along_m[-1] / apart_m > MOST_POINTS - 2:
        raise ValhallaError(314, f"at most {MOST_POINTS}")
    at = np.append(np.arange(0.0, along_m[-1], apart_m), along_m[-1])
    return list(zip(*(np.interp(at, along_m, line[:, k]).tolist() for k in (0, 1)), strict=True))


def locate_answer(asked: ValhallaRequest, electric: Electric, service: Service) -> list[dict[str, Any]]:
    """The road nearest to each place."""
    written = []
    for place in asked.places("locations", MOST_LOCATED, few=120, missing=110, bad=130):
        lon, lat = lonlat_sent(place)
        located: dict[str, Any] = {"input_lon": lon, "input_lat": lat, "nodes": None, "edges": None}
        try:
            (near,) = roads_near(service, range_request((lon, lat), electric), 1)
        except (PointOutsideMapError, PointFarFromRoadError) as error:
            located["warnings"] = [f"No suitable edges near location: {error}"]
        else:
            on = near.place
            located["edges"] = [
                {
                    "way_id": near.way_id,
                    "correlated_lat": round(on.on_road.lat_deg, DECIMALS),
                    "correlated_lon": round(on.on_road.lon_deg, DECIMALS),
                    "side_of_street": "neither",
                    "percent_along": round(on.offset_m / near.length_m, 5),
                    "distance": round(on.distance_m, 3),
                    "names": [on.road_name] if on.road_name else [],
                }
            ]
            located["nodes"] = []
        written.append(located)
    return written
