"""The steps of a route: what a driver is told, with distance, time, energy and charge from there on."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

import numpy as np

from routing.graph.earth import EARTH_RADIUS_M
from routing.guidance.bearings import LOOK_AHEAD_M, bearing_deg, turned_deg
from routing.guidance.course import Course
from routing.guidance.joining import joined
from routing.guidance.lanes import lanes_for
from routing.guidance.manoeuvres import manoeuvres_of
from routing.guidance.step import Intersection, Lane, Modifier, Step, StepType, TravelMode
from routing.guidance.surroundings import LINK, RAMP, RING
from routing.route.route import LegEnd

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from routing.graph.road_graph import RoadGraph
    from routing.guidance.manoeuvre import Manoeuvre
    from routing.places import Point
    from routing.route.route import Route, RouteLeg

__all__ = ["Intersection", "Lane", "Modifier", "Step", "StepType", "TravelMode", "steps_of"]

NEAR_M: Final = 1.0  # from a place where the route begins or ends nothing is turned
# How far off the road a goal is said to be on a side of it [m], as in OSRM's source; nearer ones are on the road.
ASIDE_M: Final = 5.0
FAR_ASIDE_M: Final = 300.0
AHEAD_DEG: Final = 30.0  # off the direction of travel, up to which a goal is said to be ahead (assumed)


def steps_of(graph: RoadGraph, route: Route, *, asked: Sequence[Point] = (), language: str = "") -> tuple[Step, ...]:
    """The steps of a route on its graph, in O(links), from a departure to an arrival for each of its legs.

    The link positions of all steps follow each other without gaps, and so do their distances. A leg on which nothing is
    driven has a departure and an arrival without links. On a graph without signs there are no ramps and roundabouts.
    asked: via points and goal as they were asked for, from which the side of arrival is found; none without them.
    language: in which roads are named where the map has their names in it, as `de`; empty for those on the signs.
    """
    return _Writer(graph, route, asked, language).steps()


class _Writer:
    """Makes steps of manoeuvres."""

    def __init__(self, graph: RoadGraph, route: Route, asked: Sequence[Point], language: str) -> None:
        self.graph, self.route = graph, route
        self.course = Course(graph, route, language)
        self.goals = _goals(route, asked)
        results = route.links.results
        self.time_s = _sums(results.duration_s)
        self.energy_j = _sums(results.energy_j)
        self.drives_left = graph.signs is not None and graph.signs.drives_left
        self.exits: dict[int, str] = {}
        if graph.signs is not None and self.course.links:
            at = np.flatnonzero(np.isin(graph.signs.exit_node, graph.head[self.course.link]))
            self.exits = {int(graph.signs.exit_node[k]): graph.signs.exit_ref[k] for k in at.tolist()}

    def steps(self) -> tuple[Step, ...]:
        """All steps."""
        steps: list[Step] = []
        done = 0
        for leg, goal in zip(self.route.legs, self.goals, strict=True):
            if leg.first_link is None or leg.last_link is None:
                steps += self._standing(leg, done)
            else:
                steps += self._driven(leg, leg.first_link, leg.last_link, goal)
                done = leg.last_link + 1
        return tuple(steps)

    def _standing(self, leg: RouteLeg, position: int) -> list[Step]:
        """A leg from a place to itself, after the links before a position."""
        at = self._geometry_end(position - 1)
        label = self.course.label(max(position - 1, 0)) if self.course.links else None
        return [
            Step(
                type=kind,
                modifier=None,
                at=self._place(at),
                bearing_before_deg=0.0,
                bearing_after_deg=0.0,
                first_link=position,
                last_link=position - 1,
                geometry_first=at,
                geometry_last=at,
                distance_m=0.0,
                duration_s=0.0,
                energy_j=0.0,
                soc_start_frac=leg.soc_end_frac if kind is StepType.ARRIVE else leg.soc_start_frac,
                soc_end_frac=leg.soc_end_frac,
                name="" if label is None else label.name,
                ref="" if label is None else label.ref,
                destinations="",
                exits="",
                exit=None,
                lanes=(),
                intersections=(Intersection(self._place(at), (0,), (True,), *ends),),
                drives_left=self.drives_left,
                ends_at=leg.ends_at if kind is StepType.ARRIVE else None,
            )
            for kind, ends in ((StepType.DEPART, (None, 0)), (StepType.ARRIVE, (0, None)))
        ]

    def _driven(self, leg: RouteLeg, first: int, last: int, goal: Point | None) -> list[Step]:
        course = self.course
        found = joined(course, manoeuvres_of(course, first, last), first, last)
        begin_m, end_m = course.at_m[first] + NEAR_M, course.at_m[last + 1] - NEAR_M
        found = [m for m in found if begin_m <= course.at_m[m.at + 1] <= end_m]
        ends = [manoeuvre.at for manoeuvre in found] + [last]
        steps = [self._departure(leg, first, ends[0])]
        steps += [self._turn(leg, m, end, last) for m, end in zip(found, ends[1:], strict=True)]
        steps.append(self._arrival(leg, last, goal))
        return steps

    def _departure(self, leg: RouteLeg, first: int, end: int) -> Step:
        begin, stop = self._geometry_end(first - 1), self._geometry_end(end)
        bearing = self._along(begin, self._geometry_end(leg.last_link or first), 1)
        place = self._place(begin)
        start = Intersection(place, (_whole(bearing),), (True,), None, 0)
        return self._step(
            leg,
            StepType.DEPART,
            None,
            first,
            end,
            (begin, stop),
            (0.0, bearing),
            (start,),
            named=self.course.begins(first, end),
            speed_cap_mps=leg.speed_cap_mps,
        )

    def _arrival(self, leg: RouteLeg, last: int, goal: Point | None) -> Step:
        end = self._geometry_end(last)
        bearing = (self._along(end, self._geometry_end((leg.first_link or 0) - 1), -1) + 180.0) % 360.0
        place = self._place(end)
        junction = Intersection(place, (_whole(bearing + 180.0),), (True,), 0, None)
        side = None if goal is None else _side(self.route.geometry[end], bearing, goal)
        return self._step(
            leg, StepType.ARRIVE, side, last + 1, last, (end, end), (bearing, 0.0), (junction,), named=last
        )

    def _turn(self, leg: RouteLeg, manoeuvre: Manoeuvre, end: int, last: int) -> Step:
        at = manoeuvre.at
        lanes = self._lanes(manoeuvre)
        return self._step(
            leg,
            manoeuvre.type,
            manoeuvre.modifier,
            at + 1,
            end,
            (self._geometry_end(at), self._geometry_end(end)),
            (manoeuvre.before_deg, manoeuvre.after_deg),
            (self._intersection(at, lanes),),
            named=manoeuvre.named,
            named_last=max(end, min(manoeuvre.named, last)),
            exits=self._exits(manoeuvre),
            exit_idx=manoeuvre.exit,
            lanes=lanes,
            rotary_name=manoeuvre.rotary,
        )

    def _step(
        self,
        leg: RouteLeg,
        kind: StepType,
        modifier: Modifier | None,
        first: int,
        last: int,
        geometry: tuple[int, int],
        bearings: tuple[float, float],
        start: tuple[Intersection, ...],
        *,
        named: int | None = None,
        named_last: int | None = None,
        exits: str = "",
        exit_idx: int | None = None,
        lanes: tuple[Lane, ...] = (),
        rotary_name: str = "",
        speed_cap_mps: float | None = None,
    ) -> Step:
        course = self.course
        named = first if named is None else named
        label = course.label_from(named, last if named_last is None else named_last)
        begin = min(first, len(course.links))
        return Step(
            type=kind,
            modifier=modifier,
            at=self._place(geometry[0]),
            bearing_before_deg=bearings[0],
            bearing_after_deg=bearings[1],
            first_link=first,
            last_link=last,
            geometry_first=geometry[0],
            geometry_last=geometry[1],
            distance_m=course.at_m[last + 1] - course.at_m[begin],
            duration_s=self.time_s[last + 1] - self.time_s[begin],
            energy_j=self.energy_j[last + 1] - self.energy_j[begin],
            soc_start_frac=self._soc(leg, first),
            soc_end_frac=self._soc(leg, last + 1),
            name=label.name,
            ref=label.ref,
            destinations=self._destinations(kind, named, last),
            exits=exits,
            exit=exit_idx,
            lanes=lanes,
            intersections=start + self._passed(first, last),
            rotary_name=rotary_name,
            mode=TravelMode.FERRY if first <= last and course.ferry[first] else TravelMode.DRIVING,
            drives_left=self.drives_left,
            speed_cap_mps=speed_cap_mps,
            ends_at=leg.ends_at if kind is StepType.ARRIVE else None,
        )

    def _soc(self, leg: RouteLeg, position: int) -> float:
        """Charge where a link of the leg begins."""
        return leg.soc_start_frac if position == leg.first_link else self.route.links.soc_end_frac[position - 1]

    def _geometry_end(self, position: int) -> int:
        return 0 if position < 0 else self.route.links.geometry_end_idx[position]

    def _place(self, geometry_idx: int) -> tuple[float, float]:
        lon, lat = self.route.geometry[geometry_idx].tolist()
        return lat, lon

    def _along(self, begin: int, end: int, way: int) -> float:
        """Direction from a point of the route's line to the one that is LOOK_AHEAD_M on, or to the end."""
        line = self.route.geometry
        here, k, seen_m = line[begin], begin, 0.0
        while k != end and seen_m < LOOK_AHEAD_M:
            k += way
            seen_m = _apart_m(here, line[k])
        return bearing_deg(here, line[k])

    def _passed(self, first: int, last: int) -> tuple[Intersection, ...]:
        """Junctions of three roads or more on the way between two links."""
        course = self.course
        return tuple(self._intersection(k, ()) for k in course.met(first, last) if course.roads[k] > 2)

    def _intersection(self, position: int, lanes: tuple[Lane, ...]) -> Intersection:
        course, junctions = self.course, self.course.junctions
        row = course.rows[position]
        begin, end = junctions.first[row], junctions.first[row + 1]
        following = course.links[position + 1]
        out = junctions.out_link
        return Intersection(
            self._place(self._geometry_end(position)),
            tuple([_whole(bearing) for bearing in junctions.bearing_deg[begin:end]]),
            tuple(junctions.entry[begin:end]),
            junctions.came[row] - begin if junctions.came[row] >= 0 else None,
            next((k - begin for k in range(begin, end) if out[k] == following), None),
            lanes,
        )

    def _lanes(self, manoeuvre: Manoeuvre) -> tuple[Lane, ...]:
        sign = self.course.labels.sign(self.course.links[manoeuvre.at])
        turn = turned_deg(manoeuvre.before_deg, manoeuvre.after_deg)
        return lanes_for(sign.turn_lanes, turn) if sign.turn_lanes else ()

    def _exits(self, manoeuvre: Manoeuvre) -> str:
        """The number of the exit that is taken, from the ramp's sign or from the junction."""
        course, at = self.course, manoeuvre.at
        if course.bits[at] & (LINK | RING) or not course.bits[at + 1] & RAMP:
            return ""
        own = course.labels.sign(course.links[at + 1]).exit_ref
        return own or self.exits.get(int(self.graph.head[course.links[at]]), "")

    def _destinations(self, kind: StepType, named: int, last: int) -> str:
        """What is written on the signs of a road, `A 1: Lisboa, Porto`; of a ramp also on those further on."""
        course = self.course
        if kind is StepType.ARRIVE or not course.links:
            return ""
        for k in range(named, max(named, last) + 1):
            sign = course.labels.sign(course.links[k])
            if sign.destination or sign.destination_ref:
                parts = (sign.destination_ref, sign.destination)
                return ": ".join(", ".join(p.strip() for p in part.split(";") if p.strip()) for part in parts if part)
            if not course.bits[k] & LINK:
                break
        return ""


