"""Valhalla's route: a trip of legs with manoeuvres and shapes."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

import numpy as np

from app.errors.problems import shortened
from app.http.faces.electric import route_request
from app.http.faces.figures import electric_leg, electric_route, kwh, notes_of
from app.http.faces.lines import box_of, distinct, heights_along, places_of, route_line
from app.http.faces.polylines import encoded
from app.http.faces.valhalla.asked import LONGEST, lonlat_sent
from app.http.faces.valhalla.errors import ValhallaError
from app.http.faces.valhalla.maneuvers import maneuver
from app.schemas.route import MAX_VIA
from energy.stops import FunctionalClass
from routing.graph.earth import great_circle_m
from routing.guidance.step import StepType
from routing.route.route import LegEnd

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from app.http.faces.electric import Electric
    from app.http.faces.valhalla.asked import ValhallaRequest
    from app.schemas.route import RouteRequest
    from app.service.found import FoundRoutes
    from routing.guidance.step import Step
    from routing.route.route import Route

BREAKS: Final = ("break", "break_through")
TYPES: Final = (*BREAKS, "via", "through")
SHAPES: Final = ("polyline6", "polyline5", "geojson", "no_shape")
NAMES: Final = ("name", "street", "city", "state", "postal_code", "country")  # that come back with a location
MOST_FURTHER: Final = 2
MOST_HEIGHTS: Final = 20_000
FEET: Final = 3.280839895


def asked_trip(asked: ValhallaRequest, electric: Electric) -> RouteRequest:
    """The route request of a Valhalla request; refuses what can't be heeded."""
    places = asked.places("locations", MAX_VIA + 2, few=120, missing=110, bad=130, least=2)
    for k, place in enumerate(places):
        kind = place.get("type", "break")
        if kind not in TYPES:
            raise ValhallaError(130, f"locations[{k}] of type {', '.join(TYPES)}")
        if kind in ("through", "break_through") and 0 < k < len(places) - 1:
            asked.warn(299, f"locations[{k}] is {kind}, but the vehicle may turn there")
    asked.check_heeded()
    if asked.fields.get("shape_format", "polyline6") not in SHAPES:
        raise ValhallaError(164, f"one of {', '.join(SHAPES)}")
    if asked.fields.get("format", "json") != "json":
        asked.warn(211, "This action doesn't support requested format, using json instead")
    asked.number("elevation_interval", 0.0, 1e6)
    further = asked.number("alternates", 0.0, 1e6)
    return route_request(
        [lonlat_sent(place) for place in places],
        electric,
        min(int(further or 0), MOST_FURTHER),
        asked.weights(),
    )


def trip_answer(asked: ValhallaRequest, found: FoundRoutes) -> dict[str, Any]:
    """Routes as Valhalla answers them: the best one, and alternates."""
    for k, (place, on) in enumerate(zip(asked.fields["locations"], places_of(found.answer), strict=True)):
        cutoff = place.get("search_cutoff")
        if isinstance(cutoff, (int, float)) and on.distance_m > cutoff:
            raise ValhallaError(171, f"locations[{k}] is {on.distance_m:.1f} m from a road")
    for note in notes_of(found.answer):
        asked.warn(299, note)
    trips = [_Trip(asked, found, route).written() for route in distinct(found.answer.routes)]
    if asked.warnings:
        trips[0]["warnings"] = asked.warnings
    written: dict[str, Any] = {"trip": trips[0]}
    if trips[1:]:
        written["alternates"] = [{"trip": trip} for trip in trips[1:]]
    return written | asked.asked_id


