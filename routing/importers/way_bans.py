"""Bans of driving over ways as bans of single turns, where that says the same, else as bans of chains of links."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace
from itertools import pairwise
from typing import TYPE_CHECKING, Final

import numpy as np

from routing.graph.link_bans import LinkBan, carried
from routing.importers.tags import Dropped

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from routing.graph.road_graph import RoadGraph
    from routing.importers.roads import WayBan


LONGEST_M: Final = 100.0  # of the ways between: a link of two carriageways, at which nobody lives (assumed)


class _Near:
    """Links at the nodes that ways of bans touch."""

    def __init__(
        self, bans: Sequence[WayBan], tail: NDArray[np.int32], head: NDArray[np.int32], way_id: NDArray[np.int64]
    ) -> None:
        via = np.isin(way_id, [way for ban in bans for way in ban.via_way_ids])
        nodes = np.unique(np.concatenate((tail[via], head[via])))
        near = np.flatnonzero(np.isin(tail, nodes) | np.isin(head, nodes)).tolist()
        self.tail, self.head, self.way = tail, head, way_id
        self.into: dict[int, list[int]] = {}
        self.out_of: dict[int, list[int]] = {}
        for link in near:
            self.into.setdefault(int(head[link]), []).append(link)
            self.out_of.setdefault(int(tail[link]), []).append(link)

    def back(self, link: int, other: int) -> bool:
        """Whether a link is the other direction of another."""
        same_ends = self.tail[link] == self.head[other] and self.head[link] == self.tail[other]
        return bool(same_ends and self.way[link] == self.way[other])

    def permitted(self, graph: RoadGraph, chain: list[int]) -> bool:
        """Whether a chain may be driven up to its last turn."""
        return all(after in graph.successors(before) for before, after in pairwise(chain[:-1]))

    def chains(self, ban: WayBan) -> list[list[int]]:
        """Links from the last of a from way over the ways between to the first of a to way, each way of driving it."""
        found: list[list[int]] = []
        stack = [
            [origin, link]
            for node in list(self.into)
            for origin in self.into[node]
            if self.way[origin] in ban.from_way_ids
            for link in self.out_of.get(node, [])
            if self.way[link] in ban.via_way_ids and not self.back(link, origin)
        ]
        while stack:
            chain = stack.pop()
            nodes = {int(self.tail[link]) for link in chain[1:]}
            for link in self.out_of.get(int(self.head[chain[-1]]), []):
                if self.back(link, chain[-1]):
                    continue
                if self.way[link] in ban.to_way_ids:
                    found.append([*chain, link])
                elif self.way[link] in ban.via_way_ids and int(self.head[link]) not in nodes:
                    stack.append([*chain, link])
        return found


def banned_over_ways(
    bans: Sequence[WayBan],
    tail: NDArray[np.int32],
    head: NDArray[np.int32],
    way_id: NDArray[np.int64],
    length_m: NDArray[np.float64],
    dropped: Counter[str],
    bans_left: list[WayBan],
) -> list[tuple[int, int]]:
    """Pairs of links (first, next) whose turn is forbidden where bans over ways are; others go into bans_left.

    A search that goes from link to link does not know where it came from. So a ban is carried by its last turn where
    the ways between can be entered from its first link alone, or by its first turn where they lead to its last link
    alone. Others are left, and those whose ways between are longer than LONGEST_M: drives may begin or end there.
    Those without a link are counted in dropped.
    """
    pairs: list[tuple[int, int]] = []
    if not bans:
        return pairs
    near = _Near(bans, tail, head, way_id)
    for ban in bans:
        chains = near.chains(ban)
        if not chains:
            dropped[Dropped.RESTRICTION_MOOT] += 1
            continue
        short = not ban.only and len(chains) == 1 and float(length_m[chains[0][1:-1]].sum()) <= LONGEST_M
        turn = _turn_of(near, chains[0]) if short else None
        if turn is None:
            bans_left.append(ban)
        else:
            pairs.append(turn)
    return pairs


def with_bans_over_ways(graph: RoadGraph, bans: Sequence[WayBan]) -> RoadGraph:
    """The graph with bans over ways carried by copies of links; meta.dropped counts those that are not.

    Not carried are those whose way runs on through the node at which it begins or ends (which side is meant?), and
    those that would cut roads off.
    """
    if not bans:
        return graph
    dropped = Counter(graph.meta.dropped)
    near = _Near(bans, graph.tail, graph.head, graph.way_id)
    found: list[LinkBan] = []
    for ban in bans:
        chains = near.chains(ban)
        whole = [chain for chain in chains if {int(graph.way_id[k]) for k in chain[1:-1]} == set(ban.via_way_ids)]
        chains = [chain for chain in whole or chains if near.permitted(graph, chain)]
        begins, ends = {chain[0] for chain in chains}, {chain[-1] for chain in chains}
        if not chains:
            dropped[Dropped.RESTRICTION_MOOT] += 1
        elif len(begins) > len(ban.from_way_ids) or len(ends) > len(ban.to_way_ids):
            dropped[Dropped.RESTRICTION_VIA_WAY] += 1
        else:
            found.append(LinkBan(tuple(map(tuple, chains)), ban.only))
    graph, left = carried(graph, found)
    dropped[Dropped.RESTRICTION_VIA_WAY] += left
    counts = {str(reason): count for reason, count in sorted(dropped.items()) if count}
    return replace(graph, meta=replace(graph.meta, dropped=counts))


def _turn_of(near: _Near, chain: list[int]) -> tuple[int, int] | None:
    """The turn that nobody but those whom the ban means takes, or None."""
    steps = list(pairwise(chain))
    # at each node between, who else comes in and goes on along the chain; and who on the chain may go elsewhere
    enters = any(
        other != before and not near.back(other, after)
        for before, after in steps[:-1]
        for other in near.into[int(near.head[before])]
    )
    if not enters:
        return steps[-1]
    leaves = any(
        other != after and not near.back(other, before)
        for before, after in steps[1:]
        for other in near.out_of[int(near.head[before])]
    )
    return None if leaves else steps[0]
