"""Commands that make, list and export graphs."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.console import Console

from app.cli import tables
from app.cli.commands.output import JsonOption, service_for, show
from app.cli.commands.places import say_places
from app.cli.commands.progress import reporter, stage_bars
from app.cli.station_tables import report_lines
from app.errors.raised import CommandError
from app.schemas.graph import GraphFolder, StoredGraphs
from app.settings import Settings
from energy.folders import user_graphs_folder
from routing.graph.sealed import META_FILE, GraphFiles

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from routing.graph.road_graph import CutOffPart, RoadGraph
    from routing.ground.making import GroundBeside
    from routing.stations.importing import StationsBeside

graphs = typer.Typer(no_args_is_help=True, help="The road networks that requests can name.")
making = typer.Typer()

NameOption = Annotated[str | None, typer.Option("--name", help="name of the graph, by default that of its folder")]
OutOption = Annotated[
    Path | None,
    typer.Option(
        "--out",
        help="folder that the graph is written to; by default, one of its name where `graphs list` looks first",
        metavar="DIR",
    ),
]


@making.command("import")
def import_map(
    map_path: Annotated[Path, typer.Argument(metavar="MAP", help="OpenStreetMap PBF, or GraphML as OSMnx writes it")],
    more_dem: Annotated[list[Path] | None, typer.Argument(metavar="[TILE]...", help="further elevation files")] = None,
    *,
    out: OutOption = None,
    dem: Annotated[
        list[Path] | None, typer.Option(help="elevation file: GeoTIFF, .hgt or .hgt.zip", metavar="TILE…")
    ] = None,
    name: NameOption = None,
    smoothing_m: Annotated[float | None, typer.Option(help="smoothing of heights along the road [m]")] = None,
    ferries: Annotated[
        bool, typer.Option("--ferries", help="bring in ferries that take cars: time on board, no energy")
    ] = False,
) -> None:
    """Import a region: map and elevation files in, a graph folder out. Nothing is written when it fails."""
    from routing.gazetteer.making import places_beside
    from routing.gazetteer.osm import PlaceReader
    from routing.graph.files import save_graph
    from routing.ground.making import ground_beside
    from routing.ground.osm import GroundReader
    from routing.importers.beside import ReadTogether
    from routing.importers.region import DEFAULT_SMOOTHING_M, import_region
    from routing.stations.importing import stations_beside

    reader, ground_reader = PlaceReader(), GroundReader()
    tiles = [*(dem or []), *(more_dem or [])]
    length_m = DEFAULT_SMOOTHING_M if smoothing_m is None else smoothing_m
    place = out or _own_folder(name or map_path.name.partition(".")[0])
    with stage_bars() as progress:
        graph = import_region(
            map_path,
            tiles,
            name or place.name,
            smoothing_m=length_m,
            ferries=ferries,
            beside=ReadTogether(reader, ground_reader),
            progress=reporter(progress),
        )
        stations = stations_beside(map_path, graph, place)
        report = reporter(progress)
        report("index places", 0.0)
        found = reader.found if reader.found.pieces else None  # a GraphML has nothing but its roads
        beside = places_beside(graph, stations.stations, found)
        report("index places", 1.0)
        report("draw ground", 0.0)
        ground = ground_beside(graph, ground_reader.found)
        report("draw ground", 1.0)
    save_graph(graph, place, {**stations.files, **beside.files, **ground.files})
    _say_written(place, graph.node_count, graph.road_link_count, graph.meta.dropped)
    _say_stations(stations)
    say_places(beside.counts, beside.left_out, beside.size_bytes)
    _say_ground(ground)
    _say_cut_off(graph.meta.cut_off)
    _say_cut_roads(None if graph.cut_node is None else graph.cut_node.size)
    _say_ferries(graph)


@making.command()
def synth(
    *,
    out: OutOption = None,
    name: NameOption = None,
    seed: Annotated[int, typer.Option(help="the same seed makes the same graph")] = 1,
    links: Annotated[int, typer.Option(help="directed links, about")] = 45_000,
    width_km: Annotated[
        float | None, typer.Option("--width-km", help="from west to east [km]; by default as large as the links need")
    ] = None,
    height_km: Annotated[float | None, typer.Option("--height-km", help="from south to north [km]")] = None,
) -> None:
    """Make a synthetic region with towns, motorways and passes."""
    from routing.gazetteer.making import places_beside
    from routing.graph.files import save_graph
    from routing.stations.files import STATIONS_FILE, stations_bytes
    from routing.synth import synthesize
    from routing.synth.stations import synthetic_stations

    place = out or _own_folder(f"synthetic-{seed}" if name is None else name)
    with stage_bars() as progress:
        try:
            graph = synthesize(
                name or place.name,
                seed=seed,
                width_km=width_km,
                height_km=height_km,
                links_target=links,
                progress=reporter(progress),
            )
        except ValueError as error:
            raise CommandError(str(error)) from error
    stations = synthetic_stations(graph, seed)
    beside = places_beside(graph, stations, None)
    save_graph(graph, place, {STATIONS_FILE: stations_bytes(graph, stations), **beside.files})
    _say_written(place, graph.node_count, graph.link_count, graph.meta.dropped)
    Console(stderr=True).print(f"  charging stations: {len(stations.stations)}", style="dim", highlight=False)


@graphs.command("list")
def list_graphs(as_json: JsonOption = False) -> None:
    """All graphs, and the folders that they are looked for in."""
    service = service_for(None)
    folders = [GraphFolder(path=str(parent), exists=os.path.isdir(parent)) for parent in service.settings.graph_dirs]
    listed = service.list_graphs()
    paths = {name: str(service.atlas.folder(name)) for name in service.atlas.names}
    answer = StoredGraphs(graphs=listed.graphs, default=listed.default, folders=folders, paths=paths)
    show(answer, tables.graphs_table, as_json)
    if not as_json:
        console = Console(soft_wrap=True)
        console.print("folders with graphs, the first of a name wins:", style="dim", highlight=False)
        for folder in folders:
            missing = "" if folder.exists else " (does not exist yet)"
            console.print(f"  {folder.path}{missing}", style="dim", markup=False, highlight=False)


@graphs.command("show")
def show_graph(name: Annotated[str, typer.Argument(metavar="NAME|DIR")], as_json: JsonOption = False) -> None:
    """One graph with its extent."""
    service = service_for(name)
    show(service.show_graph(service.settings.default_graph), tables.graph_table, as_json)


@graphs.command("check")
def check_graphs(
    names: Annotated[list[str] | None, typer.Argument(metavar="[NAME|DIR]...", help="without, all graphs")] = None,
) -> None:
    """Hold stored graphs against the hashes of their files and their parts against each other; 1 where one is wrong."""
    from routing.errors import GraphFormatError
    from routing.graph.files import load_version
    from routing.graph.folders import graph_folders
    from routing.ground.files import open_ground
    from routing.stations.files import load_stations

    known = {} if names else graph_folders(Settings().graph_dirs)
    for name in names or ():
        folder = Path(name)
        is_folder = (folder / META_FILE).is_file() or len(folder.parts) > 1
        known[name] = folder if is_folder else service_for(name).atlas.folder(name)
    wrong = 0
    for name, folder in known.items():
        try:
            graph, version = load_version(folder)
            stations = len(load_stations(folder, graph).stations)
            open_ground(folder)
        except GraphFormatError as error:
            wrong += 1
            Console(stderr=True, soft_wrap=True).print(f"{name}: {error}", style="red", markup=False, highlight=False)
            continue
        sealed = "as it was written" if GraphFiles(folder).sealed else "fits together; it has no hashes, import it anew"
        said = f"{name}: {sealed}, version {version}, {graph.link_count} directed links"
        said += f", {stations} charging stations" if stations else ""
        Console(soft_wrap=True).print(said, markup=False, highlight=False)
    if wrong:
        raise typer.Exit(1)


@graphs.command("export")
def export_graph(
    name: Annotated[str, typer.Argument(metavar="NAME|DIR")],
    out: Annotated[Path, typer.Argument(metavar="OUT.graphml")],
) -> None:
    """Write a graph as GraphML that OSMnx and `joulepath import` read."""
    from routing.graph.networkx_graph import write_graphml

    service = service_for(name)
    write_graphml(service.atlas.planner(service.settings.default_graph).graph, out)
    Console(stderr=True).print(f"{out} written", highlight=False)


def _own_folder(name: str) -> Path:
    """Where a graph goes without --out: the first folder that graphs are looked for in, the user's own by default."""
    if not name or name in {".", ".."} or Path(name).name != name:
        raise CommandError(f"--name is {name!r}, allowed without --out: the name of a folder")
    parent = next(iter(Settings().graph_dirs), user_graphs_folder())
    parent.mkdir(parents=True, exist_ok=True)  # where that can't be, it is better said before the work than after it
    return parent / name


