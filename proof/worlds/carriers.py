"""Effects of the generator added to the recorded power of real drives: real traffic, roads and sensors carry them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from proof.worlds.car import Car, car_of
from proof.worlds.causes import CAUSES, Cause
from proof.worlds.dynamics import Strengths, drive
from proof.worlds.loop import STEP_M, Loop
from proof.worlds.share import energy_share, scaled
from proof.worlds.traffic import STEPS_PER_S, TIME_STEP_S
from proof.worlds.trips import WorldRegime, WorldTrip, acted_on, draw_chance, draw_day, way_of
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
    from collections.abc import Mapping, Sequence

    from numpy.typing import NDArray

    from proof.worlds.orders import WantedEffect


@dataclass(frozen=True, slots=True)
class Carrier:
    """One real drive as arrays of equal length: channels by the names of world.DECIMALS, among them time_s, speed_kmh,
    power_w, elevation_m and ambient_c, no value missing.
    """

    id: str
    channels: Mapping[str, NDArray[np.float64]]


@dataclass(frozen=True, slots=True)
class CarrierVehicle:
    """The car that recorded the drives, as far as an effect needs it, and its vehicle file."""

    mass_kg: float
    drag_area_m2: float
    capacity_kwh: float
    vehicle_toml: str
    rolling_coef: float = 0.0085
    motor_eff: float = 0.91
    aux_w: float = 300.0


def carrier_world(
    vehicle: CarrierVehicle, carriers: Sequence[Carrier], wanted: WantedEffect | None, seeds: np.random.SeedSequence
) -> tuple[World, WorldLabel]:
    """The recorded drives with what one effect takes added to their power; without an effect, as they are.

    The effect is what the generator's car takes on that speed, height and temperature with it, less what it takes
    without it. Effects that need a channel which the drives lack (wind, water) get it made up. Raises ShareError
    where the effect cannot take the wanted share on these drives; ValueError where there is no drive.
    """
    if not carriers:
        raise ValueError("carriers is empty, allowed: at least one drive")
    key = seed_numbers(seeds)
    world_id = world_name(key, WorldKind.CARRIER.value, None if wanted is None else (wanted.effect, wanted.share))
    ids = [carrier.id for carrier in carriers]
    recorded_j = np.array([_energy_j(carrier.channels["time_s"], carrier.channels["power_w"]) for carrier in carriers])
    if wanted is None:
        plain = tuple(WorldRecording(carrier.id, carrier.channels) for carrier in carriers)
        label = WorldLabel(world_id, WorldKind.CARRIER, (), {}, None, (), {}, by_trip_kwh(ids, recorded_j))
        return World(world_id, WorldKind.CARRIER, key, vehicle.vehicle_toml, plain), label
    load = _load(vehicle, carriers, wanted, seeds)
    strength = scaled(
        lambda size: energy_share(recorded_j + load.energies_j(size), recorded_j),
        wanted.share,
        load.cause.most,
        wanted.effect,
    )
    added_j = load.energies_j(strength)
    truth = EffectTruth(
        family=load.cause.family,
        energy_kwh=by_trip_kwh(ids, added_j),
        energy_share=energy_share(recorded_j + added_j, recorded_j),
        net_share=float(np.sum(added_j) / np.sum(recorded_j + added_j)),
        strength=strength,
        trips=acted_on(wanted.effect, [trip for _, trip in load.roads]),
    )
    effects = {wanted.effect: truth}
    label = WorldLabel(
        world_id, WorldKind.CARRIER, (truth.family,), effects, None, (), {}, by_trip_kwh(ids, recorded_j + added_j)
    )
    return World(world_id, WorldKind.CARRIER, key, vehicle.vehicle_toml, load.recordings(strength)), label


@dataclass(frozen=True, slots=True)
class _Load:
    """What one effect puts on recorded drives, as its strength is varied."""

    cause: Cause
    car: Car
    carriers: tuple[Carrier, ...]
    roads: tuple[tuple[Loop, WorldTrip], ...]

    def extra_w(self, strength: float) -> list[NDArray[np.float64]]:
        """Power that it adds at each drive's own samples [W]."""
        only: dict[str, Any] = {self.cause.strength: strength}
        on = Strengths(**only)
        return [
            _extra_w(self.car, loop, trip, on, carrier)
            for carrier, (loop, trip) in zip(self.carriers, self.roads, strict=True)
        ]

    def energies_j(self, strength: float) -> NDArray[np.float64]:
        """Energy that it adds to each drive, float64 (drives,) [J]."""
        extra = zip(self.carriers, self.extra_w(strength), strict=True)
        return np.array([_energy_j(carrier.channels["time_s"], watts) for carrier, watts in extra])

    def recordings(self, strength: float) -> tuple[WorldRecording, ...]:
        """The drives with it."""
        return tuple(
            _with_effect(carrier, trip, watts, self.cause.channels, strength)
            for carrier, (_, trip), watts in zip(self.carriers, self.roads, self.extra_w(strength), strict=True)
        )


def _load(
    vehicle: CarrierVehicle, carriers: Sequence[Carrier], wanted: WantedEffect, seeds: np.random.SeedSequence
) -> _Load:
    for_car, for_days = seeds.spawn(2)
    roads = tuple(
        _traced(carrier, np.random.default_rng(seed))
        for carrier, seed in zip(carriers, for_days.spawn(len(carriers)), strict=True)
    )
    return _Load(CAUSES[wanted.effect], _car(vehicle, np.random.default_rng(for_car)), tuple(carriers), roads)


