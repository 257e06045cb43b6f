"""The label-setting search on a networkx graph, written to be read: the slow twin of routing.kernels.

It knows a graph as routing.networkx_graph.to_networkx makes it. The link model is the edge-cost function: driving an
edge costs what energy.kernels.link_energy says for the speed it is entered with and the limit of the edge that
follows. Labels are compared only when their states are equal, unless a bound on what differing states are worth is
given; the compiled search has such a bound, and must find the same costs.
"""

from __future__ import annotations

import heapq
import itertools
import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, TypeAlias

from energy.kernels import LinkPhysics, link_energy
from energy.stops import FunctionalClass, StopSettings
from routing.search import JOULE_PER_KWH, METRE_PER_KM, SECOND_PER_HOUR, Limits

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    import networkx as nx

    from routing.query import Weights

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
class Label:
    """One way of getting into a state; edge None is the goal."""

    state: State | None
    cost: float
    energy_j: float
    time_s: float
    distance_m: float
    parent: Label | None

    def edges(self) -> tuple[Edge, ...]:
        """The edges driven to get here, in order."""
        way: list[Edge] = []
        label = self.parent
        while label is not None:
            assert label.state is not None
            way.append(label.state.edge)
            label = label.parent
        return tuple(reversed(way))


Dominance: TypeAlias = "Callable[[Label, Label], bool]"


@dataclass(frozen=True, slots=True)
class EnergySearch:
    """Searches on one graph for one vehicle; graph edges as to_networkx makes them.

    dominance(a, b), if given, says that a makes b superfluous though their states differ.
    """

    graph: NetworkxGraph
    physics: LinkPhysics
    stops: StopSettings | None
    weights: Weights
    limits: Limits = field(default_factory=Limits)
    dominance: Dominance | None = None

    def edge_cost(
        self, state: State, next_limit_mps: float, *, to_m: float | None = None
    ) -> tuple[float, float, float, float, float]:
        """Energy [J], time [s], distance [m], end speed [m/s] and stop probability of driving a state's edge.

        With to_m the drive ends there with a stop, else at the edge's head.
        """
        edge = self.graph.edges[state.edge]
        limit = edge["speed_limit_mps"]
        if to_m is not None:
            ds = to_m - state.offset_m
            energy, time, end = link_energy(
                self.physics, ds, self._grade(state.edge), state.speed_mps, state.stopped_frac, limit, limit, 1.0, 0.0
            )
            return energy, time, ds, 0.0, 1.0
        ds = edge["length"] - state.offset_m
        probability, wait = self._stop(edge)
        energy, time, end = link_energy(
            self.physics,
            ds,
            self._grade(state.edge),
            state.speed_mps,
            state.stopped_frac,
            limit,
            next_limit_mps,
            probability,
            wait,
        )
        return energy, time, ds, end, probability

    def route(self, starts: Sequence[tuple[Edge, float]], goals: Sequence[tuple[Edge, float]]) -> Label | None:
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
            energy, *_ = self.edge_cost(label.state, math.inf, to_m=length)
            used = max(label.energy_j + energy, self.limits.least_energy_j)
            node = label.state.edge[1]
            if used <= self.limits.most_energy_j and used < best.get(node, math.inf):
                best[node] = used
        return best

    def _settled(self, starts: Sequence[tuple[Edge, float]], goals: Sequence[tuple[Edge, float]]) -> Iterator[Label]:
        """Labels in the order of their reduced cost, dominated ones left out."""
        edge_of = {data["idx"]: (u, v, k) for u, v, k, data in self.graph.edges(keys=True, data=True)}
        bags: dict[Edge, list[Label]] = {}
        ties = itertools.count()
        heap: list[tuple[float, int, Label]] = []
        for edge, offset in starts:
            label = Label(State(edge, 0.0, 0.0, offset), 0.0, 0.0, 0.0, 0.0, None)
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
                    made = self._extended(label, self.edge_cost(state, math.inf, to_m=offset), None)
                    if made is not None:
                        heapq.heappush(heap, (self._key(made, self._height(edge, offset)), next(ties), made))
            for idx in map(int, self.graph.edges[state.edge]["successors"].split()):
                following = edge_of[idx]
                step = self.edge_cost(state, self.graph.edges[following]["speed_limit_mps"])
                made = self._extended(label, step, State(following, step[3], step[4]))
                if made is None:
                    continue
                bag = bags.setdefault(following, [])
                if any(self._dominates(other, made) for other in bag):
                    continue
                bag[:] = [other for other in bag if not self._dominates(made, other)]
                bag.append(made)
                heapq.heappush(heap, (self._key(made, self._height(following, 0.0)), next(ties), made))

    def _extended(
        self, label: Label, step: tuple[float, float, float, float, float], state: State | None
    ) -> Label | None:
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
        return Label(state, cost, used, label.time_s + time, label.distance_m + distance, label)

    def _dominates(self, a: Label, b: Label) -> bool:
        if a.state == b.state:
            alone = not self.limits.held or (self.weights.time == 0.0 and self.weights.distance == 0.0)
            return a.cost <= b.cost and (alone or a.energy_j <= b.energy_j)
        return self.dominance is not None and self.dominance(a, b)

    def _key(self, label: Label, height_m: float) -> float:
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
