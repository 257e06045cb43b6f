"""The course of a route link by link: what each link is, and the junctions between them."""

from __future__ import annotations

from bisect import bisect_left
from functools import cached_property
from typing import TYPE_CHECKING, Final

import numpy as np

from routing.guidance.bearings import turned_deg
from routing.guidance.junctions import junctions_after
from routing.guidance.labels import Labels, same_road
from routing.guidance.manoeuvre import Arm, Crossing
from routing.guidance.surroundings import LINK, RANKS, RING, bits_of, surroundings_of

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from routing.graph.road_graph import RoadGraph
    from routing.guidance.labels import Label
    from routing.route.route import Route

# A junction is clear where the way taken is about straight and all others lead aside: no rule asks for a step there.
CLEAR_AHEAD_DEG: Final = 15.0
CLEAR_ASIDE_DEG: Final = 60.0
LINK_AHEAD_M: Final = 50.0  # how far on the name of a road without one is looked for


class Course:
    """The links of a route on its graph; a junction is named by the position of the link that leads to it.

    link: int64 (n,). at_m: n+1, distance along the route at which each begins, and the end [m]. bits: of each link what
    its sign says. junctions: of those in `rows`, by position: where three roads meet or more, or something changes.
    """

    def __init__(self, graph: RoadGraph, route: Route, language: str = "") -> None:
        self.graph, self.route, self.labels = graph, route, Labels(graph, language)
        links = route.links
        self.link = np.array(graph.originals(links.link_idx), np.int64)
        self.links = self.link.tolist()
        driven_m = np.subtract(links.to_m, links.from_m)
        self.at_m: list[float] = [0.0, *np.cumsum(driven_m).tolist()]
        self.around = surroundings_of(graph)
        self._bits = bits_of(graph, self.link)
        self.bits: list[int] = self._bits.tolist()
        self.ferry: list[bool] = _ferry(graph, self.link).tolist()
        self.roads, self._met = self._meetings()
        self._positions: list[int] = self._met.tolist()
        self.rows = {position: row for row, position in enumerate(self._positions)}
        self.junctions = junctions_after(graph, self.link[self._met])

    def _meetings(self) -> tuple[list[int], NDArray[np.int64]]:
        """Number of roads at the end of each link, and positions at which there is something to look at."""
        graph, node = self.graph, self.graph.head[self.link]
        out, into = self.around.out_first, self.around.oneway_first
        roads = out[node + 1] - out[node] + into[node + 1] - into[node]
        here, there = self.link[:-1], self.link[1:]
        changes = np.zeros(self.link.size, np.bool_)
        changes[:-1] = (graph.name_idx[here] != graph.name_idx[there]) | (graph.reverse_idx[here] == there)
        if graph.signs is not None:
            changes[:-1] |= graph.signs.sign_idx[here] != graph.signs.sign_idx[there]
        ferry = np.array(self.ferry, np.bool_)
        changes[:-1] |= ferry[:-1] != ferry[1:]
        return roads.tolist(), np.flatnonzero((roads > 2) | changes)

    @cached_property
    def clear(self) -> set[int]:
        """Junctions at which nobody asks for the way, by angles alone, at which nothing begins or ends."""
        junctions, met = self.junctions, self._met
        inner = met[met < self.link.size - 1]
        if not inner.size:
            return set()
        count = np.diff(junctions.first)
        row = np.repeat(np.arange(met.size), count)
        bearing, came = np.array(junctions.bearing_deg), np.array(junctions.came)
        out, entry = np.array(junctions.out_link), np.array(junctions.entry)
        turn = (bearing - bearing[came][row]) % 360.0 - 180.0
        taken = np.zeros(row.size, np.bool_)
        following = np.append(self.link, -2)[met + 1]
        taken = out == following[row]
        off = np.where(entry & ~taken, np.abs(turn), 180.0)
        off[came] = 180.0
        nearest = np.minimum.reduceat(off, np.array(junctions.first[:-1]))
        ahead = np.minimum.reduceat(np.where(taken, np.abs(turn), 180.0), np.array(junctions.first[:-1]))
        plain = (ahead <= CLEAR_AHEAD_DEG) & (nearest >= CLEAR_ASIDE_DEG)
        bits = np.append(self._bits, 0)
        plain &= ((bits[met] | bits[met + 1]) & (LINK | RING)) == 0
        return set(met[plain].tolist())

    @cached_property
    def mini(self) -> set[int]:
        """Positions of links that end at a mini roundabout."""
        signs = self.graph.signs
        if signs is None or not signs.mini_node.size:
            return set()
        return set(np.flatnonzero(np.isin(self.graph.head[self.link], signs.mini_node)).tolist())

    def left_out_exits(self, first: int, last: int) -> int:
        """How many ways out that are no links the route passes on the roundabout between two of its links."""
        signs = self.graph.signs
        if signs is None or not signs.left_out_link.size:
            return 0
        return int(signs.left_out_exits[np.isin(signs.left_out_link, self.link[first : last + 1])].sum())

    def met(self, first: int, last: int) -> list[int]:
        """Positions from first to last, without it, at whose ends there is something to look at."""
        return self._positions[bisect_left(self._positions, first) : bisect_left(self._positions, last)]

    def label(self, position: int) -> Label:
        """Name and number of a link of the route."""
        return self.labels.label(self.links[position])

    def begins(self, first: int, last: int) -> int:
        """The position of the first link of which more than a metre is driven."""
        return next((k for k in range(first, last) if self.at_m[k + 1] - self.at_m[first] >= 1.0), last)

    def label_from(self, position: int, last: int) -> Label:
        """Those of a link, or of the first one with any that begins within LINK_AHEAD_M of it, up to the last."""
        for k in range(position, last + 1):
            if self.at_m[k] - self.at_m[position] > LINK_AHEAD_M:
                break
            if (label := self.label(k)).known:
                return label
        return self.label(position)

    def before_deg(self, position: int) -> float:
        """Direction of travel at the end of a link."""
        junctions = self.junctions
        return (junctions.bearing_deg[junctions.came[self.rows[position]]] + 180.0) % 360.0

    def after_deg(self, position: int) -> float:
        """Direction of travel at the beginning of the link that follows."""
        junctions, following = self.junctions, self.links[position + 1]
        for k in junctions.roads(self.rows[position]):
            if junctions.out_link[k] == following:
                return junctions.bearing_deg[k]
        raise LookupError(f"link {following} does not leave the junction at {position}")

    def arms(self, position: int) -> list[tuple[int, Arm]]:
        """The roads at the end of a link but for that itself, each with the link that leaves by it, -1 for none."""
        junctions, row = self.junctions, self.rows[position]
        before, own = self.before_deg(position), self.label(position)
        found = []
        for k in junctions.roads(row):
            if k == junctions.came[row]:
                continue
            out = junctions.out_link[k]
            link = out if out >= 0 else junctions.in_link[k]
            label = self.labels.label(link)
            found.append(
                (
                    out,
                    Arm(
                        turn_deg=turned_deg(before, junctions.bearing_deg[k]),
                        entry=junctions.entry[k],
                        rank=junctions.rank[k],
                        bits=junctions.bits[k],
                        label=label,
                        leads_in=junctions.in_link[k] >= 0,
                        same=same_road(label, own),
                    ),
                )
            )
        return found

    def crossing(self, position: int) -> Crossing | None:
        """The junction at the end of a link as rules see it, None where the route turns back on its road."""
        taken: Arm | None = None
        others = []
        for out, arm in self.arms(position):
            if out == self.links[position + 1]:
                taken = arm
            else:
                others.append(arm)
        if taken is None:
            return None
        own, link = self.label(position), self.links[position]
        rank = int(RANKS[self.graph.functional_class[link]])
        came = Arm(180.0, False, rank, self.bits[position], own, True, True)
        return Crossing(came, taken, tuple(others))


def _ferry(graph: RoadGraph, link: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Whether links are ferries, bool (k,)."""
    if graph.ferries is None:
        return np.zeros(link.size, np.bool_)
    return np.isin(link, graph.ferries.link)
