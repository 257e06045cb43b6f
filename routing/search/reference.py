"""The label-setting search on a networkx graph, written to be read: the slow twin of routing.search.kernels_search.

It knows a graph as routing.graph.networkx_graph.to_networkx makes it. The link model is the edge-cost function:
driving an edge costs what energy.chain.kernels_link.link_energy says for the speed it is entered with and the limit of
the edge that follows. Labels are compared only when their states are equal, unless a bound on what differing states
are worth is given; the compiled search has such a bound, and must find the same costs.
"""

from __future__ import annotations

import heapq
import itertools
import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np

from energy.chain.kernels_link import link_energy
from energy.force.effects import LinkSetting
from energy.force.kernels_physics import accepted_j, cabin_energy_j, road_in_time
from energy.stops import FunctionalClass, StopSettings
from energy.units import JOULE_PER_KWH, METRE_PER_KM, SECOND_PER_HOUR
from routing.dominance.bounds import slack_rules, warm_up_w
from routing.errors import SearchLimitError
from routing.graph.earth import EARTH_RADIUS_M
from routing.search.found import Limits

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    import networkx as nx
    from numpy.typing import NDArray

    from energy.force.effects import Drive
    from energy.force.kernels_physics import LinkPhysics
    from routing.weights import Weights

    NetworkxGraph = nx.MultiDiGraph[Any]

Edge: TypeAlias = tuple[Any, Any, int]


@dataclass(frozen=True, slots=True)
class State:
    """An edge about to be driven, its entry speed [m/s], and the probability of having stopped before it."""

    edge: Edge
    speed_mps: float
    stopped_frac: float
    offset_m: float = 0.0


@dataclass(frozen=True, slots=True)
class TwinLabel:
    """One way of getting into a state; edge None is the goal."""

    state: State | None
    cost: float
    energy_j: float
    time_s: float
    distance_m: float
    parent: TwinLabel | None

    def edges(self) -> tuple[Edge, ...]:
        """The edges driven to get here, in order."""
        way: list[Edge] = []
        label = self.parent
        while label is not None:
            assert label.state is not None
            way.append(label.state.edge)
            label = label.parent
        return tuple(reversed(way))


Dominance: TypeAlias = "Callable[[TwinLabel, TwinLabel], bool]"


