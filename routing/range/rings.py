"""The rings around an area as arrays, which are cheaper to read than its shape."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, cast

import numpy as np
import shapely

from routing.range.kernels_rings import POINT_BYTES, RING_BYTES, write_polygons

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

    def coordinates_json(self) -> bytes:
        """The coordinates of a GeoJSON MultiPolygon, to seven decimals, without Python's lock."""
        rings_bytes = RING_BYTES * (self.ring_first.size + self.polygon_first.size + 1)
        text = np.empty(POINT_BYTES * len(self.lonlat) + rings_bytes, np.uint8)
        size = write_polygons(self.lonlat, self.ring_first, self.polygon_first, text)
        return text[:size].tobytes()


def rings_of(area: shapely.MultiPolygon) -> AreaRings:
    """The rings of an area."""
    _, lonlat, (ring_first, polygon_first, _) = shapely.to_ragged_array([area])
    return AreaRings(lonlat, ring_first.astype(np.int64), polygon_first.astype(np.int64))


def shape_of(rings: AreaRings) -> shapely.MultiPolygon:
    """The area within rings."""
    firsts = rings.ring_first, rings.polygon_first, np.array((0, rings.polygon_first.size - 1))
    (area,) = shapely.from_ragged_array(shapely.GeometryType.MULTIPOLYGON, rings.lonlat, firsts)
    return cast("shapely.MultiPolygon", area)
