"""Route requests into routing.queries, and its routes into answers."""

from __future__ import annotations

from dataclasses import dataclass
from operator import attrgetter
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from app.conversions.charging.plans import no_plan_answer, plan_answer, planning_stats
from app.conversions.conditions import conditions_from
from app.conversions.graph import terrain_note
from app.conversions.guidance.steps import step_answers
from app.conversions.lean.colours import MARKERS, route_colour
from app.conversions.lean.digits import compacted
from app.conversions.lean.lines import drawn, line_of
from app.conversions.lean.selection import Selection, asks_for, feature, part_of, picked, selection_of
from app.conversions.place import DECIMALS, lat_lon, place_feature, point_from_place, snapped
from app.schemas.as_json import as_json, fields_of
from app.schemas.lean.form import GeometryFormat, Overview
from app.schemas.places.named import named_places
from app.schemas.route import (
    ParetoAnswer,
    RemedyAnswer,
    RouteResponse,
    SearchStatsAnswer,
    UncertaintyAnswer,
)
from energy.force.parts import PART_NAMES
from energy.units import JOULE_PER_KWH, JOULE_PER_M_PER_KWH_PER_100KM, JOULE_PER_WH, KMH_PER_MPS
from routing.errors import QueryError
from routing.guidance.steps import steps_of
from routing.queries import ParetoSettings, RouteQuery
from routing.weights import NAMED_WEIGHTS, Weights

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping

    from numpy.typing import NDArray

    from app.conversions.charging.plans import PlannedStops
    from app.schemas.route import RouteRequest
    from energy.chain.uncertainty import EnergyDistribution
    from energy.force.parts import EnergyParts
    from energy.vehicle.files import AnyVehicle
    from routing.graph.road_graph import RoadGraph
    from routing.places import Point
    from routing.route.hot_links import HotStretch
    from routing.route.route import DrivenLinks, ParetoClaim, Route, RouteAnswer, RouteLeg, SearchStats

    Coordinates = Callable[[NDArray[np.float64]], object]

CUSTOM: Final = "custom"
SPEED_DIGITS: Final = 9  # of km/h, so that a cap comes back as it was sent

NO_PARTS: Final[Mapping[str, Any]] = dict.fromkeys(PART_NAMES, 0.0)
ALL_PARTS_J: Final = attrgetter(*(f"{name}_j" for name in PART_NAMES))


def route_query(sent: RouteRequest, vehicle: AnyVehicle) -> RouteQuery:
    """What the planner is asked; vehicle: with the effects of the request."""
    return RouteQuery(
        start=point_from_place(sent.start),
        goal=point_from_place(sent.goal),
        via=tuple(point_from_place(place) for place in sent.via),
        soc_frac=sent.soc,
        vehicle=vehicle,
        reserve_soc_frac=sent.reserve_soc,
        weightings=_weightings(sent),
        link_model=sent.link_model,
        stop_rule=sent.stops,
        conditions=conditions_from(sent.conditions),
        uncertainty=sent.uncertainty,
        pareto=None if sent.pareto is None else ParetoSettings(sent.pareto.epsilon_frac, sent.pareto.most),
    )


def _weightings(sent: RouteRequest) -> tuple[tuple[str, Weights], ...]:
    if sent.weights is not None:
        return ((CUSTOM, Weights(sent.weights.energy, sent.weights.time, sent.weights.distance)),)
    return tuple((name, NAMED_WEIGHTS[name]) for name in sent.alternatives or ("eco",))


def route_response(
    answer: RouteAnswer, understood: RouteRequest, graph: RoadGraph, planned: PlannedStops | None = None
) -> RouteResponse:
    """Routes with geometry and state of charge; planned: their charging stops, where these were asked for."""
    return RouteResponse.model_validate(_response(answer, understood, graph, planned, np.ndarray.tolist))


