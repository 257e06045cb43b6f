"""Routes from one place to another."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from typing import TYPE_CHECKING, Any, overload

import numpy as np

from energy.chain.chain import LinkModel, StopRule
from energy.errors import VehicleError
from energy.units import JOULE_PER_KWH, JOULE_PER_WH, KMH_PER_MPS
from joulepath.charging import no_plan_of, plan_of
from joulepath.conditions import conditions_in_si
from joulepath.figures import (
    EnergyParts,
    Feature,
    MapFeature,
    MapFeatures,
    Place,
    Snapped,
    feature,
    frozen,
    line,
    number_of,
    one_of,
    parts_of,
    place_of,
    point_of,
    snapped_of,
)
from joulepath.steps import steps_from
from routing.errors import QueryError
from routing.guidance.steps import steps_of
from routing.places import LinkSpan
from routing.queries import RouteQuery
from routing.weights import NAMED_WEIGHTS

if TYPE_CHECKING:
    from datetime import datetime

    from numpy.typing import NDArray

    from energy.chain.uncertainty import EnergyDistribution
    from joulepath.charging import Charging, ChargingPlan, NoChargingPlan
    from joulepath.conditions import Conditions
    from joulepath.graph import Graph
    from joulepath.steps import Step
    from joulepath.vehicle import Vehicle
    from routing.charging.plan import ChargingAnswer, ChargingQuery
    from routing.queries import ParetoSettings
    from routing.route.route import Route as FoundRoute
    from routing.route.route import RouteAnswer, RouteLeg
    from routing.weights import Weights

SPEED_DIGITS = 9  # of km/h, so that a cap comes back as it was sent


@dataclass(frozen=True, slots=True)
class Leg:
    """A route from one of its places to the next, from_m to to_m along the route.

    ends_at: "via", "stop" or "goal". soc_start_frac: after charging where it begins at a stop. speed_cap_kmh: highest
    speed that it is driven at by plan.
    """

    ends_at: str
    from_m: float
    to_m: float
    duration_s: float
    energy_kwh: float
    battery_kwh: float
    soc_start_frac: float
    soc_end_frac: float
    speed_cap_kmh: float | None


@dataclass(frozen=True, slots=True)
class Uncertainty:
    """How far a route's energy may be off; quantiles p10, p50 and p90 are not exceeded with 10, 50 and 90 %."""

    energy_p10_kwh: float
    energy_p50_kwh: float
    energy_p90_kwh: float
    soc_end_p10_frac: float
    soc_end_p50_frac: float
    soc_end_p90_frac: float
    above_reserve_frac: float


@dataclass(frozen=True, slots=True, eq=False)
class RouteLinks(MapFeatures):
    """The links of a route in driving order, each field a column with one value a link.

    geometry_end_idx: row of the route's geometry at which the link ends. rest: whether it ends at a via point.
    """

    link_idx: NDArray[np.int64]
    from_m: NDArray[np.float64]
    to_m: NDArray[np.float64]
    rest: NDArray[np.bool_]
    duration_s: NDArray[np.float64]
    energy_wh: NDArray[np.float64]
    soc_end_frac: NDArray[np.float64]
    grade_frac: NDArray[np.float64]
    height_end_m: NDArray[np.float64]
    speed_limit_kmh: NDArray[np.float64]
    speed_end_kmh: NDArray[np.float64]
    stop_probability_frac: NDArray[np.float64]
    geometry_end_idx: NDArray[np.int64]
    road_name: tuple[str, ...]
    geometry_lon_lat_deg: NDArray[np.float64]

    def __len__(self) -> int:
        return self.link_idx.size

    @property
    def spans(self) -> tuple[LinkSpan, ...]:
        """The stretches of links, as `simulate` takes them."""
        rows = zip(self.link_idx.tolist(), self.from_m.tolist(), self.to_m.tolist(), self.rest.tolist(), strict=True)
        return tuple(LinkSpan(*row) for row in rows)

    def _features(self) -> list[Feature]:
        names = [field.name for field in fields(self) if not field.name.startswith("geometry")]
        columns = [list(getattr(self, name)) for name in names]
        begin, found = 0, []
        for row, end in zip(zip(*columns, strict=True), self.geometry_end_idx.tolist(), strict=True):
            values = (value.item() if isinstance(value, np.generic) else value for value in row)
            shape = self.geometry_lon_lat_deg[begin : end + 1]
            found.append(feature(line(shape), dict(zip(names, values, strict=True))))
            begin = end
        return found


