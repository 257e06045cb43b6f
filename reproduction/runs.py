"""The source's 23 trips driven again by any model on the rebuilt routes."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol

from diagnosis.comparison.comparison import Averages, averages
from diagnosis.comparison.trips import TripRecord
from energy.units import JOULE_PER_KWH, JOULE_PER_M_PER_KWH_PER_100KM, KMH_PER_MPS, METRE_PER_KM
from reproduction.published import TABLE_IV, TYPE_OF, RouteType, SourceRoute, TypeAverages
from reproduction.routes import SOURCE_RUNS, source_route

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from energy.chain.chain import Chain
    from energy.vehicle.vehicle import Vehicle


class DriveSums(Protocol):
    """What any model says of a drive: sums over its route in SI units."""

    @property
    def distance_m(self) -> float:
        """Length driven [m]."""

    @property
    def duration_s(self) -> float:
        """Time, standing still included [s]."""

    @property
    def standstill_s(self) -> float:
        """Time of standing still [s]."""

    @property
    def stop_count(self) -> float:
        """Number of stops on the way, the arrival not counted."""

    @property
    def energy_j(self) -> float:
        """Energy from the battery [J]."""


@dataclass(frozen=True, slots=True)
class SourceModel:
    """A model by name, and how it drives a vehicle along a chain from rest to rest."""

    name: str
    drive: Callable[[Vehicle, Chain], DriveSums]


def drive_source_trips(vehicle: Vehicle, model: SourceModel, seed: int) -> tuple[TripRecord, ...]:
    """The 23 trips with the route's name as their type; trips of one kind of run are equal."""
    records: list[TripRecord] = []
    for run in SOURCE_RUNS:
        loaded = loaded_as(vehicle, TYPE_OF[run.route])
        drive = model.drive(loaded, source_route(run.route, seed, speed_cap_kmh=run.speed_cap_kmh))
        records += [
            TripRecord(
                trip_id=f"{run.route} {number}" if run.speed_cap_kmh is None else f"{run.route} slow {number}",
                route_type=run.route.value,
                series=model.name,
                distance_m=drive.distance_m,
                duration_s=drive.duration_s,
                stop_count=drive.stop_count,
                standstill_s=drive.standstill_s,
                energy_j=drive.energy_j,
                mass_kg=loaded.mass_kg,
            )
            for number in range(1, run.trip_count + 1)
        ]
    return tuple(records)


def loaded_as(vehicle: Vehicle, kind: RouteType) -> Vehicle:
    """The vehicle with a type's mean mass of table IV."""
    return dataclasses.replace(vehicle, mass_kg=TABLE_IV[kind].mass_kg)


def type_averages(records: Sequence[TripRecord]) -> dict[RouteType, TypeAverages]:
    """Table IV of trips that drive_source_trips made."""
    by_type: dict[RouteType, list[TripRecord]] = {kind: [] for kind in RouteType}
    for record in records:
        by_type[TYPE_OF[SourceRoute(record.route_type)]].append(record)
    return {kind: _column(averages(trips), TABLE_IV[kind].mass_kg) for kind, trips in by_type.items()}


def _column(mean: Averages, mass_kg: float) -> TypeAverages:
    return TypeAverages(
        mass_kg=mass_kg,
        distance_km=mean.distance_m / METRE_PER_KM,
        duration_s=mean.duration_s,
        speed_kmh=mean.speed_mps * KMH_PER_MPS,
        stops=mean.stop_count,
        standstill_s=mean.standstill_s,
        specific_kwh_per_100km=mean.specific_j_per_m / JOULE_PER_M_PER_KWH_PER_100KM,
        energy_kwh=mean.energy_j / JOULE_PER_KWH,
    )


def route_energies_j(records: Sequence[TripRecord]) -> dict[SourceRoute, float]:
    """Mean energy of a trip on each of the five routes [J]."""
    return {
        route: averages([record for record in records if record.route_type == route.value]).energy_j
        for route in SourceRoute
    }
