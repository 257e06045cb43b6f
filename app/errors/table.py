"""Errors of every package as HTTP problems (RFC 9457); the only place that knows a status."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

from fastapi.exceptions import RequestValidationError
from starlette.exceptions import HTTPException

from app.errors.diagnosing import (
    DiagnosisInterruptedError,
    DiagnosisNotDoneError,
    MalformedFormError,
    SourceError,
    TooManyDiagnosesError,
    UnsupportedMediaTypeError,
    UnusableRecordingsError,
)
from app.errors.problems import KINDS, MAX_FIELDS, _field, make_problem
from app.errors.raised import BodyTooLargeError, ChainLinkError, NotReadyError, TimeLimitError
from app.errors.validation import _validation_problem
from app.schemas.problem import ErrorCode, FieldProblem, Problem
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
    from collections.abc import Callable, Mapping


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
