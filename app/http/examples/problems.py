"""Documented errors: the OpenAPI responses for the codes that an operation may answer."""

from __future__ import annotations

from typing import Any, Final

from app.access.roles import HEALTH, READING, Role, need_of
from app.errors.problems import KINDS, PROBLEM_TYPE, make_problem
from app.schemas.places.named import PlaceOption
from app.schemas.problem import ErrorCode, FieldProblem, Problem

EXAMPLES: Final = {
    ErrorCode.INVALID_REQUEST: (
        "soc is 1.4, allowed: at most 1",
        FieldProblem(field="soc", value=1.4, allowed="at most 1"),
    ),
    ErrorCode.MALFORMED_JSON: (
        "the body is not valid JSON: Expecting value",
        FieldProblem(field="", value=None, allowed="valid JSON: Expecting value"),
    ),
    ErrorCode.INVALID_VEHICLE: (
        "road_load is -12.0 N at 90.0 km/h, allowed: at least 0 N everywhere in 0..200 km/h",
        FieldProblem(
            field="vehicle.road_load", value="-12.0 N at 90.0 km/h", allowed="at least 0 N everywhere in 0..200 km/h"
        ),
    ),
    ErrorCode.INVALID_LINK: (
        "id of link 3 is 812, allowed: a successor of link 97",
        FieldProblem(field="links[3].id", value=812, allowed="a successor of link 97"),
    ),
    ErrorCode.INVALID_CONDITIONS: (
        "conditions.wind_speed_mps is 8.0, allowed: 0 where links have no heading",
        FieldProblem(field="conditions.wind_speed_mps", value=8.0, allowed="0 where links have no heading"),
    ),
    ErrorCode.ENERGY_GAIN: (
        "the link model gains energy on a cycle through link 97: no cheapest route exists; use link_model 'integrated'",
        FieldProblem(field="link_model", value="printed", allowed="integrated"),
    ),
    ErrorCode.UNKNOWN_VEHICLE: (
        "vehicle 'delorean' is unknown, known: bmw-i3-60ah, hyundai-kona-64",
        FieldProblem(field="vehicle", value="delorean", allowed="one of bmw-i3-60ah, hyundai-kona-64"),
    ),
    ErrorCode.UNKNOWN_GRAPH: (
        "graph 'atlantis' is unknown, known: coquimbo, highlands",
        FieldProblem(field="graph", value="atlantis", allowed="one of coquimbo, highlands"),
    ),
    ErrorCode.GRAPH_DAMAGED: (
        "meta.json of graph /var/lib/joulepath/graphs/andorra is unreadable (Expecting value), "
        "allowed: a graph written by `joulepath import`",
        FieldProblem(field="meta.json", value="unreadable (Expecting value)", allowed="a graph that can be read"),
    ),
    ErrorCode.POINT_OUTSIDE_MAP: (
        "start (lat 60, lon -36.2) is outside the map of graph 'highlands', 1724 km away, "
        "allowed: lat 43.5077..44.4953, lon -37.0036..-35.0105",
        FieldProblem(
            field="start", value={"lat": 60.0, "lon": -36.2}, allowed="lat 43.5077..44.4953, lon -37.0036..-35.0105"
        ),
    ),
    ErrorCode.POINT_FAR_FROM_ROAD: (
        "goal (lat 44.1, lon -36.9) is 2310 m from the nearest road 'Ridge Road' at lat 44.1195, lon -36.91, "
        "allowed: at most 1000 m",
        FieldProblem(
            field="goal", value={"lat": 44.1, "lon": -36.9}, allowed="at most 1000 m from a road, this is 2310 m"
        ),
    ),
    ErrorCode.NO_PATH: ("no road leads to the goal", None),
    ErrorCode.VEHICLE_IS_BUNDLED: (
        "vehicle 'hyundai-kona-64' is bundled and can't be changed; store a copy under another id",
        FieldProblem(field="id", value="hyundai-kona-64", allowed="the id of no bundled vehicle"),
    ),
    ErrorCode.VEHICLE_DAMAGED: (
        "stored vehicle 'my-car' can't be read: mass_kg is missing, it is required; store it again or remove it",
        FieldProblem(field="vehicle", value="my-car", allowed="a stored vehicle that can be read"),
    ),
    ErrorCode.NOT_FOUND: ("Nothing at this address", None),
    ErrorCode.METHOD_NOT_ALLOWED: ("This address has no such method", None),
    ErrorCode.BODY_TOO_LARGE: (
        "the request body is too large, allowed: at most 4194304 bytes",
        FieldProblem(field="", value=None, allowed="at most 4194304 bytes"),
    ),
    ErrorCode.REQUEST_TIMEOUT: (
        "the request's body arrives too slowly, allowed: 20 s, and a second more for 2000 bytes each",
        None,
    ),
    ErrorCode.UNAUTHORIZED: (
        "no key was sent, allowed: a key of `joulepath keys add`, as Authorization: Bearer KEY or X-API-Key: KEY",
        FieldProblem(
            field="Authorization",
            value=None,
            allowed="a key of `joulepath keys add`, as Authorization: Bearer KEY or X-API-Key: KEY",
        ),
    ),
    ErrorCode.FORBIDDEN: (
        "the key has the role read, allowed: a key with the role write or above",
        FieldProblem(field="Authorization", value="read", allowed="a key with the role write or above"),
    ),
    ErrorCode.WRONG_ORIGIN: (
        "Origin is 'https://elsewhere.example', allowed: pages of this service, and of JOULEPATH_CORS_ORIGINS",
        FieldProblem(
            field="Origin",
            value="https://elsewhere.example",
            allowed="pages of this service, and of JOULEPATH_CORS_ORIGINS",
        ),
    ),
    ErrorCode.UNKNOWN_HOST: (
        "Host is 'elsewhere.example', allowed: a name of JOULEPATH_ALLOWED_HOSTS",
        FieldProblem(field="Host", value="elsewhere.example", allowed="a name of JOULEPATH_ALLOWED_HOSTS"),
    ),
    ErrorCode.RATE_LIMITED: (
        "too much was asked for, allowed: 50 units a second and 500 at once; again in 1 s",
        FieldProblem(field="", value=None, allowed="50 units a second and 500 at once"),
    ),
    ErrorCode.SEARCH_LIMIT: (
        "the search needed 2833561 labels, allowed: at most 2833560",
        FieldProblem(field="", value=2_833_561, allowed="at most 2833560 labels"),
    ),
    ErrorCode.TIME_LIMIT: (
        "no answer within 30 s; ask for a shorter route, less charge, fewer alternatives or places",
        FieldProblem(field="", value=None, allowed="at most 30 s"),
    ),
    ErrorCode.OVERLOADED: (
        "so many requests are waiting that this one would take too long; try again in 4 s",
        FieldProblem(field="", value=None, allowed="fewer requests at a time"),
    ),
    ErrorCode.DATABASE_UNAVAILABLE: (
        "the vehicle database postgresql+psycopg://joulepath:***@db/vehicles is not available: connection refused",
        None,
    ),
    ErrorCode.MALFORMED_FORM: (
        "the multipart body can't be read: Missing boundary in multipart.",
        None,
    ),
    ErrorCode.UNSUPPORTED_MEDIA_TYPE: (
        "Content-Type is 'text/csv', allowed: multipart/form-data, application/json",
        FieldProblem(field="Content-Type", value="text/csv", allowed="multipart/form-data, application/json"),
    ),
    ErrorCode.UNKNOWN_EFFECTS: (
        "effects '20260301-0c9f2a7b1d4e' are unknown, known: 20260228-5d1e7f90a2b3",
        FieldProblem(
            field="effects", value="20260301-0c9f2a7b1d4e", allowed="the id of a finished diagnosis, or an object"
        ),
    ),
    ErrorCode.UNKNOWN_DIAGNOSIS: (
        "diagnosis '20260301-0c9f2a7b1d4e' is unknown",
        FieldProblem(field="id", value="20260301-0c9f2a7b1d4e", allowed="the id of a diagnosis that can be read"),
    ),
    ErrorCode.UNKNOWN_TRIP: (
        "trip 'monday' of diagnosis '20260301-0c9f2a7b1d4e' is unknown",
        FieldProblem(field="trip", value="monday", allowed="an id of GET /diagnoses/20260301-0c9f2a7b1d4e/trips"),
    ),
    ErrorCode.NO_PLACES: (
        "graph 'valley' has no index of places, allowed: a graph with an index of places, which `joulepath places "
        "build` gives it",
        FieldProblem(
            field="graph",
            value="valley",
            allowed="a graph with an index of places, which `joulepath places build` gives it",
        ),
    ),
    ErrorCode.UNKNOWN_PLACE: (
        "goal is Atlantis, allowed: a place on graph 'highlands', or its coordinates; nothing is like it",
        FieldProblem(
            field="goal",
            value="Atlantis",
            allowed="a place on graph 'highlands', or its coordinates; nothing is like it",
        ),
    ),
    ErrorCode.AMBIGUOUS_PLACE: (
        "goal is Mill Road, allowed: a text that fits a single place on graph 'highlands', or its coordinates; found: "
        "Mill Road (lat 44.44010, lon -36.78100); Mill Road (lat 44.28380, lon -36.22980)",
        FieldProblem(
            field="goal",
            value="Mill Road",
            allowed="a text that fits a single place on graph 'highlands', or its coordinates; found: Mill Road "
            "(lat 44.44010, lon -36.78100); Mill Road (lat 44.28380, lon -36.22980)",
            suggestions=[
                PlaceOption(label="Mill Road", kind="street", lat=44.4401, lon=-36.781, match=1.0),
                PlaceOption(label="Mill Road", kind="street", lat=44.2838, lon=-36.2298, match=1.0),
            ],
        ),
    ),
    ErrorCode.DIAGNOSIS_DAMAGED: (
        "stored diagnosis '20260301-0c9f2a7b1d4e' can't be read: Expecting value; remove it",
        FieldProblem(field="id", value="20260301-0c9f2a7b1d4e", allowed="the id of a diagnosis that can be read"),
    ),
    ErrorCode.DIAGNOSIS_NOT_DONE: (
        "diagnosis '20260301-0c9f2a7b1d4e' is running, allowed: done",
        FieldProblem(field="id", value="20260301-0c9f2a7b1d4e", allowed="a diagnosis that is done, this is running"),
    ),
    ErrorCode.TOO_MANY_DIAGNOSES: (
        "8 diagnoses are queued or running already, allowed: at most 8; try again later",
        None,
    ),
    ErrorCode.STORAGE_FULL: (
        "the uploaded files can't be stored (No space left on device); try again later, or send fewer drives",
        None,
    ),
    ErrorCode.NOT_READY: ("graphs are being loaded and kernels compiled; try again in a moment", None),
}