def _say_written(out: Path, nodes: int, links: int, dropped: Mapping[str, int]) -> None:
    console = Console(stderr=True, soft_wrap=True)
    console.print(f"{out}: {nodes} nodes, {links} directed links", highlight=False)
    for reason, count in dropped.items():
        console.print(f"  left out, {reason}: {count}", style="dim", highlight=False)


def _say_stations(beside: StationsBeside) -> None:
    console = Console(stderr=True, soft_wrap=True)
    if beside.problem:
        said = f"the stations that the graph had can't be read, and are not kept: {beside.problem}"
        console.print(said, style="yellow", markup=False, highlight=False)
    if not beside.files:
        return
    console.print(f"  charging stations: {beside.report.kept}", style="dim", highlight=False)
    for line in report_lines(beside.stations, beside.report, beside.read):
        console.print(f"    {line}", style="dim", markup=False, highlight=False)


def _say_ground(beside: GroundBeside) -> None:
    console = Console(stderr=True, soft_wrap=True)
    counts = ", ".join(f"{layer} {count}" for layer, count in beside.counts.items()) or "none in the map"
    size = f" ({beside.size_bytes / 1e6:.1f} MB)" if beside.files else ""
    console.print(f"  ground: {counts}{size}", style="dim", highlight=False)
    for reason, count in beside.left_out.items():
        console.print(f"    left out, {reason}: {count}", style="dim", markup=False, highlight=False)


