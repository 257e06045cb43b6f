"""Where a map ends though its roads go on."""

from __future__ import annotations

import math
import threading
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from energy.stops import FunctionalClass
from routing.graph.earth import E7, METRE_PER_DEGREE

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from routing.graph.road_graph import RoadGraph

THROUGH: Final = FunctionalClass.TERTIARY  # roads of this class and above lead from place to place; assumed
FREE_DEG: Final = 120.0  # of the view from a road's end in which there is no road up to the horizon; assumed
TIMES_USUAL: Final = 2.0  # how much oftener ends of through roads lie outermost than those of other roads; assumed
MOSTLY_FRAC: Final = 0.5  # or of all of them, where the map cuts minor roads as well; assumed
TURNING_M: Final = 300.0  # around the end of a dual carriageway, for turning; assumed
BACK_DEG: Final = 60.0  # within which its lanes lead back from there; assumed
CELLS: Final = 100  # along the longer side of the map, in which roads are looked for
NEAR_CELLS: Final = 1.5  # roads nearer than this hide nothing
MOST_ENDS: Final = 2000  # of minor roads that are looked at


@dataclass(frozen=True, slots=True)
class MapRim:
    """The nodes at which a map cuts its roads, bool (N,), and the links that lead to or from one, bool (M,)."""

    node: NDArray[np.bool_]
    link: NDArray[np.bool_]

    @property
    def node_idx(self) -> NDArray[np.int64]:
        """The nodes of the rim, int64 (k,) ascending."""
        return np.flatnonzero(self.node)


class RimFinder:
    """The rim of one graph, found at the first question; safe to share between threads."""

    def __init__(self, graph: RoadGraph) -> None:
        self._graph = graph
        self._lock = threading.Lock()
        self._rim: MapRim | None = None

    def rim(self) -> MapRim:
        """As map_rim."""
        with self._lock:
            if self._rim is None:
                self._rim = map_rim(self._graph)
            return self._rim


def map_rim(graph: RoadGraph) -> MapRim:
    """The nodes and links of a graph at which the map cuts a road: those recorded by the import, else derived_rim."""
    if graph.cut_node is None:
        return derived_rim(graph)
    return _rim_at(graph, graph.cut_node)


