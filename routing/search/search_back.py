"""Searches to one place by one weighting, which share the search back that directs them."""

from __future__ import annotations

import math
from contextlib import contextmanager, nullcontext
from typing import TYPE_CHECKING

import numpy as np

from routing.lower_bound.lower_bound import MOST_GOALS
from routing.search import kernels_least_costs, kernels_search, kernels_workspace
from routing.search.found import Limits
from routing.search.kernels_least_costs import Sources
from routing.search.search import (
    SAME_OFFSET_M,
    begin,
    check_settled,
    found_path,
    goal_place,
    goal_places,
    run_once,
    search_rules,
    settle,
)
from routing.search.workspaces import grown
from routing.time_budget import time_budget

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from numpy.typing import NDArray

    from routing.lower_bound.kernels_lower_bound import GoalBound
    from routing.places import LinkPosition
    from routing.search.found import FoundPath
    from routing.search.space import SearchSpace
    from routing.search.workspaces import WorkspacePool
    from routing.weights import Weights


class SearchBack:
    """Searches of one weighting without limits to one place; of `search_back`, for one thread.

    is_directed: whether costs are such that a search back bounds them. crowded: whether a search relaxed dominance.
    """

    def __init__(
        self,
        space: SearchSpace,
        pool: WorkspacePool,
        weights: Weights,
        goals: Sequence[LinkPosition],
        bound: GoalBound,
        label_limit: int,
    ) -> None:
        self._space, self._pool, self._goals, self._bound = space, pool, tuple(goals), bound
        self._rules = search_rules(space, weights, Limits(), False, label_limit)
        self.is_directed = bound.used and not self._rules.correcting
        self.crowded = False

    def _gained(self) -> float:
        """What the potential at the goals is worth, in costs, which keys of labels lack."""
        arrays, goal = self._space.arrays, self._goals[0]
        height_m = arrays.tail_height_m[goal.link_idx] + arrays.grade_frac[goal.link_idx] * goal.offset_m
        gained_j = self._rules.alpha * self._space.physics.weight_n * float(height_m)
        return self._rules.energy_weight * gained_j

    def least_costs(self, sources: Sequence[Sequence[LinkPosition]], labels: int) -> NDArray[np.float64]:
        """No way from a source to the goals costs less, float64 (n,); inf where none leads there.

        Each by a search that ends after some labels: the least key in its heap is then the bound, since keys never
        fall. −inf where the searches are not directed. Raises TimeUpError, AbandonedError.
        """
        least = np.full(len(sources), -math.inf)
        if not self.is_directed:
            return least
        places = [(place.link_idx, place.offset_m) for source in sources for place in source]
        first = np.concatenate(([0], np.cumsum([len(source) for source in sources]))).astype(np.int64)
        froms = Sources(
            first, np.array([link for link, _ in places], np.int64), np.array([at_m for _, at_m in places], np.float64)
        )
        space, rules, goals = self._space, self._rules._replace(label_limit=labels), goal_places(self._goals)
        ws, epoch = self._pool.take()
        done, gained = 0, self._gained()
        with space.drives.lent() as lent:
            while done < least.size:
                done, epoch, status = kernels_least_costs.least_costs(
                    space.arrays,
                    space.physics,
                    space.slack,
                    rules,
                    ws,
                    lent.table,
                    self._bound,
                    epoch,
                    goals,
                    froms,
                    done,
                    gained,
                    least,
                )
                if status == kernels_workspace.FULL:
                    ws = grown(ws)
                elif status == kernels_workspace.CRAMPED:
                    lent.grow()
                if status != kernels_workspace.DONE:
                    epoch += 1  # the search begins anew
                    self._check_time(ws, epoch)
        self._pool.give_back(ws, epoch)
        return least

    def _check_time(self, ws: kernels_workspace.Workspace, epoch: int) -> None:
        if time_budget().is_over:
            self._pool.give_back(ws, epoch)
            time_budget().check()

    def paths(self, sources: Sequence[Sequence[LinkPosition]]) -> list[FoundPath | None]:
        """The cheapest way from each source to the goals, or None.

        Raises SearchLimitError, TimeUpError, AbandonedError, NegativeCycleError.
        """
        found: list[FoundPath | None] = []
        with self._space.drives.lent() as lent:
            for starts in sources:
                ws, epoch, goal, counts = run_once(
                    self._space, self._pool, self._rules, starts, self._goals, lent, self._bound
                )
                try:
                    found.append(None if goal < 0 else found_path(self._space, ws, goal, self._goals, 0.0))
                finally:
                    self._pool.give_back(ws, epoch)
                self.crowded |= counts.crowded > 0
        return found

    def on_the_way(
        self,
        start: Sequence[LinkPosition],
        targets: Sequence[Sequence[LinkPosition]],
        is_enough: Callable[[int, float, float], bool],
        chosen: Callable[[NDArray[np.float64]], Sequence[int]],
    ) -> tuple[NDArray[np.float64], dict[int, FoundPath]]:
        """What the cheapest ways from a start to targets cost, float64 (n,), and the ways to some of them.

        By one search that is directed to the goals, so that targets come in the order of what a way over them costs at
        least. is_enough: asked with each of them, its cost and that one, whether the search may end; targets that it
        has not come to cost inf. chosen: of those costs, whose ways are wanted. Only where is_directed.
        Raises as paths does.
        """
        space, rules = self._space, self._rules
        targets_at: dict[int, list[tuple[float, int]]] = {}
        for k, places in enumerate(targets):
            for place in places:
                targets_at.setdefault(place.link_idx, []).append((place.offset_m, k))
        whose = np.array([k for k, places in enumerate(targets) for _ in places], np.int64)
        goals = goal_places([place for places in targets for place in places])
        whose = whose[np.argsort([place.link_idx for places in targets for place in places], kind="stable")]
        found, missing, gained = np.full(len(targets), -1), np.ones(len(targets), np.bool_), self._gained()
        costs = np.full(len(targets), math.inf)
        ws, epoch = self._pool.take()
        begin(space, rules, ws, start)
        status, ends = kernels_workspace.FOUND, False
        with space.drives.lent() as lent:
            while status == kernels_workspace.FOUND and not ends and bool(missing.any()):
                left = missing[whose]
                places_left = kernels_search.Goals(goals.link[left], goals.offset_m[left])
                ws, status = settle(space, rules, ws, places_left, lent, self._bound, epoch)
                label = int(ws.counter[kernels_workspace.GOAL])
                ws.counter[kernels_workspace.GOAL] = -1
                if label < 0:
                    continue
                link_idx, at_goal_m = goal_place(ws, label)
                for at_m, k in targets_at[link_idx]:
                    if missing[k] and abs(at_m - at_goal_m) < SAME_OFFSET_M:
                        found[k], missing[k] = label, False
                        cost, key = ws.number[label, [kernels_workspace.COST, kernels_workspace.KEY]].tolist()
                        costs[k] = cost
                        ends |= is_enough(k, cost, key + gained)
        check_settled(status, space, ws, self._pool, rules, epoch)
        self.crowded |= int(ws.counter[kernels_workspace.CROWDED]) > 0
        try:
            return costs, self._paths_to(ws, found, targets, chosen(costs))
        finally:
            self._pool.give_back(ws, epoch)

    def _paths_to(
        self,
        ws: kernels_workspace.Workspace,
        found: NDArray[np.int64],
        targets: Sequence[Sequence[LinkPosition]],
        wanted: Sequence[int],
    ) -> dict[int, FoundPath]:
        return {k: found_path(self._space, ws, int(found[k]), targets[k], 0.0) for k in wanted if found[k] >= 0}


@contextmanager
def search_back(
    space: SearchSpace,
    pool: WorkspacePool,
    weights: Weights,
    led_to: Sequence[LinkPosition],
    goals: Sequence[LinkPosition],
    label_limit: int = 50_000_000,
) -> Iterator[SearchBack]:
    """Searches by a weighting to a place, which share one search back; it is led to where the first search begins."""
    directed = 0 < len(goals) <= MOST_GOALS and space.conserving
    with pool.directed(space, led_to, goals) if directed else nullcontext(space.lower_bound.undirected) as bound:
        yield SearchBack(space, pool, weights, goals, bound, label_limit)
