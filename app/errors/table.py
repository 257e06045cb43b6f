"""Errors of every package as HTTP problems (RFC 9457); the only place that knows a status."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

from fastapi.exceptions import RequestValidationError
from starlette.exceptions import HTTPException

from app.errors.diagnosing import (
    DiagnosisInterruptedError,
    DiagnosisLimitError,
    MalformedFormError,
    TooManyDiagnosesError,
    UnusableRecordingsError,
    UploadsFullError,
)
from app.errors.problems import KINDS, MAX_FIELDS, field_problem, make_problem
from app.errors.raised import NotReadyError, PlaceTextError
from app.errors.validation import validation_problem
from app.schemas.problem import ErrorCode, FieldProblem, Problem
from app.store.errors import DatabaseUnavailableError, StorageFullError
from diagnosis.errors import DiagnosisError
from energy.errors import Refusal
from routing.errors import GraphFormatError, NoPathError

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping


# names inside, on the left, are those of queries in SI units; on the right, those of requests
REQUEST_FIELDS: Final[Mapping[str, str]] = {
    "soc_frac": "soc",
    "reserve_soc_frac": "reserve_soc",
    "bands_soc_frac": "bands",
    "stop_rule": "stops",
    "weightings": "weights",
    "charging.arrive_soc_frac": "charging.arrive_soc",
    "charging.goal_soc_frac": "charging.goal_soc",
    "charging.max_soc_frac": "charging.max_soc",
}


def _refused_fields(error: Refusal) -> list[FieldProblem]:
    if isinstance(error, PlaceTextError):
        refused = (error, *error.others)[:MAX_FIELDS]
        return [field_problem(text.field, text.value, text.allowed, text.suggestions) for text in refused]
    name = REQUEST_FIELDS.get(error.request_field, error.request_field)
    return [field_problem(name, error.value, error.allowed)]


def _unusable_fields(error: UnusableRecordingsError) -> list[FieldProblem]:
    return [field_problem("recordings", refused.file, refused.error) for refused in error.refused[:MAX_FIELDS]]


def _no_fields(error: Exception) -> list[FieldProblem]:
    return []


# errors that name no field, or more than one; a refusal has its code in its class
TABLE: Final[Mapping[type[Exception], tuple[ErrorCode, Callable[[Any], list[FieldProblem]]]]] = {
    UnusableRecordingsError: (ErrorCode.UNUSABLE_RECORDINGS, _unusable_fields),
    DatabaseUnavailableError: (ErrorCode.DATABASE_UNAVAILABLE, _no_fields),
    DiagnosisError: (ErrorCode.DIAGNOSIS_FAILED, _no_fields),
    DiagnosisInterruptedError: (ErrorCode.DIAGNOSIS_INTERRUPTED, _no_fields),
    DiagnosisLimitError: (ErrorCode.DIAGNOSIS_FAILED, _no_fields),
    MalformedFormError: (ErrorCode.MALFORMED_FORM, _no_fields),
    GraphFormatError: (ErrorCode.GRAPH_DAMAGED, _refused_fields),
    NoPathError: (ErrorCode.NO_PATH, _no_fields),
    NotReadyError: (ErrorCode.NOT_READY, _no_fields),
    StorageFullError: (ErrorCode.STORAGE_FULL, _no_fields),
    TooManyDiagnosesError: (ErrorCode.TOO_MANY_DIAGNOSES, _no_fields),
    UploadsFullError: (ErrorCode.STORAGE_FULL, _no_fields),
}

HTTP_CODES: Final[Mapping[int, ErrorCode]] = {
    400: ErrorCode.MALFORMED_JSON,  # what the framework raises on a body that json can't read
    404: ErrorCode.NOT_FOUND,
    405: ErrorCode.METHOD_NOT_ALLOWED,
    408: ErrorCode.REQUEST_TIMEOUT,  # of the server, which answers before there is a request
    422: ErrorCode.INVALID_REQUEST,
}


def problem_of(error: Exception, instance: str) -> Problem:
    """What is answered for an error, by the first of its classes that is a refusal or in the table.

    Any other, and a refusal of what no request can hold, is a fault of the service.
    """
    if isinstance(error, RequestValidationError):
        return validation_problem(error.errors(), instance)
    if isinstance(error, HTTPException):
        fallback = ErrorCode.INTERNAL if error.status_code >= 500 else ErrorCode.NOT_FOUND
        code = HTTP_CODES.get(error.status_code, fallback)
        return make_problem(code, KINDS[code].title, [], instance)
    for kind in type(error).__mro__:
        if kind is Refusal and isinstance(error, Refusal) and error.code:
            return make_problem(ErrorCode(error.code), str(error), _refused_fields(error), instance)
        if kind in TABLE:
            code, fields_of = TABLE[kind]
            return make_problem(code, str(error), fields_of(error), instance)
    return make_problem(ErrorCode.INTERNAL, "the request was understood but could not be answered", [], instance)
