"""GET /metrics."""

from __future__ import annotations

from typing import Final

from fastapi import APIRouter, Request, Response

from app.http.examples.problems import problems
from app.http.metrics import MEDIA_TYPE, Metrics
from app.schemas.problem import ErrorCode

router = APIRouter(tags=["health"])

EXAMPLE: Final = """# HELP joulepath_labels_settled_total Labels settled by searches
# TYPE joulepath_labels_settled_total counter
joulepath_labels_settled_total{endpoint="/route"} 1882.0
"""


@router.get(
    "/metrics",
    summary="Figures for Prometheus",
    response_class=Response,
    responses={
        200: {
            "description": "The text format of Prometheus",
            "content": {"text/plain": {"schema": {"type": "string"}, "example": EXAMPLE}},
        },
        **problems("/metrics", ErrorCode.NOT_READY),
    },
)
async def show_metrics(request: Request) -> Response:
    """Times by endpoint and stage, labels settled, what waits and runs, what is kept in memory, the process.

    Also while graphs are being loaded, then without what has not begun.
    """
    metrics: Metrics = request.app.state.metrics
    return Response(await metrics.text(), media_type=MEDIA_TYPE)
