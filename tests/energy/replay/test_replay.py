"""Replay of a driven speed and height: the route model's own numbers, conserved energy, heights that telescope."""

from __future__ import annotations

import dataclasses
import math
from pathlib import Path

import numpy as np
import pytest

from energy.chain.chain import simulate_chain
from energy.conditions import STILL, Conditions
from energy.errors import ConditionsError
from energy.force.effects import drive_of
from energy.force.kernels_force import battery_power
from energy.force.kernels_physics import cabin_energy_j, road_at
from energy.replay.replay import DrivenProfile, DrivenProfileError, graded, replay, smoothed_height_m
from energy.vehicle.files import load_vehicle

VEHICLES = Path(__file__).resolve().parents[3] / "data" / "vehicles"
COLD = Conditions(ambient_k=268.15)
WINDY = Conditions(wind_speed_mps=9.0, wind_from_rad=math.pi)  # from the south


def profile(speed_mps, step_s=1.0, **channels):
    speed = np.asarray(speed_mps, np.float64)
    return DrivenProfile(step_s * np.arange(speed.size), speed, **channels)


def town(seconds=600, seed=3):
    """Speeds of a drive with stops, 0 at both ends, and heights that wander."""
    random = np.random.default_rng(seed)
    speed = np.clip(
        12.0 * np.sin(np.arange(seconds) / 25.0) + random.normal(0.0, 0.4, seconds).cumsum() * 0.1, 0.0, 30.0
    )
    speed[0] = speed[-1] = 0.0
    return speed, 500.0 + 20.0 * np.sin(np.arange(seconds) / 90.0)


# the route model's numbers


@pytest.mark.nojit
@pytest.mark.parametrize("conditions", [STILL, COLD])
@pytest.mark.parametrize("grade", [0.0, 0.03, -0.05])
def test_constant_speed_takes_what_the_route_model_s_cruise_takes(kona, make_chain, conditions, grade):
    speed = 20.0
    chain = dataclasses.replace(make_chain([1000.0], speed, grade), altitude_m=np.array([0.0]))
    cruise = simulate_chain(kona, chain, conditions=conditions, start_speed_mps=speed, arrive_stopped=False)
    driven = replay(
        kona,
        profile(np.full(51, speed), grade_frac=np.full(50, grade), altitude_m=np.zeros(50)),
        conditions=conditions,
    )
    assert driven.distance_m == pytest.approx(1000.0)
    assert driven.energy_j == pytest.approx(cruise.energy_j, rel=1e-9)
    for field in dataclasses.fields(driven.parts):
        ours, theirs = getattr(driven.parts, field.name), getattr(cruise.parts, field.name)
        assert ours == pytest.approx(theirs, rel=1e-9, abs=1e-6)


@pytest.mark.parametrize("vehicle_id", ["hyundai-kona-64", "toyota-corolla-petrol"])
def test_a_link_driven_as_the_route_model_plans_it_takes_the_same(vehicle_id, make_chain):
    # from rest to 15 m/s, cruise and stop again: the three phases of the link, sampled at their ends and in between
    vehicle = load_vehicle(VEHICLES / f"{vehicle_id}.toml")
    simple = dataclasses.replace(
        vehicle, accel_speed_mps=np.array([0.0, 50.0]), accel_mps2=np.array([1.5]), decel_mps2=np.array([-2.5])
    )
    # 15²/(2·1.5) = 75 m, 15²/(2·2.5) = 45 m, 150 m in between
    link = simulate_chain(simple, make_chain([270.0], 15.0, 0.02))
    time_s = np.array([0.0, 4.0, 10.0, 15.0, 20.0, 22.0, 26.0])
    speed = np.array([0.0, 6.0, 15.0, 15.0, 15.0, 10.0, 0.0])
    driven = replay(simple, DrivenProfile(time_s, speed, grade_frac=np.full(6, 0.02)))
    assert driven.distance_m == pytest.approx(270.0)
    assert driven.duration_s == link.duration_s == pytest.approx(26.0)
    assert driven.energy_j == pytest.approx(link.energy_j, rel=1e-9)


