"""Errors of every package as HTTP problems (RFC 9457); the only place that knows a status."""

from __future__ import annotations

import json
import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

from fastapi import FastAPI, Request, Response
from fastapi.exceptions import RequestValidationError
from pydantic import JsonValue, ValidationError
from starlette.exceptions import HTTPException

from app.conversions.simulation import ChainLinkError
from app.errors.diagnosing import (
    DiagnosisInterruptedError,
    DiagnosisNotDoneError,
    MalformedFormError,
    SourceError,
    TooManyDiagnosesError,
    UnsupportedMediaTypeError,
    UnusableRecordingsError,
)
from app.schemas.learned_effects import EFFECTS_BRANCH, EFFECTS_ID_BRANCH
from app.schemas.problem import ErrorCode, FieldProblem, Problem
from app.schemas.vehicle import ID_BRANCH, PHYSICAL_BRANCH, TABLE_BRANCH
from app.store.errors import (
    DatabaseUnavailableError,
    DiagnosisDamagedError,
    DiagnosisNotFoundError,
    EffectsNotFoundError,
    TripNotFoundError,
    VehicleDamagedError,
    VehicleIsBundledError,
)
from app.tiles.errors import HeightsAbsentError, TileOutOfRangeError
from diagnosis.errors import DiagnosisError
from diagnosis.holdout import HoldoutError
from energy.errors import ConditionsError, LinkError, VehicleError, VehicleNotFoundError
from routing.errors import (
    GraphNotFoundError,
    NegativeCycleError,
    NoPathError,
    PointFarFromRoadError,
    PointOutsideMapError,
    QueryError,
    SearchLimitError,
)

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

PROBLEM_TYPE: Final = "application/problem+json"
MAX_FIELDS: Final = 20
MAX_VALUE_CHARS: Final = 200


class TimeLimitError(Exception):
    """No answer within the time allowed."""

    def __init__(self, limit_s: float) -> None:
        self.limit_s = limit_s
        super().__init__(
            f"no answer within {limit_s:g} s; ask for a shorter route, less charge, fewer alternatives or places"
        )


class NotReadyError(Exception):
    """Graphs are not loaded yet."""

    def __init__(self) -> None:
        super().__init__("graphs are being loaded and kernels compiled; try again in a moment")


class BodyTooLargeError(Exception):
    """A request body above the limit."""

    def __init__(self, limit_bytes: int) -> None:
        self.limit_bytes = limit_bytes
        super().__init__(f"the request body is too large, allowed: at most {limit_bytes} bytes")


@dataclass(frozen=True, slots=True)
class Kind:
    """Status and title of one error code."""

    status: int
    title: str


