"""Very many stations that queries may use, as arrays, and which of them others at the same place stand in for."""

from __future__ import annotations

import math
import threading
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from routing.charging.choice.sources import Spots
from routing.charging.sites import charging_costs, usable_sites

if TYPE_CHECKING:
    from collections.abc import Hashable, Sequence

    from numpy.typing import NDArray

    from energy.charging.charging import Charging
    from routing.charging.plan import ChargingQuery
    from routing.charging.sites import Site
    from routing.stations.station import Station

CROWDS_KEPT: Final = 3  # of vehicles and what is asked of stations
SAME_POWER_FRAC: Final = 1e-12


@dataclass(frozen=True, slots=True, eq=False)
class Crowd:
    """Many stations. kinds: stations that differ in what charging costs; kind: int64 (n,), which of them each is.

    spots: where they are. link: int64 (n,), the first of each one's. kept: bool (n,), false where another one at the
    same place is as good in everything.
    """

    sites: Sequence[Site]
    spots: Spots
    kinds: Sequence[Site]
    kind: NDArray[np.int64]
    link: NDArray[np.int64]
    kept: NDArray[np.bool_]

    @classmethod
    def of(cls, sites: Sequence[Site]) -> Crowd:
        """Of stations; O(n) but for those at one place."""
        spots = Spots.at([site.station.position for site in sites])
        known: dict[Hashable, int] = {}
        kinds: list[Site] = []
        kind = np.empty(len(sites), np.int64)
        for k, site in enumerate(sites):
            key = (id(site.curve), site.a_second, site.a_joule, site.stop_cost)
            if key not in known:
                known[key] = len(kinds)
                kinds.append(site)
            kind[k] = known[key]
        first = np.searchsorted(spots.of, np.arange(len(sites)))
        return cls(sites, spots, kinds, kind, spots.link[first], _kept(sites))

    def slow_costs(self, capacity_j: float) -> NDArray[np.float64]:
        """What charging costs more at each station than at the best; a stop rarely charges all of a battery."""
        slow = np.array([site.window_cost * capacity_j + site.stop_cost for site in self.kinds])
        found: NDArray[np.float64] = 0.5 * (slow - slow.min(initial=math.inf))[self.kind]
        return found

    def excess(self, a_joule: float, capacity_j: float, most_frac: float) -> NDArray[np.float64]:
        """By how much a stop at each station costs at least more than what it charges by a cost a joule, float64 (n,).

        Below 0 where a stop brings joules for less.
        """
        least = []
        for site in self.kinds:
            charged_j, cost = charging_costs(site, capacity_j, most_frac)
            least.append(min(site.stop_cost, float((cost - a_joule * charged_j).min())))
        return np.array(least)[self.kind]


def _kept(sites: Sequence[Site]) -> NDArray[np.bool_]:
    """Which stations no other one at the same place, with the same hours, is as good as."""
    at: dict[Hashable, list[int]] = {}
    kept = np.ones(len(sites), np.bool_)
    for k, site in enumerate(sites):
        others = at.setdefault((site.station.position, site.station.opening_hours), [])
        if any(is_as_good(sites[other], site) for other in others):
            kept[k] = False
            continue
        for other in [other for other in others if is_as_good(site, sites[other])]:
            kept[other] = False
            others.remove(other)
        others.append(k)
    return kept


def is_as_good(site: Site, other: Site) -> bool:
    """Whether charging at a station costs no more than at another one, whatever is charged."""
    costs = site.a_second <= other.a_second and site.a_joule <= other.a_joule and site.stop_cost <= other.stop_cost
    if not costs or site.curve is other.curve:
        return costs
    at = np.union1d(site.curve.soc_frac, other.curve.soc_frac)
    power_w, other_w = (np.interp(at, curve.soc_frac, curve.power_w) for curve in (site.curve, other.curve))
    return bool((power_w >= other_w * (1.0 - SAME_POWER_FRAC)).all())


class CrowdStore:
    """Stations that the latest queries may use, kept from query to query; safe between threads."""

    def __init__(self) -> None:
        self._kept: dict[Hashable, tuple[Sequence[Station], Crowd]] = {}
        self._lock = threading.Lock()

    def crowd(self, charging: Charging, query: ChargingQuery, stations: Sequence[Station]) -> Crowd:
        """Those of many stations that a query may use."""
        key = (id(stations), _vehicle_key(charging), _query_key(query))
        with self._lock:
            known = self._kept.pop(key, None)
            if known is not None:
                self._kept[key] = known
                return known[1]
        crowd = Crowd.of(usable_sites(charging, query, stations))
        with self._lock:
            self._kept[key] = stations, crowd  # which keeps the stations, and so what they are known by
            while len(self._kept) > CROWDS_KEPT:
                del self._kept[next(iter(self._kept))]
        return crowd

    def forget(self) -> None:
        """Give up all of them."""
        with self._lock:
            self._kept.clear()


def _vehicle_key(charging: Charging) -> Hashable:
    curve = None if charging.dc is None else (charging.dc.soc_frac.tobytes(), charging.dc.power_w.tobytes())
    return (
        *(charging.connectors, curve, charging.ac_power_w, charging.ac_phases, charging.ac_eff, charging.dc_eff),
        charging.ac_one_phase_w,
    )


def _query_key(query: ChargingQuery) -> Hashable:
    """What of a query decides which stations it may use and what they cost."""
    factors = tuple(sorted(query.network_factors.items()))
    costs = (query.arrive_soc_frac, query.max_soc_frac, query.overhead_s, query.objective, query.time_value_per_h)
    rules = (query.connectors, query.min_power_w, query.excluded_networks, query.stations, query.excluded_stations)
    clock = (query.departure_min is None, query.departure)
    return factors, costs, rules, clock, query.via_stations, query.most_stops == 0