def test_consumption_table_takes_its_value_the_height_and_the_change_of_speed():
    table = load_vehicle(VEHICLES / "example-here-table.toml")
    driven = replay(table, profile([10.0, 10.0, 14.0], grade_frac=np.array([0.02, -0.02])))
    # 10 m at 10 m/s, 12 m at 12 m/s; 0.2 m up, 0.24 m down; ½·(14² − 10²) = 48 m²/s² gained; 2 s
    value = table.consumption_at(np.array([10.0, 12.0]))
    expected = 10.0 * value[0] + 12.0 * value[1] + 0.2 * table.ascent_j_per_m - 0.24 * table.descent_j_per_m
    expected += 48.0 * table.kinetic_up_kg + 2.0 * table.aux_power_w
    assert driven.energy_j == pytest.approx(expected)


def test_power_of_a_short_step_is_that_of_the_moment(kona):
    step_s, speed, accel = 1e-4, 15.0, 0.8
    driven = replay(kona, profile([speed, speed + accel * step_s], step_s, grade_frac=np.array([0.01])))
    drive = drive_of(kona)
    table = np.zeros((1, 8))
    flat = math.sqrt(1.0 - 0.01**2)
    table[0, :4] = 0.01, kona.road_load_a_n * flat, kona.road_load_b_n_per_mps, kona.road_load_c_n_per_mps2
    moment = battery_power(drive.physics, road_at(table, 0), speed, accel)
    assert driven.power_w[0] == pytest.approx(moment, rel=1e-4)


def test_standing_takes_auxiliaries_and_climate_only(kona):
    driven = replay(kona, profile(np.zeros(601)), conditions=COLD)
    drive = drive_of(kona, COLD)
    idle_w = drive.physics.aux_idle_w
    assert driven.standstill_s == 600.0
    assert driven.parts.cabin_j == pytest.approx(cabin_energy_j(drive.physics, 0.0, 600.0))
    assert driven.parts.auxiliary_j == pytest.approx(600.0 * idle_w)
    resistive_j = 600.0 * drive.physics.loss_per_w * idle_w**2
    assert driven.energy_j == pytest.approx(driven.parts.cabin_j + 600.0 * idle_w + resistive_j)


# energy is conserved


@pytest.mark.parametrize("conditions", [STILL, COLD, Conditions(ambient_k=268.15, regen_limited=True)])
def test_parts_add_up_step_by_step_and_over_the_drive(kona, conditions):
    speed, elevation = town()
    driven = replay(kona, profile(speed, elevation_m=elevation), conditions=conditions, soc_start_frac=0.97)
    assert driven.step_parts_j.sum(axis=1) == pytest.approx(driven.step_energy_j, abs=1e-6)
    assert driven.parts.total_j() == pytest.approx(driven.energy_j)
    assert driven.step_energy_j == pytest.approx(driven.power_w * 1.0)
    assert driven.energy_j == driven.step_energy_j.sum()


def test_kinetic_and_potential_energy_telescope(kona):
    speed, elevation = town()
    speed[-1] = 17.0
    driven = replay(kona, profile(speed, elevation_m=elevation))
    kinetic_j = 0.5 * kona.mass_kg * kona.rotating_mass_coef * 17.0**2
    standing = np.flatnonzero(np.cumsum(speed) > 0.0)[0]
    climb_m = elevation[-1] - elevation[:standing].mean()
    assert driven.parts.inertia_j == pytest.approx(kinetic_j)
    assert driven.parts.grade_j == pytest.approx(kona.mass_kg * 9.81 * climb_m, rel=1e-6)
    assert driven.dissipated_j == pytest.approx(driven.energy_j - kinetic_j - driven.parts.grade_j)


def test_every_step_takes_at_least_what_it_stores(kona):
    # MODEL: E ≥ α·(m·g·Δh + ½·m·d·Δv²) for α between η_chg and 1/η_dis
    speed, elevation = town()
    driven = replay(kona, profile(speed, elevation_m=elevation))
    stored_j = driven.step_parts_j[:, 3] + driven.step_parts_j[:, 4]
    for alpha in (kona.recuperation_eff, 1.0, 1.0 / kona.drive_eff):
        assert bool((driven.step_energy_j >= alpha * stored_j - 1e-6).all())


