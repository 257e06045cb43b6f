"""The way back: from where on the map a charge suffices for driving to one place, and what is left there."""

from __future__ import annotations

import threading
import time
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from routing.cache_budget import CacheBudget
from routing.errors import SearchLimitError
from routing.range import kernels_departure, kernels_entries, kernels_way_back
from routing.range.area import RoadEnergies
from routing.range.kernels_entries import Entries, EntryList
from routing.range.kernels_way_back import Goal, Homeward, ReverseArrays, ReverseRules
from routing.search.found import Reach, SearchCounts
from routing.search.space import potential_share
from routing.time_budget import time_budget

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from routing.graph.road_graph import RoadGraph
    from routing.places import LinkPosition
    from routing.search.space import SearchSpace


@dataclass(frozen=True, slots=True)
class BackCharges:
    """Charges of a way back to a goal [J].

    soc_j: at departure: at every place, or at the goal for a round trip. reserve_j, full_j: charge that is never gone
    below, and that fills the battery. left_j: to be left at the goal, ascending, the reserve first.
    """

    soc_j: float
    reserve_j: float
    full_j: float
    left_j: tuple[float, ...]


def entry_states(graph: RoadGraph, space: SearchSpace) -> Entries:
    """The states in which links are entered, in O(M + S) for a handful of them a link."""
    links, turns = graph.link_count, graph.successor.size
    most = 2 * turns + 4 * links
    gathered = EntryList(
        latest=np.full(links, -1, np.int32),
        earlier=np.empty(most, np.int32),
        link=np.empty(most, np.int32),
        speed_mps=np.empty(most),
        stopped_frac=np.empty(most),
    )
    made = kernels_entries.gather_entries(space.arrays, space.physics, gathered)
    degree = np.diff(graph.successor_first)
    count = np.bincount(graph.successor, minlength=links)
    entries = Entries(
        first=np.empty(links + 1, np.int64),
        link=np.empty(made, np.int32),
        speed_mps=np.empty(made),
        stopped_frac=np.empty(made),
        turn_first=np.empty(made, np.int64),
        turn=np.empty(int(degree[gathered.link[:made]].sum()), np.int32),
        before_first=np.concatenate((np.zeros(1, np.int64), np.cumsum(count))),
        before=np.empty(turns, np.int32),
        before_turn=np.empty(turns, np.int32),
    )
    kernels_entries.sort_entries(space.arrays, gathered, entries)
    kernels_entries.join_entries(space.arrays, space.physics, entries)
    return entries


class ReverseSearch:
    """Searches back on one graph; keeps the states of entry between queries, safe between threads."""

    def __init__(self, graph: RoadGraph, label_limit: int, budget: CacheBudget | None = None) -> None:
        self._graph = graph
        self._budget = CacheBudget() if budget is None else budget
        self._label_limit = label_limit
        self._entries: dict[int, tuple[SearchSpace, Entries]] = {}
        self._lock = threading.Lock()

    def warm_up(self, space: SearchSpace, place: LinkPosition) -> None:
        """Compile the kernels before the first query."""
        back = self.way_back(space, (place,))
        charges = BackCharges(0.0, 0.0, 1.0, (0.0,))
        nothing = np.full(self._graph.node_count, np.inf)
        nowhere = np.full(self._graph.link_count, -1.0)
        back.reverse(charges)
        back.round_trip(charges, Reach(nothing, nowhere, 0.0, SearchCounts(0, 0, 0.0, False, 0, 0)))

    def way_back(self, space: SearchSpace, goals: Sequence[LinkPosition]) -> WayBack:
        """The way back to a goal on the graph as a vehicle sees it."""
        key = id(space)  # kept beside it, so that no other space can have the same
        with self._lock:
            kept = self._entries.get(key)
        if kept is None:
            made = space, entry_states(self._graph, space)
            with self._lock:
                kept = self._entries.setdefault(key, made)
        entries = kept[1]
        self._budget.used(
            space, "entries", "entries", lambda: sum(part.nbytes for part in entries), partial(self._drop, key)
        )
        return WayBack(self._graph, space, entries, goals, self._label_limit)

    def _drop(self, key: int) -> None:
        with self._lock:
            self._entries.pop(key, None)


