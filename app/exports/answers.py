"""Answers in the format that is asked for, beside JSON and GeoJSON."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from app.conversions.lean.selection import lean_answer
from app.exports.files import links_csv, pairs_csv, pairs_parquet, range_geoparquet, route_geoparquet
from app.exports.gpx import route_gpx
from app.exports.kml import range_kml, route_kml
from app.schemas.as_json import as_json
from app.schemas.lean.formats import AnswerFormat

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from app.exports.content import RangeContent, RouteContent
    from app.schemas.matrix import MatrixResponse

ROUTE_FILES: Final[Mapping[AnswerFormat, Callable[[RouteContent], bytes]]] = {
    AnswerFormat.GPX: route_gpx,
    AnswerFormat.KML: route_kml,
    AnswerFormat.PARQUET: route_geoparquet,
    AnswerFormat.CSV: links_csv,
}
RANGE_FILES: Final[Mapping[AnswerFormat, Callable[[RangeContent], bytes]]] = {
    AnswerFormat.KML: range_kml,
    AnswerFormat.PARQUET: range_geoparquet,
}
MATRIX_FILES: Final[Mapping[AnswerFormat, Callable[[MatrixResponse], bytes]]] = {
    AnswerFormat.CSV: pairs_csv,
    AnswerFormat.PARQUET: pairs_parquet,
}


def matrix_in(form: AnswerFormat, answer: MatrixResponse) -> bytes:
    """A matrix in one of MATRIX_FORMATS."""
    if form is AnswerFormat.JSON:
        return as_json(lean_answer(answer, answer.request.fields, answer.request.compact))
    return MATRIX_FILES[form](answer)
