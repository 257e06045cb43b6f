"""Errors as openrouteservice answers them: a number that begins with that of its service, and a message."""

from __future__ import annotations

import time
from enum import IntEnum
from typing import TYPE_CHECKING, Any, Final

from app import VERSION
from app.http.faces.answering import FaceError, FaceProblem
from app.schemas.problem import ErrorCode

if TYPE_CHECKING:
    from collections.abc import Mapping

    from app.schemas.problem import Problem


class OrsService(IntEnum):
    """Services by the thousands of their error numbers."""

    DIRECTIONS = 2000
    ISOCHRONES = 3000
    MATRIX = 6000


class OrsKind(IntEnum):
    """What is wrong, by the numbers that all services share."""

    INVALID_JSON = 0
    MISSING = 1
    FORMAT = 2
    VALUE = 3
    LIMIT = 4
    EXPORT_FORMAT = 7
    UNKNOWN = 99


UNSUPPORTED: Final[Mapping[OrsService, int]] = {OrsService.DIRECTIONS: 2018, OrsService.ISOCHRONES: 3005}
UNKNOWN_PARAMETER: Final[Mapping[OrsService, int]] = {
    OrsService.DIRECTIONS: 2012,
    OrsService.ISOCHRONES: 3011,
    OrsService.MATRIX: 6011,
}
ROUTE_NOT_FOUND: Final = 2009
POINT_NOT_FOUND: Final[Mapping[OrsService, int]] = {OrsService.DIRECTIONS: 2010, OrsService.MATRIX: 6010}
MOST_NODES: Final[Mapping[OrsService, int]] = {OrsService.DIRECTIONS: 2004, OrsService.MATRIX: 6020}
NOT_FOUND: Final = frozenset({404, ROUTE_NOT_FOUND, *POINT_NOT_FOUND.values()})
PLACES: Final = frozenset({ErrorCode.POINT_OUTSIDE_MAP, ErrorCode.POINT_FAR_FROM_ROAD})
SEARCHES: Final = frozenset({ErrorCode.SEARCH_LIMIT, ErrorCode.TIME_LIMIT, ErrorCode.OVERLOADED})
UNANSWERED: Final = frozenset({ErrorCode.NOT_READY, ErrorCode.DATABASE_UNAVAILABLE, ErrorCode.GRAPH_DAMAGED})


class OrsError(FaceError):
    """A request that openrouteservice would refuse, or that its face can't answer."""

    def __init__(self, number: int, message: str) -> None:
        super().__init__(number, "", None, "", message=message)


def unsupported(service: OrsService, field: str) -> OrsError:
    """The error of a field that can't be heeded."""
    number = UNSUPPORTED.get(service, service + OrsKind.VALUE)
    return OrsError(number, f"'{field}' is not supported here.")


def ors_problem(problem: Problem, error: FaceError | None, path: str) -> FaceProblem:
    """An error in openrouteservice's form: 404 for what is not found, 503 for what can't be answered now, else 400."""
    service = service_of(path)
    if error is not None:
        number = int(error.kind)
        status = 404 if number in NOT_FOUND else 400
    elif problem.code in PLACES:
        number, status = POINT_NOT_FOUND.get(service, service + OrsKind.VALUE), 404
    elif problem.code is ErrorCode.NO_PATH:
        number, status = ROUTE_NOT_FOUND, 404
    elif problem.code in SEARCHES:
        number, status = MOST_NODES.get(service, service + OrsKind.LIMIT), problem.status
    elif problem.code in UNANSWERED:
        number, status = service + OrsKind.UNKNOWN, problem.status
    else:
        number, status = service + OrsKind.VALUE, 400
    return FaceProblem(status, {"error": {"code": number, "message": problem.detail}, "info": info()})


def service_of(path: str) -> OrsService:
    """The service that an address is of."""
    for name, service in (("/isochrones", OrsService.ISOCHRONES), ("/matrix", OrsService.MATRIX)):
        if path.startswith(name, path.find("/ors/v2") + len("/ors/v2")):
            return service
    return OrsService.DIRECTIONS


def info() -> dict[str, Any]:
    """What stands in each answer of its engine and time."""
    return {"engine": {"version": VERSION, "build_date": None}, "timestamp": round(time.time() * 1000.0)}


def metadata(
    asked_id: str | int | None, service: str, query: dict[str, Any], profile: str, attribution: str
) -> dict[str, Any]:
    """What an answer says of its request, of whose data it is, and of its engine."""
    written: dict[str, Any] = {} if asked_id is None else {"id": str(asked_id)}
    return {**written, "attribution": attribution, "service": service, "query": {**query, "profile": profile}, **info()}
