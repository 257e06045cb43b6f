"""Tyres that warm up, a cabin that is cooled, the strength of thin air, limits of recuperation of a vehicle."""

from __future__ import annotations

import itertools
import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import quad

from energy.chain.chain import LinkModel, StopRule, simulate_chain
from energy.chain.timestep import simulate_timestep
from energy.conditions import STILL, Conditions, RoadSurface
from energy.errors import ConditionsError
from energy.force.effects import LinkSetting, cabin_power_w, drive_of, regen_limit
from energy.force.kernels_force import battery_power
from energy.force.kernels_physics import accepted_j, road_in_time
from energy.force.parts import PART_NAMES
from energy.replay.replay import DrivenProfile, replay
from energy.vehicle.coefficients import EffectCoefficients
from tests.energy.drives import energy_j

MANY = settings(max_examples=100, deadline=None)
COLD = Conditions(ambient_k=270.0, climate=False, payload_kg=200.0)


def with_effects(vehicle, **coefficients):
    return replace(vehicle, effects=EffectCoefficients(**coefficients))


# Tyres that warm up


@pytest.mark.nojit
def test_cold_tyres_take_their_share_of_rolling_resistance_as_it_decays(round_vehicle, make_chain):
    # 20 m/s: 50 s a link of 1000 m; A = 100 N, ΔC = 0.3, τ = 100 s: 30 N · 20 m/s · ∫e^(−t/100) dt = 60 kJ·(1 − e^(−½))
    cold = with_effects(round_vehicle, tyre_warm_up_frac=0.3, tyre_time_s=100.0)
    chain = make_chain([1000.0, 1000.0], 20.0)
    moving = {"start_speed_mps": 20.0, "arrive_stopped": False}
    warm, result = (simulate_chain(v, chain, **moving) for v in (round_vehicle, cold))
    first = 30.0 * 20.0 * 100.0 * (1.0 - math.exp(-0.5))
    parts = [link.parts_j[PART_NAMES.index("tyre_warm_up")] for link in result.links]
    assert parts == pytest.approx([first, first * math.exp(-0.5)])
    assert result.energy_j - warm.energy_j == pytest.approx((1.0 + math.exp(-0.5)) * first / 0.8)
    assert result.parts.rolling_j == pytest.approx(warm.parts.rolling_j)


@pytest.mark.nojit
def test_cold_tyres_are_those_of_the_temperature_and_load_but_not_of_the_wet_road(round_vehicle, make_chain):
    # 253.15 K: 1 + 0.008·40; +20 % load: 100 N · 1.32 · 1.2, of which half is added at departure
    cold = with_effects(round_vehicle, tyre_warm_up_frac=0.5)
    drive = drive_of(cold, Conditions(ambient_k=253.15, climate=False, payload_kg=200.0, road=RoadSurface.WET))
    roads = drive.roads(LinkSetting(np.array([0.6]), np.array([20.0])), np.zeros(1))
    now, later = (road_in_time(drive.physics, roads, 0, at, 0.0).rolling_n for at in (0.0, 600.0))
    warm = 0.8 * (132.0 + 9.81) * 1.2
    assert now == pytest.approx(warm + 0.8 * 0.5 * 132.0 * 1.2)
    assert later == pytest.approx(warm + 0.8 * 0.5 * 132.0 * 1.2 * math.exp(-1.0))


@MANY
@given(shares=st.lists(st.floats(0.0, 2.0), min_size=2, max_size=2), time_s=st.floats(10.0, 36_000.0))
def test_energy_never_falls_with_the_share_of_the_warm_up(kona, hilly, shares, time_s):
    less, more = (with_effects(kona, tyre_warm_up_frac=share, tyre_time_s=time_s) for share in sorted(shares))
    for conditions in (STILL, COLD):
        assert energy_j(less, hilly, conditions) <= energy_j(more, hilly, conditions) * (1.0 + 1e-12)


@MANY
@given(times=st.lists(st.floats(1.0, 36_000.0), min_size=2, max_size=2))
def test_energy_never_falls_with_the_time_of_the_warm_up(kona, hilly, times):
    less, more = (with_effects(kona, tyre_warm_up_frac=0.4, tyre_time_s=time_s) for time_s in sorted(times))
    assert energy_j(less, hilly) <= energy_j(more, hilly) * (1.0 + 1e-12)


