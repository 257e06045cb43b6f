"""What journeys cost at least that may halt at stations where nothing is charged: a relaxation over the stations."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final, TypeAlias

import numpy as np

from routing.charging.ways import joined
from routing.time_budget import time_budget

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from numpy.typing import NDArray

    from routing.charging.legs import Place
    from routing.charging.network import Arc
    from routing.charging.ways import Way


ROUNDING_FRAC: Final = 1e-12
# no way from one place to each of others costs less, float64 (n,); inf where there is none
LeastCosts: TypeAlias = "Callable[[Place, Sequence[Place]], NDArray[np.float64]]"


@dataclass(frozen=True, slots=True)
class Course:
    """Where a journey leads: start, via points, goal, and what it costs in any case.

    start_cost: of the charge that there is, below 0. goal_cost: of what is asked for at the goal. stay_costs: of what
    is between coming to each via point and leaving it.
    """

    places: Sequence[Place]
    start_cost: float
    goal_cost: float
    stay_costs: Sequence[float]


@dataclass(frozen=True, slots=True, eq=False)
class PlaceBounds:
    """At least, by place of the station graph, float64 (n,): before it, after it, for a halt there, and for a stop
    beyond what its charge counts as; a_joule: what a joule of charge counts as.
    """

    reached: NDArray[np.float64]
    ahead: NDArray[np.float64]
    halt: NDArray[np.float64]
    stop: NDArray[np.float64]
    a_joule: float


@dataclass(frozen=True, slots=True)
class HaltBounds:
    """No journey costs less, float64 (stages, sites): from a station on, and over it as a whole; least_cost: any.

    reached: what is before a station, of the same shape.
    """

    ahead: NDArray[np.float64]
    through: NDArray[np.float64]
    least_cost: float
    reached: NDArray[np.float64]


def halt_bounds(
    course: Course,
    sites: Sequence[Place],
    least: LeastCosts,
    straight: LeastCosts,
    cost: float,
    is_over: Callable[[], bool],
) -> HaltBounds | None:
    """Bounds on journeys of any number of halts, sharp for those that cost no more than a cost; None where over before.

    least: by the best way; straight: by the straight line, which holds for journeys of several ways too. is_over: asked
    before each search. Halts count as nothing: what is charged at one costs no less with it than least counts it at.
    Complexity: one call of least a station over which such a journey may lead.
    """
    stages, count = len(course.places) - 1, len(sites)
    stays = [*course.stay_costs, 0.0]
    line = [straight(site, [*sites, *course.places[1:]]) for site in sites]
    between, to_next = np.empty((count, count)), np.empty((count, stages))
    for site, row in enumerate(line):
        between[site], to_next[site] = row[:count], row[count:]
    crow = to_next.T.copy()
    beyond = [course.goal_cost]  # of each stage, from its end on, by the straight line
    for stage in range(stages - 1, 0, -1):
        onward = float(straight(course.places[stage], [course.places[stage + 1]])[0])
        beyond.insert(0, stays[stage - 1] + onward + beyond[0])
    # forwards: a station is searched from if a journey over it may cost so little by what it is reached with
    searched = np.zeros(count, np.bool_)
    first = [least(place, [*sites, course.places[k + 1]]) for k, place in enumerate(course.places[:-1])]
    reached, so_far = np.empty((stages, count)), course.start_cost
    for stage in range(stages):
        while True:
            reached[stage] = _relaxed(first[stage][:-1] + so_far, between)
            through = reached[stage] + crow[stage] + beyond[stage]
            wanted = np.flatnonzero(~searched & (through <= cost))
            if wanted.size == 0:
                break
            if is_over():
                return None
            time_budget().check()
            site = int(wanted[np.argmin(through[wanted])])
            over = reached[stage][site] + between[site] + crow[stage] + beyond[stage]
            onto = np.flatnonzero((over <= cost) | (stages > 1))  # of other stages it is not known yet
            row = least(sites[site], [*(sites[k] for k in onto.tolist()), *course.places[1:]])
            between[site, onto], to_next[site], searched[site] = row[: onto.size], row[onto.size :], True
        over = reached[stage] + to_next[:, stage]
        so_far = min(so_far + float(first[stage][-1]), float(over.min(initial=math.inf))) + stays[stage]
    ahead, onward = np.empty((stages, count)), course.goal_cost
    for stage in range(stages - 1, -1, -1):
        onward += stays[stage]
        ahead[stage] = _relaxed(to_next[:, stage] + onward, between.T)
        onward = min(float(first[stage][-1]) + onward, float((first[stage][:-1] + ahead[stage]).min(initial=math.inf)))
    return HaltBounds(ahead, reached + ahead, course.start_cost + onward, reached)


def charged_halts_cost(
    places: Sequence[int],
    arcs_of: Callable[[int], Sequence[Arc]],
    margin_j: Callable[[Arc], float],
    bounds: PlaceBounds,
    halt_way: Way,
    least_j: Callable[[int, Way], float],
    most_j: float,
    cost: float,
) -> float:
    """No journey costs less, of those below a cost, that halts after a charge where a way past serves worse.

    Of such journeys the charge ahead of the halt may be none that a search tries. places: stations, where such a halt
    may follow; arcs_of: all that are known or bounds. halt_way: a halt as a profile of the battery. least_j: charge
    that a way to a place begins with at least, of most_j after a stop [J].
    """
    found = math.inf
    for place in places:
        stopped = bounds.reached[place] + bounds.stop[place]
        if stopped + bounds.ahead[place] >= min(found, cost):
            continue
        past = arcs_of(place)
        for arc in past:
            halted = stopped + arc.cost + bounds.a_joule * arc.way.energy_j + bounds.halt[arc.to]
            if not halted + bounds.ahead[arc.to] < min(found, cost) or math.isinf(bounds.halt[arc.to]):
                continue
            for onward in arcs_of(arc.to):
                over = halted + onward.cost + bounds.a_joule * onward.way.energy_j + bounds.ahead[onward.to]
                if over >= min(found, cost):
                    continue
                way = joined(joined(arc.way, halt_way), onward.way)
                kept_j = margin_j(arc) + margin_j(onward)
                if least_j(onward.to, way) > most_j:
                    continue
                if onward.to == place and way.energy_j >= 0.0:
                    continue  # as well not left
                paid = arc.cost + bounds.halt[arc.to] + onward.cost
                if not any(
                    other.to == onward.to
                    and other.cost <= paid
                    and margin_j(other) <= kept_j
                    and _serves(other.way, way)
                    for other in past
                ):
                    found = float(over)
    return found


def _serves(way: Way, other: Way) -> bool:
    """Whether a known way takes no more of the battery than another one, whatever the charge."""
    return (
        not way.is_bound
        and way.energy_j <= other.energy_j
        and way.need_j <= other.need_j
        and way.spill_j <= other.spill_j
        and way.longest_j <= other.longest_j
    )


def _relaxed(cost: NDArray[np.float64], between: NDArray[np.float64]) -> NDArray[np.float64]:
    """The least costs when each station may be come to over others, float64 (n,); between[i, k]: from i to k."""
    for _ in range(cost.size + 1):
        less: NDArray[np.float64] = np.minimum(cost, (cost[:, None] + between).min(axis=0, initial=math.inf))
        if not (less + ROUNDING_FRAC * np.abs(less) < cost).any():
            return less
        cost = less
    return np.full(cost.size, -math.inf)  # a way round that regains more than it takes, which no road has
