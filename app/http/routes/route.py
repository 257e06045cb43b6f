"""POST /route."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Body, Request, Response

from app.http.admission import Cost
from app.http.examples.answers import (
    CHARGING_ANSWER,
    NO_PLAN_ANSWER,
    ROUTE_ANSWER,
    ROUTE_FEATURES,
    ROUTE_REQUESTS,
    STEPS_ANSWER,
)
from app.http.examples.problems import BODY_CODES, SEARCH_CODES, TEXT_CODES, problems
from app.http.json_body import BoundedRoute
from app.http.routes.access import GEOJSON, JSON, RunningService, Searches, answer_in
from app.http.routes.formats import Accepted, RouteFormatAsked, file_contents
from app.schemas.lean.formats import ROUTE_FORMATS, accepted_format
from app.schemas.problem import ErrorCode
from app.schemas.route import RouteRequest, RouteResponse

router = APIRouter(route_class=BoundedRoute, tags=["route"])


@router.post(
    "/route",
    summary="Energy-optimal routes with the state of charge at every link, and charging stops where asked for",
    response_model=RouteResponse,
    responses={
        200: {
            "content": {
                "application/json": {
                    "examples": {
                        "eco": {"summary": "Least energy", "value": ROUTE_ANSWER},
                        "charging": {"summary": "With charging stops", "value": CHARGING_ANSWER},
                        "no plan": {"summary": "Without a plan, and what would help", "value": NO_PLAN_ANSWER},
                        "steps": {"summary": "Between named places, with steps", "value": STEPS_ANSWER},
                    }
                },
                GEOJSON: {
                    "schema": {"$ref": "#/components/schemas/RouteFeatureCollection"},
                    "example": ROUTE_FEATURES,
                },
                **file_contents(ROUTE_FORMATS),
            }
        },
        **problems("/route", *SEARCH_CODES, *BODY_CODES, *TEXT_CODES, ErrorCode.NO_PATH),
    },
)
async def find_route(
    sent: Annotated[RouteRequest, Body(openapi_examples=ROUTE_REQUESTS)],
    request: Request,
    service: RunningService,
    searches: Searches,
    form: RouteFormatAsked = None,
    accept: Accepted = JSON,
) -> Response:
    """One route for each weighting, by default the one that takes the least energy, or a Pareto set of time and energy.

    A goal that can't be reached on this charge is an answer too: `feasible` is false, `deficit_kwh` says how much is
    missing, `furthest` where, and `remedy` what would make it feasible. With `charging`, stops are planned that make it
    reachable: one route for each plan, or `no_plan` with what would help, by kind and value.
    """
    chosen = form or accepted_format(accept, ROUTE_FORMATS)
    return await searches.run(
        request, lambda: answer_in(request, chosen, service.route_in(chosen, sent), "route"), likely_cost(sent)
    )


def likely_cost(sent: RouteRequest) -> Cost:
    """How long a request is likely to take."""
    if sent.pareto is not None or sent.charging is not None:
        return Cost.LONG
    # a graph that the vehicle has not met under these conditions is made ready first
    known = isinstance(sent.vehicle, str | None) and sent.conditions is None and sent.effects is None
    return Cost.SHORT if known else Cost.MIDDLE