def _goals(route: Route, asked: Sequence[Point]) -> list[Point | None]:
    """What was asked for at the end of each leg, None of charging stops and where it is not known."""
    ends = [k for k, leg in enumerate(route.legs) if leg.ends_at is not LegEnd.STOP]
    goals: list[Point | None] = [None] * len(route.legs)
    if len(ends) == len(asked):
        for k, point in zip(ends, asked, strict=True):
            goals[k] = point
    return goals


def _side(on_road: NDArray[np.float64], bearing: float, goal: Point) -> Modifier | None:
    """On which side of the direction of travel a goal is, straight where it is ahead; None on the road or behind."""
    there = np.array((goal.lon_deg, goal.lat_deg))
    if not ASIDE_M <= _apart_m(on_road, there) <= FAR_ASIDE_M:
        return None
    turn = turned_deg(bearing, bearing_deg(on_road, there))
    if abs(turn) <= AHEAD_DEG:
        return Modifier.STRAIGHT
    if abs(turn) >= 180.0 - AHEAD_DEG:
        return None
    return Modifier.RIGHT if turn > 0.0 else Modifier.LEFT


def _sums(values: NDArray[np.float64]) -> list[float]:
    """0 and the sums of the first values."""
    return [0.0, *np.cumsum(values).tolist()]


def _whole(bearing: float) -> int:
    return round(bearing) % 360


def _apart_m(here: NDArray[np.float64], there: NDArray[np.float64]) -> float:
    """Distance of two near places [m], lon and lat [deg] each; good enough to look ahead."""
    east = ((there[0] - here[0] + 180.0) % 360.0 - 180.0) * np.cos(np.radians(here[1]))
    return float(np.hypot(east, there[1] - here[1])) * EARTH_RADIUS_M * math.pi / 180.0
