"""The command that proves the diagnosis where what is left out is known, and concealed from it."""

from __future__ import annotations

import json
import os
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Final

import typer
from rich.console import Console
from rich.table import Table

from app.cli.commands.progress import reporter, stage_bars
from app.errors.raised import CommandError
from app.settings import Settings

if TYPE_CHECKING:
    from collections.abc import Sequence

    from proof.figures import Figure
    from proof.runs import Proof, ProofOrder

proving = typer.Typer()

VEHICLE: Final = "bmw-i3-60ah"
DEFAULT_SEED: Final = 20270105  # never used while the diagnosis was tuned


class Worlds(StrEnum):
    """How many worlds a proof has."""

    FULL = "full"
    SMALL = "small"


@proving.command()
def prove(
    *,
    worlds: Annotated[Worlds, typer.Option(help="the whole proof, or a world or two of each kind")] = Worlds.FULL,
    seed: Annotated[int, typer.Option(help="the same seed makes the same worlds", min=0, max=2**31 - 1)] = DEFAULT_SEED,
    recordings: Annotated[
        Path | None,
        typer.Option(
            help="real drives of a BMW i3 60 Ah: with climate columns hidden, and as carriers of added effects",
            metavar="DIR",
        ),
    ] = None,
    processes: Annotated[
        int | None, typer.Option("--workers", help="processes, by default one a core", min=1, max=1024)
    ] = None,
    scheduler: Annotated[
        str | None, typer.Option(help="address of a running Dask scheduler instead", metavar="tcp://HOST:PORT")
    ] = None,
    out: Annotated[
        Path, typer.Option(help="folder for worlds, answers, proof.json and proof.md; taken up again", metavar="DIR")
    ] = Path("build/proof"),
    as_json: Annotated[bool, typer.Option("--json", help="print proof.json instead of tables")] = False,
    export: Annotated[
        Path | None,
        typer.Option(help="only make and seal the worlds into a folder, with a page for other tools", metavar="DIR"),
    ] = None,
    score: Annotated[
        Path | None,
        typer.Option(help="score another tool's answers to the worlds that --export has put into --out", metavar="DIR"),
    ] = None,
) -> None:
    """Prove the diagnosis on sealed worlds whose truth is known, and show every target beside its result."""
    from diagnosis.errors import DiagnosisError
    from proof.plans import full_plan, small_plan
    from proof.runs import ProofOrder
    from proof.runs import prove as carried_out
    from proof.telling import as_json as json_of
    from proof.telling import write_proof

    if score is not None:
        _score(Console(), out, score)
        return
    out = out if export is None else export
    if out.exists() and not out.is_dir():
        raise CommandError(f"--out is {str(out)!r}, allowed: a folder, or nothing there yet")
    if recordings is not None and not recordings.is_dir():
        raise CommandError(f"--recordings is {str(recordings)!r}, allowed: a folder of recordings")
    vehicle = None if recordings is None else Settings().vehicle_dir.resolve() / f"{VEHICLE}.toml"
    drives = None if recordings is None else recordings.resolve()
    order = ProofOrder(
        name=worlds.value,
        plan=full_plan(drives, vehicle) if worlds is Worlds.FULL else small_plan(),
        seed=seed,
        folder=out.resolve(),
        recordings=drives,
        vehicle=vehicle,
        processes=processes or os.cpu_count() or 1,
        scheduler=scheduler,
    )
    if export is not None:
        _export(order)
        return
    try:
        with stage_bars() as bars:
            proof = carried_out(order, reporter(bars))
    except DiagnosisError as error:
        raise CommandError(str(error)) from error
    write_proof(proof, out)
    if as_json:
        typer.echo(json.dumps(json_of(proof), ensure_ascii=False))
        return
    _print(Console(), proof)


def _export(order: ProofOrder) -> None:
    from app.cli.proof_exchange import PAGE_FILE
    from app.cli.proof_exchange import export as exported
    from diagnosis.errors import DiagnosisError

    try:
        with stage_bars() as bars:
            seal = exported(order, reporter(bars))
    except DiagnosisError as error:
        raise CommandError(str(error)) from error
    typer.echo(f"{len(seal.worlds)} worlds in {order.folder}, sealed with {seal.sha256}; see {PAGE_FILE} there")


def _score(console: Console, folder: Path, answers: Path) -> None:
    from app.cli.proof_exchange import score as scored
    from diagnosis.errors import DiagnosisError

    if not answers.is_dir():
        raise CommandError(f"--score is {str(answers)!r}, allowed: a folder of answers, WORLD.json each")
    try:
        figures = scored(folder, answers)
    except DiagnosisError as error:
        raise CommandError(str(error)) from error
    _print_figures(console, [figure for figure in figures if figure.value is not None])


def _print(console: Console, proof: Proof) -> None:
    from proof.telling import COMPARED_HEADER, compared_row, every_figure, summary

    _print_figures(console, every_figure(proof))
    table = _table(f"simpler rules, on {proof.compared_worlds} of the worlds", COMPARED_HEADER)
    for line in proof.compared:
        table.add_row(*compared_row(line))
    console.print(table)
    console.print(summary(proof), markup=False, highlight=False)


def _print_figures(console: Console, figures: Sequence[Figure]) -> None:
    from proof.telling import HEADER, MISSED, figure_row, met_text

    table = _table("proof", HEADER)
    group = ""
    for figure in figures:
        if figure.group != group:
            group = figure.group
            table.add_section()
            table.add_row(group, style="bold")
        table.add_row(*figure_row(figure), style="red" if met_text(figure) == MISSED else "")
    console.print(table)


def _table(title: str, header: tuple[str, ...]) -> Table:
    table = Table(title=title, title_justify="left")
    for k, name in enumerate(header):
        table.add_column(name, justify="right" if 0 < k < 4 else "left")
    return table
