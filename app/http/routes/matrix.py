"""POST /matrix."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Body, Request, Response
from starlette.concurrency import run_in_threadpool

from app.exports.answers import matrix_in
from app.http.examples.answers import MATRIX_ANSWER, MATRIX_REQUESTS
from app.http.examples.problems import BODY_CODES, SEARCH_CODES, problems
from app.http.json_body import BoundedRoute
from app.http.routes.access import JSON, RunningService, Searches, answer_in
from app.http.routes.formats import Accepted, MatrixFormatAsked, file_contents
from app.schemas.lean.formats import MATRIX_FORMATS, accepted_format
from app.schemas.matrix import MatrixRequest, MatrixResponse

router = APIRouter(route_class=BoundedRoute, tags=["route"])


@router.post(
    "/matrix",
    summary="Energy, time, distance and charge of the drives from many places to many",
    response_model=MatrixResponse,
    responses={
        200: {"content": {JSON: {"example": MATRIX_ANSWER}, **file_contents(MATRIX_FORMATS)}},
        **problems("/matrix", *SEARCH_CODES, *BODY_CODES),
    },
)
async def find_matrix(
    sent: Annotated[MatrixRequest, Body(openapi_examples=MATRIX_REQUESTS)],
    request: Request,
    service: RunningService,
    searches: Searches,
    form: MatrixFormatAsked = None,
    accept: Accepted = JSON,
) -> Response:
    """Each entry is what `POST /route` answers for its source and target: by default the drive of least energy.

    Each drive departs with `soc`. A pair that can't be driven is an answer too: its figures are null, `reason` says
    why, and `deficit_kwh` how much charge is missing. A place that is not on the map is an error that names it, such
    as `sources[3]`.
    """
    found = await searches.run_parts(request, lambda: service.matrix_work(sent), len(sent.sources))
    chosen = form or accepted_format(accept, MATRIX_FORMATS)
    return await run_in_threadpool(lambda: answer_in(request, chosen, matrix_in(chosen, found), "matrix"))
