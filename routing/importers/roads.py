"""Roads as a map file tells them, before they are given heights and cut into links."""

from __future__ import annotations

from dataclasses import dataclass, field, fields, replace
from typing import TYPE_CHECKING, Final

import numpy as np

from routing.graph.earth import E7

if TYPE_CHECKING:
    from collections.abc import Mapping

    from numpy.typing import NDArray
    from shapely import Polygon

    from routing.graph.cut_roads import Extent
    from routing.graph.road_graph import LeftOutFerry
    from routing.graph.signs import RoadSign
    from routing.importers.conditional import ConditionalLimit
    from routing.importers.tags import Control

HALF_TURN_E7: Final = 1_800_000_000
_WGS84_A_M: Final = 6_378_137.0
_WGS84_E2: Final = 6.694_379_990_14e-3


@dataclass(frozen=True, slots=True)
class Restriction:
    """A turn restriction between ways over one node; several from or to ways as in no_entry and no_exit."""

    from_way_ids: tuple[int, ...]
    via_point_id: int
    to_way_ids: tuple[int, ...]
    only: bool


@dataclass(frozen=True, slots=True)
class WayBan:
    """A ban of driving from ways over other ways to ways, such as of turning back over a link of two carriageways.

    only: instead, that whoever drives from the first ways onto the ways between must go on to the last ones.
    """

    from_way_ids: tuple[int, ...]
    via_way_ids: tuple[int, ...]
    to_way_ids: tuple[int, ...]
    only: bool = False


@dataclass(frozen=True, slots=True)
class Ways:
    """One row a way; way_first: int64 (W+1,), point: int32 positions into the points of Roads.

    forward, backward: bool, may be driven along and against the order of its points.
    forward_mps, backward_mps: tagged limit [m/s], NaN where none is.
    urban: int8, 1 and 0 as tagged, -1 where nothing is.
    stretch: float64, driven length over that of the drawn line; None unless the map states lengths of its own.
    ferry_mps: float64, speed of ferries, NaN of roads; None where all are roads.
    sign_forward, sign_backward: int32, into the signs of Roads; None where the map has none.
    """

    way_first: NDArray[np.int64]
    point: NDArray[np.int32]
    id: NDArray[np.int64]
    functional_class: NDArray[np.int8]
    ramp: NDArray[np.bool_]
    living_street: NDArray[np.bool_]
    roundabout: NDArray[np.bool_]
    structure: NDArray[np.bool_]
    forward: NDArray[np.bool_]
    backward: NDArray[np.bool_]
    forward_mps: NDArray[np.float64]
    backward_mps: NDArray[np.float64]
    urban: NDArray[np.int8]
    name_idx: NDArray[np.int32]
    stretch: NDArray[np.float64] | None = None
    ferry_mps: NDArray[np.float64] | None = None
    sign_forward: NDArray[np.int32] | None = None
    sign_backward: NDArray[np.int32] | None = None

    @property
    def ferry(self) -> NDArray[np.bool_] | None:
        """Whether a way is a ferry, bool (W,); None where all are roads."""
        return None if self.ferry_mps is None else ~np.isnan(self.ferry_mps)


@dataclass(frozen=True, slots=True)
class Roads:
    """Drivable ways over shared points.

    point_id: int64 (P,); lon_e7, lat_e7: int32 (P,) [1e-7 deg]; height_m: float64 (P,) [m] where the map has its own
    heights (NaN between known ones), else None. controls: by position of the point. built_up: landuse areas.
    country: the code whose speed rules hold, or None. dropped: what was left out, by reason.
    conditional: limits under a condition along and against a way, by the way's row. extent: where the file says that it
    ends, None where files of its kind don't. ferries_left_out: the longest ones. signs: what is read along ways. exits:
    numbers of exits by position of the point. drives_left: whether traffic keeps to the left. mini: mini roundabouts,
    by position of the point. left_out_exits: how many ways leave a point of a ring that are left out, by its position.
    """

    point_id: NDArray[np.int64]
    lon_e7: NDArray[np.int32]
    lat_e7: NDArray[np.int32]
    ways: Ways
    names: tuple[str, ...]
    controls: Mapping[int, Control]
    restrictions: tuple[Restriction, ...]
    built_up: tuple[Polygon, ...]
    country: str | None
    source: str
    licence: str
    attribution: str
    dropped: Mapping[str, int] = field(default_factory=dict)
    height_m: NDArray[np.float64] | None = None
    conditional: Mapping[int, tuple[tuple[ConditionalLimit, ...], tuple[ConditionalLimit, ...]]] = field(
        default_factory=dict
    )
    way_bans: tuple[WayBan, ...] = ()
    extent: Extent | None = None
    ferries_left_out: tuple[LeftOutFerry, ...] = ()
    signs: tuple[RoadSign, ...] = ()
    exits: Mapping[int, str] = field(default_factory=dict)
    drives_left: bool = False
    mini: frozenset[int] = frozenset()
    left_out_exits: Mapping[int, int] = field(default_factory=dict)


