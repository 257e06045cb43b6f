"""Roads as a map file tells them, before they are given heights and cut into links."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Final

import numpy as np

from routing.graph.earth import E7

if TYPE_CHECKING:
    from collections.abc import Mapping

    from numpy.typing import NDArray
    from shapely import Polygon

    from routing.importers.conditional import ConditionalLimit
    from routing.importers.tags import Control

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
class Ways:
    """One row a way; way_first: int64 (W+1,), point: int32 positions into the points of Roads.

    forward, backward: bool, may be driven along and against the order of its points.
    forward_mps, backward_mps: tagged limit [m/s], NaN where none is.
    urban: int8, 1 and 0 as tagged, -1 where nothing is.
    stretch: float64, driven length over that of the drawn line; None unless the map states lengths of its own.
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


@dataclass(frozen=True, slots=True)
class Roads:
    """Drivable ways over shared points.

    point_id: int64 (P,); lon_e7, lat_e7: int32 (P,) [1e-7 deg]; height_m: float64 (P,) [m] where the map has its own
    heights (NaN between known ones), else None. controls: by position of the point. built_up: landuse areas.
    country: the code whose speed rules hold, or None. dropped: what was left out, by reason.
    conditional: limits under a condition along and against a way, by the way's row.
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


def short_distance_m(
    lon_a_e7: NDArray[np.int32], lat_a_e7: NDArray[np.int32], lon_b_e7: NDArray[np.int32], lat_b_e7: NDArray[np.int32]
) -> NDArray[np.float64]:
    """Distance between near points on the WGS 84 ellipsoid [m], float64 (k,).

    Plane triangle with the radii of curvature at the mean latitude (Gauss mid-latitude formula, first term); within
    1e-7 of the geodesic up to 5 km between 70° S and 70° N.
    """
    lat_a, lat_b = np.radians(lat_a_e7 / E7), np.radians(lat_b_e7 / E7)
    mean = (lat_a + lat_b) / 2.0
    w2 = 1.0 - _WGS84_E2 * np.sin(mean) ** 2
    prime_vertical_m = _WGS84_A_M / np.sqrt(w2)
    meridian_m = prime_vertical_m * (1.0 - _WGS84_E2) / w2
    east = np.radians((lon_b_e7.astype(np.float64) - lon_a_e7) / E7) * np.cos(mean) * prime_vertical_m
    north = (lat_b - lat_a) * meridian_m
    distance: NDArray[np.float64] = np.hypot(east, north)
    return distance
