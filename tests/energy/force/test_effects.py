"""Every effect: off to the bit by default, its hand-computed size, its sign, its limits, and parts that add up."""

from __future__ import annotations

import itertools
import math
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import quad

from energy.chain.chain import LinkModel, StopRule, simulate_chain
from energy.chain.timestep import simulate_timestep
from energy.conditions import STILL, Conditions, RoadSurface
from energy.force.effects import (
    REFERENCE_K,
    RESISTANCE_REFERENCE_K,
    LinkSetting,
    air_density_factor,
    cabin_power_w,
    drive_of,
    regen_limit,
    resistance_rise_ohm,
)
from energy.force.kernels_physics import accepted_j, cabin_energy_j
from energy.vehicle.coefficients import EffectCoefficients
from energy.vehicle.files import load_vehicle
from tests.energy.drives import energy_j, north

ROOT = Path(__file__).resolve().parents[3]
NORTH, SOUTH = 0.0, math.pi


# Off by default


@pytest.mark.nojit
@pytest.mark.parametrize("model", list(LinkModel))
@pytest.mark.parametrize("rule", list(StopRule))
def test_conditions_at_their_defaults_change_nothing_to_the_bit(kona, hilly, make_chain, model, rule):
    strange = replace(
        kona, effects=EffectCoefficients(rolling_temp_per_k=0.02, cabin_ua_w_per_k=900.0, battery_resistance_ohm=1.9)
    )
    plain = replace(hilly, altitude_m=None, heading=None)
    explicit = Conditions(ambient_k=None, climate=False, wind_from_rad=2.0, drag_factor=1.0, payload_kg=0.0)
    first = simulate_chain(kona, plain, link_model=model, stop_rule=rule)
    for vehicle, chain, conditions in ((kona, hilly, explicit), (strange, hilly, STILL), (strange, plain, explicit)):
        again = simulate_chain(vehicle, chain, conditions=conditions, link_model=model, stop_rule=rule)
        for a, b in zip(first.links, again.links, strict=True):
            assert (a.energy_j, a.duration_s, a.speed_end_mps) == (b.energy_j, b.duration_s, b.speed_end_mps)
            np.testing.assert_array_equal(a.parts_j, b.parts_j)
            np.testing.assert_array_equal(a.parts_j[8:], 0.0)


NEUTRAL = {
    "wind from nowhere": Conditions(wind_speed_mps=0.0, wind_from_rad=1.0),
    "no payload": Conditions(payload_kg=0.0),
    "no roof box": Conditions(drag_factor=1.0),
    "dry road": Conditions(road=RoadSurface.DRY),
    "speed of the limits": Conditions(speed_factor=1.0),
    "a top speed beyond all limits": Conditions(top_speed_mps=55.0),
    "the vehicle's own auxiliaries": Conditions(aux_power_w=520.0),
    "sea of thin air switched off": Conditions(altitude_density=False),
}


@pytest.mark.nojit
@pytest.mark.parametrize("name", NEUTRAL)
def test_a_condition_that_says_what_is_so_anyway_changes_nothing_to_the_bit(kona, hilly, name):
    assert kona.aux_power_w == 520.0
    assert energy_j(kona, hilly, NEUTRAL[name]) == energy_j(kona, hilly)


@pytest.mark.nojit
def test_reference_temperature_and_pressure_leave_road_load_and_battery_as_they_are(kona):
    at_reference = Conditions(ambient_k=REFERENCE_K, climate=False, altitude_density=False)
    setting = LinkSetting(np.zeros(1), np.array([20.0]), np.array([500.0]), np.array([[0.0, 1.0]]))
    still, now = (drive_of(kona, c).roads(setting, np.zeros(1)) for c in (STILL, at_reference))
    np.testing.assert_allclose(now, still, rtol=1e-15)
    assert resistance_rise_ohm(Conditions(ambient_k=RESISTANCE_REFERENCE_K), kona.effects) == 0.0


# Sizes by hand


@pytest.mark.nojit
def test_rolling_resistance_at_0_c_is_16_percent_higher(round_vehicle):
    # ISO 28580: 0.008/K · 20 K; A = 100 N
    roads = drive_of(round_vehicle, Conditions(ambient_k=273.15, climate=False, altitude_density=False)).roads(
        LinkSetting(np.zeros(1), np.array([10.0])), np.zeros(1)
    )
    assert roads[0, 1] == pytest.approx(116.0)
    # air: 293.15/273.15 = 1.07322
    assert roads[0, 3] == pytest.approx(0.5 * 293.15 / 273.15)


