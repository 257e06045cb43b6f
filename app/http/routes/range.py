"""GET and POST /range."""

from __future__ import annotations

from typing import Annotated, Any

from fastapi import APIRouter, Body, Query, Request, Response
from fastapi.exceptions import RequestValidationError
from pydantic import ValidationError

from app.conversions.range import request_from_parameters
from app.http.admission import Cost
from app.http.examples.answers import RANGE_FEATURES, RANGE_REQUESTS
from app.http.examples.problems import BODY_CODES, SEARCH_CODES, TEXT_CODES, problems
from app.http.json_body import BoundedRoute
from app.http.routes.access import GEOJSON, UNCHANGED, GeoJSONResponse, RunningService, Searches, answer_in
from app.http.routes.formats import Accepted, RangeFormatAsked, file_contents
from app.schemas.lean.formats import RANGE_FORMATS, AnswerFormat, accepted_format
from app.schemas.range import RangeFeatureCollection, RangeParameters, RangeRequest
from energy.errors import ConditionsError

router = APIRouter(route_class=BoundedRoute, tags=["range"], default_response_class=GeoJSONResponse)

FOUND: dict[int | str, dict[str, Any]] = {
    200: {"content": {GEOJSON: {"example": RANGE_FEATURES}, **file_contents(RANGE_FORMATS)}}
}


@router.get(
    "/range",
    summary="The area that can be reached, as GeoJSON",
    response_model=RangeFeatureCollection,
    responses={**FOUND, **UNCHANGED, **problems("/range", *SEARCH_CODES)},
)
async def find_range(
    sent: Annotated[RangeParameters, Query()],
    request: Request,
    service: RunningService,
    searches: Searches,
    accept: Accepted = GEOJSON,
) -> Response:
    """One MultiPolygon for each band of charge left on arrival, the outermost first, and the origin on its road."""
    try:
        long_form = request_from_parameters(sent)
    except ValidationError as error:
        raise RequestValidationError(error.errors()) from error
    try:
        return await _answered(long_form, sent.format, accept, request, service, searches)
    except ConditionsError as error:  # names a field of the long form
        raise ConditionsError(error.field.removeprefix("conditions."), error.value, error.allowed) from error


@router.post(
    "/range",
    summary="The area that can be reached, with the vehicle inline",
    response_model=RangeFeatureCollection,
    responses={
        **FOUND,
        **problems("/range", *SEARCH_CODES, *BODY_CODES, *TEXT_CODES),
    },
)
async def find_range_of_body(
    sent: Annotated[RangeRequest, Body(openapi_examples=RANGE_REQUESTS)],
    request: Request,
    service: RunningService,
    searches: Searches,
    form: RangeFormatAsked = None,
    accept: Accepted = GEOJSON,
) -> Response:
    """The same as GET /range, asked for with a body."""
    return await _answered(sent, form, accept, request, service, searches)


async def _answered(
    sent: RangeRequest,
    form: AnswerFormat | None,
    accept: str,
    request: Request,
    service: RunningService,
    searches: Searches,
) -> Response:
    chosen = form or accepted_format(accept, RANGE_FORMATS)
    return await searches.run(
        request, lambda: answer_in(request, chosen, service.range_in(chosen, sent), "range"), Cost.MIDDLE
    )