KINDS: Final[Mapping[ErrorCode, Kind]] = {
    ErrorCode.INVALID_REQUEST: Kind(422, "A field of the request is missing, unknown or out of range"),
    ErrorCode.MALFORMED_JSON: Kind(422, "The request body can't be read as JSON"),
    ErrorCode.MALFORMED_FORM: Kind(422, "The request body can't be read as a form with files"),
    ErrorCode.UNSUPPORTED_MEDIA_TYPE: Kind(415, "The request body is of a kind that is not read"),
    ErrorCode.INVALID_VEHICLE: Kind(422, "The vehicle's numbers contradict each other"),
    ErrorCode.INVALID_LINK: Kind(422, "A link can't be driven, or not after the link before it"),
    ErrorCode.INVALID_CONDITIONS: Kind(422, "The conditions do not go together, or not with this vehicle"),
    ErrorCode.ENERGY_GAIN: Kind(422, "The chosen link model gains energy on a round trip"),
    ErrorCode.UNKNOWN_VEHICLE: Kind(404, "No vehicle of that id"),
    ErrorCode.UNKNOWN_GRAPH: Kind(404, "No graph of that name"),
    ErrorCode.UNKNOWN_EFFECTS: Kind(404, "No learned effects of that id"),
    ErrorCode.UNKNOWN_DIAGNOSIS: Kind(404, "No diagnosis of that id"),
    ErrorCode.UNKNOWN_TRIP: Kind(404, "No trip of that id in the diagnosis"),
    ErrorCode.DIAGNOSIS_NOT_DONE: Kind(409, "Only a diagnosis that is done has this"),
    ErrorCode.DIAGNOSIS_DAMAGED: Kind(409, "The stored diagnosis can't be read"),
    ErrorCode.UNUSABLE_RECORDINGS: Kind(422, "None of the recordings can be used"),
    ErrorCode.DIAGNOSIS_FAILED: Kind(422, "The recordings can't be diagnosed"),
    ErrorCode.DIAGNOSIS_INTERRUPTED: Kind(503, "The diagnosis was interrupted"),
    ErrorCode.POINT_OUTSIDE_MAP: Kind(404, "A place is outside the map"),
    ErrorCode.POINT_FAR_FROM_ROAD: Kind(404, "A place is too far from any road"),
    ErrorCode.NO_PATH: Kind(404, "No road leads to the goal"),
    ErrorCode.VEHICLE_IS_BUNDLED: Kind(409, "A bundled vehicle can't be changed"),
    ErrorCode.VEHICLE_DAMAGED: Kind(409, "The stored vehicle can't be read"),
    ErrorCode.NOT_FOUND: Kind(404, "Nothing at this address"),
    ErrorCode.METHOD_NOT_ALLOWED: Kind(405, "This address has no such method"),
    ErrorCode.BODY_TOO_LARGE: Kind(413, "The request body is too large"),
    ErrorCode.TOO_MANY_DIAGNOSES: Kind(429, "Too many diagnoses are waiting"),
    ErrorCode.SEARCH_LIMIT: Kind(503, "The search grew beyond its limit"),
    ErrorCode.TIME_LIMIT: Kind(503, "The answer took longer than allowed"),
    ErrorCode.DATABASE_UNAVAILABLE: Kind(503, "The vehicle database can't be reached or written"),
    ErrorCode.NOT_READY: Kind(503, "The service is starting"),
    ErrorCode.INTERNAL: Kind(500, "A fault of the service"),
}

# names inside, on the left, are those of queries in SI units; on the right, those of requests
REQUEST_FIELDS: Final[Mapping[str, str]] = {
    "soc_frac": "soc",
    "reserve_soc_frac": "reserve_soc",
    "bands_soc_frac": "bands",
    "stop_rule": "stops",
    "weightings": "weights",
}


def _vehicle_fields(error: VehicleError) -> list[FieldProblem]:
    # one with an id is the body itself, one without is a part of a request
    name = error.field if error.vehicle_id else f"vehicle.{error.field}"
    return [_field(name, error.value, error.allowed)]


def _unknown_vehicle_fields(error: VehicleNotFoundError) -> list[FieldProblem]:
    return [_field("vehicle", error.vehicle_id, "one of " + ", ".join(error.known))]


def _bundled_fields(error: VehicleIsBundledError) -> list[FieldProblem]:
    return [_field("id", error.vehicle_id, "the id of no bundled vehicle")]


def _damaged_fields(error: VehicleDamagedError) -> list[FieldProblem]:
    return [_field("vehicle", error.vehicle_id, "a stored vehicle that can be read")]


def _named_fields(error: ConditionsError | SourceError | HoldoutError) -> list[FieldProblem]:
    return [_field(error.field, error.value, error.allowed)]


def _link_fields(error: LinkError) -> list[FieldProblem]:
    return [_field(f"links[{error.position}].{error.field}", error.value, error.allowed)]


def _chain_link_fields(error: ChainLinkError) -> list[FieldProblem]:
    return [_field(f"chain[{error.position}].{error.field}", error.value, error.allowed)]


def _unknown_graph_fields(error: GraphNotFoundError) -> list[FieldProblem]:
    return [_field("graph", error.name, "one of " + ", ".join(error.known))]


def _outside_fields(error: PointOutsideMapError) -> list[FieldProblem]:
    west, south, east, north = error.bbox
    allowed = f"lat {south:g}..{north:g}, lon {west:g}..{east:g}"
    return [_field(error.field, {"lat": error.lat, "lon": error.lon}, allowed)]


def _far_fields(error: PointFarFromRoadError) -> list[FieldProblem]:
    allowed = f"at most {error.limit_m:g} m from a road, this is {error.distance_m:.0f} m"
    return [_field(error.field, {"lat": error.lat, "lon": error.lon}, allowed)]


def _query_fields(error: QueryError) -> list[FieldProblem]:
    return [_field(REQUEST_FIELDS.get(error.field, error.field), error.value, error.allowed)]


