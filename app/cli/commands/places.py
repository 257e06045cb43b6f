"""Commands that index the places of graphs, and search them."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.console import Console
from rich.table import Table

from app.cli.commands.output import GraphOption, service_for
from app.cli.commands.progress import reporter, stage_bars
from app.places.parameters import SearchParameters
from routing.gazetteer.gazetteer import MOST_FOUND

if TYPE_CHECKING:
    from collections.abc import Mapping

places = typer.Typer(no_args_is_help=True, help="The index of places of graphs, which `joulepath search` asks.")
searching = typer.Typer()


@places.command("build")
def build_places(
    map_path: Annotated[Path | None, typer.Argument(metavar="[REGION.osm.pbf]", help="the graph's map")] = None,
    *,
    graph: Annotated[str, typer.Option("--graph", help="name of a graph, or its folder", metavar="NAME|DIR")],
) -> None:
    """Index the places of a map beside a graph that exists; without a map, the names of the graph's own roads."""
    from routing.gazetteer.files import save_index
    from routing.gazetteer.making import places_beside, places_of_map
    from routing.graph.files import load_graph
    from routing.stations.files import load_stations

    service = service_for(graph)
    folder = service.atlas.folder(service.settings.default_graph)
    roads = load_graph(folder)
    found = None
    if map_path is not None:
        with stage_bars() as progress:
            report = reporter(progress)
            found = places_of_map(map_path, roads, lambda done: report("read map", done))
            report("read map", 1.0)
    beside = places_beside(roads, load_stations(folder, roads), found)
    for content in beside.files.values():
        save_index(folder, content)
    Console(stderr=True, soft_wrap=True).print(f"{folder}: index of places", markup=False, highlight=False)
    say_places(beside.counts, beside.left_out, beside.size_bytes)


@places.command("show")
def show_places(graph: GraphOption = None) -> None:
    """What the index of a graph holds, and what was left out."""
    service = service_for(graph)
    index = service.places.shelf.of_graph(service.settings.default_graph)
    Console().print(f"{index.about['source']}, built {index.about['built']}", markup=False, highlight=False)
    say_places(index.counts, index.left_out, index.size_bytes)


@searching.command("search")
def search(
    text: Annotated[list[str], typer.Argument(metavar="TEXT", help="names, an address or coordinates, in any order")],
    *,
    graph: GraphOption = None,
    near: Annotated[str | None, typer.Option(help="place that answers are preferred near", metavar="LAT,LON")] = None,
    limit: Annotated[int, typer.Option(help="answers at most", min=1, max=MOST_FOUND)] = 10,
    lang: Annotated[str | None, typer.Option(help="languages of names, the preferred first, as de,en")] = None,
    as_json: Annotated[bool, typer.Option("--json", help="print what HTTP would answer")] = False,
    form: Annotated[str, typer.Option("--format", help="of --json: photon, json, jsonv2, geojson")] = "photon",
) -> None:
    """Places by their name."""
    service = service_for(graph)
    lat, lon = (None, None) if near is None else near.split(",", 1) if "," in near else (near, None)
    sent = SearchParameters.model_validate(
        {
            "q": " ".join(text),
            "graph": None if graph is None else service.settings.default_graph,
            "lat": lat,
            "lon": lon,
            "limit": limit,
            "lang": lang,
            "format": form,
        }
    )
    if as_json:
        typer.echo(service.places.search_json(sent).decode())
        return
    table = Table("place", "kind", "lat, lon", "match", "graph")
    for found in service.places.search(sent):
        place = found.place
        told = ""
        if place.asked_number:
            nearest = f", nearest is {place.nearest_number}" if place.nearest_number else ""
            told = f" (no number {place.asked_number}{nearest})"
        at = f"{place.lat:.5f}, {place.lon:.5f}"
        table.add_row(place.label() + told, place.kind.value, at, f"{place.match:.2f}", found.graph)
    console = Console()
    console.print(table if table.row_count else "nothing found", markup=False)


def say_places(counts: Mapping[str, int], left_out: Mapping[str, int], size_bytes: int) -> None:
    """Print what an index holds, its size and what was left out."""
    console = Console(stderr=True, soft_wrap=True)
    held = ", ".join(f"{kind} {count}" for kind, count in counts.items())
    console.print(f"  places to search: {held}; {size_bytes / 1e6:.1f} MB", style="dim", highlight=False, markup=False)
    for reason, count in left_out.items():
        console.print(f"    left out, {reason}: {count}", style="dim", highlight=False, markup=False)
