"""The graph of a request that names none: the smallest that holds its places."""

from __future__ import annotations

import math
from itertools import chain
from typing import TYPE_CHECKING

from app.conversions.place import point_from_place
from app.schemas.matrix import MatrixRequest
from app.schemas.range import RangeRequest
from app.schemas.route import RouteRequest
from routing.graph.earth import METRE_PER_DEGREE
from routing.places import Point

if TYPE_CHECKING:
    from collections.abc import Sequence

    from app.atlas import Atlas
    from app.schemas.drive import DriveRequest


def graph_for(sent: DriveRequest, atlas: Atlas, default: str, margin_m: float) -> str:
    """Name of the smallest graph that holds all places of a request, the default one where there are no places.

    A graph holds places within its extent that are within margin_m [m] of its roads, and, where none does, those as
    near to its roads from beyond. Of graphs of one size the default one is taken. Where none holds all, that whose
    error says most: the smallest with all places in its extent, or with all of them in it once latitude and longitude
    are swapped, else the default one.
    """
    places = _places_of(sent)
    if not places:
        return default
    holding = _by_extent(places, atlas, default, margin_m)
    if len(holding) > 1:
        return next((name for name in holding if atlas.planner(name).holds(places)), holding[0])
    swapped = [Point(place.lon_deg, place.lat_deg) for place in places]
    return next(chain(holding, _by_extent(swapped, atlas, default, margin_m)), default)


def _places_of(sent: DriveRequest) -> list[Point]:
    if isinstance(sent, RouteRequest):
        return [point_from_place(place) for place in (sent.start, *sent.via, sent.goal)]
    if isinstance(sent, MatrixRequest):
        return [point_from_place(place) for place in (*sent.sources, *(sent.targets or ()))]
    return [point_from_place(sent.origin)] if isinstance(sent, RangeRequest) else []


def _by_extent(places: Sequence[Point], atlas: Atlas, default: str, margin_m: float) -> list[str]:
    """Graphs with all places in their extent, then those with all of them near it, each the smallest first."""
    found = []
    for name in atlas.names:
        west, south, east, north = atlas.bbox(name)
        shrink = math.cos(math.radians(0.5 * (south + north)))
        north_deg = margin_m / METRE_PER_DEGREE
        beyond_deg = [
            max(
                south - place.lat_deg,
                place.lat_deg - north,
                shrink * (west - place.lon_deg),
                shrink * (place.lon_deg - east),
            )
            for place in places
        ]
        if max(beyond_deg) <= north_deg:
            size = (north - south) * (east - west) * shrink
            found.append((max(beyond_deg) > 0.0, size, name != default, name))
    return [name for *_, name in sorted(found)]
