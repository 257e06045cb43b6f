"""What is asked of the planner and what it answers, in SI units."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from typing import TYPE_CHECKING

from energy.chain.chain import DriveSettings, LinkModel, StopRule
from energy.conditions import STILL, Conditions
from energy.stops import USUAL_STOPS, StopSettings
from energy.units import JOULE_PER_KWH, METRE_PER_KM, SECOND_PER_MINUTE
from routing.places import Point
from routing.weights import ECO, Weights

if TYPE_CHECKING:
    from energy.vehicle.files import AnyVehicle


# of reaching the edge of an area, and the quantile of the standard normal distribution that belongs to it
RANGE_PROBABILITIES = {0.1: -1.2815515655446004, 0.5: 0.0, 0.9: 1.2815515655446004}
EPSILON_RANGE = (0.001, 0.5)  # of ParetoSettings
MOST_RANGE = (2, 50)


@dataclass(frozen=True, slots=True)
class ParetoSettings:
    """How close the routes of a Pareto set of time and energy are to come to every other way, and how many at most.

    epsilon_frac: of the time, and of what the least energy loses on the way; 0.001..0.5. most: of routes, 2..50.
    """

    epsilon_frac: float = 0.02
    most: int = 10


@dataclass(frozen=True, slots=True)
class RouteQuery:
    """One route request; a name is given to each weighting, one route is answered for each.

    pareto: instead of the weightings, the Pareto set of time and energy, ordered by time.
    soc_frac, reserve_soc_frac: 0..1, reserve ≤ soc. via: places on the way, in order; the vehicle comes to rest at each
    and goes on at once, in any direction that the road permits.
    """

    start: Point
    goal: Point
    soc_frac: float
    vehicle: AnyVehicle
    reserve_soc_frac: float = 0.0
    weightings: tuple[tuple[str, Weights], ...] = (("eco", ECO),)
    link_model: LinkModel = LinkModel.INTEGRATED
    stop_rule: StopRule = StopRule.EXPECTED
    stop_settings: StopSettings = USUAL_STOPS
    conditions: Conditions = STILL
    uncertainty: bool = False
    via: tuple[Point, ...] = ()
    pareto: ParetoSettings | None = None


class Trip(StrEnum):
    """Which drives a range is about: from the origin, to the origin, or there and back with a stop at the place."""

    OUT = "out"
    REVERSE = "reverse"
    ROUND = "round_trip"


class By(StrEnum):
    """What the bands of a range are of: charge left, energy taken, driving time or distance driven."""

    CHARGE = "charge"
    ENERGY = "energy"
    TIME = "time"
    DISTANCE = "distance"


class Outline(StrEnum):
    """How areas are drawn: along the roads in reach, or filled, with small gaps and holes closed."""

    ROADS = "roads"
    FILLED = "filled"


LIMIT_UNITS = {By.ENERGY: JOULE_PER_KWH, By.TIME: SECOND_PER_MINUTE, By.DISTANCE: METRE_PER_KM}  # kWh, min, km


@dataclass(frozen=True, slots=True)
class RangeQuery:
    """One range request; with uncertainty, each band comes once for each probability of RANGE_PROBABILITIES.

    soc_frac: at departure: at the origin, or wherever the trip REVERSE begins. bands_soc_frac: for each band, the
    charge that must be left at the end of the trip, 0..1, each ≥ reserve and ≤ soc. The reserve itself is always the
    outermost band.
    limits: instead of these, where bands are by energy [J], time [s] or distance [m]: the most that is taken, a band
    each, > 0. Times are those of the fastest ways, distances those of the shortest, whatever the battery holds.
    tolerance_m: how far outlines may be moved for fewer points, >= 0; None: by a cell of the grid that they are drawn
    on, of which there are a few hundred across.
    """

    origin: Point
    soc_frac: float
    vehicle: AnyVehicle
    reserve_soc_frac: float = 0.0
    bands_soc_frac: tuple[float, ...] = ()
    link_model: LinkModel = LinkModel.INTEGRATED
    stop_rule: StopRule = StopRule.EXPECTED
    stop_settings: StopSettings = USUAL_STOPS
    conditions: Conditions = STILL
    uncertainty: bool = False
    trip: Trip = Trip.OUT
    outline: Outline = Outline.ROADS
    by: By = By.CHARGE
    limits: tuple[float, ...] = ()
    tolerance_m: float | None = 0.0


@dataclass(frozen=True, slots=True)
class MatrixQuery:
    """One request for all drives from sources to targets; the rest as in RouteQuery, for each drive by itself."""

    sources: tuple[Point, ...]
    targets: tuple[Point, ...]
    soc_frac: float
    vehicle: AnyVehicle
    reserve_soc_frac: float = 0.0
    weights: Weights = ECO
    link_model: LinkModel = LinkModel.INTEGRATED
    stop_rule: StopRule = StopRule.EXPECTED
    stop_settings: StopSettings = USUAL_STOPS
    conditions: Conditions = STILL


def drive_settings(query: RouteQuery | RangeQuery) -> DriveSettings:
    """How the chains of a query are driven, of which energies are sampled."""
    return DriveSettings(query.conditions, query.link_model, query.stop_rule)
