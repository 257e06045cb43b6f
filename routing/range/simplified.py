"""Areas with fewer points and shorter numbers, which lie within a tolerance, still nest and are still valid."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Final

import numpy as np
import shapely

from routing.graph.earth import E7, METRE_PER_DEGREE
from routing.range.filled import multi_polygon
from routing.range.kernels_simplify import Outlines, Squares, leave_out_points
from routing.range.rings import AreaRings, rings_of, shape_of

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from routing.graph.road_graph import RoadGraph
    from routing.places import Point
    from routing.range.area import ReachableArea, RoadEnergies

POINTS_A_SQUARE: Final = 2.0  # of the grid by which points are found
SIMPLER_CELLS: Final = 1.25  # of the grid, by which outlines are simplified where nobody says by how much
STRAIGHT_DEG: Final = 1e-6  # within which lines are straight: a tenth of a metre
ROUNDING_FRAC: Final = 0.05  # of the tolerance, by which rounding may move points besides
MOST_DECIMALS: Final = 7  # of coordinates, as they are drawn


def simplified_rings(areas: Sequence[AreaRings], origin: Point, tolerance_m: float) -> tuple[AreaRings, ...]:
    """Rings of areas with fewer points, from which no point that there was lies farther than the tolerance [m].

    Areas that hold each other still do, and valid ones stay valid: all are made simpler at once, and no line comes to
    cross another. The origin stays on its side of every line. Points are then rounded to as many decimals as a
    twentieth of the tolerance asks for, but for those at which lines come too close.
    """
    points = [np.rint(rings.lonlat * E7).astype(np.int64) for rings in areas]
    sizes = [np.diff(rings.ring_first) - 1 for rings in areas]  # without the repeated first point
    open_points = np.concatenate(
        [np.delete(found, rings.ring_first[1:] - 1, axis=0) for found, rings in zip(points, areas, strict=True)]
        + [np.rint([[origin.lon_deg * E7, origin.lat_deg * E7]]).astype(np.int64)]
    )
    size = np.concatenate([*sizes, np.ones(1, np.int64)])  # the origin, a ring of one point that is never left out
    lines = _outlines(open_points, size)
    scale = METRE_PER_DEGREE / E7 * np.array((np.cos(np.radians(origin.lat_deg)), 1.0))
    leave_out_points(lines, _squares(open_points), (float(scale[0]), float(scale[1])), tolerance_m)
    open_points = _rounded(open_points, lines, scale, tolerance_m)
    simpler, ring = [], 0
    for rings in areas:
        until = ring + rings.ring_first.size - 1
        simpler.append(_closed(open_points, lines, ring, until, rings.polygon_first))
        ring = until
    return tuple(simpler)


def simplified_areas(
    graph: RoadGraph,
    origin: Point,
    cases: Sequence[tuple[RoadEnergies, float]],
    areas: Sequence[ReachableArea],
    tolerance_m: float,
    counted: NDArray[np.bool_],
    within: int | None = None,
) -> tuple[ReachableArea, ...]:
    """Areas of cases as simplified_rings makes them, with their shares counted anew.

    counted: bool (N,), the nodes that the shares are of. area_m2 stays that of the exact outline. within: by how many
    cases before it lies the area that each is cut to, where lines already cross by a rounding; None where none do.
    """
    simpler = simplified_rings([area.rings for area in areas], origin, tolerance_m)
    found: list[ReachableArea] = []
    for (energies, budget_j), drawn, rings in zip(cases, areas, simpler, strict=True):
        shape = shape_of(rings)
        if within is not None and len(found) >= within:
            shape = multi_polygon(shapely.intersection(shape, found[-within].area, grid_size=1.0 / E7))
            rings = rings_of(shape)
        false_in, false_out = _shares(graph, drawn, shape, counted, energies.node_energy_j <= budget_j, tolerance_m)
        found.append(
            replace(
                drawn,
                area=shape,
                rings=rings,
                tolerance_m=drawn.tolerance_m + (1.0 + ROUNDING_FRAC) * tolerance_m,
                false_in_frac=false_in,
                false_out_frac=false_out,
            )
        )
    return tuple(found)


def without_straight_points(lines: shapely.MultiLineString) -> shapely.MultiLineString:
    """Lines without the points in between of straight parts."""
    return shapely.MultiLineString(shapely.simplify(shapely.get_parts(lines), STRAIGHT_DEG).tolist())


def _shares(
    graph: RoadGraph,
    drawn: ReachableArea,
    shape: shapely.MultiPolygon,
    counted: NDArray[np.bool_],
    reached: NDArray[np.bool_],
    tolerance_m: float,
) -> tuple[float, float]:
    """false_in_frac and false_out_frac of a simpler shape; only nodes near the outline are looked at."""
    all_reached = int(np.count_nonzero(reached & counted))
    both = round(all_reached * (1.0 - drawn.false_out_frac))
    covered = round(both / (1.0 - drawn.false_in_frac)) if drawn.false_in_frac < 1.0 else 0
    near = _near_nodes(graph, drawn.area, tolerance_m)
    near = near[counted[near]]
    lon, lat = graph.node_lon_deg[near], graph.node_lat_deg[near]
    for change, area in ((-1, drawn.area), (1, shape)):
        shapely.prepare(area)
        inside = shapely.contains_xy(area, lon, lat)
        covered += change * int(np.count_nonzero(inside))
        both += change * int(np.count_nonzero(inside & reached[near]))
    return (covered - both) / max(covered, 1), (all_reached - both) / max(all_reached, 1)


def _near_nodes(graph: RoadGraph, area: shapely.MultiPolygon, tolerance_m: float) -> NDArray[np.intp]:
    """The nodes that may lie on another side of an outline once it is moved by a tolerance, and few more."""
    west, south, east, north = area.bounds
    lon, lat = graph.node_lon_deg, graph.node_lat_deg
    side_lat = 2.0 * tolerance_m / METRE_PER_DEGREE
    side_lon = side_lat / max(float(np.cos(np.radians(max(abs(south), abs(north))))), 0.01)
    south_west, side = np.array((west, south)), np.array((side_lon, side_lat))
    outline = shapely.get_coordinates(shapely.segmentize(area, 0.5 * side_lat))
    columns, rows = (((east, north) - south_west) // side).astype(np.int64) + 3
    marked = np.zeros((columns, rows), np.bool_)
    at = ((outline - south_west) // side).astype(np.int64) + 1
    for dx in (-1, 0, 1):
        for dy in (-1, 0, 1):
            marked[at[:, 0] + dx, at[:, 1] + dy] = True
    within = (lon > west - side_lon) & (lon < east + side_lon) & (lat > south - side_lat) & (lat < north + side_lat)
    nodes = np.flatnonzero(within)
    square = ((np.column_stack((lon[nodes], lat[nodes])) - south_west) // side).astype(np.int64) + 1
    near: NDArray[np.intp] = nodes[marked[square[:, 0], square[:, 1]]]
    return near


def _outlines(points: NDArray[np.int64], size: NDArray[np.int64]) -> Outlines:
    first = np.concatenate((np.zeros(1, np.int64), np.cumsum(size)[:-1]))
    ring = np.repeat(np.arange(size.size, dtype=np.int32), size)
    before, after = np.arange(-1, len(points) - 1), np.arange(1, len(points) + 1)
    before[first] = first + size - 1
    after[first + size - 1] = first
    return Outlines(
        x=np.ascontiguousarray(points[:, 0]),
        y=np.ascontiguousarray(points[:, 1]),
        before=before,
        after=after,
        ring=ring,
        first=first,
        size=size.copy(),
        point_count=size.copy(),
        twin=_twins(points),
        kept=np.ones(len(points), np.bool_),
    )


def _twins(points: NDArray[np.int64]) -> NDArray[np.int64]:
    """The next point at the same place for each, round and round."""
    order = np.lexsort((points[:, 1], points[:, 0]))
    begins = np.concatenate(([True], (np.diff(points[order], axis=0) != 0).any(axis=1)))
    first = np.flatnonzero(begins)
    following = np.roll(order, -1)
    last = np.append(first[1:], len(points)) - 1
    following[last] = order[first]
    twin = np.empty(len(points), np.int64)
    twin[order] = following
    return twin


def _squares(points: NDArray[np.int64]) -> Squares:
    west_south, east_north = points.min(axis=0), points.max(axis=0)
    extent = east_north - west_south + 1
    unit = max(1, int(np.sqrt(float(extent[0]) * float(extent[1]) * POINTS_A_SQUARE / len(points))))
    unit = max(unit, int(extent.max() // len(points)))
    columns, rows = (extent // unit + 1).tolist()
    square = (points[:, 1] - west_south[1]) // unit * columns + (points[:, 0] - west_south[0]) // unit
    first = np.zeros(columns * rows + 1, np.int64)
    np.cumsum(np.bincount(square, minlength=columns * rows), out=first[1:])
    return Squares(
        first, np.argsort(square, kind="stable"), unit, columns, rows, int(west_south[0]), int(west_south[1])
    )


def _rounded(
    points: NDArray[np.int64], lines: Outlines, scale: NDArray[np.float64], tolerance_m: float
) -> NDArray[np.int64]:
    """Points with fewer decimals where no line that does not end there is within twice of what any point moves by.

    Two lines farther apart than that stay apart, however their ends are rounded; of two that are nearer, no end moves.
    """
    unit = 10 ** max(0, int(np.floor(np.log10(ROUNDING_FRAC * tolerance_m * np.sqrt(2.0) / METRE_PER_DEGREE * E7))))
    if unit == 1:
        return points
    most_m = np.sqrt(0.5) * unit * METRE_PER_DEGREE / E7
    kept = np.flatnonzero(lines.kept)
    place, vertex = np.unique(points[kept], axis=0, return_inverse=True)
    vertex_of = np.full(len(points), -1)
    vertex_of[kept] = vertex.ravel()
    ends = np.unique(np.sort(np.column_stack((vertex_of[kept], vertex_of[lines.after[kept]])), axis=1), axis=0)
    place_m = (place - place[0]) * scale
    segments = np.asarray(shapely.linestrings(place_m[ends]))
    alone = ends[:, 0] == ends[:, 1]  # the origin; trees find no lines without length
    segments[alone] = shapely.points(place_m[ends[alone, 0]])
    near = shapely.STRtree(segments).query(segments, predicate="dwithin", distance=2.0 * most_m)
    near = near[:, near[0] < near[1]]
    first, second = ends[near[0]], ends[near[1]]
    shared = (first[:, :, None] == second[:, None, :]).any(axis=(1, 2))
    stuck = np.zeros(len(place), np.bool_)
    stuck[first[~shared]] = stuck[second[~shared]] = True
    for these, others, line in ((first, second, near[1]), (second, first, near[0])):
        for k in range(2):  # of lines that meet at a point, the other end of each
            tip = shared & (these[:, k, None] != others).all(axis=1)
            away_m = shapely.distance(shapely.points(place_m[these[tip, k]]), segments[line[tip]])
            close = np.flatnonzero(tip)[away_m <= 2.0 * most_m]
            stuck[these[close]] = stuck[others[close]] = True
    moved = np.where(stuck[:, None], place, np.rint(place / unit).astype(np.int64) * unit)
    moved[vertex_of[-1]] = place[vertex_of[-1]]  # the origin
    rounded = points.copy()
    rounded[kept] = moved[vertex.ravel()]
    return rounded


def _closed(
    points: NDArray[np.int64], lines: Outlines, begin: int, end: int, polygon_first: NDArray[np.int64]
) -> AreaRings:
    """The rings from begin to end with the points that are left, each with its first point again."""
    rows = slice(int(lines.first[begin]), int(lines.first[end - 1] + lines.size[end - 1]))
    remaining = points[rows][lines.kept[rows]]
    ring_first = np.concatenate((np.zeros(1, np.int64), np.cumsum(lines.point_count[begin:end] + 1)))
    opened = ring_first[:-1] - np.arange(end - begin)
    lonlat = np.insert(remaining, np.append(opened[1:], len(remaining)), remaining[opened], axis=0) / E7
    return AreaRings(lonlat, ring_first, polygon_first)
