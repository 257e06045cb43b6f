"""The addresses of Valhalla's HTTP interface, below /valhalla."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any, Final

from fastapi import APIRouter, Request, Response
from starlette.concurrency import run_in_threadpool

from app import VERSION
from app.http.admission import Cost
from app.http.faces.answering import face_route
from app.http.faces.valhalla.asked import ValhallaRequest
from app.http.faces.valhalla.errors import ValhallaError, valhalla_problem
from app.http.faces.valhalla.isochrone import asked_isochrone, isochrone_answer
from app.http.faces.valhalla.matrix import asked_matrix, matrix_answer
from app.http.faces.valhalla.places import height_answer, locate_answer
from app.http.faces.valhalla.trip import asked_trip, trip_answer
from app.http.json_body import read_json
from app.http.routes.access import JSON, RunningService, Searches, long_answer
from app.http.routes.route import likely_cost
from app.observation import Stage, stage
from app.schemas.as_json import as_json

if TYPE_CHECKING:
    from collections.abc import Callable

router = APIRouter(prefix="/valhalla", route_class=face_route(valhalla_problem), include_in_schema=False)

ACTIONS: Final = ("route", "isochrone", "sources_to_targets", "height", "locate", "status")
BOTH: Final = ["GET", "POST"]
NO_COSTING: Final = {"costing": "auto"}  # of what Valhalla asks for none


@router.api_route("/route", methods=BOTH)
async def answer_route(request: Request, service: RunningService, searches: Searches) -> Response:
    """A trip, and alternates."""
    asked = await _asked(request)
    sent = asked_trip(asked, asked.electric(service.settings.faces_soc))
    cost = likely_cost(sent)
    return await searches.run(
        request, lambda: _written(request, partial(trip_answer, asked, service.found_routes(sent))), cost
    )


@router.api_route("/isochrone", methods=BOTH)
async def answer_isochrone(request: Request, service: RunningService, searches: Searches) -> Response:
    """Areas in reach."""
    asked = await _asked(request)
    sent = asked_isochrone(asked, asked.electric(service.settings.faces_soc))

    def answer() -> Response:
        found = [service.range(ranged) for ranged in sent]
        return _written(request, partial(isochrone_answer, asked, found))

    return await searches.run(request, answer, Cost.MIDDLE if len(sent) == 1 else Cost.LONG)


@router.api_route("/sources_to_targets", methods=BOTH)
async def answer_matrix(request: Request, service: RunningService, searches: Searches) -> Response:
    """A matrix."""
    asked = await _asked(request)
    electric = asked.electric(service.settings.faces_soc)
    sent = asked_matrix(asked, electric, service.settings.matrix_limit_places)
    found = await searches.run_parts(request, lambda: service.matrix_work(sent), len(sent.sources))
    return await run_in_threadpool(lambda: _written(request, partial(matrix_answer, asked, found)))


@router.api_route("/height", methods=BOTH)
async def answer_height(request: Request, service: RunningService, searches: Searches) -> Response:
    """Heights along a shape."""
    asked = await _asked(request, NO_COSTING)
    electric = asked.electric(service.settings.faces_soc)
    return await searches.run(
        request, lambda: _written(request, partial(height_answer, asked, electric, service)), Cost.SHORT
    )


@router.api_route("/locate", methods=BOTH)
async def answer_locate(request: Request, service: RunningService, searches: Searches) -> Response:
    """Roads near places."""
    asked = await _asked(request, NO_COSTING)
    electric = asked.electric(service.settings.faces_soc)
    return await searches.run(
        request, lambda: _written(request, partial(locate_answer, asked, electric, service)), Cost.SHORT
    )


@router.api_route("/status", methods=BOTH)
async def answer_status(service: RunningService) -> dict[str, Any]:
    """That the service answers, and what it can be asked."""
    return {"version": VERSION, "has_tiles": True, "has_live_traffic": False, "available_actions": ACTIONS}


@router.api_route("/{rest:path}", methods=["GET", "HEAD", "POST", "PUT", "DELETE", "PATCH"])
async def answer_nothing(rest: str) -> Response:
    """What any other address is answered with."""
    if rest in ACTIONS:
        raise ValhallaError(101)
    raise ValhallaError(106, " ".join(f"'/{action}'" for action in ACTIONS))


async def _asked(request: Request, defaults: dict[str, Any] | None = None) -> ValhallaRequest:
    """What a body asks for, or the parameter `json` of the address."""
    body = await request.body() if request.method == "POST" else b""
    if not body:
        body = request.query_params.get("json", "").encode()
    try:
        sent = await read_json(body)
    except (ValueError, RecursionError) as error:
        raise ValhallaError(100) from error
    if not isinstance(sent, dict):
        raise ValhallaError(100, "an object")
    named = request.query_params.get("id")
    return ValhallaRequest({**(defaults or {}), **({} if named is None else {"id": named}), **sent})


def _written(request: Request, answer: Callable[[], Any]) -> Response:
    with stage(Stage.WRITE):
        body = as_json(answer())
    return long_answer(request, body, JSON)
