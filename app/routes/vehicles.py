"""GET /vehicles and /vehicles/{id}."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Path, Response

from app.examples import VEHICLE_DETAIL, VEHICLE_LIST
from app.examples.problems import problems
from app.routes.access import RunningService, answer
from app.schemas.problem import ErrorCode
from app.schemas.vehicle import VehicleDetail, VehicleList

router = APIRouter(tags=["vehicles"])


@router.get(
    "/vehicles",
    summary="All vehicles",
    response_model=VehicleList,
    responses={
        200: {"content": {"application/json": {"example": VEHICLE_LIST}}},
        **problems("/vehicles", ErrorCode.NOT_READY),
    },
)
def list_vehicles(service: RunningService) -> Response:
    """The vehicles that requests can name by id, in the order of their ids."""
    return answer(service.list_vehicles())


@router.get(
    "/vehicles/{id}",
    summary="One vehicle with the source of each number",
    response_model=VehicleDetail,
    responses={
        200: {"content": {"application/json": {"example": VEHICLE_DETAIL}}},
        **problems("/vehicles/delorean", ErrorCode.UNKNOWN_VEHICLE, ErrorCode.INVALID_REQUEST, ErrorCode.NOT_READY),
    },
)
def show_vehicle(
    id: Annotated[str, Path(max_length=200, description="vehicle id", examples=["hyundai-kona-64"])],
    service: RunningService,
) -> Response:
    """Every number that the energy model uses.

    Without `id` and `sources` the answer can be sent as an inline vehicle.
    """
    return answer(service.show_vehicle(id))
