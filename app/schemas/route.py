"""Routes: what is asked, what is answered, and the same as GeoJSON."""

from __future__ import annotations

from typing import Any, ClassVar, Final, Literal

from pydantic import Field, create_model, model_validator

from app.schemas.base import Answered, Flag, Number, Sent, refusal
from app.schemas.charging import (
    ChargingHaltFeature,
    ChargingPlanAnswer,
    ChargingRequest,
    ChargingStopFeature,
    NoPlanAnswer,
    PlanningStats,
)
from app.schemas.drive import SearchRequest
from app.schemas.graph import TerrainNote
from app.schemas.guidance.steps import StepAnswer
from app.schemas.lean.form import COMPACT_MEANS, GeometryFormat, Overview
from app.schemas.lean.names import Picked, check_names
from app.schemas.place import LatLon, LineString, PlaceFeature, PlaceOrText, Snapped
from app.schemas.places.named import PLACES_MEANS, PlaceNamed
from energy.chain.chain import StopRule
from energy.force.parts import Part
from routing.queries import EPSILON_RANGE, MOST_RANGE, ParetoSettings
from routing.route.hot_links import HotReason
from routing.route.route import LegEnd, ParetoProof

MAX_VIA: Final = 20
BATTERY_MEANS: Final = "that the battery gave, what its charge fell by: energy_kwh and what was braked away [kWh]"
NamedWeighting = Literal["eco", "fastest", "balanced"]


class WeightsSent(Sent):
    """What the search minimises: energy·[kWh] + time·[h] + distance·[km]."""

    energy: Number = Field(default=0.0, ge=0, le=1e6, description="a kWh's worth")
    time: Number = Field(default=0.0, ge=0, le=1e6, description="an hour's worth")
    distance: Number = Field(default=0.0, ge=0, le=1e6, description="a kilometre's worth")

    @model_validator(mode="after")
    def _something_weighs(self) -> WeightsSent:
        if self.energy + self.time + self.distance <= 0.0:
            raise refusal("", "all 0", "at least one of energy, time, distance above 0")
        return self


class ParetoSent(Sent):
    """The Pareto set of time and energy: few routes of which one is about as good as any other way."""

    epsilon_frac: Number = Field(
        default=ParetoSettings().epsilon_frac,
        ge=EPSILON_RANGE[0],
        le=EPSILON_RANGE[1],
        description="how much worse the best of the routes may be than any other way, in time and in energy",
    )
    most: int = Field(
        default=ParetoSettings().most, ge=MOST_RANGE[0], le=MOST_RANGE[1], strict=True, description="of routes"
    )


