"""The charging stations of a graph as points of vector tiles, fewer where many lie close together."""

from __future__ import annotations

import hashlib
from typing import TYPE_CHECKING, Final

import numpy as np

from app.tiles.address import east_from_lon, south_from_lat
from app.tiles.roads import MAX_ZOOM, PIXEL
from app.tiles.vector_tile import EXTENT, encode_points

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from app.tiles.address import TileAddress
    from app.tiles.vector_tile import AttributeValue
    from routing.stations.selection import StationIndex
    from routing.stations.station import Station

LAYER: Final = "stations"
CELL_PIXELS: Final = 16  # of which each shows its strongest station, below the closest level
CELL: Final = CELL_PIXELS * PIXEL
NAMES_FROM_ZOOM: Final = 10
MOST_POINTS: Final = 20_000  # of a tile of the closest level


class StationTiles:
    """Points of one graph's stations by tile; reads the index, and keeps a place of each."""

    def __init__(self, index: StationIndex) -> None:
        self._index = index
        self._east = east_from_lon(index.lon_deg)
        self._south = south_from_lat(np.clip(index.lat_deg, -85.0, 85.0))
        # the strongest first, then by id, so that the one that a cell shows is the same at every level
        self._order = np.argsort(-index.power_w, kind="stable")

    def tile(self, address: TileAddress) -> bytes:
        """The stations of one tile as a layer of a vector tile, or no bytes where there are none, in O(stations)."""
        scale = 2.0**address.z
        x = np.floor((self._east * scale - address.x) * EXTENT).astype(np.int64)
        y = np.floor((self._south * scale - address.y) * EXTENT).astype(np.int64)
        inside = (x >= 0) & (x < EXTENT) & (y >= 0) & (y < EXTENT)
        shown = self._order[inside[self._order]]
        if shown.size == 0:
            return b""
        count = np.ones(shown.size, np.int64)
        if address.z < MAX_ZOOM:
            cell = (x[shown] // CELL).astype(np.int64) * EXTENT + (y[shown] // CELL).astype(np.int64)
            _, first, count = np.unique(cell, return_index=True, return_counts=True)
            order = np.argsort(first)
            shown, count = shown[first[order]], count[order]
        shown, count = shown[:MOST_POINTS][::-1], count[:MOST_POINTS][::-1]  # the strongest is drawn last, on top
        return encode_points(LAYER, np.column_stack((x[shown], y[shown])), self._attributes(shown, count, address.z))

    def _attributes(
        self, shown: NDArray[np.int64], count: NDArray[np.int64], zoom: int
    ) -> list[dict[str, AttributeValue]]:
        every = self._index.stations.stations
        attributes: list[dict[str, AttributeValue]] = []
        for k, stands_for in zip(shown.tolist(), count.tolist(), strict=True):
            station = every[k]
            drawn: dict[str, AttributeValue] = {
                "id": station.id,
                "power_kw": round(float(self._index.power_w[k]) / 1000.0),
                "count": stands_for,
            }
            if zoom >= NAMES_FROM_ZOOM:
                drawn |= _details(station)
            attributes.append(drawn)
        return attributes

    def digest_into(self, digest: hashlib.blake2b) -> None:
        """Add all that tiles show of the stations to a digest; nothing where there are none."""
        for array in (self._index.lat_deg, self._index.lon_deg, self._index.power_w):
            digest.update(array.data)
        for station in self._index.stations.stations:
            digest.update(repr((station.id, sorted(_details(station).items()))).encode("utf-8", "replace"))


def _details(station: Station) -> dict[str, AttributeValue]:
    """What is shown of a station where names are."""
    details: dict[str, AttributeValue] = {}
    if station.name:
        details["name"] = station.name
    if station.operator or station.network:
        details["operator"] = station.operator or station.network
    if station.sockets:
        details["connectors"] = ",".join(dict.fromkeys(socket.connector.value for socket in station.sockets))
        details["sockets"] = sum(socket.count for socket in station.sockets)
    if station.operational is not None:
        details["operational"] = station.operational
    return details
