"""The source's five routes rebuilt as chains of links from what it prints of them, with a seed for the rest.

Distance, number of stops and standstill time are those of table IV (simulated runs). Everything else is chosen
beforehand, from the map and from traffic law, and none of it was changed after seeing an energy, a time or a speed:

- Links: 124.7 m on average, for one route of 113 km has 906 (section II.B); gamma-distributed lengths of shape 2, at
  least 15 m, scaled to the distance.
- Limits: motorway 130 km/h (two of the five runs keep to 90, section III) with 3 km of other roads at each end, of
  which 1 km in town; country roads 90 km/h and 50 in villages; mountain roads 90, 70 in bends and 50 in villages; town
  50 km/h. The lengths of these stretches are drawn from the ranges of `_STRETCHES_M`.
- Heights: every route ends as high as it starts. Country road 1 rises by 505 m and comes back (section VI); the
  mountain route goes from 250 to 1000 m and back, from the plain to a pass above Deštné; the others lie in the plain.
  Undulation: grades with a standard deviation of `_UNDULATION` and a correlation length of 300 m, tied to the profile's
  corners. Grades are differences of node heights, so they telescope.
- Stops: the route outside motorways (equation 28) is cut into as many equal stretches as there are stops; each has one
  certain stop, at the end of a link drawn from it. All stops of a route last equally long.
- Both country roads get table IV's averages over the two, as their own values are not published.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from energy.chain.chain import Chain
from energy.stops import Cross
from energy.units import KMH_PER_MPS
from reproduction.published import COUNTRY_ROUTE_KM, COUNTRY_ROUTE_LINKS, TABLE_IV, TRIP_COUNT, TYPE_OF, SourceRoute

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

MEAN_LINK_M: Final = 1000.0 * COUNTRY_ROUTE_KM / COUNTRY_ROUTE_LINKS
SHORTEST_LINK_M: Final = 15.0
CORRELATION_M: Final = 300.0
MOTORWAY_KMH: Final = 130.0
SLOW_RUNS_KMH: Final = 90.0
SLOW_RUNS: Final = 2

# Stretches of one limit that follow each other: limit [km/h], shortest and longest length [m]
_STRETCHES_M: Final = {
    SourceRoute.MOUNTAIN: ((90.0, 1500.0, 3500.0), (70.0, 1000.0, 2500.0), (50.0, 700.0, 1500.0)),
    SourceRoute.COUNTRY_1: ((90.0, 2000.0, 4500.0), (50.0, 700.0, 1500.0)),
    SourceRoute.COUNTRY_2: ((90.0, 2000.0, 4500.0), (50.0, 700.0, 1500.0)),
    SourceRoute.URBAN: ((50.0, 1000.0, 1000.0),),
}
_HIGHWAY_ENDS_M: Final = ((50.0, 1000.0), (90.0, 2000.0))  # from either end inwards
# Corners of the profile: share of the distance, height [m]
_PROFILE: Final = {
    SourceRoute.HIGHWAY: ((0.0, 230.0), (1.0, 230.0)),
    SourceRoute.MOUNTAIN: ((0.0, 250.0), (0.25, 320.0), (0.5, 1000.0), (0.75, 320.0), (1.0, 250.0)),
    SourceRoute.COUNTRY_1: ((0.0, 230.0), (0.5, 735.0), (1.0, 230.0)),
    SourceRoute.COUNTRY_2: ((0.0, 230.0), (1.0, 230.0)),
    SourceRoute.URBAN: ((0.0, 220.0), (1.0, 220.0)),
}
_UNDULATION: Final = {
    SourceRoute.HIGHWAY: 0.008,
    SourceRoute.MOUNTAIN: 0.015,
    SourceRoute.COUNTRY_1: 0.012,
    SourceRoute.COUNTRY_2: 0.012,
    SourceRoute.URBAN: 0.005,
}


@dataclass(frozen=True, slots=True)
class SourceRun:
    """Like runs of one route: how many of its trips they stand for, and the speed that they keep to, if any."""

    route: SourceRoute
    trip_count: int
    speed_cap_kmh: float | None = None


# The source's 23 trips; runs of one route differ in nothing else that is published.
SOURCE_RUNS: Final = (
    SourceRun(SourceRoute.HIGHWAY, SLOW_RUNS, SLOW_RUNS_KMH),
    SourceRun(SourceRoute.HIGHWAY, TRIP_COUNT[SourceRoute.HIGHWAY] - SLOW_RUNS),
    *(SourceRun(route, TRIP_COUNT[route]) for route in SourceRoute if route is not SourceRoute.HIGHWAY),
)


def source_route(
    route: SourceRoute, seed: int, *, speed_cap_kmh: float | None = None, stop_share_frac: float = 1.0
) -> Chain:
    """A chain with the published distance, stops and standstill of a route; the same for the same seed.

    speed_cap_kmh: no limit is above it, as in the runs that kept to 90 km/h. stop_share_frac: share of the published
    stops that is kept, chosen evenly along the route, each as long as before.
    """
    if not 0.0 <= stop_share_frac <= 1.0:
        raise ValueError(f"stop_share_frac is {stop_share_frac}, allowed: 0..1")
    published = TABLE_IV[TYPE_OF[route]]
    rng = np.random.default_rng([seed, tuple(SourceRoute).index(route)])
    lengths = _link_lengths(1000.0 * published.distance_km, rng)
    nodes = np.concatenate(([0.0], np.cumsum(lengths)))
    middles = 0.5 * (nodes[1:] + nodes[:-1])
    limits = _highway_limits(middles, nodes[-1]) if route is SourceRoute.HIGHWAY else _limits(route, middles, rng)
    grades = np.diff(_heights(route, nodes, rng)) / lengths
    stops = _stop_links(nodes, limits < MOTORWAY_KMH, round(published.stops), rng)
    kept = stops[_evenly(stops.size, round(stop_share_frac * stops.size))]
    probability = np.zeros(lengths.size)
    probability[kept] = 1.0
    time_s = np.zeros(lengths.size)
    time_s[kept] = published.standstill_s / published.stops
    if speed_cap_kmh is not None:
        limits = np.minimum(limits, speed_cap_kmh)
    stop_class = np.where(probability > 0.0, 4 * (limits <= 50.0) + int(Cross.LARGE), int(Cross.NONE))
    return Chain(
        length_m=lengths,
        grade_frac=grades,
        speed_limit_mps=limits / KMH_PER_MPS,
        stop_probability_frac=probability,
        stop_time_s=time_s,
        stop_class=stop_class.astype(np.int8),
    )


def _link_lengths(distance_m: float, rng: np.random.Generator) -> NDArray[np.float64]:
    count = round(distance_m / MEAN_LINK_M)
    free = rng.gamma(2.0, 1.0, count)
    lengths: NDArray[np.float64] = SHORTEST_LINK_M + free * ((distance_m - count * SHORTEST_LINK_M) / free.sum())
    return lengths


def _limits(route: SourceRoute, middles_m: NDArray[np.float64], rng: np.random.Generator) -> NDArray[np.float64]:
    """Limit of each link [km/h], that of the stretch around its middle."""
    pattern = _STRETCHES_M[route]
    ends: list[float] = []
    limits: list[float] = []
    while not ends or ends[-1] <= middles_m[-1]:
        limit, shortest, longest = pattern[len(ends) % len(pattern)]
        ends.append((ends[-1] if ends else 0.0) + float(rng.uniform(shortest, longest)))
        limits.append(limit)
    return np.array(limits)[np.searchsorted(ends, middles_m, side="right")]


def _highway_limits(middles_m: NDArray[np.float64], distance_m: float) -> NDArray[np.float64]:
    to_end_m = np.minimum(middles_m, distance_m - middles_m)
    limits = np.full(middles_m.size, MOTORWAY_KMH)
    inner_m = sum(length for _, length in _HIGHWAY_ENDS_M)
    for limit, length in reversed(_HIGHWAY_ENDS_M):
        limits[to_end_m < inner_m] = limit
        inner_m -= length
    return limits


def _heights(route: SourceRoute, nodes_m: NDArray[np.float64], rng: np.random.Generator) -> NDArray[np.float64]:
    """Heights of the nodes [m]: the profile, and an undulation that is zero at the profile's corners."""
    lengths = np.diff(nodes_m)
    noise = rng.standard_normal(lengths.size)
    grades = np.empty(lengths.size)
    grade = 0.0
    for k, length in enumerate(lengths.tolist()):
        kept = float(np.exp(-length / CORRELATION_M)) if k else 0.0
        grade = kept * grade + float(np.sqrt(1.0 - kept * kept)) * float(noise[k])
        grades[k] = _UNDULATION[route] * grade
    free = np.concatenate(([0.0], np.cumsum(grades * lengths)))
    corners_m = np.array([share * nodes_m[-1] for share, _ in _PROFILE[route]])
    tie = np.interp(nodes_m, corners_m, np.interp(corners_m, nodes_m, free))
    profile = np.interp(nodes_m, corners_m, [height for _, height in _PROFILE[route]])
    heights: NDArray[np.float64] = profile + free - tie
    return heights


def _stop_links(
    nodes_m: NDArray[np.float64], stoppable: NDArray[np.bool_], count: int, rng: np.random.Generator
) -> NDArray[np.intp]:
    """One link in each of `count` equal stretches of the stoppable road, never the last link, where a trip ends."""
    position_m = np.cumsum(np.diff(nodes_m) * stoppable)
    candidates = np.flatnonzero(stoppable[:-1])
    stretch = np.minimum((count * position_m[candidates] / position_m[-1]).astype(int), count - 1)
    return np.array([rng.choice(candidates[stretch == k]) for k in range(count)], dtype=np.intp)


def _evenly(count: int, kept: int) -> Sequence[int]:
    """`kept` of `count` positions, evenly apart."""
    return [int((2 * k + 1) * count / (2 * kept)) for k in range(kept)]
