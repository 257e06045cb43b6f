"""What the field has and a laboratory has not: channels that are missing, coarse loggers, wrong units, and days that
differ by something that nobody wrote down.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import StrEnum
from typing import TYPE_CHECKING, Final

import numpy as np

from proof.worlds.car import draw_car
from proof.worlds.dynamics import Strengths, drive
from proof.worlds.trips import way_of
from proof.worlds.world import FaultTruth, WorldRecording

if TYPE_CHECKING:
    from collections.abc import Sequence

    from proof.worlds.dynamics import WorldDrive
    from proof.worlds.scene import Scene
    from proof.worlds.trips import WorldTrip

SWITCH_W: Final = (500.0, 1500.0)
SWITCH_TRIPS: Final = (4, 8)
STEP_FACTOR: Final = (1.15, 1.35)
DRIFT_FACTOR: Final = (1.25, 1.5)
STEP_AT: Final = (0.35, 0.65)  # of the drives, in their order
COARSE_S: Final = (5, 8, 12, 15)
FAHRENHEIT_TRIPS: Final = (3, 6)
FAHRENHEIT_AIR_C: Final = (1.0, 13.0)  # what a reader takes for a temperature of the air when it is read as °C
FILE_OFF: Final = (0.1, 0.25)
AGED_FACTOR: Final = (0.75, 0.92)  # of the capacity that is left
AGED_STEPS: Final = (0.005, 0.01)  # in which the charge is recorded
AGED_OFFSET_W: Final = 30.0  # standard deviation of a current sensor's offset, as power (assumed)


class FaultKind(StrEnum):
    """What is the matter with the drives of a world, or with their file."""

    NO_HEIGHT = "no_height"
    COARSE = "coarse"
    SWITCH = "switch"
    STEP = "step"
    DRIFT = "drift"
    FOREIGN = "foreign"
    FAHRENHEIT = "fahrenheit"
    WRONG_FILE = "wrong_file"
    AGED = "aged"


@dataclass(frozen=True, slots=True)
class Planted:
    """A scene with a fault in it, what it is, and the car that drove single trips instead of the scene's, by number."""

    scene: Scene
    truth: FaultTruth
    foreign: int | None = None


def planted(rng: np.random.Generator, scene: Scene, kind: FaultKind) -> Planted:
    """The scene with a fault: a draw left on, other or softer tyres, another car, an aged battery; else as it is."""
    count = len(scene.trips)
    if kind is FaultKind.SWITCH:
        watts = float(np.rint(rng.uniform(*SWITCH_W)))
        chosen = set(rng.choice(count, int(rng.integers(SWITCH_TRIPS[0], SWITCH_TRIPS[1] + 1)), replace=False).tolist())
        trips = tuple(
            replace(trip, day=trip.day._replace(aux_offset_w=trip.day.aux_offset_w + watts)) if k in chosen else trip
            for k, trip in enumerate(scene.trips)
        )
        return Planted(replace(scene, trips=trips), FaultTruth(kind.value, _names(scene, chosen), watts))
    if kind is FaultKind.STEP:
        factor = float(rng.uniform(*STEP_FACTOR))
        first = int(count * rng.uniform(*STEP_AT))
        trips = tuple(
            replace(trip, day=trip.day._replace(tyre_factor=factor)) if k >= first else trip
            for k, trip in enumerate(scene.trips)
        )
        return Planted(replace(scene, trips=trips), FaultTruth(kind.value, _names(scene, range(first, count)), factor))
    if kind is FaultKind.DRIFT:
        factor = float(rng.uniform(*DRIFT_FACTOR))
        share = np.arange(count) / max(count - 1, 1)
        trips = tuple(
            replace(trip, day=trip.day._replace(tyre_factor=1.0 + (factor - 1.0) * float(own)))
            for trip, own in zip(scene.trips, share, strict=True)
        )
        more = np.flatnonzero(share > 0.5).tolist()
        return Planted(replace(scene, trips=trips), FaultTruth(kind.value, _names(scene, more), factor))
    if kind is FaultKind.FOREIGN:
        number = int(rng.integers(count))
        return Planted(scene, FaultTruth(kind.value, _names(scene, (number,)), 1.0), number)
    if kind is FaultKind.AGED:
        factor = float(rng.uniform(*AGED_FACTOR))
        aged = scene.car._replace(capacity_j=factor * scene.car.capacity_j)
        return Planted(replace(scene, car=aged), FaultTruth(kind.value, (), factor))
    return Planted(scene, FaultTruth(kind.value, (), 0.0))


