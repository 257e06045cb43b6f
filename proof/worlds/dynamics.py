"""Compiled: a car driven forward in time by a driver who follows a demanded speed, with all that acts on it.

Unlike a replay of recorded speeds, force is the cause here and speed the effect: the driver's foot sets the motor's
force, the car answers, and temperatures, charge and speed are states that carry over. Units: m, s, N, W, J, °C, rad.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final, NamedTuple

import numpy as np
from numba import njit

from proof.worlds.car import ROLLING_SPEED_MPS, STANDARD_GRAVITY_MPS2, STILL_AIR_KG_PER_M3
from proof.worlds.loop import STEP_M
from proof.worlds.traffic import STEPS_PER_S, TIME_STEP_S

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from proof.worlds.car import Car

WARM_TYRE_C: Final = 38.0  # at which a tyre rolls as the car's numbers say (assumed: a steady 80 km/h at 20 °C)
HEATED_CABIN_C: Final = 20.5
COOLED_CABIN_C: Final = 23.0
HEATING_COP: Final = 1.8  # assumed: a heat pump on a cold day
FULL_RECUPERATION_W: Final = 90_000.0

# energies of a drive, in the order that `drive` adds them up [J]
TERMINAL, CHEMICAL, KINETIC, POTENTIAL, ROLLING, AIR, MOTOR_LOSS, BRAKE, AUX, CABIN, CONDITIONING = range(11)
COPPER, DRAW, JOULE, DRIVE_MECH, DRIVE_ELECTRIC, BRAKING_MECH, BRAKING_ELECTRIC = range(11, 18)
SUMS: Final = 18

# columns of the drive's second-by-second record
HEIGHT, BATTERY_C, CHARGE, PLACE, HEADING_RAD, CABIN_C, TYRE_C, CABIN_W, AIR_C, VOLT, AMPERE = range(11)
RECORDED: Final = 11

# where a draw from outside the library acts
NOWHERE, ALTITUDE, PLACE_AXIS, SPEED, TRIP_TIME, STATE_OF_CHARGE, DIRECTION = range(7)


class Strengths(NamedTuple):
    """How strong each effect is, 1 being its standard size and 0 off; draw_w: of an outside draw.

    battery_resistance: times the usual one, whose loss is then in the power that is recorded.
    """

    cabin_heating: float = 0.0
    air_conditioning: float = 0.0
    battery_conditioning: float = 0.0
    tyre_temperature: float = 0.0
    wet_road: float = 0.0
    air_density: float = 0.0
    roof_box: float = 0.0
    wind: float = 0.0
    payload: float = 0.0
    copper_loss: float = 0.0
    regen_cap: float = 0.0
    regen_cold: float = 0.0
    regen_cutoff: float = 0.0
    battery_resistance: float = 0.0
    draw_w: float = 0.0


class Circumstances(NamedTuple):
    """What one drive meets, all floats: weather, load, states at the start, and how this day differs from others.

    road_load_factor, aux_offset_w, breeze_*, tyre_factor: of this day, unknown to anybody. draw_axis, draw_low,
    draw_high, draw_radius_m: where the outside draw acts (for a place: its latitude and longitude).
    """

    air_c: float
    air_rise_c_per_h: float
    sun_w_per_m2: float
    humidity: float
    wind_mps: float
    wind_from_rad: float
    breeze_mps: float
    breeze_from_rad: float
    payload_kg: float
    roof_box: float
    road_load_factor: float
    aux_offset_w: float
    charge_start: float
    cabin_start_c: float
    furnishing_start_c: float
    tyre_start_c: float
    battery_start_c: float
    begin_m: float
    direction: float
    draw_axis: float = 0.0
    draw_low: float = 0.0
    draw_high: float = 0.0
    draw_radius_m: float = 0.0
    tyre_factor: float = 1.0


class WorldWay(NamedTuple):
    """The loop's arrays that a drive needs, float64 (n,) each."""

    height_m: NDArray[np.float64]
    grade: NDArray[np.float64]
    latitude_deg: NDArray[np.float64]
    longitude_deg: NDArray[np.float64]
    east: NDArray[np.float64]
    north: NDArray[np.float64]


