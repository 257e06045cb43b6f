"""Journeys with charging stops: what is asked for, and the plan that is answered."""

from __future__ import annotations

from enum import StrEnum
from typing import Annotated, Final, Literal

from pydantic import Discriminator, Field, NaiveDatetime, Tag, model_validator

from app.schemas.base import Answered, Count, Fraction, Number, Sent, refusal
from app.schemas.place import LatLon, PointGeometry
from app.schemas.stations.facts import PriceAnswer, SocketAnswer, StationSourceAnswer
from energy.charging.charging import MOST_POWER_W, Connector
from energy.conditions import CONDITION_RANGES
from energy.units import KMH_PER_MPS
from routing.charging.plan import HelpKind, Objective
from routing.stations.station import Access

MOST_STOPS: Final = 50
MOST_PLANS: Final = 3  # beside the best one
MOST_SPEED_CAPS: Final = 4
MOST_NAMES: Final = 50
MOST_STATIONS: Final = 1000
LONGEST_NAME: Final = 200
LONGEST_ID: Final = 400
MOST_MINUTES: Final = 7 * 24 * 60
MOST_OVERHEAD_S: Final = 7200.0
FACTOR_RANGE: Final = (0.1, 10.0)
CONFIDENCE_RANGE: Final = (0.5, 0.999)
LEAST_SPEED_CAP_KMH: Final = 30.0
MOST_POWER_KW: Final = MOST_POWER_W / 1000.0
MOST_SPEED_KMH: Final = round(CONDITION_RANGES["top_speed_mps"][1] * KMH_PER_MPS, 9)

NetworkName = Annotated[str, Field(min_length=1, max_length=LONGEST_NAME)]
NetworkNames = Annotated[list[NetworkName], Field(max_length=MOST_NAMES)]
StationId = Annotated[str, Field(min_length=1, max_length=LONGEST_ID)]
SpeedCap = Annotated[
    float, Field(strict=True, allow_inf_nan=False, ge=LEAST_SPEED_CAP_KMH, le=MOST_SPEED_KMH, description="km/h")
]


def _form_of_stay_place(value: object) -> str | None:
    if value == "goal":
        return "named"
    return "count" if isinstance(value, int) and not isinstance(value, bool) else None


StayPlace = Annotated[
    Annotated[int, Field(strict=True, ge=0), Tag("count")] | Annotated[Literal["goal"], Tag("named")],
    Discriminator(
        _form_of_stay_place,
        custom_error_type="stay_place",
        custom_error_message="a position in via, from 0, or goal",
    ),
]


class NetworksSent(Sent):
    """Networks and operators by name, in any case; those that are not named count as they are."""

    preferred: NetworkNames = Field(default=[], description="where a minute counts as preferred_factor minutes")
    avoided: NetworkNames = Field(default=[], description="where a minute counts as avoided_factor minutes")
    excluded: NetworkNames = Field(default=[], description="where nobody stops")
    preferred_factor: Number = Field(default=0.8, ge=FACTOR_RANGE[0], le=1, description="on time at preferred ones")
    avoided_factor: Number = Field(default=1.5, ge=1, le=FACTOR_RANGE[1], description="on time at avoided ones")

    @model_validator(mode="after")
    def _each_once(self) -> NetworksSent:
        named: dict[str, str] = {}
        for kind in ("preferred", "avoided", "excluded"):
            for k, name in enumerate(getattr(self, kind)):
                other = named.setdefault(name.casefold(), f"{kind}[{k}]")
                if other != f"{kind}[{k}]":
                    raise refusal(f"{kind}[{k}]", name, f"each network once; it is {other}, too")
        return self


class StaySent(Sent):
    """A stay that is taken anyway, at a via point or at the goal; the vehicle may charge there."""

    at: StayPlace = Field(description="position of the via point in via, from 0, or goal")
    minutes: Number = Field(gt=0, le=MOST_MINUTES, description="how long [min]")
    power_kw: Number = Field(
        default=0.0, ge=0, le=MOST_POWER_KW, description="at which it charges there, from the wall [kW]; 0: not at all"
    )


class ViaStationSent(Sent):
    """A via point that is a station at which the vehicle charges."""

    via: Count = Field(
        ge=0, description="position of the via point in via, from 0; the station's place is taken for it"
    )
    station: StationId = Field(description="id of the station")


