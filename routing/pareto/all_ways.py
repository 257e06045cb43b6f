"""All ways between two places compared in time and energy at once: those that no given route covers."""

from __future__ import annotations

import math
import time
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra

from energy.force.kernels_physics import cabin_energy_j
from routing.links.kernels_tables import CRUISE_S, LIMIT, STOP
from routing.pareto import kernels_labels as kernels
from routing.pareto import kernels_states
from routing.places import LinkPosition
from routing.search.found import FoundPath
from routing.search.space import potential_share
from routing.time_budget import time_budget

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from energy.force.kernels_physics import LinkPhysics
    from routing.links.kernels_tables import LinkArrays
    from routing.pareto.kernels_labels import Labels
    from routing.pareto.kernels_states import Ends, StateGraph
    from routing.search.space import SearchSpace

STATES_A_LINK: Final = 32  # beyond it entries share states with lower bounds; few links of a real map have more
SHARED_A_LINK: Final = 160  # at most: of 40 speeds and four probabilities of having stopped
MOST_STATES: Final = 4_000_000
MOST_LABELS: Final = 2_000_000
MOST_POINTS: Final = 4096


@dataclass(frozen=True, slots=True)
class Cover:
    """When a way needs no route of its own.

    points: time [s] and energy [J] of routes that are there. A way is covered by one of them, or of those found, that
    takes at most 1 + epsilon_frac times its time and at most slack_j more energy. Ways that take more than most_s or
    most_j need none.
    """

    points: tuple[tuple[float, float], ...]
    epsilon_frac: float
    slack_j: float
    most_s: float = math.inf
    most_j: float = math.inf


@dataclass(frozen=True, slots=True)
class Uncovered:
    """Ways that together with the points cover every way, and the work done.

    paths: their time and energy are what they take at least, exactly so where no state on the way is shared.
    shared: states that entries share.
    """

    paths: tuple[FoundPath, ...]
    labels_made: int
    labels_settled: int
    seconds: float
    states: int
    shared: int


def is_applicable(physics: LinkPhysics, *, carries: bool = False) -> bool:
    """Whether links take the same from a state at any time, and nothing takes less than its gain in potential.

    carries: the graph has ferries, on which climate takes nothing: then there must be none, since it counts by time.
    """
    climate = physics.cabin_w != 0.0 or physics.cabin_start_w != 0.0
    return not physics.printed and physics.tyre_time_s == 0.0 and not (carries and climate)


def uncovered_ways(
    space: SearchSpace,
    starts: Sequence[LinkPosition],
    goals: Sequence[LinkPosition],
    cover: Cover,
    *,
    states_a_link: int = STATES_A_LINK,
) -> Uncovered | None:
    """Ways from rest to rest that the points do not cover, none covered by another; None where it takes too much room.

    Without battery limits: what a full battery refuses and what the reserve forbids only ever makes a way worse. For
    physics that are applicable. Raises TimeUpError, AbandonedError. O(S log S + L log L) for S states and L labels.
    """
    began = time.perf_counter()
    ends = kernels_states.Ends(places_array(starts), places_array(goals))
    sg = states_between(space, ends, links_within(space.arrays, ends, cover.most_s), states_a_link)
    if sg is None:
        return None
    to_goal = kernels.ToGoal(least_to_goal(sg, sg.time_s), least_to_goal(sg, sg.energy_j))
    gain_j = float(sg.number[kernels_states.GOAL, kernels_states.POTENTIAL] - sg.number[1, kernels_states.POTENTIAL])
    lb = _labels(cover, gain_j)
    rules = kernels.CoverRules(cover.epsilon_frac, cover.slack_j, cover.most_s, cover.most_j - gain_j)
    state_j = np.full(sg.link.size, math.inf)
    status = kernels_states.PAUSED
    while status == kernels_states.PAUSED:
        time_budget().check()
        status = kernels.explore(sg, space.physics, to_goal, rules, len(starts), state_j, lb)
    if status == kernels_states.FULL:
        return None
    found = lb.solution[: lb.counter[kernels.SOLUTIONS]].tolist()
    return Uncovered(
        paths=tuple(_path(space, sg, lb, label, gain_j, starts, goals) for label in found),
        labels_made=int(lb.counter[kernels.MADE]),
        labels_settled=int(lb.counter[kernels.SETTLED]),
        seconds=time.perf_counter() - began,
        states=sg.link.size,
        shared=int(sg.counter[kernels_states.SHARED]),
    )


def warm_up_labels(space: SearchSpace, place: LinkPosition) -> None:
    """Compile what uncovered_ways needs."""
    uncovered_ways(space, [place], [place], Cover((), 0.0, 0.0, most_s=0.0))


def places_array(places: Sequence[LinkPosition]) -> NDArray[np.float64]:
    """Link and offset of each place, float64 (n, 2)."""
    return np.array([(place.link_idx, place.offset_m) for place in places], np.float64)


