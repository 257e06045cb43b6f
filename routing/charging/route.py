"""A plan with charging stops as one route over the whole journey."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING, Final

import numpy as np

from routing.route.answer import Refill, no_route, route_of
from routing.route.route import LegEnd, RouteLeg

if TYPE_CHECKING:
    from collections.abc import Sequence

    from routing.charging.plan import Halt, Plan
    from routing.links.spans import ChainMaker
    from routing.places import LinkPosition, LinkSpan, SnappedPoint
    from routing.queries import RouteQuery
    from routing.route.route import Route


PLACE_M: Final = 1e-6  # within which a stretch ends at a via point


def route_of_plan(
    chains: ChainMaker,
    query: RouteQuery,
    plan: Plan,
    start: SnappedPoint,
    vias: Sequence[tuple[LinkPosition, ...]] = (),
) -> Route:
    """The route of a plan, its charge set anew at each stop; legs end at via points, stops and the goal.

    vias: the via points of the query, or the stations that stand for them, on both directions of their roads. A leg to
    one of them on which nothing is driven is none of its own.
    """
    ahead = list(vias)
    spans: list[LinkSpan] = []
    cap_mps: list[float] = []
    first: list[int] = [0]
    refills: list[Refill] = []
    leg_caps_mps: list[float | None] = []
    for k, leg in enumerate(plan.legs):
        for position, span in enumerate(leg.spans):
            spans.append(span)
            while ahead and not _ends_at(span, ahead[0]) and span.rest and any(_ends_at(span, via) for via in ahead):
                del ahead[0]  # nothing was driven to it
            if not (span.rest and ahead and _ends_at(span, ahead[0])):
                continue  # or a station that is passed
            del ahead[0]
            if position < len(leg.spans) - 1:
                first.append(len(spans))
                leg_caps_mps.append(leg.speed_cap_mps)
        for count, cap in leg.caps or ((len(leg.spans), leg.speed_cap_mps),):
            cap_mps += [math.inf if cap is None else cap] * count
        first.append(len(spans))
        leg_caps_mps.append(leg.speed_cap_mps)
        if k < len(plan.stops):
            stop = plan.stops[k]
            refills.append(Refill(len(first) - 2, stop.depart_soc_frac, stop.depart_s - stop.arrive_s))
    if not spans:
        return _standing(no_route(chains.graph, plan.name, None, query, start), refills)
    spans[-1] = replace(spans[-1], rest=False)  # where nothing is driven from the last stop to the goal
    capped = None if all(map(math.isinf, cap_mps)) else np.array(cap_mps)
    route = route_of(chains, plan.name, None, query, tuple(spans), tuple(first), refills, capped)
    legs = zip(route.legs, leg_caps_mps, strict=True)
    halts_s = sum(halt.overhead_s for leg in plan.legs for halt in leg.halts)
    return replace(
        route, stop_s=route.stop_s + halts_s, legs=tuple(replace(leg, speed_cap_mps=cap) for leg, cap in legs)
    )


def halt_leg(halt: Halt, route: Route) -> int:
    """Position of the leg of a plan's route on which a halt lies; at a leg's end, of the first that ends there."""
    return next((k for k, leg in enumerate(route.legs) if halt.along_m <= leg.to_m + PLACE_M), len(route.legs) - 1)


def _ends_at(span: LinkSpan, place: tuple[LinkPosition, ...]) -> bool:
    return any(at.link_idx == span.link_idx and abs(at.offset_m - span.to_m) <= PLACE_M for at in place)


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
