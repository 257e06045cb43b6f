"""What is kept of tiles, and the digest that names them."""

from __future__ import annotations

import threading
from dataclasses import fields, replace
from pathlib import Path

import numpy as np
import pytest

from app.tiles.cache import ENTRY_BYTES, TileCache
from app.tiles.shelf import SHOWN_ARRAYS, tiles_digest
from routing.graph.files import load_graph, save_graph
from routing.graph.road_graph import RoadGraph, Terrain
from tests.app.conftest import street_grid


class Maker:
    """Makes so many bytes, and counts how often."""

    def __init__(self, size: int) -> None:
        self.size = size
        self.calls = 0

    def __call__(self) -> bytes:
        self.calls += 1
        return b"x" * self.size


def room_for(size: int, tiles: int) -> TileCache:
    """A cache for so many tiles that have so many bytes in all."""
    return TileCache(size + tiles * ENTRY_BYTES)


def test_tile_that_is_kept_is_made_once() -> None:
    cache, maker = room_for(100, 1), Maker(10)
    assert [cache.get("a", maker) for _ in range(3)] == [b"x" * 10] * 3
    assert maker.calls == 1


def test_tile_least_recently_asked_for_is_dropped_first() -> None:
    cache = room_for(100, 2)
    makers = {key: Maker(40) for key in "abc"}
    for key in "abac":  # c does not fit beside a and b; b was asked for longest ago
        cache.get(key, makers[key])
    for key in "ca":
        cache.get(key, makers[key])
    assert {key: maker.calls for key, maker in makers.items()} == {"a": 1, "b": 1, "c": 1}
    cache.get("b", makers["b"])
    assert makers["b"].calls == 2


def test_tile_larger_than_the_cache_is_made_but_not_kept() -> None:
    cache, large, small = room_for(100, 1), Maker(101), Maker(60)
    assert len(cache.get("large", large)) == 101
    cache.get("large", large)
    assert large.calls == 2
    for _ in range(2):
        cache.get("small", small)
    assert small.calls == 1


def test_tile_that_two_threads_make_at_once_is_counted_once() -> None:
    cache, second = room_for(100, 2), Maker(40)
    both = threading.Barrier(2)

    def slow() -> bytes:
        both.wait(timeout=10)
        return b"x" * 60

    threads = [threading.Thread(target=cache.get, args=("a", slow)) for _ in range(2)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    for _ in range(2):
        cache.get("b", second)
    assert second.calls == 1


def test_tiles_of_no_bytes_are_dropped_too() -> None:
    cache, empty = room_for(0, 2), Maker(0)
    for key in "abca":
        cache.get(key, empty)
    assert empty.calls == 4


@pytest.fixture(scope="module")
def grid() -> RoadGraph:
    return street_grid("grid", Terrain.SYNTHETIC)


def test_digest_of_a_stored_graph_is_that_of_the_graph(grid: RoadGraph, tmp_path: Path) -> None:
    save_graph(grid, tmp_path / "grid")
    assert tiles_digest(load_graph(tmp_path / "grid")) == tiles_digest(grid)


@pytest.mark.parametrize("name", SHOWN_ARRAYS)
def test_digest_changes_with_every_array_that_tiles_show(grid: RoadGraph, name: str) -> None:
    changed = np.array(getattr(grid, name))
    changed[-1] = not changed[-1] if changed.dtype == bool else changed[-1] + 1
    assert tiles_digest(replace(grid, **{name: changed})) != tiles_digest(grid)


def test_digest_changes_with_a_name_and_with_the_attribution(grid: RoadGraph) -> None:
    renamed = replace(grid, names=("Another Street", *grid.names[1:]))
    credited = replace(grid, meta=replace(grid.meta, attribution="somebody"))
    assert len({tiles_digest(graph) for graph in (grid, renamed, credited)}) == 3


def test_digest_does_not_change_with_what_tiles_do_not_show(grid: RoadGraph) -> None:
    assert {field.name for field in fields(grid)} > set(SHOWN_ARRAYS)
    assert tiles_digest(replace(grid, urban=~grid.urban, way_id=grid.way_id + 1)) == tiles_digest(grid)
