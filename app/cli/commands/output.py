"""What commands share: the service they ask, their options, and how they print."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, TypeVar

import typer
from pydantic import BaseModel
from rich.console import Console

from app.cli import tables
from app.settings import Settings
from routing.errors import GraphNotFoundError

if TYPE_CHECKING:
    from collections.abc import Callable

    from rich.table import Table

    from app.schemas.graph import TerrainNote
    from app.schemas.places.named import PlaceNamed
    from app.service.service import Service
    from app.sharing.sources import GraphsOnDisk

Shown = TypeVar("Shown", bound=BaseModel)
GraphOption = Annotated[str | None, typer.Option("--graph", help="name of a graph, or its folder", metavar="NAME|DIR")]
JsonOption = Annotated[bool, typer.Option("--json", help="print what HTTP would answer")]


def service_for(graph: str | None) -> Service:
    """The service on the stored graphs, or on the one graph of a folder, which then is the default."""
    from app.service.service import Service

    service = Service(*settings_for(graph))
    if graph is not None and service.settings.default_graph not in service.atlas.names:
        raise GraphNotFoundError(graph, service.atlas.names)
    return service


def settings_for(graph: str | None) -> tuple[Settings, GraphsOnDisk]:
    """Settings and graphs, all stored ones, or the one graph of a folder; the default is the one that was asked for."""
    from app.sharing.sources import GraphsOnDisk, folders_on_disk
    from routing.graph.files import load_meta
    from routing.graph.folders import graph_folders

    settings = Settings()
    stored = GraphsOnDisk(lambda: graph_folders(settings.graph_dirs))
    if graph is None:
        return settings, stored
    folder = Path(graph)
    if (folder / "meta.json").is_file() or (folder.is_dir() and len(folder.parts) > 1):
        name = load_meta(folder).name
        return settings.model_copy(update={"default_graph": name}), folders_on_disk({name: folder})
    return settings.model_copy(update={"default_graph": graph}), stored


def print_json(answer: BaseModel) -> None:
    """Print what HTTP would answer."""
    typer.echo(answer.model_dump_json())


def show(answer: Shown, table: Callable[[Shown], Table], as_json: bool) -> None:
    """Print an answer as JSON or as a table."""
    if as_json:
        print_json(answer)
    else:
        Console().print(table(answer))


def print_changes(console: Console, lines: list[str]) -> None:
    """Print what learned effects change of an answer."""
    for line in lines:
        console.print(line, style="cyan", markup=False, highlight=False, soft_wrap=True)


def print_notes(console: Console, terrain: TerrainNote | None, warnings: list[str]) -> None:
    """Print the data that an answer rests on; warnings go to stderr."""
    if terrain is not None:
        console.print(tables.terrain_line(terrain), style="dim", markup=False, highlight=False)
    errors = Console(stderr=True)
    for warning in warnings:
        errors.print(f"warning: {warning}", style="yellow", markup=False, highlight=False)


def print_places(places: list[PlaceNamed]) -> None:
    """Print what texts were taken for, and what else they may mean."""
    console = Console(soft_wrap=True)
    for place in places:
        number = f", no number {place.asked_number}" if place.asked_number else ""
        near = f", at the nearest, {place.nearest_number}" if place.nearest_number else ""
        said = f"{place.field}: {place.label} ({place.lat:.5f}, {place.lon:.5f}{number}{near})"
        console.print(said, style="dim", markup=False, highlight=False)
        for other in place.alternatives:
            other_said = f"  or: {other.label} ({other.lat:.5f}, {other.lon:.5f})"
            console.print(other_said, style="dim", markup=False, highlight=False)
