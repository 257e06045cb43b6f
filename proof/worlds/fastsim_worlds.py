"""Worlds whose truth is NREL's fastsim (BSD-3, version 3.1 or later): another lab's car, cabin and battery.

fastsim is asked for when the first world is made, not before: it comes with the optional extra `proof`.
"""

from __future__ import annotations

import copy
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from proof.worlds.dynamics import (
    AIR_C,
    BRAKING_ELECTRIC,
    BRAKING_MECH,
    CHARGE,
    DRIVE_ELECTRIC,
    DRIVE_MECH,
    HEIGHT,
    SUMS,
    TERMINAL,
    Strengths,
    WorldDrive,
    drive,
)
from proof.worlds.nameplate import Nameplate, vehicle_toml
from proof.worlds.scene import draw_scene
from proof.worlds.sensors import ALWAYS, recorded
from proof.worlds.share import energy_share
from proof.worlds.traffic import STEPS_PER_S
from proof.worlds.trips import WorldRegime, loaded, way_of
from proof.worlds.world import (
    J_PER_KWH,
    EffectTruth,
    World,
    WorldKind,
    WorldLabel,
    WorldRecording,
    by_trip_kwh,
    seed_numbers,
    world_name,
)

if TYPE_CHECKING:
    from collections.abc import Sequence

    from proof.worlds.scene import Scene
    from proof.worlds.trips import WorldTrip

CARS: Final = ("2016 Nissan Leaf 30 kWh thrml.yaml", "2022 Tesla Model 3 RWD thrml.yaml")
START_LIMIT_W: Final = 5000.0  # fastsim's cabin heater starts with 15 kW, three times what such cars have
SCOUT_W: Final = 42_000.0  # what the scouting car may use, within what either car can follow on any slope here
MOST_CHARGE: Final = 0.85  # above 0.95 fastsim takes no recuperation and gives up the drive
ZERO_CELSIUS_K: Final = 273.15
GRAVITY_MPS2: Final = 9.81  # fastsim's
AIR_KG_PER_M3: Final = 1.2  # fastsim's, whatever the temperature, unless given a height


@dataclass(frozen=True, slots=True)
class FastsimOrder:
    """A world to be driven by fastsim. climate: with its cabin and heater, else nothing is hidden."""

    climate: bool
    trips: tuple[int, int] = (24, 32)
    air_c: tuple[float, float] = (-10.0, 35.0)


def fastsim_world(order: FastsimOrder, seeds: np.random.SeedSequence) -> tuple[World, WorldLabel]:
    """A world and its label, from drives whose speeds and roads are this generator's and whose energy is fastsim's.

    Raises ModuleNotFoundError without the extra `proof`.
    """
    for_scene, for_order, for_sensors = seeds.spawn(3)
    rng = np.random.default_rng(for_order)
    count = int(rng.integers(order.trips[0], order.trips[1] + 1))
    regime = WorldRegime(mix=(0.45, 0.55, 0.0), minutes=(12.0, 26.0), air_c=order.air_c)
    scene = draw_scene(for_scene, regime, count)
    car = _car(str(rng.choice(CARS)))
    scout = scene.car._replace(mass_kg=float(car["mass_kilograms"]), motor_power_w=SCOUT_W)
    scene = replace(scene, car=scout)
    seen = loaded(scene.trips, 0.0, 0.0, 0.0)
    calm = [_driven(car, scene, trip, climate=False) for trip in seen]
    runs = [_driven(car, scene, trip, climate=True) for trip in seen] if order.climate else calm
    ids = [trip.id for trip in seen]
    energy_j = np.array([run.power_w.sum() / STEPS_PER_S for run in runs])
    effects = {}
    if order.climate:
        without_j = np.array([run.power_w.sum() / STEPS_PER_S for run in calm])
        effects["cabin_climate"] = EffectTruth(
            family="thermal",
            energy_kwh=by_trip_kwh(ids, energy_j - without_j),
            energy_share=energy_share(energy_j, without_j),
            net_share=float(np.sum(energy_j - without_j) / np.sum(energy_j)),
            strength=1.0,
        )
    key = seed_numbers(seeds)
    world_id = world_name(key, WorldKind.FASTSIM.value, order)
    recordings = tuple(
        WorldRecording(trip.id, recorded(np.random.default_rng(seed), scene.sensors, scene.loop, trip, run, ALWAYS))
        for seed, trip, run in zip(for_sensors.spawn(count), seen, runs, strict=True)
    )
    label = WorldLabel(
        world_id=world_id,
        kind=WorldKind.FASTSIM,
        families=("thermal",) if effects else (),
        effects=effects,
        outside=None,
        confounded_with=(),
        parameter_changes={},
        energy_kwh=by_trip_kwh(ids, energy_j),
    )
    return World(world_id, WorldKind.FASTSIM, key, vehicle_toml(_nameplate(car, calm)), recordings), label


def _fastsim() -> Any:
    import fastsim  # type: ignore[import-not-found, import-untyped, unused-ignore]

    return fastsim


def _car(name: str) -> dict[str, Any]:
    """A car of fastsim's as a dictionary, with the limit on what its heater draws at the start."""
    car: dict[str, Any] = _fastsim().Vehicle.from_resource(name).to_dict()
    for climate in car["hvac"].values():
        for limit in (name for name in climate if name.startswith("pwr_") and name.endswith("_max_watts")):
            climate[limit] = min(climate[limit], START_LIMIT_W)
    return car


