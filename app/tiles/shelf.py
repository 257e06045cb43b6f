"""The tiles of all graphs of a process."""

from __future__ import annotations

import gzip
import hashlib
import json
import logging
from threading import Lock
from typing import TYPE_CHECKING, Final

from app import VERSION
from app.tiles.cache import TileCache
from app.tiles.errors import HeightsAbsentError
from app.tiles.ground import GroundTiles
from app.tiles.heights import HeightTiles
from app.tiles.roads import RoadTiles
from app.tiles.stations import StationTiles
from routing.errors import GraphFormatError
from routing.graph.road_graph import Terrain, meta_fields
from routing.ground.files import open_ground
from routing.stations.files import NO_STATIONS
from routing.stations.selection import StationIndex

if TYPE_CHECKING:
    from collections.abc import Iterable

    from app.atlas import Atlas
    from app.caches import CacheFigures
    from app.tiles.address import TileAddress
    from routing.graph.road_graph import RoadGraph
    from routing.ground.files import GroundFile

LOG: Final = logging.getLogger(__name__)
CACHE_BYTES: Final = 64 * 1024 * 1024
DIGEST_BYTES: Final = 8
TILE_FORMAT: Final = 1  # to be counted up when the same graph is drawn otherwise: browsers keep tiles for a year
# what tiles show of a graph
SHOWN_ARRAYS: Final = (
    *("node_height_m", "tail", "head", "speed_limit_mps", "functional_class", "structure", "name_idx", "reverse_idx"),
    *("geometry_first", "geometry_lon_e7", "geometry_lat_e7"),
)


class GraphTiles:
    """Tiles of one graph, each made once while it is kept.

    digest: names the contents of all of them, in hexadecimal; it changes with what they show of the graph, its
    ground and its stations, and with the version of the program. heights: none where the graph has no terrain.
    """

    def __init__(
        self,
        graph: RoadGraph,
        cache: TileCache,
        stations: StationIndex | None = None,
        ground: GroundFile | None = None,
    ) -> None:
        self.graph, self.ground = graph, ground
        self.stations = stations if stations is not None else StationIndex(NO_STATIONS)
        self._stations = StationTiles(self.stations)
        self.digest = tiles_digest(graph, self._stations, ground)
        self._ground = None if ground is None else GroundTiles(ground)
        self._cache = cache
        self._roads = RoadTiles(graph)
        self.heights = None if graph.meta.terrain is Terrain.ABSENT else HeightTiles(graph)

    def roads_gzip(self, address: TileAddress) -> bytes:
        """Ground, roads and stations of one tile as a vector tile, packed by gzip; without any, that of no bytes."""

        def packed() -> bytes:
            ground = b"" if self._ground is None else self._ground.tile(address)
            layers = ground + self._roads.tile(address) + self._stations.tile(address)
            return gzip.compress(layers, compresslevel=6, mtime=0)

        return self._cache.get((self.digest, "roads", address), packed)

    def heights_png(self, address: TileAddress) -> bytes:
        """Heights of one tile as a terrarium picture.

        Raises HeightsAbsentError where the graph has none, and TileOutOfRangeError where the tile is finer than they.
        """
        heights = self.heights
        if heights is None:
            raise HeightsAbsentError(self.graph.meta.name)
        return self._cache.get((self.digest, "heights", address), lambda: heights.tile(address))


class TileShelf:
    """Tiles by graph name, in one cache."""

    def __init__(self, atlas: Atlas, cache_bytes: int = CACHE_BYTES) -> None:
        self._atlas = atlas
        self._cache = TileCache(cache_bytes)
        self._by_name: dict[str, GraphTiles] = {}
        self._lock = Lock()

    def cache_figures(self) -> dict[str, CacheFigures]:
        """What is kept of tiles."""
        return {"tiles": self._cache.figures()}

    def graph_tiles(self, name: str) -> GraphTiles:
        """The tiles of one graph; raises GraphNotFoundError, or GraphFormatError while loading the graph."""
        graph, stations = self._atlas.drawn(name)
        with self._lock:
            known = self._by_name.get(name)
            if known is None or known.graph is not graph or known.stations is not stations:
                ground = self._ground_of(name)
                known = self._by_name[name] = GraphTiles(graph, self._cache, stations, ground)
            return known

    def _ground_of(self, name: str) -> GroundFile | None:
        """The ground of a graph; none where it can't be read, since roads are more than nothing."""
        try:
            return open_ground(self._atlas.folder(name))
        except GraphFormatError as error:
            LOG.warning("%s; the map shows no ground", error)
            return None

    def forget(self, names: Iterable[str]) -> None:
        """Let go of what tiles of graphs need, which are made anew when they are asked for."""
        with self._lock:
            for name in names:
                self._by_name.pop(name, None)

    def warm_up(self, name: str) -> None:
        """Make what all tiles of a graph need, so that the first ones come at once: some 0.4 s."""
        tiles = self.graph_tiles(name)
        if tiles.heights is not None:
            tiles.heights.surface()


def tiles_digest(graph: RoadGraph, stations: StationTiles | None = None, ground: GroundFile | None = None) -> str:
    """A name for the contents of a graph's tiles.

    It reads all that tiles show: 0.1 s a million links from memory, once a process. Sizes and times of files would be
    quicker, but would name the same tiles otherwise on every host, and a sample would miss a corrected name.
    """
    digest = hashlib.blake2b(digest_size=DIGEST_BYTES)
    digest.update(json.dumps([VERSION, TILE_FORMAT, meta_fields(graph.meta), graph.names]).encode())
    for name in SHOWN_ARRAYS:
        digest.update(getattr(graph, name).data)
    if graph.copies is not None:  # which are not drawn
        digest.update(graph.copies.of.data)
    if graph.ferries is not None:  # neither
        digest.update(graph.ferries.link.data)
    if stations is not None:
        stations.digest_into(digest)
    if ground is not None:
        digest.update(ground.digest())
    return digest.hexdigest()