def route_json(
    answer: RouteAnswer, understood: RouteRequest, graph: RoadGraph, planned: PlannedStops | None = None
) -> bytes:
    """The JSON of route_response with what is asked for, in the form and the digits that are.

    Made without an object for each link, which would take several times as long.
    """
    selection = selection_of(understood.fields)
    lines, routes_asked = understood.geometry_format, part_of(selection, "routes")
    document = _answered(answer, understood, graph, planned)
    if asks_for(selection, "routes"):
        document["routes"] = [
            {
                **_properties(drawing, charging, understood, graph, routes_asked),
                "geometry": _geometry(drawing, understood, lines, routes_asked, np.asarray),
            }
            for drawing, charging in zip(
                _drawings(answer, understood), _stops_of(answer, understood, graph, planned), strict=True
            )
        ]
    document = picked(document, selection)
    return as_json(compacted(document) if understood.compact else document)


def route_features_json(
    answer: RouteAnswer, understood: RouteRequest, graph: RoadGraph, planned: PlannedStops | None = None
) -> bytes:
    """The same as GeoJSON: the JSON of a RouteFeatureCollection; raises QueryError where lines are to be texts."""
    if understood.geometry_format is not GeometryFormat.GEOJSON:
        raise QueryError("geometry_format", repr(understood.geometry_format.value), "'geojson' in GeoJSON")
    selection = selection_of(understood.fields)
    asked = part_of(selection, "routes")
    features: list[dict[str, Any]] = []
    stops = _stops_of(answer, understood, graph, planned)
    drawings = _drawings(answer, understood)
    colours = [route_colour(route.name, k, feasible=route.feasible) for k, route in enumerate(answer.routes)]
    lines = GeometryFormat.GEOJSON
    if asks_for(selection, "routes"):
        for drawing, charging, colour in zip(drawings, stops, colours, strict=True):
            properties = _properties(drawing, charging, understood, graph, asked) | {"stroke": colour}
            features.append(feature(_geometry(drawing, understood, lines, asked, np.asarray), properties, asked))
    for drawing, charging, colour in zip(drawings, stops, colours, strict=True):
        if charging is not None and asks_for(asked, "legs"):
            features += _leg_features(drawing, understood, colour, part_of(asked, "legs"))
        if charging is not None and asks_for(asked, "charging", "stops"):
            features += _stop_features(drawing.route, charging, part_of(asked, "charging", "stops"))
    if asks_for(selection, "snapped"):
        features += [
            {"type": "Feature", "geometry": found.geometry, "properties": fields_of(found.properties)}
            for found in (
                place_feature(answer.start, "start"),
                *(place_feature(place, "via") for place in answer.via),
                place_feature(answer.goal, "goal"),
            )
        ]
    document = picked(_answered(answer, understood, graph, planned), selection)
    document |= {"type": "FeatureCollection", "features": features}
    return as_json(document if understood.compact is False else compacted(document))


@dataclass(frozen=True, slots=True)
class _Drawing:
    """A route, and the same with its line as it is drawn; kept: as in lean.lines.drawn."""

    route: Route
    drawn: Route
    kept: NDArray[np.int64] | None


def _drawings(answer: RouteAnswer, understood: RouteRequest) -> list[_Drawing]:
    return [_Drawing(route, *drawn(route, understood.overview)) for route in answer.routes]


def _geometry(
    drawing: _Drawing, understood: RouteRequest, form: GeometryFormat, asked: Selection, coordinates: Coordinates
) -> object:
    """The line of a route, None where none is asked for."""
    if understood.overview is Overview.NONE or not asks_for(asked, "geometry"):
        return None
    return line_of(drawing.drawn.geometry.round(DECIMALS), form, coordinates)


