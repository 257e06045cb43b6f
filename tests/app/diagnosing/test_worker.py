"""Tasks on their way to the process that carries them out."""

from __future__ import annotations

import pickle
from typing import TYPE_CHECKING

import pytest

from app.diagnosing.limits import JobLimits
from app.diagnosing.order import DiagnosisOrder
from app.diagnosing.worker import Task, portable
from energy.vehicle.files import load_vehicle
from energy.vehicle.vehicle import Vehicle
from tests.app.conftest import VEHICLES

if TYPE_CHECKING:
    from pathlib import Path


@pytest.mark.parametrize("car", ["hyundai-kona-64", "nissan-leaf"])
def test_task_with_a_vehicle_that_charges_comes_to_another_process_as_it_was(car: str, tmp_path: Path):
    vehicle = load_vehicle(VEHICLES / f"{car}.toml")
    assert isinstance(vehicle, Vehicle)
    assert vehicle.charging is not None
    task = Task(
        "20261130-1", DiagnosisOrder((), vehicle), tmp_path, JobLimits(memory_bytes=1, time_s=1.0, unpacked_bytes=1)
    )
    received = pickle.loads(pickle.dumps(portable(task)))
    assert received.order.vehicle.charging.connectors == vehicle.charging.connectors
    assert received.order.vehicle.charging.sources == dict(vehicle.charging.sources)
    assert received.order.vehicle.sources == dict(vehicle.sources)
