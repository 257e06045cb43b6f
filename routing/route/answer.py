"""A path as a route: energy, charge and time link by link, what is missing on the way, where the energy goes."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from energy.battery import soc_along
from energy.chain.chain import LinkResults, simulate_chain
from energy.chain.uncertainty import chain_distribution
from energy.force.parts import PART_NAMES, EnergyParts
from energy.units import JOULE_PER_WH
from routing.graph.earth import E7
from routing.graph.snap import part_of_line
from routing.places import Point
from routing.queries import drive_settings
from routing.route.hot_links import RouteLinks, hot_stretches
from routing.route.route import DrivenLinks, LegEnd, Remedy, Route, RouteLeg

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from energy.chain.chain import Chain, ChainResult
    from energy.chain.uncertainty import EnergyDistribution
    from routing.graph.road_graph import RoadGraph
    from routing.links.spans import ChainMaker
    from routing.places import LinkSpan, SnappedPoint
    from routing.queries import RouteQuery
    from routing.route.hot_links import HotStretch
    from routing.weights import Weights


class Refill(NamedTuple):
    """A charging stop of a route: the leg that ends there, the charge that it is left with, how long it takes [s]."""

    leg: int
    depart_soc_frac: float
    stop_s: float


def route_of(
    chains: ChainMaker,
    name: str,
    weights: Weights | None,
    query: RouteQuery,
    spans: tuple[LinkSpan, ...],
    leg_first: tuple[int, ...],
    refills: Sequence[Refill] = (),
    cap_mps: NDArray[np.float64] | None = None,
) -> Route:
    """The route along stretches of links, as a query's vehicle drives them.

    leg_first: for each leg, the position of its first stretch, and the number of stretches at the end. refills: its
    charging stops in order; with any, it has no distribution, and a nearly full battery accepts all that is
    recuperated. cap_mps: highest speed at which each stretch is driven, float64 (n,), inf for none.
    """
    graph = chains.graph
    chain = chains.chain(spans, query.stop_settings, query.conditions)
    limit_mps = chain.speed_limit_mps
    if cap_mps is not None:
        chain = replace(chain, speed_limit_mps=np.minimum(limit_mps, cap_mps / query.conditions.speed_factor))
    result = simulate_chain(
        query.vehicle,
        chain,
        conditions=query.conditions,
        link_model=query.link_model,
        stop_rule=query.stop_rule,
        soc_start_frac=None if refills else query.soc_frac,
    )
    capacity_wh = query.vehicle.usable_capacity_wh
    energy_j = result.links.energy_j
    departs = [(leg_first[refill.leg + 1], refill.depart_soc_frac) for refill in refills]
    soc, braked = _charge_along(energy_j, query.soc_frac, capacity_wh, departs)
    spread = _distribution(query, chain) if query.uncertainty and not refills else None
    stretches = _stretches(spans)
    geometry, line_end = _line(graph, stretches)
    low, high = _quantiles_along(spread, len(spans))
    # lists of numbers, which are read one by one several times as fast as arrays
    links = DrivenLinks(
        link_idx=stretches.link_idx.tolist(),
        from_m=stretches.from_m.tolist(),
        to_m=stretches.to_m.tolist(),
        grade_frac=chain.grade_frac.tolist(),
        speed_limit_mps=limit_mps.tolist(),
        road_name=[graph.names[k] for k in graph.name_idx[stretches.link_idx].tolist()],
        results=result.links,
        soc_end_frac=soc.tolist(),
        braked_away_j=braked.tolist(),
        rest=[span.rest for span in spans],
        height_end_m=_heights_m(graph, stretches).tolist(),
        geometry_end_idx=line_end.tolist(),
        soc_end_p10_frac=low,
        soc_end_p90_frac=high,
    )
    legs = _legs(leg_first, result, soc, query.soc_frac, chain.length_m, energy_j + braked, refills)
    climb = chain.grade_frac * chain.length_m
    soc_min = float(min(soc.min(), query.soc_frac, *(refill.depart_soc_frac for refill in refills)))
    # the figures decide, not the search: it rounds differently, and `counted` stops are not those it saw
    feasible = soc_min >= query.reserve_soc_frac - 1e-9
    route = Route(
        name=name,
        weights=weights,
        feasible=feasible,
        distance_m=result.distance_m,
        duration_s=result.duration_s,
        energy_j=result.energy_j,
        parts=result.parts,
        braked_away_j=float(braked.sum()),
        soc_start_frac=query.soc_frac,
        soc_end_frac=legs[-1].soc_end_frac,
        soc_min_frac=soc_min,
        climb_m=float(climb[climb > 0.0].sum()),
        descent_m=float(-climb[climb < 0.0].sum()),
        geometry=geometry,
        links=links,
        legs=legs,
        height_start_m=height_m(graph, spans[0].link_idx, spans[0].from_m),
        hot_links=_hot_links(chain, result, links.road_name),
        uncertainty=spread,
        stop_s=sum(refill.stop_s for refill in refills),
    )
    if feasible:
        return route
    missing = max(query.reserve_soc_frac - soc_min, 0.0)
    return replace(
        route,
        deficit_j=missing * capacity_wh * JOULE_PER_WH,
        furthest=_furthest(graph, route, query.reserve_soc_frac),
        remedy=Remedy(
            _start_charge_needed(energy_j / (capacity_wh * JOULE_PER_WH), query.reserve_soc_frac),
            missing * capacity_wh,
        ),
    )


def _charge_along(
    energy_j: NDArray[np.float64], soc_frac: float, capacity_wh: float, departs: Sequence[tuple[int, float]]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """What soc_along says where the charge is set to another value before some links: position and charge of each."""
    if not departs:
        return soc_along(energy_j, soc_frac, capacity_wh)
    starts = [(0, soc_frac), *departs, (energy_j.size, 0.0)]
    parts = [
        soc_along(energy_j[begin:end], start_frac, capacity_wh) for (begin, start_frac), (end, _) in pairwise(starts)
    ]
    return np.concatenate([soc for soc, _ in parts]), np.concatenate([braked for _, braked in parts])


def _distribution(query: RouteQuery, chain: Chain) -> EnergyDistribution:
    return chain_distribution(
        query.vehicle,
        chain,
        drive_settings(query),
        soc_start_frac=query.soc_frac,
        reserve_soc_frac=query.reserve_soc_frac,
        along=True,
    )


def _quantiles_along(
    spread: EnergyDistribution | None, links: int
) -> tuple[Sequence[float | None], Sequence[float | None]]:
    """P10 and P90 of the charge at each link's end, or as many None."""
    if spread is None or spread.soc_p10_frac is None or spread.soc_p90_frac is None:
        return [None] * links, [None] * links
    return spread.soc_p10_frac.tolist(), spread.soc_p90_frac.tolist()


