"""A matrix request as work in parts: one row a source."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from app.conversions.matrix import matrix_response
from app.observation import Stage, note_labels, stage
from routing.errors import QueryError

if TYPE_CHECKING:
    from collections.abc import Sequence

    from app.schemas.matrix import MatrixRequest, MatrixResponse
    from routing.graph.road_graph import RoadGraph
    from routing.route.matrix import MatrixRow, MatrixSearch


@dataclass(frozen=True, slots=True)
class MatrixWork:
    """A matrix to be searched row by row (PartedWork); warnings: of the request, besides those of the search."""

    search: MatrixSearch
    understood: MatrixRequest
    graph: RoadGraph
    warnings: tuple[str, ...] = ()

    @property
    def part_count(self) -> int:
        """Rows, one a source."""
        return self.search.row_count

    def part(self, idx: int) -> MatrixRow:
        """All drives from one source."""
        with stage(Stage.SEARCH):
            row = self.search.row(idx)
        note_labels(row.labels_settled)
        return row

    def whole(self, parts: Sequence[MatrixRow]) -> MatrixResponse:
        """The answer of all rows, in the order of the sources."""
        answer = self.search.answer(parts)
        return matrix_response(
            replace(answer, warnings=(*self.warnings, *answer.warnings)), self.understood, self.graph
        )


def check_places(sent: MatrixRequest, most: int) -> None:
    """Raise QueryError where a request has more sources or targets than a service allows."""
    for field, places in (("sources", sent.sources), ("targets", sent.targets or [])):
        if len(places) > most:
            raise QueryError(field, f"a list of {len(places)}", f"at most {most} (JOULEPATH_MATRIX_LIMIT_PLACES)")
