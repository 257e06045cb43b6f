"""Where to charge instead should a stop fail."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from routing.charging.plan import Fallback
from routing.graph.earth import great_circle_m

if TYPE_CHECKING:
    from collections.abc import Collection, Sequence

    from routing.charging.legs import LegFinder, Place
    from routing.charging.sites import Site
    from routing.graph.road_graph import RoadGraph

NEAR: Final = 16  # stations about a stop that are looked at


class FallbackFinder:
    """Fallbacks of one query's stops.

    sites: that the query may use. capacity_j: of the battery [J]. Ways are those that plans are made of, and
    are kept with them.
    """

    def __init__(
        self,
        graph: RoadGraph,
        finder: LegFinder,
        sites: Sequence[Site],
        capacity_j: float,
    ) -> None:
        self._graph, self._finder, self._sites = graph, finder, sites
        self._capacity_j = capacity_j
        nodes = graph.head[np.array([site.station.position[0].link_idx for site in sites], np.int64)]
        self._lat_deg, self._lon_deg = graph.node_lat_deg[nodes], graph.node_lon_deg[nodes]

    def fallback(self, here: Place, planned: Collection[str], arrive_frac: float, more_frac: float) -> Fallback | None:
        """The next best station from a stop at which a vehicle arrives with a charge and can't charge.

        planned: ids of stations that are out of the question. more_frac: how much more than the mean the vehicle
        dissipates. It is the station of least driving time among those that are reached before the battery is
        empty, else the nearest by time; None where there is none.
        """
        near = self._near(here, planned)
        if not near:
            return None
        weight_n = self._finder.space.physics.weight_n
        pairs = self._finder.pairs(here, [self._sites[k].station.position for k in near])
        best: Fallback | None = None
        for k, pair in zip(near, pairs, strict=True):
            station = self._sites[k].station
            lifted_j = weight_n * self._finder.climb_m(here, station.position)
            for way in pair.ways:
                charge_j = arrive_frac * self._capacity_j - more_frac * max(way.energy_j - lifted_j, 0.0)
                reached = charge_j - way.need_j >= 0.0
                if best is None or (not reached, way.time_s) < (not best.reached, best.drive_s):
                    left_j = min(charge_j - way.energy_j, self._capacity_j - way.spill_j)
                    best = Fallback(station, way.time_s, left_j / self._capacity_j, reached)
        return best

    def _near(self, here: Place, planned: Collection[str]) -> list[int]:
        node = int(self._graph.head[here[0].link_idx])
        lat_deg, lon_deg = float(self._graph.node_lat_deg[node]), float(self._graph.node_lon_deg[node])
        order = np.argsort(great_circle_m(lat_deg, lon_deg, self._lat_deg, self._lon_deg), kind="stable")
        return [k for k in order.tolist() if self._sites[k].station.id not in planned][:NEAR]
