from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest

from proof.worlds import dynamics as d
from proof.worlds.causes import CAUSES

if TYPE_CHECKING:
    from collections.abc import Callable

STANDING = slice(50, 250)
CRUISING = slice(1500, 3400)
BRAKING = slice(3520, 3680)
ACCELERATING = slice(320, 480)


def extra_w(go: Callable[..., d.WorldDrive], on: dict[str, float], **setting: object) -> np.ndarray:
    """Power at each tenth of a second that an effect adds."""
    return go(**setting, **on).power_w - go(**setting).power_w


def speeding_up_to(speed_mps: float) -> np.ndarray:
    """From standstill at 1 m/s², then a minute of that speed."""
    return np.minimum(np.arange(0.0, speed_mps + 60.0, 0.1), speed_mps)


@pytest.mark.nojit
@pytest.mark.parametrize(
    "setting",
    [
        {},
        {"grade": 0.03},
        {"grade": -0.04},
        {"on_day": {"air_c": -5.0, "cabin_start_c": -5.0, "battery_start_c": -5.0, "tyre_start_c": -5.0}},
    ],
    ids=["flat", "up", "down", "cold"],
)
def test_a_drive_with_every_effect_on_keeps_its_energy_books(
    go: Callable[..., d.WorldDrive], setting: dict[str, object]
) -> None:
    on = dict.fromkeys(d.Strengths._fields, 0.7)
    on_day = {"payload_kg": 200.0, "roof_box": 1.0, "wind_mps": 5.0, **setting.get("on_day", {})}  # type: ignore[dict-item]
    e = go(**{**setting, "on_day": on_day, "water": 0.8}, **on).energy_j
    wheels_j = e[d.KINETIC] + e[d.POTENTIAL] + e[d.ROLLING] + e[d.AIR] + e[d.BRAKE]
    consumers_j = e[d.AUX] + e[d.CABIN] + e[d.CONDITIONING] + e[d.COPPER] + e[d.DRAW]
    assert wheels_j + e[d.MOTOR_LOSS] + consumers_j + e[d.JOULE] == pytest.approx(e[d.TERMINAL], rel=1e-9)
    assert e[d.KINETIC] == pytest.approx(0.0, abs=1.0)
    assert e[d.CHEMICAL] > e[d.TERMINAL] - e[d.JOULE]
    assert e[d.BRAKE] > 0.0
    assert e[d.MOTOR_LOSS] > 0.0


def test_recorded_power_adds_up_to_the_energy_of_the_terminals(go: Callable[..., d.WorldDrive]) -> None:
    driven = go(cabin_heating=1.0, on_day={"air_c": 0.0, "cabin_start_c": 0.0})
    assert driven.power_w.sum() * 0.1 == pytest.approx(driven.energy_j[d.TERMINAL], rel=1e-9)


def test_height_gained_is_work_against_gravity(go: Callable[..., d.WorldDrive], car: d.Car) -> None:
    driven = go(grade=0.03)
    gain_m = driven.states[-1, d.HEIGHT]
    assert gain_m > 100.0
    assert driven.energy_j[d.POTENTIAL] == pytest.approx(car.mass_kg * 9.80665 * gain_m, rel=1e-3)


def test_charge_falls_by_the_chemical_energy(go: Callable[..., d.WorldDrive], car: d.Car) -> None:
    driven = go()
    fall = driven.states[0, d.CHARGE] - driven.states[-1, d.CHARGE]
    assert fall * car.capacity_j == pytest.approx(driven.energy_j[d.CHEMICAL], rel=0.02)


def test_the_driver_keeps_to_the_demanded_speed(go: Callable[..., d.WorldDrive]) -> None:
    driven = go(grade=0.02)
    assert driven.speed_mps[CRUISING] == pytest.approx(20.0, abs=0.1)
    assert driven.speed_mps[-1] == 0.0


@pytest.mark.parametrize("name", [name for name in d.Strengths._fields if name != "draw_w"])
def test_an_effect_at_strength_zero_does_nothing_and_on_its_day_something(
    go: Callable[..., d.WorldDrive], name: str
) -> None:
    cold = {"air_c": -8.0, "cabin_start_c": -8.0, "battery_start_c": -8.0, "tyre_start_c": -8.0}
    hot = {"air_c": 36.0, "cabin_start_c": 40.0, "sun_w_per_m2": 700.0}
    weather = hot if name == "air_conditioning" else cold
    on_day = {**weather, "payload_kg": 200.0, "roof_box": 1.0, "wind_mps": 5.0}
    calm, off, on = (go(on_day=on_day, water=0.8, **only).energy_j[0] for only in ({}, {name: 0.0}, {name: 1.0}))
    assert off == calm
    assert abs(on - calm) > 1e-3 * calm