def test_warm_up_of_endless_time_is_a_higher_rolling_resistance(kona, hilly):
    # the limit τ → ∞ is A·(1 + ΔC): what is missing halves with every doubling of τ
    heavier = energy_j(replace(kona, road_load_a_n=1.25 * kona.road_load_a_n), hilly)
    missing = [
        heavier - energy_j(with_effects(kona, tyre_warm_up_frac=0.25, tyre_time_s=time_s), hilly)
        for time_s in (9000.0, 18_000.0, 36_000.0)
    ]
    assert 0.0 < missing[2] < missing[1] < missing[0] < 0.2 * (heavier - energy_j(kona, hilly))
    assert missing[1] / missing[2] == pytest.approx(2.0, rel=0.05)


@pytest.mark.nojit
def test_link_divided_in_pieces_takes_what_it_takes_whole(kona, make_chain):
    cold = with_effects(kona, tyre_warm_up_frac=0.6, tyre_time_s=150.0)
    moving = {"start_speed_mps": 25.0, "arrive_stopped": False}
    whole = energy_j(cold, make_chain([8000.0], 25.0, 0.01), **moving)
    pieces = energy_j(cold, make_chain([500.0, 3000.0, 4500.0], 25.0, 0.01), **moving)
    assert pieces == pytest.approx(whole, rel=1e-12)


@pytest.mark.nojit
@pytest.mark.parametrize("model", list(LinkModel))
def test_warm_up_shows_in_its_own_part_and_in_the_drivetrains_loss(kona, hilly, model):
    cold = with_effects(kona, tyre_warm_up_frac=0.3)
    plain, result = (simulate_chain(v, hilly, link_model=model).parts for v in (kona, cold))
    changed = {n for n in PART_NAMES if getattr(result, f"{n}_j") != pytest.approx(getattr(plain, f"{n}_j"), rel=1e-9)}
    assert changed == {"tyre_warm_up", "drivetrain_loss", "recuperation_loss"}
    assert plain.tyre_warm_up_j == 0.0
    assert 0.0 < result.tyre_warm_up_j < 0.3 * result.rolling_j


def driven(chain):
    """20 m/s over time for as long as a flat chain takes."""
    time_s = np.arange(0.0, float(chain.length_m.sum()) / 20.0 + 0.5)
    return DrivenProfile(time_s=time_s, speed_mps=np.full(time_s.size, 20.0))


def test_chain_time_steps_and_replay_agree_on_cold_tyres(kona, make_chain):
    cold = with_effects(kona, tyre_warm_up_frac=0.4, tyre_time_s=200.0)
    chain = make_chain([2000.0, 4000.0, 3000.0], 20.0)
    moving = {"start_speed_mps": 20.0, "arrive_stopped": False, "stop_rule": StopRule.NONE}
    fast = simulate_chain(cold, chain, **moving)
    steps = simulate_timestep(cold, chain, **moving)
    again = replay(cold, driven(chain))
    assert fast.parts.tyre_warm_up_j > 0.05 * fast.parts.rolling_j
    for other in (steps, again):
        assert other.parts.tyre_warm_up_j == pytest.approx(fast.parts.tyre_warm_up_j, rel=1e-6)
        assert other.energy_j == pytest.approx(fast.energy_j, rel=1e-6)
        assert other.parts.total_j() == pytest.approx(other.energy_j, rel=1e-12)


def test_replay_of_a_drive_that_stops_warms_its_tyres_by_the_clock(kona):
    speed = np.concatenate((np.full(200, 15.0), np.zeros(300), np.full(200, 15.0)))
    cold = with_effects(kona, tyre_warm_up_frac=0.5, tyre_time_s=400.0)
    warm = replay(cold, DrivenProfile(time_s=np.arange(700.0), speed_mps=speed)).step_parts_j[
        :, PART_NAMES.index("tyre_warm_up")
    ]
    assert np.all(warm[200:499] == 0.0)
    rolling_w = 0.5 * kona.road_load_a_n * 15.0
    assert warm[600] == pytest.approx(rolling_w * quad(lambda t: math.exp(-t / 400.0), 600.0, 601.0)[0], rel=1e-9)


# A cabin that is cooled


