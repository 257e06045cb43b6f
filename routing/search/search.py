"""One search on one graph: its workspace and the run of the kernel."""

from __future__ import annotations

import time
from contextlib import nullcontext
from dataclasses import replace
from typing import TYPE_CHECKING, Final, TypeVar

import numpy as np

from energy.units import JOULE_PER_KWH, METRE_PER_KM, SECOND_PER_HOUR
from routing.dominance.kernels_rules import SearchRules
from routing.errors import NegativeCycleError, SearchLimitError, TimeUpError
from routing.links.drives import LentDrives
from routing.lower_bound.lower_bound import MOST_GOALS
from routing.places import LinkPosition
from routing.search import kernels_search, kernels_workspace
from routing.search.found import USUAL, FoundPath, Limits, Measure, PathOptions, Reach, ReachBy, SearchCounts
from routing.search.kernels_arrivals import arrivals
from routing.search.kernels_stops import stops_by
from routing.search.kernels_workspace import Workspace
from routing.search.space import potential_share
from routing.search.workspaces import WorkspacePool, grown
from routing.time_budget import time_budget
from routing.weights import FASTEST, SHORTEST

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from numpy.typing import NDArray

    from routing.lower_bound.kernels_lower_bound import GoalBound
    from routing.search.space import SearchSpace
    from routing.weights import Weights

SAME_OFFSET_M: Final = 1e-6  # of goals on one link that a search need not tell apart
# beyond these a search from a nearly full battery gives up its proof, and the answer names a bound instead
STRICT_LABELS_PER_LINK: Final = 8
STRICT_LABELS: Final = 20_000
STRICT_COMPARED: Final = 64  # in crowds, for each label that it may make: they can grow as its square

NO_DESCENT: Final = np.empty((0, 2))  # leads in charge count in full

Found = TypeVar("Found")


def search_rules(space: SearchSpace, weights: Weights, limits: Limits, pareto: bool, label_limit: int) -> SearchRules:
    """The rules of a search by weights of its cost, for the kernel."""
    p = space.physics
    return SearchRules(
        least_energy_j=limits.least_energy_j,
        most_energy_j=limits.most_energy_j,
        energy_weight=weights.energy / JOULE_PER_KWH,
        time_weight=weights.time / SECOND_PER_HOUR,
        distance_weight=weights.distance / METRE_PER_KM,
        alpha=potential_share(p),
        half_inertia_kg=space.half_inertia_kg,
        limited=limits.held,
        pareto=pareto,
        correcting=not space.conserving,
        label_limit=label_limit,
        descent=NO_DESCENT,
    )


def _proven(
    space: SearchSpace, rules: SearchRules, search: Callable[[SearchRules], tuple[Found, SearchCounts]]
) -> tuple[Found, SearchCounts]:
    """What a search finds, searched again with safe leads alone where the battery filled up while something warms up.

    Where that makes too many labels or compares too many, or lemma 1 doesn't hold, it is what the first one found, with
    a bound.
    """
    found, counts = search(rules)
    if counts.unpaid_j == 0.0 or rules.correcting:
        return found, counts
    most = min(rules.label_limit, STRICT_LABELS_PER_LINK * space.arrays.length_m.size + STRICT_LABELS)
    began = time.perf_counter()
    try:
        found, strict = search(rules._replace(descent=space.lower_bound.descent(), label_limit=most))
    except (SearchLimitError, TimeUpError) as error:
        seconds = counts.seconds + time.perf_counter() - began
        made = error.labels if isinstance(error, SearchLimitError) else 0
        return found, replace(counts, labels_made=counts.labels_made + made, seconds=seconds)
    return found, replace(
        strict,
        labels_made=counts.labels_made + strict.labels_made,
        labels_settled=counts.labels_settled + strict.labels_settled,
        seconds=counts.seconds + strict.seconds,
    )


def run_once(
    space: SearchSpace,
    pool: WorkspacePool,
    rules: SearchRules,
    starts: Sequence[LinkPosition],
    goals: Sequence[LinkPosition],
    lent: LentDrives,
    bound: GoalBound,
    begin_s: float = 0.0,
) -> tuple[Workspace, int, int, SearchCounts]:
    """One search: its workspace, to be given back with its epoch, the label at the goal or −1, and its work."""
    ws, epoch = pool.take()
    began = begin(space, rules, ws, starts, begin_s)
    ws, status = settle(space, rules, ws, goal_places(goals), lent, bound, epoch)
    check_settled(status, space, ws, pool, rules, epoch)
    counts = search_counts(space, ws, rules, began)
    return ws, epoch, int(ws.counter[kernels_workspace.GOAL]), counts


