"""A scene: car, road and drives of one world before it is given what it hides, and how they are driven."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from proof.worlds.car import draw_car
from proof.worlds.dynamics import TERMINAL, Strengths, drive
from proof.worlds.loop import draw_loop
from proof.worlds.sensors import draw_sensors
from proof.worlds.trips import draw_trips, way_of

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from proof.worlds.car import Car
    from proof.worlds.dynamics import WorldDrive
    from proof.worlds.loop import Loop
    from proof.worlds.sensors import Sensors
    from proof.worlds.trips import WorldRegime, WorldTrip


@dataclass(frozen=True, slots=True)
class Scene:
    """What a world is made of. base_trips: so many of the trips, from the first on, set the size of its effects."""

    car: Car
    loop: Loop
    sensors: Sensors
    trips: tuple[WorldTrip, ...]
    base_trips: int

    def drive(self, strengths: Strengths) -> tuple[WorldDrive, ...]:
        """All trips driven with these effects on."""
        way = way_of(self.loop)
        return tuple(drive(self.car, strengths, trip.day, way, trip.chance, trip.demand_mps) for trip in self.trips)

    def energies_j(self, strengths: Strengths) -> NDArray[np.float64]:
        """What the battery gives on each trip, float64 (trips,) [J]."""
        return np.array([driven.energy_j[TERMINAL] for driven in self.drive(strengths)])

    def base(self) -> Scene:
        """The scene without its separating trips."""
        return replace(self, trips=self.trips[: self.base_trips])


def draw_scene(
    seeds: np.random.SeedSequence, regime: WorldRegime, count: int, extra: tuple[WorldRegime, int] | None = None
) -> Scene:
    """A scene of `count` drives, and some more in another regime that come on top of them.

    Car, road, logger, drives and further drives have seeds of their own, so that the same seed gives the same scene
    with and without the further ones.
    """
    for_car, for_loop, for_sensors, for_trips, for_extra = seeds.spawn(5)
    car = draw_car(np.random.default_rng(for_car))
    loop = draw_loop(np.random.default_rng(for_loop), regime.mix, regime.terrain, regime.steady_kmh)
    sensors = draw_sensors(np.random.default_rng(for_sensors))
    trips = draw_trips(for_trips, loop, regime, count)
    if extra is not None:
        other, further = extra
        seeds_road, seeds_trips = for_extra.spawn(2)
        # the same road with the limits and crossings of the other regime
        drawn = draw_loop(np.random.default_rng(seeds_road), other.mix, other.terrain, other.steady_kmh)
        nodes = np.arange(loop.limit_mps.size) % drawn.limit_mps.size
        road = replace(loop, limit_mps=drawn.limit_mps[nodes], stop_chance=drawn.stop_chance[nodes])
        trips += draw_trips(seeds_trips, road, other, further, count + 1)
    return Scene(car, loop, sensors, trips, count)
