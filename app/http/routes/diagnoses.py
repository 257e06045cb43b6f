"""POST and GET /diagnoses, and GET and DELETE /diagnoses/{id} with what belongs to it."""

from __future__ import annotations

from collections.abc import AsyncIterator
from dataclasses import dataclass
from pathlib import Path as FilePath
from typing import Annotated, Any, Final

from anyio import CancelScope, to_thread
from fastapi import APIRouter, Depends, Path, Request, Response
from starlette.concurrency import run_in_threadpool

from app.access.addresses import client_of, parsed
from app.diagnosing.arrivals import Arrival
from app.diagnosing.use_cases import Diagnoses, UploadedFile
from app.errors.raised import NotReadyError
from app.http.examples.answers import (
    DIAGNOSIS_ANSWER,
    DIAGNOSIS_LIST,
    DIAGNOSIS_QUEUED,
    DIAGNOSIS_REQUESTS,
    DIAGNOSIS_RESIDUALS,
    DIAGNOSIS_TRIP,
    DIAGNOSIS_TRIPS,
    LEARNED_EFFECTS,
)
from app.http.examples.problems import problems
from app.http.observed import KEY_NAME
from app.http.routes.access import GEOJSON, JSON, GeoJSONResponse, answer
from app.http.routes.diagnosis_body import (
    FORM_EXAMPLE,
    FORM_SCHEMA,
    MULTIPART,
    is_form,
    received_form,
    received_request,
)
from app.schemas.diagnosis import (
    DiagnosisAnswer,
    DiagnosisList,
    DiagnosisOptions,
    DiagnosisRequest,
    ResidualCollection,
    TripList,
    TripTimelineAnswer,
)
from app.schemas.learned_effects import LearnedEffects
from app.schemas.problem import ErrorCode

router = APIRouter(tags=["diagnoses"])

HTML: Final = "text/html"
# a report is one page with its own styles, scripts and pictures; file names of recordings stand in it
REPORT_POLICY: Final = (
    "default-src 'none'; style-src 'unsafe-inline'; script-src 'unsafe-inline'; img-src data:; font-src data:; "
    "frame-ancestors 'self'"
)
SHARED: Final = (ErrorCode.DATABASE_UNAVAILABLE, ErrorCode.NOT_READY)
ONE: Final = (ErrorCode.UNKNOWN_DIAGNOSIS, ErrorCode.DIAGNOSIS_DAMAGED, ErrorCode.INVALID_REQUEST, *SHARED)
EXAMPLE_ID: Final = DIAGNOSIS_ANSWER["id"]
EXAMPLE_TRIP: Final = DIAGNOSIS_TRIP["id"]

AnyId = Annotated[str, Path(max_length=200, description="id of a diagnosis", examples=[EXAMPLE_ID])]
AnyTrip = Annotated[
    str, Path(max_length=1000, description="id of a trip, each character of it URL-encoded", examples=[EXAMPLE_TRIP])
]


@dataclass(frozen=True, slots=True)
class Received:
    """A body as it was read: a request with the files that it names, or options with uploaded files.

    arrival: of an upload, which holds its files until the diagnosis is queued.
    """

    sent: DiagnosisOptions
    files: tuple[UploadedFile, ...]
    named: tuple[FilePath, ...]
    arrival: Arrival | None


def running_diagnoses(request: Request) -> Diagnoses:
    """The diagnoses of this process; raises NotReadyError until graphs are loaded."""
    diagnoses = getattr(request.app.state, "diagnoses", None)
    if not isinstance(diagnoses, Diagnoses):
        raise NotReadyError
    return diagnoses


RunningDiagnoses = Annotated[Diagnoses, Depends(running_diagnoses)]


async def received(request: Request, diagnoses: RunningDiagnoses) -> AsyncIterator[Received]:
    """The body of a request, its files there until the answer is made; where the queue is full, nothing is read."""
    if not is_form(request):
        await run_in_threadpool(diagnoses.check_room)
        sent = await received_request(request)
        # on few threads of their own, so that others are free
        named = await to_thread.run_sync(diagnoses.named_files, sent.recordings, limiter=diagnoses.folder_searches)
        yield Received(sent, (), named, None)
        return
    arrival = await run_in_threadpool(diagnoses.begin_arrival, _client(request))
    try:
        options, files = await received_form(
            request,
            arrival.folder,
            diagnoses.settings.diagnosis_limit_bytes,
            diagnoses.settings.diagnosis_limit_files,
        )
        yield Received(options, tuple(UploadedFile(name, path) for name, path in files), (), arrival)
    finally:
        with CancelScope(shield=True):  # also where the client is gone
            await run_in_threadpool(arrival.end)


