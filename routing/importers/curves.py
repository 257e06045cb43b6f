"""How fast the bends of a road let it be driven."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from routing.graph.earth import E7
from routing.importers.roads import eastward_e7, short_distance_m
from routing.importers.speeds import KMH

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from routing.importers.roads import Roads

LATERAL_MPS2: Final = 2.5  # assumed: what drivers accept in bends of country roads, well below the grip of a dry road
SLOWEST_MPS: Final = 30.0 * KMH
STEP_MPS: Final = 5.0 * KMH
SHORTEST_WAY_M: Final = 300.0  # on shorter ways one drawn corner would count for too much


def bend_speeds_mps(roads: Roads) -> NDArray[np.float64]:
    """Speed at which a way's bends take LATERAL_MPS2 on average, float64 (W,) [m/s], infinite on short ways.

    Mean curvature κ is the sum of all changes of heading over the length, v = √(a/κ). It stands in for the limit where
    none is signed: 90 km/h is legal on hairpins, and no one drives it. Rounded to STEP_MPS, as signs are.
    """
    ways = roads.ways
    a, b = ways.point[:-1], ways.point[1:]
    step_m = short_distance_m(roads.lon_e7[a], roads.lat_e7[a], roads.lon_e7[b], roads.lat_e7[b])
    east = eastward_e7(roads.lon_e7[a], roads.lon_e7[b]) / E7 * np.cos(np.radians(roads.lat_e7[a] / E7))
    heading = np.arctan2(roads.lat_e7[b] / E7 - roads.lat_e7[a] / E7, east)
    turn = np.abs((np.diff(heading) + np.pi) % (2.0 * np.pi) - np.pi)
    turn[(step_m[1:] <= 0.0) | (step_m[:-1] <= 0.0)] = 0.0
    way = np.repeat(np.arange(ways.id.size), np.diff(ways.way_first))
    whole_step, whole_turn = way[:-1] == way[1:], way[:-2] == way[2:]
    length_m = np.bincount(way[:-1][whole_step], step_m[whole_step], ways.id.size)
    total = np.bincount(way[:-2][whole_turn], turn[whole_turn], ways.id.size)
    with np.errstate(divide="ignore", invalid="ignore"):
        speed = np.maximum(np.rint(np.sqrt(LATERAL_MPS2 * length_m / total) / STEP_MPS) * STEP_MPS, SLOWEST_MPS)
    result: NDArray[np.float64] = np.where((length_m >= SHORTEST_WAY_M) & (total > 0.0), speed, np.inf)
    return result