def test_lossless_vehicle_in_a_vacuum_gets_all_of_it_back(kona):
    ideal = dataclasses.replace(
        kona,
        road_load_a_n=0.0,
        road_load_b_n_per_mps=0.0,
        road_load_c_n_per_mps2=0.0,
        drive_eff=1.0,
        recuperation_eff=1.0,
        aux_power_w=0.0,
    )
    speed, elevation = town()
    driven = replay(ideal, profile(speed, elevation_m=elevation))
    assert driven.energy_j == pytest.approx(driven.parts.grade_j, abs=1e-3)


def test_finer_samples_of_the_same_motion_take_the_same(kona):
    # speed is linear between samples, so samples in between change nothing
    speed, _ = town()
    coarse = profile(speed)
    fine_s = np.arange(0.0, speed.size - 1 + 1e-9, 0.25)
    fine = DrivenProfile(fine_s, np.interp(fine_s, coarse.time_s, speed))
    assert replay(kona, fine).energy_j == pytest.approx(replay(kona, coarse).energy_j, rel=1e-9)


# conditions on the way


def test_air_temperature_of_the_way_is_that_of_the_conditions_where_it_is_one(kona):
    speed, elevation = town()
    given = replay(kona, profile(speed, elevation_m=elevation), conditions=COLD)
    recorded = replay(kona, profile(speed, elevation_m=elevation, ambient_k=np.full(speed.size, 268.0)))
    nearly = replay(kona, profile(speed, elevation_m=elevation), conditions=Conditions(ambient_k=268.0))
    assert recorded.energy_j == pytest.approx(nearly.energy_j, rel=1e-9)
    assert recorded.energy_j > given.energy_j  # colder by 0.15 K


def test_drive_out_of_the_warmth_takes_what_lies_between(kona):
    speed, _ = town()
    ends = [
        replay(kona, profile(speed), conditions=Conditions(ambient_k=k, cabin_start_k=285.0)) for k in (285.0, 265.0)
    ]
    ambient_k = np.linspace(285.0, 265.0, speed.size)
    between = replay(kona, profile(speed, ambient_k=ambient_k))
    assert ends[0].energy_j < between.energy_j < ends[1].energy_j


def test_two_air_temperatures_are_refused(kona):
    with pytest.raises(ConditionsError, match=r"conditions\.ambient_k is 268\.15"):
        replay(kona, profile([1.0, 1.0], ambient_k=np.full(2, 270.0)), conditions=COLD)


def test_wind_takes_more_against_the_heading_than_along_it(kona):
    speed = np.full(101, 20.0)
    south, north = np.tile([0.0, -1.0], (100, 1)), np.tile([0.0, 1.0], (100, 1))
    against = replay(kona, profile(speed, heading=south), conditions=WINDY)
    along = replay(kona, profile(speed, heading=north), conditions=WINDY)
    calm = replay(kona, profile(speed))
    assert along.energy_j < calm.energy_j < against.energy_j
    with pytest.raises(ConditionsError, match="heading"):
        replay(kona, profile(speed), conditions=WINDY)


def test_full_battery_takes_less_back_where_recuperation_is_limited(kona):
    braking = profile(np.linspace(30.0, 0.0, 16))
    limited = Conditions(regen_limited=True)
    full, half = (replay(kona, braking, conditions=limited, soc_start_frac=soc) for soc in (1.0, 0.5))
    assert half.energy_j < full.energy_j
    assert full.parts.regen_limit_j > half.parts.regen_limit_j


# heights


@pytest.mark.nojit
def test_constant_grade_stays_as_it_is_up_to_both_ends():
    distance_m = np.linspace(0.0, 1000.0, 101)
    height = smoothed_height_m(distance_m, 400.0 + 0.05 * distance_m, 200.0)
    assert height == pytest.approx(400.0 + 0.05 * distance_m)


@pytest.mark.parametrize("window_m", [0.0, 20.0, 200.0, 5000.0])
def test_first_and_last_height_stay(window_m):
    distance_m = np.cumsum(np.random.default_rng(1).uniform(0.0, 20.0, 80))
    elevation_m = np.round(500.0 + 15.0 * np.sin(distance_m / 150.0))
    height = smoothed_height_m(distance_m, elevation_m, window_m)
    assert (height[0], height[-1]) == (elevation_m[0], elevation_m[-1])


