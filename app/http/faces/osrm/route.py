"""OSRM's route service: routes with legs, steps, annotations and lines."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

import numpy as np

from app.http.faces.answering import whole_from
from app.http.faces.electric import route_request
from app.http.faces.figures import electric_leg, electric_route, electric_step, notes_of
from app.http.faces.lines import distinct, lonlat, places_of, route_line
from app.http.faces.osrm.errors import OsrmCode, OsrmError
from app.http.faces.osrm.waypoints import waypoint
from app.http.faces.polylines import encoded
from energy.units import JOULE_PER_KWH
from routing.graph.earth import great_circle_m
from routing.guidance.step import Modifier, StepType
from routing.weights import Weights, cost_of

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    from numpy.typing import NDArray

    from app.http.faces.electric import Electric
    from app.http.faces.lines import RouteLine
    from app.http.faces.osrm.asked import OsrmRequest
    from app.schemas.route import RouteRequest
    from app.service.found import FoundRoutes
    from routing.guidance.step import Intersection, Step
    from routing.route.route import Route, RouteLeg

    Geometry = Callable[[NDArray[np.float64]], object]

OPTIONS: Final = frozenset(
    {"alternatives", "steps", "annotations", "geometries", "overview", "continue_straight", "waypoints"}
)
GEOMETRIES: Final = ("polyline", "polyline6", "geojson")
OVERVIEWS: Final = ("simplified", "full", "false", "by_legs")
ANNOTATIONS: Final = ("duration", "distance", "speed", "weight", "datasources", "nodes", "energy", "soc")
MOST_ROUTES: Final = 3
MAJOR_ROADS: Final = 2  # named in a leg's summary
WHOLE_ROUND: Final = 1  # decimals of metres and seconds


def asked_route(asked: OsrmRequest, electric: Electric) -> RouteRequest:
    """The route request of an OSRM request; refuses options that can't be heeded."""
    asked.check_options(OPTIONS)
    if len(asked.places) < 2:
        raise OsrmError(OsrmCode.INVALID_OPTIONS, "coordinates", f"{len(asked.places)}", "at least two")
    if asked.choice("continue_straight", ("default", "true", "false"), "default") == "true":
        raise OsrmError(OsrmCode.NOT_IMPLEMENTED, "continue_straight", "true", "default or false")
    if asked.indices("waypoints") != list(range(len(asked.places))):
        raise OsrmError(OsrmCode.NOT_IMPLEMENTED, "waypoints", asked.options["waypoints"][:200], "all coordinates")
    asked.choice("geometries", GEOMETRIES, "polyline")
    asked.choice("overview", OVERVIEWS, "simplified")
    asked.flag("steps")
    _annotations(asked)
    asked.radiuses()
    return route_request(asked.places, electric, _further(asked))


def _further(asked: OsrmRequest) -> int:
    """How many routes beside the best one are asked for."""
    text = asked.options.get("alternatives", "false")
    count = {"false": 0, "true": MOST_ROUTES - 1}.get(text, whole_from(text))
    if count is None:
        raise OsrmError(OsrmCode.INVALID_QUERY, "alternatives", text[:200], "true, false or a number from 0")
    return min(count, MOST_ROUTES - 1)


def _annotations(asked: OsrmRequest) -> tuple[str, ...]:
    """The annotations that are asked for, () for none."""
    text = asked.options.get("annotations", "false")
    if text in ("true", "false"):
        return tuple(name for name in ANNOTATIONS if name != "nodes") if text == "true" else ()
    names = tuple(text.split(",", len(ANNOTATIONS)))
    for name in names:
        if name not in ANNOTATIONS:
            allowed = f"true, false, or some of {', '.join(ANNOTATIONS)}"
            raise OsrmError(OsrmCode.INVALID_QUERY, "annotations", name[:200], allowed)
        if name == "nodes":
            raise OsrmError(OsrmCode.NOT_IMPLEMENTED, "annotations", name, "others than nodes")
    return names


def route_answer(asked: OsrmRequest, found: FoundRoutes) -> dict[str, object]:
    """Routes as OSRM answers them, those that drive the same links once."""
    answer = found.answer
    asked.check_moved([place.distance_m for place in places_of(answer)])
    notes = notes_of(answer)
    written: dict[str, object] = {"code": "Ok"}
    if notes:
        written["message"] = "; ".join(notes)
    written["routes"] = [_Writer(asked, found, route).route() for route in distinct(answer.routes)]
    if not asked.flag("skip_waypoints"):
        written["waypoints"] = [waypoint(place) for place in places_of(answer)]
    return written