def driven_by_another(rng: np.random.Generator, scene: Scene, number: int) -> WorldDrive:
    """One of the scene's trips driven by another car, the heavier of two that are drawn."""
    cars = [draw_car(rng) for _ in range(2)]
    far = max(cars, key=lambda car: abs(np.log(car.mass_kg / scene.car.mass_kg)))
    trip = scene.trips[number]
    return drive(far, Strengths(), trip.day, way_of(scene.loop), trip.chance, trip.demand_mps)


def spoiled(
    rng: np.random.Generator, recordings: Sequence[WorldRecording], truth: FaultTruth
) -> tuple[tuple[WorldRecording, ...], FaultTruth]:
    """Recordings without height, thinned, with temperatures in °F or a charge in steps, and the truth with trips."""
    kind = FaultKind(truth.kind)
    if kind is FaultKind.NO_HEIGHT:
        return tuple(_without(recording, "elevation_m") for recording in recordings), truth
    if kind is FaultKind.COARSE:
        step = int(rng.choice(COARSE_S))
        return tuple(_thinned(recording, step) for recording in recordings), replace(truth, size=float(step))
    if kind is FaultKind.FAHRENHEIT:
        fit = [
            k
            for k, recording in enumerate(recordings)
            if FAHRENHEIT_AIR_C[0] <= float(np.median(recording.channels["ambient_c"])) <= FAHRENHEIT_AIR_C[1]
        ]
        wanted = int(rng.integers(FAHRENHEIT_TRIPS[0], FAHRENHEIT_TRIPS[1] + 1))
        chosen = set(rng.permutation(fit)[:wanted].tolist())
        found = tuple(_in_fahrenheit(recording) if k in chosen else recording for k, recording in enumerate(recordings))
        return found, replace(truth, trips=tuple(recordings[k].id for k in sorted(chosen)))
    if kind is FaultKind.AGED:
        step_frac, offset_w = float(rng.choice(AGED_STEPS)), float(rng.normal(0.0, AGED_OFFSET_W))
        return tuple(_with_poor_charge(recording, step_frac, offset_w) for recording in recordings), truth
    return tuple(recordings), truth


def _names(scene: Scene, chosen: Sequence[int] | range | set[int] | tuple[int, ...]) -> tuple[str, ...]:
    trips: tuple[WorldTrip, ...] = scene.trips
    return tuple(trips[k].id for k in sorted(chosen))


def _without(recording: WorldRecording, name: str) -> WorldRecording:
    return WorldRecording(recording.id, {key: values for key, values in recording.channels.items() if key != name})


def _thinned(recording: WorldRecording, step: int) -> WorldRecording:
    return WorldRecording(recording.id, {name: values[::step] for name, values in recording.channels.items()})


def _in_fahrenheit(recording: WorldRecording) -> WorldRecording:
    return WorldRecording(
        recording.id, {**recording.channels, "ambient_c": np.rint(1.8 * recording.channels["ambient_c"] + 32.0)}
    )


def _with_poor_charge(recording: WorldRecording, step_frac: float, offset_w: float) -> WorldRecording:
    own = recording.channels
    charge, power_w = np.rint(own["soc_frac"] / step_frac) * step_frac, own["power_w"] + offset_w
    return WorldRecording(recording.id, {**own, "soc_frac": charge, "power_w": power_w})