def test_mean_over_the_window_is_that_of_a_fine_sum():
    distance_m = np.arange(0.0, 2001.0, 25.0)
    elevation_m = np.round(20.0 * np.sin(distance_m / 300.0))
    height = smoothed_height_m(distance_m, elevation_m, 200.0)
    fine = np.linspace(-100.0, 100.0, 20_001)
    for k in (10, 40, 60):
        around = np.interp(distance_m[k] + fine, distance_m, elevation_m)
        assert height[k] == pytest.approx(np.trapezoid(around, fine) / 200.0, abs=1e-6)


def test_whole_metres_are_smoothed_into_small_grades():
    # a 1 m step on a flat road: 1 m over 200 m instead of 1 m over one sample
    distance_m = np.arange(0.0, 2000.0, 10.0)
    elevation_m = np.where(distance_m < 1000.0, 100.0, 101.0)
    grade = np.diff(smoothed_height_m(distance_m, elevation_m, 200.0)) / 10.0
    assert np.abs(grade).max() <= 1.0 / 200.0 + 1e-12


def test_heights_at_standstill_are_one_height(kona):
    # the sensor settles by 3 m while the car stands
    speed = np.concatenate((np.zeros(50), np.full(200, 10.0)))
    elevation_m = np.concatenate((np.linspace(503.0, 500.0, 50), np.full(200, 501.5)))
    driven = replay(kona, profile(speed, elevation_m=elevation_m))
    assert driven.step_parts_j[:49, 3] == pytest.approx(0.0)
    assert driven.parts.grade_j == pytest.approx(0.0, abs=1e-6)


def test_graded_profile_is_replayed_as_the_one_with_elevation(kona):
    speed, elevation = town()
    given = profile(speed, elevation_m=elevation)
    prepared = graded(given)
    assert prepared.elevation_m is None
    assert replay(kona, prepared, conditions=COLD).energy_j == replay(kona, given, conditions=COLD).energy_j
    assert graded(prepared) is prepared


def test_step_steeper_than_vertical_is_refused(kona):
    given = profile([0.0, 1.0, 1.0], elevation_m=np.array([0.0, 0.0, 30.0]))
    with pytest.raises(DrivenProfileError, match=r"elevation_m at sample 1 is 30\.00 m higher a step of 1\.00 m later"):
        replay(kona, given, smoothing_m=0.0)


# profiles that are refused


@pytest.mark.nojit
@pytest.mark.parametrize(
    ("field", "position", "changes"),
    [
        ("time_s", 0, {"time_s": np.array([0.0]), "speed_mps": np.array([0.0])}),
        ("time_s", 2, {"time_s": np.array([0.0, 1.0, 1.0])}),
        ("time_s", 1, {"time_s": np.array([0.0, np.nan, 1.0])}),
        ("speed_mps", 1, {"speed_mps": np.array([0.0, -0.1, 0.0])}),
        ("speed_mps", 2, {"speed_mps": np.array([0.0, 1.0, 60.0])}),
        ("speed_mps", 0, {"speed_mps": np.zeros(4)}),
        ("elevation_m", 1, {"elevation_m": np.array([0.0, np.nan, 0.0])}),
        ("grade_frac", 0, {"grade_frac": np.array([1.1, 0.0])}),
        ("grade_frac", 0, {"grade_frac": np.zeros(2), "elevation_m": np.zeros(3)}),
        ("heading", 1, {"heading": np.array([[0.0, 1.0], [0.0, np.nan]])}),
        ("altitude_m", 0, {"altitude_m": np.array([20_000.0, 0.0])}),
        ("ambient_k", 2, {"ambient_k": np.array([280.0, 280.0, 20.0])}),
    ],
)
def test_profile_out_of_range_is_refused_by_field_and_position(field, position, changes):
    given = {"time_s": np.array([0.0, 1.0, 2.0]), "speed_mps": np.array([0.0, 1.0, 0.0])} | changes
    with pytest.raises(DrivenProfileError) as caught:
        DrivenProfile(**given)
    assert (caught.value.field, caught.value.position) == (field, position)
