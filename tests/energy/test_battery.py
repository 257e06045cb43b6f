"""State of charge along a chain: clamped when full, never when empty, and every joule accounted for."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from energy.battery import soc_along

pytestmark = pytest.mark.nojit


def test_soc_along_a_chain_falls_by_energy_over_capacity():
    # 1 kWh = 3.6 MJ: 0.9 MJ are a quarter
    soc, braked = soc_along(np.array([900_000.0, 1_800_000.0, -360_000.0]), 1.0, 1000.0)
    assert soc == pytest.approx([0.75, 0.25, 0.35])
    assert braked.tolist() == [0.0, 0.0, 0.0]


def test_soc_along_an_overfilling_descent_clamps_and_reports_the_surplus():
    # 0.95 + 0.1 = 1.05: 0.05 of 3.6 MJ are braked away; the next link starts from a full battery
    soc, braked = soc_along(np.array([-360_000.0, 720_000.0]), 0.95, 1000.0)
    assert soc == pytest.approx([1.0, 0.8])
    assert braked == pytest.approx([180_000.0, 0.0])


def test_soc_along_a_full_battery_stays_full_without_surplus():
    soc, braked = soc_along(np.array([0.0]), 1.0, 1000.0)
    assert soc.tolist() == [1.0]
    assert braked.tolist() == [0.0]


def test_soc_along_a_chain_that_needs_too_much_goes_below_zero():
    soc, braked = soc_along(np.array([5_400_000.0, -1_800_000.0]), 0.5, 1000.0)
    assert soc == pytest.approx([-1.0, -0.5])
    assert braked.tolist() == [0.0, 0.0]


@settings(max_examples=300, deadline=None)
@given(
    energy_j=st.lists(st.floats(-1e8, 1e8), max_size=30),
    start=st.floats(0.0, 1.0),
    capacity_wh=st.floats(100.0, 200_000.0),
)
def test_soc_along_any_chain_closes_the_energy_balance(energy_j, start, capacity_wh):
    soc, braked = soc_along(np.array(energy_j), start, capacity_wh)
    assert np.all(soc <= 1.0)
    assert np.all(braked >= 0.0)
    assert np.all(soc[braked > 0.0] == 1.0)
    before = np.concatenate(([start], soc))[:-1]
    # what left the battery is what the link took, plus what no longer fitted in
    released_j = (before - soc) * capacity_wh * 3600.0
    scale_j = capacity_wh * 3600.0 * (1.0 + np.max(np.abs(soc), initial=1.0)) + max(map(abs, energy_j), default=0.0)
    assert released_j == pytest.approx(np.array(energy_j) + braked, abs=1e-12 * scale_j)
    if energy_j:
        total_j = math.fsum(energy_j) + math.fsum(braked.tolist())
        assert (start - soc[-1]) * capacity_wh * 3600.0 == pytest.approx(total_j, abs=1e-10 * scale_j)