class RouteRequest(SearchRequest):
    """One route request; unknown fields are errors."""

    order: ClassVar[tuple[str, ...]] = (
        "start",
        "goal",
        "via",
        "soc",
        "vehicle",
        "graph",
        "weights",
        "alternatives",
        "pareto",
        "charging",
        "reserve_soc",
        "link_model",
        "stops",
        "conditions",
        "effects",
        "uncertainty",
        "links",
        "steps",
        "geometry_format",
        "overview",
        "fields",
        "compact",
    )

    start: PlaceOrText
    goal: PlaceOrText
    via: list[PlaceOrText] = Field(
        default=[],
        max_length=MAX_VIA,
        description="places to go over, in this order; the vehicle comes to rest at each and goes on at once",
    )
    weights: WeightsSent | None = Field(
        default=None, description="own weighting; excludes alternatives; default energy only"
    )
    alternatives: list[NamedWeighting] | None = Field(
        None, min_length=1, max_length=3, description="one route for each named weighting; excludes weights"
    )
    pareto: ParetoSent | None = Field(
        default=None, description="the Pareto set of time and energy; excludes weights and alternatives"
    )
    charging: ChargingRequest | None = Field(
        default=None,
        description="has charging stops planned where the charge does not suffice; excludes weights, alternatives and "
        "pareto",
    )
    uncertainty: Flag = Field(default=False, description="true adds quantiles of energy and arrival charge")
    links: Flag = Field(default=True, description="false leaves the list of links out of the answer")
    steps: Flag = Field(default=False, description="true adds what a driver is told along each route")
    geometry_format: GeometryFormat = Field(
        default=GeometryFormat.GEOJSON,
        description="how lines are written: as GeoJSON, or as a text in the polyline encoding with 5 or 6 decimals",
    )
    overview: Overview = Field(
        default=Overview.FULL,
        description="lines in full, simplified to what a map of the whole route shows, or none",
    )
    fields: Picked = None
    compact: Flag | None = Field(default=None, description=COMPACT_MEANS)

    @model_validator(mode="after")
    def _one_weighting(self) -> RouteRequest:
        if self.weights is not None and self.alternatives is not None:
            raise refusal("weights", "sent with alternatives", "either weights or alternatives, not both")
        if self.pareto is not None and (self.weights is not None or self.alternatives is not None):
            raise refusal("pareto", "sent with weights or alternatives", "pareto without weights and alternatives")
        if self.alternatives is not None and len(set(self.alternatives)) != len(self.alternatives):
            raise refusal("alternatives", self.alternatives, "each at most once")
        self.check_reserve()
        if self.charging is not None:
            self._check_charging(self.charging)
        check_names(self.fields, RouteResponse)
        return self

    def _check_charging(self, charging: ChargingRequest) -> None:
        """Refuse what contradicts a plan with charging stops."""
        for name in ("weights", "alternatives", "pareto"):
            if getattr(self, name) is not None:
                allowed = f"{name} without charging, whose objective says what is best"
                raise refusal(name, "sent with charging", allowed)
        if self.stops is StopRule.COUNTED:
            raise refusal("stops", self.stops.value, "with charging expected, none or crossings")
        if self.reserve_soc >= charging.max_soc:
            raise refusal("charging.max_soc", charging.max_soc, f"above reserve_soc, {self.reserve_soc}")
        is_charged_by_stays = any(stay.power_kw > 0.0 for stay in charging.stays)
        if charging.goal_soc > max(charging.max_soc, self.soc) and not is_charged_by_stays:
            allowed = f"at most max_soc, {charging.max_soc}, or more with a greater soc or a stay that charges"
            raise refusal("charging.goal_soc", charging.goal_soc, allowed)
        for k, chosen in enumerate(charging.via_stations):
            if chosen.via >= len(self.via):
                allowed = f"0..{len(self.via) - 1}" if self.via else "a request with via points"
                raise refusal(f"charging.via_stations[{k}].via", chosen.via, allowed)
        for k, stay in enumerate(charging.stays):
            if stay.at != "goal" and stay.at >= len(self.via):
                places = "goal" if not self.via else f"0..{len(self.via) - 1}, a position in via, or goal"
                raise refusal(f"charging.stays[{k}].at", stay.at, places)
        departure = None if self.conditions is None else self.conditions.departure
        if None not in (departure, charging.departure_time) and departure != charging.departure_time:
            raise refusal(
                "charging.departure_time",
                str(charging.departure_time),
                f"that of conditions.departure, {departure}, or one of them alone",
            )


_PART_FIELDS: Final[Any] = {part.value: (float, Field(default=0.0, description=part.meaning)) for part in Part}
_FloatByPart: Any = create_model("_FloatByPart", __base__=Answered, **_PART_FIELDS)


class EnergyPartsKwh(_FloatByPart):  # type: ignore[misc]  # its fields are those of energy.force.parts.Part
    """Battery energy by cause [kWh]; the parts add up to the whole. Those of effects are 0 while the effect is off.

    In compact answers those that are 0 are left out.
    """


class EnergyPartsWh(EnergyPartsKwh):
    """Battery energy by cause [Wh]; the parts add up to the whole."""


class RouteLinkAnswer(Answered):
    """One link of a route, driven from from_m to to_m of its length."""

    id: int = Field(description="directed link of the graph; can be sent to POST /simulate")
    from_m: float
    to_m: float
    rest: bool = Field(description="whether it ends at a via point or charging stop, where the vehicle comes to rest")
    length_m: float = Field(description="driven length, to_m - from_m [m]")
    duration_s: float = Field(description="with standing still [s]")
    energy_wh: float = Field(description="from the battery, negative where more is recuperated [Wh]")
    energy_parts_wh: EnergyPartsWh
    soc_end: float = Field(description="state of charge at its end; below 0 is missing energy")
    soc_end_p10: float | None = Field(
        description="charge at its end that is exceeded with 90 % probability; null unless uncertainty was asked for"
    )
    soc_end_p90: float | None = Field(
        description="charge at its end that is exceeded with 10 % probability; null unless uncertainty was asked for"
    )
    grade: float = Field(description="rise over length")
    height_end_m: float = Field(description="height of its end above sea [m]; 0 on a graph without terrain")
    geometry_end: int = Field(
        description="position in the line's points of that at which it ends, or of the next one with a simplified line"
    )
    speed_limit_kmh: float
    speed_end_kmh: float = Field(
        description="speed carried into the next link, given no stop [km/h]; 0 where it comes to rest for certain"
    )
    stop_probability: float = Field(description="of stopping at its end, 0..1")
    name: str