def _energy_gain_fields(error: NegativeCycleError) -> list[FieldProblem]:
    if error.least_load_n < 0.0:
        return [_field("conditions", f"road load of {error.least_load_n:.1f} N", "a road load of at least 0 N")]
    return [_field("link_model", "printed", "integrated")]


def _search_limit_fields(error: SearchLimitError) -> list[FieldProblem]:
    return [_field("", error.labels, f"at most {error.limit} labels")]


def _time_limit_fields(error: TimeLimitError) -> list[FieldProblem]:
    return [_field("", None, f"at most {error.limit_s:g} s")]


def _body_fields(error: BodyTooLargeError) -> list[FieldProblem]:
    return [_field("", None, f"at most {error.limit_bytes} bytes")]


def _unknown_effects_fields(error: EffectsNotFoundError) -> list[FieldProblem]:
    return [_field("effects", error.effects_id, "the id of a finished diagnosis, or an object")]


def _diagnosis_id_fields(error: DiagnosisNotFoundError | DiagnosisDamagedError) -> list[FieldProblem]:
    return [_field("id", error.diagnosis_id, "the id of a diagnosis that can be read")]


def _unknown_trip_fields(error: TripNotFoundError) -> list[FieldProblem]:
    return [_field("trip", error.trip, f"an id of GET /diagnoses/{error.diagnosis_id}/trips")]


def _not_done_fields(error: DiagnosisNotDoneError) -> list[FieldProblem]:
    return [_field("id", error.diagnosis_id, f"a diagnosis that is done, this is {error.state}")]


def _unusable_fields(error: UnusableRecordingsError) -> list[FieldProblem]:
    return [_field("recordings", one.file, one.error) for one in error.refused[:MAX_FIELDS]]


def _media_type_fields(error: UnsupportedMediaTypeError) -> list[FieldProblem]:
    return [_field("Content-Type", error.media_type, "multipart/form-data, application/json")]


def _no_fields(error: Exception) -> list[FieldProblem]:
    return []


TABLE: Final[Mapping[type[Exception], tuple[ErrorCode, Callable[[Any], list[FieldProblem]]]]] = {
    VehicleError: (ErrorCode.INVALID_VEHICLE, _vehicle_fields),
    VehicleNotFoundError: (ErrorCode.UNKNOWN_VEHICLE, _unknown_vehicle_fields),
    VehicleIsBundledError: (ErrorCode.VEHICLE_IS_BUNDLED, _bundled_fields),
    VehicleDamagedError: (ErrorCode.VEHICLE_DAMAGED, _damaged_fields),
    DatabaseUnavailableError: (ErrorCode.DATABASE_UNAVAILABLE, _no_fields),
    ConditionsError: (ErrorCode.INVALID_CONDITIONS, _named_fields),
    ChainLinkError: (ErrorCode.INVALID_LINK, _chain_link_fields),
    LinkError: (ErrorCode.INVALID_LINK, _link_fields),
    GraphNotFoundError: (ErrorCode.UNKNOWN_GRAPH, _unknown_graph_fields),
    PointOutsideMapError: (ErrorCode.POINT_OUTSIDE_MAP, _outside_fields),
    PointFarFromRoadError: (ErrorCode.POINT_FAR_FROM_ROAD, _far_fields),
    TileOutOfRangeError: (ErrorCode.INVALID_REQUEST, _named_fields),
    HeightsAbsentError: (ErrorCode.NOT_FOUND, _named_fields),
    QueryError: (ErrorCode.INVALID_REQUEST, _query_fields),
    NoPathError: (ErrorCode.NO_PATH, _no_fields),
    NegativeCycleError: (ErrorCode.ENERGY_GAIN, _energy_gain_fields),
    SearchLimitError: (ErrorCode.SEARCH_LIMIT, _search_limit_fields),
    EffectsNotFoundError: (ErrorCode.UNKNOWN_EFFECTS, _unknown_effects_fields),
    DiagnosisNotFoundError: (ErrorCode.UNKNOWN_DIAGNOSIS, _diagnosis_id_fields),
    DiagnosisDamagedError: (ErrorCode.DIAGNOSIS_DAMAGED, _diagnosis_id_fields),
    TripNotFoundError: (ErrorCode.UNKNOWN_TRIP, _unknown_trip_fields),
    DiagnosisNotDoneError: (ErrorCode.DIAGNOSIS_NOT_DONE, _not_done_fields),
    SourceError: (ErrorCode.INVALID_REQUEST, _named_fields),
    HoldoutError: (ErrorCode.INVALID_REQUEST, _named_fields),
    DiagnosisError: (ErrorCode.DIAGNOSIS_FAILED, _no_fields),
    UnusableRecordingsError: (ErrorCode.UNUSABLE_RECORDINGS, _unusable_fields),
    DiagnosisInterruptedError: (ErrorCode.DIAGNOSIS_INTERRUPTED, _no_fields),
    TooManyDiagnosesError: (ErrorCode.TOO_MANY_DIAGNOSES, _no_fields),
    MalformedFormError: (ErrorCode.MALFORMED_FORM, _no_fields),
    UnsupportedMediaTypeError: (ErrorCode.UNSUPPORTED_MEDIA_TYPE, _media_type_fields),
    TimeLimitError: (ErrorCode.TIME_LIMIT, _time_limit_fields),
    NotReadyError: (ErrorCode.NOT_READY, _no_fields),
    BodyTooLargeError: (ErrorCode.BODY_TOO_LARGE, _body_fields),
}

