"""The time-step model: hand-computed drives, what holds for every drive, and the fast model as its limit."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from energy.chain.chain import Chain, StopRule, simulate_chain
from energy.chain.kernels_timestep import braking_distance_m, braking_of, braking_speed_mps, speed_on_curve
from energy.chain.timestep import CERTAIN_RULES, simulate_timestep
from energy.conditions import STILL, Conditions, RoadSurface
from energy.errors import ConditionsError, LinkError
from energy.force.parts import PART_NAMES
from energy.stops import Cross
from energy.vehicle.consumption_table import ConsumptionTableVehicle

MANY = settings(max_examples=150, deadline=None)


@pytest.fixture(scope="module")
def steady(round_vehicle):
    """The round vehicle with one interval: 2 m/s² faster and slower at any speed."""
    return dataclasses.replace(
        round_vehicle,
        accel_speed_mps=np.array([0.0, 30.0]),
        accel_mps2=np.array([2.0]),
        decel_mps2=np.array([-2.0]),
    )


@pytest.fixture(scope="module")
def steady_kona(kona):
    """The Kona with one interval, so that the fast model's mean over intervals is the table's value."""
    return dataclasses.replace(
        kona, accel_speed_mps=np.array([0.0, 60.0]), accel_mps2=np.array([1.1]), decel_mps2=np.array([-0.9])
    )


@pytest.mark.nojit
def test_cruise_at_the_limit_takes_force_times_way(round_vehicle, make_chain):
    # F = 100 + 0.5·10² = 150 N; 150 N·100 m/0.8 = 18 750 J; 600 W for 10 s
    result = simulate_timestep(round_vehicle, make_chain([100.0], 10.0), start_speed_mps=10.0, arrive_stopped=False)
    assert result.energy_j == pytest.approx(18_750.0 + 6000.0, rel=1e-12)
    assert result.duration_s == pytest.approx(10.0, rel=1e-12)
    assert result.step_count == 100
    assert result.links[0].speed_end_mps == 10.0


@pytest.mark.nojit
def test_start_from_rest_takes_kinetic_energy_and_road_load(steady, make_chain):
    # 0 → 20 m/s at 2 m/s² in 10 s and 100 m; ∫F ds = (100 + 0.5·20²/2 + 1100·2)·100 = 240 000 J, over 0.8, and 6000 J
    result = simulate_timestep(steady, make_chain([100.0], 20.0), arrive_stopped=False)
    assert result.duration_s == pytest.approx(10.0, rel=1e-9)
    assert result.energy_j == pytest.approx(306_000.0, rel=1e-9)
    assert result.parts.inertia_j == pytest.approx(0.5 * 1100.0 * 20.0**2, rel=1e-9)
    assert result.parts.aero_j == pytest.approx(10_000.0, rel=1e-9)
    assert result.links[0].speed_end_mps == pytest.approx(20.0, rel=1e-9)


@pytest.mark.nojit
def test_stop_begins_to_brake_where_the_table_just_suffices(steady, make_chain):
    # 100 m at 20 m/s: 300 N·100 m/0.8 = 37 500 J in 5 s. Then 100 m and 10 s of braking at 2 m/s²: F < 0 throughout,
    # ∫F ds = (100 + 100 − 2200)·100 = −200 000 J, half of it recuperated. 600 W for 15 s
    result = simulate_timestep(steady, make_chain([200.0], 20.0), start_speed_mps=20.0, profile=True)
    assert result.duration_s == pytest.approx(15.0, rel=1e-9)
    assert result.energy_j == pytest.approx(37_500.0 - 100_000.0 + 9000.0, rel=1e-9)
    assert result.stop_count == 0
    profile = result.profile
    assert profile.distance_m[np.flatnonzero(profile.speed_mps >= 20.0 - 1e-9)[-1]] == pytest.approx(100.0, rel=1e-9)


@pytest.mark.nojit
def test_braking_over_several_short_links_begins_before_all_of_them(steady, make_chain):
    # 30 → 10 m/s at 2 m/s² takes 200 m, 50 m of them in the first link: v² there 100 + 4·150 = 700, then 500, 300, 100
    chain = make_chain([1000.0, 50.0, 50.0, 50.0, 100.0], [30.0, 30.0, 30.0, 30.0, 10.0])
    result = simulate_timestep(steady, chain, start_speed_mps=30.0, arrive_stopped=False)
    assert [link.speed_end_mps**2 for link in result.links] == pytest.approx([700.0, 500.0, 300.0, 100.0, 100.0])
    assert result.duration_s == pytest.approx(950.0 / 30.0 + 10.0 + 10.0, rel=1e-5)  # one step begins to brake
    fast = simulate_chain(steady, chain, start_speed_mps=30.0, arrive_stopped=False)
    assert [link.speed_end_mps for link in fast.links] == pytest.approx([30.0, 30.0, 30.0, 10.0, 10.0])


@pytest.mark.parametrize(("step_s", "within_s"), [(0.1, 0.2), (0.01, 0.02)])
def test_table_of_three_intervals_is_followed_interval_by_interval(round_vehicle, make_chain, step_s, within_s):
    # up 10/3 + 10/2 + 10/1 s over 100/6 + 300/4 + 500/2 m, down 10/4 + 10/3 + 10/2 s over 12.5 + 50 + 125 m
    up_m, down_m = 100.0 / 6.0 + 75.0 + 250.0, 187.5
    up_s, down_s = 10.0 / 3.0 + 5.0 + 10.0, 2.5 + 10.0 / 3.0 + 5.0
    result = simulate_timestep(round_vehicle, make_chain([up_m + 600.0 + down_m], 30.0), step_s=step_s, profile=True)
    assert result.duration_s == pytest.approx(up_s + 20.0 + down_s, abs=within_s)
    profile = result.profile
    full = profile.distance_m[profile.speed_mps >= 30.0 - 1e-9]
    assert full[[0, -1]] == pytest.approx([up_m, up_m + 600.0], abs=60.0 * step_s)
    coasting_m = result.distance_m - 12.5
    assert np.interp(coasting_m, profile.distance_m, profile.speed_mps) == pytest.approx(10.0, abs=2.0 * step_s)


@pytest.mark.nojit
def test_stop_on_the_way_stands_still_for_its_time(steady, make_chain):
    # 0 → 20 → 0 m/s takes 200 m and 20 s; twice, with 15 s of standing at 500 W between
    chain = make_chain([200.0, 200.0], 20.0, 0.0, [1.0, 0.0], [15.0, 0.0], [int(Cross.MEDIUM), 0])
    result = simulate_timestep(steady, chain, profile=True)
    assert result.stop_count == 1
    assert result.standstill_s == result.links[0].standstill_s == 15.0
    assert result.duration_s == pytest.approx(55.0, rel=1e-6)
    assert result.links[0].energy_j - result.links[1].energy_j == pytest.approx(15.0 * 500.0, rel=1e-4)
    standing = np.flatnonzero(np.diff(result.profile.distance_m) == 0.0)
    assert np.diff(result.profile.time_s)[standing] == pytest.approx([15.0])


@pytest.mark.nojit
def test_braking_distance_of_the_table_is_the_sum_over_its_intervals(make_physics):
    # 10 → 0 at 4 m/s²: 12.5 m; 20 → 10 at 3: 50 m; 30 → 20 at 2: 125 m, which holds on above
    braking = braking_of(make_physics().physics)
    for speed, distance in ((0.0, 0.0), (10.0, 12.5), (15.0, 12.5 + 125.0 / 6.0), (30.0, 187.5), (40.0, 362.5)):
        assert braking_distance_m(braking, speed) == pytest.approx(distance)
        assert braking_speed_mps(braking, distance) == pytest.approx(speed)


@pytest.mark.nojit
@pytest.mark.parametrize(("v", "curve"), [(30.0, 187.5), (20.1, 70.0), (5.0, 20.0), (0.0, 1.0), (0.3, 0.02)])
def test_speed_on_curve_lies_on_the_braking_curve(make_physics, v, curve):
    braking = braking_of(make_physics().physics)
    speed = speed_on_curve(braking, v, curve, 1.0, 0.1)
    assert braking_distance_m(braking, speed) == pytest.approx(curve - 0.5 * (v + speed) * 0.1, abs=1e-12)


@pytest.mark.nojit
def test_start_too_fast_for_a_stop_brakes_harder_than_the_table_by_one_factor(round_vehicle, make_chain):
    # from 30 m/s the table needs 187.5 m and 10/2 + 10/3 + 10/4 s; in 50 m all of it is 3.75 times as hard
    result = simulate_timestep(round_vehicle, make_chain([20.0, 30.0], 30.0), start_speed_mps=30.0)
    assert result.duration_s == pytest.approx((5.0 + 10.0 / 3.0 + 2.5) / 3.75, rel=1e-2)
    assert result.parts.inertia_j == pytest.approx(-0.5 * 1100.0 * 900.0)
    assert result.links[1].speed_end_mps == 0.0


@pytest.mark.nojit
def test_start_above_the_limit_brakes_by_the_table_down_to_it(steady, make_chain):
    # 20 → 10 m/s at 2 m/s²: 75 m and 5 s; then 75 m at 10 m/s
    result = simulate_timestep(steady, make_chain([150.0], 10.0), start_speed_mps=20.0, arrive_stopped=False)
    assert result.duration_s == pytest.approx(12.5, rel=1e-9)
    assert result.links[0].speed_end_mps == 10.0


def hilly_chain(rng, n):
    return Chain(
        length_m=np.exp(rng.uniform(math.log(2.0), math.log(2000.0), n)),
        grade_frac=rng.uniform(-0.1, 0.1, n),
        speed_limit_mps=rng.choice([20.0, 30.0, 50.0, 80.0, 130.0], n) / 3.6,
        stop_probability_frac=rng.choice([0.0, 0.3], n),
        stop_time_s=np.full(n, 10.0),
        stop_class=rng.integers(0, 8, n).astype(np.int8),
        altitude_m=rng.uniform(0.0, 2000.0, n),
        heading=np.tile([0.6, 0.8], (n, 1)),
    )


ALL_EFFECTS = Conditions(
    ambient_k=263.15,
    wind_speed_mps=9.0,
    wind_from_rad=4.0,
    payload_kg=250.0,
    drag_factor=1.3,
    road=RoadSurface.WET,
    speed_factor=0.9,
    regen_limited=True,
)


@MANY
@given(
    seed=st.integers(0, 10**6),
    n=st.integers(1, 30),
    rule=st.sampled_from(CERTAIN_RULES),
    start=st.one_of(st.just(0.0), st.floats(0.0, 55.0)),
    arrive_stopped=st.booleans(),
    conditions=st.sampled_from([STILL, ALL_EFFECTS]),
)
def test_drive_of_any_chain_conserves_energy_and_keeps_limits(kona, seed, n, rule, start, arrive_stopped, conditions):
    chain = hilly_chain(np.random.default_rng(seed), n)
    asked = {"conditions": conditions, "stop_rule": rule, "start_speed_mps": start, "arrive_stopped": arrive_stopped}
    result = simulate_timestep(kona, chain, **asked, soc_start_frac=0.95, profile=True)
    turnover_j = sum(float(np.abs(link.parts_j).sum()) for link in result.links)
    assert result.parts.total_j() == pytest.approx(result.energy_j, abs=1e-11 * turnover_j)
    for link in result.links:
        assert link.parts_j.sum() == pytest.approx(link.energy_j, abs=1e-11 * turnover_j)
    mass_kg = kona.mass_kg + conditions.payload_kg
    share = kona.mass_kg / mass_kg  # the rest of climb and inertia is booked as payload
    climb_m = float((chain.grade_frac * chain.length_m).sum())
    assert result.parts.grade_j == pytest.approx(share * mass_kg * 9.81 * climb_m, rel=1e-9, abs=1.0)
    kinetic_j = 0.5 * mass_kg * 1.1 * (result.links[-1].speed_end_mps ** 2 - start**2)
    assert result.parts.inertia_j == pytest.approx(share * kinetic_j, rel=1e-9, abs=1e-3)
    assert result.duration_s == pytest.approx(float(result.profile.time_s[-1]), rel=1e-9)
    assert result.distance_m == pytest.approx(float(result.profile.distance_m[-1]), rel=1e-9)
    limits = chain.speed_limit_mps * conditions.speed_factor
    if start == 0.0:
        assert_limits_and_braking_kept(result, kona, chain.length_m, limits)
    following = [*limits[1:], limits[-1]]
    for k, link in enumerate(result.links):
        assert link.speed_end_mps <= min(limits[k], following[k]) * (1.0 + 1e-9)
        assert (link.speed_end_mps == 0.0) == (link.stop_probability_frac == 1.0)


def assert_limits_and_braking_kept(result, vehicle, length_m, limits_mps):
    way, speed = result.profile.distance_m, result.profile.speed_mps
    ends = np.cumsum(length_m)
    link = np.minimum(np.searchsorted(ends, way - 1e-9), length_m.size - 1)
    assert np.all(speed <= limits_mps[link] * (1.0 + 1e-9))
    # the way that stopping takes falls by at most a metre a metre: braking is that of the table or less
    bound, decel = vehicle.accel_speed_mps, -vehicle.decel_mps2
    to_stop = np.zeros_like(speed)
    for i, strength in enumerate(decel):
        high = bound[i + 1] if i + 1 < decel.size else np.inf
        inside = np.clip(speed, bound[i], high)
        to_stop += (inside**2 - bound[i] ** 2) / (2.0 * strength)
    assert np.all(-np.diff(to_stop) <= np.diff(way) + 1e-6)


@pytest.mark.parametrize("rule", CERTAIN_RULES)
def test_stop_count_is_that_of_the_fast_model(kona, rule):
    chain = hilly_chain(np.random.default_rng(8), 200)
    result, fast = simulate_timestep(kona, chain, stop_rule=rule), simulate_chain(kona, chain, stop_rule=rule)
    assert result.stop_count == fast.stop_count
    assert result.standstill_s == pytest.approx(fast.standstill_s)
    if rule is StopRule.CROSSINGS:
        asked = (chain.stop_probability_frac > 0.0) & (chain.stop_class % 4 >= Cross.MEDIUM)
        assert result.stop_count == np.count_nonzero(asked[:-1])


def long_chain():
    limits = np.array([50.0, 80.0, 100.0, 50.0, 130.0, 80.0]) / 3.6
    n = limits.size
    return Chain(
        length_m=np.full(n, 3000.0),
        grade_frac=np.array([0.01, -0.05, 0.04, -0.02, 0.0, 0.03]),
        speed_limit_mps=limits,
        stop_probability_frac=np.full(n, 0.3),
        stop_time_s=np.full(n, 10.0),
        stop_class=np.array([2, 0, 6, 3, 0, 0], np.int8),
        altitude_m=np.full(n, 900.0),
        heading=np.tile([0.6, 0.8], (n, 1)),
    )


@pytest.mark.parametrize("conditions", [STILL, ALL_EFFECTS], ids=["still", "all effects"])
def test_shrinking_steps_converge_to_the_fast_model_on_long_links(steady_kona, conditions):
    vehicle = dataclasses.replace(
        steady_kona,
        effects=dataclasses.replace(steady_kona.effects, drive_loss_w_per_n2=1e-4, regen_cap_w=15_000.0),
    )
    chain = long_chain()
    fast = simulate_chain(vehicle, chain, conditions=conditions, stop_rule=StopRule.CROSSINGS)
    errors = []
    for step_s in (1.0, 0.1, 0.01):
        drive = simulate_timestep(vehicle, chain, conditions=conditions, step_s=step_s)
        errors.append(abs(drive.energy_j / fast.energy_j - 1.0))
        assert drive.duration_s == pytest.approx(fast.duration_s, rel=1e-3 * step_s)
    assert errors[0] < 4e-3
    assert errors[1] < 4e-4
    assert errors[2] < 4e-5
    for name, part_j, fast_j in zip(
        PART_NAMES, dataclasses.astuple(drive.parts), dataclasses.astuple(fast.parts), strict=True
    ):
        assert part_j == pytest.approx(fast_j, abs=1e-4 * fast.energy_j), name


def test_table_of_many_intervals_differs_from_the_fast_models_mean_by_little(kona):
    chain = long_chain()
    fast = simulate_chain(kona, chain, stop_rule=StopRule.CROSSINGS)
    drive = simulate_timestep(kona, chain)
    assert drive.energy_j == pytest.approx(fast.energy_j, rel=0.02)
    assert (
        drive.energy_j < fast.energy_j
    )  # as the source found: at the table's own accelerations it is faster for less way


@pytest.mark.parametrize(
    ("conditions", "part"),
    [
        (Conditions(wind_speed_mps=8.0, wind_from_rad=0.64), "wind_j"),
        (Conditions(ambient_k=268.15), "cabin_j"),
        (Conditions(ambient_k=268.15), "battery_resistance_j"),
        (Conditions(ambient_k=268.15), "tyre_temperature_j"),
        (Conditions(regen_limited=True), "regen_limit_j"),
        (Conditions(payload_kg=300.0), "payload_j"),
        (Conditions(drag_factor=1.25), "drag_j"),
    ],
)
def test_effect_that_is_on_takes_energy_as_in_the_fast_model(steady_kona, conditions, part):
    strength = dataclasses.replace(steady_kona.effects, regen_cap_w=10_000.0)
    vehicle = dataclasses.replace(steady_kona, effects=strength)
    chain = long_chain()
    drive = simulate_timestep(vehicle, chain, conditions=conditions)
    fast = simulate_chain(vehicle, chain, conditions=conditions, stop_rule=StopRule.CROSSINGS)
    taken = getattr(drive.parts, part)
    assert taken > 0.0
    assert getattr(simulate_timestep(vehicle, chain).parts, part) == 0.0
    assert taken == pytest.approx(getattr(fast.parts, part), rel=1e-2)


def test_recuperation_fades_within_a_link_as_the_battery_fills(kona):
    descent = dataclasses.replace(
        long_chain(), grade_frac=np.full(6, -0.08), stop_probability_frac=np.zeros(6), speed_limit_mps=np.full(6, 20.0)
    )
    limited = Conditions(regen_limited=True)
    nearly_full = simulate_timestep(kona, descent, conditions=limited, soc_start_frac=0.98)
    half_full = simulate_timestep(kona, descent, conditions=limited, soc_start_frac=0.5)
    assert nearly_full.parts.regen_limit_j > half_full.parts.regen_limit_j
    assert nearly_full.energy_j > half_full.energy_j
    assert -nearly_full.energy_j < 0.02 * kona.usable_capacity_wh * 3600.0  # no more than fits
    taken = [link.energy_j for link in nearly_full.links]
    assert taken[1:-1] == sorted(taken[1:-1])  # the last one brakes to a stop


@pytest.mark.nojit
def test_rule_expected_is_refused(round_vehicle, make_chain):
    with pytest.raises(ConditionsError) as caught:
        simulate_timestep(round_vehicle, make_chain([100.0], 10.0), stop_rule=StopRule.EXPECTED)
    assert (caught.value.field, caught.value.value) == ("stop_rule", "expected")


@pytest.mark.nojit
@pytest.mark.parametrize("step_s", [0.0, -0.1, 2.0, math.nan])
def test_step_out_of_range_is_refused(round_vehicle, make_chain, step_s):
    with pytest.raises(ConditionsError, match="step_s"):
        simulate_timestep(round_vehicle, make_chain([100.0], 10.0), step_s=step_s)


@pytest.mark.nojit
def test_consumption_table_is_refused(make_chain):
    table = ConsumptionTableVehicle(**table_fields())
    with pytest.raises(ConditionsError, match="fast for vehicle 'table'"):
        simulate_timestep(table, make_chain([100.0], 10.0))


def table_fields():
    return {
        "id": "table",
        "name": "A table",
        "speed_mps": np.array([5.0, 30.0]),
        "consumption_j_per_m": np.array([400.0, 700.0]),
        "ascent_j_per_m": 20_000.0,
        "descent_j_per_m": 10_000.0,
        "aux_power_w": 500.0,
        "usable_capacity_wh": 40_000.0,
    }


@pytest.mark.nojit
def test_drive_of_too_many_steps_is_refused_before_it_begins(round_vehicle, make_chain):
    with pytest.raises(LinkError) as caught:
        simulate_timestep(round_vehicle, make_chain([10.0, 1e6], [10.0, 1e-3]))
    assert (caught.value.field, caught.value.position) == ("speed_limit_mps", 1)


def test_creeping_from_stop_to_stop_reaches_the_step_limit(round_vehicle, make_chain, monkeypatch):
    monkeypatch.setattr("energy.chain.timestep.STEP_LIMIT", 100)
    with pytest.raises(LinkError, match="at most 100 steps"):
        simulate_timestep(round_vehicle, make_chain([199.0], 20.0))


@pytest.mark.nojit
def test_profile_of_too_many_steps_is_refused_before_it_begins(round_vehicle, make_chain):
    # 200 km at 0.5 m/s is 4 million steps of 0.1 s: a drive without a profile may take them
    with pytest.raises(LinkError, match=r"at most 2000000 steps .* with a profile") as caught:
        simulate_timestep(round_vehicle, make_chain([10.0, 2e5], [10.0, 0.5]), profile=True)
    assert (caught.value.field, caught.value.position, caught.value.value) == ("speed_limit_mps", 1, 0.5)


@pytest.mark.nojit
def test_profile_has_a_lower_step_limit_than_a_drive(round_vehicle, make_chain, monkeypatch):
    monkeypatch.setattr("energy.chain.timestep.PROFILE_STEP_LIMIT", 100)
    chain = make_chain([199.0], 20.0)
    assert simulate_timestep(round_vehicle, chain).step_count > 100
    with pytest.raises(LinkError, match="at most 100 steps"):
        simulate_timestep(round_vehicle, chain, profile=True)


@pytest.mark.nojit
@pytest.mark.parametrize("length_m", [1e-9, 1e-4, 0.02])
def test_link_shorter_than_a_step_is_driven_from_rest_to_rest(round_vehicle, make_chain, length_m):
    result = simulate_timestep(round_vehicle, make_chain([length_m], 10.0))
    assert 0.0 < result.duration_s < 1.0
    assert result.links[0].speed_end_mps == 0.0
    assert result.parts.inertia_j == pytest.approx(0.0, abs=1e-9)
