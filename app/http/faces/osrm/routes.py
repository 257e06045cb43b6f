"""The addresses of OSRM's HTTP interface, below /osrm."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any, Final, Literal
from urllib.parse import parse_qsl

from fastapi import APIRouter, Request, Response
from starlette.concurrency import run_in_threadpool

from app.http.admission import Cost
from app.http.faces.answering import face_route
from app.http.faces.osrm.asked import FORMATS, OsrmRequest, options_from_json, places_from
from app.http.faces.osrm.errors import OsrmCode, OsrmError, osrm_problem
from app.http.faces.osrm.nearest import asked_nearest, nearest_answer
from app.http.faces.osrm.route import asked_route, route_answer
from app.http.faces.osrm.table import asked_table, table_answer
from app.http.routes.access import RunningService, Searches, long_answer
from app.http.routes.route import likely_cost
from app.observation import Stage, stage
from app.schemas.as_json import as_json
from app.schemas.place import MAX_PLACES
from app.schemas.route import MAX_VIA

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from app.http.admission import Admission
    from app.service.service import Service

router = APIRouter(prefix="/osrm", route_class=face_route(osrm_problem), include_in_schema=False)

OsrmService = Literal["route", "table", "nearest"]
SERVICES: Final[tuple[OsrmService, ...]] = ("route", "table", "nearest")
ELSEWHERE: Final = ("match", "trip", "tile")  # of OSRM, not of this face
MOST: Final[Mapping[OsrmService, int]] = {"route": MAX_VIA + 2, "table": MAX_PLACES, "nearest": 1}
FORM: Final = "application/x-www-form-urlencoded"


def _add(name: OsrmService) -> None:
    """Add the addresses of one service, each by its own name, so that logs and metrics tell them apart."""

    async def answer_address(
        profile: str, coordinates: str, request: Request, service: RunningService, searches: Searches
    ) -> Response:
        text, _, form = coordinates.rpartition(".")
        options = dict(request.query_params)
        if form in FORMATS:
            coordinates, options = text, {"format": form} | options
        asked = OsrmRequest(profile, places_from(coordinates, MOST[name]), options)
        return await _answered(name, asked, request, service, searches)

    async def answer_body(profile: str, request: Request, service: RunningService, searches: Searches) -> Response:
        options, own = await _body(request)
        coordinates = options.pop("coordinates", "")
        asked = OsrmRequest(profile, places_from(coordinates, MOST[name]), dict(request.query_params) | options, own)
        return await _answered(name, asked, request, service, searches)

    router.add_api_route(f"/{name}/v1/{{profile}}/{{coordinates:path}}", answer_address, methods=["GET"])
    router.add_api_route(f"/{name}/v1/{{profile}}", answer_body, methods=["POST"])


for _name in SERVICES:
    _add(_name)


@router.api_route("/{rest:path}", methods=["GET", "HEAD", "POST", "PUT", "DELETE", "PATCH"])
async def answer_nothing(rest: str) -> Response:
    """What any other address is answered with."""
    kind, _, further = rest.partition("/")
    version = further.partition("/")[0]
    if kind in ELSEWHERE:
        raise OsrmError(OsrmCode.NOT_IMPLEMENTED, "service", kind, f"one of {', '.join(SERVICES)}")
    if kind not in SERVICES and further:
        raise OsrmError(OsrmCode.INVALID_SERVICE, "service", kind[:200], f"one of {', '.join(SERVICES)}")
    if kind in SERVICES and version not in ("", "v1"):
        raise OsrmError(OsrmCode.INVALID_VERSION, "version", version[:200], "v1")
    raise OsrmError(OsrmCode.INVALID_URL, "the address", rest[:200], "/osrm/SERVICE/v1/PROFILE/COORDINATES")


async def _body(request: Request) -> tuple[dict[str, str], Any]:
    """Options of a body, a JSON object or a form as Mapbox's clients send it, and the object `ev`."""
    if request.headers.get("Content-Type", "").partition(";")[0].strip().lower() == FORM:
        body = await request.body()
        return dict(parse_qsl(body.decode("utf-8", "replace"), keep_blank_values=True)), None
    try:
        sent = await request.json()
    except (ValueError, RecursionError) as error:
        raise OsrmError(OsrmCode.INVALID_QUERY, "the body", "unreadable", "JSON") from error
    return options_from_json(sent), sent.get("ev")


async def _answered(
    name: OsrmService, asked: OsrmRequest, request: Request, service: Service, searches: Admission
) -> Response:
    electric = asked.electric(service.settings.faces_soc)
    if name == "route":
        sent = asked_route(asked, electric)
        cost = likely_cost(sent)
        return await searches.run(
            request, lambda: _written(request, partial(route_answer, asked, service.found_routes(sent))), cost
        )
    if name == "table":
        matrix = asked_table(asked, electric)
        most = service.settings.matrix_limit_places
        if max(len(matrix.sources), len(matrix.targets or ())) > most:
            raise OsrmError(OsrmCode.TOO_BIG, "coordinates", f"more than {most}", f"at most {most} each way")
        found = await searches.run_parts(request, lambda: service.matrix_work(matrix), len(matrix.sources))
        return await run_in_threadpool(lambda: _written(request, partial(table_answer, asked, found)))
    number = asked_nearest(asked)
    return await searches.run(
        request, lambda: _written(request, partial(nearest_answer, asked, electric, number, service)), Cost.SHORT
    )


def _written(request: Request, answer: Callable[[], dict[str, object]]) -> Response:
    with stage(Stage.WRITE):
        body = as_json(answer())
    return long_answer(request, body)