def begin(
    space: SearchSpace, rules: SearchRules, ws: Workspace, starts: Sequence[LinkPosition], begin_s: float = 0.0
) -> float:
    """Put the starts into the heap of a workspace; what the clock says [s]."""
    ws.counter[:] = 0
    ws.counter[[kernels_workspace.GOAL, kernels_workspace.CYCLE, kernels_workspace.REFUSED_S]] = -1
    began = time.perf_counter()
    for start in starts:
        kernels_search.start_label(space.arrays, space.physics, rules, ws, start.link_idx, start.offset_m, begin_s)
    return began


def goal_places(goals: Sequence[LinkPosition]) -> kernels_search.Goals:
    """Goals as the kernel reads them."""
    link = np.array([goal.link_idx for goal in goals], np.int64)
    order = np.argsort(link, kind="stable")
    return kernels_search.Goals(link[order], np.array([goal.offset_m for goal in goals], np.float64)[order])


def settle(
    space: SearchSpace,
    rules: SearchRules,
    ws: Workspace,
    places: kernels_search.Goals,
    lent: LentDrives,
    bound: GoalBound,
    epoch: int,
) -> tuple[Workspace, int]:
    """Run the kernel until it is done, has met a goal or time is up, with more room wherever it asks for it."""
    budget = time_budget()
    while True:
        status = kernels_search.run(
            space.arrays,
            space.physics,
            space.slack,
            rules,
            ws,
            lent.table,
            bound,
            epoch,
            places,
        )
        if status == kernels_workspace.FULL:
            ws = grown(ws)
        elif status == kernels_workspace.CRAMPED:
            lent.grow()
        elif status != kernels_workspace.PAUSED or budget.is_over:
            return ws, status
        elif rules.descent.size and ws.counter[kernels_workspace.COMPARED] > STRICT_COMPARED * rules.label_limit:
            return ws, kernels_workspace.TOO_MANY


def check_settled(
    status: int, space: SearchSpace, ws: Workspace, pool: WorkspacePool, rules: SearchRules, epoch: int
) -> None:
    """Give the workspace back and raise where a search has failed."""
    if status == kernels_workspace.NEGATIVE_CYCLE:
        cycle = int(ws.counter[kernels_workspace.CYCLE])
        pool.give_back(ws, epoch)
        raise NegativeCycleError(cycle, 0.0 if space.physics.printed else space.least_load_n)
    if status == kernels_workspace.TOO_MANY:
        made = int(ws.counter[kernels_workspace.LABELS])
        pool.give_back(ws, epoch)
        raise SearchLimitError(made, rules.label_limit)
    if status == kernels_workspace.PAUSED:
        pool.give_back(ws, epoch)
        time_budget().check()


def search_counts(space: SearchSpace, ws: Workspace, rules: SearchRules, began: float) -> SearchCounts:
    """The work that a search has done in a workspace."""
    refused_s = int(ws.counter[kernels_workspace.REFUSED_S])
    safe = refused_s < 0 or rules.descent.size > 0
    return SearchCounts(
        labels_made=int(ws.counter[kernels_workspace.LABELS]),
        labels_settled=int(ws.counter[kernels_workspace.SETTLED]),
        seconds=time.perf_counter() - began,
        label_correcting=bool(rules.correcting),
        reduced_below_zero=int(ws.counter[kernels_workspace.REDUCED_BELOW_ZERO]),
        crowded=int(ws.counter[kernels_workspace.CROWDED]),
        unpaid_j=0.0 if safe else space.still_owed_j(refused_s),
    )


