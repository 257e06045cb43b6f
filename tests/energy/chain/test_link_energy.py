"""Energy and time of one link by hand, in both evaluations of a dynamic phase.

Vehicle: A = 100 N, B = 0, C = 0.5 N/(m/s)², m·g = 9810 N, m·d = 1100 kg, η_dis = 0.8, η_chg = 0.5, auxiliaries
600 W moving and 500 W standing; accelerations 3, 2, 1 and brakings 4, 3, 2 m/s² in 0-10, 10-20, 20-30 m/s.
"""

from __future__ import annotations

import math

import numpy as np
import pytest

from energy.force.kernels_parts import (
    AERO,
    AUXILIARY,
    DRIVETRAIN_LOSS,
    GRADE,
    INERTIA,
    LINEAR,
    PART_COUNT,
    RECUPERATION_LOSS,
    ROLLING,
)
from tests.energy.loaded import add_link_parts, cruise_energy, link_energy, ramp_energy

pytestmark = pytest.mark.nojit


def certain(physics, length, v_start, v_max, *, grade=0.0, v_next=math.inf, stop=False, wait=0.0, from_rest=False):
    return link_energy(physics, length, grade, v_start, float(from_rest), v_max, v_next, float(stop), wait)


# Dynamic phases


def test_start_from_rest_integrated_is_the_integral(make_physics):
    # 0 → 20 m/s at 2.5: s = 80 m, t = 8 s. F = 100 + 0.5·v² + 1100·2.5; v² is linear in s, so its mean is 200:
    # (2850 + 100)·80 = 236 kJ, /0.8 = 295 kJ, + 600·8 = 4.8 kJ
    assert ramp_energy(make_physics(), 80.0, 0.0, 20.0, 0.0, 1.0) == pytest.approx((299_800.0, 8.0))


def test_start_from_rest_with_linear_drag_uses_the_mean_speed_over_distance(make_physics):
    # v = √(5s): mean over s is 2/3·20, so B = 2 adds 2·13.333·80 = 2133.33 J at the wheel, /0.8 = 2666.67 J
    plain = ramp_energy(make_physics(), 80.0, 0.0, 20.0, 0.0, 1.0)[0]
    linear = ramp_energy(make_physics(linear_n_per_mps=2.0), 80.0, 0.0, 20.0, 0.0, 1.0)[0]
    assert linear - plain == pytest.approx(8000.0 / 3.0)


def test_start_from_rest_printed_follows_the_printed_equations(make_physics):
    # (13) dt = 20/(2·2.5) = 4, (15) v = 0.75·20 = 15, (34) F = 100 + 112.5 + 2750 = 2962.5,
    # (35) P = 44437.5 W, (36) 44437.5·4/0.8 + 600·4 = 222187.5 + 2400
    assert ramp_energy(make_physics(printed=True), 80.0, 0.0, 20.0, 0.0, 1.0) == pytest.approx((224_587.5, 4.0))


def test_braking_to_rest_integrated_recuperates_the_integral(make_physics):
    # 20 → 0 at 3.5: s = 400/7, t = 20/3.5. (100 - 3850 + 100)·400/7 = -208571.43 J, ·0.5 = -104285.71,
    # + 600·40/7 = 3428.57
    energy_j, time_s = ramp_energy(make_physics(), 400.0 / 7.0, 20.0, 0.0, 0.0, 1.0)
    assert energy_j == pytest.approx((-730_000.0 + 24_000.0) / 7.0)
    assert time_s == pytest.approx(40.0 / 7.0)


def test_braking_to_rest_printed_follows_the_printed_equations(make_physics):
    # (23) with |a_3|: dt = 20/7; (25) v = 15; (34) with the signed a: F = 212.5 - 3850 = -3637.5;
    # -3637.5·15·20/7·0.5 + 600·20/7 = -77946.43 + 1714.29
    energy_j, time_s = ramp_energy(make_physics(printed=True), 400.0 / 7.0, 20.0, 0.0, 0.0, 1.0)
    assert energy_j == pytest.approx((-545_625.0 + 12_000.0) / 7.0)
    assert time_s == pytest.approx(20.0 / 7.0)


def test_first_phase_that_brakes_printed_weights_the_higher_speed(make_physics):
    # 30 → 20 at 2 in 125 m: dt = 10/4 = 2.5, v = 0.75·30 + 0.25·20 = 27.5 (not 22.5)
    # F = 100 + 0.5·756.25 - 2200 = -1721.875; ·27.5·2.5·0.5 = -59189.453; + 600·2.5
    energy_j, time_s = ramp_energy(make_physics(printed=True), 125.0, 30.0, 20.0, 0.0, 1.0)
    assert energy_j == pytest.approx(-59_189.453125 + 1500.0)
    assert time_s == pytest.approx(2.5)


