"""A world, which the tool may read, and its label, which it may not."""

from __future__ import annotations

import csv
import hashlib
from dataclasses import dataclass, field
from enum import StrEnum
from types import MappingProxyType
from typing import TYPE_CHECKING, Final

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping
    from pathlib import Path

    from numpy.typing import NDArray

J_PER_KWH: Final = 3.6e6
VEHICLE_FILE: Final = "vehicle.toml"
DECIMALS: Final = MappingProxyType(
    {
        "time_s": 1,
        "speed_kmh": 3,
        "power_w": 0,
        "elevation_m": 1,
        "ambient_c": 1,
        "heading_deg": 1,
        "lat": 6,
        "lon": 6,
        "soc_frac": 4,
        "battery_c": 1,
        "voltage_v": 1,
        "current_a": 1,
        "wind_speed_mps": 1,
        "wind_from_deg": 0,
        "wet": 0,
        "payload_kg": 0,
    }
)


class WorldKind(StrEnum):
    """What a world is there to show."""

    NULL = "null"
    NULL_WRONG_PARAMETERS = "null_wrong_parameters"
    SINGLE = "single"
    SEVERAL = "several"
    CONFOUNDED = "confounded"
    CONFOUNDED_SEPARATED = "confounded_separated"
    OUTSIDE = "outside"
    FEW_TRIPS = "few_trips"
    FASTSIM = "fastsim"
    CARRIER = "carrier"
    FAULT = "fault"


@dataclass(frozen=True, slots=True)
class WorldRecording:
    """One drive as the sensors have it: name of the file without its ending, and columns of equal length.

    channels: float64 (n,) by the column names of DECIMALS, in the units that these names say.
    """

    id: str
    channels: Mapping[str, NDArray[np.float64]]


@dataclass(frozen=True, slots=True)
class World:
    """A vehicle as its maker describes it and the drives recorded with it; kind and seed are never written."""

    id: str
    kind: WorldKind
    seed: tuple[int, ...]
    vehicle_toml: str
    recordings: tuple[WorldRecording, ...]


@dataclass(frozen=True, slots=True)
class EffectTruth:
    """What one effect did: the energy that the drives would not have taken without it.

    energy_kwh: by trip. energy_share: sum of its magnitudes over the trips by the energy of all trips, so that an
    effect which helps one trip and hinders another counts for both. net_share: likewise with signs. strength: what
    the effect's standard size was multiplied by. trips: those it acted on, where it acts on some only.
    """

    family: str
    energy_kwh: Mapping[str, float]
    energy_share: float
    net_share: float
    strength: float
    trips: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class OutsideTruth:
    """A constant draw that no effect of any library has: on which axis, between which values, how much.

    For the axis "place" low and high are latitude and longitude of its middle [°] and radius_m its size.
    """

    axis: str
    low: float
    high: float
    mean_w: float
    unit: str
    radius_m: float | None = None


@dataclass(frozen=True, slots=True)
class FaultTruth:
    """What is the matter with a world's drives: its kind, the trips that it is on, and its size in the kind's unit.

    Empty where it is on all of them.
    """

    kind: str
    trips: tuple[str, ...]
    size: float


@dataclass(frozen=True, slots=True)
class WorldLabel:
    """The truth of a world.

    families: of all effects, sorted. confounded_with: families that these drives cannot distinguish from the true ones.
    parameter_changes: value in the vehicle file over the value that fits, by parameter. energy_kwh: what the battery
    gave on each trip, before any sensor. fault: what the field has done to them.
    """

    world_id: str
    kind: WorldKind
    families: tuple[str, ...]
    effects: Mapping[str, EffectTruth]
    outside: OutsideTruth | None
    confounded_with: tuple[str, ...]
    parameter_changes: Mapping[str, float]
    energy_kwh: Mapping[str, float]
    separating_trips: tuple[str, ...] = field(default=())
    fault: FaultTruth | None = None


def seed_numbers(seeds: np.random.SeedSequence) -> tuple[int, ...]:
    """What a seed is made of, to be kept with a world."""
    return (*np.atleast_1d(np.asarray(seeds.entropy)).tolist(), *seeds.spawn_key)


def world_name(*facts: object) -> str:
    """A world's id: distinguishes worlds and says nothing about them."""
    return "w" + hashlib.sha256(repr(facts).encode()).hexdigest()[:12]


def by_trip_kwh(ids: Iterable[str], energy_j: NDArray[np.float64]) -> dict[str, float]:
    """Energies [J] as a label has them [kWh], by trip."""
    return {name: float(value) / J_PER_KWH for name, value in zip(ids, energy_j, strict=True)}


def write_world(world: World, folder: Path) -> None:
    """Write vehicle.toml and a CSV file a drive into the folder, which is made where it is missing."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / VEHICLE_FILE).write_text(world.vehicle_toml, encoding="utf-8")
    for recording in world.recordings:
        names = [name for name in DECIMALS if name in recording.channels]
        columns = [[f"{value:.{DECIMALS[name]}f}" for value in recording.channels[name].tolist()] for name in names]
        with (folder / f"{recording.id}.csv").open("w", encoding="utf-8", newline="") as file:
            writer = csv.writer(file, lineterminator="\n")
            writer.writerow(names)
            writer.writerows(zip(*columns, strict=True))
