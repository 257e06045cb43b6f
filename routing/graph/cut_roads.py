"""At which nodes a map's extract cuts roads, by what its file says of where it ends."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np
import shapely
from scipy.spatial import cKDTree

from routing.graph.earth import E7, METRE_PER_DEGREE
from routing.graph.rim import THROUGH, derived_rim

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from routing.graph.road_graph import LooseLinks, LooseNodes, RoadGraph

Box = tuple[float, float, float, float]

INSIDE_FRAC: Final = 0.5  # of all nodes: with fewer inside it is the box of something else; assumed
APART_FRAC: Final = 0.25  # of all ways that may lie apart from a box, such as those of bus lines through it; assumed
AREA_TIMES: Final = 2.0  # a box with nothing near its sides that is larger than so many times the data tells nothing
MARGIN_FRAC: Final = 0.02  # of a box's longer side, within which roads are near a side; assumed
NEAR_EDGE_M: Final = 20.0  # a road that ends so near before a box's side ends there in any case; assumed
LEAST_STEPS: Final = 2.5  # times its longest of the last steps that a road may end before the side it leads to; assumed
FARTHEST_M: Final = 300.0  # but not farther than this; assumed
LAST_STEPS: Final = 4
AGREED_M: Final = 300.0  # what the graph itself shows as cut agrees with cuts so near; assumed
AGREED_FRAC: Final = 0.5  # of that which has to agree with a box, else both count; assumed
AGREED_KNOWN_FRAC: Final = 0.25  # the same where points are lacking, which is no guess; assumed
ON_LINE_M: Final = 1.0
AT_BORDER_M: Final = 30.0  # a through road that ends so near to the region's border is cut there; assumed


@dataclass(frozen=True, slots=True)
class Extent:
    """What a map file says of where it ends.

    boxes: west, south, east, north [deg], as its header has them, none where it has none that is one.
    region: the area that the extract is of, by the boundary in the file, or None. lacking: positions of points beside
    which ways name points that the file lacks.
    """

    boxes: tuple[Box, ...] = ()
    region: shapely.Polygon | shapely.MultiPolygon | None = None
    lacking: tuple[int, ...] = ()


def cut_nodes(
    graph: RoadGraph,
    extent: Extent,
    nodes: LooseNodes,
    links: LooseLinks,
    known: NDArray[np.bool_],
    way_end: NDArray[np.bool_],
    left_out: NDArray[np.bool_],
) -> NDArray[np.int32] | None:
    """The nodes of a graph at which its extract cuts roads, int32 (k,) ascending, None where nothing tells.

    nodes, links: all roads of the map, those that the graph leaves out as well: where a road that is left out leads
    from the graph to a cut, or from a cut to it, the node where it leaves the graph counts. known: bool (N,), nodes at
    which a road is cut for certain. Beside them count: ends of ways, way_end: bool (N,), outside of the file's box,
    where an extract that keeps whole ways lacks the roads that go on; where nothing is outside of it, dead ends before
    its sides; dead ends outside of the region. What the graph itself shows (derived_rim) is added where less than
    AGREED_FRAC of it lies at such cuts, as in extracts by a polygon that keep whole ways, and no region is known.
    left_out: bool (N,), nodes at which the import left out a road for want of heights, which count as well. No node,
    and not None, is answered where a box has a margin without roads on all sides.
    """
    dead_end = _dead_ends(nodes, links)
    boxes = () if not extent.boxes else _believed(extent.boxes, nodes, links)
    cut = known.copy()
    if boxes:
        depth_m = _depth_m(boxes, nodes)
        cut |= way_end & (depth_m < -ON_LINE_M)
        if not known.any() and bool((depth_m >= -ON_LINE_M).all()):
            cut[_ends_before_sides(boxes, nodes, links, np.flatnonzero(dead_end & (depth_m < FARTHEST_M)))] = True
    outside = None
    if extent.region is not None:
        outside = dead_end & _beyond(extent.region, nodes, links)
        cut |= outside
    found = _in_graph(graph, nodes, links, cut)
    with_left_out = _in_graph(graph, nodes, links, cut | left_out)
    if with_left_out.size == 0:
        return found if boxes and _has_margin(boxes, nodes) else None
    if outside is not None and outside.any():
        return with_left_out
    derived = derived_rim(graph).node_idx
    least_frac = AGREED_KNOWN_FRAC if known.any() else AGREED_FRAC
    if derived.size and (found.size == 0 or _agreed_frac(graph, derived, found) < least_frac):
        return np.union1d(with_left_out, derived).astype(np.int32)
    return with_left_out


def _dead_ends(nodes: LooseNodes, links: LooseLinks) -> NDArray[np.bool_]:
    """Whether a single road leads to a node, bool (N,)."""
    mm = np.rint(links.length_m * 1000.0).astype(np.int64)
    low, high = np.minimum(links.tail, links.head), np.maximum(links.tail, links.head)
    roads = np.unique(np.column_stack((low, high, mm)), axis=0)[:, :2]
    return np.asarray(np.bincount(roads.ravel(), minlength=nodes.lat_deg.size) == 1, np.bool_)


def _beyond(region: shapely.Polygon | shapely.MultiPolygon, nodes: LooseNodes, links: LooseLinks) -> NDArray[np.bool_]:
    """Whether nodes lie outside of a region, those of through roads also just before its border, bool (N,)."""
    through = np.zeros(nodes.lat_deg.size, np.bool_)
    for end in (links.tail, links.head):
        through[end[links.functional_class <= THROUGH]] = True
    inner = region.buffer(-AT_BORDER_M / METRE_PER_DEGREE)
    within = shapely.contains_xy(region, nodes.lon_deg, nodes.lat_deg)
    return np.asarray(~within | (through & ~shapely.contains_xy(inner, nodes.lon_deg, nodes.lat_deg)), np.bool_)


def _believed(boxes: tuple[Box, ...], nodes: LooseNodes, links: LooseLinks) -> tuple[Box, ...]:
    """The boxes where they are those of an extract that has these roads, else none."""
    inside = _depth_m(boxes, nodes) >= -ON_LINE_M
    if float(inside.mean()) < INSIDE_FRAC:
        return ()
    way = np.unique(links.way_id, return_inverse=True)[1]
    has_inside, has_outside = (np.zeros(int(way.max(initial=-1)) + 1, np.bool_) for _ in range(2))
    for end in (links.tail, links.head):
        has_inside[way[inside[end]]] = True
        has_outside[way[~inside[end]]] = True
    apart, outside = int((has_outside & ~has_inside).sum()), int(has_outside.sum())
    return boxes if apart <= max(INSIDE_FRAC * outside, APART_FRAC * has_inside.size) else ()


def _sides_m(box: Box, nodes: LooseNodes) -> NDArray[np.float64]:
    """How far nodes lie within each side of a box, float64 (4, N) [m], below 0 outside; west, south, east, north."""
    west, south, east, north = box
    squeeze = np.cos(np.radians(nodes.lat_deg))
    lon, lat = nodes.lon_deg, nodes.lat_deg
    return np.array(((lon - west) * squeeze, lat - south, (east - lon) * squeeze, north - lat)) * METRE_PER_DEGREE


def _depth_m(boxes: tuple[Box, ...], nodes: LooseNodes) -> NDArray[np.float64]:
    """How far nodes lie within the box that holds them best, float64 (N,) [m], below 0 outside."""
    return np.asarray(np.max([_sides_m(box, nodes).min(axis=0) for box in boxes], axis=0), np.float64)


def _has_margin(boxes: tuple[Box, ...], nodes: LooseNodes) -> bool:
    """Whether roads are far from all sides of a box that is not much larger than what they span."""
    if len(boxes) != 1:
        return False
    west, south, east, north = boxes[0]
    squeeze = float(np.cos(np.radians(0.5 * (south + north))))
    least_m = MARGIN_FRAC * max((east - west) * squeeze, north - south) * METRE_PER_DEGREE
    spanned = float(np.ptp(nodes.lon_deg) * np.ptp(nodes.lat_deg))
    return bool((_depth_m(boxes, nodes) > least_m).all()) and (east - west) * (north - south) <= AREA_TIMES * spanned


def _ends_before_sides(
    boxes: tuple[Box, ...], nodes: LooseNodes, links: LooseLinks, ends: NDArray[np.int64]
) -> list[int]:
    """Those of some dead ends that lie before a side of the box that their road leads to.

    Tools that drop the points outside of a box leave a road's last point inside, up to a step before the side.
    """
    at = {int(node): -1 for node in ends}
    for link in np.flatnonzero(np.isin(links.head, ends) | np.isin(links.tail, ends)).tolist():
        for node in (int(links.head[link]), int(links.tail[link])):
            if node in at:
                at[node] = link
    sides_m = np.max([_sides_m(box, nodes) for box in boxes], axis=0)
    found = []
    for node, link in at.items():
        begin, end = int(links.geometry_first[link]), int(links.geometry_first[link + 1])
        points = slice(begin, end)
        squeeze = float(np.cos(np.radians(nodes.lat_deg[node])))
        line_m = np.column_stack((links.geometry_lon_e7[points] * squeeze, links.geometry_lat_e7[points]))
        line_m = line_m * (METRE_PER_DEGREE / E7)
        if int(links.tail[link]) == node:
            line_m = line_m[::-1]
        steps = np.diff(line_m[-1 - LAST_STEPS :], axis=0)
        step_m = np.hypot(steps[:, 0], steps[:, 1])
        steps, step_m = steps[step_m > 0.0], step_m[step_m > 0.0]
        if not step_m.size:
            continue
        east, north = steps[-1] / step_m[-1]
        most_m = min(max(NEAR_EDGE_M, LEAST_STEPS * float(step_m.max())), FARTHEST_M)
        for depth_m, towards in zip(sides_m[:, node].tolist(), (-east, -north, east, north), strict=True):
            if depth_m <= ON_LINE_M or (towards > 0.0 and depth_m <= most_m * towards):
                found.append(node)
                break
    return found


def _in_graph(graph: RoadGraph, nodes: LooseNodes, links: LooseLinks, cut: NDArray[np.bool_]) -> NDArray[np.int32]:
    """The graph's nodes that are cut, or that links left out lead from to a cut one or to from one, int32 (k,)."""
    kept = np.isin(nodes.id, graph.node_id)
    here = cut & kept
    for tail, head in ((links.tail, links.head), (links.head, links.tail)):
        reached = cut & ~kept
        ahead = reached.copy()
        while ahead.any():
            after = np.zeros(cut.size, np.bool_)
            after[head[ahead[tail]]] = True
            here |= after & kept
            ahead = after & ~kept & ~reached
            reached |= ahead
    return np.flatnonzero(here[kept]).astype(np.int32)


def _agreed_frac(graph: RoadGraph, derived: NDArray[np.int64], found: NDArray[np.int32]) -> float:
    """Which part of some nodes has one of the others near, 0..1."""
    scale = METRE_PER_DEGREE * np.array((np.cos(np.radians(graph.node_lat_deg.mean())), 1.0))
    place_m = np.column_stack((graph.node_lon_deg, graph.node_lat_deg)) * scale
    nearest_m = np.asarray(cKDTree(place_m[found]).query(place_m[derived])[0])
    return float(np.mean(nearest_m <= AGREED_M))
