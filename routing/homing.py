"""The lower bound that directs a search to its goal: least costs of links, and the search back that adds them up."""

from __future__ import annotations

import math
import threading
from dataclasses import dataclass
from enum import StrEnum
from typing import TYPE_CHECKING, Final

import numpy as np

from routing import kernels_homing, kernels_least
from routing.aligned import aligned
from routing.kernels_homing import Homing

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from energy.kernels_force import LinkPhysics
    from routing.graph import RoadGraph
    from routing.kernels import LinkArrays
    from routing.kernels_gap import GapRules

PASSES: Final = 4  # over the turns, each of which raises the speeds that links are known to be entered with
MOST_GOALS: Final = 64  # beyond which a search runs undirected


@dataclass(frozen=True, slots=True)
class LeastCosts:
    """What links take at least, whatever they are entered with; shapes as in Homing."""

    into_first: NDArray[np.int64]
    into: NDArray[np.float64]
    slowest_mps: NDArray[np.float64]


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


def least_costs(graph: RoadGraph, arrays: LinkArrays, physics: LinkPhysics, gap: GapRules, alpha: float) -> LeastCosts:
    """Least energy above the potential and least time of every link, in O(M)."""
    plain = plain_physics(physics)
    links = graph.link_count
    turns = (arrays.successor_first, arrays.successor)
    entry, least = np.empty((links, 3)), np.empty((links, 2))
    kernels_least.fill_entries(plain, arrays.row, *turns, PASSES, entry)
    kernels_least.fill_least(plain, alpha, gap.sag_n, arrays.row, arrays.roads, *turns, entry, least)
    first, order = np.zeros(graph.node_count + 1, np.int64), np.empty(links, np.int32)
    kernels_homing.links_by_head(graph.head, first, order)
    into = np.column_stack((least[order], graph.length_m[order], graph.tail[order]))
    return LeastCosts(first, np.ascontiguousarray(into), np.ascontiguousarray(entry[:, kernels_least.SLOWEST]))


class Direction(StrEnum):
    """Whether a search is directed to its goals, which changes its work and not its answer."""

    NEVER = "never"
    WHEN_READY = "when ready"  # not before the least costs are known, which are then computed beside the first searches
    ALWAYS = "always"


class Guide:
    """The least costs of one search space; safe between threads."""

    def __init__(self, graph: RoadGraph, arrays: LinkArrays, physics: LinkPhysics, gap: GapRules, alpha: float) -> None:
        self._known = (graph, arrays, physics, gap, alpha)
        self._tail = graph.tail
        self._costs: LeastCosts | None = None
        self._computing = threading.Lock()
        self._begun = False

    def costs(self) -> LeastCosts:
        """The least costs of all links, computed if they are not known."""
        with self._computing:
            if self._costs is None:
                self._costs = least_costs(*self._known)
            return self._costs

    def directs(self, direction: Direction) -> bool:
        """Whether a search is to be directed now; the first one that asks has the least costs computed beside it.

        They take as long as many searches of a small part of a large graph, and one-off conditions never pay for them.
        """
        if direction is not Direction.WHEN_READY:
            return direction is Direction.ALWAYS
        if self._costs is None and not self._begun:
            self._begun = True
            threading.Thread(target=self.costs, name="least-costs", daemon=True).start()
        return self._costs is not None

    def homing(self, scratch: HomingScratch, goal_links: Sequence[int]) -> Homing:
        """What directs a search to places on these links."""
        costs = self.costs()
        homing = Homing(
            used=True,
            into_first=costs.into_first,
            into=costs.into,
            tail=self._tail,
            slowest_mps=costs.slowest_mps,
            node=scratch.node,
            heap_key=scratch.heap_key,
            heap_node=scratch.heap_node,
            in_heap=scratch.in_heap,
            reach=scratch.reach,
            epoch=scratch.next_epoch(),
        )
        kernels_homing.set_out(homing, self._tail[list(goal_links)].astype(np.int64))
        return homing


class HomingScratch:
    """Arrays that one search back writes; room for a node a link, of which a connected graph has no more."""

    def __init__(self, links: int) -> None:
        self.node = np.zeros((links + 1, 3))
        self.heap_key = aligned(links + MOST_GOALS, 1)
        self.heap_node = np.empty(links + MOST_GOALS, np.int32)
        self.in_heap = np.zeros(1, np.int64)
        self.reach = np.zeros(2)
        self.epoch = 0.0

    def next_epoch(self) -> float:
        """The number of the search that begins."""
        self.epoch += 1.0
        return self.epoch


def undirected() -> Homing:
    """What a search without a goal is given."""
    nowhere = np.zeros(0, np.int32)
    nowhere.flags.writeable = False  # as the arrays of a graph are, so that there is one compiled search
    none = np.empty(0)
    return Homing(
        used=False,
        into_first=np.zeros(1, np.int64),
        into=np.empty((0, 4)),
        tail=nowhere,
        slowest_mps=none,
        node=np.empty((0, 3)),
        heap_key=none,
        heap_node=np.empty(0, np.int32),
        in_heap=np.zeros(1, np.int64),
        reach=np.zeros(2),
        epoch=0.0,
    )


UNDIRECTED: Final = undirected()
