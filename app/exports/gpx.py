"""Routes as GPX 1.1: a track with heights and times for each, and its steps as a route."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final
from xml.etree.ElementTree import Element

from app.conversions.charging.plans import departure_of
from app.conversions.place import DECIMALS
from app.conversions.route import asked_places
from app.exports.content import data_note, summary_of
from app.exports.track import times_of, track_of
from app.exports.xml import add, document
from routing.graph.snap import road_point
from routing.guidance.instructions import instruction_of
from routing.guidance.steps import steps_of

if TYPE_CHECKING:
    from app.exports.content import RouteContent
    from routing.charging.plan import Plan
    from routing.places import Point
    from routing.route.route import Route

NAMESPACE: Final = "http://www.topografix.com/GPX/1/1"
SCHEMA: Final = f"{NAMESPACE} http://www.topografix.com/GPX/1/1/gpx.xsd"
INSTANCE: Final = "http://www.w3.org/2001/XMLSchema-instance"
HEIGHT_DIGITS: Final = 1
# elements are in the order that the schema has them in


def route_gpx(content: RouteContent) -> bytes:
    """All routes of an answer. With `steps`, a rte for each; heights are left out on a graph without terrain.

    Times begin at the departure of the request, in local time without a zone; without one, now in universal time.
    """
    root = Element("gpx", {"version": "1.1", "creator": "joulepath", "xmlns": NAMESPACE})
    root.set("xmlns:xsi", INSTANCE)
    root.set("xsi:schemaLocation", SCHEMA)
    _metadata(root, content)
    answer = content.answer
    _waypoint(root, answer.start.on_road, "Start", "start")
    for k, place in enumerate(answer.via):
        _waypoint(root, place.on_road, f"Via {k + 1}", "via")
    _waypoint(root, answer.goal.on_road, "Goal", "goal")
    for route, plan in zip(answer.routes, content.plans, strict=True):
        _stops(root, content, route, plan)
    if content.understood.steps:
        for route in answer.routes:
            _steps(root, content, route)
    for k, (route, plan) in enumerate(zip(answer.routes, content.plans, strict=True)):
        _track(root, content, route, plan, k + 1)
    return document(root)


def _metadata(root: Element, content: RouteContent) -> None:
    metadata = add(root, "metadata")
    add(metadata, "name", "joulepath route")
    add(metadata, "desc", data_note(content.graph))
    routes = content.answer.routes
    if routes:
        west, south = (min(float(route.geometry[:, axis].min()) for route in routes) for axis in (0, 1))
        east, north = (max(float(route.geometry[:, axis].max()) for route in routes) for axis in (0, 1))
        bounds = {"minlat": south, "minlon": west, "maxlat": north, "maxlon": east}
        add(metadata, "bounds", **{name: _degrees(value) for name, value in bounds.items()})


def _waypoint(root: Element, at: Point, name: str, kind: str, about: str = "") -> None:
    point = add(root, "wpt", lat=_degrees(at.lat_deg), lon=_degrees(at.lon_deg))
    add(point, "name", name)
    if about:
        add(point, "desc", about)
    add(point, "type", kind)


def _stops(root: Element, content: RouteContent, route: Route, plan: Plan | None) -> None:
    for stop in () if plan is None else plan.stops:
        name = "Charging stop" if stop.station is None else stop.station.name or "Charging stop"
        about = (
            f"route {route.name}: charge {100.0 * stop.arrive_soc_frac:.0f} % to {100.0 * stop.depart_soc_frac:.0f} %, "
            f"{(stop.depart_s - stop.arrive_s) / 60.0:.0f} min"
        )
        _waypoint(root, road_point(content.graph, stop.position), name, "charging stop", about)


def _steps(root: Element, content: RouteContent, route: Route) -> None:
    steps = add(root, "rte")
    add(steps, "name", route.name)
    add(steps, "desc", summary_of(route))
    for step in steps_of(content.graph, route, asked=asked_places(content.understood)):
        point = add(steps, "rtept", lat=_degrees(step.at[0]), lon=_degrees(step.at[1]))
        add(point, "name", instruction_of(step))
        add(point, "desc", f"{step.distance_m:.0f} m, charge {100.0 * step.soc_start_frac:.1f} %")
        add(point, "type", step.type.value if step.modifier is None else f"{step.type.value} {step.modifier.value}")


def _track(root: Element, content: RouteContent, route: Route, plan: Plan | None, number: int) -> None:
    track = track_of(route, plan)
    times = times_of(track, departure_of(content.understood))
    with_heights = content.graph.meta.terrain.value != "absent"
    drawn = add(root, "trk")
    add(drawn, "name", route.name)
    add(drawn, "desc", summary_of(route))
    add(drawn, "number", str(number))
    segment = add(drawn, "trkseg")
    points = zip(track.lat_deg.tolist(), track.lon_deg.tolist(), track.height_m.tolist(), times, strict=True)
    for lat, lon, height_m, time in points:
        point = add(segment, "trkpt", lat=_degrees(lat), lon=_degrees(lon))
        if with_heights:
            add(point, "ele", f"{height_m:.{HEIGHT_DIGITS}f}")
        add(point, "time", time)


def _degrees(value: float) -> str:
    return f"{value:.{DECIMALS}f}".rstrip("0").rstrip(".")
