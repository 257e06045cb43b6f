"""Small worlds drawn at random, and the best journey in them by trying everything."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from energy.chain.chain import LinkModel, StopRule
from energy.charging.charging import Charging, Connector, PowerCurve
from energy.stops import StopSettings
from energy.units import JOULE_PER_WH
from energy.vehicle.vehicle import Vehicle
from routing.charging.plan import ChargingQuery, FixedStay, Objective
from routing.charging.planner import ChargingPlanner
from routing.graph.road_graph import RoadGraph
from routing.links.spans import ChainMaker
from routing.places import LinkPosition, LinkSpan, Point
from routing.queries import RouteQuery
from routing.route.best_path import RouteSearch
from routing.search.found import Limits
from routing.search.search import find_path
from routing.search.space import search_space
from routing.search.workspaces import WorkspacePool
from routing.stations.station import Price, Socket, Station
from routing.weights import ECO
from tests.routing.drawn_streets import drawn_streets

GRID = 801
AC_W, AC_EFF = 3000.0, 0.9
ZOOMS = 9
OBJECTIVES = (Objective.TIME, Objective.TIME, Objective.ENERGY, Objective.COST)
A_SECOND: dict[Objective, Callable[[ChargingQuery], float]] = {
    Objective.TIME: lambda _: 1.0,
    Objective.ENERGY: lambda _: 1.0,
    Objective.COST: lambda query: query.time_value_per_h / 3600.0,
}
SPEEDS_MPS = np.array([30.0, 50.0, 80.0, 120.0]) / 3.6


@dataclass(frozen=True, slots=True)
class World:
    """A map, a vehicle, stations, and a question."""

    graph: RoadGraph
    query: RouteQuery
    charging: ChargingQuery
    vehicle_charging: Charging
    stations: tuple[Station, ...]
    places: tuple[tuple[LinkPosition, ...], ...]

    @property
    def capacity_j(self) -> float:
        return self.query.vehicle.usable_capacity_wh * JOULE_PER_WH

    def planner(self) -> ChargingPlanner:
        chains = ChainMaker(self.graph)
        return ChargingPlanner(RouteSearch(self.graph, chains), chains)


def small_car(capacity_wh: float) -> Vehicle:
    bounds = np.array([0.0, 20.0, 40.0, 60.0, 90.0, 140.0]) / 3.6
    return Vehicle(
        id="drawn",
        name="drawn",
        mass_kg=1500.0,
        road_load_a_n=120.0,
        road_load_b_n_per_mps=0.5,
        road_load_c_n_per_mps2=0.5,
        drive_eff=0.9,
        recuperation_eff=0.6,
        aux_power_w=300.0,
        usable_capacity_wh=capacity_wh,
        accel_speed_mps=bounds,
        accel_mps2=np.array((1.4, 1.2, 1.0, 0.7, 0.5)),
        decel_mps2=-np.array((1.3, 1.2, 1.1, 1.0, 0.9)),
    )


def direct_wh(graph: RoadGraph, ends: Sequence[tuple[LinkPosition, ...]]) -> float:
    """Least energy of going there without a stop, at least 100 Wh."""
    space = search_space(graph, small_car(1000.0), LinkModel.INTEGRATED, StopRule.EXPECTED, StopSettings())
    path, _ = find_path(space, WorkspacePool(graph.link_count), ECO, Limits(), ends[0], ends[1])
    return max(100.0, 0.0 if path is None else path.energy_j / JOULE_PER_WH)


def drawn_curve(rng: np.random.Generator) -> PowerCurve:
    """Power that rises, falls and is level as it comes, of which a small battery takes minutes."""
    count = int(rng.integers(2, 6))
    soc = np.concatenate(([0.0], np.sort(rng.uniform(0.05, 0.95, count)), [1.0]))
    power = rng.uniform(1.0, 6.0, count + 2) * 1e3
    if rng.random() < 0.6:
        power = np.sort(power)[::-1].copy()
    if rng.random() < 0.3:
        power[1] = power[0]
    return PowerCurve(soc, power)


def drawn_world(seed: int) -> World:
    """Four to six nodes with hills, a battery for about half of the way, two or three stations."""
    rng = np.random.default_rng(seed)
    nodes = int(rng.integers(4, 7))
    cells = rng.permutation([(x, y) for x in range(3) for y in range(2)])[:nodes]
    places = [(float(x), float(y)) for x, y in 2.5 * cells + rng.uniform(-0.7, 0.7, (nodes, 2))]
    ring = [(k, (k + 1) % nodes) for k in range(nodes)]
    free = [pair for pair in itertools.combinations(range(nodes), 2) if pair not in ring and pair[::-1] not in ring]
    chosen = rng.permutation(len(free))[: int(rng.integers(1, 3))]
    pairs = ring + [free[k] for k in chosen]
    links = [link for a, b in pairs for link in ((a, b), (b, a))]
    if rng.random() < 0.3:
        del links[int(rng.integers(len(links)))]
    n = len(links)
    graph = drawn_streets(
        "drawn",
        places,
        links,
        rng.uniform(0.0, 250.0, nodes),
        detour=rng.uniform(1.0, 1.5, n),
        speed_limit_mps=rng.choice(SPEEDS_MPS, n),
        cross=rng.integers(0, 3, n),
    )

    def place() -> tuple[LinkPosition, ...]:
        link = int(rng.integers(graph.link_count))
        at = float(rng.uniform(0.1, 0.9))
        length_m = float(graph.length_m[link])
        here = [LinkPosition(link, at * length_m)]
        back = int(graph.reverse_idx[link])
        if back >= 0:
            here.append(LinkPosition(back, length_m - at * length_m))
        return tuple(here)

    prices = rng.random() < 0.5
    stations = tuple(
        Station(
            id=f"s{k}",
            at=Point(46.0, 8.0),
            sockets=(Socket(Connector.CCS2, float(rng.uniform(1.5e3, 8e3))),),
            network=str(rng.choice(["a", "b"])),
            price=Price(
                currency="EUR",
                per_kwh=float(rng.uniform(0.2, 0.9)),
                per_min=float(rng.choice([0.0, 0.05])),
                per_session=float(rng.choice([0.0, 0.5])),
            )
            if prices
            else None,
            position=place(),
        )
        for k in range(int(rng.integers(3, 5)))
    )
    via: tuple[tuple[LinkPosition, ...], ...] = (place(),) if rng.random() < 0.35 else ()
    if via:
        stations = stations[:2]
    ends = max(((place(), place()) for _ in range(5)), key=lambda pair: direct_wh(graph, pair))
    soc = float(rng.uniform(0.4, 1.0))
    charging = ChargingQuery(
        arrive_soc_frac=float(rng.choice([0.05, 0.1, 0.2])),
        goal_soc_frac=float(rng.choice([0.05, 0.1, 0.4])),
        max_soc_frac=float(rng.choice([0.7, 0.85, 1.0])),
        overhead_s=float(rng.choice([60.0, 120.0])),
        network_factors={"a": float(rng.choice([0.8, 1.0, 1.5]))},
        objective=OBJECTIVES[int(rng.integers(4))],
    )
    if via and rng.random() < 0.5:
        stay = FixedStay(0, float(rng.uniform(60.0, 600.0)), float(rng.choice([0.0, 2e3, 4e3])))
        charging = replace(charging, stays=(stay,))
    query = RouteQuery(
        start=Point(46.0, 8.0),
        goal=Point(46.0, 8.0),
        soc_frac=soc,
        vehicle=small_car(direct_wh(graph, ends) / float(rng.uniform(0.4, 1.25))),
        via=(Point(46.0, 8.0),) * len(via),
        reserve_soc_frac=float(rng.choice([0.0, 0.03, 0.05])),
    )
    charge = Charging((Connector.CCS2, Connector.TYPE2), drawn_curve(rng), AC_W, 3, AC_EFF, dc_eff=0.95)
    return World(graph, query, charging, charge, stations, (ends[0], *via, ends[1]))


@dataclass(frozen=True, slots=True)
class Trail:
    """A way that uses no link twice: time [s] and charge used at the end of each link [J].

    A fixed stay on it charges, which is charge given back; driven_j is without it.
    """

    time_s: float
    used_j: NDArray[np.float64]
    driven_j: float

    @property
    def takes(self) -> tuple[float, float, float, float, float]:
        used = self.used_j
        falls = used - np.minimum.accumulate(used)
        return self.time_s, used[-1], used.max(), falls[-1], falls.max()


def trails(world: World, here: tuple[LinkPosition, ...], there: tuple[LinkPosition, ...]) -> list[Trail]:
    """All ways from one place to another, but for those that another one is as good as in everything."""
    graph = world.graph
    search = RouteSearch(graph, ChainMaker(graph))
    found: list[Trail] = []

    def drive(spans: list[LinkSpan]) -> None:
        energy_j, time_s = search.link_energies(world.query, tuple(spans), None)
        used_j = np.concatenate(([0.0], np.cumsum(energy_j)))
        found.append(Trail(float(time_s.sum()), used_j, float(used_j[-1])))

    def walk(links: list[int], start: LinkPosition) -> None:
        link = links[-1]
        for goal in there:
            if goal.link_idx == link and (len(links) > 1 or goal.offset_m > start.offset_m):
                drive(
                    [
                        LinkSpan(
                            at,
                            start.offset_m if k == 0 else 0.0,
                            goal.offset_m if k == len(links) - 1 else float(graph.length_m[at]),
                        )
                        for k, at in enumerate(links)
                    ]
                )
        for onward in graph.successor[graph.successor_first[link] : graph.successor_first[link + 1]].tolist():
            if links.count(onward) == 0 or (onward == links[0] and links.count(onward) == 1):
                walk([*links, onward], start)

    for start in here:
        walk([start.link_idx], start)
    return best_of(found)


def best_of(found: list[Trail]) -> list[Trail]:
    """Those that no other one is as good as in everything."""
    kept: list[Trail] = []
    for trail in sorted(found, key=lambda trail: trail.takes):
        if not any(all(a <= b for a, b in zip(other.takes, trail.takes, strict=True)) for other in kept):
            kept.append(trail)
    return kept


def over_via(world: World, before: list[Trail], after: list[Trail]) -> list[Trail]:
    """Ways to the via point and on from there, with what is charged while staying there."""
    stay = next(iter(world.charging.stays), FixedStay(0, 0.0))
    gain_j = min(stay.power_w, AC_W) * AC_EFF * stay.seconds
    least_j = (
        (world.charging.arrive_soc_frac - world.query.reserve_soc_frac) * world.capacity_j if gain_j > 0.0 else 0.0
    )
    found = []
    for first, onward in itertools.product(before, after):
        there = first.used_j[-1]
        on_stay = [there + least_j, there, there - gain_j]
        used = np.concatenate((first.used_j, on_stay, there - gain_j + onward.used_j[1:]))
        found.append(Trail(first.time_s + stay.seconds + onward.time_s, used, first.driven_j + onward.driven_j))
    return best_of(found)


class Pile:
    """Cost of charging at a station from empty to a charge, by sums of pieces of the curve."""

    def __init__(self, world: World, station: Station) -> None:
        charging, query = world.vehicle_charging, world.charging
        assert charging.dc is not None
        most_w = (station.sockets[0].output_w or 0.0) * charging.dc_eff
        soc, power = charging.dc.soc_frac, charging.dc.power_w
        cuts = [
            soc[k] + (most_w - power[k]) / (power[k + 1] - power[k]) * (soc[k + 1] - soc[k])
            for k in range(soc.size - 1)
            if (power[k] - most_w) * (power[k + 1] - most_w) < 0.0
        ]
        self.at_j = np.unique(np.concatenate((soc, cuts))) * world.capacity_j
        self.power_w = np.minimum(np.interp(self.at_j / world.capacity_j, soc, power), most_w)
        p0, p1, step = self.power_w[:-1], self.power_w[1:], np.diff(self.at_j)
        level = np.abs(p1 - p0) < 1e-9 * p0
        with np.errstate(divide="ignore", invalid="ignore"):
            taken = np.where(level, step / p0, step / (p1 - p0) * np.log(p1 / p0))
        self.since_s = np.concatenate(([0.0], np.cumsum(taken)))
        factor = query.network_factors.get(station.network, 1.0)
        self.a_second, self.a_joule = A_SECOND[query.objective](query) * factor, 0.0
        self.stop = self.a_second * query.overhead_s
        if query.objective is Objective.COST and station.price is not None:
            self.stop += station.price.per_session or 0.0
            self.a_joule = (station.price.per_kwh or 0.0) / (3.6e6 * charging.dc_eff)
            self.a_second += (station.price.per_min or 0.0) / 60.0

    def cost(self, charge_j: NDArray[np.float64]) -> NDArray[np.float64]:
        k = np.clip(np.searchsorted(self.at_j, charge_j, side="right") - 1, 0, self.at_j.size - 2)
        p0 = self.power_w[k]
        slope = (self.power_w[k + 1] - p0) / (self.at_j[k + 1] - self.at_j[k])
        step = charge_j - self.at_j[k]
        share = slope * step / p0
        with np.errstate(divide="ignore", invalid="ignore"):
            taken = np.where(np.abs(share) < 1e-9, step / p0, np.log1p(share) / np.where(slope == 0.0, 1.0, slope))
        out: NDArray[np.float64] = self.a_second * (self.since_s[k] + taken) + self.a_joule * charge_j
        return out


def least_cost(world: World) -> float:
    """Least cost of any journey: all orders of stops, all ways, charges on a grid that is refined; inf for none."""
    charging = world.charging
    spots = [world.places[0], *(station.position for station in world.stations), world.places[-1], world.places[1]]
    goal = len(spots) - 2
    via = goal + 1 if len(world.places) == 3 else None
    piles = {k + 1: Pile(world, station) for k, station in enumerate(world.stations)}
    known = {(i, j): trails(world, spots[i], spots[j]) for i in range(goal) for j in range(1, goal + 1) if i != j}
    past = {}
    if via is not None:
        to_via = {i: trails(world, spots[i], spots[via]) for i in range(goal)}
        from_via = {j: trails(world, spots[via], spots[j]) for j in range(1, goal + 1)}
        past = {(i, j): over_via(world, to_via[i], from_via[j]) for i in range(goal) for j in range(1, goal + 1)}
    second = A_SECOND[charging.objective](charging)
    joule = 1.0 if charging.objective is Objective.ENERGY else 0.0
    best = math.inf
    orders = [order for count in range(len(piles) + 1) for order in itertools.permutations(range(1, goal), count)]
    # without a via point no station is called at twice; with one, each before it and behind it
    rows = [(before, behind) for before in orders for behind in (orders if via is not None else [None])]
    for before, behind in rows:
        order = before if behind is None else before + behind
        pairs = list(itertools.pairwise([0, *order, goal]))
        fixed = sum(piles[k].stop for k in order)
        legs = [known.get(pair, []) for pair in pairs]
        if behind is not None:
            legs[len(before)] = past[pairs[len(before)]]
        for ways in itertools.product(*legs):
            driven = sum(second * way.time_s + joule * way.driven_j for way in ways)
            if driven + fixed < best:
                charged = least_charging_cost(world, [piles[k] for k in order], ways, best - driven - fixed)
                best = min(best, driven + fixed + charged)
    return best


def least_charging_cost(world: World, piles: list[Pile], ways: tuple[Trail, ...], enough: float) -> float:
    """Least cost of charging at stations in a row with given ways between them; inf where they can't be driven."""
    query, charging, capacity_j = world.query, world.charging, world.capacity_j
    reserve_j = query.reserve_soc_frac * capacity_j
    least, full, energy = [], [], []
    for k, way in enumerate(ways):
        _, energy_j, need_j, spill_j, longest_j = way.takes
        goal = k == len(ways) - 1
        arrive_j = (
            max(charging.goal_soc_frac * capacity_j, reserve_j) if goal else charging.arrive_soc_frac * capacity_j
        )
        if longest_j > capacity_j - reserve_j or capacity_j - spill_j < arrive_j:
            return math.inf
        least.append(max(arrive_j + energy_j, reserve_j + need_j))
        full.append(capacity_j - spill_j)
        energy.append(energy_j)
    start_j = query.soc_frac * capacity_j
    if start_j < least[0] - 1e-9:
        return math.inf
    arrive_j = min(start_j - energy[0], full[0])
    if not piles:
        return 0.0
    cap_j = charging.max_soc_frac * capacity_j
    low, high = [], []
    for k in range(len(piles)):
        low.append(max(least[k + 1], arrive_j if k == 0 else 0.0))
        high.append(max(cap_j, arrive_j) if k == 0 else cap_j)
        if low[k] > high[k] + 1e-9:
            return math.inf
        high[k] = max(high[k], low[k])
    grids = []
    for k in range(len(piles)):
        marks = [piles[k].at_j, np.array([full[k + 1] + energy[k + 1]])]
        if k + 1 < len(piles):
            marks.append(piles[k + 1].at_j + energy[k + 1])
        inside = np.concatenate(marks)
        inside = inside[(inside > low[k]) & (inside < high[k])]
        grids.append(np.unique(np.concatenate((np.linspace(low[k], high[k], GRID), inside))))
    for k in range(len(piles) - 1, 0, -1):  # what leaving a station lower by makes of the one before
        onto = grids[k] + energy[k]
        onto = onto[(onto > low[k - 1]) & (onto < high[k - 1])]
        grids[k - 1] = np.unique(np.concatenate((grids[k - 1], onto)))
    best = math.inf
    for _ in range(ZOOMS):
        cost, chosen = _row(piles, grids, energy, full, arrive_j)
        best = min(best, cost)
        if not cost < enough + 0.05 * abs(enough) + 20.0:
            break
        grids = [np.union1d(_near(grid, at), [at]) for grid, at in zip(grids, chosen, strict=True)]
    return best


