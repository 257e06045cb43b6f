"""Charges at which it may pay to leave a station are the local minima of what a stop and the next one cost."""

from __future__ import annotations

import numpy as np
import pytest

from energy.charging.charge_time import charge_times
from energy.charging.charging import PowerCurve
from routing.charging.kernels_curves import Price, turning_charges
from tests.routing.charging.networks import drawn_power

CAPACITY_J = 2e8
STEPS = 20_001


def found_between(
    here: PowerCurve, there: PowerCurve, price: Price, other: Price, energy: float, low: float, high: float
) -> np.ndarray:
    curves = charge_times([here, there], CAPACITY_J).curves
    room = np.empty(48)
    return room[: turning_charges(curves, 0, price, 1, other, energy, low, high, room)]


def cost(here: PowerCurve, there: PowerCurve, price: Price, other: Price, energy: float, at: np.ndarray) -> np.ndarray:
    times = charge_times([here, there], CAPACITY_J)
    none = np.zeros(at.size)
    paid = price.a_second * times.seconds(0, none, at) + price.a_joule * CAPACITY_J * at
    return paid - other.a_second * times.seconds(1, none, at - energy) - other.a_joule * CAPACITY_J * (at - energy)


@pytest.mark.parametrize("seed", range(40))
def test_no_charge_of_a_dense_scan_costs_less_than_all_that_are_found(seed: int) -> None:
    rng = np.random.default_rng(seed)
    here, there = drawn_power(rng), drawn_power(rng)
    price = Price(float(rng.uniform(0.5, 2.0)), float(rng.choice([0.0, 1e-5])))
    other = Price(float(rng.uniform(0.5, 2.0)), float(rng.choice([0.0, 2e-5])))
    energy = float(rng.uniform(-0.2, 0.5))
    low = max(energy, 0.0) + float(rng.uniform(0.0, 0.2))
    high = min(low + float(rng.uniform(0.1, 0.5)), 1.0, 1.0 + energy)
    found = found_between(here, there, price, other, energy, low, high)
    scan = cost(here, there, price, other, energy, np.linspace(low, high, STEPS))
    best = min(float(scan[0]), *cost(here, there, price, other, energy, found).tolist(), float("inf"))
    assert best <= float(scan.min()) + 1e-6
    assert ((found > low) & (found <= high)).all()


def test_two_equal_powers_give_nothing_to_choose() -> None:
    level = PowerCurve(np.array([0.0, 1.0]), np.array([50e3, 50e3]))
    same = Price(1.0, 0.0)
    assert found_between(level, level, same, same, 0.3, 0.4, 0.8).size == 0


def test_a_faster_station_is_left_as_full_as_may_be_and_a_slower_one_at_once() -> None:
    fast = PowerCurve(np.array([0.0, 1.0]), np.array([100e3, 100e3]))
    slow = PowerCurve(np.array([0.0, 1.0]), np.array([50e3, 50e3]))
    same = Price(1.0, 0.0)
    assert found_between(fast, slow, same, same, 0.3, 0.4, 0.8).tolist() == [0.8]
    assert found_between(slow, fast, same, same, 0.3, 0.4, 0.8).size == 0


def test_a_sinking_and_a_level_power_are_left_where_they_cross() -> None:
    sinking = PowerCurve(np.array([0.0, 1.0]), np.array([100e3, 0.1]))
    level = PowerCurve(np.array([0.0, 1.0]), np.array([40e3, 40e3]))
    same = Price(1.0, 0.0)
    (at,) = found_between(sinking, level, same, same, 0.3, 0.4, 0.9)
    assert at == pytest.approx(0.6, abs=1e-6)
