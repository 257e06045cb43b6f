"""What lies around the roads of a graph as layers of vector tiles: land, water, borders and places."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np
import shapely

from app.tiles.address import east_from_lon, south_from_lat
from app.tiles.roads import BUFFER, PIXEL
from app.tiles.vector_tile import EXTENT, TileLines, encode_areas, encode_points, encode_tile
from routing.ground.kinds import AREAS, Layer

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from numpy.typing import NDArray

    from app.tiles.address import TileAddress
    from app.tiles.vector_tile import AttributeValue
    from routing.ground.files import GroundFile, Shown

NAMES_FROM_ZOOM: Final = 10  # of water; places are always named
TOLERANCE: Final = PIXEL / 4.0
SMALLEST_AREA: Final = PIXEL * PIXEL  # of a ring that is drawn
MOST_PLACES: Final = 200  # a tile


class GroundTiles:
    """Ground layers of the vector tiles of one graph."""

    def __init__(self, ground: GroundFile) -> None:
        self._ground = ground

    def tile(self, address: TileAddress) -> bytes:
        """The layers of one tile that have anything, the lowest first, in O(shapes of the graph)."""
        box = address.bounds_deg(BUFFER / EXTENT)
        layers = []
        for layer in Layer:
            shown = self._ground.shown(layer, address.z, box)
            if not shown.kind:
                continue
            if layer is Layer.PLACE:
                layers.append(_places(shown, address))
            elif layer in AREAS:
                layers.append(_areas(layer, shown, address))
            else:
                layers.append(_lines(layer, shown, address))
        return b"".join(layers)


def _places(shown: Shown, address: TileAddress) -> bytes:
    """The places whose point is in the tile, the most important first."""
    points = np.floor(_in_tile(shown.shape, address)).astype(np.int64)
    inside = np.flatnonzero(np.all((points >= 0) & (points < EXTENT), axis=1))
    chosen = sorted(inside.tolist(), key=lambda k: shown.rank[k])[:MOST_PLACES]
    attributes = [{"class": shown.kind[k], "rank": shown.rank[k], **_named(shown.names[k])} for k in chosen]
    return encode_points(Layer.PLACE, points[chosen], attributes)


def _lines(layer: Layer, shown: Shown, address: TileAddress) -> bytes:
    """Waterways and borders, those with the same attributes as one line each."""
    attributes, group = _grouped(layer, shown, address.z)
    parts, of = shapely.get_parts(_simplified(shown.shape, address), return_index=True)
    coordinates, part = shapely.get_coordinates(parts, return_index=True)
    points, part = _without_repeats(np.rint(coordinates).astype(np.int64), part)
    return encode_tile(layer, _ordered(points, part, group[of], attributes, least=2))


def _areas(layer: Layer, shown: Shown, address: TileAddress) -> bytes:
    """Areas, those with the same attributes as one each."""
    attributes, group = _grouped(layer, shown, address.z)
    parts, of = shapely.get_parts(_simplified(shown.shape, address), return_index=True)
    kept = shapely.get_type_id(parts) == shapely.GeometryType.POLYGON
    parts, of = parts[kept], of[kept]
    kept = shapely.area(parts) >= SMALLEST_AREA
    # outer rings turn from x to y
    parts, of = shapely.orient_polygons(parts[kept]), of[kept]
    rings, of_part = shapely.get_rings(parts, return_index=True)
    kept = shapely.area(shapely.polygons(rings)) >= SMALLEST_AREA if rings.size else np.zeros(0, np.bool_)
    rings, of_part = rings[kept], of_part[kept]
    coordinates, ring = shapely.get_coordinates(rings, return_index=True)
    points, ring = _without_repeats(np.rint(coordinates).astype(np.int64), ring, closed=True)
    return encode_areas(layer, _ordered(points, ring, group[of[of_part]], attributes, least=3))


def _in_tile(shapes: NDArray[np.object_], address: TileAddress) -> NDArray[np.float64]:
    """All points of shapes in units of the tile."""
    return _units(shapely.get_coordinates(shapes), address)


def _units(lon_lat_deg: NDArray[np.float64], address: TileAddress) -> NDArray[np.float64]:
    scale = 2.0**address.z
    x = (east_from_lon(lon_lat_deg[:, 0]) * scale - address.x) * EXTENT
    y = (south_from_lat(lon_lat_deg[:, 1]) * scale - address.y) * EXTENT
    return np.column_stack((x, y))


def _simplified(shapes: NDArray[np.object_], address: TileAddress) -> NDArray[np.object_]:
    """Shapes in units of the tile, cut at its rim and simplified."""
    drawn = shapely.transform(shapes, lambda lon_lat_deg: _units(lon_lat_deg, address))
    cut = shapely.clip_by_rect(drawn, -BUFFER, -BUFFER, EXTENT + BUFFER, EXTENT + BUFFER)
    return np.asarray(shapely.simplify(cut, TOLERANCE, preserve_topology=False), np.object_)


def _grouped(layer: Layer, shown: Shown, zoom: int) -> tuple[list[dict[str, AttributeValue]], NDArray[np.int64]]:
    """The different attributes of a layer's shapes, and the number of those of each shape."""
    every: dict[tuple[tuple[str, AttributeValue], ...], int] = {}
    group = []
    for kind, names in zip(shown.kind, shown.names, strict=True):
        attributes: dict[str, AttributeValue] = (
            {"admin_level": int(kind)} if layer is Layer.BOUNDARY else {"class": kind}
        )
        if zoom >= NAMES_FROM_ZOOM and layer in (Layer.WATER, Layer.WATERWAY):
            attributes |= _named(names)
        group.append(every.setdefault(tuple(attributes.items()), len(every)))
    return [dict(items) for items in every], np.array(group, np.int64)


def _named(names: Mapping[str, str]) -> dict[str, AttributeValue]:
    return {f"name:{language}" if language else "name": name for language, name in names.items()}


def _without_repeats(
    points: NDArray[np.int64], part: NDArray[np.int64], *, closed: bool = False
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Points without those that repeat the one before, and of rings without the last, which is the first again."""
    begins = np.diff(part, prepend=-1) != 0
    kept = begins | np.any(np.diff(points, axis=0, prepend=0) != 0, axis=1)
    points, part = points[kept], part[kept]
    if closed and part.size:
        points, part = points[:-1][part[1:] == part[:-1]], part[:-1][part[1:] == part[:-1]]
    return points, part


def _ordered(
    points: NDArray[np.int64],
    part: NDArray[np.int64],
    group: NDArray[np.int64],
    attributes: Sequence[dict[str, AttributeValue]],
    least: int,
) -> TileLines:
    """Parts by the number of their attributes, without those of fewer points than that; group: of each part."""
    count = np.bincount(part, minlength=group.size)
    first = np.cumsum(count) - count
    order = np.argsort(group, kind="stable")
    order = order[count[order] >= least]
    kept_count = count[order]
    part_first = np.concatenate(([0], np.cumsum(kept_count)))
    at = np.arange(part_first[-1]) + np.repeat(first[order] - part_first[:-1], kept_count)
    used, line = np.unique(group[order], return_inverse=True)
    return TileLines(points[at], part_first, line, [attributes[k] for k in used.tolist()])