class _Writer:
    """Writes one route."""

    def __init__(self, asked: OsrmRequest, found: FoundRoutes, route: Route) -> None:
        self.asked, self.found, self.found_route = asked, found, route
        self.line: RouteLine = route_line(route, found.answer)
        self.geometry = _geometry(asked.options.get("geometries", "polyline"))
        self.annotations = _annotations(asked)

    def route(self) -> dict[str, object]:
        """The fields of an OSRM route."""
        route = self.found_route
        overview = self.asked.options.get("overview", "simplified")
        written: dict[str, object] = {}
        if overview in ("full", "simplified"):
            line = self.line.simplified() if overview == "simplified" else self.line.lonlat
            written["geometry"] = self.geometry(line)
        return written | {
            "legs": self._legs(by_legs=overview == "by_legs"),
            "distance": round(route.distance_m, WHOLE_ROUND),
            "duration": round(route.duration_s + route.stop_s, WHOLE_ROUND),
            "weight": self._weight(route.energy_j, route.duration_s + route.stop_s, route.distance_m),
            "weight_name": route.name,
            "ev": electric_route(route),
        }

    def _weight(self, energy_j: float, duration_s: float, distance_m: float) -> float:
        """What the search has minimised, in the units of its weights; of a plan with charging stops, hours."""
        weights = self.found_route.weights or Weights(0.0, 1.0, 0.0)
        return round(cost_of(weights, energy_j / JOULE_PER_KWH, duration_s, distance_m), 6)

    def _legs(self, *, by_legs: bool) -> list[dict[str, object]]:
        route = self.found_route
        steps = list(self.found.steps(route)) if self.asked.flag("steps") else []
        written, at = [], 0
        for leg, (begin, end) in zip(route.legs, self.line.legs, strict=True):
            own = []
            while at < len(steps):
                own.append(steps[at])
                at += 1
                if own[-1].type is StepType.ARRIVE:
                    break
            fields: dict[str, object] = {
                "steps": [self._step(step) for step in own],
                "summary": _summary(own),
                "distance": round(leg.to_m - leg.from_m, WHOLE_ROUND),
                "duration": round(leg.duration_s, WHOLE_ROUND),
                "weight": self._weight(leg.energy_j, leg.duration_s, leg.to_m - leg.from_m),
                "ev": electric_leg(leg),
            }
            if by_legs:
                fields["geometry"] = self.geometry(self.line.lonlat[begin : end + 1])
            if self.annotations:
                fields["annotation"] = _annotation(route, leg, self.line.lonlat, (begin, end), self.annotations)
            written.append(fields)
        return written

    def _step(self, step: Step) -> dict[str, object]:
        written: dict[str, object] = {
            "geometry": self.geometry(self.line.lonlat[step.geometry_first : step.geometry_last + 1]),
            "maneuver": _manoeuvre(step),
            "mode": step.mode.value,
            "driving_side": "left" if step.drives_left else "right",
            "name": step.name,
            "intersections": [_intersection(junction) for junction in step.intersections],
            "distance": round(step.distance_m, WHOLE_ROUND),
            "duration": round(step.duration_s, WHOLE_ROUND),
            "weight": self._weight(step.energy_j, step.duration_s, step.distance_m),
            "ev": electric_step(step),
        }
        for name in ("ref", "destinations", "exits", "rotary_name"):
            if value := getattr(step, name):
                written[name] = value
        return written


def _geometry(form: str) -> Geometry:
    """How a line is written; one of one point has it twice."""

    def write(line: NDArray[np.float64]) -> object:
        whole = line if line.shape[0] > 1 else np.repeat(line, 2, axis=0)
        if form == "geojson":
            return {"type": "LineString", "coordinates": np.ascontiguousarray(whole)}
        return encoded(whole, 6 if form == "polyline6" else 5)

    return write


