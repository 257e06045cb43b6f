"""GET /vehicles, and GET, PUT and DELETE /vehicles/{id}."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Body, Path, Request, Response

from app.http.examples.answers import VEHICLE_BODIES, VEHICLE_DETAIL, VEHICLE_LIST, VEHICLE_STORED
from app.http.examples.problems import problems
from app.http.json_body import BoundedRoute
from app.http.routes.access import JSON, UNCHANGED, RunningService, kept_answer
from app.schemas.problem import ErrorCode
from app.schemas.vehicles.answer import AnyVehicleDetail, VehicleList
from app.schemas.vehicles.services import NewVehicleBody
from app.schemas.vehicles.vehicle import MAX_ID_CHARS, VEHICLE_ID_PATTERN

router = APIRouter(route_class=BoundedRoute, tags=["vehicles"])

AnyId = Annotated[str, Path(max_length=200, description="vehicle id", examples=["hyundai-kona-64"])]
NewId = Annotated[
    str,
    Path(
        pattern=VEHICLE_ID_PATTERN,
        max_length=MAX_ID_CHARS,
        description="lower-case letters and digits, joined by single hyphens",
        examples=["my-compact-car"],
    ),
]


@router.get(
    "/vehicles",
    summary="All vehicles",
    response_model=VehicleList,
    responses={
        200: {"content": {"application/json": {"example": VEHICLE_LIST}}},
        **UNCHANGED,
        **problems("/vehicles", ErrorCode.NOT_READY),
    },
)
def list_vehicles(request: Request, service: RunningService) -> Response:
    """The vehicles that requests can name by id, bundled and stored, in the order of their ids.

    Without the database those that are bundled, with a warning.
    """
    return kept_answer(request, service.list_vehicles())


@router.get(
    "/vehicles/{id}",
    summary="One vehicle with the source of each number",
    response_model=AnyVehicleDetail,
    responses={
        200: {"content": {"application/json": {"example": VEHICLE_DETAIL}}},
        **UNCHANGED,
        **problems(
            "/vehicles/delorean",
            ErrorCode.UNKNOWN_VEHICLE,
            ErrorCode.VEHICLE_DAMAGED,
            ErrorCode.INVALID_REQUEST,
            ErrorCode.DATABASE_UNAVAILABLE,
            ErrorCode.NOT_READY,
        ),
    },
)
def show_vehicle(id: AnyId, request: Request, service: RunningService) -> Response:
    """Every number that the energy model uses.

    Without `id` (and with `sources` or without) the answer can be sent as an inline vehicle, or stored by PUT.
    """
    return kept_answer(request, service.show_vehicle(id))


@router.put(
    "/vehicles/{id}",
    summary="Store a vehicle",
    response_model=AnyVehicleDetail,
    responses={
        200: {
            "description": "It replaced the stored vehicle of this id",
            "content": {"application/json": {"example": VEHICLE_STORED}},
        },
        201: {
            "description": "There was none of this id",
            "model": AnyVehicleDetail,
            "content": {"application/json": {"example": VEHICLE_STORED}},
            "headers": {"Location": {"description": "path of the vehicle", "schema": {"type": "string"}}},
        },
        **problems(
            "/vehicles/my-compact-car",
            ErrorCode.INVALID_REQUEST,
            ErrorCode.MALFORMED_JSON,
            ErrorCode.INVALID_VEHICLE,
            ErrorCode.UNKNOWN_VEHICLE,
            ErrorCode.VEHICLE_IS_BUNDLED,
            ErrorCode.VEHICLE_DAMAGED,
            ErrorCode.BODY_TOO_LARGE,
            ErrorCode.DATABASE_UNAVAILABLE,
            ErrorCode.STORAGE_FULL,
            ErrorCode.NOT_READY,
        ),
    },
)
def put_vehicle(
    id: NewId, sent: Annotated[NewVehicleBody, Body(openapi_examples=VEHICLE_BODIES)], service: RunningService
) -> Response:
    """Stores a vehicle under an id of one's own, in place of the stored one of this id; requests can name it at once.

    The body is what an inline vehicle is, or a vehicle in the parameters of a routing service with its `format`:
    `tomtom`, `here` or `mapbox`. Of the latter the consumption table is stored.

    What the body leaves out is stored as it is now: the default vehicle's acceleration tables (404 or 409 where that
    one can't be read), and the id as its name. Of two that are stored under one id at the same time, one stays whole.
    """
    detail, created = service.put_vehicle(id, sent)
    headers = {"Location": f"/vehicles/{id}"} if created else {}
    return Response(detail.model_dump_json(), 201 if created else 200, headers, media_type=JSON)


@router.delete(
    "/vehicles/{id}",
    summary="Remove a stored vehicle",
    status_code=204,
    response_class=Response,
    responses=problems(
        "/vehicles/delorean",
        ErrorCode.UNKNOWN_VEHICLE,
        ErrorCode.VEHICLE_IS_BUNDLED,
        ErrorCode.INVALID_REQUEST,
        ErrorCode.DATABASE_UNAVAILABLE,
        ErrorCode.STORAGE_FULL,
        ErrorCode.NOT_READY,
    ),
)
def remove_vehicle(id: AnyId, service: RunningService) -> Response:
    """Removes a stored vehicle; bundled ones stay."""
    service.remove_vehicle(id)
    return Response(status_code=204)
