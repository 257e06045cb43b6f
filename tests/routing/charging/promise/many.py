"""Many plans, each driven many times: `python -m tests.routing.charging.promise.many [WORLDS] [DRIVES] [SEED]`.

Prints how often stops were kept beside what was promised, of drawn worlds and of `highlands` with a bundled car; ends
with 1 where a stop is off by more than two points.
"""

from __future__ import annotations

import sys
import time
from dataclasses import dataclass, field, replace

import numpy as np

from benchmarks.charging import ends_apart, made_stations
from benchmarks.graphs import ROOT
from diagnosis.comparison.coverage import wilson_interval
from energy.vehicle.files import load_vehicle
from routing.charging.plan import ChargingQuery, Plan
from routing.charging.planner import ChargingPlanner
from routing.graph.files import load_graph
from routing.graph.road_graph import RoadGraph
from routing.graph.snap import RoadIndex
from routing.links.spans import ChainMaker
from routing.queries import RouteQuery
from routing.route.best_path import RouteSearch
from tests.routing.charging.promise.drives import kept_drives, promised
from tests.routing.charging.promise.test_promise import hilly, planned

CONFIDENCES = (None, 0.7, 0.8, 0.9, 0.95, 0.99)
MOST_POINTS = 2.0
HIGHLANDS_STATIONS = 100
HIGHLANDS_CROW_KM = 60.0
HIGHLANDS_BATTERY_WH = 12e3
CARS = ("hyundai-kona-64", "vw-id4", "tesla-model-3")


@dataclass
class Tally:
    """Legs, what was promised of them, drives that kept them, and by how much the worst is off."""

    legs: int = 0
    promised: float = 0.0
    kept: int = 0
    drives: int = 0
    off_points: float = 0.0
    whole_off_points: float = 0.0
    halting_off_points: float = 0.0
    seeds: list[int] = field(default_factory=list)

    def add(
        self, graph: RoadGraph, query: RouteQuery, charging: ChargingQuery, plan: Plan, drives: int, seed: int
    ) -> None:
        """Drive a plan and count."""
        shares = kept_drives(graph, query, charging, plan, drives, seed)
        told = np.array(promised(plan))
        off = 100.0 * np.abs(shares.mean(axis=1) - told)
        self.legs += told.size
        self.promised += float(told.sum())
        self.kept += int(shares.sum())
        self.drives += shares.size
        self.off_points = max(self.off_points, float(off.max()))
        whole = plan.kept_probability_frac or 0.0
        self.whole_off_points = max(self.whole_off_points, 100.0 * abs(float(shares.all(axis=0).mean()) - whole))
        halting = kept_drives(graph, query, charging, plan, drives, seed, halts=True).mean(axis=1)
        self.halting_off_points = max(self.halting_off_points, 100.0 * float(np.abs(halting - told).max()))
        if off.max() > MOST_POINTS:
            self.seeds.append(seed)

    def told(self, name: str) -> str:
        """A line of the table."""
        low, high = wilson_interval(self.kept, self.drives)
        return (
            f"{name:22} {self.legs:4} legs {self.drives:8} drives: promised {100 * self.promised / self.legs:6.2f} %, "
            f"kept {100 * self.kept / self.drives:6.2f} % ({100 * low:.2f} … {100 * high:.2f}); worst leg "
            f"{self.off_points:.2f}, worst journey {self.whole_off_points:.2f}, with drawn halts "
            f"{self.halting_off_points:.2f} points{f'; off: {self.seeds}' if self.seeds else ''}"
        )


def of_worlds(count: int, drives: int, seed: int) -> dict[str, Tally]:
    """Plans with stops of drawn worlds, by confidence."""
    tallies: dict[str, Tally] = {}
    for at in range(seed, seed + count):
        world = hilly(at)
        for confidence in CONFIDENCES:
            plan = planned(world, confidence=confidence)
            if plan is not None and plan.stops:
                tally = tallies.setdefault(f"worlds, {confidence or 'mean'}", Tally())
                tally.add(world.graph, world.query, world.charging, plan, drives, 1000 * at + 17)
    return tallies


def of_highlands(count: int, drives: int, seed: int) -> dict[str, Tally]:
    """Plans with stops of bundled cars on a bundled graph, by confidence."""
    tallies: dict[str, Tally] = {}
    graph = load_graph(ROOT / "data" / "graphs" / "highlands")
    roads, chains, rng = RoadIndex(graph), ChainMaker(graph), np.random.default_rng(seed)
    planner = ChargingPlanner(RouteSearch(graph, chains), chains)
    plugs = load_vehicle(ROOT / "data" / "vehicles" / f"{CARS[0]}.toml").charging
    assert plugs is not None
    stations = made_stations(graph, HIGHLANDS_STATIONS, rng)
    for k in range(count):
        car = load_vehicle(ROOT / "data" / "vehicles" / f"{CARS[k % len(CARS)]}.toml")
        share = HIGHLANDS_BATTERY_WH / car.usable_capacity_wh
        sd = {name: share * value if name == "usable_capacity_wh" else value for name, value in car.sd.items()}
        small = replace(car, usable_capacity_wh=share * car.usable_capacity_wh, sd=sd)
        start, goal = ends_apart(graph, HIGHLANDS_CROW_KM, rng)
        places = [roads.snap(name, place, 1e5)[1] for name, place in (("start", start), ("goal", goal))]
        query = RouteQuery(start, goal, 0.9, small, reserve_soc_frac=0.05)
        for confidence in CONFIDENCES:
            charging = ChargingQuery(confidence=confidence, max_soc_frac=0.9)
            answer = planner.plan(query, charging, plugs, stations, places)
            if answer.plans and answer.plans[0].stops:
                tally = tallies.setdefault(f"highlands, {confidence or 'mean'}", Tally())
                tally.add(graph, query, charging, answer.plans[0], drives, 1000 * k + 23)
    return tallies


def main(arguments: list[str]) -> int:
    worlds, drives, seed = ([int(argument) for argument in arguments] + [24, 10_000, 0][len(arguments) :])[:3]
    began = time.perf_counter()
    tallies = of_worlds(worlds, drives, seed) | of_highlands(worlds // 4, drives, seed)
    for name, tally in tallies.items():
        print(tally.told(name))
    print(f"{time.perf_counter() - began:.0f} s")
    return 1 if any(tally.seeds for tally in tallies.values()) else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
