"""`joulepath bench --peers`: all engines on one map, in one run."""

from __future__ import annotations

import os
import tempfile
from contextlib import ExitStack
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Final

import numpy as np

from benchmarks.graphs import ROOT, import_in_process
from benchmarks.machine import this_machine
from benchmarks.peers import ours, routee, valhalla
from benchmarks.peers.compare import DEFAULT_CHARGE_FRAC, Competitor, energy_ratio, measure_ranges, measure_routes
from benchmarks.peers.environments import PeerUnavailableError
from benchmarks.peers.pairs import draw_pairs, draw_places
from benchmarks.peers.tables import RANGES, ROUTES, PeerReport, asked_of
from benchmarks.terrain import write_hills
from energy.vehicle.files import load_vehicle
from routing.graph.files import load_graph

if TYPE_CHECKING:
    from collections.abc import Callable

    from rich.progress import Progress

    from benchmarks.peers.compare import Rounds
    from benchmarks.peers.tables import Asked
    from routing.graph.road_graph import RoadGraph

MAP_FILE: Final = "porto.osm.pbf"
MINUTES: Final = (15.0, 30.0)
VERSIONS: Final = {routee.NAME: routee.VERSION, valhalla.NAME: valhalla.VERSION}


@dataclass(frozen=True, slots=True)
class Order:
    """What to measure: maps: folder of the map files; cache: folder of the peers' environments."""

    maps: Path
    cache: Path
    seed: int
    pairs: int
    ranges: int


def measure_peers(order: Order, progress: Progress) -> PeerReport:
    """Measure; raises ValueError without the map, CalledProcessError and RuntimeError where ours does not come up."""
    map_path = order.maps / MAP_FILE
    if not map_path.is_file():
        raise ValueError(f"no {MAP_FILE} in {order.maps}")
    machine = this_machine()
    notes = [f"the machine was not quiet: load {machine.load:.2f} before the run"] if machine.load >= 1.0 else []
    with tempfile.TemporaryDirectory(prefix="joulepath-peers-") as name, ExitStack() as open_engines:
        scratch = Path(name)
        graph_folder = _imported(map_path, order.seed, scratch, progress)
        graph = load_graph(graph_folder)
        competitors = _competitors(order, graph, graph_folder, scratch, open_engines, notes, progress)
        asked = _measured(order, graph, competitors, progress)
    versions = {competitor.name: VERSIONS[competitor.name] for competitor in competitors if competitor.name in VERSIONS}
    return PeerReport(machine, os.getloadavg()[0], versions, order.seed, asked, notes)


def _imported(map_path: Path, seed: int, scratch: Path, progress: Progress) -> Path:
    bar = progress.add_task("import", total=None)
    dem_path, folder = scratch / "hills.tif", scratch / "graphs" / map_path.name.split(".")[0]
    write_hills(map_path, dem_path, seed)
    import_in_process(folder.name, map_path, [dem_path], folder)
    progress.update(bar, total=1.0, completed=1.0)
    return folder


def _competitors(
    order: Order,
    graph: RoadGraph,
    graph_folder: Path,
    scratch: Path,
    open_engines: ExitStack,
    notes: list[str],
    progress: Progress,
) -> list[Competitor]:
    """Ours first, then every peer that could be had; why one could not goes to the notes."""
    bar = progress.add_task("start engines", total=None)
    competitors = [Competitor(ours.NAME, open_engines.enter_context(ours.ours(graph_folder, scratch)), 1.0)]
    vehicle = load_vehicle(ROOT / "data/vehicles" / f"{ours.VEHICLE}.toml")
    charge_scale = vehicle.usable_capacity_wh / 1e3 / routee.CAPACITY_KWH  # the same energy from its smaller battery
    try:
        engine = open_engines.enter_context(routee.routee(graph, order.cache, scratch))
        competitors.append(Competitor(routee.NAME, engine, charge_scale))
    except PeerUnavailableError as error:
        notes.append(str(error))
    try:
        engine = open_engines.enter_context(valhalla.valhalla(order.maps / MAP_FILE, order.cache, scratch))
        competitors.append(Competitor(valhalla.NAME, engine, None))
    except PeerUnavailableError as error:
        notes.append(str(error))
    progress.update(bar, total=1.0, completed=1.0)
    return competitors


def _measured(order: Order, graph: RoadGraph, competitors: list[Competitor], progress: Progress) -> list[Asked]:
    def shown(what: str) -> Callable[[float], None]:
        bar = progress.add_task(what, total=1.0)
        return lambda done: progress.update(bar, completed=done)

    pairs = draw_pairs(graph, np.random.default_rng(order.seed))
    rounds = measure_routes(competitors, pairs, order.pairs, shown("routes"))
    asked = [asked_of("route of 25 km", ROUTES, rounds)]
    competitors = [_as_far(competitor, rounds) for competitor in competitors]
    timed = any(competitor.charge_scale is None for competitor in competitors)
    for minutes in MINUTES if timed else MINUTES[:1]:
        origins = draw_places(graph, np.random.default_rng(order.seed))
        title = f"range as far as {minutes:g} min" if timed else f"range on a charge of {DEFAULT_CHARGE_FRAC:.0%}"
        rounds = measure_ranges(competitors, graph, origins, order.ranges, minutes, shown(title))
        asked.append(asked_of(title, RANGES, rounds))
    return asked


def _as_far(competitor: Competitor, rounds: Rounds) -> Competitor:
    """With the charge that takes it about as far as ours, by the energies of the same routes."""
    if competitor.charge_scale is None:
        return competitor
    return replace(competitor, charge_scale=competitor.charge_scale * energy_ratio(rounds, competitor.name))
