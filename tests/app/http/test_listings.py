"""GET /vehicles, /graphs, /healthz and /readyz; the last says whether the database answers, without waiting for it."""

from __future__ import annotations

import asyncio
import threading
import time
from typing import TYPE_CHECKING

import pytest
from starlette.testclient import TestClient

from app.http.readiness import KEPT_S, LIMIT_S, DatabaseProbe, Reachable
from app.main import create_app
from app.service.service import Service
from app.store.database import Database
from tests.apart import run_apart
from tests.app.expected import check_problem, database_in

if TYPE_CHECKING:
    from pathlib import Path

    from app.settings import Settings


def test_vehicles_are_listed_in_the_order_of_their_ids(client: TestClient) -> None:
    answer = client.get("/vehicles").json()
    ids = [vehicle["id"] for vehicle in answer["vehicles"]]
    assert ids == sorted(ids)
    assert [v["id"] for v in answer["vehicles"] if v["default"]] == [answer["default"]] == ["hyundai-kona-64"]


def test_vehicle_is_shown_in_human_units_with_a_source_for_each_number(client: TestClient) -> None:
    kona = client.get("/vehicles/hyundai-kona-64").json()
    assert kona["usable_capacity_kwh"] == 64
    # target coefficient A, 24.859 lbf, times 4.4482216 N/lbf
    assert kona["road_load"]["a_n"] == pytest.approx(110.578, abs=1e-3)
    assert kona["acceleration"]["speed_kmh"] == [10 * k for k in range(14)]
    leaves: set[str] = set()
    for field, value in kona.items():
        if field not in ("id", "kind", "name", "powertrain", "effects", "sources", "sd"):
            parts = value if isinstance(value, dict) else {}
            leaves |= {f"{field}.{part}" for part, leaf in parts.items() if leaf is not None} or {field}
    assert leaves <= set(kona["sources"])
    assert all(kona["sources"].values())


def test_graphs_are_listed_with_source_and_licence(client: TestClient) -> None:
    answer = client.get("/graphs").json()
    assert answer["default"] == "grid"
    assert [(g["name"], g["terrain"], g["default"]) for g in answer["graphs"]] == [
        ("grid", "synthetic", True),
        ("level", "absent", False),
    ]
    assert answer["graphs"][0]["licence"] == "CC0-1.0"


def test_graph_is_shown_with_its_extent(client: TestClient) -> None:
    grid = client.get("/graphs/grid").json()
    assert (grid["node_count"], grid["link_count"]) == (9, 24)
    assert (grid["height_min_m"], grid["height_max_m"]) == (500, 560)
    assert grid["bbox"] == [8.0, 46.5, 8.02, 46.52]
    lengths = {kind["functional_class"]: kind["length_km"] for kind in grid["road_classes"]}
    assert lengths["tertiary"] == pytest.approx(grid["length_km"])


def test_readyz_of_a_started_service_names_its_graphs(client: TestClient, service: Service) -> None:
    answer = client.get("/readyz").json()
    assert answer["status"] == "ready"
    assert answer["graphs"] == [
        {"name": name, "loaded": True, "version": service.atlas.version(name)} for name in ("grid", "level")
    ]
    assert answer["database"] == {"reachable": True, "reason": None}


class Silent(Database):
    """A database that does not answer until it is let, and counts how often it was asked."""

    def __init__(self, folder: Path) -> None:
        super().__init__(database_in(folder))
        self.answers = threading.Event()
        self.asked = 0

    def check(self) -> None:
        self.asked += 1
        self.answers.wait(30.0)
        super().check()


def test_readyz_names_what_keeps_the_database_from_being_read_and_is_ready_all_the_same(
    settings: Settings, service: Service, tmp_path: Path
) -> None:
    (tmp_path / "vehicles.sqlite").write_text("x" * 5000, encoding="utf-8")
    own = Service(settings.model_copy(update={"database_url": database_in(tmp_path)}))
    own.atlas = service.atlas
    with TestClient(create_app(own.settings, own)) as client:
        answer = client.get("/readyz")
        assert answer.status_code == 200
        assert answer.json()["database"] == {"reachable": False, "reason": "file is not a database"}
        assert client.get("/vehicles/vw-id4").status_code == 200


def test_readyz_names_graphs_that_are_not_loaded_yet(settings: Settings, tmp_path: Path) -> None:
    own = Service(settings.model_copy(update={"database_url": database_in(tmp_path)}))
    with TestClient(create_app(own.settings, own)) as client:
        problem = check_problem(client.get("/readyz"), 503, "not_ready")
        assert "graphs that are not loaded yet: grid, level" in problem["detail"]
        own.atlas.planner("grid")
        assert check_problem(client.get("/readyz"), 503, "not_ready")["detail"].startswith("graphs that are not loaded")
        own.atlas.planner("level")
        assert client.get("/readyz").json()["status"] == "ready"


def test_database_that_does_not_answer_is_asked_once_while_the_loop_goes_on(tmp_path: Path) -> None:
    database = Silent(tmp_path)

    async def ask() -> tuple[list[Reachable], int, Reachable, Reachable]:
        probe = DatabaseProbe(database)
        ticks = 0

        async def tick() -> None:
            nonlocal ticks
            while True:
                await asyncio.sleep(0.02)
                ticks += 1

        ticking = asyncio.create_task(tick())
        began = time.monotonic()
        silent = await asyncio.gather(*(probe.reachable() for _ in range(20)))
        assert time.monotonic() - began < LIMIT_S + 5.0
        asked_while_silent = database.asked
        database.answers.set()
        first = await probe.reachable()
        await asyncio.sleep(KEPT_S + 0.1)
        later = await probe.reachable()
        ticking.cancel()
        probe.close()
        assert ticks > 5
        return silent, asked_while_silent, first, later

    silent, asked_while_silent, first, later = run_apart(ask)
    assert silent == [Reachable(False, "no answer within 1 s")] * 20
    assert asked_while_silent == 1
    assert first == later == Reachable(True)
    assert database.asked == 2


def test_database_is_asked_at_most_once_a_second(tmp_path: Path) -> None:
    database = Silent(tmp_path)
    database.answers.set()

    async def ask() -> None:
        probe = DatabaseProbe(database)
        for _ in range(50):
            assert (await probe.reachable()).reachable
        probe.close()

    began = time.monotonic()
    run_apart(ask)
    assert database.asked <= 1 + (time.monotonic() - began) / KEPT_S
