"""Charging stops: what is asked for, and the plans with them."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import datetime
from typing import TYPE_CHECKING, Final

from energy.charging.charging import MOST_POWER_W, Connector
from energy.conditions import CONDITION_RANGES, exact_minute_of_week
from energy.units import JOULE_PER_KWH, KMH_PER_MPS, SECOND_PER_MINUTE
from joulepath.figures import Feature, MapFeature, Place, feature, number_of, numbers_of, one_of, place_of
from routing.charging.plan import ChargingQuery, FixedStay, HelpKind, Objective
from routing.charging.route import halt_leg
from routing.errors import QueryError
from routing.route.route import LegEnd
from routing.stations.names import network_rules

if TYPE_CHECKING:
    from energy.charging.charging import Charging as VehicleCharging
    from routing.charging.plan import ChargeStop, Halt, Help, NoPlan, Plan
    from routing.route.route import Route
    from routing.stations.names import StationNames
    from routing.stations.station import Station

W_PER_KW: Final = 1000.0
GOAL: Final = "goal"
MOST_MINUTES: Final = 7 * 24 * 60
MOST_POWER_KW: Final = MOST_POWER_W / W_PER_KW
CAP_RANGE_KMH: Final = (30.0, CONDITION_RANGES["top_speed_mps"][1] * KMH_PER_MPS)
RANGES: Final = {
    "arrive_soc_frac": (0.0, 1.0),
    "goal_soc_frac": (0.0, 1.0),
    "max_soc_frac": (0.0, 1.0),
    "overhead_s": (0.0, 7200.0),
    "min_power_kw": (0.0, MOST_POWER_KW),
    "preferred_factor": (0.1, 1.0),
    "avoided_factor": (1.0, 10.0),
    "time_value_per_h": (0.0, 10_000.0),
}
COUNTS: Final = {"most_stops": 50, "alternatives": 3}
LISTS: Final = (
    "connectors",
    "preferred_networks",
    "avoided_networks",
    "excluded_networks",
    "stations",
    "excluded_stations",
)
SPEED_DIGITS: Final = 9  # so that 110 km/h stay 110


@dataclass(frozen=True, slots=True)
class Stay:
    """A stay that is taken anyway, at a via point by its position or at the "goal": minutes, power from the wall."""

    at: int | str
    minutes: float
    power_kw: float = 0.0


@dataclass(frozen=True, slots=True)
class Charging:
    """What charging stops may be like, by the names of the HTTP API (docs/http-api.md); charges are fractions 0..1.

    networks: names of networks and operators in any case; factors are on time there. stations: ids of the only ones to
    stop at; via_stations: via points by their position that are stations, by id, at which the vehicle charges
    before any other.
    departure: local time, for opening hours. objective: "time", "energy" or "cost". confidence: probability with which
    charges on arrival are kept, None: on average. alternatives: further plans.
    """

    arrive_soc_frac: float = 0.1
    goal_soc_frac: float = 0.1
    max_soc_frac: float = 0.8
    overhead_s: float = 300.0
    connectors: tuple[str, ...] = ()
    min_power_kw: float = 0.0
    preferred_networks: tuple[str, ...] = ()
    avoided_networks: tuple[str, ...] = ()
    excluded_networks: tuple[str, ...] = ()
    preferred_factor: float = 0.8
    avoided_factor: float = 1.5
    stations: tuple[str, ...] = ()
    excluded_stations: tuple[str, ...] = ()
    via_stations: tuple[tuple[int, str], ...] = ()
    stays: tuple[Stay, ...] = ()
    departure: datetime | None = None
    objective: str = "time"
    time_value_per_h: float = 10.0
    confidence: float | None = None
    speed_caps_kmh: tuple[float, ...] = ()
    most_stops: int = 20
    alternatives: int = 0

    def in_si(self, charging: VehicleCharging, names: StationNames, departure: datetime | None) -> ChargingQuery:
        """The same as the planner takes it.

        charging: of the vehicle, names: of the graph's stations. departure: local time where this has none. Raises
        QueryError where it names what they lack.
        """
        self._check()
        plugs = tuple(one_of(f"charging.connectors[{k}]", name, Connector) for k, name in enumerate(self.connectors))
        for field in ("stations", "excluded_stations"):
            for k, station_id in enumerate(getattr(self, field)):
                names.check_id(f"charging.{field}[{k}]", station_id)
        for k, (_, station_id) in enumerate(self.via_stations):
            names.check_id(f"charging.via_stations[{k}]", station_id)
        names.check_power(
            "charging.min_power_kw",
            self.min_power_kw,
            names.usable_plugs("charging.connectors", charging, plugs),
        )
        weighted = (
            ("preferred_networks", self.preferred_networks, self.preferred_factor),
            ("avoided_networks", self.avoided_networks, self.avoided_factor),
            ("excluded_networks", self.excluded_networks, None),
        )
        factors, excluded = network_rules(names, "charging.", weighted)
        departure = self._departure_beside(departure)
        return ChargingQuery(
            arrive_soc_frac=self.arrive_soc_frac,
            goal_soc_frac=self.goal_soc_frac,
            max_soc_frac=self.max_soc_frac,
            overhead_s=self.overhead_s,
            connectors=plugs,
            min_power_w=self.min_power_kw * W_PER_KW,
            network_factors=factors,
            excluded_networks=excluded,
            stations=tuple(self.stations),
            excluded_stations=frozenset(self.excluded_stations),
            via_stations=tuple(self.via_stations),
            stays=tuple(_stay(k, stay) for k, stay in enumerate(self.stays)),
            departure_min=None if departure is None else exact_minute_of_week(departure),
            departure=departure,
            objective=one_of("charging.objective", self.objective, Objective),
            confidence=self.confidence,
            speed_caps_mps=tuple(cap / KMH_PER_MPS for cap in self.speed_caps_kmh),
            most_stops=self.most_stops,
            alternatives=self.alternatives,
            time_value_per_h=self.time_value_per_h,
        )

    def _check(self) -> None:
        """Raise QueryError where a field is not of its kind, or out of a range that the planner does not look at."""
        for name, (low, high) in RANGES.items():
            value = number_of(f"charging.{name}", getattr(self, name))
            if not low <= value <= high:
                raise QueryError(f"charging.{name}", value, f"{low:g}..{high:g}")
        for name, most in COUNTS.items():
            value = getattr(self, name)
            if isinstance(value, bool) or not isinstance(value, int) or not 0 <= value <= most:
                raise QueryError(f"charging.{name}", repr(value), f"a whole number, 0..{most}")
        for name in LISTS:
            if isinstance(getattr(self, name), str):
                raise QueryError(f"charging.{name}", repr(getattr(self, name)), "several in a tuple or list")
        if self.confidence is not None:
            number_of("charging.confidence", self.confidence)
        for k, cap in enumerate(numbers_of("charging.speed_caps_kmh", self.speed_caps_kmh)):
            if not CAP_RANGE_KMH[0] <= cap <= CAP_RANGE_KMH[1]:
                allowed = f"{CAP_RANGE_KMH[0]:g}..{CAP_RANGE_KMH[1]:g}"
                raise QueryError(f"charging.speed_caps_kmh[{k}]", cap, allowed)
        chosen: tuple[object, ...] = tuple(self.via_stations)
        for k, pair in enumerate(chosen):
            if not isinstance(pair, (tuple, list)) or len(pair) != 2 or not isinstance(pair[0], int):
                raise QueryError(f"charging.via_stations[{k}]", repr(pair), "(position in via from 0, id of a station)")

    def _departure_beside(self, other: datetime | None) -> datetime | None:
        """Local time of departure, by the conditions of a query where it is not said here."""
        own = self.departure
        if own is None:
            return other
        if not isinstance(own, datetime):
            raise QueryError("charging.departure", repr(own), "a datetime, local at the roads")
        if own.tzinfo is not None:
            raise QueryError("charging.departure", own.isoformat(), "a local time without a time zone")
        if other not in (None, own):
            raise QueryError("charging.departure", own, f"that of conditions.departure, {other}, or one of them alone")
        return own


def _stay(k: int, stay: Stay) -> FixedStay:
    if not isinstance(stay, Stay):
        raise QueryError(f"charging.stays[{k}]", repr(stay), "a joulepath.Stay")
    if stay.at != GOAL and (isinstance(stay.at, bool) or not isinstance(stay.at, int)):
        raise QueryError(f"charging.stays[{k}].at", repr(stay.at), "a position in via, from 0, or 'goal'")
    via_idx = None if isinstance(stay.at, str) else stay.at
    minutes = number_of(f"charging.stays[{k}].minutes", stay.minutes)
    if not 0.0 < minutes <= MOST_MINUTES:
        raise QueryError(f"charging.stays[{k}].minutes", minutes, f"above 0, at most {MOST_MINUTES}")
    power_kw = number_of(f"charging.stays[{k}].power_kw", stay.power_kw)
    if not 0.0 <= power_kw <= MOST_POWER_KW:
        raise QueryError(f"charging.stays[{k}].power_kw", power_kw, f"0..{MOST_POWER_KW:g}")
    return FixedStay(via_idx, minutes * SECOND_PER_MINUTE, power_kw * W_PER_KW)


@dataclass(frozen=True, slots=True)
class ChargingStop(MapFeature):
    """One stop of a plan; station: its id, "" of a stay that is taken anyway, as all that is said of one.

    leg: position of the leg that ends there. place: of the station. output_kw: of the socket, None where not known.
    overhead_s: beside charging, with waiting_s, for which the station is still closed on arrival. charged_kwh: into the
    battery; drawn_kwh: from the wall. power_bands: kW from, kW to, seconds. soc_arrive_p10_frac and so on: charge on
    arrival that is exceeded with 90, 50 and 10 %, None where not asked for. fallback: id of the station to go to should
    it fail, "" where there is none. gatekeeper: whether there is no way without it, None where that is not known.
    """

    station: str
    name: str
    operator: str
    network: str
    connector: str
    output_kw: float | None
    leg: int
    place: Place | None
    arrive_s: float
    depart_s: float
    overhead_s: float
    waiting_s: float
    charging_s: float
    soc_arrive_frac: float
    soc_depart_frac: float
    charged_kwh: float
    drawn_kwh: float
    mean_power_kw: float
    power_bands: tuple[tuple[float, float, float], ...]
    price: float | None
    currency: str
    soc_arrive_p10_frac: float | None
    soc_arrive_p50_frac: float | None
    soc_arrive_p90_frac: float | None
    kept_probability_frac: float | None
    fallback: str
    gatekeeper: bool | None

    @property
    def __geo_interface__(self) -> Feature:
        """GeoJSON Feature: where the station is, with the figures of the stop."""
        hidden = {"place", "power_bands"}
        shown = {name: getattr(self, name) for name in self.__slots__ if name not in hidden}
        point = None if self.place is None else (self.place.lon_deg, self.place.lat_deg)
        return feature(None if point is None else {"type": "Point", "coordinates": point}, shown)


@dataclass(frozen=True, slots=True)
class ChargingHalt(MapFeature):
    """A halt at a station, by its id, at which nothing is charged, since driving on from rest serves better.

    leg: position of the leg on which it lies. place: of the station. overhead_s: of the halt, with waiting_s, for which
    the station is still closed on arrival. price: of a session without a charge, None where there is none in numbers.
    """

    station: str
    name: str
    operator: str
    network: str
    leg: int
    place: Place
    along_m: float
    arrive_s: float
    depart_s: float
    overhead_s: float
    waiting_s: float
    soc_frac: float
    price: float | None
    currency: str

    @property
    def __geo_interface__(self) -> Feature:
        """GeoJSON Feature: where the station is, with the figures of the halt."""
        shown = {name: getattr(self, name) for name in self.__slots__ if name != "place"}
        return feature({"type": "Point", "coordinates": (self.place.lon_deg, self.place.lat_deg)}, shown)


@dataclass(frozen=True, slots=True)
class ChargingPlan:
    """How a route is charged on.

    objective: its value, in s, kWh or the currency of prices. short_by: by how much at most another plan has less of
    it, 0 where it is proven to be the best, None where nothing is proven; unproven says why. kept_probability_frac: of
    keeping what was asked everywhere in one journey. sources: names and licences of the stations' sources. halts: at
    stations at which nothing is charged. overhead_s: of stops, halts and stays, with waiting_s.
    """

    stops: tuple[ChargingStop, ...]
    halts: tuple[ChargingHalt, ...]
    driving_s: float
    charging_s: float
    overhead_s: float
    waiting_s: float
    objective: float
    short_by: float | None
    unproven: str
    price: float | None
    kept_probability_frac: float | None
    sources: tuple[str, ...]

    @property
    def total_s(self) -> float:
        """Driving, charging and overhead."""
        return self.driving_s + self.charging_s + self.overhead_s


@dataclass(frozen=True, slots=True)
class ChargingHelp:
    """What would make a plan possible.

    kind: "speed_cap" [km/h], "max_soc", "soc" (charge at departure), "confidence", of which value is what helps, a
    fraction 0..1 where it is no speed; or "stations" to be added, whose value is None. text: the same in words.
    """

    kind: str
    value: float | None
    text: str


@dataclass(frozen=True, slots=True)
class NoChargingPlan:
    """Why no charging stops make the goal reachable.

    from_station: id of where the leg begins that fails, last_reached: of the last station in reach; "" for none. helps:
    what would help.
    """

    reason: str
    from_station: str
    missing_kwh: float
    last_reached: str
    helps: tuple[ChargingHelp, ...]


def plan_of(plan: Plan, route: Route, names: StationNames, objective: Objective) -> ChargingPlan:
    """A plan in human units; route: of it."""
    stop_legs = [leg for leg, route_leg in enumerate(route.legs) if route_leg.ends_at is LegEnd.STOP]
    per_unit = JOULE_PER_KWH if objective is Objective.ENERGY else 1.0
    stations = [*(stop.station for stop in plan.stops), *(halt.station for halt in plan.halts)]
    keys = sorted({station.source for station in stations if station is not None})
    return ChargingPlan(
        stops=tuple(_stop(stop, leg) for stop, leg in zip(plan.stops, stop_legs, strict=True)),
        halts=tuple(_halt(halt, halt_leg(halt, route)) for halt in plan.halts),
        driving_s=float(plan.driving_s),
        charging_s=float(plan.charging_s),
        overhead_s=float(plan.overhead_s),
        waiting_s=plan.waiting_s,
        objective=plan.objective / per_unit,
        short_by=None if plan.short_by is None else plan.short_by / per_unit,
        unproven=plan.unproven,
        price=plan.price,
        kept_probability_frac=plan.kept_probability_frac,
        sources=tuple(f"{source.name} ({source.licence})" for key in keys if (source := names.sources.get(key))),
    )


def no_plan_of(no_plan: NoPlan) -> NoChargingPlan:
    """Why there is no plan, in human units."""
    return NoChargingPlan(
        no_plan.reason,
        _id(no_plan.from_station),
        no_plan.missing_j / JOULE_PER_KWH,
        _id(no_plan.last_reached),
        tuple(map(_help, no_plan.helps)),
    )


def _help(each: Help) -> ChargingHelp:
    value = each.value
    if value is not None and each.kind is HelpKind.SPEED_CAP:
        value = round(value * KMH_PER_MPS, SPEED_DIGITS)
    return ChargingHelp(each.kind.value, value, each.text)


def _id(station: Station | None) -> str:
    return "" if station is None else station.id


def _stop(stop: ChargeStop, leg: int) -> ChargingStop:
    station, socket = stop.station, stop.socket
    p10, p50, p90 = stop.arrive_quantiles_frac or (None, None, None)
    return ChargingStop(
        station=_id(station),
        name="" if station is None else station.name,
        operator="" if station is None else station.operator,
        network="" if station is None else station.network,
        connector="" if socket is None else socket.connector.value,
        output_kw=None if socket is None or socket.output_w is None else socket.output_w / W_PER_KW,
        leg=leg,
        place=None if station is None else place_of(station.at),
        arrive_s=stop.arrive_s,
        depart_s=stop.depart_s,
        overhead_s=stop.overhead_s,
        waiting_s=stop.waiting_s,
        charging_s=stop.charging_s,
        soc_arrive_frac=stop.arrive_soc_frac,
        soc_depart_frac=stop.depart_soc_frac,
        charged_kwh=stop.charged_j / JOULE_PER_KWH,
        drawn_kwh=stop.drawn_j / JOULE_PER_KWH,
        mean_power_kw=stop.mean_power_w / W_PER_KW,
        power_bands=tuple((low / W_PER_KW, high / W_PER_KW, taken) for low, high, taken in stop.power_bands),
        price=stop.price,
        currency=stop.currency,
        soc_arrive_p10_frac=p10,
        soc_arrive_p50_frac=p50,
        soc_arrive_p90_frac=p90,
        kept_probability_frac=stop.kept_probability_frac,
        fallback="" if stop.fallback is None else stop.fallback.station.id,
        gatekeeper=stop.gatekeeper,
    )


def _halt(halt: Halt, leg: int) -> ChargingHalt:
    station = halt.station
    return ChargingHalt(
        station=station.id,
        name=station.name,
        operator=station.operator,
        network=station.network,
        leg=leg,
        place=place_of(station.at),
        along_m=halt.along_m,
        arrive_s=halt.arrive_s,
        depart_s=halt.arrive_s + halt.overhead_s,
        overhead_s=halt.overhead_s,
        waiting_s=halt.waiting_s,
        soc_frac=halt.soc_frac,
        price=halt.price,
        currency=halt.currency,
    )