def _client(request: Request) -> str | None:
    """Who uploads, as rates know it: a key or an address, None for this machine, which has no limits of its own."""
    key: str | None = request.scope.get("state", {}).get(KEY_NAME)
    if key is not None:
        return f"key {key}"
    host = request.client.host if request.client is not None else ""
    address = parsed(host)
    return None if address is None or address.is_loopback else client_of(host)


def _json(example: dict[str, Any]) -> dict[str, Any]:
    return {"content": {JSON: {"example": example}}}


@router.post(
    "/diagnoses",
    summary="Diagnose recorded drives",
    status_code=202,
    response_model=DiagnosisAnswer,
    openapi_extra={
        "requestBody": {
            "required": True,
            "content": {
                MULTIPART: {"schema": FORM_SCHEMA, "example": FORM_EXAMPLE, "encoding": {"vehicle": {}}},
                JSON: {
                    "schema": {"$ref": "#/components/schemas/DiagnosisRequest"},
                    "examples": DIAGNOSIS_REQUESTS,
                },
            },
        }
    },
    responses={
        202: {
            **_json(DIAGNOSIS_QUEUED),
            "description": "It is queued",
            "headers": {"Location": {"description": "path of the diagnosis", "schema": {"type": "string"}}},
        },
        **problems(
            "/diagnoses",
            ErrorCode.INVALID_REQUEST,
            ErrorCode.MALFORMED_JSON,
            ErrorCode.MALFORMED_FORM,
            ErrorCode.UNSUPPORTED_MEDIA_TYPE,
            ErrorCode.INVALID_VEHICLE,
            ErrorCode.UNKNOWN_VEHICLE,
            ErrorCode.UNKNOWN_GRAPH,
            ErrorCode.VEHICLE_DAMAGED,
            ErrorCode.BODY_TOO_LARGE,
            ErrorCode.TOO_MANY_DIAGNOSES,
            ErrorCode.STORAGE_FULL,
            *SHARED,
        ),
    },
)
def begin_diagnosis(body: Annotated[Received, Depends(received)], diagnoses: RunningDiagnoses) -> Response:
    """Queues a diagnosis of recordings that are uploaded as a form, or that lie on the server.

    It runs in a process of its own, one at a time; GET of its Location says how far it is, and in the end what it has
    found. What it has learned can then be named by its id as the `effects` of routes and areas. With a `graph`,
    recordings with positions are matched to its roads.
    """
    try:
        if isinstance(body.sent, DiagnosisRequest):
            queued = diagnoses.begin_referenced(body.sent, body.named)
        else:
            queued = diagnoses.begin_uploaded(body.sent, body.files)
    finally:
        if body.arrival is not None:
            body.arrival.end()
    return Response(queued.model_dump_json(), 202, {"Location": f"/diagnoses/{queued.id}"}, media_type=JSON)


@router.get(
    "/diagnoses",
    summary="All diagnoses",
    response_model=DiagnosisList,
    responses={200: _json(DIAGNOSIS_LIST), **problems("/diagnoses", *SHARED)},
)
def list_diagnoses(diagnoses: RunningDiagnoses) -> Response:
    """How far each is, the latest first."""
    return answer(diagnoses.list_all())


@router.get(
    "/diagnoses/{id}",
    summary="One diagnosis",
    response_model=DiagnosisAnswer,
    responses={200: _json(DIAGNOSIS_ANSWER), **problems(f"/diagnoses/{EXAMPLE_ID}", *ONE)},
)
def show_diagnosis(id: AnyId, diagnoses: RunningDiagnoses) -> Response:
    """How far it is; when it is done, its result: verdict, findings, and the fit before and after.

    One that could not be carried out is `failed`, with the reason as `problem` and the files as `refused`.
    """
    return answer(diagnoses.show(id))


