"""Places that requests name by a text, looked up before anything else is done with them."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final, TypeVar

from app.errors.raised import AmbiguousPlaceError, NoPlacesError, PlaceTextError, UnknownPlaceError
from app.schemas.place import LatLon
from app.schemas.places.named import NamedPlace, PlaceNamed, PlaceOption
from app.schemas.range import RangeRequest
from app.schemas.route import RouteRequest
from routing.gazetteer.coordinates import coordinates_in
from routing.gazetteer.found import Near
from routing.graph.earth import METRE_PER_DEGREE
from routing.graph.snap import beyond_m
from routing.places import Point

if TYPE_CHECKING:
    from collections.abc import Mapping

    from app.atlas import Atlas
    from app.places.shelf import PlacesShelf
    from app.schemas.drive import DriveRequest
    from app.schemas.place import PlaceOrText
    from routing.gazetteer.found import FoundPlace
    from routing.gazetteer.gazetteer import Gazetteer

LEAST_MATCH: Final = 0.66  # of what a text is taken for; assumed
AS_GOOD: Final = 0.05  # of score and match, within which a place is as likely as the best one; assumed
APART_M: Final = 1000.0  # beyond which it makes a difference which one is meant
MOST_OPTIONS: Final = 5
LEAST_OF_OPTION: Final = 0.6

Asked = TypeVar("Asked", bound="DriveRequest")


@dataclass(frozen=True, slots=True)
class _Read:
    """What a text may mean on a graph, the likeliest first."""

    field: str
    text: str
    found: list[FoundPlace]


def with_places(sent: Asked, shelf: PlacesShelf, atlas: Atlas, default: str, margin_m: float) -> Asked:
    """A request with coordinates in place of texts, each a NamedPlace; itself where it has none.

    Texts are looked up on the graph of the request, else on the one of those with an index on which they all fit best
    and that holds the coordinates of the request. Raises NoPlacesError, UnknownPlaceError, AmbiguousPlaceError, and as
    PlacesShelf.chosen does.
    """
    sent_places = _places_of(sent)
    if not any(isinstance(place, str) for place in sent_places.values()):
        return sent
    asked = {field: _typed(place) for field, place in sent_places.items()}
    texts = {field: place for field, place in asked.items() if isinstance(place, str)}
    if not texts:
        return _with(sent, asked, sent.graph)
    known = [_lat_lon(place) for place in asked.values() if not isinstance(place, str)]
    indexes = {graph: index for graph, index in shelf.chosen(sent.graph, default).items() if not index.is_empty}
    if not indexes:
        raise NoPlacesError(sent.graph or default, empty=True)
    holding = {
        graph: index
        for graph, index in indexes.items()
        if all(beyond_m(Point(*at), atlas.bbox(graph)) <= margin_m for at in known)
    }
    reads = {graph: _read(texts, index, known) for graph, index in (holding or indexes).items()}
    graph = max(reads, key=lambda graph: _worth(reads[graph]))
    named: dict[str, PlaceOrText] = {}
    refused: list[PlaceTextError] = []
    for read in reads[graph]:
        try:
            named[read.field] = _named(read, graph)
        except PlaceTextError as error:
            refused.append(error)
    if refused:
        refused[0].others = tuple(refused[1:])
        raise refused[0]
    return _with(sent, {**asked, **named}, graph)


def _read(texts: Mapping[str, str], index: Gazetteer, known: list[tuple[float, float]]) -> list[_Read]:
    """What each text may mean, near the coordinates of the request or else near the first that is surely meant."""
    near = Near(*known[0]) if known else None
    reads = []
    for field, text in texts.items():
        found = index.search(text, limit=2 * MOST_OPTIONS, near=near)
        reads.append(_Read(field, text, found))
        if near is None and found and not _as_good(found):
            near = Near(found[0].lat, found[0].lon)
    if near is not None and not known:  # those before it, too
        reads = [
            _Read(read.field, read.text, index.search(read.text, limit=2 * MOST_OPTIONS, near=near))
            if _as_good(read.found)
            else read
            for read in reads
        ]
    return reads


def _worth(reads: list[_Read]) -> tuple[int, float]:
    fitting = [read.found[0] for read in reads if read.found and read.found[0].match >= LEAST_MATCH]
    return len(fitting), sum(place.score for place in fitting)


def _as_good(found: list[FoundPlace]) -> list[FoundPlace]:
    """Others that are as likely as the best one and elsewhere."""
    if not found:
        return []
    best = found[0]
    return [
        other
        for other in found[1:]
        if other.score >= best.score - AS_GOOD
        and other.match >= best.match - AS_GOOD
        and _away_m(best, other) > APART_M
    ]


def _named(read: _Read, graph: str) -> NamedPlace:
    if not read.found or read.found[0].match < LEAST_MATCH:
        raise UnknownPlaceError(read.field, read.text, graph, [_option(place) for place in read.found[:MOST_OPTIONS]])
    best = read.found[0]
    if _as_good(read.found):
        likely = [best, *_as_good(read.found)][:MOST_OPTIONS]
        raise AmbiguousPlaceError(read.field, read.text, graph, [_option(place) for place in likely])
    others = [place for place in read.found[1:] if place.match >= LEAST_OF_OPTION][:MOST_OPTIONS]
    return NamedPlace.of(
        PlaceNamed(
            field=read.field,
            text=read.text,
            graph=graph,
            **_option(best).model_dump(),
            asked_number=best.asked_number or None,
            nearest_number=best.nearest_number or None,
            alternatives=[_option(place) for place in others],
        )
    )


def _option(place: FoundPlace) -> PlaceOption:
    return PlaceOption(
        label=place.label(),
        kind=place.kind.value,
        lat=round(place.lat, 7),
        lon=round(place.lon, 7),
        match=round(place.match, 3),
    )


def _away_m(place: FoundPlace, other: FoundPlace) -> float:
    east = (place.lon - other.lon) * math.cos(math.radians(place.lat))
    return math.hypot(place.lat - other.lat, east) * float(METRE_PER_DEGREE)


def _places_of(sent: DriveRequest) -> dict[str, PlaceOrText]:
    if isinstance(sent, RouteRequest):
        via = {f"via[{k}]": place for k, place in enumerate(sent.via)}
        return {"start": sent.start, **via, "goal": sent.goal}
    return {"origin": sent.origin} if isinstance(sent, RangeRequest) else {}


def _typed(place: PlaceOrText) -> PlaceOrText:
    """Coordinates in place of a text that holds some, which need no index."""
    typed = coordinates_in(place) if isinstance(place, str) else None
    return place if typed is None else LatLon(lat=typed[0], lon=typed[1])


def _with(sent: Asked, places: Mapping[str, PlaceOrText], graph: str | None) -> Asked:
    fields: dict[str, object] = {name: place for name, place in places.items() if not name.startswith("via")}
    if isinstance(sent, RouteRequest):
        fields["via"] = [place for name, place in places.items() if name.startswith("via")]
    return sent.model_copy(update={**fields, "graph": graph})


def _lat_lon(place: PlaceOrText) -> tuple[float, float]:
    assert not isinstance(place, str)
    return (place.lat, place.lon) if isinstance(place, LatLon) else (place[1], place[0])