@pytest.mark.nojit
def test_cooling_has_its_own_target_start_and_time(kona):
    # 35 °C in the cabin and outside, cooled to 26 °C: 110·9 W and 400·9 W over COP 2.5; a fan of 100 W for 1 kW
    own = {"cooling_target_k": 299.15, "cooling_soak_w_per_k": 400.0, "cooling_time_s": 240.0}
    strength = EffectCoefficients(**own)
    power = cabin_power_w(Conditions(ambient_k=308.15), strength)
    assert power == pytest.approx((110.0 * 9.0 / 2.5 + 99.0, 400.0 * 9.0 / 2.5, 240.0))
    # heating is what it is without them
    cold = Conditions(ambient_k=268.15)
    assert cabin_power_w(cold, strength) == cabin_power_w(cold, EffectCoefficients())
    # a hot cabin on a cool day is cooled at the start, with cooling's own time
    assert cabin_power_w(Conditions(ambient_k=283.15, cabin_start_k=309.15), strength)[1:] == pytest.approx(
        (1600.0, 240.0)
    )


@pytest.mark.nojit
def test_between_heating_and_cooling_nothing_is_needed(kona):
    strength = EffectCoefficients(cabin_target_k=292.15, cooling_target_k=298.15)
    for ambient_k in (292.15, 295.0, 298.15):
        assert cabin_power_w(Conditions(ambient_k=ambient_k), strength)[:2] == (0.0, 0.0)
    # 110 W/K: 500 W of sun need no cooling up to 4.5 K below its target, and replace heat
    sunny = [cabin_power_w(Conditions(ambient_k=t, sun_w=500.0), strength)[0] for t in (287.7, 290.0, 293.5, 293.7)]
    assert sunny[1:3] == [0.0, 0.0]
    assert 0.0 < sunny[3] < 15.0
    assert sunny[0] == 0.0


@MANY
@given(
    temps=st.lists(st.floats(220.0, 330.0), min_size=2, max_size=2),
    band_k=st.floats(0.0, 15.0),
    soak=st.floats(0.0, 1000.0),
    sun_w=st.floats(0.0, 1500.0),
)
def test_climate_power_never_falls_with_distance_from_the_band_of_comfort(temps, band_k, soak, sun_w):
    strength = EffectCoefficients(
        cooling_target_k=294.15 + band_k, cooling_soak_w_per_k=soak, cooling_time_s=90.0, climate_limit_w=1e5
    )
    low, high = sorted(temps)
    at_low, at_high = (cabin_power_w(Conditions(ambient_k=t, sun_w=sun_w), strength) for t in (low, high))
    if high <= 294.15 - sun_w / 110.0:
        assert at_low[0] >= at_high[0]
        assert at_low[1] >= at_high[1]
    if low >= 294.15 + band_k:
        assert at_low[0] <= at_high[0]
        assert at_low[1] <= at_high[1]


@pytest.mark.nojit
def test_cooling_below_heating_is_refused():
    with pytest.raises(ConditionsError) as caught:
        EffectCoefficients(cooling_target_k=290.0)
    assert (caught.value.field, caught.value.value) == ("effects.cooling_target_k", 290.0)
    assert caught.value.allowed == "at least cabin_target_k, 294.15"


# The strength of the air's density


@pytest.mark.nojit
def test_strength_of_the_airs_density_scales_its_part_and_0_switches_it_off(kona, hilly):
    high = Conditions(ambient_k=285.0, climate=False)
    still = simulate_chain(kona, hilly, conditions=high).parts
    half, none = (
        simulate_chain(with_effects(kona, air_density_coef=coef), hilly, conditions=high).parts for coef in (0.5, 0.0)
    )
    assert half.air_density_j == pytest.approx(0.5 * still.air_density_j)
    assert none.air_density_j == 0.0
    assert none.aero_j == pytest.approx(still.aero_j)


def test_thin_air_of_any_strength_never_pushes(kona, make_chain):
    chain = replace(make_chain([5000.0], 30.0), altitude_m=np.array([5000.0]))
    thin = Conditions(altitude_density=True)
    energies = [energy_j(with_effects(kona, air_density_coef=coef), chain, thin) for coef in (0.0, 1.0, 2.0, 3.0)]
    assert all(a >= b for a, b in itertools.pairwise(energies))
    parts = simulate_chain(with_effects(kona, air_density_coef=3.0), chain, conditions=thin).parts
    assert parts.aero_j + parts.air_density_j >= 0.0


