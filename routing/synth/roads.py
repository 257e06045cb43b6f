"""Country roads of a synthetic region: corridors turned into curved roads that end at town streets."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np
from scipy.sparse import csr_array
from scipy.spatial import cKDTree

from energy.stops import FunctionalClass
from routing.synth.corridors import EASY_GRADE
from routing.synth.links import Nodes, RoadPieces
from routing.synth.polylines import Polylines, at_index, offsets, ragged_indices, resampled, smoothed
from routing.synth.serpentines import meandered, winding_needed
from routing.synth.settlements import Rank

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from routing.synth.corridors import Corridors
    from routing.synth.settlements import Settlements
    from routing.synth.streets import Streets
    from routing.synth.terrain import Landscape

SMOOTHING_M: Final = 180.0  # standard deviation of the smoothing of heights along a road
_SAMPLE_M: Final = 40.0
_SMOOTHING_PASSES: Final = round(2.0 * (SMOOTHING_M / _SAMPLE_M) ** 2)
_WINDING_SAMPLE_M: Final = 8.0
_CLIP_M: Final = 75.0  # a country road ends that close to a street node
_STIFFNESS: Final = np.array([6.0, 5.0, 4.0, 3.0, 2.0, 1.0])  # of a road at its junctions, by class (assumed)
LIMIT_KMH: Final = np.array([130, 100, 90, 90, 70, 70, 30, 30])  # outside towns (assumed)
URBAN_KMH: Final = np.array([100, 70, 50, 50, 50, 50, 30, 30])
_EASY: Final = np.array([EASY_GRADE.get(c, 0.10) for c in FunctionalClass])


@dataclass(frozen=True, slots=True)
class RoadCourses:
    """Roads between junctions. lines: their courses; tail, head: nodes; functional_class: int8, one a line.

    Before clipping, nodes count in node_x_m and node_y_m; after it, street nodes come first.
    """

    lines: Polylines
    tail: NDArray[np.int64]
    head: NDArray[np.int64]
    functional_class: NDArray[np.int8]
    node_x_m: NDArray[np.float64]
    node_y_m: NDArray[np.float64]


def chains_from_corridors(
    corridors: Corridors, fixed_cell: NDArray[np.int64], fixed_xy_m: NDArray[np.float64]
) -> RoadCourses:
    """Corridor steps joined to lines between junctions, their corners rounded; fixed cells keep their given place."""
    cells, flat = np.unique(np.concatenate((corridors.cell_a, corridors.cell_b)), return_inverse=True)
    a, b = flat[: corridors.cell_a.size], flat[corridors.cell_a.size :]
    x = ((cells % corridors.cols + 0.5) * corridors.cell_m).astype(np.float64)
    y = ((cells // corridors.cols + 0.5) * corridors.cell_m).astype(np.float64)
    pinned = np.isin(cells, fixed_cell)
    _, first_of = np.unique(fixed_cell, return_index=True)
    at = np.searchsorted(fixed_cell[first_of], cells[pinned])
    x[pinned], y[pinned] = fixed_xy_m[first_of[at]].T
    weight = _STIFFNESS[corridors.functional_class]
    both = (np.concatenate((a, b)), np.concatenate((b, a)))
    stiff = csr_array((np.tile(weight, 2), both), shape=(cells.size, cells.size))
    total = np.asarray(stiff.sum(axis=1)).ravel()
    degree = np.bincount(both[0], minlength=cells.size)
    free = ~pinned & (degree > 1)
    for _ in range(6):
        x = np.where(free, 0.5 * x + 0.5 * (stiff @ x) / total, x)
        y = np.where(free, 0.5 * y + 0.5 * (stiff @ y) / total, y)
    low, high = np.full(cells.size, 99), np.full(cells.size, -1)
    np.minimum.at(low, both[0], np.tile(corridors.functional_class, 2))
    np.maximum.at(high, both[0], np.tile(corridors.functional_class, 2))
    key = (degree != 2) | pinned | (low != high)
    sequence, counts, classes = _walk_chains(a, b, corridors.functional_class, key)
    first = offsets(counts)
    lines = Polylines(first, x[sequence], y[sequence])
    for spacing_m, passes in ((150.0, 8), (_SAMPLE_M, 6)):
        lines, _ = resampled(lines, spacing_m)
        end = lines.is_end()
        lines = Polylines(lines.first, smoothed(lines.x_m, end, passes), smoothed(lines.y_m, end, passes))
    lines, _ = resampled(lines, _SAMPLE_M)
    return RoadCourses(lines, sequence[first[:-1]], sequence[first[1:] - 1], classes, x, y)


def _walk_chains(
    a: NDArray[np.int64], b: NDArray[np.int64], road_class: NDArray[np.int8], key: NDArray[np.bool_]
) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.int8]]:
    """Node sequences from key node to key node, their lengths and classes."""
    node = np.concatenate((a, b))
    order = np.argsort(node, kind="stable")
    begin = np.searchsorted(node[order], np.arange(key.size + 1)).tolist()
    step_of = (order % a.size).tolist()
    other_of = np.concatenate((b, a))[order].tolist()
    is_key = key.tolist()
    used = bytearray(a.size)
    sequence: list[int] = []
    counts: list[int] = []
    first_step: list[int] = []
    for start in np.flatnonzero(key).tolist():
        for slot in range(begin[start], begin[start + 1]):
            step = step_of[slot]
            if used[step]:
                continue
            used[step] = 1
            here = other_of[slot]
            length = 2
            sequence += (start, here)
            first_step.append(step)
            while not is_key[here]:
                onward = begin[here] if not used[step_of[begin[here]]] else begin[here] + 1
                step = step_of[onward]
                if used[step]:
                    break
                used[step] = 1
                here = other_of[onward]
                sequence.append(here)
                length += 1
            counts.append(length)
    return np.array(sequence, np.int64), np.array(counts, np.int64), road_class[np.array(first_step, np.int64)]


def clipped_at_towns(chains: RoadCourses, streets: Streets) -> RoadCourses:
    """The parts of chains outside towns; where one enters a town it ends at the nearest street node."""
    on_street = streets.functional_class != FunctionalClass.SERVICE
    real = np.unique(np.concatenate((streets.centre, streets.tail[on_street], streets.head[on_street])))
    lines = chains.lines
    points = np.column_stack((lines.x_m, lines.y_m))
    near_m, slot = cKDTree(np.column_stack((streets.x_m[real], streets.y_m[real]))).query(points)
    street_node = real[slot]
    owner = lines.line_of_point()
    outside = np.asarray(near_m > _CLIP_M)
    starts = outside.copy()
    starts[1:] &= ~outside[:-1] | (owner[1:] != owner[:-1])
    ends = outside.copy()
    ends[:-1] &= ~outside[1:] | (owner[1:] != owner[:-1])
    begin, last = np.flatnonzero(starts), np.flatnonzero(ends)
    line = owner[begin]
    base = streets.x_m.size
    from_town, to_town = begin > lines.first[line], last < lines.first[line + 1] - 1
    tail = np.where(from_town, street_node[np.maximum(begin - 1, 0)], base + chains.tail[line])
    head = np.where(to_town, street_node[np.minimum(last + 1, owner.size - 1)], base + chains.head[line])
    length_m = (last - begin) * _SAMPLE_M
    keep = (tail != head) | (length_m > 1_500.0)
    keep &= ~(
        from_town
        & to_town
        & (length_m < 120.0)
        & (streets.place[np.minimum(tail, base - 1)] == streets.place[np.minimum(head, base - 1)])
    )
    begin, last, line, tail, head, from_town, to_town = (
        v[keep] for v in (begin, last, line, tail, head, from_town, to_town)
    )
    counts = last - begin + 1 + from_town + to_town
    first = offsets(counts)
    source = np.full(int(first[-1]), -1)
    body = ragged_indices(first[:-1] + from_town, first[1:] - to_town)
    source[body] = ragged_indices(begin, last + 1)
    x, y = lines.x_m[source], lines.y_m[source]
    x[first[:-1][from_town]], y[first[:-1][from_town]] = streets.x_m[tail[from_town]], streets.y_m[tail[from_town]]
    x[first[1:][to_town] - 1], y[first[1:][to_town] - 1] = streets.x_m[head[to_town]], streets.y_m[head[to_town]]
    clipped = Polylines(first, x, y)
    whole = counts > 1
    clipped, _ = resampled(clipped.take(np.flatnonzero(whole)), _SAMPLE_M)
    end = clipped.is_end()
    clipped = Polylines(clipped.first, smoothed(clipped.x_m, end, 4), smoothed(clipped.y_m, end, 4))
    return RoadCourses(
        clipped, tail[whole], head[whole], chains.functional_class[line[whole]], chains.node_x_m, chains.node_y_m
    )


def roads_from_chains(
    land: Landscape,
    places: Settlements,
    streets: Streets,
    chains: RoadCourses,
    first_new_node: int,
    pieces_wanted: int,
    rng: np.random.Generator,
) -> tuple[Nodes, RoadPieces]:
    """Road pieces with serpentines where the ground is steep, and the nodes at which roads are cut into pieces.

    The new nodes count from first_new_node; there are more of them where the grade changes.
    """
    lines = chains.lines
    height = smoothed(land.sample_m(lines.x_m, lines.y_m), lines.is_end(), _SMOOTHING_PASSES)
    winding = winding_needed(lines, height, 1.02 * _EASY[chains.functional_class])
    winds = np.maximum.reduceat(winding, lines.first[:-1]) > 1.0
    fine, index = resampled(lines, np.where(winds, _WINDING_SAMPLE_M, _SAMPLE_M))
    height, winding = at_index(height, index), at_index(winding, index)
    fine, index = resampled(meandered(fine, winding, rng), np.where(winds, 14.0, _SAMPLE_M))
    height, winding = at_index(height, index), at_index(winding, index)

    is_node = _is_node(fine, height, chains.tail == chains.head, pieces_wanted)
    node = np.full(is_node.size, -1)
    node[is_node] = first_new_node + np.arange(int(is_node.sum()))
    begins = is_node.copy()
    begins[fine.first[:-1]] = True
    begin = np.flatnonzero(begins)
    line = fine.line_of_point()[begin]
    last = np.append(begin[1:], 0)
    closes = np.append(line[1:] != line[:-1], True)
    last[closes] = fine.first[line[closes] + 1] - 1
    tail = np.where(node[begin] >= 0, node[begin], chains.tail[line])
    head = np.where(node[last] >= 0, node[last], chains.head[line])
    point = ragged_indices(begin, last + 1)
    shape = Polylines(offsets(last - begin + 1), fine.x_m[point], fine.y_m[point])
    curvy = np.maximum.reduceat(winding[point], shape.first[:-1])
    urban = _near_homes(places, streets, shape)
    road_class = chains.functional_class[line]
    limit = np.where(urban, URBAN_KMH[road_class], LIMIT_KMH[road_class])
    limit = np.minimum(limit, np.where(curvy > 1.7, 50, np.where(curvy > 1.2, 70, 130)))
    pieces = RoadPieces(
        tail=tail,
        head=head,
        functional_class=road_class,
        limit_kmh=limit,
        urban=urban,
        oneway=np.zeros(tail.size, bool),
        way=line,
        shape=without_straight_points(shape),
    )
    return Nodes(fine.x_m[is_node], fine.y_m[is_node], height[is_node]), pieces


def _is_node(
    lines: Polylines, height_m: NDArray[np.float64], closed: NDArray[np.bool_], pieces_wanted: int
) -> NDArray[np.bool_]:
    """Inner points at which lines are cut, bool (k,), into about pieces_wanted pieces: denser where grades change."""
    position = lines.position_m()
    step = np.diff(position, prepend=0.0)
    step[lines.first[:-1]] = 0.0
    grade = np.divide(np.diff(height_m, prepend=0.0), step, out=np.zeros(step.size), where=step > 0.0)
    bend = np.abs(np.diff(grade, prepend=0.0))
    bend[lines.first[:-1]] = 0.0
    bend[np.minimum(lines.first[:-1] + 1, bend.size - 1)] = 0.0
    pace = np.cumsum(step / 900.0 + np.minimum(bend, 0.1) / 0.05)
    start = np.repeat(pace[lines.first[:-1]], np.diff(lines.first))
    pace -= start
    whole = pace[lines.first[1:] - 1]
    scale = float(np.clip(pieces_wanted / max(float(whole.sum()), 1.0), 0.4, 3.0))
    count = np.maximum(np.where(closed, 3, 1), np.round(whole * scale).astype(np.int64))
    count = np.minimum(count, np.maximum(1, (lines.length_m() / 60.0).astype(np.int64)))
    share = pace / np.repeat(np.maximum(whole, 1e-9), np.diff(lines.first)) * np.repeat(count, np.diff(lines.first))
    number = np.floor(share + 1e-9)
    is_node = np.zeros(number.size, bool)
    is_node[1:] = np.diff(number) > 0
    return is_node & ~lines.is_end()


def _near_homes(places: Settlements, streets: Streets, shape: Polylines) -> NDArray[np.bool_]:
    """Whether a piece lies at the edge of a village or larger place, bool (pieces,)."""
    middle = (shape.first[:-1] + shape.first[1:] - 1) // 2
    homes = np.flatnonzero(places.rank[streets.place] <= Rank.VILLAGE)
    tree = cKDTree(np.column_stack((streets.x_m[homes], streets.y_m[homes])))
    near_m, _ = tree.query(np.column_stack((shape.x_m[middle], shape.y_m[middle])), distance_upper_bound=200.0)
    return np.asarray(near_m < 170.0)


def without_straight_points(shape: Polylines, tolerance_m: float = 0.8) -> Polylines:
    """The lines without inner points that lie nearer than the tolerance to the chord of their neighbours."""
    for parity in (0, 1, 0, 1):
        x, y = shape.x_m, shape.y_m
        dx, dy = np.roll(x, -1) - np.roll(x, 1), np.roll(y, -1) - np.roll(y, 1)
        away_m = np.abs((x - np.roll(x, 1)) * dy - (y - np.roll(y, 1)) * dx) / np.maximum(np.hypot(dx, dy), 1e-9)
        keep = (away_m > tolerance_m) | shape.is_end() | (np.arange(x.size) % 2 == parity)
        counts = np.add.reduceat(keep.astype(np.int64), shape.first[:-1])
        shape = Polylines(offsets(counts), x[keep], y[keep])
    return shape
