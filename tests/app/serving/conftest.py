"""A service of two processes, each on its own or shared by tests that leave it as it was."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from routing.graph.files import save_graph
from routing.graph.road_graph import Terrain
from tests.app.conftest import street_grid
from tests.app.serving.supervised import Supervised, supervised

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path


@pytest.fixture(scope="module")
def own_graphs(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("graphs")
    save_graph(street_grid("grid", Terrain.SYNTHETIC), folder / "grid")
    return folder


@pytest.fixture(scope="module")
def running(tmp_path_factory: pytest.TempPathFactory, own_graphs: Path) -> Iterator[Supervised]:
    with supervised(tmp_path_factory.mktemp("service"), own_graphs) as service:
        yield service