def test_start_from_rest_printed_books_three_quarters_of_the_kinetic_energy(make_physics):
    # only inertia: F·v·dt = m·d·a · 0.75·v · v/(2a) = 0.375·m·d·v² = 0.75·(½·m·d·v²); with the kinematic
    # dt = v/a, twice the printed one, the same power gives 1.5·(½·m·d·v²)
    physics = make_physics(
        rolling_n=0.0, aero_n_per_mps2=0.0, drive_factor=1.0, aux_move_w=0.0, inertia_kg=1000.0, printed=True
    )
    kinetic_j = 0.5 * 1000.0 * 20.0**2
    energy_j, time_s = ramp_energy(physics, 80.0, 0.0, 20.0, 0.0, 1.0)
    assert energy_j == pytest.approx(0.75 * kinetic_j)
    kinematic_s = 20.0 / 2.5
    assert energy_j / time_s * kinematic_s == pytest.approx(1.5 * kinetic_j)
    assert ramp_energy(physics._replace(printed=False), 80.0, 0.0, 20.0, 0.0, 1.0)[0] == pytest.approx(kinetic_j)


def test_printed_round_trip_without_losses_gains_energy(make_physics):
    # No drag, no losses: 0 → 10 → 20 m/s in two phases, then 20 → 0 in one. a·dt = Δv/2 in every phase, so booked
    # are m·d·(5·7.5 + 5·17.5 - 10·15) = m·d·(37.5 + 87.5 - 150), -25 J/kg: only `integrated` keeps the bound
    physics = make_physics(
        rolling_n=0.0,
        aero_n_per_mps2=0.0,
        drive_factor=1.0,
        recuperation_factor=1.0,
        aux_move_w=0.0,
        inertia_kg=1000.0,
        printed=True,
    )
    stretches = ((50.0, 0.0, 10.0), (75.0, 10.0, 20.0), (100.0, 20.0, 0.0))
    assert sum(ramp_energy(physics, *s, 0.0, 1.0)[0] for s in stretches) == pytest.approx(-25_000.0)
    exact = physics._replace(printed=False)
    assert sum(ramp_energy(exact, *s, 0.0, 1.0)[0] for s in stretches) == pytest.approx(0.0, abs=1e-6)


def test_gentle_braking_integrated_drives_first_and_recuperates_then(make_physics):
    # a chosen so that m·d·a = -300 N: F = -200 + 0.5·v² changes sign at 20 m/s. 30 → 10 m/s takes
    # s = 800·1100/600 m; the part above 20 m/s is 500/800 of it.
    # above: F mean = -200 + 0.5·650 = 125; below: -200 + 0.5·250 = -75
    s = 800.0 * 1100.0 / 600.0
    drive_j = 125.0 * s * 5.0 / 8.0 / 0.8
    recuperated_j = -75.0 * s * 3.0 / 8.0 * 0.5
    energy_j, time_s = ramp_energy(make_physics(), s, 30.0, 10.0, 0.0, 1.0)
    assert time_s == pytest.approx(s / 20.0)
    assert energy_j == pytest.approx(drive_j + recuperated_j + 600.0 * s / 20.0)
    assert energy_j == pytest.approx(143_229.1667 - 20_625.0 + 44_000.0)


def test_gentle_braking_printed_takes_one_sign_for_the_phase(make_physics):
    # as above: v = 0.75·30 + 0.25·10 = 25, F = -200 + 312.5 = 112.5 ≥ 0, dt = 20/(2·300/1100) = 36.667
    s = 800.0 * 1100.0 / 600.0
    energy_j, time_s = ramp_energy(make_physics(printed=True), s, 30.0, 10.0, 0.0, 1.0)
    assert time_s == pytest.approx(110.0 / 3.0)
    assert energy_j == pytest.approx((112.5 * 25.0 / 0.8 + 600.0) * 110.0 / 3.0)


# Constant speed, efficiencies, slope


def test_cruise_on_the_flat_takes_drag_over_drive_efficiency(make_physics):
    # (34) 100 + 0.5·400 = 300 N over 1 km / 0.8 = 375 kJ (37); 600 W · 50 s = 30 kJ (39); (18) 50 s
    assert cruise_energy(make_physics(), 1000.0, 20.0, 0.0, 1.0) == pytest.approx((405_000.0, 50.0))


def test_climb_weighs_rolling_with_the_cosine(make_physics):
    # sinθ = 0.6, cosθ = 0.8: 80 + 200 + 9810·0.6 = 6166 N, /0.8·1000 = 7707.5 kJ, + 30 kJ
    energy_j, time_s, end = certain(make_physics(), 1000.0, 20.0, 20.0, grade=0.6)
    assert (energy_j, time_s, end) == pytest.approx((7_737_500.0, 50.0, 20.0))


