"""`python -m tests.faults.long_search [LINKS] [SECONDS]`: fastest routes that the charge does not reach, far across.

Prints for each how long it took and with what it ended. The exit status is 1 where one ended more than a second after
its limit.
"""

from __future__ import annotations

import sys
import time
from dataclasses import replace

import numpy as np

from energy.folders import bundled_folder
from energy.units import JOULE_PER_WH
from energy.vehicle.files import load_vehicles
from energy.vehicle.vehicle import Vehicle
from routing.errors import NoPathError, TimeUpError
from routing.places import Point
from routing.planner import Planner
from routing.queries import RouteQuery
from routing.synth import synthesize
from routing.time_budget import TimeBudget, within
from routing.weights import ECO, FASTEST

QUERIES = 8
SOC = 0.95
BOTH = (("eco", ECO), ("fastest", FASTEST))


def main(links: int, limit_s: float) -> int:
    """Ask and print."""
    graph = synthesize("far", seed=7, width_km=None, height_km=None, links_target=links)
    planner = Planner(graph)
    vehicle = load_vehicles(bundled_folder("data") / "vehicles")["hyundai-kona-64"]
    assert isinstance(vehicle, Vehicle)
    planner.warm_up(vehicle)
    dice = np.random.default_rng(3)
    west = np.argsort(graph.node_lon_deg)[: graph.node_count // 20]
    east = np.argsort(graph.node_lon_deg)[-graph.node_count // 20 :]
    late = 0
    for k in range(QUERIES):
        ends = [
            Point(float(graph.node_lat_deg[n]), float(graph.node_lon_deg[n])) for n in map(dice.choice, (west, east))
        ]
        free = RouteQuery(ends[0], ends[1], 1.0, replace(vehicle, usable_capacity_wh=1e6), weightings=BOTH)
        eco, fastest = (route.energy_j for route in planner.route(free).routes)
        held_j = eco + (fastest - eco) * (k + 1) / (QUERIES + 1)  # enough for one and not for the other
        short = replace(vehicle, usable_capacity_wh=held_j / JOULE_PER_WH / SOC)
        query = RouteQuery(ends[0], ends[1], SOC, short, weightings=BOTH[1:])
        began = time.perf_counter()
        try:
            with within(TimeBudget(limit_s)):
                answer = planner.route(query)
            stats = answer.stats[0]
            end = f"{answer.routes[0].distance_m / 1000:.0f} km, {stats.method}, {stats.labels_made} labels"
        except (TimeUpError, NoPathError) as error:
            end = str(error)
        seconds = time.perf_counter() - began
        late += seconds > limit_s + 1.0
        print(f"{graph.link_count} links: {seconds:.2f} s of {limit_s:g}; {end}", flush=True)
    return 1 if late else 0


if __name__ == "__main__":
    sys.exit(
        main(int(sys.argv[1]) if len(sys.argv) > 1 else 1_000_000, float(sys.argv[2]) if len(sys.argv) > 2 else 5.0)
    )