class Chance(NamedTuple):
    """What wanders during a drive, one value a second: driver's foot [m/s²], gusts [-], consumers [W], water [0..1]."""

    foot_mps2: NDArray[np.float64]
    gust: NDArray[np.float64]
    aux_w: NDArray[np.float64]
    water: NDArray[np.float64]


class WorldDrive(NamedTuple):
    """A drive that was driven: speed and power at the recorder's place ten times a second, states once a second.

    energy_j: float64 (18,) by the constants TERMINAL to BRAKING_ELECTRIC.
    """

    speed_mps: NDArray[np.float64]
    power_w: NDArray[np.float64]
    states: NDArray[np.float64]
    energy_j: NDArray[np.float64]


def drive(
    car: Car, strengths: Strengths, day: Circumstances, way: WorldWay, chance: Chance, demand_mps: NDArray[np.float64]
) -> WorldDrive:
    """Drive one demanded speed, float64 (n,) every tenth of a second [m/s]; chance: a value for each second of it."""
    n = demand_mps.size
    seconds = (n + STEPS_PER_S - 1) // STEPS_PER_S
    driven = WorldDrive(np.zeros(n), np.zeros(n), np.zeros((seconds, RECORDED)), np.zeros(SUMS))
    _drive(car, strengths, day, way, chance, demand_mps, driven)
    return driven


@njit(nogil=True, cache=True)
def rolling_coef(car: Car, speed_mps: float) -> float:
    """Rolling resistance by weight of a warm tyre [-]."""
    u = speed_mps / ROLLING_SPEED_MPS
    return car.rolling_0 + car.rolling_1 * u + car.rolling_4 * u**4


@njit(nogil=True, cache=True)
def motor_eff(car: Car, force_n: float, speed_mps: float) -> float:
    """Efficiency of inverter, motor and gear [-]: best at a third of the torque and at 50 km/h, falling off gently."""
    load = min(abs(force_n) / car.motor_force_n, 1.0) - 0.3
    pace = speed_mps / 14.0
    return car.motor_eff - car.sag_load * load * load / 0.25 - car.sag_speed * (pace - 1.0) ** 2 / (1.0 + pace * pace)


@njit(nogil=True, cache=True)
def air_kg_per_m3(air_c: float, height_m: float) -> float:
    """Density of air as an ideal gas under an isothermal column (barometric formula) [kg/m³]."""
    kelvin = air_c + 273.15
    pressure_pa = 101_325.0 * np.exp(-0.0289644 * 9.80665 * height_m / (8.314463 * (0.5 * (kelvin + 283.0))))
    return float(pressure_pa / (287.05 * kelvin))


@njit(nogil=True, cache=True)
def cooling_electric_w(heat_w: float, air_c: float, humidity: float) -> float:
    """Compressor power that moves heat out of the cabin [W]: a share of Carnot's, and water to condense."""
    moist = 1.0 + 0.9 * humidity * max(air_c - 15.0, 0.0) / 20.0
    return heat_w * moist / (0.4 * 278.0 / (max(air_c, 18.0) + 17.0)) + (120.0 if heat_w > 0.0 else 0.0)


@njit(nogil=True, cache=True)
def _rolling_n(car: Car, on: Strengths, weight_n: float, speed_mps: float, tyre_c: float, water: float) -> float:
    """Rolling resistance on the flat [N]: stiffer when cold, and a film of water to push aside."""
    cold = WARM_TYRE_C - tyre_c
    stiff = 1.0 + on.tyre_temperature * (0.008 * cold + 0.00007 * cold * cold)
    film = on.wet_road * 0.003 * np.tanh(2.0 * water) * (0.6 + (speed_mps / 20.0) ** 1.4)
    return float(weight_n * (rolling_coef(car, speed_mps) * stiff + film))


@njit(nogil=True, cache=True)
def _air_n(
    on: Strengths, drag_area_m2: float, against_mps: float, across_mps: float, air_c: float, height_m: float
) -> float:
    """Drag along the car of air that comes against it and across [N]; a crosswind drags more than its share."""
    thick = 1.0 + on.air_density * (air_kg_per_m3(air_c, height_m) / STILL_AIR_KG_PER_M3 - 1.0)
    flow = against_mps * np.sqrt(against_mps * against_mps + 0.6 * across_mps * across_mps)
    return float(0.5 * STILL_AIR_KG_PER_M3 * thick * drag_area_m2 * flow)


