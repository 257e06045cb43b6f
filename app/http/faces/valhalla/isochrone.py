"""Valhalla's isochrones: areas by time and distance, and ours by energy and by charge left."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

import numpy as np
from shapely import Polygon

from app.http.faces.areas import area_of, origin_of
from app.http.faces.electric import range_request
from app.http.faces.valhalla.asked import is_number, lonlat_sent
from app.http.faces.valhalla.errors import ValhallaError
from app.schemas.range import MAX_BANDS
from routing.graph.earth import METRE_PER_DEGREE
from routing.queries import By, Outline

if TYPE_CHECKING:
    from collections.abc import Sequence

    from app.http.faces.areas import Rings
    from app.http.faces.electric import Electric
    from app.http.faces.valhalla.asked import ValhallaRequest
    from app.schemas.range import RangeFeatureCollection, RangeRequest

# metrics of a contour, in our limits' units: min, km, kWh, charge left
METRICS: Final = {"time": By.TIME, "distance": By.DISTANCE, "energy": By.ENERGY, "charge": By.CHARGE}
FILL_OPACITY: Final = 0.33
COLOUR_DIGITS: Final = frozenset("0123456789abcdefABCDEF")


def asked_isochrone(asked: ValhallaRequest, electric: Electric) -> list[RangeRequest]:
    """A range request for each metric of the contours; refuses what can't be heeded."""
    (place,) = asked.places("locations", 1, few=120, missing=110, bad=130)
    asked.check_heeded()
    if asked.weights() is not None:
        asked.warn(299, "costing options without effect: shortest")
    reverse = asked.flag("reverse")
    asked.number("denoise", 0.0, 1.0)
    asked.number("generalize", 0.0, 1e6)
    fields: dict[str, object] = {"outline": Outline.FILLED, "reverse": reverse}
    requests = []
    for metric, values in _by_metric(asked).items():
        if reverse and metric in ("time", "distance"):
            raise ValhallaError(142, f"by {metric}; contours of energy or charge can be reversed")
        by = METRICS[metric]
        limits = {"bands": values} if by is By.CHARGE else {"by": by, "limits": values}
        requests.append(range_request(lonlat_sent(place), electric, **fields, **limits))
    return requests


def _contours(asked: ValhallaRequest) -> list[tuple[str, float, str]]:
    """Metric, value and colour of each contour."""
    sent = asked.fields.get("contours")
    if not isinstance(sent, list) or not sent:
        raise ValhallaError(113)
    if len(sent) > MAX_BANDS:
        raise ValhallaError(152, f"{MAX_BANDS}")
    contours = []
    for k, contour in enumerate(sent):
        named = [name for name in METRICS if isinstance(contour, dict) and contour.get(name) is not None]
        value: Any = contour[named[0]] if len(named) == 1 else None
        if not is_number(value) or value < 0.0 or (value == 0.0 and named != ["charge"]):
            raise ValhallaError(113, f"contours[{k}] has one of {', '.join(METRICS)}, above 0")
        colour = str(contour.get("color") or "").removeprefix("#")
        if len(colour) not in (0, 3, 6) or not set(colour) <= COLOUR_DIGITS:
            raise ValhallaError(113, f"contours[{k}] has color of six hexadecimal digits")
        contours.append((named[0], float(value), colour))
    return contours


def _by_metric(asked: ValhallaRequest) -> dict[str, list[float]]:
    """The values of each metric, each once, in the order of requests."""
    values: dict[str, list[float]] = {}
    for metric, value, _ in _contours(asked):
        values.setdefault(metric, []).append(value)
    return {metric: sorted(set(found)) for metric, found in values.items()}


