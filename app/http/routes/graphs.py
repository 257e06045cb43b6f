"""GET /graphs and /graphs/{name}."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Path, Request, Response

from app.http.examples.answers import GRAPH_DETAIL, GRAPH_LIST
from app.http.examples.problems import problems
from app.http.routes.access import UNCHANGED, RunningService, answer, kept_answer
from app.schemas.graph import GraphDetail, GraphList, GraphsReloaded
from app.schemas.problem import ErrorCode

router = APIRouter(tags=["graphs"])


@router.get(
    "/graphs",
    summary="All loaded graphs",
    response_model=GraphList,
    responses={
        200: {"content": {"application/json": {"example": GRAPH_LIST}}},
        **UNCHANGED,
        **problems("/graphs", ErrorCode.NOT_READY),
    },
)
def list_graphs(request: Request, service: RunningService) -> Response:
    """The road networks that requests can name, with the source and licence of their data."""
    return kept_answer(request, service.list_graphs())


@router.get(
    "/graphs/{name}",
    summary="One graph with its extent",
    response_model=GraphDetail,
    responses={
        200: {"content": {"application/json": {"example": GRAPH_DETAIL}}},
        **UNCHANGED,
        **problems("/graphs/atlantis", ErrorCode.UNKNOWN_GRAPH, ErrorCode.INVALID_REQUEST, ErrorCode.NOT_READY),
    },
)
def show_graph(
    name: Annotated[str, Path(max_length=200, description="graph name", examples=["highlands"])],
    request: Request,
    service: RunningService,
) -> Response:
    """Heights, lengths by road class, and what the import left out."""
    return kept_answer(request, service.show_graph(name))


@router.post(
    "/reload",
    summary="Take in graphs that have changed on disk",
    response_model=GraphsReloaded,
    responses={
        200: {
            "content": {
                "application/json": {"example": {"added": ["andorra"], "replaced": [], "removed": [], "refused": []}}
            }
        },
        **problems("/reload", ErrorCode.UNKNOWN_GRAPH, ErrorCode.GRAPH_DAMAGED, ErrorCode.NOT_READY),
    },
)
def reload_graphs(service: RunningService) -> Response:
    """Graphs that were added, replaced or removed since; requests under way end on what they began with.

    One that can't be read is refused, and an earlier version of it stays. Where the default graph is gone, or a folder
    can't be looked through, nothing changes.
    """
    return answer(service.reload_graphs())