@dataclass(frozen=True, slots=True, eq=False)
class Route(MapFeature):
    """One route. Where it is not feasible, deficit_kwh is missing to stay above the reserve, and `furthest` is where.

    battery_kwh: that the battery gave, what its charge fell by: energy_kwh and what was braked away.
    soc_start_needed_frac, charge_needed_kwh: what would make it feasible; None where it is. total_s: with charging
    stops, which `charging` has; it is None where they were not asked for, and where there is no plan. steps: what a
    driver is told, None unless asked for.
    """

    name: str
    feasible: bool
    distance_m: float
    duration_s: float
    total_s: float
    energy_kwh: float
    battery_kwh: float
    energy_parts: EnergyParts
    braked_away_kwh: float
    soc_start_frac: float
    soc_end_frac: float
    soc_min_frac: float
    climb_m: float
    descent_m: float
    deficit_kwh: float
    furthest: Place | None
    soc_start_needed_frac: float | None
    charge_needed_kwh: float | None
    uncertainty: Uncertainty | None
    charging: ChargingPlan | None
    legs: tuple[Leg, ...]
    links: RouteLinks
    geometry_lon_lat_deg: NDArray[np.float64]
    steps: tuple[Step, ...] | None = None

    @property
    def __geo_interface__(self) -> Feature:
        """GeoJSON Feature: the line, with the figures of the whole route."""
        hidden = {"furthest", "uncertainty", "charging", "legs", "links", "geometry_lon_lat_deg", "steps"}
        shown = {name: getattr(self, name) for name in (field.name for field in fields(self)) if name not in hidden}
        return feature(line(self.geometry_lon_lat_deg), shown)


@dataclass(frozen=True, slots=True, eq=False)
class Routes(MapFeatures, Sequence[Route]):
    """Routes in the order of the weightings asked for; those of a Pareto set from the fastest to the thriftiest.

    epsilon_frac, energy_slack_kwh: what is proven of a Pareto set (docs/pareto.md), None where nothing is. no_plan: why
    no charging stops make the goal reachable, where they were asked for.
    """

    routes: tuple[Route, ...]
    start: Snapped
    via: tuple[Snapped, ...]
    goal: Snapped
    warnings: tuple[str, ...]
    epsilon_frac: float | None = None
    energy_slack_kwh: float | None = None
    no_plan: NoChargingPlan | None = None

    def __len__(self) -> int:
        return len(self.routes)

    @overload
    def __getitem__(self, at: int) -> Route: ...

    @overload
    def __getitem__(self, at: slice) -> tuple[Route, ...]: ...

    def __getitem__(self, at: int | slice) -> Route | tuple[Route, ...]:
        return self.routes[at]

    def _features(self) -> Sequence[Route]:
        return self.routes


