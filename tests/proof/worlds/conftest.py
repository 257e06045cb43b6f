"""A straight flat road and one plain drive on it, so that what an effect does can be computed by hand."""

from __future__ import annotations

import platform
import sys
from typing import TYPE_CHECKING

import numpy as np
import pytest

from proof.worlds.car import Car, draw_car
from proof.worlds.dynamics import Chance, Circumstances, Strengths, WorldDrive, WorldWay, drive

if TYPE_CHECKING:
    from collections.abc import Callable

# pyproject.toml leaves fastsim out where it has no wheels
collect_ignore = ["test_fastsim_worlds.py"] if sys.platform == "linux" and platform.machine() != "x86_64" else []

STEP_S = 0.1


def demand_of(*legs: tuple[float, float]) -> np.ndarray:
    """Speeds from standstill: legs of (seconds, speed in m/s at their end), straight between."""
    times, speeds = [0.0], [0.0]
    for seconds, speed in legs:
        times.append(times[-1] + seconds)
        speeds.append(speed)
    return np.interp(np.arange(0.0, times[-1], STEP_S), times, speeds)


# 30 s standing, 20 s up to 20 m/s, 300 s of that, 20 s down, 40 s standing
STOP_AND_GO = demand_of((30.0, 0.0), (20.0, 20.0), (300.0, 20.0), (20.0, 0.0), (40.0, 0.0))


@pytest.fixture(scope="session")
def car() -> Car:
    return draw_car(np.random.default_rng(7))


@pytest.fixture(scope="session")
def day() -> Circumstances:
    """A day on which no effect has anything to act on: 21 °C everywhere, warm tyres, no wind, no load, no sun."""
    return Circumstances(
        air_c=21.0,
        air_rise_c_per_h=0.0,
        sun_w_per_m2=0.0,
        humidity=0.5,
        wind_mps=0.0,
        wind_from_rad=0.0,
        breeze_mps=0.0,
        breeze_from_rad=0.0,
        payload_kg=0.0,
        roof_box=0.0,
        road_load_factor=1.0,
        aux_offset_w=0.0,
        charge_start=0.8,
        cabin_start_c=21.0,
        furnishing_start_c=21.0,
        tyre_start_c=38.0,
        battery_start_c=21.0,
        begin_m=0.0,
        direction=1.0,
    )


@pytest.fixture(scope="session")
def go(car: Car, day: Circumstances) -> Callable[..., WorldDrive]:
    """Drive north on a road of one grade and height; keywords of Strengths, and of Circumstances as `on_day`."""

    def driven(
        *,
        grade: float = 0.0,
        height_m: float = 0.0,
        water: float = 0.0,
        demand: np.ndarray = STOP_AND_GO,
        on_day: dict[str, float] | None = None,
        **strengths: float,
    ) -> WorldDrive:
        nodes = 2000
        ones = np.ones(nodes)
        way = WorldWay(height_m * ones, grade * ones, 50.0 + 9e-5 * np.arange(nodes), 8.0 * ones, 0.0 * ones, ones)
        still = np.zeros(demand.size // 10 + 2)
        chance = Chance(still, still, still, still + water)
        return drive(car, Strengths(**strengths), day._replace(**(on_day or {})), way, chance, demand)

    return driven