def isochrone_answer(asked: ValhallaRequest, found: Sequence[RangeFeatureCollection]) -> dict[str, Any]:
    """Areas as Valhalla's GeoJSON: the largest first, as its clients count on."""
    polygons = asked.flag("polygons")
    areas: dict[tuple[str, float], Any] = {}
    for (metric, values), ranged in zip(_by_metric(asked).items(), found, strict=True):
        bands = [feature for feature in ranged.features if feature.properties.kind == "band"]
        origin = origin_of(ranged)
        for band in bands:
            properties: Any = band.properties
            value = float(properties.soc_left if metric == "charge" else properties.limit)
            nearest = min(values, key=lambda sent, value=value: abs(sent - value))  # type: ignore[misc]
            if abs(nearest - value) < 1e-9 * max(1.0, nearest):
                areas[metric, nearest] = (area_of(band, origin), properties)
    contours = _contours(asked)
    features = []
    for k in sorted(range(len(contours)), key=lambda k: _size(contours[k]), reverse=True):
        metric, value, colour = contours[k]
        area, properties = areas[metric, value]
        chosen = _chosen(asked, area.polygons, area.shares)
        shown = f"#{colour}" if colour else _colour(k, len(contours))
        features.append(
            {
                "type": "Feature",
                "properties": {
                    "fill-opacity": FILL_OPACITY,
                    "fillOpacity": FILL_OPACITY,
                    "opacity": FILL_OPACITY,
                    "fill": shown,
                    "fillColor": shown,
                    "color": shown,
                    "contour": value,
                    "metric": metric,
                    "ev": {"area_km2": round(area.area_km2, 4), "reaches_map_edge": properties.reaches_map_edge},
                },
                "geometry": _geometry(chosen, filled=polygons),
            }
        )
    if asked.flag("show_locations"):
        features += _locations(asked, found)
    written: dict[str, Any] = {"type": "FeatureCollection", "features": features}
    warnings = [*asked.warnings, *({"code": 299, "description": note} for ranged in found for note in ranged.warnings)]
    return written | ({"warnings": warnings} if warnings else {}) | asked.asked_id


def _size(contour: tuple[str, float, str]) -> float:
    """What contours of one metric are ordered by: less charge left is a larger area."""
    metric, value, _ = contour
    return -value if metric == "charge" else value


def _chosen(asked: ValhallaRequest, polygons: Sequence[Rings], shares: Sequence[float]) -> list[Rings]:
    """Polygons that are as large as denoise asks for, at least one; as simple as generalize asks for."""
    denoise = asked.number("denoise", 0.0, 1.0)
    least = (1.0 if denoise is None else denoise) * max(shares, default=0.0)
    kept = [rings for k, (rings, share) in enumerate(zip(polygons, shares, strict=True)) if k == 0 or share >= least]
    if denoise is None or denoise == 1.0:
        kept = kept[:1]
    tolerance_m = asked.number("generalize", 0.0, 1e6) or 0.0
    return [_simple(rings, tolerance_m) for rings in kept] if tolerance_m > 0.0 else list(kept)


def _simple(rings: Rings, tolerance_m: float) -> Rings:
    shape = Polygon(rings[0], rings[1:]).simplify(tolerance_m / METRE_PER_DEGREE)
    if shape.is_empty or not isinstance(shape, Polygon):
        return rings
    return [list(ring.coords) for ring in (shape.exterior, *shape.interiors)]


def _geometry(polygons: Sequence[Rings], *, filled: bool) -> dict[str, Any]:
    if not filled:
        lines = [rings[0] for rings in polygons if rings]
        if len(lines) > 1:
            return {"type": "MultiLineString", "coordinates": lines}
        return {"type": "LineString", "coordinates": lines[0] if lines else []}
    if len(polygons) > 1:
        return {"type": "MultiPolygon", "coordinates": list(polygons)}
    return {"type": "Polygon", "coordinates": polygons[0] if polygons else []}


def _locations(asked: ValhallaRequest, found: Sequence[RangeFeatureCollection]) -> list[dict[str, Any]]:
    """The place asked for, and where it met the road."""
    snapped = origin_of(found[0])
    (place,) = asked.fields["locations"]
    return [
        {
            "type": "Feature",
            "properties": {"type": "snapped", "location_index": 0},
            "geometry": {"type": "MultiPoint", "coordinates": [snapped]},
        },
        {
            "type": "Feature",
            "properties": {"type": "input", "location_index": 0},
            "geometry": {"type": "Point", "coordinates": [place["lon"], place["lat"]]},
        },
    ]


def _colour(position: int, count: int) -> str:
    """A colour from red over green, one a contour."""
    hue = position * 150.0 / count / 60.0
    rest = 0.5 * (1.0 - abs(hue % 2.0 - 1.0))
    parts = ((0.5, rest, 0.0), (rest, 0.5, 0.0), (0.0, 0.5, rest))[min(int(hue), 2)]
    return "#" + "".join(f"{round(255.0 * (0.25 + part)):02x}" for part in np.asarray(parts).tolist())
