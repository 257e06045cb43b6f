"""openrouteservice's directions: as JSON, GeoJSON and GPX."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any, Final
from xml.sax.saxutils import escape

import numpy as np

from app.http.faces.electric import route_request
from app.http.faces.figures import electric_leg, electric_route, notes_of
from app.http.faces.lines import box_of, distinct, heights_along, places_of, route_line
from app.http.faces.ors.asked import METRES, places_from
from app.http.faces.ors.errors import POINT_NOT_FOUND, OrsError, OrsKind, OrsService, metadata
from app.http.faces.ors.steps import step_fields
from app.http.faces.polylines import encoded
from routing.graph.earth import great_circle_m
from routing.guidance.step import StepType
from routing.weights import ECO, FASTEST, SHORTEST

if TYPE_CHECKING:
    from collections.abc import Mapping

    from numpy.typing import NDArray

    from app.http.faces.electric import Electric
    from app.http.faces.ors.asked import DirectionsBody
    from app.schemas.route import RouteRequest
    from app.service.found import FoundRoutes
    from routing.guidance.step import Step
    from routing.route.route import Route
    from routing.weights import Weights

WEIGHTS: Final[Mapping[str, Weights]] = {"recommended": ECO, "fastest": FASTEST, "shortest": SHORTEST}
EXTENSIONS: Final = "urn:joulepath:gpx"  # of another namespace than GPX's, as its schema demands
WARNING: Final = 4  # openrouteservice numbers its warnings 1 to 3


def asked_directions(body: DirectionsBody, electric: Electric) -> RouteRequest:
    """The route request of a body; refuses what can't be heeded."""
    body.refuse_unheeded()
    radiuses(body)
    drive = dict(electric.drive)
    weather = {} if drive.get("conditions") is None else drive["conditions"]
    if isinstance(weather, dict):
        if body.departure is not None:
            weather = {"departure": body.departure.isoformat(), **weather}
        if body.maximum_speed is not None:
            weather = {"top_speed_kmh": body.maximum_speed, **weather}
        drive |= {"conditions": weather} if weather else {}
    places = places_from(body.coordinates, OrsService.DIRECTIONS, "coordinates")
    further = 0 if body.alternative_routes is None else body.alternative_routes.target_count - 1
    weights = WEIGHTS[body.preference]
    return route_request(places, replace(electric, drive=drive), further, None if weights is ECO else weights)


def radiuses(body: DirectionsBody) -> list[float]:
    """How far each place may be moved to a road [m], negative for any distance."""
    sent = body.radiuses
    if sent is None:
        return []
    limits = [sent] if isinstance(sent, float) else sent
    if len(limits) == 1:
        return limits * len(body.coordinates)
    if len(limits) != len(body.coordinates):
        number = OrsService.DIRECTIONS + OrsKind.VALUE
        raise OrsError(number, "Parameter 'radiuses' has not as many values as 'coordinates'.")
    return limits


def check_moved(body: DirectionsBody, found: FoundRoutes) -> None:
    """Refuse places that are farther from a road than radiuses allow."""
    for k, (limit_m, place) in enumerate(zip(radiuses(body), places_of(found.answer), strict=False)):
        if 0.0 <= limit_m < place.distance_m:
            message = (
                f"Could not find routable point within a radius of {limit_m:g} meters of specified coordinate {k}: "
                f"{place.asked.lon_deg:g} {place.asked.lat_deg:g}."
            )
            raise OrsError(POINT_NOT_FOUND[OrsService.DIRECTIONS], message)


