"""Plans with charging stops as they are answered."""

from __future__ import annotations

import math
from dataclasses import dataclass
from datetime import timedelta
from typing import TYPE_CHECKING, Final

from app.conversions.place import lat_lon
from app.conversions.stations.facts import W_PER_KW, price_fields, socket_fields, source_fields
from app.schemas.charging import HelpUnit
from energy.units import JOULE_PER_KWH, KMH_PER_MPS
from routing.charging.plan import HelpKind, Objective
from routing.charging.route import halt_leg
from routing.graph.snap import road_point
from routing.route.route import LegEnd

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping
    from datetime import datetime

    from app.schemas.route import RouteRequest
    from routing.charging.plan import ChargeStop, Fallback, Halt, Help, NoPlan, Plan, PlanStats
    from routing.graph.road_graph import RoadGraph
    from routing.route.route import Route
    from routing.stations.station import Station, StationSource

HELP_DIGITS: Final = 9  # of what would help, so that 110 km/h stay 110


@dataclass(frozen=True, slots=True)
class PlannedStops:
    """What planning charging stops adds to the routes of an answer.

    plans: one for each route, or none where there is no plan. sources: of the graph's stations, by key.
    """

    plans: tuple[Plan, ...]
    no_plan: NoPlan | None
    stats: PlanStats
    sources: Mapping[str, StationSource]


def plan_answer(
    planned: PlannedStops, plan: Plan, route: Route, understood: RouteRequest, graph: RoadGraph
) -> dict[str, object]:
    """The fields of a ChargingPlanAnswer in their order."""
    departure = departure_of(understood)
    legs = [k for k, leg in enumerate(route.legs) if leg.ends_at is LegEnd.STOP]
    stops = [
        _stop(stop, leg, route.legs[leg].to_m, departure, graph) for stop, leg in zip(plan.stops, legs, strict=True)
    ]
    total_s = float(plan.driving_s + plan.charging_s + plan.overhead_s)
    quantiles = plan.goal_quantiles_frac or (None, None, None)
    assert understood.charging is not None
    objective = understood.charging.objective
    per_unit = JOULE_PER_KWH if objective is Objective.ENERGY else 1.0
    units = {Objective.TIME: "s", Objective.ENERGY: "kWh", Objective.COST: plan.currency}
    stations = [place for stop in plan.stops for place in (stop.station, _elsewhere(stop)) if place is not None]
    stations += [halt.station for halt in plan.halts]
    return {
        "objective": objective,
        "objective_value": plan.objective / per_unit,
        "objective_unit": units[objective],
        "proof": {
            "proven": plan.short_by == 0.0,
            "short_by": None if plan.short_by is None else plan.short_by / per_unit,
            "unproven": plan.unproven or None,
        },
        "totals": {
            "total_s": total_s,
            "driving_s": float(plan.driving_s),
            "charging_s": float(plan.charging_s),
            "overhead_s": float(plan.overhead_s),
            "waiting_s": plan.waiting_s,
            "charged_kwh": sum(stop.charged_j for stop in plan.stops) / JOULE_PER_KWH,
            "drawn_kwh": sum(stop.drawn_j for stop in plan.stops) / JOULE_PER_KWH,
            "price": plan.price,
            "currency": plan.currency,
        },
        "stops": stops,
        "halts": [_halt(halt, halt_leg(halt, route), departure, graph) for halt in plan.halts],
        "goal": {
            "arrive_s": total_s,
            "arrive_time": _local_time(departure, total_s),
            "arrive_soc": route.soc_end_frac,
            "arrive_soc_p10": quantiles[0],
            "arrive_soc_p50": quantiles[1],
            "arrive_soc_p90": quantiles[2],
            "probability_kept": plan.goal_kept_probability_frac,
            "stay": None if plan.goal_stay is None else _goal_stay(plan.goal_stay, departure),
        },
        "probability_kept": plan.kept_probability_frac,
        "sources": _sources(stations, planned.sources),
    }


def no_plan_answer(no_plan: NoPlan, sources: Mapping[str, StationSource]) -> dict[str, object]:
    """The fields of a NoPlanAnswer in their order."""
    named = [station for station in (no_plan.from_station, no_plan.last_reached) if station is not None]
    return {
        "reason": no_plan.reason,
        "from_station": None if no_plan.from_station is None else _station(no_plan.from_station),
        "missing_kwh": no_plan.missing_j / JOULE_PER_KWH,
        "last_reached": None if no_plan.last_reached is None else _station(no_plan.last_reached),
        "helps": [_help(each) for each in no_plan.helps],
        "sources": _sources(named, sources),
    }


def _help(each: Help) -> dict[str, object]:
    """The fields of a HelpAnswer in their order."""
    value, unit = each.value, HelpUnit.FRACTION
    if value is not None and each.kind is HelpKind.SPEED_CAP:
        value, unit = value * KMH_PER_MPS, HelpUnit.KMH
    return {
        "kind": each.kind,
        "value": None if value is None else round(value, HELP_DIGITS),
        "unit": None if value is None else unit,
        "text": each.text,
    }


def planning_stats(stats: PlanStats) -> dict[str, object]:
    """The fields of a PlanningStats in their order."""
    return {
        "leg_searches": stats.leg_searches,
        "legs_cached": stats.legs_cached,
        "labels_made": stats.labels_made,
        "labels_settled": stats.labels_settled,
        "seconds": stats.seconds,
        "stage_s": dict(stats.stage_s),
    }