def test_descent_recuperates_with_the_charging_efficiency(make_physics):
    # 80 + 200 - 5886 = -5606 N, ·1000·0.5 = -2803 kJ (38), + 30 kJ
    assert certain(make_physics(), 1000.0, 20.0, 20.0, grade=-0.6)[0] == pytest.approx(-2_773_000.0)


def test_power_of_exactly_zero_leaves_auxiliaries_only(make_physics):
    # 300 N of drag against 9810·sinθ; cosθ = 1 is set apart to make the balance exact
    assert cruise_energy(make_physics(weight_n=1000.0), 1000.0, 20.0, -0.3, 1.0) == (30_000.0, 50.0)


@pytest.mark.parametrize("printed", [False, True])
def test_standstill_takes_the_idle_auxiliaries_and_no_more(make_physics, printed):
    # phase 4 (26)-(33), (40): 20 s · 500 W
    physics = make_physics(printed=printed)
    brief = certain(physics, 1000.0, 0.0, 20.0, stop=True)
    long = certain(physics, 1000.0, 0.0, 20.0, stop=True, wait=20.0)
    assert long[0] - brief[0] == pytest.approx(10_000.0)
    assert long[1] - brief[1] == pytest.approx(20.0)


# Whole links: the example of the source's section II.D, and what its end speed follows


def test_link_with_all_four_phases_integrated_adds_them_up(make_physics):
    # 1000 m from rest, limit 20, stop of 20 s: (41) 299800 [80 m, 8 s] + cruise over 1000-80-400/7 m
    # at 300 N/0.8 and 600 W + braking (-706000/7 J, 40/7 s) + 10000 J
    cruise_m = 920.0 - 400.0 / 7.0
    energy_j, time_s, _ = certain(make_physics(), 1000.0, 0.0, 20.0, stop=True, wait=20.0)
    assert time_s == pytest.approx(8.0 + cruise_m / 20.0 + 40.0 / 7.0 + 20.0)
    assert energy_j == pytest.approx(299_800.0 + cruise_m * (375.0 + 30.0) - 706_000.0 / 7.0 + 10_000.0)


def test_link_with_all_four_phases_printed_adds_them_up(make_physics):
    # the distances (12), (17), (22) are the same, the times and energies of phases 1 and 3 as printed
    cruise_m = 920.0 - 400.0 / 7.0
    energy_j, time_s, _ = certain(make_physics(printed=True), 1000.0, 0.0, 20.0, stop=True, wait=20.0)
    assert time_s == pytest.approx(4.0 + cruise_m / 20.0 + 20.0 / 7.0 + 20.0)
    assert energy_j == pytest.approx(224_587.5 + cruise_m * 405.0 - 533_625.0 / 7.0 + 10_000.0)


def test_next_link_unknown_or_faster_ends_at_the_limit(make_physics):
    # (9)
    for v_next in (20.0, 25.0, math.inf):
        assert certain(make_physics(), 1000.0, 0.0, 20.0, v_next=v_next)[2] == 20.0


def test_next_link_slower_is_braked_for_in_this_link(make_physics):
    # (10): 20 → 10 at 3 m/s² in the last 50 m: -(3300-100-125)·50·0.5 + 600·10/3
    energy_j, time_s, end = certain(make_physics(), 1000.0, 20.0, 20.0, v_next=10.0)
    assert end == 10.0
    assert time_s == pytest.approx(950.0 / 20.0 + 10.0 / 3.0)
    assert energy_j == pytest.approx(950.0 * 405.0 - 76_875.0 + 2000.0)


def test_lower_peak_energy_is_two_ramps(make_physics):
    # 96 m from rest to rest: peak² = 280, 56 m at 2.5 and 40 m at -3.5 m/s², mean of v² = 140 in both
    # up: (100+70+2750)·56 = 163520, /0.8 = 204400; down: (100+70-3850)·40·0.5 = -73600; 600 W · peak·(1/2.5+1/3.5)
    peak = math.sqrt(280.0)
    energy_j, time_s, _ = certain(make_physics(), 96.0, 0.0, 20.0, stop=True)
    assert time_s == pytest.approx(peak / 2.5 + peak / 3.5)
    assert energy_j == pytest.approx(204_400.0 - 73_600.0 + 600.0 * time_s)


def test_target_out_of_reach_energy_is_one_ramp(make_physics):
    # 45 m at 2.5 m/s² to 15 m/s: (100 + 0.5·112.5 + 2750)·45/0.8 + 600·6
    energy_j, time_s, end = certain(make_physics(), 45.0, 0.0, 20.0)
    assert (time_s, end) == pytest.approx((6.0, 15.0))
    assert energy_j == pytest.approx(2906.25 * 45.0 / 0.8 + 3600.0)


