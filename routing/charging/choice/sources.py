"""Searches that begin at many places at once: how far they come with a charge, with how much of it, and at what cost.

Places that are searched from are at rest; no search here tells from which of them a way leads, but the one to a goal.
"""

from __future__ import annotations

import math
from contextlib import contextmanager, nullcontext
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final, TypeAlias

import numpy as np

from energy.units import JOULE_PER_KWH
from routing.charging.choice import kernels_sources
from routing.lower_bound.lower_bound import MOST_GOALS
from routing.places import LinkPosition
from routing.search import kernels_workspace
from routing.search.found import Limits
from routing.search.kernels_arrivals import arrivals
from routing.search.search import (
    begin,
    check_settled,
    found_path,
    goal_places,
    search_counts,
    search_rules,
    settle,
)
from routing.search.space import potential_share
from routing.search.workspaces import grown
from routing.weights import ECO

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from numpy.typing import NDArray

    from routing.graph.road_graph import RoadGraph
    from routing.links.drives import LentDrives
    from routing.lower_bound.kernels_lower_bound import GoalBound
    from routing.route.best_path import RouteSearch
    from routing.search.found import FoundPath
    from routing.search.kernels_workspace import Workspace
    from routing.search.space import SearchSpace
    from routing.weights import Weights

Place: TypeAlias = "tuple[LinkPosition, ...]"  # on each direction of its road

SAME_PLACE_M: Final = 0.5  # as of same_place


