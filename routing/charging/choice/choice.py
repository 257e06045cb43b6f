"""Which of very many stations a journey may call at: a few that are likely, and what is paid at least over others.

A journey that stops at a station pays at least, for any cost a joule σ up to the least at which any stop brings one,
Σ (c·t + (w + σ)·e) + σ·(asked for at the goal − charge now − stays) + what the stop costs beyond σ times what it
charges. The sums are bounded by one search from the place before the station and short ones to the place after it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import TYPE_CHECKING, Final

import numpy as np

from energy.units import JOULE_PER_KWH, JOULE_PER_WH, SECOND_PER_HOUR
from routing.charging.choice.sources import Spots, heights_m, least_costs_from
from routing.charging.corridor import COST_UNIT, Dearness, mixed_weights
from routing.charging.sites import charging_costs, least_cost_a_joule
from routing.lower_bound.kernels_lower_bound import lower_levels
from routing.lower_bound.lower_bound import GoalBoundScratch
from routing.route.via import same_place
from routing.search.space import potential_share

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from routing.charging.choice.crowd import Crowd
    from routing.charging.corridor import Charges
    from routing.charging.legs import LegFinder, Place
    from routing.charging.network import Step
    from routing.charging.sites import Worth
    from routing.route.best_path import RouteSearch
    from routing.search.space import SearchSpace
    from routing.weights import Weights

LABELS: Final = 256  # after which the searches of bounds end
FEW_LABELS: Final = 24
WIDER: Final = 4  # times as many stations, where no journey was found over few
AT_ONCE: Final = 512  # stations that are bounded before it is looked at whether enough were
STRETCHES: Final = 12  # of the way between two places


@dataclass(frozen=True, slots=True)
class Few:
    """How many stations are looked at: of each stretch of a way, and at each of its ends."""

    a_stretch: int = 8
    at_ends: int = 12
    more: int = 32  # at once, that a better journey may lead over


USUAL_FEW: Final = Few()


@dataclass(frozen=True, slots=True, eq=False)
class Through:
    """Costs of journeys over stations by one cost a joule, float64 (stages, n).

    excess: (n,), of stops. least: of any journey. to: what is paid at least before a station, straight: after it by the
    straight line, beside: besides both. ahead, likely: what likely is paid after it, and on the whole.
    """

    a_joule: float
    weights: Weights
    excess: NDArray[np.float64]
    least: float
    to: NDArray[np.float64]
    beside: NDArray[np.float64]
    straight: NDArray[np.float64]
    likely: NDArray[np.float64]
    ahead: NDArray[np.float64]


class StationChoice:
    """The stations of one query that are looked at. places: start, via points, goal; stays: seconds and charge [J]."""

    def __init__(
        self,
        search: RouteSearch,
        finders: Sequence[LegFinder],
        worth: Worth,
        crowd: Crowd,
        places: Sequence[Place],
        stays: Sequence[tuple[float, float]],
        charges: Charges,
        max_soc_frac: float,
        few: Few = USUAL_FEW,
    ) -> None:
        self._search, self._finders, self._worth, self._crowd, self._few = search, finders, worth, crowd, few
        self._graph = search.graph
        self._places, self._stays, self._charges, self._max_soc_frac = places, stays, charges, max_soc_frac
        self._a_joule = least_cost_a_joule(crowd.kinds, charges.capacity_j / JOULE_PER_WH, max_soc_frac)
        likely_j = self._likely_j()
        self._through = self._paid(min(self._a_joule, self._marginal(likely_j)) if likely_j > 0.0 else 0.0)
        self._searches = 0  # short ones that are left
        self.chosen = self._first()
        self.stop_cost = self._through.least  # no journey that stops costs less
        self.beyond_cost = self._through.least  # no journey over stations that are not chosen costs less

    def add(self, stations: Sequence[int]) -> None:
        """Choose some stations as well."""
        self.chosen[list(stations)] = True

    def widen(self) -> bool:
        """Choose some times as many stations, in the end all; whether any was not chosen."""
        before, few = int(self.chosen.sum()), self._few
        self._few = replace(few, a_stretch=WIDER * max(few.a_stretch, 1), at_ends=WIDER * max(few.at_ends, 1))
        self.chosen |= self._first()
        if int(self.chosen.sum()) == before:
            self.chosen |= self._crowd.kept
        return int(self.chosen.sum()) > before

    def grow(self, best: list[Step], searches: int) -> bool:
        """Choose more stations over which a journey may cost less than one that is known; whether there were any.

        searches: short ones, after which bounds stay as they are.
        """
        cost, self._searches = best[-1].cost, searches
        bound = self._bounds(self._through, cost)
        self.stop_cost = float(bound.min(initial=math.inf))
        bound[self.chosen] = math.inf
        better = np.flatnonzero(bound < cost)
        order = better[np.argsort(bound[better], kind="stable")]
        self.chosen[order[: self._few.more]] = True
        bound[self.chosen] = math.inf
        self.beyond_cost = float(bound.min(initial=math.inf))
        return order.size > 0

    def dearness(self, stations: Sequence[int]) -> Dearness:
        """Of some stations."""
        return Dearness(self._through.a_joule, self._through.excess[list(stations)])

    def _likely_j(self) -> float:
        """What a stop likely charges: as much as others, along the way that costs least."""
        ways = [
            way
            for here, there in pairwise(self._places)
            for pair in self._finders[0].pairs(here, [there], (mixed_weights(self._worth, self._a_joule),))
            for way in pair.ways[:1]
        ]
        charges = self._charges
        lacking_j = sum(way.energy_j for way in ways) + charges.goal_j - charges.start_j
        lacking_j -= sum(gain_j for _, gain_j in self._stays)
        most_j = self._max_soc_frac * charges.capacity_j
        return max(lacking_j, 0.0) / max(math.ceil(lacking_j / most_j), 1)

    def last_of(self, reached: NDArray[np.bool_]) -> int | None:
        """The one of some stations that is nearest to the goal, it seems; None where there are none."""
        ahead = np.where(reached, self._through.ahead[-1], math.inf)
        return int(np.argmin(ahead)) if reached.any() else None

    def _marginal(self, charged_j: float) -> float:
        """What the next joule costs at the best station once so many are charged."""
        fastest = math.inf
        for site in self._crowd.kinds:
            at_j, cost = charging_costs(site, self._charges.capacity_j, 1.0)
            k = min(int(np.searchsorted(at_j, charged_j)), at_j.size - 1)
            before = (at_j[k - 1], cost[k - 1]) if k > 0 else (0.0, site.stop_cost)
            fastest = min(fastest, float((cost[k] - before[1]) / (at_j[k] - before[0])))
        return fastest

    def _first(self) -> NDArray[np.bool_]:
        """Those of each stretch over which journeys likely cost least, and those next to its ends."""
        chosen = np.zeros(len(self._crowd.sites), np.bool_)
        slow = self._crowd.slow_costs(self._charges.capacity_j)
        kept = np.flatnonzero(self._crowd.kept)
        for to, ahead, likely in zip(self._through.to, self._through.ahead, self._through.likely, strict=True):
            score = (likely + slow)[kept]
            whole = float(np.min(to[kept] + ahead[kept], initial=math.inf))
            if not math.isfinite(whole):
                continue
            part = np.clip(STRETCHES * to[kept] / max(whole, 1e-9), 0, STRETCHES - 1)
            stretch = np.where(np.isfinite(part), part, 0).astype(np.int64)
            for number in range(STRETCHES):
                there = np.flatnonzero(stretch == number)
                chosen[kept[there[np.argsort(score[there], kind="stable")[: self._few.a_stretch]]]] = True
            for near in (to, ahead):
                chosen[kept[np.argsort(near[kept], kind="stable")[: self._few.at_ends]]] = True
        for place in self._places:
            links = [position.link_idx for position in place]
            for k in np.flatnonzero(self._crowd.spots.any_of(np.isin(self._crowd.spots.link, links))).tolist():
                if self._crowd.kept[k] and self._crowd.sites[k].station.position == place:
                    chosen[k] = True
        return chosen

    def _paid(self, a_joule: float) -> Through:
        """What journeys over stations cost by a cost a joule."""
        charges, stages, count = self._charges, len(self._places) - 1, len(self._crowd.sites)
        weights = mixed_weights(self._worth, a_joule)
        to, straight, ahead = (np.full((stages, count), math.inf) for _ in range(3))
        onward = np.full(stages, math.inf)
        for stage in range(stages):
            here, there = self._places[stage], self._places[stage + 1]
            both = self._crowd.spots.joined(Spots.at([there]))
            for finder in self._finders:
                found = COST_UNIT * least_costs_from(self._search, finder.space, weights, here, both)
                to[stage] = np.minimum(to[stage], found[:-1])
                onward[stage] = min(onward[stage], 0.0 if same_place(here, there) else float(found[-1]))
                straight[stage] = np.minimum(straight[stage], self._straight(finder.space, weights, there))
                ahead[stage] = np.minimum(ahead[stage], self._likely_ahead(finder.space, weights, there))
        stays = [self._worth.a_second * seconds - a_joule * gain_j for seconds, gain_j in self._stays]
        fixed = a_joule * (charges.goal_j - charges.start_j) + sum(stays)
        excess = np.maximum(self._crowd.excess(a_joule, charges.capacity_j, self._max_soc_frac), 0.0)
        beside = fixed + (onward.sum() - onward)[:, None] + excess[None, :]
        least = fixed + float(onward.sum())
        return Through(a_joule, weights, excess, least, to, beside, straight, to + ahead + beside, ahead)

    def _bounds(self, paid: Through, cost: float) -> NDArray[np.float64]:
        """No journey over a station costs less, float64 (n,); as close as searches tell where that may be below cost.

        Those that are likely are looked at first, all of them by very short searches before any by longer ones.
        """
        ahead = paid.straight.copy()
        for stage, (here, there) in enumerate(pairwise(self._places)):
            for labels in (FEW_LABELS, LABELS):
                through = paid.to[stage] + ahead[stage] + paid.beside[stage]
                wanted = np.flatnonzero((through < cost) & self._crowd.kept)
                wanted = wanted[np.argsort(paid.likely[stage][wanted], kind="stable")]
                least = self._short_searches(paid.weights, labels, (here, there), wanted)
                ahead[stage, wanted] = np.maximum(ahead[stage, wanted], least)
        bound: NDArray[np.float64] = (paid.to + ahead + paid.beside).min(axis=0)
        bound[~self._crowd.kept] = math.inf
        return bound

    def _short_searches(
        self, weights: Weights, labels: int, ends: tuple[Place, Place], wanted: NDArray[np.int64]
    ) -> NDArray[np.float64]:
        """No way from stations to the second end costs less, float64 (n,); −inf for those that are searched no more."""
        here, there = ends
        spots = [self._crowd.sites[k].station.position for k in wanted.tolist()]
        least = np.full(wanted.size, math.inf)
        for finder in self._finders if spots else ():
            found = np.full(wanted.size, -math.inf)
            with finder.search_back(weights, here, there) as back:
                for begin in range(0, wanted.size, AT_ONCE):
                    if self._searches <= 0:
                        break
                    self._searches -= min(AT_ONCE, wanted.size - begin)
                    found[begin : begin + AT_ONCE] = back.least_costs(spots[begin : begin + AT_ONCE], labels)
            least = np.minimum(least, COST_UNIT * found)
        least[[same_place(spot, there) for spot in spots]] = 0.0
        return least

    def _straight(self, space: SearchSpace, weights: Weights, there: Place) -> NDArray[np.float64]:
        """No way from stations to a place costs less, by the straight line and height, float64 (n,)."""
        costs, graph, link = space.lower_bound.costs(), self._graph, self._crowd.link
        at_m = costs.place_m[graph.tail[link]] - costs.place_m[graph.tail[there[0].link_idx]]
        aside_m = graph.length_m[link] + graph.length_m[there[0].link_idx]
        away_m = np.maximum(np.linalg.norm(at_m, axis=1) - aside_m, 0.0) * costs.line_to_road
        road_j, road_s, _ = costs.least_a_metre.tolist()
        a_metre = weights.energy / JOULE_PER_KWH * road_j + weights.time / SECOND_PER_HOUR * road_s
        found: NDArray[np.float64] = COST_UNIT * (a_metre * away_m + self._lift(space, weights, there))
        return found

    def _lift(self, space: SearchSpace, weights: Weights, there: Place) -> NDArray[np.float64]:
        """What height stores on the way from stations to a place by weights, at least, float64 (n,)."""
        share = weights.energy / JOULE_PER_KWH * potential_share(space.physics) * space.physics.weight_n
        at_m = self._crowd.spots.least_of(-heights_m(space, self._crowd.spots))
        return share * (float(heights_m(space, Spots.at([there])).min()) + at_m)

    def _likely_ahead(self, space: SearchSpace, weights: Weights, there: Place) -> NDArray[np.float64]:
        """What ways from stations to a place likely cost: each link at the least that it may, float64 (n,)."""
        a_joule, a_second = max(weights.energy / JOULE_PER_KWH, 1e-12), weights.time / SECOND_PER_HOUR
        graph = self._graph
        level = np.full(graph.node_count, math.inf)
        level[graph.tail[[position.link_idx for position in there]]] = 0.0
        scratch = GoalBoundScratch(graph.node_count + graph.link_count)
        lower_levels(space.lower_bound.towards(scratch, 0, ()), a_second / a_joule, level)
        spots = self._crowd.spots
        return COST_UNIT * (a_joule * spots.least_of(level[graph.head[spots.link]]) + self._lift(space, weights, there))