def _leg_features(drawing: _Drawing, understood: RouteRequest, colour: str, asked: Selection) -> list[dict[str, Any]]:
    """The fields of a LegFeature for each leg that something is driven on."""
    route = drawing.drawn
    features: list[dict[str, Any]] = []
    for k, leg in enumerate(route.legs):
        if leg.first_link is None or leg.last_link is None:
            continue
        begin = 0 if leg.first_link == 0 else route.links.geometry_end_idx[leg.first_link - 1]
        line = route.geometry[begin : route.links.geometry_end_idx[leg.last_link] + 1]
        geometry = (
            None
            if understood.overview is Overview.NONE
            else line_of(line.round(DECIMALS), GeometryFormat.GEOJSON, np.asarray)
        )
        properties = picked(_leg(leg), asked) | {"kind": "leg", "route": route.name, "leg": k, "stroke": colour}
        features.append({"type": "Feature", "geometry": geometry, "properties": properties})
    return features


def _stop_features(route: Route, charging: Mapping[str, Any], asked: Selection) -> list[dict[str, Any]]:
    """The fields of a ChargingStopFeature for each stop, then of a ChargingHaltFeature for each halt."""
    return [
        {
            "type": "Feature",
            "geometry": {"type": "Point", "coordinates": [stop["at"]["lon"], stop["at"]["lat"]]},
            "properties": picked(stop, asked) | {"kind": kind, "route": route.name, "marker-color": MARKERS[kind]},
        }
        for kind in ("stop", "halt")
        for stop in charging[f"{kind}s"]
    ]


def _response(
    answer: RouteAnswer,
    understood: RouteRequest,
    graph: RoadGraph,
    planned: PlannedStops | None,
    coordinates: Coordinates,
) -> dict[str, Any]:
    """All fields of a RouteResponse in their order; coordinates: as which form of an array they are given."""
    routes = [
        {
            **_properties(drawing, charging, understood, graph, None),
            "geometry": _geometry(drawing, understood, understood.geometry_format, None, coordinates),
        }
        for drawing, charging in zip(
            _drawings(answer, understood), _stops_of(answer, understood, graph, planned), strict=True
        )
    ]
    return _answered(answer, understood, graph, planned) | {"routes": routes}


def _stops_of(
    answer: RouteAnswer, understood: RouteRequest, graph: RoadGraph, planned: PlannedStops | None
) -> list[dict[str, object] | None]:
    """The fields of a ChargingPlanAnswer for each route, None where it has no plan."""
    if planned is None or not planned.plans:
        return [None] * len(answer.routes)
    return [
        plan_answer(planned, plan, route, understood, graph)
        for plan, route in zip(planned.plans, answer.routes, strict=True)
    ]


def _answered(
    answer: RouteAnswer, understood: RouteRequest, graph: RoadGraph, planned: PlannedStops | None
) -> dict[str, object]:
    """The fields of RouteAnswered in their order."""
    no_plan = None if planned is None else planned.no_plan
    return {
        "snapped": _snapped_ends(answer),
        "places": named_places((understood.start, *understood.via, understood.goal)),
        "request": understood,
        "warnings": list(answer.warnings),
        "stats": [search_stats(stats) for stats in answer.stats],
        "pareto": None if answer.pareto is None else _pareto(answer.pareto),
        "no_plan": None if planned is None or no_plan is None else no_plan_answer(no_plan, planned.sources),
        "planning": None if planned is None else planning_stats(planned.stats),
        "terrain": terrain_note(graph),
    }


def _weights(weights: Weights) -> dict[str, float]:
    """The fields of a WeightsSent."""
    return {"energy": weights.energy, "time": weights.time, "distance": weights.distance}


def _pareto(claim: ParetoClaim) -> ParetoAnswer:
    return ParetoAnswer(
        epsilon_frac=claim.epsilon_frac,
        energy_slack_kwh=None if claim.slack_j is None else claim.slack_j / JOULE_PER_KWH,
        reference_kwh=claim.reference_j / JOULE_PER_KWH,
        found=claim.found,
        proof=claim.proof,
        unproven=claim.unproven,
    )