@njit(nogil=True, cache=True)
def _motor_and_brake_n(
    car: Car, on: Strengths, force_n: float, speed_mps: float, battery_c: float
) -> tuple[float, float]:
    """The motor's part of a wished force, negative while recuperating, and the friction brakes' part [N]."""
    if force_n >= 0.0:
        return min(force_n, car.motor_force_n, car.motor_power_w / max(speed_mps, 1.0)), 0.0
    fade_mps = car.fade_high_mps + on.regen_cutoff - car.fade_low_mps
    blend = min(max((speed_mps - car.fade_low_mps) / fade_mps, 0.0), 1.0)
    if on.regen_cutoff > 0.0:
        blend = blend**4
    allowed = 1.0 - min(on.regen_cold * _cold_battery(battery_c), 0.97)
    cap_w = FULL_RECUPERATION_W * np.exp(-on.regen_cap)
    motor_n = max(force_n * blend * allowed, -cap_w / max(speed_mps, 1.0))
    return motor_n, motor_n - force_n


@njit(nogil=True, cache=True)
def _battery(
    car: Car, on: Strengths, charge: float, battery_c: float, terminal_w: float
) -> tuple[float, float, float, float]:
    """Open-circuit voltage [V], current [A], heat in the inner resistance [W] and the terminals' voltage [V]."""
    open_v = car.open_volt + car.open_volt_rise * (0.6 * charge + 0.4 * charge**5)
    ohm = car.resistance_ohm * (0.7 + 0.6 * np.exp(-(battery_c + 5.0) / 22.0))
    if on.battery_resistance > 0.0:
        ohm *= on.battery_resistance
    current_a = (open_v - np.sqrt(max(open_v * open_v - 4.0 * ohm * terminal_w, 1.0))) / (2.0 * ohm)
    return open_v, current_a, current_a * current_a * ohm, open_v - current_a * ohm


@njit(nogil=True, cache=True)
def _draws(day: Circumstances, height_m: float, north_deg: float, east_deg: float, speed: float, time_s: float,
           charge: float, heading_rad: float) -> bool:  # fmt: skip
    """Whether the outside draw is on here and now."""
    axis = int(day.draw_axis)
    if axis == PLACE_AXIS:
        off_north = (north_deg - day.draw_low) * 111_195.0
        off_east = (east_deg - day.draw_high) * 111_195.0 * np.cos(np.radians(north_deg))
        return bool(off_north * off_north + off_east * off_east < day.draw_radius_m * day.draw_radius_m)
    value = -np.inf
    if axis == ALTITUDE:
        value = height_m
    elif axis == SPEED:
        value = speed * 3.6
    elif axis == TRIP_TIME:
        value = time_s / 60.0
    elif axis == STATE_OF_CHARGE:
        value = charge
    elif axis == DIRECTION:
        value = np.degrees(heading_rad) % 360.0
    return day.draw_low <= value < day.draw_high


