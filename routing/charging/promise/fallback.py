"""Where to charge instead should a stop fail."""

from __future__ import annotations

import math
from itertools import islice
from typing import TYPE_CHECKING, Final

import numpy as np

from routing.charging.plan import Fallback
from routing.graph.earth import great_circle_m

if TYPE_CHECKING:
    from collections.abc import Collection

    from routing.charging.legs import Place
    from routing.charging.task import Task
    from routing.graph.road_graph import RoadGraph

NEAR: Final = 16  # stations about a stop that are looked at
FAR: Final = 128  # of which are those that open soonest
CROW_MPS: Final = 15.0  # at which a station comes nearer as the crow flies, to tell which are closed; assumed


class FallbackFinder:
    """Fallbacks of one query's stops, among the stations that it may use.

    Ways are those that plans are made of, and are kept with them. A vehicle that waits takes as much as when standing.
    """

    def __init__(self, graph: RoadGraph, task: Task) -> None:
        self._graph, self._task, self._finder, self._sites = graph, task, task.finder, task.usable
        physics = self._finder.space.physics
        self._standing_w = physics.aux_idle_w + physics.cabin_w
        nodes = graph.head[np.array([site.station.position[0].link_idx for site in self._sites], np.int64)]
        self._lat_deg, self._lon_deg = graph.node_lat_deg[nodes], graph.node_lon_deg[nodes]

    def fallback(
        self, here: Place, planned: Collection[str], depart_s: float, soc_frac: float, more_frac: float
    ) -> Fallback | None:
        """The next best station from a stop at which a vehicle arrives with a charge and can't charge.

        planned: ids of stations that are out of the question. depart_s: when the vehicle goes on, since the journey
        began. more_frac: how much more than the mean it dissipates. It is the station at which it may charge soonest,
        after driving and waiting, among those at which the battery is not empty before, else among all; None where
        there is none.
        """
        near = self._near(here, planned, depart_s)
        if not near:
            return None
        capacity_j, weight_n = self._task.capacity_j, self._finder.space.physics.weight_n
        pairs = self._finder.pairs(here, [self._sites[k].station.position for k in near])
        best: Fallback | None = None
        for k, pair in zip(near, pairs, strict=True):
            station = self._sites[k].station
            lifted_j = weight_n * self._finder.climb_m(here, station.position)
            for way in pair.ways:
                charge_j = soc_frac * capacity_j - more_frac * max(way.energy_j - lifted_j, 0.0)
                left_j = min(charge_j - way.energy_j, capacity_j - way.spill_j)
                wait_s = self._waiting_s(k, depart_s + way.time_s)
                if not math.isfinite(wait_s):
                    continue
                found = Fallback(
                    station,
                    way.time_s,
                    arrive_soc_frac=left_j / capacity_j,
                    reached=charge_j - way.need_j >= 0.0,
                    wait_s=wait_s,
                    open_soc_frac=(left_j - self._standing_w * wait_s) / capacity_j,
                )
                if best is None or _rank(found) < _rank(best):
                    best = found
        return best

    def _near(self, here: Place, planned: Collection[str], depart_s: float) -> list[int]:
        """Stations at which a vehicle may charge soonest, as the crow flies and with waiting."""
        node = int(self._graph.head[here[0].link_idx])
        lat_deg, lon_deg = float(self._graph.node_lat_deg[node]), float(self._graph.node_lon_deg[node])
        soon_s = great_circle_m(lat_deg, lon_deg, self._lat_deg, self._lon_deg) / CROW_MPS
        order = np.argsort(soon_s, kind="stable").tolist()
        near = islice((k for k in order if self._sites[k].station.id not in planned), FAR)
        if not self._task.is_clocked:
            return list(islice(near, NEAR))
        ready_s = {k: float(soon_s[k]) + self._waiting_s(k, depart_s + float(soon_s[k])) for k in near}
        return sorted(ready_s, key=ready_s.__getitem__)[:NEAR]

    def _waiting_s(self, site: int, arrive_s: float) -> float:
        return self._task.waiting_of_s(self._sites[site], arrive_s)


def _rank(fallback: Fallback) -> tuple[bool, bool, float]:
    return not fallback.reached, fallback.open_soc_frac < 0.0, fallback.drive_s + fallback.wait_s
