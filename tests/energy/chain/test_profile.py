"""Speed profiles: the drawn drive is the simulated one."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from energy.chain.chain import LinkModel, StopRule, simulate_chain
from energy.chain.profile import RAMP_STEP_MPS, chain_profile, thinned
from energy.chain.timestep import CERTAIN_RULES, simulate_timestep
from energy.errors import LinkError
from energy.stops import Cross
from energy.vehicle.consumption_table import ConsumptionTableVehicle


@pytest.fixture(scope="module")
def town(make_chain):
    """Links too short for their limits, a stop after every third, hills."""
    n = 40
    rng = np.random.default_rng(4)
    return make_chain(
        rng.uniform(5.0, 600.0, n),
        rng.choice([30.0, 50.0, 80.0], n) / 3.6,
        rng.uniform(-0.05, 0.05, n),
        [0.4 if k % 3 == 2 else 0.0 for k in range(n)],
        12.0,
        [int(Cross.LARGE) if k % 3 == 2 else 0 for k in range(n)],
    )


@pytest.mark.nojit
def test_ramp_is_drawn_by_points_that_lie_on_it(round_vehicle, make_chain):
    # 0 → 10 m/s at 3 m/s²: v² = 6·s, v = 3·t
    profile = chain_profile(round_vehicle, make_chain([200.0], 10.0), arrive_stopped=False)
    ramp = profile.distance_m < 100.0 / 6.0
    assert np.count_nonzero(ramp) == 10.0 / RAMP_STEP_MPS
    assert profile.speed_mps[ramp] ** 2 == pytest.approx(6.0 * profile.distance_m[ramp])
    assert profile.speed_mps[ramp] == pytest.approx(3.0 * profile.time_s[ramp])
    assert profile.speed_mps[-1] == 10.0


@pytest.mark.parametrize("rule", CERTAIN_RULES)
@pytest.mark.parametrize("model", LinkModel)
@pytest.mark.parametrize("arrive_stopped", [True, False])
def test_profile_of_the_fast_model_ends_at_its_distance_and_duration(kona, town, rule, model, arrive_stopped):
    asked = {"link_model": model, "stop_rule": rule, "arrive_stopped": arrive_stopped, "start_speed_mps": 5.0}
    profile = chain_profile(kona, town, **asked)
    result = simulate_chain(kona, town, **asked)
    assert profile.stop_rule is rule
    assert profile.distance_m[-1] == pytest.approx(result.distance_m)
    assert profile.time_s[-1] == pytest.approx(result.duration_s)
    assert_drawable(profile)
    ends = np.interp(np.cumsum(town.length_m), profile.distance_m, profile.speed_mps)
    for drawn, link in zip(ends[:-1], result.links[:-1], strict=True):
        expected = 0.0 if link.stop_probability_frac else link.speed_end_mps
        assert drawn == pytest.approx(expected, abs=1e-6)


@pytest.mark.nojit
def test_profile_under_expected_draws_counted_and_says_so(round_vehicle, make_chain):
    chain = make_chain([300.0, 300.0], 10.0, 0.0, 0.5, 8.0, int(Cross.LARGE))
    profile = chain_profile(round_vehicle, chain)
    assert profile.stop_rule is StopRule.COUNTED
    counted = simulate_chain(round_vehicle, chain, stop_rule=StopRule.COUNTED)
    assert profile.time_s[-1] == pytest.approx(counted.duration_s)


def test_profile_of_time_steps_keeps_every_corner_of_the_track(kona, town):
    result = simulate_timestep(kona, town, profile=True)
    profile = result.profile
    assert profile.stop_rule is StopRule.CROSSINGS
    assert_drawable(profile)
    assert profile.distance_m.size < 0.5 * result.step_count
    fine = simulate_timestep(kona, town, profile=True, step_s=0.02).profile
    seconds = np.linspace(0.0, result.duration_s, 5000)
    drawn, exact = (np.interp(seconds, p.time_s, p.speed_mps) for p in (profile, fine))
    assert np.sqrt(np.mean((drawn - exact) ** 2)) < 0.1
    moved = np.sum(0.5 * (profile.speed_mps[1:] + profile.speed_mps[:-1]) * np.diff(profile.time_s))
    assert moved == pytest.approx(result.distance_m, rel=1e-4)


@pytest.mark.nojit
def test_thinned_cruise_has_two_points_and_a_wait_both_its_ends():
    moving = np.column_stack((np.arange(11) * 2.0, np.arange(11) * 0.1, np.full(11, 20.0)))
    assert thinned(moving, StopRule.NONE).distance_m.tolist() == [0.0, 20.0]
    waiting = np.array([[0.0, 0.0, 0.0], [0.0, 8.0, 0.0], [0.01, 8.1, 0.2], [0.04, 8.2, 0.4]])
    assert thinned(waiting, StopRule.NONE).time_s.tolist() == [0.0, 8.0, 8.2]


@pytest.mark.nojit
def test_profile_of_a_consumption_table_changes_speed_at_once(make_chain):
    table = ConsumptionTableVehicle(
        id="table",
        name="A table",
        speed_mps=np.array([5.0, 30.0]),
        consumption_j_per_m=np.array([400.0, 700.0]),
        ascent_j_per_m=20_000.0,
        descent_j_per_m=10_000.0,
        aux_power_w=500.0,
        usable_capacity_wh=40_000.0,
    )
    chain = make_chain([100.0, 100.0], [10.0, 20.0], 0.0, [1.0, 0.0], 5.0, int(Cross.LARGE))
    profile = chain_profile(table, chain, stop_rule=StopRule.CROSSINGS)
    assert profile.speed_mps.tolist() == [0.0, 10.0, 10.0, 0.0, 0.0, 20.0, 20.0, 0.0]
    assert profile.time_s[-1] == pytest.approx(
        simulate_chain(table, chain, stop_rule=StopRule.CROSSINGS).duration_s, rel=1e-12
    )


@pytest.mark.nojit
def test_profile_of_a_link_that_cannot_be_driven_is_refused(round_vehicle, make_chain):
    with pytest.raises(LinkError, match="length_m"):
        chain_profile(round_vehicle, make_chain([0.0], 10.0))


def assert_drawable(profile):
    for column in (profile.distance_m, profile.time_s, profile.speed_mps):
        assert column.dtype == np.float64
        assert np.isfinite(column).all()
        assert (column >= 0.0).all()
    assert profile.distance_m.size == profile.time_s.size == profile.speed_mps.size
    assert (np.diff(profile.distance_m) >= 0.0).all()
    assert (np.diff(profile.time_s) >= 0.0).all()
    assert {f.name for f in dataclasses.fields(profile)} == {"distance_m", "time_s", "speed_mps", "stop_rule"}
