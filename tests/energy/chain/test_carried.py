"""A chain of links over some of which a ferry carries the vehicle."""

from __future__ import annotations

from dataclasses import fields, replace

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from energy.chain.chain import Chain, DriveSettings, StopRule, simulate_chain
from energy.chain.profile import chain_profile
from energy.chain.timestep import simulate_timestep
from energy.chain.uncertainty import chain_distribution
from energy.conditions import Conditions
from energy.errors import LinkError

CROSSING_S = 1800.0
COLD = Conditions(ambient_k=258.0)


def carried_over(chain: Chain, links: list[int]) -> Chain:
    seconds = np.zeros(chain.length_m.size)
    seconds[links] = CROSSING_S
    probability = np.where(seconds > 0.0, 0.0, chain.stop_probability_frac)
    return replace(
        chain, carried_s=seconds, stop_probability_frac=probability, grade_frac=chain.grade_frac * (seconds == 0.0)
    )


def part(chain: Chain, begin: int, end: int) -> Chain:
    columns = {f.name: getattr(chain, f.name) for f in fields(chain) if f.name != "carried_s"}
    return Chain(**{name: None if values is None else values[begin:end] for name, values in columns.items()})


@pytest.mark.nojit
def test_a_crossing_is_two_drives_from_rest_to_rest_and_a_pause_without_energy(round_vehicle, make_chain) -> None:
    chain = carried_over(make_chain([600.0, 400.0, 9000.0, 500.0], speed_limit_mps=[14.0, 20.0, 6.0, 14.0]), [2])
    driven = simulate_chain(round_vehicle, chain, stop_rule=StopRule.NONE)
    before = simulate_chain(round_vehicle, part(chain, 0, 2), stop_rule=StopRule.NONE)
    after = simulate_chain(round_vehicle, part(chain, 3, 4), stop_rule=StopRule.NONE)
    assert driven.links.energy_j.tolist() == [*before.links.energy_j.tolist(), 0.0, *after.links.energy_j.tolist()]
    assert driven.duration_s == before.duration_s + CROSSING_S + after.duration_s
    assert driven.links.speed_end_mps[1:3].tolist() == [0.0, 0.0]
    assert driven.links.parts_j[2].tolist() == [0.0] * driven.links.parts_j.shape[1]


@pytest.mark.nojit
def test_the_clock_of_the_cabin_stands_still_on_board(round_vehicle, make_chain) -> None:
    chain = make_chain([600.0, 9000.0, 500.0], speed_limit_mps=[14.0, 6.0, 14.0])
    chain = replace(chain, altitude_m=np.zeros(3), heading=np.zeros((3, 2)))
    short = carried_over(chain, [1])
    assert short.carried_s is not None
    long = replace(short, carried_s=short.carried_s * 10.0)
    for model in (simulate_chain, simulate_timestep):
        drives = [model(round_vehicle, way, conditions=COLD, stop_rule=StopRule.NONE) for way in (short, long)]
        assert drives[0].energy_j == drives[1].energy_j
        assert drives[1].duration_s - drives[0].duration_s == pytest.approx(9.0 * CROSSING_S)


@pytest.mark.nojit
def test_time_steps_and_profile_cross_as_the_fast_model_does(round_vehicle, make_chain) -> None:
    chain = carried_over(make_chain([900.0, 9000.0, 800.0], speed_limit_mps=[14.0, 6.0, 14.0]), [1])
    fast = simulate_chain(round_vehicle, chain, stop_rule=StopRule.NONE)
    stepped = simulate_timestep(round_vehicle, chain, stop_rule=StopRule.NONE, step_s=0.01, profile=True)
    assert stepped.links[1].energy_j == 0.0
    assert stepped.links[1].duration_s == CROSSING_S
    assert stepped.energy_j == pytest.approx(fast.energy_j, rel=0.05)
    assert stepped.duration_s == pytest.approx(fast.duration_s, rel=1e-2)
    drawn = chain_profile(round_vehicle, chain, stop_rule=StopRule.NONE)
    assert drawn.time_s[-1] == pytest.approx(fast.duration_s)
    assert stepped.profile is not None
    for profile in (drawn, stepped.profile):
        assert profile.distance_m[-1] == pytest.approx(10_700.0)
        aboard = np.flatnonzero(np.diff(profile.time_s) > 0.9 * CROSSING_S)
        assert aboard.size == 1
        assert profile.speed_mps[aboard[0] : aboard[0] + 2].tolist() == pytest.approx([0.0, 0.0], abs=1e-6)
        assert np.diff(profile.distance_m)[aboard[0]] == pytest.approx(9000.0)


def test_what_is_uncertain_does_not_go_on_on_board(round_vehicle, make_chain) -> None:
    chain = carried_over(make_chain([900.0, 9000.0, 800.0], speed_limit_mps=[14.0, 6.0, 14.0]), [1])
    spread = chain_distribution(
        round_vehicle, chain, DriveSettings(), soc_start_frac=0.9, reserve_soc_frac=0.1, along=True
    )
    assert spread.soc_p10_frac is not None
    assert spread.soc_p10_frac[1] == spread.soc_p10_frac[0]


@settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.data())
def test_charge_and_energy_are_kept_over_any_crossing(kona, make_chain, data) -> None:
    n = data.draw(st.integers(2, 8))
    column = lambda low, high: [data.draw(st.floats(low, high)) for _ in range(n)]  # noqa: E731
    chain = make_chain(column(5.0, 2000.0), grade_frac=column(-0.08, 0.08), speed_limit_mps=column(3.0, 33.0))
    links = data.draw(st.lists(st.integers(0, n - 1), min_size=1, unique=True))
    driven = simulate_chain(kona, carried_over(chain, links), stop_rule=data.draw(st.sampled_from(list(StopRule))))
    assert driven.links.energy_j[links].tolist() == [0.0] * len(links)
    assert driven.links.duration_s[links].tolist() == [CROSSING_S] * len(links)
    assert not driven.links.speed_end_mps[[k - 1 for k in links if k > 0]].any()
    assert driven.parts.total_j() == pytest.approx(driven.energy_j, rel=1e-9, abs=1e-6)


@pytest.mark.parametrize("carried_s", [np.array([np.nan, 0.0]), np.zeros(3)])
def test_a_time_on_board_that_is_no_number_or_of_another_shape_is_refused(round_vehicle, make_chain, carried_s) -> None:
    chain = replace(make_chain([600.0, 400.0], 14.0), carried_s=carried_s)
    with pytest.raises(LinkError, match="carried_s"):
        simulate_chain(round_vehicle, chain)