def find_path(
    space: SearchSpace,
    pool: WorkspacePool,
    weights: Weights,
    limits: Limits,
    starts: Sequence[LinkPosition],
    goals: Sequence[LinkPosition],
    options: PathOptions = USUAL,
) -> tuple[FoundPath | None, SearchCounts]:
    """The cheapest way from a start to a goal, or None; the vehicle starts from rest and stops at the goal.

    The path's time counts from its start.
    """
    rules = search_rules(space, weights, limits, options.pareto, options.label_limit)
    directed = options.directed and 0 < len(goals) <= MOST_GOALS and not rules.correcting
    directed_to = pool.directed(space, starts, goals) if directed else nullcontext(space.lower_bound.undirected)
    with space.drives.lent() as lent, directed_to as bound:

        def search(by: SearchRules) -> tuple[FoundPath | None, SearchCounts]:
            ws, epoch, goal, counts = run_once(space, pool, by, starts, goals, lent, bound, options.begin_s)
            try:
                return (None if goal < 0 else found_path(space, ws, goal, goals, options.begin_s)), counts
            finally:
                pool.give_back(ws, epoch)

        return _proven(space, rules, search)


def found_path(
    space: SearchSpace, ws: Workspace, goal: int, goals: Sequence[LinkPosition], begin_s: float
) -> FoundPath:
    """The path to the label at a goal."""
    labels = kernels_workspace.labels_to(ws.pointer, ws.pointer[goal, kernels_workspace.PARENT])
    links: list[int] = ws.pointer[labels, kernels_workspace.LINK].tolist()
    number = ws.number[goal]
    goal_m = next(g.offset_m for g in goals if g.link_idx == links[-1])
    driven = space.originals(links)
    return FoundPath(
        links=driven,
        start=LinkPosition(driven[0], float(ws.number[labels[0], kernels_workspace.OFFSET])),
        goal=LinkPosition(driven[-1], goal_m),
        cost=float(number[kernels_workspace.COST]),
        energy_j=float(number[kernels_workspace.ENERGY]),
        time_s=float(number[kernels_workspace.TIME]) - begin_s + space.carried_s(links),
        distance_m=float(number[kernels_workspace.DISTANCE]),
    )


def reach(
    space: SearchSpace,
    pool: WorkspacePool,
    limits: Limits,
    starts: Sequence[LinkPosition],
    head: NDArray[np.int32],
    node_count: int,
    *,
    label_limit: int = 50_000_000,
) -> Reach:
    """Least energy to stop at every node, one to all, within the limits."""
    from routing.weights import ECO

    rules = search_rules(space, ECO, limits, False, label_limit)
    with space.drives.lent() as lent:  # the labels have states of this table

        def search(by: SearchRules) -> tuple[tuple[NDArray[np.float64], NDArray[np.float64]], SearchCounts]:
            node_energy, link_reach = np.full(node_count, np.inf), np.full(head.size, -1.0)
            ws, epoch, _, counts = run_once(space, pool, by, starts, (), lent, space.lower_bound.undirected)
            try:
                arrivals(space.arrays, space.physics, by, ws, lent.table, head, node_energy, link_reach)
            finally:
                pool.give_back(ws, epoch)
            return (node_energy, link_reach), counts

        (node_energy, link_reach), counts = _proven(space, rules, search)
    link_reach[space.arrays.speed_limit_mps < 0.0] = -1.0  # nobody stops on board
    space.join_reach(link_reach)
    return Reach(node_energy, link_reach, limits.most_energy_j, counts)


def reach_by(
    space: SearchSpace,
    pool: WorkspacePool,
    measure: Measure,
    most: float,
    starts: Sequence[LinkPosition],
    head: NDArray[np.int32],
    node_count: int,
    *,
    label_limit: int = 50_000_000,
) -> ReachBy:
    """Least time or distance to stop at every node, one to all, up to `most` [s or m], whatever the battery holds."""
    by_time = measure is Measure.TIME
    rules = search_rules(space, FASTEST if by_time else SHORTEST, Limits(), False, label_limit)
    with space.drives.lent() as lent:

        def search(by: SearchRules) -> tuple[ReachBy, SearchCounts]:
            least, energy_j, link_reach = (
                np.full(node_count, np.inf),
                np.full(node_count, np.inf),
                np.full(head.size, -1.0),
            )
            ws, epoch, _, counts = run_once(space, pool, by, starts, (), lent, space.lower_bound.undirected)
            try:
                stops_by(space.arrays, space.physics, by, ws, head, by_time, most, least, energy_j, link_reach)
            finally:
                pool.give_back(ws, epoch)
            link_reach[space.arrays.speed_limit_mps < 0.0] = -1.0
            space.join_reach(link_reach)
            return ReachBy(least, energy_j, link_reach, most, counts), counts

        return _proven(space, rules, search)[0]


