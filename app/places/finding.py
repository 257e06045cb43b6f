"""Places searched for on all graphs that have an index of them, or on one."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from app.places.parameters import MOST_RADIUS_KM
from routing.gazetteer.entries import Kind

if TYPE_CHECKING:
    from collections.abc import Sequence

    from app.atlas import Atlas
    from app.places.parameters import ReverseParameters, SearchParameters
    from app.places.shelf import PlacesShelf
    from routing.gazetteer.found import FoundPlace

STREET_ZOOM: Final = 18  # below which Nominatim answers no house
AREA_ZOOM: Final = 16
TOWN_ZOOM: Final = 13
LOOKED_AT: Final = 40
AREA_KM: Final = 20.0


@dataclass(frozen=True, slots=True)
class PlaceOnGraph:
    """A place, the graph that it is on, and the licence of the data."""

    graph: str
    place: FoundPlace
    licence: str


def search_places(
    shelf: PlacesShelf, default: str, sent: SearchParameters, languages: Sequence[str]
) -> list[PlaceOnGraph]:
    """What a text may mean, the likeliest first; raises as PlacesShelf.chosen does."""
    found = [
        PlaceOnGraph(graph, place, index.about.get("attribution", ""))
        for graph, index in shelf.chosen(sent.graph, default).items()
        for place in index.search(
            sent.text(), limit=sent.limit, near=sent.near(), languages=languages, within=sent.within()
        )
    ]
    return _single(sorted(found, key=lambda found: -found.place.score))[: sent.limit]


def reverse_places(
    shelf: PlacesShelf, atlas: Atlas, default: str, sent: ReverseParameters, languages: Sequence[str]
) -> list[PlaceOnGraph]:
    """What is at a place: its address, then what else is near; raises as PlacesShelf.chosen does."""
    area = sent.zoom < AREA_ZOOM and sent.format != "photon"
    radius_km = min(MOST_RADIUS_KM, max(AREA_KM, sent.radius) if area else sent.radius)
    narrow = sent.zoom < STREET_ZOOM and sent.format != "photon"
    found = []
    for graph, index in shelf.chosen(sent.graph, default).items():
        west, south, east, north = atlas.bbox(graph)
        beyond = radius_km / 100.0 / max(0.05, math.cos(math.radians(sent.lat)))
        if not (west - beyond <= sent.lon <= east + beyond and south - beyond <= sent.lat <= north + beyond):
            continue
        limit = LOOKED_AT if narrow else sent.limit
        for place in index.reverse(
            sent.lat, sent.lon, limit=limit, radius_m=1000.0 * radius_km, languages=languages, areas_only=area
        ):
            found.append(PlaceOnGraph(graph, place, index.about.get("attribution", "")))
    if narrow:
        kinds = (Kind.CITY,) if sent.zoom < TOWN_ZOOM else (Kind.CITY, Kind.DISTRICT) if area else (Kind.STREET,)
        found = [place for place in found if place.place.kind in kinds] or found
    return _single(found)[: sent.limit]


def _single(found: Sequence[PlaceOnGraph]) -> list[PlaceOnGraph]:
    """Places without those that several graphs have, such as a map imported twice."""
    seen: set[tuple[object, ...]] = set()
    single = []
    for each in found:
        place = each.place
        key = (place.osm_type, place.osm_id, place.kind, place.number, place.name or place.street)
        if place.osm_type and key in seen:
            continue
        seen.add(key)
        single.append(each)
    return single
