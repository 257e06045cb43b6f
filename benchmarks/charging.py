"""How long plans with charging stops take: `python -m benchmarks.charging [--graph FOLDER]`.

Stations are made on major roads. First: nothing is known of vehicle and weather but compiled code. Again: the same
question. Near: start and goal some kilometres away. New: others as far apart, of which the median and the 90th
percentile are told. Times are those of the processor, stages by the clock.
"""

from __future__ import annotations

import argparse
import time
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Final

import numpy as np

from benchmarks.graphs import ROOT
from benchmarks.scale.regions import cache_folder, kept_region
from energy.charging.charging import Connector
from energy.units import METRE_PER_KM
from energy.vehicle.files import load_vehicle
from routing.charging.plan import ChargingAnswer, ChargingQuery
from routing.charging.planner import ChargingPlanner
from routing.graph.earth import great_circle_m
from routing.graph.files import load_graph
from routing.graph.snap import RoadIndex
from routing.links.spans import ChainMaker
from routing.places import LinkPosition, Point
from routing.queries import RouteQuery
from routing.route.best_path import RouteSearch
from routing.stations.station import Socket, Station

if TYPE_CHECKING:
    from energy.vehicle.files import AnyVehicle
    from routing.charging.legs import Place
    from routing.graph.road_graph import RoadGraph

VEHICLE: Final = "hyundai-kona-64"
OUTPUTS_W: Final = (50e3, 150e3, 300e3)
MAJOR: Final = 3  # functional class up to which roads have stations
NEAR_KM: Final = 5.0
PAIRS: Final = 12  # of ends, of each kind
LINKS: Final = 1_000_000


@dataclass(frozen=True, slots=True)
class Case:
    """A graph with stations, how far the goal is as the crow flies, the share of the battery that the car has, and how
    many pairs of other ends are asked for.
    """

    name: str
    graph: RoadGraph
    stations: int
    crow_km: float
    battery: float = 1.0
    pairs: int = PAIRS


def made_stations(graph: RoadGraph, count: int, rng: np.random.Generator) -> list[Station]:
    """Stations in the middle of random links of major roads."""
    major = np.flatnonzero((graph.functional_class <= MAJOR) & (graph.length_m > 20.0))
    major = major[major < graph.road_link_count]
    stations = []
    for k, link in enumerate(rng.choice(major, count, replace=False).tolist()):
        lon, lat = graph.geometry(link)[0]
        output_w = float(rng.choice(OUTPUTS_W))
        sockets = (Socket(Connector.CCS2, output_w, count=4),)
        place = _positions(graph, link)
        stations.append(Station(f"made:{k}", Point(float(lat), float(lon)), sockets, position=place))
    return stations


def _positions(graph: RoadGraph, link: int) -> Place:
    half_m = 0.5 * float(graph.length_m[link])
    back = int(graph.reverse_idx[link])
    places = [LinkPosition(link, half_m), *([LinkPosition(back, half_m)] if back >= 0 else [])]
    for place in tuple(places):
        places += [LinkPosition(copy, place.offset_m) for copy in graph.copies_of(place.link_idx)]
    return tuple(places)


def ends_apart(graph: RoadGraph, crow_km: float, rng: np.random.Generator) -> tuple[Point, Point]:
    """Two nodes about so far apart."""
    while True:
        start = int(rng.integers(graph.node_count))
        here = graph.node_lat_deg[start], graph.node_lon_deg[start]
        away_km = np.asarray(great_circle_m(*here, graph.node_lat_deg, graph.node_lon_deg)) / METRE_PER_KM
        goals = np.flatnonzero(np.abs(away_km - crow_km) < 0.02 * crow_km)
        if goals.size:
            goal = int(rng.choice(goals))
            return Point(*map(float, here)), Point(float(graph.node_lat_deg[goal]), float(graph.node_lon_deg[goal]))


def moved(place: Point, graph: RoadGraph, rng: np.random.Generator) -> Point:
    """A node some kilometres from a place."""
    away_m = np.asarray(great_circle_m(place.lat_deg, place.lon_deg, graph.node_lat_deg, graph.node_lon_deg))
    node = int(rng.choice(np.flatnonzero(np.abs(away_m / METRE_PER_KM - NEAR_KM) < 1.0)))
    return Point(float(graph.node_lat_deg[node]), float(graph.node_lon_deg[node]))