def route(
    graph: Graph,
    vehicle: Vehicle,
    *,
    start: tuple[float, float],
    goal: tuple[float, float],
    soc_frac: float,
    via: Sequence[tuple[float, float]] = (),
    reserve_soc_frac: float = 0.0,
    alternatives: Sequence[str] = ("eco",),
    weights: Weights | None = None,
    pareto: ParetoSettings | None = None,
    charging: Charging | None = None,
    conditions: Conditions | None = None,
    link_model: str = "integrated",
    stops: str = "expected",
    uncertainty: bool = False,
    steps: bool = False,
    language: str = "",
) -> Routes:
    """The best routes from a place over others to a place; places are (lat, lon) [deg].

    soc_frac: charge at departure, reserve_soc_frac: charge to be kept, both 0..1. alternatives: weightings that a route
    each is answered for, of "eco", "fastest", "balanced"; weights: one of one's own instead; pareto: the Pareto set of
    time and energy instead; charging: plans with charging stops instead, one route each. A goal out of reach on this
    charge is an answer that is not feasible. steps: with what a driver is told along each; language: in which roads are
    named then, as "de", where the map has their names in it.

    Raises QueryError for a value out of range, VehicleError where stops are asked for and the vehicle does not say how
    it charges, PointOutsideMapError, PointFarFromRoadError, NoPathError,
    NegativeCycleError, SearchLimitError.
    """
    if isinstance(alternatives, str) or (weights is None and pareto is None and not alternatives):
        raise QueryError("alternatives", repr(alternatives), f"at least one of {', '.join(NAMED_WEIGHTS)}, in a list")
    for name in alternatives:
        if name not in NAMED_WEIGHTS:
            raise QueryError("alternatives", repr(name), ", ".join(NAMED_WEIGHTS))
    query = RouteQuery(
        start=point_of("start", start),
        goal=point_of("goal", goal),
        via=tuple(point_of(f"via[{k}]", place) for k, place in enumerate(via)),
        soc_frac=number_of("soc_frac", soc_frac),
        vehicle=vehicle.model,
        reserve_soc_frac=number_of("reserve_soc_frac", reserve_soc_frac),
        weightings=tuple((name, NAMED_WEIGHTS[name]) for name in alternatives)
        if weights is None
        else (("custom", weights),),
        link_model=one_of("link_model", link_model, LinkModel),
        stop_rule=one_of("stops", stops, StopRule),
        conditions=conditions_in_si(conditions),
        uncertainty=uncertainty,
        pareto=pareto,
    )
    if charging is None:
        answer, planned = graph.planner.route(query), None
    else:
        answer, planned = _charged(graph, query, charging, None if conditions is None else conditions.departure)
    routes = _routes(answer, planned)
    if not steps:
        return routes
    asked = (*query.via, query.goal)
    with_steps = [
        replace(result, steps=steps_from(steps_of(graph.planner.graph, found, asked=asked, language=language)))
        for result, found in zip(routes.routes, answer.routes, strict=True)
    ]
    return replace(routes, routes=tuple(with_steps))


def _charged(
    graph: Graph, query: RouteQuery, charging: Charging, departure: datetime | None
) -> tuple[RouteAnswer, tuple[Graph, ChargingQuery, ChargingAnswer]]:
    """Routes with charging stops, and what was planned; departure: of the conditions."""
    if query.pareto is not None or [name for name, _ in query.weightings] != ["eco"]:
        raise QueryError("charging", "sent with alternatives, weights or pareto", "charging without them")
    if query.stop_rule is StopRule.COUNTED:
        raise QueryError("stops", query.stop_rule.value, "with charging expected, none or crossings")
    how = query.vehicle.charging
    if how is None:
        allowed = "plugs and power of charging, without which no stops can be planned"
        raise VehicleError("charging", None, allowed, query.vehicle.id)
    asked = charging.in_si(how, graph.station_names, departure)
    asked = replace(asked, arrive_soc_frac=max(asked.arrive_soc_frac, query.reserve_soc_frac))
    answer, charged = graph.planner.journey(query, asked, how, graph.stations.stations)
    return answer, (graph, asked, charged)


def _routes(answer: RouteAnswer, planned: tuple[Graph, ChargingQuery, ChargingAnswer] | None) -> Routes:
    claim = answer.pareto
    slack_j = None if claim is None else claim.slack_j
    plans: list[ChargingPlan | None] = [None] * len(answer.routes)
    no_plan = None
    if planned is not None:
        graph, asked, charged = planned
        no_plan = None if charged.no_plan is None else no_plan_of(charged.no_plan)
        for k, (plan, found) in enumerate(zip(charged.plans, answer.routes, strict=False)):
            plans[k] = plan_of(plan, found, graph.station_names, asked.objective)
    return Routes(
        routes=tuple(map(_route, answer.routes, plans)),
        start=snapped_of(answer.start),
        via=tuple(map(snapped_of, answer.via)),
        goal=snapped_of(answer.goal),
        warnings=answer.warnings,
        epsilon_frac=None if claim is None else claim.epsilon_frac,
        energy_slack_kwh=None if slack_j is None else slack_j / JOULE_PER_KWH,
        no_plan=no_plan,
    )