class ChargingRequest(Sent):
    """What charging stops may be like. Charges are fractions of the usable capacity."""

    arrive_soc: Fraction = Field(default=0.1, description="least charge on arrival at every stop, below max_soc")
    goal_soc: Fraction = Field(default=0.1, description="least charge on arrival at the goal")
    max_soc: Fraction = Field(default=0.8, description="charge at which a vehicle leaves a station at most")
    overhead_s: Number = Field(
        default=300.0,
        ge=0,
        le=MOST_OVERHEAD_S,
        description="of every stop: leaving the road, plugging in, paying, beside charging itself [s]",
    )
    connectors: list[Connector] | None = Field(
        default=None, min_length=1, max_length=len(Connector), description="plugs to use; without it, all that fit"
    )
    min_power_kw: Number = Field(
        default=0.0, ge=0, le=MOST_POWER_KW, description="least output of a socket [kW]; 0: any"
    )
    networks: NetworksSent | None = Field(default=None, description="which to prefer, avoid or exclude")
    stations: list[StationId] | None = Field(
        default=None, min_length=1, max_length=MOST_STATIONS, description="ids of the only stations to stop at"
    )
    excluded_stations: list[StationId] = Field(
        default=[], max_length=MOST_STATIONS, description="ids of stations not to stop at"
    )
    via_stations: list[ViaStationSent] = Field(
        default=[],
        max_length=20,
        description="via points that are stations, at which the vehicle charges before any other",
    )
    stays: list[StaySent] = Field(default=[], max_length=21, description="stays that are taken anyway")
    departure_time: NaiveDatetime | None = Field(
        default=None,
        description="local time such as 2026-11-30T08:15, for opening hours and times of arrival; without it, that of "
        "conditions.departure; without both, opening hours are not looked at",
    )
    objective: Objective = Field(
        default=Objective.TIME, description="what a plan has least of: time, energy of driving, or cost"
    )
    time_value_per_h: Number = Field(
        default=10.0, ge=0, le=10_000, description="an hour's worth in the currency of the prices, where cost counts"
    )
    confidence: Number | None = Field(
        default=None,
        ge=CONFIDENCE_RANGE[0],
        le=CONFIDENCE_RANGE[1],
        description="probability with which the charge on arrival is kept at every stop; without it, on average",
    )
    speed_caps_kmh: list[SpeedCap] = Field(
        default=[], max_length=MOST_SPEED_CAPS, description="highest speeds that a leg may also be driven at [km/h]"
    )
    most_stops: Count = Field(default=20, ge=0, le=MOST_STOPS, description="stations to stop at, at most")
    alternatives: Count = Field(
        default=0, ge=0, le=MOST_PLANS, description="further plans: with the fewest stops, fastest, with most reserve"
    )

    @model_validator(mode="after")
    def _no_contradiction(self) -> ChargingRequest:
        if self.arrive_soc >= self.max_soc and "arrive_soc" not in self.model_fields_set:
            raise refusal("max_soc", self.max_soc, f"above arrive_soc, {self.arrive_soc}")
        if self.arrive_soc >= self.max_soc:
            raise refusal("arrive_soc", self.arrive_soc, f"below max_soc, {self.max_soc}")
        for name in ("connectors", "stations", "excluded_stations", "speed_caps_kmh"):
            values = getattr(self, name) or []
            if len(set(values)) != len(values):
                raise refusal(name, values, "each once")
        places = [stay.at for stay in self.stays]
        if len(set(places)) != len(places):
            raise refusal("stays", places, "one stay a place")
        if len(self.via_stations) > self.most_stops:
            raise refusal("most_stops", self.most_stops, f"at least {len(self.via_stations)}, as many as via_stations")
        for k, chosen in enumerate(self.via_stations):
            if chosen.station in self.excluded_stations:
                raise refusal(f"via_stations[{k}].station", chosen.station, "a station that is not excluded")
            if chosen.via in places or chosen.via in [other.via for other in self.via_stations[:k]]:
                raise refusal(f"via_stations[{k}].via", chosen.via, "one stay or station a via point")
        return self


class StopStation(Answered):
    """The station of a stop, as GET /graphs/{name}/stations has it."""

    id: str
    name: str
    operator: str
    network: str
    at: LatLon = Field(description="the place that its source gives")
    sockets: list[SocketAnswer]
    capacity: int | None = Field(description="vehicles at a time; null where not known")
    access: Access
    fee: bool | None
    price: PriceAnswer | None
    opening_hours: str | None = Field(description="in the syntax of OpenStreetMap")
    source: str = Field(description="key of sources")


class PowerBandAnswer(Answered):
    """How long a stop charges within a band of power into the battery."""

    from_kw: float
    to_kw: float | None = Field(description="null: without an upper end")
    seconds: float