def _car(vehicle: CarrierVehicle, rng: np.random.Generator) -> Car:
    return car_of(
        mass_kg=vehicle.mass_kg,
        drag_area_m2=vehicle.drag_area_m2,
        rolling_0=vehicle.rolling_coef,
        motor_eff=vehicle.motor_eff,
        aux_w=vehicle.aux_w,
        capacity_j=vehicle.capacity_kwh * J_PER_KWH,
        size=float(np.clip((vehicle.mass_kg - 1050.0) / 1450.0, 0.0, 1.0)),
        rng=rng,
    )


def _traced(carrier: Carrier, rng: np.random.Generator) -> tuple[Loop, WorldTrip]:
    """The road under a recorded drive, straight north where no direction is recorded, and the drive on it."""
    channels = carrier.channels
    time_s = channels["time_s"] - channels["time_s"][0]
    steps = int(time_s[-1] * STEPS_PER_S) + 1
    at_s = np.arange(steps) * TIME_STEP_S
    speed_mps = np.interp(at_s, time_s, channels["speed_kmh"]) / 3.6
    way_m = np.concatenate(([0.0], np.cumsum(0.5 * (speed_mps[1:] + speed_mps[:-1]) * TIME_STEP_S)))
    nodes = np.arange(int(way_m[-1] / STEP_M) + 3) * STEP_M
    window = np.hanning(42)[1:-1]  # 400 m: heights in whole metres make steps that no road has
    height = np.interp(nodes, way_m, np.interp(at_s, time_s, channels["elevation_m"]))
    height = np.convolve(np.pad(height, 20, mode="edge"), window / window.sum(), mode="same")[20:-20]
    slope = np.gradient(height, STEP_M)
    heading = np.zeros(nodes.size)
    if "heading_deg" in channels:
        turned = np.unwrap(np.radians(np.interp(at_s, time_s, channels["heading_deg"])))
        heading = np.interp(nodes, way_m, turned)
    none = np.zeros(nodes.size)
    loop = Loop(
        height_m=height,
        grade=slope / np.sqrt(1.0 + slope * slope),
        limit_mps=none,
        stop_chance=none,
        latitude_deg=none,
        longitude_deg=none,
        east=np.sin(heading),
        north=np.cos(heading),
    )
    air = channels["ambient_c"]
    day = draw_day(rng, WorldRegime(), float(np.mean(air)), 0.0, 1)
    day = day._replace(air_rise_c_per_h=0.0, road_load_factor=1.0, aux_offset_w=0.0, breeze_mps=0.0)
    if "battery_c" in channels:
        day = day._replace(battery_start_c=float(channels["battery_c"][0]))
    chance = draw_chance(rng, steps)
    still = np.zeros_like(chance.gust)
    return loop, WorldTrip(carrier.id, day, chance._replace(foot_mps2=still, aux_w=still), speed_mps)


def _extra_w(car: Car, loop: Loop, trip: WorldTrip, on: Strengths, carrier: Carrier) -> NDArray[np.float64]:
    """Power that the effect adds at the drive's own samples, as means over a second [W]."""
    way = way_of(loop)
    with_it = drive(car, on, trip.day, way, trip.chance, trip.demand_mps)
    without = drive(car, Strengths(), trip.day, way, trip.chance, trip.demand_mps)
    way_j = np.concatenate(([0.0], np.cumsum(with_it.power_w - without.power_w))) * TIME_STEP_S
    edges_s = np.arange(way_j.size) * TIME_STEP_S
    time_s = carrier.channels["time_s"] - carrier.channels["time_s"][0]
    ahead, behind = np.interp(time_s + 0.5, edges_s, way_j), np.interp(time_s - 0.5, edges_s, way_j)
    return np.asarray(ahead - behind, np.float64)


def _with_effect(
    carrier: Carrier, trip: WorldTrip, extra_w: NDArray[np.float64], names: Sequence[str], strength: float
) -> WorldRecording:
    """The drive's channels with the power added, and those that the effect needs and the drive lacks made up."""
    n = extra_w.size
    seconds = np.clip(carrier.channels["time_s"] - carrier.channels["time_s"][0], 0, trip.chance.water.size - 1)
    day = trip.day
    made = {
        "wet": (trip.chance.water[seconds.astype(np.int64)] > 0.3).astype(np.float64),
        "wind_speed_mps": np.full(n, strength * day.wind_mps),
        "wind_from_deg": np.full(n, np.degrees(day.wind_from_rad)),
        "heading_deg": np.zeros(n),
        "payload_kg": np.full(n, strength * day.payload_kg),
        "battery_c": np.full(n, day.battery_start_c),
    }
    channels = {name: made[name] for name in names if name not in carrier.channels}
    return WorldRecording(
        carrier.id, {**carrier.channels, **channels, "power_w": carrier.channels["power_w"] + extra_w}
    )


def _energy_j(time_s: NDArray[np.float64], power_w: NDArray[np.float64]) -> float:
    return float(np.trapezoid(power_w, time_s))
