"""Errors as OSRM answers them: a code of its documentation, and a message."""

from __future__ import annotations

from enum import StrEnum
from typing import TYPE_CHECKING, Final

from app.http.faces.answering import FaceError, FaceProblem
from app.schemas.problem import ErrorCode

if TYPE_CHECKING:
    from collections.abc import Mapping

    from app.schemas.problem import Problem


class OsrmCode(StrEnum):
    """Codes of OSRM's documentation of its HTTP interface."""

    INVALID_URL = "InvalidUrl"
    INVALID_SERVICE = "InvalidService"
    INVALID_VERSION = "InvalidVersion"
    INVALID_OPTIONS = "InvalidOptions"
    INVALID_QUERY = "InvalidQuery"
    INVALID_VALUE = "InvalidValue"
    NO_SEGMENT = "NoSegment"
    TOO_BIG = "TooBig"
    DISABLED_DATASET = "DisabledDataset"
    NO_ROUTE = "NoRoute"
    NO_TABLE = "NoTable"
    NOT_IMPLEMENTED = "NotImplemented"


CODES: Final[Mapping[ErrorCode, OsrmCode]] = {
    ErrorCode.POINT_OUTSIDE_MAP: OsrmCode.NO_SEGMENT,
    ErrorCode.POINT_FAR_FROM_ROAD: OsrmCode.NO_SEGMENT,
    ErrorCode.NO_PATH: OsrmCode.NO_ROUTE,
    ErrorCode.GRAPH_DAMAGED: OsrmCode.DISABLED_DATASET,
    ErrorCode.MALFORMED_JSON: OsrmCode.INVALID_QUERY,
    ErrorCode.SEARCH_LIMIT: OsrmCode.TOO_BIG,
    ErrorCode.TIME_LIMIT: OsrmCode.TOO_BIG,
    ErrorCode.OVERLOADED: OsrmCode.TOO_BIG,
    ErrorCode.NOT_READY: OsrmCode.DISABLED_DATASET,
    ErrorCode.DATABASE_UNAVAILABLE: OsrmCode.DISABLED_DATASET,
    ErrorCode.NOT_FOUND: OsrmCode.INVALID_URL,
    ErrorCode.METHOD_NOT_ALLOWED: OsrmCode.INVALID_URL,
}


class OsrmError(FaceError):
    """A request that OSRM would refuse, or that its face can't answer."""

    def __init__(self, kind: OsrmCode, field: str, value: object, allowed: str) -> None:
        super().__init__(kind.value, field, value, allowed)


def osrm_problem(problem: Problem, error: FaceError | None, path: str) -> FaceProblem:
    """An error in OSRM's form, with status 400 unless it is the service that can't answer now."""
    kind = CODES.get(problem.code, OsrmCode.INVALID_VALUE).value if error is None else str(error.kind)
    return FaceProblem(problem.status if problem.status >= 500 else 400, {"code": kind, "message": problem.detail})
