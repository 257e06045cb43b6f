"""Station graphs drawn at random, with ways made up, and what any journey on them must satisfy."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from energy.charging.charge_time import charge_times, seconds
from energy.charging.charging import PowerCurve
from routing.charging import kernels_plan as kernels
from routing.charging.kernels_plan import Rules, Stops
from routing.charging.network import Arc, Part, StationGraph, Step
from routing.charging.ways import Way

CAPACITY_J = 2e8
OVERHEAD_S = 240.0
SPEED_MPS = 25.0
SLOW_MPS = 18.0
J_PER_M, SLOW_J_PER_M, J_PER_CLIMB_M = 700.0, 520.0, 15_000.0
ROUNDING_S = 1e-6
ROUNDING_J = 1e-3


@dataclass(frozen=True, slots=True)
class Network:
    """Places in a plane with heights, of which the first is the start and the last the goal; the rest are stations.

    curves: one a station. charges as fractions.
    """

    at_m: np.ndarray
    height_m: np.ndarray
    curves: tuple[PowerCurve, ...]
    start_soc: float
    arrive_soc: float
    goal_soc: float
    max_soc: float

    @property
    def goal(self) -> int:
        return self.at_m.shape[0] - 1

    def best(self) -> list[Step] | None:
        number = np.zeros((self.goal + 1, 10))
        number[:, kernels.CURVE] = -1.0
        number[1 : self.goal, kernels.CURVE] = np.arange(len(self.curves))
        number[1 : self.goal, kernels.A_SECOND] = 1.0
        number[1 : self.goal, kernels.STOP_COST] = number[1 : self.goal, kernels.STOP_S] = OVERHEAD_S
        number[:, kernels.CAP] = self.max_soc * CAPACITY_J
        number[:, kernels.LEAST_J] = self.arrive_soc * CAPACITY_J
        number[self.goal, kernels.LEAST_J] = self.goal_soc * CAPACITY_J
        count = self.goal + 1
        stops = Stops(
            number,
            np.zeros(count, np.bool_),
            np.zeros(count, np.int64),
            np.zeros(count, np.int64),
            np.zeros(count + 1, np.int64),
            np.empty((0, 2)),
        )
        rules = Rules(0.0, 0.0, 1.0, False, False, 50, False)
        graph = StationGraph(charge_times(self.curves, CAPACITY_J).curves, stops, self._arcs)
        return graph.best(0, self.start_soc * CAPACITY_J, self.goal, rules)

    def _arcs(self, place: int) -> list[Arc]:
        arcs = []
        for to in range(1, self.goal + 1):
            if to == place or place == self.goal:
                continue
            away_m = float(np.hypot(*(self.at_m[to] - self.at_m[place])))
            lifted_j = J_PER_CLIMB_M * float(self.height_m[to] - self.height_m[place])
            for speed, a_metre in ((SPEED_MPS, J_PER_M), (SLOW_MPS, SLOW_J_PER_M)):
                energy_j = a_metre * away_m + lifted_j
                need_j = max(energy_j, 0.0)
                way = Way(away_m / speed, energy_j, need_j, need_j, need_j, away_m)
                arcs.append(Arc(to, way, way.time_s, 0.0, (Part(place, to, way),)))
        return arcs


def drawn_network(seed: int) -> Network:
    rng = np.random.default_rng(seed)
    stations = int(rng.integers(3, 9))
    far_m = float(rng.uniform(2e5, 8e5))
    along = np.concatenate(([0.0], np.sort(rng.uniform(0.0, far_m, stations)), [far_m]))
    aside = np.concatenate(([0.0], rng.normal(0.0, 2e4, stations), [0.0]))
    arrive = float(rng.choice([0.0, 0.1, 0.2]))
    return Network(
        np.column_stack((along, aside)),
        rng.uniform(0.0, 800.0, stations + 2),
        tuple(drawn_power(rng) for _ in range(stations)),
        float(rng.uniform(0.5, 1.0)),
        arrive,
        float(rng.choice([0.0, 0.1, 0.4])),
        float(rng.choice([0.7, 0.8, 1.0])),
    )


def drawn_power(rng: np.random.Generator) -> PowerCurve:
    points = int(rng.integers(0, 7))
    soc = np.concatenate(([0.0], np.sort(rng.uniform(0.02, 0.98, points)), [1.0]))
    power = rng.uniform(5.0, 200.0, points + 2) * 1e3
    if rng.random() < 0.6:
        power = np.sort(power)[::-1].copy()
    return PowerCurve(soc, np.minimum(power, float(rng.choice([22e3, 50e3, 150e3, 300e3]))))


def improved(network: Network, station: int, factor: float) -> Network:
    """The same with more power at a station."""
    curve = network.curves[station]
    better = PowerCurve(curve.soc_frac, curve.power_w * factor)
    return replace(network, curves=(*network.curves[:station], better, *network.curves[station + 1 :]))


def time_of(steps: list[Step] | None) -> float:
    return math.inf if steps is None else steps[-1].time_s


def same_speed(way: Way, other: Way) -> bool:
    return abs(way.distance_m / way.time_s - other.distance_m / other.time_s) < 0.1


def broken_rules(network: Network, steps: list[Step]) -> list[str]:
    """What a journey does that none may do."""
    found = []
    clock_s, charge_j = 0.0, network.start_soc * CAPACITY_J
    for k, step in enumerate(steps[1:], start=1):
        assert step.arc is not None
        before = steps[k - 1].place
        if before != 0:
            # a halt is where the speed changes, which ways made up do not do elsewhere
            before_arc = steps[k - 1].arc
            assert before_arc is not None
            if step.depart_j < charge_j + ROUNDING_J and same_speed(before_arc.way, step.arc.way):
                found.append(f"nothing is charged at {before}")
            if step.depart_j > max(network.max_soc * CAPACITY_J, charge_j) + ROUNDING_J:
                found.append(f"too much is charged at {before}")
            curve = network.curves[before - 1]
            taken_s = float(seconds(curve, CAPACITY_J, charge_j / CAPACITY_J, min(step.depart_j / CAPACITY_J, 1.0)))
            clock_s += OVERHEAD_S + taken_s
        elif step.depart_j != charge_j:
            found.append("the charge jumps at the start")
        way = step.arc.way
        clock_s += way.time_s
        charge_j = min(step.depart_j - way.energy_j, CAPACITY_J - way.spill_j)
        if step.depart_j < way.need_j - ROUNDING_J:
            found.append(f"the charge runs out on the way to {step.place}")
        if abs(charge_j - step.charge_j) > ROUNDING_J:
            found.append(f"the charge jumps on the way to {step.place}")
        least = network.goal_soc if step.place == network.goal else network.arrive_soc
        if charge_j < least * CAPACITY_J - ROUNDING_J:
            found.append(f"too little is left at {step.place}")
        if abs(clock_s - step.time_s) > ROUNDING_S:
            found.append(f"time does not add up at {step.place}: {clock_s} and {step.time_s}")
        if abs(step.cost - step.time_s) > ROUNDING_S:
            found.append(f"cost is not time at {step.place}")
    return found


def unmet_properties(seed: int) -> tuple[int, list[str]]:
    """Plans made of one drawn network and its variants, and which properties they do not have."""
    network = drawn_network(seed)
    rng = np.random.default_rng(seed + 1_000_000)
    steps = network.best()
    found = [] if steps is None else broken_rules(network, steps)
    careful = replace(network, arrive_soc=network.arrive_soc + float(rng.uniform(0.01, 0.2)))
    thrifty = replace(network, goal_soc=network.goal_soc + float(rng.uniform(0.01, 0.2)))
    better = improved(network, int(rng.integers(len(network.curves))), float(rng.uniform(1.05, 3.0)))
    fuller = replace(network, start_soc=min(network.start_soc + float(rng.uniform(0.01, 0.2)), 1.0))
    plans = 1
    for name, other, slower in (
        ("more reserve", careful, True),
        ("more at the goal", thrifty, True),
        ("a better station", better, False),
        ("more charge at the start", fuller, False),
    ):
        changed = other.best()
        plans += 1
        if changed is not None:
            found += [f"{name}: {text}" for text in broken_rules(other, changed)]
        before_s, after_s = time_of(steps), time_of(changed)
        if (after_s < before_s - ROUNDING_S) if slower else (after_s > before_s + ROUNDING_S):
            found.append(f"{name} takes {after_s} s instead of {before_s}")
    return plans, found
