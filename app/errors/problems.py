"""Problem details (RFC 9457), and the table of all kinds."""

from __future__ import annotations

import json
import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from pydantic import JsonValue

from app.schemas.problem import ErrorCode, FieldProblem, Problem

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from app.schemas.places.named import PlaceOption


PROBLEM_TYPE: Final = "application/problem+json"
MAX_FIELDS: Final = 20
MAX_VALUE_CHARS: Final = 200


@dataclass(frozen=True, slots=True)
class ProblemKind:
    """Status and title of one error code."""

    status: int
    title: str


KINDS: Final[Mapping[ErrorCode, ProblemKind]] = {
    ErrorCode.INVALID_REQUEST: ProblemKind(422, "A field of the request is missing, unknown or out of range"),
    ErrorCode.MALFORMED_JSON: ProblemKind(422, "The request body can't be read as JSON"),
    ErrorCode.MALFORMED_FORM: ProblemKind(422, "The request body can't be read as a form with files"),
    ErrorCode.UNSUPPORTED_MEDIA_TYPE: ProblemKind(415, "The request body is of a kind that is not read"),
    ErrorCode.INVALID_VEHICLE: ProblemKind(422, "The vehicle's numbers contradict each other"),
    ErrorCode.INVALID_LINK: ProblemKind(422, "A link can't be driven, or not after the link before it"),
    ErrorCode.INVALID_CONDITIONS: ProblemKind(422, "The conditions do not go together, or not with this vehicle"),
    ErrorCode.ENERGY_GAIN: ProblemKind(422, "The chosen link model gains energy on a round trip"),
    ErrorCode.UNKNOWN_VEHICLE: ProblemKind(404, "No vehicle of that id"),
    ErrorCode.UNKNOWN_GRAPH: ProblemKind(404, "No graph of that name"),
    ErrorCode.GRAPH_DAMAGED: ProblemKind(409, "A stored graph can't be read"),
    ErrorCode.UNKNOWN_EFFECTS: ProblemKind(404, "No learned effects of that id"),
    ErrorCode.UNKNOWN_DIAGNOSIS: ProblemKind(404, "No diagnosis of that id"),
    ErrorCode.UNKNOWN_TRIP: ProblemKind(404, "No trip of that id in the diagnosis"),
    ErrorCode.DIAGNOSIS_NOT_DONE: ProblemKind(409, "Only a diagnosis that is done has this"),
    ErrorCode.DIAGNOSIS_DAMAGED: ProblemKind(409, "The stored diagnosis can't be read"),
    ErrorCode.UNUSABLE_RECORDINGS: ProblemKind(422, "None of the recordings can be used"),
    ErrorCode.DIAGNOSIS_FAILED: ProblemKind(422, "The recordings can't be diagnosed"),
    ErrorCode.DIAGNOSIS_INTERRUPTED: ProblemKind(503, "The diagnosis was interrupted"),
    ErrorCode.POINT_OUTSIDE_MAP: ProblemKind(404, "A place is outside the map"),
    ErrorCode.POINT_FAR_FROM_ROAD: ProblemKind(404, "A place is too far from any road"),
    ErrorCode.NO_PATH: ProblemKind(404, "No road leads to the goal"),
    ErrorCode.NO_PLACES: ProblemKind(404, "The graph has no index of places"),
    ErrorCode.UNKNOWN_PLACE: ProblemKind(422, "No place fits the text"),
    ErrorCode.AMBIGUOUS_PLACE: ProblemKind(422, "Several places fit the text"),
    ErrorCode.VEHICLE_IS_BUNDLED: ProblemKind(409, "A bundled vehicle can't be changed"),
    ErrorCode.VEHICLE_DAMAGED: ProblemKind(409, "The stored vehicle can't be read"),
    ErrorCode.NOT_FOUND: ProblemKind(404, "Nothing at this address"),
    ErrorCode.METHOD_NOT_ALLOWED: ProblemKind(405, "This address has no such method"),
    ErrorCode.BODY_TOO_LARGE: ProblemKind(413, "The request body is too large"),
    ErrorCode.REQUEST_TIMEOUT: ProblemKind(408, "The request arrives too slowly"),
    ErrorCode.UNAUTHORIZED: ProblemKind(401, "A key is needed, and none that is known was sent"),
    ErrorCode.FORBIDDEN: ProblemKind(403, "The key does not allow this"),
    ErrorCode.WRONG_ORIGIN: ProblemKind(403, "A page of another origin may not send this"),
    ErrorCode.UNKNOWN_HOST: ProblemKind(421, "The service is not known by this name"),
    ErrorCode.RATE_LIMITED: ProblemKind(429, "More was asked for than is allowed to one client"),
    ErrorCode.TOO_MANY_DIAGNOSES: ProblemKind(429, "Too many diagnoses are waiting"),
    ErrorCode.SEARCH_LIMIT: ProblemKind(503, "The search grew beyond its limit"),
    ErrorCode.TIME_LIMIT: ProblemKind(503, "The answer took longer than allowed"),
    ErrorCode.OVERLOADED: ProblemKind(503, "More is asked than can be answered in time"),
    ErrorCode.DATABASE_UNAVAILABLE: ProblemKind(503, "The vehicle database can't be reached or written"),
    ErrorCode.STORAGE_FULL: ProblemKind(507, "No space is left to store what was sent"),
    ErrorCode.NOT_READY: ProblemKind(503, "The service is starting"),
    ErrorCode.INTERNAL: ProblemKind(500, "A fault of the service"),
}


