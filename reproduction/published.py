"""What tables IV to X of the source print, in its own units, with the number of trips of each route (section III)."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from typing import Final


class RouteType(StrEnum):
    """The source's columns: four types of route."""

    HIGHWAY = "highway"
    MOUNTAIN = "mountain"
    COUNTRY = "country road"
    URBAN = "urban area"


class SourceRoute(StrEnum):
    """The source's five routes."""

    HIGHWAY = "highway"
    MOUNTAIN = "mountain"
    COUNTRY_1 = "country road 1"
    COUNTRY_2 = "country road 2"
    URBAN = "urban area"


TYPE_OF: Final = {
    SourceRoute.HIGHWAY: RouteType.HIGHWAY,
    SourceRoute.MOUNTAIN: RouteType.MOUNTAIN,
    SourceRoute.COUNTRY_1: RouteType.COUNTRY,
    SourceRoute.COUNTRY_2: RouteType.COUNTRY,
    SourceRoute.URBAN: RouteType.URBAN,
}
TRIP_COUNT: Final = {
    SourceRoute.HIGHWAY: 5,
    SourceRoute.MOUNTAIN: 4,
    SourceRoute.COUNTRY_1: 4,
    SourceRoute.COUNTRY_2: 4,
    SourceRoute.URBAN: 6,
}
ROUTE_LENGTHS_KM: Final = (77.0, 124.0)  # section III: shortest and longest route
COUNTRY_ROUTE_KM: Final = 113.0  # section II.B: one country route, of 906 links
COUNTRY_ROUTE_LINKS: Final = 906
AUX_EFF: Final = 0.9


@dataclass(frozen=True, slots=True)
class TypeAverages:
    """A column of table IV in its units, of the source's simulated trips or of any others."""

    mass_kg: float
    distance_km: float
    duration_s: float
    speed_kmh: float
    stops: float
    standstill_s: float
    specific_kwh_per_100km: float
    energy_kwh: float


TABLE_IV: Final = {
    RouteType.HIGHWAY: TypeAverages(1866, 82.0, 2856, 108.0, 5, 109, 18.6, 15.0),
    RouteType.MOUNTAIN: TypeAverages(1946, 93.0, 6759, 49.4, 28, 588, 13.7, 12.7),
    RouteType.COUNTRY: TypeAverages(1903, 93.4, 5666, 59.4, 56, 1171, 14.3, 13.0),
    RouteType.URBAN: TypeAverages(1810, 82.9, 9356, 31.9, 154, 3234, 13.7, 9.1),
}


@dataclass(frozen=True, slots=True)
class PercentErrors:
    """A column of table V [%], positive where the simulation has more."""

    distance: float
    duration: float
    speed: float
    stops: float
    standstill: float
    specific_energy: float
    energy: float


TABLE_V: Final = {
    RouteType.HIGHWAY: PercentErrors(0, -9, 10, 9, 12, 9, 9),
    RouteType.MOUNTAIN: PercentErrors(0, -12, 14, 157, -50, -1, -1),
    RouteType.COUNTRY: PercentErrors(-2, -13, 14, 201, 104, 18, 8),
    RouteType.URBAN: PercentErrors(-4, -28, 35, 0, -6, 4, -3),
}


@dataclass(frozen=True, slots=True)
class RouteError:
    """Mean and standard deviation of the energy error on one route [%], and its range where printed."""

    mean: float
    sd: float
    low: float | None = None
    high: float | None = None


TABLE_VI: Final = {
    SourceRoute.HIGHWAY: RouteError(8.6, 6.9, 3, 22),
    SourceRoute.MOUNTAIN: RouteError(-1.3, 0.8, -3, -1),
    SourceRoute.COUNTRY_1: RouteError(17.7, 7.6, 10, 29),
    SourceRoute.COUNTRY_2: RouteError(-1.6, 2.1, -5, 0),
    SourceRoute.URBAN: RouteError(-3.1, 9.2, -15, 13),
}
TABLE_IX_SIMPLE: Final = {
    SourceRoute.HIGHWAY: RouteError(8.6, 6.9),
    SourceRoute.MOUNTAIN: RouteError(-1.3, 0.8),
    SourceRoute.COUNTRY_1: RouteError(17.7, 7.6),
    SourceRoute.COUNTRY_2: RouteError(-1.6, 2.1),
    SourceRoute.URBAN: RouteError(-3.1, 9.2),
}
TABLE_IX_COMPLEX: Final = {
    SourceRoute.HIGHWAY: RouteError(7.5, 7.1),
    SourceRoute.MOUNTAIN: RouteError(-5.2, 0.7),
    SourceRoute.COUNTRY_1: RouteError(9.9, 4.7),
    SourceRoute.COUNTRY_2: RouteError(-7.8, 3.6),
    SourceRoute.URBAN: RouteError(-28.1, 6.8),
}


@dataclass(frozen=True, slots=True)
class AllTrips:
    """A column of table X [%]: mean, its 95 % confidence interval, standard deviation, range of 95 % of trips."""

    mean: float
    mean_low: float
    mean_high: float
    sd: float
    trips_low: float
    trips_high: float


TABLE_X_SIMPLE: Final = AllTrips(3.6, -0.9, 8.1, 10.4, -16.8, 24.0)  # as table VII
TABLE_X_COMPLEX: Final = AllTrips(-6.2, -13.1, 0.6, 15.9, -37.3, 24.9)

# Table VIII: energy errors [%] of the urban trips
WITHOUT_AC_PERCENT: Final = (13.0, 2.0)
WITH_AC_PERCENT: Final = (1.0, -15.0, -10.0, -10.0)
WITHOUT_AC_MEAN_PERCENT: Final = 7.3
WITH_AC_MEAN_PERCENT: Final = -8.3

# Section VI: the more complex algorithm in town against reality
COMPLEX_URBAN_STOPS_PERCENT: Final = -70.0
COMPLEX_URBAN_SPEED_PERCENT: Final = 80.0
COMPLEX_URBAN_DURATION_PERCENT: Final = -50.0