@dataclass(frozen=True, slots=True)
class EnergySearch:
    """Searches on one graph for one vehicle under given conditions; graph edges as to_networkx makes them.

    dominance(a, b), if given, says that a makes b superfluous though their states differ. Without it labels may grow
    without end; beyond label_limit of them, if given, a search raises SearchLimitError.
    """

    graph: NetworkxGraph
    drive: Drive
    stops: StopSettings | None
    weights: Weights
    limits: Limits = field(default_factory=Limits)
    dominance: Dominance | None = None
    label_limit: int | None = None
    _roads: dict[Edge, NDArray[np.float64]] = field(default_factory=dict, repr=False)
    _driven_mps: dict[Edge, float] = field(default_factory=dict, repr=False)
    _warm_up_w: tuple[float, float] = field(default=(0.0, 0.0), init=False, repr=False)

    def __post_init__(self) -> None:
        for key in self.graph.edges(keys=True):
            self._driven_mps[key], self._roads[key] = self._road(key)
            if "duration_s" in self.graph.edges[key]:
                self._driven_mps[key] = 0.0  # nobody boards a ferry but at rest
        if self.physics.tyre_time_s > 0.0:
            driven, roads = np.array(list(self._driven_mps.values())), np.vstack(list(self._roads.values()))
            slack = slack_rules(self.physics, roads, driven)
            object.__setattr__(self, "_warm_up_w", warm_up_w(self.physics, slack, roads, driven))

    @property
    def physics(self) -> LinkPhysics:
        """Vehicle and conditions as the link model takes them."""
        return self.drive.physics

    def _road(self, key: Edge) -> tuple[float, NDArray[np.float64]]:
        """Speed driven on an edge [m/s], and its row of the table of roads, (1, 8)."""
        edge, tail, head = self.graph.edges[key], self.graph.nodes[key[0]], self.graph.nodes[key[1]]
        middle = math.radians(0.5 * (tail["y"] + head["y"]))
        east = math.radians(head["x"] - tail["x"]) * math.cos(middle) * EARTH_RADIUS_M / edge["length"]
        north = math.radians(head["y"] - tail["y"]) * EARTH_RADIUS_M / edge["length"]
        whole = max(math.hypot(east, north), 1.0)
        driven = self.drive.driven_mps(np.array([edge["speed_limit_mps"]]))
        setting = LinkSetting(
            grade_frac=np.array([self._grade(key)]),
            driven_mps=driven,
            altitude_m=np.array([0.5 * (tail["elevation"] + head["elevation"])]),
            heading=np.array([[east / whole, north / whole]]),
        )
        _, wait = self._stop(edge)
        return float(driven[0]), self.drive.roads(setting, np.array([wait]))

    def edge_cost(
        self,
        state: State,
        next_limit_mps: float,
        *,
        to_m: float | None = None,
        used_j: float = 0.0,
        clock_s: float = 0.0,
    ) -> tuple[float, float, float, float, float]:
        """Energy [J], time [s], distance [m], end speed [m/s] and stop probability of driving a state's edge.

        With to_m the drive ends there with a stop, else at the edge's head. used_j, clock_s: since departure, on which
        climate, tyres and acceptance depend.
        """
        edge = self.graph.edges[state.edge]
        if "duration_s" in edge:  # on board
            return 0.0, 0.0, edge["length"], 0.0, 0.0
        limit = self._driven_mps[state.edge]
        ds = (edge["length"] if to_m is None else to_m) - state.offset_m
        road = road_in_time(self.physics, self._roads[state.edge], 0, clock_s, ds / limit)
        if to_m is not None:
            energy, time, end = link_energy(
                self.physics, road, ds, state.speed_mps, state.stopped_frac, limit, limit, 1.0, 0.0
            )
            return self._taken_j(energy, time, used_j, clock_s), time, ds, 0.0, 1.0
        probability, wait = self._stop(edge)
        energy, time, end = link_energy(
            self.physics,
            road,
            ds,
            state.speed_mps,
            state.stopped_frac,
            limit,
            next_limit_mps,
            probability,
            wait,
        )
        return self._taken_j(energy, time, used_j, clock_s), time, ds, end, probability

    def _taken_j(self, energy_j: float, time_s: float, used_j: float, clock_s: float) -> float:
        """Battery energy of a drive with the climate, as far as the battery accepts what is given back."""
        offered = energy_j + cabin_energy_j(self.physics, clock_s, clock_s + time_s)
        return accepted_j(self.physics, used_j, offered, self.limits.least_energy_j)

    def route(self, starts: Sequence[tuple[Edge, float]], goals: Sequence[tuple[Edge, float]]) -> TwinLabel | None:
        """The cheapest way from rest at a start to rest at a goal (each an edge and an offset [m]), or None."""
        for label in self._settled(starts, goals):
            if label.state is None:
                return label
        return None

    def energy_to_nodes(self, starts: Sequence[tuple[Edge, float]]) -> dict[Any, float]:
        """Least battery energy [J] to stop at each node that can be reached within the limits."""
        best: dict[Any, float] = {}
        for label in self._settled(starts, ()):
            assert label.state is not None
            length = self.graph.edges[label.state.edge]["length"]
            energy, *_ = self.edge_cost(label.state, math.inf, to_m=length, used_j=label.energy_j, clock_s=label.time_s)
            used = max(label.energy_j + energy, self.limits.least_energy_j)
            node = label.state.edge[1]
            if used <= self.limits.most_energy_j and used < best.get(node, math.inf):
                best[node] = used
        return best

    def _settled(
        self, starts: Sequence[tuple[Edge, float]], goals: Sequence[tuple[Edge, float]]
    ) -> Iterator[TwinLabel]:
        """Labels in the order of their reduced cost, dominated ones left out."""
        edge_of = {data["idx"]: (u, v, k) for u, v, k, data in self.graph.edges(keys=True, data=True)}
        bags: dict[Edge, list[TwinLabel]] = {}
        ties = itertools.count()
        heap: list[tuple[float, int, TwinLabel]] = []
        count = 0
        for edge, offset in starts:
            label = TwinLabel(State(edge, 0.0, 0.0, offset), 0.0, 0.0, 0.0, 0.0, None)
            heapq.heappush(heap, (self._key(label, self._height(edge, offset)), next(ties), label))
        while heap:
            _, _, label = heapq.heappop(heap)
            state = label.state
            if state is None:
                yield label
                continue
            # a start lies within its edge and takes part in no dominance
            if label.parent is not None and label not in bags[state.edge]:
                continue
            yield label
            for edge, offset in goals:
                if edge == state.edge and offset > state.offset_m:
                    last = self.edge_cost(state, math.inf, to_m=offset, used_j=label.energy_j, clock_s=label.time_s)
                    made = self._extended(label, last, None)
                    if made is not None:
                        heapq.heappush(heap, (self._key(made, self._height(edge, offset)), next(ties), made))
            for idx in map(int, self.graph.edges[state.edge]["successors"].split()):
                following = edge_of[idx]
                step = self.edge_cost(state, self._driven_mps[following], used_j=label.energy_j, clock_s=label.time_s)
                made = self._extended(label, step, State(following, step[3], step[4]))
                if made is None:
                    continue
                bag = bags.setdefault(following, [])
                if any(self._dominates(other, made) for other in bag):
                    continue
                bag[:] = [other for other in bag if not self._dominates(made, other)]
                bag.append(made)
                count += 1
                if self.label_limit is not None and count > self.label_limit:
                    raise SearchLimitError(count, self.label_limit)
                heapq.heappush(heap, (self._key(made, self._height(following, 0.0)), next(ties), made))

    def _extended(
        self, label: TwinLabel, step: tuple[float, float, float, float, float], state: State | None
    ) -> TwinLabel | None:
        energy, time, distance, _, _ = step
        used = max(label.energy_j + energy, self.limits.least_energy_j)  # a full battery takes no more
        if used > self.limits.most_energy_j:
            return None
        cost = (
            label.cost
            + self.weights.energy * (used - label.energy_j) / JOULE_PER_KWH
            + self.weights.time * time / SECOND_PER_HOUR
            + self.weights.distance * distance / METRE_PER_KM
        )
        if label.state is not None:
            carried_s = self.graph.edges[label.state.edge].get("duration_s", 0.0)
            cost += self.weights.time * carried_s / SECOND_PER_HOUR
        return TwinLabel(state, cost, used, label.time_s + time, label.distance_m + distance, label)

    def _dominates(self, a: TwinLabel, b: TwinLabel) -> bool:
        if a.state == b.state:
            alone = not self.limits.held or (self.weights.time == 0.0 and self.weights.distance == 0.0)
            debt_j = 0.0
            if a.time_s < b.time_s:  # the earlier one may still have more of the climate's start before it
                debt_j = cabin_energy_j(self.physics, a.time_s, b.time_s) - self.physics.cabin_w * (b.time_s - a.time_s)
            debt_j += self._warm_up_debt_j(a.time_s, b.time_s)
            if a.cost + self.weights.energy * debt_j / JOULE_PER_KWH > b.cost:
                return False
            return (
                a.energy_j + debt_j <= b.energy_j
                if debt_j > 0.0 and self.limits.held
                else (alone or a.energy_j <= b.energy_j)
            )
        return self.dominance is not None and self.dominance(a, b)

    def _warm_up_debt_j(self, a_s: float, b_s: float) -> float:
        """Most that colder or warmer tyres can still cost the drive that is there at a_s, not at b_s."""
        tau = self.physics.tyre_time_s
        if tau == 0.0:
            return 0.0
        colder_s = tau * (math.exp(-a_s / tau) - math.exp(-b_s / tau))
        early_w, late_w = self._warm_up_w
        return max(early_w * colder_s, -late_w * colder_s)

    def _key(self, label: TwinLabel, height_m: float) -> float:
        """Cost less the potential: what the position and the speed are worth, so that no step is negative."""
        p = self.physics
        alpha = 0.5 * (p.drive_factor + p.recuperation_factor)
        kinetic = 0.0
        if label.state is not None:
            kinetic = 0.5 * p.inertia_kg * (1.0 - label.state.stopped_frac) * label.state.speed_mps**2
        return label.cost - self.weights.energy * alpha * (p.weight_n * height_m + kinetic) / JOULE_PER_KWH

    def _grade(self, edge: Edge) -> float:
        u, v, _ = edge
        climb: float = self.graph.nodes[v]["elevation"] - self.graph.nodes[u]["elevation"]
        return climb / float(self.graph.edges[edge]["length"])

    def _height(self, edge: Edge, offset_m: float) -> float:
        return float(self.graph.nodes[edge[0]]["elevation"]) + self._grade(edge) * offset_m

    def _stop(self, edge: dict[str, Any]) -> tuple[float, float]:
        if self.stops is None or edge["functional_class"] == FunctionalClass.MOTORWAY:
            return 0.0, 0.0
        row, column = int(edge["urban"]), int(edge["cross"])
        return float(self.stops.probability_frac[row, column]), float(self.stops.time_s[row, column])
