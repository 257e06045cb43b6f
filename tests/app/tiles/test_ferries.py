"""Tiles of a map with a ferry."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from app.tiles.address import TileAddress
from app.tiles.roads import RoadTiles
from app.tiles.shelf import tiles_digest
from routing.graph.ferries import Ferries
from tests.routing.drawn_streets import SOUTH, WEST, drawn_streets

# two shores of a kilometre each, 0.1° apart
PLACES = [(0, 0), (1, 0), (1, 10), (2, 10)]
LINKS = [(0, 1), (1, 0), (1, 2), (2, 1), (2, 3), (3, 2)]


def test_ferries_are_not_drawn_and_tiles_have_another_name_for_it() -> None:
    limits_mps, cross = np.full(len(LINKS), 50.0 / 3.6), np.zeros(len(LINKS), np.int64)
    road = drawn_streets("sound", PLACES, LINKS, [0.0] * 4, speed_limit_mps=limits_mps, cross=cross)
    aboard = np.flatnonzero(road.length_m > 5000.0)
    sound = replace(road, ferries=Ferries(aboard, np.full(2, 1800.0)))
    zoom = 13
    x = int((WEST + 0.01 + 180.0) / 360.0 * 2**zoom)
    y = int((1.0 - np.arcsinh(np.tan(np.radians(SOUTH + 0.05))) / np.pi) / 2.0 * 2**zoom)
    assert RoadTiles(road).tile(TileAddress(zoom, x, y)) != b""
    assert RoadTiles(sound).tile(TileAddress(zoom, x, y)) == b""
    assert tiles_digest(road) != tiles_digest(sound)
