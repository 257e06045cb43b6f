"""A service of two processes, each on its own or shared by tests that leave it as it was."""

from __future__ import annotations

import os
from contextlib import ExitStack
from http.client import HTTPConnection
from typing import TYPE_CHECKING

import pytest

from routing.graph.files import save_graph
from routing.graph.road_graph import Terrain
from tests.app.conftest import street_grid
from tests.app.server_process import PATIENCE_S
from tests.app.serving.supervised import WORKERS, Supervised, supervised

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


@pytest.fixture
def both(service: Supervised) -> Iterator[dict[int, HTTPConnection]]:
    """A connection to each worker, by its process."""
    with ExitStack() as opened:
        found: dict[int, HTTPConnection] = {}
        for _ in range(16):
            before = {pid: len(os.listdir(f"/proc/{pid}/fd")) for pid in service.all_workers()}
            connection = HTTPConnection("127.0.0.1", service.server.port, timeout=PATIENCE_S)
            opened.callback(connection.close)
            connection.connect()
            service.ask("GET", "/healthz", connection=connection)
            for pid, count in before.items():
                if len(os.listdir(f"/proc/{pid}/fd")) > count:
                    found.setdefault(pid, connection)
            if len(found) == WORKERS:
                break
        assert len(found) == WORKERS
        yield found
