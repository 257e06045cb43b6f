"""Options for the form of answers: formats, chosen parts, short lines."""

from __future__ import annotations

from typing import Annotated, Any

import typer

from app.errors.raised import CommandError
from app.schemas.lean.formats import AnswerFormat

RouteFormatOption = Annotated[
    AnswerFormat | None,
    typer.Option("--format", help="print the answer in a format", metavar="json|geojson|gpx|kml|parquet|csv"),
]
RangeFormatOption = Annotated[
    AnswerFormat | None,
    typer.Option("--format", help="print the answer in a format", metavar="geojson|kml|parquet"),
]
MatrixFormatOption = Annotated[
    AnswerFormat | None,
    typer.Option("--format", help="print the answer in a format", metavar="json|csv|parquet"),
]
GeometryFormatOption = Annotated[
    str, typer.Option("--geometry-format", help="of lines in JSON", metavar="geojson|polyline5|polyline6")
]
OverviewOption = Annotated[str, typer.Option("--overview", help="how much of lines", metavar="full|simplified|none")]
FieldsOption = Annotated[
    str | None,
    typer.Option("--fields", help="only these parts of JSON and GeoJSON", metavar="routes.distance_m,…"),
]
CompactOption = Annotated[
    bool | None,
    typer.Option("--compact/--full-digits", help="six digits and no energies of 0; so in GeoJSON unless said"),
]
StepsOption = Annotated[bool, typer.Option("--steps", help="what a driver is told along each route")]
LinksOption = Annotated[bool, typer.Option("--links/--no-links", help="with each link of a route")]
ToleranceOption = Annotated[
    float | None,
    typer.Option("--tolerance-m", help="how far outlines may be moved for fewer points; 0 for none", metavar="M"),
]


def asked_parts(fields: str | None, compact: bool | None) -> dict[str, Any]:
    """The members of a request that say which parts its answer has, and in how many digits."""
    return {"fields": None if fields is None else fields.split(","), "compact": compact}


def chosen_format(form: AnswerFormat | None, as_json: bool, offered: tuple[AnswerFormat, ...]) -> AnswerFormat | None:
    """The format to print, None for tables; --json is that of HTTP without a format. Raises CommandError."""
    if as_json and form not in (None, offered[0]):
        raise CommandError(f"--json is set, allowed: without --format {form}")
    if form is not None and form not in offered:
        raise CommandError(f"--format is {form.value!r}, allowed: {', '.join(offered)}")
    return offered[0] if as_json else form


def print_bytes(document: bytes) -> None:
    """Print an answer as it is; with an end of line where it is text."""
    typer.echo(document, nl=not document.startswith(b"PAR1") and not document.endswith(b"\n"))
