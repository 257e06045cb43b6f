"""Diagnoses of a service of two processes: one queue among them."""

from __future__ import annotations

import os
import signal
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from energy.vehicle.files import load_vehicle
from energy.vehicle.vehicle import Vehicle
from tests.app.conftest import VEHICLES
from tests.app.recorded import write_winter
from tests.app.serving.supervised import Supervised, supervised, until

if TYPE_CHECKING:
    from collections.abc import Iterator
    from http.client import HTTPConnection

pytestmark = pytest.mark.skipif(not Path("/proc/self/smaps_rollup").exists(), reason="processes are looked at in /proc")
CAR = "hyundai-kona-64"
ORDER = {"recordings": ["*.csv"], "vehicle": CAR}


@pytest.fixture
def service(tmp_path: Path, own_graphs: Path) -> Iterator[Supervised]:
    car = load_vehicle(VEHICLES / f"{CAR}.toml")
    assert isinstance(car, Vehicle)
    write_winter(tmp_path / "recordings", car)
    recordings = str(tmp_path / "recordings")
    with supervised(
        tmp_path, own_graphs, JOULEPATH_RECORDINGS_DIR=recordings, JOULEPATH_DIAGNOSIS_QUEUE_LIMIT="2"
    ) as running:
        yield running


def states(service: Supervised, connection: HTTPConnection) -> dict[str, str]:
    _, listed = service.ask("GET", "/diagnoses", connection=connection)
    return {diagnosis["id"]: diagnosis["state"] for diagnosis in listed["diagnoses"]}


def begun(service: Supervised, connection: HTTPConnection) -> str:
    status, queued = service.ask("POST", "/diagnoses", ORDER, connection=connection)
    assert status == 202, queued
    return str(queued["id"])


def diagnosing(pid: int) -> list[str]:
    """Processes that diagnose for a worker."""
    children = [
        Path(f"/proc/{pid}/task/{task}/children").read_text().split() for task in os.listdir(f"/proc/{pid}/task")
    ]
    return [
        child for found in children for child in found if b"spawn_main" in Path(f"/proc/{child}/cmdline").read_bytes()
    ]


def test_diagnoses_of_all_workers_are_one_queue(service: Supervised, both: dict[int, HTTPConnection]) -> None:
    (here_pid, here), (there_pid, there) = both.items()
    first = begun(service, here)
    until("the first runs", lambda: states(service, there)[first] == "running")
    second = begun(service, there)
    for connection in (here, there):
        assert states(service, connection) == {first: "running", second: "queued"}
        status, problem = service.ask("POST", "/diagnoses", ORDER, connection=connection)
        assert (status, problem["code"]) == (429, "too_many_diagnoses")
    assert diagnosing(here_pid)
    assert not diagnosing(there_pid)
    assert service.ask("DELETE", f"/diagnoses/{first}", connection=there)[1]["state"] == "cancelled"
    until("the first stops", lambda: not diagnosing(here_pid))
    until("the second runs", lambda: states(service, here)[second] == "running")
    assert service.ask("DELETE", f"/diagnoses/{second}", connection=here)[1]["state"] == "cancelled"
    until("the second stops", lambda: not diagnosing(there_pid))


def test_queue_goes_on_when_the_worker_whose_turn_it_was_is_killed(
    service: Supervised, both: dict[int, HTTPConnection]
) -> None:
    (here_pid, here), (_, there) = both.items()
    first = begun(service, here)
    until("the first runs", lambda: states(service, there)[first] == "running")
    second = begun(service, there)
    os.kill(here_pid, signal.SIGKILL)
    until("the second runs", lambda: states(service, there)[second] == "running")
    assert states(service, there)[first] == "failed"