class _Trip:
    """Writes one route."""

    def __init__(self, asked: ValhallaRequest, found: FoundRoutes, route: Route) -> None:
        self.asked, self.found, self.driven = asked, found, route
        self.line = route_line(route, found.answer)
        self.steps = () if asked.directions_type == "none" else found.steps(route, asked.language)
        self.km_a_unit = asked.km_a_unit

    def written(self) -> dict[str, Any]:
        """The fields of a trip."""
        route = self.driven
        return {
            "locations": self._locations(),
            "legs": self._legs(),
            "summary": self._summary(
                route.distance_m, route.duration_s + route.stop_s, (0, self.line.lonlat.shape[0] - 1)
            ),
            "status_message": "Found route between points",
            "status": 0,
            "units": self.asked.units,
            "language": "en-US",
            "ev": electric_route(route),
        }

    def _locations(self) -> list[dict[str, Any]]:
        return [
            {name: shortened(text, LONGEST) for name in NAMES if isinstance(text := place.get(name), str)}
            | {"type": place.get("type", "break"), "lat": place["lat"], "lon": place["lon"], "original_index": k}
            for k, place in enumerate(self.asked.fields["locations"])
        ]

    def _groups(self) -> list[list[int]]:
        """Legs of the route that are one leg of the trip: to the next place that is a break, or charging stop."""
        sent: Sequence[Mapping[str, Any]] = self.asked.fields["locations"]
        groups: list[list[int]] = [[]]
        at = 0
        for k, leg in enumerate(self.driven.legs):
            groups[-1].append(k)
            if leg.ends_at is LegEnd.VIA:
                at += 1
                if sent[at].get("type", "break") in BREAKS:
                    groups.append([])
            elif leg.ends_at is LegEnd.STOP:
                groups.append([])
        return groups

    def _legs(self) -> list[dict[str, Any]]:
        by_leg: list[list[Step]] = [[] for _ in self.driven.legs] if not self.steps else [[]]
        for step in self.steps:
            by_leg[-1].append(step)
            if step.type is StepType.ARRIVE:
                by_leg.append([])
        return [self._leg(group, by_leg) for group in self._groups()]

    def _leg(self, group: Sequence[int], by_leg: Sequence[Sequence[Step]]) -> dict[str, Any]:
        legs = [self.driven.legs[k] for k in group]
        begin, end = self.line.legs[group[0]][0], self.line.legs[group[-1]][1]
        steps = [
            step
            for k in group
            for step in by_leg[k]
            if step.type is not StepType.ARRIVE or k == group[-1]  # a place that is driven over is no end
        ]
        written: dict[str, Any] = {}
        kind = self.asked.directions_type
        if kind != "none":
            written["maneuvers"] = [
                maneuver(
                    step,
                    begin,
                    self.km_a_unit,
                    spoken=kind == "instructions",
                    lanes=self.asked.flag("turn_lanes"),
                    passing=step.type is StepType.DEPART and position > 0,
                )
                for position, step in enumerate(steps)
            ]
        way_m, time_s = sum(leg.to_m - leg.from_m for leg in legs), sum(leg.duration_s for leg in legs)
        written["summary"] = self._summary(way_m, time_s, (begin, end))
        written |= self._shape(begin, end)
        whole_j = sum(leg.energy_j for leg in legs)
        first, last = electric_leg(legs[0]), electric_leg(legs[-1])
        written["ev"] = {**last, "energy_kwh": kwh(whole_j), "soc_start": first["soc_start"]}
        return written

    def _shape(self, begin: int, end: int) -> dict[str, Any]:
        """The line of a leg, and heights along it where they are asked for."""
        line = self.line.lonlat[begin : end + 1]
        whole = line if line.shape[0] > 1 else np.repeat(line, 2, axis=0)
        form = self.asked.fields.get("shape_format", "polyline6")
        written: dict[str, Any] = {}
        if form == "geojson":
            written["shape"] = {"type": "LineString", "coordinates": np.ascontiguousarray(whole)}
        elif form != "no_shape":
            written["shape"] = encoded(whole, 5 if form == "polyline5" else 6)
        interval = self.asked.number("elevation_interval", 0.0, 1e6)
        if interval:
            written |= self._elevation(begin, end, interval)
        return written

    def _elevation(self, begin: int, end: int, interval: float) -> dict[str, Any]:
        line = self.driven.geometry[begin : end + 1]
        step_m = np.asarray(great_circle_m(line[:-1, 1], line[:-1, 0], line[1:, 1], line[1:, 0]), np.float64)
        along_m = np.concatenate(([0.0], np.cumsum(step_m)))
        unit = FEET if self.asked.units == "miles" else 1.0
        apart_m = max(interval / unit, along_m[-1] / MOST_HEIGHTS)
        at = np.append(np.arange(0.0, along_m[-1], apart_m), along_m[-1]) if apart_m > 0.0 else along_m[-1:]
        heights = np.interp(at, along_m, heights_along(self.driven)[begin : end + 1])
        return {"elevation_interval": round(apart_m * unit, 3), "elevation": (heights * unit).round(1)}

    def _summary(self, way_m: float, time_s: float, rows: tuple[int, int]) -> dict[str, Any]:
        west, south, east, north = box_of(self.line.lonlat[rows[0] : rows[1] + 1])
        ends = np.asarray(self.driven.links.geometry_end_idx, np.int64)
        inside = np.flatnonzero((ends > rows[0]) & (ends <= rows[1]))
        links = np.asarray(self.driven.links.link_idx, np.int64)[inside]
        ferries = self.found.graph.ferries
        return {
            "has_highway": bool((self.found.graph.functional_class[links] == FunctionalClass.MOTORWAY).any()),
            "has_ferry": ferries is not None and bool(np.isin(links, ferries.link).any()),
            "min_lat": south,
            "min_lon": west,
            "max_lat": north,
            "max_lon": east,
            "time": round(time_s, 3),
            "length": round(way_m / 1000.0 / self.km_a_unit, 3),
            "cost": round(time_s, 3),
        }
