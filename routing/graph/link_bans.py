"""Bans of driving over several links, carried by copies of the links between, which know where a drive came from."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Final, TypeAlias

import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.csgraph import breadth_first_order, connected_components

from routing.graph.link_copies import LinkCopies

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from routing.graph.road_graph import RoadGraph

MOST_STATES: Final = 20_000  # of all bans of a map together; cities have hundreds


@dataclass(frozen=True, slots=True)
class LinkBan:
    """What may not follow, or, with only, what must follow once the links between are entered from the first one.

    chains: of links, each from the one before the links between to the one after them, at least three.
    """

    chains: tuple[tuple[int, ...], ...]
    only: bool


# a link, and how far along which chains of which bans the drive is that is on it: (ban, chain, place in the chain)
_State: TypeAlias = "tuple[int, frozenset[tuple[int, int, int]]]"


def carried(graph: RoadGraph, bans: Sequence[LinkBan]) -> tuple[RoadGraph, int]:
    """The graph with bans carried, and how many are not, for they would cut roads off or need too many copies."""
    kept = _acceptable(graph, [], list(bans))
    return _with_bans(graph, kept) or graph, len(bans) - len(kept)


def _acceptable(graph: RoadGraph, kept: list[LinkBan], more: list[LinkBan]) -> list[LinkBan]:
    """Those of more that can be carried beside kept, with these."""
    if not more or _with_bans(graph, kept + more) is not None:
        return kept + more
    if len(more) == 1:
        return kept
    half = len(more) // 2
    return _acceptable(graph, _acceptable(graph, kept, more[:half]), more[half:])


def _with_bans(graph: RoadGraph, bans: Sequence[LinkBan]) -> RoadGraph | None:
    """The graph with all of the bans, None where links no longer reach each other or there are too many copies."""
    turns = _turns(graph, bans)
    if turns is None:
        return None
    _drop_dead_ends(turns)
    number: dict[_State, int] = {}
    for following in turns.values():
        for state in following:
            if state[1]:
                number.setdefault(state, graph.link_count + len(number))
    rows = [graph.successors(k) for k in range(graph.link_count)] if turns else []
    if not turns:
        return graph
    for state, following in turns.items():
        if not state[1]:
            rows[state[0]] = np.array([number.get(to, to[0]) for to in following], np.int32)
    rows += [np.array([number.get(to, to[0]) for to in turns[state]], np.int32) for state in number]
    first = np.concatenate(([0], np.cumsum([row.size for row in rows]))).astype(np.int64)
    successor = np.concatenate(rows).astype(np.int32)
    of = np.array([link for link, _ in number], np.int64)
    if not _hang_together(of, first, successor):
        return None
    return _extended(graph, of, first, successor)


def _hang_together(of: NDArray[np.int64], first: NDArray[np.int64], successor: NDArray[np.int32]) -> bool:
    """Whether every link leads to every other one, or to a copy of it: who enters may do so on copies alone."""
    size = first.size - 1
    matrix = csr_array((np.ones(successor.size, np.int8), successor, first), shape=(size, size))
    part = connected_components(matrix, directed=True, connection="strong")[1]
    inside = part == np.argmax(np.bincount(part))
    entered = inside[: size - of.size].copy()
    entered[of[inside[size - of.size :]]] = True
    from_there = breadth_first_order(matrix.T.tocsr(), int(np.argmax(inside)), return_predecessors=False)
    return bool(entered.all()) and from_there.size == size


def _turns(graph: RoadGraph, bans: Sequence[LinkBan]) -> dict[_State, list[_State]] | None:
    """What may follow each state that a ban looks at: first links of chains, and links between with their past."""
    begins: dict[int, list[tuple[int, int, int]]] = {}
    for b, ban in enumerate(bans):
        for c, chain in enumerate(ban.chains):
            begins.setdefault(chain[0], []).append((b, c, 0))
    nothing: frozenset[tuple[int, int, int]] = frozenset()
    waiting: list[_State] = [(link, nothing) for link in begins]
    turns: dict[_State, list[_State]] = {}
    while waiting:
        state = waiting.pop()
        if state in turns:
            continue
        if len(turns) >= MOST_STATES:
            return None
        turns[state] = _onward(graph, bans, state, begins.get(state[0], []))
        waiting += [to for to in turns[state] if to[1]]
    return turns


def _onward(
    graph: RoadGraph, bans: Sequence[LinkBan], state: _State, begun: list[tuple[int, int, int]]
) -> list[_State]:
    link, past = state
    successors = graph.successors(link).tolist()
    must: dict[int, set[int]] = {}
    for b, c, at in past:
        if bans[b].only:
            must.setdefault(b, set()).add(bans[b].chains[c][at + 1])
    orders = [allowed for allowed in must.values() if allowed & set(successors)]
    following = _permitted(bans, past, begun, successors, orders)
    if following or not past or graph.reverse_idx[link] < 0:
        return following
    return _permitted(bans, past, begun, [int(graph.reverse_idx[link])], [])  # a dead end for those who come from there


def _permitted(
    bans: Sequence[LinkBan],
    past: frozenset[tuple[int, int, int]],
    begun: list[tuple[int, int, int]],
    successors: list[int],
    orders: list[set[int]],
) -> list[_State]:
    following: list[_State] = []
    for to in successors:
        on = [(b, c, at + 1) for b, c, at in (*past, *begun) if bans[b].chains[c][at + 1] == to]
        ends = [b for b, c, at in on if at + 1 == len(bans[b].chains[c])]
        if any(not bans[b].only for b in ends) or any(to not in allowed for allowed in orders):
            continue
        following.append((to, frozenset((b, c, at) for b, c, at in on if at + 1 < len(bans[b].chains[c]))))
    return following


def _drop_dead_ends(turns: dict[_State, list[_State]]) -> None:
    """Take out turns into links between from which nothing may follow."""
    while True:
        dead = {state for state, following in turns.items() if state[1] and not following}
        if not dead:
            return
        for state in dead:
            del turns[state]
        for state in turns:
            turns[state] = [to for to in turns[state] if to not in dead]


def _extended(
    graph: RoadGraph, of: NDArray[np.int64], first: NDArray[np.int64], successor: NDArray[np.int32]
) -> RoadGraph:
    """The graph with copies of links behind its own."""
    if not of.size:
        return replace(graph, successor_first=first, successor=successor)
    links = np.concatenate((np.arange(graph.link_count), of))
    names = ("tail", "head", "length_m", "speed_limit_mps", "functional_class", "cross", "urban", "structure")
    columns: dict[str, Any] = {
        name: getattr(graph, name)[links] for name in (*names, "way_id", "name_idx", "reverse_idx")
    }
    count = np.diff(graph.geometry_first)[links]
    geometry_first = np.concatenate(([0], np.cumsum(count)))
    point = np.repeat(graph.geometry_first[:-1][links] - geometry_first[:-1], count) + np.arange(
        int(geometry_first[-1])
    )
    rank = np.arange(graph.link_count, links.size)
    conditional, ferries = graph.conditional, graph.ferries
    if conditional is not None:
        conditional = conditional.with_links(of, rank)
    if ferries is not None:
        ferries = ferries.with_links(of, rank)
    return replace(
        graph,
        **columns,
        geometry_first=geometry_first,
        geometry_lon_e7=graph.geometry_lon_e7[point],
        geometry_lat_e7=graph.geometry_lat_e7[point],
        successor_first=first,
        successor=successor,
        conditional=conditional,
        ferries=ferries,
        signs=None if graph.signs is None else graph.signs.with_links(of),
        copies=LinkCopies(of),
    )


def whole_successors(graph: RoadGraph) -> tuple[NDArray[np.int64], NDArray[np.int32]]:
    """What may follow each link for some of those that drive on it, no copies among them: as RoadGraph has successors.

    Copies of links lead nowhere. Those of the graph itself where it has no copies.
    """
    if graph.copies is None:
        return graph.successor_first, graph.successor
    original = np.concatenate((np.arange(graph.road_link_count), graph.copies.of))
    link = original[np.repeat(np.arange(graph.link_count), np.diff(graph.successor_first))]
    pairs = np.unique(np.column_stack((link, original[graph.successor])), axis=0)
    count = np.bincount(pairs[:, 0], minlength=graph.link_count)
    return np.concatenate(([0], np.cumsum(count))).astype(np.int64), pairs[:, 1].astype(np.int32)