def eastward_e7(lon_a_e7: NDArray[np.int32], lon_b_e7: NDArray[np.int32]) -> NDArray[np.int64]:
    """Difference of longitude from a to b the short way round, int64 (k,) [1e-7 deg], east positive."""
    east = lon_b_e7.astype(np.int64) - lon_a_e7
    return np.where(np.abs(east) > HALF_TURN_E7, east - np.sign(east) * 2 * HALF_TURN_E7, east)


def cut_at_antimeridian(roads: Roads) -> Roads:
    """The roads with every way that crosses ±180° cut there at a point put in, so that no line runs round the world.

    The point has longitude 180°; ways stay as they are where none crosses. O(points).
    """
    ways = roads.ways
    a, b = ways.point[:-1], ways.point[1:]
    span = np.abs(roads.lon_e7[b].astype(np.int64) - roads.lon_e7[a])
    span[ways.way_first[1:-1] - 1] = 0
    at = np.flatnonzero(span > HALF_TURN_E7)
    if at.size == 0:
        return roads
    a, b = a[at], b[at]
    to_a, to_b = (HALF_TURN_E7 - np.abs(roads.lon_e7[p].astype(np.int64)) for p in (a, b))
    along = to_a / np.maximum(to_a + to_b, 1)
    lat = np.rint(roads.lat_e7[a] + along * (roads.lat_e7[b].astype(np.int64) - roads.lat_e7[a])).astype(np.int32)
    added = np.arange(at.size)
    lowest_id = min(0, int(roads.point_id.min(initial=0)))
    rows = np.repeat(np.arange(ways.id.size), 1 + np.bincount(_way_of(ways, at), minlength=ways.id.size))
    columns = {
        f.name: getattr(ways, f.name)[rows]
        for f in fields(Ways)
        if f.name not in ("way_first", "point") and getattr(ways, f.name) is not None
    }
    first = np.concatenate((ways.way_first + 2 * np.searchsorted(at, ways.way_first), at + 2 + 2 * added))
    point = np.insert(ways.point, np.repeat(at + 1, 2), np.repeat(roads.point_id.size + added, 2)).astype(np.int32)
    height_m = None
    if roads.height_m is not None:
        height_m = np.concatenate((roads.height_m, _heights_along(roads, at, along)))
    return replace(
        roads,
        point_id=np.concatenate((roads.point_id, lowest_id - 1 - added)),
        lon_e7=np.concatenate((roads.lon_e7, np.full(at.size, HALF_TURN_E7, np.int32))),
        lat_e7=np.concatenate((roads.lat_e7, lat)),
        height_m=height_m,
        ways=replace(ways, way_first=np.sort(first), point=point, **columns),
    )


def _way_of(ways: Ways, position: NDArray[np.int64]) -> NDArray[np.int64]:
    way: NDArray[np.int64] = np.searchsorted(ways.way_first, position, side="right") - 1
    return way


def _heights_along(roads: Roads, at: NDArray[np.int64], along: NDArray[np.float64]) -> NDArray[np.float64]:
    """Heights of places within steps of ways, straight between the ends of their ways, float64 (k,) [m]."""
    assert roads.height_m is not None
    ways = roads.ways
    found = []
    for position, part, way in zip(at.tolist(), along.tolist(), _way_of(ways, at).tolist(), strict=True):
        begin = int(ways.way_first[way])
        point = ways.point[begin : int(ways.way_first[way + 1])]
        lon, lat = roads.lon_e7[point], roads.lat_e7[point]
        step_m = short_distance_m(lon[:-1], lat[:-1], lon[1:], lat[1:])
        done_m = step_m[: position - begin].sum() + part * step_m[position - begin]
        share = done_m / max(float(step_m.sum()), 1e-9)
        found.append((1.0 - share) * roads.height_m[point[0]] + share * roads.height_m[point[-1]])
    return np.array(found, np.float64)


def short_distance_m(
    lon_a_e7: NDArray[np.int32], lat_a_e7: NDArray[np.int32], lon_b_e7: NDArray[np.int32], lat_b_e7: NDArray[np.int32]
) -> NDArray[np.float64]:
    """Distance between near points on the WGS 84 ellipsoid [m], float64 (k,).

    Plane triangle with the radii of curvature at the mean latitude (Gauss mid-latitude formula, first term); within
    1e-7 of the geodesic up to 5 km between 70° S and 70° N. Over the antimeridian it is the short way.
    """
    lat_a, lat_b = np.radians(lat_a_e7 / E7), np.radians(lat_b_e7 / E7)
    mean = (lat_a + lat_b) / 2.0
    w2 = 1.0 - _WGS84_E2 * np.sin(mean) ** 2
    prime_vertical_m = _WGS84_A_M / np.sqrt(w2)
    meridian_m = prime_vertical_m * (1.0 - _WGS84_E2) / w2
    east = np.radians(eastward_e7(lon_a_e7, lon_b_e7) / E7) * np.cos(mean) * prime_vertical_m
    north = (lat_b - lat_a) * meridian_m
    distance: NDArray[np.float64] = np.hypot(east, north)
    return distance
