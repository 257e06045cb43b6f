"""The source's car."""

from __future__ import annotations

from pathlib import Path

import pytest

from energy.vehicle.files import load_vehicle
from energy.vehicle.vehicle import Vehicle


@pytest.fixture(scope="session")
def kona() -> Vehicle:
    """The source's car as bundled."""
    vehicle = load_vehicle(Path(__file__).resolve().parents[2] / "data" / "vehicles" / "hyundai-kona-64.toml")
    assert isinstance(vehicle, Vehicle)
    return vehicle