def _manoeuvre(step: Step) -> dict[str, object]:
    written: dict[str, object] = {
        "type": step.type.value,
        "location": lonlat(step.at),
        "bearing_before": round(step.bearing_before_deg) % 360,
        "bearing_after": round(step.bearing_after_deg) % 360,
    }
    modifier = step.modifier
    if modifier is None and step.type not in (StepType.DEPART, StepType.ARRIVE):
        modifier = Modifier.STRAIGHT  # clients rely on there being one
    if modifier is not None:
        written["modifier"] = modifier.value
    if step.exit is not None:
        written["exit"] = step.exit
    return written


def _intersection(junction: Intersection) -> dict[str, object]:
    written: dict[str, object] = {
        "location": lonlat(junction.location),
        "bearings": list(junction.bearings),
        "entry": list(junction.entry),
    }
    if junction.in_idx is not None:
        written["in"] = junction.in_idx
    if junction.out_idx is not None:
        written["out"] = junction.out_idx
    if junction.lanes:
        written["lanes"] = [{"valid": lane.valid, "indications": list(lane.indications)} for lane in junction.lanes]
    return written


def _summary(steps: Iterable[Step]) -> str:
    """Names of the roads that most of a leg is driven on, in the order of driving."""
    driven_m: dict[str, float] = {}
    for step in steps:
        if name := step.name or step.ref:
            driven_m[name] = driven_m.get(name, 0.0) + step.distance_m
    major = sorted(driven_m, key=lambda name: -driven_m[name])[:MAJOR_ROADS]
    return ", ".join(name for name in driven_m if name in major)


def _annotation(
    route: Route, leg: RouteLeg, line: NDArray[np.float64], rows: tuple[int, int], names: tuple[str, ...]
) -> dict[str, Any]:
    """What is asked for of each stretch between two points of a leg's line.

    A link's time and energy are shared among its points by distance; soc is the charge at the end of a stretch.
    """
    begin, end = rows
    links, results = route.links, route.links.results
    here, there = line[begin:end], line[begin + 1 : end + 1]
    apart_m = np.asarray(great_circle_m(here[:, 1], here[:, 0], there[:, 1], there[:, 0]), np.float64)
    link = np.searchsorted(np.asarray(links.geometry_end_idx), np.arange(begin + 1, end + 1))
    count = len(links)
    whole_m = np.bincount(link, apart_m, count)
    pieces = np.bincount(link, minlength=count)
    with np.errstate(invalid="ignore", divide="ignore"):
        share = np.where(whole_m[link] > 0.0, apart_m / whole_m[link], 1.0 / pieces[link])
    length_m = (np.subtract(links.to_m, links.from_m))[link] * share
    duration_s = results.duration_s[link] * share
    energy_j = results.energy_j[link] * share
    soc_end = np.asarray(links.soc_end_frac, np.float64)
    weights = route.weights or Weights(0.0, 1.0, 0.0)
    values: dict[str, Any] = {
        "distance": lambda: length_m.round(1),
        "duration": lambda: duration_s.round(1),
        "speed": lambda: np.where(duration_s > 0.0, length_m / np.where(duration_s > 0.0, duration_s, 1.0), 0.0).round(
            1
        ),
        "weight": lambda: np.round(
            [
                cost_of(weights, energy / JOULE_PER_KWH, time, way)
                for energy, time, way in zip(energy_j, duration_s, length_m, strict=True)
            ],
            6,
        ),
        "datasources": lambda: np.zeros(link.size, np.int64),
        "energy": lambda: (energy_j / 3600.0).round(2),
        "soc": lambda: _soc_along(link, share, soc_end, leg).round(5),
    }
    written = {name: values[name]() for name in names}
    if "datasources" in names:
        written["metadata"] = {"datasource_names": ["joulepath"]}
    return written


def _soc_along(
    link: NDArray[np.int64], share: NDArray[np.float64], soc_end: NDArray[np.float64], leg: RouteLeg
) -> NDArray[np.float64]:
    """Charge at the end of each stretch, between those at the ends of its link."""
    if link.size == 0:
        return np.empty(0)
    starts = np.concatenate(([leg.soc_start_frac], soc_end[link[:-1]]))
    first = np.concatenate(([True], link[1:] != link[:-1]))
    run = np.cumsum(first) - 1
    begins = np.flatnonzero(first)
    before = np.cumsum(share) - np.repeat(np.cumsum(share)[begins] - share[begins], np.bincount(run))
    at_start = starts[begins][run]
    along: NDArray[np.float64] = at_start + (soc_end[link] - at_start) * np.minimum(before, 1.0)
    return along