class FallbackAnswer(Answered):
    """The next best station should a stop fail."""

    station_id: str
    station_name: str
    at: LatLon
    drive_s: float = Field(description="from the stop to it [s]")
    arrive_soc: float = Field(description="charge on arrival there without charging at the stop; below 0: missing")
    reached: bool = Field(description="whether that is enough")
    wait_s: float = Field(description="how long it is still closed then, looked at with a time of departure [s]")
    open_soc: float = Field(description="charge when it opens, of a vehicle that stays on; below 0: missing")


class ChargingStopAnswer(Answered):
    """One stop of a plan: at a station, or a stay that is taken anyway."""

    station: StopStation | None = Field(description="null of a stay that is taken anyway")
    socket: SocketAnswer | None = Field(description="that the vehicle charges at; null of a stay")
    leg: int = Field(description="position in legs of the leg that ends here")
    at: LatLon = Field(description="on the road")
    link_id: int = Field(description="directed link of the graph")
    offset_m: float = Field(description="from the start of that link [m]")
    along_m: float = Field(description="along the route [m]")
    arrive_s: float = Field(description="since departure [s]")
    depart_s: float = Field(description="since departure [s]")
    arrive_time: str | None = Field(description="local time, ISO 8601; null without a time of departure")
    depart_time: str | None = Field(description="local time, ISO 8601; null without a time of departure")
    overhead_s: float = Field(description="beside charging, with waiting_s [s]")
    waiting_s: float = Field(description="for which the station is still closed on arrival [s]")
    charging_s: float
    arrive_soc: float
    depart_soc: float
    charged_kwh: float = Field(description="into the battery [kWh]")
    drawn_kwh: float = Field(description="from the wall, with what charging loses [kWh]")
    mean_power_kw: float = Field(description="into the battery while charging [kW]")
    power_bands: list[PowerBandAnswer] = Field(description="time of charging by power into the battery, least first")
    price: float | None = Field(description="of this stop; null where the station gives none in numbers")
    currency: str = Field(description="of the price, ISO 4217; empty where not known")
    arrive_soc_p10: float | None = Field(
        description="charge on arrival that is exceeded with 90 % probability: the cautious one; null where not asked"
    )
    arrive_soc_p50: float | None = Field(description="charge on arrival that is exceeded with 50 % probability")
    arrive_soc_p90: float | None = Field(description="charge on arrival that is exceeded with 10 % probability")
    probability_kept: float | None = Field(description="of arriving with at least arrive_soc")
    fallback: FallbackAnswer | None = Field(description="where else to charge should this stop fail; null: nowhere")
    gatekeeper: bool | None = Field(
        description="whether there is no way to the goal without this station; null: not known, or not looked for"
    )


class ChargingHaltAnswer(Answered):
    """A halt at a station at which nothing is charged, since driving on from rest serves better than passing it."""

    station: StopStation
    leg: int = Field(description="position in legs of the leg on which it lies")
    at: LatLon = Field(description="on the road")
    link_id: int = Field(description="directed link of the graph")
    offset_m: float = Field(description="from the start of that link [m]")
    along_m: float = Field(description="along the route [m]")
    arrive_s: float = Field(description="since departure [s]")
    depart_s: float = Field(description="since departure [s]")
    arrive_time: str | None = Field(description="local time, ISO 8601; null without a time of departure")
    depart_time: str | None = Field(description="local time, ISO 8601; null without a time of departure")
    overhead_s: float = Field(description="of the halt, with waiting_s [s]")
    waiting_s: float = Field(description="for which the station is still closed on arrival [s]")
    soc: float = Field(description="charge on arrival and at departure")
    price: float | None = Field(description="of a session without a charge; null where there is none in numbers")
    currency: str = Field(description="of the price, ISO 4217; empty where not known")


class GoalStay(Answered):
    """A stay at the goal that is taken anyway, in which the vehicle charges."""

    depart_s: float = Field(description="end of the stay, since departure [s]")
    depart_time: str | None = Field(description="local time, ISO 8601; null without a time of departure")
    depart_soc: float
    charging_s: float
    charged_kwh: float = Field(description="into the battery [kWh]")
    drawn_kwh: float = Field(description="from the wall [kWh]")


class GoalArrival(Answered):
    """The end of a plan."""

    arrive_s: float = Field(description="since departure [s]")
    arrive_time: str | None = Field(description="local time, ISO 8601; null without a time of departure")
    arrive_soc: float
    arrive_soc_p10: float | None = Field(description="exceeded with 90 % probability; null where not asked")
    arrive_soc_p50: float | None
    arrive_soc_p90: float | None
    probability_kept: float | None = Field(description="of arriving with at least goal_soc")
    stay: GoalStay | None = Field(description="null unless asked for")


