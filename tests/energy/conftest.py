"""Vehicles and chains with round numbers, so that a test's expected value can be derived beside it by hand."""

from __future__ import annotations

import dataclasses
import math
from typing import TYPE_CHECKING

import numpy as np
import pytest

from energy.chain.chain import Chain
from energy.force.kernels_physics import LinkPhysics
from energy.units import KMH_PER_MPS
from energy.vehicle.vehicle import Vehicle
from tests.energy.loaded import Loaded, off

if TYPE_CHECKING:
    from collections.abc import Callable

NEWTON_PER_LBF = 4.4482216152605
MPS_PER_MPH = 0.44704


def running_sum(values: list[float]) -> np.ndarray:
    return np.concatenate(([0.0], np.cumsum(values)))


@pytest.fixture(scope="session")
def make_physics() -> Callable[..., Loaded]:
    """A factory; its defaults are the round vehicle of the hand-computed tests.

    A = 100 N, B = 0, C = 0.5 N/(m/s)², m·g = 9810 N, m·d = 1100 kg, η_dis = 0.8, η_chg = 0.5, 600 W moving,
    500 W standing. Intervals 0-10-20-30 m/s, accelerations 3, 2, 1 m/s², brakings 4, 3, 2 m/s².
    """

    def make(
        *, accel: tuple[float, ...] = (3.0, 2.0, 1.0), decel: tuple[float, ...] = (4.0, 3.0, 2.0), **changes: object
    ) -> Loaded:
        physics = LinkPhysics(
            weight_n=9810.0,
            inertia_kg=1100.0,
            drive_factor=1.25,
            recuperation_factor=0.5,
            aux_move_w=600.0,
            aux_idle_w=500.0,
            speed_bound_mps=np.arange(len(accel) + 1) * 10.0,
            accel_sum=running_sum(list(accel)),
            decel_sum=running_sum(list(decel)),
            printed=False,
            **off(),
        )
        return Loaded(physics)._replace(**changes)

    return make


@pytest.fixture(scope="session")
def round_vehicle() -> Vehicle:
    """The vehicle of make_physics' defaults, as the border takes it."""
    return Vehicle(
        id="round",
        name="Round numbers",
        mass_kg=1000.0,
        road_load_a_n=100.0,
        road_load_b_n_per_mps=0.0,
        road_load_c_n_per_mps2=0.5,
        drive_eff=0.8,
        recuperation_eff=0.5,
        aux_power_w=450.0,
        usable_capacity_wh=10_000.0,
        accel_speed_mps=np.array([0.0, 10.0, 20.0, 30.0]),
        accel_mps2=np.array([3.0, 2.0, 1.0]),
        decel_mps2=np.array([-4.0, -3.0, -2.0]),
        aux_move_eff=0.75,  # 450 W / 0.75 = 600 W
        aux_idle_eff=0.9,  # 450 W / 0.9 = 500 W
    )


@pytest.fixture(scope="session")
def kona() -> Vehicle:
    """Source, section III.A, with the EPA list's road load, whose B is negative; accelerations are assumed here."""
    return Vehicle(
        id="kona",
        name="Kona Electric 64 kWh",
        mass_kg=1810.0,
        road_load_a_n=24.859 * NEWTON_PER_LBF,
        road_load_b_n_per_mps=-0.20036 * NEWTON_PER_LBF / MPS_PER_MPH,
        road_load_c_n_per_mps2=0.023656 * NEWTON_PER_LBF / MPS_PER_MPH**2,
        drive_eff=0.92,
        recuperation_eff=0.63,
        aux_power_w=520.0,
        usable_capacity_wh=64_000.0,
        accel_speed_mps=np.arange(14) * 10.0 / KMH_PER_MPS,
        accel_mps2=np.linspace(1.4, 0.2, 13),
        decel_mps2=np.linspace(-1.0, -0.4, 13),
    )


@pytest.fixture(scope="session")
def make_chain() -> Callable[..., Chain]:
    """A factory: one value a link or one for all of them; flat and without stops by default."""

    def make(
        length_m: object,
        speed_limit_mps: object,
        grade_frac: object = 0.0,
        stop_probability_frac: object = 0.0,
        stop_time_s: object = 0.0,
        stop_class: object = 0,
    ) -> Chain:
        n = len(np.atleast_1d(np.asarray(length_m)))

        def column(values: object) -> np.ndarray:
            return np.array(np.broadcast_to(np.asarray(values, np.float64), (n,)))

        return Chain(
            length_m=column(length_m),
            grade_frac=column(grade_frac),
            speed_limit_mps=column(speed_limit_mps),
            stop_probability_frac=column(stop_probability_frac),
            stop_time_s=column(stop_time_s),
            stop_class=column(stop_class).astype(np.int8),
        )

    return make


@pytest.fixture(scope="session")
def altered() -> Callable[..., object]:
    """A copy of a frozen dataclass (vehicle, chain) with other values in some fields."""
    return dataclasses.replace


@pytest.fixture(scope="session")
def hilly(make_chain):
    """Sixty links of every kind, with altitude and heading, up and down again to the same height."""
    rng = np.random.default_rng(5)
    length = rng.uniform(5.0, 900.0, 60)
    grade = rng.uniform(-0.09, 0.09, 60)
    grade -= np.sum(grade * length) / np.sum(length)
    chain = make_chain(
        length,
        rng.choice([30.0, 50.0, 80.0, 130.0], 60) / 3.6,
        grade,
        rng.choice([0.0, 0.0, 0.1, 0.4, 1.0], 60),
        12.0,
        rng.integers(0, 8, 60),
    )
    bearing = rng.uniform(0.0, 2.0 * math.pi, 60)
    heading = np.column_stack((np.sin(bearing), np.cos(bearing)))
    return dataclasses.replace(chain, altitude_m=rng.uniform(0.0, 2400.0, 60), heading=heading)
