"""POST /simulate."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Body, Request, Response

from app.http.examples.answers import SIMULATE_ANSWER, SIMULATE_REQUESTS
from app.http.examples.problems import BODY_CODES, DRIVE_CODES, problems
from app.http.json_body import BoundedRoute
from app.http.routes.access import RunningService, Searches, long_answer
from app.schemas.problem import ErrorCode
from app.schemas.simulation import SimulateRequest, SimulateResponse

router = APIRouter(route_class=BoundedRoute, tags=["simulate"])


@router.post(
    "/simulate",
    summary="Energy and time of driving given links",
    response_model=SimulateResponse,
    responses={
        200: {"content": {"application/json": {"example": SIMULATE_ANSWER}}},
        **problems("/simulate", *DRIVE_CODES, *BODY_CODES, ErrorCode.INVALID_LINK),
    },
)
async def simulate(
    sent: Annotated[SimulateRequest, Body(openapi_examples=SIMULATE_REQUESTS)],
    request: Request,
    service: RunningService,
    searches: Searches,
) -> Response:
    """Drives consecutive links of a graph, such as those of a route, or a chain of links given by their numbers.

    The links of a route sent back unchanged take exactly the route's energy. `model` 'timestep' solves the equation of
    motion in steps of 0.1 s and brakes for what lies several links ahead; it needs the whole way in advance.
    """
    return await searches.run(request, lambda: long_answer(request, service.simulate_json(sent)))