class _Stretches(NamedTuple):
    """Stretches of links as columns: int64 (n,), float64 (n,) [m], float64 (n,) [m]."""

    link_idx: NDArray[np.int64]
    from_m: NDArray[np.float64]
    to_m: NDArray[np.float64]


def _stretches(spans: tuple[LinkSpan, ...]) -> _Stretches:
    return _Stretches(
        np.array([span.link_idx for span in spans], np.int64),
        np.array([span.from_m for span in spans]),
        np.array([span.to_m for span in spans]),
    )


def _line(graph: RoadGraph, stretches: _Stretches) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """The line over stretches of links, float64 (k, 2) lon, lat, and the row at which each ends, int64 (n,)."""
    idx, from_m, to_m = stretches
    length_m = graph.length_m[idx]
    begin = graph.geometry_first[idx] + 1  # the point at which a stretch begins is the last one of that before
    count = graph.geometry_first[idx + 1] - begin
    end = np.cumsum(count)
    point = np.repeat(begin - (end - count), count) + np.arange(int(end[-1]))
    whole = np.empty((point.size, 2))
    whole[:, 0], whole[:, 1] = graph.geometry_lon_e7[point], graph.geometry_lat_e7[point]
    whole /= E7
    parts, done = [], 0
    in_part = (from_m != 0.0) | (to_m != length_m)
    in_part[0] = True  # it brings the point at which the route begins
    for k in np.flatnonzero(in_part).tolist():
        parts.append(whole[done : end[k] - count[k]])
        part = part_of_line(graph.geometry(int(idx[k])), from_m[k] / length_m[k], to_m[k] / length_m[k])
        parts.append(part if k == 0 else part[1:])
        done = end[k]
        count[k] = len(parts[-1])
    parts.append(whole[done:])
    return np.concatenate(parts), np.cumsum(count) - 1


def height_m(graph: RoadGraph, link_idx: int, at_m: float) -> float:
    """Height of a place on a link [m], its grade being the same everywhere on it."""
    low, high = float(graph.node_height_m[graph.tail[link_idx]]), float(graph.node_height_m[graph.head[link_idx]])
    return low + (high - low) * at_m / float(graph.length_m[link_idx])


def _heights_m(graph: RoadGraph, stretches: _Stretches) -> NDArray[np.float64]:
    """Height at the end of each stretch, float64 (n,) [m]."""
    idx = stretches.link_idx
    low, high = graph.node_height_m[graph.tail[idx]], graph.node_height_m[graph.head[idx]]
    heights: NDArray[np.float64] = low + (high - low) * stretches.to_m / graph.length_m[idx]
    return heights


