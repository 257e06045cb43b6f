"""Places in the form of Photon."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

from routing.gazetteer.entries import Kind

if TYPE_CHECKING:
    from collections.abc import Sequence

    from app.places.finding import PlaceOnGraph

LAYERS: Final = {
    Kind.POINT: "other",
    Kind.STATION: "other",
    Kind.POSTCODE: "other",
    Kind.COORDINATES: "other",
}
DECIMALS: Final = 7


def photon_collection(found: Sequence[PlaceOnGraph]) -> dict[str, Any]:
    """The fields of a PhotonCollection, without those that are not known."""
    return {"type": "FeatureCollection", "features": [_feature(place) for place in found]}


def _feature(found: PlaceOnGraph) -> dict[str, Any]:
    place = found.place
    layer = LAYERS.get(place.kind, place.kind.value)
    extra: dict[str, Any] = {"graph": found.graph, "match": round(place.match, 3)}
    if place.distance_m is not None:
        extra["distance_m"] = round(place.distance_m, 1)
    if place.asked_number:
        extra |= {"asked_housenumber": place.asked_number}
        extra |= {"nearest_housenumber": place.nearest_number} if place.nearest_number else {}
    properties = {
        "osm_type": place.osm_type.upper() or None,
        "osm_id": place.osm_id if place.osm_type else None,
        "osm_key": place.key,
        "osm_value": place.value,
        "type": layer,
        "name": place.name or None,
        "housenumber": place.number or None,
        "street": place.street or None,
        **{kind.value: name for kind, name in place.address.items()},
        "countrycode": place.country_code.upper() or None,
        "postcode": place.postcode or None,
        "extent": None if place.box is None else (place.box[0], place.box[3], place.box[2], place.box[1]),
        "extra": extra,
    }
    return {
        "type": "Feature",
        "geometry": {"type": "Point", "coordinates": (round(place.lon, DECIMALS), round(place.lat, DECIMALS))},
        "properties": {key: value for key, value in properties.items() if value is not None},
    }
