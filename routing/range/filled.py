"""Smooth outlines without small holes and gaps, in place of those that follow the roads in reach."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Final

import numpy as np
import shapely
from shapely.geometry.polygon import orient

from routing.graph.earth import METRE_PER_DEGREE
from routing.range.area import area_of_rings_m2
from routing.range.rings import rings_of

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from routing.graph.road_graph import RoadGraph
    from routing.places import Point
    from routing.range.area import ReachableArea, RoadEnergies

LEAST_GAP_M: Final = 800.0  # twice the distance at which areas lie off roads
GAP_FRAC: Final = 0.05  # of the diameter of a circle as large as the outermost band; assumed
SIMPLER: Final = 0.01  # of a gap, by which outlines are simplified before they are widened


@dataclass(frozen=True, slots=True)
class Filling:
    """Gaps narrower than gap_m are closed, and holes smaller than hole_m2."""

    gap_m: float
    hole_m2: float


def filling_of(outermost: ReachableArea) -> Filling:
    """How far areas of one answer are filled; the larger the outermost is, the farther."""
    gap_m = max(LEAST_GAP_M, GAP_FRAC * 2.0 * float(np.sqrt(outermost.area_m2 / np.pi)))
    return Filling(gap_m, gap_m**2)


def filled_areas(
    graph: RoadGraph,
    origin: Point,
    cases: Sequence[tuple[RoadEnergies, float]],
    areas: Sequence[ReachableArea],
    filling: Filling,
    cases_a_level: int,
) -> tuple[ReachableArea, ...]:
    """The areas of cases with their gaps and holes closed, and shares counted anew on all nodes.

    Widened by half a gap and narrowed again, in a plane that touches the earth at the origin. Each holds the area that
    it is made of. They nest as these do: each lies within that of the level before, which is so many cases before it.
    """
    scale = METRE_PER_DEGREE * np.array((np.cos(np.radians(origin.lat_deg)), 1.0))
    home = np.array((origin.lon_deg, origin.lat_deg))
    tolerance_m = SIMPLER * filling.gap_m
    ashore = nodes_ashore(graph)
    filled: list[ReachableArea] = []
    wholes: list[shapely.MultiPolygon] = []
    for (energies, budget_j), drawn in zip(cases, areas, strict=True):
        flat = shapely.transform(drawn.area, lambda lonlat: (lonlat - home) * scale)
        wide = shapely.buffer(shapely.simplify(flat, tolerance_m), 0.5 * filling.gap_m + tolerance_m)
        closed = shapely.union(shapely.buffer(wide, -0.5 * filling.gap_m), flat)
        whole = shapely.MultiPolygon([_without_holes(part, filling.hole_m2) for part in shapely.get_parts(closed)])
        if len(wholes) >= cases_a_level:
            whole = multi_polygon(shapely.intersection(whole, wholes[-cases_a_level]))
        wholes.append(whole)
        lonlat = shapely.transform(whole, lambda place_m: place_m / scale + home)
        shape = multi_polygon(shapely.set_precision(lonlat, 1e-7))
        rings = rings_of(shape)
        shapely.prepare(shape)
        covered = shapely.contains_xy(shape, graph.node_lon_deg, graph.node_lat_deg)
        reached = energies.node_energy_j <= budget_j
        covered, reached = covered & ashore, reached & ashore
        filled.append(
            replace(
                drawn,
                area=shape,
                rings=rings,
                area_m2=area_of_rings_m2(rings),
                tolerance_m=drawn.tolerance_m + tolerance_m,
                false_in_frac=float(np.count_nonzero(covered & ~reached)) / max(int(np.count_nonzero(covered)), 1),
                false_out_frac=float(np.count_nonzero(reached & ~covered)) / max(int(np.count_nonzero(reached)), 1),
            )
        )
    return tuple(filled)


def nodes_ashore(graph: RoadGraph) -> NDArray[np.bool_]:
    """Which nodes are on a road and not on ferries alone, bool (N,)."""
    ashore = np.zeros(graph.node_count, np.bool_)
    ashore[graph.tail[~graph.is_ferry()]] = True
    ashore[graph.head[~graph.is_ferry()]] = True
    return ashore


def _without_holes(part: shapely.Polygon, least_m2: float) -> shapely.Polygon:
    """A polygon that keeps its large holes only."""
    kept = [hole for hole in part.interiors if shapely.area(shapely.Polygon(hole)) >= least_m2]
    return shapely.Polygon(part.exterior, kept)


def multi_polygon(shape: shapely.Geometry) -> shapely.MultiPolygon:
    """Polygons with shells counter-clockwise and holes clockwise."""
    parts = [part for part in shapely.get_parts(shape) if isinstance(part, shapely.Polygon) and not part.is_empty]
    return shapely.MultiPolygon([orient(part) for part in parts])