def _snapped_ends(answer: RouteAnswer) -> dict[str, object]:
    """The fields of SnappedEnds."""
    return {
        "start": snapped(answer.start),
        "via": [snapped(place) for place in answer.via],
        "goal": snapped(answer.goal),
    }


def search_stats(stats: SearchStats) -> SearchStatsAnswer:
    """What a search did."""
    return SearchStatsAnswer(
        labels_made=stats.labels_made,
        labels_settled=stats.labels_settled,
        seconds=stats.seconds,
        method=stats.method,
    )


def parts_kwh(parts: EnergyParts) -> dict[str, float]:
    """Energy by cause of a whole route [kWh]: the fields of EnergyPartsKwh in their order."""
    return {name: part_j / JOULE_PER_KWH for name, part_j in zip(PART_NAMES, ALL_PARTS_J(parts), strict=True)}


def parts_wh(parts_j: NDArray[np.float64]) -> list[dict[str, Any]]:
    """Energy by cause of links [Wh], the fields of EnergyPartsWh in their order; parts_j: float64 (n, 20)."""
    present = np.flatnonzero(parts_j.any(axis=0)).tolist()
    columns = (parts_j[:, present].T / JOULE_PER_WH).tolist()
    return rows_of(parts_j.shape[0], NO_PARTS, zip([PART_NAMES[part] for part in present], columns, strict=True))


def rows_of(
    count: int, blank: Mapping[str, Any], columns: Iterable[tuple[str, Iterable[object]]]
) -> list[dict[str, Any]]:
    """Dictionaries like `blank` with the values of columns, by their names: made so in half the time of any other way.

    count: of rows, the length of each column.
    """
    rows = [{**blank} for _ in range(count)]
    for name, values in columns:
        for row, value in zip(rows, values, strict=True):
            row[name] = value
    return rows


def _properties(
    drawing: _Drawing,
    charging: Mapping[str, object] | None,
    understood: RouteRequest,
    graph: RoadGraph,
    asked: Selection,
) -> dict[str, Any]:
    """The fields of RouteProperties in their order; charging: those of a ChargingPlanAnswer.

    asked: for which of them; lists of links and steps are made only where they are.
    """
    route = drawing.route
    remedy = route.remedy
    with_links = understood.links and asks_for(asked, "links")
    with_steps = understood.steps and asks_for(asked, "steps")
    told = steps_of(graph, route, asked=asked_places(understood)) if with_steps else ()
    return {
        "name": route.name,
        "weights": None if route.weights is None else _weights(route.weights),
        "feasible": route.feasible,
        "distance_m": route.distance_m,
        "duration_s": route.duration_s,
        "total_s": route.duration_s + route.stop_s,
        "energy_kwh": route.energy_j / JOULE_PER_KWH,
        "battery_kwh": route.battery_j / JOULE_PER_KWH,
        "energy_parts_kwh": parts_kwh(route.parts),
        "braked_away_kwh": route.braked_away_j / JOULE_PER_KWH,
        "soc_start": route.soc_start_frac,
        "soc_end": route.soc_end_frac,
        "soc_min": route.soc_min_frac,
        "climb_m": route.climb_m,
        "descent_m": route.descent_m,
        "height_start_m": route.height_start_m,
        "deficit_kwh": route.deficit_j / JOULE_PER_KWH,
        "furthest": None if route.furthest is None else lat_lon(route.furthest),
        "remedy": None
        if remedy is None
        else RemedyAnswer(
            soc_start_needed=remedy.soc_start_needed_frac, charge_needed_kwh=remedy.charge_needed_wh / 1000.0
        ),
        "uncertainty": None if route.uncertainty is None else _uncertainty(route.uncertainty),
        "hot_links": [_hot_links(stretch) for stretch in route.hot_links],
        "charging": charging,
        "legs": [_leg(leg) for leg in route.legs],
        "links": link_rows(drawing.drawn.links) if with_links else None,
        "steps": step_answers(told, drawing.kept) if with_steps else None,
    }