def _driven(car: dict[str, Any], scene: Scene, trip: WorldTrip, *, climate: bool) -> WorldDrive:
    """One drive by fastsim at a step a second; the generator's own car drives first and sets speed and height."""
    scouted = drive(scene.car, Strengths(), trip.day, way_of(scene.loop), trip.chance, trip.demand_mps)
    speed = scouted.speed_mps[::STEPS_PER_S]
    seconds = speed.size
    height = scouted.states[:, HEIGHT]
    step_m = 0.5 * (speed[1:] + speed[:-1])
    rise = np.diff(height)
    grade = np.concatenate(([0.0], np.where(step_m > 0.5, rise / np.maximum(step_m, 0.5), 0.0)))
    air_k = scouted.states[:, AIR_C] + ZERO_CELSIUS_K
    cycle = {
        "init_elev_meters": float(height[0]),
        "time_seconds": np.arange(seconds, dtype=np.float64).tolist(),
        "speed_meters_per_second": speed.tolist(),
        "dist_meters": [],
        "grade": grade.tolist(),
        "elev_meters": [],
        "pwr_max_chrg_watts": [0.0] * seconds,
        "temp_amb_air_kelvin": air_k.tolist(),
        "pwr_solar_load_watts": [trip.day.sun_w_per_m2 * 0.5] * seconds,
        "grade_interp": None,
        "elev_interp": None,
    }
    fastsim = _fastsim()
    run = fastsim.SimDrive(
        fastsim.Vehicle.from_dict(_prepared(car, trip, climate=climate)), fastsim.Cycle.from_dict(cycle)
    )
    run.run_once()  # `run` would begin with a full battery, which takes no recuperation
    vehicle = run.to_dict()["veh"]
    battery = vehicle["pt_type"]["BEV"]["res"]["history"]
    power_w = np.array(battery["pwr_out_electrical_watts"])
    states = scouted.states.copy()
    states[:, CHARGE] = battery["soc"]
    # fastsim's step ends where the second does; its mean over the second is what lies between two samples
    fine = np.repeat(np.append(power_w[1:], power_w[-1]), STEPS_PER_S)[: scouted.speed_mps.size]
    tractive_w = np.array(vehicle["history"]["pwr_tractive_watts"])
    drawn_w = np.array(battery["pwr_out_prop_watts"])
    energy_j = np.zeros(SUMS)
    energy_j[TERMINAL] = power_w.sum()
    energy_j[DRIVE_MECH], energy_j[DRIVE_ELECTRIC] = (watts[tractive_w > 0.0].sum() for watts in (tractive_w, drawn_w))
    energy_j[BRAKING_MECH], energy_j[BRAKING_ELECTRIC] = (
        watts[tractive_w < 0.0].sum() for watts in (tractive_w, drawn_w)
    )
    return scouted._replace(power_w=fine, states=states, energy_j=energy_j)


def _prepared(car: dict[str, Any], trip: WorldTrip, *, climate: bool) -> dict[str, Any]:
    """The car as it stands at departure: soaked to the day's temperature, charged; without climate no cabin at all."""
    own = copy.deepcopy(car)
    battery = own["pt_type"]["BEV"]["res"]
    battery["state"]["soc"] = min(trip.day.charge_start, MOST_CHARGE)
    if not climate:
        own["cabin"], own["hvac"], battery["thrml"] = "None", "None", "None"
        return own
    starts = (
        (battery["thrml"]["RESLumpedThermal"]["state"], trip.day.battery_start_c),
        (own["cabin"]["LumpedCabin"]["state"], trip.day.cabin_start_c),
    )
    for state, celsius in starts:
        state["temperature_kelvin"] = state["temp_prev_kelvin"] = celsius + ZERO_CELSIUS_K
    return own


def _nameplate(car: dict[str, Any], calm: Sequence[WorldDrive]) -> Nameplate:
    """What fastsim's numbers say of the car; efficiencies as on these drives without climate."""
    chassis = car["chassis"]
    mass_kg = float(car["mass_kilograms"])
    spin_kg = (
        chassis["num_wheels"] * chassis["wheel_inertia_kilogram_square_meters"] / chassis["wheel_radius_meters"] ** 2
    )
    total = np.sum([run.energy_j for run in calm], axis=0)
    battery = car["pt_type"]["BEV"]["res"]
    return Nameplate(
        mass_kg=mass_kg,
        rotating_coef=1.0 + spin_kg / mass_kg,
        road_load_a_n=mass_kg * GRAVITY_MPS2 * chassis["wheel_rr_coef"],
        road_load_b_n_per_mps=0.0,
        road_load_c_n_per_mps2=0.5 * AIR_KG_PER_M3 * chassis["drag_coef"] * chassis["frontal_area_square_meters"],
        drive_eff=float(total[DRIVE_MECH] / total[DRIVE_ELECTRIC]),
        recuperation_eff=float(total[BRAKING_ELECTRIC] / total[BRAKING_MECH]),
        aux_power_w=float(car["pwr_aux_base_watts"]),
        usable_capacity_kwh=battery["energy_capacity_joules"] * (battery["max_soc"] - battery["min_soc"]) / J_PER_KWH,
        battery_volt=360.0,
    )