def find_paths(
    space: SearchSpace,
    pool: WorkspacePool,
    weights: Weights,
    limits: Limits,
    starts: Sequence[LinkPosition],
    targets: Sequence[Sequence[LinkPosition]],
    *,
    label_limit: int = 50_000_000,
) -> tuple[list[FoundPath | None], SearchCounts]:
    """The cheapest way from a start to each target, or None, by one search that ends when all targets are settled.

    targets: each by its positions, as the goals of find_path, whose answer it is: labels at goals lead nowhere, so that
    they do not change the others. Limits may be held only where energy alone is weighted, for there is no search with
    pairs of cost and energy here. Raises as find_path does.
    """
    rules = search_rules(space, weights, limits, False, label_limit)
    targets_at: dict[int, list[tuple[float, int]]] = {}
    for k, goals in enumerate(targets):
        for goal in goals:
            targets_at.setdefault(goal.link_idx, []).append((goal.offset_m, k))
    with space.drives.lent() as lent:

        def search(by: SearchRules) -> tuple[list[FoundPath | None], SearchCounts]:
            return _run_to_all(space, pool, by, starts, targets, targets_at, lent)

        return _proven(space, rules, search)


def _run_to_all(
    space: SearchSpace,
    pool: WorkspacePool,
    rules: SearchRules,
    starts: Sequence[LinkPosition],
    targets: Sequence[Sequence[LinkPosition]],
    targets_at: Mapping[int, Sequence[tuple[float, int]]],
    lent: LentDrives,
) -> tuple[list[FoundPath | None], SearchCounts]:
    """One search that ends when all targets are settled; targets_at: by link, how far along it which of them is [m]."""
    found = [-1] * len(targets)
    whose = np.array([k for k, goals in enumerate(targets) for _ in goals], np.int64)
    link = np.array([goal.link_idx for goals in targets for goal in goals], np.int64)
    offset_m = np.array([goal.offset_m for goals in targets for goal in goals], np.float64)
    order = np.argsort(link, kind="stable")
    whose, link, offset_m = whose[order], link[order], offset_m[order]
    left, missing = len(targets), np.ones(len(targets), np.bool_)
    ws, epoch = pool.take()
    began = begin(space, rules, ws, starts)
    status = kernels_workspace.FOUND
    while status == kernels_workspace.FOUND and left > 0:
        places = kernels_search.Goals(link[missing[whose]], offset_m[missing[whose]])
        ws, status = settle(space, rules, ws, places, lent, space.lower_bound.undirected, epoch)
        for label in _labels_at_goals(ws, rules):
            link_idx, at_goal_m = goal_place(ws, label)
            for at_m, k in targets_at[link_idx]:
                if found[k] < 0 and abs(at_m - at_goal_m) < SAME_OFFSET_M:
                    found[k] = label
                    missing[k] = False
                    left -= 1
        ws.counter[kernels_workspace.GOAL] = -1
    check_settled(status, space, ws, pool, rules, epoch)
    counts = search_counts(space, ws, rules, began)
    try:
        return [
            None if goal < 0 else found_path(space, ws, goal, targets[k], 0.0) for k, goal in enumerate(found)
        ], counts
    finally:
        pool.give_back(ws, epoch)


def _labels_at_goals(ws: Workspace, rules: SearchRules) -> list[int]:
    """The label at a goal that was met, or, as a label-correcting search ends with all of them, all by their costs."""
    if not rules.correcting:
        met = int(ws.counter[kernels_workspace.GOAL])
        return [] if met < 0 else [met]
    made = int(ws.counter[kernels_workspace.LABELS])
    labels = np.flatnonzero(ws.pointer[:made, kernels_workspace.LINK] == ws.bag.shape[0] - 1)
    order = np.argsort(ws.number[labels, kernels_workspace.COST], kind="stable")
    return [int(label) for label in labels[order]]


def goal_place(ws: Workspace, label: int) -> tuple[int, float]:
    """Link of a label at a goal, and how far along it the goal is [m]."""
    before = int(ws.pointer[label, kernels_workspace.PARENT])
    driven_m = float(ws.number[label, kernels_workspace.DISTANCE] - ws.number[before, kernels_workspace.DISTANCE])
    return int(ws.pointer[before, kernels_workspace.LINK]), float(
        ws.number[before, kernels_workspace.OFFSET]
    ) + driven_m
