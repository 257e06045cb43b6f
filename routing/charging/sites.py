"""Stations that a query may use, and what charging at each of them costs."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from energy.charging.charge_time import seconds
from energy.charging.power import accepted_power, wall_eff
from energy.units import JOULE_PER_KWH, JOULE_PER_WH, SECOND_PER_HOUR, SECOND_PER_MINUTE
from routing.charging.plan import Objective
from routing.stations.opening import open_times
from routing.stations.station import Access

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from energy.charging.charging import Charging, PowerCurve
    from routing.charging.plan import ChargingQuery
    from routing.stations.station import Socket, Station

ENERGY_SECOND_J: Final = 1.0  # what a second counts as where energy is minimised, which decides between equals
VIA_STATION_FACTOR: Final = 0.01  # what charging at a chosen station counts as: below what power makes up for; assumed
W_PER_KW: Final = 1000.0
NO_PUBLIC: Final = frozenset({Access.PRIVATE})


@dataclass(frozen=True, slots=True)
class Worth:
    """What an objective counts: cost of a second, and of a joule of driving."""

    a_second: float
    a_joule: float


def worth_of(query: ChargingQuery) -> Worth:
    """Of seconds in s, of joules in J, or of both in the currency of prices."""
    if query.objective is Objective.TIME:
        return Worth(1.0, 0.0)
    if query.objective is Objective.ENERGY:
        return Worth(ENERGY_SECOND_J, 1.0)
    return Worth(query.time_value_per_h / SECOND_PER_HOUR, 0.0)


@dataclass(frozen=True, slots=True)
class Site:
    """A station as a vehicle uses it: the socket, its curve, and costs in the unit of the objective.

    a_second, a_joule: of charging. stop_cost: of stopping. wall_eff: battery from wall. window_cost: of a stop from the
    least to the most charge of a query, over the capacity.
    """

    station: Station
    socket: Socket
    curve: PowerCurve
    a_second: float
    a_joule: float
    stop_cost: float
    wall_eff: float
    window_cost: float


def hindrance(station: Station, charging: Charging, query: ChargingQuery) -> str:
    """Why a query does not use a station: the first of its rules that leaves it out; "" where none does."""
    fitting = [
        socket
        for socket in station.sockets
        if socket.output_w is not None
        and accepted_power(charging, socket.connector, socket.output_w, socket.phases) is not None
    ]
    asked = [socket for socket in fitting if not query.connectors or socket.connector in query.connectors]
    least_kw = query.min_power_w / W_PER_KW
    rules = (
        (not station.position, "it is on no road"),
        (station.operational is False, "it is out of order"),
        (station.access in NO_PUBLIC, "it is private"),
        (station.id in query.excluded_stations, "it is in excluded_stations"),
        (bool(query.stations) and station.id not in query.stations, "it is not in stations"),
        (not query.excluded_networks.isdisjoint((station.network, station.operator)), "its network is excluded"),
        (not fitting, "none of its sockets fits the vehicle or tells its power"),
        (not asked, "it has none of the connectors asked for"),
        (all((socket.output_w or 0.0) < query.min_power_w for socket in asked), f"it gives less than {least_kw:g} kW"),
        (
            query.departure_min is not None and open_times(station.opening_hours, query.departure) == (),
            "it is not open in the week of departure",
        ),
        (query.most_stops == 0, "no stops are allowed"),
    )
    return next((why for holds, why in rules if holds), "")


def usable_sites(charging: Charging, query: ChargingQuery, stations: Sequence[Station]) -> list[Site]:
    """Stations that a query may use, each with the socket that charges its vehicle fastest; none without stops."""
    if query.most_stops == 0:
        return []
    only = frozenset(query.stations)
    worth = worth_of(query)
    taken: dict[tuple[object, ...], tuple[float, PowerCurve] | None] = {}  # by kinds of sockets, of which there are few
    sites = []
    for station in stations:
        if (only and station.id not in only) or station.id in query.excluded_stations:
            continue
        if not station.position or station.operational is False or station.access in NO_PUBLIC:
            continue
        if query.departure_min is not None and open_times(station.opening_hours, query.departure) == ():
            continue
        if not query.excluded_networks.isdisjoint((station.network, station.operator)):
            continue
        best: tuple[float, Socket, PowerCurve] | None = None
        for socket in station.sockets:
            if query.connectors and socket.connector not in query.connectors:
                continue
            if socket.output_w is None or socket.output_w < query.min_power_w:
                continue
            key = (socket.connector, socket.output_w, socket.phases)
            if key not in taken:
                curve = accepted_power(charging, socket.connector, socket.output_w, socket.phases)
                taken[key] = None if curve is None else (_window_s(curve, query), curve)
            found = taken[key]
            if found is not None and (best is None or found[0] < best[0]):
                best = found[0], socket, found[1]
        if best is not None:
            sites.append(_site(station, *best, charging, query, worth.a_second))
    return sites


def _site(
    station: Station,
    window_s: float,
    socket: Socket,
    curve: PowerCurve,
    charging: Charging,
    query: ChargingQuery,
    a_second: float,
) -> Site:
    """The site of a station; window_s: of its curve, from the least to the most charge of a query [s]."""
    factors = [
        query.network_factors[name] for name in (station.network, station.operator) if name in query.network_factors
    ]
    a_second *= factors[0] if factors else 1.0
    from_wall = wall_eff(charging, socket.connector, socket.output_w or 0.0)
    stop_cost, a_joule = a_second * query.overhead_s, 0.0
    price = station.price
    if query.objective is Objective.COST and price is not None:
        stop_cost += price.per_session or 0.0
        a_joule = (price.per_kwh or 0.0) / (JOULE_PER_KWH * from_wall)
        a_second += (price.per_min or 0.0) / SECOND_PER_MINUTE
    if any(station.id == station_id for _, station_id in query.via_stations):
        a_second, a_joule, stop_cost = (VIA_STATION_FACTOR * cost for cost in (a_second, a_joule, stop_cost))
    window_cost = a_second * window_s + a_joule * abs(query.max_soc_frac - query.arrive_soc_frac)
    return Site(station, socket, curve, a_second, a_joule, stop_cost, from_wall, window_cost)


def _window_s(curve: PowerCurve, query: ChargingQuery) -> float:
    """Time of charging from the least to the most charge of a query, of a battery of 1 J [s]."""
    low, high = sorted((query.arrive_soc_frac, query.max_soc_frac))
    return float(seconds(curve, 1.0, low, high))


def least_cost_a_joule(sites: Sequence[Site], capacity_wh: float, window_frac: float) -> float:
    """No stop of any site brings a joule of charge for less, its overhead and session counted; 0 without sites.

    Of one stop that charges x: at best the x of charge in which its power is greatest. (cost of stopping + that) / x is
    least where it equals the cost of the next joule, or at the whole window.
    """
    least = math.inf
    for site in _distinct(sites):
        # between two steps the quotient lies between those at its ends, but for the first, where it falls from inf
        charged_j, cost = charging_costs(site, capacity_wh * JOULE_PER_WH, window_frac)
        least = min(least, float((cost / charged_j).min()))
    return 0.0 if not math.isfinite(least) else least


def charging_costs(
    site: Site, capacity_j: float, window_frac: float
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Energies [J], rising, up to the window's, and what stops that charge them cost at least, float64 (s,) each.

    Each charges those joules that are the fastest; between two energies costs are linear.
    """
    soc, power = site.curve.soc_frac, site.curve.power_w
    # from the greatest power down, each piece in small steps whose power counts as that of their faster end
    at = np.unique(np.concatenate((soc, np.linspace(0.0, 1.0, 401))))
    p = np.interp(at, soc, power)
    step_j = np.diff(at) * capacity_j
    fast = np.maximum(p[:-1], p[1:])
    order = np.argsort(-fast, kind="stable")
    x = np.cumsum(step_j[order])
    cost = site.stop_cost + np.cumsum(step_j[order] * (site.a_second / fast[order] + site.a_joule))
    inside = np.concatenate(([True], x[:-1] < window_frac * capacity_j))
    return x[inside], cost[inside]


def _distinct(sites: Sequence[Site]) -> list[Site]:
    seen: dict[tuple[object, ...], Site] = {}
    for site in sites:
        seen.setdefault((id(site.curve), site.a_second, site.a_joule, site.stop_cost), site)
    return list(seen.values())