HTTP_CODES: Final[Mapping[int, ErrorCode]] = {
    400: ErrorCode.MALFORMED_JSON,  # what the framework raises on a body that json can't read
    404: ErrorCode.NOT_FOUND,
    405: ErrorCode.METHOD_NOT_ALLOWED,
    422: ErrorCode.INVALID_REQUEST,
}

# parts of a location that name a branch of a union, not a field
BRANCHES: Final = frozenset(
    {
        *("named", "pair", "metric", "epa", "count", "values", "[key]"),
        *(ID_BRANCH, PHYSICAL_BRANCH, TABLE_BRANCH, EFFECTS_ID_BRANCH, EFFECTS_BRANCH),
    }
)


def problem_of(error: Exception, instance: str) -> Problem:
    """What is answered for an error; any that is not in the table is a fault of the service."""
    if isinstance(error, RequestValidationError):
        return _validation_problem(error.errors(), instance)
    if isinstance(error, HTTPException):
        fallback = ErrorCode.INTERNAL if error.status_code >= 500 else ErrorCode.NOT_FOUND
        code = HTTP_CODES.get(error.status_code, fallback)
        return make_problem(code, KINDS[code].title, [], instance)
    for kind in type(error).__mro__:
        if kind in TABLE:
            code, fields_of = TABLE[kind]
            return make_problem(code, str(error), fields_of(error), instance)
    return make_problem(ErrorCode.INTERNAL, "the request was understood but could not be answered", [], instance)


def validation_detail(error: ValidationError) -> str:
    """What is wrong with something that pydantic refused, in one line."""
    return _validation_problem(error.errors(), "").detail.removeprefix("the body is ")


def make_problem(code: ErrorCode, detail: str, fields: list[FieldProblem], instance: str) -> Problem:
    """Problem details of one code."""
    kind = KINDS[code]
    return Problem(
        type=f"urn:joulepath:problem:{code.value}",
        title=kind.title,
        status=kind.status,
        detail=_shortened(detail, 1000),
        instance=_shortened(instance, MAX_VALUE_CHARS),
        code=code,
        errors=fields,
    )


def problem_bytes(problem: Problem) -> bytes:
    """A problem as JSON; refuses NaN and infinities, which JSON does not know."""
    return json.dumps(problem.model_dump(mode="python"), allow_nan=False).encode("ascii")


def problem_response(error: Exception, instance: str, headers: Mapping[str, str] | None = None) -> Response:
    """The HTTP answer for an error."""
    problem = problem_of(error, instance)
    sent = dict(headers or {})
    if problem.status in (429, 503):
        sent.setdefault("Retry-After", "5")
    return Response(problem_bytes(problem), problem.status, sent, media_type=PROBLEM_TYPE)


def install_error_handlers(app: FastAPI, allowed_methods: Callable[[str], set[str]]) -> None:
    """Answer every error of the table, of validation and of the framework as a problem.

    allowed_methods: of an address; the framework names those of the first matching route only.
    """

    def handle(request: Request, error: Exception) -> Response:
        headers = dict(error.headers or {}) if isinstance(error, HTTPException) else {}
        if isinstance(error, HTTPException) and error.status_code == 405:
            methods = allowed_methods(request.url.path)
            headers |= {"Allow": ", ".join(sorted(methods))} if methods else {}
        return problem_response(error, request.url.path, headers)

    for kind in (*TABLE, RequestValidationError, HTTPException, Exception):
        app.add_exception_handler(kind, handle)


