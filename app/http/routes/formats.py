"""How endpoints are asked for formats, and how the OpenAPI document shows files."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any, Final

from fastapi import Header, Query

from app.schemas.lean.formats import MEDIA_TYPES, AnswerFormat, MatrixFormat, RangeFormat

if TYPE_CHECKING:
    from collections.abc import Iterable

FORMAT_MEANS: Final = "format of the answer, whatever Accept says"
RouteFormatAsked = Annotated[AnswerFormat | None, Query(alias="format", description=FORMAT_MEANS)]
RangeFormatAsked = Annotated[RangeFormat | None, Query(alias="format", description=FORMAT_MEANS)]
MatrixFormatAsked = Annotated[MatrixFormat | None, Query(alias="format", description=FORMAT_MEANS)]
Accepted = Annotated[
    str,
    Header(description="media type of the answer, such as application/gpx+xml", examples=["application/json"]),
]
EXAMPLES: Final = {
    AnswerFormat.GPX: '<?xml version="1.0" encoding="UTF-8"?>\n<gpx version="1.1" creator="joulepath">…</gpx>',
    AnswerFormat.KML: '<?xml version="1.0" encoding="UTF-8"?>\n<kml><Document>…</Document></kml>',
    AnswerFormat.PARQUET: "PAR1…",
    AnswerFormat.CSV: "route,id,from_m,to_m,…",
}


def file_contents(forms: Iterable[AnswerFormat]) -> dict[str, Any]:
    """The files among formats, by media type, as the OpenAPI document has them."""
    binary = {"type": "string", "format": "binary"}
    return {
        MEDIA_TYPES[form].partition(";")[0]: {
            "schema": binary if form is AnswerFormat.PARQUET else {"type": "string"},
            "example": EXAMPLES[form],
        }
        for form in forms
        if form in EXAMPLES
    }
