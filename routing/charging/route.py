"""A plan with charging stops as one route over the whole journey."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from routing.route.answer import Refill, no_route, route_of
from routing.route.route import LegEnd, RouteLeg

if TYPE_CHECKING:
    from routing.charging.plan import Plan
    from routing.links.spans import ChainMaker
    from routing.places import LinkSpan, SnappedPoint
    from routing.queries import RouteQuery
    from routing.route.route import Route


def route_of_plan(chains: ChainMaker, query: RouteQuery, plan: Plan, start: SnappedPoint) -> Route:
    """The route of a plan, its charge set anew at each stop; legs end at via points, stops and the goal.

    A leg to a via point on which nothing is driven is none of its own.
    """
    spans: list[LinkSpan] = []
    first: list[int] = [0]
    caps_mps: list[float | None] = []
    refills: list[Refill] = []
    for k, leg in enumerate(plan.legs):
        for position, span in enumerate(leg.spans):
            spans.append(span)
            if span.rest and position < len(leg.spans) - 1:
                first.append(len(spans))
                caps_mps.append(leg.speed_cap_mps)
        first.append(len(spans))
        caps_mps.append(leg.speed_cap_mps)
        if k < len(plan.stops):
            stop = plan.stops[k]
            refills.append(Refill(len(first) - 2, stop.depart_soc_frac, stop.depart_s - stop.arrive_s))
    if not spans:
        return _standing(no_route(chains.graph, plan.name, None, query, start), refills)
    spans[-1] = replace(spans[-1], rest=False)  # where nothing is driven from the last stop to the goal
    return route_of(chains, plan.name, None, query, tuple(spans), tuple(first), refills, caps_mps)


def _standing(route: Route, refills: list[Refill]) -> Route:
    """The route from a place to itself with charging stops there."""
    legs: list[RouteLeg] = []
    soc_frac = route.soc_start_frac
    for refill in refills:
        legs.append(replace(route.legs[0], soc_start_frac=soc_frac, soc_end_frac=soc_frac, ends_at=LegEnd.STOP))
        soc_frac = refill.depart_soc_frac
    legs.append(replace(route.legs[-1], soc_start_frac=soc_frac, soc_end_frac=soc_frac))
    stop_s = sum(refill.stop_s for refill in refills)
    return replace(route, legs=tuple(legs), soc_end_frac=soc_frac, stop_s=stop_s)
