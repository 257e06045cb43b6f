"""Journeys over drawn station graphs have the properties that every plan must have."""

from __future__ import annotations

import numpy as np
import pytest

from energy.charging.charging import PowerCurve
from tests.routing.charging.networks import CAPACITY_J, Network, unmet_properties

LEVEL = PowerCurve(np.array([0.0, 1.0]), np.array([100e3, 100e3]))
SINKING = PowerCurve(np.array([0.0, 1.0]), np.array([150e3, 10e3]))


@pytest.mark.parametrize("block", range(5))
def test_no_plan_breaks_a_rule_and_more_reserve_or_a_worse_station_is_never_faster(block: int) -> None:
    for seed in range(20 * block, 20 * block + 20):
        _, unmet = unmet_properties(seed)
        assert unmet == [], seed


def test_a_journey_within_the_charge_has_no_stop() -> None:
    steps = straight(2e5, (LEVEL,), start_soc=0.9).best()
    assert steps is not None
    assert [step.place for step in steps] == [0, 2]
    assert steps[-1].time_s == pytest.approx(2e5 / 25.0)


def test_the_last_stop_charges_what_the_goal_takes_and_no_more() -> None:
    steps = straight(3.2e5, (LEVEL,), start_soc=0.8).best()
    assert steps is not None
    assert [step.place for step in steps] == [0, 1, 2]
    assert steps[-1].charge_j == pytest.approx(0.1 * CAPACITY_J)


def test_power_that_sinks_with_charge_is_left_where_the_next_station_charges_as_fast() -> None:
    network = straight(6e5, (SINKING, SINKING), start_soc=1.0)
    steps = network.best()
    assert steps is not None
    assert [step.place for step in steps] == [0, 1, 2, 3]
    leaves, arrives = steps[2].depart_j, steps[2].charge_j
    # power is the same at both charges, or the least or the most that may be charged is reached
    same = leaves == pytest.approx(arrives, rel=1e-9)
    at_need = arrives == pytest.approx(network.arrive_soc * CAPACITY_J)
    at_cap = leaves == pytest.approx(network.max_soc * CAPACITY_J)
    assert same or at_need or at_cap


def straight(far_m: float, curves: tuple[PowerCurve, ...], start_soc: float) -> Network:
    """Stations at even distances along a level road."""
    along = np.linspace(0.0, far_m, len(curves) + 2)
    places = np.column_stack((along, np.zeros(along.size)))
    return Network(places, np.zeros(along.size), curves, start_soc, 0.1, 0.1, 0.9)
