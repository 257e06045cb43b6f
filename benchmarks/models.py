"""The time-step model against the fast model, on the links of routes: time and energy."""

from __future__ import annotations

import math
import time
from contextlib import suppress
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from benchmarks.searches import Spread, spread
from energy.chain.chain import RULE_CODE, StopRule, chain_links, simulate_chain
from energy.chain.kernels_chain import ChainDrive, drive_chain, undriven
from energy.chain.kernels_timestep import drive_steps
from energy.chain.timestep import STEP_LIMIT, STEP_S, simulate_timestep
from energy.force.effects import LinkSetting, drive_of
from routing.errors import RoutingError
from routing.places import LinkSpan, Point
from routing.planner import Planner
from routing.queries import RouteQuery
from routing.weights import FASTEST

if TYPE_CHECKING:
    from collections.abc import Callable

    from energy.chain.chain import Chain
    from energy.vehicle.vehicle import Vehicle
    from routing.graph.road_graph import RoadGraph

RULE: Final = StopRule.CROSSINGS  # both models stop at the same places
LABELS_PER_LINK: Final = 5


@dataclass(frozen=True, slots=True)
class ModelFigures:
    """Both models on the same routes; None where there was none.

    fast, steps: whole calls, per km and per link over all routes [µs]. ratio: steps over fast, route by route, of
    whole calls; kernel_ratio: of the compiled parts. energy_ratio: steps over fast, of the sums over all routes, since
    a single one may take next to nothing. steps_per_km: of 0.1 s.
    """

    routes: int
    km: float
    links: int
    steps_per_km: float
    fast_us_per_km: float
    steps_us_per_km: float
    fast_us_per_link: float
    steps_us_per_link: float
    ratio: Spread
    kernel_ratio: Spread
    energy_ratio: float


def measure_models(
    graph: RoadGraph,
    vehicle: Vehicle,
    pairs: int,
    repeat: int,
    rng: np.random.Generator,
    progress: Callable[[float], None] = lambda done: None,
) -> ModelFigures | None:
    """Time both models on fastest routes between random nodes, each the median of some repetitions."""
    chains = _chains(graph, vehicle, pairs, rng)
    if not chains:
        return None
    for chain in chains[:1]:  # compiles
        simulate_chain(vehicle, chain, stop_rule=RULE)
        simulate_timestep(vehicle, chain, stop_rule=RULE)
    rows = []
    for k, chain in enumerate(chains):
        fast = simulate_chain(vehicle, chain, stop_rule=RULE)
        stepped = simulate_timestep(vehicle, chain, stop_rule=RULE)
        fast_kernel, steps_kernel = _kernels(vehicle, chain)
        rows.append(
            (
                float(chain.length_m.sum()) / 1000.0,
                chain.length_m.size,
                stepped.step_count,
                _median_s(lambda chain=chain: simulate_chain(vehicle, chain, stop_rule=RULE), repeat),
                _median_s(lambda chain=chain: simulate_timestep(vehicle, chain, stop_rule=RULE), repeat),
                _median_s(fast_kernel, repeat),
                _median_s(steps_kernel, repeat),
                fast.energy_j,
                stepped.energy_j,
            )
        )
        progress((k + 1) / len(chains))
    km, links, steps, fast_s, steps_s, fast_kernel_s, steps_kernel_s, fast_j, steps_j = np.array(rows).T
    return ModelFigures(
        routes=len(rows),
        km=float(km.sum()),
        links=int(links.sum()),
        steps_per_km=float(steps.sum() / km.sum()),
        fast_us_per_km=float(1e6 * fast_s.sum() / km.sum()),
        steps_us_per_km=float(1e6 * steps_s.sum() / km.sum()),
        fast_us_per_link=float(1e6 * fast_s.sum() / links.sum()),
        steps_us_per_link=float(1e6 * steps_s.sum() / links.sum()),
        ratio=spread(steps_s / fast_s),
        kernel_ratio=spread(steps_kernel_s / fast_kernel_s),
        energy_ratio=float(steps_j.sum() / fast_j.sum()),
    )


def _chains(graph: RoadGraph, vehicle: Vehicle, pairs: int, rng: np.random.Generator) -> list[Chain]:
    planner = Planner(graph, label_limit=LABELS_PER_LINK * graph.link_count)
    chains = []
    for ends in rng.integers(graph.node_count, size=(pairs, 2)):
        start, goal = (Point(float(graph.node_lat_deg[n]), float(graph.node_lon_deg[n])) for n in ends)
        with suppress(RoutingError):
            (route,) = planner.route(RouteQuery(start, goal, 1.0, vehicle, weightings=(("fastest", FASTEST),))).routes
            if route.links:
                spans = tuple(LinkSpan(link.link_idx, link.from_m, link.to_m) for link in route.links)
                chains.append(planner.chain(spans))
    return chains


def _kernels(vehicle: Vehicle, chain: Chain) -> tuple[Callable[[], object], Callable[[], object]]:
    """The compiled parts of both models, on arrays that are ready."""
    drive = drive_of(vehicle)
    setting = LinkSetting(chain.grade_frac, chain.speed_limit_mps, chain.altitude_m, chain.heading)
    links = chain_links(chain, chain.speed_limit_mps, drive.roads(setting, chain.stop_time_s))
    way = ChainDrive(RULE_CODE[RULE], 0.0, True, -math.inf)
    driven = undriven(chain.length_m.size, with_parts=True)
    return (
        lambda: drive_chain(drive.physics, links, way, driven),
        lambda: drive_steps(drive.physics, links, way, STEP_S, STEP_LIMIT, driven, np.empty((0, 3))),
    )


def _median_s(call: Callable[[], object], repeat: int) -> float:
    took = []
    for _ in range(repeat):
        began = time.perf_counter()
        call()
        took.append(time.perf_counter() - began)
    return float(np.median(took))