@dataclass(frozen=True, slots=True, eq=False)
class Spots:
    """Places as arrays: link and how far along it [m], (p,) each, in the order of places; of: (p,) which place."""

    link: NDArray[np.int64]
    offset_m: NDArray[np.float64]
    of: NDArray[np.int64]
    count: int

    @classmethod
    def at(cls, places: Sequence[Place]) -> Spots:
        """Of places, each by its positions on both directions of its road."""
        positions = [position for place in places for position in place]
        return cls(
            np.array([position.link_idx for position in positions], np.int64),
            np.array([position.offset_m for position in positions], np.float64),
            np.repeat(np.arange(len(places)), np.array([len(place) for place in places], np.int64)),
            len(places),
        )

    def where(self, chosen: NDArray[np.bool_]) -> Spots:
        """Those of chosen places, bool (count,), by the numbers that they have."""
        kept = chosen[self.of]
        return Spots(self.link[kept], self.offset_m[kept], self.of[kept], self.count)

    def joined(self, more: Spots) -> Spots:
        """These and more places after them."""
        of = np.concatenate((self.of, more.of + self.count))
        link, offset_m = np.concatenate((self.link, more.link)), np.concatenate((self.offset_m, more.offset_m))
        return Spots(link, offset_m, of, self.count + more.count)

    def any_of(self, held: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """Places of which any position is so, bool (count,)."""
        found = np.zeros(self.count, np.bool_)
        found[self.of[held]] = True
        return found

    def least_of(self, value: NDArray[np.float64]) -> NDArray[np.float64]:
        """Least value of the positions of each place, float64 (count,)."""
        found = np.full(self.count, math.inf)
        np.minimum.at(found, self.of, value)
        return found


@contextmanager
def _searched(
    search: RouteSearch,
    space: SearchSpace,
    weights: Weights,
    limits: Limits,
    spots: Spots,
    used_j: NDArray[np.float64],
    goals: Sequence[LinkPosition],
    lent: LentDrives,
    bound: GoalBound,
) -> Iterator[tuple[Workspace, bool]]:
    """A workspace in which a search has come from all spots to the first goal, and whether dominance held in full.

    used_j: float64 (p,), what was used before at each of them [J], ≥ 0.
    """
    pool = search.pool
    rules = search_rules(space, weights, limits, False, search.label_limit)
    ws, epoch = pool.take()
    while ws.pointer.shape[0] < 2 * spots.link.size + 4096:
        ws = grown(ws)
    began = begin(space, rules, ws, ())
    kernels_sources.start_labels(space.arrays, space.physics, rules, ws, spots.link, spots.offset_m, used_j)
    ws, status = settle(space, rules, ws, goal_places(goals), lent, bound, epoch)
    check_settled(status, space, ws, pool, rules, epoch)
    counts = search_counts(space, ws, rules, began)
    try:
        yield ws, counts.crowded == 0 and counts.unpaid_j == 0.0
    finally:
        pool.give_back(ws, epoch)


@dataclass(frozen=True, slots=True)
class Held:
    """What a battery keeps on the way: at least the reserve, which may be −inf, and at most its capacity [J]."""

    reserve_j: float
    capacity_j: float

    def limits(self, charge_j: float) -> Limits:
        """Energy from a charge on."""
        return Limits(charge_j - self.capacity_j, max(charge_j - self.reserve_j, 0.0))


def reached_from(
    search: RouteSearch, space: SearchSpace, held: Held, sources: Spots, charge_j: NDArray[np.float64], places: Spots
) -> NDArray[np.float64] | None:
    """No way from any source comes to places with more charge, float64 (n,) [J]; −inf where none comes there.

    charge_j: float64 (count,) of sources. Energy counts up to where a way comes onto a place's link, and what height
    stores after it. One search of all: O(M log M). None where it is not certain. Raises SearchLimitError, TimeUpError,
    AbandonedError.
    """
    if sources.link.size == 0:
        return np.full(places.count, -math.inf)
    graph: RoadGraph = search.graph
    node_energy, link_reach = np.full(graph.node_count, np.inf), np.full(graph.link_count, -1.0)
    key = np.full(graph.link_count, math.inf)
    most_j = float(charge_j[sources.of].max())
    limits, used_j = held.limits(most_j), most_j - charge_j[sources.of]
    with (
        space.drives.lent() as lent,
        _searched(search, space, ECO, limits, sources, used_j, (), lent, space.lower_bound.undirected) as (ws, certain),
    ):
        if not certain:
            return None
        rules = search_rules(space, ECO, limits, False, search.label_limit)
        arrivals(space.arrays, space.physics, rules, ws, lent.table, graph.head, node_energy, link_reach)
        kernels_sources.least_keys(ws, key)
    link_reach[space.arrays.speed_limit_mps < 0.0] = -1.0  # nobody stops on board
    space.join_reach(link_reach)
    least_j = JOULE_PER_KWH * (key[places.link] + _stored(space, ECO, places))
    least_j[link_reach[places.link] < places.offset_m - SAME_PLACE_M] = math.inf
    return most_j - places.least_of(least_j)


@dataclass(frozen=True, slots=True)
class Left:
    """The most charge that is left at a goal from any source [J], from which, and by which way; −inf, −1 for none."""

    most_j: float = -math.inf
    source: int = -1
    path: FoundPath | None = None


def most_left(
    search: RouteSearch, space: SearchSpace, held: Held, sources: Spots, charge_j: NDArray[np.float64], goal: Place
) -> Left | None:
    """What is left at a goal. charge_j: float64 (count,) of sources.

    None where it is not certain. Raises as reached_from does.
    """
    if sources.link.size == 0:
        return Left()
    most_j = float(charge_j[sources.of].max())
    limits, used_j = held.limits(most_j), most_j - charge_j[sources.of]
    undirected = nullcontext(space.lower_bound.undirected)
    whence = [LinkPosition(int(sources.link[0]), float(sources.offset_m[0]))]
    directed = 0 < len(goal) <= MOST_GOALS and space.conserving
    bounds = search.pool.directed(space, whence, goal) if directed else undirected
    with (
        space.drives.lent() as lent,
        bounds as bound,
        _searched(search, space, ECO, limits, sources, used_j, goal, lent, bound) as (ws, certain),
    ):
        if not certain:
            return None
        label = int(ws.counter[kernels_workspace.GOAL])
        if label < 0:
            return Left()
        left_j = most_j - float(ws.number[label, kernels_workspace.ENERGY])
        path = found_path(space, ws, label, goal, 0.0)
        while ws.pointer[label, kernels_workspace.PARENT] >= 0:  # sources are the labels that were made first
            label = int(ws.pointer[label, kernels_workspace.PARENT])
        return Left(left_j, int(sources.of[label]), path)


def least_costs_from(
    search: RouteSearch, space: SearchSpace, weights: Weights, source: Place, places: Spots
) -> NDArray[np.float64]:
    """No way from a source to places costs less by weights, float64 (n,); inf where there is none.

    One search to all links: what is paid up to where a way comes onto a place's link, and what height stores after it.
    Raises as reached_from does.
    """
    if not space.conserving:  # where keys may fall
        return np.full(places.count, -math.inf)
    least = np.full(search.graph.link_count, math.inf)
    whence, undirected = Spots.at([source]), space.lower_bound.undirected
    unused = np.zeros(whence.link.size)
    with (
        space.drives.lent() as lent,
        _searched(search, space, weights, Limits(), whence, unused, (), lent, undirected) as (ws, _),
    ):
        kernels_sources.least_keys(ws, least)
    return places.least_of(least[places.link] + _stored(space, weights, places))


def heights_m(space: SearchSpace, places: Spots) -> NDArray[np.float64]:
    """Heights of all positions of places, float64 (p,) [m]."""
    found: NDArray[np.float64] = (
        space.arrays.tail_height_m[places.link] + space.arrays.grade_frac[places.link] * places.offset_m
    )
    return found


def _stored(space: SearchSpace, weights: Weights, places: Spots) -> NDArray[np.float64]:
    """What height stores at all positions of places by weights, which keys of labels lack, float64 (p,)."""
    share = weights.energy / JOULE_PER_KWH * potential_share(space.physics) * space.physics.weight_n
    return share * heights_m(space, places)