def links_within(g: LinkArrays, ends: Ends, most_s: float) -> NDArray[np.bool_]:
    """Links that some way enters which takes no more than most_s, at the limit all along, bool (M,)."""
    link_s = g.length_m / g.row[:, LIMIT] + g.row[:, STOP] * g.stop_time_s
    link_s = np.where(g.row[:, LIMIT] < 0.0, g.row[:, CRUISE_S], link_s)
    links = link_s.size
    ways = csr_array(
        (np.repeat(link_s, np.diff(g.successor_first)), g.successor, g.successor_first), shape=(links, links)
    )
    since = np.full(links, math.inf)
    for link, offset_m in ends.starts.tolist():
        driven_s = offset_m / float(g.row[int(link), LIMIT])  # counted by the search, but behind the start
        (way_s,) = dijkstra(ways, indices=[int(link)], limit=most_s + driven_s)
        since = np.minimum(since, np.maximum(way_s - driven_s, 0.0))
    onward = least_to(ways, ends.goals[:, 0].astype(np.int64), most_s)
    whole = since + onward
    allowed: NDArray[np.bool_] = np.isfinite(whole) & (whole <= most_s * (1.0 + 1e-9))
    return allowed


def states_between(
    space: SearchSpace,
    ends: Ends,
    allowed: NDArray[np.bool_],
    states_a_link: int,
) -> StateGraph | None:
    """All states and drives on the links allowed, cut to size; None where there are too many."""
    g, physics = space.arrays, space.physics
    room = min((states_a_link + SHARED_A_LINK) * int(allowed.sum()), MOST_STATES) + 64
    arcs = 4 * room + ends.goals.shape[0] + int(np.diff(g.successor_first).max(initial=0))
    sg = kernels_states.StateGraph(
        link=np.empty(room, np.int32),
        number=np.empty((room, 4)),
        earlier=np.empty(room, np.int32),
        first=np.empty(room + 1, np.int64),
        head=np.empty(arcs, np.int32),
        energy_j=np.empty(arcs),
        time_s=np.empty(arcs),
        counter=np.zeros(5, np.int64),
    )
    latest = np.full(allowed.size, -1, np.int32)
    rules = kernels_states.StateRules(potential_share(physics), space.half_inertia_kg, states_a_link)
    status = kernels_states.PAUSED
    while status == kernels_states.PAUSED:
        time_budget().check()
        status = kernels_states.expand(g, physics, rules, ends, allowed, latest, sg)
    if status == kernels_states.FULL or sg.counter[kernels_states.NEGATIVE] > 0:
        return None
    states, used = int(sg.counter[kernels_states.STATES]), int(sg.counter[kernels_states.ARCS])
    return kernels_states.StateGraph(
        link=sg.link[:states].copy(),
        number=sg.number[:states].copy(),
        earlier=sg.earlier[:states].copy(),
        first=sg.first[: states + 1].copy(),
        head=sg.head[:used].copy(),
        energy_j=sg.energy_j[:used].copy(),
        time_s=sg.time_s[:used].copy(),
        counter=sg.counter,
    )


def least_to_goal(sg: StateGraph, weight: NDArray[np.float64]) -> NDArray[np.float64]:
    """Least sum of weights from each state to the goal, float64 (S,)."""
    states = sg.link.size
    return least_to(csr_array((weight, sg.head, sg.first), shape=(states, states)), np.array([kernels_states.GOAL]))


def least_to(arcs: csr_array, goals: NDArray[np.int64], most: float = math.inf) -> NDArray[np.float64]:
    """Least sum of arc weights from every vertex to the nearest of goals, inf where it is more than most.

    Weights ≥ 0: explicit zeros are arcs, and so is each of parallel ones.
    """
    sums: NDArray[np.float64] = dijkstra(arcs.T.tocsr(), indices=np.unique(goals), limit=most, min_only=True)
    return sums


def _labels(cover: Cover, gain_j: float) -> Labels:
    """Room for labels, whose pages cost nothing until they are touched, and the points of a cover."""
    lb = kernels.Labels(
        state=np.empty(MOST_LABELS, np.int32),
        parent=np.empty(MOST_LABELS, np.int32),
        time_s=np.empty(MOST_LABELS),
        energy_j=np.empty(MOST_LABELS),
        key_s=np.empty(MOST_LABELS),
        key_j=np.empty(MOST_LABELS),
        item=np.empty(MOST_LABELS, np.int32),
        point_s=np.empty(MOST_POINTS),
        point_j=np.empty(MOST_POINTS),
        solution=np.empty(MOST_POINTS, np.int32),
        counter=np.zeros(5, np.int64),
    )
    for time_s, energy_j in cover.points:
        kernels.add_point(lb, time_s, energy_j - gain_j)
    return lb


def _path(
    space: SearchSpace,
    sg: StateGraph,
    lb: Labels,
    label: int,
    gain_j: float,
    starts: Sequence[LinkPosition],
    goals: Sequence[LinkPosition],
) -> FoundPath:
    """The way of a label that arrived."""
    time_s = float(lb.time_s[label])
    energy_j = float(lb.energy_j[label]) + gain_j + cabin_energy_j(space.physics, 0.0, time_s)
    links: list[int] = []
    first = label = int(lb.parent[label])
    while label >= 0:
        links.append(int(sg.link[lb.state[label]]))
        first, label = label, int(lb.parent[label])
    links.reverse()
    start = starts[int(lb.state[first]) - 1]
    goal_m = next(place.offset_m for place in goals if place.link_idx == links[-1])
    driven = space.originals(links)
    start, goal = LinkPosition(driven[0], start.offset_m), LinkPosition(driven[-1], goal_m)
    return FoundPath(driven, start, goal, cost=time_s, energy_j=energy_j, time_s=time_s, distance_m=math.nan)
