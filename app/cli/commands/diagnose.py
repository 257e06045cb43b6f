"""The command that says where recorded drives and the model differ, and which physics was left out.

What takes long to import is imported when the command runs.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.console import Console

from app.cli.commands.output import GraphOption, service_for
from app.cli.commands.progress import reporter, stage_bars, whole_reporter
from app.errors.raised import CommandError

if TYPE_CHECKING:
    from app.service.service import Service
    from energy.vehicle.vehicle import Vehicle
    from routing.planner import Planner

diagnosing = typer.Typer()


@diagnosing.command()
def diagnose(
    *,
    files: Annotated[
        list[Path],
        typer.Argument(metavar="FILE…", help="recordings: files, folders, or patterns such as 'drives/*.csv'"),
    ],
    vehicle: Annotated[
        str, typer.Option(help="the vehicle that was driven: its id, or its file", metavar="ID|FILE.toml")
    ],
    out: Annotated[
        Path,
        typer.Option(
            help="folder for diagnosis.json, report.html, effects.json and, with a graph, residuals.geojson",
            metavar="DIR",
        ),
    ],
    hide: Annotated[
        list[str] | None,
        typer.Option(help="columns to drop while reading, by name or pattern; repeatable", metavar="COLUMN_GLOB"),
    ] = None,
    holdout: Annotated[
        list[str] | None,
        typer.Option(
            help="trips to keep out of the fit, by id (the file's name without its ending) or pattern; repeatable",
            metavar="TRIP_ID_OR_GLOB",
        ),
    ] = None,
    holdout_fraction: Annotated[
        float, typer.Option(help="share of all trips that is drawn to be kept out as well, 0..0.9", metavar="F")
    ] = 0.0,
    seed: Annotated[int, typer.Option(help="the same seed draws the same", min=0, max=2**31 - 1)] = 1,
    graph: GraphOption = None,
    dem: Annotated[
        list[Path] | None,
        typer.Option(
            help="elevation file for drives without height: GeoTIFF, .hgt or .hgt.zip; repeatable", metavar="TILE"
        ),
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="print diagnosis.json instead of tables")] = False,
) -> None:
    """Find the physics that the model left out on recorded drives, and show what adding it mends."""
    from app.cli.diagnosis_tables import print_diagnosis
    from app.diagnosing.documents import documents_of, write_documents
    from app.diagnosing.order import DiagnosisOrder, carry_out
    from app.diagnosing.places import on_graph
    from app.errors.diagnosing import DiagnosingError
    from diagnosis.errors import DiagnosisError
    from diagnosis.matching.matched_drives import MatchedDrives
    from diagnosis.recordings.files import recording_files

    if out.exists() and not out.is_dir():
        raise CommandError(f"--out is {str(out)!r}, allowed: a folder, or nothing there yet")
    found = recording_files(files)
    if not found:
        raise CommandError(f"no recordings in {', '.join(str(file) for file in files)}")
    service = service_for(graph)
    order = DiagnosisOrder(
        files=tuple(found),
        vehicle=_physical(service, vehicle),
        hidden=tuple(hide or ()),
        held_out=tuple(holdout or ()),
        held_out_frac=holdout_fraction,
        seed=seed,
        dem=tuple(dem or ()),
    )
    planner = None if graph is None else _planner(service)
    drives = None if planner is None else MatchedDrives(planner.graph)
    try:
        with stage_bars() as bars:
            diagnosed = carry_out(order, whole_reporter(bars), drives=drives)
            places: str | None = None
            unmatched: tuple[str, ...] = ()
            if planner is not None and drives is not None:
                laid = on_graph(diagnosed, planner, drives, order.vehicle, reporter(bars))
                diagnosed, places, unmatched = laid.diagnosed, laid.places, laid.unmatched
            documents = documents_of(diagnosed, places=places)
    except (DiagnosisError, DiagnosingError) as error:
        raise CommandError(str(error)) from error
    written = write_documents(out, documents)
    errors = Console(stderr=True)
    warnings = [f"left aside: {refused.error}" for refused in diagnosed.refused]
    for warning in (*warnings, *(f"not on the graph: {trip}" for trip in unmatched)):
        errors.print(f"warning: {warning}", style="yellow", markup=False, highlight=False)
    if as_json:
        typer.echo(json.dumps(json.loads(documents.result), ensure_ascii=False))
        return
    print_diagnosis(Console(), diagnosed.diagnosis)
    Console().print(f"{len(written)} files in {out}", style="dim", markup=False, highlight=False)


def _physical(service: Service, named: str) -> Vehicle:
    """The vehicle of an id or of a TOML file, which has to be given by its physics."""
    from energy.vehicle.files import load_vehicle
    from energy.vehicle.vehicle import Vehicle

    path = Path(named)
    found = load_vehicle(path) if path.suffix == ".toml" else service.known_vehicle(named)
    if not isinstance(found, Vehicle):
        raise CommandError(
            f"--vehicle is {named!r}, a consumption table, allowed: a vehicle that is given by its physics"
        )
    return found


def _planner(service: Service) -> Planner:
    return service.atlas.planner(service.settings.default_graph)
