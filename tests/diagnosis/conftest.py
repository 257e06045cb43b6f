"""Trips with round numbers, so that a test's expected value can be derived beside it by hand."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from diagnosis.comparison.trips import TripRecord
from energy.vehicle.files import load_vehicle
from energy.vehicle.vehicle import Vehicle

if TYPE_CHECKING:
    from collections.abc import Callable

J_PER_KWH = 3.6e6


@pytest.fixture(scope="session")
def make_trip() -> Callable[..., TripRecord]:
    """A factory in the units of a trip table; by default 10 km in 1000 s with 10 stops, 100 s standing and 2 kWh."""

    def make(
        trip: str,
        series: str = "measured",
        *,
        kind: str = "urban",
        km: float = 10.0,
        seconds: float = 1000.0,
        stops: float = 10.0,
        standstill: float = 100.0,
        kwh: float = 2.0,
        mass: float | None = None,
    ) -> TripRecord:
        return TripRecord(trip, kind, series, km * 1000.0, seconds, stops, standstill, kwh * J_PER_KWH, mass)

    return make


@pytest.fixture(scope="session")
def kona() -> Vehicle:
    """The source's car as bundled."""
    vehicle = load_vehicle(Path(__file__).resolve().parents[2] / "data" / "vehicles" / "hyundai-kona-64.toml")
    assert isinstance(vehicle, Vehicle)
    return vehicle
