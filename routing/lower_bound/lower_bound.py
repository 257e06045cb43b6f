"""The lower bound that directs a search to its goal: least costs of links, and the search back that adds them up."""

from __future__ import annotations

import math
import threading
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from routing.dominance.bounds import least_load_n
from routing.graph.earth import EARTH_RADIUS_M
from routing.links import kernels_tables
from routing.links.aligned import aligned
from routing.lower_bound import kernels_least, kernels_lower_bound
from routing.lower_bound.kernels_least import Reduction
from routing.lower_bound.kernels_lower_bound import GoalBound
from routing.time_budget import time_budget

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from energy.force.kernels_physics import LinkPhysics
    from routing.dominance.kernels_rules import SlackRules
    from routing.graph.road_graph import RoadGraph
    from routing.links.kernels_tables import LinkArrays

PASSES: Final = 4  # over the turns, each of which raises the speeds that links are known to be entered with
NOISE_FRAC: Final = 1e-9
MOST_GOALS: Final = 64  # beyond which a search runs undirected


def plain_physics(physics: LinkPhysics) -> LinkPhysics:
    """A vehicle without losses, caps, climate and cold tyres, all of which only add energy."""
    return physics._replace(
        regen_cap_w=math.inf,
        fade_width_j=0.0,
        loss_per_n2=0.0,
        loss_per_w=0.0,
        regen_min_mps=0.0,
        lossy=False,
        cabin_w=0.0,
        cabin_start_w=0.0,
        tyre_time_s=0.0,
    )


@dataclass(frozen=True, slots=True)
class LeastCosts:
    """Links by the node that they lead into, and what is known of their least costs; shapes as in GoalBound."""

    into_first: NDArray[np.int64]
    into: NDArray[np.float64]
    into_link: NDArray[np.int32]
    entry: NDArray[np.float64]
    physics: LinkPhysics
    place_m: NDArray[np.float64]
    least_a_metre: NDArray[np.float64]
    line_to_road: float


class LowerBound:
    """The least costs of one search space, link by link as searches ask for them; safe between threads."""

    def __init__(
        self, graph: RoadGraph, arrays: LinkArrays, physics: LinkPhysics, slack: SlackRules, alpha: float
    ) -> None:
        self._graph, self._arrays, self._physics = graph, arrays, physics
        self._reduction = Reduction(alpha, slack.sag_n)
        self._costs: LeastCosts | None = None
        self._descent: NDArray[np.float64] | None = None
        self._lock = threading.Lock()
        self.undirected = _undirected(arrays, physics)

    @property
    def held_bytes(self) -> int:
        """Memory of what is known by now [B]."""
        costs, descent = self._costs, self._descent
        held = 0 if descent is None else descent.nbytes
        if costs is not None:
            arrays = (costs.into_first, costs.into, costs.into_link, costs.entry, costs.place_m)
            held += sum(array.nbytes for array in arrays)
        return held

    def costs(self) -> LeastCosts:
        """The links by head and their entries, in O(M) the first time; no least cost is known then.

        Raises as TimeBudget.check does.
        """
        with self._lock:
            if self._costs is None:
                self._costs = self._unknown()
            return self._costs

    def _unknown(self) -> LeastCosts:
        graph, arrays = self._graph, self._arrays
        plain = plain_physics(self._physics)
        entry = np.empty((graph.link_count, 3))
        kernels_least.fill_entries(plain, arrays.row, arrays.successor_first, arrays.successor, PASSES, entry)
        time_budget().check()
        first, order = np.zeros(graph.node_count + 1, np.int64), np.empty(graph.link_count, np.int32)
        kernels_lower_bound.links_by_head(graph.head, first, order)
        into = np.full((graph.link_count, 4), np.nan)
        into[:, kernels_lower_bound.INTO_M] = graph.length_m[order]
        into[:, kernels_lower_bound.INTO_TAIL] = graph.tail[order]
        time_budget().check()
        place_m = _places_m(graph)
        longer = max(kernels_lower_bound.most_straight(place_m, graph.tail, graph.head, graph.length_m), 1.0)
        time_budget().check()
        load_n = max(least_load_n(plain, arrays.roads, np.maximum(arrays.speed_limit_mps, 0.0)), 0.0)
        fastest_mps = float(arrays.speed_limit_mps.max())
        if arrays.carries:  # on board a metre takes nothing
            load_n, carried = 0.0, arrays.speed_limit_mps < 0.0
            carried_s = arrays.row[carried, kernels_tables.CRUISE_S]
            fastest_mps = max(fastest_mps, float((arrays.length_m[carried] / carried_s).max()))
        a_metre = np.array((self._reduction.alpha * load_n, 1.0 / fastest_mps, 1.0))
        return LeastCosts(first, into, order, entry, plain, place_m, a_metre, (1.0 - NOISE_FRAC) / longer)

    def descent(self) -> NDArray[np.float64]:
        """What ways on give back at most, float64 (M, 2) as in SearchRules, in O(M log M) the first time (lemma 10)."""
        graph = self._graph
        costs, h = self.costs(), self.towards(GoalBoundScratch(graph.node_count + graph.link_count), 0, ())
        with self._lock:
            if self._descent is None:
                height_j = self._reduction.alpha * self._physics.weight_n * graph.node_height_m
                level_j = height_j.copy()
                heat_w = 0.0 if self._arrays.carries else self._physics.cabin_w  # none on board
                kernels_lower_bound.lower_levels(h, heat_w, level_j)
                slowest_mps = costs.entry[:, kernels_least.SLOWEST]
                self._descent = np.column_stack(((height_j - level_j)[graph.tail], slowest_mps))
            return self._descent

    def towards(self, scratch: GoalBoundScratch, start_link: int, goal_links: Sequence[int]) -> GoalBound:
        """What directs a search from a place on a link to places on others."""
        costs, arrays, tail = self.costs(), self._arrays, self._graph.tail
        bound = GoalBound(
            used=True,
            into_first=costs.into_first,
            into=costs.into,
            into_link=costs.into_link,
            tail=tail,
            entry=costs.entry,
            physics=costs.physics,
            reduction=self._reduction,
            row=arrays.row,
            roads=arrays.roads,
            successor_first=arrays.successor_first,
            successor=arrays.successor,
            place_m=costs.place_m,
            start_m=costs.place_m[tail[start_link]],
            least_a_metre=costs.least_a_metre,
            line_to_road=costs.line_to_road,
            node=scratch.node,
            heap_key=scratch.heap_key,
            heap_node=scratch.heap_node,
            in_heap=scratch.in_heap,
            reach=scratch.reach,
            epoch=scratch.next_epoch(),
        )
        kernels_lower_bound.set_out(bound, tail[list(goal_links)].astype(np.int64))
        return bound


