"""What of the things that OpenStreetMap draws is one station: an area, what lies in it, and members of relations."""

from __future__ import annotations

import math
from collections import defaultdict
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Final

import numpy as np
import shapely
from shapely.ops import nearest_points

from routing.graph.earth import METRE_PER_DEGREE
from routing.places import Point
from routing.stations.duplicates import added_up, best_sockets, names_of
from routing.stations.station import Access

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from shapely.geometry.base import BaseGeometry

    from routing.stations.station import Station

POINT_REACH_M: Final = 60.0  # from a station, within which a charge point beside it is its own; assumed
MEMBER_REACH_M: Final = 500.0  # from a relation's middle; members farther away are stations of their own; assumed
MOST_LOOKED_AT: Final = 200  # of the things in one place, which is more than any place has
_EDGE_DEG: Final = 1e-6  # by which an area is widened, so that what is on its outline lies in it


@dataclass(frozen=True, slots=True)
class Drawing:
    """How a station or charge point is drawn: its shape [deg], and the ids of what a relation is made of."""

    shape: BaseGeometry
    is_point: bool  # of a charge point
    members: tuple[str, ...] = ()


def place_of_shape(shape: BaseGeometry) -> Point:
    """A place within a shape [deg], the middle of one that is no area."""
    middle = shape.representative_point() if shape.area > 0.0 else shape.centroid
    return Point(round(middle.y, 7), round(middle.x, 7))


def without_parts(stations: Mapping[str, Station], drawings: Mapping[str, Drawing]) -> dict[str, Station]:
    """Stations by id in their order, those united with their parts that are drawn on their own.

    Parts are members of a station's relation; what lies in a station's area and is of no other operator; and charge
    points beside a station, POINT_REACH_M at most, likewise. A charge point is a part of the station drawn as a point
    that it is nearest to in the same area. No socket counts twice: each plug is as the station or all of its parts say,
    whoever knows most of it, and other facts come from the first that says them. What has no drawing is none's part.
    O(n log n) for shapes that overlap little.
    """
    parents = _parents(stations, drawings)
    children: dict[str, list[str]] = defaultdict(list)
    for part, whole in parents.items():
        children[whole].append(part)
    found: dict[str, Station] = {}
    roots = [key for key in stations if key not in parents]
    for root in roots:
        below = [root]
        for key in below:
            below += children.get(key, ())
        done: dict[str, Station] = {}
        for key in reversed(below):
            parts = [done.pop(part) for part in children.get(key, ())]
            points = {part for part in children.get(key, ()) if drawings[part].is_point}
            done[key] = _with_parts(stations[key], parts, points) if parts else stations[key]
        found[root] = done[root]
    return found


def _parents(stations: Mapping[str, Station], drawings: Mapping[str, Drawing]) -> dict[str, str]:
    """The station that each part belongs to, by id."""
    wholes = [key for key, drawing in drawings.items() if not drawing.is_point]
    points = [key for key, drawing in drawings.items() if drawing.is_point]
    relations: dict[str, str] = {}
    for key in wholes:
        for member in drawings[key].members:
            if member in drawings and member != key and _is_near(drawings[key].shape, drawings[member].shape):
                relations.setdefault(member, key)
    areas = _Areas(stations, drawings, [key for key in wholes if drawings[key].shape.area > 0.0])
    parents: dict[str, str] = {}
    for key in sorted(wholes, key=lambda key: key not in relations):
        around = areas.smallest_around(key)
        relation = relations.get(key)
        if relation is not None and (around is None or relations.get(around) != relation):
            around = relation
        if around is not None and not _is_below(around, key, parents):
            parents[key] = around
    if not wholes:
        return parents
    tree = shapely.STRtree(np.array([drawings[key].shape for key in wholes], np.object_))
    for key in points:
        around = areas.smallest_around(key)
        group = around if around is not None else relations.get(key)
        near = [
            whole
            for whole in _within_reach(stations, drawings, key, tree, wholes)
            if group is None or (drawings[whole].shape.area == 0.0 and parents.get(whole) == group)
        ]
        owner = near[0] if near else group
        if owner is not None:
            parents[key] = owner
    return parents