def test_harder_braking_energy_is_one_ramp(make_physics):
    # 20 → 0 in 20 m is 10 m/s², 2 s: (100 + 100 - 11000)·20·0.5 + 600·2
    energy_j, time_s, end = certain(make_physics(), 20.0, 20.0, 20.0, stop=True)
    assert (time_s, end) == pytest.approx((2.0, 20.0))  # the end speed is the go-speed, here without braking
    assert energy_j == pytest.approx(-108_000.0 + 1200.0)


def test_harder_braking_printed_takes_half_the_time(make_physics):
    # dt = 20/(2·10) = 1, v = 15, F = 212.5 - 11000 = -10787.5: ·15·0.5 + 600
    energy_j, time_s, _ = certain(make_physics(printed=True), 20.0, 20.0, 20.0, stop=True)
    assert time_s == pytest.approx(1.0)
    assert energy_j == pytest.approx(-80_906.25 + 600.0)


def test_entry_from_rest_ignores_the_go_speed(make_physics):
    physics = make_physics()
    assert certain(physics, 500.0, 17.0, 20.0, from_rest=True) == certain(physics, 500.0, 0.0, 20.0)


# Expected stops


def test_expected_stop_is_the_weighted_mean_of_the_certain_branches(make_physics):
    physics = make_physics()
    branches = {
        (rest, stop): certain(physics, 300.0, 15.0, 20.0, grade=0.02, v_next=10.0, stop=stop, wait=9.0, from_rest=rest)
        for rest in (False, True)
        for stop in (False, True)
    }
    weight = {
        (False, False): 0.75 * 0.6,
        (False, True): 0.75 * 0.4,
        (True, False): 0.25 * 0.6,
        (True, True): 0.25 * 0.4,
    }
    energy_j, time_s, end = link_energy(physics, 300.0, 0.02, 15.0, 0.25, 20.0, 10.0, 0.4, 9.0)
    assert energy_j == pytest.approx(sum(weight[key] * branches[key][0] for key in branches))
    assert time_s == pytest.approx(sum(weight[key] * branches[key][1] for key in branches))
    assert end == 10.0


def test_branches_that_end_at_different_speeds_carry_the_root_mean_square(make_physics):
    # 45 m: from rest to 15 m/s, from 20 m/s on at 20: √(0.64·400 + 0.36·225) = √337
    _, _, end = link_energy(make_physics(), 45.0, 0.0, 20.0, 0.36, 20.0, 20.0, 0.0, 0.0)
    assert end == pytest.approx(math.sqrt(337.0))


# Parts


def test_parts_of_a_climbing_start_are_the_terms_of_the_force(make_physics):
    # 80 m from rest at sinθ = 0.6, B = 3: A·cosθ·80, B·13.333·80, C·200·80, m·g·0.6·80, m·d·2.5·80; η_dis = 0.8
    parts = np.zeros(PART_COUNT)
    add_link_parts(make_physics(linear_n_per_mps=3.0), 80.0, 0.6, 0.0, 0.0, 20.0, 20.0, 0.0, 0.0, parts)
    assert parts[ROLLING] == pytest.approx(6400.0)
    assert parts[LINEAR] == pytest.approx(3200.0)
    assert parts[AERO] == pytest.approx(8000.0)
    assert parts[GRADE] == pytest.approx(470_880.0)
    assert parts[INERTIA] == pytest.approx(220_000.0)
    assert parts[DRIVETRAIN_LOSS] == pytest.approx((6400.0 + 3200.0 + 8000.0 + 470_880.0 + 220_000.0) * 0.25)
    assert parts[RECUPERATION_LOSS] == 0.0
    assert parts[AUXILIARY] == pytest.approx(4800.0)


def test_parts_of_braking_charge_the_recuperation_loss(make_physics):
    # 20 → 0 in 20 m: wheel work -216 kJ, half of which comes back; auxiliaries 2 s moving and 3 s standing
    parts = np.zeros(PART_COUNT)
    add_link_parts(make_physics(), 20.0, 0.0, 20.0, 0.0, 20.0, 20.0, 1.0, 3.0, parts)
    assert parts[ROLLING] == pytest.approx(2000.0)
    assert parts[AERO] == pytest.approx(2000.0)
    assert parts[INERTIA] == pytest.approx(-220_000.0)
    assert parts[DRIVETRAIN_LOSS] == 0.0
    assert parts[RECUPERATION_LOSS] == pytest.approx(108_000.0)
    assert parts[AUXILIARY] == pytest.approx(1200.0 + 1500.0)
