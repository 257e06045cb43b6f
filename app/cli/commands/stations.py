"""Commands that bring charging stations into graphs, and list them."""

from __future__ import annotations

from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.console import Console

from app.cli.commands.output import GraphOption, JsonOption, print_json, service_for
from app.cli.station_tables import report_lines, stations_table
from app.stations.parameters import MOST_STATIONS, StationParameters

if TYPE_CHECKING:
    from routing.stations.importing import ReadSource

stations = typer.Typer(no_args_is_help=True, help="The charging stations of graphs.")


@stations.command("import")
def import_stations(
    files: Annotated[
        list[Path], typer.Argument(metavar="FILE...", help="files of stations, in any format that is read")
    ],
    graph: Annotated[str, typer.Option("--graph", help="name of a graph, or its folder", metavar="NAME|DIR")],
    *,
    replace: Annotated[
        bool,
        typer.Option("--replace/--merge", help="keep no other stations of the graph, or those of other sources"),
    ] = False,
) -> None:
    """Bring stations of files into a graph: placed on its roads, those told twice united.

    Formats: OpenStreetMap, Open Charge Map, OCPI, registers of Germany and the United States, GeoJSON, CSV. By default
    the graph's stations of the same source are replaced and those of others stay. Nothing is written when it fails,
    nor where none of the stations is near a road.
    """
    from routing.graph.files import load_graph
    from routing.stations.files import load_stations, save_stations
    from routing.stations.importing import bring_in
    from routing.stations.notes import StationFileError

    service = service_for(graph)
    folder = service.atlas.folder(service.settings.default_graph)
    read = [_read(path) for path in files]
    roads = load_graph(folder)
    before = None if replace else load_stations(folder, roads)
    kept, report = bring_in(roads, read, before)
    fresh = {part.source.key for part in read}
    if not report.united and not any(station.source in fresh for station in kept.stations):
        west, south, east, north = roads.meta.bbox
        found = "; ".join(f"{reason}: {count}" for reason, count in report.left_out.items())
        allowed = f"at least one near a road within lat {south:g}..{north:g}, lon {west:g}..{east:g}; are they swapped?"
        raise StationFileError(", ".join(map(str, files)), "", "every station", f"left out ({found})", allowed)
    save_stations(folder, roads, kept)
    console = Console(stderr=True, soft_wrap=True)
    console.print(f"{folder}: {report.kept} stations", highlight=False, markup=False)
    for line in report_lines(kept, report, read):
        console.print(f"  {line}", style="dim", highlight=False, markup=False)


@stations.command("list")
def list_stations(
    graph: GraphOption = None,
    *,
    bbox: Annotated[str | None, typer.Option(help="west,south,east,north [deg]")] = None,
    connectors: Annotated[str | None, typer.Option(help="with one of these plugs, such as ccs2,type2")] = None,
    min_power_kw: Annotated[float, typer.Option(help="least output of a socket [kW]")] = 0.0,
    network: Annotated[str | None, typer.Option(help="a part of the name of its network or operator")] = None,
    access: Annotated[str | None, typer.Option(help="who may charge there, such as public,customers")] = None,
    open_at: Annotated[datetime | None, typer.Option(help="local time at which it is not known to be closed")] = None,
    limit: Annotated[int, typer.Option(help="stations at most", min=1, max=MOST_STATIONS)] = 50,
    as_json: JsonOption = False,
) -> None:
    """The stations of a graph."""
    service = service_for(graph)
    sent = StationParameters(
        bbox=bbox,
        connectors=connectors,
        min_power_kw=min_power_kw,
        network=network,
        access=access,
        open_at=open_at,
        limit=limit,
    )
    found = service.stations(service.settings.default_graph).collection(sent)
    if as_json:
        print_json(found)
        return
    Console().print(stations_table(found))
    console = Console(soft_wrap=True)
    more = f", the first {found.returned} are shown" if found.returned < found.matched else ""
    console.print(f"{found.matched} stations{more}", style="dim", highlight=False)
    for source in found.sources:
        console.print(f"{source.key}: {source.name}, {source.licence}", style="dim", markup=False, highlight=False)
    for warning in found.warnings:
        Console(stderr=True).print(f"warning: {warning}", style="yellow", markup=False, highlight=False)


def _read(path: Path) -> ReadSource:
    """The stations of a file of any format."""
    from routing.stations.formats.osm.reading import is_osm, read_osm_stations
    from routing.stations.reading import read_stations

    return read_osm_stations(path) if is_osm(path) else read_stations(path)
