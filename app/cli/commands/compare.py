"""The command that holds simulated trips beside measured ones.

What takes long to import is imported when the command runs.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.console import Console
from rich.table import Table

from app.errors.raised import CommandError

if TYPE_CHECKING:
    from diagnosis.comparison.comparison import SeriesComparison

comparing = typer.Typer()


@comparing.command()
def compare(
    *,
    trips: Annotated[
        list[Path],
        typer.Argument(
            metavar="TRIPS…",
            help="tables of trips, .csv or .json: trip,type,series,distance_km,duration_s,stops,standstill_s,energy_kwh"
            "[,mass_kg]",
        ),
    ],
    out: Annotated[Path, typer.Option(help="folder for comparison.json, tables.md, trips.csv and pictures")],
    measured: Annotated[str, typer.Option(help="the series that the others are held against", metavar="NAME")] = (
        "measured"
    ),
    as_json: Annotated[bool, typer.Option("--json", help="print comparison.json instead of tables")] = False,
) -> None:
    """Errors of simulated trips against measured ones, with their statistics."""
    from diagnosis.comparison.comparison import compare as compare_trips
    from diagnosis.comparison.report import comparison_figures, write_comparison
    from diagnosis.comparison.tables import paired_test_sentence, partner_sentences
    from diagnosis.comparison.trips import read_trips
    from diagnosis.errors import DiagnosisError

    errors = Console(stderr=True)
    try:
        records = read_trips(trips)
        comparison = compare_trips(records, measured)
        with errors.status("drawing"):
            written = write_comparison(out, comparison, records)
    except DiagnosisError as error:
        raise CommandError(str(error)) from error
    for series in comparison.series:
        for sentence in partner_sentences(comparison.measured, series):
            errors.print(f"warning: {series.series}: {sentence}", style="yellow", markup=False, highlight=False)
    if as_json:
        typer.echo(json.dumps(comparison_figures(comparison), ensure_ascii=False, allow_nan=False))
        return
    console = Console()
    for series in comparison.series:
        for table in _tables(series):
            console.print(table)
        console.print(paired_test_sentence(series.paired_test), markup=False, highlight=False)
    console.print(f"{len(written)} files in {out}", style="dim", markup=False, highlight=False)


def _tables(series: SeriesComparison) -> list[Table]:
    from rich.markup import escape

    from diagnosis.comparison.tables import error_rows, overall_rows, spread_rows

    name = escape(series.series)
    errors = Table("mean error", title=f"{name}: {len(series.pairs)} trips")
    for kind in series.types:
        errors.add_column(escape(kind.route_type), justify="right")
    for row in error_rows(series):
        errors.add_row(*row)
    spread = Table("energy error", title=name)
    for heading in ("trips", "mean", "SD", "population SD", "range"):
        spread.add_column(heading, justify="right")
    for row in spread_rows(series):
        spread.add_row(*map(escape, row))
    overall = Table("energy error of all trips", title=name)
    overall.add_column(no_wrap=True)
    for row in overall_rows(series.energy_error):
        overall.add_row(*row)
    return [errors, spread, overall]