def _say_cut_roads(places: int | None) -> None:
    where = "the file does not say" if places is None else f"at {places} place{'' if places == 1 else 's'}"
    Console(stderr=True).print(f"  roads cut by the extract: {where}", style="dim", highlight=False)


def _say_ferries(graph: RoadGraph) -> None:
    console = Console(stderr=True)
    if graph.ferries is not None:
        own = graph.ferries.link[graph.ferries.link < graph.road_link_count]
        length_km = float(graph.length_m[own].sum()) / 1000.0
        said = f"  ferries: {own.size} directed links, {length_km:.1f} km, no energy on board"
        console.print(said, style="dim", highlight=False)
    for ferry in graph.meta.ferries_left_out:
        place = f"lat {ferry.lat_deg:.5f}, lon {ferry.lon_deg:.5f}" + (f" ({ferry.name})" if ferry.name else "")
        said = f"  ferry left out: {ferry.length_m / 1000.0:.2f} km from {place}; --ferries brings it in"
        console.print(said, style="dim", highlight=False, markup=False)


def _say_cut_off(parts: Sequence[CutOffPart]) -> None:
    console = Console(stderr=True)
    for part in parts:
        place = f"lat {part.lat_deg:.5f}, lon {part.lon_deg:.5f}" + (f" ({part.name})" if part.name else "")
        road = f"{part.length_m / 1000.0:.2f} km of road in {part.link_count} links"
        console.print(f"  not connected: {road} at {place}", style="dim", highlight=False, markup=False)