def _near(grid: NDArray[np.float64], at: float) -> NDArray[np.float64]:
    k = int(np.searchsorted(grid, at))
    return np.linspace(grid[max(k - 1, 0)], grid[min(k + 1, grid.size - 1)], 41)


def _row(
    piles: list[Pile],
    grids: list[NDArray[np.float64]],
    energy: list[float],
    full: list[float],
    arrive_j: float,
) -> tuple[float, list[float]]:
    """Least cost over the grids' charges, and these charges: a station is left with no less than it is come to with."""
    last = len(piles) - 1
    ahead = piles[last].cost(grids[last])
    onward: list[NDArray[np.intp]] = []
    for k in range(last - 1, -1, -1):
        arrives = np.minimum(grids[k] - energy[k + 1], full[k + 1])
        least, place = np.append(ahead, math.inf), np.arange(ahead.size + 1)
        for j in range(ahead.size - 1, -1, -1):  # the least of all that leave with no less
            if least[j + 1] < least[j]:
                least[j], place[j] = least[j + 1], place[j + 1]
        first = np.searchsorted(grids[k + 1], arrives - 1e-9 * grids[k + 1][-1])
        onward.insert(0, place[first])
        ahead = piles[k].cost(grids[k]) - piles[k + 1].cost(np.maximum(arrives, 0.0)) + least[first]
    best = int(np.argmin(ahead))
    cost = float(ahead[best] - piles[0].cost(np.array([arrive_j]))[0])
    chosen = [best]
    for places in onward:
        chosen.append(min(int(places[chosen[-1]]), grids[len(chosen)].size - 1))
    return cost, [float(grid[k]) for grid, k in zip(grids, chosen, strict=True)]