def measure(case: Case, vehicle: AnyVehicle, seed: int) -> None:
    """Print the times of one case."""
    rng = np.random.default_rng(seed)
    graph, roads = case.graph, RoadIndex(case.graph)
    stations = made_stations(graph, case.stations, rng)
    start, goal = ends_apart(graph, case.crow_km, rng)
    chains = ChainMaker(graph)
    search = RouteSearch(graph, chains)
    planner = ChargingPlanner(search, chains)
    car = replace(vehicle, usable_capacity_wh=case.battery * vehicle.usable_capacity_wh)
    charging = vehicle.charging
    if charging is None:
        raise ValueError(f"vehicle {vehicle.id!r} says nothing of charging")
    roads.snap("warm-up", start, 1e5)

    def ask(name: str, whence: Point, whither: Point) -> float:
        began = time.process_time()
        places = [roads.snap(field, place, 1e5)[1] for field, place in (("start", whence), ("goal", whither))]
        query = RouteQuery(whence, whither, 0.9, car, reserve_soc_frac=0.05)
        answer = planner.plan(query, ChargingQuery(), charging, stations, places)
        taken_s = time.process_time() - began
        told = f"{case.name:24} {name:6} {1000.0 * taken_s:9.1f} ms"
        first_s = answer.stats.stage_s.get("first_plan", 0.0)
        told += f"  (plan known at {1000.0 * first_s:.1f} ms; {answer.stats.leg_searches} searches, "
        told += f"{answer.stats.legs_cached} pairs known, {answer.stats.labels_made} labels)"
        told += f"\n{'':31} {_stages(answer)}"
        if answer.plans:
            plan = answer.plans[0]
            km = sum(leg.distance_m for leg in plan.legs) / METRE_PER_KM
            bound = "unknown" if plan.short_by is None else f"{plan.short_by:.1f} s"
            told += f"\n{'':31} {km:.0f} km, {plan.objective / 3600.0:.2f} h, {len(plan.stops)} stops, short by {bound}"
        else:
            told += f"\n{'':31} no plan: {answer.no_plan.reason if answer.no_plan else ''}"
        print(told, flush=True)
        return taken_s

    ask("first", start, goal)
    for _ in range(3):
        ask("again", start, goal)
    _print_spread(
        case.name, "near", [ask("near", moved(start, graph, rng), moved(goal, graph, rng)) for _ in range(case.pairs)]
    )
    _print_spread(case.name, "new", [ask("new", *ends_apart(graph, case.crow_km, rng)) for _ in range(case.pairs)])
    held = {kind: f"{size / 2**20:.1f} MiB" for kind, size in search.budget.held_bytes().items()}
    print(f"{case.name:24} caches hold {held}", flush=True)


def _stages(answer: ChargingAnswer) -> str:
    """How long each stage of a plan took, by the clock."""
    ends = answer.stats.stage_s
    since = [0.0, *ends.values()]
    return ", ".join(
        f"{name} {1000.0 * (end - begin):.1f}" for (name, end), begin in zip(ends.items(), since, strict=False)
    )


def _print_spread(case: str, name: str, taken_s: list[float]) -> None:
    median, high = np.quantile(taken_s, [0.5, 0.9])
    print(f"{case:24} {name:6} p50 {1000.0 * median:.1f} ms, p90 {1000.0 * high:.1f} ms of {len(taken_s)}", flush=True)


def main() -> None:
    """Measure on `highlands` and on a made graph of a million links."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--graph", type=Path, help="folder of a large graph, instead of one that is made")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--stations", type=int, default=2000, help="on the large graph")
    parser.add_argument("--km", type=float, default=420.0, help="on the large graph, as the crow flies")
    parser.add_argument("--only", choices=("highlands", "large"))
    asked = parser.parse_args()
    vehicle = load_vehicle(ROOT / f"data/vehicles/{VEHICLE}.toml")
    small = load_graph(ROOT / "data/graphs/highlands")
    if asked.only != "large":
        measure(Case("compiling", small, 30, 60.0, 0.2, 1), vehicle, asked.seed)
        measure(Case("highlands, 100 stations", small, 100, 110.0, 0.3), vehicle, asked.seed)
    if asked.only != "highlands":
        folder = asked.graph or kept_region(cache_folder(), LINKS, asked.seed)[1]
        large = load_graph(folder)
        if asked.only == "large":
            measure(Case("compiling", small, 30, 60.0, 0.2, 1), vehicle, asked.seed)
        name = f"{large.link_count} links, {asked.stations}"
        measure(Case(name, large, asked.stations, asked.km), vehicle, asked.seed)


if __name__ == "__main__":
    main()
