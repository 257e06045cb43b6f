"""Divided motorways of a synthetic region, with interchanges and link roads."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np
from scipy.spatial import cKDTree

from energy.stops import FunctionalClass
from routing.synth.links import Nodes, RoadPieces
from routing.synth.polylines import Polylines, normals, offsets, resampled, smoothed

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from routing.synth.roads import RoadCourses
    from routing.synth.terrain import Landscape

CARRIAGEWAY_M: Final = 12.0  # from the middle of the motorway to either carriageway
SAMPLE_M: Final = 80.0
PIECE_SAMPLES: Final = 9  # samples between nodes where nothing joins
RAMP_SAMPLES: Final = 5  # an interchange's link roads join that far before and after it
BETWEEN_INTERCHANGES_M: Final = 7_000.0
REACH_M: Final = 900.0  # from the motorway to the road an interchange serves
RAMP_KMH: Final = 60


class _Builder:
    """Pieces and nodes of the motorways, collected line by line."""

    def __init__(self, first_node: int) -> None:
        self.next_node = first_node
        self.node_x: list[NDArray[np.float64]] = []
        self.node_y: list[NDArray[np.float64]] = []
        self.node_h: list[NDArray[np.float64]] = []
        self.rows: list[tuple[int, int, int, int, bool, int]] = []  # tail, head, class, km/h, oneway, way
        self.shapes: list[NDArray[np.float64]] = []

    def add_nodes(self, x: NDArray[np.float64], y: NDArray[np.float64], h: NDArray[np.float64]) -> NDArray[np.int64]:
        ids = self.next_node + np.arange(x.size)
        self.next_node += x.size
        self.node_x.append(x)
        self.node_y.append(y)
        self.node_h.append(h)
        return ids

    def add(
        self,
        tail: int,
        head: int,
        road_class: FunctionalClass,
        kmh: int,
        way: int,
        shape: NDArray[np.float64],
        *,
        oneway: bool,
    ) -> None:
        self.rows.append((tail, head, int(road_class), kmh, oneway, way))
        self.shapes.append(shape)

    def result(self) -> tuple[Nodes, RoadPieces]:
        table = np.array(self.rows, np.int64).reshape(-1, 6)
        points = np.concatenate([*self.shapes, np.empty((0, 2))])
        shape = Polylines(offsets(np.array([s.shape[0] for s in self.shapes], np.int64)), points[:, 0], points[:, 1])
        empty = np.empty(0)
        return (
            Nodes(*(np.concatenate([empty, *part]) for part in (self.node_x, self.node_y, self.node_h))),
            RoadPieces(
                tail=table[:, 0],
                head=table[:, 1],
                functional_class=table[:, 2].astype(np.int8),
                limit_kmh=table[:, 3],
                urban=np.zeros(table.shape[0], bool),
                oneway=table[:, 4].astype(bool),
                way=table[:, 5],
                shape=shape,
            ),
        )


def build_motorways(
    land: Landscape, chains: RoadCourses, nodes: Nodes, roads: RoadPieces
) -> tuple[Nodes, RoadPieces, NDArray[np.int64]]:
    """Nodes and pieces of motorways and of their link roads, and the nodes where carriageways meet.

    The carriageways of motorway k are the ways 2k and 2k + 1.
    An interchange is a diamond: link roads from and to either carriageway meet at one node of a country road nearby.
    Where motorways meet or end the carriageways come together, and a link road leads on to the nearest country road.
    """
    builder = _Builder(nodes.x_m.size)
    lines, _ = resampled(chains.lines, SAMPLE_M)
    end = lines.is_end()
    lines = Polylines(lines.first, smoothed(lines.x_m, end, 30), smoothed(lines.y_m, end, 30))
    height = smoothed(land.sample_m(lines.x_m, lines.y_m), end, 30)
    nx, ny = normals(lines)
    useful = (
        (roads.functional_class >= FunctionalClass.TRUNK)
        & (roads.functional_class <= FunctionalClass.TERTIARY)
        & ~roads.urban
    )
    candidates = np.unique(np.concatenate((roads.tail[useful], roads.head[useful])))
    if candidates.size == 0:
        return *builder.result(), np.empty(0, np.int64)
    tree = cKDTree(np.column_stack((nodes.x_m[candidates], nodes.y_m[candidates])))
    meeting, first_at = np.unique(np.concatenate((chains.tail, chains.head)), return_index=True)
    end_point = np.concatenate((lines.first[:-1], lines.first[1:] - 1))[first_at]
    joint = dict(
        zip(
            meeting.tolist(),
            builder.add_nodes(lines.x_m[end_point], lines.y_m[end_point], height[end_point]).tolist(),
            strict=True,
        )
    )
    taken: set[int] = set()
    for k in range(lines.count):
        part = slice(int(lines.first[k]), int(lines.first[k + 1]))
        x, y, h = lines.x_m[part], lines.y_m[part], height[part]
        if x.size < 3:
            continue
        side = (
            np.column_stack((nx[part], ny[part]))
            * CARRIAGEWAY_M
            * np.sin(np.pi / 2 * np.minimum(1.0, np.minimum(np.arange(x.size), np.arange(x.size)[::-1]) / 4.0))[:, None]
        )
        middle = np.column_stack((x, y))
        joins = _interchanges(middle, tree, candidates, taken)
        way = 2 * k
        ends = (joint[int(chains.tail[k])], joint[int(chains.head[k])])
        stops = sorted({s + d for s, _ in joins for d in (-RAMP_SAMPLES, RAMP_SAMPLES)})
        node_samples = _node_samples(x.size, stops)
        forward = _carriageway(builder, middle - side, h, node_samples, ends, way)
        back = _carriageway(
            builder, (middle + side)[::-1], h[::-1], [x.size - 1 - c for c in node_samples][::-1], ends[::-1], way + 1
        )
        for s, target in joins:
            before, after = s - RAMP_SAMPLES, s + RAMP_SAMPLES
            goal = np.array([nodes.x_m[target], nodes.y_m[target]])
            for line, ids, a, b in (
                (middle - side, forward, before, after),
                ((middle + side)[::-1], back, x.size - 1 - after, x.size - 1 - before),
            ):
                off, on = _ramp(line, a, goal), _ramp(line[::-1], x.size - 1 - b, goal)[::-1]
                builder.add(ids[a], target, FunctionalClass.TRUNK, RAMP_KMH, way, off, oneway=True)
                builder.add(target, ids[b], FunctionalClass.TRUNK, RAMP_KMH, way, on, oneway=True)
    _end_roads(builder, joint, lines, end_point, meeting, tree, candidates, nodes, 2 * lines.count)
    made, pieces = builder.result()
    return made, pieces, np.array(sorted(joint.values()), np.int64)


def _interchanges(
    middle: NDArray[np.float64], tree: cKDTree, candidates: NDArray[np.int64], taken: set[int]
) -> list[tuple[int, int]]:
    """Sample and country road node of each interchange of a motorway, well apart from each other and from the ends."""
    near_m, slot = (np.asarray(v) for v in tree.query(middle, distance_upper_bound=REACH_M))
    margin = 2 * RAMP_SAMPLES + 3
    found: list[tuple[int, int]] = []
    for s in np.argsort(np.abs(near_m - 160.0), kind="stable").tolist():
        if not np.isfinite(near_m[s]) or s < margin or s >= middle.shape[0] - margin:
            continue
        target = int(candidates[slot[s]])
        if target in taken or any(abs(s - other) * SAMPLE_M < BETWEEN_INTERCHANGES_M for other, _ in found):
            continue
        taken.add(target)
        found.append((s, target))
    return sorted(found)


def _node_samples(count: int, stops: list[int]) -> list[int]:
    """Samples that become nodes: the ends, the stops, and others in between at an even distance."""
    node_samples = [0]
    for stop in [*stops, count - 1]:
        samples = stop - node_samples[-1]
        parts = max(1, round(samples / PIECE_SAMPLES))
        node_samples += [node_samples[-1] + round(samples * p / parts) for p in range(1, parts)] + [stop]
    return sorted(set(node_samples))


def _carriageway(
    builder: _Builder,
    line: NDArray[np.float64],
    height: NDArray[np.float64],
    node_samples: list[int],
    ends: tuple[int, int],
    way: int,
) -> dict[int, int]:
    """Add a carriageway; the node at each of node_samples."""
    inner = np.array(node_samples[1:-1], np.int64)
    ids = [ends[0], *builder.add_nodes(line[inner, 0], line[inner, 1], height[inner]).tolist(), ends[1]]
    for k in range(len(node_samples) - 1):
        shape = line[node_samples[k] : node_samples[k + 1] + 1]
        kmh = 80 if node_samples[k] == 0 or node_samples[k + 1] == line.shape[0] - 1 else 130
        builder.add(ids[k], ids[k + 1], FunctionalClass.MOTORWAY, kmh, way, shape, oneway=True)
    return dict(zip(node_samples, ids, strict=True))


def _ramp(line: NDArray[np.float64], leave: int, goal: NDArray[np.float64]) -> NDArray[np.float64]:
    """A link road that leaves a line along its direction and bends to the goal (cubic Bézier curve)."""
    start = line[leave]
    ahead = line[leave + 1] - line[leave - 1]
    ahead = ahead / np.hypot(*ahead)
    reach = float(np.hypot(*(goal - start)))
    first, second = start + ahead * reach * 0.45, goal - ahead * reach * 0.12
    t = np.linspace(0.0, 1.0, 14)[:, None]
    curve: NDArray[np.float64] = (
        (1 - t) ** 3 * start + 3 * t * (1 - t) ** 2 * first + 3 * t**2 * (1 - t) * second + t**3 * goal
    )
    return curve


def _end_roads(
    builder: _Builder,
    joint: dict[int, int],
    lines: Polylines,
    end_point: NDArray[np.int64],
    meeting: NDArray[np.int64],
    tree: cKDTree,
    candidates: NDArray[np.int64],
    nodes: Nodes,
    way: int,
) -> None:
    """Two-way link roads from where motorways end or meet to the nearest country road."""
    for cell, point in zip(meeting.tolist(), end_point.tolist(), strict=True):
        start = np.array([lines.x_m[point], lines.y_m[point]])
        far_m, slot = tree.query(start)
        if not 5.0 < far_m < 6_000.0:
            continue
        target = int(candidates[slot])
        goal = np.array([nodes.x_m[target], nodes.y_m[target]])
        aside = np.array([start[1] - goal[1], goal[0] - start[0]]) * 0.12
        t = np.linspace(0.0, 1.0, max(4, int(far_m / 80.0)))[:, None]
        shape = start + (goal - start) * t + aside * np.sin(np.pi * t) ** 2
        builder.add(joint[cell], target, FunctionalClass.TRUNK, 80, way, shape, oneway=False)