def departure_of(understood: RouteRequest) -> datetime | None:
    """Local time of departure of a request with charging stops, None where it has none."""
    if understood.charging is not None and understood.charging.departure_time is not None:
        return understood.charging.departure_time
    return None if understood.conditions is None else understood.conditions.departure


def _stop(
    stop: ChargeStop, leg: int, along_m: float, departure: datetime | None, graph: RoadGraph
) -> dict[str, object]:
    """The fields of a ChargingStopAnswer in their order."""
    quantiles = stop.arrive_quantiles_frac or (None, None, None)
    return {
        "station": None if stop.station is None else _station(stop.station),
        "socket": None if stop.socket is None else socket_fields(stop.socket),
        "leg": leg,
        "at": lat_lon(road_point(graph, stop.position)),
        "link_id": stop.position.link_idx,
        "offset_m": stop.position.offset_m,
        "along_m": along_m,
        "arrive_s": stop.arrive_s,
        "depart_s": stop.depart_s,
        "arrive_time": _local_time(departure, stop.arrive_s),
        "depart_time": _local_time(departure, stop.depart_s),
        "overhead_s": stop.overhead_s,
        "waiting_s": stop.waiting_s,
        "charging_s": stop.charging_s,
        "arrive_soc": stop.arrive_soc_frac,
        "depart_soc": stop.depart_soc_frac,
        "charged_kwh": stop.charged_j / JOULE_PER_KWH,
        "drawn_kwh": stop.drawn_j / JOULE_PER_KWH,
        "mean_power_kw": stop.mean_power_w / W_PER_KW,
        "power_bands": [
            {
                "from_kw": from_w / W_PER_KW,
                "to_kw": to_w / W_PER_KW if math.isfinite(to_w) else None,
                "seconds": seconds,
            }
            for from_w, to_w, seconds in stop.power_bands
        ],
        "price": stop.price,
        "currency": stop.currency,
        "arrive_soc_p10": quantiles[0],
        "arrive_soc_p50": quantiles[1],
        "arrive_soc_p90": quantiles[2],
        "probability_kept": stop.kept_probability_frac,
        "fallback": None if stop.fallback is None else _fallback(stop.fallback),
        "gatekeeper": stop.gatekeeper,
    }


def _halt(halt: Halt, leg: int, departure: datetime | None, graph: RoadGraph) -> dict[str, object]:
    """The fields of a ChargingHaltAnswer in their order."""
    depart_s = halt.arrive_s + halt.overhead_s
    return {
        "station": _station(halt.station),
        "leg": leg,
        "at": lat_lon(road_point(graph, halt.position)),
        "link_id": halt.position.link_idx,
        "offset_m": halt.position.offset_m,
        "along_m": halt.along_m,
        "arrive_s": halt.arrive_s,
        "depart_s": depart_s,
        "arrive_time": _local_time(departure, halt.arrive_s),
        "depart_time": _local_time(departure, depart_s),
        "overhead_s": halt.overhead_s,
        "waiting_s": halt.waiting_s,
        "soc": halt.soc_frac,
        "price": halt.price,
        "currency": halt.currency,
    }


def _goal_stay(stay: ChargeStop, departure: datetime | None) -> dict[str, object]:
    """The fields of a GoalStay in their order."""
    return {
        "depart_s": stay.depart_s,
        "depart_time": _local_time(departure, stay.depart_s),
        "depart_soc": stay.depart_soc_frac,
        "charging_s": stay.charging_s,
        "charged_kwh": stay.charged_j / JOULE_PER_KWH,
        "drawn_kwh": stay.drawn_j / JOULE_PER_KWH,
    }


def _station(station: Station) -> dict[str, object]:
    """The fields of a StopStation in their order."""
    return {
        "id": station.id,
        "name": station.name,
        "operator": station.operator,
        "network": station.network,
        "at": lat_lon(station.at),
        "sockets": [socket_fields(socket) for socket in station.sockets],
        "capacity": station.capacity,
        "access": station.access,
        "fee": station.fee,
        "price": price_fields(station.price),
        "opening_hours": station.opening_hours,
        "source": station.source,
    }


def _fallback(fallback: Fallback) -> dict[str, object]:
    """The fields of a FallbackAnswer in their order."""
    return {
        "station_id": fallback.station.id,
        "station_name": fallback.station.name,
        "at": lat_lon(fallback.station.at),
        "drive_s": fallback.drive_s,
        "arrive_soc": fallback.arrive_soc_frac,
        "reached": fallback.reached,
        "wait_s": fallback.wait_s,
        "open_soc": fallback.open_soc_frac,
    }


def _elsewhere(stop: ChargeStop) -> Station | None:
    return None if stop.fallback is None else stop.fallback.station


def _sources(stations: Iterable[Station], sources: Mapping[str, StationSource]) -> list[dict[str, object]]:
    """The fields of a StationSourceAnswer for each source of stations, by key."""
    return [
        source_fields(source)
        for key in sorted({station.source for station in stations})
        if (source := sources.get(key)) is not None
    ]


def _local_time(departure: datetime | None, seconds: float) -> str | None:
    """Local time so long after departure, to the second; None without departure, and after the year 9999."""
    if departure is None:
        return None
    try:
        return (departure + timedelta(seconds=round(seconds))).isoformat(timespec="seconds")
    except OverflowError:
        return None