def test_every_effect_of_the_catalogue_has_a_switch() -> None:
    assert {cause.strength for cause in CAUSES.values()} == set(d.Strengths._fields) - {"draw_w"}


def test_heating_draws_at_standstill_in_the_cold_and_less_once_warm(go: Callable[..., d.WorldDrive]) -> None:
    cold = extra_w(go, {"cabin_heating": 1.0}, on_day={"air_c": -5.0, "cabin_start_c": -5.0})
    assert cold[STANDING].min() > 1000.0
    assert 100.0 < cold[-100:].mean() < 0.7 * cold[STANDING].mean()
    assert extra_w(go, {"cabin_heating": 1.0}) == pytest.approx(0.0)


def test_air_conditioning_draws_in_the_heat_only(go: Callable[..., d.WorldDrive]) -> None:
    hot = extra_w(go, {"air_conditioning": 1.0}, on_day={"air_c": 34.0, "cabin_start_c": 38.0, "sun_w_per_m2": 600.0})
    assert hot[STANDING].min() > 300.0
    assert extra_w(go, {"air_conditioning": 1.0}, on_day={"air_c": 5.0, "cabin_start_c": 5.0}) == pytest.approx(0.0)


def test_battery_conditioning_is_on_until_the_battery_is_warm_enough(go: Callable[..., d.WorldDrive]) -> None:
    cold = extra_w(go, {"battery_conditioning": 1.0}, on_day={"battery_start_c": 0.0})
    assert cold == pytest.approx(2200.0, abs=1.0)
    assert extra_w(go, {"battery_conditioning": 1.0}) == pytest.approx(0.0)


def test_cold_tyres_cost_while_rolling_and_less_as_they_warm(go: Callable[..., d.WorldDrive]) -> None:
    cold = extra_w(go, {"tyre_temperature": 1.0}, on_day={"air_c": 0.0, "tyre_start_c": 0.0})
    assert cold[STANDING] == pytest.approx(0.0)
    assert cold[CRUISING.start] > cold[CRUISING.stop - 1] > 200.0
    warm = extra_w(go, {"tyre_temperature": 1.0}, on_day={"air_c": 35.0, "tyre_start_c": 55.0})
    assert warm[CRUISING].mean() < 0.0


def test_water_on_the_road_costs_while_rolling(go: Callable[..., d.WorldDrive]) -> None:
    wet = extra_w(go, {"wet_road": 1.0}, water=0.8)
    assert wet[STANDING] == pytest.approx(0.0)
    assert wet[CRUISING].min() > 200.0
    assert extra_w(go, {"wet_road": 1.0}) == pytest.approx(0.0)


def test_thin_air_helps_and_cold_air_costs(go: Callable[..., d.WorldDrive]) -> None:
    thin = extra_w(go, {"air_density": 1.0}, height_m=1500.0)[CRUISING].mean()
    cold = extra_w(go, {"air_density": 1.0}, on_day={"air_c": -10.0})[CRUISING].mean()
    near_reference = extra_w(go, {"air_density": 1.0})[CRUISING].mean()
    assert thin < -100.0 < abs(near_reference) < 100.0 < cold


def test_a_roof_box_costs_with_the_cube_of_speed_where_there_is_one(go: Callable[..., d.WorldDrive]) -> None:
    slow, fast = (
        extra_w(go, {"roof_box": 1.0}, demand=speeding_up_to(speed), on_day={"roof_box": 1.0})[-50:].mean()
        for speed in (12.0, 24.0)
    )
    assert fast / slow == pytest.approx(8.0, rel=0.05)
    assert extra_w(go, {"roof_box": 1.0}) == pytest.approx(0.0)


def test_wind_from_ahead_costs_and_from_behind_helps(go: Callable[..., d.WorldDrive]) -> None:
    ahead = extra_w(go, {"wind": 1.0}, on_day={"wind_mps": 6.0, "wind_from_rad": 0.0})[CRUISING].mean()
    behind = extra_w(go, {"wind": 1.0}, on_day={"wind_mps": 6.0, "wind_from_rad": np.pi})[CRUISING].mean()
    assert ahead > 800.0
    assert -ahead < behind < -400.0