class Written:
    """One route as openrouteservice writes it."""

    def __init__(self, body: DirectionsBody, found: FoundRoutes, route: Route, profile: str) -> None:
        self.body, self.route, self.profile = body, route, profile
        self.answer = found.answer
        self.metres = METRES[body.units]
        line = route_line(route, found.answer)
        self.lonlat, self.legs = line.lonlat, line.legs
        self.heights = heights_along(route).round(1)
        self.rows: list[int] = list(range(self.lonlat.shape[0]))
        self.steps: tuple[Step, ...] = ()
        if body.instructions or body.format == "gpx":
            language = body.language[:2].lower()
            self.steps = found.steps(route, "" if language == "en" else language)
        if body.geometry_simplify:
            self._simplify(line.simplified())

    def _simplify(self, simple: NDArray[np.float64]) -> None:
        """Leave points out that are not seen; the places of steps stay."""
        known = {tuple(point) for point in simple.tolist()}
        ends = {row for leg in self.legs for row in leg}
        ends |= {row for step in self.steps for row in (step.geometry_first, step.geometry_last)}
        kept = np.array([k in ends or tuple(point) in known for k, point in enumerate(self.lonlat.tolist())])
        self.rows = (np.cumsum(kept) - 1).tolist()
        self.lonlat, self.heights = self.lonlat[kept], self.heights[kept]

    @property
    def way_points(self) -> list[int]:
        """Rows of the line at which legs begin and end."""
        return [self.rows[self.legs[0][0]], *(self.rows[end] for _, end in self.legs)]

    def box(self) -> list[float]:
        """The line's box, with heights where they are asked for."""
        west, south, east, north = box_of(self.lonlat)
        if not self.body.elevation:
            return [west, south, east, north]
        return [west, south, float(self.heights.min()), east, north, float(self.heights.max())]

    def summary(self) -> dict[str, Any]:
        """What the whole route comes to."""
        route = self.route
        written = {"distance": self._way(route.distance_m), "duration": round(route.duration_s + route.stop_s, 1)}
        if self.body.elevation:
            written |= {"ascent": round(route.climb_m, 1), "descent": round(route.descent_m, 1)}
        return written

    def segments(self) -> list[dict[str, Any]]:
        """The legs with their steps."""
        written, at = [], 0
        for leg, (begin, end) in zip(self.route.legs, self.legs, strict=True):
            steps = []
            while at < len(self.steps):
                steps.append(self.steps[at])
                at += 1
                if steps[-1].type is StepType.ARRIVE:
                    break
            way_m = leg.to_m - leg.from_m
            fields: dict[str, Any] = {
                "distance": self._way(way_m),
                "duration": round(leg.duration_s, 1),
                "steps": [
                    step_fields(
                        step,
                        self.rows,
                        self.metres,
                        html=self.body.instructions_format == "html",
                        manoeuvre=self.body.maneuvers,
                    )
                    for step in steps
                ],
            }
            for name in self.body.attributes:
                fields[name] = self._attribute(name, way_m, leg.duration_s, (begin, end))
            if self.body.elevation:
                rise = np.diff(self.heights[self.rows[begin] : self.rows[end] + 1])
                fields |= {"ascent": round(float(rise[rise > 0.0].sum()), 1)}
                fields |= {"descent": round(float(-rise[rise < 0.0].sum()), 1)}
            written.append(fields | {"ev": electric_leg(leg)})
        return written

    def _way(self, way_m: float) -> float:
        """A distance in the units asked for."""
        return round(way_m / self.metres, 1 if self.metres == 1.0 else 4)

    def _attribute(self, name: str, way_m: float, time_s: float, rows: tuple[int, int]) -> float:
        if name == "avgspeed":
            return round(3.6 * way_m / time_s, 2) if time_s > 0.0 else 0.0
        if name == "percentage":
            return round(100.0 * way_m / self.route.distance_m, 2) if self.route.distance_m > 0.0 else 0.0
        (from_lon, from_lat), (to_lon, to_lat) = (self.lonlat[self.rows[row]] for row in rows)
        direct_m = float(great_circle_m(from_lat, from_lon, to_lat, to_lon))
        return round(way_m / direct_m, 2) if direct_m > 0.0 else 0.0

    def details(self) -> dict[str, Any]:
        """What JSON and GeoJSON share."""
        written: dict[str, Any] = {}
        if self.body.instructions:
            written["segments"] = self.segments()
        written["way_points"] = self.way_points
        notes = notes_of(replace(self.answer, routes=(self.route,)))
        if notes and not self.body.suppress_warnings:
            written["warnings"] = [{"code": WARNING, "message": note} for note in notes]
        return written | {"ev": electric_route(self.route)}

    def as_json(self) -> dict[str, Any]:
        """A route of the JSON answer."""
        written = {"summary": self.summary(), "bbox": self.box(), **self.details()}
        if self.body.geometry:
            written["geometry"] = encoded(self.lonlat, 5, self.heights if self.body.elevation else None)
        return written

    def as_feature(self) -> dict[str, Any]:
        """A feature of the GeoJSON answer."""
        points = np.column_stack((self.lonlat, self.heights)) if self.body.elevation else self.lonlat
        whole = points if points.shape[0] > 1 else np.repeat(points, 2, axis=0)
        summary = self.summary()
        raised = {name: summary[name] for name in ("ascent", "descent") if name in summary}
        return {
            "bbox": self.box(),
            "type": "Feature",
            "properties": {**raised, **self.details(), "summary": summary},
            "geometry": {"type": "LineString", "coordinates": np.ascontiguousarray(whole)},
        }

    def as_rte(self) -> str:
        """A route of the GPX answer: a point for each step, with what is to be done there."""
        points = []
        for k, step in enumerate(self.steps):
            lat, lon = step.at
            height = self.heights[self.rows[step.geometry_first]]
            fields = step_fields(step, self.rows, self.metres, html=False, manoeuvre=False)
            points.append(
                f'<rtept lat="{lat:.6f}" lon="{lon:.6f}"><ele>{height:.1f}</ele><name>{_xml(fields["name"])}</name>'
                f"<desc>{_xml(fields['instruction'])}</desc><extensions><ev:distance>{fields['distance']}</ev:distance>"
                f"<ev:duration>{fields['duration']}</ev:duration><ev:type>{fields['type']}</ev:type><ev:step>{k}</ev:step>"
                f"<ev:energy_kwh>{fields['ev']['energy_kwh']}</ev:energy_kwh><ev:soc_start>{fields['ev']['soc_start']}"
                "</ev:soc_start></extensions></rtept>"
            )
        return f"<rte><name>{_xml(self.route.name)}</name>{''.join(points)}</rte>"

    def as_trk(self) -> str:
        """A track of the GPX answer: the line with heights."""
        points = "".join(
            f'<trkpt lat="{lat:.6f}" lon="{lon:.6f}"><ele>{height:.1f}</ele></trkpt>'
            for (lon, lat), height in zip(self.lonlat.tolist(), self.heights.tolist(), strict=True)
        )
        return f"<trk><name>{_xml(self.route.name)}</name><trkseg>{points}</trkseg></trk>"


