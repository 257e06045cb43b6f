"""The ground of a graph for the zoom levels of a map: what is too small to be seen is left out, the rest simplified."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np
import shapely

from routing.ground.features import Ground, LayerShapes, RawGround
from routing.ground.kinds import AREAS, OCEAN, Layer
from routing.ground.sea import sea_of

if TYPE_CHECKING:
    from collections.abc import Mapping

    from numpy.typing import NDArray

BANDS: Final = ((0, 7), (8, 10), (11, 12), (13, 14))  # zoom levels that share a simplified shape
TILE_PIXELS: Final = 512  # along the side of a tile, as web maps draw vector tiles
TOLERANCE_PIXELS: Final = (0.5, 0.5, 0.5, 0.25)  # by which a line may go aside at the closest level of each band
SEEN_PIXELS: Final = 2.0  # side of the square that an area must have there; lines as long
RIM_FRAC: Final = 0.05  # beyond the roads, of the larger side of their box
FIRST_ZOOM: Final[Mapping[str, int]] = dict(  # of lines and places, set by eye
    (
        *(("river", 8), ("canal", 10), ("stream", 12)),
        *(("2", 0), ("3", 4), ("4", 5), ("5", 8), ("6", 9)),
        *(("city", 4), ("town", 7), ("village", 10), ("suburb", 11), ("borough", 11), ("quarter", 12)),
        *(("neighbourhood", 13), ("hamlet", 12), ("island", 9), ("isolated_dwelling", 14), ("locality", 14)),
    )
)


def ground_of(raw: RawGround, bbox: tuple[float, float, float, float]) -> Ground:
    """The ground around roads that lie in a box (west, south, east, north) [deg], cut a little beyond it."""
    west, south, east, north = bbox
    rim = RIM_FRAC * max(east - west, north - south)
    box = (west - rim, south - rim, east + rim, north + rim)
    left_out = dict(raw.left_out)
    layers = np.array([str(layer) for layer in raw.layers], np.object_)
    shapes = np.asarray(shapely.from_wkb(raw.shapes), np.object_)
    found = {}
    for layer in Layer:
        at = np.flatnonzero(layers == str(layer)) if layers.size else np.zeros(0, np.int64)
        kinds = [raw.classes[k] for k in at]
        names = [raw.names[k] for k in at]
        ranks = [raw.ranks[k] for k in at]
        mine = shapes[at] if at.size else np.zeros(0, np.object_)
        if layer in AREAS:
            mine = _filled(mine)
        if layer is Layer.WATER:
            sea, unclear = sea_of(_coast(raw), box)
            mine = np.append(mine, np.array(sea, np.object_)) if sea else mine
            kinds += [OCEAN] * len(sea)
            names += [{}] * len(sea)
            ranks += [0] * len(sea)
            if unclear:
                left_out["areas by the coast of which the map does not say whether they are sea"] = unclear
        if layer is not Layer.PLACE and mine.size:
            mine = _clipped(mine, box)
        found[layer] = _banded(
            layer, mine, kinds, names, np.array(ranks, np.int64), np.cos(np.radians(south + north) / 2.0)
        )
    return Ground(found, left_out)


def _coast(raw: RawGround) -> list[shapely.LineString]:
    return [line for line in shapely.from_wkb(raw.coast) if not line.is_empty]


def _filled(shapes: NDArray[np.object_]) -> NDArray[np.object_]:
    """Areas, where rims are given as closed lines those that they enclose; lines of too few points as empty ones."""
    lines = np.flatnonzero(shapely.get_type_id(shapes) == shapely.GeometryType.LINESTRING)
    coordinates, ring = shapely.get_coordinates(shapes[lines], return_index=True)
    enough = np.bincount(ring, minlength=lines.size) > 3
    kept = enough[ring]
    shapes[lines] = shapely.Polygon()
    rings = shapely.linearrings(coordinates[kept], indices=np.cumsum(enough)[ring[kept]] - 1) if kept.any() else ()
    shapes[lines[enough]] = shapely.polygons(rings) if kept.any() else ()
    return shapes


def _clipped(shapes: NDArray[np.object_], box: tuple[float, float, float, float]) -> NDArray[np.object_]:
    """Shapes that are valid, cut where they leave a box; empty ones where nothing is left."""
    wrong = np.flatnonzero(~shapely.is_valid(shapes))
    shapes[wrong] = shapely.make_valid(shapes[wrong])
    west, south, east, north = shapely.bounds(shapes).T
    outside = np.flatnonzero((west < box[0]) | (south < box[1]) | (east > box[2]) | (north > box[3]))
    shapes[outside] = shapely.clip_by_rect(shapes[outside], *box)
    return shapes


def _banded(
    layer: Layer,
    shapes: NDArray[np.object_],
    kinds: list[str],
    names: list[Mapping[str, str]],
    ranks: NDArray[np.int64],
    squeeze: float,
) -> LayerShapes:
    """Each shape for the bands of zoom levels that show it. squeeze: width of a degree of longitude by latitude's."""
    number = np.arange(shapes.size)
    first_zoom = np.array([FIRST_ZOOM.get(kind, 0) for kind in kinds], np.int64)
    if layer is Layer.PLACE:
        return LayerShapes(shapes, kinds, names, ranks, first_zoom, np.full(shapes.size, BANDS[-1][1]))
    extent = shapely.area(shapes) * squeeze if layer in AREAS else shapely.length(shapes)
    parts = []
    for (low, high), tolerance in zip(BANDS, TOLERANCE_PIXELS, strict=True):
        pixel_deg = 360.0 / (TILE_PIXELS * 2.0**high)
        seen = extent >= ((SEEN_PIXELS * pixel_deg * squeeze) ** (2 if layer in AREAS else 1))
        at = number[seen & (first_zoom <= high)]
        simple = shapely.simplify(shapes[at], tolerance * pixel_deg * squeeze, preserve_topology=False)
        if layer in AREAS:
            wrong = np.flatnonzero(~shapely.is_valid(simple))
            simple[wrong] = shapely.make_valid(simple[wrong])
        whole = ~shapely.is_empty(simple)
        parts.append(
            (simple[whole], at[whole], np.maximum(first_zoom[at[whole]], low), np.full(int(whole.sum()), high))
        )
    simple, at, first, last = (np.concatenate(column) for column in zip(*parts, strict=True))
    return LayerShapes(simple, [kinds[k] for k in at], [names[k] for k in at], ranks[at], first, last)
