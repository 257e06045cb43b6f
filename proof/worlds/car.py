"""A vehicle as it truly is: forces, motor, battery and cabin by formulas that the tool does not use."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final, NamedTuple

if TYPE_CHECKING:
    import numpy as np

STANDARD_GRAVITY_MPS2: Final = 9.80665  # CGPM 1901
ROLLING_SPEED_MPS: Final = 100.0 / 3.6  # to which the rolling polynomial's speed refers (Mitschke, Wallentowitz 2004)
STILL_AIR_KG_PER_M3: Final = 1.1885  # dry air at 20 °C and 100 kPa


class Car(NamedTuple):
    """One true car, all floats, so that the compiled drive takes it as it is.

    rolling_0, rolling_1, rolling_4: f0 + f1·u + f4·u⁴, u = v/(100 km/h) (Mitschke, Wallentowitz 2004). gear_drag_n,
    gear_drag_n_per_mps: of gearbox and bearings at the wheel. motor_eff: of inverter, motor and gear at its best point;
    sag_load, sag_speed: what it loses far from that point. motor_force_n, motor_power_w: largest at the wheel.
    fade_low_mps, fade_high_mps: speeds between which braking goes from friction over to the motor. open_volt: at an
    empty battery, open_volt_rise: up to a full one. cabin_*: heat capacity of air and of furnishings, exchange with
    the outside at rest, exchange between the two, window area that lets sun in, heat that heater and cooler can move.
    """

    mass_kg: float
    rotating_coef: float
    rolling_0: float
    rolling_1: float
    rolling_4: float
    gear_drag_n: float
    gear_drag_n_per_mps: float
    drag_area_m2: float
    motor_eff: float
    sag_load: float
    sag_speed: float
    motor_force_n: float
    motor_power_w: float
    fade_low_mps: float
    fade_high_mps: float
    open_volt: float
    open_volt_rise: float
    resistance_ohm: float
    capacity_j: float
    battery_j_per_k: float
    aux_w: float
    tyre_j_per_k: float
    tyre_w_per_k: float
    cabin_air_j_per_k: float
    cabin_mass_j_per_k: float
    cabin_w_per_k: float
    cabin_inner_w_per_k: float
    window_m2: float
    heater_w: float


def draw_car(rng: np.random.Generator) -> Car:
    """A car somewhere between a small one and a van, its parts in keeping with its mass; ranges assumed."""
    size = float(rng.uniform(0.0, 1.0))
    mass_kg = 1050.0 + 1450.0 * size + float(rng.uniform(-50.0, 100.0))
    blunt = float(rng.uniform(0.0, 1.0))
    return car_of(
        mass_kg=mass_kg,
        drag_area_m2=(0.24 + 0.10 * blunt) * (2.05 + 0.75 * size + 0.35 * blunt * size),
        rolling_0=float(rng.uniform(0.0068, 0.0105)),
        motor_eff=float(rng.uniform(0.895, 0.935)),
        aux_w=float(rng.uniform(180.0, 480.0)),
        capacity_j=3.6e6 * (34.0 + 48.0 * size + float(rng.uniform(-4.0, 10.0))),
        size=size,
        rng=rng,
    )


def car_of(
    *,
    mass_kg: float,
    drag_area_m2: float,
    rolling_0: float,
    motor_eff: float,
    aux_w: float,
    capacity_j: float,
    size: float,
    rng: np.random.Generator,
) -> Car:
    """A car with these main numbers; what is left is drawn, in keeping with its size from 0 (small) to 1 (van)."""
    return Car(
        mass_kg=mass_kg,
        rotating_coef=1.04 + 0.05 * float(rng.uniform()),
        rolling_0=rolling_0,
        rolling_1=0.0012 * float(rng.uniform(0.3, 1.0)),
        rolling_4=0.0008 * float(rng.uniform(0.2, 1.0)),
        gear_drag_n=float(rng.uniform(8.0, 22.0)),
        gear_drag_n_per_mps=float(rng.uniform(0.1, 0.7)),
        drag_area_m2=drag_area_m2,
        motor_eff=motor_eff,
        sag_load=float(rng.uniform(0.005, 0.02)),
        sag_speed=float(rng.uniform(0.004, 0.012)),
        motor_force_n=mass_kg * float(rng.uniform(3.2, 4.5)),
        motor_power_w=mass_kg * float(rng.uniform(55.0, 85.0)),
        fade_low_mps=float(rng.uniform(0.4, 0.8)),
        fade_high_mps=float(rng.uniform(1.2, 2.0)),
        open_volt=float(rng.uniform(320.0, 350.0)),
        open_volt_rise=float(rng.uniform(45.0, 65.0)),
        resistance_ohm=float(rng.uniform(0.06, 0.13)) * (1.2 - 0.5 * size),
        capacity_j=capacity_j,
        battery_j_per_k=mass_kg * 0.18 * 1000.0,
        aux_w=aux_w,
        tyre_j_per_k=float(rng.uniform(60e3, 95e3)) * (0.8 + 0.6 * size),
        tyre_w_per_k=float(rng.uniform(28.0, 42.0)) * (0.8 + 0.6 * size),
        cabin_air_j_per_k=float(rng.uniform(30e3, 50e3)) * (0.8 + 0.6 * size),
        cabin_mass_j_per_k=float(rng.uniform(90e3, 160e3)) * (0.8 + 0.6 * size),
        cabin_w_per_k=float(rng.uniform(55.0, 90.0)) * (0.85 + 0.5 * size),
        cabin_inner_w_per_k=float(rng.uniform(60.0, 110.0)),
        window_m2=float(rng.uniform(1.2, 2.2)),
        heater_w=float(rng.uniform(4000.0, 6500.0)),
    )
