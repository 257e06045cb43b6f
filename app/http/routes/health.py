"""GET /healthz and /readyz."""

from __future__ import annotations

from fastapi import APIRouter

from app import VERSION
from app.http.examples.problems import problems
from app.http.routes.access import RunningService
from app.schemas.health import Alive, Ready
from app.schemas.problem import ErrorCode

router = APIRouter(tags=["health"])


@router.get(
    "/healthz",
    summary="Whether the process lives",
    response_model=Alive,
    responses={200: {"content": {"application/json": {"example": {"status": "ok"}}}}},
)
async def healthz() -> Alive:
    """Always 200 while the process answers."""
    return Alive()


@router.get(
    "/readyz",
    summary="Whether requests can be answered",
    response_model=Ready,
    responses={
        200: {
            "content": {
                "application/json": {
                    "example": {
                        "status": "ready",
                        "version": "0.1.0",
                        "graphs": ["coquimbo", "highlands"],
                        "vehicle_count": 7,
                    }
                }
            }
        },
        **problems("/readyz", ErrorCode.NOT_READY),
    },
)
async def readyz(service: RunningService) -> Ready:
    """200 once all graphs are loaded and the kernels are compiled, 503 before."""
    return Ready(version=VERSION, graphs=list(service.atlas.names), vehicle_count=len(service.vehicles))
