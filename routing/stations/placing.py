"""Where stations meet the roads."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Final

import numpy as np

from energy.stops import FunctionalClass
from routing.graph.earth import METRE_PER_DEGREE
from routing.graph.kernels_nearest import Lines
from routing.graph.nearest import RoadTree
from routing.graph.snap import END_MARGIN_M, beside
from routing.places import LinkPosition
from routing.stations.kernels_stopping import stopping_links

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from numpy.typing import NDArray

    from routing.graph.road_graph import RoadGraph
    from routing.places import Point
    from routing.stations.station import Station

STATION_LIMIT_M: Final = 250.0  # from a road, beyond which a station is not reached by it; assumed
# What a road is farther away than it is, for a station that stands between several: who charges turns off a main road,
# and a motorway is behind a fence. Assumed.
EXTRA_M: Final[Mapping[FunctionalClass, float]] = {
    FunctionalClass.MOTORWAY: math.inf,
    FunctionalClass.TRUNK: 40.0,  # and the ramps and rest areas of motorways
    FunctionalClass.PRIMARY: 15.0,
    FunctionalClass.SECONDARY: 8.0,
    FunctionalClass.TERTIARY: 4.0,
    FunctionalClass.UNCLASSIFIED: 0.0,
    FunctionalClass.RESIDENTIAL: 0.0,
    FunctionalClass.SERVICE: 0.0,
}
STRUCTURE_M: Final = 60.0  # likewise, of bridges and tunnels; assumed


@dataclass(frozen=True, slots=True)
class FarStation:
    """A station that no road is near enough to; distance_m: of the nearest one where a vehicle may stop [m]."""

    id: str
    name: str
    at: Point
    distance_m: float


@dataclass(frozen=True, slots=True)
class Placed:
    """Stations on the roads of a graph, those left out in its bounds, the nearest first, and the number beyond."""

    stations: tuple[Station, ...]
    far: tuple[FarStation, ...]
    outside: int

    @property
    def left_out(self) -> dict[str, int]:
        """How many are left out, by reason."""
        counts = {"outside the map": self.outside, f"over {STATION_LIMIT_M:g} m from a road": len(self.far)}
        return {reason: count for reason, count in counts.items() if count}


def place_stations(graph: RoadGraph, stations: Sequence[Station], limit_m: float = STATION_LIMIT_M) -> Placed:
    """Stations with their positions on the roads of a graph, in their order, on each direction that may be driven.

    A station is reached from the road with the least sum of distance and EXTRA_M, of those within limit_m: never from a
    motorway itself nor a ferry. All links of a graph reach each other, so that a station beside an island's roads or
    those of a part that is cut off is far from a road. O(n log R + R log R) for n stations beside R roads.
    """
    west, south, east, north = bbox = graph.meta.bbox
    here = [beside(station.at, bbox) for station in stations]
    lon_deg = np.array([point.lon_deg for point in here], np.float64)
    lat_deg = np.array([point.lat_deg for point in here], np.float64)
    spare_lat = limit_m / METRE_PER_DEGREE
    spare_lon = spare_lat / max(math.cos(math.radians(max(abs(south), abs(north)))), 1e-3)
    inside = (lon_deg >= west - spare_lon) & (lon_deg <= east + spare_lon)
    inside &= (lat_deg >= south - spare_lat) & (lat_deg <= north + spare_lat)
    asked = np.flatnonzero(inside)
    if asked.size == 0:
        return Placed((), (), len(stations))
    tree = RoadTree(graph)
    link, away_m, share = _nearest(graph, tree, lon_deg[asked], lat_deg[asked], limit_m)
    lost = np.flatnonzero(link < 0)
    _, far_m, _ = _nearest(graph, tree, lon_deg[asked[lost]], lat_deg[asked[lost]], math.inf)
    copies = _copies(graph)
    placed = [
        replace(
            stations[station],
            position=_positions(graph, copies, int(link[k]), float(share[k])),
            snap_m=round(float(away_m[k]), 2),
        )
        for k, station in enumerate(asked.tolist())
        if link[k] >= 0
    ]
    far = [
        FarStation(stations[k].id, stations[k].name or stations[k].operator, stations[k].at, float(distance_m))
        for k, distance_m in zip(asked[lost].tolist(), far_m.tolist(), strict=True)
    ]
    far.sort(key=lambda station: (station.distance_m, station.id))
    return Placed(tuple(placed), tuple(far), len(stations) - asked.size)


def _nearest(
    graph: RoadGraph, tree: RoadTree, lon_deg: NDArray[np.float64], lat_deg: NDArray[np.float64], limit_m: float
) -> tuple[NDArray[np.int32], NDArray[np.float64], NDArray[np.float64]]:
    count = lon_deg.size
    link, away_m, share = np.empty(count, np.int32), np.empty(count), np.empty(count)
    lines = Lines(graph.geometry_first, graph.geometry_lon_e7, graph.geometry_lat_e7)
    extra_m = _extra_m(graph)
    stopping_links(tree.boxes, lines, extra_m, lon_deg, lat_deg, limit_m, METRE_PER_DEGREE, link, away_m, share)
    return link, away_m, share


def _extra_m(graph: RoadGraph) -> NDArray[np.float64]:
    """How much farther away each link counts, float64 (M,) [m]."""
    by_class = np.array([EXTRA_M[kind] for kind in FunctionalClass])
    return np.asarray(by_class[graph.functional_class] + STRUCTURE_M * graph.structure, np.float64)


def _copies(graph: RoadGraph) -> dict[int, list[int]]:
    """Copies of each link that has some."""
    found: dict[int, list[int]] = {}
    if graph.copies is not None:
        for k, original in enumerate(graph.copies.of.tolist()):
            found.setdefault(original, []).append(graph.road_link_count + k)
    return found


def _positions(graph: RoadGraph, copies: Mapping[int, list[int]], link: int, share: float) -> tuple[LinkPosition, ...]:
    """A place on a link and on its other direction, within the ends of both, and on their copies."""
    length_m = float(graph.length_m[link])
    margin = min(END_MARGIN_M, 0.25 * length_m)
    offset_m = min(max(share * length_m, margin), length_m - margin)
    found = [LinkPosition(link, offset_m)]
    reverse = int(graph.reverse_idx[link])
    if reverse >= 0:
        found.append(LinkPosition(reverse, length_m - offset_m))
    for place in tuple(found):
        found += [LinkPosition(copy, place.offset_m) for copy in copies.get(place.link_idx, ())]
    return tuple(found)
