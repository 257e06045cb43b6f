"""What holds for every chain of links: conservation, monotony, invariance to how a road is cut into links."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from energy.chain.chain import Chain, LinkModel, StopRule, simulate_chain

MANY = settings(max_examples=200, deadline=None)


@st.composite
def chains(draw, *, max_grade=0.3):
    n = draw(st.integers(1, 10))

    def column(values):
        return np.array(draw(st.lists(values, min_size=n, max_size=n)), np.float64)

    return Chain(
        length_m=column(st.one_of(st.floats(0.1, 60.0), st.floats(60.0, 3000.0))),
        grade_frac=column(st.floats(-max_grade, max_grade)) if max_grade else np.zeros(n),
        speed_limit_mps=column(st.floats(1.0 / 3.6, 200.0 / 3.6)),
        stop_probability_frac=column(st.one_of(st.just(0.0), st.just(1.0), st.floats(0.0, 1.0))),
        stop_time_s=column(st.floats(0.0, 60.0)),
        stop_class=column(st.integers(0, 7)).astype(np.int8),
    )


rules = st.sampled_from(list(StopRule))
starts_mps = st.one_of(st.just(0.0), st.floats(0.0, 55.0))


def turnover_j(result):
    return sum(float(np.abs(link.parts_j).sum()) for link in result.links)


@MANY
@given(chain=chains(), rule=rules, start=starts_mps, arrive_stopped=st.booleans(), model=st.sampled_from(LinkModel))
def test_chain_of_any_valid_input_is_finite_and_adds_up(kona, chain, rule, start, arrive_stopped, model):
    result = simulate_chain(
        kona, chain, link_model=model, stop_rule=rule, start_speed_mps=start, arrive_stopped=arrive_stopped
    )
    assert np.isfinite((result.energy_j, result.duration_s, result.standstill_s, result.stop_count)).all()
    rounding_j = 1e-11 * turnover_j(result)
    assert result.parts.total_j() == pytest.approx(result.energy_j, abs=rounding_j)
    assert sum(link.energy_j for link in result.links) == pytest.approx(result.energy_j, abs=rounding_j)
    assert sum(link.duration_s for link in result.links) == pytest.approx(result.duration_s, rel=1e-12)
    assert result.distance_m == pytest.approx(float(chain.length_m.sum()), rel=1e-12)
    limits = [*chain.speed_limit_mps.tolist()]
    for link, here, following in zip(result.links, limits, [*limits[1:], np.inf], strict=True):
        assert link.parts_j.sum() == pytest.approx(link.energy_j, abs=rounding_j)
        assert 0.0 < link.speed_end_mps <= min(here, following) * (1.0 + 1e-12)
        assert 0.0 <= link.standstill_s <= link.duration_s


@MANY
@given(chain=chains(), rule=rules, start=starts_mps, arrive_stopped=st.booleans())
def test_integrated_chain_conserves_energy(kona, chain, rule, start, arrive_stopped):
    result = simulate_chain(kona, chain, stop_rule=rule, start_speed_mps=start, arrive_stopped=arrive_stopped)
    last = result.links[-1]
    climb_j = kona.mass_kg * 9.81 * float(chain.length_m @ chain.grade_frac)
    kinetic_m2 = (1.0 - last.stop_probability_frac) * last.speed_end_mps**2 - start**2
    stored_j = climb_j + 0.5 * kona.mass_kg * kona.rotating_mass_coef * kinetic_m2
    for alpha in (kona.recuperation_eff, 1.0, 1.0 / kona.drive_eff):
        assert result.energy_j >= alpha * stored_j - 1e-9 * turnover_j(result)


@MANY
@given(chain=chains(max_grade=0.0), rule=rules, more=st.floats(1.0, 2000.0))
def test_integrated_trip_on_the_flat_never_takes_less_with_more_mass(altered, kona, chain, rule, more):
    # from rest to rest the kinetic energy is given back at η_chg or saves drag at 1/η_dis, never more
    light = simulate_chain(kona, chain, stop_rule=rule)
    heavy = simulate_chain(altered(kona, mass_kg=kona.mass_kg + more), chain, stop_rule=rule)
    assert heavy.energy_j >= light.energy_j - 1e-9 * turnover_j(heavy)
    assert heavy.duration_s == light.duration_s


@MANY
@given(
    chain=chains(),
    rule=rules,
    model=st.sampled_from(LinkModel),
    change=st.sampled_from(
        [
            {"road_load_a_n": 150.0},
            {"road_load_b_n_per_mps": 0.0},
            {"road_load_c_n_per_mps2": 0.9},
            {"aux_power_w": 3000.0},
            {"drive_eff": 0.8, "aux_move_eff": 0.8},
        ]
    ),
)
def test_chain_energy_never_falls_with_more_load(altered, kona, chain, rule, model, change):
    less = simulate_chain(kona, chain, stop_rule=rule, link_model=model)
    more = simulate_chain(altered(kona, **change), chain, stop_rule=rule, link_model=model)
    assert more.energy_j >= less.energy_j - 1e-9 * turnover_j(more)
    assert more.duration_s == less.duration_s


@MANY
@given(
    before=st.floats(500.0, 2000.0),
    length=st.floats(1.0, 3000.0),
    share=st.floats(0.01, 0.99),
    limit=st.floats(2.0, 35.0),
    grade=st.floats(-0.1, 0.1),
    model=st.sampled_from(LinkModel),
)
def test_chain_with_a_cruise_divided_in_two_takes_the_same(
    kona, make_chain, before, length, share, limit, grade, model
):
    # 3000 m lead in and out, so that the link in the middle is driven at its limit
    def trip(lengths):
        chain = make_chain([3000.0, *lengths, 3000.0], limit, grade)
        return simulate_chain(kona, chain, link_model=model)

    whole, divided = trip([before + length]), trip([before, length * share, length * (1.0 - share)])
    assert whole.links[0].speed_end_mps == limit
    assert divided.energy_j == pytest.approx(whole.energy_j, abs=1e-10 * turnover_j(whole))
    assert divided.duration_s == pytest.approx(whole.duration_s, rel=1e-12)


@MANY
@given(chain=chains())
def test_kinematic_time_of_a_chain_is_never_below_the_printed(kona, chain):
    # (13) and (23) halve the time of every dynamic phase
    integrated = simulate_chain(kona, chain)
    printed = simulate_chain(kona, chain, link_model=LinkModel.PRINTED)
    assert printed.duration_s <= integrated.duration_s
    moving_s = integrated.duration_s - integrated.standstill_s
    assert printed.duration_s - printed.standstill_s >= 0.5 * moving_s * (1.0 - 1e-12)
    assert [link.speed_end_mps for link in printed.links] == [link.speed_end_mps for link in integrated.links]