@pytest.mark.nojit
def test_air_of_the_standard_atmosphere_has_its_tabulated_density():
    # ISO 2533: 1.2250, 1.1117 and 1.0066 kg/m³ at 0, 1000 and 2000 m with 15.0, 8.5 and 2.0 °C; reference 1.1883 kg/m³
    reference = 100_000.0 / (287.053 * 293.15)
    for altitude_m, temp_k, density in ((0.0, 288.15, 1.2250), (1000.0, 281.65, 1.1117), (2000.0, 275.15, 1.0066)):
        factor = air_density_factor(Conditions(ambient_k=temp_k), np.array([altitude_m]))
        assert factor * reference == pytest.approx(density, rel=2e-4)


@pytest.mark.nojit
@pytest.mark.parametrize(
    ("wind_from", "air_mps"), [(NORTH, 30.0), (SOUTH, 10.0), (0.5 * math.pi, 20.0), (1.5 * math.pi, 20.0)]
)
def test_drag_in_wind_is_that_of_the_air_speed(round_vehicle, make_chain, wind_from, air_mps):
    # northbound at 20 m/s in 10 m/s of wind: F = 100 + 0.5·air², E = F·1000/0.8 + 600·50
    vehicle = replace(round_vehicle, effects=EffectCoefficients(yaw_drag_per_rad=0.0))
    chain = north(make_chain([1000.0], 20.0))
    windy = Conditions(wind_speed_mps=10.0, wind_from_rad=wind_from)
    result = simulate_chain(vehicle, chain, conditions=windy, start_speed_mps=20.0, arrive_stopped=False)
    assert result.energy_j == pytest.approx((100.0 + 0.5 * air_mps**2) * 1250.0 + 30_000.0)
    assert result.parts.wind_j == pytest.approx(0.5 * (air_mps**2 - 400.0) * 1000.0, abs=1e-6)


@pytest.mark.nojit
def test_side_wind_raises_drag_by_the_yaw_angle(round_vehicle, make_chain):
    # 10 m/s across 20 m/s: β = atan(0.5); C rises by 0.6·β
    windy = Conditions(wind_speed_mps=10.0, wind_from_rad=0.5 * math.pi)
    result = simulate_chain(
        round_vehicle, north(make_chain([1000.0], 20.0)), conditions=windy, start_speed_mps=20.0, arrive_stopped=False
    )
    assert result.parts.drag_j == pytest.approx(0.5 * 400.0 * 1000.0 * 0.6 * math.atan(0.5))


@pytest.mark.nojit
def test_a_storm_from_behind_pushes_at_most_as_hard_as_the_tyres_hold(round_vehicle, make_chain):
    # 20 m/s from behind at 2 m/s: 100 − 0.5·18² < 0, so the load is 0 and only the auxiliaries count
    storm = Conditions(wind_speed_mps=20.0, wind_from_rad=SOUTH)
    result = simulate_chain(
        round_vehicle, north(make_chain([100.0], 2.0)), conditions=storm, start_speed_mps=2.0, arrive_stopped=False
    )
    assert result.energy_j == pytest.approx(600.0 * 50.0)
    assert result.parts.total_j() == pytest.approx(result.energy_j)


@pytest.mark.nojit
def test_payload_rolls_climbs_and_gains_speed(round_vehicle, make_chain):
    # +100 kg on 1000 kg: A 100 → 110 N, weight +981 N, inertia +110 kg; 0 → 20 m/s, then 5 % up
    loaded = Conditions(payload_kg=100.0)
    chain = make_chain([80.0, 1000.0], 20.0, [0.0, 0.05])
    before, after = (simulate_chain(round_vehicle, chain, conditions=c, arrive_stopped=False) for c in (STILL, loaded))
    flat = math.sqrt(1.0 - 0.05**2)
    extra = 10.0 * (80.0 + 1000.0 * flat) + 981.0 * 0.05 * 1000.0 + 110.0 * 0.5 * 400.0
    assert after.energy_j - before.energy_j == pytest.approx(extra / 0.8)
    assert after.parts.payload_j == pytest.approx(extra)


@pytest.mark.nojit
def test_wet_and_snowy_roads_add_their_force(round_vehicle, make_chain):
    # wet: 0.001·9810 N + 0.8·20 N; snow: 0.008·9810 N; over 1000 m at 20 m/s
    chain = make_chain([1000.0], 20.0)
    for road, force_n in ((RoadSurface.WET, 9.81 + 16.0), (RoadSurface.SNOW, 78.48)):
        result = simulate_chain(
            round_vehicle, chain, conditions=Conditions(road=road), start_speed_mps=20.0, arrive_stopped=False
        )
        assert result.parts.road_surface_j == pytest.approx(force_n * 1000.0)


