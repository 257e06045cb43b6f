"""The heights of a graph as raster-dem tiles, in terrarium colours."""

from __future__ import annotations

import math
from threading import Lock
from typing import TYPE_CHECKING, Final

import numpy as np

from app.tiles.errors import TileOutOfRangeError
from app.tiles.png import png_from_rgb
from app.tiles.surface import HeightSurface, surface_grid

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from app.tiles.address import TileAddress
    from routing.graph.road_graph import RoadGraph

TILE_SIZE: Final = 256
MAX_ZOOM: Final = 14
PIXELS_A_CELL: Final = 2  # what a bicubic spline between grid points needs to be seen smooth
MAX_OVERSAMPLING: Final = 4
# heights are rounded to less than a thousandth of a pixel: finer steps are lost on a screen and double a tile's size
STEPS_A_METRE_AT_ZOOM_7: Final = 2
TERRARIUM_BASE_M: Final = 32_768


class HeightTiles:
    """Raster-dem tiles of one graph; their surface is made when the first one is asked for."""

    def __init__(self, graph: RoadGraph) -> None:
        self._graph = graph
        self._grid = surface_grid(graph)
        self._surface: HeightSurface | None = None
        self._lock = Lock()
        self.bounds_deg = self._grid.bounds_deg()
        pixels = PIXELS_A_CELL / self._grid.cell  # along the whole map
        self.max_zoom = min(MAX_ZOOM, max(0, math.ceil(math.log2(pixels / TILE_SIZE))))

    def surface(self) -> HeightSurface:
        """The surface through the nodes, made once."""
        with self._lock:
            if self._surface is None:
                self._surface = HeightSurface(self._graph, self._grid)
            return self._surface

    def tile(self, address: TileAddress) -> bytes:
        """One tile as PNG; raises TileOutOfRangeError where it is finer than the surface."""
        if address.z > self.max_zoom:
            raise TileOutOfRangeError("z", address.z, f"0..{self.max_zoom} for heights of this graph")
        surface = self.surface()
        over = min(MAX_OVERSAMPLING, 2 ** (self.max_zoom - address.z))
        middle = (np.arange(TILE_SIZE * over) + 0.5) / (TILE_SIZE * over)
        heights_m = surface.heights_m((address.x + middle) / 2.0**address.z, (address.y + middle) / 2.0**address.z)
        pixels_m = heights_m.reshape(TILE_SIZE, over, TILE_SIZE, over).mean(axis=(1, 3))
        return png_from_rgb(terrarium_rgb(pixels_m, STEPS_A_METRE_AT_ZOOM_7 * 2 ** max(address.z - 7, 0)))


def terrarium_rgb(height_m: NDArray[np.float64], steps_a_metre: int) -> NDArray[np.uint8]:
    """Heights as colours, uint8 (..., 3): height = 256 R + G + B / 256 − 32768, within ±32768 m.

    steps_a_metre: what heights are rounded to, a power of two up to 256.
    """
    steps = np.rint((height_m + TERRARIUM_BASE_M) * steps_a_metre).astype(np.int64) * (256 // steps_a_metre)
    steps = np.clip(steps, 0, 2**24 - 1)
    return np.stack((steps >> 16, steps >> 8 & 255, steps & 255), axis=-1).astype(np.uint8)
