"""The addresses of openrouteservice's second version, below /ors/v2."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any, Final

from fastapi import APIRouter, Request, Response
from starlette.concurrency import run_in_threadpool

from app.http.admission import Cost
from app.http.faces.answering import face_route, number_from, read
from app.http.faces.electric import OWN_PARAMETERS, ElectricParameters
from app.http.faces.ors.asked import DirectionsBody, IsochronesBody, MatrixBody, body_from
from app.http.faces.ors.directions import asked_directions, directions_geojson, directions_gpx, directions_json
from app.http.faces.ors.errors import UNKNOWN_PARAMETER, OrsError, OrsKind, OrsService, info, ors_problem, service_of
from app.http.faces.ors.isochrones import asked_isochrones, isochrones_geojson
from app.http.faces.ors.matrix import asked_matrix, matrix_json
from app.http.routes.access import GEOJSON, JSON, RunningService, Searches, long_answer
from app.http.routes.route import likely_cost
from app.observation import Stage, stage
from app.schemas.as_json import as_json

if TYPE_CHECKING:
    from collections.abc import Callable

    from app.http.admission import Admission
    from app.service.found import FoundRoutes
    from app.service.service import Service

router = APIRouter(prefix="/ors/v2", route_class=face_route(ors_problem), include_in_schema=False)

GPX: Final = "application/gpx+xml;charset=UTF-8"
GEO: Final = f"{GEOJSON};charset=UTF-8"
ADDRESSED: Final = frozenset({"start", "end", "api_key"})


@dataclass(frozen=True, slots=True)
class Form:
    """A form of directions: how it is written, and its media type."""

    write: Callable[[DirectionsBody, FoundRoutes, str], Any]
    media_type: str


FORMS: Final = {
    "json": Form(directions_json, JSON),
    "geojson": Form(directions_geojson, GEO),
    "gpx": Form(directions_gpx, GPX),
}


@router.get("/health")
async def answer_health(service: RunningService) -> dict[str, str]:
    """Whether the service answers."""
    return {"status": "ready"}


@router.get("/status")
async def answer_status(service: RunningService) -> dict[str, Any]:
    """Languages, services and the profile that is always there."""
    return {
        "languages": ["en"],
        "services": ["routing", "isochrones", "matrix"],
        "profiles": {"driving-car": {"profiles": "driving-car"}, "ev": {"profiles": "ev:VEHICLE@CHARGE"}},
        **info(),
    }


@router.get("/directions/{profile}")
async def answer_address(profile: str, request: Request, service: RunningService, searches: Searches) -> Response:
    """A route from start to end of the address, as GeoJSON."""
    sent: dict[str, Any] = {}
    own = {}
    for name, value in request.query_params.items():
        if name in OWN_PARAMETERS:
            own[name] = value
        elif name not in ADDRESSED:
            number = UNKNOWN_PARAMETER[OrsService.DIRECTIONS]
            raise OrsError(number, f"Unknown parameter '{name[:200]}'.")
    places = []
    for name in ("start", "end"):
        text = request.query_params.get(name)
        if text is None:
            raise OrsError(OrsService.DIRECTIONS + OrsKind.MISSING, f"Parameter '{name}' is missing.")
        place = [number_from(part.strip()) for part in text.split(",", 2)]
        if len(place) != 2 or None in place:
            raise OrsError(
                OrsService.DIRECTIONS + OrsKind.FORMAT, f"Parameter '{name}' is not longitude,latitude: '{text[:200]}'."
            )
        places.append(place)
    sent["coordinates"] = places
    if own:
        sent["ev"] = read(ElectricParameters, own).long_form()
    return await _directions(sent, profile, "geojson", request, service, searches)


@router.post("/directions/{profile}")
async def answer_directions(profile: str, request: Request, service: RunningService, searches: Searches) -> Response:
    """Routes of a body, as JSON."""
    return await _directions(await _body(request), profile, "json", request, service, searches)


@router.post("/directions/{profile}/{form}")
async def answer_directions_in(
    profile: str, form: str, request: Request, service: RunningService, searches: Searches
) -> Response:
    """Routes of a body in a form."""
    return await _directions(await _body(request), profile, form, request, service, searches)


@router.post("/isochrones/{profile}")
@router.post("/isochrones/{profile}/geojson")
async def answer_isochrones(profile: str, request: Request, service: RunningService, searches: Searches) -> Response:
    """Areas of a body, as GeoJSON."""
    asked = body_from(IsochronesBody, await _body(request), OrsService.ISOCHRONES)
    electric = asked.electric(profile, service.settings.faces_soc, OrsService.ISOCHRONES)
    sent = asked_isochrones(asked, electric)
    cost = Cost.MIDDLE if len(sent) == 1 else Cost.LONG

    def answer() -> Response:
        found = [service.range(ranged) for ranged in sent]
        return _written(request, partial(isochrones_geojson, asked, found, profile), GEO)

    return await searches.run(request, answer, cost)


@router.post("/matrix/{profile}")
@router.post("/matrix/{profile}/json")
async def answer_matrix(profile: str, request: Request, service: RunningService, searches: Searches) -> Response:
    """A matrix of a body, as JSON."""
    asked = body_from(MatrixBody, await _body(request), OrsService.MATRIX)
    sent = asked_matrix(asked, asked.electric(profile, service.settings.faces_soc, OrsService.MATRIX))
    most = service.settings.matrix_limit_places
    if max(len(sent.sources), len(sent.targets or ())) > most:
        number = OrsService.MATRIX + OrsKind.LIMIT
        raise OrsError(number, f"Search exceeds the limit of {most} sources, and as many destinations.")
    found = await searches.run_parts(request, lambda: service.matrix_work(sent), len(sent.sources))
    return await run_in_threadpool(lambda: _written(request, partial(matrix_json, asked, found, profile), JSON))


@router.api_route("/{rest:path}", methods=["GET", "HEAD", "POST", "PUT", "DELETE", "PATCH"])
async def answer_nothing(rest: str) -> Response:
    """What any other address is answered with."""
    raise OrsError(404, f"Nothing at this address: '{rest[:200]}'.")


async def _body(request: Request) -> Any:
    try:
        return await request.json()
    except (ValueError, RecursionError) as error:
        raise OrsError(service_of(request.scope["path"]) + OrsKind.INVALID_JSON, "Unable to parse JSON.") from error


async def _directions(
    sent: Any, profile: str, form: str, request: Request, service: Service, searches: Admission
) -> Response:
    chosen = FORMS.get(form)
    if chosen is None:
        number = OrsService.DIRECTIONS + OrsKind.EXPORT_FORMAT
        raise OrsError(number, f"Unsupported export format '{form[:200]}': {', '.join(FORMS)}.")
    asked = body_from(DirectionsBody, sent, OrsService.DIRECTIONS).model_copy(update={"format": form})
    route = asked_directions(asked, asked.electric(profile, service.settings.faces_soc, OrsService.DIRECTIONS))
    cost = likely_cost(route)

    def answer() -> Response:
        found = service.found_routes(route)
        return _written(request, partial(chosen.write, asked, found, profile), chosen.media_type)

    return await searches.run(request, answer, cost)


def _written(request: Request, answer: Callable[[], Any], media_type: str) -> Response:
    with stage(Stage.WRITE):
        written = answer()
        body = written.encode() if isinstance(written, str) else as_json(written)
    return long_answer(request, body, media_type)