class WayBack:
    """Searches back to one goal on one graph as a vehicle sees it."""

    def __init__(
        self,
        graph: RoadGraph,
        space: SearchSpace,
        entries: Entries,
        goals: Sequence[LinkPosition],
        label_limit: int,
    ) -> None:
        self._graph = graph
        self._space = space
        self._entries = entries
        self._goal = Goal(np.array([g.link_idx for g in goals], np.int64), np.array([g.offset_m for g in goals]))
        self._label_limit = label_limit
        self._counts = SearchCounts(0, 0, 0.0, False, 0, 0)

    def reverse(self, charges: BackCharges) -> tuple[RoadEnergies, SearchCounts]:
        """Energy from every place to the goal, departing with charges.soc_j; raises SearchLimitError."""
        charge = np.full(self._graph.node_count, charges.soc_j)
        found = self._left_j(charges, charge)
        begin = np.full(self._graph.link_count, np.inf)
        node_left, head_left = self._node_most(found.left_j), self._head_left(found.left_j)
        for rules, labels in found.searched:
            arrays = self._arrays(rules, labels)
            kernels_departure.first_places(arrays, head_left, charges.soc_j, charges.reserve_j, found.left_j, begin)
        for value in (begin, found.left_j, head_left):
            self._space.copy_values(value)
        reached = np.isfinite(begin) & (self._space.arrays.speed_limit_mps >= 0.0)  # nobody departs on board
        return (
            RoadEnergies(
                node_energy_j=charges.soc_j - node_left,
                tail_energy_j=charges.soc_j - found.left_j,
                head_energy_j=charges.soc_j - head_left,
                from_m=np.where(reached, begin, 0.0),
                to_m=np.where(reached, self._graph.length_m, -1.0),
                most_energy_j=charges.soc_j - charges.reserve_j,
            ),
            self._counts,
        )

    def round_trip(self, charges: BackCharges, out: Reach) -> tuple[RoadEnergies, SearchCounts]:
        """Energy of driving from the goal to every place, stopping there, and back; raises SearchLimitError.

        out: what is reached from the goal with charges.soc_j.
        """
        graph = self._graph
        charge = charges.soc_j - out.node_energy_j
        found = self._left_j(charges, charge)
        node_energy = charges.soc_j - self._node_most(found.left_j)
        tail, head = node_energy[graph.tail], node_energy[graph.head]
        driven = out.link_reach_m >= graph.length_m
        whole = driven & np.isfinite(tail) & np.isfinite(head)
        end_charge = np.where(driven, charge[graph.head], charges.soc_j - out.most_energy_j)
        rim_m = np.where(np.isfinite(tail) & ~whole, out.link_reach_m, -1.0)
        turn_m = np.where(whole, graph.length_m, -1.0)
        for rules, labels in found.searched:
            kernels_departure.last_places(
                self._arrays(rules, labels),
                graph.reverse_idx,
                charge[graph.tail],
                end_charge,
                rim_m,
                charges.reserve_j,
                turn_m,
            )
        turn_m[self._space.arrays.speed_limit_mps < 0.0] = -1.0
        self._space.copy_values(turn_m)
        return (
            RoadEnergies(
                node_energy_j=node_energy,
                tail_energy_j=tail,
                head_energy_j=head,
                from_m=np.zeros(graph.link_count),
                to_m=turn_m,
                most_energy_j=charges.soc_j - charges.reserve_j,
            ),
            self._counts,
        )

    def _left_j(self, charges: BackCharges, node_charge_j: NDArray[np.float64]) -> _Left:
        """Charge left at the goal after departing from rest at each link's tail.

        First along the ways of least energy. Where those fail only because of the battery's limits, the least charge
        at departure is searched for that keeps them.
        """
        charge = node_charge_j[self._graph.tail]
        finite = node_charge_j[np.isfinite(node_charge_j)]
        most = float(finite.max()) if finite.size else charges.reserve_j
        best, hoped = np.full(charge.size, -np.inf), np.full(self._graph.node_count, -np.inf)
        searched = []
        wanting = charge
        for held_left in (None, *charges.left_j):
            if held_left is not None:
                # without limits it would be enough
                doubt = (self._node_most(best) < held_left) & (hoped >= held_left)
                if not doubt.any():
                    continue
                wanting = np.where(doubt, node_charge_j, -np.inf)[self._graph.tail]
            rules = self._rules(charges, held_left, most)
            labels = self._search(rules)
            left_j, hoped_j, cold_j = np.empty((3, charge.size))
            choice = np.empty(charge.size, np.int32)
            departures = kernels_departure.Departures(left_j, hoped_j, cold_j, choice)
            arrays = self._arrays(rules, labels)
            kernels_departure.depart_everywhere(arrays, wanting, departures)
            for wanted in charges.left_j if held_left is None else (held_left,):
                kernels_departure.drive_doubtful(arrays, wanting, wanted, departures)
            if held_left is None:
                hoped = self._node_most(departures.hoped_j)
            best = np.maximum(best, departures.left_j)
            searched.append((rules, labels))
        return _Left(best, searched)

    def _rules(self, charges: BackCharges, held_left_j: float | None, most_j: float) -> ReverseRules:
        p = self._space.physics
        held = held_left_j is not None
        return ReverseRules(
            reserve_j=charges.reserve_j,
            full_j=charges.full_j,
            accepting_j=charges.full_j - p.fade_width_j,
            held=held,
            left_j=charges.reserve_j if held_left_j is None else held_left_j,
            bound_j=most_j if held else most_j - charges.reserve_j,
            alpha=potential_share(p),
            gain_n=p.climb_down_j_per_m if p.table else p.recuperation_factor * p.weight_n,
            highest_m=float(self._graph.node_height_m.max()),
            half_inertia_kg=self._space.half_inertia_kg,
            label_limit=self._label_limit,
        )

    def _search(self, rules: ReverseRules) -> Homeward:
        count = self._entries.link.size
        pushes = self._entries.turn.size + 2 * int(np.diff(self._entries.first).max())
        labels = Homeward(
            number=np.empty((count, kernels_way_back.NUMBERS)),
            following=np.full(count, kernels_way_back.NONE, np.int32),
            settled=np.zeros(count, np.bool_),
            heap_key=np.empty(pushes),
            heap_label=np.empty(pushes, np.int32),
            counter=np.zeros(2, np.int64),
        )
        labels.number[:, kernels_way_back.BEST] = np.inf
        labels.number[:, kernels_way_back.LEG_TARGET] = -1.0
        began = time.perf_counter()
        status = kernels_way_back.PAUSED
        while status == kernels_way_back.PAUSED:
            time_budget().check()
            status = kernels_way_back.search_back(self._arrays(rules, labels))
        made = int(labels.counter[kernels_way_back.SETTLED])
        if status == kernels_way_back.TOO_MANY:
            raise SearchLimitError(made, self._label_limit)
        before, spent = self._counts, time.perf_counter() - began
        self._counts = SearchCounts(
            before.labels_made + made, before.labels_settled + made, before.seconds + spent, False, 0, 0
        )
        return labels

    def _arrays(self, rules: ReverseRules, labels: Homeward) -> ReverseArrays:
        """What every kernel of one search reads."""
        space = self._space
        return ReverseArrays(space.arrays, space.physics, rules, self._entries, labels, self._goal)

    def _node_most(self, link_value: NDArray[np.float64]) -> NDArray[np.float64]:
        """The largest value of the links that leave each node, float64 (N,)."""
        most = np.full(self._graph.node_count, -np.inf)
        np.maximum.at(most, self._graph.tail, link_value)
        return most

    def _head_left(self, link_left: NDArray[np.float64]) -> NDArray[np.float64]:
        """The largest value of the links that may follow each link, float64 (M,)."""
        graph = self._graph
        most = np.full(graph.link_count, -np.inf)
        link = np.repeat(np.arange(graph.link_count), np.diff(graph.successor_first))
        np.maximum.at(most, link, link_left[graph.successor])
        return most


@dataclass(frozen=True, slots=True)
class _Left:
    """Charge left at the goal from each link's tail, float64 (M,) [J], and the searches that found it."""

    left_j: NDArray[np.float64]
    searched: list[tuple[ReverseRules, Homeward]]
