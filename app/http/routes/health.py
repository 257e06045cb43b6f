"""GET /healthz and /readyz."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Depends, Request

from app import VERSION
from app.errors.raised import NotReadyError
from app.http.examples.problems import problems
from app.http.readiness import DatabaseProbe
from app.http.routes.access import RunningService
from app.schemas.health import Alive, DatabaseReadiness, GraphReadiness, Ready
from app.schemas.problem import ErrorCode

router = APIRouter(tags=["health"])


async def database_probe(request: Request) -> DatabaseProbe:
    """What asks the database; raises NotReadyError until graphs are loaded."""
    probe = getattr(request.app.state, "database_probe", None)
    if not isinstance(probe, DatabaseProbe):
        raise NotReadyError
    return probe


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
                        "graphs": [
                            {"name": "coquimbo", "loaded": True, "version": "7cb0db27ec5b211e"},
                            {"name": "highlands", "loaded": True, "version": "af03c910944a816f"},
                        ],
                        "database": {"reachable": False, "reason": "connection refused"},
                        "vehicle_count": 7,
                    }
                }
            }
        },
        **problems("/readyz", ErrorCode.NOT_READY),
    },
)
async def readyz(service: RunningService, probe: Annotated[DatabaseProbe, Depends(database_probe)]) -> Ready:
    """200 once all graphs are loaded and the kernels are compiled, 503 before, with the reason.

    A database that can't be read is named and leaves the service ready: bundled vehicles need none. It is asked at
    most once a second, and for a second at most.
    """
    graphs = [
        GraphReadiness(name=name, loaded=service.atlas.is_loaded(name), version=service.atlas.version(name) or None)
        for name in service.atlas.names
    ]
    missing = [graph.name for graph in graphs if not graph.loaded]
    if missing:
        raise NotReadyError(f"graphs that are not loaded yet: {', '.join(missing)}")
    found = await probe.reachable()
    return Ready(
        version=VERSION,
        graphs=graphs,
        database=DatabaseReadiness(reachable=found.reachable, reason=found.reason),
        vehicle_count=len(service.vehicles),
    )