class RouteLegAnswer(Answered):
    """A route from one of its places to the next: start, via points and charging stops in order, goal."""

    ends_at: LegEnd = Field(description="what it leads to")
    from_m: float = Field(description="along the route [m]")
    to_m: float = Field(description="along the route [m]")
    duration_s: float
    energy_kwh: float
    battery_kwh: float = Field(description=BATTERY_MEANS)
    soc_start: float = Field(description="state of charge at its beginning: after charging where it begins at a stop")
    soc_end: float = Field(description="state of charge at its end; below 0 is missing energy")
    speed_cap_kmh: float | None = Field(description="highest speed that it is driven at by plan; null: none")
    first_link: int | None = Field(description="position of its first link in links; null where nothing is driven")
    last_link: int | None = Field(description="position of its last link in links; null where nothing is driven")


class HotLinks(Answered):
    """A stretch of a route that takes more energy for its length than the rest, and what it has more of."""

    first: int = Field(description="position of its first link in links")
    last: int = Field(description="position of its last link in links")
    from_m: float = Field(description="along the route [m]")
    to_m: float = Field(description="along the route [m]")
    energy_kwh: float
    energy_share: float | None = Field(description="of the route's energy; null where that is not above 0")
    kwh_per_100km: float
    times_mean: float | None = Field(description="energy a metre over the route's; null where that is not above 0")
    reason: HotReason = Field(description="what it has more of than the route: climb, speed, stops, …")
    rise_m: float = Field(description="height of its end above its start [m]")
    stop_count: float = Field(description="expected stops on it")
    speed_kmh: float = Field(description="mean, with standing still")
    names: list[str] = Field(description="roads, each once, in order")


class UncertaintyAnswer(Answered):
    """How far a route's energy may be off: vehicle parameters within their sd, and the model's own residual."""

    soc_end_p10: float = Field(description="charge on arrival that is exceeded with 90 % probability: the cautious one")
    soc_end_p50: float = Field(description="charge on arrival that is exceeded with 50 % probability")
    soc_end_p90: float = Field(description="charge on arrival that is exceeded with 10 % probability")
    energy_kwh_p10: float = Field(description="not exceeded with 10 % probability")
    energy_kwh_p50: float = Field(description="not exceeded with 50 % probability")
    energy_kwh_p90: float = Field(description="not exceeded with 90 % probability")
    probability_above_reserve: float = Field(description="of never falling below reserve_soc, arrival included")
    parameter_sd_share: float = Field(description="sd of the dissipated energy from the vehicle's parameters")
    residual_sd_share: float = Field(description="sd of the dissipated energy from what the model leaves out")
    samples: int
    seed: int


class RemedyAnswer(Answered):
    """What would make an infeasible route feasible."""

    soc_start_needed: float = Field(description="charge at departure that this route needs, may exceed 1")
    charge_needed_kwh: float = Field(description="energy to add before departure or on the way [kWh]")


class RouteProperties(Answered):
    """Everything of one route but its geometry."""

    name: str = Field(
        description="weighting that it is best in; 'custom' for own weights; 'pareto-2' … of a Pareto set; 'best', "
        "'fewest stops', 'fastest', 'most reserve' of plans with charging stops"
    )
    weights: WeightsSent | None = Field(
        description="what it is best in; null for a route of a Pareto set that no weighting found, and of a plan"
    )
    feasible: bool = Field(description="whether the charge stays above the reserve")
    distance_m: float
    duration_s: float = Field(description="of driving, with standing still at crossings [s]")
    total_s: float = Field(description="with charging stops and their overhead [s]; duration_s without any")
    energy_kwh: float = Field(description="with what is braked away counted as given back [kWh]; the sum of its parts")
    battery_kwh: float = Field(description=BATTERY_MEANS)
    energy_parts_kwh: EnergyPartsKwh
    braked_away_kwh: float = Field(description="recuperation that a full battery could not take [kWh]")
    soc_start: float
    soc_end: float = Field(description="below 0 is missing energy")
    soc_min: float
    climb_m: float
    descent_m: float
    height_start_m: float = Field(description="height of its beginning above sea [m]; 0 on a graph without terrain")
    deficit_kwh: float = Field(description="energy missing to stay above the reserve [kWh], 0 if feasible")
    furthest: LatLon | None = Field(description="where the charge falls below the reserve")
    remedy: RemedyAnswer | None
    uncertainty: UncertaintyAnswer | None = Field(description="null unless asked for, and of routes with stops")
    hot_links: list[HotLinks] = Field(description="where the energy goes: the most energy-intensive stretches")
    charging: ChargingPlanAnswer | None = Field(description="stops, totals and proof; null unless asked for")
    legs: list[RouteLegAnswer] = Field(
        description="from place to place; one where there are neither via points nor charging stops"
    )
    links: list[RouteLinkAnswer] | None = Field(description="in driving order; null if not asked for")
    steps: list[StepAnswer] | None = Field(
        description="what a driver is told, from a departure to an arrival for each leg; null unless asked for"
    )


