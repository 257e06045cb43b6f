"""What follows from the source's tables without being printed in them, within their rounding."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

from reproduction.published import TABLE_IV, TABLE_V, TRIP_COUNT, RouteError, RouteType, SourceRoute, TypeAverages

if TYPE_CHECKING:
    from collections.abc import Mapping


@dataclass(frozen=True, slots=True)
class Rounded:
    """What a printed number can stand for: an interval."""

    low: float
    high: float

    def __truediv__(self, other: Rounded) -> Rounded:
        """Quotient of two positive numbers."""
        return Rounded(self.low / other.high, self.high / other.low)

    def times(self, factor: float) -> Rounded:
        """Product with a positive factor."""
        return Rounded(self.low * factor, self.high * factor)

    def meets(self, other: Rounded) -> bool:
        """Whether both can stand for the same number."""
        return self.low <= other.high and other.low <= self.high


@dataclass(frozen=True, slots=True)
class Pooled:
    """Mean and standard deviation (n − 1) of all trips [%], from those of the routes."""

    mean: float
    sd_from_population_sds: float
    sd_from_sample_sds: float


def rounded(value: float, digits: int = 0) -> Rounded:
    """A number printed with so many digits after the point."""
    half = 0.5 * 10.0**-digits
    return Rounded(value - half, value + half)


def percent_factor(percent: float) -> Rounded:
    """One plus an error printed in whole percent."""
    return rounded(100.0 + percent).times(0.01)


def real_averages(kind: RouteType) -> TypeAverages:
    """Averages of the real trips of a type, which the source does not print: table IV over one plus table V's error.

    Exact only if errors of averages and averages of errors agree, which alike trips do to about a percent.
    """
    simulated, error = TABLE_IV[kind], TABLE_V[kind]
    return TypeAverages(
        mass_kg=simulated.mass_kg,
        distance_km=simulated.distance_km / (1.0 + error.distance / 100.0),
        duration_s=simulated.duration_s / (1.0 + error.duration / 100.0),
        speed_kmh=simulated.speed_kmh / (1.0 + error.speed / 100.0),
        stops=simulated.stops / (1.0 + error.stops / 100.0),
        standstill_s=simulated.standstill_s / (1.0 + error.standstill / 100.0),
        specific_kwh_per_100km=simulated.specific_kwh_per_100km / (1.0 + error.specific_energy / 100.0),
        energy_kwh=simulated.energy_kwh / (1.0 + error.energy / 100.0),
    )


def pooled(errors: Mapping[SourceRoute, RouteError]) -> Pooled:
    """All trips from the routes: the sum of squares within routes and between them.

    A route's own sum of squares is n·SD² where its SD divides by n, and (n − 1)·SD² where it divides by n − 1.
    """
    count = sum(TRIP_COUNT.values())
    mean = sum(TRIP_COUNT[route] * error.mean for route, error in errors.items()) / count
    between = sum(TRIP_COUNT[route] * (error.mean - mean) ** 2 for route, error in errors.items())

    def sd(missing: int) -> float:
        within = sum((TRIP_COUNT[route] - missing) * error.sd**2 for route, error in errors.items())
        return math.sqrt((within + between) / (count - 1))

    return Pooled(mean, sd(0), sd(1))