DRIVE_CODES: Final = (
    ErrorCode.INVALID_REQUEST,
    ErrorCode.INVALID_CONDITIONS,
    ErrorCode.UNKNOWN_VEHICLE,
    ErrorCode.VEHICLE_DAMAGED,
    ErrorCode.UNKNOWN_EFFECTS,
    ErrorCode.DIAGNOSIS_DAMAGED,
    ErrorCode.DATABASE_UNAVAILABLE,
    ErrorCode.UNKNOWN_GRAPH,
    ErrorCode.TIME_LIMIT,
    ErrorCode.OVERLOADED,
    ErrorCode.NOT_READY,
)  # of whatever asks what a vehicle takes on a graph
SEARCH_CODES: Final = (
    *DRIVE_CODES,
    ErrorCode.ENERGY_GAIN,
    ErrorCode.POINT_OUTSIDE_MAP,
    ErrorCode.POINT_FAR_FROM_ROAD,
    ErrorCode.SEARCH_LIMIT,
)
TEXT_CODES: Final = (ErrorCode.NO_PLACES, ErrorCode.UNKNOWN_PLACE, ErrorCode.AMBIGUOUS_PLACE, ErrorCode.GRAPH_DAMAGED)
BODY_CODES: Final = (ErrorCode.MALFORMED_JSON, ErrorCode.INVALID_VEHICLE, ErrorCode.BODY_TOO_LARGE)


