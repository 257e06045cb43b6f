"""A rest at a link's end: the vehicle stops for certain and for no time, whatever the rule."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from energy.chain.chain import DriveSettings, StopRule, simulate_chain
from energy.chain.kernels_chain import REST
from energy.chain.profile import chain_profile
from energy.chain.sampling import Sampling
from energy.chain.timestep import simulate_timestep
from energy.chain.uncertainty import chain_distribution

pytestmark = pytest.mark.nojit

RULES = list(StopRule)
CERTAIN_RULES = [StopRule.COUNTED, StopRule.NONE, StopRule.CROSSINGS]


@pytest.fixture(scope="module")
def chain(make_chain):
    """A kilometre up and down at 72 km/h, with a crossing in each half."""
    plain = make_chain(np.full(10, 100.0), 20.0, np.repeat([0.03, -0.02], 5))
    at_crossing = np.isin(np.arange(10), (2, 7))
    return dataclasses.replace(
        plain,
        stop_probability_frac=np.where(at_crossing, 0.5, 0.0),
        stop_time_s=np.where(at_crossing, 20.0, 0.0),
        stop_class=np.where(at_crossing, 7, 0).astype(np.int8),
    )


def resting_after(chain, link):
    """The same chain with a rest at a link's end."""
    there = np.arange(chain.length_m.size) == link
    return dataclasses.replace(
        chain,
        stop_probability_frac=np.where(there, 1.0, chain.stop_probability_frac),
        stop_time_s=np.where(there, 0.0, chain.stop_time_s),
        stop_class=np.where(there, REST, chain.stop_class).astype(np.int8),
    )


def part(chain, begin, end):
    return dataclasses.replace(
        chain, **{field.name: getattr(chain, field.name)[begin:end] for field in dataclasses.fields(chain)[:6]}
    )


@pytest.mark.parametrize("rule", [rule for rule in RULES if rule is not StopRule.COUNTED])
def test_chain_with_a_rest_is_two_chains_from_rest_to_rest(kona, chain, rule):
    whole = simulate_chain(kona, resting_after(chain, 4), stop_rule=rule)
    halves = [simulate_chain(kona, part(chain, *ends), stop_rule=rule) for ends in ((0, 5), (5, 10))]
    assert whole.energy_j == pytest.approx(sum(half.energy_j for half in halves), rel=1e-12)
    assert whole.duration_s == pytest.approx(sum(half.duration_s for half in halves), rel=1e-12)
    assert whole.links[4].stop_probability_frac == 1.0
    assert whole.links[4].standstill_s == 0.0


def test_rest_is_not_counted_as_a_stop_at_a_crossing(kona, chain):
    # the first of two requests stops and the second does not, with the rest in between as without
    for driven in (chain, resting_after(chain, 4)):
        links = simulate_chain(kona, driven, stop_rule=StopRule.COUNTED).links
        assert [links[k].stop_probability_frac for k in (2, 7)] == [1.0, 0.0]


@pytest.mark.parametrize("rule", CERTAIN_RULES)
def test_rest_holds_in_time_steps(kona, chain, rule):
    driven = simulate_timestep(kona, resting_after(chain, 4), stop_rule=rule)
    assert driven.links[4].speed_end_mps == 0.0
    assert driven.links[4].standstill_s == 0.0
    assert driven.duration_s > simulate_timestep(kona, chain, stop_rule=rule).duration_s + 5.0


@pytest.mark.parametrize("rule", CERTAIN_RULES)
def test_rest_is_drawn_in_the_profile_of_speed(kona, chain, rule):
    profile = chain_profile(kona, resting_after(chain, 4), stop_rule=rule)
    assert np.interp(500.0, profile.distance_m, profile.speed_mps) == pytest.approx(0.0, abs=1e-6)
    assert profile.time_s[-1] == pytest.approx(
        simulate_chain(kona, resting_after(chain, 4), stop_rule=rule).duration_s, rel=1e-9
    )


@pytest.mark.parametrize("rule", RULES)
def test_rest_holds_in_every_draw_of_the_uncertainty(kona, chain, rule):
    certain = dataclasses.replace(kona, sd={})
    found = chain_distribution(
        certain,
        resting_after(chain, 4),
        DriveSettings(stop_rule=rule),
        soc_start_frac=0.8,
        reserve_soc_frac=0.0,
        sampling=Sampling(samples=2, residual_sd_frac=0.0),
    )
    assert found.energy_p50_j == simulate_chain(certain, resting_after(chain, 4), stop_rule=rule).energy_j