def _is_below(key: str, whole: str, parents: Mapping[str, str]) -> bool:
    """Whether something is a thing or one of its parts."""
    at: str | None = key
    while at is not None:
        if at == whole:
            return True
        at = parents.get(at)
    return False


class _Areas:
    """Stations that are drawn as areas."""

    def __init__(self, stations: Mapping[str, Station], drawings: Mapping[str, Drawing], keys: Sequence[str]) -> None:
        self.stations = stations
        self.drawings = drawings
        self.keys = keys
        self.sizes = [drawings[key].shape.area for key in keys]
        wide = [drawings[key].shape.buffer(_EDGE_DEG) for key in keys]
        self.tree = shapely.STRtree(np.array(wide, np.object_))

    def smallest_around(self, key: str) -> str | None:
        """The smallest area of no other operator that something lies in, None where there is none."""
        shape = self.drawings[key].shape
        inside = self.tree.query(shape, predicate="covered_by").tolist()[:MOST_LOOKED_AT]
        around = [
            (self.sizes[k], k)
            for k in inside
            if self.keys[k] != key
            and self.sizes[k] >= shape.area
            and _may_be_one(self.stations[key], self.stations[self.keys[k]])
        ]
        return self.keys[min(around)[1]] if around else None


def _within_reach(
    stations: Mapping[str, Station],
    drawings: Mapping[str, Drawing],
    key: str,
    tree: shapely.STRtree,
    wholes: Sequence[str],
) -> list[str]:
    """Stations of no other operator within POINT_REACH_M of a charge point, the nearest first."""
    middle = drawings[key].shape.centroid
    reach = POINT_REACH_M / METRE_PER_DEGREE
    wide = reach / max(math.cos(math.radians(middle.y)), 0.01)
    box = shapely.box(middle.x - wide, middle.y - reach, middle.x + wide, middle.y + reach)
    near = [
        (away_m, k)
        for k in tree.query(box).tolist()[:MOST_LOOKED_AT]
        if (away_m := _away_m(drawings[wholes[k]].shape, middle)) <= POINT_REACH_M
        and _may_be_one(stations[key], stations[wholes[k]])
    ]
    return [wholes[k] for _, k in sorted(near)]


def _is_near(relation: BaseGeometry, member: BaseGeometry) -> bool:
    return _away_m(member, relation.centroid) <= MEMBER_REACH_M


def _away_m(shape: BaseGeometry, point: shapely.Point) -> float:
    place = nearest_points(shape, point)[0]
    shrink = max(math.cos(math.radians(point.y)), 0.01)
    return METRE_PER_DEGREE * math.hypot((place.x - point.x) * shrink, place.y - point.y)


def _may_be_one(a: Station, b: Station) -> bool:
    """Whether what two things name does not say that they are of two operators."""
    if a.operator and b.operator:
        return not names_of(a.operator).isdisjoint(names_of(b.operator))
    of_a, of_b = names_of(a.operator, a.network), names_of(b.operator, b.network)
    return not of_a or not of_b or not of_a.isdisjoint(of_b)


def _with_parts(whole: Station, parts: Sequence[Station], points: set[str]) -> Station:
    """A station united with its parts; points: the ids of those that are charge points."""
    every = (whole, *parts)
    named = (whole, *(part for part in parts if part.id not in points))  # a charge point's name is a number
    known = [part.operational for part in parts if part.operational is not None]
    capacities = [part.capacity or (1 if part.id in points else None) for part in parts]
    counted = None if None in capacities else sum(capacity or 0 for capacity in capacities)
    return replace(
        whole,
        sockets=best_sockets([whole.sockets, added_up(parts)]),
        name=next((part.name for part in named if part.name), ""),
        operator=next((part.operator for part in every if part.operator), ""),
        network=next((part.network for part in every if part.network), ""),
        capacity=whole.capacity if whole.capacity is not None else counted,
        access=next((part.access for part in every if part.access is not Access.UNKNOWN), Access.UNKNOWN),
        fee=next((part.fee for part in every if part.fee is not None), None),
        price=next((part.price for part in every if part.price is not None), None),
        opening_hours=next((part.opening_hours for part in every if part.opening_hours is not None), None),
        operational=whole.operational if whole.operational is not None or not known else any(known),
        merged=tuple(sorted({other for part in parts for other in (part.id, *part.merged)})),
    )