def gate_codes(method: str, path: str, with_body: bool) -> tuple[ErrorCode, ...]:
    """What may be answered before an operation is asked; path: also with parameters in braces."""
    if path in HEALTH:
        return ()
    role = need_of(method, path).role
    return (
        *((ErrorCode.REQUEST_TIMEOUT,) if with_body else ()),
        *((ErrorCode.UNAUTHORIZED,) if role is not None else ()),
        *((ErrorCode.FORBIDDEN,) if role not in (None, Role.READ) else ()),
        *((ErrorCode.WRONG_ORIGIN,) if method not in READING else ()),
        ErrorCode.UNKNOWN_HOST,
        ErrorCode.RATE_LIMITED,
    )


def problems(instance: str, *codes: ErrorCode) -> dict[int | str, dict[str, Any]]:
    """OpenAPI responses for the codes that an operation may answer, each with an example."""
    responses: dict[int | str, dict[str, Any]] = {}
    for code in codes:
        kind = KINDS[code]
        detail, field = EXAMPLES[code]
        example = make_problem(code, detail, [] if field is None else [field], instance)
        entry = responses.setdefault(
            kind.status, {"model": Problem, "description": "", "content": {PROBLEM_TYPE: {"examples": {}}}}
        )
        entry["description"] = "; ".join(
            part for part in (entry["description"], f"`{code.value}`: {kind.title}") if part
        )
        entry["content"][PROBLEM_TYPE]["examples"][code.value] = {
            "summary": kind.title,
            "value": example.model_dump(mode="json"),
        }
    return responses
