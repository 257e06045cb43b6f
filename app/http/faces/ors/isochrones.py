"""openrouteservice's isochrones: areas by time, distance, and ours by energy and by charge left."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any, Final

from app.http.faces.areas import area_of, box_of_rings, origin_of
from app.http.faces.electric import range_request
from app.http.faces.ors.asked import METRES, places_from
from app.http.faces.ors.errors import OrsError, OrsKind, OrsService, metadata, unsupported
from app.schemas.range import MAX_BANDS
from energy.units import METRE_PER_KM, SECOND_PER_MINUTE
from routing.queries import By, Outline

if TYPE_CHECKING:
    from collections.abc import Sequence

    from app.http.faces.electric import Electric
    from app.http.faces.ors.asked import IsochronesBody
    from app.schemas.place import PlaceFeature
    from app.schemas.range import BandFeature, RangeFeatureCollection, RangeRequest

VALUE: Final = OrsService.ISOCHRONES + OrsKind.VALUE
WH: Final = {"Wh": 1.0, "kWh": 1000.0}
BY: Final = {"time": By.TIME, "distance": By.DISTANCE, "energy": By.ENERGY, "charge": By.CHARGE}
ROUNDING: Final = 1e-9


def asked_isochrones(body: IsochronesBody, electric: Electric) -> list[RangeRequest]:
    """A range request for each location; refuses what can't be heeded."""
    if body.intersections:
        raise unsupported(OrsService.ISOCHRONES, "intersections")
    if body.location_type == "destination" and body.range_type in ("time", "distance"):
        raise unsupported(OrsService.ISOCHRONES, f"location_type=destination with range_type={body.range_type}")
    if body.time is not None:
        weather = electric.drive.get("conditions") or {}
        if isinstance(weather, dict):
            weather = {"departure": body.time.isoformat(), **weather}
            electric = replace(electric, drive={**electric.drive, "conditions": weather})
    fields: dict[str, object] = {
        "outline": Outline.ROADS if body.smoothing == 0.0 else Outline.FILLED,
        "reverse": body.location_type == "destination",
    }
    values = ranges(body)
    by = BY[body.range_type]
    if by is By.CHARGE:
        fields["bands"] = values
    else:
        fields |= {"by": by, "limits": [value * _unit(body) for value in values]}
    places = places_from(body.locations, OrsService.ISOCHRONES, "locations")
    return [range_request(place, electric, **fields) for place in places]


def ranges(body: IsochronesBody) -> list[float]:
    """The limits of a body, ascending: its range, or steps of an interval up to that."""
    values = sorted(set(body.range))
    if body.interval is not None and len(values) == 1:
        count = values[0] / body.interval
        if count > MAX_BANDS:
            number = OrsService.ISOCHRONES + OrsKind.LIMIT
            raise OrsError(number, f"Parameter 'interval' makes more than {MAX_BANDS} isochrones.")
        values = [body.interval * k for k in range(1, int(count + ROUNDING) + 1)] or values
        if body.range[0] - values[-1] > ROUNDING * body.range[0]:
            values.append(body.range[0])
    if values[0] <= 0.0 and body.range_type != "charge":
        raise OrsError(VALUE, f"Parameter 'range' has incorrect value of '{values[0]:g}', above 0 is allowed.")
    return values


def _unit(body: IsochronesBody) -> float:
    """What a value of the body is in the units of our limits: min, km or kWh."""
    units = body.units
    if body.range_type == "time":
        return 1.0 / SECOND_PER_MINUTE
    if body.range_type == "distance" and units in (None, *METRES):
        return METRES[units or "m"] / METRE_PER_KM
    if body.range_type == "energy" and units in (None, "m", *WH):  # m is what clients send by default
        return WH.get(units or "Wh", 1.0) / 1000.0
    raise OrsError(VALUE, f"Parameter 'units' has incorrect value of '{units}' for range_type {body.range_type}.")


def isochrones_geojson(body: IsochronesBody, found: Sequence[RangeFeatureCollection], profile: str) -> dict[str, Any]:
    """Areas as openrouteservice's GeoJSON: for each location the smallest first."""
    features: list[dict[str, Any]] = []
    values = ranges(body)
    square = METRES[body.area_units] ** 2
    for group, ranged in enumerate(found):
        bands = [feature for feature in ranged.features if feature.properties.kind == "band"]
        center = origin_of(ranged)
        for value, band in _by_value(body, values, bands):
            area = area_of(band, center)
            properties: dict[str, Any] = {"group_index": group, "value": value, "center": center}
            if "area" in body.attributes:
                properties["area"] = round(1e6 * area.area_km2 * (area.shares[:1] or (0.0,))[0] / square, 4)
            properties["ev"] = {
                "area_km2": round(area.area_km2, 4),
                "parts": len(area.polygons),
                "reaches_map_edge": band.properties.reaches_map_edge,
            }
            features.append(
                {
                    "type": "Feature",
                    "properties": properties,
                    "geometry": {"type": "Polygon", "coordinates": area.main},
                }
            )
    query = body.query()
    return {
        "type": "FeatureCollection",
        "bbox": box_of_rings([feature["geometry"]["coordinates"] for feature in features]) or [],
        "features": features,
        "metadata": metadata(body.id, "isochrones", query, profile, found[0].terrain.attribution),
    }


def _by_value(
    body: IsochronesBody, values: list[float], bands: Sequence[BandFeature | PlaceFeature]
) -> list[tuple[float, BandFeature]]:
    """Bands with the value that they were asked for by, ascending; by charge, the most of it left first."""
    if body.range_type == "charge":
        by_soc = {round(band.properties.soc_left, 9): band for band in bands}  # type: ignore[union-attr,arg-type]
        chosen = [(value, by_soc[round(value, 9)]) for value in reversed(values) if round(value, 9) in by_soc]
    else:
        ordered = sorted(bands, key=lambda band: band.properties.limit)  # type: ignore[union-attr,arg-type,return-value]
        chosen = list(zip(values, ordered, strict=True))
    return chosen  # type: ignore[return-value]
