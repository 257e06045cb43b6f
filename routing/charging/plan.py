"""What is asked of the planner of charging stops and what it answers, in SI units."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import StrEnum
from types import MappingProxyType
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Mapping
    from datetime import datetime

    from energy.charging.charging import Connector
    from routing.places import LinkPosition, LinkSpan
    from routing.route.route import Route
    from routing.stations.station import Socket, Station


class Objective(StrEnum):
    """What a plan has least of."""

    TIME = "time"
    ENERGY = "energy"
    COST = "cost"


@dataclass(frozen=True, slots=True)
class FixedStay:
    """A stay that is taken anyway: at a via point (its position in the query, from 0) or at the goal (None).

    power_w: at which the vehicle charges there [W from the wall], 0 where it can't. seconds: how long.
    """

    via_idx: int | None
    seconds: float
    power_w: float = 0.0


@dataclass(frozen=True, slots=True)
class ChargingQuery:
    """How a journey may be charged on; charges are fractions of the usable capacity, 0..1.

    arrive_soc_frac: least on arrival at every stop. goal_soc_frac: least at the goal. max_soc_frac: charged to at most.
    overhead_s: of every stop, for leaving the road, plugging in and paying [s]. connectors: to use, empty: all fitting.
    min_power_w: least output of a socket [W]. network_factors: by network or operator, what time at its stations counts
    as, above 1 where they are avoided, below where preferred; excluded_networks: not used. stations: only these ids,
    empty: all. stays: fixed ones. departure_min: minutes since Monday 0:00 local time, for opening hours, which None
    does not look at; departure: the local time itself, in whose week hours are those of its season. confidence:
    probability, 0.5..0.999, with which arrive_soc_frac is kept at every stop; None: by the mean. speed_caps_mps:
    highest speeds to try beside none [m/s]. most_stops: at most. alternatives: further plans.
    time_value_per_h: what an hour is worth where the objective is cost, in the currency of the prices.
    excluded_stations: ids that are not used. via_stations: via points, by their position in the query, that are
    stations, by id: the journey goes there, and charges there first of all, since that counts next to nothing.
    """

    arrive_soc_frac: float = 0.1
    goal_soc_frac: float = 0.1
    max_soc_frac: float = 0.8
    overhead_s: float = 300.0
    connectors: tuple[Connector, ...] = ()
    min_power_w: float = 0.0
    network_factors: Mapping[str, float] = field(default_factory=lambda: MappingProxyType({}))
    excluded_networks: frozenset[str] = frozenset()
    stations: tuple[str, ...] = ()
    stays: tuple[FixedStay, ...] = ()
    departure_min: float | None = None
    departure: datetime | None = None
    objective: Objective = Objective.TIME
    confidence: float | None = None
    speed_caps_mps: tuple[float, ...] = ()
    most_stops: int = 20
    alternatives: int = 0
    time_value_per_h: float = 10.0
    excluded_stations: frozenset[str] = frozenset()
    via_stations: tuple[tuple[int, str], ...] = ()


@dataclass(frozen=True, slots=True)
class ChargeStop:
    """One stop of a plan.

    overhead_s: beside charging, waiting_s of it until the station opens. power_bands: seconds at power from..to [W],
    of the charging alone. charged_j: into the battery; drawn_j: from the
    wall. price: in the currency of the station, None where it has none in numbers.
    station is None at a fixed stay. arrive_quantiles_frac: charge on arrival that is not exceeded with 10, 50 and 90 %;
    kept_probability_frac: of arriving with at least what was asked and of never being below the reserve on the way.
    fallback: None where there is no other station, and at fixed stays. gatekeeper: without it there is no plan; None
    where that is not known, at fixed stays, and of further plans.
    """

    station: Station | None
    socket: Socket | None
    position: LinkPosition
    arrive_s: float
    depart_s: float
    overhead_s: float
    charging_s: float
    arrive_soc_frac: float
    depart_soc_frac: float
    charged_j: float
    drawn_j: float
    mean_power_w: float
    power_bands: tuple[tuple[float, float, float], ...] = ()
    price: float | None = None
    currency: str = ""
    arrive_quantiles_frac: tuple[float, float, float] | None = None
    kept_probability_frac: float | None = None
    fallback: Fallback | None = None
    gatekeeper: bool | None = None
    waiting_s: float = 0.0


@dataclass(frozen=True, slots=True)
class Fallback:
    """The next best station should a stop fail: how long to it, and charge on arrival there, after arriving at P10.

    reached: before the battery is empty, by a vehicle that takes as much as it did to arrive with so little. wait_s:
    how long it is still closed then. open_soc_frac: charge when it opens, by a vehicle that stays on all the time.
    """

    station: Station
    drive_s: float
    arrive_soc_frac: float
    reached: bool
    wait_s: float
    open_soc_frac: float


@dataclass(frozen=True, slots=True)
class Halt:
    """A halt at a station at which nothing is charged, since driving on from rest, maybe back, serves better.

    along_m: since the start. overhead_s: what a stop takes beside charging, waiting_s of it until the station opens.
    price: of a stop without a charge, None where it has none in numbers.
    """

    station: Station
    position: LinkPosition
    along_m: float
    arrive_s: float
    overhead_s: float
    waiting_s: float
    soc_frac: float
    price: float | None
    currency: str


@dataclass(frozen=True, slots=True)
class PassedStation:
    """A via point that is a usable station, passed without a stop; waiting_s: for which it is still closed then."""

    via_idx: int
    station: Station
    arrive_s: float
    waiting_s: float


@dataclass(frozen=True, slots=True)
class PlanLeg:
    """A drive between two stops: its stretches, time, energy, charge at both ends, and the speed cap that it kept.

    soc_min_p10_frac: least charge on the way that is not exceeded with 10 %. caps: of its parts, between which it may
    come over via points and stations at which nothing is charged: how many stretches each has, and its speed cap.
    halts: at these stations, whose time is not in time_s.
    """

    spans: tuple[LinkSpan, ...]
    time_s: float
    energy_j: float
    distance_m: float
    soc_start_frac: float
    soc_end_frac: float
    soc_min_frac: float
    speed_cap_mps: float | None = None
    route: Route | None = None
    soc_min_p10_frac: float | None = None
    caps: tuple[tuple[int, float | None], ...] = ()
    halts: tuple[Halt, ...] = ()


@dataclass(frozen=True, slots=True)
class Plan:
    """A journey: n + 1 legs and the n stops between them.

    short_by_s: by how much at most a better plan is better, in the objective's own unit (s, J or currency); 0: proven
    best for the model, None: nothing is proven, and why is in unproven.
    overhead_s: of stops and halts. goal_quantiles_frac, goal_kept_probability_frac: as at stops. goal_stay: what a
    fixed stay at the goal charges. kept_probability_frac: of keeping all of them in one journey. price: of stops and
    halts at stations, in one currency; None where a station has none in numbers or currencies differ.
    """

    name: str
    legs: tuple[PlanLeg, ...]
    stops: tuple[ChargeStop, ...]
    driving_s: float
    charging_s: float
    overhead_s: float
    energy_j: float
    objective: float
    short_by: float | None = 0.0
    unproven: str = ""
    goal_quantiles_frac: tuple[float, float, float] | None = None
    goal_kept_probability_frac: float | None = None
    price: float | None = None
    currency: str = ""
    goal_stay: ChargeStop | None = None
    kept_probability_frac: float | None = None
    passed: tuple[PassedStation, ...] = ()

    @property
    def halts(self) -> tuple[Halt, ...]:
        """Those of all legs, in their order."""
        return tuple(halt for leg in self.legs for halt in leg.halts)

    @property
    def waiting_s(self) -> float:
        """How long stations are still closed on arrival, at all stops and halts; a part of overhead_s."""
        return float(sum(stop.waiting_s for stop in self.stops) + sum(halt.waiting_s for halt in self.halts))


class HelpKind(StrEnum):
    """What would make a plan possible, by the field of a request that is to be changed."""

    SPEED_CAP = "speed_cap"
    MAX_SOC = "max_soc"
    SOC = "soc"
    CONFIDENCE = "confidence"
    STATIONS = "stations"


@dataclass(frozen=True, slots=True)
class Help:
    """What would help, and how it is said.

    value: of a speed cap [m/s], of a charge or a confidence a fraction 0..1; None of stations that are to be added.
    """

    kind: HelpKind
    value: float | None
    text: str


@dataclass(frozen=True, slots=True)
class NoPlan:
    """Why there is no plan: the leg that fails, by how much [J], the last station in reach, and what would help."""

    reason: str
    from_station: Station | None
    missing_j: float
    last_reached: Station | None
    helps: tuple[Help, ...]


@dataclass(frozen=True, slots=True)
class PlanStats:
    """Work of a plan: searches of legs, labels of the station graph, seconds by stage, legs taken from the cache."""

    leg_searches: int
    legs_cached: int
    labels_made: int
    labels_settled: int
    seconds: float
    stage_s: Mapping[str, float] = field(default_factory=lambda: MappingProxyType({}))


@dataclass(frozen=True, slots=True)
class ChargingAnswer:
    """Plans, the best first, or why there is none."""

    plans: tuple[Plan, ...]
    no_plan: NoPlan | None
    stats: PlanStats
    warnings: tuple[str, ...] = ()