class RouteFound(RouteProperties):
    """One route."""

    geometry: LineString | str | None = Field(
        description="the line; a text in the polyline encoding with geometry_format, null with overview none"
    )


class SnappedEnds(Answered):
    """Where start, via points and goal met the road network."""

    start: Snapped
    via: list[Snapped] = Field(description="in the order asked; empty without via points")
    goal: Snapped


class SearchStatsAnswer(Answered):
    """What a search did."""

    labels_made: int
    labels_settled: int
    seconds: float
    method: str


class ParetoAnswer(Answered):
    """What is proven of a Pareto set.

    For every way that keeps the reserve there is one of the routes that takes at most 1 + epsilon_frac times its time
    and uses at most energy_slack_kwh more charge than it. The charge used is battery_kwh.
    """

    epsilon_frac: float | None = Field(
        description="more than asked for if most routes are not enough; null where nothing is proven"
    )
    energy_slack_kwh: float | None = Field(description="epsilon_frac of reference_kwh; null where nothing is proven")
    reference_kwh: float = Field(
        description="charge that the route of least energy uses beyond its gain in height, which all ways share"
    )
    found: int = Field(
        description="routes found that none is better than in both, of which those answered are a choice"
    )
    proof: ParetoProof = Field(description="best ways by weightings, or all ways compared in time and energy, or none")
    unproven: str | None = Field(description="why nothing is proven, null where something is")


class RouteAnswered(Answered):
    """What a route request is answered with, besides the routes."""

    snapped: SnappedEnds
    places: list[PlaceNamed] = Field(description=PLACES_MEANS)
    request: RouteRequest = Field(description="the request as understood, with defaults; can be sent again")
    warnings: list[str]
    stats: list[SearchStatsAnswer] = Field(description="one for each search")
    pareto: ParetoAnswer | None = Field(description="what is proven of a Pareto set; null unless asked for")
    no_plan: NoPlanAnswer | None = Field(
        description="why no charging stops make the goal reachable; routes then shows the way without charging"
    )
    planning: PlanningStats | None = Field(description="what planning stops took; null unless asked for")
    terrain: TerrainNote


class RouteResponse(RouteAnswered):
    """Routes, in the order of the weightings asked; those of a Pareto set from the fastest to the thriftiest.

    With charging, one for each plan, the best first.
    """

    routes: list[RouteFound]


class RouteFeatureProperties(RouteProperties):
    """What a LineString feature says of a route."""

    stroke: str = Field(description="colour of the line, by simplestyle-spec")


class RouteFeature(Answered):
    """GeoJSON Feature of one route."""

    type: Literal["Feature"] = "Feature"
    geometry: LineString | None = Field(description="null with overview none, or where fields leave it out")
    properties: RouteFeatureProperties


class LegProperties(RouteLegAnswer):
    """What a LineString feature says of a leg between charging stops."""

    kind: Literal["leg"] = "leg"
    route: str = Field(description="name of its route")
    leg: int = Field(description="position in its legs")
    stroke: str = Field(description="colour of the line, by simplestyle-spec")


class LegFeature(Answered):
    """GeoJSON Feature of a leg."""

    type: Literal["Feature"] = "Feature"
    geometry: LineString | None = Field(description="null with overview none")
    properties: LegProperties


class RouteFeatureCollection(RouteAnswered):
    """The same answer as GeoJSON: a LineString a route, then Points for start, via points and goal.

    With charging, LineStrings for the legs of each route, Points for its stops and for its halts follow.
    """

    type: Literal["FeatureCollection"] = "FeatureCollection"
    features: list[RouteFeature | LegFeature | ChargingStopFeature | ChargingHaltFeature | PlaceFeature]
