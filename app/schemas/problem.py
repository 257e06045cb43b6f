"""Errors as they are answered: RFC 9457 problem details with a stable code."""

from __future__ import annotations

from enum import StrEnum

from pydantic import Field, JsonValue

from app.schemas.base import Answered
from app.schemas.places.named import PlaceOption


class ErrorCode(StrEnum):
    """The closed list of what can go wrong."""

    INVALID_REQUEST = "invalid_request"
    MALFORMED_JSON = "malformed_json"
    MALFORMED_FORM = "malformed_form"
    UNSUPPORTED_MEDIA_TYPE = "unsupported_media_type"
    INVALID_VEHICLE = "invalid_vehicle"
    INVALID_LINK = "invalid_link"
    INVALID_CONDITIONS = "invalid_conditions"
    ENERGY_GAIN = "energy_gain"
    UNKNOWN_VEHICLE = "unknown_vehicle"
    VEHICLE_IS_BUNDLED = "vehicle_is_bundled"
    VEHICLE_DAMAGED = "vehicle_damaged"
    UNKNOWN_GRAPH = "unknown_graph"
    GRAPH_DAMAGED = "graph_damaged"
    UNKNOWN_EFFECTS = "unknown_effects"
    UNKNOWN_DIAGNOSIS = "unknown_diagnosis"
    UNKNOWN_TRIP = "unknown_trip"
    DIAGNOSIS_NOT_DONE = "diagnosis_not_done"
    DIAGNOSIS_DAMAGED = "diagnosis_damaged"
    UNUSABLE_RECORDINGS = "unusable_recordings"
    DIAGNOSIS_FAILED = "diagnosis_failed"
    DIAGNOSIS_INTERRUPTED = "diagnosis_interrupted"
    POINT_OUTSIDE_MAP = "point_outside_map"
    POINT_FAR_FROM_ROAD = "point_far_from_road"
    NO_PATH = "no_path"
    NO_PLACES = "no_places"
    UNKNOWN_PLACE = "unknown_place"
    AMBIGUOUS_PLACE = "ambiguous_place"
    NOT_FOUND = "not_found"
    METHOD_NOT_ALLOWED = "method_not_allowed"
    BODY_TOO_LARGE = "body_too_large"
    REQUEST_TIMEOUT = "request_timeout"
    UNAUTHORIZED = "unauthorized"
    FORBIDDEN = "forbidden"
    WRONG_ORIGIN = "wrong_origin"
    UNKNOWN_HOST = "unknown_host"
    RATE_LIMITED = "rate_limited"
    TOO_MANY_DIAGNOSES = "too_many_diagnoses"
    STORAGE_FULL = "storage_full"
    SEARCH_LIMIT = "search_limit"
    TIME_LIMIT = "time_limit"
    OVERLOADED = "overloaded"
    DATABASE_UNAVAILABLE = "database_unavailable"
    NOT_READY = "not_ready"
    INTERNAL = "internal"


class FieldProblem(Answered):
    """One field that was wrong."""

    field: str = Field(description="path in the request, such as start.lat or links[3].id; empty for the whole of it")
    value: JsonValue = Field(description="what was sent, shortened; null where it was missing")
    allowed: str = Field(description="what would have been right")
    suggestions: list[PlaceOption] = Field(
        default=[],
        exclude_if=lambda suggestions: not suggestions,
        description="places that a text may have meant, the likeliest first; not there where there are none",
    )


class Problem(Answered):
    """Problem details (RFC 9457), sent as application/problem+json."""

    type: str = Field(description="identifier of the kind of problem, one for each code")
    title: str = Field(description="the kind of problem in words")
    status: int = Field(description="the HTTP status")
    detail: str = Field(description="what was wrong this time: field, value and allowed range")
    instance: str = Field(description="path that was called")
    code: ErrorCode = Field(description="stable code, of a closed list")
    errors: list[FieldProblem] = Field(description="the fields that were wrong, at most 20")