# Limits of recuperation that are the vehicle's own


def test_vehicle_that_is_always_limited_needs_no_condition(kona, hilly):
    always = with_effects(kona, regen_cap_w=8000.0, regen_always_limited=True)
    asked = with_effects(kona, regen_cap_w=8000.0)
    limited = Conditions(regen_limited=True)
    assert energy_j(always, hilly) == energy_j(asked, hilly, limited) == energy_j(always, hilly, limited)
    assert energy_j(asked, hilly) == energy_j(kona, hilly)
    assert regen_limit(STILL, always.effects, 64_000.0)[0] == 8000.0
    p = drive_of(always).physics
    assert accepted_j(p, 0.0, -1e6, -1e6) > -1e6  # it fades near a full battery


@pytest.mark.nojit
def test_braking_below_the_least_speed_gives_nothing_back(round_vehicle, make_chain):
    # 30 → 0 m/s at the mean of 4, 3, 2 = 3 m/s²: F = 100 + 0.5·v² − 3300 N; above 6 m/s η = 0.5 of it comes back
    slow = with_effects(round_vehicle, regen_min_speed_mps=6.0)
    chain = make_chain([150.0], 30.0)
    free, limited = (simulate_chain(v, chain, start_speed_mps=30.0) for v in (round_vehicle, slow))
    lost = quad(lambda v: 0.5 * (3200.0 - 0.5 * v * v) * v / 3.0, 0.0, 6.0)[0]
    assert limited.energy_j - free.energy_j == pytest.approx(lost)
    assert limited.parts.regen_limit_j == pytest.approx(lost)
    assert limited.parts.total_j() == pytest.approx(limited.energy_j)


@pytest.mark.nojit
def test_rolling_downhill_slower_than_the_least_speed_gives_nothing_back(round_vehicle, make_chain):
    # 10 % down at 5 m/s: braked away, so that only the auxiliaries count; at 6 m/s and above it comes back
    slow = with_effects(round_vehicle, regen_min_speed_mps=6.0)
    for speed, gives in ((5.0, False), (6.0, True), (7.0, True)):
        chain = make_chain([100.0], speed, -0.1)
        moving = {"start_speed_mps": speed, "arrive_stopped": False}
        free, limited = (energy_j(v, chain, **moving) for v in (round_vehicle, slow))
        assert limited == pytest.approx(free if gives else 600.0 * 100.0 / speed)
    p = drive_of(slow).physics
    road = road_in_time(p, np.array([[-0.1, 100.0, 0.0, 0.5, 0.0, 0.0, 0.0, 0.0]]), 0, 0.0, 0.0)
    assert battery_power(p, road, 5.9, 0.0) == 600.0
    assert battery_power(p, road, 6.0, 0.0) < 0.0


@MANY
@given(speeds=st.lists(st.floats(0.0, 15.0), min_size=2, max_size=2), model=st.sampled_from(list(LinkModel)))
def test_energy_never_falls_with_the_least_speed_of_recuperation(kona, hilly, speeds, model):
    less, more = (with_effects(kona, regen_min_speed_mps=speed) for speed in sorted(speeds))
    low, high = (energy_j(vehicle, hilly, link_model=model) for vehicle in (less, more))
    assert energy_j(kona, hilly, link_model=model) <= low * (1.0 + 1e-12)
    assert low <= high * (1.0 + 1e-12)


@pytest.mark.nojit
@pytest.mark.parametrize("rule", [StopRule.CROSSINGS, StopRule.NONE])
def test_time_steps_with_everything_learned_add_up(kona, hilly, rule):
    learned = with_effects(
        kona,
        tyre_warm_up_frac=0.3,
        regen_min_speed_mps=3.0,
        regen_always_limited=True,
        regen_cap_w=20_000.0,
        air_density_coef=0.8,
    )
    result = simulate_timestep(learned, hilly, conditions=COLD, stop_rule=rule, soc_start_frac=0.96, step_s=0.5)
    assert result.parts.tyre_warm_up_j > 0.0
    assert result.parts.regen_limit_j > 0.0
    for link in result.links:
        assert link.parts_j.sum() == pytest.approx(link.energy_j, rel=1e-9, abs=1e-6)