def written_routes(body: DirectionsBody, found: FoundRoutes, profile: str) -> list[Written]:
    """The routes of an answer, those that drive the same links once."""
    check_moved(body, found)
    return [Written(body, found, route, profile) for route in distinct(found.answer.routes)]


def directions_json(body: DirectionsBody, found: FoundRoutes, profile: str) -> dict[str, Any]:
    """Routes as openrouteservice's JSON."""
    routes = written_routes(body, found, profile)
    return {
        "bbox": _union([route.box() for route in routes]),
        "routes": [route.as_json() for route in routes],
        "metadata": metadata(
            body.id,
            "routing",
            body.query(),
            profile,
            found.graph.meta.attribution,
        ),
    }


def directions_geojson(body: DirectionsBody, found: FoundRoutes, profile: str) -> dict[str, Any]:
    """Routes as openrouteservice's GeoJSON."""
    routes = written_routes(body, found, profile)
    return {
        "type": "FeatureCollection",
        "bbox": _union([route.box() for route in routes]),
        "features": [route.as_feature() for route in routes],
        "metadata": metadata(
            body.id,
            "routing",
            body.query(),
            profile,
            found.graph.meta.attribution,
        ),
    }


def directions_gpx(body: DirectionsBody, found: FoundRoutes, profile: str) -> str:
    """Routes as GPX 1.1: a route with steps, and a track."""
    routes = written_routes(body, found, profile)
    attribution = _xml(found.graph.meta.attribution)
    return (
        '<?xml version="1.0" encoding="UTF-8"?><gpx version="1.1" creator="joulepath" '
        f'xmlns="http://www.topografix.com/GPX/1/1" xmlns:ev="{EXTENSIONS}"><metadata><name>joulepath directions</name>'
        f"<desc>{attribution}</desc></metadata>{''.join(route.as_rte() for route in routes)}"
        f"{''.join(route.as_trk() for route in routes)}</gpx>"
    )


def _xml(text: str) -> str:
    """A text as XML has it, without characters that XML 1.0 does not allow."""
    return escape("".join(letter for letter in text if letter >= " " and letter not in "\ufffe\uffff"))


def _union(boxes: list[list[float]]) -> list[float]:
    sides = np.array(boxes)
    half = sides.shape[1] // 2
    return [*sides[:, :half].min(axis=0).tolist(), *sides[:, half:].max(axis=0).tolist()]
