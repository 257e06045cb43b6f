"""Where a tile lies: zoom level, column and row of the web map pyramid, in spherical Mercator (EPSG:3857)."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from app.tiles.errors import TileOutOfRangeError

if TYPE_CHECKING:
    from numpy.typing import NDArray


@dataclass(frozen=True, slots=True)
class TileAddress:
    """One tile; x counts columns from 180° west to the east, y rows from the north to the south.

    Raises TileOutOfRangeError where x or y is not in 0..2^z − 1.
    """

    z: int
    x: int
    y: int

    def __post_init__(self) -> None:
        most = 2**self.z - 1
        for field, value in (("x", self.x), ("y", self.y)):
            if not 0 <= value <= most:
                raise TileOutOfRangeError(field, value, f"0..{most} at zoom {self.z}")

    def bounds_deg(self, buffer_frac: float = 0.0) -> tuple[float, float, float, float]:
        """West, south, east and north end of the tile [deg], widened by a share of its width on each side."""
        side = 2.0**-self.z
        west, east = (self.x - buffer_frac) * side, (self.x + 1 + buffer_frac) * side
        north, south = (self.y - buffer_frac) * side, (self.y + 1 + buffer_frac) * side
        return lon_deg_from_east(west), lat_deg_from_south(south), lon_deg_from_east(east), lat_deg_from_south(north)


def east_from_lon(lon_deg: NDArray[np.float64]) -> NDArray[np.float64]:
    """Share of the map's width from its western edge, 0..1, of longitudes [deg]."""
    return np.asarray(lon_deg / 360.0 + 0.5, np.float64)


def south_from_lat(lat_deg: NDArray[np.float64]) -> NDArray[np.float64]:
    """Share of the map's height from its northern edge, 0..1 within ±85.05°, of latitudes [deg]."""
    return np.asarray(0.5 - np.arcsinh(np.tan(np.radians(lat_deg))) / (2.0 * math.pi), np.float64)


def lon_deg_from_east(east_frac: float) -> float:
    """Longitude [deg] of a share of the map's width."""
    return (east_frac - 0.5) * 360.0


def lat_deg_from_south(south_frac: float) -> float:
    """Latitude [deg] of a share of the map's height."""
    return math.degrees(math.atan(math.sinh((0.5 - south_frac) * 2.0 * math.pi)))
