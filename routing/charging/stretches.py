"""The few stations of each stretch of a way that are looked at on a large graph, by one search along the way."""

from __future__ import annotations

import math
from bisect import insort
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final, Protocol, TypeAlias

import numpy as np

from routing.route.via import same_place

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence
    from contextlib import AbstractContextManager

    from numpy.typing import NDArray

    from routing.places import LinkPosition
    from routing.search.found import FoundPath
    from routing.search.search_back import SearchBack
    from routing.weights import Weights

Place: TypeAlias = "tuple[LinkPosition, ...]"  # on each direction of its road

STRETCHES: Final = 12  # of the way between two places
A_STRETCH: Final = 3
ROUNDING_FRAC: Final = 1e-9
LABELS: Final = 48  # after which the searches of bounds end


class Finder(Protocol):
    """What finds and keeps ways, as LegFinder does."""

    def search_back(self, weights: Weights, led_to: Place, there: Place) -> AbstractContextManager[SearchBack]:
        """Searches to a place that share one search back."""

    def learn(self, weights: Weights, paths: Mapping[tuple[Place, Place], FoundPath | None]) -> None:
        """Keep the best ways by some weights between places."""

    def learn_to(self, back: SearchBack, weights: Weights, here: Sequence[Place], there: Place) -> None:
        """Learn the best ways from places to that of a search back."""


@dataclass(frozen=True, slots=True, eq=False)
class AlongWay:
    """Stations along the way between two places, by what ways over them cost at least.

    onward: least cost of the way itself, inf where there is none. way_j: what it takes. least_there: float64 (n,), what
    is paid at least from each station on, −inf for those that were not looked at. few: those of each stretch over which
    ways cost least, the farthest from the end first.
    """

    onward: float
    way_j: float
    least_there: NDArray[np.float64]
    few: tuple[int, ...]


def along_way(
    finder: Finder,
    weights: Weights,
    unit: float,
    ends: tuple[Place, Place],
    spots: Sequence[Place],
    slow: NDArray[np.float64],
    likely: Callable[[float], float],
) -> AlongWay | None:
    """Stations along the way by a weighting, and the best ways to and from the few of each stretch, which are learnt.

    unit: of the objective, that a unit of the weighting's cost is. slow: float64 (n,), what is added to compare
    stations. likely: by how much more than the least cost a way may cost. None where no search back directs searches by
    these weights. The search ends once no other station can be among the few. Raises as LegFinder.pairs does.
    """
    here, there = ends
    goal = len(spots)
    if same_place(here, there):
        return AlongWay(0.0, 0.0, np.full(goal, -math.inf), ())
    if weights.energy == weights.time == 0.0:
        return None
    with finder.search_back(weights, here, there) as back:
        if not back.is_directed:
            return None
        least = unit * float(back.least_costs([here], LABELS)[0])
        most = least + likely(least)
        scores: list[list[float]] = [[] for _ in range(STRETCHES)]
        looked_at: list[int] = []
        met_goal = False

        def is_enough(k: int, cost: float, via: float) -> bool:
            nonlocal met_goal
            if k == goal:
                met_goal = True
            else:
                looked_at.append(k)
                insort(scores[_stretch(unit * (via - cost), least)], unit * via + float(slow[k]))
            third = max(ranked[A_STRETCH - 1] if len(ranked) >= A_STRETCH else math.inf for ranked in scores)
            return met_goal and unit * via > min(third, most)

        least_there = np.full(goal, -math.inf)
        few: list[int] = []

        def chosen(costs: NDArray[np.float64]) -> Sequence[int]:
            bounds = unit * back.least_costs([spots[k] for k in looked_at], LABELS)
            bounds[[same_place(spots[k], there) for k in looked_at]] = 0.0
            least_there[looked_at] = bounds
            through = unit * costs[looked_at] + bounds
            ranked: list[list[tuple[float, int]]] = [[] for _ in range(STRETCHES)]
            for k, ahead, over in zip(looked_at, bounds.tolist(), through.tolist(), strict=True):
                if over <= most:
                    insort(ranked[_stretch(ahead, least)], (over + float(slow[k]), k))
            few.extend(k for stretch in ranked for _, k in stretch[:A_STRETCH])
            return [*few, goal]

        costs, paths = back.on_the_way(here, [*spots, there], is_enough, chosen)
        finder.learn(weights, {(here, there if k == goal else spots[k]): path for k, path in paths.items()})
        few.sort(key=lambda k: -least_there[k])
        finder.learn_to(back, weights, [spots[k] for k in few], there)
    way_j = paths[goal].energy_j if goal in paths else 0.0
    onward = unit * float(costs[goal])
    slack = ROUNDING_FRAC * abs(onward) if math.isfinite(onward) else 0.0
    return AlongWay(onward - slack, way_j, least_there, tuple(few))


def _stretch(ahead: float, whole: float) -> int:
    """The number of the stretch that a place with so much of a whole ahead lies in."""
    return min(max(int(STRETCHES * ahead / max(whole, 1e-9)), 0), STRETCHES - 1)
