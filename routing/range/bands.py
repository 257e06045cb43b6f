"""What a range query is answered with: bands of charge left."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from routing.places import SnappedPoint
from routing.route.route import SearchStats

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray
    from shapely import MultiPolygon

    from routing.range.filled import Filling
    from routing.range.map_edge import MapEdge
    from routing.range.reach import RoadReach
    from routing.range.rings import AreaRings


@dataclass(frozen=True, slots=True)
class RangeBand:
    """The area that can be reached, or come from, with at least soc_left_frac left at the end of the trip.

    soc_left_frac: None where bands are by time or distance. limit: what is taken at most, where bands are by energy
    [J], time [s] or distance [m], else None. rings: of the area.

    probability_frac: that a place at its edge is reached so; None where uncertainty was not asked for. map_edge: where
    the map ends it and not the charge; None where no charge is left at the map's rim. edge_left_j: what the battery
    holds then at most, there or at the end of the trip back. bearing_reach_m: float64 (24,), how far the area reaches
    from north on clockwise. road_reach: where it ends along roads.
    """

    soc_left_frac: float | None
    limit: float | None
    area: MultiPolygon
    rings: AreaRings
    area_m2: float
    tolerance_m: float  # how far the boundary may have been moved for fewer points
    node_count: int
    false_in_frac: float  # share of the covered nodes that can't be reached
    false_out_frac: float  # share of reachable nodes that it leaves out
    probability_frac: float | None
    map_edge: MapEdge | None
    edge_left_j: float | None
    bearing_reach_m: NDArray[np.float64]
    road_reach: RoadReach


@dataclass(frozen=True, slots=True)
class RangeAnswer:
    """Bands from the outermost (reserve) to the innermost; filling: how far they are filled, None along roads."""

    origin: SnappedPoint
    bands: tuple[RangeBand, ...]
    stats: SearchStats
    warnings: tuple[str, ...]
    filling: Filling | None = None