def derived_rim(graph: RoadGraph) -> MapRim:
    """The nodes and links of a graph at which the map cuts a road, as far as the graph itself tells.

    A node of the rim is a dead end of a through road that lies outermost: in a third of the view from it, there is no
    road up to the horizon. Capes and ends of valleys lie so, too. So none counts where few dead ends of through roads
    are outermost: fewer than half of them, and not twice as often as those of minor roads, which end anywhere. Then it
    is an island, or may be one. On a map without through roads the outermost dead ends of all roads count.
    """
    ends = _dead_ends(graph)
    best_class = np.full(graph.node_count, len(FunctionalClass))
    np.minimum.at(best_class, graph.tail, graph.functional_class)
    np.minimum.at(best_class, graph.head, graph.functional_class)
    is_through = best_class[ends] <= THROUGH
    view = _View(graph)
    if bool((graph.functional_class <= THROUGH).any()):
        through, minor = ends[is_through], ends[~is_through]
        minor = minor[:: 1 + minor.size // MOST_ENDS]
        outermost = view.free_deg(through) >= FREE_DEG
        usual_frac = float(np.mean(view.free_deg(minor) >= FREE_DEG)) if minor.size else 0.0
        if outermost.any() and float(np.mean(outermost)) < min(TIMES_USUAL * usual_frac, MOSTLY_FRAC):
            outermost[:] = False
        cut_off = np.concatenate((through[outermost], _carriageway_ends(graph, view, best_class <= THROUGH)))
    else:
        cut_off = ends[view.free_deg(ends) >= FREE_DEG]
    return _rim_at(graph, cut_off)


def _rim_at(graph: RoadGraph, cut_off: NDArray[np.integer]) -> MapRim:
    node = np.zeros(graph.node_count, np.bool_)
    node[cut_off] = True
    link = node[graph.tail] | node[graph.head]
    node.flags.writeable = link.flags.writeable = False
    return MapRim(node, link)


def _dead_ends(graph: RoadGraph) -> NDArray[np.int64]:
    """Nodes at which a single road ends, int64 (k,)."""
    road = ((graph.reverse_idx < 0) | (np.arange(graph.link_count) < graph.reverse_idx)) & ~graph.is_copy()
    degree = np.bincount(graph.tail[road], minlength=graph.node_count)
    degree += np.bincount(graph.head[road], minlength=graph.node_count)
    return np.flatnonzero(degree == 1)


def _carriageway_ends(graph: RoadGraph, view: _View, on_through: NDArray[np.bool_]) -> NDArray[np.int64]:
    """Outermost nodes from which the carriageways of a through road lead back in one direction only, int64 (k,).

    Where a map cuts a dual carriageway, what is left are its lanes up to the last place for turning.
    """
    one_way = on_through[graph.tail] & (graph.reverse_idx < 0) & (graph.functional_class <= THROUGH)
    nodes = np.unique(graph.tail[one_way]).astype(np.int64)
    nodes = nodes[view.outer(nodes)]
    nodes = nodes[view.free_deg(nodes) >= FREE_DEG]
    through = np.flatnonzero(graph.functional_class <= THROUGH)
    ends = np.concatenate((graph.tail[through], graph.head[through]))
    others = np.concatenate((graph.head[through], graph.tail[through]))
    order = np.argsort(ends, kind="stable")
    first = np.searchsorted(ends[order], np.arange(graph.node_count + 1))
    neighbour = others[order]
    found: list[tuple[int, float]] = []
    for node in nodes.tolist():
        near, beyond, ahead = {node}, [], [node]
        while ahead:
            here = ahead.pop()
            for other in neighbour[first[here] : first[here + 1]].tolist():
                if other in near:
                    continue
                if view.distance_m(node, other) > TURNING_M:
                    beyond.append(other)
                else:
                    near.add(other)
                    ahead.append(other)
        if beyond and view.spread_deg(node, beyond) <= BACK_DEG:
            found.append((node, min(view.distance_m(node, other) for other in beyond)))
    kept: list[int] = []
    for node, _ in sorted(found, key=lambda end: -end[1]):  # of a place for turning, the node that is farthest out
        if all(view.distance_m(node, other) > 2.0 * TURNING_M for other in kept):
            kept.append(node)
    return np.array(kept, np.int64)


class _View:
    """What is seen of a map's roads from its nodes, by the outermost cells of a grid that hold a road."""

    def __init__(self, graph: RoadGraph) -> None:
        middle_deg = 0.5 * float(graph.node_lat_deg.min() + graph.node_lat_deg.max())
        scale = METRE_PER_DEGREE * np.array((np.cos(np.radians(middle_deg)), 1.0))
        self._node_m = np.column_stack((graph.node_lon_deg, graph.node_lat_deg)) * scale
        on_road = ~np.repeat(graph.is_ferry(), np.diff(graph.geometry_first))
        point_m = np.column_stack((graph.geometry_lon_e7, graph.geometry_lat_e7))[on_road] * (scale / E7)
        west_south = point_m.min(axis=0)
        self.cell_m = max(float((point_m.max(axis=0) - west_south).max()) / CELLS, 1.0)
        column, row = ((point_m - west_south) // self.cell_m).astype(np.int64).T + 1
        held = np.zeros((int(row.max()) + 2, int(column.max()) + 2), np.bool_)
        held[row, column] = True
        inner = held[1:-1, 1:-1] & held[:-2, 1:-1] & held[2:, 1:-1] & held[1:-1, :-2] & held[1:-1, 2:]
        held[1:-1, 1:-1] &= ~inner  # what lies behind others
        self._held, self._west_south = held, west_south
        self._cell_m = (np.argwhere(held)[:, ::-1] - 0.5) * self.cell_m + west_south

    def free_deg(self, nodes: NDArray[np.int64]) -> NDArray[np.float64]:
        """The widest angle at each node without a road in it, float64 (k,) [deg], 360 where there is none at all."""
        widest = np.full(nodes.size, 360.0)
        for k, place_m in enumerate(self._node_m[nodes]):
            away = self._cell_m - place_m
            away = away[np.hypot(away[:, 0], away[:, 1]) > NEAR_CELLS * self.cell_m]
            if away.size:
                angle = np.sort(np.degrees(np.arctan2(away[:, 1], away[:, 0])))
                widest[k] = np.diff(np.append(angle, angle[0] + 360.0)).max()
        return widest

    def outer(self, nodes: NDArray[np.int64]) -> NDArray[np.bool_]:
        """Whether nodes lie in outermost cells, bool (k,)."""
        column, row = ((self._node_m[nodes] - self._west_south) // self.cell_m).astype(np.int64).T + 1
        last_row, last_column = np.array(self._held.shape) - 1
        return np.asarray(self._held[np.clip(row, 0, last_row), np.clip(column, 0, last_column)])

    def distance_m(self, node: int, other: int) -> float:
        """Between two nodes, as the crow flies."""
        return math.dist(self._node_m[node], self._node_m[other])

    def spread_deg(self, node: int, others: list[int]) -> float:
        """The narrowest angle at a node that holds all others [deg]."""
        away = self._node_m[others] - self._node_m[node]
        angle = np.sort(np.degrees(np.arctan2(away[:, 1], away[:, 0])))
        return 360.0 - float(np.diff(np.append(angle, angle[0] + 360.0)).max())