def asked_places(understood: RouteRequest) -> list[Point]:
    """Via points and goal as they were asked for."""
    return [point_from_place(place) for place in (*understood.via, understood.goal)]


def _uncertainty(spread: EnergyDistribution) -> UncertaintyAnswer:
    return UncertaintyAnswer(
        soc_end_p10=spread.arrival_soc_p10_frac,
        soc_end_p50=spread.arrival_soc_p50_frac,
        soc_end_p90=spread.arrival_soc_p90_frac,
        energy_kwh_p10=spread.energy_p10_j / JOULE_PER_KWH,
        energy_kwh_p50=spread.energy_p50_j / JOULE_PER_KWH,
        energy_kwh_p90=spread.energy_p90_j / JOULE_PER_KWH,
        probability_above_reserve=spread.above_reserve_frac,
        parameter_sd_share=spread.parameter_sd_frac,
        residual_sd_share=spread.residual_sd_frac,
        samples=spread.samples,
        seed=spread.seed,
    )


def _hot_links(stretch: HotStretch) -> dict[str, object]:
    """The fields of HotLinks in their order."""
    return {
        "first": stretch.first,
        "last": stretch.last,
        "from_m": stretch.from_m,
        "to_m": stretch.to_m,
        "energy_kwh": stretch.energy_j / JOULE_PER_KWH,
        "energy_share": stretch.energy_share_frac,
        "kwh_per_100km": stretch.energy_per_m / JOULE_PER_M_PER_KWH_PER_100KM,
        "times_mean": stretch.times_mean,
        "reason": stretch.reason,
        "rise_m": stretch.rise_m,
        "stop_count": stretch.stop_count,
        "speed_kmh": stretch.speed_mps * KMH_PER_MPS,
        "names": list(stretch.road_names),
    }


def _leg(leg: RouteLeg) -> dict[str, object]:
    """The fields of a RouteLegAnswer in their order."""
    cap_mps = leg.speed_cap_mps
    return {
        "ends_at": leg.ends_at,
        "from_m": leg.from_m,
        "to_m": leg.to_m,
        "duration_s": leg.duration_s,
        "energy_kwh": leg.energy_j / JOULE_PER_KWH,
        "battery_kwh": leg.battery_j / JOULE_PER_KWH,
        "soc_start": leg.soc_start_frac,
        "soc_end": leg.soc_end_frac,
        "speed_cap_kmh": None if cap_mps is None else round(cap_mps * KMH_PER_MPS, SPEED_DIGITS),
        "first_link": leg.first_link,
        "last_link": leg.last_link,
    }


def link_rows(links: DrivenLinks) -> list[dict[str, object]]:
    """The fields of RouteLinkAnswer in their order, one dictionary a link."""
    results = links.results
    columns = {
        "id": links.link_idx,
        "from_m": links.from_m,
        "to_m": links.to_m,
        "rest": links.rest,
        "length_m": np.subtract(links.to_m, links.from_m).tolist(),
        "duration_s": results.duration_s.tolist(),
        "energy_wh": (results.energy_j / JOULE_PER_WH).tolist(),
        "energy_parts_wh": parts_wh(results.parts_j),
        "soc_end": links.soc_end_frac,
        "soc_end_p10": links.soc_end_p10_frac,
        "soc_end_p90": links.soc_end_p90_frac,
        "grade": links.grade_frac,
        "height_end_m": links.height_end_m,
        "geometry_end": links.geometry_end_idx,
        "speed_limit_kmh": np.multiply(links.speed_limit_mps, KMH_PER_MPS).tolist(),
        "speed_end_kmh": (results.carried_mps * KMH_PER_MPS).tolist(),
        "stop_probability": results.stop_probability_frac.tolist(),
        "name": links.road_name,
    }
    return rows_of(len(links), dict.fromkeys(columns), columns.items())