class PlanTotals(Answered):
    """Sums over a plan."""

    total_s: float = Field(description="driving, charging and overhead [s]")
    driving_s: float
    charging_s: float
    overhead_s: float = Field(description="of stops and halts, with waiting_s, and of stays without charging [s]")
    waiting_s: float = Field(description="for which stations of stops and halts are still closed on arrival [s]")
    charged_kwh: float = Field(description="into the battery at all stops [kWh]")
    drawn_kwh: float = Field(description="from the wall at all stops [kWh]")
    price: float | None = Field(description="of all stops; null where one gives none or currencies differ")
    currency: str = Field(description="of the price, empty without one")


class PlanProof(Answered):
    """How good a plan is at least, for the model: how much less of the objective any other plan has at most."""

    proven: bool = Field(description="whether there is no better plan")
    short_by: float | None = Field(
        description="by how much at most a better plan is better, in the objective's unit; null: nothing is proven"
    )
    unproven: str | None = Field(description="why it is not proven; null where it is")


class ChargingPlanAnswer(Answered):
    """How a route is charged on."""

    objective: Objective
    objective_value: float = Field(description="of this plan, in objective_unit; weighted by factors of networks")
    objective_unit: str = Field(description="s, kWh, or the currency of prices (empty where not known)")
    proof: PlanProof
    totals: PlanTotals
    stops: list[ChargingStopAnswer] = Field(description="in order; empty where none is needed")
    halts: list[ChargingHaltAnswer] = Field(
        description="at stations at which nothing is charged, in order; nearly always empty"
    )
    goal: GoalArrival
    probability_kept: float | None = Field(
        description="of arriving everywhere in one journey with at least what was asked; null where not known"
    )
    sources: list[StationSourceAnswer] = Field(
        description="of the stations of this plan; to be named where it is shown"
    )


class HelpUnit(StrEnum):
    """Of the value of what would help."""

    KMH = "km/h"
    FRACTION = "fraction"


class HelpAnswer(Answered):
    """What would make a plan possible: the field of a request to change, and to which value."""

    kind: HelpKind = Field(
        description="speed_cap: charging.speed_caps_kmh with value; max_soc: charging.max_soc; soc: soc at departure; "
        "confidence: charging.confidence; stations: added to the graph"
    )
    value: float | None = Field(description="in unit, as the field takes it; null of stations")
    unit: HelpUnit | None = Field(description="km/h of a speed cap, fraction (0..1) of a charge or a confidence")
    text: str = Field(description="the same in words")


class NoPlanAnswer(Answered):
    """Why there is no plan."""

    reason: str
    from_station: StopStation | None = Field(
        description="where the leg begins that fails; null: at the start, or no leg"
    )
    missing_kwh: float = Field(description="by how much that leg fails [kWh]")
    last_reached: StopStation | None = Field(description="the station in reach that is nearest to the goal")
    helps: list[HelpAnswer] = Field(
        description="each of what would help, the least first: less speed, a higher cap, more charge, less confidence"
    )
    sources: list[StationSourceAnswer] = Field(description="of the stations named here")


class PlanningStats(Answered):
    """What planning stops took."""

    leg_searches: int = Field(description="searches of ways between stations")
    legs_cached: int = Field(description="ways that were known from requests before")
    labels_made: int = Field(description="of the search over stations")
    labels_settled: int
    seconds: float
    stage_s: dict[str, float] = Field(description="when each stage had ended, since the beginning [s]")


class ChargingStopProperties(ChargingStopAnswer):
    """What a Point feature says of a stop."""

    kind: Literal["stop"] = "stop"
    route: str = Field(description="name of its route")
    marker_color: str = Field(alias="marker-color", description="colour of the marker, by simplestyle-spec")


class ChargingHaltProperties(ChargingHaltAnswer):
    """What a Point feature says of a halt."""

    kind: Literal["halt"] = "halt"
    route: str = Field(description="name of its route")
    marker_color: str = Field(alias="marker-color", description="colour of the marker, by simplestyle-spec")


class ChargingHaltFeature(Answered):
    """GeoJSON Feature of a halt at which nothing is charged, where its road is."""

    type: Literal["Feature"] = "Feature"
    geometry: PointGeometry
    properties: ChargingHaltProperties


class ChargingStopFeature(Answered):
    """GeoJSON Feature of a stop, where its road is."""

    type: Literal["Feature"] = "Feature"
    geometry: PointGeometry
    properties: ChargingStopProperties
