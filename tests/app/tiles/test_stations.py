"""Stations as points of tiles: each at its place, the strongest of those close together."""

from __future__ import annotations

import hashlib

import numpy as np
import pytest

from app.tiles.address import TileAddress, east_from_lon, south_from_lat
from app.tiles.stations import CELL, LAYER, StationTiles
from app.tiles.vector_tile import EXTENT
from energy.charging.charging import Connector
from routing.places import Point
from routing.stations.selection import StationIndex
from routing.stations.station import Socket, Station, Stations
from tests.app.tiles.tile_reader import Feature, read_tile

MUNICH = Point(48.137, 11.575)


def drawn(*rows: tuple[str, float, float, float]) -> StationTiles:
    """Stations by id, latitude, longitude and kilowatts."""
    stations = tuple(
        Station(key, Point(lat, lon), (Socket(Connector.CCS2, 1000.0 * kw),) if kw else (), name=f"Station {key}")
        for key, lat, lon, kw in rows
    )
    return StationTiles(StationIndex(Stations(stations, ())))


def holding(place: Point, zoom: int) -> TileAddress:
    east = float(east_from_lon(np.array([place.lon_deg]))[0])
    south = float(south_from_lat(np.array([place.lat_deg]))[0])
    return TileAddress(zoom, int(east * 2**zoom), int(south * 2**zoom))


def features(tiles: StationTiles, address: TileAddress) -> list[Feature]:
    content = tiles.tile(address)
    if not content:
        return []
    (layer,) = read_tile(content)
    assert (layer.name, layer.version, layer.extent) == (LAYER, 2, EXTENT)
    return layer.features


@pytest.mark.parametrize("zoom", [0, 5, 10, 14])
def test_a_station_is_drawn_at_its_place(zoom: int) -> None:
    address = holding(MUNICH, zoom)
    (found,) = features(drawn(("a", MUNICH.lat_deg, MUNICH.lon_deg, 150.0)), address)
    x, y = found.point
    east = float(east_from_lon(np.array([MUNICH.lon_deg]))[0]) * 2**zoom - address.x
    south = float(south_from_lat(np.array([MUNICH.lat_deg]))[0]) * 2**zoom - address.y
    assert (x, y) == (int(east * EXTENT), int(south * EXTENT))
    assert (found.attributes["id"], found.attributes["power_kw"], found.attributes["count"]) == ("a", 150, 1)
    assert ("name" in found.attributes) == (zoom >= 10)


def test_a_station_is_in_one_tile_of_a_level() -> None:
    rng = np.random.default_rng(3)
    rows = [
        (str(k), *place, 22.0) for k, place in enumerate(rng.uniform((47.9, 11.3), (48.3, 11.9), (200, 2)).tolist())
    ]
    tiles, address = drawn(*rows), holding(MUNICH, 9)
    seen: list[str] = []
    for x in range(address.x * 32, (address.x + 2) * 32):
        for y in range((address.y - 1) * 32, (address.y + 2) * 32):
            seen += [str(found.attributes["id"]) for found in features(tiles, TileAddress(14, x, y))]
    assert len(seen) == len(set(seen)) > 100


def test_of_stations_close_together_the_strongest_is_drawn_with_their_number() -> None:
    step = 360.0 / 2**8 / EXTENT * CELL / 20.0
    middle = Point(48.0, 11.26)
    rows = [(f"{k}", middle.lat_deg, middle.lon_deg + k * step, kw) for k, kw in enumerate((22.0, 300.0, 0.0, 50.0))]
    found = features(drawn(*rows), holding(middle, 8))
    assert sum(int(str(feature.attributes["count"])) for feature in found) == 4
    assert len(found) <= 2
    assert found[-1].attributes["id"] == "1"  # drawn last: on top
    for key, lat, lon, _ in rows:  # at the closest level each is drawn
        closest = features(drawn(*rows), holding(Point(lat, lon), 14))
        assert key in {feature.attributes["id"] for feature in closest}
        assert {feature.attributes["count"] for feature in closest} == {1}


def test_a_tile_of_many_stations_stays_small() -> None:
    rng = np.random.default_rng(4)
    rows = [(f"{k}", *place, 22.0) for k, place in enumerate(rng.uniform((36, -10), (70, 30), (20_000, 2)).tolist())]
    found = features(drawn(*rows), TileAddress(0, 0, 0))
    assert sum(int(str(feature.attributes["count"])) for feature in found) == 20_000
    assert len(found) <= (EXTENT / CELL) ** 2


def test_tiles_of_no_stations_are_empty() -> None:
    assert drawn().tile(TileAddress(0, 0, 0)) == b""
    assert drawn(("a", 48.0, 11.0, 22.0)).tile(TileAddress(10, 0, 0)) == b""


def test_the_digest_changes_with_what_is_shown() -> None:
    def digest(*rows: tuple[str, float, float, float]) -> str:
        found = hashlib.blake2b()
        drawn(*rows).digest_into(found)
        return found.hexdigest()

    first = ("a", 48.0, 11.0, 22.0)
    others = [("b", 48.0, 11.0, 22.0), ("a", 48.1, 11.0, 22.0), ("a", 48.0, 11.0, 50.0)]
    assert digest(first) == digest(first)
    assert len({digest(), digest(first), *(digest(other) for other in others)}) == 5