@pytest.mark.nojit
def test_cabin_heat_has_its_warm_up_transient(kona):
    # −5 °C, 26 K below 21 °C: 110·26 + 100 W to stay, 150·26 W at first, limited to 6000 W together
    cold = Conditions(ambient_k=268.15)
    steady_w, start_w, time_s = cabin_power_w(cold, kona.effects)
    assert time_s == 600.0
    assert steady_w == pytest.approx(110.0 * 26.0 + 100.0)
    assert start_w == pytest.approx(min(150.0 * 26.0, 6000.0 - steady_w))
    p = drive_of(kona, cold).physics
    for begin, end in ((0.0, 60.0), (300.0, 2000.0), (0.0, 1e5)):
        integral = quad(lambda t: steady_w + start_w * math.exp(-t / 600.0), begin, end, epsrel=1e-10, limit=400)[0]
        assert cabin_energy_j(p, begin, end) == pytest.approx(integral, rel=1e-8)
    # a cabin that is warm already needs the steady part only
    warm = cabin_power_w(replace(cold, cabin_start_k=294.15), kona.effects)
    assert warm[:2] == pytest.approx((steady_w, 0.0))
    assert cabin_power_w(Conditions(ambient_k=268.15, climate=False), kona.effects)[:2] == (0.0, 0.0)


def test_air_conditioning_on_the_sources_kinds_of_road_takes_what_the_page_says(make_chain):
    # Source, section III.D: 15 % in town, 3 to 8 % on the open road. The page holds what ours does, met or not.
    car = load_vehicle(ROOT / "data" / "vehicles" / "hyundai-kona-64.toml")
    page = (ROOT / "docs" / "effects.md").read_text(encoding="utf-8")
    rows = re.findall(r"^\| (\d+) °C \| ([\d.]+) % \| ([\d.]+) % \| ([\d.]+) % \|$", page, re.MULTILINE)
    assert [row[0] for row in rows] == ["24", "27", "30"]
    for ambient_c, *shown in rows:
        on = Conditions(ambient_k=273.15 + float(ambient_c), sun_w=300.0, cabin_start_k=294.15, altitude_density=False)
        roads = ((154, 538.0, 50.0, 21.0), (56, 1668.0, 80.0, 21.0), (5, 16_400.0, 120.0, 20.0))
        for (count, length, limit, wait), expected in zip(roads, shown, strict=True):
            chain = make_chain([length] * count, limit / 3.6, 0.0, 1.0, wait)
            share = energy_j(car, chain, on) / energy_j(car, chain, replace(on, climate=False)) - 1.0
            assert 100.0 * share == pytest.approx(float(expected), abs=0.0501)


@pytest.mark.nojit
def test_cold_battery_doubles_its_resistance_in_23_kelvin(round_vehicle, make_chain):
    # 0 °C: 23 K below 23 °C, so R rises by 0.09 Ω. 20 m/s: 300 N·20/0.8 + 600 W = 8100 W; 0.09/360²·8100²·50 s
    cold = Conditions(ambient_k=273.15, climate=False, altitude_density=False)
    vehicle = replace(round_vehicle, effects=EffectCoefficients(rolling_temp_per_k=0.0))
    chain = make_chain([1000.0], 20.0)
    result = simulate_chain(vehicle, chain, conditions=cold, start_speed_mps=20.0, arrive_stopped=False)
    power_w = (100.0 + 0.5 * 293.15 / 273.15 * 400.0) * 20.0 / 0.8 + 600.0
    assert result.parts.battery_resistance_j == pytest.approx(0.09 / 360.0**2 * power_w**2 * 50.0)


@pytest.mark.nojit
def test_cap_on_recuperation_limits_power_and_leaves_the_rest_to_the_brakes(round_vehicle, make_chain):
    # 10 % down at 20 m/s: F = 99.5 + 200 − 981 = −681.5 N, 6815 W at η = 0.5; capped at 5000 W for 50 s
    vehicle = replace(round_vehicle, effects=EffectCoefficients(regen_cap_w=5000.0))
    capped = Conditions(regen_limited=True)
    chain = make_chain([1000.0], 20.0, -0.1)
    result = simulate_chain(vehicle, chain, conditions=capped, start_speed_mps=20.0, arrive_stopped=False)
    assert result.energy_j == pytest.approx((600.0 - 5000.0) * 50.0)
    force_n = 100.0 * math.sqrt(0.99) + 200.0 - 981.0
    assert result.parts.regen_limit_j == pytest.approx((-force_n * 20.0 * 0.5 - 5000.0) * 50.0)


