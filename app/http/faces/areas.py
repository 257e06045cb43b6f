"""Areas in reach as other engines draw them: polygons, of which clients read one for each limit."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from shapely import Polygon, box

from app.schemas.place import PointGeometry

if TYPE_CHECKING:
    from collections.abc import Sequence

    from app.schemas.place import Position
    from app.schemas.range import BandFeature, RangeFeatureCollection

    Rings = list[list[Position]]


@dataclass(frozen=True, slots=True)
class Area:
    """One limit's area: polygons as rings, the main one first, each with its share of the whole area.

    The main one holds the origin, or is the largest where none does.
    """

    polygons: tuple[Rings, ...]
    shares: tuple[float, ...]
    area_km2: float

    @property
    def main(self) -> Rings:
        """The polygon that clients read; an empty one where nothing is in reach."""
        return self.polygons[0] if self.polygons else []


def area_of(band: BandFeature, origin: Position) -> Area:
    """A band's area."""
    assert band.geometry is not None  # which faces always ask for
    parts = band.geometry.coordinates
    shapes = [Polygon(rings[0], rings[1:]) for rings in parts]
    at = box(*origin, *origin)
    order = sorted(range(len(parts)), key=lambda k: (not shapes[k].intersects(at), -shapes[k].area))
    whole = sum(shape.area for shape in shapes) or 1.0
    return Area(tuple(parts[k] for k in order), tuple(shapes[k].area / whole for k in order), band.properties.area_km2)


def origin_of(ranged: RangeFeatureCollection) -> Position:
    """The place on a road that a range begins at: lon, lat [deg]."""
    geometry = ranged.features[-1].geometry
    assert isinstance(geometry, PointGeometry)  # which faces always ask for
    return geometry.coordinates


def box_of_rings(polygons: Sequence[Rings]) -> list[float] | None:
    """West, south, east, north [deg] of polygons, None of none."""
    shells = [rings[0] for rings in polygons if rings]
    if not shells:
        return None
    points = np.concatenate([np.asarray(shell) for shell in shells])
    return [*points.min(axis=0).tolist(), *points.max(axis=0).tolist()]
