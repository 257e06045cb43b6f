"""GET /search and GET /reverse."""

from __future__ import annotations

from typing import Annotated, Any, Final

from fastapi import APIRouter, Header, Query, Request, Response

from app.http.examples.answers import REVERSE_ANSWER, REVERSE_NOMINATIM, SEARCH_ANSWER, SEARCH_NOMINATIM
from app.http.examples.problems import problems
from app.http.routes.access import GEOJSON, JSON, UNCHANGED, GeoJSONResponse, RunningService, long_answer
from app.places.answer import NominatimCollection, NominatimError, NominatimPlace, PhotonCollection
from app.places.parameters import ReverseParameters, SearchParameters
from app.schemas.problem import ErrorCode

router = APIRouter(tags=["places"], default_response_class=GeoJSONResponse)

CODES: Final = (
    ErrorCode.NO_PLACES,
    ErrorCode.UNKNOWN_GRAPH,
    ErrorCode.GRAPH_DAMAGED,
    ErrorCode.INVALID_REQUEST,
    ErrorCode.NOT_READY,
)
Accepted = Annotated[
    str,
    Header(alias="Accept-Language", description="languages of names, without lang and accept-language"),
]


def _answers(geojson: dict[str, Any], nominatim: object, listed: dict[str, Any]) -> dict[int | str, dict[str, Any]]:
    return {200: {"content": {GEOJSON: {"example": geojson}, JSON: {"schema": listed, "example": nominatim}}}}


@router.get(
    "/search",
    summary="Places by their name, in the forms of Photon and Nominatim",
    response_model=PhotonCollection | NominatimCollection,
    responses={
        **_answers(
            SEARCH_ANSWER,
            SEARCH_NOMINATIM,
            {"type": "array", "items": {"$ref": "#/components/schemas/NominatimPlace"}},
        ),
        **UNCHANGED,
        **problems("/search", *CODES),
    },
)
def search_places(
    sent: Annotated[SearchParameters, Query()],
    request: Request,
    service: RunningService,
    accept_language: Accepted = "",
) -> Response:
    """Streets, house numbers, settlements, stations and points of interest, the likeliest first.

    Spelling, order and abbreviations matter little, and the last word may be its beginning only. What is near lat and
    lon goes before what fits as well. A house number that a street has not is answered with the street, at the place of
    the nearest number, which is told.
    """
    body = service.places.search_json(sent, accept_language)
    return long_answer(request, body, GEOJSON if sent.format in ("photon", "geojson") else JSON)


@router.get(
    "/reverse",
    summary="The address of a place, in the forms of Photon and Nominatim",
    response_model=PhotonCollection | NominatimCollection,
    responses={
        **_answers(
            REVERSE_ANSWER,
            REVERSE_NOMINATIM,
            {
                "anyOf": [
                    {"$ref": "#/components/schemas/NominatimPlace"},
                    {"$ref": "#/components/schemas/NominatimError"},
                ]
            },
        ),
        **UNCHANGED,
        **problems("/reverse", *CODES),
    },
)
def reverse_places(
    sent: Annotated[ReverseParameters, Query()],
    request: Request,
    service: RunningService,
    accept_language: Accepted = "",
) -> Response:
    """The house at a place or the nearest street; with a limit above 1, in Photon's form, also what else is near."""
    body = service.places.reverse_json(sent, accept_language)
    return long_answer(request, body, GEOJSON if sent.format in ("photon", "geojson") else JSON)


SCHEMAS: Final = (NominatimPlace, NominatimError)  # that only the responses above name

for path, endpoint in (
    ("/api", search_places),  # as Photon calls it
    ("/api/", search_places),
    ("/search/", search_places),
    ("/reverse/", reverse_places),
):
    router.add_api_route(path, endpoint, include_in_schema=False)
