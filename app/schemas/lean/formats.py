"""The formats that answers come in, and which of them a client wants."""

from __future__ import annotations

from enum import StrEnum
from typing import TYPE_CHECKING, Final, Literal

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence


class AnswerFormat(StrEnum):
    """A format of answers."""

    JSON = "json"
    GEOJSON = "geojson"
    GPX = "gpx"
    KML = "kml"
    PARQUET = "parquet"
    CSV = "csv"


# the first of each is what is answered where nothing is asked for
ROUTE_FORMATS: Final = tuple(AnswerFormat)
RANGE_FORMATS: Final = (AnswerFormat.GEOJSON, AnswerFormat.KML, AnswerFormat.PARQUET)
MATRIX_FORMATS: Final = (AnswerFormat.JSON, AnswerFormat.CSV, AnswerFormat.PARQUET)
RangeFormat = Literal[AnswerFormat.GEOJSON, AnswerFormat.KML, AnswerFormat.PARQUET]
MatrixFormat = Literal[AnswerFormat.JSON, AnswerFormat.CSV, AnswerFormat.PARQUET]
MEDIA_TYPES: Final[Mapping[AnswerFormat, str]] = {
    AnswerFormat.JSON: "application/json",
    AnswerFormat.GEOJSON: "application/geo+json",
    AnswerFormat.GPX: "application/gpx+xml",
    AnswerFormat.KML: "application/vnd.google-earth.kml+xml",
    AnswerFormat.PARQUET: "application/vnd.apache.parquet",
    AnswerFormat.CSV: "text/csv; charset=utf-8",
}


def accepted_format(accept: str, offered: Sequence[AnswerFormat]) -> AnswerFormat:
    """The format that an Accept header ranks highest; the first one offered where it names none of them.

    Of two that are wanted as much the first in the header (RFC 9110 section 12.5.1).
    """
    by_name = {MEDIA_TYPES[form].partition(";")[0]: form for form in offered}
    best, best_rank = offered[0], 0.0
    for part in accept.split(","):
        name, *parameters = (piece.strip().lower() for piece in part.split(";"))
        rank = _quality(parameters)
        if name in by_name and rank > best_rank:
            best, best_rank = by_name[name], rank
    return best


def _quality(parameters: list[str]) -> float:
    for parameter in parameters:
        if parameter.startswith("q="):
            try:
                return float(parameter[2:])
            except ValueError:
                return 0.0
    return 1.0
