"""GET /graphs/{name}/stations."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Header, Path, Query, Request, Response

from app.http.examples.answers import STATIONS
from app.http.examples.problems import problems
from app.http.routes.access import GEOJSON, GeoJSONResponse, RunningService, has_tag, long_answer
from app.schemas.problem import ErrorCode
from app.stations.answer import StationCollection
from app.stations.parameters import StationParameters

router = APIRouter(tags=["graphs"], default_response_class=GeoJSONResponse)


@router.get(
    "/graphs/{name}/stations",
    summary="The charging stations of a graph, as GeoJSON",
    response_model=StationCollection,
    responses={
        200: {"content": {GEOJSON: {"example": STATIONS}}},
        304: {"description": "The caller has this answer"},
        **problems(
            "/graphs/atlantis/stations",
            ErrorCode.UNKNOWN_GRAPH,
            ErrorCode.GRAPH_DAMAGED,
            ErrorCode.INVALID_REQUEST,
            ErrorCode.NOT_READY,
        ),
    },
)
def list_stations(
    name: Annotated[str, Path(max_length=200, description="graph name", examples=["highlands"])],
    sent: Annotated[StationParameters, Query()],
    request: Request,
    service: RunningService,
    if_none_match: Annotated[
        str | None, Header(alias="If-None-Match", description="tags of answers that the caller has")
    ] = None,
) -> Response:
    """Stations by place, plug, power, network, access and opening hours, page by page, with their sources.

    A graph without stations has none: an empty answer, no error.
    """
    prefix = str(request.scope.get("root_path", "")).rstrip("/")
    found = service.stations(name)
    takes_gzip = "gzip" in request.headers.get("Accept-Encoding", "")
    tag = f'"{found.tag(sent)}{"-gzip" if takes_gzip else ""}"'
    headers = {"ETag": tag, "Cache-Control": "no-cache", "Vary": "Accept-Encoding"}
    if has_tag(if_none_match, tag):
        return Response(status_code=304, headers=headers)
    answered = long_answer(request, found.json(sent, prefix), GEOJSON)
    answered.headers.update(headers)
    return answered
