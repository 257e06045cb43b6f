"""The rings around an area as arrays, which are cheaper to read than its shape."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import shapely

if TYPE_CHECKING:
    from numpy.typing import NDArray


@dataclass(frozen=True, slots=True)
class AreaRings:
    """Closed rings of polygons, shells counter-clockwise and holes clockwise.

    lonlat: float64 (P, 2) [deg], the first point of each ring repeated at its end. ring_first: int64 (R + 1,), where
    each ring's points begin. polygon_first: int64 (G + 1,), where each polygon's rings do, the shell before its holes.
    """

    lonlat: NDArray[np.float64]
    ring_first: NDArray[np.int64]
    polygon_first: NDArray[np.int64]


def rings_of(area: shapely.MultiPolygon) -> AreaRings:
    """The rings of an area."""
    _, lonlat, (ring_first, polygon_first, _) = shapely.to_ragged_array([area])
    return AreaRings(lonlat, ring_first.astype(np.int64), polygon_first.astype(np.int64))
