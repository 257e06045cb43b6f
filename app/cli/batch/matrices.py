"""Rows of a matrix, searched wherever Dask runs the call."""

from __future__ import annotations

from typing import TYPE_CHECKING

from app.cli.batch.opening import opened_matrix

if TYPE_CHECKING:
    from app.cli.batch.opening import ServiceOrder
    from routing.route.matrix import MatrixRow


def matrix_row(order: ServiceOrder, request: str, idx: int) -> MatrixRow:
    """All drives from one source of a matrix request, as JSON, on the service of an order."""
    return opened_matrix(order, request).part(idx)
