"""What holds for every link: energy is conserved, parts and phases add up, and more load never takes less."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from energy.force.kernels_parts import PART_COUNT
from energy.force.kernels_physics import LinkPhysics
from tests.energy.loaded import Loaded, add_link_parts, link_energy, off, plan_link

MANY = settings(max_examples=300, deadline=None)
KMH = 1.0 / 3.6

speeds_mps = st.floats(1.0 * KMH, 200.0 * KMH)
entries_mps = st.one_of(st.just(0.0), speeds_mps)
lengths_m = st.one_of(st.floats(0.1, 60.0), st.floats(60.0, 5000.0))
grades = st.floats(-0.3, 0.3)
chances = st.one_of(st.just(0.0), st.just(1.0), st.floats(0.0, 1.0))


either_model = st.booleans()
integrated_only = st.just(False)


@st.composite
def vehicles(draw, *, printed=either_model):
    """Any vehicle whose road load is nowhere negative, not even on a slope of 0.3 (cosθ = 0.954)."""
    count = draw(st.integers(1, 13))
    bound = np.concatenate(([0.0], np.cumsum(draw(st.lists(st.floats(1.0, 8.0), min_size=count, max_size=count)))))
    accel = draw(st.lists(st.floats(0.1, 5.0), min_size=count, max_size=count))
    decel = draw(st.lists(st.floats(0.1, 8.0), min_size=count, max_size=count))
    rolling = draw(st.floats(0.0, 800.0))
    aero = draw(st.one_of(st.just(0.0), st.floats(0.01, 2.0)))
    linear = draw(st.one_of(st.just(0.0), st.floats(-2.0 * math.sqrt(0.95 * rolling * aero), 30.0)))
    mass = draw(st.floats(300.0, 5000.0))
    drive_eff = draw(st.floats(0.3, 1.0))
    physics = LinkPhysics(
        weight_n=mass * 9.81,
        inertia_kg=mass * draw(st.floats(1.0, 1.3)),
        drive_factor=1.0 / drive_eff,
        recuperation_factor=draw(st.floats(0.0, 1.0)),
        aux_move_w=draw(st.floats(0.0, 5000.0)),
        aux_idle_w=draw(st.floats(0.0, 5000.0)),
        speed_bound_mps=bound,
        accel_sum=np.concatenate(([0.0], np.cumsum(accel))),
        decel_sum=np.concatenate(([0.0], np.cumsum(decel))),
        printed=draw(printed),
        **off(),
    )
    return Loaded(physics, rolling, linear, aero)


def parts_of(p, *link):
    parts = np.zeros(PART_COUNT)
    add_link_parts(p, *link, parts)
    return parts


@MANY
@given(
    p=vehicles(),
    length=lengths_m,
    grade=grades,
    v_start=entries_mps,
    p_start=chances,
    v_max=speeds_mps,
    v_next=speeds_mps,
    p_stop=chances,
    wait=st.floats(0.0, 300.0),
)
def test_link_of_any_valid_input_is_finite_and_its_parts_add_up(
    p, length, grade, v_start, p_start, v_max, v_next, p_stop, wait
):
    link = (length, grade, v_start, p_start, v_max, v_next, p_stop, wait)
    energy_j, time_s, end = link_energy(p, *link)
    parts = parts_of(p, *link)
    assert np.all(np.isfinite((energy_j, time_s, end, *parts)))
    assert time_s > 0.0
    assert parts.sum() == pytest.approx(energy_j, abs=1e-11 * float(np.abs(parts).sum()) + 1e-9)
    assert 0.0 < end <= min(v_max, v_next) * (1.0 + 1e-12)


@MANY
@given(p=vehicles(), length=lengths_m, v_start=entries_mps, v_max=speeds_mps, target=entries_mps)
def test_phases_of_any_link_add_to_its_length_and_keep_the_limits(p, length, v_start, v_max, target):
    target = min(target, v_max)
    s1, s2, s3, peak, end = plan_link(p, length, v_start, v_max, target)
    assert s1 + s2 + s3 == pytest.approx(length, rel=1e-12)
    assert min(s1, s3) >= 0.0
    assert s2 >= -1e-12 * length
    assert end <= target * (1.0 + 1e-12)
    assert end == target or (end > v_start and s1 == length)  # below the target only where it is out of reach
    assert peak <= v_max * (1.0 + 1e-12)
    if s3 > 0.0:
        assert peak > end


def bounded_below(p, energy_j, climb_m, kinetic_before_m2, kinetic_after_m2, scale_j):
    """E ≥ α·(m·g·Δh + ½·m·d·Δv²) for α in [η_chg, 1/η_dis]; linear in α, so its ends and one between suffice."""
    stored_j = p.weight_n * climb_m + 0.5 * p.inertia_kg * (kinetic_after_m2 - kinetic_before_m2)
    for alpha in (p.recuperation_factor, 0.5 * (p.recuperation_factor + p.drive_factor), p.drive_factor):
        assert energy_j >= alpha * stored_j - 1e-9 * scale_j


@MANY
@given(
    p=vehicles(printed=integrated_only),
    length=lengths_m,
    grade=grades,
    v_start=entries_mps,
    p_start=chances,
    v_max=speeds_mps,
    v_next=speeds_mps,
    p_stop=chances,
)
def test_integrated_link_conserves_energy(p, length, grade, v_start, p_start, v_max, v_next, p_stop):
    # the kinetic state is the expected v², (1 - p)·v²: a stop that happens with probability p has none
    link = (length, grade, v_start, p_start, v_max, v_next, p_stop, 0.0)
    energy_j, _, end = link_energy(p, *link)
    scale_j = float(np.abs(parts_of(p, *link)).sum())
    before, after = (1.0 - p_start) * v_start**2, (1.0 - p_stop) * end**2
    bounded_below(p, energy_j, grade * length, before, after, scale_j)


@MANY
@given(
    p=vehicles(),
    length=lengths_m,
    grade=grades,
    v_start=entries_mps,
    p_start=chances,
    v_max=speeds_mps,
    v_next=speeds_mps,
    p_stop=chances,
    wait=st.floats(0.0, 60.0),
)
def test_expected_link_is_the_weighted_mean_of_certain_branches(
    p, length, grade, v_start, p_start, v_max, v_next, p_stop, wait
):
    energy_j, time_s, end = link_energy(p, length, grade, v_start, p_start, v_max, v_next, p_stop, wait)
    mean_j = mean_s = mean_end2 = scale_j = 0.0
    for rest in (0.0, 1.0):
        for stop in (0.0, 1.0):
            weight = (p_start if rest else 1.0 - p_start) * (p_stop if stop else 1.0 - p_stop)
            e, t, v = link_energy(p, length, grade, v_start, rest, v_max, v_next, stop, wait)
            mean_j, mean_s, mean_end2 = mean_j + weight * e, mean_s + weight * t, mean_end2 + weight * v * v
            scale_j += abs(e)
    assert energy_j == pytest.approx(mean_j, abs=1e-12 * scale_j)
    assert time_s == pytest.approx(mean_s, rel=1e-12)
    assert end**2 == pytest.approx(mean_end2, rel=1e-12)


@MANY
@given(
    p=vehicles(),
    length=lengths_m,
    grade=grades,
    v_start=entries_mps,
    v_max=speeds_mps,
    p_stop=chances,
    field=st.sampled_from(("rolling_n", "linear_n_per_mps", "aero_n_per_mps2", "aux_move_w", "aux_idle_w")),
    more=st.floats(0.0, 100.0),
)
def test_link_energy_never_falls_with_more_load(p, length, grade, v_start, v_max, p_stop, field, more):
    link = (length, grade, v_start, 0.3, v_max, v_max, p_stop, 5.0)
    heavier = p._replace(**{field: getattr(p, field) + more})
    rounding_j = 1e-9 * float(np.abs(parts_of(heavier, *link)).sum())
    assert link_energy(heavier, *link)[0] >= link_energy(p, *link)[0] - rounding_j
    assert link_energy(heavier, *link)[1:] == link_energy(p, *link)[1:]


@MANY
@given(p=vehicles(), v=speeds_mps, length=st.floats(1.0, 5000.0), share=st.floats(0.01, 0.99), grade=grades)
def test_cruise_split_in_two_takes_the_same(p, v, length, share, grade):
    whole_j, whole_s, _ = link_energy(p, length, grade, v, 0.0, v, v, 0.0, 0.0)
    first_j, first_s, between = link_energy(p, length * share, grade, v, 0.0, v, v, 0.0, 0.0)
    second_j, second_s, _ = link_energy(p, length * (1.0 - share), grade, between, 0.0, v, v, 0.0, 0.0)
    assert between == v
    assert first_j + second_j == pytest.approx(whole_j, rel=1e-9, abs=1e-6)
    assert first_s + second_s == pytest.approx(whole_s, rel=1e-12)


@MANY
@given(p=vehicles(), v_start=entries_mps, v_max=speeds_mps, target=entries_mps, grade=grades)
def test_link_energy_has_no_step_where_one_case_becomes_another(p, v_start, v_max, target, grade):
    # for entries up to the limit: full phases / lower peak, lower peak / out of reach, lower peak / harder braking
    v_start, target = min(v_start, v_max), min(target, v_max)
    s1, _, s3, _, _ = plan_link(p, 1e9, v_start, v_max, target)
    borders = [s1 + s3]
    if v_start < target:
        borders.append(s1 * (target**2 - v_start**2) / (v_max**2 - v_start**2))
    elif v_start > target:
        borders.append(s3 * (v_start**2 - target**2) / (v_max**2 - target**2))
    for border in borders:
        if border < 0.1:
            continue
        below, above = (
            link_energy(p, border * (1.0 + side * 1e-10), grade, v_start, 0.0, v_max, target, 0.0, 0.0)
            for side in (-1.0, 1.0)
        )
        parts = parts_of(p, border, grade, v_start, 0.0, v_max, target, 0.0, 0.0)
        assert below[0] == pytest.approx(above[0], abs=1e-4 * float(np.abs(parts).sum()))
        assert below[1:] == pytest.approx(above[1:], rel=1e-4)


@pytest.mark.nojit
@pytest.mark.parametrize("printed", [False, True])
def test_parts_on_a_grid_of_links_add_up_and_are_finite(make_physics, printed):
    p = make_physics(linear_n_per_mps=-4.0, printed=printed)
    for length in (0.1, 30.0, 800.0):
        for grade in (-0.3, -0.02, 0.0, 0.3):
            for v_start in (0.0, 10.0, 40.0):
                for v_next in (2.0, 55.0):
                    link = (length, grade, v_start, 0.2, 20.0, v_next, 0.4, 9.0)
                    energy_j, _, _ = link_energy(p, *link)
                    parts = parts_of(p, *link)
                    assert math.isfinite(energy_j)
                    assert parts.sum() == pytest.approx(energy_j, abs=1e-11 * float(np.abs(parts).sum()))


def test_printed_link_can_break_the_bound_that_integrated_keeps(make_physics):
    # 10 m/s entered, 20 m/s left: printed books m·d·5·17.5 where ½·m·d·Δv² = m·d·150 was stored
    p = make_physics(rolling_n=0.0, aero_n_per_mps2=0.0, aux_move_w=0.0, printed=True)
    stored_j = 0.5 * 1100.0 * (20.0**2 - 10.0**2)
    link = (75.0, 0.0, 10.0, 0.0, 20.0, 20.0, 0.0, 0.0)
    assert link_energy(p, *link)[0] < p.drive_factor * stored_j
    assert link_energy(p._replace(printed=False), *link)[0] == pytest.approx(p.drive_factor * stored_j)
