"""What a range query is answered with: bands of charge left."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from routing.places import SnappedPoint
from routing.route.route import SearchStats

if TYPE_CHECKING:
    from shapely import MultiPolygon


@dataclass(frozen=True, slots=True)
class RangeBand:
    """The area that can be reached, or come from, with at least soc_left_frac left at the end of the trip.

    probability_frac: that a place at its edge is reached so; None where uncertainty was not asked for.
    """

    soc_left_frac: float
    area: MultiPolygon
    area_m2: float
    tolerance_m: float  # how far the boundary may have been moved for fewer points
    node_count: int
    false_in_frac: float  # share of the covered nodes that can't be reached
    false_out_frac: float  # share of reachable nodes that it leaves out
    probability_frac: float | None = None


@dataclass(frozen=True, slots=True)
class RangeAnswer:
    """Bands from the outermost (reserve) to the innermost."""

    origin: SnappedPoint
    bands: tuple[RangeBand, ...]
    stats: SearchStats
    warnings: tuple[str, ...]
