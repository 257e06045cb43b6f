"""Graphs in memory that processes share."""

from __future__ import annotations

import gc
import mmap
import os
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pytest

from app.sharing.memory import can_share, share_graph, shared_graph
from routing.graph.ferries import Ferries
from routing.graph.files import load_graph
from routing.graph.road_graph import ARRAY_NAMES, Terrain
from tests.app.conftest import street_grid

if TYPE_CHECKING:
    from routing.graph.road_graph import RoadGraph

pytestmark = pytest.mark.skipif(not can_share(), reason="the system has no memory to share without a file")
ROOT = Path(__file__).resolve().parents[3]


def shared(graph: RoadGraph) -> RoadGraph:
    descriptor = share_graph(graph, "test")
    try:
        return shared_graph(descriptor)[0]
    finally:
        os.close(descriptor)


@pytest.mark.parametrize("name", ["grid", "coquimbo"])
def test_shared_graph_is_the_graph_with_arrays_that_nobody_can_change(name: str) -> None:
    graph = street_grid("grid", Terrain.SYNTHETIC) if name == "grid" else load_graph(ROOT / "data" / "graphs" / name)
    found = shared(graph)
    assert (found.meta, found.names) == (graph.meta, graph.names)
    for array_name in ARRAY_NAMES:
        array, expected = getattr(found, array_name), getattr(graph, array_name)
        assert array.dtype == expected.dtype
        assert np.array_equal(array, expected)
        assert array.flags.c_contiguous
        assert array.flags.aligned
        with pytest.raises(ValueError, match="WRITEABLE"):
            array.flags.writeable = True


def test_parts_that_not_every_graph_has_are_shared_too() -> None:
    graph = street_grid("grid", Terrain.SYNTHETIC)
    ferries = Ferries(np.array([0], np.int64), np.array([600.0]))
    found = shared(replace(graph, cut_node=np.array([2, 5], np.int32), ferries=ferries))
    assert found.cut_node is not None
    assert found.cut_node.tolist() == [2, 5]
    assert found.is_ferry().tolist() == [True] + [False] * (graph.link_count - 1)


def test_memory_can_be_neither_written_nor_cut_nor_grown() -> None:
    descriptor = share_graph(street_grid("grid", Terrain.SYNTHETIC), "test")
    size = os.fstat(descriptor).st_size
    try:
        for change in (
            lambda: os.pwrite(descriptor, b"x", 0),
            lambda: os.ftruncate(descriptor, 0),
            lambda: os.ftruncate(descriptor, 2 * size),
            lambda: mmap.mmap(descriptor, size),
        ):
            with pytest.raises(PermissionError):
                change()
    finally:
        os.close(descriptor)


def test_memory_goes_with_the_last_graph_on_it() -> None:
    found = shared(street_grid("grid", Terrain.SYNTHETIC))
    assert "/memfd:test" in Path("/proc/self/maps").read_text()
    del found
    gc.collect()
    assert "/memfd:test" not in Path("/proc/self/maps").read_text()