@router.get(
    "/diagnoses/{id}/report",
    summary="The report of a diagnosis, as a page",
    response_class=Response,
    responses={
        200: {
            "description": "A page that needs nothing else",
            "content": {HTML: {"schema": {"type": "string"}, "example": "<!doctype html><title>Diagnosis</title>"}},
        },
        **problems(f"/diagnoses/{EXAMPLE_ID}/report", *ONE, ErrorCode.DIAGNOSIS_NOT_DONE),
    },
)
def show_report(id: AnyId, diagnoses: RunningDiagnoses) -> Response:
    """The findings in words and pictures."""
    return Response(diagnoses.report(id), media_type=HTML, headers={"Content-Security-Policy": REPORT_POLICY})


@router.get(
    "/diagnoses/{id}/effects",
    summary="What a diagnosis has learned",
    response_model=LearnedEffects,
    responses={
        200: _json(LEARNED_EFFECTS),
        **problems(f"/diagnoses/{EXAMPLE_ID}/effects", *ONE, ErrorCode.DIAGNOSIS_NOT_DONE, ErrorCode.UNKNOWN_EFFECTS),
    },
)
def show_effects(id: AnyId, diagnoses: RunningDiagnoses) -> Response:
    """effects.json: can be sent as the `effects` of a request, as the id of the diagnosis can."""
    return Response(diagnoses.effects(id).model_dump_json(exclude_none=True), media_type=JSON)


@router.get(
    "/diagnoses/{id}/residuals",
    summary="Where a diagnosis differs from measurement, as GeoJSON",
    response_class=GeoJSONResponse,
    response_model=ResidualCollection,
    responses={
        200: {"content": {GEOJSON: {"example": DIAGNOSIS_RESIDUALS}}},
        **problems(f"/diagnoses/{EXAMPLE_ID}/residuals", *ONE, ErrorCode.DIAGNOSIS_NOT_DONE),
    },
)
def show_residuals(id: AnyId, diagnoses: RunningDiagnoses) -> Response:
    """Measured power less that of the model with all findings: on the links of the graph that was asked for.

    Without a graph, along the recorded tracks, in stretches of about 250 m; without positions, no features.
    """
    return Response(diagnoses.residuals(id), media_type=GEOJSON)


@router.get(
    "/diagnoses/{id}/trips",
    summary="The trips of a diagnosis",
    response_model=TripList,
    responses={
        200: _json(DIAGNOSIS_TRIPS),
        **problems(f"/diagnoses/{EXAMPLE_ID}/trips", *ONE, ErrorCode.DIAGNOSIS_NOT_DONE),
    },
)
def list_trips(id: AnyId, diagnoses: RunningDiagnoses) -> Response:
    """What there is along time of each; energies of trips are in the diagnosis."""
    return answer(diagnoses.trips(id))


@router.get(
    "/diagnoses/{id}/trips/{trip}",
    summary="One trip of a diagnosis along time",
    response_model=TripTimelineAnswer,
    responses={
        200: _json(DIAGNOSIS_TRIP),
        **problems(
            f"/diagnoses/{EXAMPLE_ID}/trips/{EXAMPLE_TRIP}",
            *ONE,
            ErrorCode.UNKNOWN_TRIP,
            ErrorCode.DIAGNOSIS_NOT_DONE,
        ),
    },
)
def show_trip(id: AnyId, trip: AnyTrip, diagnoses: RunningDiagnoses) -> Response:
    """Speed and power, measured and modelled, in windows of 10 s, or longer ones on long trips, with positions."""
    return Response(diagnoses.timeline(id, trip), media_type=JSON)


@router.delete(
    "/diagnoses/{id}",
    summary="Cancel or remove a diagnosis",
    response_model=DiagnosisAnswer,
    responses={
        200: {
            **_json({**DIAGNOSIS_QUEUED, "state": "cancelled"}),
            "description": "It was not finished and is cancelled",
        },
        204: {"description": "It was finished and is removed, with its trips and the effects that it has learned"},
        **problems(f"/diagnoses/{EXAMPLE_ID}", *ONE, ErrorCode.STORAGE_FULL),
    },
)
def remove_diagnosis(id: AnyId, diagnoses: RunningDiagnoses) -> Response:
    """Cancels one that is queued or running; removes one that is finished, whatever its outcome."""
    cancelled = diagnoses.cancel_or_remove(id)
    return Response(status_code=204) if cancelled is None else answer(cancelled)
