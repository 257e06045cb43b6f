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
    """The format that an Accept header ranks highest (RFC 9110 section 12.5.1); the first one where it takes none.

    Of those that are wanted as much, the first that the header names, then the first that is offered.
    """
    wanted: dict[str, tuple[float, int]] = {}
    for position, part in enumerate(accept.split(",")):
        name, *parameters = (piece.strip().lower() for piece in part.split(";"))
        wanted.setdefault(name, (_quality(parameters), -position))
    best, best_rank = offered[0], (0.0, 0)
    for form in offered:
        name = MEDIA_TYPES[form].partition(";")[0]
        any_of_type = f"{name.partition('/')[0]}/*"
        quality, place = wanted.get(name) or (wanted.get(any_of_type, wanted.get("*/*", (0.0, 0)))[0], -len(wanted) - 1)
        if quality > 0.0 and (quality, place) > best_rank:
            best, best_rank = form, (quality, place)
    return best


def _quality(parameters: list[str]) -> float:
    for parameter in parameters:
        if parameter.startswith("q="):
            try:
                quality = float(parameter[2:])
            except ValueError:
                return 0.0
            return quality if 0.0 <= quality <= 1.0 else 0.0
    return 1.0