@pytest.mark.nojit
def test_battery_accepts_less_as_it_fills_and_never_turns_the_order_of_charges(kona):
    p = drive_of(kona, Conditions(regen_limited=True)).physics
    width = 0.1 * 64_000.0 * 3600.0
    # far from full: all; in the fading range: room·(1 − e^(−offered/width)); across its edge: both
    assert accepted_j(p, 0.0, -1e6, -10.0 * width) == -1e6
    assert accepted_j(p, 0.0, -width, -width) == pytest.approx(-width * (1.0 - math.exp(-1.0)))
    assert accepted_j(p, 0.0, -2.0 * width, -2.0 * width) == pytest.approx(-width - width * (1.0 - math.exp(-1.0)))
    assert accepted_j(p, 0.0, 5e5, -10.0) == 5e5
    assert accepted_j(p, 0.0, -1e9, 0.0) == 0.0
    for offered in (1e5, 1e7, 1e9):
        ends = [used + accepted_j(p, used, -offered, -width) for used in np.linspace(-width, 3.0 * width, 50)]
        assert all(a <= b for a, b in itertools.pairwise(ends))
        assert all(end >= -width for end in ends)


@pytest.mark.parametrize("soc", [0.9, 0.97, 0.99, 1.0])
def test_fading_recuperation_on_a_long_descent_is_that_of_time_steps(kona, make_chain, soc):
    # one link of 3 km, where a cap taken once at its start would let the battery overfill
    chain = make_chain([3000.0], 50.0 / 3.6, -0.08)
    small = replace(kona, usable_capacity_wh=18_800.0)
    limited = Conditions(regen_limited=True)
    way = {"conditions": limited, "stop_rule": StopRule.NONE, "start_speed_mps": 50.0 / 3.6, "arrive_stopped": False}
    fast = simulate_chain(small, chain, **way, soc_start_frac=soc)
    steps = simulate_timestep(small, chain, **way, soc_start_frac=soc)
    assert fast.energy_j == pytest.approx(steps.energy_j, rel=1e-6, abs=1.0)
    assert soc - fast.energy_j / (18_800.0 * 3600.0) <= 1.0


def test_cap_on_recuperation_fades_with_charge_and_cold(kona):
    strength = EffectCoefficients(regen_cap_w=40_000.0)
    assert regen_limit(STILL, strength, 64_000.0) == (math.inf, 0.0)
    cap_w, fade_j = regen_limit(Conditions(regen_limited=True), strength, 64_000.0)
    assert (cap_w, fade_j) == pytest.approx((40_000.0, 0.1 * 64_000.0 * 3600.0))
    for temp_k, share in ((283.15, 1.0), (270.65, 0.5), (258.15, 0.0), (250.0, 0.0)):
        cap_w, _ = regen_limit(Conditions(regen_limited=True, ambient_k=temp_k), strength, 64_000.0)
        assert cap_w == pytest.approx(share * 40_000.0)


def test_descent_from_a_full_battery_recuperates_less_than_from_half(kona, make_chain):
    chain = make_chain([500.0] * 20, 15.0, -0.06)
    limited = Conditions(regen_limited=True)
    free = energy_j(kona, chain)
    half, high, full = (energy_j(kona, chain, limited, soc_start_frac=soc) for soc in (0.5, 0.95, 1.0))
    assert free <= half < high < full
    assert full > -0.3 * abs(free)


@pytest.mark.nojit
def test_load_loss_grows_with_the_square_of_the_force(round_vehicle, make_chain):
    # 0 → 20 m/s in 80 m, 8 s: F = 2850 + 0.5·v², v = 2.5t. ∫F² dt = 2850²·8 + 2·2850·0.5·∫v² + 0.25·∫v⁴
    vehicle = replace(round_vehicle, effects=EffectCoefficients(drive_loss_w_per_n2=1e-3))
    result = simulate_chain(vehicle, make_chain([80.0], 20.0), arrive_stopped=False)
    integral = 2850.0**2 * 8.0 + 2850.0 * 20.0**3 / 7.5 + 0.25 * 20.0**5 / 12.5
    assert result.parts.load_loss_j == pytest.approx(1e-3 * integral)


@pytest.mark.nojit
def test_speed_factor_and_top_speed_set_the_driven_speed(round_vehicle, make_chain):
    chain = make_chain([1000.0] * 2, [20.0, 30.0])
    slow, capped = (
        simulate_chain(round_vehicle, chain, conditions=c, start_speed_mps=10.0, arrive_stopped=False)
        for c in (Conditions(speed_factor=0.5), Conditions(top_speed_mps=12.0))
    )
    assert [link.speed_end_mps for link in slow.links] == [10.0, 15.0]
    assert [link.speed_end_mps for link in capped.links] == [12.0, 12.0]