@njit(nogil=True, cache=True)
def _drive(
    car: Car,
    on: Strengths,
    day: Circumstances,
    way: WorldWay,
    chance: Chance,
    demand: NDArray[np.float64],
    driven: WorldDrive,
) -> None:
    dt = TIME_STEP_S
    nodes = way.grade.size
    mass = car.mass_kg + on.payload * day.payload_kg
    inertia = mass + car.mass_kg * (car.rotating_coef - 1.0)
    weight = mass * STANDARD_GRAVITY_MPS2
    drag_area = car.drag_area_m2 * (1.0 + on.roof_box * 0.35 * day.roof_box)
    wind_east = -on.wind * day.wind_mps * np.sin(day.wind_from_rad) - day.breeze_mps * np.sin(day.breeze_from_rad)
    wind_north = -on.wind * day.wind_mps * np.cos(day.wind_from_rad) - day.breeze_mps * np.cos(day.breeze_from_rad)
    speed, at_m = 0.0, day.begin_m
    height = way.height_m[int(at_m / STEP_M) % nodes]
    tyre, cabin, inner, battery = day.tyre_start_c, day.cabin_start_c, day.furnishing_start_c, day.battery_start_c
    charge, integral_w, foot_integral, force, felt_n = day.charge_start, 0.0, 0.0, 0.0, 0.0
    conditioning = False
    total = driven.energy_j
    for k in range(demand.size):
        second = k // STEPS_PER_S
        later = min(second + 1, chance.gust.size - 1)
        part = (k % STEPS_PER_S) * dt
        time_s = k * dt
        node = at_m / STEP_M
        low = int(np.floor(node))
        share = node - low
        low, high = low % nodes, (low + 1) % nodes
        sine = day.direction * ((1.0 - share) * way.grade[low] + share * way.grade[high])
        east, north = day.direction * way.east[low], day.direction * way.north[low]
        air_c = day.air_c + day.air_rise_c_per_h * time_s / 3600.0
        water = (1.0 - part) * chance.water[second] + part * chance.water[later]

        # forces that the road and the air set against the car
        gust = 1.0 + (1.0 - part) * chance.gust[second] + part * chance.gust[later]
        against = speed - gust * (wind_east * east + wind_north * north)
        across = gust * (wind_east * north - wind_north * east)
        rolling_n = _rolling_n(car, on, weight, speed, tyre, water) * np.sqrt(1.0 - sine * sine)
        rolling_n = (
            rolling_n * day.tyre_factor * day.road_load_factor + car.gear_drag_n + car.gear_drag_n_per_mps * speed
        )
        air_n = _air_n(on, drag_area * day.road_load_factor, against, across, air_c, height)
        climb_n = weight * sine
        if speed < 0.02:
            rolling_n, air_n, climb_n = 0.0, 0.0, 0.0
        resist_n = rolling_n + air_n + climb_n

        # the driver: feels the road, looks at the speed, and has an unsteady foot
        ahead = demand[min(k + 1, demand.size - 1)]
        missing = demand[k] - speed
        foot_integral = min(max(foot_integral + 0.12 * missing * dt, -0.5), 0.5)
        foot = (1.0 - part) * chance.foot_mps2[second] + part * chance.foot_mps2[later]
        wish = (ahead - demand[k]) / dt + 0.9 * missing + foot_integral + foot * min(speed / 5.0, 1.0)
        felt_n += (resist_n - felt_n) * dt / 0.4
        wish_n = inertia * wish + felt_n
        if ahead <= 0.0 and speed < 0.3:
            wish_n = min(wish_n, -0.3 * inertia)
        force += (wish_n - force) * min(dt / 0.15, 1.0)

        # split of the force between motor and brakes
        motor_n, brake_n = _motor_and_brake_n(car, on, force, speed, battery)
        gain = (motor_n - brake_n - resist_n) / inertia
        new = speed + gain * dt
        if new <= 0.0 or (ahead <= 0.0 and new < 0.05):
            new = 0.0
            motor_n = min(motor_n, 0.0)
            brake_n = motor_n - resist_n + inertia * speed / dt
        ds = 0.5 * (speed + new) * dt

        # electric side
        mech_w = motor_n * ds / dt
        eff = motor_eff(car, motor_n, speed)
        electric_w = mech_w / eff if mech_w > 0.0 else mech_w * eff
        copper_w = on.copper_loss * car.motor_power_w * 0.05 * (motor_n / (0.4 * car.motor_force_n)) ** 2
        aux_w = car.aux_w + day.aux_offset_w + (1.0 - part) * chance.aux_w[second] + part * chance.aux_w[later]
        aux_w = max(aux_w, 40.0)

        heat_w, integral_w = _cabin_control(car, cabin, integral_w)
        climate_w = on.cabin_heating * max(heat_w, 0.0) / HEATING_COP
        climate_w += on.air_conditioning * cooling_electric_w(max(-heat_w, 0.0), air_c, day.humidity)
        leaves_w = car.cabin_w_per_k * (1.0 + 0.02 * speed) * (cabin - air_c)
        shared_w = car.cabin_inner_w_per_k * (cabin - inner)
        sun_w = day.sun_w_per_m2 * car.window_m2
        cabin += (heat_w + 0.3 * sun_w - leaves_w - shared_w) / car.cabin_air_j_per_k * dt
        inner += (shared_w + 0.5 * sun_w) / car.cabin_mass_j_per_k * dt

        if battery < 8.0:
            conditioning = True
        elif battery > 14.0:
            conditioning = False
        warming_w = on.battery_conditioning * 2200.0 if conditioning else 0.0
        draw_w = 0.0
        heading = np.arctan2(east, north)
        if day.draw_axis > 0.0 and _draws(
            day, height, way.latitude_deg[low], way.longitude_deg[low], speed, time_s, charge, heading
        ):
            draw_w = on.draw_w
        terminal_w = electric_w + copper_w + aux_w + climate_w + warming_w + draw_w
        open_v, current_a, joule_w, volt = _battery(car, on, charge, battery, terminal_w)
        upstream_w = joule_w if on.battery_resistance > 0.0 else 0.0  # the power is told before the resistance then

        # books, then states
        for at, value in (
            (TERMINAL, (terminal_w + upstream_w) * dt),
            (CHEMICAL, (terminal_w + joule_w) * dt),
            (KINETIC, 0.5 * inertia * (new * new - speed * speed)),
            (POTENTIAL, climb_n * ds),
            (ROLLING, rolling_n * ds),
            (AIR, air_n * ds),
            (MOTOR_LOSS, (electric_w - mech_w) * dt),
            (BRAKE, brake_n * ds),
            (AUX, aux_w * dt),
            (CABIN, climate_w * dt),
            (CONDITIONING, warming_w * dt),
            (COPPER, copper_w * dt),
            (DRAW, draw_w * dt),
            (JOULE, upstream_w * dt),
        ):
            total[at] += value
        if force >= 0.0:
            total[DRIVE_MECH] += mech_w * dt
            total[DRIVE_ELECTRIC] += electric_w * dt
        else:
            total[BRAKING_MECH] += (motor_n - brake_n) * ds
            total[BRAKING_ELECTRIC] += electric_w * dt
        if k % STEPS_PER_S == 0:
            row = driven.states[second]
            row[HEIGHT], row[BATTERY_C], row[CHARGE], row[PLACE] = height, battery, charge, node % nodes
            row[HEADING_RAD], row[CABIN_C], row[TYRE_C] = heading, cabin, tyre
            row[CABIN_W], row[AIR_C], row[VOLT], row[AMPERE] = climate_w, air_c, volt, current_a
        driven.speed_mps[k] = speed
        driven.power_w[k] = terminal_w + upstream_w
        tyre += (0.7 * rolling_n * speed - car.tyre_w_per_k * (1.0 + 0.06 * speed) * (tyre - air_c)) * (
            dt / car.tyre_j_per_k
        )
        battery += (joule_w + 0.4 * warming_w - 6.0 * (battery - air_c)) / car.battery_j_per_k * dt
        charge -= open_v * current_a * dt / car.capacity_j
        height += sine * ds
        at_m += day.direction * ds
        speed = new


@njit(nogil=True, cache=True)
def _cold_battery(battery_c: float) -> float:
    """How much of the recuperation a cold battery declines [0..1]: none from 16 °C on, all at −12 °C."""
    u = min(max((16.0 - battery_c) / 28.0, 0.0), 1.0)
    return u * u * (3.0 - 2.0 * u)


@njit(nogil=True, cache=True)
def _cabin_control(car: Car, cabin_c: float, integral_w: float) -> tuple[float, float]:
    """Heat into the cabin (negative: out of it) by a controller with a memory and limits, and its memory [W]."""
    missing = 0.0
    if cabin_c < HEATED_CABIN_C:
        missing = HEATED_CABIN_C - cabin_c
    elif cabin_c > COOLED_CABIN_C:
        missing = COOLED_CABIN_C - cabin_c
    wish = 420.0 * missing + integral_w
    heat_w = min(max(wish, -0.8 * car.heater_w), car.heater_w)
    if heat_w == wish:
        integral_w += 6.0 * missing * TIME_STEP_S
    if missing == 0.0:
        integral_w -= integral_w * TIME_STEP_S / 120.0
    return heat_w, integral_w