def _legs(
    first: tuple[int, ...],
    result: ChainResult,
    soc: NDArray[np.float64],
    soc_start_frac: float,
    length_m: NDArray[np.float64],
    battery_j: NDArray[np.float64],
    refills: Sequence[Refill],
) -> tuple[RouteLeg, ...]:
    """What each leg takes, from the links of the whole; soc: float64 (n,) at each link's end."""
    way_m = np.concatenate(([0.0], np.cumsum(length_m)))
    charge = np.concatenate(([soc_start_frac], soc))
    duration_s, energy_j = result.links.duration_s.tolist(), result.links.energy_j.tolist()
    departs = {refill.leg: refill.depart_soc_frac for refill in refills}
    legs: list[RouteLeg] = []
    start_frac = soc_start_frac
    for k, (begin, end) in enumerate(pairwise(first)):
        end_frac = float(charge[end]) if begin < end else start_frac
        goal = k == len(first) - 2
        legs.append(
            RouteLeg(
                from_m=float(way_m[begin]),
                to_m=float(way_m[end]),
                duration_s=sum(duration_s[begin:end], 0.0),
                energy_j=sum(energy_j[begin:end], 0.0),
                soc_end_frac=end_frac,
                first_link=begin if begin < end else None,
                last_link=end - 1 if begin < end else None,
                battery_j=float(battery_j[begin:end].sum()),
                soc_start_frac=start_frac,
                ends_at=LegEnd.GOAL if goal else LegEnd.STOP if k in departs else LegEnd.VIA,
            )
        )
        start_frac = departs.get(k, end_frac)
    return tuple(legs)


def _furthest(graph: RoadGraph, route: Route, reserve_frac: float) -> Point:
    """Where along a route the charge reaches the reserve, taking it as linear within a link."""
    before = route.soc_start_frac
    for link in route.links:
        if link.soc_end_frac < reserve_frac:
            share = (before - reserve_frac) / (before - link.soc_end_frac)
            at_m = link.from_m + share * (link.to_m - link.from_m)
            part = at_m / float(graph.length_m[link.link_idx])
            lon, lat = part_of_line(graph.geometry(link.link_idx), 0.0, max(part, 1e-9))[-1]
            return Point(float(lat), float(lon))
        before = link.soc_end_frac
    lon, lat = route.geometry[-1]
    return Point(float(lat), float(lon))


def _hot_links(chain: Chain, result: ChainResult, names: list[str]) -> tuple[HotStretch, ...]:
    """Where a route's energy goes; standing still counts to the link that it follows."""
    links = result.links
    return hot_stretches(
        RouteLinks(
            length_m=chain.length_m,
            energy_j=links.energy_j,
            grade_frac=chain.grade_frac,
            speed_limit_mps=chain.speed_limit_mps,
            stop_probability_frac=links.stop_probability_frac,
            duration_s=links.duration_s,
            standstill_s=links.standstill_s,
            parts_j=links.parts_j,
            road_names=names,
        )
    )


def _start_charge_needed(used_frac: NDArray[np.float64], reserve_frac: float) -> float:
    """Charge at departure that keeps the reserve on the way; above 1 where a full battery would not do.

    A battery that fills up on the way starts from 1 again there, whatever it had at departure.
    used_frac: float64 (n,) battery energy of each link over the capacity.
    """
    used = np.concatenate(([0.0], np.cumsum(used_frac)))
    longest_fall = float((used - np.minimum.accumulate(used)).max())
    needed = reserve_frac + float(used.max())
    return max(needed, reserve_frac + longest_fall) if reserve_frac + longest_fall > 1.0 else needed


def no_route(graph: RoadGraph, name: str, weights: Weights | None, query: RouteQuery, start: SnappedPoint) -> Route:
    """The route from a place to itself."""
    here = np.array([[start.on_road.lon_deg, start.on_road.lat_deg]] * 2)
    soc = query.soc_frac
    to_via = RouteLeg(0.0, 0.0, 0.0, 0.0, soc, None, None, soc_start_frac=soc, ends_at=LegEnd.VIA)
    return Route(
        name=name,
        weights=weights,
        feasible=True,
        distance_m=0.0,
        duration_s=0.0,
        energy_j=0.0,
        parts=EnergyParts(),
        braked_away_j=0.0,
        soc_start_frac=soc,
        soc_end_frac=soc,
        soc_min_frac=soc,
        climb_m=0.0,
        descent_m=0.0,
        geometry=here,
        links=_no_links(),
        legs=(*(to_via,) * len(query.via), replace(to_via, ends_at=LegEnd.GOAL)),
        height_start_m=height_m(graph, start.link_idx, start.offset_m),
    )


def _no_links() -> DrivenLinks:
    none = np.empty(0)
    results = LinkResults(none, none, none, none, none, np.empty((0, len(PART_NAMES))))
    return DrivenLinks([], [], [], [], [], [], results, [], [], [], [], [], [], [])
