"""Errors as Valhalla answers them: a number and text of its documentation, and what is wrong."""

from __future__ import annotations

from http import HTTPStatus
from typing import TYPE_CHECKING, Final

from app.http.faces.answering import FaceError, FaceProblem
from app.schemas.problem import ErrorCode

if TYPE_CHECKING:
    from collections.abc import Mapping

    from app.schemas.problem import Problem

TEXTS: Final[Mapping[int, str]] = {
    100: "Failed to parse json request",
    101: "Try a POST or GET request instead",
    106: "Try any of",
    107: "Not Implemented",
    110: "Insufficiently specified required parameter 'locations'",
    112: "Insufficiently specified required parameter 'locations' or 'sources & targets'",
    113: "Insufficiently specified required parameter 'contours'",
    114: "Insufficiently specified required parameter 'shape' or 'encoded_polyline'",
    120: "Insufficient number of locations provided",
    121: "Insufficient number of sources provided",
    122: "Insufficient number of targets provided",
    123: "Insufficient shape provided",
    124: "No edge/node costing provided",
    125: "No costing method found",
    130: "Failed to parse location",
    131: "Failed to parse source",
    132: "Failed to parse target",
    134: "Failed to parse shape",
    142: "Arrive by not implemented for isochrones",
    150: "Exceeded max locations",
    152: "Exceeded max contours",
    154: "Path distance exceeds the max distance limit",
    157: "Exceeded max avoid locations",
    162: "Date and time is invalid.  Format is YYYY-MM-DDTHH:MM",
    163: "Invalid date_type",
    164: "Invalid shape format",
    167: "Exceeded maximum circumference for exclude_polygons",
    171: "No suitable edges near location",
    199: "Unknown",
    313: "'resample_distance' must be >= ",
    314: "Too many shape points",
    442: "No path could be found for input",
}
STATUS: Final[Mapping[int, int]] = {101: 405, 106: 404}
NUMBERS: Final[Mapping[ErrorCode, int]] = {
    ErrorCode.POINT_OUTSIDE_MAP: 171,
    ErrorCode.POINT_FAR_FROM_ROAD: 171,
    ErrorCode.NO_PATH: 442,
    ErrorCode.UNKNOWN_VEHICLE: 125,
    ErrorCode.SEARCH_LIMIT: 154,
    ErrorCode.TIME_LIMIT: 154,
    ErrorCode.OVERLOADED: 199,
    ErrorCode.NOT_READY: 199,
    ErrorCode.DATABASE_UNAVAILABLE: 199,
}


class ValhallaError(FaceError):
    """A request that Valhalla would refuse, or that its face can't answer."""

    def __init__(self, number: int, detail: str = "") -> None:
        super().__init__(number, "", None, "", message=detail or TEXTS[number])


def valhalla_problem(problem: Problem, error: FaceError | None, path: str) -> FaceProblem:
    """An error in Valhalla's form, with status 400 unless it is the service that can't answer now."""
    number = NUMBERS.get(problem.code, 100) if error is None else int(error.kind)
    text = TEXTS[number]
    status = problem.status if problem.status >= 500 else STATUS.get(number, 400)
    return FaceProblem(
        status,
        {
            "error_code": number,
            "error": text if problem.detail == text else f"{text}: {problem.detail}",
            "status_code": status,
            "status": HTTPStatus(status).phrase,
        },
    )
