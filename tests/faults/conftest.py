"""A service without graphs, on a database and a folder of recordings of its own."""

from __future__ import annotations

from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest
from starlette.testclient import TestClient

from app.main import create_app
from app.service.service import Service
from app.settings import Settings
from tests.app.expected import database_in

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from contextlib import AbstractContextManager

VEHICLES = Path(__file__).resolve().parents[2] / "data" / "vehicles"


@pytest.fixture
def recordings_dir(tmp_path: Path) -> Path:
    """A folder that requests may name recordings of: five long drives, and one that can't be read."""
    folder = tmp_path / "recordings"
    (folder / "long").mkdir(parents=True)
    for drive in range(5):
        rows = "".join(f"{k},{20 + (k * 7 + drive) % 60},{3000 + (k * 911) % 9000}\n" for k in range(30_000))
        (folder / "long" / f"{drive}.csv").write_text(f"time_s,speed_kmh,power_w\n{rows}", encoding="utf-8")
    (folder / "bad.csv").write_text("time_s,speed_kmh,power_w\n0,10,500\n1,ten,500\n2,11,500\n", encoding="utf-8")
    return folder


@pytest.fixture
def serving(tmp_path: Path, recordings_dir: Path) -> Callable[..., AbstractContextManager[TestClient]]:
    """Starts a service with settings of one's own, and gives its client."""

    @contextmanager
    def started(**changes: Any) -> Iterator[TestClient]:
        chosen = Settings(
            graph_dirs=(),
            vehicle_dir=VEHICLES,
            database_url=database_in(tmp_path),
            recordings_dir=recordings_dir,
            **changes,
        )
        with TestClient(create_app(chosen, Service(chosen, {}))) as client:
            yield client

    return started
