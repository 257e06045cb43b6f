"""Places in the forms of Nominatim: json, jsonv2, geojson."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

from routing.gazetteer.entries import Kind

if TYPE_CHECKING:
    from collections.abc import Sequence

    from app.places.finding import PlaceOnGraph
    from app.places.parameters import Form
    from routing.gazetteer.found import FoundPlace

TYPES: Final = {"n": "node", "w": "way", "r": "relation"}
RANKS: Final = {
    Kind.COUNTRY: 4,
    Kind.STATE: 8,
    Kind.COUNTY: 12,
    Kind.CITY: 16,
    Kind.DISTRICT: 20,
    Kind.LOCALITY: 22,
    Kind.POSTCODE: 21,
    Kind.STREET: 26,
    Kind.HOUSE: 30,
    Kind.POINT: 30,
    Kind.STATION: 30,
    Kind.COORDINATES: 30,
}
PARTS: Final = {Kind.DISTRICT: "suburb", Kind.CITY: "city", Kind.COUNTY: "county", Kind.STATE: "state"}
UNKNOWN: Final = {"error": "Unable to geocode"}
_AROUND_DEG: Final = 5e-5


def nominatim_list(found: Sequence[PlaceOnGraph], form: Form, *, with_address: bool) -> list[dict[str, Any]]:
    """The fields of a NominatimPlace each."""
    return [nominatim_place(place, form, with_address=with_address) for place in found]


def nominatim_place(found: PlaceOnGraph, form: Form, *, with_address: bool) -> dict[str, Any]:
    """The fields of a NominatimPlace; `class` in json, `category` else."""
    place = found.place
    west, south, east, north = _box(place)
    fields = _fields(place, with_address=with_address)
    return {
        "place_id": fields.pop("place_id"),
        "licence": found.licence,
        **{key: fields.pop(key) for key in ("osm_type", "osm_id") if key in fields},
        "lat": f"{place.lat:.7f}",
        "lon": f"{place.lon:.7f}",
        "class" if form == "json" else "category": fields.pop("category"),
        **fields,
        "boundingbox": tuple(f"{value:.7f}" for value in (south, north, west, east)),
    }


def nominatim_collection(found: Sequence[PlaceOnGraph], *, with_address: bool) -> dict[str, Any]:
    """The fields of a NominatimCollection."""
    features = [
        {
            "type": "Feature",
            "properties": _fields(place.place, with_address=with_address),
            "bbox": _box(place.place),
            "geometry": {"type": "Point", "coordinates": (round(place.place.lon, 7), round(place.place.lat, 7))},
        }
        for place in found
    ]
    licence = "; ".join(dict.fromkeys(place.licence for place in found))
    return {"type": "FeatureCollection", "licence": licence, "features": features}


def _fields(place: FoundPlace, *, with_address: bool) -> dict[str, Any]:
    fields: dict[str, Any] = {"place_id": place.place_id + 1}
    if place.osm_type:
        fields |= {"osm_type": TYPES[place.osm_type], "osm_id": place.osm_id}
    fields |= {
        "category": place.key,
        "type": place.value,
        "place_rank": RANKS[place.kind],
        "importance": round(place.importance, 4),
        "addresstype": _address_type(place),
        "name": place.name,
        "display_name": place.label(),
    }
    return fields | ({"address": _address(place)} if with_address else {})


def _address_type(place: FoundPlace) -> str:
    if place.kind is Kind.STREET:
        return "road"
    if place.kind in (Kind.POINT, Kind.STATION):
        return place.key
    if place.kind is Kind.HOUSE:
        return "place"
    return place.value if place.key == "place" else place.kind.value


def _address(place: FoundPlace) -> dict[str, str]:
    """Parts of an address from the smallest to the largest."""
    own = _address_type(place)
    if place.kind is Kind.HOUSE:
        parts = {"house_number": place.number, "road": place.street}
    else:
        parts = {own: place.name, "house_number": place.number, "road": place.street}
        if own == "road":
            parts["road"] = place.name
    parts |= {key: place.address[kind] for kind, key in PARTS.items() if kind in place.address and key not in parts}
    parts["postcode"] = place.postcode
    parts |= {"country": place.address.get(Kind.COUNTRY, ""), "country_code": place.country_code}
    return {key: text for key, text in parts.items() if text}


def _box(place: FoundPlace) -> tuple[float, float, float, float]:
    if place.box is not None:
        return place.box
    west, east = place.lon - _AROUND_DEG, place.lon + _AROUND_DEG
    return round(west, 7), round(place.lat - _AROUND_DEG, 7), round(east, 7), round(place.lat + _AROUND_DEG, 7)