def test_a_load_costs_uphill_and_while_gaining_speed_and_gives_back_while_braking(
    go: Callable[..., d.WorldDrive],
) -> None:
    on_day = {"payload_kg": 300.0}
    flat = extra_w(go, {"payload": 1.0}, on_day=on_day)
    assert flat[ACCELERATING].mean() > 1000.0
    assert flat[BRAKING].mean() < -800.0
    uphill = extra_w(go, {"payload": 1.0}, on_day=on_day, grade=0.04)
    assert uphill[CRUISING].mean() > 300.0 * 9.81 * 0.04 * 20.0


def test_copper_loss_costs_under_load_of_either_sign(go: Callable[..., d.WorldDrive]) -> None:
    loss = extra_w(go, {"copper_loss": 1.0})
    assert loss[STANDING] == pytest.approx(0.0)
    assert loss[ACCELERATING].mean() > 4.0 * loss[CRUISING].mean() > 0.0
    assert loss[BRAKING].mean() > 2.0 * loss[CRUISING].mean()


@pytest.mark.parametrize(
    ("name", "strength", "on_day"),
    [("regen_cap", 3.0, {}), ("regen_cold", 1.0, {"battery_start_c": 0.0}), ("regen_cutoff", 6.0, {})],
)
def test_limits_of_recuperation_cost_while_braking_only(
    go: Callable[..., d.WorldDrive], name: str, strength: float, on_day: dict[str, float]
) -> None:
    lost = extra_w(go, {name: strength}, on_day=on_day)
    assert lost[BRAKING].mean() > 500.0
    assert lost[STANDING] == pytest.approx(0.0)
    assert lost[CRUISING] == pytest.approx(0.0, abs=1.0)


def test_a_warm_battery_takes_all_recuperation(go: Callable[..., d.WorldDrive]) -> None:
    assert extra_w(go, {"regen_cold": 1.0}) == pytest.approx(0.0)


def test_the_cutoff_acts_at_low_speed_only(go: Callable[..., d.WorldDrive]) -> None:
    lost = extra_w(go, {"regen_cutoff": 3.0})
    speed = go().speed_mps
    assert lost[BRAKING][speed[BRAKING] > 8.0] == pytest.approx(0.0, abs=30.0)
    assert lost[BRAKING][(speed[BRAKING] > 1.5) & (speed[BRAKING] < 3.0)].min() > 100.0


def test_battery_resistance_costs_with_the_square_of_power(go: Callable[..., d.WorldDrive]) -> None:
    lost, power = extra_w(go, {"battery_resistance": 1.0}), go().power_w
    ratio = lost[ACCELERATING.stop - 20] / lost[CRUISING].mean()
    assert ratio == pytest.approx((power[ACCELERATING.stop - 20] / power[CRUISING].mean()) ** 2, rel=0.1)


@pytest.mark.parametrize(
    ("axis", "low", "high", "inside"),
    [
        (d.SPEED, 60.0, 75.0, CRUISING),
        (d.TRIP_TIME, 2.5, 5.0, slice(1510, 2990)),
        (d.DIRECTION, 0.0, 20.0, STANDING),
        (d.ALTITUDE, -5.0, 5.0, STANDING),
        (d.STATE_OF_CHARGE, 0.5, 0.9, STANDING),
    ],
)
def test_an_outside_draw_is_constant_within_its_band_and_off_beyond(
    go: Callable[..., d.WorldDrive], axis: int, low: float, high: float, inside: slice
) -> None:
    band = {"draw_axis": float(axis), "draw_low": low, "draw_high": high}
    assert extra_w(go, {"draw_w": 700.0}, on_day=band)[inside] == pytest.approx(700.0)
    beyond = {**band, "draw_low": high + 500.0, "draw_high": high + 900.0}
    assert extra_w(go, {"draw_w": 700.0}, on_day=beyond) == pytest.approx(0.0)


def test_an_outside_draw_at_a_place_is_on_within_its_radius(go: Callable[..., d.WorldDrive]) -> None:
    place = {"draw_axis": float(d.PLACE_AXIS), "draw_low": 50.018, "draw_high": 8.0, "draw_radius_m": 500.0}
    drawn = extra_w(go, {"draw_w": 700.0}, on_day=place)
    way_m = np.cumsum(go().speed_mps) * 0.1
    middle_m = 0.018 * 111_195.0  # the road goes north, 9e-5 degrees each 10 m
    assert drawn[np.abs(way_m - middle_m) < 480.0] == pytest.approx(700.0)
    assert drawn[np.abs(way_m - middle_m) > 520.0] == pytest.approx(0.0)