def _validation_problem(errors: Sequence[Any], instance: str) -> Problem:
    if any(error["type"] == "json_invalid" for error in errors):
        reason = str(errors[0].get("ctx", {}).get("error", errors[0]["msg"]))
        field = _field("", None, f"valid JSON: {reason}")
        return make_problem(ErrorCode.MALFORMED_JSON, f"the body is not valid JSON: {reason}", [field], instance)
    fields = [_validation_field(error) for error in errors[:MAX_FIELDS]]
    first = fields[0]
    name, value = first.field or "the request", first.value
    if errors[0]["type"] == "missing":
        detail = f"{name} is missing, it is required"
    else:
        detail = f"{name} is {json.dumps(value, ensure_ascii=False)}, allowed: {first.allowed}"
    if len(errors) > 1:
        detail += f" (and {len(errors) - 1} more)"
    return make_problem(ErrorCode.INVALID_REQUEST, detail, fields, instance)


def _validation_field(error: Any) -> FieldProblem:
    """The field, value and allowed range of one error that pydantic reports."""
    context = error.get("ctx") or {}
    path = _path(error["loc"])
    kind, value = error["type"], error.get("input")
    if kind == "refused":
        name = ".".join(part for part in (path, context["field"]) if part)
        return _field(name, context["value"], context["allowed"])
    if kind == "missing":
        return _field(path, None, "required")
    if kind == "extra_forbidden":
        return _field(path, value, "no field of this name")
    if isinstance(value, bytes):
        return _field(path, value.decode("utf-8", "replace"), "a JSON object, sent with Content-Type: application/json")
    return _field(path, value, _allowed(kind, context, str(error["msg"])))


def _allowed(kind: str, context: Mapping[str, object], message: str) -> str:
    if kind in ("model_type", "model_attributes_type", "dict_type"):
        return "an object"
    if kind in ("too_short", "too_long"):
        few = kind == "too_short"
        return f"at least {context['min_length']} items" if few else f"at most {context['max_length']} items"
    if kind == "string_pattern_mismatch":
        return f"text that matches {context['pattern']}"
    for start in ("Input should be ", "String should have ", "Value error, "):
        message = message.removeprefix(start)
    message = message.replace("greater than or equal to", "at least").replace("less than or equal to", "at most")
    return message.replace("greater than", "above").replace("less than", "below")


def _path(location: Sequence[str | int]) -> str:
    path = ""
    for depth, part in enumerate(location):
        if isinstance(part, int):
            path += f"[{part}]"
        elif not (depth == 0 and part in ("body", "query", "path")) and part not in BRANCHES:
            path += f".{part}" if path else part
    return _shortened(path, MAX_VALUE_CHARS)


def _field(field: str, value: object, allowed: str) -> FieldProblem:
    return FieldProblem(field=field, value=_json_value(value), allowed=_shortened(allowed, 1000))


def _json_value(value: object) -> JsonValue:
    """A value as sent, in valid JSON and not too long."""
    if value is None or isinstance(value, bool):
        return value
    if isinstance(value, float):
        return value if math.isfinite(value) else str(value)
    if isinstance(value, int):
        return value if abs(value) < 2**63 else "an integer beyond 64 bits"
    if isinstance(value, str):
        return _shortened(value, MAX_VALUE_CHARS)
    if isinstance(value, dict) and len(value) <= 2 and all(isinstance(v, (int, float)) for v in value.values()):
        return {_shortened(str(k), MAX_VALUE_CHARS): _json_value(v) for k, v in value.items()}
    if isinstance(value, dict):
        return "an object"
    if isinstance(value, (list, tuple)):
        plain = len(value) <= 8 and all(isinstance(v, (int, float, str)) for v in value)
        return [_json_value(v) for v in value] if plain else f"a list of {len(value)}"
    return _shortened(str(value), MAX_VALUE_CHARS)


def _shortened(text: str, limit: int) -> str:
    """At most so many characters, lone surrogates replaced."""
    text = text[: limit + 1].encode("utf-8", "replace").decode("utf-8")
    return text if len(text) <= limit else text[: limit - 1] + "…"