def make_problem(code: ErrorCode, detail: str, fields: list[FieldProblem], instance: str) -> Problem:
    """Problem details of one code."""
    kind = KINDS[code]
    return Problem(
        type=f"urn:joulepath:problem:{code.value}",
        title=kind.title,
        status=kind.status,
        detail=shortened(detail, 1000),
        instance=shortened(instance, MAX_VALUE_CHARS),
        code=code,
        errors=fields,
    )


def problem_bytes(problem: Problem) -> bytes:
    """A problem as JSON; refuses NaN and infinities, which JSON does not know."""
    return json.dumps(problem.model_dump(mode="python"), allow_nan=False).encode("ascii")


def field_problem(field: str, value: object, allowed: str, suggestions: Sequence[PlaceOption] = ()) -> FieldProblem:
    """One field that was wrong, its value in valid JSON and not too long."""
    allowed = shortened(allowed, 1000)
    return FieldProblem(field=field, value=_json_value(value), allowed=allowed, suggestions=list(suggestions))


def _json_value(value: object) -> JsonValue:
    """A value as sent, in valid JSON and not too long."""
    if value is None or isinstance(value, bool):
        return value
    if isinstance(value, float):
        return value if math.isfinite(value) else str(value)
    if isinstance(value, int):
        return value if abs(value) < 2**63 else "an integer beyond 64 bits"
    if isinstance(value, str):
        return shortened(value, MAX_VALUE_CHARS)
    if isinstance(value, dict) and len(value) <= 2 and all(isinstance(v, (int, float)) for v in value.values()):
        return {shortened(str(k), MAX_VALUE_CHARS): _json_value(v) for k, v in value.items()}
    if isinstance(value, dict):
        return "an object"
    if isinstance(value, (list, tuple)):
        plain = len(value) <= 8 and all(isinstance(v, (int, float, str)) for v in value)
        return [_json_value(v) for v in value] if plain else f"a list of {len(value)}"
    return shortened(str(value), MAX_VALUE_CHARS)


def shortened(text: str, limit: int) -> str:
    """At most so many characters, lone surrogates replaced."""
    text = text[: limit + 1].encode("utf-8", "replace").decode("utf-8")
    return text if len(text) <= limit else text[: limit - 1] + "…"