def _places_m(graph: RoadGraph) -> NDArray[np.float64]:
    """Nodes on the mean sphere, float64 (N, 3) [m]: straight lines through it are shorter than any way on it."""
    lat, lon = np.radians(graph.node_lat_deg), np.radians(graph.node_lon_deg)
    return EARTH_RADIUS_M * np.column_stack((np.cos(lat) * np.cos(lon), np.cos(lat) * np.sin(lon), np.sin(lat)))


class GoalBoundScratch:
    """Arrays that one search back writes; room for a node a link, of which a connected graph has no more."""

    def __init__(self, links: int) -> None:
        self.node = np.zeros((links + 1, 3))
        self.heap_key = aligned(links + MOST_GOALS, 1)
        self.heap_node = np.empty(links + MOST_GOALS, np.int32)
        self.in_heap = np.zeros(1, np.int64)
        self.reach = np.zeros(2)
        self.epoch = 0.0

    @property
    def held_bytes(self) -> int:
        """Memory of its arrays [B]."""
        return self.node.nbytes + self.heap_key.nbytes + self.heap_node.nbytes

    def next_epoch(self) -> float:
        """The number of the search that begins."""
        self.epoch += 1.0
        return self.epoch


def _undirected(arrays: LinkArrays, physics: LinkPhysics) -> GoalBound:
    """What a search without a goal is given; its arrays are of the types of any other, of which none is read."""
    none, nowhere = np.empty((0, 4)), np.zeros(0, np.int32)
    nowhere.flags.writeable = False  # as the arrays of a graph are, so that there is one compiled search
    return GoalBound(
        used=False,
        into_first=np.zeros(1, np.int64),
        into=none,
        into_link=np.zeros(0, np.int32),
        tail=nowhere,
        entry=none,
        physics=physics,
        reduction=Reduction(0.0, 0.0),
        row=arrays.row,
        roads=arrays.roads,
        successor_first=arrays.successor_first,
        successor=arrays.successor,
        place_m=none,
        start_m=np.empty(0),
        least_a_metre=np.empty(0),
        line_to_road=1.0,
        node=none,
        heap_key=np.empty(0),
        heap_node=np.zeros(0, np.int32),
        in_heap=np.zeros(1, np.int64),
        reach=np.zeros(2),
        epoch=0.0,
    )