def _route(found: FoundRoute, charging: ChargingPlan | None) -> Route:
    geometry = frozen(found.geometry)
    remedy = found.remedy
    return Route(
        name=found.name,
        feasible=found.feasible,
        distance_m=found.distance_m,
        duration_s=found.duration_s,
        total_s=found.duration_s + found.stop_s,
        energy_kwh=found.energy_j / JOULE_PER_KWH,
        battery_kwh=found.battery_j / JOULE_PER_KWH,
        energy_parts=parts_of(found.parts),
        braked_away_kwh=found.braked_away_j / JOULE_PER_KWH,
        soc_start_frac=found.soc_start_frac,
        soc_end_frac=found.soc_end_frac,
        soc_min_frac=found.soc_min_frac,
        climb_m=found.climb_m,
        descent_m=found.descent_m,
        deficit_kwh=found.deficit_j / JOULE_PER_KWH,
        furthest=None if found.furthest is None else place_of(found.furthest),
        soc_start_needed_frac=None if remedy is None else remedy.soc_start_needed_frac,
        charge_needed_kwh=None if remedy is None else remedy.charge_needed_wh * JOULE_PER_WH / JOULE_PER_KWH,
        uncertainty=None if found.uncertainty is None else _uncertainty(found.uncertainty),
        charging=charging,
        legs=tuple(map(_leg, found.legs)),
        links=_links(found, geometry),
        geometry_lon_lat_deg=geometry,
    )


def _leg(leg: RouteLeg) -> Leg:
    return Leg(
        ends_at=leg.ends_at.value,
        from_m=leg.from_m,
        to_m=leg.to_m,
        duration_s=leg.duration_s,
        energy_kwh=leg.energy_j / JOULE_PER_KWH,
        battery_kwh=leg.battery_j / JOULE_PER_KWH,
        soc_start_frac=leg.soc_start_frac,
        soc_end_frac=leg.soc_end_frac,
        speed_cap_kmh=None if leg.speed_cap_mps is None else round(leg.speed_cap_mps * KMH_PER_MPS, SPEED_DIGITS),
    )


def _uncertainty(spread: EnergyDistribution) -> Uncertainty:
    return Uncertainty(
        energy_p10_kwh=spread.energy_p10_j / JOULE_PER_KWH,
        energy_p50_kwh=spread.energy_p50_j / JOULE_PER_KWH,
        energy_p90_kwh=spread.energy_p90_j / JOULE_PER_KWH,
        soc_end_p10_frac=spread.arrival_soc_p10_frac,
        soc_end_p50_frac=spread.arrival_soc_p50_frac,
        soc_end_p90_frac=spread.arrival_soc_p90_frac,
        above_reserve_frac=spread.above_reserve_frac,
    )


def _links(found: FoundRoute, geometry: NDArray[np.float64]) -> RouteLinks:
    links, results = found.links, found.links.results
    columns: dict[str, Any] = {name: frozen(getattr(links, name)) for name in ("from_m", "to_m", "soc_end_frac")}
    return RouteLinks(
        link_idx=frozen(links.link_idx, np.int64),
        rest=frozen(links.rest, np.bool_),
        duration_s=frozen(results.duration_s),
        energy_wh=frozen(results.energy_j / JOULE_PER_WH),
        grade_frac=frozen(links.grade_frac),
        height_end_m=frozen(links.height_end_m),
        speed_limit_kmh=frozen(np.multiply(links.speed_limit_mps, KMH_PER_MPS)),
        speed_end_kmh=frozen(results.carried_mps * KMH_PER_MPS),
        stop_probability_frac=frozen(results.stop_probability_frac),
        geometry_end_idx=frozen(links.geometry_end_idx, np.int64),
        road_name=tuple(links.road_name),
        geometry_lon_lat_deg=geometry,
        **columns,
    )
