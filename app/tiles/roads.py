"""The roads of a graph as vector tiles, each road drawn once and generalised for its zoom level."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np
import shapely

from app.tiles.address import east_from_lon, south_from_lat
from app.tiles.vector_tile import EXTENT, TileLines, encode_tile
from energy.stops import FunctionalClass
from routing.graph.earth import E7

if TYPE_CHECKING:
    from collections.abc import Mapping

    from numpy.typing import NDArray

    from app.tiles.address import TileAddress
    from app.tiles.vector_tile import AttributeValue
    from routing.graph.road_graph import RoadGraph

LAYER: Final = "roads"
CLASS_NAMES: Final = tuple(kind.name.lower() for kind in FunctionalClass)
MIN_ZOOM: Final = 0
MAX_ZOOM: Final = 14
BUFFER: Final = 64  # units beyond the edge, so that wide lines don't end at it
PIXEL: Final = EXTENT / 512.0  # web maps draw a vector tile 512 pixels wide at its own zoom

# the zoom level at which a class appears; set by eye, so that a region on one screen shows its network, not a blot
FIRST_ZOOM: Final[Mapping[FunctionalClass, int]] = {
    FunctionalClass.MOTORWAY: 0,
    FunctionalClass.TRUNK: 4,
    FunctionalClass.PRIMARY: 6,
    FunctionalClass.SECONDARY: 8,
    FunctionalClass.TERTIARY: 9,
    FunctionalClass.UNCLASSIFIED: 11,
    FunctionalClass.RESIDENTIAL: 12,
    FunctionalClass.SERVICE: 13,
}
# below these levels an attribute is left out, so that roads merge across its changes
NAMES_FROM_ZOOM: Final = 10
DETAILS_FROM_ZOOM: Final = 12


@dataclass(frozen=True, slots=True)
class _Merged:
    """Lines in tile units after merging: geometry, and for each the link that its attributes are read from."""

    lines: NDArray[np.object_]
    link_idx: NDArray[np.int64]


class RoadTiles:
    """Vector tiles of one graph; reads the graph, and keeps a box for each road."""

    def __init__(self, graph: RoadGraph) -> None:
        self._graph = graph
        one_way = (graph.reverse_idx < 0) | (np.arange(graph.link_count) < graph.reverse_idx)
        drawn = np.flatnonzero(one_way & ~graph.is_ferry() & ~graph.is_copy())
        self._link_idx = drawn[np.argsort(graph.functional_class[drawn], kind="stable")]
        self._class_end = np.searchsorted(
            graph.functional_class[self._link_idx], np.arange(len(FunctionalClass)), side="right"
        )
        first = graph.geometry_first[:-1]
        low_high = (np.minimum, np.maximum)
        self._lon_low_e7, self._lon_high_e7 = (
            f.reduceat(graph.geometry_lon_e7, first)[self._link_idx] for f in low_high
        )
        self._lat_low_e7, self._lat_high_e7 = (
            f.reduceat(graph.geometry_lat_e7, first)[self._link_idx] for f in low_high
        )

    def tile(self, address: TileAddress) -> bytes:
        """One tile as Mapbox Vector Tile 2.1, or no bytes where no road is drawn, in O(roads of its classes)."""
        link_idx = self._links_in(address)
        if link_idx.size == 0:
            return b""
        return encode_tile(LAYER, self._tile_lines(self._merged(link_idx, address), address.z))

    def _links_in(self, address: TileAddress) -> NDArray[np.int64]:
        """Links whose box meets the tile, of the classes that its zoom shows; the most important first."""
        shown = max(kind for kind, zoom in FIRST_ZOOM.items() if zoom <= address.z)
        end = self._class_end[shown]
        west, south, east, north = (E7 * edge for edge in address.bounds_deg(BUFFER / EXTENT))
        meets = (self._lon_high_e7[:end] >= west) & (self._lon_low_e7[:end] <= east)
        meets &= (self._lat_high_e7[:end] >= south) & (self._lat_low_e7[:end] <= north)
        return self._link_idx[:end][meets]

    def _merged(self, link_idx: NDArray[np.int64], address: TileAddress) -> _Merged:
        """Chains of links with the same attributes as one line each; a oneway keeps its direction."""
        lines = self._lines(link_idx, address)
        group = self._groups(link_idx, address.z)
        order = np.argsort(group, kind="stable")
        first = order[np.flatnonzero(np.diff(group[order], prepend=-1))]
        chains = np.asarray(shapely.multilinestrings(lines[order], indices=group[order]), np.object_)
        oneway = self._graph.reverse_idx[link_idx[first]] < 0
        chains[oneway] = shapely.line_merge(chains[oneway], directed=True)
        chains[~oneway] = shapely.line_merge(chains[~oneway])
        parts, of = shapely.get_parts(chains, return_index=True)
        return _Merged(parts, link_idx[first][of])

    def _lines(self, link_idx: NDArray[np.int64], address: TileAddress) -> NDArray[np.object_]:
        """Geometry of links in units of the tile."""
        graph = self._graph
        begin = graph.geometry_first[link_idx]
        count = graph.geometry_first[link_idx + 1] - begin
        line = np.repeat(np.arange(link_idx.size), count)
        point = np.arange(line.size) + np.repeat(begin - (np.cumsum(count) - count), count)
        scale = 2.0**address.z
        x = (east_from_lon(graph.geometry_lon_e7[point] / E7) * scale - address.x) * EXTENT
        y = (south_from_lat(graph.geometry_lat_e7[point] / E7) * scale - address.y) * EXTENT
        return np.asarray(shapely.linestrings(np.column_stack((x, y)), indices=line), np.object_)

    def _groups(self, link_idx: NDArray[np.int64], zoom: int) -> NDArray[np.int64]:
        """Number of the attributes that each link is drawn with, int64 (k,); the least important class first."""
        graph = self._graph
        columns = [-graph.functional_class[link_idx].astype(np.int64), graph.reverse_idx[link_idx] < 0]
        if zoom >= NAMES_FROM_ZOOM:
            columns.append(graph.name_idx[link_idx])
        if zoom >= DETAILS_FROM_ZOOM:
            columns += [self._speed_kmh(link_idx), graph.structure[link_idx]]
        _, group = np.unique(np.column_stack(columns), axis=0, return_inverse=True)
        return np.asarray(group, np.int64).ravel()

    def _speed_kmh(self, link_idx: NDArray[np.int64]) -> NDArray[np.int64]:
        return np.rint(self._graph.speed_limit_mps[link_idx] * 3.6).astype(np.int64)

    def _tile_lines(self, merged: _Merged, zoom: int) -> TileLines:
        """What is left of lines in a tile: cut, simplified and rounded, without what is too short to be seen."""
        inside, of = shapely.get_parts(
            shapely.clip_by_rect(merged.lines, -BUFFER, -BUFFER, EXTENT + BUFFER, EXTENT + BUFFER), return_index=True
        )
        # the last level is drawn larger on all closer ones
        tolerance = 1.0 if zoom == MAX_ZOOM else PIXEL / 4.0
        coordinates, part = shapely.get_coordinates(
            shapely.simplify(inside, tolerance, preserve_topology=False), return_index=True
        )
        points, part = _seen(np.rint(coordinates).astype(np.int64), part, zoom < DETAILS_FROM_ZOOM)
        used, part_first = np.unique(part, return_index=True)
        line, part_line = np.unique(of[used], return_inverse=True)
        attributes = self._attributes(merged.link_idx[line], zoom)
        return TileLines(points, np.append(part_first, part.size), part_line, attributes)

    def _attributes(self, link_idx: NDArray[np.int64], zoom: int) -> list[dict[str, AttributeValue]]:
        """What the lines that stand for links are drawn with."""
        graph = self._graph
        attributes: list[dict[str, AttributeValue]] = [
            {"class": CLASS_NAMES[kind]} for kind in graph.functional_class[link_idx].tolist()
        ]
        if zoom >= NAMES_FROM_ZOOM:
            for drawn, name_idx in zip(attributes, graph.name_idx[link_idx].tolist(), strict=True):
                if graph.names[name_idx]:
                    drawn["name"] = graph.names[name_idx]
        if zoom >= DETAILS_FROM_ZOOM:
            speeds, oneway = self._speed_kmh(link_idx).tolist(), (graph.reverse_idx[link_idx] < 0).tolist()
            structure = graph.structure[link_idx].tolist()
            for drawn, *details in zip(attributes, speeds, oneway, structure, strict=True):
                drawn.update(zip(("speed_kmh", "oneway", "structure"), details, strict=True))
        return attributes


def _seen(
    points: NDArray[np.int64], part: NDArray[np.int64], drop_small: bool
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Points without those that repeat the one before and without parts of one point, or smaller than half a pixel."""
    begins = np.diff(part, prepend=-1) != 0
    kept = begins | np.any(np.diff(points, axis=0, prepend=0) != 0, axis=1)
    points, part = points[kept], part[kept]
    if part.size == 0:
        return points, part
    first = np.flatnonzero(np.diff(part, prepend=-1))
    size = (np.maximum.reduceat(points, first) - np.minimum.reduceat(points, first)).max(axis=1)
    large = size >= PIXEL / 2.0 if drop_small else size > 0
    kept = np.repeat(large, np.diff(first, append=part.size))
    return points[kept], part[kept]
