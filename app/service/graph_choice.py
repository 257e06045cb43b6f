"""The graph of a request: the one that it names, else the smallest that holds its places."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from app.conversions.place import point_from_place
from app.errors.raised import PlacesApartError
from app.schemas.matrix import MatrixRequest
from app.schemas.range import RangeRequest
from app.schemas.route import RouteRequest
from routing.errors import PointOutsideMapError
from routing.graph.earth import METRE_PER_DEGREE
from routing.graph.snap import beside, beyond_m
from routing.places import Point

if TYPE_CHECKING:
    from collections.abc import Sequence

    from app.atlas import Atlas
    from app.schemas.drive import DriveRequest

    Asked = tuple[str, Point]  # a place by its field


def graph_for(sent: DriveRequest, atlas: Atlas, default: str, margin_m: float) -> str:
    """Name of the graph of a request: its own, else the smallest that holds all places, the default one without places.

    A graph holds places within its extent that are within margin_m [m] of its roads, and, where none does, those as
    near to its roads from beyond. Of graphs of one size the default one is taken. Where none is near enough to the
    roads, the smallest with all places in its extent is taken, whose error says how far they are.

    Raises PointOutsideMapError for a place in the extent of no graph, which names the nearest one, or one that holds
    the place with latitude and longitude swapped, and for a place on another graph than the request names, which names
    both; PlacesApartError where the places are on different graphs; GraphNotFoundError.
    """
    asked = _places_of(sent)
    if sent.graph is not None:
        for field, place in asked:
            _check_on(sent.graph, field, place, atlas, margin_m)
        return sent.graph
    if not asked:
        return default
    places = [place for _, place in asked]
    holding = _by_extent(places, atlas, default, margin_m)
    if not holding:
        return _where_none_holds_all(asked, atlas, default, margin_m)
    if len(holding) == 1:
        return holding[0]
    return next((name for name in holding if atlas.planner(name).holds(places)), holding[0])


def _check_on(name: str, field: str, place: Point, atlas: Atlas, margin_m: float) -> None:
    """Raise PointOutsideMapError where a place is not on one graph but on another."""
    is_off = beyond_m(place, atlas.bbox(name)) > margin_m
    others = _by_extent([place], atlas, name, margin_m) if is_off else []
    if others:
        whose = f"graph {name!r}, but on graph {others[0]!r}"
        raise PointOutsideMapError(field, place.lat_deg, place.lon_deg, atlas.bbox(name), whose=whose)


def _places_of(sent: DriveRequest) -> list[Asked]:
    if isinstance(sent, RouteRequest):
        named = [
            ("start", sent.start),
            *((f"via[{k}]", place) for k, place in enumerate(sent.via)),
            ("goal", sent.goal),
        ]
    elif isinstance(sent, MatrixRequest):
        lists = (("sources", sent.sources), ("targets", sent.targets or ()))
        named = [(f"{name}[{k}]", place) for name, sent_places in lists for k, place in enumerate(sent_places)]
    elif isinstance(sent, RangeRequest):
        named = [("origin", sent.origin)]
    else:
        named = []
    return [(field, point_from_place(place)) for field, place in named]


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
            for place in (beside(asked, atlas.bbox(name)) for asked in places)
        ]
        if max(beyond_deg) <= north_deg:
            size = (north - south) * (east - west) * shrink
            found.append((max(beyond_deg) > 0.0, size, name != default, name))
    return [name for *_, name in sorted(found)]


def _where_none_holds_all(asked: Sequence[Asked], atlas: Atlas, default: str, margin_m: float) -> str:
    """Raise the error of the first place that is not on a graph with those before it; or as _on_no_graph."""
    shared = list(atlas.names)
    for field, place in asked:
        on = _by_extent([place], atlas, default, margin_m)
        if not on:
            return _on_no_graph(field, place, atlas, default, margin_m)
        if not set(shared) & set(on):
            raise PlacesApartError((field, place, on), (*asked[0], shared))
        shared = [name for name in on if name in shared]
    return shared[0]


def _on_no_graph(field: str, place: Point, atlas: Atlas, default: str, margin_m: float) -> str:
    """Raise the error of a place in the extent of no graph; the nearest graph where its roads are near all the same."""
    swapped = _by_extent([Point(place.lon_deg, place.lat_deg)], atlas, default, margin_m)
    away = [(beyond_m(place, atlas.bbox(name)), name != default, name) for name in atlas.names]
    away_m, _, nearest = min(away)
    if swapped:
        name, away_m, road = swapped[0], math.inf, None
        whose = "every graph" if len(away) > 1 else f"graph {name!r}"
    else:
        name, whose = nearest, f"every graph, the nearest is {nearest!r}" if len(away) > 1 else f"graph {nearest!r}"
        try:
            atlas.planner(nearest).snap(field, place)
        except PointOutsideMapError as error:
            road = error.nearest
        else:
            return nearest
    raise PointOutsideMapError(
        field,
        place.lat_deg,
        place.lon_deg,
        atlas.bbox(name),
        road,
        whose=whose,
        away_m=away_m,
        swapped=bool(swapped),
    )
